"""Conditions: the typed columns of a table, declared or inferred from their cells."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from contextdb.cells.domains import Domain

Swaps = tuple[tuple[str, str], ...]
"""Pairs of values or tags that change places in a mirror."""

Mirror = Literal["negate", "none"] | Swaps


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

    weight: float = 1.0
    """What a cell of this condition counts under the policy "specific"."""
    owner: str = ""
    """Who answers for it."""
    hysteresis: float = 0.0
    """How far beyond the edges of its cells a row that plays stays valid. See `contextdb.cells.mirroring`."""

    @property
    def role(self) -> str | None:
        """The role before the first dot: Defender of Defender.DepthChart; None for a plain fact."""
        head, dot, _ = self.name.partition(".")
        return head if dot else None
