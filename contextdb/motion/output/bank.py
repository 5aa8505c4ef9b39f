"""The poses of clips, to be played: each frame against the place and heading of the body in it.

A frame of a clip is where its root is on the ground and which way it faces, as in a motion database, and each joint against its
parent; the first joint is against the root. So a pose can be put wherever a character is. A skeleton whose hips hang below other
joints, which stay behind at the origin, has these joints at the root.

Frames are at the schema's rate, one range for each clip and one for each that is mirrored too, as in a database of the same clips
and schema. Lengths in metres, y up, angles in radians. N frames, R ranges, J joints, M of them with positions of their own: the
first, and those that do not keep their offset in every clip. All others lie at the rig's offsets, mirrored ranges too.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Iterable, Iterator, Mapping
from dataclasses import dataclass, fields, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from contextdb.cells.arguments import require_kind, require_many, require_real, require_text
from contextdb.core import PoseFrames, place_joints
from contextdb.errors import Fault, MotionError, Place, in_quotes, mend_for, plural, some
from contextdb.files import scratch
from contextdb.files.scratch import Pile
from contextdb.motion.clips import quaternions
from contextdb.motion.clips.clip import Clip
from contextdb.motion.clips.quaternions import Floats
from contextdb.motion.clips.skeleton import Ints, Skeleton
from contextdb.motion.features.schema import FeatureSchema
from contextdb.motion.markup.markup import Markup
from contextdb.motion.output.clip_parts import ARRAYS, ClipParts, Part, parts_of, tops_of
from contextdb.motion.output.legs import leg_of, steps_of, travels
from contextdb.motion.output.samples import Flags, Moment, Place3, Sample, Singles

SAME_M = 1e-6
"""A joint that is never farther from its offset keeps it."""
RIG_MEND = 'to put the clips on one rig: rig = "clips/idle.bvh" in [databases.NAME], or motion.retargeted'
STEP_S, USUAL = 1.0 / 30.0, 0.999
"""Accelerations are those over steps of this length, and usual are those of so many frames."""


@dataclass(frozen=True, eq=False)
class PoseBank:
    """Poses of clips. Made by `build`, or opened by `open_poses`.

    Attributes
    ----------
    skeleton : Skeleton
        The rig: that of the first clip, its offsets in metres.
    rate : float
        Frames a second.
    starts, stops : int64 array, shape (R,)
    assets : tuple of str, length R
    mirrored, looping : bool array, shape (R,)
    moving : int64 array, shape (M,)
        The joints with positions of their own.
    rotations : float32 array, shape (N, J, 4)
    positions : float32 array, shape (N, M, 3)
    root : float32 array, shape (N, 3)
        x, z and heading, unwrapped.
    feet : tuple of str
        Left and right; empty where no bones are named like feet.
    contacts : bool array, shape (N, len(feet))
        Whether each foot is down in the clip, so that it can be held where it is: stands flat or on its toe, or is marked.
    """

    skeleton: Skeleton
    rate: float
    starts: Ints
    stops: Ints
    assets: tuple[str, ...]
    mirrored: Flags
    looping: Flags
    moving: Ints
    rotations: Singles
    positions: Singles
    root: Singles
    feet: tuple[str, ...]
    contacts: Flags

    @classmethod
    def build(
        cls,
        clips: Iterable[Clip],
        schema: FeatureSchema,
        *,
        mirror: bool | Collection[str] = False,
        markup: Markup | None = None,
    ) -> PoseBank:
        """The poses of some clips, at the schema's rate.

        Parameters
        ----------
        clips : iterable of Clip
            All of one rig: the same bones below the same parents.
        schema : FeatureSchema
            Says the rate, the root and the facing, and the pairs to mirror by; that of the database with which the bank is used.
        mirror : bool or collection of str
            Whether all clips, or those of these names, are there a second time with left and right exchanged.
        markup : Markup, optional
            Says which clips loop, and when feet are down where that is not to be detected.

        Raises
        ------
        MotionError
            No clip, one without frames, of another rig or with numbers too large for a body, or two of one name; or they cannot be
            mirrored. All faults together.
        ContextError
            An argument of another type.
        """
        require_kind(schema, FeatureSchema, "schema", "a FeatureSchema")
        require_kind(markup, (Markup, type(None)), "markup", "a Markup, or None")
        for name in () if isinstance(mirror, bool) else require_many(mirror, "mirror", "True, False, or the names of clips"):
            require_text(name, "one of mirror")
        taken = (parts_of(clip, schema, mirror, markup) for clip in require_many(clips, "clips", "a list of Clip"))
        return cls.of_parts(taken, schema.rate)

    @classmethod
    def of_parts(cls, taken: Iterable[ClipParts], rate: float) -> PoseBank:
        """The bank of the parts of some clips, taken one after another. Raises what `build` raises."""
        parts: list[Part] = []
        pile, faults, seen = Pile(), list[Fault](), set[str]()
        first: ClipParts | None = None
        for each in taken:
            first = each if first is None else first
            wrong = [*_faults(each, first, seen), *each.faults]
            seen.add(each.name)
            faults += [fault.at(Place(each.name)) for fault in wrong]
            if not wrong:
                parts += [part.on(pile) for part in each.parts]
        if not parts and not faults:
            faults.append(Fault("there is no clip to take poses of.", "at least one clip"))
        if faults:
            raise MotionError(*faults)
        return _bank_of(parts, pile.arrays(), rate)

    def __repr__(self) -> str:
        sizes = plural(len(self.assets), "range"), plural(self.n_frames, "frame"), plural(self.n_joints, "joint")
        return f"<PoseBank: {', '.join(sizes)}>"

    @property
    def n_frames(self) -> int:
        """How many frames all ranges have."""
        return len(self.root)

    @cached_property
    def n_joints(self) -> int:
        """How many joints a pose has."""
        return self.skeleton.n_joints

    def range_of(self, asset: str, mirrored: bool = False) -> int:
        """The range of an asset. Raises MotionError when there is none, with the nearest name."""
        number = self.number_of(asset, mirrored)
        if number < 0:
            raise MotionError(self._unknown(asset))
        return number

    def number_of(self, asset: str, mirrored: bool) -> int:
        """The same; -1 when there is none."""
        return self._ranges.get((asset, bool(mirrored)), -1)

    def last_s(self, range_number: int) -> float:
        """Seconds from the first frame of a range to its last."""
        return float(self.stops[range_number] - self.starts[range_number] - 1) / self.rate

    def sample(self, asset: str, time_s: float, mirrored: bool = False) -> Sample:
        """A moment of an asset, between frames too: before its beginning its first pose, behind its end its last; a loop goes on.
        Raises MotionError where there is no such asset, or not mirrored; ContextError where `time_s` is no finite number."""
        require_text(asset, "asset")
        return self.sample_of(self.range_of(asset, mirrored), require_real(time_s, "time_s"))

    def sample_of(self, range_number: int, time_s: float) -> Sample:
        """As `sample`, of a range's number, without a look at the arguments."""
        return self._sampled(range_number, time_s)[0]

    def _sampled(self, range_number: int, time_s: float) -> tuple[Sample, int, int, float]:
        """A moment, the two frames about it, and the share of the second."""
        rotations, positions, numbers = np.empty((self.n_joints, 4)), np.empty((len(self.moving), 3)), np.empty(6)
        spins, velocities = np.empty((self.n_joints, 3)), np.empty((len(self.moving), 3))
        self.frames.sample(int(range_number), time_s, rotations, positions, spins, velocities, numbers)
        low, high, share, left, ahead, turn = numbers.tolist()
        return Sample(rotations, positions, spins, velocities, (left, ahead, turn)), int(low), int(high), share

    def moment_of(self, range_number: int, time_s: float) -> Moment:
        """What a range is at a moment."""
        sample, low, high, share = self._sampled(range_number, time_s)
        (x, z, heading, left, ahead, sway), (to_x, to_z, to_heading, to_left, to_ahead, to_sway) = self._ways[[low, high]].tolist()
        root = x + share * (to_x - x), z + share * (to_z - z), heading + share * (to_heading - heading)
        travel = left + share * (to_left - left), ahead + share * (to_ahead - ahead), sway + share * (to_sway - sway)
        near = high if share >= 0.5 else low
        return Moment(sample.rotations, sample.positions, root, travel, np.asarray(self.contacts[near]), near)

    def joints_at(self, range_number: int, time_s: float, heading: float = 0.0) -> Floats:
        """Where the joints are at a moment of a range [J, 3], with the body at the origin."""
        sample = self.sample_of(range_number, time_s)
        return placed(self.skeleton, self.translations(sample.positions), sample.rotations, (0.0, 0.0, heading))[0]

    def contacts_at(self, range_number: int, time_s: float) -> Flags:
        """Which feet are down at a moment of a range: in the nearest frame."""
        return self.moment_of(range_number, time_s).contacts

    def translations(self, positions: Floats) -> Floats:
        """Each joint against its parent [J, 3], of the positions [M, 3] of those that have some of their own."""
        translations = self.skeleton.offsets.copy()
        translations[self.moving] = positions
        return translations

    @cached_property
    def _steps(self) -> Floats:
        if not self.feet:
            return np.zeros((self.n_frames, 0, 3))
        legs = ((leg_of(self.skeleton, foot), foot) for foot in self.feet)
        toes = [self._places_of(self.skeleton.index(foot) if leg is None else leg.toe) for leg, foot in legs]
        return steps_of(self.root, np.stack(toes, axis=1), self.contacts, self._spans)

    def _places_of(self, joint: int) -> Floats:
        """Where a joint is against the root in each frame: [N, 3]."""
        rotations, places = np.tile([1.0, 0.0, 0.0, 0.0], (self.n_frames, 1)), np.zeros((self.n_frames, 3))
        for each in (*reversed(self.skeleton.ancestors(joint)), joint):
            row = self.places[each]
            own = self.positions[:, row] if row >= 0 else self.skeleton.offsets[each]
            places = places + quaternions.rotate(rotations, np.broadcast_to(own, places.shape))
            rotations = quaternions.multiply(rotations, self.rotations[:, each].astype(np.float64))
        return places

    @cached_property
    def places(self) -> Ints:
        """Which row of positions [M, 3] is each joint's, -1 where it keeps its offset: int64 [J]."""
        columns = np.full(self.n_joints, -1)
        columns[self.moving] = np.arange(len(self.moving))
        return columns

    @cached_property
    def most_accel(self) -> float:
        """The acceleration that no joint passes in 99.9 % of the frames, over steps of about 1/30 s, m/s²; infinite without any."""
        step, every = max(1, round(STEP_S * self.rate)), [np.zeros(0)]
        for number in np.flatnonzero(~self.mirrored & (self.stops - self.starts > 2 * step)).tolist():
            accelerations = np.empty(int(self.stops[number] - self.starts[number]) - 2 * step)
            self.frames.accelerations(number, *self.joints, step, accelerations)
            every.append(accelerations)
        accelerations = np.concatenate(every)
        return float(np.quantile(accelerations, USUAL)) if len(accelerations) else math.inf

    @cached_property
    def joints(self) -> tuple[Ints, Floats, Ints]:
        """Parents [J], offsets [J, 3] and places [J], as the core takes them."""
        return np.array(self.skeleton.parents, np.int64), np.array(self.skeleton.offsets, np.float64), self.places

    @cached_property
    def _ways(self) -> Floats:
        """Root and travel of each frame: [N, 6]."""
        return np.column_stack((self.root, travels(self.root, self.starts, self.stops, self.looping, self.rate)))

    @cached_property
    def frames(self) -> PoseFrames:
        """The frames for the core, for those who feel no ground."""
        return self._frames(None)

    @cached_property
    def frames_on_ground(self) -> PoseFrames:
        """The frames for the core, with the steps of feet."""
        return self._frames(self._steps)

    def _frames(self, steps: Floats | None) -> PoseFrames:
        return PoseFrames(*self.frame_parts(steps))

    def frame_parts(self, steps: Floats | None) -> tuple[Any, ...]:
        """The arrays of which the core makes frames; without steps for those who feel no ground."""
        rotations, positions, root = (
            np.require(each, np.float32, ("C", "A")) for each in (self.rotations, self.positions, self.root)
        )
        starts, looping, contacts = np.array(self.starts, np.int64), np.array(self.looping), np.ascontiguousarray(self.contacts)
        n_steps, ways = np.array(self.stops, np.int64) - starts - 1, np.ascontiguousarray(self._ways, np.float64)
        return rotations, positions, root, ways, contacts, steps, starts, n_steps, looping, float(self.rate)

    @property
    def steps(self) -> Floats:
        """Of each foot in each frame how far it is through its swing, and where that puts it down: [N, feet, 3]."""
        return self._steps

    def __getstate__(self) -> dict[str, object]:
        """The fields alone: what is prepared for the core is prepared again where the bank is unpickled or copied."""
        return {each.name: getattr(self, each.name) for each in fields(self)}

    @cached_property
    def _spans(self) -> list[tuple[int, int, bool]]:
        """First frame, steps to the last and whether it loops, of each range."""
        steps = (self.stops - self.starts - 1).tolist()
        return list(zip(self.starts.tolist(), steps, self.looping.tolist(), strict=True))

    @cached_property
    def _ranges(self) -> dict[tuple[str, bool], int]:
        return {(asset, bool(side)): i for i, (asset, side) in enumerate(zip(self.assets, self.mirrored.tolist(), strict=True))}

    def _unknown(self, asset: str) -> Fault:
        names = list(dict.fromkeys(self.assets))
        if asset in names:
            return Fault(f"{in_quotes(asset)} has no mirrored poses.", "a bank built with mirror = true, as its database is")
        return Fault(f"there are no poses of {in_quotes(asset)}.", some(names), mend_for(asset, names))


def placed(rig: Skeleton, translations: Floats, rotations: Floats, root: Place3) -> tuple[Floats, Floats]:
    """Joints in the world [J, 3], and their rotations [J, 4], of a pose against parents whose first joint is against a root."""
    positions, world = np.empty((rig.n_joints, 3)), np.empty((rig.n_joints, 4))
    parents = np.asarray(rig.parents, np.int64)
    place_joints(parents, np.ascontiguousarray(translations), np.ascontiguousarray(rotations), np.array(root), positions, world)
    return positions, world


def _faults(clip: ClipParts, first: ClipParts, seen: set[str]) -> Iterator[Fault]:
    """What keeps a clip out of a bank."""
    if clip.name in seen:
        yield Fault(f"two clips are named {in_quotes(clip.name)}.", "a different name for each asset", rule="duplicate")
    if clip.n_frames == 0:
        yield Fault("the clip has no frame.", "a clip with at least one frame")
    names, rig = clip.rig.names, first.rig
    if names != rig.names:
        other = [name for name in names if name not in rig] or [name for name in rig.names if name not in clip.rig]
        differ = (
            f"its bones are not those of {in_quotes(first.name)}: {some(other)}" if other else "its bones come in another order"
        )
        yield Fault(f"{differ}.", f"the same {plural(rig.n_joints, 'bone')} in every clip of a bank", RIG_MEND)
    elif not np.array_equal(clip.rig.parents, rig.parents):
        problem = f"its bones hang on other parents than those of {in_quotes(first.name)}."
        yield Fault(problem, "one rig for every clip of a bank", RIG_MEND)


def moving_alike(banks: Mapping[str, PoseBank]) -> dict[str, PoseBank]:
    """The banks; those of one rig with positions of the same joints: one take moves its root, another its hips."""
    alike = dict(banks)
    for name, bank in banks.items():
        rig = [each.moving for each in banks.values() if each.skeleton.names == bank.skeleton.names]
        moving = np.unique(np.concatenate(rig))
        if len(moving) > len(bank.moving):
            positions = np.tile(bank.skeleton.offsets[moving].astype(np.float32), (bank.n_frames, 1, 1))
            positions[:, np.searchsorted(moving, bank.moving)] = bank.positions
            alike[name] = replace(bank, moving=moving, positions=positions)
    return alike


def _bank_of(parts: list[Part], arrays: list[NDArray[Any]], rate: float) -> PoseBank:
    """The bank of parts, of arrays on a pile."""
    rig = parts[0].rig
    away = [
        np.maximum(np.abs(part.least - rig.offsets), np.abs(part.most - rig.offsets)).max(axis=1)
        for part in parts
        if not part.is_mirrored
    ]
    moving = sorted({*tops_of(rig), *np.flatnonzero(np.max(away, axis=0) > SAME_M).tolist()})
    rotations, positions, root, contacts = ([arrays[part.numbers[i]] for part in parts] for i in range(len(ARRAYS)))
    lengths = list(map(len, root))
    stops = np.cumsum(lengths, dtype=np.int64)
    places = scratch.zeros((int(stops[-1]), len(moving), 3), np.float32)
    for start, stop, own in zip((stops - lengths).tolist(), stops.tolist(), positions, strict=True):
        places[start:stop] = own[:, moving]
    return PoseBank(
        rig,
        rate,
        stops - np.array(lengths, np.int64),
        stops,
        tuple(part.asset for part in parts),
        np.array([part.is_mirrored for part in parts], np.bool_),
        np.array([part.is_looping for part in parts], np.bool_),
        np.array(moving, np.int64),
        scratch.joined(rotations, rotations[0][:0]),
        places,
        scratch.joined(root, root[0][:0]),
        parts[0].feet,
        scratch.joined(contacts, contacts[0][:0]),
    )
