"""Random keys, typed texts, pastes and clicks in the whole editor, and what may change in its tables at each of them.

A cell may change only where the cursor, the selection, or the editor of a cell is to be seen at the moment of the event; or by a
dialog, or a pane with keys of its own, that is shown then. The sequences come from a seed; one that breaks a rule is made shorter
before it is reported.
"""

import asyncio
import random
import unicodedata
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path
from typing import Any
from unittest.mock import patch

from quick_apps import _rested, quick
from terminal import alone
from textual import events
from textual.css.query import NoMatches
from textual.keys import REPLACED_KEYS, _character_to_key, _get_unicode_name_from_key
from textual.screen import Screen

from contextdb.errors import ContextDBError
from contextdb.tables.table import Table
from docs import keys as documented
from tui.app import EditorApp
from tui.commands import ASSETS, COMMANDS, GRID, SCREEN
from tui.model.coverage_run import CoverageRun, measured
from tui.model.workspace import Workspace
from tui.panes.pane import Pane
from tui.screens.main import MainScreen
from tui.widgets.editing.entry import Entry
from tui.widgets.editing.keys import KEYS as CELL_KEYS
from tui.widgets.find_bar import SheetBar
from tui.widgets.grid import Grid

TOML = """\
[conditions.gait]
type = "enum"
values = ["Walk", "Run", "Crouch"]

[conditions.speed]
type = "number"
min = 0
max = 10

[conditions.tired]
type = "bool"
"""
ROWS = ["Asset,gait,speed,tired,note"] + [f"clip_{at:02},{['Walk', 'Run'][at % 2]},{at}..{at + 1},Any,n{at}" for at in range(9)]
TEXTS = ["7w", "Q", "run", "0,5", "2..3", "Wal", "True", "x", " ", "=", "+", "not", "clip_03", "1", "é", "ä b"]
PASTES = [
    "Perch_01",
    "a\tRun\n",
    "1\n2\n3\n",
    "0,5\n1,5\n",
    "x\ty\tz\tu\tv\tw",
    "\n",
    '"a\nb"\tc',
    "csv_a,Walk,1",
    "7\tTrue\n8\tFalse\n",
]
OPENERS = (
    "alt+1", "alt+2", "alt+3", "alt+4", "alt+5", "alt+right", "alt+left", "ctrl+pagedown", "ctrl+f", "ctrl+l", "f6", "ctrl+end",
    "down", "home", "enter", "enter", "escape", "f2", "tab", "ctrl+s", "alt+0", "alt+e", "shift+right", "shift+down", "delete",
)  # fmt: skip
"""Keys that come more often than the others."""
LONGEST_REST_S, LATER_S = 120.0, 0.1
N_EVENTS = 12

IN_GRID = {key: command for command in (*GRID, *ASSETS, *SCREEN) for key in command.keys.split(",") if key}
OF_SELECTION = frozenset(("clear", "cut", "fill-down", "fill-right", "fill-series", "repeat"))
OF_ROWS = frozenset(
    ("insert-row", "insert-below", "insert-copied", "duplicate", "delete-rows", "row-up", "row-down", "enable", "repeat")
)
OF_COLUMNS = frozenset(("delete-columns", "column-left", "column-right", "repeat"))
OF_HISTORY = frozenset(("undo", "redo"))


@cache
def pressed_keys() -> list[str]:
    """Every key that the documentation names, each once, and those of the cell editor."""
    of_cells = [key for binding in CELL_KEYS for key in getattr(binding, "key", "").split(",")]
    return sorted({key for row in documented.all_keys() for key in row.split(",")} | {*of_cells, *IN_GRID} - {""})


# ---- events


@dataclass(frozen=True)
class Act:
    """One thing that hands do."""

    what: str
    """key, type, paste, click, right click, double click, wheel, or command: one of the palette."""
    text: str = ""
    at: tuple[int, int] = (0, 0)

    def __str__(self) -> str:
        return f"{self.what} {self.text!r}" if self.text else f"{self.what} {self.at}"


def random_acts(seed: int, size: tuple[int, int], n_acts: int = N_EVENTS) -> list[Act]:
    """The acts of a seed."""
    draw, keys = random.Random(seed), pressed_keys()
    return [_random_act(draw, keys, size) for _ in range(draw.randint(4, n_acts))]


def _random_act(draw: random.Random, keys: Sequence[str], size: tuple[int, int]) -> Act:
    kind = draw.random()
    if kind < 0.24:
        return Act("key", draw.choice(OPENERS))
    if kind < 0.56:
        return Act("key", draw.choice(keys))
    if kind < 0.78:
        return Act("type", draw.choice(TEXTS))
    if kind < 0.84:
        return Act("paste", draw.choice(PASTES))
    if kind < 0.88:
        return Act("command", draw.choice([command.id for command in COMMANDS]))
    y = draw.choice((0, 1, draw.randrange(size[1]), draw.randrange(size[1]), size[1] - 1))
    what = draw.choice(("click", "click", "click", "double click", "right click", "wheel"))
    return Act(what, at=(draw.randrange(size[0] if y > 1 else min(size[0], 70)), y))


class Chosen(events.Event):
    """A command was chosen in the palette."""

    def __init__(self, command: str) -> None:
        super().__init__()
        self.command = command


class Left(events.Event):
    """The cell that is edited is taken, as a command does first."""


def events_of(act: Act) -> Iterable[events.Event]:
    """What the terminal sends for an act, one after the other."""
    if act.what == "key":
        yield _key(act.text)
    elif act.what == "type":
        yield from map(_key, act.text)
    elif act.what == "paste":
        yield events.Paste(act.text)
    elif act.what == "command":
        yield Left()
        yield Chosen(act.text)
    elif act.what == "wheel":
        yield _mouse(events.MouseScrollDown, act.at, 0)
    else:
        button = 3 if act.what == "right click" else 1
        for _ in range(2 if act.what == "double click" else 1):
            yield _mouse(events.MouseDown, act.at, button)
            yield _mouse(events.MouseUp, act.at, button)


def _key(key: str) -> events.Key:
    name = _character_to_key(key) if len(key) == 1 and not key.isalnum() else key
    original = REPLACED_KEYS.get(name, name)
    try:
        character: str | None = unicodedata.lookup(_get_unicode_name_from_key(original))
    except KeyError:
        character = key if len(key) == 1 else None
    return events.Key(name, character)


def _mouse(kind: type[events.MouseEvent], at: tuple[int, int], button: int) -> events.MouseEvent:
    x, y = at
    return kind(None, x, y, 0, 0, button, False, False, False, screen_x=x, screen_y=y)


# ---- what is seen, and what may change then

Texts = dict[str, list[str]]
"""A table: its columns by name."""


def texts_of(table: Table) -> Texts:
    return {column.name: column.to_list() for column in table.columns}


def rows_of(texts: Texts, names: Iterable[str]) -> list[tuple[str, ...]]:
    return list(zip(*(texts[name] for name in names), strict=True))


@dataclass
class Seen:
    """What stands on the screen before an event."""

    screen: Screen[Any]
    tables: dict[str, Texts]
    where: str = "elsewhere"
    """Of the main screen: "grid", "test row", "new row", "cell", "bar" or "pane"; else "dialog"."""
    name: str = ""
    """The table that is shown."""
    rows: list[int] = field(default_factory=list)
    """The rows of the file that are selected."""
    columns: list[str] = field(default_factory=list)
    cell: tuple[Sequence[int], Sequence[str]] = ((), ())
    """The row and the column of the cell that is edited."""
    view: list[int] = field(default_factory=list)
    hidden: set[str] = field(default_factory=set)
    """The columns that are hidden."""
    is_new: bool = False
    is_fact: bool = False
    keys: dict[tuple[int, int], str] = field(default_factory=dict)
    """The keys of the line at the foot, where a click means each."""


def seen(app: EditorApp) -> Seen:
    """What stands on the screen; asserts that the keys go to something that is shown."""
    screen = app.screen
    tables = {name: texts_of(session.sheet.table) for name, session in app.workspace.sessions.items()}
    focused = screen.focused
    if focused is not None:
        hidden = [part for part in focused.ancestors_with_self if isinstance(part, (Pane, SheetBar, Entry)) and not part.display]
        assert not hidden, f"the keys go to {focused}, which is not shown"
    found = Seen(screen, tables)
    if not isinstance(screen, MainScreen):
        found.where = "dialog"
        return found
    found.name = screen.table_name
    line = screen.query_one("KeyLine")
    assert line._keys == tuple(line._bound()), "the key line does not show the keys of what has the focus"  # type: ignore[attr-defined]
    top = line.region
    found.keys = {(top.x + x + at, top.y): key.key for x, key in line._fitting() for at in range(key.width - 2)}  # type: ignore[attr-defined]
    assets = screen.assets
    grid, sheet, editor = assets.grid, assets.sheet, assets.editor
    block = sheet.block
    found.view = [int(row) for row in sheet.view.rows]
    found.rows = found.view[block.top : block.bottom]
    found.hidden = {column.name for column, is_hidden in zip(sheet.table.columns, sheet.hidden, strict=True) if is_hidden}
    found.columns = [c.name for c in sheet.table.columns[block.left : block.right] if c.name not in found.hidden]
    assert sheet.table.columns[sheet.cursor[1]].name not in found.hidden, "the cursor is in a hidden column"
    found.is_new, found.is_fact = grid.is_in_new_row, grid.is_in_test_row
    if editor is not None:
        assert screen.tab == "assets", "a cell is edited that is not shown"
        assert focused is editor.entry, f"a cell is edited and {focused} has the keys"
        cell = grid.cell_region()
        assert grid.region.contains_region(cell.intersection(grid.region)), "the cell that is edited is not in sight"
        assert cell.y == editor.region.y, f"the cell at {cell} is edited at {editor.region}"
        found.where = "cell"
        found.cell = [found.view[sheet.cursor[0]]] if found.view else [], [sheet.table.columns[sheet.cursor[1]].name]
    elif screen.tab != "assets":
        assert not isinstance(focused, Grid), "the keys go to the grid, which is not shown"
        found.where = "pane"
    elif focused is grid:
        found.where = "test row" if found.is_fact else "new row" if found.is_new else "grid"
    elif focused is not None and any(isinstance(part, SheetBar) for part in focused.ancestors_with_self):
        found.where = "bar"
    return found


class Rules:
    """What may change; it remembers every state of each table, to which undo may go back."""

    def __init__(self) -> None:
        self.states: dict[str, list[Texts]] = {}

    def hold(self, before: Seen, event: events.Event, after: Seen) -> None:
        """Assert that what changed was seen before."""
        for name, old in before.tables.items():
            self.states.setdefault(name, []).append(old)
            new = after.tables.get(name, old)
            if new != old:
                assert self._may(before, event, after, name, old, new), (
                    f"{name} was changed by {event} in {before.where}: {differences(old, new)}"
                )

    def _may(self, before: Seen, event: events.Event, after: Seen, name: str, old: Texts, new: Texts) -> bool:
        if isinstance(event, events.MouseUp) and (key := before.keys.get((event.x, event.y))):
            event = events.Key(key, key if len(key) == 1 else None)  # a click on a key of the foot is that key
        if before.where == "dialog":
            return after.screen is not before.screen  # it was answered
        if name != before.name or isinstance(event, events.MouseScrollDown):
            return False
        if before.where == "cell" and self._is_of_cell(before, event, old, new):
            return True
        if isinstance(event, events.MouseUp):
            return False
        key = event.key if isinstance(event, events.Key) else ""
        if before.where == "pane" and not isinstance(event, Chosen):
            return not (isinstance(event, events.Key) and event.is_printable) or key.lower() in ("m", "u", "d", "a", "x", "space")
        if before.where == "bar" and not isinstance(event, Chosen):
            is_taken = key in ("enter", "alt+r", "alt+a") or isinstance(event, events.MouseDown)
            return is_taken and only_in(before.view, old.keys() - before.hidden, old, new)
        command = event.command if isinstance(event, Chosen) else IN_GRID[key].id if key in IN_GRID else ""
        if before.where == "cell":
            return False
        if (command in ("paste", "repeat") or isinstance(event, events.Paste)) and not before.is_fact:
            is_pasted = is_added(old, new) if before.is_new else self._is_below(before, old, new)
            if is_pasted or command != "repeat":
                return is_pasted
        if command in OF_HISTORY:
            return new in self.states[name]
        if command == "sort-file":
            return rows_sorted(old) == rows_sorted(new)
        if command == "mend-all":  # of the whole column, as its name says
            return columns_stay(before.columns, old, new)
        if before.where == "new row":
            return (command == "repeat" and is_added(old, new)) or (
                command in ("insert-row", "insert-below") and is_added(old, new)
            )
        return (
            (command in OF_SELECTION and only_in(before.rows, before.columns, old, new))
            or (command in OF_ROWS and others_stay(before.rows, old, new))
            or (command in OF_COLUMNS and columns_stay(before.columns, old, new))
        )

    def _is_of_cell(self, before: Seen, event: events.Event, old: Texts, new: Texts) -> bool:
        if before.is_fact:
            return False
        if before.is_new:
            return is_added(old, new)
        is_fill = isinstance(event, events.Key) and event.key in ("ctrl+j", "ctrl+enter")
        return only_in(*((before.rows, before.columns) if is_fill else before.cell), old, new)

    def _is_below(self, before: Seen, old: Texts, new: Texts) -> bool:
        """Whether a paste changed cells from the selection on alone."""
        first = before.view.index(before.rows[0]) if before.rows else 0
        names = [name for name in old if name not in before.hidden]
        columns = names[names.index(before.columns[0]) :] if before.columns else names
        return only_in(before.view[first:], columns, old, new)


def differences(old: Texts, new: Texts) -> str:
    """The first cells that differ."""
    if old.keys() != new.keys():
        return f"columns {list(old)} are {list(new)}"
    names = list(old)
    before, after = rows_of(old, names), rows_of(new, names)
    if len(before) != len(after):
        return f"{len(before)} rows are {len(after)}"
    return ", ".join(f"row {at + 1}: {a} is {b}" for at, (a, b) in enumerate(zip(before, after, strict=True)) if a != b)[:400]


def only_in(rows: Iterable[int], columns: Iterable[str], old: Texts, new: Texts) -> bool:
    """Whether no cell changed but in these rows and columns; rows may be new at the end."""
    if old.keys() != new.keys():
        return False
    rows, columns = set(rows), set(columns)
    n_old, n_new = len(next(iter(old.values()))), len(next(iter(new.values())))
    return n_new >= n_old and all(
        old[name][at] == new[name][at] or (at in rows and name in columns) for name in old for at in range(n_old)
    )


def is_added(old: Texts, new: Texts) -> bool:
    """Whether all rows stayed and there are more at the end."""
    return only_in((), (), old, new)


def others_stay(rows: Iterable[int], old: Texts, new: Texts) -> bool:
    """Whether the rows that are not these are there as before, in their order; there may be a new column."""
    if old.keys() - new.keys():
        return False
    names, chosen = list(old), set(rows)
    others = iter(rows_of(new, names))
    return all(row in others for at, row in enumerate(rows_of(old, names)) if at not in chosen)


def rows_sorted(texts: Texts) -> list[tuple[str, ...]]:
    """The rows in one order."""
    return sorted(rows_of(texts, sorted(texts)))


def columns_stay(columns: Iterable[str], old: Texts, new: Texts) -> bool:
    """Whether the columns that are not these have their texts."""
    chosen = set(columns)
    return all(new.get(name) == texts for name, texts in old.items() if name not in chosen)


# ---- the editor


async def rest(app: EditorApp) -> None:
    """Wait until all is done that an event set off, also in threads."""
    await _rested(app)
    end = asyncio.get_running_loop().time() + LONGEST_REST_S
    while app._exception is None and app._running and _is_at_work(app):
        assert asyncio.get_running_loop().time() < end, "what an event set off does not end"
        await asyncio.sleep(0.001)
        await _rested(app)


def _is_at_work(app: EditorApp) -> bool:
    return app._settling is not None or bool(app._ahead) or any(not worker.is_finished for worker in app.workers)


async def seen_at_rest(app: EditorApp) -> Seen:
    """What stands on the screen once a timer of the screen, too, has done what it had to do."""
    try:
        return seen(app)
    except (AssertionError, NoMatches):
        await asyncio.sleep(LATER_S)
        await rest(app)
        return seen(app)


def _leave_cell(screen: MainScreen) -> None:
    if screen.assets.editor is not None:
        screen.assets.editor.leave()


async def perform(app: EditorApp, acts: Sequence[Act], rules: Rules) -> None:
    """Do the acts one after the other, and hold after each event that only what was seen has changed."""
    for act in acts:
        before = await seen_at_rest(app)
        for event in events_of(act):
            if isinstance(event, (Left, Chosen)):
                if isinstance(app.screen, MainScreen):
                    app._run(event.command) if isinstance(event, Chosen) else _leave_cell(app.screen)
            else:
                event.set_sender(app)
                app._driver.send_message(event)  # type: ignore[union-attr]
            await rest(app)
            if app._exception is not None:
                raise app._exception
            if not app._running or not any(isinstance(screen, MainScreen) for screen in app.screen_stack):
                return
            after = await seen_at_rest(app)
            rules.hold(before, event, after)
            before = after


def quick_coverage() -> CoverageRun:
    """The coverage of the first table that is measured, for all."""
    known: list[Any] = []

    def once(*arguments: Any) -> Any:
        if not known:
            known.append(measured(*arguments))
        return known[0]

    return CoverageRun(once)


@dataclass
class Broken(AssertionError):
    """A sequence that breaks a rule."""

    seed: int
    size: tuple[int, int]
    acts: Sequence[Act]
    why: str

    def __str__(self) -> str:
        lines = "\n  ".join(map(str, self.acts))
        return f"seed {self.seed} at {self.size}: {self.why}\nby\n  {lines}"


def play(folder: Path, size: tuple[int, int], sequences: Sequence[Sequence[Act]]) -> tuple[int, str] | None:
    """Do sequences, each in a new table of one editor; gives the number of the first that breaks a rule, and why."""
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "contextdb.toml").write_text(TOML)
    for at in range(len(sequences)):
        (folder / f"t{at}.csv").write_text("\n".join(ROWS) + "\n")

    async def run() -> tuple[int, str] | None:
        app = EditorApp(Workspace(folder / "t0.csv"))
        app.animation_level = "none"
        try:
            async with app.run_test(size=size) as pilot:
                await pilot.pause()
                for at, acts in enumerate(sequences):
                    await _show(app, at)
                    try:
                        await perform(app, acts, Rules())
                    except (AssertionError, ContextDBError) as error:
                        return at, str(error) or repr(error)
                    except Exception as error:
                        app._exception = None
                        return at, repr(error)
        finally:
            app.workspace.close()
        return None

    live, shot, leave = (
        patch.object(MainScreen, "action_live", lambda _: None),
        patch.object(EditorApp, "deliver_screenshot", lambda *_: None),
        patch.object(EditorApp, "_leave", lambda _: None),  # one editor plays many sequences
    )
    coverage = patch("tui.screens.table_screen.CoverageRun", quick_coverage)
    with quick(is_light=True), alone(folder), live, shot, leave, coverage:
        return asyncio.run(run())


async def _show(app: EditorApp, at: int) -> None:
    """Show a new table, and nothing over it."""
    while not isinstance(app.screen, MainScreen):
        app.pop_screen()
        await rest(app)
    if at:
        app.open_table(f"t{at}")
    await rest(app)


def first_broken(folder: Path, size: tuple[int, int], seeds: Sequence[int], n_together: int = 20) -> Broken | None:
    """The first of the sequences of some seeds that breaks a rule, made as short as it goes."""
    for start in range(0, len(seeds), n_together):
        some = seeds[start : start + n_together]
        broken = play(folder / f"{size[0]}-{start}", size, [random_acts(seed, size) for seed in some])
        if broken is not None:
            return _shortest(folder, size, some[broken[0]], broken[1], [random_acts(seed, size) for seed in some[: broken[0] + 1]])
    return None


def _shortest(folder: Path, size: tuple[int, int], seed: int, why: str, sequences: list[list[Act]]) -> Broken:
    acts, n_tries = sequences[-1], 0
    alone_broken = play(folder / f"{seed}-alone", size, [acts])
    if alone_broken is None:
        return Broken(seed, size, [act for one in sequences for act in one], f"only after those before it: {why}")
    why, at = alone_broken[1], 0
    while at < len(acts):
        shorter, n_tries = [*acts[:at], *acts[at + 1 :]], n_tries + 1
        again = play(folder / f"{seed}-{n_tries}", size, [shorter])
        if again is None:
            at += 1
        else:
            acts, why = shorter, again[1]
    return Broken(seed, size, acts, why)
