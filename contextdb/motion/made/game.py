"""Made clips for a small game, beyond those of `RECIPES`: turns about, strafing, backwards, vaults, catches. Made, not captured.

Each is another made clip with some of its channels raised for a while. What a table and a search choose among is in the folder,
what plays once and ends at a target in `once/`, and what two play together, one clip for each role, in `contest/`.

Both come as the made clip of the recipe comes to a stand, and reach out; the guest is the host turned half a turn about the upright
line through the host's hand at the contact, so that the hands meet there. An asset `greet_walk` has the clips `greet_walk.Host` and
`greet_walk.Guest`, of one length, in one world.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from os import PathLike
from pathlib import Path

import numpy as np

from contextdb.cells.arguments import require_kind, require_path, require_text
from contextdb.disk import make_folder
from contextdb.errors import MotionError, no_such
from contextdb.motion.clips.clip import CENTIMETRE, Clip, write_bvh
from contextdb.motion.clips.poses import poses_of
from contextdb.motion.clips.quaternions import Floats
from contextdb.motion.made.recipes import ABOUT_TURNS, make_clip, write_recipes

Bump = tuple[str, str, float, float, float]
"""A joint, its channel, from when to when in seconds, and by how much in between, in centimetres or degrees."""

SIDEWAYS = BACKWARDS = ("walk", "jog")
"""Who strafes turns hips and legs to the way; see `path_alignment` of `[output.NAME]`. Backwards a clip is played from its end."""
LEGS_UP: list[Bump] = [
    (f"{side}{joint}", "Xrotation", 0.85, 1.65, bend)
    for side in ("Left", "Right")
    for joint, bend in (("UpLeg", -75.0), ("Leg", 95.0), ("Arm", -35.0))
]
STEPS: list[Bump] = [
    (f"{side}{joint}", "Xrotation", from_s, from_s + 0.35, bend)
    for side, from_s in (("Left", 0.55), ("Right", 0.85))
    for joint, bend in (("UpLeg", -35.0), ("Leg", 60.0), ("Foot", -25.0))
]
"""Two steps on the spot, while the clip is brought to the other one: a foot that stands would slide."""


def _hands_up(from_s: float, to_s: float) -> list[Bump]:
    return [(f"{side}Arm", "Xrotation", from_s, to_s, -160.0) for side in ("Left", "Right")]


Bent = tuple[str, float, float, list[Bump]]
"""A made clip, from when to when it is taken, and what is raised."""
ONCE: dict[str, Bent] = {
    "vault_run": ("run", 0.0, 2.4, [("Hips", "Yposition", 0.8, 1.7, 72.0), ("Chest", "Xrotation", 0.6, 1.6, 25.0), *LEGS_UP]),
    "vault_walk": (
        "walk_fast",
        *(0.0, 2.6),
        [("Hips", "Yposition", 0.7, 1.9, 74.0), ("Chest", "Xrotation", 0.5, 1.8, 35.0), *LEGS_UP],
    ),
    "catch_high": ("idle", 0.0, 1.5, [("Hips", "Yposition", 0.35, 0.9, 28.0), *_hands_up(0.1, 1.2)]),
}
CONTESTS: dict[str, dict[str, Bent]] = {
    "catch_contested": {
        "Catcher": ("stop_walk", 3.2, 4.9, [("Hips", "Yposition", 0.9, 1.5, 45.0), *_hands_up(0.7, 1.7)]),
        "Other": ("stop_walk", 3.2, 4.9, [("Chest", "Xrotation", 0.8, 1.6, 25.0), *_hands_up(0.7, 1.7)[:1], *STEPS]),
    }
}
"""The clips of each role. Both come to a stand, `APART_M` from each other, face to face."""
APART_M = 0.8


def write_made_clips(folder: str | PathLike[str], *, of_game: bool = False) -> list[Path]:
    """Write all made clips into a folder that exists, each as NAME.bvh in centimetres, y up; the paths, in order.

    With `of_game` those of a small game too, and the folder is made. Raises FileError where they cannot be written.
    """
    place = require_path(folder, "folder")
    require_kind(of_game, bool, "of_game", "True or False")
    if not of_game:
        return write_recipes(place)
    for each in (place, place / "once", place / "contest"):
        make_folder(each)
    paths = write_recipes(place)
    for name, clip in _others():
        paths.append(place / f"{name}.bvh")
        write_bvh(clip, paths[-1])
    return paths


def _others() -> Iterator[tuple[str, Clip]]:
    """All clips that `RECIPES` does not name, and where they are written."""
    for name in ABOUT_TURNS:
        yield name, make_clip(name).clip
    for name in SIDEWAYS:
        yield f"{name}_strafe", make_clip(name).clip
    for name in BACKWARDS:
        clip = make_clip(name).clip
        yield f"{name}_back", replace(clip, values=clip.values[::-1].copy())
    for name, bent in ONCE.items():
        yield f"once/{name}", _bent(name, *bent)
    for name, roles in CONTESTS.items():
        for role, bent in roles.items():
            clip = _bent(f"{name}.{role}", *bent)
            yield f"contest/{clip.name}", clip if role == "Catcher" else _opposite(clip)


def _bent(name: str, base: str, from_s: float, to_s: float, bumps: list[Bump]) -> Clip:
    """A piece of a made clip with some of its channels raised for a while."""
    clip = make_clip(base).clip
    values = clip.values[round(from_s / clip.frame_time_s) : round(to_s / clip.frame_time_s) + 1].copy()
    times_s = np.arange(len(values)) * clip.frame_time_s
    for joint, channel, begins_s, ends_s, amount in bumps:
        share = np.clip((times_s - begins_s) / (ends_s - begins_s), 0.0, 1.0)
        values[:, column(clip, joint, channel)] += amount * np.sin(np.pi * share) ** 2
    return replace(clip, name=name, values=values)


def _opposite(clip: Clip) -> Clip:
    """The same from the other side, so that both end `APART_M` from each other."""
    x, z = clip.values[-1, [column(clip, "Hips", "Xposition"), column(clip, "Hips", "Zposition")]] * CENTIMETRE
    return replace(clip, values=half_turned(clip, float(x), float(z) + 0.5 * APART_M))


# ---- made joint clips: two bodies come up to each other and shake hands. Made, not captured, as all clips of `RECIPES`


JOINT_ROLES = ("Host", "Guest")
JOINT_RECIPES = {"greet_walk": "stop_walk", "greet_tired": "stop_walk_tired", "greet_run": "stop_run"}
"""The joint clips, and the made clip that both bodies come by."""
REACH_S = 0.6
"""How long a hand takes to be held out; it is there `HOLD_S` before the end, the contact."""
HOLD_S = 0.2
REACH = {"RightArm": (-55.0, 24.0), "RightForeArm": (-25.0, 0.0)}
"""How far joints turn, in degrees: about x, which lifts the arm ahead, and about y, which turns it in."""


def make_joint_clip(name: str) -> dict[str, Clip]:
    """Compute one joint clip of `JOINT_RECIPES`, by role; the same every time. Raises MotionError for another name."""
    if require_text(name, "name") not in JOINT_RECIPES:
        raise MotionError(no_such("made joint clip", name, JOINT_RECIPES))
    walked = make_clip(JOINT_RECIPES[name]).clip
    host = replace(walked, name=f"{name}.Host", values=_reaching(walked))
    poses = poses_of(host)
    contact = poses.n_frames - 1 - round(HOLD_S * poses.rate)
    hand = poses.positions[contact, host.skeleton.index("RightHand")]
    return {"Host": host, "Guest": replace(host, name=f"{name}.Guest", values=half_turned(host, hand[0], hand[2]))}


def write_joint_clips(folder: str | PathLike[str]) -> list[Path]:
    """Write all made joint clips into a folder that exists, each as NAME.ROLE.bvh; the paths, in order.

    Raises FileError where they cannot be written.
    """
    place = require_path(folder, "folder")
    clips = [clip for name in JOINT_RECIPES for clip in make_joint_clip(name).values()]
    for clip in clips:
        write_bvh(clip, place / f"{clip.name}.bvh")
    return [place / f"{clip.name}.bvh" for clip in clips]


def _reaching(clip: Clip) -> Floats:
    """The values of a clip whose right hand is held out at its end."""
    since = clip.duration_s - HOLD_S - REACH_S
    u = np.clip((np.arange(len(clip.values)) * clip.frame_time_s - since) / REACH_S, 0.0, 1.0)
    share = u * u * (3.0 - 2.0 * u)
    values = clip.values.copy()
    for joint, (lift, turn) in REACH.items():
        for channel, degrees in (("Xrotation", lift), ("Yrotation", turn)):
            values[:, column(clip, joint, channel)] += share * degrees
    return values


def half_turned(clip: Clip, x: float, z: float) -> Floats:
    """The values of a clip turned half a turn about the upright line through a point of the ground, in metres."""
    values = clip.values.copy()
    for channel, middle in (("Xposition", x), ("Zposition", z)):
        at = column(clip, "Hips", channel)
        values[:, at] = 2.0 * middle / CENTIMETRE - values[:, at]
    values[:, column(clip, "Hips", "Yrotation")] += 180.0
    return values


def column(clip: Clip, joint: str, channel: str) -> int:
    """Where a joint's channel is in the values."""
    at = clip.skeleton.index(joint)
    return int(clip.skeleton.channel_starts[at]) + clip.skeleton.channels[at].index(channel)
