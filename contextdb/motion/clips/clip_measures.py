"""What is measured of a clip before it is believed: how tall the body is, how it stands, how fast its hips go. A few numbers.

`doubts` compares them with those of other clips and with what bodies can be. Lengths are in metres, y up, as the settings have the
clip's unit and axis.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from contextdb.errors import MotionError
from contextdb.motion.clips import quaternions
from contextdb.motion.clips.clip import Clip
from contextdb.motion.clips.feet import footfalls_of
from contextdb.motion.clips.on_the_spot import ground_motion
from contextdb.motion.clips.poses import LocalPoses, forward_kinematics, local_poses, poses_of
from contextdb.motion.clips.quaternions import Floats
from contextdb.motion.clips.skeleton import Skeleton

USUAL_BODY_M = 1.7
LEAST_USUAL_M, MOST_USUAL_M = 0.9, 2.6
"""How tall a body is, in a unit that may be right."""
FARTHEST_M = 1e9
LONGEST_FLIGHT_S = 2.0
"""No jump takes longer."""
LYING = 0.65
"""A body whose extent upwards is less than this part of its largest lies."""
MOST_POSES = 64
"""So many poses of a clip are looked at for size, ground and axis."""
UNITS = {1.0: "metres", 0.01: "centimetres", 0.001: "millimetres", 0.0254: "inches", 0.3048: "feet", 0.056444: "units of CMU"}


@dataclass(frozen=True, slots=True)
class Measures:
    """What is doubted of a clip, in a few numbers.

    Attributes
    ----------
    n_frames : int
    frame_time_s, metres_per_unit : float
    up : str
    extents : tuple of 3 floats
        The median over poses of how far the joints reach along x, y (upwards) and z, in metres.
    lying : float
        The share of poses that reach less far upwards than `LYING` of their largest extent.
    lowest : float
        The height of the lowest joint of all poses, in metres.
    raised : float
        The same of the pose in which the lowest joint is highest.
    fastest_mps, fastest_frame : float, int
        The largest speed of the hips between two frames, and the earlier of the two.
    farthest_m : float
        How far the hips move between these.
    n_unmoved, unmoved_frame : int, int
        How many frames hold zeros only, and the first of these.
    never_down : bool
        Whether no foot is ever down, in a clip of more than `LONGEST_FLIGHT_S`.
    on_the_spot_mps : float
        How fast the body would go of which the feet stand, where the hips stay and the ground goes by; else 0.
    bones : mapping of str to float
        The median distance of each joint below the hips from its parent, in metres, where there is one.
    """

    n_frames: int
    frame_time_s: float
    metres_per_unit: float
    up: str
    extents: tuple[float, float, float] = (0.0, 0.0, 0.0)
    lying: float = 0.0
    lowest: float = 0.0
    raised: float = 0.0
    fastest_mps: float = 0.0
    fastest_frame: int = 0
    farthest_m: float = 0.0
    n_unmoved: int = 0
    unmoved_frame: int = 0
    never_down: bool = False
    on_the_spot_mps: float = 0.0
    bones: Mapping[str, float] | None = None

    @property
    def size_m(self) -> float:
        """The body's largest extent."""
        return max(self.extents)

    def to_json(self) -> dict[str, Any]:
        """As plain data; `Measures.of_json` reads it."""
        return asdict(self)

    @classmethod
    def of_json(cls, document: Mapping[str, Any]) -> Measures:
        return cls(**{**document, "extents": tuple(document["extents"])})


def measure(clip: Clip) -> Measures:
    """What is doubted of a clip; of one without frames, next to nothing."""
    plain = Measures(clip.n_frames, clip.frame_time_s, clip.metres_per_unit, clip.up)
    if clip.n_frames == 0:
        return plain
    with np.errstate(all="ignore"):  # numbers too large are refused where features are computed
        joints = _body(clip.skeleton)
        local = _some_poses(clip)
        body = forward_kinematics(local).positions[:, joints]
        lengths = np.median(np.linalg.norm(local.positions[:, joints[1:]], axis=-1), axis=0).tolist()
        reach, lows = np.ptp(body, axis=1), body[:, :, 1].min(axis=1)
        hips = _hips(clip)
        steps = np.linalg.norm(np.diff(hips, axis=0), axis=1)
        ground = ground_motion(clip) if np.isfinite(hips).all() and np.abs(hips).max() < FARTHEST_M else None
    fastest = int(np.argmax(steps)) if len(steps) else 0
    zeros = np.flatnonzero(~clip.values.any(axis=1)) if clip.values.shape[1] else np.zeros(0, np.int64)
    x, y, z = np.median(reach, axis=0).tolist()
    step = float(steps[fastest]) if len(steps) else 0.0
    return Measures(
        clip.n_frames,
        clip.frame_time_s,
        clip.metres_per_unit,
        clip.up,
        extents=(x, y, z),
        lying=float((reach[:, 1] < LYING * reach.max(axis=1)).mean()),
        lowest=float(lows.min()),
        raised=float(lows.max()),
        fastest_mps=step / clip.frame_time_s,
        fastest_frame=fastest,
        farthest_m=step,
        n_unmoved=len(zeros),
        unmoved_frame=int(zeros[0]) if len(zeros) else 0,
        never_down=_is_never_down(clip),
        on_the_spot_mps=0.0 if ground is None else ground.speed_mps,
        bones={clip.skeleton.names[joint]: length for joint, length in zip(joints[1:], lengths, strict=True) if length > 0.0},
    )


def unit_by_size(clip: Clip) -> float | None:
    """The unit in which a clip's body is of a usual size: its own if it is, else the nearest; None where there is none."""
    return unit_of(measure(clip))


def unit_of(measures: Measures) -> float | None:
    """The same of what is measured of a clip."""
    size, own = measures.size_m, measures.metres_per_unit
    if not 0.0 < size < math.inf:
        return None
    unit = min(UNITS, key=lambda unit: abs(math.log(size * unit / own / USUAL_BODY_M)))
    return next((each for each in (own, unit) if LEAST_USUAL_M <= size * each / own <= MOST_USUAL_M), None)


def _is_never_down(clip: Clip) -> bool:
    """Whether a clip is long, has feet, and none of them ever rests."""
    if clip.duration_s < LONGEST_FLIGHT_S:
        return False
    try:
        falls = footfalls_of(poses_of(clip))
    except MotionError:
        return False
    return not any(len(falls.down[foot]) for foot in falls.feet)


def _body(skeleton: Skeleton) -> list[int]:
    """The hips and all below: a root above them marks a place on the ground, and is no part of the body."""
    joints = {skeleton.hips}
    for joint, parent in enumerate(skeleton.parents.tolist()):
        if parent in joints:
            joints.add(joint)
    return sorted(joints)


def _some_poses(clip: Clip) -> LocalPoses:
    """Poses spread evenly over a clip."""
    frames = np.unique(np.linspace(0, clip.n_frames - 1, min(clip.n_frames, MOST_POSES)).round().astype(np.int64))
    few = Clip(clip.name, clip.skeleton, clip.frame_time_s, clip.values[frames], clip.metres_per_unit, clip.up)
    return local_poses(few)


def _hips(clip: Clip) -> Floats:
    """Where the hips are in each frame: float64 [F, 3], from the joints above them alone."""
    local, joint = local_poses(clip), clip.skeleton.hips
    chain = [joint]
    while clip.skeleton.parents[chain[-1]] >= 0:
        chain.append(int(clip.skeleton.parents[chain[-1]]))
    position, rotation = local.positions[:, chain[-1]], local.rotations[:, chain[-1]]
    for below in reversed(chain[:-1]):
        position = position + quaternions.rotate(rotation, local.positions[:, below])
        rotation = quaternions.multiply(rotation, local.rotations[:, below])
    return position
