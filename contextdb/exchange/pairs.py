"""Two columns of another program that are the ends of one interval, such as "Speed min" and "Speed max", as one column of ours."""

from __future__ import annotations

import re
from collections.abc import Container, Sequence
from dataclasses import replace

from contextdb.cells.words import says_any
from contextdb.columns import TextColumn
from contextdb.errors import in_quotes
from contextdb.exchange.everyday import are_ends, without_end
from contextdb.exchange.reading import Reading, Remark

_NUMBER = re.compile(r"\s*[+-]?(?:\d+(?:[.,]\d+)?|[.,]\d+)\s*")


def with_intervals(reading: Reading, apart: Container[str] = ()) -> Reading:
    """A reading in which columns of least and of greatest values are one column of intervals, and which says so.

    Their names differ in one word, each cell is a number or empty, and no least value is above the greatest. Columns that
    stay `apart`, as those that are declared, and what the file itself declares are no such pair.
    """
    columns, remarks = list(reading.columns), list[Remark]()
    taken = {column.name for column in columns}
    for low in reading.columns:
        if low.name in apart or low.name in reading.schema.conditions:
            continue
        for high in columns:
            name = _common_name(low.name, high.name)
            texts = _intervals(low, high) if name and name not in taken and high.name not in apart else None
            if name and texts:
                columns[columns.index(low)] = TextColumn.of(name, texts)
                columns.remove(high)
                taken.add(name)
                example = next(text for text in texts if ".." in text)
                both = f"{in_quotes(low.name)} and {in_quotes(high.name)} are one interval, {in_quotes(name)}, such as {example}."
                remarks.append(Remark(f"the columns {both}"))
                break
    if not remarks:
        return reading
    return replace(reading, columns=tuple(columns), remarks=(*reading.remarks, *remarks), source=None)


def _common_name(low: str, high: str) -> str:
    """The name of the interval between two columns; empty where they are no such pair."""
    first, second = without_end(low), without_end(high)
    if first is None or second is None or first[1].casefold() != second[1].casefold():
        return ""
    return first[1] if are_ends(first[0], second[0]) else ""


def _intervals(low: TextColumn, high: TextColumn) -> list[str] | None:
    """The cells between two columns; None where a cell is no number, an end is on the wrong side, or no row has both."""
    if not all(says_any(text) or _NUMBER.fullmatch(text) for text in (*low.texts, *high.texts)):
        return None
    texts = [_interval(*ends) for ends in zip(low.to_list(), high.to_list(), strict=True)]
    return (
        [text for text in texts if text is not None] if None not in texts and any(".." in text for text in texts if text) else None
    )


def _interval(low: str, high: str) -> str | None:
    ends: Sequence[str] = ["" if says_any(text) else text.strip().replace(",", ".") for text in (low, high)]
    if all(ends):
        return f"{ends[0]}..{ends[1]}" if float(ends[0]) <= float(ends[1]) else None
    return f">={ends[0]}" if ends[0] else f"<={ends[1]}" if ends[1] else ""
