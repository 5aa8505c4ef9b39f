"""Conditions: the typed columns of a table, declared or inferred from their cells."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from contextdb.cells import reads
from contextdb.columns import TextColumn
from contextdb.domains import BOOL, NUMBER, TAGS, TEXT, Domain

READABLE_SHARE = 0.8
"""A type is inferred when at least this share of the rows that are not Any can be read as it; the rest are faults."""

_ANY_WORDS = frozenset(("", "-", "any"))
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

    @property
    def role(self) -> str | None:
        """The role before the first dot: Defender of Defender.DepthChart; None for a plain fact."""
        head, dot, _ = self.name.partition(".")
        return head if dot else None


def infer_condition(column: TextColumn) -> Condition:
    """The condition of a column that nobody declared, from its cells: bool, number or tags where they read so, else text."""
    counts = np.bincount(column.codes, minlength=len(column.texts))
    said = {t: int(n) for t, n in zip(column.texts, counts, strict=True) if t.strip().casefold() not in _ANY_WORDS}
    domains = [BOOL, NUMBER, TAGS] if {t.strip() for t in said} - _DIGITS else [NUMBER]
    domain = next((d for d in domains if said and _mostly_reads(said, d)), TEXT)
    return Condition(column.name, domain, is_declared=False)


def _mostly_reads(said: dict[str, int], domain: Domain) -> bool:
    """Whether most rows read as a domain, the commonest texts first; stops at the row that decides it is not so."""
    total = sum(said.values())
    may_fail = total - READABLE_SHARE * total
    for text, n_rows in sorted(said.items(), key=lambda item: -item[1]):
        may_fail -= 0 if reads(text, domain) else n_rows
        if may_fail < 0:
            return False
    return True
