"""Autofill: what the clips of the project give to the open table, as a preview; then what is empty is filled, or all is.

Nothing is changed here: the dialog gives back an `Autofill`, whose edit the sheet makes as one step.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import ClassVar

from textual import on, work
from textual.app import ComposeResult
from textual.binding import Binding, BindingType
from textual.content import Content
from textual.widgets import Static
from textual.worker import Worker, get_current_worker

from contextdb.authoring.clip_folder import Tell
from contextdb.authoring.described_table import ClipRows, Difference, Filling, filling, rows_for
from contextdb.errors import ContextDBError, plural, some
from contextdb.motion.preparing.cells_of_clips import CONDITIONS, reason
from contextdb.motion.preparing.clip_facts import ClipFacts
from contextdb.tables.table import Table

from ..model.clip_cells import ClipCells
from ..model.sheet import Done, Sheet
from ..widgets.line_list import LineList, ListCell, ListColumn
from .dialog import Dialog


class Stopped(Exception):
    """The dialog was left."""


@dataclass(frozen=True)
class Autofill:
    """What the dialog gives back: the clips, and whether they replace cells that say otherwise."""

    clips: ClipRows
    updates: bool

    def fill(self, sheet: Sheet) -> Done:
        """Fill the table as it is now, as one step, and mark the cells that say what their clips say. Raises ContextDBError where
        the conditions are declared so that the cells cannot be read, or another cell of the table cannot be."""
        fills = filling(sheet.table, self.clips.rows)
        edit = fills.edit(updates=self.updates)
        refused = frozenset((each.asset, each.column, each.cell) for each in fills.differences)
        sheet.clips = ClipCells(fills.cells, refused)
        done = sheet.apply(edit) if edit.changes else Done(notes=("Nothing is empty.",))
        notes = list(done.warnings)
        if fills.differences and not self.updates:
            n = len(fills.differences)
            notes.append("1 cell says otherwise than its clip." if n == 1 else f"{n:,} cells say otherwise than their clips.")
        if not sheet.table.schema.databases:
            notes.append('No database is declared: "contextdb motion describe --into" declares one for the clips.')
        return replace(done, warnings=tuple(notes))


@dataclass(frozen=True)
class Line:
    """What is done with a cell, or with a row that is new."""

    what: str
    place: str
    asset: str
    column: str
    now: str
    clip: str
    why: str


class AutofillDialog(Dialog[Autofill]):
    """Fill the table from its clips."""

    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("a", "take(True)", "Fill all cells", show=False),
        Binding("e", "take(False)", "Fill empty cells", show=False),
    ]
    DEFAULT_CSS = """
    AutofillDialog {
        & > #dialog { width: 110; height: 92%; }
        & > #dialog > #dialog-body { height: 1fr; }
        &.-refused > #dialog, &.-refused > #dialog > #dialog-body { height: auto; }
        & #autofill-about { height: auto; max-height: 4; }
        & #autofill-lines { height: 1fr; margin: 1 0; }
        & #autofill-why { height: auto; max-height: 5; }
        & #autofill-detail { height: auto; max-height: 4; color: $text-muted; }
    }
    """
    title_text = "Autofill from clips"
    keys_text = "↑↓ · Enter fill empty cells · A also cells that differ · Esc cancel"

    def __init__(self, table: Table, folder: Path) -> None:
        """`folder` is that of contextdb.toml."""
        super().__init__()
        self.table, self.folder = table, folder
        self.clips: ClipRows | None = None
        self.lines: list[Line] = []

    def compose_body(self) -> ComposeResult:
        """What is done by column, then cell by cell."""
        yield Static("Reading the clips …", id="autofill-about", markup=False)
        columns = [
            ListColumn("", 8),
            ListColumn("Row", 6, 0, True),
            ListColumn("Asset", 20, 2, is_name=True),
            ListColumn("Column", 12, 1, is_name=True),
        ]
        columns += [ListColumn("Now", 12, 1), ListColumn("Clip", 14, 1, is_name=True)]
        yield LineList(columns, empty="", id="autofill-lines")
        yield Static(id="autofill-why", markup=False)
        yield Static(id="autofill-detail", markup=False)

    def on_mount(self) -> None:
        self.query_one(LineList).focus()
        self._worker = self._describe()

    def action_cancel(self) -> None:
        self._worker.cancel()
        self.dismiss(None)

    # ---- the work

    @work(thread=True, exclusive=True)
    def _describe(self) -> None:
        worker = get_current_worker()
        try:
            result: ClipRows | ContextDBError = rows_for(self.folder, self.table.path, lambda label: self._telling(label, worker))
        except Stopped:
            return
        except ContextDBError as error:
            result = error
        if not worker.is_cancelled:
            self.app.call_from_thread(self._take, result)

    @contextmanager
    def _telling(self, label: str, worker: Worker[None]) -> Iterator[Tell]:
        def tell(done: int, total: int, clip: str) -> None:
            if worker.is_cancelled:
                raise Stopped
            self.app.call_from_thread(self._about, f"{label.capitalize()}: {done} of {total}, {clip}")

        yield tell

    def _about(self, text: str) -> None:
        self.query_one("#autofill-about", Static).update(text)

    def _take(self, result: ClipRows | ContextDBError) -> None:
        if isinstance(result, ContextDBError):
            self.query_one("#autofill-about", Static).update(Content.styled(f"✗ {result}", "$text-error"))
            self.query_one(LineList).display = False
            self.query_one("#dialog").border_subtitle = "Esc close"
            self.add_class("-refused")
            return
        self.clips = result
        fills = filling(self.table, result.rows)
        self.lines = list(_lines(fills, {row.asset: row.facts for row in result.rows}))
        self._about(_summary(fills))
        self.query_one("#autofill-detail", Static).update("\n".join(_notes(result, fills)))
        self.query_one(LineList).show(len(self.lines), lambda at: _cells(self.lines[at]), 0)

    @on(LineList.Moved)
    def _moved(self, event: LineList.Moved) -> None:
        event.stop()
        self.query_one("#autofill-why", Static).update(self.lines[event.index].why if self.lines else "")

    # ---- the answer

    @on(LineList.Chosen)
    def _chosen(self) -> None:
        self.action_take(False)

    def action_take(self, updates: bool) -> None:
        """Give back what is to be done, once it is known."""
        if self.clips is not None:
            self.dismiss(Autofill(self.clips, updates))


def _lines(fills: Filling, facts: Mapping[str, ClipFacts]) -> Iterator[Line]:
    """What differs first, then what is empty, row by row, then the rows that are new."""
    by_row: Callable[[Difference], int] = lambda each: each.row  # noqa: E731
    for what, differences in (("differs", fills.differences), ("fill", fills.empty)):
        for each in sorted(differences, key=by_row):
            why = f"{each.column}: {reason(facts[each.asset], each.column, each.clip)}."
            yield Line(what, f"{each.row + 1:,}", each.asset, each.column, each.cell, each.clip, why)
    for row in fills.added:
        known = [f"{name}: {reason(row.facts, name, cell)}" for name, cell in row.cells.items() if name in CONDITIONS and cell]
        cells = ", ".join(filter(None, row.cells.values()))
        yield Line("new row", "", row.asset, "", "", cells, "No row names this clip." if not known else "\n".join(known))


def _cells(line: Line) -> Sequence[ListCell]:
    tone = "warning" if line.what == "differs" else "info" if line.what == "new row" else ""
    return (line.what, tone), line.place, line.asset, line.column, (line.now, tone), line.clip


def _summary(fills: Filling) -> str:
    """What is done, by column."""
    if not (fills.differences or fills.empty or fills.added):
        return "Every cell accepts what its clip shows; nothing is empty."
    empty, differs = (Counter(each.column for each in cells) for cells in (fills.empty, fills.differences))
    parts = []
    for column in dict.fromkeys([*empty, *differs, *fills.new_columns]):
        counts = [f"{empty[column]} empty"] * bool(empty[column]) + [f"{differs[column]} differ"] * bool(differs[column])
        parts.append(f"{column}{' (new)' if column in fills.new_columns else ''}: {', '.join(counts) or 'no cell'}")
    rows = [plural(len(fills.added), "new row")] if fills.added else []
    return " · ".join([*parts, *rows])


def _notes(clips: ClipRows, fills: Filling) -> Iterator[str]:
    """What was taken for granted or left out."""
    if fills.without_clip:
        yield f"No clip for {plural(len(fills.without_clip), 'row')}: {some(fills.without_clip)}"
    yield from fills.notes
    yield from clips.source.notes
    yield from (f"left out: {message}" for message in clips.source.left_out)
