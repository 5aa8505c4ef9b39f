"""The parts of `motion.measure`: each gives measures by name; a text in place of one says why there is none."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np

from contextdb.motion.clips.quaternions import Floats
from contextdb.motion.clips.skeleton import Ints
from contextdb.motion.measuring import formulas
from contextdb.motion.measuring.displayed import Displayed
from contextdb.motion.measuring.raw_clips import Banks, Clips
from contextdb.motion.measuring.usage import HasRanges, frames_used, permutations_in, usable
from contextdb.motion.output.bank import PoseBank
from contextdb.motion.search.database import MotionDatabase

NO_POSES = "there are no poses: the pose banks of the session are missing, and no poses are given"
NO_BANKS = "there are no pose banks to compare with"
NO_CONTACTS = "it is not known when the feet of the clips are down"
NO_BODY = "the session does not say where the game had the body"
NO_COSTS = "poses do not say what a jump cost"
NO_FEET = "no bones are named like feet"
TOO_SHORT = "there are too few moments"
NO_DATABASES = "the databases are not there"
NO_JUMP, NO_FORCED, NO_CHANGE = "nothing jumps", "no jump is forced", "the wanted velocity never changes"
NEVER_PLANTED, NO_REST = "no foot is ever down", "nothing comes to rest for two seconds"


# ---- jumps


def jumps(it: Displayed) -> dict[str, object]:
    """How often something jumps, how often it must, and for how long what was entered stays."""
    forced = it.costs[it.forced]
    n_entered, seconds = int(it.entered.sum()), it.seconds
    known = forced[~np.isnan(forced)]
    cost: object = float(known.max()) if len(known) else NO_COSTS if len(forced) else NO_FORCED
    return {
        "jumps_per_s": int(it.jumped.sum()) / seconds if seconds > 0.0 else TOO_SHORT,
        "forced_jumps": int(it.forced.sum()),
        "forced_cost": cost,
        "stay_s": _playing_s(it) / n_entered if n_entered and seconds > 0.0 else TOO_SHORT if n_entered else "nothing plays",
    }


def _playing_s(it: Displayed) -> float:
    plays = np.array([at is not None for at in it.playing[:-1]], np.bool_)
    return float(np.diff(it.times_s)[plays].sum())


def steps(it: Displayed, clips: Clips | None) -> dict[str, object]:
    """How far joints are apart at jumps, and by how much their speeds differ."""
    names = ("jump_cm", "jump_worst_cm", "jump_mps")
    if clips is None:
        return dict.fromkeys(names, NO_BANKS)
    means, worst, velocities = [], [], []
    for i in np.flatnonzero(it.jumped).tolist():
        before, after = it.before[i], it.playing[i]
        places = [None if at is None else clips.find(at) for at in (before, after)]
        if before is None or after is None or places[0] is None or places[1] is None:
            continue
        (old, old_number), (new, new_number) = places[0], places[1]
        left, left_v = old.body_at(old_number, before.time_s)
        taken, taken_v = new.body_at(new_number, after.time_s)
        apart = np.linalg.norm(taken - left, axis=-1)
        means.append(float(apart.mean()))
        worst.append(float(apart.max()))
        velocities.append(float(np.linalg.norm(taken_v - left_v, axis=-1).mean()))
    if not means:
        return dict.fromkeys(names, NO_JUMP)
    figures = (100.0 * np.mean(means), 100.0 * np.quantile(worst, 0.95), np.mean(velocities))
    return {name: float(value) for name, value in zip(names, figures, strict=True)}


# ---- feet and joints


def moving(it: Displayed) -> Ints:
    """The moments at which time has passed, which poses can be measured at: the last of several at one time."""
    return np.flatnonzero(np.diff(it.times_s, append=math.inf) > 0.0)


def skate(it: Displayed, clips: Clips | None) -> dict[str, object]:
    """How much feet slide that are down."""
    planted, height = ("skate_cm_s", "skate_m_min"), ("skate_weighted_cm_s", "skate_ratio")
    played = "skate_played_cm_s"
    if it.positions is None:
        return dict.fromkeys((*planted, *height, played), NO_POSES)
    at = moving(it)
    if it.feet is None or len(at) < 2:
        why = TOO_SHORT if len(at) < 2 else NO_FEET if clips is not None or it.contacts is None else NO_BANKS
        return dict.fromkeys((*planted, *height, played), why)
    places, times_s = it.positions[at][:, it.feet], it.times_s[at]
    contacts = np.zeros(places.shape[:2], np.bool_) if it.contacts is None else it.contacts[at]
    slides = formulas.Slides.of(places, times_s, formulas.standing(contacts, places, times_s), formulas.floor_of(places))
    values: dict[str, object] = {"skate_weighted_cm_s": _scaled(slides.weighted_mps(), 100.0), "skate_ratio": slides.ratio()}
    if it.contacts is None:
        return {**values, **dict.fromkeys((*planted, played), NO_CONTACTS)}
    skate = slides.skate_mps()
    values["skate_cm_s"] = NEVER_PLANTED if skate is None else 100.0 * skate
    values["skate_m_min"] = _scaled(slides.skated_m_per_s(), 60.0)
    values[played] = NO_BANKS if clips is None else _or(_scaled(_played(it, clips), 100.0), NEVER_PLANTED)
    return values


def _played(it: Displayed, clips: Clips) -> float | None:
    """The mean speed of feet that are down, of the frames that play, as their clips have them."""
    ways, seconds = 0.0, 0.0
    for at, dt_s in zip(it.playing[:-1], np.diff(it.times_s).tolist(), strict=True):
        if at is None or (clip := clips.find(at)) is None:
            continue
        raw, number = clip
        frame = raw.frame_at(number, at.time_s)
        speeds = raw.foot_speeds[frame]
        down = raw.bank.contacts[frame] & ~np.isnan(speeds) & raw.bank.contacts[min(frame + 1, raw.bank.n_frames - 1)]
        ways += float(speeds[down].sum()) * dt_s
        seconds += float(down.sum()) * dt_s
    return ways / seconds if seconds > 0.0 else None


def raw_skate(clips: Clips | None) -> dict[str, object]:
    """How much feet slide in the clips themselves."""
    names = ("skate_raw_cm_s", "skate_raw_m_min", "skate_weighted_raw_cm_s", "skate_ratio_raw")
    if clips is None:
        return dict.fromkeys(names, NO_BANKS)
    parts = [part for raw in clips.distinct if len(raw.bank.feet) for part in raw.slides]
    if not parts:
        return dict.fromkeys(names, NO_FEET)
    slides = formulas.Slides.joined(parts)
    skate = slides.skate_mps()
    if skate is None:
        return dict.fromkeys(names, NEVER_PLANTED)
    per_min, weighted = _scaled(slides.skated_m_per_s(), 60.0), _scaled(slides.weighted_mps(), 100.0)
    return dict(zip(names, (100.0 * skate, per_min, weighted, slides.ratio()), strict=True))


def accelerations(it: Displayed, clips: Clips | None) -> dict[str, object]:
    """How hard joints accelerate, beside the clips, and how often harder than these ever do."""
    at = moving(it)
    times_s = it.times_s[at]
    step = formulas.step_of(times_s)
    step_s = step * float(np.median(np.diff(times_s))) if len(times_s) > 1 else formulas.STEP_S
    raw = [] if clips is None else [each for part in clips.distinct for each in part.accelerations(step_s) if len(each)]
    values: dict[str, object] = {
        "accel_raw_p99": float(np.quantile(np.concatenate([each.ravel() for each in raw]), 0.99)) if raw else NO_BANKS
    }
    if it.positions is None:
        return {**values, "accel_p99": NO_POSES, "snap_share": NO_POSES}
    own = formulas.accelerations(it.positions[at], times_s, step)
    if not len(own):
        return {**values, "accel_p99": TOO_SHORT, "snap_share": TOO_SHORT}
    values["accel_p99"] = float(np.quantile(own, 0.99))
    if not raw:
        return {**values, "snap_share": NO_BANKS}
    bar = float(np.quantile(np.concatenate([each.max(axis=1) for each in raw]), 0.999))
    return {**values, "snap_share": float((own.max(axis=1) > bar).mean())}


# ---- the path


def path(it: Displayed) -> dict[str, object]:
    """How far the root is from where the game had the body."""
    names = ("path_rms_m", "path_p95_m", "heading_rms_deg", "heading_p95_deg")
    if it.roots is None or it.bodies is None:
        return dict.fromkeys(names, NO_BODY if it.bodies is None else NO_POSES)
    known = ~np.isnan(it.bodies).any(axis=1)
    metres, turns = formulas.apart(it.roots[known], it.bodies[known])
    figures = (formulas.rms(metres), np.quantile(metres, 0.95), *np.rad2deg((formulas.rms(turns), np.quantile(turns, 0.95))))
    return {name: float(value) for name, value in zip(names, figures, strict=True)}


def reach(it: Displayed, wanted: Floats | None) -> dict[str, object]:
    """How long the motion takes to follow a change of what is wanted."""
    kinds = ("direction", "speed", "stop")
    names = ("reach_s", *(f"reach_{kind}_s" for kind in kinds), "n_changes", "n_missed")
    at = moving(it)
    if it.roots is None or (wanted is None and it.bodies is None) or len(at) < 2:
        return dict.fromkeys(names, TOO_SHORT if len(at) < 2 else NO_POSES if it.roots is None else NO_BODY)
    times_s, target = it.times_s[at], target_of(it, wanted, at)
    if target is None:
        return dict.fromkeys(names, NO_BODY)
    moved = formulas.velocities(it.roots[at, :2], times_s)
    changes = formulas.changes_of(target, times_s)
    durations: dict[str, list[float]] = {kind: [] for kind in kinds}
    n_missed = 0
    for change in changes:
        took_s = formulas.reach_s(change, moved, times_s)
        n_missed += took_s is None
        durations[change.kind].append(float(times_s[change.until] - times_s[change.at]) if took_s is None else took_s)
    every = [took_s for each in durations.values() for took_s in each]
    means = [float(np.mean(each)) if each else NO_CHANGE for each in (every, *durations.values())]
    return dict(zip(names, (*means, len(changes), n_missed), strict=True))


def target_of(it: Displayed, wanted: Floats | None, at: Ints) -> Floats | None:
    """The velocity over the ground that is wanted at some moments [n, 2]: the stick's, or else the body's; None without either."""
    if wanted is not None:
        return np.asarray(wanted[at])
    if it.bodies is None or np.isnan(it.bodies[at]).any():
        return None
    target = np.diff(it.bodies[at, :2], axis=0) / np.diff(it.times_s[at])[:, None]
    return np.concatenate((target, target[-1:]))


# ---- what is used


def usage(it: Displayed, databases: Mapping[str, MotionDatabase] | None, banks: Banks | None) -> dict[str, object]:
    """How much of the databases plays, and which assets never do."""
    names = ("frames_used_share", "assets_used_share", "assets_never_used", "frames_unusable_share")
    of: Mapping[str, HasRanges] = databases or ({"": banks} if isinstance(banks, PoseBank) else banks or {})
    if not of:
        return dict.fromkeys(names, NO_DATABASES)
    used = frames_used(it.playing, it.entered, of, {name: _frames_a_second(each, it) for name, each in of.items()})
    known = list(dict.fromkeys(asset for each in of.values() for asset in each.assets))
    played = {at.asset for at in it.playing if at is not None}
    never = tuple(asset for asset in known if asset not in played)
    n_frames = sum(each.n_frames // permutations_in(each) for each in of.values())
    values: dict[str, object] = {
        "frames_used_share": sum(int(flags.sum()) for flags in used.values()) / n_frames if n_frames else NO_DATABASES,
        "assets_used_share": (len(known) - len(never)) / len(known) if known else NO_DATABASES,
        "assets_never_used": never,
        "frames_unusable_share": NO_DATABASES,
    }
    if databases and n_frames:
        unusable = sum(int((~usable(each)).sum()) // each.n_permutations for each in databases.values())
        values["frames_unusable_share"] = unusable / n_frames
    return values


def _frames_a_second(of: HasRanges, it: Displayed) -> float:
    if isinstance(of, PoseBank):
        return of.rate
    schema = of.schema if isinstance(of, MotionDatabase) else None
    return it.rate if schema is None else schema.rate


def _scaled(value: float | None, factor: float) -> float | None:
    return None if value is None else factor * value


def _or(value: float | None, why: str) -> float | str:
    return why if value is None else value
