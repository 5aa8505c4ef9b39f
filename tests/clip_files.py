"""Clips as files of other tools, written here as those tools write them: GLB, glTF, USD and arrays; ASCII FBX is in an example.

A `Moving` is a body as arrays, in metres with y up; each writer puts it into the unit and axis of its file.
"""

from __future__ import annotations

import base64
import csv
import json
import struct
import zlib
from collections.abc import Iterable, Iterator
from contextlib import suppress
from io import BytesIO
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from contextdb.motion.clips import quaternions
from contextdb.motion.clips.quaternions import Floats
from examples.mixamo.ascii_fbx import Z_UP, Moving
from examples.mixamo.ascii_fbx import fbx as fbx

BODY = Moving(
    ("Hips", "LeftFoot", "RightFoot"),
    [-1, 0, 0],
    np.array([[0.0, 0.9, 0.0], [0.1, -0.9, 0.0], [-0.1, -0.9, 0.0]]),
    np.tile(np.array([1.0, 0.0, 0.0, 0.0]), (4, 3, 1)),
    np.arange(12.0).reshape(4, 3),
    30.0,
)
"""A small body, to damage the files of."""


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


# ---- FBX with a skin, and binary FBX


def skinned(text: bytes, body: Moving) -> bytes:
    """ASCII FBX of ours in centimetres with a triangle that hangs on every bone, and the pose in which it was bound."""
    places = 100.0 * body.offsets
    for joint, parent in enumerate(body.parents):
        places[joint] += places[parent] if parent >= 0 else 0.0

    def array(key: str, values: Iterable[object], n: int) -> list[str]:
        return [f"{key}: *{n} {{", f"a: {','.join(map(str, values))}", "}"]

    def matrix(key: str, place: Floats) -> list[str]:
        return array(key, [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, *place.tolist(), 1], 16)

    lines = ['Geometry: 700000, "Geometry::m", "Mesh" {', *array("Vertices", range(9), 9)]
    lines += [*array("PolygonVertexIndex", (0, 1, -3), 3), "}", 'Model: 700001, "Model::m", "Mesh" {', "Version: 232", "}"]
    lines += ['Deformer: 700002, "Deformer::s", "Skin" {', "Version: 101", "}", 'Pose: 700003, "Pose::b", "BindPose" {']
    lines += ['Type: "BindPose"', f"NbPoseNodes: {len(places)}"]
    for joint, place in enumerate(places):
        lines += ["PoseNode:  {", f"Node: {1_000 + joint}", *matrix("Matrix", place), "}"]
    lines.append("}")
    links = ['C: "OO",700001,0', 'C: "OO",700000,700001', 'C: "OO",700002,700000']
    for joint, place in enumerate(places):
        lines += [f'Deformer: {710_000 + joint}, "SubDeformer::c", "Cluster" {{', "Version: 100", *array("Indexes", (0, 1, 2), 3)]
        lines += [*array("Weights", (1, 1, 1), 3), *matrix("Transform", -place), *matrix("TransformLink", place), "}"]
        links += [f'C: "OO",{710_000 + joint},700002', f'C: "OO",{1_000 + joint},{710_000 + joint}']
    objects, connections = "\n".join(lines).encode(), "\n".join(links).encode()
    return text.replace(b"}\nConnections:  {\n", b"\n" + objects + b"\n}\nConnections:  {\n" + connections + b"\n")


ARRAYS = {"KeyTime": ("l", "<i8"), "KeyValueFloat": ("f", "<f4"), "KeyAttrFlags": ("i", "<i4"), "KeyAttrRefCount": ("i", "<i4")}
"""Letter and type of the numbers of an array, by its name; the others are of floats."""


def binary_fbx(text: bytes) -> bytes:
    """Binary FBX 7.4 of an ASCII one of ours: its nodes, one after another, each with where it ends."""
    out = bytearray(b"Kaydara FBX Binary  \0\x1a\0" + struct.pack("<I", 7400))
    _binary_nodes((line.strip() for line in text.decode().split("\n")), out)
    return bytes(out + bytes(13))


def _binary_nodes(lines: Iterator[str], out: bytearray) -> None:
    """The nodes up to the brace that closes them."""
    for line in lines:
        if line == "}":
            return
        if not line or line.startswith(";"):
            continue
        name, rest = line.split(":", 1)
        opens = rest.endswith("{")
        values = rest.removesuffix("{").strip()
        if is_array := values.startswith("*"):
            letter, dtype = ARRAYS.get(name, ("f", "<f4"))
            raw = np.array(next(lines).removeprefix("a: ").split(","), np.float64).astype(dtype).tobytes()
            packed = zlib.compress(raw)
            parts = [letter.encode() + struct.pack("<III", int(values[1:]), 1, len(packed)) + packed]
            assert next(lines) == "}"
        else:
            parts = [_binary_value(text) for text in next(csv.reader([values], skipinitialspace=True), [])]
        start, properties = len(out), b"".join(parts)
        out += struct.pack("<IIIB", 0, len(parts), len(properties), len(name)) + name.encode() + properties
        if opens and not is_array:
            _binary_nodes(lines, out)
            out += bytes(13)
        struct.pack_into("<I", out, start, len(out))


def _binary_value(text: str) -> bytes:
    try:
        return b"L" + struct.pack("<q", int(text))
    except ValueError:
        with suppress(ValueError):
            return b"D" + struct.pack("<d", float(text))
    kind, _, name = text.rpartition("::")
    raw = (f"{name}\0\1{kind}" if kind else text).encode()
    return b"S" + struct.pack("<I", len(raw)) + raw


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


def usdc(text: bytes) -> bytes:
    """The same stage as a crate."""
    from pxr import Sdf

    layer = Sdf.Layer.CreateAnonymous(".usda")
    layer.ImportFromString(text.decode())
    with TemporaryDirectory() as folder:
        layer.Export(f"{folder}/clip.usdc")
        return Path(folder, "clip.usdc").read_bytes()


def _tuple(numbers: Floats) -> str:
    return f"({', '.join(f'{number:.9g}' for number in numbers.tolist())})"
