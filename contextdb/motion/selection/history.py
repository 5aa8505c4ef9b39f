"""Which frames may not be entered now because of what plays, and of what was played just now.

Three rules, each a span of frames that a search leaves out. The frame that plays on is never touched by them.

- NextNaturalOnly: while such a frame plays, the rest of its own range is left out, so that nothing important is passed over.
- Jump threshold: frames of the playing range near to the playing one are left out; a jump there would be a hiccup.
- History: frames played within the last so many seconds, in any database, are left out, so that no pose is entered over and over.

All hold for a frame in every permutation of its clip alike, as each shows the same.

Source: NextNaturalOnly of EA's talk; PoseJumpThresholdTime and PoseReselectHistory of Unreal's PoseSearch.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass

from contextdb.motion.markup.left_out import LeftOut, Skip
from contextdb.motion.records import quickly_made
from contextdb.motion.search.database import MotionDatabase
from contextdb.motion.selection.playhead import TOLERANCE_S, Playhead


@quickly_made
@dataclass(frozen=True, slots=True)
class Played:
    """Frames [start, stop) of a database, and the moment at which they were played; of permutations those of the first."""

    database: str
    start: int
    stop: int
    time_s: float


def played_spans(database: MotionDatabase, at: int, spans: Iterable[tuple[int, int]]) -> list[tuple[int, int]]:
    """Spans of frames of a range, as the first permutation of its clip has them: so they are remembered once."""
    return [database.in_permutations(at, start, stop)[0] for start, stop in spans]


def in_every_permutation(database: MotionDatabase, skips: Sequence[Skip], at: int = -1) -> Sequence[Skip]:
    """What is left out of a range, in every permutation of its clip; `at` is the range, -1 for that which holds each.

    Frames that are in no range any more, as those played before the database was exchanged, are left away.
    """
    if database.n_permutations == 1:
        return skips
    ranges = [database.range_of(skip.start) if at < 0 else at for skip in skips]
    return [
        Skip(*span, skip.why)
        for i, skip in zip(ranges, skips, strict=True)
        if i >= 0
        for span in database.in_permutations(i, skip.start, skip.stop)
    ]


def remembered(
    history: tuple[Played, ...], database: str, spans: Iterable[tuple[int, int]], now_s: float, for_s: float
) -> tuple[Played, ...]:
    """A history with some spans that are played now; what was played `for_s` seconds ago, or before, is forgotten."""
    if for_s <= 0.0:
        return ()
    oldest_s = now_s - for_s + TOLERANCE_S
    n_forgotten = 0  # of those in front: what is remembered is in the order of its moments
    while n_forgotten < len(history) and history[n_forgotten].time_s <= oldest_s:
        n_forgotten += 1
    return (*history[n_forgotten:], *[Played(database, start, stop, now_s) for start, stop in spans])


def history_skips(history: Iterable[Played]) -> dict[str, list[Skip]]:
    """What was played, by database; spans that touch are one."""
    spans: dict[str, list[tuple[int, int]]] = {}
    name, start, stop = "", 0, -1
    for played in history:
        if start <= played.start <= stop and played.database == name:  # it played on, as mostly
            if played.stop > stop:
                stop = played.stop
            continue
        if stop >= start:
            spans.setdefault(name, []).append((start, stop))
        name, start, stop = played.database, played.start, played.stop
    if stop >= start:
        spans.setdefault(name, []).append((start, stop))
    return {name: [Skip(start, stop, LeftOut.HISTORY) for start, stop in _joined(found)] for name, found in spans.items()}


def playing_skips(head: Playhead, frame: int, threshold_s: float) -> Iterator[Skip]:
    """What is left out because of a frame that may play on."""
    if head.database.marks.is_next_natural(frame):
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


def _joined(spans: list[tuple[int, int]]) -> Iterator[tuple[int, int]]:
    """Spans in order, those that touch as one."""
    first, *others = sorted(spans)
    start, stop = first
    for next_start, next_stop in others:
        if next_start > stop:
            yield start, stop
            start = next_start
        stop = max(stop, next_stop)
    yield start, stop


def _n_frames(seconds: float, rate: float) -> int:
    """How many whole frames a time holds."""
    return int((seconds + TOLERANCE_S) * rate)
