"""Files that lie beside tables and are none: a stick, markup, saved contexts under another name, a recorded session.

Only files that contextdb.toml does not declare are looked at: what it declares is a table, whatever it holds. The look is at the
header and a few lines, and only at forms that no table has; a table with faults is a table. An edge: this reads parts of files.
"""

from __future__ import annotations

import csv
import io
from collections.abc import Callable, Collection, Sequence
from contextlib import suppress
from pathlib import Path

from contextdb.disk import CASES_SUFFIX, NOTES_SUFFIX
from contextdb.errors import in_quotes
from contextdb.files.texts import is_parquet

HEAD = 65_536
"""Bytes of a file that are looked at."""
FEW_ROWS = 20
TIMES = ("time", "time_s", "times", "timestamp", "t", "tick", "frame")
CASE_COLUMNS = ("Case", "Expected", "Note")
"""The columns of saved contexts that are no facts: a name, the assets that are expected, and why in words."""
SESSION = b"contextdb.trace"
FOOTER_AT = 8

Rows = Sequence[Sequence[str]]


def other_form(path: Path, conditions: Collection[str]) -> str | None:
    """What a file is, in words, that looks like something else than a table; None for what may be a table.

    `conditions` are those that contextdb.toml declares.
    """
    with suppress(OSError):
        if is_parquet(path):
            return "a recorded session of motion matching" if SESSION in _footer(path) else None
        with path.open("rb") as file:
            head = file.read(HEAD)
        rows = _rows(head.decode("utf-8-sig", "replace"))
        names = [name.strip() for name in rows[0]] if rows else []
        return next((form for is_one, form in _forms(conditions) if names and is_one(names, rows[1 : FEW_ROWS + 1])), None)
    return None


def cases_path(table: Path) -> Path:
    return table.with_name(table.stem + CASES_SUFFIX)


def notes_path(table: Path) -> Path:
    """The file of the notes on a table's file."""
    return table.with_name(table.stem + NOTES_SUFFIX)


def stray_sentence(path: Path, form: str) -> str:
    """What to write in contextdb.toml so that a file is read which looks like none of a table."""
    name = path.stem
    section = name if name.isidentifier() and name.isascii() else f'"{name}"'
    declared = f"[tables.{section}] file = {in_quotes(path.name)}"
    return f"the file looks like {form}, so it is not read as a table. To have it read, write {declared}; else move it elsewhere."


def _forms(conditions: Collection[str]) -> Sequence[tuple[Callable[[Sequence[str], Rows], bool], str]]:
    return (
        (lambda names, rows: {"asset", "tag", "from", "to"} <= {name.casefold() for name in names}, "markup of clips"),
        (lambda names, rows: set(CASE_COLUMNS[:2]) <= set(names), "saved contexts, whose files end in .cases.csv"),
        (lambda names, rows: names[0].casefold() in TIMES and _are_numbers(rows), "recorded moments, such as a stick"),
        (lambda names, rows: len(names) > 1 and all(name in conditions for name in names), "contexts: it has no column of assets"),
    )


def _are_numbers(rows: Rows) -> bool:
    """Whether the first cell of every row is a number."""
    try:
        return all(bool(row) and float(row[0]) == float(row[0]) for row in rows if any(cell.strip() for cell in row))
    except ValueError:
        return False


def _rows(text: str) -> list[list[str]]:
    """The first rows of a CSV text; as many as can be read."""
    records: list[list[str]] = []
    with suppress(csv.Error):
        for row in csv.reader(io.StringIO(text, newline="")):
            records.append(row)
            if len(records) > FEW_ROWS:
                break
    return records


def _footer(path: Path) -> bytes:
    """The end of a Parquet file, where its metadata are."""
    with path.open("rb") as file:
        size = file.seek(0, io.SEEK_END)
        file.seek(max(0, size - FOOTER_AT))
        length = int.from_bytes(file.read(4), "little")
        file.seek(max(0, size - FOOTER_AT - min(length, size)))
        return file.read()
