"""Made joint clips: two bodies come up to each other and shake hands. Made, not captured, as all clips of `RECIPES`.

Both come as the made clip of the recipe comes to a stand, and reach out; the guest is the host turned half a turn about the upright
line through the host's hand at the contact, so that the hands meet there. An asset `greet_walk` has the clips `greet_walk.Host` and
`greet_walk.Guest`, of one length, in one world.
"""

from __future__ import annotations

from dataclasses import replace
from os import PathLike
from pathlib import Path

import numpy as np

from contextdb.cells.arguments import require_path, require_text
from contextdb.errors import MotionError, no_such
from contextdb.motion.clips.clip import CENTIMETRE, Clip, write_bvh
from contextdb.motion.clips.poses import poses_of
from contextdb.motion.clips.quaternions import Floats
from contextdb.motion.made.recipes import make_clip

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
