"""The columns of a table as a sheet: a column a row, in cells what contextdb.toml says of it, and the one edit that comes of it.

Rows are columns in their order, so rows that move, come and go are columns that do. Behind them stand conditions that are declared
and have no column here: derived facts, say. A cell is a text as `[conditions.NAME]` or an output would have it.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

from contextdb.cells.conditions import Condition
from contextdb.cells.kinds import KINDS
from contextdb.cells.output_types import OUTPUT_TYPES
from contextdb.cells.outputs import Output
from contextdb.cells.words import format_number, quoted
from contextdb.edits.renaming import uses_of
from contextdb.errors import CellError, ContextDBError, Fault, in_quotes, plural, safe_text
from contextdb.expressions.tokens import names_in as expression_names
from contextdb.schema.outputs import declared_outputs, outputs_faults
from contextdb.schema.sections import condition_to_dict, differences, has_place, settings_to_dict
from contextdb.schema.settings import TableSettings, with_outputs
from contextdb.schema.table_settings import JOBS, PLAIN_JOBS
from contextdb.tables.changes import Change, Columns, Edit, Sections
from contextdb.tables.table import Table

from .condition_form import TYPED, ConditionForm, names_in, plain
from .displayed_table import Header
from .options import CONDITION_OPTIONS
from .roomy_sheet import RoomySheet

NAME, IS, TYPE = "Column", "Is", "Type"
CONDITION, OUTPUT, ASSET, RULE, DECLARED = "condition", "output", "asset", "rule", "declared"
WORDS = (CONDITION, OUTPUT, ASSET, RULE, *PLAIN_JOBS, DECLARED)
"""What a row can be; "declared": contextdb.toml tells of the condition, and the table has no column of it."""
HINTS = {
    NAME: "name", IS: "job", TYPE: "type", "Unit": "m/s", "Least": "bound", "Most": "bound", "Values": "names",
    "Default": "output", "Weight": "number", "Mirror": "pairs", "Expression": "computed as", "Description": "text", "Owner": "team",
}  # fmt: skip
"""The columns of the sheet, and what is below their names."""
_FORM = {key: CONDITION_OPTIONS[key].label for key in TYPED}
_KEYS = _FORM | {"size": "Values", "default": "Default", "expr": "Expression"}
_OF_CONDITIONS = ("Weight", "Mirror", "Expression", "Owner")
_TOLD = tuple(HINTS)[2:]
_JOB_OF = {RULE: "when"}
Parts = dict[str, Mapping[str, object] | None]


class Wrong(Exception):
    """What is wrong, and in which cell of the sheet."""

    def __init__(self, row: int, column: str, text: str) -> None:
        super().__init__(text)
        self.row, self.column, self.text = row, column, text


@dataclass(frozen=True)
class ColumnRow:
    """A row of the sheet: a column, or a declared condition."""

    at: int
    """Its place in the sheet."""
    texts: Mapping[str, str]
    before: str | None = None
    """What it was called when the sheet was opened; None: it is new."""
    first: Mapping[str, str] = field(default_factory=dict)
    """Its texts then."""

    @property
    def name(self) -> str:
        return self.texts[NAME].strip()

    @property
    def job(self) -> str:
        return self.texts[IS] or CONDITION

    @property
    def is_condition(self) -> bool:
        """Whether contextdb.toml may tell of it as a condition."""
        return self.job in (CONDITION, DECLARED)

    @property
    def is_changed(self) -> bool:
        """Whether it is declared differently than before, or of another name."""
        was = self.first.get(IS, "") in (CONDITION, DECLARED)
        same = all(self.texts[key] == self.first.get(key, "") for key in _TOLD)
        return not (same and self.name == (self.before or "") and was == self.is_condition)

    def wrong(self, column: str, text: str) -> Wrong:
        """That a cell of it is wrong."""
        return Wrong(self.at, column, text)


class ColumnSheet(RoomySheet):
    """The columns of a table, being edited."""

    fixed = "These are the settings of a column; they stay as they are here."
    no_enabling = "Delete the row of a column that is not wanted."

    def __init__(self, of: Table) -> None:
        self.of = of
        self.first = [dict.fromkeys(HINTS, "") | texts for texts in _texts_of(of)]
        texts = {key: [*(row[key] for row in self.first), ""] for key in HINTS}
        typed = (
            Output(IS, "enum", CONDITION, values=WORDS),
            Output(TYPE, "enum", "text", values=tuple(dict.fromkeys((*KINDS, *OUTPUT_TYPES)))),
        )
        settings = TableSettings("columns", asset=NAME, outputs=tuple(HINTS)[1:], typed=typed)
        super().__init__(Table.from_columns(texts, settings=settings, name="columns"))

    def header(self, column: int) -> Header:
        name = self.table.columns[column].name
        return Header(name, HINTS[name])

    def known(self, column: int) -> list[str]:
        """The words of a column that has only some."""
        output = self.table.settings.output(self.table.columns[column].name)
        return list(output.choices) if output is not None else super().known(column)

    def fault_of(self, column: int, text: str) -> Fault | None:
        """Why a text cannot be taken in the row of the cursor, as far as the row alone says so."""
        key, row = self.table.columns[column].name, self._rows[int(self.view.rows[self.cursor[0]])]
        now = replace(row, texts={**row.texts, key: text})
        try:
            _require_row(now)
        except Wrong as wrong:
            return Fault(wrong.text) if wrong.column == key and text.strip() else None
        return None

    @property
    def _rows(self) -> list[ColumnRow]:
        """The rows in their order, empty ones too."""
        table, rows = self.table, []
        for row in range(table.n_rows):
            origin, texts = int(table.origin[row]), {c.name: c[row] for c in table.columns}
            first = self.first[origin] if 0 <= origin < len(self.first) else {}
            rows.append(ColumnRow(self.view.place(row) or 0, texts, first.get(NAME), first))
        return rows

    def edit(self) -> Edit:
        """The edit of the table that the sheet was made of. Raises Wrong with the cell that is to be mended first."""
        return _edit(self.of, [row for row in self._rows if row.before is not None or any(map(str.strip, row.texts.values()))])


# ---- what a table says


def _texts_of(table: Table) -> Iterator[dict[str, str]]:
    settings = table.settings
    conditions = {c.condition.name: c.condition for c in table.conditions}
    jobs = {column: job for job, column in settings.jobs if job != "outputs"} | {settings.when: RULE, table.asset_column: ASSET}
    for column in table.columns:
        texts = {NAME: column.name, IS: jobs.get(column.name, OUTPUT)}
        if (condition := conditions.get(column.name)) is not None:
            texts |= {IS: CONDITION} | _condition_texts(condition)
        elif (output := settings.output(column.name)) is not None:
            texts |= _output_texts(output)
        yield texts
    here = {c.name for c in table.columns}
    for condition in table.schema.conditions.values():
        if condition.name not in here:
            yield {NAME: condition.name, IS: DECLARED} | _condition_texts(condition)


def _condition_texts(condition: Condition) -> dict[str, str]:
    form = ConditionForm.of(condition)
    return {TYPE: form.kind, "Expression": condition.expr or ""} | {_FORM[key]: getattr(form, key) for key in _FORM}


def _output_texts(output: Output) -> dict[str, str]:
    low, high = (format_number(x) if abs(x) != float("inf") else "" for x in (output.minimum, output.maximum))
    values = str(output.size) if output.type.has_size else " ".join(map(quoted, output.values))
    default = "" if output.default is None else output.written(output.default)
    texts = {TYPE: output.kind, "Unit": output.unit, "Least": low, "Most": high, "Values": values, "Default": default}
    return texts | {"Description": output.description}


# ---- one row


def _require_row(row: ColumnRow) -> dict[str, Any]:
    """What contextdb.toml is to say of a condition or an output; raises Wrong."""
    if not row.name:
        raise row.wrong(NAME, "A column needs a name; Ctrl+K deletes one.")
    for key in () if row.is_condition else _OF_CONDITIONS:
        if row.texts[key].strip() and row.job not in ("", *JOBS):
            raise row.wrong(key, f"Only a condition has {'an' if key[0] in 'EO' else 'a'} {key.lower()}.")
    if row.is_condition:
        return _condition_keys(row)
    return _output_keys(row) if row.job == OUTPUT else {}


def _condition_keys(row: ColumnRow) -> dict[str, Any]:
    kind, typed = row.texts[TYPE], [key for key in _TOLD if row.texts[key].strip()]
    if not typed and not row.first.get(TYPE):
        return {}
    if not kind:
        raise row.wrong(TYPE, f"Say the type{f': {typed[0]} is given' if typed else ''}.")
    if kind not in KINDS:
        raise row.wrong(TYPE, f'"{kind}" is not a type of a condition. Accepted: {", ".join(KINDS)}.')
    if row.texts["Default"].strip():
        raise row.wrong("Default", "Only an output has a default.")
    for key, column in _FORM.items():
        if row.texts[column].strip() and not has_place(key, kind):
            raise row.wrong(column, f"A condition of type {kind} has none. Empty the cell.")
    keys, wrong = ConditionForm(kind, **{key: row.texts[column] for key, column in _FORM.items()}).declared()
    for key, why in wrong.items():
        raise row.wrong(_FORM.get(key, TYPE), why)
    return keys | ({"expr": row.texts["Expression"].strip()} if row.texts["Expression"].strip() else {})


def _output_keys(row: ColumnRow) -> dict[str, Any]:
    texts = {key: row.texts[key].strip() for key in _TOLD}
    if not any(texts.values()):
        return {}
    kind = texts[TYPE] or "text"
    if kind not in OUTPUT_TYPES:
        raise row.wrong(TYPE, f'"{kind}" is not a type of an output. Accepted: {", ".join(OUTPUT_TYPES)}.')
    keys: dict[str, Any] = {"type": kind}
    for key, column in (("min", "Least"), ("max", "Most")):
        if texts[column]:
            keys[key] = _number(row, column, texts[column])
    if texts["Values"] and OUTPUT_TYPES[kind].has_size:
        keys["size"] = _number(row, "Values", texts["Values"])
    elif texts["Values"]:
        keys["values"] = list(dict.fromkeys(names_in(texts["Values"])))
    keys |= {key: texts[column] for key, column in (("unit", "Unit"), ("description", "Description")) if texts[column]}
    for path, fault in outputs_faults({"outputs": {row.name: keys}}):
        key = path[2] if len(path) > 2 else "values" if "values" in fault.found or "size" in fault.found else "type"
        raise row.wrong(_KEYS.get(key, TYPE), plain(fault))
    if texts["Default"]:
        [output] = declared_outputs({row.name: keys})
        try:
            value = output.read(texts["Default"])
        except CellError as error:
            raise row.wrong("Default", plain(error.faults[0])) from None
        keys["default"] = list(value) if isinstance(value, tuple) else value
    return keys


def _number(row: ColumnRow, column: str, text: str) -> float | int:
    try:
        value = float(text)
    except ValueError:
        raise row.wrong(column, f'"{text}" is not a number.') from None
    return int(value) if value.is_integer() else value


# ---- all of them


def _edit(table: Table, rows: Sequence[ColumnRow]) -> Edit:
    declared = [_require_row(row) for row in rows]
    _require_whole(table, rows)
    here = {c.name for c in table.columns}
    layout = tuple((row.name, row.before if row.before in here else None) for row in rows if row.job != DECLARED)
    changes: list[Change] = []
    if layout != tuple((c.name, c.name) for c in table.columns):
        changes.append(Columns(layout))
    try:
        moved = Edit("", tuple(changes)).apply(table.with_rows_taken([]))
        settings = _settings(moved.settings, rows, declared)
        parts = _conditions(table, rows, declared)
        sections = Sections(settings, {"conditions": parts} if parts else {})
        changes += [] if sections.is_empty else [sections]
        edit = Edit(_name(rows, table), tuple(changes))
        edit.apply(table.with_rows_taken([]))
    except ContextDBError as error:
        raise _placed(error.faults[0], rows) from None
    return edit


def _require_whole(table: Table, rows: Sequence[ColumnRow]) -> None:
    """Raise Wrong for what two rows say together: a name or a job twice, no assets, a name that others use."""
    seen: dict[str, str] = {}
    jobs: dict[str, str] = {}
    for row in rows:
        if row.name in seen:
            raise row.wrong(NAME, f"There is a column {in_quotes(row.name)} already.")
        seen[row.name] = row.job
        if row.job in jobs and row.job not in (CONDITION, OUTPUT, DECLARED):
            raise row.wrong(IS, f"{in_quotes(jobs[row.job])} is the {row.job} column already.")
        jobs.setdefault(row.job, row.name)
        is_other = row.before is not None and row.before != row.name
        if is_other and row.before in table.schema.conditions and (uses := uses_of(table, row.before or "").text):
            raise row.wrong(
                NAME, f"{row.before} is used by {uses}: give it another name with Rename column, which changes them too."
            )
    if ASSET not in jobs:
        raise rows[0].wrong(IS, "One column names the assets: write asset here.") if rows else Wrong(0, NAME, "There is no column.")
    gone = {c.name for c in table.schema.conditions.values()} - {row.before for row in rows} - {c.name for c in table.columns}
    names = {row.name for row in rows}
    for name in sorted(gone - names):
        if uses := uses_of(table, name).text:
            raise Wrong(0, NAME, f"{name} is used by {uses}, so it stays declared. Ctrl+Z brings its row back.")


def _settings(before: TableSettings, rows: Sequence[ColumnRow], declared: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
    """The keys of the table's section that change."""
    columns = {_JOB_OF.get(row.job, row.job): row.name for row in rows}
    first = next(row for row in rows if row.job != DECLARED)
    jobs: dict[str, Any] = {job: columns.get(job) for job in JOBS}
    if before.asset is None and first.job == ASSET:
        jobs["asset"] = None
    outputs = {row.name: dict(part) for row, part in zip(rows, declared, strict=True) if row.job == OUTPUT}
    names = [name for name in before.outputs if name in outputs] + [name for name in outputs if name not in before.outputs]
    after = settings_to_dict(replace(with_outputs(before, names), **jobs))
    after.pop("outputs", None)
    is_typed = any(part and part != {"type": "text"} for part in outputs.values())
    if names:
        after["outputs"] = {name: outputs[name] or {"type": "text"} for name in names} if is_typed else names
    return differences(settings_to_dict(before), after)


def _conditions(
    table: Table, rows: Sequence[ColumnRow], texts_of_rows: Sequence[Mapping[str, Any]]
) -> dict[str, Mapping[str, object] | None]:
    """What changes of the conditions that contextdb.toml tells of."""
    declared, parts = table.schema.conditions, Parts()
    for row, part in zip(rows, texts_of_rows, strict=True):
        was = declared.get(row.before or "")
        if was is not None and (not row.is_condition or row.name != row.before):
            parts[was.name] = None
        if not row.is_condition or not part or (row.name in declared and not row.is_changed):
            continue
        if row.is_changed or row.job == DECLARED:
            unchanged = {} if was is None else {k: v for k, v in condition_to_dict(was).items() if k == "hysteresis"}
            parts[row.name] = {**{k: v for k, v in unchanged.items() if has_place(k, part["type"])}, **part}
    for row, part in zip(rows, texts_of_rows, strict=True):  # an expression names what is declared
        if row.is_condition and part and row.name in _named(rows) and row.name not in declared:
            parts[row.name] = part
    known = {row.before for row in rows} | {row.name for row in rows} | {c.name for c in table.columns}
    parts |= {name: None for name in declared if name not in known}
    return parts


def _named(rows: Sequence[ColumnRow]) -> set[str]:
    return {name for row in rows if row.texts["Expression"].strip() for name in expression_names(row.texts["Expression"])}


def _name(rows: Sequence[ColumnRow], table: Table) -> str:
    done = {
        "change": [row.name for row in rows if row.before is not None and dict(row.texts) != dict(row.first)],
        "add": [row.name for row in rows if row.before is None and row.job != DECLARED],
        "take away": sorted({c.name for c in table.columns} - {row.before for row in rows}),
    }
    parts = [f"{verb} {_named_or_counted(names)}" for verb, names in done.items() if names]
    declared = [row.name for row in rows if row.before is None and row.job == DECLARED]
    parts += [f"declare {safe_text(declared[0]) if len(declared) == 1 else plural(len(declared), 'condition')}"] if declared else []
    return f"{parts[0][:1].upper()}{parts[0][1:]}{''.join(f', {one}' for one in parts[1:])}" if parts else "Move columns"


def _named_or_counted(names: Sequence[str]) -> str:
    return f"the column {safe_text(names[0])}" if len(names) == 1 else plural(len(names), "column")


def _placed(fault: Fault, rows: Sequence[ColumnRow]) -> Wrong:
    """A fault of the whole, at the row of which it speaks."""
    text = plain(fault)
    about = [row for row in rows if in_quotes(row.name) in fault.found or f".{row.name}]" in fault.found]
    row = next(iter(about), rows[0])
    column = "Expression" if row.texts["Expression"].strip() and "expr" in fault.found else NAME
    return row.wrong(column, text)
