"""Numbers with a decimal comma, which a cell of ours reads as centre and tolerance: "0,5" as 0 ± 5."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace

from contextdb.cells.kinds import KINDS
from contextdb.columns import TextColumn
from contextdb.errors import in_quotes, plural
from contextdb.exchange.reading import Remark

PAIR = re.compile(r"\s*[+-]?[\d.]+,\d+\s*")
"""A cell that another program may mean as one number."""
DECIMAL_COMMA = re.compile(r"(?<=\d),(?=\d)")
_DECIMAL_POINT = re.compile(r"(?<!\.)\.(?!\.)\d")
_NUMERIC = re.compile(r"(?:not\b|[\d\s.,+\-±<>=()\[\]|~])+", re.IGNORECASE)
MOST_TOLD = 20
"""Changed texts of a column that are listed."""
MOST_LISTED = 6
"""Texts of a column that are listed, and rows of a text."""


def with_points(
    columns: Iterable[TextColumn], delimiter: str, is_decimal_comma: bool | None
) -> tuple[list[TextColumn], list[Remark]]:
    """Columns with decimal points for decimal commas, and what was decided.

    `delimiter` is what parts the fields of a text, "" in other files. Left to itself, a comma between two digits is a decimal one
    in a file with semicolons or bars where no number has a point: "3,5" in a file with "3.5" is a pair, centre and tolerance, and
    so it is in a file with tabs, which contextdb writes too, and in a workbook.
    """
    columns = list(columns)
    if is_decimal_comma is False:
        return columns, []
    numeric = [[text for text in column.texts if text and _NUMERIC.fullmatch(text)] for column in columns]
    has_comma = [any(DECIMAL_COMMA.search(text) for text in texts) for texts in numeric]
    if not any(has_comma):
        return columns, []
    is_pointed = any(_DECIMAL_POINT.search(text) for texts in numeric for text in texts)
    if is_decimal_comma is None and (is_pointed or delimiter not in (";", "|")):
        return columns, []
    changed = [_pointed(column, texts) if has else column for column, texts, has in zip(columns, numeric, has_comma, strict=True)]
    messages = [_changes(*pair) for pair, has in zip(zip(columns, changed, strict=True), has_comma, strict=True) if has]
    return changed, [Remark(f"decimal commas became points: {text}.", f"column {in_quotes(name)}") for name, text in messages]


def _changes(before: TextColumn, after: TextColumn) -> tuple[str, str]:
    """The name of a column, and what became of its cells: each text with its rows, from 1."""
    rows: dict[tuple[str, str], list[int]] = {}
    for at, pair in enumerate(zip(before.to_list(), after.to_list(), strict=True), 1):
        if pair[0] != pair[1]:
            rows.setdefault(pair, []).append(at)
    each = [f"{in_quotes(old)} is {new} in {_rows(at)}" for (old, new), at in list(rows.items())[:MOST_TOLD]]
    more = f" and {plural(len(rows) - MOST_TOLD, 'other text')}" if len(rows) > MOST_TOLD else ""
    return before.name, f"{', '.join(each)}{more}"


def _pointed(column: TextColumn, numeric: Sequence[str]) -> TextColumn:
    new = {text: DECIMAL_COMMA.sub(".", text) for text in numeric}
    texts = [new.get(text, text) for text in column.texts]
    if len(Counter(texts)) < len(texts):  # two texts became one
        return TextColumn.of(column.name, (texts[code] for code in column.codes.tolist()))
    return replace(column, texts=tuple(texts))


def pair_in(texts: Iterable[str]) -> str:
    """What is said of a number with a comma and no blank behind it, which could be meant as 1.5; empty where there is none."""
    pair = next((text for text in texts if PAIR.fullmatch(text)), None)
    return "" if pair is None else f"; {in_quotes(pair)} is read as centre and tolerance"


def as_pair(text: str) -> str:
    """How a cell reads a number with a comma."""
    centre, _, tolerance = text.strip().rpartition(",")
    return f"{centre} ± {tolerance}"


def commas_in_numbers(name: str, kind: str, cells: TextColumn, other_way: str) -> Iterator[str]:
    """What a person should know of a column of some type in which numbers have a comma and no blank behind it: each such text with
    its rows, from 1. `other_way` says how to read them as decimal commas."""
    texts = [text for text in cells.texts if PAIR.fullmatch(text)] if KINDS[kind].is_numeric else []
    rows = {text: [at + 1 for at, one in enumerate(cells.to_list()) if one == text] for text in texts[:MOST_LISTED]}
    n_cells = sum(text in set(texts) for text in cells.to_list()) if texts else 0
    if not n_cells:
        return
    each = [f"{in_quotes(text)} in {_rows(at)}" for text, at in rows.items() if at]
    more = f" and {plural(len(texts) - MOST_LISTED, 'other text')}" if len(texts) > MOST_LISTED else ""
    meaning, number = as_pair(texts[0]), DECIMAL_COMMA.sub(".", texts[0].strip())
    yield (
        f"column {in_quotes(name)}: {plural(n_cells, 'cell')} with a comma, {', '.join(each)}{more}, read as centre and tolerance, "
        f"{meaning}; {other_way} reads {number}."
    )


def _rows(rows: Sequence[int]) -> str:
    more = f" and {len(rows) - MOST_LISTED:,} more" if len(rows) > MOST_LISTED else ""
    return f"row{'' if len(rows) == 1 else 's'} {', '.join(f'{row:,}' for row in rows[:MOST_LISTED])}{more}"
