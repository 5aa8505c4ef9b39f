"""A table and what it can do: tell its faults, be saved, be put flat, be compiled."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from contextdb.cells.arguments import require_kind, require_many, require_mapping, require_path, require_text
from contextdb.cells.fact_columns import is_frame
from contextdb.columns import TextColumn
from contextdb.columns import polars as pl
from contextdb.compiled.table import CompiledTable
from contextdb.errors import Fault, SchemaError, TableError, in_quotes
from contextdb.schema.settings import EMPTY, Schema, TableSettings, conditions_from_dict, expression_faults, settings_from_dict
from contextdb.tables.compiling import compile_table
from contextdb.tables.data import TableData, require_readable
from contextdb.tables.nesting.flat import FlatTable, flatten
from contextdb.tables.nesting.links import inner_rows, is_nested, nesting_faults
from contextdb.tables.variants import WholeTable, is_variant, variant_faults, whole_of


@dataclass(frozen=True, eq=False, repr=False)
class Table(TableData):
    """Assets and their conditions. Get one from `cdb.load`, `Table.from_columns` or a `Project`."""

    around: Mapping[str, Table] | None = field(default=None, repr=False)
    """The tables of its folder by name, for rows that refer to another table; None where they are not known."""

    if not TYPE_CHECKING:  # a type checker takes every name for one that exists where it sees this

        def __getattr__(self, name: str) -> object:
            problem = f"Table has no attribute {name!r}"
            if hasattr(CompiledTable, name) and not name.startswith("_"):
                problem += f": a compiled table has it. Did you mean table.compile().{name}?"
            raise AttributeError(problem, name=name, obj=self)

    @classmethod
    def from_columns(
        cls,
        columns: Mapping[str, Sequence[object]] | Sequence[Mapping[str, object]] | pl.DataFrame,
        schema: Mapping[str, Mapping[str, object]] | Schema | None = None,
        settings: Mapping[str, object] | TableSettings | None = None,
        name: str | None = None,
    ) -> Table:
        """Build a table from texts.

        Parameters
        ----------
        columns : mapping of str to sequence of str, list of mappings, or polars DataFrame
            The cells of each column, equally many; or the rows, each a mapping of columns to cells; or a frame, read as a Parquet
            file is. Cells are texts, and numbers and truths as they are written; None is empty (Any). The first column names the
            assets unless the settings say otherwise.
        schema : mapping, optional
            The contents of `[conditions.NAME]` in contextdb.toml: `{"speed": {"type": "number"}}`. Others are inferred.
        settings : mapping or TableSettings, optional
            The contents of `[tables.NAME]` in contextdb.toml: `{"policy": "first", "outputs": {"damage": {"type": "int"}}}`.
        name : str, optional
            The name of the table. Default: that of a TableSettings, or "table".

        Raises
        ------
        SchemaError
            The schema is invalid, or the settings are.
        TableError
            Columns of unequal length, or cells that cannot be read.
        """
        if not isinstance(schema, Schema):
            schema = {} if schema is None else require_mapping(schema, "schema", 'a mapping: {"speed": {"type": "number"}}')
            schema = replace(EMPTY, conditions=conditions_from_dict(schema))
            if faults := list(expression_faults(schema)):
                raise SchemaError(*faults)
        if name is not None:
            require_text(name, "name")
        else:
            name = settings.name if isinstance(settings, TableSettings) else "table"
        if settings is not None and not isinstance(settings, TableSettings):
            accepted = 'a mapping: {"priority": "Prio"}, or a contextdb.schema.TableSettings'
            settings = settings_from_dict(name, require_mapping(settings, "settings", accepted), schema.conditions.keys())
        texts = columns_given(columns)
        table = cls.build(name, texts, schema, settings)
        require_readable(table)
        return table

    @cached_property
    def faults(self) -> list[Fault]:
        """Every cell that cannot be read, every row that refers to a table that cannot be used there, in the order of rows, and a
        base that cannot be used."""
        if self.around is None:
            return self._in_order(())
        return self._in_order((*variant_faults(self, self.around), *nesting_faults(self, self.around)))

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
        target = require_path(path) if path is not None else self.path
        if target is None:
            raise TableError(Fault(f"the table {in_quotes(self.name)} has no file yet.", "save(path)"))
        from contextdb.tables.saving import save_table

        return save_table(self, target, overwrite)

    def compile(self, tables: Mapping[str, Table] | None = None) -> CompiledTable:
        """Compile into masks. Columns that were compiled before, in this table or one it was edited from, are not compiled again.

        `tables` are those that rows `@name` refer to, by name; None: those of the table's folder. Raises TableError for cells that
        cannot be read, all of them, in tables inside the table too.
        """
        require_readable(self)
        return CompiledTable(compile_table(self.flat(tables)))

    def flat(self, tables: Mapping[str, Table] | None = None) -> EitherTable:
        """The table with the rows of its inner tables in place of those that refer to them, and those of its base where it is a
        variant: the rows that a query answers with. The table itself where no other table has a part in it. `tables` and what is
        raised as in `compile`."""
        if tables is not None:
            for table in require_mapping(tables, "tables", "a mapping of names to tables").values():
                require_kind(table, Table, "a table of tables", "a Table")
        if not has_others(self):
            return self
        return self._flat if tables is None else flat_of(self, tables)

    @cached_property
    def _flat(self) -> EitherTable:
        return flat_of(self, self.around)


EitherTable = Table | FlatTable | WholeTable
"""A table as it was read, or one with the rows of the tables inside it, or of its base."""


def has_others(table: TableData) -> bool:
    """Whether other tables have a part in it: inside its rows, or as its base."""
    return is_variant(table) or is_nested(table)


def flat_of(table: TableData, tables: Mapping[str, TableData] | None) -> FlatTable | WholeTable:
    """A table with the rows of its base and of its inner tables; raises TableError where they are not known, or cannot be read."""
    whole = whole_of(table, tables)
    if is_nested(whole):
        return flat_table(whole, tables)
    assert isinstance(whole, WholeTable)
    require_readable(whole)
    return whole


def flat_table(table: TableData, tables: Mapping[str, TableData] | None) -> FlatTable:
    """A table with its inner tables' rows; raises TableError where no others are known."""
    inner = inner_rows(table)
    if tables is None and inner:
        name, rows = next(iter(inner.items()))
        problem = f"{in_quotes('@' + name)} refers to a table, but no other tables are given."
        fault = Fault(problem, f'compile(tables={{"{name}": ...}}), or a table out of a folder', rule="no-such-table")
        raise TableError(fault.at(table.place(rows[0], table.asset_column)))
    return flatten(table, tables or {})


def rows_of_file(flat: TableData) -> NDArray[np.int64] | None:
    """For each row of a flat table the row of the table's own file, -1 for one that is all inherited; None where they are the
    same."""
    outer = flat.expansion.tables[0] if isinstance(flat, FlatTable) and flat.expansion.tables else flat
    rows = flat.expansion.rows[0].astype(np.int64) if isinstance(flat, FlatTable) else None
    if not isinstance(outer, WholeTable):
        return rows
    return outer.own_rows if rows is None else outer.own_rows[rows]


def leaf_assets(table: Table) -> list[str]:
    """The assets that the rows of a table and those inside it name, without paths."""
    flat = table.flat()
    return list(flat.leaves) if isinstance(flat, FlatTable) else flat.assets


# ---- columns as Python gives them


ACCEPTED = 'a mapping: {"Asset Name": [...], "speed": [...]}, a list of such mappings of one row each, or a polars DataFrame'


def columns_given(given: object) -> list[TextColumn]:
    """The texts of each column; what is None, or left out of a row, is empty. Raises ContextError where what is given, or a part of
    it, is of another type; TableError for columns of unequal length, or columns of a DataFrame of a type that no cell has."""
    if is_frame(given):
        from contextdb.files.parquet import columns_of_frame

        return columns_of_frame(given)
    columns = given if isinstance(given, Mapping) else _of_rows(require_many(given, "columns", ACCEPTED))
    listed = []
    for name, values in columns.items():
        require_many(values, f"the column {in_quotes(require_text(name, 'a name of columns'))}", "a list of texts")
        listed.append(TextColumn.of(name, map(_text, values)))
    lengths = {column.name: column.n_rows for column in listed}
    if len(set(lengths.values())) > 1:
        raise TableError(Fault(f"the columns are not equally long: {lengths}.", "one text for each row in every column"))
    return listed


def _of_rows(rows: Iterable[object]) -> Mapping[str, Sequence[object]]:
    listed = [require_mapping(row, "a row of columns", 'a mapping: {"Asset Name": "walk", "speed": "0..2"}') for row in rows]
    names = dict.fromkeys(name for row in listed for name in row)
    return {name: [row.get(name) for row in listed] for name in names}


def _text(value: object) -> str:
    return "" if value is None else str(value)
