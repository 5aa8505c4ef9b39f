"""The spine of a rig: the joints that turn back what `contextdb.motion.output.alignment` turns the hips by."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from contextdb.motion.clips.quaternions import Floats
from contextdb.motion.clips.skeleton import Ints, Skeleton
from contextdb.motion.output.bank import PoseBank, tops_of


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
