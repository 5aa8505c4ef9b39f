"""What a clip gives to a pose bank: its poses at the rate of a schema, each against the place and heading of the body in it.

A clip is a part, and a second one where it is mirrored too. Parts are made one by one, wherever the clip is read; a bank puts them
together. Lengths in metres, y up, angles in radians. F frames, J joints.
"""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass, replace

import numpy as np

from contextdb.cells.arguments import require_kind
from contextdb.errors import Fault, MotionError
from contextdb.files.scratch import Pile
from contextdb.motion.clips import mirror as mirrors
from contextdb.motion.clips import quaternions
from contextdb.motion.clips.clip import Clip
from contextdb.motion.clips.feet import NO_MARKS, ContactMarks, held_feet_of
from contextdb.motion.clips.poses import Poses, forward_kinematics, local_poses, resampled
from contextdb.motion.clips.quaternions import Floats
from contextdb.motion.clips.skeleton import Skeleton
from contextdb.motion.features.schema import FeatureSchema
from contextdb.motion.markup.markup import Markup
from contextdb.motion.output.samples import Flags, Singles

FARTHEST_M = 1e6
ARRAYS = ("rotations", "positions", "root", "contacts")
"""What of a part grows with its frames."""


@dataclass(frozen=True, eq=False)
class Part:
    """One clip, as recorded or mirrored: rotations [F, J, 4] and positions [F, J, 3] of all joints, and the least and largest
    positions [J, 3]."""

    asset: str
    is_mirrored: bool
    is_looping: bool
    rig: Skeleton
    rotations: Singles
    positions: Singles
    root: Singles
    feet: tuple[str, ...]
    contacts: Flags
    least: Floats
    most: Floats
    numbers: tuple[int, ...] = ()
    """Where its arrays are on a pile."""

    @classmethod
    def of(cls, clip: Clip, schema: FeatureSchema, is_mirrored: bool, is_looping: bool, marks: ContactMarks) -> Part:
        with np.errstate(all="ignore"):  # numbers too large become infinite or NaN, and are refused below
            local = resampled(local_poses(clip), schema.rate)
            if is_mirrored:
                if not schema.mirror:
                    raise MotionError(mirrors.undeclared(clip.skeleton, schema.name))
                local = mirrors.mirrored(local, schema.mirror)
            poses = forward_kinematics(local)
        if not np.isfinite(poses.positions).all() or np.abs(poses.positions).max() > FARTHEST_M:
            raise MotionError(Fault("its numbers are too large to be a body.", f"joints within {FARTHEST_M:g} m of the origin"))
        path = schema.path_of(poses)
        root = np.column_stack((path.positions, path.headings)).astype(np.float32).astype(np.float64)
        rotations, positions = local.rotations, local.positions.copy()
        above = poses.skeleton.ancestors(poses.skeleton.hips)
        rotations[:, above], positions[:, above] = [1.0, 0.0, 0.0, 0.0], 0.0
        tops = tops_of(poses.skeleton)
        back = quaternions.about_axis("y", -root[:, 2])[:, None]
        ground = np.stack((root[:, 0], np.zeros(len(root)), root[:, 1]), axis=-1)[:, None]
        positions[:, tops] = quaternions.rotate(back, poses.positions[:, tops] - ground)
        rotations[:, tops] = quaternions.multiply(back, poses.rotations[:, tops])
        feet, contacts = _contacts(poses, schema, (marks[1], marks[0]) if is_mirrored else marks)
        turns, places, on_ground = (each.astype(np.float32) for each in (rotations, positions, root))
        least, most = positions.min(axis=0), positions.max(axis=0)
        return cls(clip.name, is_mirrored, is_looping, _rig(clip), turns, places, on_ground, feet, contacts, least, most)

    def on(self, pile: Pile) -> Part:
        """The part without its arrays, which are on a pile."""
        numbers = tuple(pile.put(getattr(self, name)) for name in ARRAYS)
        return replace(self, numbers=numbers, **{name: getattr(self, name)[:0].copy() for name in ARRAYS})


@dataclass(frozen=True, eq=False)
class ClipParts:
    """What a clip gives to a bank: its parts, or why it gives none; its rig and how many frames it has."""

    name: str
    rig: Skeleton
    n_frames: int
    parts: tuple[Part, ...]
    faults: tuple[Fault, ...] = ()


def parts_of(clip: Clip, schema: FeatureSchema, mirror: bool | Collection[str], markup: Markup | None) -> ClipParts:
    """What a clip gives to the bank of a schema. Raises ContextError for what is no clip."""
    require_kind(clip, Clip, "one of clips", "a Clip")
    parts: list[Part] = []
    faults: tuple[Fault, ...] = ()
    both = mirror if isinstance(mirror, bool) else clip.name in mirror
    loops = markup is not None and markup.is_looping(clip.name)
    marks = NO_MARKS if markup is None else markup.contacts_of(clip.name)
    try:
        if clip.n_frames:
            parts = [Part.of(clip, schema, side, loops, marks) for side in ((False, True) if both else (False,))]
    except MotionError as error:
        faults = error.faults
    return ClipParts(clip.name, clip.skeleton, clip.n_frames, tuple(parts), faults)


def tops_of(skeleton: Skeleton) -> list[int]:
    """The joints that hang on the root: the first, or those below the joints above the hips."""
    above = {-1, *skeleton.ancestors(skeleton.hips)}
    return [joint for joint, parent in enumerate(skeleton.parents.tolist()) if parent in above and joint not in above]


def _rig(clip: Clip) -> Skeleton:
    """The clip's skeleton in metres, the joints above its hips at the root."""
    offsets = clip.skeleton.offsets * clip.metres_per_unit
    offsets[[0, *clip.skeleton.ancestors(clip.skeleton.hips)]] = 0.0
    ends = tuple(
        (joint, (x * clip.metres_per_unit, y * clip.metres_per_unit, z * clip.metres_per_unit))
        for joint, (x, y, z) in clip.skeleton.end_sites
    )
    return replace(clip.skeleton, offsets=offsets, end_sites=ends)


def _contacts(poses: Poses, schema: FeatureSchema, marks: ContactMarks) -> tuple[tuple[str, ...], Flags]:
    """The feet, and in which frames each is down."""
    try:
        falls = held_feet_of(poses, schema.foot_bones(), marks)
    except MotionError:
        return (), np.zeros((poses.n_frames, 0), np.bool_)
    feet = falls.feet
    frames = np.arange(poses.n_frames) / poses.rate
    down = [[(a - 1e-9 <= frames) & (frames <= b + 1e-9) for a, b in falls.down[foot].tolist()] for foot in feet]
    none = np.zeros(poses.n_frames, np.bool_)
    return feet, np.column_stack([np.logical_or.reduce([none, *each]) for each in down])
