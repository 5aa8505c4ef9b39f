"""JSON both ways: a list of objects, or one object a line, each a row by the names of its columns. Other shapes: `json_shapes`."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from contextdb.columns import TextColumn
from contextdb.errors import Fault, Place, TableError, in_quotes, row_name
from contextdb.exchange.reading import Reading, Remark, listed, require_no_conflicts, text_of_value
from contextdb.files.csv_source import MOST_CHARACTERS, name_faults
from contextdb.files.toml_shapes import what

_ACCEPTED = 'a list of objects, [{"Asset Name": "jog", "speed": "2..4"}], or one object a line'
_TAG = "TagName"
"""The only key of a tag in a list of Unreal's: [{"TagName": "Move.Run"}] says what ["Move.Run"] says."""
MOST_FAULTS = 20
MOST_LEVELS = 16
"""How deep objects may be in a row: each makes the name of a column longer."""


def read_json(text: str, file: str, format_name: str = "json") -> Reading:
    """Read rows from a JSON document or from JSON lines; the text shows which of the two it is.

    A key that a row leaves out, and null, is an empty cell. A list is a set of names; an object inside an object becomes columns
    with a dot: {"Defender": {"speed": 3}} is the column Defender.speed. Raises TableError where the text is not JSON, with its
    line; or no list of objects; or a git conflict is in it.
    """
    require_no_conflicts(text, file)
    rows, lines = parsed_rows(text, file)
    flat = [_flat(row, Place(file, line)) for row, line in zip(rows, lines, strict=True)]
    columns = columns_of_rows(flat, file)
    sets = _sets(rows, len(rows))
    missing = [name for name in (c.name for c in columns) if any(name not in row for row in flat)]
    remarks = [Remark(f"some rows have no {listed(missing)}; those cells are empty.")] if missing else []
    return Reading(tuple(columns), format_name, tuple(remarks), has_whole_names=True, sets=sets)


def _sets(rows: Sequence[Mapping[str, Any]], n_rows: int) -> dict[str, NDArray[np.bool_]]:
    """The rows in which each column holds a list, which is a set of names."""
    flags_by_name: dict[str, NDArray[np.bool_]] = {}
    for at, row in enumerate(rows):
        for name in _lists(row):
            flags_by_name.setdefault(name, np.zeros(n_rows, np.bool_))[at] = True
    return flags_by_name


def _lists(row: Mapping[str, Any], prefix: str = "") -> Iterator[str]:
    """The columns of a row that hold a list; the row is no deeper than `MOST_LEVELS`."""
    for key, value in row.items():
        if isinstance(value, list):
            yield prefix + key
        elif isinstance(value, dict):
            yield from _lists(value, f"{prefix}{key}.")


def parsed_rows(text: str, file: str) -> tuple[list[dict[str, Any]], list[int | None]]:
    """The objects of a JSON document or of JSON lines, and the line of each where it is known."""
    stripped = text.strip()
    if not stripped:
        raise TableError(Fault("the file is empty.", _ACCEPTED, place=Place(file)))
    if stripped.startswith("["):
        rows = _loaded(text, file)
        return _shaped(rows, file) or _objects(rows, [None] * len(rows), file)
    lines = [(number, line) for number, line in enumerate(text.split("\n"), 1) if line.strip()]
    document = _tried(stripped)
    if rows_of_shape(document) is not None and (shaped := _shaped(_loaded(text, file), file)):
        return shaped
    inner = _only_list(document)
    if inner is not None:
        return _objects(inner, [None] * len(inner), file)
    if isinstance(document, dict) or isinstance(_tried(lines[0][1]), dict):
        problem = (
            [_loaded(line, file, number) for number, line in lines]
            if len(lines) > 1 and document is None
            else [_loaded(text, file)]
        )
        return _objects(problem, [number for number, _ in lines][: len(problem)], file)
    document = _loaded(text, file)
    raise TableError(Fault(f"the document is {what(document)} without one list of rows.", _ACCEPTED, place=Place(file)))


def _shaped(document: object, file: str) -> tuple[list[dict[str, Any]], list[int | None]] | None:
    """The rows of a document that is no list of them, but is a table all the same; None for all others."""
    rows = rows_of_shape(document)
    if isinstance(rows, Fault):
        raise TableError(rows.at(Place(file)))
    return None if rows is None else _objects(rows, [None] * len(rows), file)


def _only_list(document: object) -> list[Any] | None:
    """The rows of a document such as {"rows": [...]}, whose only list of objects they are."""
    lists = [value for value in document.values() if isinstance(value, list)] if isinstance(document, dict) else []
    return lists[0] if len(lists) == 1 and lists[0] and all(isinstance(row, dict) for row in lists[0]) else None


def _tried(line: str) -> object:
    try:
        return json.loads(line)
    except (ValueError, RecursionError):
        return None


def _loaded(text: str, file: str, line: int | None = None) -> Any:
    try:
        return json.loads(
            text, object_pairs_hook=_without_twins, parse_constant=lambda name: None if name == "NaN" else float(name)
        )
    except json.JSONDecodeError as error:
        place = Place(file, error.lineno if line is None else line)
        raise TableError(Fault(f"this is not JSON: {error.msg} at character {error.colno}.", _ACCEPTED, place=place)) from None
    except RecursionError:
        raise TableError(Fault("lists or objects are nested too deeply.", _ACCEPTED, place=Place(file, line))) from None
    except _TwinError as error:
        raise TableError(Fault(f"{error}.", "each key once in an object", place=Place(file, line))) from None
    except ValueError:  # Python reads no whole number of more than some thousand digits
        raise TableError(Fault("a number has too many digits.", "numbers that a double holds", place=Place(file, line))) from None


class _TwinError(ValueError):
    """A key appears twice in one object."""


def _without_twins(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    members = dict(pairs)
    if len(members) < len(pairs):
        seen = set[str]()
        twin = next(key for key, _ in pairs if key in seen or seen.add(key))  # type: ignore[func-returns-value]
        raise _TwinError(f"the key {in_quotes(twin)} appears twice in one object")
    return members


def _objects(rows: Sequence[Any], lines: Sequence[int | None], file: str) -> tuple[list[dict[str, Any]], list[int | None]]:
    faults = [
        Fault(f"{row_name(at)} is {what(row)}, no object.", _ACCEPTED, place=Place(file, line))
        for at, (row, line) in enumerate(zip(rows, lines, strict=True))
        if not isinstance(row, dict)
    ]
    if faults:
        raise TableError(*faults[:MOST_FAULTS])
    return list(rows), list(lines)


def _flat(row: Mapping[str, Any], place: Place, prefix: str = "", level: int = 1) -> dict[str, str]:
    if level > MOST_LEVELS:
        raise TableError(Fault("objects are nested too deeply.", f"at most {MOST_LEVELS} levels", place=place))
    texts_by_name: dict[str, str] = {}
    for key, value in row.items():
        name = prefix + key
        texts = _flat(value, place, f"{name}.", level + 1) if isinstance(value, dict) else {name: _text(value, name, place)}
        for twin in texts.keys() & texts_by_name.keys():
            raise TableError(Fault(f"the key {in_quotes(twin)} appears twice in one row.", "each key once", place=place))
        texts_by_name |= texts
    return texts_by_name


def _text(value: object, name: str, place: Place) -> str:
    if isinstance(value, list) and all(isinstance(item, dict) and [*item] == [_TAG] for item in value):
        value = [item[_TAG] for item in value]
    if isinstance(value, list) and any(isinstance(item, (list, dict)) for item in value):
        problem = f"{in_quotes(name)} holds a list with lists or objects in it."
        raise TableError(Fault(problem, "texts, numbers, true, false, null, and lists of texts", place=place))
    if isinstance(value, list) and not value:
        return ""
    text = text_of_value(value)
    if len(text) > MOST_CHARACTERS:
        fault = Fault(
            f"{in_quotes(name)} has {len(text):,} characters.", f"at most {MOST_CHARACTERS:,} characters in a cell", place=place
        )
        raise TableError(fault)
    if not text.isascii() and any("\ud800" <= c <= "\udfff" for c in text):
        raise TableError(Fault(f"{in_quotes(name)} has half a surrogate pair.", "text in UTF-8", place=place))
    return text


def columns_of_rows(rows: Sequence[Mapping[str, str]], file: str) -> list[TextColumn]:
    """Columns of rows, in the order in which their names first appear. Raises TableError where there is no row, or a name that no
    column can have."""
    names = list(dict.fromkeys(name for row in rows for name in row))
    faults = [fault.at(Place(file)) for fault in name_faults(names)]
    if not names:
        faults = [Fault("there is no row.", _ACCEPTED, place=Place(file))]
    if faults:
        raise TableError(*faults)
    return [TextColumn.of(name, [row.get(name, "") for row in rows]) for name in names]


def write_json(columns: Sequence[TextColumn]) -> bytes:
    """Columns as one JSON document: a list with an object for each row, every cell a text."""
    return ("[\n" + ",\n".join(_row_lines(columns)) + "\n]\n" if columns[0].n_rows else "[]\n").encode()


def write_json_lines(columns: Sequence[TextColumn]) -> bytes:
    """Columns as JSON lines: an object for each row, every cell a text."""
    return "".join(f"{line}\n" for line in _row_lines(columns)).encode()


def _row_lines(columns: Sequence[TextColumn]) -> Iterator[str]:
    fields = [[f"{_string(c.name)}: {_string(text)}" for text in c.texts] for c in columns]
    cells = [[texts[code] for code in column.codes.tolist()] for texts, column in zip(fields, columns, strict=True)]
    return (f"{{{', '.join(row)}}}" for row in zip(*cells, strict=True))


def _string(text: str) -> str:
    return json.dumps(text, ensure_ascii=False)


# ---- JSON documents that are tables in another shape than a list of rows: columns, rows with a name each, or as FModel
# exports them. {"speed": {"0": 1, "1": 2}, "on": {"0": true, "1": false}} pandas: columns, each with a cell for each number
# of a row {"0": {"speed": 1, "on": true}, "1": {"speed": 2, "on": false}} pandas, orient="index": rows by their numbers
# {"speed": [1, 2], "on": [true, false]} polars and others: columns as lists {"columns": ["speed"], "index": [0, 1], "data":
# [[1], [2]]} pandas, orient="split" [{"Type": "DataTable", "Rows": {"jog": {"Speed": 1}}}] FModel: rows by the names of
# assets Objects of objects with names on both levels may be either of the first two; they are refused. Sources: pandas,
# DataFrame.to_json; FModel and CUE4Parse, the JSON of a UDataTable

Rows = list[dict[str, Any]]
NAME = "Name"
"""The column of the names of a DataTable's rows, as Unreal's own JSON calls it."""
_ACCEPTED_SHAPE = "a list of objects, one for each row"
_RECORDS = 'to export it with orient="records", as pandas calls that'


def rows_of_shape(document: object) -> Rows | Fault | None:
    """The rows of a document of one of these shapes, why it has none, or None where it is of no such shape."""
    exported = _exported(document)
    if exported is not None:
        return exported
    if not isinstance(document, dict) or not document:
        return None
    if {"columns", "data"} <= document.keys() <= {"columns", "index", "data"}:
        return _split(document["columns"], document["data"])
    parts = list(document.values())
    if all(isinstance(part, list) and not any(isinstance(item, (list, dict)) for item in part) for part in parts):
        return _shaped_lists(document)
    if all(isinstance(part, dict) and part for part in parts):
        return _shaped_objects(document)
    return None


def _exported(document: object) -> Rows | Fault | None:
    """The rows of a DataTable as FModel exports it: an object, or the only one of a list, whose "Rows" are objects."""
    if isinstance(document, list) and len(document) == 1:
        (document,) = document
    rows = document.get("Rows") if isinstance(document, dict) else None
    if not isinstance(rows, dict) or not all(isinstance(row, dict) for row in rows.values()):
        return None
    if any(NAME in row for row in rows.values()):
        return Fault(f'rows of the DataTable have a "{NAME}" beside their names.', _ACCEPTED_SHAPE)
    return [{NAME: name} | row for name, row in rows.items()]


def _split(names: object, data: object) -> Rows | Fault:
    is_table = (
        isinstance(names, list)
        and all(isinstance(name, str) for name in names)
        and len(set(names)) == len(names)
        and isinstance(data, list)
        and all(isinstance(row, list) and len(row) == len(names) for row in data)
    )
    if not is_table:
        return Fault('"columns" and "data" do not fit together.', _ACCEPTED_SHAPE, _RECORDS)
    return [dict(zip(names, row, strict=True)) for row in data]  # type: ignore[call-overload, attr-defined]


def _shaped_lists(columns: dict[str, list[Any]]) -> Rows | Fault:
    lengths = {name: len(column) for name, column in columns.items()}
    if len(set(lengths.values())) > 1:
        lengths_text = ", ".join(f"{in_quotes(name)} {length:,}" for name, length in [*lengths.items()][:3])
        return Fault(f"the document is lists of several lengths: {lengths_text}.", _ACCEPTED_SHAPE)
    return [dict(zip(columns, row, strict=True)) for row in zip(*columns.values(), strict=True)]


def _shaped_objects(document: dict[str, dict[str, Any]]) -> Rows | Fault:
    if _are_numbers(document):
        return list(document.values())
    first, *others = document.values()
    if _are_numbers(first) and all(other.keys() == first.keys() for other in others):
        return [{name: column[row] for name, column in document.items()} for row in first]
    return Fault("the document is an object of objects, which may be its rows or its columns.", _ACCEPTED_SHAPE, _RECORDS)


def _are_numbers(keys: dict[str, Any]) -> bool:
    return all(key.isdecimal() and key.isascii() for key in keys)
