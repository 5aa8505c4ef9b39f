"""What motion needs of a table's answer: which assets may play, and what their rows cost. Motion knows no tables, only this.

`contextdb.Matches` is such an `Answer` and `contextdb.ManyMatches` such `Answers`; `NamedAssets` is one without a table.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Protocol, TypeGuard

import numpy as np
from numpy.typing import NDArray

from contextdb import bitmask
from contextdb.bitmask import Words


class Answer(Protocol):
    """The valid rows of a table in one context; R rows, W words a mask (see `contextdb.bitmask`)."""

    @property
    def assets(self) -> Sequence[str]:
        """The assets of the valid rows."""

    @property
    def table_assets(self) -> Sequence[str]:
        """The assets of all rows, R; one object for all answers of a table."""

    @property
    def flags(self) -> NDArray[np.bool_]:
        """Which rows are valid: bool [R]."""

    @property
    def mask(self) -> Words:
        """The same as bits: uint64 [W]."""

    @property
    def plays(self) -> NDArray[np.float64] | None:
        """How each row plays, then what plays without one: float64 [R + 1, 8], see `contextdb.cells.row_play`; None where no row
        says. One object for all answers of a table."""

    @property
    def has_penalties(self) -> bool:
        """Whether soft cells cost something."""

    @property
    def penalties(self) -> NDArray[np.float64]:
        """What the soft cells of each row cost: float64 [R]."""

    @property
    def mirrored(self) -> Answer:
        """The answer for animations that are played mirrored; the same object where it is no other."""

    @property
    def is_widening(self) -> bool:
        """Whether `widened` may be another answer."""

    @property
    def widened(self) -> Answer:
        """The answer for the animation that plays already; the same object where it is no other."""


class Answers(Protocol):
    """The answers of one table in N contexts."""

    def __len__(self) -> int: ...

    def __getitem__(self, context: int, /) -> Answer: ...

    @property
    def table_assets(self) -> Sequence[str]:
        """As in each of the answers."""

    @property
    def mask(self) -> Words:
        """The valid rows of each context as bits: uint64 [N, W]."""

    @property
    def mirrored(self) -> Answers:
        """The answers for animations that are played mirrored."""

    @property
    def is_widening(self) -> bool:
        """Whether an answer may be another one for the animation that plays already."""


class NamedAssets:
    """An answer without a table: the animations of these assets may play."""

    has_penalties = is_widening = False
    plays = None

    def __init__(self, assets: Sequence[str], mirrored: Answer | None = None) -> None:
        self.assets = self.table_assets = assets
        self._mirrored = mirrored

    @property
    def flags(self) -> NDArray[np.bool_]:
        return np.ones(len(self.assets), np.bool_)

    @property
    def mask(self) -> Words:
        return bitmask.full(len(self.assets))

    @property
    def penalties(self) -> NDArray[np.float64]:
        return np.zeros(len(self.assets))

    @property
    def mirrored(self) -> Answer:
        return self if self._mirrored is None else self._mirrored

    @property
    def widened(self) -> Answer:
        return self


def is_answer(given: object) -> TypeGuard[Answer]:
    """Whether it is one answer; by one of its names, as `isinstance` of a protocol takes as long as a small search."""
    return hasattr(given, "table_assets") and not hasattr(given, "lists")


def are_answers(given: object) -> TypeGuard[Answers]:
    """Whether it is the answers of one table in many contexts."""
    return hasattr(given, "lists")


def has_casts(answer: Any) -> bool:
    """Whether actors were cast for it: `casts(roles)` gives each cast with its rows."""
    return hasattr(answer, "casts")
