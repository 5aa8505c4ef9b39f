"""What hot reload costs: one cell changed in a watched table, beside reading and compiling the folder afresh.

    python benchmarks/reload.py                 1,000 x 30 and 10,000 x 40
    python benchmarks/reload.py --quick         fewer repeats
    python benchmarks/reload.py --json FILE     the same figures for programs

A reload is `Watch.poll` where a change is due: all files are read, compared with the version at hand, what changed is compiled, and
the table is made ready for its first query. A look that finds nothing is what a watch costs the rest of the time.
"""

from __future__ import annotations

import argparse
import csv
import json
import sys
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

if __package__ in (None, ""):
    sys.path[0] = str(Path(__file__).parent.parent)  # not this folder: its coverage.py is no package of that name

import numpy as np

from benchmarks import generator, timing
from benchmarks.sections import print_aligned
from contextdb.tables.project import Project
from contextdb.tables.watching import Watch, watch


class Edited:
    """A watched folder with one table, and a clock that goes on by a second a look."""

    def __init__(self, folder: Path, table: generator.GameTable) -> None:
        self.folder, self.table, self.time_s = folder, table, 0.0
        self.cells = table.cells()
        lines = [f"[conditions.{n}]\ntype = {json.dumps(s['type'])}\n" + _values(s) for n, s in table.schema().items()]
        (folder / "contextdb.toml").write_text("\n".join(lines), encoding="utf-8")
        self.save()
        self.watch: Watch = watch(folder, poll_s=None, clock=lambda: self.time_s)

    def save(self) -> None:
        """Write the table."""
        with (self.folder / "game.csv").open("w", newline="", encoding="utf-8") as file:
            csv.writer(file).writerows([self.cells.keys(), *zip(*self.cells.values(), strict=True)])

    def edit(self, name: str, row: int, text: str) -> None:
        """Change one cell, and let the files rest until the change is due."""
        self.cells[name][row] = text
        self.save()
        self.look()

    def look(self) -> bool:
        """One look, a second after the last."""
        self.time_s += 1.0
        return self.watch.poll()

    def reload(self) -> None:
        """The look that swaps the change in."""
        assert self.look(), "nothing was swapped in"


def _values(section: dict[str, object]) -> str:
    return f"values = {json.dumps(section['values'])}\n" if "values" in section else ""


def afresh(folder: Path) -> None:
    """Read and compile the folder, ready for the first query."""
    for compiled in Project.load(folder).compile().values():
        compiled.query({}, unknown="any")


def measured(shape: generator.Shape, repeats: int) -> dict[str, timing.Summary]:
    """The figures of one size."""
    with tempfile.TemporaryDirectory() as folder:
        edited = Edited(Path(folder), generator.make_table(shape))
        table = edited.table
        edits: dict[str, Callable[[int], tuple[str, int, str]]] = {
            "one bool cell": lambda i: (
                table.bool_names[0],
                i,
                "True" if edited.cells[table.bool_names[0]][i] != "True" else "Any",
            ),
            "one number cell": lambda i: (table.number_names[0], i, f"{i}.25..{i + 1}"),
        }
        found = {"afresh": timing.seconds(lambda: afresh(Path(folder)), repeats)}
        for name, edit in edits.items():
            rounds = []
            for i in range(repeats):
                edited.edit(*edit(i))
                rounds.append(timing.timed(lambda _: edited.reload(), [None]))
            found[name] = timing.Summary.of(rounds)
        edited.time_s += 10.0
        edited.look()
        looks = [np.asarray(timing.timed(lambda _: edited.look(), [None] * 20)) for _ in range(repeats)]
        return found | {"nothing changed": timing.Summary.of(looks)}


def main() -> None:
    """Measure every size, print the figures, and write them as JSON when that is asked for."""
    parser = argparse.ArgumentParser(description="Measure hot reload.")
    parser.add_argument("--quick", action="store_true", help="fewer repeats")
    parser.add_argument("--json", type=Path, metavar="FILE", help="also write the figures to a file")
    options = parser.parse_args()
    report: dict[str, Any] = {"format": 1, "machine": timing.machine(), "versions": timing.versions()}
    print(" · ".join(f"{key} {value}" for key, value in (report["machine"] | report["versions"]).items()))
    for shape in generator.SHAPES:
        figures = measured(shape, 3 if options.quick else 9)
        print(f"\nreload at {shape.name}: milliseconds, median (lowest … highest)")
        print_aligned([(name, f"{s.median_us / 1e3:,.2f}", _spread(s)) for name, s in figures.items()])
        report[shape.name] = {name: vars(summary) for name, summary in figures.items()}
    if options.json:
        options.json.write_text(json.dumps(report, indent=1) + "\n", encoding="utf-8")


def _spread(summary: timing.Summary) -> str:
    return f"({summary.low_us / 1e3:,.2f} … {summary.high_us / 1e3:,.2f})"


if __name__ == "__main__":
    main()
