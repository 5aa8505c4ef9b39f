"""A table: assets (rows) against conditions (columns), as texts and as the cells they mean.

A Table is never changed: an edit gives a new one that shares every column it did not touch, and with it whatever was already
worked out for that column (its cells, its masks). Texts that cannot be read stay as they are and are in `faults`; only
`compile` insists on none. Nothing here touches the disk; `load` and `Table.save` call the modules that do.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from contextdb.arguments import require_kind, require_many, require_mapping, require_path, require_row, require_text, require_whole
from contextdb.columns import TextColumn
from contextdb.condition_column import ConditionColumn
from contextdb.conditions import Condition, infer_condition
from contextdb.errors import ContextError, Fault, Place, SchemaError, TableError, in_quotes, nearest, some
from contextdb.plain_columns import PlainColumns
from contextdb.schema import EMPTY, Schema, TableSettings, conditions_from_dict, expression_faults
from contextdb.unchanging import Unchanging
from contextdb.when import WhenColumn

if TYPE_CHECKING:
    from contextdb.compiled import CompiledTable
    from contextdb.files import AnySource


@dataclass(frozen=True, eq=False)
class Table(Unchanging):
    """Assets and their conditions. Get one from `cdb.load`, `Table.from_columns` or a `Project`."""

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
    around: Mapping[str, Table] | None = field(default=None, repr=False)
    """The tables of its folder by name, for rows that refer to another table; None where they are not known."""

    @classmethod
    def from_columns(
        cls,
        columns: Mapping[str, Sequence[str]],
        schema: Mapping[str, Mapping[str, object]] | Schema | None = None,
        settings: TableSettings | None = None,
        name: str | None = None,
    ) -> Table:
        """Build a table from texts.

        Parameters
        ----------
        columns : mapping of str to sequence of str
            The cells of each column, equally many; the first column names the assets unless `settings.asset` says otherwise.
        schema : mapping, optional
            The contents of `[conditions.NAME]` in contextdb.toml: `{"speed": {"type": "number"}}`. Others are inferred.
        settings : contextdb.schema.TableSettings, optional
            The contents of `[tables.NAME]` in contextdb.toml.
        name : str, optional
            The name of the table. Default: that of the settings, or "table".

        Raises
        ------
        SchemaError
            The schema is invalid.
        TableError
            Columns of unequal length, or cells that cannot be read.
        """
        if not isinstance(schema, Schema):
            schema = {} if schema is None else require_mapping(schema, "schema", 'a mapping: {"speed": {"type": "number"}}')
            schema = replace(EMPTY, conditions=conditions_from_dict(schema))
            if faults := list(expression_faults(schema)):
                raise SchemaError(*faults)
        if settings is not None:
            require_kind(settings, TableSettings, "settings", "a contextdb.schema.TableSettings")
        name = require_text(name, "name") if name is not None else settings.name if settings is not None else "table"
        for n, values in require_mapping(columns, "columns", 'a mapping: {"Asset Name": [...], "speed": [...]}').items():
            require_many(values, f"the column {in_quotes(require_text(n, 'a name of columns'))}", "a list of texts")
        texts = [TextColumn.of(n, map(str, values)) for n, values in columns.items()]
        lengths = {c.name: c.n_rows for c in texts}
        if len(set(lengths.values())) > 1:
            raise TableError(Fault(f"the columns are not equally long: {lengths}.", "one text for each row in every column"))
        table = build_table(name, texts, schema, settings)
        table.require_readable()
        return table

    @property
    def n_rows(self) -> int:
        """The number of rows."""
        return self.columns[0].n_rows if self.columns else 0

    def __len__(self) -> int:
        return self.n_rows

    @cached_property
    def assets(self) -> list[str]:
        """The asset of each row."""
        return self.text_column(self.asset_column).to_list() if self.columns else []

    @property
    def asset_column(self) -> str:
        """The name of the column that names the assets."""
        return self.settings.asset or (self.columns[0].name if self.columns else "")

    def text_column(self, name: str) -> TextColumn:
        """The texts of a column."""
        return self.columns[self._column_at(name)]

    def condition(self, name: str) -> ConditionColumn:
        """The column of a condition."""
        require_text(name, "name")
        for column in self.conditions:
            if column.condition.name == name:
                return column
        raise TableError(_no_such("condition", name, [c.condition.name for c in self.conditions]))

    def text(self, row: int, column: str) -> str:
        """The text of one cell; raises NoSuchPlace, also an IndexError, for a row that the table does not have."""
        return self.text_column(column)[require_row(row, self.n_rows)]

    def place(self, row: int, column: str | None = None) -> Place:
        """Where a row is: its file and line where it has one, else its number."""
        row = require_whole(row, "row")
        file = str(self.path) if self.path else None
        record = int(self.origin[row]) if self.source is not None and row < len(self.origin) else -1
        line = self.source.line(record) if self.source is not None and record >= 0 else None
        return Place(file, line, column, row)

    @cached_property
    def faults(self) -> list[Fault]:
        """Every cell that cannot be read, in the order of rows."""
        found = [(row, at, fault) for at, column in enumerate(self.conditions) for row, fault in column.faulty_rows()]
        found += [(row, -1, fault) for row, fault in self._plain.faults]
        if self.when is not None:
            found += [(row, -1, fault.at(self.place(row, self.when.name))) for row, fault in self.when.faulty_rows()]
        if self.around is not None:
            from contextdb.nesting.links import nesting_faults

            found += [(fault.place.row or 0, -1, fault) for fault in nesting_faults(self, self.around)]
        names = [c.condition.name for c in self.conditions]
        found.sort(key=lambda item: item[:2])
        return [f if at < 0 else f.at(self.place(row, names[at])) for row, at, f in found]

    def require_readable(self) -> None:
        """Raise TableError with every cell that cannot be read, if there is one."""
        if self.faults:
            raise TableError(*self.faults)

    def with_cell(self, row: int, column: str, text: str) -> Table:
        """The table with one cell changed; every other column is shared."""
        return self.with_cells([(row, column, text)])

    def with_cells(self, edits: Iterable[tuple[int, str, str]]) -> Table:
        """The table with some cells changed, given as (row, column, text)."""
        changed: dict[int, TextColumn] = {}
        accepted = "a row, a column and a text for each cell"
        for edit in require_many(edits, "edits", accepted):
            if not isinstance(edit, (tuple, list)) or len(edit) != 3:
                raise ContextError(Fault("edits contain something that is not an edit.", accepted))
            row, name, text = require_whole(edit[0], "row"), edit[1], require_text(edit[2], "text")
            at = self._column_at(name)
            if not 0 <= row < self.n_rows:
                raise TableError(self._no_row(row))
            changed[at] = changed.get(at, self.columns[at]).with_text(row, text)
        return self._with_columns([changed.get(i, c) for i, c in enumerate(self.columns)], self.origin)

    def with_rows(self, at: int, rows: Sequence[Mapping[str, str]]) -> Table:
        """The table with new rows before row `at`; columns that a row leaves out are empty (Any)."""
        at, rows = require_whole(at, "at"), list(require_many(rows, "rows", "a list of mappings of columns to texts"))
        for row in rows:
            for name, text in require_mapping(row, "a row of rows", "a mapping of columns to texts").items():
                self._column_at(name)
                require_text(text, f"the text for {in_quotes(name)}")
        if not 0 <= at <= self.n_rows:
            raise TableError(Fault(f"there is no row {at}.", f"0 to {self.n_rows}, to insert before"))
        columns = [c.with_inserted(at, [row.get(c.name, "") for row in rows]) for c in self.columns]
        return self._with_columns(columns, np.insert(self.origin, at, np.full(len(rows), -1)))

    def with_rows_taken(self, rows: Sequence[int] | NDArray[np.int64]) -> Table:
        """The table of the given rows in the given order: deletes, moves, sorts."""
        numbers = rows.tolist() if isinstance(rows, np.ndarray) else require_many(rows, "rows", "a list of row numbers")
        numbers = [require_whole(row, "a row of rows") for row in require_many(numbers, "rows", "a list of row numbers")]
        if wrong := [row for row in numbers if not 0 <= row < self.n_rows]:
            raise TableError(self._no_row(wrong[0]))
        taken = np.array(numbers, np.int64)
        return self._with_columns([c.with_rows_taken(taken) for c in self.columns], self.origin[taken])

    def save(self, path: str | Path | None = None, overwrite: bool = False) -> Table:
        """Write the table atomically; only edited lines change. Returns the table as it is on disk.

        Changes that others wrote to its file since it was read are merged, cell by cell. A deleted file is created again.

        Parameters
        ----------
        path : str or Path, optional
            Another file, which is overwritten. Default: the file that the table was read from.
        overwrite : bool
            Also overwrite what others wrote to the table's own file.

        Raises
        ------
        FileError
            The disk refuses, or others changed the same cells differently (rule "merge-conflict", with the cells). The old file is
            then whole.
        """
        from contextdb.saving import save_table

        target = require_path(path) if path is not None else self.path
        if target is None:
            raise TableError(Fault(f"the table {in_quotes(self.name)} has no file yet.", "save(path)"))
        return save_table(self, target, overwrite)

    def compile(self, tables: Mapping[str, Table] | None = None) -> CompiledTable:
        """Compile into masks. Columns that were compiled before, in this table or one it was edited from, are not compiled again.

        Parameters
        ----------
        tables : mapping of str to Table, optional
            The tables that rows `@name` refer to. Default: those of the table's folder.

        Raises
        ------
        TableError
            Cells that cannot be read, all of them; in tables inside the table too.
        """
        from contextdb.compiled import CompiledTable

        self.require_readable()
        return CompiledTable.of(self.flat(tables))

    def flat(self, tables: Mapping[str, Table] | None = None) -> Table:
        """The table with the rows of its inner tables in place of those that refer to them: the rows that a query answers with.
        The table itself where no row refers to a table. `tables` and what is raised as in `compile`."""
        from contextdb.nesting.links import is_nested

        if tables is not None:
            for table in require_mapping(tables, "tables", "a mapping of names to tables").values():
                require_kind(table, Table, "a table of tables", "a Table")
        if not is_nested(self):
            return self
        return self._flat if tables is None else flat_table(self, tables)

    @cached_property
    def _flat(self) -> Table:
        return flat_table(self, self.around)

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
    def when(self) -> WhenColumn | None:
        """The rows' own rules; None without a `when` column."""
        if self.settings.when is None:
            return None
        return WhenColumn.read(self.text_column(self.settings.when), self.known_conditions)

    @property
    def known_conditions(self) -> dict[str, Condition]:
        """The conditions that rules may name: those of the table, and all that are declared."""
        return {**self.schema.conditions, **{c.condition.name: c.condition for c in self.conditions}}

    @cached_property
    def _plain(self) -> PlainColumns:
        return PlainColumns.read(self)

    def _no_row(self, row: int) -> Fault:
        accepted = f"rows 0 to {self.n_rows - 1}" if self.n_rows else "no row: the table is empty"
        return Fault(f"there is no row {row}.", accepted)

    def _column_at(self, name: str) -> int:
        require_text(name, "column")
        for at, column in enumerate(self.columns):
            if column.name == name:
                return at
        raise TableError(_no_such("column", name, [c.name for c in self.columns]))

    def _with_columns(self, columns: Sequence[TextColumn], origin: NDArray[np.int64]) -> Table:
        now = {c.name: c for c in columns}
        conditions = tuple(c if now[c.condition.name] is c.texts else c.with_texts(now[c.condition.name]) for c in self.conditions)
        return replace(self, columns=tuple(columns), conditions=conditions, origin=origin)


def flat_table(table: Table, tables: Mapping[str, Table] | None) -> Table:
    """A table with its inner tables' rows; raises TableError where no others are known."""
    from contextdb.nesting.flat import flatten
    from contextdb.nesting.links import inner_rows

    inner = inner_rows(table)
    if tables is None and inner:
        name, rows = next(iter(inner.items()))
        found = f"{in_quotes('@' + name)} refers to a table, but no other tables are given."
        fault = Fault(found, f'compile(tables={{"{name}": ...}}), or a table out of a folder', rule="no-such-table")
        raise TableError(fault.at(table.place(rows[0], table.asset_column)))
    return flatten(table, tables or {})


def build_table(
    name: str,
    columns: Sequence[TextColumn],
    schema: Schema = EMPTY,
    settings: TableSettings | None = None,
    path: Path | None = None,
    source: AnySource | None = None,
) -> Table:
    """A table of texts under a schema; cells that cannot be read are kept and are in its `faults`.

    Raises
    ------
    TableError
        A column that the settings name is missing, or two columns have one name.
    """
    settings = settings or TableSettings(name=name)
    _require_columns(columns, settings, path)
    plain = _plain_names(columns, settings)
    conditions = tuple(
        ConditionColumn.read(c, schema.conditions.get(c.name) or infer_condition(c)) for c in columns if c.name not in plain
    )
    n_rows = columns[0].n_rows if columns else 0
    return Table(name, settings, tuple(columns), conditions, schema, path, source, np.arange(n_rows))


def load(path: str | Path, strict: bool = True) -> Table:
    """Read one table and the contextdb.toml next to it.

    Parameters
    ----------
    path : str or Path
        A .csv or .parquet file.
    strict : bool
        False keeps cells that cannot be read, in `table.faults`, as an editor needs it.

    Raises
    ------
    FileError, SchemaError, TableError
        Each with every fault, its place, what is accepted and the nearest correction.
    """
    from contextdb.project import load_table

    return load_table(require_path(path), strict)


def _no_such(what: str, name: str, known: list[str]) -> Fault:
    near = nearest(name, known)
    return Fault(
        f"there is no {what} {in_quotes(name)}.", some(known) or f"no {what}: there is none", in_quotes(near) if near else ""
    )


def _require_columns(columns: Sequence[TextColumn], settings: TableSettings, path: Path | None) -> None:
    names = [c.name for c in columns]
    place = Place(str(path) if path else None)
    faults = [
        Fault(f"the column name {in_quotes(n)} appears twice.", "each name once", place=place)
        for n in sorted(n for n, count in Counter(names).items() if count > 1)
    ]
    wanted = [(key, getattr(settings, key)) for key in ("asset", "enabled", "priority", "weight", "when")]
    for key, name in [*wanted, *(("outputs", n) for n in settings.outputs)]:
        if name is not None and name not in names:
            fault = _no_such("column", name, names)
            faults.append(replace(fault, found=f"{fault.found[:-1]}, which [tables.{settings.name}] names as {key}.", place=place))
    if faults:
        raise TableError(*faults)


def _plain_names(columns: Sequence[TextColumn], settings: TableSettings) -> set[str]:
    asset = settings.asset or (columns[0].name if columns else None)
    jobs = (asset, settings.enabled, settings.priority, settings.weight, settings.when, *settings.outputs)
    return {name for name in jobs if name is not None}
