"""The bones of a skeleton that touch the ground: feet, heels and toes, found by their names, by the shape of the rig, or declared.

A foot is the bone at the ankle. Its toe is the joint at the ball, or where the foot's chain ends; a rig without either has none.
Few rigs have a heel; `contextdb.motion.clips.contacts` makes one of the foot and the toe.

Heights are those of the first frame, in metres, y up.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from contextdb.errors import Fault, MotionError, some
from contextdb.motion.clips.bone_names import side_and_core
from contextdb.motion.clips.clip import Clip
from contextdb.motion.clips.poses import poses_of
from contextdb.motion.clips.skeleton import Skeleton, sided_pairs

Pair = tuple[str, str]
FOOT_WORDS = ("foot", "ankle")
TOE_WORDS = ("toe", "ball")
HEEL_WORDS = ("heel",)
LEG_JOINTS = 2
"""The foot of a leg without names is so many joints below the thigh."""


@dataclass(frozen=True, slots=True)
class FootBones:
    """What `[features.NAME]` says of the bones of both feet, left first; None is to be detected."""

    feet: Pair | None = None
    heels: Pair | None = None
    toes: Pair | None = None

    def feet_in(self, skeleton: Skeleton) -> tuple[Foot, Foot]:
        """The two feet of a skeleton; a MotionError when it has none, or lacks a bone that is declared."""
        left, right = feet_of(skeleton) if self.feet is None else self.feet
        return self._foot(skeleton, left, 0), self._foot(skeleton, right, 1)

    def _foot(self, skeleton: Skeleton, bone: str, side: int) -> Foot:
        foot = skeleton.index(bone)
        heel = _below(skeleton, foot, HEEL_WORDS) if self.heels is None else skeleton.index(self.heels[side])
        toe = _toe(skeleton, foot) if self.toes is None else skeleton.index(self.toes[side])
        return Foot(bone, foot, heel, toe)


@dataclass(frozen=True, slots=True)
class Foot:
    """One foot: the name of its bone, and the joints of ankle, heel and toe; a heel and a toe may be missing."""

    bone: str
    joint: int
    heel: int | None
    toe: int | None


def feet_of(skeleton: Skeleton) -> Pair:
    """The sided bones, left first, whose names hold "foot" or "ankle", else the ends of both legs; a MotionError when there are
    none."""
    pairs = sided_pairs(skeleton.names)
    feet = next((pair for pair in pairs if side_and_core(pair[0])[1] == FOOT_WORDS[0]), None)
    feet = feet or next((pair for word in FOOT_WORDS for pair in pairs if word in pair[0].casefold()), None)
    feet = feet or _ends_of_legs(skeleton, pairs)
    if feet is None:
        raise MotionError(Fault("no pair of bones is named like feet.", f"feet=(left, right), of {some(skeleton.names)}"))
    return feet


def _ends_of_legs(skeleton: Skeleton, pairs: list[Pair]) -> Pair | None:
    """The sided bones two joints below those across which the body faces."""
    if skeleton.facing_pair is None:
        return None
    left, right = skeleton.facing_pair
    for pair in pairs:
        above = [skeleton.ancestors(skeleton.index(bone))[LEG_JOINTS - 1 : LEG_JOINTS] for bone in pair]
        if above == [[left], [right]]:
            return pair
    return None


def _toe(skeleton: Skeleton, foot: int) -> int | None:
    """The joint at the ball of a foot: one of that name, else its first child that is no heel."""
    named = _below(skeleton, foot, TOE_WORDS)
    heel = _below(skeleton, foot, HEEL_WORDS)
    children = [joint for joint, parent in enumerate(skeleton.parents.tolist()) if parent == foot and joint != heel]
    return named if named is not None else next(iter(children), None)


def _below(skeleton: Skeleton, foot: int, words: tuple[str, ...]) -> int | None:
    """The first joint below a foot whose name holds one of some words."""
    below = (joint for joint in range(foot + 1, skeleton.n_joints) if foot in skeleton.ancestors(joint))
    return next((joint for joint in below if any(word in skeleton.names[joint].casefold() for word in words)), None)


UNDECLARED = FootBones()
"""All bones are to be detected."""


# ---- what a rig shows by names and shape: hips, spine, head, feet, pairs; for people who write settings for it


@dataclass(frozen=True, slots=True)
class Rig:
    """What a skeleton shows: heights of its bones (none for a clip without frames), the spine from hips to head from below,
    feet, heels and toes left and right (empty where there are none), the left and right bone across which the body faces, and the
    pairs that change places in a mirror."""

    skeleton: Skeleton
    heights_m: tuple[float, ...]
    hips: str
    head: str | None
    spine: tuple[str, ...]
    feet: tuple[str, ...]
    heels: tuple[str, ...]
    toes: tuple[str, ...]
    facing: tuple[str, ...]
    mirror: tuple[tuple[str, str], ...]

    @classmethod
    def of(cls, clip: Clip) -> Rig:
        skeleton = clip.skeleton
        names = skeleton.names
        first = Clip(clip.name, skeleton, clip.frame_time_s, clip.values[:1], clip.metres_per_unit, clip.up)
        heights = poses_of(first).positions[0, :, 1] if clip.n_frames else np.zeros(0)
        head = _head(skeleton, heights.tolist())
        above = [] if head is None else skeleton.ancestors(head)
        spine = above[: above.index(skeleton.hips)] if skeleton.hips in above else []
        feet = _feet(skeleton)
        heels, toes = [foot.heel for foot in feet], [foot.toe for foot in feet]
        return cls(
            skeleton,
            tuple(heights.tolist()),
            names[skeleton.hips],
            None if head is None else names[head],
            tuple(names[joint] for joint in reversed(spine)),
            tuple(foot.bone for foot in feet),
            tuple(names[joint] for joint in heels if joint is not None),
            tuple(names[joint] for joint in toes if joint is not None),
            tuple(names[joint] for joint in skeleton.facing_pair or ()),
            tuple(sided_pairs(names)),
        )

    @property
    def height_m(self) -> float:
        """How far the body reaches upwards, from its lowest joint to its highest."""
        return max(self.heights_m) - min(self.heights_m) if self.heights_m else 0.0

    def roles(self, bone: str) -> list[str]:
        """What a bone is detected to be."""
        alone = [role for role, name in (("hips", self.hips), ("head", self.head)) if name == bone]
        listed = (("spine", self.spine), ("foot", self.feet), ("heel", self.heels), ("toe", self.toes), ("facing", self.facing))
        return alone + [role for role, names in listed if bone in names]

    def partner(self, bone: str) -> str | None:
        return next((right if bone == left else left for left, right in self.mirror if bone in (left, right)), None)


def _feet(skeleton: Skeleton) -> tuple[Foot, ...]:
    """The feet, left first; none where none are detected."""
    try:
        return UNDECLARED.feet_in(skeleton)
    except MotionError:
        return ()


def _head(skeleton: Skeleton, heights: list[float]) -> int | None:
    """The bone that is named so, else the highest one without a side."""
    unsided = [joint for joint, name in enumerate(skeleton.names) if side_and_core(name)[0] == ""]
    named = next((joint for joint in unsided if side_and_core(skeleton.names[joint])[1] == "head"), None)
    if named is not None or not heights:
        return named
    above_hips = [joint for joint in unsided if skeleton.hips in skeleton.ancestors(joint)]
    return max(above_hips, key=lambda joint: heights[joint], default=None)
