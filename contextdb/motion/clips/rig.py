"""What a rig shows by names and shape: hips, spine, head, feet, pairs; for people who write settings for it.

Heights are those of the first frame, in metres, y up.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from contextdb.errors import MotionError
from contextdb.motion.clips.bone_names import side_and_core
from contextdb.motion.clips.clip import Clip
from contextdb.motion.clips.foot_bones import UNDECLARED, Foot
from contextdb.motion.clips.poses import poses_of
from contextdb.motion.clips.skeleton import Skeleton, sided_pairs


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
        """What a clip's skeleton shows."""
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
