"""What a table is: assets (rows) against conditions (columns), as texts and as the cells they mean.

It is never changed: an edit gives a new one that shares every column it did not touch, and with it whatever was already
worked out for that column (its cells, its masks). Texts that cannot be read stay as they are and are in `faults`; only
`compile` insists on none. Nothing here touches the disk.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Self, TypeVar

import numpy as np
from numpy.typing import NDArray

from contextdb.cells.arguments import (
    require_many,
    require_mapping,
    require_place,
    require_row,
    require_text,
    require_whole,
)
from contextdb.cells.conditions import Condition
from contextdb.cells.notebook import as_html, one_line
from contextdb.columns import Framed, TextColumn, frame_of
from contextdb.columns import polars as pl
from contextdb.compiled.outputs import Outputs
from contextdb.compiled.pick_columns import PickColumns, specificities
from contextdb.compiled.unchanging import Unchanging
from contextdb.compiled.ways import Ways
from contextdb.errors import ContextError, Fault, NoSuchRow, Place, TableError, in_quotes, no_such, plural, some
from contextdb.files.texts import AnySource
from contextdb.schema.policies import POLICIES
from contextdb.schema.settings import EMPTY, Schema, TableSettings, plain_names, settings_renamed
from contextdb.schema.table_settings import PLAIN_JOBS, missing_job
from contextdb.tables.condition_column import ConditionColumn
from contextdb.tables.nesting.names import inner_name
from contextdb.tables.plain_columns import OutputColumn, PlainColumns, output_columns, outputs_of

if TYPE_CHECKING:
    from contextdb.expressions.rules import WhenColumn

AnyTable = TypeVar("AnyTable", bound="TableData")


@dataclass(frozen=True, eq=False, repr=False)
class TableData(Framed, Unchanging):
    """Assets against conditions, as texts and as the cells they mean; `Table` has what a table can do besides."""

    name: str
    settings: TableSettings
    columns: tuple[TextColumn, ...]
    """Every column of the file, in its order."""
    conditions: tuple[ConditionColumn, ...]
    """The columns that are conditions, in the file's order."""
    schema: Schema = EMPTY
    path: Path | None = None
    source: AnySource | None = None
    origin: NDArray[np.int64] = field(default_factory=lambda: np.empty(0, np.int64))
    """Which record of the source each row came from; -1 for a new row."""
    around: Mapping[str, TableData] | None = field(default=None, repr=False)
    """The tables of its folder by name, for rows that refer to another table; None where they are not known."""

    @classmethod
    def build(
        cls,
        name: str,
        columns: Sequence[TextColumn],
        schema: Schema = EMPTY,
        settings: TableSettings | None = None,
        path: Path | None = None,
        source: AnySource | None = None,
        before: Mapping[str, ConditionColumn] | None = None,
    ) -> Self:
        """A table of texts under a schema; cells that cannot be read are kept and are in its `faults`.

        `before`: the same columns in another version of the table, by name; what is known of them is not worked out again. Raises
        TableError where a column that the settings name is missing, or two columns have one name.
        """
        settings = settings or TableSettings(name=name)
        if settings.base is not None:
            settings = _of_variant(settings, columns)
        _require_columns(columns, settings, path)
        conditions = conditions_of(columns, schema, settings, before or {})
        n_rows = columns[0].n_rows if columns else 0
        return cls(name, settings, tuple(columns), conditions, schema, path, source, np.arange(n_rows))

    @property
    def n_rows(self) -> int:
        """The number of rows."""
        return self.columns[0].n_rows if self.columns else 0

    def __len__(self) -> int:
        return self.n_rows

    def __getitem__(self, row: int) -> dict[str, str]:
        """The texts of a row by column; NoSuchPlace, also an IndexError, for a row that the table does not have."""
        at = require_place(row, self.n_rows, "row")
        return {column.name: column[at] for column in self.columns}

    def __iter__(self) -> Iterator[dict[str, str]]:
        return (self[row] for row in range(self.n_rows))

    def to_polars(self) -> pl.DataFrame:
        """The texts of all cells as a DataFrame, which `Table.from_columns` takes."""
        texts = {column.name: column.to_list() for column in self.columns}
        return frame_of(texts, texts)

    def __repr__(self) -> str:
        size = f"{plural(self.n_rows, 'row')} x {plural(len(self.conditions), 'condition')}"
        return one_line(type(self).__name__, self.name, size)

    def _repr_html_(self) -> str:
        heads = [column.name for column in self.columns]
        rows = ([column[row] for column in self.columns] for row in range(self.n_rows))
        return as_html(repr(self), heads, rows, self.n_rows)

    @property
    def assets(self) -> list[str]:
        """The asset of each row."""
        return self.text_column(self.asset_column).once(TextColumn.to_list) if self.columns else []

    @property
    def asset_column(self) -> str:
        """The name of the column that names the assets."""
        return self.settings.asset or (self.columns[0].name if self.columns else "")

    def text_column(self, name: str) -> TextColumn:
        """The texts of a column; raises TableError, with the nearest, for one that the table does not have."""
        return self.columns[self._column_at(name)]

    def condition(self, name: str) -> ConditionColumn:
        """The column of a condition; raises TableError, with the nearest, for one that the table does not have."""
        require_text(name, "name")
        for column in self.conditions:
            if column.condition.name == name:
                return column
        raise TableError(_no_such("condition", name, [c.condition.name for c in self.conditions]))

    def text(self, row: int, column: str) -> str:
        """The text of one cell; raises NoSuchPlace, also an IndexError, for a row that the table does not have."""
        return self.text_column(column)[require_row(row, self.n_rows)]

    def place(self, row: int, column: str | None = None) -> Place:
        """Where a row is: its file and line where it has one, else its number. Raises ContextError for no whole
        number; a row that there is not has no line."""
        row = require_whole(row, "row")
        file = str(self.path) if self.path else None
        record = int(self.origin[row]) if self.source is not None and row < len(self.origin) else -1
        line = self.source.line(record) if self.source is not None and record >= 0 else None
        return Place(file, line, column, row)

    @cached_property
    def faults(self) -> list[Fault]:
        """Every cell that cannot be read, in the order of rows."""
        return self._in_order(())

    def _in_order(self, more: Iterable[Fault]) -> list[Fault]:
        """The faults of cells, and others that have their places already, in the order of rows."""
        faults = [
            (row, at, replace(fault, mend=mend) if mend else fault)
            for at, column in enumerate(self.conditions)
            for mend in ["" if column.condition.is_declared else missing_job(column.condition.name, vars(self.settings))]
            for row, fault in column.faulty_rows()
        ]
        faults += [
            (row, -1, fault.at(self.place(row, fault.place.column))) for row, fault in (*self._plain.faults, *self._output_faults)
        ]
        if self.when is not None:
            faults += [(row, -1, fault.at(self.place(row, self.when.name))) for row, fault in self.when.faulty_rows()]
        faults += [(fault.place.row or 0, -1, fault) for fault in more]
        names = [c.condition.name for c in self.conditions]
        faults.sort(key=lambda item: item[:2])
        return [f if at < 0 else f.at(self.place(row, names[at])) for row, at, f in faults]

    def with_cell(self, row: int, column: str, text: str) -> Self:
        """The table with one cell changed; every other column is shared. Raises what `with_cells` raises."""
        return self.with_cells([(row, column, text)])

    def with_cells(self, edits: Iterable[tuple[int, str, str]]) -> Self:
        """The table with some cells changed, given as (row, column, text). Raises NoSuchRow or TableError where there is no such
        row, or no such column; ContextError where an edit is no row, column and text."""
        changed: dict[int, TextColumn] = {}
        accepted = "a row, a column and a text for each cell"
        for edit in require_many(edits, "edits", accepted):
            if not isinstance(edit, (tuple, list)) or len(edit) != 3:
                raise ContextError(Fault("edits contain something that is not an edit.", accepted))
            row, name, text = require_whole(edit[0], "row"), edit[1], require_text(edit[2], "text")
            at = self._column_at(name)
            if not 0 <= row < self.n_rows:
                raise NoSuchRow(self._no_row(row))
            changed[at] = changed.get(at, self.columns[at]).with_text(row, text)
        return with_columns(self, [changed.get(i, c) for i, c in enumerate(self.columns)], self.origin)

    def with_rows(self, at: int, rows: Sequence[Mapping[str, str]]) -> Self:
        """The table with new rows before row `at`; columns that a row leaves out are empty (Any). Raises NoSuchRow or TableError
        where there is no such place, or no such column; ContextError where a row is no mapping of columns to texts."""
        at, rows = require_whole(at, "at"), list(require_many(rows, "rows", "a list of mappings of columns to texts"))
        for row in rows:
            for name, text in require_mapping(row, "a row of rows", "a mapping of columns to texts").items():
                self._column_at(name)
                require_text(text, f"the text for {in_quotes(name)}")
        if not 0 <= at <= self.n_rows:
            raise NoSuchRow(Fault(f"there is no row {at}.", f"0 to {self.n_rows}, to insert before"))
        columns = [c.with_inserted(at, [row.get(c.name, "") for row in rows]) for c in self.columns]
        return with_columns(self, columns, np.insert(self.origin, at, np.full(len(rows), -1)))

    def with_rows_taken(self, rows: Sequence[int] | NDArray[np.int64]) -> Self:
        """The table of the given rows in the given order: deletes, moves, sorts. Raises NoSuchRow where there is no such row,
        ContextError where `rows` are no whole numbers."""
        numbers = rows.tolist() if isinstance(rows, np.ndarray) else require_many(rows, "rows", "a list of row numbers")
        numbers = [require_whole(row, "a row of rows") for row in require_many(numbers, "rows", "a list of row numbers")]
        if wrong := [row for row in numbers if not 0 <= row < self.n_rows]:
            raise NoSuchRow(self._no_row(wrong[0]))
        taken = np.array(numbers, np.int64)
        return with_columns(self, [c.with_rows_taken(taken) for c in self.columns], self.origin[taken])

    @property
    def _ways(self) -> Ways | None:
        """The way of each row through tables inside tables, for a table that was made of several; else None."""
        return None

    @property
    def enabled(self) -> NDArray[np.bool_]:
        """Whether each row may match at all: bool [n_rows]."""
        return self._plain.enabled

    @property
    def priorities(self) -> NDArray[np.int64]:
        """The priority of each row, higher first: int64 [n_rows]; 0 without a priority column."""
        return self._plain.priorities

    @property
    def row_weights(self) -> NDArray[np.float64]:
        """The weight of each row in a random pick: float64 [n_rows]; 1 without a weight column."""
        return self._plain.weights

    @cached_property
    def _picking(self) -> PickColumns:
        """How specific the rows are, where the policy asks for it, and how long they rest after they were picked."""
        if not POLICIES[self.settings.policy].needs_specificities:
            return self._plain.resting
        columns = [(c.condition, c.cells, c.texts.codes) for c in self.conditions]
        has_rule = None if self.when is None else self.when.has_rule
        return replace(self._plain.resting, specificities=specificities(columns, has_rule, self.n_rows))

    @cached_property
    def _output_columns(self) -> tuple[OutputColumn, ...]:
        return output_columns(self.columns, self.settings)

    @cached_property
    def outputs(self) -> Outputs:
        """What the rows give the game besides their assets, to be read by row."""
        return outputs_of(self._output_columns, self.settings)

    @property
    def _output_faults(self) -> Iterator[tuple[int, Fault]]:
        """The cells of outputs that cannot be read; a row that refers to a table may leave them empty,
        and one of a variant, which inherits them."""
        if any(column.faults for column in self._output_columns):
            texts = self.text_column(self.asset_column)
            refers = np.array([inner_name(text) is not None for text in texts.texts], np.bool_)
            is_left = refers[texts.codes] | (self.settings.base is not None)
            may_be_empty = frozenset(np.flatnonzero(is_left).tolist())
            for column in self._output_columns:
                yield from column.faulty_rows(may_be_empty)

    @cached_property
    def when(self) -> WhenColumn | None:
        """The rows' own rules; None without a `when` column."""
        if self.settings.when is None:
            return None
        from contextdb.expressions.rules import WhenColumn

        return WhenColumn.read(self.text_column(self.settings.when), known_conditions(self))

    @cached_property
    def _plain(self) -> PlainColumns:
        return PlainColumns.read(self.columns, self.settings)

    def _no_row(self, row: int) -> Fault:
        accepted = f"rows 0 to {self.n_rows - 1}" if self.n_rows else "no row: the table is empty"
        return Fault(f"there is no row {row}.", accepted)

    def _column_at(self, name: str) -> int:
        require_text(name, "column")
        if name in self._places:
            return self._places[name]
        raise TableError(_no_such("column", name, [c.name for c in self.columns]))

    @cached_property
    def _places(self) -> dict[str, int]:
        """Where each column is, by its name; of several of one name the first."""
        return {column.name: at for at, column in reversed([*enumerate(self.columns)])}


def known_conditions(table: TableData) -> dict[str, Condition]:
    """The conditions that rules may name: those of the table, and all that are declared."""
    return {**table.schema.conditions, **{c.condition.name: c.condition for c in table.conditions}}


def picking_of(table: TableData) -> PickColumns:
    """How specific the rows of a table are, where the policy asks for it, and how long they rest after they were picked."""
    return table._picking


def removed_rows(table: TableData) -> NDArray[np.bool_]:
    """Whether each row takes that of the base out, where the table is a variant: bool [n_rows]."""
    removed = table._plain.removed
    return np.zeros(table.n_rows, np.bool_) if removed is None else removed


def output_columns_of(table: TableData) -> tuple[OutputColumn, ...]:
    """The columns of a table's outputs, in the order of the settings."""
    return table._output_columns


def require_readable(table: TableData) -> None:
    """Raise TableError with every cell that cannot be read, if there is one."""
    if table.faults:
        raise TableError(*table.faults)


def conditions_of(
    columns: Sequence[TextColumn], schema: Schema, settings: TableSettings, before: Mapping[str, ConditionColumn]
) -> tuple[ConditionColumn, ...]:
    """Those of some columns that are conditions; what is known of them from `before` is not worked out again."""
    plain, declared = plain_names(settings, columns), schema.conditions
    return tuple(ConditionColumn.like(before.get(c.name), c, declared.get(c.name)) for c in columns if c.name not in plain)


def with_columns(table: AnyTable, columns: Sequence[TextColumn], origin: NDArray[np.int64]) -> AnyTable:
    """The table with other texts in the same columns, and where its rows then came from."""
    now = {c.name: c for c in columns}
    conditions = tuple(c if now[c.condition.name] is c.texts else c.with_texts(now[c.condition.name]) for c in table.conditions)
    after = replace(table, columns=tuple(columns), conditions=conditions, origin=origin)
    jobs = [name for job in PLAIN_JOBS if (name := getattr(table.settings, job)) is not None]
    if after.n_rows == table.n_rows and all(now[name] is table.text_column(name) for name in jobs):
        after.__dict__["_plain"] = table._plain
    after.__dict__["_output_columns"] = tuple(column.with_texts(now[column.output.name]) for column in table._output_columns)
    return after


def _no_such(what: str, name: str, known: list[str]) -> Fault:
    return no_such(what, name, known, some(known) or f"no {what}: there is none")


def _of_variant(settings: TableSettings, columns: Sequence[TextColumn]) -> TableSettings:
    """The settings of a variant without jobs of columns that its file leaves to the base."""
    present = settings_renamed(settings, {c.name: c.name for c in columns}.get)
    return replace(present, asset=settings.asset, remove=settings.remove)


def _require_columns(columns: Sequence[TextColumn], settings: TableSettings, path: Path | None) -> None:
    names = [c.name for c in columns]
    place = Place(str(path) if path else None)
    faults = [
        Fault(f"the column name {in_quotes(n)} appears twice.", "each name once", place=place)
        for n in sorted(n for n, count in Counter(names).items() if count > 1)
    ]
    for key, name in settings.jobs:
        if name not in names:
            fault = _no_such("column", name, names)
            faults.append(replace(fault, found=f"{fault.found[:-1]}, which [tables.{settings.name}] names as {key}.", place=place))
    if faults:
        raise TableError(*faults)
