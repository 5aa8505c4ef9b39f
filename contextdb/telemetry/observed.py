"""What telemetry says of a table: numbers, gaps and what is wrong with the recorded facts. Data only."""

from __future__ import annotations

from dataclasses import dataclass

from contextdb.cells.words import InCells
from contextdb.covering.report import Nearest, format_percent
from contextdb.errors import Fault


@dataclass(frozen=True, slots=True)
class SeenGap(InCells):
    """A box of contexts without a valid row that the game was in. `cells` leaves out the conditions that it does not restrict."""

    id: str
    """As that of a gap with the same cells in a coverage report."""
    moments: float
    """How many recorded moments lie in it; whole where `is_exact`."""
    share: float
    """Of all recorded moments."""
    new_share: float
    """What no earlier gap of the list holds."""
    cells: dict[str, str]
    nearest: Nearest | None
    is_exact: bool = True
    """False where there were too many different contexts without a row to keep them all: shares are then those of a sample."""

    def to_json(self) -> dict[str, object]:
        return {
            "id": self.id,
            "moments": self.moments,
            "share": self.share,
            "new_share": self.new_share,
            "exact": self.is_exact,
            "cells": self.cells,
            "nearest": None if self.nearest is None else self.nearest.to_json(),
        }


@dataclass(frozen=True, slots=True)
class FactNote:
    """A condition whose recorded facts are missing, or outside its domain, in some moments."""

    condition: str
    moments: int
    examples: tuple[str, ...] = ()
    """A few of the values found outside the domain, in the order of their letters."""

    def to_json(self) -> dict[str, object]:
        return {"condition": self.condition, "moments": self.moments, "examples": list(self.examples)}


@dataclass(frozen=True, slots=True)
class BadFile:
    """A file that could not be read; nothing of it is counted."""

    file: str
    faults: tuple[Fault, ...]

    def to_json(self) -> dict[str, object]:
        return {"file": self.file, "message": "\n".join(map(str, self.faults))}


@dataclass(frozen=True)
class Observed:
    """Recorded contexts evaluated against a table.

    A moment is a row of a file, or as many as the count column says. A missing fact, and one outside its domain, is accepted by no
    cell but Any; a number outside its bounds is compared as it is. Sums are exact.
    """

    table: str
    files: int
    """Files that were read."""
    rows: int
    """Rows of these files."""
    moments: int
    """Rows, each counted as often as its count column says."""
    distinct: int
    """Contexts that the table distinguishes."""
    distinct_is_exact: bool
    """False where there were too many to keep; `distinct` is then an estimate (standard error 0.4 %)."""
    uncovered: int
    """Moments without a valid row."""
    hits: tuple[int, ...]
    """For each row the moments in which it is valid."""
    gaps: tuple[SeenGap, ...]
    """Where the moments without a row are, the largest first."""
    elsewhere: float
    """Moments without a row that lie in no box of the domains: a fact is missing or outside its domain."""
    missing: tuple[FactNote, ...]
    outside: tuple[FactNote, ...]
    unknown_columns: tuple[str, ...]
    """Columns that the table does not ask for."""
    unread: tuple[BadFile, ...] = ()

    @property
    def covered(self) -> float:
        """The share of the moments that have a valid row; 1 where there is no moment."""
        return (self.moments - self.uncovered) / self.moments if self.moments else 1.0

    @property
    def is_complete(self) -> bool:
        """Whether every file was read."""
        return not self.unread

    @property
    def never_used(self) -> tuple[int, ...]:
        """The rows that are valid in no recorded moment."""
        return tuple(row for row, n in enumerate(self.hits) if n == 0)

    @property
    def headline(self) -> str:
        """The covered share of the moments, in one sentence."""
        if not self.moments:
            return "No moment was recorded."
        about = "" if self.distinct_is_exact else "about "
        share = format_percent(self.covered)
        return f"{share} of {self.moments:,} recorded moments have a valid row ({about}{self.distinct:,} distinct)."

    def to_json(self) -> dict[str, object]:
        """As plain data: `telemetry` in `coverage --format json`."""
        return {
            "rows": self.rows,
            "moments": self.moments,
            "distinct": self.distinct,
            "distinct_exact": self.distinct_is_exact,
            "covered": self.covered,
            "uncovered": self.uncovered,
            "elsewhere": self.elsewhere,
            "hits": list(self.hits),
            "gaps": [gap.to_json() for gap in self.gaps],
            "missing": [note.to_json() for note in self.missing],
            "outside": [note.to_json() for note in self.outside],
            "unknown_columns": list(self.unknown_columns),
            "files": self.files,
            "unread": [file.to_json() for file in self.unread],
        }
