"""Edits of a table: steps with a name for people ("Delete 3 rows"), made of the changes of `contextdb.tables.changes`.

An edit never changes a table: `apply` gives a new one. It is plain data, so that a journal can keep it; `contextdb.edits.history`
keeps edits and tables for undo. Cells are taken as they are, readable or not; `check_text` and `check_cell` say what is wrong with
one that a person typed. Nothing here touches the disk.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, cast

import numpy as np

from contextdb.cells.conditions import Condition
from contextdb.cells.grammar import parse_cell
from contextdb.columns import TextColumn
from contextdb.errors import CellError, Fault, Place, SchemaError, TableError, in_quotes, plural, row_name, safe_text
from contextdb.expressions import assumption_faults
from contextdb.expressions.rules import check_rule
from contextdb.files.csv_source import name_faults
from contextdb.schema.sections import condition_to_dict, differences, has_place, settings_to_dict, settings_with
from contextdb.schema.settings import conditions_from_dict, with_outputs
from contextdb.schema.table_settings import PLAIN_JOBS
from contextdb.tables.changes import CameFrom, Cells, Change, Columns, Edit, Rows, Sections
from contextdb.tables.data import known_conditions
from contextdb.tables.merging.building import edit_to
from contextdb.tables.plain_columns import plain_fault
from contextdb.tables.table import Table

JOBS = ("condition", "output", "when", *PLAIN_JOBS)
"""What a new column may be."""


# ---- what a person typed


def check_text(condition: Condition, text: str) -> Fault | None:
    """What is wrong with a cell's text, with what is accepted and the nearest mend; None when it can be read."""
    try:
        parse_cell(text, condition.domain)
    except CellError as error:
        return error.faults[0]
    return unwritable(text)


def check_cell(table: Table, column: str, text: str) -> Fault | None:
    """The same for any column of a table: an asset and an output without a type may be any text. Whether a cell of an output may be
    empty hangs on its row, so that is not stated here."""
    settings = table.settings
    for one in table.conditions:
        if one.condition.name == column:
            return check_text(one.condition, text)
    if column == settings.when and table.when is not None:
        return check_rule(text, known_conditions(table)) or unwritable(text)
    if text.strip() and (output := settings.output(column)) is not None:
        return output.fault(text) or unwritable(text)
    for job in PLAIN_JOBS:
        if column == getattr(settings, job):
            return plain_fault(job, column, text) or unwritable(text)
    return unwritable(text)


def unwritable(text: str) -> Fault | None:
    """Why no file can hold a text; None for one that a file can."""
    try:
        text.encode()
    except UnicodeEncodeError:
        return Fault(f"{in_quotes(text)} has half a surrogate pair.", "text in UTF-8")
    return Fault(f"{in_quotes(text)} has a NUL character.", "text without one") if "\0" in text else None


# ---- edits of cells


def set_cells(table: Table, cells: Iterable[tuple[int, str, str]], name: str = "", n_new: int = 0) -> Edit:
    """Set cells, given as (row, column, text); those that hold the text already are left out. `n_new` empty rows are added at the
    end first, and can be set too."""
    texts: dict[str, dict[int, str]] = {}
    columns: dict[str, TextColumn] = {}
    n_before, n_rows = table.n_rows, table.n_rows + n_new
    for row, column, text in cells:
        if column not in columns:
            columns[column] = table.text_column(column)
        if not 0 <= row < n_rows:
            raise TableError(Fault(f"there is no row {row}.", f"rows 0 to {n_rows - 1}"))
        if text != (columns[column][row] if row < n_before else ""):
            texts.setdefault(column, {})[row] = text
    grown = (Rows(np.append(np.arange(table.n_rows), np.full(n_new, -1))),) if n_new else ()
    return Edit(name or _cells_name(table, texts), (*grown, Cells(texts)) if texts else grown)


def _cells_name(table: Table, texts: Mapping[str, Mapping[int, str]]) -> str:
    n_cells = sum(map(len, texts.values()))
    if n_cells != 1:
        return f"Change {plural(n_cells, 'cell')}"
    [(column, cells)] = texts.items()
    [row] = cells
    return f"Type {safe_text(column)} of {_named(table, [row])}"


# ---- edits of rows


def insert_rows(table: Table, at: int, rows: Sequence[Mapping[str, str]], name: str = "") -> Edit:
    """Insert rows before row `at`; columns that a row leaves out are empty (Any)."""
    if not 0 <= at <= table.n_rows:
        raise TableError(Fault(f"there is no row {at}.", f"0 to {table.n_rows}, to insert before"))
    texts: dict[str, dict[int, str]] = {}
    for i, row in enumerate(rows):
        for column, text in row.items():
            if text:
                texts.setdefault(column, {})[at + i] = text
    taken = Rows(np.insert(np.arange(table.n_rows), at, np.full(len(rows), -1)))
    return Edit(name or f"Insert {plural(len(rows), 'row')}", (taken, Cells(texts)) if texts else (taken,))


def delete_rows(table: Table, rows: Sequence[int]) -> Edit:
    gone = _rows_of(table, rows)
    return Edit(f"Delete {_named(table, gone)}", (Rows(np.delete(np.arange(table.n_rows), gone)),))


def duplicate_rows(table: Table, rows: Sequence[int]) -> Edit:
    """Copy rows to below the last of them."""
    copied = _rows_of(table, rows)
    taken = np.insert(np.arange(table.n_rows), int(copied[-1]) + 1, copied)
    return Edit(f"Duplicate {_named(table, copied)}", (Rows(taken),))


def move_rows(table: Table, rows: Sequence[int], to: int) -> Edit:
    """Move rows to before what is now row `to` (n_rows: to the end); their order among each other stays."""
    moved = _rows_of(table, rows)
    if not 0 <= to <= table.n_rows:
        raise TableError(Fault(f"there is no row {to}.", f"0 to {table.n_rows}, to move before"))
    rest = np.delete(np.arange(table.n_rows), moved)
    at = int(np.searchsorted(rest, to))
    return Edit(f"Move {_named(table, moved)}", (Rows(np.insert(rest, at, moved)),))


def reorder_rows(table: Table, order: Sequence[int] | CameFrom, name: str = "Sort the file") -> Edit:
    """Put every row in another order: row i is then what is now row `order[i]`."""
    taken = np.asarray(order, np.int64)
    if not np.array_equal(np.sort(taken), np.arange(table.n_rows)):
        raise TableError(Fault("the order does not hold each row once.", f"each of {plural(table.n_rows, 'row')} once"))
    return Edit(name, (Rows(taken),))


def enable_rows(table: Table, rows: Sequence[int], is_enabled: bool) -> Edit:
    """Enable or disable rows. A table without a column for it gets one, "Enabled", as its last: the settings then name it."""
    chosen, column = _rows_of(table, rows), table.settings.enabled
    changes: list[Change] = []
    if column is None:
        column = _free_name("Enabled", table)
        changes += [Columns((*_layout(table), (column, None))), Sections({"enabled": column})]
    texts = dict.fromkeys(chosen.tolist(), str(is_enabled))
    return Edit(f"{'Enable' if is_enabled else 'Disable'} {_named(table, chosen)}", (*changes, Cells({column: texts})))


# ---- edits of columns


@dataclass(frozen=True)
class NewColumn:
    """A column to insert: its name, what it is, and what every row holds in it."""

    name: str
    job: str = "condition"
    declared: Mapping[str, object] | None = None
    """What `[conditions.NAME]` of contextdb.toml shall say of it; None: what it says already, else the cells decide."""
    text: str = ""


def insert_columns(table: Table, at: int, columns: Sequence[NewColumn]) -> Edit:
    """Insert columns before column `at`, in this order: those of a blueprint, say."""
    layout = list(_layout(table))
    _require_place(table, at, len(layout))
    layout[at:at] = [(column.name, None) for column in columns]
    settings: dict[str, Any] = {c.job: c.name for c in columns if c.job not in ("condition", "output")}
    if outputs := [c.name for c in columns if c.job == "output"]:
        settings["outputs"] = settings_to_dict(with_outputs(table.settings, [*table.settings.outputs, *outputs]))["outputs"]
    declared = {c.name: c.declared for c in columns if c.declared}
    sections = Sections(settings, {"conditions": declared} if declared else {})
    changes: list[Change] = [Columns(tuple(layout))]
    changes += [] if sections.is_empty else [sections]
    filled = {c.name: dict.fromkeys(range(table.n_rows), c.text) for c in columns if c.text and table.n_rows}
    changes += [Cells(filled)] if filled else []
    what = f"the column {safe_text(columns[0].name)}" if len(columns) == 1 else plural(len(columns), "column")
    return Edit(f"Insert {what}", tuple(changes) if columns else ())


def delete_columns(table: Table, columns: Sequence[str]) -> Edit:
    """Delete columns; the one that names the assets cannot go."""
    for column in columns:
        table.text_column(column)
        if column == table.asset_column:
            problem = f"the column {in_quotes(column)} names the assets, so it cannot be deleted."
            raise TableError(Fault(problem, "any other column", place=Place(column=column)))
    left = tuple(pair for pair in _layout(table) if pair[0] not in columns)
    what = f"the column {safe_text(columns[0])}" if len(columns) == 1 else plural(len(columns), "column")
    return Edit(f"Delete {what}", (Columns(left),))


def move_column(table: Table, column: str, to: int) -> Edit:
    """Move a column to before what is now column number `to`."""
    layout = list(_layout(table))
    at = [c.name for c in table.columns].index(table.text_column(column).name)
    if at != to:
        _require_place(table, to, len(layout), is_asset=column == table.asset_column)
    layout.insert(to - (to > at), layout.pop(at))
    return Edit(f"Move the column {safe_text(column)}", (Columns(tuple(layout)),))


def move_columns(table: Table, columns: Sequence[str], to: int) -> Edit:
    """Move columns to before what is now column number `to`; their order among each other stays."""
    if len(columns) == 1:
        return move_column(table, columns[0], to)
    layout = list(_layout(table))
    _require_place(table, to, len(layout), is_asset=table.asset_column in columns)
    moved = [pair for pair in layout if pair[0] in columns]
    before = [pair for pair in layout[:to] if pair not in moved]
    behind = [pair for pair in layout[to:] if pair not in moved]
    return Edit(f"Move {plural(len(moved), 'column')}", (Columns((*before, *moved, *behind)),))


def rename_column(table: Table, column: str, name: str, keep_declared: bool = True) -> Edit:
    """Give a column another name. What contextdb.toml declares of it holds for the new name, unless that is declared itself.

    `keep_declared`: the old name stays declared too, for others that use it: see `contextdb.edits.renaming.uses_of`.
    """
    table.text_column(column)
    layout = tuple((name if old == column else new, old) for new, old in _layout(table))
    faults = list(name_faults([new for new, _ in layout]))
    if faults:
        raise TableError(*faults)
    is_left = keep_declared or column not in table.schema.conditions or name == column
    undeclared = () if is_left else (Sections(parts={"conditions": {column: None}}),)
    return Edit(f"Rename {safe_text(column)} to {safe_text(name)}", (Columns(layout), *undeclared))


# ---- edits of what contextdb.toml says


def set_settings(table: Table, **changes: Any) -> Edit:
    """Set keys of the table's section, such as `policy="first"` or `outputs=["Slots"]`; None takes a key away."""
    after = settings_to_dict(settings_with(table.settings, changes))
    changed = differences(settings_to_dict(table.settings), after)
    keys = ", ".join(changed)
    edit = Edit(f"Set {keys} of the table", (Sections(changed),) if changed else ())
    if changed.get("assume"):
        _require_known(table, cast("list[str]", changed["assume"]))
    return _checked(table, edit)


def set_outputs(table: Table, names: Sequence[str]) -> Edit:
    """Say which columns are outputs; what is declared of those that stay, and what the fallback gives to them, is kept."""
    after = settings_to_dict(with_outputs(table.settings, names))
    changed = differences(settings_to_dict(table.settings), after)
    return _checked(table, Edit("Set outputs of the table", (Sections(changed),) if changed else ()))


def set_fallback(table: Table, asset: str | None) -> Edit:
    """Set the asset of the fallback; the outputs that it gives stay, and go with it."""
    after = settings_to_dict(replace(table.settings, fallback=asset))
    return set_settings(table, fallback=after.get("fallback"))


def _require_known(table: Table, assume: Sequence[str]) -> None:
    """Raise SchemaError where an assumption cannot be read, or names what is not a condition of the table and not declared."""
    known = {**table.schema.conditions, **{c.condition.name: c.condition for c in table.conditions}}
    if faults := list(assumption_faults(assume, known)):
        raise SchemaError(*faults)


def set_condition(table: Table, name: str, **changes: Any) -> Edit:
    """Set keys of a condition's section, such as `min=0.0` or `values=["A"]`; None takes a key away.

    A condition whose type was inferred is declared by it. Keys that have no place under the type are taken away with it.
    """
    column = table.condition(name).condition
    before = condition_to_dict(column)
    part = {key: value for key, value in (before | changes).items() if value is not None}
    part = {key: value for key, value in part.items() if key in changes or has_place(key, part.get("type"))}
    if column.is_declared and conditions_from_dict({name: part})[name] == column:
        return Edit(f"Declare {safe_text(name)}", ())
    keys = ", ".join(differences(before, part))
    what = f"Set {keys} of {safe_text(name)}" if column.is_declared and keys else f"Declare {safe_text(name)}"
    return _checked(table, Edit(what, (Sections(parts={"conditions": {name: part}}),)))


def set_blueprint(table: Table, name: str, conditions: Sequence[str] | None) -> Edit:
    """Keep conditions as a blueprint, or with None take it away. Conditions of the table that nobody has declared are declared."""
    undeclared = [n for n in conditions or () if n not in table.schema.conditions]
    declared = {n: condition_to_dict(table.condition(n).condition) for n in undeclared}
    parts: dict[str, Mapping[str, Any]] = {"conditions": declared} if declared else {}
    parts["blueprints"] = {name: None if conditions is None else {"conditions": list(conditions)}}
    verb = "Remove" if conditions is None else "Keep"
    return _checked(table, Edit(f"{verb} the blueprint {safe_text(name)}", (Sections(parts=parts),)))


def _checked(table: Table, edit: Edit) -> Edit:
    """The edit, if contextdb.toml could hold what it says; SchemaError if not."""
    edit.apply(table.with_rows_taken([]))
    return edit


# ---- what leads from one table to another


def edit_between(before: Table, after: Table, came_from: CameFrom, name: str) -> Edit:
    """An edit that makes the texts of `before` those of `after`, whose row i is what was row `came_from[i]`, -1 a new one."""
    places = {column.name: at for at, column in enumerate(before.columns)}
    fields = np.array([places.get(column.name, -1) for column in after.columns], np.int64)
    return edit_to(before, after.columns, came_from, fields, lambda table: Sections.between(table, after), name)


# ---- parts


def _layout(table: Table) -> tuple[tuple[str, str | None], ...]:
    return tuple((c.name, c.name) for c in table.columns)


def _require_place(table: Table, at: int, n_columns: int, is_asset: bool = False) -> None:
    is_first_taken = table.settings.asset is None and (at == 0 or is_asset)
    if is_first_taken and n_columns:
        problem = f"the first column, {in_quotes(table.asset_column)}, names the assets, so it stays the first."
        raise TableError(Fault(problem, "any place behind it", "to name the column of the assets in contextdb.toml"))
    if not 0 <= at <= n_columns:
        raise TableError(Fault(f"there is no column {at}.", f"0 to {n_columns}"))


def _rows_of(table: Table, rows: Sequence[int]) -> CameFrom:
    chosen = np.unique(np.asarray(rows, np.int64))
    if not len(chosen):
        raise TableError(Fault("no row is chosen.", "at least one row"))
    for row in chosen[(chosen < 0) | (chosen >= table.n_rows)][:1].tolist():
        raise TableError(Fault(f"there is no row {row}.", f"rows 0 to {table.n_rows - 1}"))
    return chosen


def _named(table: Table, rows: Sequence[int] | CameFrom) -> str:
    if len(rows) != 1:
        return plural(len(rows), "row")
    asset = table.text(int(rows[0]), table.asset_column)
    return safe_text(asset) if asset.strip() else row_name(int(rows[0]))


def _free_name(wanted: str, table: Table) -> str:
    taken = {c.name for c in table.columns} | set(table.schema.conditions)
    return next(name for name in (wanted, *(f"{wanted} {i}" for i in range(2, len(taken) + 3))) if name not in taken)
