"""What was read from another format: columns of texts, what the file itself says of them, and what a person should know."""

from __future__ import annotations

import datetime
import math
import re
from collections import Counter
from collections.abc import Container, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from contextdb.cells.kinds import KINDS
from contextdb.cells.words import format_number, quoted, says_any
from contextdb.columns import TextColumn
from contextdb.errors import Fault, Place, TableError, in_quotes, plural, safe_text
from contextdb.exchange.everyday import are_ends, without_end
from contextdb.files.texts import AnySource
from contextdb.schema.settings import EMPTY, Schema

ERRORS = frozenset(
    (
        "#N/A",
        "#REF!",
        "#VALUE!",
        "#DIV/0!",
        "#NAME?",
        "#NULL!",
        "#NUM!",
        "#SPILL!",
        "#CALC!",
        "#GETTING_DATA",
        "#FIELD!",
        "#BLOCKED!",
    )
)
"""What Excel shows in a cell whose formula failed. No cell of ours reads it, so that it is never taken for a value or for Any."""

MOST_REMARKS = 20
"""Remarks of one kind that are listed; then how many more there are is reported."""


class SheetWanted(TableError):
    """Several sheets of a workbook hold cells, and none of them is named."""


class TableWanted(TableError):
    """A sheet holds several tables, and none of them is named."""

    def __init__(self, *faults: Fault, blocks: Sequence[str]) -> None:
        super().__init__(*faults)
        self.blocks = blocks
        """Their cells, as in A1:F20."""


@dataclass(frozen=True, slots=True)
class Remark:
    """Something that a person should know of a reading or a writing: how a file was understood, or what could not be kept."""

    text: str
    place: str = ""
    """Where: "line 3", "cell B7"; empty where it is about the whole file."""
    is_loss: bool = False
    """Whether something of the file is not in the table, or reads otherwise there."""
    n_left_out: int = 0
    """The rows that were not written."""

    def __str__(self) -> str:
        return f"{self.place}: {self.text}" if self.place else self.text


@dataclass(frozen=True, eq=False)
class Reading:
    """A table as another format tells it."""

    columns: tuple[TextColumn, ...]
    """Its columns, all equally long."""
    format: str
    """The name of the format it was read as."""
    remarks: tuple[Remark, ...] = ()
    schema: Schema = EMPTY
    """What the file itself says: the types of its columns, and at most one table's settings."""
    source: AnySource | None = None
    """The bytes, where the file is one that contextdb writes as it is."""
    sheets: tuple[str, ...] = ()
    """The sheets of a workbook that hold cells."""
    outputs: tuple[str, ...] = field(default=())
    """Columns that the format says are data and no conditions."""
    has_whole_names: bool = False
    """Whether a text is one name, blanks and all, as other programs mean it; else it is a cell of ours, where blanks part names."""
    sets: Mapping[str, NDArray[np.bool_]] = field(default_factory=dict)
    """Of a column the rows in which the format has a set of names: there the text is a cell of ours all the same."""

    spots: Mapping[tuple[int, str], tuple[str, str]] = field(default_factory=dict)
    """Notes on cells and colours of rows, by row and column; a colour stands at the column ""."""

    @property
    def n_rows(self) -> int:
        return self.columns[0].n_rows if self.columns else 0

    @property
    def names(self) -> list[str]:
        """The names of the columns, in order."""
        return [column.name for column in self.columns]

    def column(self, name: str) -> TextColumn:
        return self._by_name[name]

    @cached_property
    def _by_name(self) -> Mapping[str, TextColumn]:
        """The first column of each name."""
        return {column.name: column for column in reversed(self.columns)}

    def whole_names(self, column: TextColumn) -> TextColumn | None:
        """A column as cells in which each text is one name, quoted where need be; None where that changes nothing."""
        if not self.has_whole_names:
            return None
        whole = [_whole_name(text) for text in column.texts]
        if whole == list(column.texts):
            return None
        are_sets = self.sets.get(column.name, np.zeros(column.n_rows, np.bool_))
        codes = zip(column.codes.tolist(), are_sets.tolist(), strict=True)
        return TextColumn.of(column.name, (column.texts[code] if is_set else whole[code] for code, is_set in codes))


def _whole_name(text: str) -> str:
    """A text of another program as a cell that accepts this one name; what says Any stays, and so does an error of Excel."""
    name = text.strip()
    return text if says_any(name) or name in ERRORS or quoted(name) == name else quoted(name)


def capped(remarks: Sequence[Remark], what: str) -> tuple[Remark, ...]:
    """The first remarks of one kind, and one that says how many more there are: "12 more formulas"."""
    if len(remarks) <= MOST_REMARKS:
        return tuple(remarks)
    n_left_out = sum(remark.n_left_out for remark in remarks[MOST_REMARKS:])
    rest = Remark(f"{len(remarks) - MOST_REMARKS:,} more {what}.", is_loss=remarks[0].is_loss, n_left_out=n_left_out)
    return (*remarks[:MOST_REMARKS], rest)


def listed(names: Sequence[str], most: int = 6) -> str:
    """Names for a remark, the first few of them."""
    head = ", ".join(f'"{safe_text(name)}"' for name in names[:most])
    return head if len(names) <= most else f"{head} and {len(names) - most} more"


# ---- values of other formats as the texts of cells


DATES = (datetime.date, datetime.time, datetime.datetime, datetime.timedelta)


def text_of_value(value: object) -> str:
    """The text of a value: a string as it is, a bool True or False, a number in the fewest digits, a list its names, None empty.

    Dates become ISO texts, at midnight without a time; NaN, which no cell can mean, is empty. What is nested deeper becomes its
    Python text.
    """
    if isinstance(value, str):
        return value
    if value is None or (isinstance(value, float) and math.isnan(value)):
        return ""
    if isinstance(value, bool):
        return str(value)
    if isinstance(value, int):
        return str(value)
    if isinstance(value, float):
        return format_number(value)
    if isinstance(value, datetime.datetime) and value.time() == datetime.time():
        return value.date().isoformat()
    if isinstance(value, (datetime.date, datetime.time)):
        return value.isoformat()
    if isinstance(value, (list, tuple)):
        return " ".join(quoted(text_of_value(item)) for item in value)
    return str(value)


# ---- git's conflict marks in a text: named with their lines, never read as rows


_MARK = re.compile(r"^(?:<{7}|>{7}|\|{7})(?: .*)?$|^={7}$", re.MULTILINE)
_ACCEPTED = "one version of each row"
_MEND = 'to keep one side and delete the lines "<<<<<<<", "=======" and ">>>>>>>"'


def begins_like_a_mark(text: str) -> bool:
    """Whether a text begins as a mark of git does, so that the row it begins may be none."""
    return text.startswith(("<<<<<<<", ">>>>>>>", "|||||||"))


def require_no_conflicts(text: str, file: str) -> None:
    """Refuse a text in which git left a conflict. Raises TableError with the lines on which conflicts start; a mark that is alone,
    after a mend that was not finished, is named too."""
    unified = text.replace("\r\n", "\n").replace("\r", "\n")
    marks, line, at = list[tuple[int, str]](), 1, 0
    for match in _MARK.finditer(unified):
        line, at = line + unified.count("\n", at, match.start()), match.start()
        marks.append((line, match[0][0]))
    starts = [line for line, mark in marks if mark == "<"]
    if not starts and not any(mark == ">" for _, mark in marks):
        return
    first = starts[0] if starts else marks[0][0]
    what = "an unresolved git conflict starts here" if starts else "this line is a conflict mark of git"
    more = f"; there are {plural(len(starts), 'conflict')} in the file" if len(starts) > 1 else ""
    raise TableError(Fault(f"{what}{more}.", _ACCEPTED, _MEND, Place(file, first)))


# ---- numbers with a decimal comma, which a cell of ours reads as centre and tolerance: "0,5" as 0 ± 5


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


# ---- two columns of another program that are the ends of one interval, such as "Speed min" and "Speed max", as one column of
# ours


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
