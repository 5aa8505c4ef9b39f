"""Conditions: the typed columns of a table, declared or inferred from their cells."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from contextdb.cells.domains import BOOL, NUMBER, TAGS, TEXT, Domain
from contextdb.cells.grammar import reads
from contextdb.cells.numbers import are_plain
from contextdb.cells.words import ANY_WORDS
from contextdb.columns import TextColumn

Swaps = tuple[tuple[str, str], ...]
"""Pairs of values or tags that change places in a mirror."""

Mirror = Literal["negate", "none"] | Swaps

READABLE_SHARE = 0.8
"""A type is inferred when at least this share of the rows that are not Any can be read as it; the rest are faults."""


_DIGITS = frozenset(("0", "1"))


@dataclass(frozen=True, slots=True)
class Condition:
    """A named fact that cells are about: its domain, and what people should know of it."""

    name: str
    domain: Domain
    unit: str = ""
    description: str = ""
    expr: str | None = None
    """For a derived fact: how it is computed from others."""
    is_declared: bool = True
    """False where the type was inferred from the cells."""
    mirror: Mirror | None = None
    """How its facts change in a mirror; None where that is not declared. See `contextdb.cells.mirroring`."""

    @property
    def role(self) -> str | None:
        """The role before the first dot: Defender of Defender.DepthChart; None for a plain fact."""
        head, dot, _ = self.name.partition(".")
        return head if dot else None


def infer_condition(column: TextColumn) -> Condition:
    """The condition of a column that nobody declared, from its cells: bool, number or tags where they read so, else text."""
    counts = np.bincount(column.codes, minlength=len(column.texts))
    flags = are_plain(column.texts)
    if flags is not None and _is_number_column(column.texts, counts, flags):
        return Condition(column.name, NUMBER, is_declared=False)
    said = _said(column.texts, counts)
    domains = [BOOL, NUMBER, TAGS] if {t.strip() for t in said} - _DIGITS else [NUMBER]
    domain = next((d for d in domains if said and _mostly_reads(said, d)), TEXT)
    return Condition(column.name, domain, is_declared=False)


def _said(texts: Sequence[str], counts: NDArray[np.int64]) -> dict[str, int]:
    """How many rows say each text that is not Any."""
    return {t: n for t, n in zip(texts, counts.tolist(), strict=True) if t.strip().casefold() not in ANY_WORDS}


def _is_number_column(texts: Sequence[str], counts: NDArray[np.int64], are_numbers: NDArray[np.bool_]) -> bool:
    """Whether so many rows say plain numbers, which no bool does, that the column is one of numbers: tags are asked after those."""
    rest = _said([texts[i] for i in np.flatnonzero(~are_numbers).tolist()], counts[~are_numbers])
    n_others = sum(rest.values())
    n_rows = int(counts[are_numbers].sum()) + n_others
    return n_rows > n_others and n_others <= n_rows - READABLE_SHARE * n_rows


def _mostly_reads(said: dict[str, int], domain: Domain) -> bool:
    """Whether most rows read as a domain, the commonest texts first; stops at the row that decides it is not so."""
    total = sum(said.values())
    may_fail = total - READABLE_SHARE * total
    for text, n_rows in sorted(said.items(), key=lambda item: -item[1]):
        may_fail -= 0 if reads(text, domain) else n_rows
        if may_fail < 0:
            return False
    return True
