"""What the debugger of a session costs: opening, a step in time, a turned weight, and the whole session run again.

    python benchmarks/debug.py                      a session of ten minutes over the made clips, which takes a minute to record
    python benchmarks/debug.py SESSION [FOLDER]     one of your own, saved with the databases and poses of its project
    python benchmarks/debug.py --json FILE          the same figures for programs

Figures are CPU time, which other work on the machine changes little, on a screen of 160 x 48 that nobody sees. Opening is from the
file to the first screen, once the modules are imported; a step and a turned weight are one key with all that it paints, the median
of many and the slowest. The searches of the whole session are asked again beside the screen, then it is run again in closed loop.
"""

from __future__ import annotations

import argparse
import asyncio
import contextlib
import json
import random
import statistics
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

if __package__ in (None, ""):
    sys.path[0] = str(Path(__file__).parent.parent)  # not this folder: its coverage.py is no package of that name

from benchmarks import timing
from benchmarks.sections import print_aligned

SCREEN = (160, 48)
SECONDS = 600
N_KEYS = 60

Figures = dict[str, float]


def main() -> None:
    """Measure, print the figures, and write them as JSON when that is asked for."""
    parser = argparse.ArgumentParser(description="Measure the debugger.")
    parser.add_argument("session", nargs="?", metavar="SESSION", help="a recorded session (default: one of the made clips)")
    parser.add_argument("folder", nargs="?", metavar="FOLDER", help="its project (default: as recorded)")
    parser.add_argument("--json", type=Path, metavar="FILE", help="also write the figures to a file")
    options = parser.parse_args()
    report: dict[str, Any] = {"format": 1, "machine": timing.machine(), "versions": timing.versions()}
    print(" · ".join(f"{key} {value}" for key, value in (report["machine"] | report["versions"]).items()))
    with tempfile.TemporaryDirectory() as folder:
        session = options.session or recorded(Path(folder))
        report["figures"] = measured(session, options.folder)
    print()
    print_aligned([("", "CPU ms"), *((name, f"{value:,.1f}") for name, value in report["figures"].items())])
    if options.json:
        options.json.write_text(json.dumps(report, indent=1))


def recorded(folder: Path) -> str:
    """A session of ten minutes: a stick that changes its mind every few seconds, over the clips of the demo."""
    from contextdb.cli import main as contextdb

    game, rng = folder / "game", random.Random(1)
    lines, at_s = ["time_s,speed_mps,turn_dps,gait,style"], 0.0
    while at_s < SECONDS:
        gait, speed = rng.choice([("Idle", 0.0), ("Walk", 1.3), ("Walk", 1.0), ("Run", 3.0)])
        lines.append(f"{at_s:g},{speed},{rng.choice([0, 0, 45, -45])},{gait},{rng.choice(['normal', 'tired'])}")
        at_s += rng.choice([1.5, 2.0, 3.0])
    lines.append(f"{SECONDS},0,0,Idle,normal")
    (folder / "stick.csv").write_text("\n".join(lines) + "\n")
    session = str(folder / "session.parquet")
    with contextlib.redirect_stdout(sys.stderr):
        contextdb(["demo", "--keep", str(game)])
        contextdb(["motion", "build", str(game), "--poses"])
        contextdb(["motion", "run", str(game), "player", str(folder / "stick.csv"), "--out", session])
    return session


def measured(session: str, folder: str | None) -> Figures:
    """The figures of a session, in milliseconds."""
    from contextdb.commands.motion_replay_command import databases_of, project_of
    from contextdb.motion.trace.session import Trace
    from tui.debug.app import DebugApp
    from tui.debug.recording import Recording

    figures: Figures = {}

    async def run() -> None:
        start = time.process_time()
        trace = Trace.load(session)
        databases, why = databases_of(trace, folder, session)
        recording = Recording(session, trace, project_of(trace, folder, session)[0], databases, why or trace.use(databases))
        app = DebugApp(recording, measures=False)
        app.animation_level = "none"
        async with app.run_test(size=SCREEN):
            await _painted(app)
            figures["open, updates"] = len(recording)
            figures["open"] = 1e3 * (time.process_time() - start)
            await _pressed(app, "right")
            for name, keys in STEPS.items():
                times = [await _pressed(app, keys[i % len(keys)]) for i in range(N_KEYS)]
                figures[name], figures[f"{name}, slowest"] = statistics.median(times), max(times)
        _whole(recording, figures)

    asyncio.run(run())
    return figures


STEPS = {
    "step of an update": ("right",),
    "step to a jump": ("right_square_bracket",),
    "next asset": ("down",),
    "turned weight": ("plus", "minus"),
}


def _whole(recording: Any, figures: Figures) -> None:
    from tui.debug.recording import Turned
    from tui.debug.whole import repeated_searches, run_both

    name, weight = next(iter(recording.weights().items()))
    turned = Turned({name: 2.0 * weight + 1.0})
    start = time.process_time()
    recording.decisions(lambda: None)
    figures["read all decisions, once"] = 1e3 * (time.process_time() - start)
    start = time.process_time()
    repeated_searches(recording, turned, lambda: None)
    figures["ask all searches again"] = 1e3 * (time.process_time() - start)
    start = time.process_time()
    run_both(recording, turned, lambda: None)
    figures["run again, without and with"] = 1e3 * (time.process_time() - start)


async def _pressed(app: Any, key: str) -> float:
    """The time of a key with all that it paints, in milliseconds."""
    start = time.process_time()
    app.simulate_key(key)
    await _painted(app)
    return 1e3 * (time.process_time() - start)


async def _painted(app: Any) -> None:
    """Wait until the loop has nothing left to run, and paint."""
    loop: Any = asyncio.get_running_loop()
    for _ in range(3):
        await asyncio.sleep(0)
        while loop._ready:
            await asyncio.sleep(0)
        app.screen._on_timer_update()


if __name__ == "__main__":
    main()
