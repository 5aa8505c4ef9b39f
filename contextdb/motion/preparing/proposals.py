"""What is proposed for clips: roots, contacts, loops, standing ends, noise, starts, turns, duplicates; each with its reason.

    clip ─► Look: poses against the body's own place, path, feet ─► proposals of each kind ─► less what the markup says already

What is proposed depends on the clip alone; a mark of the same tag that holds any of the same frames, a pattern's too, takes its
place. So a second run on its own result proposes nothing. F frames, J joints; metres, y up.
"""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Callable, Collection, Iterator, Sequence
from functools import cache, partial

import numpy as np
from numpy.typing import NDArray

from contextdb.cells.arguments import require_callable, require_kind, require_many, require_many_of
from contextdb.errors import ContextError, Fault, MotionError, in_quotes, no_such, some
from contextdb.motion.clips.clip import Clip
from contextdb.motion.clips.contacts import spans_of
from contextdb.motion.clips.foot_bones import UNDECLARED
from contextdb.motion.clips.prepared_root import prepared_path
from contextdb.motion.clips.quaternions import Floats
from contextdb.motion.markup.markup import Markup
from contextdb.motion.markup.reserved import CONTACTS, ReservedTag
from contextdb.motion.preparing.clip_facts import ENDS_S, STANDING_MPS, step_of
from contextdb.motion.preparing.look import LOOP_M, Look
from contextdb.motion.preparing.proposal import KINDS, N_SAMPLES, KeptClip, Kind, KnownProposals, Proposal, Shape

ROOT_SMOOTH_S = 0.2
"""What is proposed for `root_smooth_s`: it evens out a step, and keeps a start and a bend."""
SWAY_M, SWAY_DEG = 0.01, 3.0
"""Hips that are farther than this from the body's prepared path, or turned, for a twentieth of the time, sway."""
SMOOTH_SHARE = 0.95
"""Or where speeds change no more from its end to its start than in this share of its frames: a foot that comes down there changes
them at once."""
LEAST_LOOP_S = 0.5
FEWEST_TO_CUT = 6
MOST_FRAMES = 400
"""So many frames of a clip are compared with each other for a cut."""
LEAST_TAIL_S = 0.4
NEAR_STANDING_S = 0.1
"""So much of a stand before a start is part of it."""
AT_SPEED = 0.9
"""Of its middle speed: a start is over."""
BENDING_DPS, TURNING_DPS, LEAST_TURN_DEG, LONGEST_TURN_S = 25.0, 50.0, 60.0, 3.0
"""A turn begins and ends at the first rate, and comes to the second."""
LONGEST_ONE_OFF_S, LEAST_WAY_M = 6.0, 0.3
"""A clip that is no longer, comes so far and then stands may bring a body to a target."""
STEADY_DPS = 30.0
"""A clip whose middle turn is faster turns all the time, and is no turn to be played as a whole."""
SPIKE_MPS, SPIKE = 8.0, 4.0
"""A joint that moves so fast between two frames, and so many times faster than before and behind, is noise."""
END_SHARE = 0.1
"""Noise so near an end of a clip cuts that end off."""
ALIKE_M, ALIKE_S = 0.02, 0.05
"""Clips are near-duplicates whose joints are on the mean so near at the same share of the clip, and whose lengths differ by such a
share."""
ALIKE_AHEAD_S = 0.5
"""So much later the joints, seen from where the body was, are as near: a turn with the steps of a walk is none."""


def prepare(
    clips: Sequence[Clip],
    markup: Markup | None = None,
    *,
    kinds: Sequence[str] | None = None,
    progress: Callable[[int, int, str], None] | None = None,
) -> list[Proposal]:
    """Propose marks for clips.

    Parameters
    ----------
    clips : sequence of Clip
        Each with at least one frame.
    markup : Markup, optional
        The markup so far: nothing is proposed where it has a mark of the same tag.
    kinds : sequence of str, optional
        Of `KINDS` those that are wanted: "roots", "contacts", "loops", "cuts", "tails", "noise", "starts", "turns", "targets",
        "duplicates". Default: all.
    progress : function, optional
        Called with the number of clips that are done, of all clips, and the name of the next.

    Returns
    -------
    list of Proposal
        By clip, in their order. A cut has no tag: it says where the file would have to be cut for the clip to loop. Nor has a
        root: it says that hips sway, which `root_smooth_s` of its features evens out.

    Raises
    ------
    MotionError
        A clip has no frame.
    ContextError
        An argument is wrong, or there is no such kind.
    """
    return prepare_again(clips, markup, kinds, progress, KnownProposals())


def prepare_again(
    clips: Sequence[Clip],
    markup: Markup | None,
    kinds: Sequence[str] | None,
    progress: Callable[[int, int, str], None] | None,
    previous: KnownProposals,
) -> list[Proposal]:
    """What `prepare` proposes; only clips that are not as they were when they were stored are looked at, and then stored."""
    clips = require_many_of(clips, Clip, "clips", "a list of Clip")
    if markup is not None:
        require_kind(markup, Markup, "markup", "a Markup")
    if progress is not None:
        require_callable(progress, "progress")
    wanted = _wanted(kinds)
    if faults := [Fault(f"the clip {in_quotes(clip.name)} has no frame.", "at least one") for clip in clips if not clip.n_frames]:
        raise MotionError(*faults)
    proposals = defaultdict[str, list[Proposal]](list)
    shapes: list[tuple[Clip, Shape]] = []
    for i, clip in enumerate(clips):
        if progress is not None:
            progress(i, len(clips), clip.name)
        known = previous.of(clip)
        look_for(known, clip, wanted)
        for kind in (kind for kind in KINDS if kind in wanted and kind in _OF_ONE):
            proposals[clip.name] += known.found[kind]
        if "duplicates" in wanted and known.shape is not None:
            shapes.append((clip, known.shape))
    for each in _duplicates(shapes):
        proposals[each.asset].append(each)
    current = markup or Markup()
    return [
        each for clip in dict.fromkeys(clip.name for clip in clips) for each in proposals[clip] if not _is_marked(each, current)
    ]


def look_for(known: KeptClip, clip: Clip, kinds: Collection[str]) -> None:
    """Look for what is not known yet of a clip. Raises MotionError where its joints are too far away to be measured."""
    look = cache(partial(Look.at, clip))
    for kind in (kind for kind in KINDS if kind in kinds and kind in _OF_ONE):
        if kind not in known.found:
            known.found[kind] = list(_OF_ONE[kind](look()))
    if "duplicates" in kinds and known.shape is None:
        known.shape = _shape(look())


def _wanted(kinds: Sequence[str] | None) -> set[str]:
    if kinds is None:
        return set(KINDS)
    wanted = list(require_many(kinds, "kinds", "a list of kinds"))
    for kind in wanted:
        if not isinstance(kind, str) or kind not in KINDS:
            raise ContextError(no_such("kind", kind, KINDS, some(KINDS, len(KINDS))))
    return set(wanted)


def _is_marked(proposal: Proposal, markup: Markup) -> bool:
    """Whether the markup has a mark of the same tag where one is proposed; of a foot, anywhere."""
    first, last = proposal.from_s or 0.0, math.inf if proposal.to_s is None else proposal.to_s
    stronger = {ReservedTag.EXCLUDED} if proposal.tag == ReservedTag.DO_NOT_CHOOSE else set()
    tags = {ReservedTag.LOOPING} if proposal.kind == "cuts" else {proposal.tag, *stronger}
    spans = [span for span in markup.spans_of(proposal.asset) if span.tag in tags]
    if proposal.tag in CONTACTS or proposal.kind == "cuts":
        return bool(spans)
    return any(span.from_s <= last and first <= span.to_s for span in spans)


# ---- hips and feet


def _roots(look: Look) -> Iterator[Proposal]:
    """Hips that sway about the path of the body."""
    if look.usual_mps < STANDING_MPS or look.clip.duration_s < LEAST_LOOP_S:
        return
    path = prepared_path(look.poses, look.path, ROOT_SMOOTH_S, UNDECLARED)
    metres = float(np.quantile(np.linalg.norm(path.positions - look.path.positions, axis=-1), 0.95))
    degrees = float(np.rad2deg(np.quantile(np.abs(path.headings - look.path.headings), 0.95)))
    if metres >= SWAY_M or degrees >= SWAY_DEG:
        yield look.proposal("roots", None, None, None, f"its hips sway by {100.0 * metres:.1f} cm and {degrees:.0f}°", metres)


def _contacts(look: Look) -> Iterator[Proposal]:
    if look.falls is None:
        return
    for foot, tag in zip(look.falls.feet, CONTACTS, strict=True):
        for begin, end in look.falls.down[foot].tolist():
            reason = f"{foot} rests for {end - begin:.2f} s"
            first, last = round(begin * look.rate) or None, round(end * look.rate)
            yield look.proposal("contacts", tag, first, last if last < look.poses.n_frames - 1 else None, reason, end - begin)


# ---- loops


def _loops(look: Look) -> Iterator[Proposal]:
    """A clip whose last pose is its first."""
    if look.clip.duration_s >= LEAST_LOOP_S:
        apart_m, apart_mps = _apart(look, 0, -1)
        if apart_m <= LOOP_M and (apart_mps <= look.loop_mps or _is_smooth(look)):
            reason = f"its ends are {100.0 * apart_m:.1f} cm and {apart_mps:.2f} m/s apart"
            yield look.proposal("loops", ReservedTag.LOOPING, None, None, reason, apart_m)


def _is_smooth(look: Look) -> bool:
    """Whether speeds change no more from the last step of a clip to its first than they do between its frames."""
    speeds = np.diff(look.own, axis=0)
    ways = np.linalg.norm(np.diff(look.path.positions, axis=0), axis=-1)
    across = np.concatenate((np.linalg.norm(speeds[0] - speeds[-1], axis=-1), [ways[0] - ways[-1]]))
    within = np.column_stack((np.linalg.norm(np.diff(speeds, axis=0), axis=-1), np.diff(ways)))
    return bool(np.mean(across**2) <= np.quantile(np.mean(within**2, axis=1), SMOOTH_SHARE))


def _cuts(look: Look) -> Iterator[Proposal]:
    """The longest part of a clip that loops, where the whole does not."""
    if any(_loops(look)) or look.usual_mps < STANDING_MPS or look.poses.n_frames < FEWEST_TO_CUT:
        return
    n = look.poses.n_frames
    at = np.arange(2, n - 2, max(1, math.ceil(n / MOST_FRAMES)))
    n_joints = look.poses.skeleton.n_joints
    ahead, back = (_one_sided(look, at, side) for side in (1, -1))
    apart_mps = _distances(ahead, back, n_joints + 1)
    pose = look.own[at].reshape(len(at), -1)
    fits = (_distances(pose, pose, n_joints) <= LOOP_M) & (apart_mps <= look.loop_mps)
    long_enough = (at[None, :] - at[:, None]) >= max(LEAST_LOOP_S, 0.8 * step_of(look.falls)) * look.rate
    first, last = np.nonzero(fits & long_enough)
    if not len(first):
        return
    best = int(np.argmax(at[last] - at[first]))
    i, j = int(at[first[best]]), int(at[last[best]])
    apart_m, mps = _apart(look, i, j)[0], float(apart_mps[first[best], last[best]])
    reason = f"these {(j - i) / look.rate:.2f} s loop: their ends are {100.0 * apart_m:.1f} cm and {mps:.2f} m/s apart"
    yield look.proposal("cuts", None, i, j, reason, apart_m)


def _apart(look: Look, i: int, j: int) -> tuple[float, float]:
    """How far two poses are apart, and their speeds: root mean squares over joints."""
    metres = np.linalg.norm(look.own[i] - look.own[j], axis=-1)
    root = look.speeds[:, None]
    mps = np.concatenate((np.linalg.norm(look.own_speeds[i] - look.own_speeds[j], axis=-1), [np.linalg.norm(root[i] - root[j])]))
    return float(np.sqrt(np.mean(metres**2))), float(np.sqrt(np.mean(mps**2)))


def _one_sided(look: Look, at: NDArray[np.int64], side: int) -> Floats:
    """How fast joints and body go at some frames, as far as the frames ahead (1) or behind (-1) show: [N, J * 3 + 1]."""
    moved = 2.0 * look.own[at + side] - 1.5 * look.own[at] - 0.5 * look.own[at + 2 * side]
    n = max(1, round(ENDS_S * look.rate / 2.0))
    other = np.clip(at + side * n, 0, look.poses.n_frames - 1)
    root = np.linalg.norm(look.path.positions[other] - look.path.positions[at], axis=-1) / np.abs(other - at)
    return np.concatenate(((side * moved).reshape(len(at), -1), root[:, None]), axis=1) * look.rate


def _distances(some: Floats, others: Floats, n_joints: int) -> Floats:
    """Root mean squares over joints of the distances of some rows [N, D] from others [M, D]: [N, M]."""
    squares, other_squares = (some**2).sum(axis=1), (others**2).sum(axis=1)
    apart = squares[:, None] + other_squares[None, :] - 2.0 * some @ others.T
    return np.asarray(np.sqrt(np.maximum(apart, 0.0) / n_joints))


# ---- ends, starts and turns


def _tails(look: Look) -> Iterator[Proposal]:
    """Standing before and behind what a clip shows."""
    first, last = _moving(look)
    if first is None or last is None:
        return
    n = look.poses.n_frames
    head = first - round(NEAR_STANDING_S * look.rate)
    if head / look.rate >= LEAST_TAIL_S:
        yield look.proposal(
            "tails", ReservedTag.DO_NOT_CHOOSE, None, head, f"stands for {head / look.rate:.2f} s first", head / look.rate
        )
    tail_s = (n - 1 - last) / look.rate
    if tail_s >= LEAST_TAIL_S:
        yield look.proposal("tails", ReservedTag.DO_NOT_CHOOSE, last, None, f"stands for its last {tail_s:.2f} s", tail_s)


def _starts(look: Look) -> Iterator[Proposal]:
    """From a stand to nine tenths of the middle speed."""
    first, _ = _moving(look)
    if not first:
        return
    fast = np.flatnonzero(look.speeds[first:] >= AT_SPEED * look.usual_mps)
    if len(fast) and fast[0]:
        stop = first + int(fast[0])
        seconds = (stop - first) / look.rate
        reason = f"speeds up from a stand to {look.speeds[stop]:.2f} m/s within {seconds:.2f} s"
        yield look.proposal("starts", ReservedTag.NEXT_NATURAL_ONLY, first, stop, reason, seconds)


def _moving(look: Look) -> tuple[int | None, int | None]:
    """The first and the last frame in which the body of a clip goes anywhere; None where it stands all the time."""
    moving = np.flatnonzero(look.speeds >= look.stands_mps)
    if look.usual_mps < STANDING_MPS or not len(moving):
        return None, None
    return int(moving[0]), int(moving[-1])


def _turns(look: Look) -> Iterator[Proposal]:
    """Each turn of a clip that else goes straight."""
    if abs(float(np.median(look.moments.turns))) >= STEADY_DPS:
        return
    half = look.moments.n // 2
    for first, stop in spans_of(np.abs(look.moments.turns) >= BENDING_DPS):
        turns = look.moments.turns[first:stop]
        turned, seconds = float(turns.sum()) / look.rate, (stop - 1 - first) / look.rate
        if np.abs(turns).max() >= TURNING_DPS and abs(turned) >= LEAST_TURN_DEG and 0.0 < seconds <= LONGEST_TURN_S:
            reason = f"turns by {abs(turned):.0f}° to the {'left' if turned > 0.0 else 'right'} within {seconds:.2f} s"
            first, last = first + half, stop - 1 + half
            yield look.proposal("turns", ReservedTag.NEXT_NATURAL_ONLY, first, last, reason, abs(turned))


def _targets(look: Look) -> Iterator[Proposal]:
    """Where a clip that comes to a stand may be entered, and where it may be bent towards the place at which a body is to stand."""
    first, last = _moving(look)
    if first is None or last is None or last >= look.poses.n_frames - 1 or (last - first) / look.rate > LONGEST_ONE_OFF_S:
        return
    metres = float(look.path.lengths[last] - look.path.lengths[first])
    fast = np.flatnonzero(look.speeds[first : last + 1] >= AT_SPEED * look.usual_mps)
    if metres < LEAST_WAY_M or not len(fast) or fast[-1] < 1:
        return
    slows = first + int(fast[-1])
    begin = first or None
    reason = f"from {slows / look.rate:.2f} s on it slows down to a stand"
    yield look.proposal("targets", ReservedTag.MATCH_RANGE, begin, slows, reason, slows / look.rate)
    yield look.proposal("targets", ReservedTag.WARP_POSITION, begin, last, f"comes {metres:.2f} m far and then stands", metres)


# ---- noise


def _noise(look: Look) -> Iterator[Proposal]:
    """Frames between which a joint jumps."""
    n = look.poses.n_frames
    if n < 5:
        return
    steps = np.linalg.norm(np.diff(look.poses.positions, axis=0), axis=-1).max(axis=1) * look.rate
    around = np.maximum(_moved_by(steps, 3), _moved_by(steps, -3))
    for first, stop in spans_of((steps >= SPIKE_MPS) & (steps >= SPIKE * np.maximum(around, 1.0))):
        fastest = float(steps[first:stop].max())
        reason = f"a joint moves at {fastest:.0f} m/s from one frame to the next"
        if stop <= END_SHARE * n:
            yield look.proposal(
                "noise", ReservedTag.EXCLUDED, None, stop - 1, f"{reason}: what is before is not part of the clip", fastest
            )
        elif first >= (1.0 - END_SHARE) * n:
            yield look.proposal(
                "noise", ReservedTag.EXCLUDED, first + 1, None, f"{reason}: what is after is not part of the clip", fastest
            )
        else:
            last = max(first + 1, stop - 1)
            yield look.proposal("noise", ReservedTag.EXCLUDED, first + 1, last, reason, fastest)


def _moved_by(values: Floats, n: int) -> Floats:
    """The values so many places before, or behind; at the ends those of the other side count, so 0."""
    moved = np.zeros_like(values)
    if n > 0:
        moved[n:] = values[:-n]
    else:
        moved[:n] = values[-n:]
    return moved


# ---- clips that are alike


def _shape(look: Look) -> Shape:
    """The poses of a clip at shares of its length, now and a moment later, both as the body sees them now: [2, samples, J, 3]."""
    last = look.poses.n_frames - 1
    at = np.linspace(0.0, last, N_SAMPLES).round().astype(np.int64)
    later = min(round(ALIKE_AHEAD_S * look.poses.rate), last)
    before = np.minimum(at, last - later)
    return np.stack((look.own[at], look.seen(before + later, before))).astype(np.float32)


def _duplicates(shapes: Sequence[tuple[Clip, Shape]]) -> Iterator[Proposal]:
    """Clips that show what one before them shows."""
    firsts: list[tuple[Clip, Shape]] = []
    for clip, shape in shapes:
        for other, seen in firsts:
            if other.skeleton.names != clip.skeleton.names or _differ(clip.duration_s, other.duration_s):
                continue
            apart = float(np.linalg.norm(shape - seen, axis=-1).mean(axis=(1, 2)).max())
            if apart <= ALIKE_M:
                reason = f"its joints are {100.0 * apart:.1f} cm from those of {in_quotes(other.name)} on the mean"
                yield Proposal(clip.name, "duplicates", ReservedTag.DO_NOT_CHOOSE, None, None, None, reason, round(apart, 4))
                break
        else:
            firsts.append((clip, shape))


def _differ(one: float, other: float) -> bool:
    return abs(one - other) > ALIKE_S * max(one, other)


_OF_ONE: dict[Kind, Callable[[Look], Iterator[Proposal]]] = {
    "roots": _roots,
    "contacts": _contacts,
    "loops": _loops,
    "cuts": _cuts,
    "tails": _tails,
    "noise": _noise,
    "starts": _starts,
    "turns": _turns,
    "targets": _targets,
}
