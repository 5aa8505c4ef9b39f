"""Clips as files of other tools, written here as those tools write them: ASCII FBX, GLB, glTF, USDA and arrays.

A `Moving` is a body as arrays, in metres with y up; each writer puts it into the unit and axis of its file.
"""

from __future__ import annotations

import base64
import json
import struct
from dataclasses import dataclass, replace
from io import BytesIO

import numpy as np

from contextdb.motion.clips import quaternions
from contextdb.motion.clips.clip import Clip
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


BODY = Moving(
    ("Hips", "LeftFoot", "RightFoot"),
    [-1, 0, 0],
    np.array([[0.0, 0.9, 0.0], [0.1, -0.9, 0.0], [-0.1, -0.9, 0.0]]),
    np.tile(np.array([1.0, 0.0, 0.0, 0.0]), (4, 3, 1)),
    np.arange(12.0).reshape(4, 3),
    30.0,
)
"""A small body, to damage the files of."""


# ---- FBX


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


# ---- arrays


SMPL_OFFSETS = np.zeros((22, 3))
"""A body whose left leg has lengths, in metres; it faces +z, with its left at +x."""
SMPL_OFFSETS[[1, 4, 7]] = [0.1, -0.1, 0.0], [0.0, -0.4, 0.0], [0.0, -0.4, 0.0]


def joints() -> bytes:
    """Four frames of three joints in the world."""
    places = np.arange(36.0).reshape(4, 3, 3)
    whole = BytesIO()
    np.savez_compressed(whole, positions=places, bones=np.array(["a", "b", "c"]), parents=np.array([-1, 0, 1]), rate=30.0)
    return whole.getvalue()


def amass(offsets: Floats | None = None) -> bytes:
    """Two frames of AMASS: z up; the body faces +x, 1 m along it, with its left knee bent by 90 degrees."""
    poses = np.zeros((2, 156))
    standing = quaternions.about_axis("x", np.array(np.pi / 2.0))
    turned = quaternions.multiply(quaternions.about_axis("z", np.array(np.pi / 2.0)), standing)
    poses[:, :3] = quaternions.rotation_vectors(turned)
    poses[:, 12:15] = [np.pi / 2.0, 0.0, 0.0]
    arrays = {"poses": poses, "trans": np.array([[1.0, 0.0, 0.9]] * 2), "mocap_framerate": 60.0, "gender": np.array("neutral")}
    whole = BytesIO()
    np.savez(whole, **arrays, **({} if offsets is None else {"offsets": offsets}))
    return whole.getvalue()


# ---- glTF


def gltf(body: Moving, *, up: str = "y", how: str = "LINEAR", takes: tuple[str, ...] = ("walk",), binary: bool = True) -> bytes:
    """A .glb file, or a .gltf with its numbers in it: a node of a joint each, below a node that turns z up into y up where that is
    asked for, and scales centimetres; rotations of all joints and translations of the root."""
    moved = body.in_space(0.01 if up == "z" else 1.0, up)
    n = len(body.names)
    nodes: list[dict[str, object]] = [
        {"name": name, "children": children, "translation": place.tolist()}
        for name, children, place in zip(body.names, body.children, moved.offsets, strict=True)
    ]
    nodes = [{key: value for key, value in node.items() if value != []} for node in nodes]
    world = {"name": "World", "children": [0], "scale": [0.01] * 3, "rotation": [-np.sqrt(0.5), 0.0, 0.0, np.sqrt(0.5)]}
    nodes.append(world if up == "z" else {"name": "World", "children": [0]})
    if up == "z":
        nodes[0]["rotation"] = Z_UP[[1, 2, 3, 0]].tolist()
    data, views, accessors = b"", [], []

    def add(values: Floats, kind: str) -> int:
        nonlocal data
        raw = np.ascontiguousarray(values, np.float32).tobytes()
        views.append({"buffer": 0, "byteOffset": len(data), "byteLength": len(raw)})
        accessors.append({"bufferView": len(views) - 1, "componentType": 5126, "count": len(values), "type": kind})
        data += raw
        return len(accessors) - 1

    def keys(values: Floats) -> Floats:
        if how != "CUBICSPLINE":
            return values
        slopes = np.gradient(values, body.times, axis=0)
        return np.stack((slopes, values, slopes), axis=1).reshape(-1, values.shape[1])

    times = add(body.times[:, None], "SCALAR")
    tracks = [(joint, "rotation", add(keys(moved.rotations[:, joint][:, [1, 2, 3, 0]]), "VEC4")) for joint in range(n)]
    tracks.append((0, "translation", add(keys(moved.root), "VEC3")))
    samplers = [{"input": times, "output": output, "interpolation": how} for _, _, output in tracks]
    channels = [{"sampler": i, "target": {"node": node, "path": path}} for i, (node, path, _) in enumerate(tracks)]
    document = {
        "asset": {"version": "2.0"}, "scenes": [{"nodes": [n]}], "nodes": nodes, "skins": [{"joints": list(range(n))}],
        "animations": [{"name": take, "samplers": samplers, "channels": channels} for take in takes],
        "bufferViews": views, "accessors": accessors, "buffers": [{"byteLength": len(data)}],
    }  # fmt: skip
    if not binary:
        document["buffers"] = [{"byteLength": len(data), "uri": "data:;base64," + base64.b64encode(data).decode()}]
        return json.dumps(document).encode()
    text = json.dumps(document).encode()
    text += b" " * (-len(text) % 4)
    parts = struct.pack("<I4s", len(text), b"JSON") + text + struct.pack("<I4s", len(data), b"BIN\0") + data
    return struct.pack("<4sII", b"glTF", 2, 12 + len(parts)) + parts


# ---- USD


def usda(body: Moving, *, metres_per_unit: float = 0.01, up: str = "y", reference: str = "") -> bytes:
    """A stage with one skeleton and one animation of it, a time code a frame."""
    moved = body.in_space(metres_per_unit, up)
    paths: list[str] = []
    for name, parent in zip(body.names, body.parents, strict=True):
        paths.append(f"{paths[parent]}/{name}" if parent >= 0 else name)
    joints = ", ".join(f'"{path}"' for path in paths)
    turn = quaternions.matrices(Z_UP if up == "z" else np.array([1.0, 0.0, 0.0, 0.0]))
    rest = []
    for joint, place in enumerate(moved.offsets):
        matrix = np.eye(4)
        matrix[3, :3] = place
        matrix[:3, :3] = turn.T if joint == 0 else np.eye(3)
        rest.append("( " + ", ".join(_tuple(row) for row in matrix) + " )")

    def samples(values: Floats) -> str:
        frames = (f"{i}: [{', '.join(map(_tuple, frame))}]" for i, frame in enumerate(values))
        return "{ " + ", ".join(frames) + " }"

    places = np.repeat(moved.offsets[None], len(moved.root), axis=0)
    places[:, 0] = moved.root
    lines = [
        "#usda 1.0",
        "(",
        f'    defaultPrim = "Root"\n    metersPerUnit = {metres_per_unit!r}\n    upAxis = "{up.upper()}"',
        f"    timeCodesPerSecond = {body.rate!r}\n    startTimeCode = 0\n    endTimeCode = {len(moved.root) - 1}",
        ")",
        f'def SkelRoot "Root"{f" (references = @{reference}@)" if reference else ""}\n{{',
        '    def Skeleton "Skel" (prepend apiSchemas = ["SkelBindingAPI"])\n    {',
        f"        uniform token[] joints = [{joints}]",
        f"        uniform matrix4d[] bindTransforms = [{', '.join(rest)}]",
        f"        uniform matrix4d[] restTransforms = [{', '.join(rest)}]",
        "        rel skel:animationSource = </Root/Anim>\n    }",
        '    def SkelAnimation "Anim"\n    {',
        f"        uniform token[] joints = [{joints}]",
        f"        half3[] scales = [{', '.join(['(1, 1, 1)'] * len(paths))}]",
        f"        float3[] translations.timeSamples = {samples(places)}",
        f"        quatf[] rotations.timeSamples = {samples(moved.rotations)}",
        "    }\n}",
    ]
    return "\n".join([*lines, ""]).encode()


def _tuple(numbers: Floats) -> str:
    return f"({', '.join(f'{number:.9g}' for number in numbers.tolist())})"
