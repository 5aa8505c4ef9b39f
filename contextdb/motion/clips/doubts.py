"""Clips that read well and mean nonsense: another unit, another axis, a jump in the data. Data in, findings out.

    measure(clip) ─► Measures, a few numbers ─► doubts(measures of all clips) ─► ClipFinding

A finding is a doubt, never a refusal: a giant may be 4 m tall. What no body can be (no frame, a second and more between two frames)
is refused where clips are read and built. Lengths are in metres, y up, as the settings have the clip's unit and axis.
"""

from __future__ import annotations

import math
from collections import Counter, defaultdict
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from typing import Any

import numpy as np

from contextdb.cells.arguments import require_many_of
from contextdb.errors import plural
from contextdb.motion.clips.bone_names import cores_of
from contextdb.motion.clips.clip import Clip
from contextdb.motion.clips.clip_measures import UNITS, USUAL_BODY_M, Measures, measure
from contextdb.motion.clips.trajectory import FASTEST_MPS

LEAST_BODY_M, MOST_BODY_M = 0.3, 3.0
LEAST_RATE, MOST_RATE = 10.0, 240.0
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
LYING_SHARE = 0.5
"""Of a clip's poses."""
OTHER_SHAPE = 0.12
"""Bones of another body: half the sum of the differences of all bones' shares of the length. Adults differ by 0.02 to 0.06."""
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
        return asdict(self)


def doubts(clips: Iterable[tuple[str, str | None, Measures]]) -> list[ClipFinding]:
    """What is doubtful about all clips of one database, (asset, file, Measures) each, in their order: the shape of a body is
    compared with that of the others. Of a clip whose unit is doubtful nothing else is reported that is a length."""
    listed = [(asset, file, replace(measures, bones=_by_core(measures.bones or {}))) for asset, file, measures in clips]
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
    difference = _difference(of.bones or {}, usual or {})
    if difference > OTHER_SHAPE:
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


# ---- the bodies of the other clips


def _by_core(bones: Mapping[str, float]) -> dict[str, float]:
    """Bones by their side and core, so that rigs with other namespaces and spellings are compared; by their name where that is the
    same for two."""
    cores = cores_of(list(bones))
    counts = Counter(cores)
    return {
        " ".join(core) if counts[core] == 1 else name: length for core, (name, length) in zip(cores, bones.items(), strict=True)
    }


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


def _difference(bones: Mapping[str, float], usual: Shape) -> float:
    """Half the sum of the differences of the shares of all bones: 0 for the same shape, and for a rig that has few of the bones."""
    shape = _shape(bones, usual)
    if 2 * len(shape) < len(usual):
        return 0.0
    return 0.5 * math.fsum(abs(shape.get(bone, 0.0) - share) for bone, share in usual.items())
