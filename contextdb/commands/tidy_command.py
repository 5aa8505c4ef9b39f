"""Show a table with fewer cells that gives the same answers: rows of one asset join, and cells that exclude nothing become Any.

Valid assets, picks and their chances stay the same in every context that can happen, which is proved before anything is shown.
Exits with 1 if there is something to tidy and --write is not given, with 0 if there is not, or it was written.

  contextdb tidy tables/locomotion.csv
  contextdb tidy locomotion --write
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from functools import cached_property

from contextdb.cells.grammar import format_cell
from contextdb.cells.sets import Accepted, Cell, NumberSet, ValueSet, complement, meet_exactly, union
from contextdb.checks.effects import effects
from contextdb.columns import TextColumn
from contextdb.commands import add_format_arguments, deliver, is_coloured
from contextdb.commands.diff_views import as_markdown, as_text
from contextdb.compiled.choosing import Choosing
from contextdb.compiled.table import data_of
from contextdb.console import ExitCode, note, printable
from contextdb.covering.assumed import opened
from contextdb.covering.points import PointFinder
from contextdb.covering.progress import SILENT, Progress
from contextdb.edits.diffing import diff
from contextdb.errors import Fault, Place, TableError, in_quotes, plural
from contextdb.report.render_json import as_json
from contextdb.schema.policies import PLACE, POLICIES
from contextdb.tables.nesting.links import is_nested
from contextdb.tables.places import table_path
from contextdb.tables.project import load_table
from contextdb.tables.table import Table


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("table", metavar="TABLE", help="a .csv or .parquet file, or the name of a table")
    parser.add_argument("--write", action="store_true", help="write the table; only lines that change are rewritten")
    add_format_arguments(parser, ("text", "markdown", "json"))
    parser.add_argument("--all", action="store_true", help="print every difference, not the first of each kind")


def run(arguments: argparse.Namespace) -> ExitCode:
    before = load_table(table_path(arguments.table))
    after = tidied(before)
    changes = diff(before, after)
    cells = {"before": n_cells(before), "after": n_cells(after)}
    if arguments.format == "json":
        text = as_json(changes.to_json() | {"cells_saying_something": cells, "written": bool(arguments.write and changes)})
    elif not changes:
        text = printable(f"{before.name}: no row or cell can be left out.") + "\n"
    elif arguments.format == "markdown":
        text = as_markdown(changes, arguments.all)
    else:
        text = as_text(changes, is_coloured(arguments), arguments.all)
        text += f"\n{plural(cells['before'], 'cell')} that say something become {cells['after']:,}, with the same answers.\n"
    if arguments.write and changes:
        after.save()
    deliver(text, arguments)
    if changes and not arguments.write:
        note("--write writes it.")
    return ExitCode.FOUND if changes and not arguments.write else ExitCode.OK


def n_cells(table: Table) -> int:
    """How many cells of conditions are not Any."""
    return sum(not column.cells[int(code)].is_any for column in table.conditions for code in column.texts.codes.tolist())


# ---- a table with fewer cells that gives the same answers, in every context that can happen
#
#     a row goes      it holds nothing that an earlier row of the same asset and data does not hold, where the first row plays
#     two rows join   they have the same asset and data, and differ in one condition, whose cells become their union
#     a cell is Any   what is assumed, or derived, rules out all contexts in which it would exclude the row
#
# What is picked stays the same too. So rows of one asset that may be valid at once are two chances, and stay where chance decides;
# where the first row plays, no other row may come between; where cells count (policy "specific") they stay; and a row that rests
# stays by itself. Sets of tags do not join. `contextdb.checks.effects` proves the whole again.


WORK = 20_000_000
EFFECTS = 100_000
"""So many changed assets are proved again."""


def tidied(table: Table, progress: Progress = SILENT) -> Table:
    """The table with fewer cells; the same table where there is nothing to leave out.

    Raises TableError where cells cannot be read, rows refer to tables, or the rows of a base are in another file.
    """
    _require_own_rows(table)
    work = _Tidying(table, progress)
    work.join_rows()
    work.drop_cells()
    after = work.result
    if after is not table and effects(table, after, most=EFFECTS):
        raise TableError(Fault("the answers would change, which is an error of contextdb; nothing is written."))
    return after if after is table else tidied(after, progress)  # joined rows may be joined with more


def _require_own_rows(table: Table) -> None:
    why = "rows refer to tables" if is_nested(table) else "it has rows of a base" if table.settings.base is not None else ""
    if why:
        place = Place(str(table.path) if table.path else None)
        raise TableError(
            Fault(f"the table {in_quotes(table.name)} cannot be tidied: {why}.", "those tables themselves", place=place)
        )


Cells = tuple[Cell, ...]


@dataclass(eq=False)
class _Tidying:
    """The rows of a table, some of which join, and the cells that change."""

    table: Table
    progress: Progress
    cells: dict[int, Cells] = field(init=False)
    """The cells of each row that is left, one for each condition."""

    def __post_init__(self) -> None:
        if self.table.faults:
            raise TableError(*self.table.faults)
        columns = self.table.conditions
        rows = range(self.table.n_rows)
        self.cells = {row: tuple(column.cells[int(column.texts.codes[row])] for column in columns) for row in rows}

    @cached_property
    def _choosing(self) -> Choosing:
        return data_of(self.table.compile()).once(Choosing.of)

    @cached_property
    def _is_first(self) -> bool:
        return PLACE in POLICIES[self.table.settings.policy].ranked_by

    @cached_property
    def _counts_cells(self) -> bool:
        return POLICIES[self.table.settings.policy].needs_specificities

    def _data(self, row: int) -> tuple[object, ...] | None:
        """What two rows must have in common to join; None where a row stays by itself."""
        limits = self._choosing.limits
        if not self.table.enabled[row] or (limits is not None and limits.of_row[0, row] >= 0):
            return None
        names = {column.condition.name for column in self.table.conditions}
        texts = tuple(column[row] for column in self.table.columns if column.name not in names)
        return texts, tuple(cell if cell.is_soft else None for cell in self.cells[row])

    # ---- rows

    def join_rows(self) -> None:
        """Join rows of the same asset and data until none can any more."""
        groups: dict[tuple[object, ...], list[int]] = {}
        for row in self.cells if not self._counts_cells else ():
            if (data := self._data(row)) is not None:
                groups.setdefault(data, []).append(row)
        for rows in groups.values():
            while self._join_one(rows):
                self.progress.check()

    def _join_one(self, rows: list[int]) -> bool:
        for at, i in enumerate(rows):
            for j in rows[at + 1 :]:
                joined = self._joined(i, j)
                if joined is not None and not self._comes_between(i, j):
                    self.cells[i] = joined
                    del self.cells[j]
                    rows.remove(j)
                    return True
        return False

    def _joined(self, i: int, j: int) -> Cells | None:
        """The cells of two rows as those of one; None where no row says so, or it would be picked otherwise."""
        one, other = self.cells[i], self.cells[j]
        differing = [at for at, (a, b) in enumerate(zip(one, other, strict=True)) if a.accepts != b.accepts]
        if not differing:
            return one if self._is_first else None
        at = differing[0]
        if len(differing) > 1 or one[at].is_soft:
            return None
        accepts = self._union(at, one[at].accepts, other[at].accepts)
        return None if accepts is None else (*one[:at], accepts, *one[at + 1 :])

    def _union(self, at: int, one: Accepted | None, other: Accepted | None) -> Cell | None:
        if one is None or other is None:
            return Cell() if self._is_first else None
        if not isinstance(one, (NumberSet, ValueSet)) or not isinstance(other, (NumberSet, ValueSet)):
            return None
        if not self._is_first and not meet_exactly(one, other).is_empty:
            return None
        joined = union(one, other)
        is_all = complement(joined, self.table.conditions[at].condition.domain, is_bounded=False).is_empty
        return Cell(None if is_all else joined)

    def _comes_between(self, i: int, j: int) -> bool:
        """Whether, where the first row plays, another row would lose a context to a row that moves up."""
        return self._is_first and any(i < row < j and self._meet(row, j) for row in self.cells)

    def _meet(self, i: int, j: int) -> bool:
        pairs = ((a.accepts, b.accepts) for a, b in zip(self.cells[i], self.cells[j], strict=True) if not (a.is_soft or b.is_soft))
        return not any(a is not None and b is not None and meet_exactly(a, b).is_empty for a, b in pairs)

    # ---- cells

    def drop_cells(self) -> None:
        """Make cells Any that exclude only what cannot happen, the last columns first."""
        if self._counts_cells:
            return
        plain = replace(self._of_rows(), settings=replace(self.table.settings, when=None, policy="collect"))
        space = opened(plain, progress=self.progress).space
        finder = PointFinder(space, WORK, self.progress)
        boxes = {list(self.cells)[row]: box for row, box in zip(space.rows, space.boxes, strict=True)}
        for row, box in boxes.items():
            self.progress.check()
            for at in reversed(range(len(self.table.conditions))):
                factors = space.of_condition[at]
                cell = self.cells[row][at]
                if cell.accepts is None or cell.is_soft or not factors or any(box[f] == space.full[f] for f in factors):
                    continue
                outside = [(*box[:f], space.full[f] & ~box[f], *box[f + 1 :]) for f in factors]
                finder.is_cut = False
                if all(finder.point(part, finder.impossible) is None for part in outside) and not finder.is_cut:
                    self.cells[row] = (*self.cells[row][:at], Cell(), *self.cells[row][at + 1 :])
                    box = tuple(space.full[f] if f in factors else side for f, side in enumerate(box))

    # ---- the table

    @property
    def result(self) -> Table:
        now = self._of_rows()
        return self.table if now.n_rows == self.table.n_rows and not list(self._edits()) else now

    def _of_rows(self) -> Table:
        taken = self.table.with_rows_taken(list(self.cells)) if len(self.cells) < self.table.n_rows else self.table
        return taken.with_cells(self._edits())

    def _edits(self) -> Iterator[tuple[int, str, str]]:
        """The cells that say something else, by the rows that are left."""
        for at, column in enumerate(self.table.conditions):
            texts: TextColumn = column.texts
            for number, (row, cells) in enumerate(self.cells.items()):
                if cells[at] != column.cells[int(texts.codes[row])]:
                    yield number, column.condition.name, format_cell(cells[at], column.condition.domain)
