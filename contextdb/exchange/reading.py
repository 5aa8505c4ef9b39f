"""What was read from another format: columns of texts, what the file itself says of them, and what a person should know."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

from contextdb.columns import TextColumn
from contextdb.errors import shown
from contextdb.files import AnySource
from contextdb.schema import EMPTY, Schema

MOST_REMARKS = 20
"""Remarks of one kind that are listed; then how many more there are is told."""


@dataclass(frozen=True, slots=True)
class Remark:
    """Something that a person should know of a reading or a writing: how a file was understood, or what could not be kept."""

    text: str
    place: str = ""
    """Where: "line 3", "cell B7"; empty where it is about the whole file."""
    is_loss: bool = False
    """Whether something of the file is not in the table, or reads otherwise there."""

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
    """The bytes, where the file is one that contextdb writes as it stands."""
    sheets: tuple[str, ...] = ()
    """The sheets of a workbook that hold cells."""
    outputs: tuple[str, ...] = field(default=())
    """Columns that the format says are data and no conditions."""

    @property
    def n_rows(self) -> int:
        """How many rows there are."""
        return self.columns[0].n_rows if self.columns else 0

    @property
    def names(self) -> list[str]:
        """The names of the columns, in order."""
        return [column.name for column in self.columns]

    def column(self, name: str) -> TextColumn:
        """A column by its name."""
        return next(column for column in self.columns if column.name == name)


def capped(remarks: Sequence[Remark], what: str) -> tuple[Remark, ...]:
    """The first remarks of one kind, and one that says how many more there are: "12 more formulas"."""
    if len(remarks) <= MOST_REMARKS:
        return tuple(remarks)
    rest = Remark(f"{len(remarks) - MOST_REMARKS:,} more {what}.", is_loss=remarks[0].is_loss)
    return (*remarks[:MOST_REMARKS], rest)


def listed(names: Sequence[str], most: int = 6) -> str:
    """Names for a remark, the first few of them."""
    head = ", ".join(f'"{shown(name)}"' for name in names[:most])
    return head if len(names) <= most else f"{head} and {len(names) - most} more"
