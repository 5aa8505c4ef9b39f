"""What a live link costs the game's thread: nobody listens, somebody does, and one that listens badly.

    python benchmarks/live_link.py                1,000 x 30 and 10,000 x 40
    python benchmarks/live_link.py --quick        fewer calls
    python benchmarks/live_link.py --json FILE    the same figures for programs

Listeners are in another process. All states take turns in each round, so that what the machine does meanwhile falls on all of them
alike; "no link" is an equal table, never watched. "more" is what a query takes longer than with "off": the median over the rounds.
A frame is 66 queries, each followed by the pick, and a rest; what is told is the time that its work takes.
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
import time
from pathlib import Path
from typing import IO, Any

if __package__ in (None, ""):
    sys.path[0] = str(Path(__file__).parent.parent)  # not this folder: its coverage.py is no package of that name

import numpy as np

import contextdb as cdb
from benchmarks import generator, ours, timing
from benchmarks.sections import print_aligned
from contextdb.telemetry.link import doors

STATES = ("no link", "off", "on", "stalled", "every", "flood")
QUERIES = 66
REST_S = 0.004
LATE_MS = 2.0
"""A frame is late that takes so much longer than the median."""
LISTENER = """
import socket, sys, threading
from contextdb.telemetry.link.doors import connected
from pathlib import Path
held = []
def read(one):
    try:
        while one.recv(1 << 16): pass
    except OSError: pass
def flood(path):
    while held:
        try:
            one = connected(path); one.sendall(b"x" * 9000); one.close()
        except OSError: pass
for line in sys.stdin:
    state, path = line.rstrip().split(" ", 1)
    path = Path(path)
    for one in held: one.close()
    held.clear()
    if state in ("on", "every", "stalled", "flood"):
        one = connected(path); one.settimeout(None); held.append(one)
        if state in ("every", "flood"): one.sendall(b'{"format":1,"every":true}\\n')
        if state != "stalled": threading.Thread(target=read, args=(one,), daemon=True).start()
        if state == "flood": threading.Thread(target=flood, args=(path,), daemon=True).start()
    print(state, flush=True)
"""


class Other:
    """The process that listens, or does not."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self.process = subprocess.Popen([sys.executable, "-c", LISTENER], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)

    def be(self, state: str, link: cdb.Link) -> None:
        """Listen so from now on."""
        given, said = self.process.stdin, self.process.stdout
        assert given is not None
        assert said is not None
        _say(given, f"{state} {self.path}")
        said.readline()
        while link.is_heard != (state not in ("no link", "off")):
            time.sleep(0.005)

    def end(self) -> None:
        """End the process."""
        self.process.communicate()


def _say(file: IO[str], text: str) -> None:
    file.write(text + "\n")
    file.flush()


def frames(compiled: cdb.CompiledTable, contexts: list[dict[str, Any]], n: int) -> timing.Nanoseconds:
    """What the work of each frame took."""
    taken = []
    for frame in range(n):
        start = time.perf_counter_ns()
        for at in range(QUERIES):
            compiled.pick(compiled.query(contexts[(frame * QUERIES + at) % len(contexts)]))
        taken.append(time.perf_counter_ns() - start)
        time.sleep(REST_S)
    return np.array(taken, np.int64)


def measure(shape: generator.Shape, is_quick: bool) -> dict[str, Any]:
    """Queries and frames in every state."""
    table = generator.make_table(shape)
    build = ours.build(table)
    watched, plain = build.compile(), build.compile()
    contexts = generator.make_contexts(table, 400).dicts()
    rounds, n_frames = (3, 40) if is_quick else (10, 120)
    queries: dict[str, list[timing.Nanoseconds]] = {state: [] for state in STATES}
    work: dict[str, list[timing.Nanoseconds]] = {state: [] for state in STATES}
    with cdb.link("benchmark") as link:
        link.watch(watched, "player")
        other = Other(dict(doors.doors())[link.name])
        for _ in range(rounds):
            for state in STATES:
                other.be(state, link)
                asked = plain if state == "no link" else watched
                timing.timed(asked.query, contexts[:50])
                queries[state].append(timing.timed(asked.query, contexts))
                work[state].append(frames(asked, contexts, n_frames))
        other.end()
    return {state: _summary(queries[state], queries["off"], work[state]) for state in STATES}


def _summary(queries: list[timing.Nanoseconds], off: list[timing.Nanoseconds], work: list[timing.Nanoseconds]) -> dict[str, float]:
    query, frame = timing.Summary.of(queries), np.concatenate(work) / 1e6
    is_late = frame > np.median(frame) + LATE_MS
    more = [float(np.median(one) - np.median(other)) / 1e3 for one, other in zip(queries, off, strict=True)]
    return {
        "query_us": query.median_us,
        "more_us": float(np.median(more)),
        "low_us": query.low_us,
        "high_us": query.high_us,
        "frame_ms": float(np.median(frame)),
        "frame_p99_ms": float(np.percentile(frame, 99)),
        "late_percent": 100.0 * float(is_late.mean()),
        "frame_max_ms": float(frame.max()),
        "frames": len(frame),
    }


def main() -> None:
    """Measure both sizes, and print them."""
    parser = argparse.ArgumentParser(description="Measure what a live link costs the game.")
    parser.add_argument("--quick", action="store_true", help="fewer calls, for a rough look")
    parser.add_argument("--json", type=Path, metavar="FILE", help="also write the figures to a file")
    options = parser.parse_args()
    report: dict[str, Any] = {"format": 1, "machine": timing.machine(), "versions": timing.versions()}
    print(" · ".join(f"{key} {value}" for key, value in report["machine"].items()))
    for shape in generator.SHAPES:
        report[shape.name] = found = measure(shape, options.quick)
        print(f"\n{shape.name}: a query in microseconds; a frame of {QUERIES} queries and picks in milliseconds\n")
        lines: list[tuple[str, ...]] = [("state", "query", "more", "lowest", "highest", "frame", "p99", "late %", "longest")]
        for state, one in found.items():
            numbers = [one["query_us"], one["more_us"], one["low_us"], one["high_us"]]
            numbers += [one["frame_ms"], one["frame_p99_ms"], one["late_percent"], one["frame_max_ms"]]
            lines.append((state, *(f"{number:.2f}" for number in numbers)))
        print_aligned(lines)
    if options.json:
        options.json.write_text(json.dumps(report, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
