"""glTF and GLB files: nodes, skins and animations, as joints in the world. Needs nothing but numpy; external buffers are read too.

`packed` makes one file of a `.gltf` and its buffers; the rest speaks of such bytes alone and touches no disk. Every number that
the file gives is checked against what there is before it is used.

Source: Khronos Group, glTF 2.0 Specification.
"""

from __future__ import annotations

import base64
import binascii
import json
import struct
from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from typing import Any
from urllib.parse import unquote

import numpy as np
from numpy.typing import NDArray

from contextdb.disk import read_bytes
from contextdb.disk.boundary import inside
from contextdb.errors import ClipError, ContextDBError, Fault, Place, in_quotes
from contextdb.motion.clips import quaternions
from contextdb.motion.clips.clip import Clip
from contextdb.motion.clips.joint_arrays import MOST_FRAME_JOINTS, MOST_JOINTS, depth_first, most_frame_joints
from contextdb.motion.clips.joint_worlds import JointWorlds, numbered
from contextdb.motion.clips.quaternions import Floats

MAGIC = b"glTF"
JSON_CHUNK, BINARY_CHUNK = b"JSON", b"BIN\0"
TYPES = {5120: np.int8, 5121: np.uint8, 5122: np.int16, 5123: np.uint16, 5125: np.uint32, 5126: np.float32}
WIDTHS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4, "MAT4": 16}
PATHS = {"translation": 3, "rotation": 4, "scale": 3}
RATE = 30.0
"""Frames a second of an animation whose keys have no rate of a recording."""
LEAST_RATE, LARGEST_RATE = 10.0, 480.0
MOST_DEPTH = 200
"""Braces within each other; a plain list of numbers and names needs ten."""


def is_gltf(content: bytes) -> bool:
    """Whether bytes begin as GLB, or as an object of JSON."""
    return content.startswith(MAGIC) or content[:64].removeprefix(b"\xef\xbb\xbf").lstrip().startswith(b"{")


def packed(content: bytes, path: Path) -> bytes:
    """The bytes of a file with those of the buffers that it names, which are in its folder or below. Raises ClipError."""
    if content.startswith(MAGIC):
        return content
    try:
        document = _json(content)
    except ClipError as error:
        raise ClipError(*(fault.at(Place(str(path))) for fault in error.faults)) from None
    parts = [content]
    for buffer in _list(document, "buffers"):
        uri = buffer.get("uri") if isinstance(buffer, dict) else None
        if isinstance(uri, str) and not uri.startswith("data:"):
            name = unquote(uri)
            if not name or "\0" in name or "://" in name:
                fault = Fault(f"the buffer {in_quotes(uri)} is no file of this folder.", "a file beside it", place=Place(str(path)))
                raise ClipError(fault)
            try:
                parts.append(read_bytes(inside(path.parent / name, path.parent)))
            except ContextDBError as error:
                named = (replace(each, found=f"the buffer {in_quotes(uri)}: {each.found}") for each in error.faults)
                raise ClipError(*(replace(each, place=Place(str(path))) for each in named)) from None
    if len(parts) == 1:
        return content
    head = b"".join(struct.pack("<Q", len(part)) for part in parts)
    return _PACKED + struct.pack("<I", len(parts)) + head + b"".join(parts)


_PACKED = MAGIC + b"+files\0"


def takes(content: bytes, file: str) -> tuple[str, ...]:
    """The names of the animations, one after another; those without a name by their number."""
    try:
        animations = _list(_json(_split(content)[0]), "animations")
    except ContextDBError as error:
        raise ClipError(*(fault.at(Place(file)) for fault in error.faults)) from None
    names = [each.get("name") if isinstance(each, dict) else None for each in animations]
    listed = [name if isinstance(name, str) and name else f"take {i}" for i, name in enumerate(names, start=1)]
    return numbered(listed)


def read(content: bytes, take: int, name: str, file: str) -> Clip:
    """The clip of an animation, from 0. Raises ClipError."""
    try:
        return _File.of(content).worlds(take).clip(name)
    except ContextDBError as error:
        raise ClipError(*(fault.at(Place(file)) for fault in error.faults)) from None
    except (KeyError, TypeError, IndexError, ValueError, AttributeError, OverflowError, MemoryError) as error:
        problem = f"the file does not follow glTF 2.0 ({type(error).__name__})."
        raise ClipError(Fault(problem, "a whole file", "to export it again", Place(file))) from None


class _File:
    """The document of a file and its buffers."""

    def __init__(self, document: dict[str, Any], buffers: list[bytes]) -> None:
        self.document = document
        self.buffers = buffers
        self.nodes = _list(document, "nodes")

    @classmethod
    def of(cls, content: bytes) -> _File:
        raw, outer, binary = _split(content)
        document, buffers, files = _json(raw), [], iter(outer)
        for buffer in _list(document, "buffers"):
            uri = buffer.get("uri") if isinstance(buffer, dict) else None
            if uri is None:
                buffers.append(binary)
            elif isinstance(uri, str) and uri.startswith("data:"):
                try:
                    buffers.append(base64.b64decode(uri.partition(",")[2], validate=True))
                except (binascii.Error, ValueError):
                    raise _refused("a buffer in the file is no base64.") from None
            else:
                part = next(files, None)
                if part is None:
                    raise _refused("a .glb file names a buffer that is not in it.", "one .glb file with all in it")
                buffers.append(part)
        return cls(document, buffers)

    def array(self, number: int) -> Floats:
        """The numbers of an accessor, [count, width]; normalised integers become -1 to 1."""
        accessor = _list(self.document, "accessors")[_index(number)]
        dtype, width = np.dtype(TYPES[accessor["componentType"]]), WIDTHS[accessor["type"]]
        count = _index(accessor["count"])
        if "sparse" in accessor:
            raise _refused("an animation has sparse accessors.", "plain ones", "to export it without compression")
        if "bufferView" not in accessor:
            return np.zeros((min(count, MOST_FRAME_JOINTS), width))
        view = _list(self.document, "bufferViews")[_index(accessor["bufferView"])]
        if "EXT_meshopt_compression" in view.get("extensions", {}):
            raise _refused("the animation is compressed (EXT_meshopt_compression).", "plain buffers", "to export it without")
        data = self.buffers[_index(view["buffer"])]
        first = _index(view.get("byteOffset", 0)) + _index(accessor.get("byteOffset", 0))
        stride = _index(view.get("byteStride", 0)) or dtype.itemsize * width
        end = first + stride * (count - 1) + dtype.itemsize * width
        if count and end > len(data):
            raise _refused(f"an accessor ends at byte {end:,} of a buffer of {len(data):,}.")
        shape, strides = (count, width), (stride, dtype.itemsize)
        values: NDArray[Any] = np.ndarray(shape, dtype, data, first, strides) if count else np.zeros(shape, dtype)
        numbers = values.astype(np.float64)
        if accessor.get("normalized") and dtype.kind in "iu":
            numbers = np.maximum(numbers / float(2 ** (8 * dtype.itemsize - (dtype.kind == "i")) - 1), -1.0)
        if not np.isfinite(numbers).all():
            raise _refused("an accessor holds numbers that are not finite.")
        return numbers

    def parents(self) -> NDArray[np.int64]:
        parents = np.full(len(self.nodes), -1, np.int64)
        for node, each in enumerate(self.nodes):
            for child in _list(each, "children"):
                if not 0 <= _index(child) < len(parents) or parents[child] >= 0 or child == node:
                    raise _refused(f"node {child} is below two nodes, or there is none.")
                parents[child] = node
        if len(depth_first(parents)) < len(parents):
            raise _refused("the nodes are no tree.")
        return parents

    def worlds(self, take: int) -> JointWorlds:
        """The joints of the skins, else the nodes that move and what is above them, of an animation."""
        if len(self.nodes) > MOST_JOINTS:
            raise _refused(f"there are {len(self.nodes):,} nodes.", f"at most {MOST_JOINTS:,}")
        animations = _list(self.document, "animations")
        if not animations:
            raise _refused("there is no animation.", "an animation", "to export with animations")
        tracks = self._tracks(animations[take])
        times = sorted({float(t) for each, _, _ in tracks.values() for t in each[[0, -1]]})
        rate = _rate([each for each, _, _ in tracks.values()])
        start, stop = (times[0], times[-1]) if times else (0.0, 0.0)
        n_frames = round((stop - start) * rate) + 1
        parents = self.parents()
        most = most_frame_joints(sum(map(len, self.buffers)))
        if n_frames * len(self.nodes) > most:
            raise _refused(f"{n_frames:,} frames of {len(self.nodes):,} nodes are too many for its size.", f"{most:,} in all")
        at = np.minimum(start + np.arange(n_frames) / rate, stop)
        rest_local = np.array([_local(node) for node in self.nodes]).reshape(-1, 4, 4)
        local = np.repeat(rest_local[None], n_frames, axis=0)
        for node in {node for node, _ in tracks}:
            parts = _parts(self.nodes[node])
            for path in PATHS:
                if (node, path) in tracks:
                    parts[path] = _sampled(*tracks[node, path], at, path == "rotation")
            local[:, node] = _matrices(**parts)
        frames, rest = local, rest_local
        for node in depth_first(parents).tolist():
            if parents[node] >= 0:
                frames[:, node] = frames[:, parents[node]] @ frames[:, node]
                rest[node] = rest[parents[node]] @ rest[node]
        joints, deforms = self._joints(parents, {node for node, _ in tracks})
        rank = np.full(len(parents) + 1, -1, np.int64)
        rank[joints] = np.arange(len(joints))
        names = [str(self.nodes[joint].get("name") or f"node {joint}") for joint in joints.tolist()]
        return JointWorlds(names, rank[parents[joints]], rest[joints], frames[:, joints], deforms[joints], rate)

    def _tracks(self, animation: Any) -> dict[tuple[int, str], tuple[Floats, Floats, str]]:
        tracks = {}
        for channel in _list(animation, "channels"):
            target = channel["target"]
            path, node = target.get("path"), target.get("node")
            if path not in PATHS or node is None:
                continue
            if not 0 <= _index(node) < len(self.nodes):
                raise _refused(f"an animation moves node {node}, and there is none.")
            sampler = _list(animation, "samplers")[_index(channel["sampler"])]
            times, values = self.array(sampler["input"])[:, 0], self.array(sampler["output"])
            how = sampler.get("interpolation", "LINEAR")
            per_key = 3 if how == "CUBICSPLINE" else 1
            if not len(times) or values.shape != (per_key * len(times), PATHS[path]) or (np.diff(times) <= 0.0).any():
                raise _refused(f"a track of node {node} has {len(times)} times for values {list(values.shape)}.", "a value a time")
            tracks[node, path] = times, values.reshape(len(times), per_key, -1), how
        return tracks

    def _joints(self, parents: NDArray[np.int64], moved: set[int]) -> tuple[NDArray[np.int64], NDArray[np.bool_]]:
        """Which nodes are joints, and on which of all nodes a skin hangs."""
        deforms = np.zeros(len(parents), bool)
        for skin in _list(self.document, "skins"):
            joints = [_index(joint) for joint in _list(skin, "joints")]
            if any(joint >= len(parents) for joint in joints):
                raise _refused("a skin has a joint that is no node.")
            deforms[joints] = True
        below = deforms.copy()
        if not deforms.any():
            below[list(moved)] = True
        above, order = below.copy(), depth_first(parents).tolist()
        for node in order:
            below[node] |= parents[node] >= 0 and below[parents[node]]
        for node in reversed(order):
            above[parents[node]] |= parents[node] >= 0 and above[node]
        return np.flatnonzero(below & above if deforms.any() else below), deforms


def _local(node: Any) -> Floats:
    """A node against its parent: [4, 4]."""
    if "matrix" in node:
        matrix = np.array(node["matrix"], np.float64).reshape(4, 4).T
        if not np.isfinite(matrix).all():
            raise _refused("the matrix of a node is not finite.")
        return matrix
    return np.asarray(_matrices(**_parts(node))[0])


def _parts(node: Any) -> dict[str, Floats]:
    """Translation, rotation (x, y, z, w) and scale of a node, as tracks of one frame."""
    usual = {"translation": [0.0, 0.0, 0.0], "rotation": [0.0, 0.0, 0.0, 1.0], "scale": [1.0, 1.0, 1.0]}
    return {path: np.array([node.get(path, usual[path])], np.float64).reshape(1, PATHS[path]) for path in PATHS}


def _matrices(translation: Floats, rotation: Floats, scale: Floats) -> Floats:
    lengths = np.linalg.norm(rotation, axis=-1, keepdims=True)
    if not (np.isfinite(lengths).all() and lengths.all()):
        raise _refused("a rotation is 0, or not finite.")
    turns = quaternions.matrices((rotation / lengths)[:, [3, 0, 1, 2]])
    n = max(map(len, (translation, rotation, scale)))
    matrices = np.zeros((n, 4, 4))
    matrices[:, :3, :3] = turns * scale[:, None, :]
    matrices[:, :3, 3] = translation
    matrices[:, 3, 3] = 1.0
    return matrices


def _sampled(times: Floats, values: Floats, how: str, at: Floats, is_rotation: bool) -> Floats:
    """The values of a track [keys, 1 or 3, width] at some times."""
    before = np.clip(np.searchsorted(times, at + 1e-6, side="right") - 1, 0, len(times) - 1)
    after = np.minimum(before + 1, len(times) - 1)
    step = np.where(after > before, times[after] - times[before], 1.0)
    share = np.clip((at - times[before]) / step, 0.0, 1.0)[:, None]
    if how == "STEP":
        return np.asarray(values[before, 0])
    if how == "CUBICSPLINE":
        start, stop = values[before, 1], values[after, 1]
        leaves, arrives = values[before, 2] * step[:, None], values[after, 0] * step[:, None]
        twice, thrice = share**2, share**3
        eased = (2.0 * thrice - 3.0 * twice + 1.0) * start + (thrice - 2.0 * twice + share) * leaves
        return np.asarray(eased + (3.0 * twice - 2.0 * thrice) * stop + (thrice - twice) * arrives)
    start, stop = values[before, 0], values[after, 0]
    if is_rotation:
        return quaternions.blend(start, stop, share)
    return np.asarray(start * (1.0 - share) + stop * share)


def _rate(tracks: list[Floats]) -> float:
    """Frames a second: that of the keys of the track with most of them."""
    keys = max(tracks, key=len, default=np.zeros(1))
    step = float(np.median(np.diff(keys))) if len(keys) > 1 else 0.0
    rate = 1.0 / step if step > 1e-6 else RATE
    if not LEAST_RATE <= rate <= LARGEST_RATE:
        return RATE
    return float(round(rate)) if abs(rate - round(rate)) < 1e-3 * rate else rate


def _split(content: bytes) -> tuple[bytes, list[bytes], bytes]:
    """The document of a file, the buffers beside it and that in it."""
    if content.startswith(_PACKED):
        start = len(_PACKED) + 4
        (count,) = struct.unpack_from("<I", content, len(_PACKED))
        sizes = struct.unpack_from(f"<{count}Q", content, start)
        ends = np.cumsum([start + 8 * count, *sizes]).tolist()
        raw, *outer = (content[a:b] for a, b in pairwise(ends))
        return raw, outer, b""
    return _chunks(content) if content.startswith(MAGIC) else (content, [], b"")


def _chunks(content: bytes) -> tuple[bytes, list[bytes], bytes]:
    """The document and the buffer of a .glb file."""
    if len(content) < 20:
        raise _refused(f"the file ends after {len(content)} bytes.")
    _, version, length = struct.unpack_from("<4sII", content)
    if version != 2 or length > len(content):
        raise _refused(f"the file says version {version} and {length:,} bytes, and has {len(content):,}.", "glTF 2.0, a whole file")
    document, binary, at = None, b"", 12
    while at + 8 <= length:
        size, kind = struct.unpack_from("<I4s", content, at)
        chunk = content[at + 8 : at + 8 + size]
        if len(chunk) < size:
            raise _refused(f"a part of {size:,} bytes has {len(chunk):,}.", "a whole file")
        if kind == JSON_CHUNK and document is None:
            document = chunk
        elif kind == BINARY_CHUNK and not binary:
            binary = chunk
        at += 8 + size
    if document is None:
        raise _refused("there is no document in the file.", "a JSON part")
    return document, [], binary


def _json(raw: bytes) -> dict[str, Any]:
    deepest = depth = 0
    for byte in raw.translate(None, bytes(set(range(256)) - set(b"[]{}"))):
        depth += 1 if byte in b"[{" else -1
        deepest = max(deepest, depth)
    if deepest > MOST_DEPTH:
        raise _refused("the document is too deep.", f"at most {MOST_DEPTH} lists within each other")
    try:
        document = json.loads(raw.decode("utf-8-sig"))
    except (ValueError, RecursionError) as error:
        raise _refused(f"the document is no JSON ({type(error).__name__}).", "glTF 2.0") from None
    if not isinstance(document, dict) or not isinstance(document.get("asset"), dict):
        raise _refused("the document is no glTF: it has no asset.", "glTF 2.0")
    return document


def _list(of: Any, key: str) -> list[Any]:
    listed = of.get(key, []) if isinstance(of, dict) else None
    if not isinstance(listed, list):
        raise _refused(f"{in_quotes(key)} is no list.")
    return listed


def _index(value: Any) -> int:
    """A whole number from 0, such as one that names a part of the file."""
    if isinstance(value, bool) or not isinstance(value, int) or value < 0:
        raise _refused(f"{value!r} is where a whole number from 0 is expected.")
    return value


def _refused(problem: str, accepted: str = "glTF 2.0", mend: str = "to export it again") -> ClipError:
    return ClipError(Fault(problem, accepted, mend))
