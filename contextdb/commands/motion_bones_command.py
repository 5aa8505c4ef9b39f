"""Show the bones of clips as a tree, with their channels and heights, and which are detected as hips, spine, head, feet and toes.

Files of one rig are listed together; a folder means the clips in it and below, in any format. The settings of [features.NAME] and
[databases.NAME] name bones as they are listed here.

  contextdb motion bones clips/walk.bvh
  contextdb motion bones clips --json
  contextdb motion bones robot.bvh --metres-per-unit 1 --up z
"""

from __future__ import annotations

import argparse
import os
from collections.abc import Iterator
from pathlib import Path

from contextdb.authoring.clip_folder import clips_below
from contextdb.commands import answer
from contextdb.commands.numbers import unit_of
from contextdb.console import ExitCode, aligned, printable
from contextdb.errors import plural
from contextdb.motion.clips.clip import CENTIMETRE, UPS, Clip
from contextdb.motion.clips.foot_bones import Rig
from contextdb.motion.clips.source import clips_by_file

HEADER = ("bone", "channels", "height m", "role", "mirrored to")


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("files", metavar="FILE", nargs="+", help="files of clips, one take as FILE:TAKE, or folders")
    parser.add_argument(
        "--metres-per-unit", metavar="M", type=unit_of, default=CENTIMETRE, help="the unit of BVH files in metres (default: 0.01)"
    )
    parser.add_argument("--up", choices=UPS, default="y", help="the axis of BVH files that points up (default: y)")
    parser.add_argument("--json", action="store_true", help="print a JSON document instead of trees")


def run(arguments: argparse.Namespace) -> ExitCode:
    """Show the rigs of some files."""
    files = [file for each in arguments.files for file in (clips_below(Path(each), needs=True) if os.path.isdir(each) else [each])]
    clips = clips_by_file(files, arguments.metres_per_unit, arguments.up)
    rigs: dict[tuple[object, ...], list[int]] = {}
    for i, (_, clip) in enumerate(clips):
        key = (clip.skeleton.names, tuple(clip.skeleton.parents.tolist()), clip.skeleton.channels)
        rigs.setdefault(key, []).append(i)
    groups = [(list(dict.fromkeys(clips[i][0] for i in members)), clips[members[0]][1]) for members in rigs.values()]
    answer(
        arguments,
        lambda: {"rigs": [_document(*each) for each in groups]},
        lambda: ["\n\n".join("\n".join(_lines(*each)) for each in groups)],
    )
    return ExitCode.OK


def _lines(files: list[str], clip: Clip) -> Iterator[str]:
    rig = Rig.of(clip)
    more = f" and {plural(len(files) - 1, 'other file')}" if len(files) > 1 else ""
    size = f"{rig.height_m:.3g} m tall" if clip.n_frames else "no frame"
    yield printable(f"{files[0]}{more}: {plural(rig.skeleton.n_joints, 'bone')}, {size}, {clip.rate:.4g} frames a second")
    rows = [HEADER]
    for joint, name in enumerate(rig.skeleton.names):
        height = f"{rig.heights_m[joint]:.3f}" if rig.heights_m else ""
        tree = f"{'  ' * int(rig.skeleton.depths[joint])}{printable(name)}"
        n_channels = str(len(rig.skeleton.channels[joint]))
        rows.append((tree, n_channels, height, ", ".join(rig.roles(name)), printable(rig.partner(name) or "")))
    yield from (line.rstrip() for line in aligned(rows, right=(1, 2)))
    missing = [what for what, names in (("feet", rig.feet), ("toes", rig.toes), ("mirror pairs", rig.mirror)) if not names]
    if missing:
        yield f"no bone for: {', '.join(missing)}; [features.NAME] can declare feet, heels, toes, facing and mirror"


def _document(files: list[str], clip: Clip) -> dict[str, object]:
    rig = Rig.of(clip)
    skeleton = rig.skeleton
    bones = [
        {
            "bone": name,
            "parent": None if parent < 0 else skeleton.names[parent],
            "depth": int(skeleton.depths[joint]),
            "channels": list(skeleton.channels[joint]),
            "offset_m": [round(x * clip.metres_per_unit, 6) for x in skeleton.offsets[joint].tolist()],
            "height_m": round(rig.heights_m[joint], 6) if rig.heights_m else None,
            "found_as": rig.roles(name),
            "mirrored_to": rig.partner(name),
        }
        for joint, (name, parent) in enumerate(zip(skeleton.names, skeleton.parents.tolist(), strict=True))
    ]
    roles = {"hips": rig.hips, "spine": rig.spine, "head": rig.head, "feet": rig.feet, "heels": rig.heels, "toes": rig.toes}
    sides = {"facing": rig.facing, "mirror": [list(pair) for pair in rig.mirror]}
    return {"files": files, "rate": clip.rate, "height_m": round(rig.height_m, 6), **roles, **sides, "bones": bones}
