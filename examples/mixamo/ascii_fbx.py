"""A body that moves, and a writer of ASCII FBX 7.4 for it: enough to make files as other tools write them, without those tools."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from contextdb.motion import Clip
from contextdb.motion.clips import quaternions
from contextdb.motion.clips.poses import local_poses
from contextdb.motion.clips.quaternions import Floats

Z_UP = quaternions.about_axis("x", np.array(np.pi / 2.0))
"""The rotation of a world with y up into one with z up."""
FBX_TICKS = 46186158000
"""A second of FBX."""


@dataclass(frozen=True)
class Moving:
    """Joints against their parents: rest offsets [J, 3] and rotations [J, 4], rotations [F, J, 4], the root's places [F, 3]."""

    names: tuple[str, ...]
    parents: list[int]
    offsets: Floats
    rotations: Floats
    root: Floats
    rate: float

    @classmethod
    def of(cls, clip: Clip) -> Moving:
        local = local_poses(clip)
        offsets = clip.skeleton.offsets * clip.metres_per_unit
        parents = clip.skeleton.parents.tolist()
        return cls(clip.skeleton.names, parents, offsets, local.rotations, local.positions[:, 0], clip.rate)

    def in_space(self, metres_per_unit: float, up: str) -> Moving:
        """The same in a unit, and with z up where that is asked for."""
        offsets, root, rotations = self.offsets / metres_per_unit, self.root / metres_per_unit, self.rotations.copy()
        if up == "z":
            root = quaternions.rotate(Z_UP, root)
            rotations[:, 0] = quaternions.multiply(Z_UP, rotations[:, 0])
        return replace(self, offsets=offsets, root=root, rotations=rotations)

    @property
    def times(self) -> Floats:
        return np.arange(len(self.root)) / self.rate

    @property
    def children(self) -> list[list[int]]:
        return [[child for child, parent in enumerate(self.parents) if parent == joint] for joint in range(len(self.names))]


def fbx(
    body: Moving, *, metres_per_unit: float = 0.01, up: str = "y", takes: tuple[str, ...] = ("Take 001",), helper: str = ""
) -> bytes:
    """ASCII FBX 7.4: a node of a bone for each joint, a curve for each angle and each place of the root, the same in each take;
    `helper` is a bone beside the body that does not move."""
    moved = body.in_space(metres_per_unit, up)
    axis, sign, front = (1, 1, 2) if up == "y" else (2, 1, 1)
    front_sign = 1 if up == "y" else -1
    settings = {
        "UpAxis": axis, "UpAxisSign": sign, "FrontAxis": front, "FrontAxisSign": front_sign, "CoordAxis": 0, "CoordAxisSign": 1,
    }  # fmt: skip
    lines = ["; FBX 7.4.0 project file", "FBXHeaderExtension:  {", "\tFBXHeaderVersion: 1003", "\tFBXVersion: 7400", "}"]
    lines += ["GlobalSettings:  {", "\tVersion: 1000", "\tProperties70:  {"]
    lines += [f'\t\tP: "{key}", "int", "Integer", "",{value}' for key, value in settings.items()]
    lines += [f'\t\tP: "UnitScaleFactor", "double", "Number", "",{100.0 * metres_per_unit!r}']
    lines += ['\t\tP: "TimeMode", "enum", "", "",14', f'\t\tP: "CustomFrameRate", "double", "Number", "",{body.rate!r}']
    lines += ["\t}", "}", "Objects:  {"]
    links: list[str] = []
    rest = moved.offsets.copy()
    for joint, name in enumerate(body.names):
        lines += _fbx_bone(joint, name, rest[joint], np.array([90.0 * (up == "z" and joint == 0), 0.0, 0.0]))
        parent = body.parents[joint]
        links += [
            f'C: "OO",{_BONE + joint},{_BONE + parent if parent >= 0 else 0}',
            f'C: "OO",{_ATTRIBUTE + joint},{_BONE + joint}',
        ]
    if helper:
        lines += _fbx_bone(len(body.names), helper, np.zeros(3), np.zeros(3))
        links += [f'C: "OO",{_BONE + len(body.names)},0', f'C: "OO",{_ATTRIBUTE + len(body.names)},{_BONE + len(body.names)}']
    angles = np.unwrap(np.rad2deg(quaternions.to_euler("zyx", moved.rotations))[..., ::-1], period=360.0, axis=0)
    ticks = [round(time * FBX_TICKS) for time in moved.times.tolist()]
    for i, take in enumerate(takes):
        base = 10_000_000 * (i + 1)
        lines += [f'\tAnimationStack: {base}, "AnimStack::{take}", "" {{', "\t\tProperties70:  {"]
        lines += [f'\t\t\tP: "{key}", "KTime", "Time", "",{tick}' for key, tick in (("LocalStart", 0), ("LocalStop", ticks[-1]))]
        lines += ["\t\t}", "\t}", f'\tAnimationLayer: {base + 1}, "AnimLayer::Base", "" {{', "\t}"]
        links += [f'C: "OO",{base + 1},{base}']
        for joint in range(len(body.names)):
            curves = [("R", "Lcl Rotation", angles[:, joint])] + ([("T", "Lcl Translation", moved.root)] if joint == 0 else [])
            for k, (letter, key, values) in enumerate(curves):
                node = base + 100 + 10 * joint + 5 * k
                lines += [f'\tAnimationCurveNode: {node}, "AnimCurveNode::{letter}", "" {{', "\t}"]
                links += [f'C: "OO",{node},{base + 1}', f'C: "OP",{node},{_BONE + joint}, "{key}"']
                for axis in range(3):
                    lines += _fbx_curve(node + 1 + axis, ticks, values[:, axis])
                    links += [f'C: "OP",{node + 1 + axis},{node}, "d|{"XYZ"[axis]}"']
    lines += ["}", "Connections:  {", *(f"\t{link}" for link in links), "}", ""]
    return "\n".join(lines).encode()


_BONE, _ATTRIBUTE = 1_000, 500_000


def _fbx_bone(joint: int, name: str, place: Floats, turn: Floats) -> list[str]:
    def numbers(values: Floats) -> str:
        return ",".join(map(repr, values.tolist()))

    return [
        f'\tNodeAttribute: {_ATTRIBUTE + joint}, "NodeAttribute::{name}", "LimbNode" {{',
        '\t\tTypeFlags: "Skeleton"',
        "\t}",
        f'\tModel: {_BONE + joint}, "Model::{name}", "LimbNode" {{',
        "\t\tVersion: 232",
        "\t\tProperties70:  {",
        f'\t\t\tP: "Lcl Translation", "Lcl Translation", "", "A",{numbers(place)}',
        f'\t\t\tP: "Lcl Rotation", "Lcl Rotation", "", "A",{numbers(turn)}',
        "\t\t}",
        "\t}",
    ]


def _fbx_curve(number: int, ticks: list[int], values: Floats) -> list[str]:
    n = len(ticks)

    def array(key: str, items: list[str]) -> str:
        return f"\t\t{key}: *{len(items)} {{\n\t\t\ta: {','.join(items)}\n\t\t}}"

    return [
        f'\tAnimationCurve: {number}, "AnimCurve::", "" {{',
        "\t\tDefault: 0",
        "\t\tKeyVer: 4008",
        array("KeyTime", list(map(str, ticks))),
        array("KeyValueFloat", [f"{value:.9g}" for value in values.tolist()]),
        array("KeyAttrFlags", ["4"]),
        array("KeyAttrDataFloat", ["0", "0", "0", "0"]),
        array("KeyAttrRefCount", [str(n)]),
        "\t}",
    ]
