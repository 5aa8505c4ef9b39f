"""The bones of a skeleton that touch the ground: feet, heels and toes, found by their names, by the shape of the rig, or declared.

A foot is the bone at the ankle. Its toe is the joint at the ball, or where the foot's chain ends; a rig without either has none.
Few rigs have a heel; `contextdb.motion.clips.contacts` makes one of the foot and the toe.
"""

from __future__ import annotations

from dataclasses import dataclass

from contextdb.errors import Fault, MotionError, some
from contextdb.motion.clips.bone_names import side_and_core
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
