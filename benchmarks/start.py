"""How large an installation is, and how long each command takes to start.

    python benchmarks/start.py                 the sizes, then every command in seven rounds
    python benchmarks/start.py --quick         three rounds
    python benchmarks/start.py --json FILE     the same figures for programs

The size is that of the files of contextdb and of every package that it asks for, as pip lists them, without what Python compiles.
Each command runs on the sample tables in a fresh process, from start to end, once unmeasured; the editor runs without a screen
and leaves after the first paint. Commands take turns. A time is the median of the rounds; CPU is what the process computed, less
than that where others use the machine, and 0 where the system does not count it; × is how many times the time of `python -c ""`.
"""

from __future__ import annotations

import argparse
import json
import os
import re
import shutil
import statistics
import subprocess
import sys
import tempfile
import time
import tomllib
from collections.abc import Iterator, Mapping, Sequence
from importlib.metadata import PackageNotFoundError, distribution
from pathlib import Path
from typing import Any

if __package__ in (None, ""):
    sys.path[0] = str(Path(__file__).parent.parent)  # not this folder: its coverage.py is no package of that name

from benchmarks import timing
from benchmarks.sections import print_aligned

ROOT = Path(__file__).parent.parent
FACTS = {"gait": "Walk", "speed": "1.3", "direction": "65", "style": "normal"}
_SAID = [f"{name}={value}" for name, value in FACTS.items()]
EDITOR = """
import tui.run
async def leave(pilot):
    await pilot.pause()
    pilot.app.exit()
run = tui.run.EditorApp.run
tui.run.EditorApp.run = lambda app: run(app, headless=True, auto_pilot=leave)
tui.run.edit("tables")
"""
_MADE = (
    ("export", "locomotion", "moves.xlsx"),
    ("compile", "tables", "-o", "compiled"),
    ("-c", 'from contextdb import motion; motion.write_made_clips("tables/clips")'),
    ("motion", "build", "tables"),
)
COMMANDS: Mapping[str, Sequence[str]] = {
    "--version": ("--version",),
    "query": ("query", "locomotion", *_SAID),
    "evaluate": ("evaluate", "locomotion", "moments.csv"),
    "check": ("check", "tables"),
    "cases": ("cases", "tables/hit_mid_air.csv"),
    "tidy": ("tidy", "tables/hit_mid_air.csv"),
    "index": ("index", "tables", "--out", "rows.parquet"),
    "coverage": ("coverage", "tables/hit_mid_air.csv"),
    "ci": ("ci", "tables"),
    "diff": ("diff", "tables/locomotion.csv", "moves.csv"),
    "merge": ("merge", "tables/locomotion.csv", "moves.csv", "moves.csv"),
    "git status": ("git", "status"),
    "import, of CSV": ("import", "moves.csv", "tables/moves.csv", "--dry-run"),
    "import, of Excel": ("import", "moves.xlsx", "tables/moves.csv", "--dry-run"),
    "export, to CSV": ("export", "locomotion", "copy.csv", "--force"),
    "export, to Excel": ("export", "locomotion", "copy.xlsx", "--force"),
    "compile": ("compile", "tables", "-o", "compiled"),
    "verify": ("verify", "compiled"),
    "motion search": ("motion", "search", "tables", "loco", "--query", "walk@2.0", "--speed", "0.2", *_SAID),
    "demo": ("demo",),
    "edit, first paint": ("-c", EDITOR),
}
"""What is run in a folder that `prepare` made."""


def prepare(folder: Path) -> None:
    """Make a folder in which the commands run: the sample tables, moments, and what some commands make for others."""
    shutil.copytree(ROOT / "tables", folder / "tables")
    shutil.copy(ROOT / "tables" / "locomotion.csv", folder / "moves.csv")
    (folder / "moments.csv").write_text(f"{','.join(FACTS)}\n{','.join(FACTS.values())}\n", encoding="utf-8")
    subprocess.run(["git", "init", "--quiet", str(folder)], check=True)
    for command in _MADE:
        run(command, folder)


def run(command: Sequence[str], folder: Path) -> str:
    """What a command, or `-c` and a script, prints in a fresh process; one that fails is no measurement."""
    words = command if command[:1] == ("-c",) else ("-m", "contextdb", *command)
    environment = {**os.environ, "PYTHONPATH": str(ROOT), "TERM": "xterm-256color"}
    done = subprocess.run([sys.executable, *words], capture_output=True, encoding="utf-8", cwd=folder, env=environment)
    if done.returncode not in (0, 1) or "Traceback" in done.stderr:
        raise RuntimeError(f"{' '.join(words)} failed:\n{done.stderr}")
    return done.stdout


def main() -> None:
    """Measure, print the figures, and write them as JSON when that is asked for."""
    parser = argparse.ArgumentParser(description="Measure the size of an installation and the start of each command.")
    parser.add_argument("--quick", action="store_true", help="a rough look: three rounds")
    parser.add_argument("--json", type=Path, metavar="FILE", help="also write the figures to a file")
    options = parser.parse_args()
    report: dict[str, Any] = {"format": 1, "machine": timing.machine(), "versions": timing.versions()}
    print(" · ".join(f"{key} {value}" for key, value in (report["machine"] | {"python": report["versions"]["python"]}).items()))
    report["bytes"] = sizes()
    _print_sizes(report["bytes"])
    report["seconds"] = starts(3 if options.quick else 7)
    _print_starts(report["seconds"])
    if options.json:
        options.json.write_text(json.dumps(report, indent=1))


# ---- size


def sizes() -> dict[str, int]:
    """The bytes of each package that is installed with contextdb, the largest first."""
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    found: dict[str, int] = {}
    wanted = list(project["dependencies"])
    while wanted:
        name, extras = _named(wanted.pop())
        try:
            package = distribution(name)
        except PackageNotFoundError:  # wanted on other systems only
            continue
        wanted += [] if name in found else [one for one in package.requires or () if _is_asked(one, extras)]
        found[name] = sum(file.size or 0 for file in package.files or ())
    found["contextdb"] = sum(path.stat().st_size for path in _own_files())
    return dict(sorted(found.items(), key=lambda item: -item[1]))


def _named(requirement: str) -> tuple[str, frozenset[str]]:
    """The package that a requirement names, and its extras."""
    parts = re.match(r"([\w.-]+)\s*(?:\[([^\]]*)\])?", requirement)
    assert parts is not None, "pip has read it"
    return re.sub(r"[-_.]+", "-", parts[1]).lower(), frozenset(re.findall(r"[\w-]+", parts[2] or ""))


def _is_asked(requirement: str, extras: frozenset[str]) -> bool:
    extra = re.search(r"""extra\s*==\s*["']([\w-]+)["']""", requirement)
    return extra is None or extra[1] in extras


def _own_files() -> Iterator[Path]:
    for folder in ("contextdb", "tui", "tables"):
        yield from (path for path in (ROOT / folder).rglob("*") if path.is_file() and path.parent.name != "__pycache__")


def _print_sizes(found: Mapping[str, int]) -> None:
    large = {name: n for name, n in found.items() if n >= 1_000_000}
    rest = sum(found.values()) - sum(large.values())
    lines = [*large.items(), (f"{len(found) - len(large)} more packages", rest), ("together", sum(found.values()))]
    print("\nAn installation; MB")
    print_aligned([(name, f"{n / 1e6:.1f}") for name, n in lines])


# ---- start


def starts(rounds: int) -> dict[str, list[tuple[float, float]]]:
    """The seconds of each command in each round, and those of its CPU, after a round that is not measured."""
    commands = {'python -c ""': ("-c", ""), "import contextdb": ("-c", "import contextdb"), **COMMANDS}
    found: dict[str, list[tuple[float, float]]] = {name: [] for name in commands}
    with tempfile.TemporaryDirectory() as made:
        prepare(Path(made))
        for _ in range(rounds + 1):
            for name, command in commands.items():
                before, start = os.times(), time.perf_counter()
                run(command, Path(made))
                after, stop = os.times(), time.perf_counter()
                cpu_s = after.children_user + after.children_system - before.children_user - before.children_system
                found[name].append((stop - start, cpu_s))
    return {name: times[1:] for name, times in found.items()}


def _print_starts(found: Mapping[str, Sequence[tuple[float, float]]]) -> None:
    lines = [("", "median", "lowest..highest", "CPU", "×")]
    least = 0.0
    for name, times in found.items():
        whole, cpu = ([1e3 * each for each in kind] for kind in zip(*times, strict=True))
        median = statistics.median(whole)
        least = least or median
        span = f"{min(whole):,.0f}..{max(whole):,.0f}"
        lines.append((name, f"{median:,.0f}", span, f"{statistics.median(cpu):,.0f}", f"{median / least:.1f}"))
    print("\nFresh processes, start to end; milliseconds")
    print_aligned(lines)


if __name__ == "__main__":
    main()
