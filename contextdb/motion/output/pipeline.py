"""What plays, for many characters at once, as poses: each a row, see `contextdb.motion.output.stages`."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache
from types import ModuleType

import numpy as np

from contextdb.cells.arguments import require_kind, require_mapping
from contextdb.console import announce
from contextdb.errors import Fault, MotionError, in_quotes, no_such
from contextdb.motion.clips.quaternions import Floats
from contextdb.motion.clips.skeleton import Ints, Skeleton
from contextdb.motion.output import stages
from contextdb.motion.output.bank import RIG_MEND, PoseBank, tops_of
from contextdb.motion.output.feet import OnGround, hinges_of, legs_of
from contextdb.motion.output.ground import ManyGround, Triple, below, below_many
from contextdb.motion.output.pose import CrowdPoses
from contextdb.motion.output.samples import Flags
from contextdb.motion.output.settings import PoseSettings
from contextdb.motion.selection.decision import Action, Decision, Playing

ADDED_SHARE = 0.75
"""What is added to the clips may accelerate joints by this share of what the clips do; the rest is left for the clips."""
NEAR_S = 0.1
"""What is shown goes on where it is not farther from where it should be than this."""
ROOTS = {"animation": stages.ANIMATION, "code": stages.CODE, "mixed": stages.MIXED, "path": stages.PATH}
BLENDS = {"none": stages.PLAIN, "spring": stages.SPRING, "dead": stages.DEAD}
WRITTEN = (0.0,) * 6
"""What loops write behind what is given."""
Seam = tuple[int, int, float, float]
"""A moment at a seam: the number of its bank, its range and second, and how fast it plays."""
Grounds = Sequence[stages.Ground | None] | ManyGround | None


@dataclass(frozen=True, eq=False, slots=True)
class Rows:
    """Where N characters are: a row of numbers each [N, W], and what each showed last. Never changed, so it may be kept."""

    numbers: Floats
    playing: list[Playing | None]

    def __len__(self) -> int:
        return len(self.playing)

    def row(self, i: int) -> Rows:
        return self if len(self) == 1 else Rows(self.numbers[i : i + 1], self.playing[i : i + 1])


class Pipeline:
    """Pose banks of one rig and settings, ready for the loops: what all streams of a crowd share."""

    def __init__(self, banks: PoseBank | Mapping[str, PoseBank], settings: PoseSettings) -> None:
        self.settings = settings
        self.only = banks if isinstance(banks, PoseBank) else None
        self.banks: dict[str, PoseBank] = {} if isinstance(banks, PoseBank) else _checked(banks)
        self.all: list[PoseBank] = [self.only] if self.only is not None else list(self.banks.values())
        self.rig = self.all[0]
        self._numbers = {name: i for i, name in enumerate(self.banks)}
        self._to, self._bones = _shaping(settings), _bones(self.all)
        self._columns = stages.Columns(self.rig.n_joints, len(self.rig.moving), len(self.rig.feet), self._to.blend)

    def is_like(self, other: Pipeline) -> bool:
        """Whether another one is of the same banks and settings."""
        if self is other:
            return True
        is_same = self.only is other.only and self.banks.keys() == other.banks.keys()
        return is_same and self.settings == other.settings and all(other.banks[name] is bank for name, bank in self.banks.items())

    @property
    def width(self) -> int:
        return self._columns.width

    def begun(self) -> Rows:
        """One character that has not shown anything yet: the rig at rest."""
        row, at = np.zeros(self.width), self._columns.at
        row[stages.PLAY_RATE] = row[stages.CLIP_RATE] = row[stages.STRIDE] = 1.0
        row[stages.SINCE] = -1.0
        row[at[stages.ROTATIONS] : at[stages.POSITIONS] : 4] = 1.0
        row[at[stages.POSITIONS] :] = self.rig.skeleton.offsets[self.rig.moving].ravel()
        return Rows(row[None], [None])

    def update(
        self, rows: Rows, decisions: Sequence[Decision], dt: float, places: Floats | None, grounds: Grounds
    ) -> tuple[Rows, CrowdPoses]:
        """The rows and the poses of all after a decision for each; `places` [N, 3] are those of the bodies, NaN for none."""
        given, seams, playing, jumps, forced = self._given(rows, decisions, dt, grounds)
        if places is not None:
            given[:, stages.GIVES_BODY], given[:, stages.GIVEN_BODY : stages.GIVEN_BODY + 3] = places[:, 0] == places[:, 0], places
        loops, to, bones, at = _loops(), self._to, self._bones, self._columns.at
        n, n_joints, n_feet = len(rows), self.rig.n_joints, len(self.rig.feet)
        after, roots, contacts = np.empty((n, self.width)), np.empty((n, 3)), np.zeros((n, n_feet), np.bool_)
        for number in self._used(given[:, stages.IN_BANK]):
            loops.sample_rows(number, self.all[number].frames, at, given, after, contacts)
        left, velocities = self._seams(seams)
        rotations, moved = np.empty((n, n_joints, 4)), np.empty((n, len(self.rig.moving), 3))
        translations, positions = np.empty((n, n_joints, 3)), np.empty((n, n_joints, 3))
        world, free = np.empty((n, n_joints, 4)), np.empty((n, n_feet, 3))
        before = rows.numbers
        loops.move_rows(
            to, bones, at, before, given, left, velocities, dt, after, roots, rotations, moved, translations, positions, world, free
        )
        if grounds is not None or not given[:, stages.IS_FLAT].all():
            self._stand(given, before, dt, grounds, contacts, roots, free, after)
        loops.stand_rows(
            to, bones, at, before, given, contacts, dt, after, roots, rotations, moved, free, translations, positions, world
        )
        shown = [now or last for now, last in zip(playing, rows.playing, strict=True)]
        poses = CrowdPoses(playing, jumps, forced, roots, rotations, translations, positions, contacts, after[:, stages.PLAY_RATE])
        return Rows(after, shown), poses

    def find(self, playing: Playing) -> tuple[int, int]:
        """The number of the bank of what plays, and its range there."""
        number = 0 if self.only is not None else self._numbers.get(playing.database, -1)
        if number < 0:
            raise MotionError(no_such("pose bank of the database", playing.database, self.banks))
        return number, self.all[number].range_of(playing.asset, playing.mirrored)

    def _given(
        self, rows: Rows, decisions: Sequence[Decision], dt: float, grounds: Grounds
    ) -> tuple[Floats, list[Seam], list[Playing | None], list[bool], list[bool]]:
        """What happens in this update, a row each, and the moments at seams, two for each; what plays; which jump, and had to."""
        given: list[tuple[float, ...]] = []
        seams: list[Seam] = []
        all_playing, jumps, forced = [], [], []
        gives = _gives(grounds, len(rows))
        rates = rows.numbers[:, [stages.CLIP_RATE, stages.PLAY_RATE]].tolist()
        for decision, shown, (rate, shown_rate), ground in zip(decisions, rows.playing, rates, gives, strict=True):
            playing, action, before, is_ahead = decision.playing, decision.action, decision.before, False
            number, at, time_s, seam, lost_s = -1, 0, 0.0, -1, 0.0
            if playing is not None:
                (number, at), time_s = self.find(playing), playing.time_s
            if shown is not None and playing is not None:
                if not _goes_on(decision, shown, dt * rate):
                    is_seam = action is Action.JUMP or action is Action.START
                    is_ahead = not is_seam or before is None
                    before, action = replace(shown, time_s=shown.time_s + dt * rate), action if is_seam else Action.JUMP
                if action is Action.LOOP:
                    seam, end_s = len(seams) // 2, self.all[number].last_s(at)
                    seams += [(number, at, end_s, rate), (number, at, 0.0, decision.play_rate)]
                elif action is Action.JUMP or action is Action.START:
                    left = self._left(before or shown, shown.time_s + dt * rate, rate, shown_rate == 0.0)
                    seam = len(seams) // 2
                    lost_s = 0.0 if before is None or is_ahead or rate == 0.0 else (left[2] - before.time_s) / rate
                    seams += [
                        left,
                        (number, at, time_s, decision.play_rate),
                    ]
            code = stages.CONTINUES if action is Action.CONTINUE else stages.HOLDS if action is Action.HOLD else stages.ELSE
            motion = decision.root_motion
            given.append(
                (
                    number, at, time_s, shown is not None, code, decision.play_rate,
                    motion.left_m, motion.ahead_m, motion.turn_rad, decision.root_weight, is_ahead, seam,
                    0.0, 0.0, 0.0, 0.0, ground, *WRITTEN, lost_s,
                )
            )  # fmt: skip
            all_playing.append(playing)
            jumps.append(action is Action.JUMP)
            forced.append(action is Action.JUMP and decision.continuing_cost is None)
        return np.array(given, np.float64), seams, all_playing, jumps, forced

    def _left(self, was: Playing, until_s: float, rate: float, is_still: bool) -> Seam:
        """The moment that is left at a seam: behind its end where a clip has run out within the update, and did not stand there."""
        number, at = self.find(was)
        if was.time_s < self.all[number].last_s(at):
            return number, at, was.time_s, rate
        return number, at, was.time_s if is_still else max(was.time_s, until_s), 0.0 if is_still else rate

    def _used(self, numbers: Floats) -> Iterator[int]:
        """The numbers of the banks among some."""
        for number in range(len(self.all)):
            if len(self.all) == 1 or (numbers == number).any():
                yield number

    def _seams(self, seams: list[Seam]) -> tuple[tuple[Floats, Floats, Floats, Floats], Floats]:
        """The moments at seams: rotations, spins, positions and their change, and the velocities of the root."""
        n, joints, moving = max(len(seams), 2), self.rig.n_joints, len(self.rig.moving)
        left = np.empty((n, joints, 4)), np.empty((n, joints, 3)), np.empty((n, moving, 3)), np.empty((n, moving, 3))
        velocities = np.empty((n, 3))
        if seams:
            wanted, (rotations, spins, positions, speeds) = np.array(seams, np.float64), left
            for number in self._used(wanted[:, stages.IN_BANK]):
                frames = self.all[number].frames
                _loops().sample_seams(number, frames, wanted, velocities, rotations, spins, positions, speeds)
        return left, velocities

    def _stand(
        self,
        given: Floats,
        before: Floats,
        dt: float,
        grounds: Grounds,
        contacts: Flags,
        roots: Floats,
        free: Floats,
        after: Floats,
    ) -> None:
        """Write the footings and the hips of all that feel a ground."""
        feet: list[tuple[int, OnGround]] = []
        gives = _gives(grounds, len(given))
        for i in np.flatnonzero(given[:, stages.IS_FLAT] == 0.0).tolist():
            number, frame = int(given[i, stages.IN_BANK]), int(given[i, stages.FRAME])
            steps: Sequence[Sequence[float]] = ()
            if gives[i]:
                steps = self.all[number].steps_at(frame) if number >= 0 else [(0.0, 0.0, 0.0)] * len(self.rig.feet)
            x, z, heading = roots[i].tolist()
            each = OnGround(self._bones.legs, self._columns, contacts[i], steps, (x, z, heading), free[i], after[i])
            feet.append((i, each))
        points = [each.points() for _, each in feet]
        told: list[list[Triple]]
        if grounds is None or isinstance(grounds, Sequence):
            functions = [None if grounds is None else grounds[i] for i, _ in feet]
            told = [[below(of, x, z) for x, z in own] for of, own in zip(functions, points, strict=True)]
        else:
            flat = iter(below_many(grounds, [point for own in points for point in own]))
            told = [[next(flat) for _ in own] for own in points]
        for (i, each), answer in zip(feet, told, strict=True):
            each.stand(answer, dt if before[i, 0] else 0.0)


def _goes_on(decision: Decision, shown: Playing, passed_s: float) -> bool:
    """Whether a decision goes on from what was shown; else another one has decided meanwhile."""
    playing = decision.before if decision.action is Action.JUMP or decision.action is Action.START else decision.playing
    if playing is None or playing.asset != shown.asset or playing.mirrored != shown.mirrored or playing.database != shown.database:
        return False
    return decision.action is Action.LOOP or -NEAR_S <= playing.time_s - shown.time_s <= passed_s + NEAR_S


def _gives(grounds: Grounds, n: int) -> Sequence[bool]:
    if isinstance(grounds, Sequence):
        return [each is not None for each in grounds]
    return [grounds is not None] * n


@cache
def _loops() -> ModuleType:
    """The loops over rows, with a word where they are compiled for the first time on this machine."""
    from contextdb.motion.output import kernels, row_loops

    if kernels.IS_COMPILED:
        announce(row_loops.move_rows)
    return row_loops


def _shaping(settings: PoseSettings) -> stages.Shaping:
    return stages.Shaping(
        root=ROOTS[settings.root],
        blend=BLENDS[settings.blend],
        position_weight=float(settings.position_weight),
        rotation_weight=float(settings.rotation_weight),
        position_pull_s=float(settings.position_pull_s),
        rotation_pull_s=float(settings.rotation_pull_s),
        position_clamp_m=float(settings.position_clamp_m),
        rotation_clamp=math.radians(settings.rotation_clamp_deg),
        damping=stages.damping(settings.halflife_s),
        fade_s=float(settings.fade_s),
        braking=math.log(2.0) / settings.fade_halflife_s,
        is_warping=settings.is_warping,
        turn_limit=math.radians(settings.alignment_limit_deg) if settings.path_alignment else 0.0,
        turn_damping=stages.damping(settings.alignment_halflife_s),
        min_stride=float(settings.min_stride),
        max_stride=float(settings.max_stride),
        is_locking=bool(settings.foot_lock),
        foot_damping=stages.damping(settings.foot_halflife_s),
        foot_radius_m=float(settings.foot_radius_m),
    )


def _bones(banks: Sequence[PoseBank]) -> stages.Bones:
    bank = banks[0]
    rig, spine, tops = bank.skeleton, spine_of(bank), np.array(tops_of(bank.skeleton), np.int64)
    joints, left = (np.zeros(0, np.int64), np.zeros(0)) if spine is None else (spine.joints, spine.left)
    parents, offsets = np.array(rig.parents, np.int64), np.array(rig.offsets, np.float64)
    legs, hinges = legs_of(bank), hinges_of(bank)
    tops_at, most = np.searchsorted(bank.moving, tops), ADDED_SHARE * max(each.most_accel for each in banks)
    return stages.Bones(parents, offsets, bank.places, legs, hinges, tops, tops_at, joints, left, most)


def _checked(banks: object) -> dict[str, PoseBank]:
    """Banks by name, all of one rig."""
    named: dict[str, PoseBank] = dict(require_mapping(banks, "bank", "a PoseBank, or a mapping of databases to them"))
    for each in named.values():
        require_kind(each, PoseBank, "one of bank", "a PoseBank")
    if not named:
        raise MotionError(Fault("there is no pose bank.", "at least one"))
    (first, rig), *others = named.items()
    for name, other in others:
        if apart := _apart(rig, other):
            both = " and ".join(f"{in_quotes(at)} (with {in_quotes(bank.assets[0])})" for at, bank in ((first, rig), (name, other)))
            raise MotionError(Fault(f"the banks {both} are of different rigs: {apart}.", "banks of one rig", RIG_MEND))
    return named


def _apart(rig: PoseBank, other: PoseBank) -> str:
    """How the rigs of two banks differ, as the end of a sentence; empty where they do not."""
    if alone := [name for name in rig.skeleton.names if name not in other.skeleton.names]:
        return f"the second has no joint {in_quotes(alone[0])}"
    if more := [name for name in other.skeleton.names if name not in rig.skeleton.names]:
        return f"the first has no joint {in_quotes(more[0])}"
    if rig.skeleton.names != other.skeleton.names or not np.array_equal(rig.skeleton.parents, other.skeleton.parents):
        return "their joints have another order or other parents"
    apart = np.setxor1d(rig.moving, other.moving).tolist()
    return f"the joint {in_quotes(rig.skeleton.names[apart[0]])} has positions of its own in one of them alone" if apart else ""


# ---- the spine: the joints that turn back what `contextdb.motion.output.alignment` turns the hips by


@dataclass(frozen=True, eq=False, slots=True)
class Spine:
    """The joints that hang on the root, where they are in positions [M, 3], and the joints from the hips to the chest, which turn
    back: after each so much of the turn is left."""

    tops: Ints
    places: Ints
    joints: Ints
    left: Floats


def spine_of(bank: PoseBank) -> Spine | None:
    """The spine of a rig: from where the legs part up to where the arms do; None where there are no feet or nothing above them."""
    rig = bank.skeleton
    if not bank.feet:
        return None
    legs = [{rig.index(foot), *rig.ancestors(rig.index(foot))} for foot in bank.feet]
    shared = set.intersection(*legs)
    hips = max(shared, key=lambda joint: int(rig.depths[joint]), default=0)
    above = [joint for joint in _below(rig, hips) if not any(joint in leg for leg in legs)]
    joints: list[int] = []
    while above:
        joints.append(max(above, key=lambda joint: _size(rig, joint)))
        above = [joint for joint in _below(rig, joints[-1]) if _below(rig, joint)]
        if len(above) > 1:
            break
    if not joints:
        return None
    tops = np.array(tops_of(rig), np.int64)
    left = 1.0 - np.arange(1, len(joints) + 1) / len(joints)
    return Spine(tops, np.searchsorted(bank.moving, tops), np.array(joints, np.int64), left)


def _below(rig: Skeleton, joint: int) -> list[int]:
    return [other for other in range(rig.n_joints) if rig.parents[other] == joint]


def _size(rig: Skeleton, joint: int) -> int:
    """How many joints hang on a joint, itself among them."""
    return 1 + sum(_size(rig, other) for other in _below(rig, joint))
