"""What a selector chose among its databases, and how it came to that."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum

from contextdb.motion.records import quickly_made
from contextdb.motion.search.hit import Hit


class Status(StrEnum):
    """What became of one database in a choice."""

    WINNER = "winner"
    BEATEN = "beaten"
    NOTHING_VALID = "nothing valid"
    NOT_SEARCHED = "not searched"
    NOT_AMONG = "not among"
    NOT_LOADED = "not loaded"


class Reason(StrEnum):
    """Why the winner won."""

    UNDER_THRESHOLD = "under its threshold"
    LOWEST = "lowest cost"
    NOTHING_VALID = "nothing valid"


@quickly_made
@dataclass(frozen=True, slots=True)
class Search:
    """One database in a choice: its best frame, its threshold, and what became of it. `hit` is None when it was not searched."""

    database: str
    threshold: float | None
    hit: Hit | None
    status: Status

    @property
    def is_under_threshold(self) -> bool:
        """Whether its best cost is under its threshold."""
        return self.hit is not None and self.threshold is not None and self.hit.cost < self.threshold

    def __str__(self) -> str:
        if self.hit is None or not self.hit:
            return f"{self.database}: {self.status}"
        text = f"{self.database}: cost {self.hit.cost:.4g}"
        if self.threshold is None:
            return text
        return f"{text}, {'under' if self.is_under_threshold else 'not under'} its threshold {self.threshold:g}"


@quickly_made
@dataclass(frozen=True, slots=True)
class Choice:
    """What a selector chose, and how. False when nothing may play.

    Attributes
    ----------
    hit : Hit
    database : str or None
        The name of the database that `hit` is in.
    reason : Reason
    searches : tuple of Search
        All databases of the selector in order, those not searched too.
    """

    hit: Hit
    database: str | None
    reason: Reason
    searches: tuple[Search, ...]

    def __bool__(self) -> bool:
        return bool(self.hit)

    @property
    def why(self) -> str:
        """The choice in one sentence for people."""
        text = "; ".join(map(str, self.searches))
        if self.database is None:
            return f"{text}. Nothing may play."
        ends = {Reason.UNDER_THRESHOLD: "wins outright", Reason.LOWEST: "has the lowest cost and wins"}
        return f"{text}. {self.database} {ends[self.reason]}."
