"""Measures of how a body stands: feet by their sources, knees, hips over the feet, lean and dips; and the worst seconds.

Each gives measures by name, as in `parts`; a text in place of one says why there is none. What a moment shows is compared with its
source: the nearest frame of the clip that plays. T moments, K feet.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from contextdb.motion.clips.quaternions import Floats
from contextdb.motion.clips.skeleton import Ints
from contextdb.motion.clips.trajectory import to_own_frame
from contextdb.motion.measuring import formulas
from contextdb.motion.measuring.displayed import Displayed
from contextdb.motion.measuring.parts import (
    NEVER_PLANTED,
    NO_BANKS,
    NO_BODY,
    NO_FEET,
    NO_POSES,
    NO_REST,
    TOO_SHORT,
    moving,
    target_of,
)
from contextdb.motion.measuring.raw_clips import Clips, RawClips
from contextdb.motion.output.legs import legs_of
from contextdb.motion.output.pipeline import spine_of

AFTER_S = 2.0
"""So long after a stop a character stands."""
SECOND_S = 1.0
STRAIGHT_DEG = 178.0
"""A knee that is straighter is at its limit."""
FEET = ("skate_toe_cm_s", "skate_toe_worst_cm_s", "skate_worst_cm_s", "penetration_cm", "knee_limit_share", "hip_dip_cm")
RAW = ("skate_toe_raw_cm_s", "penetration_raw_cm", "knee_limit_raw_share")
REST = ("hips_off_feet_cm", "lean_deg", "lean_raw_deg")


@dataclass(frozen=True, eq=False)
class Body:
    """The joints of a stance: hips, the top of the spine, and of each leg hip, knee, ankle and what stands [K, 4]."""

    hips: int
    top: int
    legs: Ints

    @classmethod
    def of(cls, clips: RawClips) -> Body | None:
        """Of a bank; None where a foot has no leg, or no spine is above the hips."""
        legs, spine = legs_of(clips.bank.skeleton, clips.bank.feet), spine_of(clips.bank)
        if spine is None or (legs < 0).any():
            return None
        return cls(clips.bank.skeleton.hips, int(spine.joints[-1]), legs)

    def knees_deg(self, positions: Floats) -> Floats:
        """The angles of the knees [T, K], 180 where they are straight."""
        hip, knee, ankle = (positions[:, self.legs[:, i]] for i in range(3))
        thigh, shin = hip - knee, ankle - knee
        size = np.linalg.norm(thigh, axis=-1) * np.linalg.norm(shin, axis=-1)
        return np.asarray(np.rad2deg(np.arccos(np.clip((thigh * shin).sum(axis=-1) / np.maximum(size, 1e-12), -1.0, 1.0))))

    def over_feet(self, positions: Floats) -> Floats:
        """Where hips are over the ground, from the middle of ankles and toes: x and z [T, 2]."""
        middle = positions[:, self.legs[:, 2:].ravel()].mean(axis=1)
        return np.asarray((positions[:, self.hips] - middle)[:, [0, 2]])

    def leans_deg(self, positions: Floats) -> Floats:
        """The angle between the way from hips to the top of the spine and the vertical [T]."""
        way = positions[:, self.top] - positions[:, self.hips]
        return np.asarray(np.rad2deg(np.arctan2(np.linalg.norm(way[:, [0, 2]], axis=-1), way[:, 1])))


def postures(it: Displayed, clips: Clips | None, wanted: Floats | None) -> dict[str, object]:
    """All measures of this module."""
    if clips is None:
        return dict.fromkeys((*FEET, *RAW, *REST, "accel_worst"), NO_BANKS if it.positions is not None else NO_POSES)
    values = _raw(clips)
    at = moving(it)
    sources = [i for i in at.tolist() if it.sources is not None and it.sources[i] is not None]
    if it.positions is None or it.feet is None or it.sources is None or len(at) < 2 or not sources:
        why = NO_POSES if it.positions is None else NO_FEET if it.feet is None else TOO_SHORT
        return {**values, **dict.fromkeys((*FEET, *REST, "accel_worst"), why)}
    values.update(_worst_seconds(it, at))
    return {**values, **_shapes(it, sources), **_rest(it, at, wanted)}


def _raw(clips: Clips) -> dict[str, object]:
    """The measures of the clips themselves."""
    parts = [part for raw in clips.distinct if len(raw.bank.feet) for part in raw.toe_slides]
    if not parts:
        return dict.fromkeys(RAW, NO_FEET)
    skate = formulas.Slides.joined(parts).skate_mps()
    deepest = max(float((floor - feet[..., 1].min(axis=0)).max()) for raw in clips.distinct for feet, floor in raw.paths)
    bodies = [(raw, body) for raw in clips.distinct if (body := Body.of(raw)) is not None]
    straight = [body.knees_deg(raw.positions).max(axis=1) > STRAIGHT_DEG for raw, body in bodies]
    return {
        "skate_toe_raw_cm_s": NEVER_PLANTED if skate is None else 100.0 * skate,
        "penetration_raw_cm": 100.0 * max(deepest, 0.0),
        "knee_limit_raw_share": float(np.concatenate(straight).mean()) if straight else NO_FEET,
    }


def _worst_seconds(it: Displayed, at: Ints) -> dict[str, object]:
    """Skate while the source's toe is down, and the worst second of it, of planted feet and of accelerations."""
    assert it.positions is not None
    assert it.feet is not None
    assert it.sources is not None
    places, times_s = it.positions[at][:, it.feet], it.times_s[at]
    none = np.zeros(len(it.feet), np.bool_)
    down = np.array([none if (source := it.sources[i]) is None else source[0].toes_down[source[1]] for i in at.tolist()])
    floor = formulas.floor_of(places)
    toes = formulas.Slides.of(places, times_s, down, floor)
    skate = toes.skate_mps()
    values: dict[str, object] = {
        "skate_toe_cm_s": NEVER_PLANTED if skate is None else 100.0 * skate,
        "skate_toe_worst_cm_s": NEVER_PLANTED if skate is None else 100.0 * _worst_slide(toes),
        "skate_worst_cm_s": NEVER_PLANTED,
    }
    if it.contacts is not None:
        planted = formulas.Slides.of(places, times_s, formulas.standing(it.contacts[at], places, times_s), floor)
        values["skate_worst_cm_s"] = 100.0 * _worst_slide(planted) if planted.planted.any() else NEVER_PLANTED
    step = formulas.step_of(times_s)
    accelerations = formulas.accelerations(it.positions[at], times_s, step)
    width = max(1, round(SECOND_S / float(np.median(np.diff(times_s)))))
    worst = [np.quantile(accelerations[i : i + width], 0.99) for i in range(0, max(1, len(accelerations) - width + 1), width)]
    return {**values, "accel_worst": float(np.max(worst)) if len(accelerations) else TOO_SHORT}


def _worst_slide(slides: formulas.Slides) -> float:
    """The mean speed of planted feet in the second in which it is highest; they count as planted for half a second at least."""
    width = max(1, round(SECOND_S / float(np.median(slides.seconds))))
    ways = (slides.speeds * slides.seconds[:, None] * slides.planted).sum(axis=1)
    times = (slides.seconds[:, None] * slides.planted).sum(axis=1)
    way_sums, time_sums = (np.convolve(each, np.ones(min(width, len(each))), "valid") for each in (ways, times))
    return float((way_sums / np.maximum(time_sums, SECOND_S / 2.0)).max())


def _shapes(it: Displayed, sources: list[int]) -> dict[str, object]:
    """How deep toes are in the ground, how long knees are at their limit, and how much lower than in the source the hips."""
    assert it.positions is not None
    assert it.feet is not None
    assert it.sources is not None
    deepest, dip = 0.0, 0.0
    for i in sources:
        source = it.sources[i]
        assert source is not None, "only those with a source are looked at"
        clips, frame = source
        deepest = max(deepest, float((clips.floors[frame] - it.positions[i, it.feet, 1]).max()))
        hips = clips.bank.skeleton.hips
        dip = max(dip, float(clips.in_body[frame, hips, 1] - it.positions[i, hips, 1]))
    first = it.sources[sources[0]]
    body = None if first is None else Body.of(first[0])
    straight: object = NO_FEET if body is None else float((body.knees_deg(it.positions).max(axis=1) > STRAIGHT_DEG).mean())
    return {"penetration_cm": 100.0 * deepest, "hip_dip_cm": 100.0 * dip, "knee_limit_share": straight}


def _rest(it: Displayed, at: Ints, wanted: Floats | None) -> dict[str, object]:
    """From two seconds after each stop on, the most that hips are from where their clips have them over the feet, on the mean of a
    second, as they swing over feet that step on the spot; and that the spine leans."""
    assert it.positions is not None
    assert it.roots is not None
    assert it.sources is not None
    target = target_of(it, wanted, at)
    if target is None:
        return dict.fromkeys(REST, NO_BODY)
    stood = _standing(target, it.times_s[at])
    pairs = [(i, source) for i in at[stood].tolist() if (source := it.sources[i]) is not None]
    body = Body.of(pairs[0][1][0]) if pairs else None
    if body is None:
        return dict.fromkeys(REST, NO_FEET if pairs else NO_REST)
    moments = [i for i, _ in pairs]
    displayed, raw = it.positions[moments], np.stack([clips.in_body[frame] for _, (clips, frame) in pairs])
    own = to_own_frame(body.over_feet(displayed), it.roots[moments, 2])
    off = _most_off(own - body.over_feet(raw), it.times_s[moments])
    figures = 100.0 * off, body.leans_deg(displayed).max(), body.leans_deg(raw).max()
    return {name: float(value) for name, value in zip(REST, figures, strict=True)}


def _most_off(offsets: Floats, times_s: Floats) -> float:
    """The longest mean of offsets [T, 2] over a second of moments that follow each other, or over all of a shorter run."""
    step = float(np.median(np.diff(times_s))) if len(times_s) > 1 else SECOND_S
    runs = np.split(offsets, np.flatnonzero(np.diff(times_s) > 1.5 * step) + 1)
    sums = [np.cumsum(np.vstack([np.zeros(2), run]), axis=0) for run in runs]
    widths = [min(max(1, round(SECOND_S / step)), len(run)) for run in runs]
    means = [(total[n:] - total[:-n]) / n for total, n in zip(sums, widths, strict=True)]
    return float(np.linalg.norm(np.concatenate(means), axis=-1).max())


def _standing(target: Floats, times_s: Floats) -> NDArray[np.bool_]:
    """The moments two seconds and more after each stop of a wanted velocity [T, 2], until it is another."""
    stood = np.zeros(len(times_s), np.bool_)
    for change in formulas.changes_of(target, times_s):
        if change.kind == "stop":
            stood[change.at : change.until] |= times_s[change.at : change.until] >= times_s[change.at] + AFTER_S
    return stood
