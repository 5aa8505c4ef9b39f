"""Which frames may not be entered now because of what plays, and of what was played just now.

Three rules, each a span of frames that a search leaves out. The frame that plays on is never touched by them.

- NextNaturalOnly: while such a frame plays, the rest of its own range is left out, so that nothing important is passed over.
- Jump threshold: frames of the playing range near to the playing one are left out; a jump there would be a hiccup.
- History: frames played within the last so many seconds, in any database, are left out, so that no pose is entered over and over.

Source: NextNaturalOnly of EA's talk; PoseJumpThresholdTime and PoseReselectHistory of Unreal's PoseSearch.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass

from contextdb.motion.left_out import LeftOut, Skip
from contextdb.motion.marks import Mark
from contextdb.motion.playhead import TOLERANCE_S, Playhead


@dataclass(frozen=True, slots=True)
class Played:
    """Frames [start, stop) of a database, and the moment at which they were played."""

    database: str
    start: int
    stop: int
    time_s: float


def remembered(
    history: tuple[Played, ...], database: str, spans: Iterable[tuple[int, int]], now_s: float, for_s: float
) -> tuple[Played, ...]:
    """A history with some spans that are played now; what is older than `for_s` seconds is forgotten."""
    recent = tuple(played for played in history if _is_recent(played, now_s, for_s))
    return recent + tuple(Played(database, start, stop, now_s) for start, stop in spans) if for_s > 0.0 else ()


def history_skips(history: Iterable[Played], now_s: float, for_s: float) -> dict[str, list[Skip]]:
    """What was played within the last `for_s` seconds, by database; spans that touch are one."""
    found: dict[str, list[Skip]] = {}
    for played in sorted(history, key=lambda played: (played.database, played.start)):
        if _is_recent(played, now_s, for_s):
            _add(found.setdefault(played.database, []), Skip(played.start, played.stop, LeftOut.HISTORY))
    return found


def playing_skips(head: Playhead, frame: int, threshold_s: float) -> Iterator[Skip]:
    """What is left out because of a frame that may play on."""
    if head.database.marks.mark_of(frame) & Mark.NEXT_NATURAL:
        yield Skip(head.start, head.stop, LeftOut.NEXT_NATURAL)
    near = _n_frames(threshold_s, head.rate)
    first, stop = frame - near, frame + near + 1
    yield Skip(max(first, head.start), min(stop, head.stop), LeftOut.JUMP)
    if head.is_looping:
        n_loop = head.stop - head.start - 1
        if first <= head.start:
            yield Skip(max(first + n_loop, head.start), head.stop, LeftOut.JUMP)
        if stop > head.start + n_loop:
            yield Skip(head.start, min(stop - n_loop, head.stop), LeftOut.JUMP)


def ended_skip(head: Playhead, frame: int, threshold_s: float) -> Skip:
    """What is left out when playing on has ended at a frame: those after which it would end again at once. The first frame of the
    range is never among them, or a clip that is shorter could not play again."""
    return Skip(max(frame - _n_frames(threshold_s, head.rate), head.start + 1), head.stop, LeftOut.JUMP)


def _add(skips: list[Skip], skip: Skip) -> None:
    """Add a span, or lengthen the last one that it touches."""
    if skips and skip.start <= skips[-1].stop:
        skip = Skip(skips[-1].start, max(skips.pop().stop, skip.stop), skip.why)
    skips.append(skip)


def _is_recent(played: Played, now_s: float, for_s: float) -> bool:
    return now_s - played.time_s < for_s - TOLERANCE_S


def _n_frames(seconds: float, rate: float) -> int:
    """How many whole frames a time holds."""
    return int((seconds + TOLERANCE_S) * rate)
