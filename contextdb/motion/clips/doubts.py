"""Clips that read well and mean nonsense: another unit, another axis, a jump in the data. Data in, findings out.

    measure(clip) ─► Measures, a few numbers ─► doubts(measures of all clips) ─► ClipFinding

A finding is a doubt, never a refusal: a giant may be 4 m tall. What no body can be (no frame, a second and more between two frames)
is refused where clips are read and built. Lengths are in metres, y up, as the settings have the clip's unit and axis.
"""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from contextdb.cells.arguments import require_many_of
from contextdb.errors import MotionError, plural
from contextdb.motion.clips import quaternions
from contextdb.motion.clips.clip import Clip
from contextdb.motion.clips.feet import footfalls_of
from contextdb.motion.clips.on_the_spot import ground_motion
from contextdb.motion.clips.poses import LocalPoses, forward_kinematics, local_poses, poses_of
from contextdb.motion.clips.quaternions import Floats
from contextdb.motion.clips.skeleton import Skeleton
from contextdb.motion.clips.trajectory import FASTEST_MPS

LEAST_BODY_M, MOST_BODY_M = 0.3, 3.0
USUAL_BODY_M = 1.7
LEAST_USUAL_M, MOST_USUAL_M = 0.9, 2.6
"""How tall a body is, in a unit that may be right."""
LEAST_RATE, MOST_RATE = 10.0, 240.0
FARTHEST_M = 1e9
FEWEST_FRAMES = 3
"""Two frames give one velocity, one frame none."""
FAR_FROM_GROUND = 0.25
"""Of the body's size: so far above or below the ground no foot stands."""
UNDER_GROUND = 0.01
"""Of the body's size: a joint that is deeper than this in every pose is under the floor. Joints lie above their soles."""
OTHER_SIZE = 1.5
"""A body so many times as large as those of the other clips, or so many times smaller, is in another unit. Adults differ by 1.3."""
FEWEST_TO_COMPARE = 3
"""Of two bodies nobody knows which is the odd one."""
LONGEST_FLIGHT_S = 2.0
"""No jump takes longer."""
LYING = 0.65
"""A body whose extent upwards is less than this part of its largest lies."""
LYING_SHARE = 0.5
"""Of a clip's poses."""
OTHER_SHAPE = 0.12
"""Bones of another body: half the sum of the differences of all bones' shares of the length. Adults differ by 0.02 to 0.06."""
MOST_POSES = 64
"""So many poses of a clip are looked at for size, ground and axis."""
UNITS = {1.0: "metres", 0.01: "centimetres", 0.001: "millimetres", 0.0254: "inches", 0.3048: "feet", 0.056444: "units of CMU"}
AXES = ("x", "y", "z")


@dataclass(frozen=True, slots=True)
class ClipFinding:
    """A doubt about a clip: which rule, where, what was measured, what is expected, and the likely mend."""

    rule: str
    asset: str
    found: str
    expected: str
    mend: str = ""
    measure: float | None = None
    """The number that the doubt is about, in the unit that `found` names."""
    frame: int | None = None
    """The frame of the clip, from 0, where it is about one."""
    file: str | None = None

    @property
    def message(self) -> str:
        """The finding without its file, on one line."""
        return f"{self.found} Expected: {self.expected}.{f' Try {self.mend}.' if self.mend else ''}"

    def __str__(self) -> str:
        return f"{self.file or self.asset}: {self.message}"

    def to_json(self) -> dict[str, Any]:
        """The finding as plain data, every field in it."""
        return asdict(self)


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
    size = measure(clip).size_m
    if not 0.0 < size < math.inf:
        return None
    unit = min(UNITS, key=lambda unit: abs(math.log(size * unit / clip.metres_per_unit / USUAL_BODY_M)))
    units = (each for each in (clip.metres_per_unit, unit) if LEAST_USUAL_M <= size * each / clip.metres_per_unit <= MOST_USUAL_M)
    return next(units, None)


def doubts(clips: Iterable[tuple[str, str | None, Measures]]) -> list[ClipFinding]:
    """What is doubtful about all clips of one database, (asset, file, Measures) each, in their order: the shape of a body is
    compared with that of the others. Of a clip whose unit is doubtful nothing else is reported that is a length."""
    listed = list(clips)
    usual = _usual_shape([measures for _, _, measures in listed])
    lengths = _usual_lengths([measures.bones for _, _, measures in listed if measures.bones], usual or {})
    return [
        ClipFinding(rule, asset, **doubt, file=file)
        for asset, file, measures in listed
        for rule, doubt in _rules(measures, usual, _times(measures.bones or {}, lengths))
    ]


def doubts_of(clips: Iterable[Clip]) -> list[ClipFinding]:
    """What is doubtful about some clips of one kind: `doubts` of their measures. Raises ContextError for what are no clips."""
    return doubts((clip.name, None, measure(clip)) for clip in require_many_of(clips, Clip, "clips", "a list of Clip"))


def grouped(findings: Iterable[ClipFinding], n_clips: int) -> Iterator[str]:
    """The findings as sentences; of many clips that break a rule for one mend the first, with how many others there are."""
    groups: dict[tuple[str, str], list[ClipFinding]] = defaultdict(list)
    for finding in findings:
        groups[finding.rule, finding.mend].append(finding)
    for group in groups.values():
        others = len(group) - 1
        more = f" ({others:,} of the {plural(n_clips - 1, 'other clip')} likewise.)" if others else ""
        yield f"{group[0]}{more}"


# ---- the rules


Doubt = dict[str, Any]
"""The fields of a finding next to its rule, asset and file."""
Shape = Mapping[str, float]
"""For each bone its share of the length of all."""


def _rules(of: Measures, usual: Shape | None, times: float) -> Iterator[tuple[str, Doubt]]:
    """What is doubted of a clip whose bones are so many times as long as those of the others."""
    if of.n_frames < FEWEST_FRAMES:
        yield "few-frames", _few_frames(of)
    rate = 1.0 / of.frame_time_s
    if not LEAST_RATE <= round(rate, 2) <= MOST_RATE and of.n_frames > 1:
        yield "odd-rate", _odd_rate(of, rate)
    if of.n_unmoved:
        yield "zero-poses", _zero_poses(of)
    if of.size_m == 0.0 or not math.isfinite(of.size_m):
        return
    if not LEAST_BODY_M <= of.size_m <= MOST_BODY_M:
        yield "odd-size", _odd_size(of)
        return
    if not 1.0 / OTHER_SIZE <= times <= OTHER_SIZE:
        yield "odd-size", _other_size(of, times)
        return
    if of.fastest_mps > FASTEST_MPS:
        yield "jump", _jump(of)
    if of.lying >= LYING_SHARE:
        yield "lying", _lying(of)
    elif abs(of.lowest) > FAR_FROM_GROUND * of.size_m and of.n_unmoved < of.n_frames:
        yield "off-ground", _off_ground(of)
    elif of.raised < -UNDER_GROUND * of.size_m:
        yield "off-ground", _under_ground(of)
    if of.never_down and of.lying < LYING_SHARE and not of.on_the_spot_mps:
        yield "no-footfalls", _no_footfalls(of)
    if of.on_the_spot_mps:
        yield "on-the-spot", _on_the_spot(of)
    difference = None if usual is None else _difference(_shape(of.bones or {}, usual), usual)
    if difference is not None and difference > OTHER_SHAPE:
        problem = f"{100.0 * difference:.0f} % of the body's length is distributed differently from the other clips."
        mend = 'rig = "a clip of the usual body" in [databases.NAME], which puts the others on it, or metres_per_unit'
        yield (
            "odd-proportions",
            {"found": problem, "expected": f"at most {100 * OTHER_SHAPE:g} %", "mend": mend, "measure": difference},
        )


def _few_frames(of: Measures) -> Doubt:
    none = "so nothing moves and every velocity is 0" if of.n_frames == 1 else "so there is one velocity"
    problem = f"the clip has {plural(of.n_frames, 'frame')}, {none}."
    return {
        "found": problem,
        "expected": f"at least {FEWEST_FRAMES} frames",
        "mend": "to export the whole take, or leave the clip if a still pose is intended",
        "measure": float(of.n_frames),
    }


def _odd_rate(of: Measures, rate: float) -> Doubt:
    problem = f"the clip has {rate:.3g} frames a second (Frame Time: {of.frame_time_s:g})."
    meant = next(
        (
            t
            for t in (of.frame_time_s / 10, of.frame_time_s * 10, of.frame_time_s / 100, of.frame_time_s * 1000)
            if 24.0 <= 1.0 / t <= 120.0
        ),
        None,
    )
    return {
        "found": problem,
        "expected": f"{LEAST_RATE:g} to {MOST_RATE:g}",
        "mend": f"Frame Time: {meant:.6g}" if meant else "to export it again at 30 or 60 frames a second",
        "measure": rate,
    }


def _zero_poses(of: Measures) -> Doubt:
    if of.n_unmoved == of.n_frames:
        problem = f"every value of all {plural(of.n_frames, 'frame')} is 0: the body stands in its rest pose at the origin."
    else:
        problem = f"{plural(of.n_unmoved, 'frame')} of {of.n_frames:,} hold zeros only, first frame {of.unmoved_frame}."
    return {
        "found": problem,
        "expected": "frames with rotations",
        "mend": "to export the clip again without these frames",
        "measure": float(of.n_unmoved),
        "frame": of.unmoved_frame,
    }


def _odd_size(of: Measures) -> Doubt:
    unit = min(UNITS, key=lambda unit: abs(math.log(of.size_m / of.metres_per_unit * unit / USUAL_BODY_M)))
    size = of.size_m / of.metres_per_unit * unit
    fits = LEAST_BODY_M <= size <= MOST_BODY_M
    return {
        "found": f"the body is {_metres(of.size_m)} long, as one unit of the file is taken to be {of.metres_per_unit:g} m.",
        "expected": f"{LEAST_BODY_M:g} to {MOST_BODY_M:g} m",
        "mend": f"metres_per_unit = {unit:g} ({UNITS[unit]})" if fits else "",
        "measure": of.size_m,
    }


def _other_size(of: Measures, times: float) -> Doubt:
    unit = min(UNITS, key=lambda unit: abs(math.log(unit / of.metres_per_unit * times)))
    fits = 1.0 / OTHER_SIZE <= unit / of.metres_per_unit * times <= OTHER_SIZE and not math.isclose(unit, of.metres_per_unit)
    return {
        "found": f"the bones are {times:.2g} times as long as those of the other clips, as one unit of the file is taken to be "
        f"{of.metres_per_unit:g} m.",
        "expected": f"{1.0 / OTHER_SIZE:.2g} to {OTHER_SIZE:g} times",
        "mend": f"metres_per_unit = {unit:g} ({UNITS[unit]}) in a database of its own" if fits else "a database of its own, or rig",
        "measure": times,
    }


def _jump(of: Measures) -> Doubt:
    where = f"from frame {of.fastest_frame} to {of.fastest_frame + 1}"
    return {
        "found": f"the hips move {_metres(of.farthest_m)} {where}, which is {of.fastest_mps:,.0f} m/s.",
        "expected": f"at most {FASTEST_MPS:g} m/s",
        "mend": "to cut the clip there, or correct the frames",
        "measure": of.fastest_mps,
        "frame": of.fastest_frame,
    }


def _lying(of: Measures) -> Doubt:
    longest = max(range(3), key=lambda axis: of.extents[axis])
    # The settings turn "z" up into y up, so that the file's y lies along -z, and "x" up so that the file's y lies along x.
    axis = {"y": AXES[longest], "z": {0: "x", 2: "y"}.get(longest, "z"), "x": {0: "y", 2: "z"}.get(longest, "x")}[of.up]
    return {
        "found": f"the body lies: it reaches {_metres(of.extents[1])} upwards and {_metres(of.size_m)} along the ground.",
        "expected": f"a body that stands, as the file's {of.up} axis is taken to point up",
        "mend": f'up = "{axis}", or nothing if the body should lie',
        "measure": of.extents[1],
    }


def _on_the_spot(of: Measures) -> Doubt:
    return {
        "found": f"the hips stay, and the standing feet are those of {of.on_the_spot_mps:.2f} m/s: the clip runs on the spot.",
        "expected": "a clip whose root moves along",
        "mend": 'root = "feet" in [databases.NAME]',
        "measure": of.on_the_spot_mps,
    }


def _off_ground(of: Measures) -> Doubt:
    side = "above" if of.lowest > 0.0 else "below"
    what = "no joint comes nearer to it" if of.lowest > 0.0 else "a joint is so far below it"
    return {
        "found": f"the lowest joint is {_metres(abs(of.lowest))} {side} the ground (0 upwards): {what}.",
        "expected": f"a foot within {_metres(FAR_FROM_GROUND * of.size_m)} of the ground in some frame",
        "mend": "to export the clip with its floor at 0, or nothing where the body flies, climbs or dives",
        "measure": of.lowest,
    }


def _under_ground(of: Measures) -> Doubt:
    return {
        "found": f"a joint is {_metres(-of.raised)} or more below the ground (0 upwards) in every pose: the body is in the floor.",
        "expected": "a foot that stands on the ground in some frame",
        "mend": "to export the clip with its floor at 0, or nothing where the body dives or climbs below it",
        "measure": of.raised,
    }


def _no_footfalls(of: Measures) -> Doubt:
    problem = f"neither foot is ever on the ground, in {of.n_frames * of.frame_time_s:.3g} s."
    return {
        "found": problem,
        "expected": "a foot that rests on the ground now and then",
        "mend": "[features.NAME] feet, or marks Contact.Left and Contact.Right, or nothing where the body flies or slides",
        "measure": 0.0,
    }


def _metres(length_m: float) -> str:
    """A length for people: three digits, and never 0 where it is none."""
    return f"{length_m:,.0f} m" if length_m >= 100.0 else f"{length_m:.3g} m"


# ---- measures


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


def _shape(bones: Mapping[str, float], of: Mapping[str, float]) -> Shape:
    """The share of each bone in the length of those that are looked at."""
    total = math.fsum(length for bone, length in bones.items() if bone in of)
    return {bone: length / total for bone, length in bones.items() if bone in of} if total else {}


def _usual_shape(all_measures: Sequence[Measures]) -> Shape | None:
    """The median share of each bone that most clips have; None for fewer than two clips."""
    having = [measures.bones for measures in all_measures if measures.bones]
    if len(having) < 2:
        return None
    names = [bone for bone in having[0] if sum(bone in bones for bones in having) > len(having) / 2]
    shares = [_shape(bones, dict.fromkeys(names, 0.0)) for bones in having]
    median = {bone: float(np.median([share[bone] for share in shares if bone in share])) for bone in names}
    total = math.fsum(median.values())
    return {bone: share / total for bone, share in median.items()} if total else None


def _usual_lengths(all_bones: Sequence[Mapping[str, float]], names: Iterable[str]) -> dict[str, float]:
    """The median length of each bone of these names; empty for fewer clips than are compared."""
    having = {name: [bones[name] for bones in all_bones if name in bones] for name in names}
    return {name: float(np.median(those)) for name, those in having.items()} if len(all_bones) >= FEWEST_TO_COMPARE else {}


def _times(bones: Mapping[str, float], usual: Mapping[str, float]) -> float:
    """How many times as long as usual the middle bone of a body is: long arms alone make it no larger. 1 where none is known."""
    ratios = [bones[bone] / length for bone, length in usual.items() if length and bone in bones]
    return float(np.median(ratios)) if ratios else 1.0


def _difference(shape: Shape, usual: Shape) -> float:
    """Half the sum of the differences of all bones: 0 for the same shape, 1 where nothing is shared."""
    return 0.5 * math.fsum(abs(shape.get(bone, 0.0) - share) for bone, share in usual.items())
