"""A cycle: one gait cycle cut from a clip, seen from a body that moves steadily below it.

    clip ─► two mid-stances of the left foot ─► the steady movement between them ─► poses against that, evenly spread over phase

Phase 0 is the left foot in mid-stance. The body of a cycle is not its hips, which sway and bob, but what moves on evenly below
them: along a straight line, or on a circle where the clip turns. So a foot that stands still in the clip stands still where a game
moves the body at the cycle's speed. What is left between a cycle's end and its beginning is spread over all of it.

J joints, n moments. Between moments joints are on a cubic curve, without a step in their speed.

Source: Forsyth, "How a Character Should Walk", Game Tech 2004: cycles "all start and end with the left foot down, mid-stride";
"you calculate their actual speed in metres per second for each of the animations".
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise

import numpy as np

from contextdb.cells.arguments import require_kind, require_pair, require_real
from contextdb.errors import Fault, MotionError, Place, in_quotes
from contextdb.motion.clips import quaternions
from contextdb.motion.clips.clip import Clip
from contextdb.motion.clips.feet import Footfalls, footfalls_of
from contextdb.motion.clips.foot_bones import FootBones
from contextdb.motion.clips.poses import LocalPoses, Poses, forward_kinematics, poses_of
from contextdb.motion.clips.quaternions import Floats
from contextdb.motion.clips.skeleton import Skeleton
from contextdb.motion.clips.trajectory import root_trajectory
from contextdb.motion.output.legs import leg_of
from contextdb.motion.output.samples import Place3
from contextdb.motion.walking.places import joined, moved, movement_of, movement_to, undone
from contextdb.motion.walking.stances import Stances

MOST_APART_M, MOST_APART_DEG = 0.03, 5.0
"""A cycle whose end is farther from its beginning is refused."""
LEAST_MOMENTS = 8
LEAST_STRIDE_M = 0.05
"""A cycle that comes less far is none of walking."""
A_LOOP = "a clip whose left foot stands at least twice within it, from down to up, or one that is a loop"


@dataclass(frozen=True, eq=False)
class Cycle:
    """One gait cycle. Made by `Cycle.of`."""

    name: str
    """The clip's."""
    skeleton: Skeleton
    feet: tuple[str, str]
    """The bones of the left and the right foot."""
    duration_s: float
    movement: Place3
    """How far the body comes in one cycle: metres along its path, and radians."""
    rotations: Floats
    """Each joint against its parent, the first against the body, evenly spread over the cycle: float64 [n, J, 4]."""
    positions: Floats
    """Likewise, metres: float64 [n, J, 3]."""
    stances: Stances

    @classmethod
    def of(
        cls,
        clip: Clip,
        *,
        feet: tuple[str, str] | None = None,
        footfalls: Footfalls | None = None,
        stances: Stances | None = None,
        most_m: float = MOST_APART_M,
        most_deg: float = MOST_APART_DEG,
    ) -> Cycle:
        """Cut one cycle from a clip: between two mid-stances of its left foot, or of a loop its whole.

        Parameters
        ----------
        clip : Clip
            Of several cycles, of which the first whole one is taken, or of exactly one that loops.
        feet : (left bone, right bone), optional
            Default: as `contextdb.motion.clips.feet.footfalls` detects them.
        footfalls : Footfalls, optional
            Those of the clip, where they are known better than they are detected.
        stances : Stances, optional
            When the feet are down in the cycle, counted from its mid-stance. Default: as the footfalls say.

        most_m, most_deg : float
            A cycle whose end is farther from its beginning is refused; what there is is spread over all of it.

        Raises
        ------
        MotionError
            The clip has no cycle, its ends differ by more than that, or it does not move on.
        ContextError
            An argument of another type.
        """
        require_kind(clip, Clip, "clip", "a Clip")
        require_kind(footfalls, (Footfalls, type(None)), "footfalls", "Footfalls, or None")
        require_kind(stances, (Stances, type(None)), "stances", "Stances, or None")
        most_m, most_deg = require_real(most_m, "most_m", 1e-6), require_real(most_deg, "most_deg", 1e-6)
        if feet is not None:
            require_pair(feet, "feet", "the names of two bones, left and right")
        try:
            return _cut(clip, FootBones(feet), footfalls, stances, (most_m, most_deg))
        except MotionError as error:
            raise MotionError(*(fault.at(Place(clip.name)) for fault in error.faults)) from None

    @property
    def stride_m(self) -> float:
        """Metres of one cycle: two steps."""
        return math.hypot(self.movement[0], self.movement[1])

    @property
    def speed_mps(self) -> float:
        """How fast the body moves, metres a second."""
        return self.stride_m / self.duration_s

    @property
    def cadence(self) -> float:
        """Cycles a second."""
        return 1.0 / self.duration_s

    @property
    def turn_dps(self) -> float:
        """How fast the body turns, degrees a second, positive to the left."""
        return math.degrees(self.movement[2]) / self.duration_s

    @cached_property
    def toes(self) -> Floats:
        """Where the toes of both feet, or the feet of a rig without, are against the body: [n, 2, 3]."""
        placed = forward_kinematics(LocalPoses(self.skeleton, 1.0, self.positions, self.rotations))
        return np.stack([placed.positions[:, toe_of(self.skeleton, foot)] for foot in self.feet], axis=1)

    def at(self, phase: float) -> tuple[Floats, Floats]:
        """Rotations [J, 4] and positions [J, 3] at a phase, against the body. Raises ContextError for what is no number."""
        around, shares = self._around(require_real(phase, "phase"))
        rotations = self.rotations[around]
        signs = np.where((rotations * rotations[1]).sum(axis=-1, keepdims=True) < 0.0, -1.0, 1.0)
        mixed = np.tensordot(shares, rotations * signs, 1)
        return mixed / np.linalg.norm(mixed, axis=-1, keepdims=True), np.tensordot(shares, self.positions[around], 1)

    def toes_at(self, phase: float) -> Floats:
        """Where both toes are at a phase, against the body: [2, 3]. Raises ContextError for what is no number.

        On a curve of their own through the moments, and not at the ends of the joints' curves: so a toe that stands, stands still
        between two moments too.
        """
        around, shares = self._around(require_real(phase, "phase"))
        return np.asarray((shares @ self.toes[around].reshape(4, 6)).reshape(2, 3))

    def _around(self, phase: float) -> tuple[list[int], Floats]:
        """The four moments about a phase, and their weights."""
        n = len(self.rotations)
        moment = (phase % 1.0) * n
        first = min(int(moment), n - 1)
        return [(first + i) % n for i in (-1, 0, 1, 2)], _cubic(moment - first)


def toe_of(skeleton: Skeleton, foot: str) -> int:
    """The joint of a foot that stands: its toe, where its leg has one, else the foot."""
    leg = leg_of(skeleton, foot)
    return skeleton.index(foot) if leg is None else leg.toe


def _cubic(share: float) -> Floats:
    """The weights of four moments for one between the second and the third: Catmull and Rom's."""
    s = share
    return 0.5 * np.array(
        [s * (s * (2.0 - s) - 1.0), s * s * (3.0 * s - 5.0) + 2.0, s * (s * (4.0 - 3.0 * s) + 1.0), s * s * (s - 1.0)]
    )


@dataclass(frozen=True, eq=False)
class _Cut:
    """A cycle as it comes out of its clip: its moments with the end against the body, and how far the body comes.

    `apart_m` and `apart_deg`: how far end and beginning are apart at most, and at which joint they are farthest.
    """

    local: LocalPoses
    duration_s: float
    movement: Place3
    missing: Floats
    joint: int
    apart_m: float
    apart_deg: float

    def apart(self, most: tuple[float, float]) -> float:
        """How far apart the ends are, of what is accepted."""
        return max(self.apart_m / most[0], self.apart_deg / most[1])


def _cut(clip: Clip, bones: FootBones, falls: Footfalls | None, stances: Stances | None, most: tuple[float, float]) -> Cycle:
    poses = poses_of(clip)
    if poses.n_frames < LEAST_MOMENTS:
        raise MotionError(Fault(f"the clip has {poses.n_frames} frames.", f"at least {LEAST_MOMENTS}"))
    pair = bones.feet_in(poses.skeleton)
    feet = pair[0].bone, pair[1].bone
    known = footfalls_of(poses, bones) if falls is None else falls
    middles = _middles(known, 0, poses)
    spans = list(pairwise(middles)) or [(0.0, (poses.n_frames - 1) / poses.rate)]
    cuts = [_between(poses, begin_s, end_s) for begin_s, end_s in spans]
    best = min(range(len(cuts)), key=lambda i: cuts[i].apart(most))
    cut = _closed(cuts[best], most)
    if math.hypot(*cut.movement[:2]) < LEAST_STRIDE_M:
        raise MotionError(Fault(f"the body comes {math.hypot(*cut.movement[:2]):.2f} m far in a cycle.", "a cycle that moves on"))
    is_known = falls is not None and len(middles) > 1
    own = _known(known, spans[best]) if is_known else _detected(cut, bones)
    if own is None:
        raise MotionError(Fault("no whole cycle is detected in it.", A_LOOP))
    shift = own.middle(0)
    n = len(cut.local.rotations) - 1
    round_ = LocalPoses(poses.skeleton, poses.rate, cut.local.positions[:-1], cut.local.rotations[:-1])
    local = _sampled(round_, np.asarray(np.arange(n) + shift * n), loops=True)
    own = _inwards(own.shifted(shift), n) if stances is None else stances
    return Cycle(clip.name, poses.skeleton, feet, cut.duration_s, cut.movement, local.rotations, local.positions, own)


def _middles(falls: Footfalls, side: int, poses: Poses) -> list[float]:
    """The middles, in seconds, of the stances of a foot that are whole within the clip."""
    end_s = (poses.n_frames - 1) / poses.rate
    intervals = falls.down[falls.feet[side]].tolist()
    return [(begin + end) / 2.0 for begin, end in intervals if begin > 0.0 and end < end_s - 1e-9]


def _known(falls: Footfalls, span: tuple[float, float]) -> Stances | None:
    """The stances of the cycle between two mid-stances, of footfalls that are given."""
    begin, long = span[0], span[1] - span[0]
    own: list[tuple[float, float]] = []
    for foot in falls.feet:
        whole = [(a, b) for a, b in falls.down[foot].tolist() if a > 0.0 and b < falls.duration_s - 1e-9]
        inside = [(a, b) for a, b in whole if begin - 1e-9 <= (a + b) / 2.0 < begin + long - 1e-9]
        if len(inside) != 1:
            return None
        own.append((((inside[0][0] - begin) / long) % 1.0, ((inside[0][1] - begin) / long) % 1.0))
    return Stances((own[0][0], own[1][0]), (own[0][1], own[1][1]))


def _inwards(stances: Stances, n: int) -> Stances:
    """The stances from the first of n moments in which a foot is down to the last: nobody knows where it is between moments."""
    (a, b), (c, d) = stances.down, stances.up
    down = math.ceil(a * n - 1e-6) / n % 1.0, math.ceil(b * n - 1e-6) / n % 1.0
    return replace(stances, down=down, up=(math.floor(c * n + 1e-6) / n % 1.0, math.floor(d * n + 1e-6) / n % 1.0))


def _detected(cut: _Cut, bones: FootBones) -> Stances | None:
    """The stances of a cycle, of three rounds of it; None where a foot does not come down once in each."""
    n = len(cut.local.rotations) - 1
    moments = np.arange(3 * n + 1)
    around = moments % n
    places = [moved(cut.movement, moment / n) for moment in moments.tolist()]
    laid = LocalPoses(cut.local.skeleton, n / cut.duration_s, cut.local.positions[around], cut.local.rotations[around])
    poses = _placed(forward_kinematics(laid), places)
    falls, own = footfalls_of(poses, bones), []
    for foot in falls.feet:
        shares = [(a / cut.duration_s, b / cut.duration_s) for a, b in falls.down[foot].tolist()]
        inside = [(a, b) for a, b in shares if 1.0 - 1e-9 <= (a + b) / 2.0 < 2.0 - 1e-9]
        if len(inside) != 1:
            return None
        own.append((inside[0][0] % 1.0, inside[0][1] % 1.0))
    return Stances((own[0][0], own[1][0]), (own[0][1], own[1][1]))


def _placed(poses: Poses, places: list[Place3]) -> Poses:
    """Poses against a body, with that body at some places."""
    x, z, headings = np.array(places).T
    turns = quaternions.about_axis("y", headings)[:, None]
    ground = np.stack((x, np.zeros(len(x)), z), axis=-1)[:, None]
    positions = quaternions.rotate(turns, poses.positions) + ground
    return Poses(poses.skeleton, poses.rate, positions, quaternions.multiply(turns, poses.rotations))


# ---- the cut


def _between(poses: Poses, begin_s: float, end_s: float) -> _Cut:
    """The cycle between two moments of a clip, its body in the middle of what it does."""
    path = root_trajectory(poses)
    way = np.column_stack((path.positions, path.headings))
    start, end = (_at(way, seconds * poses.rate) for seconds in (begin_s, end_s))
    movement, long = movement_to(joined(undone(start), end)), end_s - begin_s
    first, last = max(0, math.floor(begin_s * poses.rate) - 1), min(poses.n_frames - 1, math.ceil(end_s * poses.rate) + 1)
    frames = slice(first, last + 1)
    shares = [(frame / poses.rate - begin_s) / long for frame in range(first, last + 1)]
    local = _against([joined(start, moved(movement, share)) for share in shares], poses, frames)
    n = max(LEAST_MOMENTS, round(long * poses.rate))
    at = np.asarray(begin_s * poses.rate - first + np.arange(n + 1) * (long * poses.rate / n))
    local = _sampled(local, at, loops=False)
    seen = root_trajectory(forward_kinematics(local))
    x, z = seen.positions[:-1].mean(axis=0).tolist()
    middle = x, z, float(seen.headings[:-1].mean())
    local = _against([middle] * (n + 1), forward_kinematics(local), slice(None))
    return _compared(local, long, movement_of(movement, middle))


def _at(way: Floats, frame: float) -> Place3:
    """A place on a path between frames."""
    low = min(max(math.floor(frame), 0), len(way) - 2)
    x, z, heading = (way[low] + (frame - low) * (way[low + 1] - way[low])).tolist()
    return x, z, heading


def _against(places: list[Place3], poses: Poses, frames: slice) -> LocalPoses:
    """Joints against their parents, the first against a body at some places; those above the hips are that body's place."""
    skeleton = poses.skeleton
    seen = _placed(
        Poses(skeleton, poses.rate, poses.positions[frames], poses.rotations[frames]), [undone(place) for place in places]
    )
    positions, rotations = seen.positions, seen.rotations
    above = skeleton.ancestors(skeleton.hips)
    positions[:, above], rotations[:, above] = 0.0, [1.0, 0.0, 0.0, 0.0]
    parents = skeleton.parents[1:]
    back = quaternions.inverse(rotations[:, parents])
    own_positions, own_rotations = positions.copy(), rotations.copy()
    own_positions[:, 1:] = quaternions.rotate(back, positions[:, 1:] - positions[:, parents])
    own_rotations[:, 1:] = quaternions.multiply(back, rotations[:, 1:])
    return LocalPoses(skeleton, poses.rate, own_positions, own_rotations)


def _sampled(local: LocalPoses, at: Floats, *, loops: bool) -> LocalPoses:
    """Local poses between their frames, on cubic curves; whole frames as they are."""
    n = len(local.rotations)
    first = np.floor(at + 1e-9).astype(np.int64)
    shares = np.maximum(at - first, 0.0)
    weights = np.array([_cubic(share if share > 1e-9 else 0.0) for share in shares.tolist()])
    frames = first[:, None] + np.arange(-1, 3)
    frames = frames % n if loops else np.clip(frames, 0, n - 1)
    rotations = local.rotations[frames]
    signs = np.where((rotations * rotations[:, 1:2]).sum(axis=-1, keepdims=True) < 0.0, -1.0, 1.0)
    mixed = np.einsum("tk,tkjc->tjc", weights, rotations * signs)
    mixed /= np.linalg.norm(mixed, axis=-1, keepdims=True)
    positions = np.einsum("tk,tkjc->tjc", weights, local.positions[frames])
    return LocalPoses(local.skeleton, local.rate, positions, mixed)


def _compared(local: LocalPoses, duration_s: float, movement: Place3) -> _Cut:
    """A cycle, with how far its end is from its beginning."""
    ends = forward_kinematics(LocalPoses(local.skeleton, local.rate, local.positions[[0, -1]], local.rotations[[0, -1]]))
    apart = np.linalg.norm(ends.positions[1] - ends.positions[0], axis=-1)
    missing = quaternions.multiply(local.rotations[0], quaternions.inverse(local.rotations[-1]))
    turned = np.rad2deg(np.linalg.norm(quaternions.rotation_vectors(missing), axis=-1))
    joint = int(np.argmax(np.maximum(apart / MOST_APART_M, turned / MOST_APART_DEG)))
    return _Cut(local, duration_s, movement, missing, joint, float(apart.max()), float(turned.max()))


def _closed(cut: _Cut, most: tuple[float, float]) -> _Cut:
    """The cycle with its end where it began, what is between the two spread evenly; refused where that is too much."""
    local = cut.local
    if cut.apart(most) > 1.0:
        name = in_quotes(local.skeleton.names[cut.joint])
        problem = f"the cycle's end is not its beginning: {name} and others are up to {100.0 * cut.apart_m:.1f} cm and"
        accepted = f"ends that differ by at most {100.0 * most[0]:g} cm and {most[1]:g}°"
        raise MotionError(Fault(f"{problem} {cut.apart_deg:.1f}° from where it began.", accepted))
    n = len(local.rotations) - 1
    shares = (np.arange(n + 1) / n)[:, None, None]
    nothing = np.array([[[1.0, 0.0, 0.0, 0.0]]])
    rotations = quaternions.multiply(quaternions.blend(nothing, cut.missing[None], shares), local.rotations)
    positions = local.positions + shares * (local.positions[0] - local.positions[-1])
    return replace(cut, local=LocalPoses(local.skeleton, local.rate, positions, rotations))
