"""JSON documents that are tables in another shape than a list of rows: columns, rows with a name each, or as FModel exports them.

    {"speed": {"0": 1, "1": 2}, "on": {"0": true, "1": false}}       pandas: columns, each with a cell for each number of a row
    {"0": {"speed": 1, "on": true}, "1": {"speed": 2, "on": false}}  pandas, orient="index": rows by their numbers
    {"speed": [1, 2], "on": [true, false]}                           polars and others: columns as lists
    {"columns": ["speed"], "index": [0, 1], "data": [[1], [2]]}      pandas, orient="split"
    [{"Type": "DataTable", "Rows": {"jog": {"Speed": 1}}}]           FModel: rows by the names of assets

Objects of objects with names on both levels may be either of the first two; they are refused.

Sources: pandas, DataFrame.to_json; FModel and CUE4Parse, the JSON of a UDataTable.
"""

from __future__ import annotations

from typing import Any

from contextdb.errors import Fault, in_quotes

Rows = list[dict[str, Any]]
NAME = "Name"
"""The column of the names of a DataTable's rows, as Unreal's own JSON calls it."""
_ACCEPTED = "a list of objects, one for each row"
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
        return _lists(document)
    if all(isinstance(part, dict) and part for part in parts):
        return _objects(document)
    return None


def _exported(document: object) -> Rows | Fault | None:
    """The rows of a DataTable as FModel exports it: an object, or the only one of a list, whose "Rows" are objects."""
    if isinstance(document, list) and len(document) == 1:
        (document,) = document
    rows = document.get("Rows") if isinstance(document, dict) else None
    if not isinstance(rows, dict) or not all(isinstance(row, dict) for row in rows.values()):
        return None
    if any(NAME in row for row in rows.values()):
        return Fault(f'rows of the DataTable have a "{NAME}" beside their names.', _ACCEPTED)
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
        return Fault('"columns" and "data" do not fit together.', _ACCEPTED, _RECORDS)
    return [dict(zip(names, row, strict=True)) for row in data]  # type: ignore[call-overload, attr-defined]


def _lists(columns: dict[str, list[Any]]) -> Rows | Fault:
    lengths = {name: len(column) for name, column in columns.items()}
    if len(set(lengths.values())) > 1:
        lengths_text = ", ".join(f"{in_quotes(name)} {length:,}" for name, length in [*lengths.items()][:3])
        return Fault(f"the document is lists of several lengths: {lengths_text}.", _ACCEPTED)
    return [dict(zip(columns, row, strict=True)) for row in zip(*columns.values(), strict=True)]


def _objects(document: dict[str, dict[str, Any]]) -> Rows | Fault:
    if _are_numbers(document):
        return list(document.values())
    first, *others = document.values()
    if _are_numbers(first) and all(other.keys() == first.keys() for other in others):
        return [{name: column[row] for name, column in document.items()} for row in first]
    return Fault("the document is an object of objects, which may be its rows or its columns.", _ACCEPTED, _RECORDS)


def _are_numbers(keys: dict[str, Any]) -> bool:
    return all(key.isdecimal() and key.isascii() for key in keys)
