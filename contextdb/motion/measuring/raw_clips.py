"""The clips of pose banks as they are: what the displayed motion is compared with.

N frames of one bank, J joints, K feet.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from functools import cached_property, lru_cache
from typing import TypeAlias

import numpy as np

from contextdb.motion.clips.poses import LocalPoses, forward_kinematics
from contextdb.motion.clips.quaternions import Floats
from contextdb.motion.clips.skeleton import Ints, Skeleton
from contextdb.motion.measuring.formulas import Slides, accelerations, floor_of
from contextdb.motion.output.bank import PoseBank
from contextdb.motion.output.samples import Flags

ON_FRAME = 1e-4
"""A moment that is nearer to a frame, in frames, is on it."""
DOWN_M, DOWN_MPS = 0.03, 0.5
"""What stands of a foot is down where it is lower over its floor than the first and slower than the second: on purpose another
definition than that of the contacts, which the foot lock has."""
Banks: TypeAlias = PoseBank | Mapping[str, PoseBank]
"""One for all databases, or by their names."""


@dataclass(frozen=True, slots=True)
class At:
    """A moment of an asset; the database is "" where it is not known."""

    database: str
    asset: str
    mirrored: bool
    time_s: float


@dataclass(frozen=True, eq=False)
class RawClips:
    """The clips of one bank, each joint in the world of its clip; what was once computed is cached.

    `of_steps` are the accelerations by the number of frames of a step.
    """

    bank: PoseBank
    of_steps: dict[int, list[Floats]] = field(default_factory=dict)

    @cached_property
    def numbers(self) -> dict[tuple[str, bool], int]:
        """The range of each asset, as recorded and mirrored."""
        pairs = zip(self.bank.assets, self.bank.mirrored.tolist(), strict=True)
        return {pair: number for number, pair in enumerate(pairs)}

    @property
    def feet(self) -> Ints:
        """For each foot of the bank the joint that is planted: the toe where there is one, else the ankle."""
        return np.array([toe_of(self.bank.skeleton, foot) for foot in self.bank.feet], np.int64)

    @cached_property
    def in_body(self) -> Floats:
        """Each joint against the place and heading of the body: float64 [N, J, 3]."""
        bank = self.bank
        offsets = np.repeat(bank.skeleton.offsets[None], bank.n_frames, axis=0)
        offsets[:, bank.moving] = bank.positions
        local = LocalPoses(bank.skeleton, bank.rate, offsets, np.asarray(bank.rotations, np.float64))
        return forward_kinematics(local).positions

    @cached_property
    def positions(self) -> Floats:
        """Each joint in the world of its clip: float64 [N, J, 3]."""
        return _turned(self.in_body, self.root[:, 2], 1.0) + _ground(self.root)

    @cached_property
    def root(self) -> Floats:
        """Where the clips have the body: float64 [N, 3]."""
        return np.asarray(self.bank.root, np.float64)

    def recorded(self) -> Iterator[slice]:
        """The frames of each range that is not mirrored, of two frames or more."""
        for start, stop, is_mirrored in zip(self.bank.starts.tolist(), self.bank.stops.tolist(), self.bank.mirrored, strict=True):
            if not is_mirrored and stop - start > 1:
                yield slice(start, stop)

    def accelerations(self, step_s: float) -> list[Floats]:
        """The accelerations of all joints over steps of about some time, clip by clip."""
        step = max(1, round(step_s * self.bank.rate))
        if step not in self.of_steps:
            every = (self.positions[frames] for frames in self.recorded())
            self.of_steps[step] = [accelerations(each, np.arange(len(each)) / self.bank.rate, step) for each in every]
        return self.of_steps[step]

    @cached_property
    def paths(self) -> list[tuple[Floats, Floats]]:
        """The places of the feet [frames, K, 3] and their floors [K], clip by clip."""
        every = [self.positions[frames][:, self.feet] for frames in self.recorded()]
        return [(places, floor_of(places)) for places in every]

    @cached_property
    def slides(self) -> list[Slides]:
        """How the feet move, clip by clip."""
        return self._slides(self.bank.contacts)

    @cached_property
    def toe_slides(self) -> list[Slides]:
        """The same, with what `toes_down` says."""
        return self._slides(self.toes_down)

    def _slides(self, down: Flags) -> list[Slides]:
        every = zip(self.paths, self.recorded(), strict=True)
        return [Slides.of(places, np.arange(len(places)) / self.bank.rate, down[at], floor) for (places, floor), at in every]

    @cached_property
    def floors(self) -> Floats:
        """The height of the floor below each foot in the range of each frame: float64 [N, K]."""
        floors = np.zeros((self.bank.n_frames, len(self.feet)))
        for start, stop in zip(self.bank.starts.tolist(), self.bank.stops.tolist(), strict=True):
            floors[start:stop] = floor_of(self.positions[start:stop, self.feet])
        return floors

    @cached_property
    def toes_down(self) -> Flags:
        """Whether each foot is low and slow in each frame, whatever its contacts say: bool [N, K]."""
        speeds = self.foot_speeds.copy()
        last = self.bank.stops - 1
        speeds[last] = speeds[np.maximum(last - 1, self.bank.starts)]
        heights = self.positions[:, self.feet, 1] - self.floors
        return np.asarray((heights < DOWN_M) & ~(speeds >= DOWN_MPS))

    @cached_property
    def foot_speeds(self) -> Floats:
        """How fast each foot moves over the ground from each frame to the next of its range: float64 [N, K]; NaN at the last."""
        feet = self.positions[:, self.feet][..., [0, 2]]
        speeds = np.full(feet.shape[:2], np.nan)
        speeds[:-1] = np.linalg.norm(np.diff(feet, axis=0), axis=-1) * self.bank.rate
        speeds[self.bank.stops - 1] = np.nan
        return speeds

    def body_at(self, range_number: int, time_s: float) -> tuple[Floats, Floats]:
        """Where the joints are against the body at a moment of a range, and their velocities in its frame: float64 [J, 3]."""
        low, high, share = self._between(range_number, time_s)
        places = self.in_body[low] + share * (self.in_body[high] - self.in_body[low])
        speeds = (self.positions[high] - self.positions[low]) * self.bank.rate
        heading = self.root[low, 2] + share * (self.root[high, 2] - self.root[low, 2])
        return places, _turned(speeds[None], np.array([heading]), -1.0)[0]

    def contacts_at(self, range_number: int, time_s: float) -> Flags:
        """Which feet are down at a moment, between two frames in both: bool [K]."""
        low, high, share = self._between(range_number, time_s)
        contacts = self.bank.contacts
        at_low, at_high = share < 1.0 - ON_FRAME, share > ON_FRAME
        return np.asarray((contacts[low] | (not at_low)) & (contacts[high] | (not at_high)))

    def frame_at(self, range_number: int, time_s: float) -> int:
        """The nearest frame, counted over the whole bank."""
        low, high, share = self._between(range_number, time_s)
        return high if share >= 0.5 else low

    def _between(self, range_number: int, time_s: float) -> tuple[int, int, float]:
        start, last = int(self.bank.starts[range_number]), int(self.bank.stops[range_number]) - 1
        frame = min(max(time_s * self.bank.rate, 0.0), float(last - start))
        low = min(int(frame + 1e-9), max(last - start - 1, 0))
        return start + low, min(start + low + 1, last), frame - low


@dataclass(frozen=True, eq=False)
class Clips:
    """The clips of one bank or of several, by the names of their databases."""

    raw: Mapping[str, RawClips]

    @classmethod
    def of(cls, banks: Banks) -> Clips:
        """Of what a pose stream takes."""
        named = {"": banks} if isinstance(banks, PoseBank) else banks
        return cls({name: raw_of(bank) for name, bank in named.items()})

    def find(self, at: At) -> tuple[RawClips, int] | None:
        """The clips that an asset is among, and its range there; None where there is no such asset."""
        named = self.raw.get(at.database)
        for clips in self.raw.values() if named is None else (named,):
            if (number := clips.numbers.get((at.asset, at.mirrored))) is not None:
                return clips, number
        return None

    @cached_property
    def distinct(self) -> list[RawClips]:
        """Those that are compared with: of databases that share assets the largest alone."""
        distinct: list[RawClips] = []
        for clips in sorted(self.raw.values(), key=lambda each: -each.bank.n_frames):
            if not any(set(clips.bank.assets) <= set(other.bank.assets) for other in distinct):
                distinct.append(clips)
        return distinct


@lru_cache(maxsize=4)
def raw_of(bank: PoseBank) -> RawClips:
    """The clips of a bank; those of the last banks are cached, as many sessions are measured with the same."""
    return RawClips(bank)


def toe_of(skeleton: Skeleton, foot: str) -> int:
    """The toe below a foot, or the foot itself."""
    ankle = skeleton.index(foot)
    below = [joint for joint in range(skeleton.n_joints) if skeleton.parents[joint] == ankle]
    names = {joint: skeleton.names[joint].casefold() for joint in below}
    return next((joint for joint, name in names.items() if "toe" in name or "ball" in name), ankle)


def _turned(vectors: Floats, headings: Floats, sign: float) -> Floats:
    """Vectors [T, J, 3] turned about up by headings [T]."""
    sin, cos = np.sin(sign * headings)[:, None], np.cos(sign * headings)[:, None]
    x, y, z = np.moveaxis(vectors, -1, 0)
    return np.stack((cos * x + sin * z, y, cos * z - sin * x), axis=-1)


def _ground(root: Floats) -> Floats:
    return np.stack((root[:, 0], np.zeros(len(root)), root[:, 1]), axis=-1)[:, None]
