"""What was read from another format: columns of texts, what the file itself says of them, and what a person should know."""

from __future__ import annotations

import datetime
import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from contextdb.cells.words import format_number, quoted, says_any
from contextdb.columns import TextColumn
from contextdb.errors import Fault, Place, TableError, plural, safe_text
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
