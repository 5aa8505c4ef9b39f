"""Unreal DataTables, as CSV and as JSON: the row names are the assets; a set, (A,B) there, is A B here, and so are gameplay tags.

Unreal's CSV begins with a header whose first name is "---" or empty; its JSON is a list of objects with a "Name". A name of a
column there is a C++ identifier, so a dot becomes two underscores and back.

Source: Unreal Engine documentation, "Data Driven Gameplay Elements": CSV and JSON of a DataTable.
"""

from __future__ import annotations

import csv
import io
import json
import re
from collections import Counter, deque
from collections.abc import Sequence
from dataclasses import replace
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from contextdb.cells.words import quoted
from contextdb.columns import TextColumn
from contextdb.errors import Fault, Place, TableError, in_quotes, plural, row_name
from contextdb.exchange.reading import Reading, Remark, capped
from contextdb.tables.table import Table

CSV_NAMES = ("---", "")
JSON_NAME = "Name"
_SET = re.compile(r'\(\s*(?:"(?:[^"\\]|\\.)*"|[\w.:/\-]+)(?:\s*,\s*(?:"(?:[^"\\]|\\.)*"|[\w.:/\-]+))*\s*\)')
_ITEM = re.compile(r'"((?:[^"\\]|\\.)*)"|([\w.:/\-]+)')
_TAG = r'\(\s*TagName\s*=\s*"([^"\\]*)"\s*\)'
_TAGS = re.compile(rf"\(\s*GameplayTags\s*=\s*(?:\(\s*(?:{_TAG}(?:\s*,\s*{_TAG})*\s*)?\)\s*)?\)|{_TAG}")
_STRUCT = re.compile(r"\(\s*\w+\s*=")
_LOCALISED = ("NSLOCTEXT(", "INVTEXT(", "LOCTEXT(")
_STRING = re.compile(r'"((?:[^"\\]|\\.)*)("?)', re.DOTALL)


def is_unreal_header(names: Sequence[str]) -> bool:
    """Whether the first name of a header is the one that Unreal writes."""
    return bool(names) and names[0] == CSV_NAMES[0]


def from_csv(reading: Reading) -> Reading:
    """What was read from an Unreal CSV, with cells as contextdb writes them."""
    return _from_unreal(reading, "unreal-csv")


def from_json(reading: Reading) -> Reading:
    """What was read from an Unreal JSON, with cells as contextdb writes them."""
    return _from_unreal(reading, "unreal-json")


def _from_unreal(reading: Reading, kind: str) -> Reading:
    first, *rest = reading.columns
    remarks = [Remark("the row names of an Unreal DataTable name the assets.", f"column {in_quotes(first.name)}")]
    columns, sets = [first.renamed("Asset Name")], dict[str, NDArray[np.bool_]]()
    for column in rest:
        texts, lost = _cells(column)
        name = column.name.replace("__", ".")
        columns.append(TextColumn.of(name, (texts[code] for code in column.codes.tolist())))
        are_sets = np.array([_is_set(text) or _are_tags(text) for text in column.texts], np.bool_)[column.codes]
        sets[name] = are_sets | reading.sets.get(column.name, False)
        remarks += lost
    return replace(reading, columns=tuple(columns), format=kind, remarks=(*reading.remarks, *remarks), sets=sets)


def _cells(column: TextColumn) -> tuple[list[str], tuple[Remark, ...]]:
    """Each distinct text as a cell, and those that are no value of ours."""
    texts = [_cell(text) for text in column.texts]
    place = f"column {in_quotes(column.name)}"
    lost = [
        Remark(f"{in_quotes(text)} is a struct; it is kept as text.", place, is_loss=True)
        for text in column.texts
        if _STRUCT.match(text) and not _are_tags(text)
    ]
    return texts, capped(lost, "structs")


def _cell(text: str) -> str:
    if text.lstrip().startswith(_LOCALISED) and (plain := _localised(text)) is not None:
        return plain
    if text == "()":
        return ""
    if _are_tags(text):
        return " ".join(quoted(tag) for tag in re.findall(_TAG, text) if tag)
    if _is_set(text):
        return " ".join(quoted(bare or inner.replace('\\"', '"')) for inner, bare in _ITEM.findall(text))
    return text


def _are_tags(text: str) -> bool:
    """Whether a text is a tag or a container of tags, the structs that Unreal writes as (GameplayTags=((TagName="Move.Run")))."""
    return _TAGS.fullmatch(text.strip()) is not None


def _is_set(text: str) -> bool:
    """Whether a text is a set as Unreal writes it; (10..30) is an open interval of ours."""
    return ".." not in text and _SET.fullmatch(text.strip()) is not None


def _localised(text: str) -> str | None:
    """The last string of NSLOCTEXT("space", "key", "text"), which is what people read; None where it is written differently."""
    last = next(iter(deque(_STRING.finditer(text), maxlen=1)), None)
    is_sound = last is not None and last[2] and text[last.end() :].strip() == ")"
    return last[1].replace('\\"', '"') if last is not None and is_sound else None


# ---- writing


def write_csv(table: Table) -> tuple[bytes, tuple[Remark, ...]]:
    """A table as the CSV of an Unreal DataTable: the assets as row names, every cell as text in quotes. Raises TableError where an
    asset appears twice or is empty: Unreal's row names are unique."""
    columns, remarks = _unreal_columns(table)
    out = io.StringIO(newline="")
    writer = csv.writer(out, quoting=csv.QUOTE_ALL, lineterminator="\r\n")
    out.write(",".join([CSV_NAMES[0], *(c.name for c in columns[1:])]) + "\r\n")
    writer.writerows(zip(*(c.to_list() for c in columns), strict=True))
    return out.getvalue().encode(), remarks


def write_json(table: Table) -> tuple[bytes, tuple[Remark, ...]]:
    """A table as the JSON of an Unreal DataTable. Raises TableError as `write_csv` does."""
    columns, remarks = _unreal_columns(table)
    names = [JSON_NAME, *(c.name for c in columns[1:])]
    rows = [dict(zip(names, row, strict=True)) for row in zip(*(c.to_list() for c in columns), strict=True)]
    return (json.dumps(rows, ensure_ascii=False, indent="\t") + "\n").encode(), remarks


def _unreal_columns(table: Table) -> tuple[list[TextColumn], tuple[Remark, ...]]:
    """The columns under names that Unreal takes, the assets first."""
    _require_unique(table)
    rest = [c for c in table.columns if c.name != table.asset_column]
    names = [_identifier(c.name) for c in rest]
    twice = sorted(name for name, n in Counter([*names, JSON_NAME]).items() if n > 1)
    if twice:
        raise TableError(
            Fault(f"two columns would be called {in_quotes(twice[0])} in Unreal.", "names that differ in letters and digits")
        )
    pairs = zip(rest, names, strict=True)
    renamed = [Remark(f"is called {in_quotes(new)} in Unreal.", f"column {in_quotes(c.name)}") for c, new in pairs if new != c.name]
    columns = [table.text_column(table.asset_column), *(c.renamed(n) for c, n in zip(rest, names, strict=True))]
    return columns, capped(renamed, "renamed columns")


def _require_unique(table: Table) -> None:
    faults, rows = [], dict[str, int]()
    for row, asset in enumerate(table.assets):
        if not asset.strip() or asset in rows:
            problem = (
                f"the asset {in_quotes(asset)} is also in {row_name(rows[asset])}." if asset in rows else "the row names no asset."
            )
            faults.append(
                Fault(problem, "a different name for each row, as Unreal requires", place=Place(row=row, column=table.asset_column))
            )
        rows.setdefault(asset, row)
    if faults:
        raise TableError(*faults[:20])


def _identifier(name: str) -> str:
    """A name as C++ may have it: a dot as two underscores, any other character as one."""
    word = re.sub(r"[^A-Za-z0-9_]", "_", name.replace(".", "__"))
    return word if word[:1].isalpha() or word[:1] == "_" else f"_{word}"


# ---- texts that a spreadsheet takes for formulas when it opens a CSV: named, or written with an apostrophe before them
#
# Source: OWASP, "CSV Injection": = + - @, tab and carriage return at the start of a field.


Formulas = Literal["tell", "keep", "quote"]
"""What becomes of such texts: written as they are and named, as they are without a word, or with an apostrophe."""

_FORMULA = re.compile(r"[=+@\t\r]|-(?!\Z)")
_NUMBER = re.compile(r"[+-]?(?:\d+(?:\.\d*)?|\.\d+)(?:[eE][+-]?\d+)?")


def is_formula(text: str) -> bool:
    """Whether a spreadsheet may compute a text; a plain number, and the - that says Any, do no harm."""
    return _FORMULA.match(text) is not None and _NUMBER.fullmatch(text) is None


def quoted_formulas(columns: Sequence[TextColumn]) -> list[TextColumn]:
    """The columns with an apostrophe before each text, and each name, that a spreadsheet may compute."""
    return [replace(column, name=_quoted(column.name), texts=_distinct(column)) for column in columns]


def _quoted(text: str) -> str:
    return f"'{text}" if is_formula(text) else text


def _distinct(column: TextColumn) -> tuple[str, ...]:
    """The texts with their apostrophes, as different from each other as before."""
    known = set(column.texts)
    columns = []
    for text in column.texts:
        new = _quoted(text)
        while new != text and new in known:
            new = f"'{new}"
        known.add(new)
        columns.append(new)
    return tuple(columns)


def formula_remarks(columns: Sequence[TextColumn]) -> tuple[Remark, ...]:
    """How many cells a spreadsheet may compute, and the first of them; nothing where there is none."""
    flagged = [(column, [is_formula(text) for text in column.texts]) for column in columns]
    rows = [(np.flatnonzero(np.array(flags, np.bool_)[column.codes]), column) for column, flags in flagged if any(flags)]
    n_cells = sum(len(where) for where, _ in rows) + sum(is_formula(column.name) for column in columns)
    first = next((f"{in_quotes(column[int(where[0])])} in {in_quotes(column.name)}" for where, column in rows if len(where)), None)
    if not n_cells:
        return ()
    first = first or in_quotes(next(column.name for column in columns if is_formula(column.name)))
    text = f"{plural(n_cells, 'cell')} may run as a formula in a spreadsheet, first {first}; --formulas quote puts ' before each."
    return (Remark(text),)
