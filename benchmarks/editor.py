"""What a key costs in the editor, beside other grids of Textual.

    python benchmarks/editor.py                 1,000 x 40, 10,000 x 60 and 100,000 x 60, every grid
    python benchmarks/editor.py --quick         without the largest size of the slow grid
    python benchmarks/editor.py --json FILE     the same figures for programs

Each grid runs in a process of its own on a screen of 200 x 50 that nobody sees. Ours is the whole editor with a test row that asks
for something; "all on" has a filter, two sort keys, three frozen columns and the pane of reasons too. The others are their widget
alone, which cannot be typed in. A figure is the CPU time of one key with all that it
paints, the median of many; first paint is the CPU time from the data in memory to the first screen; memory is what the process grew
by from there until the last page was seen (nothing, where what loading left behind was enough).
"""

from __future__ import annotations

import argparse
import asyncio
import contextlib
import gc
import json
import os
import random
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Awaitable, Callable, Mapping
from functools import partial
from pathlib import Path
from typing import Any

if __package__ in (None, ""):
    sys.path[0] = str(Path(__file__).parent.parent)  # not this folder: its coverage.py is no package of that name

from benchmarks import generator, timing
from benchmarks.sections import print_aligned

SHAPES = {
    "1,000 x 40": generator.Shape("1,000 x 40", 1_000, 24, 8, 8),
    "10,000 x 60": generator.Shape("10,000 x 60", 10_000, 36, 12, 12),
    "100,000 x 60": generator.Shape("100,000 x 60", 100_000, 36, 12, 12),
}
GRIDS = ("contextdb", "all on", "fastdatatable", "DataTable")
STEPS = (
    "down, in view",
    "down, scrolling",
    "right",
    "page down",
    "type a cell",
    "undo",
    "test-row key",
    "live change",
    "paste 5 MB",
)
SCREEN = (200, 50)
N_KEYS = 24
PASTED = 5_000_000
"""So many bytes are pasted; a terminal hands them over in pieces of `PIECE`."""
PIECE = 4096

Figures = dict[str, float]


def main() -> None:
    """Measure every grid at every size, print the figures, and write them as JSON when that is asked for."""
    parser = argparse.ArgumentParser(description="Measure the editor's grid.")
    parser.add_argument("--quick", action="store_true", help="without the stock widget at the largest size")
    parser.add_argument("--json", type=Path, metavar="FILE", help="also write the figures to a file")
    parser.add_argument("--one", nargs=2, metavar=("GRID", "SIZE"), help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.one:
        print(json.dumps(measured(*options.one)))
        return
    report: dict[str, Any] = {"format": 1, "machine": timing.machine(), "versions": timing.versions(), "sizes": {}}
    print(" · ".join(f"{key} {value}" for key, value in (report["machine"] | report["versions"]).items()))
    for size in SHAPES:
        grids = [g for g in GRIDS if not (options.quick and g == "DataTable" and size == "100,000 x 60")]
        found = {grid: _in_own_process(grid, size) for grid in grids}
        report["sizes"][size] = found
        _print(size, found)
    if options.json:
        options.json.write_text(json.dumps(report, indent=1))


def _in_own_process(grid: str, size: str) -> Figures:
    done = subprocess.run(
        [sys.executable, __file__, "--one", grid, size],
        capture_output=True,
        text=True,
        check=False,
        env=os.environ | {"TERM": "xterm"},
    )
    if done.returncode:
        raise SystemExit(f"{grid}, {size}: {done.stderr}")
    figures: Figures = json.loads(done.stdout.splitlines()[-1])
    return figures


def _print(size: str, found: Mapping[str, Figures]) -> None:
    print(f"\n{size}: CPU milliseconds")
    steps = ("first paint", *STEPS, "memory MB")
    rows = [("", *found)]
    rows += [(step, *(f"{figures[step]:,.1f}" if step in figures else "–" for figures in found.values())) for step in steps]
    print_aligned(rows)


def measured(grid: str, size: str) -> Figures:
    """The figures of one grid, in this process."""
    table = generator.make_table(SHAPES[size], seed=1)
    measures: dict[str, Callable[[generator.GameTable], Awaitable[Figures]]] = {
        "contextdb": partial(_ours, has_all=False),
        "all on": partial(_ours, has_all=True),
        "DataTable": _stock,
        "fastdatatable": _fast,
    }
    return asyncio.run(_awaited(measures[grid](table)))


async def _awaited(figures: Awaitable[Figures]) -> Figures:
    return await figures


def _memory_mb() -> float:
    gc.collect()
    pages = int(Path("/proc/self/statm").read_text().split()[1])
    return pages * os.sysconf("SC_PAGE_SIZE") / 2**20


async def _pressed(app: Any, *keys: str) -> float:
    """CPU milliseconds from a key to the screen that shows it, and to the end of what it left to do."""
    from textual.events import Key

    start = time.process_time()
    for key in keys:
        shown = asyncio.Event()
        display = type(app)._display
        app._display = lambda *what, shown=shown, display=display: (display(app, *what), shown.set())
        app.post_message(Key(key, key if len(key) == 1 else None))
        with contextlib.suppress(TimeoutError):  # a key at the edge of the table changes nothing
            await asyncio.wait_for(shown.wait(), 2)
        await asyncio.sleep(0.05)
    return 1e3 * (time.process_time() - start)


async def _keys(app: Any, *keys: str, n: int = N_KEYS) -> float:
    """The median of `n` presses."""
    return statistics.median([await _pressed(app, *keys) for _ in range(n)])


async def _moves(app: Any, figures: Figures) -> None:
    figures["down, in view"] = await _keys(app, "down", n=16)
    await _keys(app, "down", n=30)
    figures["down, scrolling"] = await _keys(app, "down")
    figures["right"] = await _keys(app, "right")
    figures["page down"] = await _keys(app, "pagedown", n=12)


# ---- ours


async def _ours(made: generator.GameTable, has_all: bool) -> Figures:
    import contextdb as cdb
    from tui.app import EditorApp
    from tui.model.workspace import Workspace
    from tui.run import pass_over_what_stays

    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "table.csv"
        cdb.Table.from_columns(made.cells(), schema=made.schema()).save(path)
        (Path(folder) / "contextdb.toml").write_text(_toml(made))
        workspace = Workspace(path)
        sheet = workspace.session(workspace.first).sheet
        pass_over_what_stays()
        before, start = _memory_mb(), time.process_time()
        app = EditorApp(workspace)
        app.animation_level = "none"
        figures: Figures = {}
        async with app.run_test(size=SCREEN) as pilot:
            await pilot.pause()
            figures["first paint"] = 1e3 * (time.process_time() - start)
            app.main.assets.set_context({made.bool_names[0]: "True", made.number_names[0]: "50"}, "")
            if has_all:
                _turn_all_on(app, made)
            await pilot.pause()
            await _moves(app, figures)
            figures["memory MB"] = max(_memory_mb() - before, 0.0)
            figures["type a cell"] = await _typing(app, sheet)
            figures["undo"] = await _keys(app, "ctrl+z", n=N_KEYS // 2)
            figures["test-row key"] = await _facts(app, made)
            figures["live change"] = await _live(app, made)
            app.main.following.stop()
            figures["paste 5 MB"] = await _paste(app, sheet, made)
        return figures


def _turn_all_on(app: Any, made: generator.GameTable) -> None:
    """A filter, a sort by two columns, three columns that do not scroll, and the pane of reasons."""
    from tui.model.views import CellTest, Filter, Sort
    from tui.model.visible_columns import VisibleColumns

    assets = app.main.assets
    assets.sheet.set_filter(Filter(tests=(CellTest(made.bool_names[1], "!=", "False"),)))
    assets.sheet.set_sort(Sort.by([Sort(made.bool_names[2]), Sort(made.bool_names[3])]))
    assets.sheet.show_columns(VisibleColumns(frozen=assets.sheet.table.columns[2].name))
    assets.why_pane.turn(assets.sheet)
    assets.show()


async def _paste(app: Any, sheet: Any, made: generator.GameTable) -> float:
    """A block of cells of numbers, as a terminal sends it."""
    from textual.events import Paste

    from tui.keyboard import KeyParser

    sheet.go(0, next(at for at, column in enumerate(sheet.table.columns) if column.name == made.number_names[0]))
    line = "\t".join("0..100" for _ in made.number_names) + "\n"
    text = f"\x1b[200~{line * (PASTED // len(line))}\x1b[201~"
    start, parser = time.process_time(), KeyParser()
    events = [event for at in range(0, len(text), PIECE) for event in parser.feed(text[at : at + PIECE])]
    assert [type(event) for event in events] == [Paste]
    position = sheet.history.position
    app.main.assets.grid.post_message(events[0])
    while sheet.history.position == position:
        await asyncio.sleep(0.05)
    await asyncio.sleep(0.5)
    return 1e3 * (time.process_time() - start)


async def _typing(app: Any, sheet: Any) -> float:
    """A letter and Enter, in a bool column: the editor opens and closes again."""
    sheet.go(5, 1)
    times = [await _pressed(app, "tfa"[i % 3], "enter") for i in range(N_KEYS // 2)]
    assert sheet.is_modified, "nothing was typed"
    return statistics.median(times)


async def _facts(app: Any, made: generator.GameTable) -> float:
    """Another value of a number fact: the valid rows lit, the failing cells marked, and counted, anew."""
    assets, times = app.main.assets, []
    for i in range(N_KEYS):
        start = time.process_time()
        assets.sheet.set_fact(made.number_names[0], str(i * 3.5))
        assets.show()
        await asyncio.sleep(0.1)
        times.append(1e3 * (time.process_time() - start))
    return statistics.median(times)


async def _live(app: Any, made: generator.GameTable) -> float:
    """A moment of a game that is followed: its bools and numbers are given, and a third of the numbers and one bool are others.
    The mean of changes at 30 a second, of which the editor shows `RATE`, after the first second."""
    from tui.model.game_answer import GameAnswer
    from tui.model.moments import Moment
    from tui.screens.following import ITEMS, RATE
    from tui.widgets.bar import Item
    from tui.widgets.live_line import LiveState

    assets, times, rng = app.main.assets, [], random.Random(1)
    facts: dict[str, object] = dict.fromkeys(made.bool_names, True) | dict.fromkeys(made.number_names, 50.0)
    for i in range(30 + 2 * N_KEYS):
        moment = Moment(i / 30, dict(facts), 0, 0)
        start = time.process_time()
        if i % (30 // RATE) == 0:
            assets.follow(moment.texts(assets.sheet.query.wanted.given), {}, i, "game")
            state = LiveState(
                "●", "game", GameAnswer(moment, assets.sheet.query, assets.sheet.table, assets.sheet.table).summary, ""
            )
            assets.show_live(state, [Item(*item) for item in ITEMS])
        await asyncio.sleep(1 / 30)
        times.append(1e3 * (time.process_time() - start))
        facts[rng.choice(made.bool_names)] = rng.random() < 0.5
        for name in made.number_names[::3]:
            facts[name] = min(max(float(str(facts[name])) + rng.uniform(-2, 2), 0.0), 100.0)
    return statistics.mean(times[30:])


def _toml(made: generator.GameTable) -> str:
    lines = ["[tables.table]", 'file = "table.csv"']
    for name, said in made.schema().items():
        lines += [f"[conditions.{name}]", *(f"{key} = {json.dumps(value)}" for key, value in said.items())]
    return "\n".join(lines) + "\n"


# ---- peers


async def _stock(made: generator.GameTable) -> Figures:
    from textual.widgets import DataTable

    cells = made.cells()
    rows = list(zip(*cells.values(), strict=True))

    def fill(table: DataTable[str]) -> None:
        table.add_columns(*cells)
        table.add_rows(rows)

    return await _peer(lambda: DataTable(fixed_columns=1), fill)


async def _fast(made: generator.GameTable) -> Figures:
    import pyarrow as pa
    from textual_fastdatatable import ArrowBackend, DataTable

    data = pa.table(made.cells())
    return await _peer(lambda: DataTable(backend=ArrowBackend(data), fixed_columns=1, render_markup=False), lambda _: None)


async def _peer(make: Callable[[], Any], fill: Callable[[Any], None]) -> Figures:
    from textual.app import App, ComposeResult

    class Alone(App[None]):
        def compose(self) -> ComposeResult:
            yield make()

        def on_mount(self) -> None:
            table = next(iter(self.screen.children))
            fill(table)
            table.focus()

    before, start = _memory_mb(), time.process_time()
    app = Alone()
    app.animation_level = "none"
    figures: Figures = {}
    async with app.run_test(size=SCREEN) as pilot:
        await pilot.pause()
        figures["first paint"] = 1e3 * (time.process_time() - start)
        await _moves(app, figures)
        figures["memory MB"] = max(_memory_mb() - before, 0.0)
    return figures


if __name__ == "__main__":
    main()
