"""Two sessions beside each other: where they part, and what that does to their measures."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any

from contextdb.motion.selection.decision import Decision, Playing
from contextdb.motion.trace.stats import measures_of


@dataclass(frozen=True)
class Parting:
    """The first update at which two sessions do not play the same frame."""

    tick: int
    time_s: float
    one: str | None
    other: str | None
    why_one: str
    why_other: str


@dataclass(frozen=True)
class SessionDiff:
    """Two sessions, update by update."""

    updates: int
    """How many updates both have."""
    longer: int
    """How many updates the first has beyond them; negative where the other has."""
    other_frames: int
    other_assets: int
    """`other_frames`, `other_assets`: at how many updates another frame, another asset plays."""
    parting: Parting | None
    """None where both play the same all along."""
    one: Mapping[str, float | None]
    other: Mapping[str, float | None]
    """`one`, `other`: their measures."""

    def to_json(self) -> dict[str, object]:
        parting = None if self.parting is None else vars(self.parting)
        return {**vars(self), "parting": parting, "one": dict(self.one), "other": dict(self.other)}


def diff_sessions(
    one: Iterable[Decision],
    other: Iterable[Decision],
    about_one: Mapping[str, Mapping[str, Any]],
    about_other: Mapping[str, Mapping[str, Any]],
) -> SessionDiff:
    """Where two sessions part, and their measures; the updates are compared in order."""
    first, second = list(one), list(other)
    pairs = list(zip(first, second, strict=False))
    parting = next(((a, b) for a, b in pairs if _frame(a.playing) != _frame(b.playing)), None)
    return SessionDiff(
        updates=len(pairs),
        longer=len(first) - len(second),
        other_frames=sum(_frame(a.playing) != _frame(b.playing) for a, b in pairs),
        other_assets=sum(_asset(a.playing) != _asset(b.playing) for a, b in pairs),
        parting=None if parting is None else _parting(*parting),
        one=measures_of(first, about_one),
        other=measures_of(second, about_other),
    )


def _parting(one: Decision, other: Decision) -> Parting:
    return Parting(one.tick, one.time_s, _playing_text(one.playing), _playing_text(other.playing), one.why, other.why)


def _frame(playing: Playing | None) -> object:
    """What plays, whatever its database's other ranges are."""
    return None if playing is None else (playing.database, playing.asset, playing.mirrored, round(playing.time_s, 6))


def _asset(playing: Playing | None) -> str | None:
    return None if playing is None else playing.asset


def _playing_text(playing: Playing | None) -> str | None:
    return None if playing is None else f"{playing.asset} at {playing.time_s:.2f} s"
