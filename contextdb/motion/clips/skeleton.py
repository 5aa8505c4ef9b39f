"""A skeleton: joints with parents, offsets and channels, in the order in which a BVH file lists them.

J joints; a parent always is before its children, and a joint's descendants directly behind it. Offsets are in the file's units.
A bone is named by the joint at its start.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from contextdb.errors import Fault, MotionError, in_quotes, plural, some
from contextdb.motion.clips.bone_names import meant_bone, nearest_bones, side_words, without_namespace
from contextdb.motion.clips.quaternions import Floats

Ints = NDArray[np.int64]

POSITIONS = ("Xposition", "Yposition", "Zposition")
ROTATIONS = ("Xrotation", "Yrotation", "Zrotation")
CHANNELS = POSITIONS + ROTATIONS

MOST_NAMED = 4
"""So many bones are named where one is missing."""
SIDES = (("left", "right"), ("Left", "Right"), ("LEFT", "RIGHT"))


@dataclass(frozen=True, eq=False)
class Skeleton:
    """The joints of a body. Compare names and parents, not skeletons: each file makes its own.

    Attributes
    ----------
    names : tuple of str, length J
        Unique.
    parents : int64 array, shape (J,)
        The parent's index; -1 for the root, which is joint 0.
    offsets : float64 array, shape (J, 3)
        From the parent, in the file's units.
    channels : tuple of tuples of str, length J
        For each joint, the channels of its values in order; rotations apply from the last to the first.
    end_sites : tuple of (joint, offset)
        Where a chain of bones ends; they have no channels and are no joints.
    """

    names: tuple[str, ...]
    parents: Ints
    offsets: Floats
    channels: tuple[tuple[str, ...], ...]
    end_sites: tuple[tuple[int, tuple[float, float, float]], ...] = ()

    @property
    def n_joints(self) -> int:
        """How many joints there are."""
        return len(self.names)

    @property
    def n_channels(self) -> int:
        """How many values one frame of motion has."""
        return sum(map(len, self.channels))

    @cached_property
    def channel_starts(self) -> Ints:
        """The column of each joint's first channel: int64 [J]."""
        return np.cumsum([0, *map(len, self.channels)])[:-1]

    @cached_property
    def depths(self) -> Ints:
        """How many joints are above each: int64 [J]."""
        depths = np.zeros(self.n_joints, np.int64)
        for joint, parent in enumerate(self.parents.tolist()):
            depths[joint] = depths[parent] + 1 if parent >= 0 else 0
        return depths

    @cached_property
    def levels(self) -> tuple[Ints, ...]:
        """The joints of each depth, the root first: what can be placed in one step."""
        order = np.argsort(self.depths, kind="stable")
        return tuple(np.split(order, np.flatnonzero(np.diff(self.depths[order])) + 1))

    @cached_property
    def _index(self) -> dict[str, int]:
        """The joints by their names, and by those without namespace that only one has."""
        bare = [without_namespace(name) for name in self.names]
        times = Counter(bare)
        alone = {name: joint for joint, name in enumerate(bare) if times[name] == 1}
        return alone | {name: joint for joint, name in enumerate(self.names)}

    def __contains__(self, bone: str) -> bool:
        return bone in self._index

    def index(self, bone: str) -> int:
        """The joint of a bone's name; a MotionError names the nearest bone when there is none."""
        if bone not in self._index:
            raise MotionError(self.missing_bone(bone))
        return self._index[bone]

    def missing_bone(self, bone: str) -> Fault:
        """What to say of a bone that the skeleton lacks."""
        near = meant_bone(bone, self.names)
        mend = in_quotes(near) if near else ""
        accepted = f"one of {plural(self.n_joints, 'bone')}, such as {some(nearest_bones(bone, self.names, MOST_NAMED))}"
        return Fault(f"there is no bone {in_quotes(bone)}.", accepted, mend, rule="unknown-bone")

    @cached_property
    def facing_pair(self) -> tuple[int, int] | None:
        """The left and right joint whose line the body faces across: the sided pair nearest the root, as a rule the thighs.

        Pairs whose two joints lie at one offset are passed over: some exporters put a joint of no length between hips and thigh.
        None when no two names differ by their side.
        """
        pairs = [
            (left, right) for left, right in self._sided_joints() if not np.array_equal(self.offsets[left], self.offsets[right])
        ]
        return min(pairs, key=lambda pair: (self.depths[pair[0]], pair[0]), default=None)

    @cached_property
    def hips(self) -> int:
        """The joint whose place on the ground is the body's: the lowest one above both of `facing_pair`, else the root."""
        if self.facing_pair is None:
            return 0
        left, right = self.facing_pair
        above_right = set(self.ancestors(right))
        return next((joint for joint in self.ancestors(left) if joint in above_right), 0)

    def _sided_joints(self) -> Iterator[tuple[int, int]]:
        for left, right in sided_pairs(self.names):
            yield self._index[left], self._index[right]

    def ancestors(self, joint: int) -> list[int]:
        """The joints above one, its parent first."""
        joints: list[int] = []
        while (joint := int(self.parents[joint])) >= 0:
            joints.append(joint)
        return joints


def sided_pairs(names: Sequence[str]) -> list[tuple[str, str]]:
    """The pairs of bones whose names differ by side alone, left first: LeftFoot and RightFoot, Hip_L and Hip_R, lhip and rhip."""
    known = set(names)
    spelt = {side_words(name): name for name in reversed(names)}
    pairs = []
    for name in names:
        rights = [right for right in _right_names(name) if right in known and right != name]
        pairs += [(name, right) for right in rights or filter(None, [spelt.get(_right_words(side_words(name)))])]
    return list(dict.fromkeys(pairs))


def _right_words(words: tuple[str, ...]) -> tuple[str, ...]:
    """The words of a left-hand name as those of the right-hand one; none where it is on no side."""
    at = words.index("left") if "left" in words else len(words)
    return (*words[:at], "right", *words[at + 1 :]) if at < len(words) else ()


def _right_names(name: str) -> Iterator[str]:
    """What the right-hand bone may be called if `name` is a left-hand one; a namespace such as "rig:" stays."""
    space, colon, stem = name.rpartition(":")
    for left, right in SIDES:
        if left in stem:
            yield space + colon + stem.replace(left, right, 1)
    for left, right in (("l", "r"), ("L", "R")):
        if stem.startswith(left):
            yield space + colon + right + stem[1:]
        if stem.endswith(left):
            yield space + colon + stem[:-1] + right
        yield from (space + colon + stem.replace(f"{mark}{left}{mark}", f"{mark}{right}{mark}", 1) for mark in "_.- ")
