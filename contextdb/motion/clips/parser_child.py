"""The child process that reads FBX or USD: one file after another, of which it hands back arrays. It imports nothing of ours.

    python parser_child.py fbx FOLDER      (or usd; the folder is for its files, and goes with it)

A request on standard input is a line of JSON, `{"size", "take", "joints", "frame_joints", "seconds"}`, the last three the most that
may be, and the bytes of the file. An answer on standard output is one line of
JSON: `{"fault": text}`, or `{"names", "parents", "deforms", "rate", "frames"}` and float64 matrices [J, 4, 4] at rest and
[F, J, 4, 4] in the world, metres, y up. Before it `{"done": n, "of": m}` says that the process is alive.
What kills this process kills no other.
"""

from __future__ import annotations

import json
import os
import re
import shutil
import signal
import sys
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from typing import Any

import numpy as np
from numpy.typing import NDArray

USUAL_RATE = 30.0
MOST_MEMORY = 3 << 29
"""Bytes that this process may take with a small file, of which a library needs 1.1e9; a large one so many times its size more."""
TIMES_MEMORY = 24

HELD: list[Any] = []
"""What ufbx gave, never to be let go: its binding counts one reference too few of what an object led to when that object goes. The
process ends before this is much."""

Floats = NDArray[np.float64]
Tell = Callable[[int, int], None]
Joints = tuple[list[str], list[int], Any, Any, float, Floats, Floats | None, Floats]
"""Names, parents, which are joints, which deform, the rate, and places: at rest, of nodes as they stand (None: all places are in
the world already), and of frames."""


class Refusal(Exception):
    """What is wrong with a file, in a sentence."""


def fbx(content: bytes, take: int, most: int, tell: Tell) -> Joints:
    """The bones of an FBX file, against their parents."""
    import ufbx

    scene = ufbx.load_memory(
        content,
        target_axes=ufbx.axes_right_handed_y_up,
        target_unit_meters=1.0,
        ignore_geometry=False,
        ignore_embedded=True,
        skip_mesh_parts=True,
        inherit_mode_handling=ufbx.InheritModeHandling.HELPER_NODES,
        node_depth_limit=1000,
    )
    nodes, stacks, settings = list(scene.nodes), list(scene.anim_stacks), scene.settings
    HELD.extend((scene, nodes, stacks, settings))
    if not stacks:
        raise Refusal("there is no animation.")
    if take >= len(stacks):
        raise Refusal(f"there are {len(stacks)} takes, and take {take + 1} is wanted.")
    stack, rate = stacks[take], settings.frames_per_second
    rate = rate if 1.0 <= rate <= 1e4 else USUAL_RATE
    n_frames = frames_of(stack.time_end - stack.time_begin, rate, len(nodes), most)
    ids = {node.typed_id: i for i, node in enumerate(nodes)}
    tell(0, n_frames)
    rest = np.array([of_transform(node.local_transform) for node in nodes]).reshape(-1, 4, 4)
    anim = stack.anim
    baked = ufbx.bake_anim(scene, anim, resample_rate=rate, maximum_sample_rate=rate, max_keyframe_segments=4096)
    HELD.extend((anim, baked))
    local = fbx_frames(baked, nodes, rest, stack.time_begin + np.arange(n_frames) / rate, tell)
    bound = fbx_bound(nodes, rest, ufbx.get_bone_pose)
    is_joint, deforms = fbx_joints(scene, nodes, ids)
    names = [node.name for node in nodes]
    return names, fbx_parents(nodes, ids), is_joint, deforms, rate, bound if usable(bound) else rest, rest, local


def fbx_parents(nodes: Sequence[Any], ids: Mapping[int, int]) -> list[int]:
    """The place of each node's parent, -1 for none."""
    parents = []
    for node in nodes:
        parent = node.parent
        parents.append(-1 if parent is None else ids[parent.typed_id])
    return parents


def fbx_frames(baked: Any, nodes: Sequence[Any], rest: Floats, at: Floats, tell: Tell) -> Floats:
    """Each node against its parent at some times: [F, N, 4, 4]."""
    ids = {node.typed_id: i for i, node in enumerate(nodes)}
    local = np.repeat(rest[None], len(at), axis=0)
    for own in list(baked.nodes):
        node = ids.get(own.typed_id)
        if node is None:
            continue
        usual = nodes[node].local_transform
        places = sampled(own.translation_keys, at, usual.translation)
        turns = sampled(own.rotation_keys, at, usual.rotation)
        local[:, node] = matrices(places, turns, sampled(own.scale_keys, at, usual.scale))
        tell(node, len(nodes))
    return local


def fbx_bound(nodes: Sequence[Any], rest: Floats, bone_pose_of: Callable[[Any, Any], Any]) -> Floats:
    """Each node against its parent as skins were bound to it; as it rests where no pose says it."""
    bound = rest.copy()
    for i, node in enumerate(nodes):
        pose = node.bind_pose
        bone = None if pose is None else bone_pose_of(pose, node)
        HELD.extend((pose, bone))
        if bone is not None:
            bound[i, :3] = np.array(bone.bone_to_parent, np.float64).T
    return bound


def fbx_joints(scene: Any, nodes: Sequence[Any], ids: Mapping[int, int]) -> tuple[Any, Any]:
    """Which nodes are joints, and on which of them a skin hangs."""
    is_bone = np.array([node.bone is not None for node in nodes])
    deforms = np.zeros(len(nodes), bool)
    clusters = list(scene.skin_clusters)
    HELD.append(clusters)
    for cluster in clusters:
        bone = cluster.bone_node
        if bone is not None and cluster.num_weights and bone.typed_id in ids:
            deforms[ids[bone.typed_id]] = True
    if not is_bone.any():  # some exporters write joints as empty nodes
        plain = (node.parent is not None and not (node.mesh or node.camera or node.light) for node in nodes)
        is_bone = np.fromiter(plain, bool, len(nodes))
    return is_bone | deforms, deforms


def of_transform(transform: Any) -> Floats:
    """A place, a turn and a size as a matrix [4, 4]."""
    place, turn, size = transform.translation, transform.rotation, transform.scale
    return np.asarray(matrices(np.array([list(place)]), np.array([list(turn)]), np.array([list(size)]))[0])


def usable(rest: Floats) -> bool:
    """Whether matrices are finite, and none scales to nothing."""
    return bool(np.isfinite(rest).all() and (np.abs(np.linalg.det(rest)) > 1e-18).all())


def sampled(keys: Any, at: Floats, usual: Any) -> Floats:
    """Keys of a track at some times: [F, 3], or rotations [F, 4]."""
    listed = [(key.time, *key.value) for key in keys]
    if not listed:
        return np.repeat(np.array([list(usual)]), len(at), axis=0)
    table = np.array(listed)
    times, values = table[:, 0], table[:, 1:]
    before = np.clip(np.searchsorted(times, at + 1e-6, side="right") - 1, 0, len(times) - 1)
    after = np.minimum(before + 1, len(times) - 1)
    step = np.where(times[after] > times[before], times[after] - times[before], 1.0)
    share = np.clip((at - times[before]) / step, 0.0, 1.0)[:, None]
    first, second = values[before], values[after]
    if values.shape[1] == 4:
        second = np.where((first * second).sum(axis=1, keepdims=True) < 0.0, -second, second)
    return np.asarray(first * (1.0 - share) + second * share)


def matrices(places: Floats, turns: Floats, sizes: Floats) -> Floats:
    """Matrices [F, 4, 4] of places, rotations (x, y, z, w) of any length, and sizes."""
    x, y, z, w = (turns / np.linalg.norm(turns, axis=1, keepdims=True)).T
    rows = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
        [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
        [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
    ]
    whole = np.zeros((len(places), 4, 4))
    whole[:, :3, :3] = np.moveaxis(np.array(rows), 2, 0) * sizes[:, None, :]
    whole[:, :3, 3] = places
    whole[:, 3, 3] = 1.0
    return whole


def usd(content: bytes, take: int, most: int, tell: Tell) -> Joints:
    """The joints of the largest skeleton that moves in a USD file, in the world."""
    from pxr import Sdf, Tf, Usd, UsdGeom, UsdSkel

    is_crate = content.startswith(b"PXR-USDC")
    if not is_crate:
        require_utf8(content)
    path = os.path.join(sys.argv[2], "clip.usdc" if is_crate else "clip.usda")
    try:
        with open(path, "wb") as file:
            file.write(content)
        layer = Sdf.Layer.FindOrOpen(path)
    except Tf.ErrorException as error:
        lines = re.findall(r"clip\.usda:(\d+):", text_of(error))
        raise Refusal(f"the file is damaged{f' in line {lines[-1]}' if lines else ''}.") from None
    finally:
        with suppress(OSError):  # a file that is mapped, on Windows
            os.remove(path)
    if layer is None:
        raise Refusal("the file is damaged, or no USD.")
    others = [name for name in layer.GetCompositionAssetDependencies() if name]
    if others:
        raise Refusal(f"the file refers to other files, such as {others[0]!r}: flatten it, by usdcat --flatten")
    stage = Usd.Stage.Open(layer)
    return usd_joints(stage, most, tell, Usd, UsdGeom, UsdSkel)


def require_utf8(content: bytes) -> None:
    """Refuse a text that is none, by the line: the library shows such bytes in messages that cannot be read."""
    try:
        content.decode()
    except UnicodeDecodeError as error:
        line = content.count(b"\n", 0, error.start) + 1
        raise Refusal(f"line {line} is not UTF-8.") from None


def usd_joints(stage: Any, most: int, tell: Tell, Usd: Any, UsdGeom: Any, UsdSkel: Any) -> Joints:
    """The joints of the skeleton of a stage, in the world."""
    prim, query = usd_skeleton(stage, Usd, UsdSkel)
    moves, rate = query.GetAnimQuery(), stage.GetTimeCodesPerSecond()
    if not moves:
        raise Refusal("nothing moves the skeleton.")
    if not 1.0 <= rate <= 1e4:
        raise Refusal(f"the file has {rate:g} time codes a second.")
    paths = [str(path) for path in query.GetJointOrder()]
    times = sorted({*moves.GetJointTransformTimeSamples()}) or [0.0]
    step = float(np.median(np.diff(times))) if len(times) > 1 else 1.0
    step = step if step > 1e-6 else 1.0
    codes = np.minimum(times[0] + step * np.arange(frames_of((times[-1] - times[0]) / step, 1.0, len(paths), most)), times[-1])
    index = {path: i for i, path in enumerate(paths)}
    parents = [index.get(path.rpartition("/")[0], -1) for path in paths]
    if len(in_order(parents)) < len(parents):
        raise Refusal("a joint is above itself.")
    unit = UsdGeom.GetStageMetersPerUnit(stage)
    upright = np.eye(4) * [unit, unit, unit, 1.0]
    if UsdGeom.GetStageUpAxis(stage) == UsdGeom.Tokens.z:
        upright = np.array([[1.0, 0, 0, 0], [0, 0, 1, 0], [0, -1, 0, 0], [0, 0, 0, 1]]) @ upright

    def above(code: float) -> Floats:
        return np.asarray(upright @ np.array(UsdGeom.XformCache(Usd.TimeCode(code)).GetLocalToWorldTransform(prim)).T)

    frames = np.empty((len(codes), len(paths), 4, 4))
    for frame, code in enumerate(codes.tolist()):
        joints = np.array(query.ComputeJointSkelTransforms(Usd.TimeCode(code))).transpose(0, 2, 1)
        if joints.shape != (len(paths), 4, 4):
            raise Refusal("the animation does not fit the skeleton.")
        frames[frame] = above(code) @ joints
        if frame % 64 == 0:
            tell(frame, len(codes))
    given = np.array(UsdSkel.Skeleton(prim).GetRestTransformsAttr().Get())
    local = given.transpose(0, 2, 1) if given.shape == (len(paths), 4, 4) else None
    rest = frames[0].copy()
    if local is not None and usable(local):
        for joint in in_order(parents):
            rest[joint] = (above(times[0]) if parents[joint] < 0 else rest[parents[joint]]) @ local[joint]
    names, every = [path.rpartition("/")[2] for path in paths], np.ones(len(paths), bool)
    return names, parents, every, every, rate / step, rest, None, frames


def usd_skeleton(stage: Any, Usd: Any, UsdSkel: Any) -> tuple[Any, Any]:
    """The skeleton with most joints of those that move, else of all; and what answers about it."""
    cache, best = UsdSkel.Cache(), None
    for prim in stage.Traverse():
        if prim.IsA(UsdSkel.Root):
            cache.Populate(UsdSkel.Root(prim), Usd.PrimDefaultPredicate)
    for prim in stage.Traverse():
        if prim.IsA(UsdSkel.Skeleton):
            query = cache.GetSkelQuery(UsdSkel.Skeleton(prim))
            moves = query.GetAnimQuery() if query else None
            if query and (best is None or (bool(moves), len(query.GetJointOrder())) > best[0]):
                best = (bool(moves), len(query.GetJointOrder())), prim, query
    if best is None:
        raise Refusal("there is no skeleton.")
    return best[1:]


def frames_of(duration_s: float, rate: float, n_joints: int, most: int) -> int:
    """How many frames there are; a refusal of more joints in all than can be meant."""
    if not 0.0 <= duration_s * rate * n_joints <= most:
        raise Refusal(f"{duration_s:g} s of {n_joints} joints at {rate:g} frames a second are too much, or nothing.")
    return round(duration_s * rate) + 1


def words_of(error: Exception) -> str:
    """What to add about an exception; nothing where a library names its own sources."""
    return "" if type(error).__module__.startswith("pxr") else f" ({type(error).__name__}: {text_of(error)[:200]})"


def text_of(error: Exception) -> str:
    """What an exception of a library says, in one line; nothing where its text is none."""
    try:
        return " ".join(str(error).split())
    except UnicodeDecodeError:
        return ""


def in_order(parents: Sequence[int]) -> list[int]:
    """The joints, a parent before its children."""
    children: list[list[int]] = [[] for _ in parents]
    for joint, parent in enumerate(parents):
        if parent >= 0:
            children[parent].append(joint)
    order = [joint for joint, parent in enumerate(parents) if parent < 0]
    for joint in order:
        order += children[joint]
    return order


def in_world(
    names: list[str],
    parents: list[int],
    is_joint: Any,
    deforms: Any,
    rate: float,
    bound: Floats,
    rest: Floats | None,
    local: Floats,
) -> tuple[dict[str, Any], Floats, Floats]:
    """The joints that count alone, in the world; what is above and between them is in their places."""
    if rest is not None:
        for node in in_order(parents):
            if parents[node] >= 0:
                bound[node] = bound[parents[node]] @ bound[node]
                local[:, node] = local[:, parents[node]] @ local[:, node]
    joints = [i for i in range(len(names)) if is_joint[i]]
    rank = {joint: i for i, joint in enumerate(joints)}
    nearest = {-1: -1}  # of each node the joint that it is, or that is next above it
    for node in in_order(parents):
        nearest[node] = rank.get(node, nearest[parents[node]])
    above = [nearest[parents[joint]] for joint in joints]
    about = {"names": [names[i] for i in joints], "parents": above, "deforms": [bool(deforms[i]) for i in joints]}
    return {**about, "rate": float(rate), "frames": len(local)}, bound[joints], local[:, joints]


def limit_memory(size: int) -> None:
    """Let this process take no more memory than a file of a size may need."""
    try:
        import resource
    except ImportError:  # Windows
        return
    hard = resource.getrlimit(resource.RLIMIT_AS)[1]
    wanted = MOST_MEMORY + TIMES_MEMORY * size
    with suppress(ValueError, OSError):
        resource.setrlimit(resource.RLIMIT_AS, (wanted if hard < 0 else min(wanted, hard), hard))


def limit_time(seconds: float) -> None:
    """End this process by a signal when it has worked for longer; 0 takes that back."""
    if hasattr(signal, "setitimer"):
        signal.setitimer(signal.ITIMER_PROF, seconds)


def main() -> None:
    """Answer requests until standard input ends."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # whoever started this decides
    answers = os.fdopen(os.dup(1), "wb")
    os.dup2(os.open(os.devnull, os.O_WRONLY), 1)  # libraries may print
    read = {"fbx": fbx, "usd": usd}[sys.argv[1]]

    def answer(document: dict[str, Any], *arrays: Floats) -> None:
        """Write a line, and arrays behind it."""
        answers.write(json.dumps(document).encode() + b"\n")
        for array in arrays:
            answers.write(np.ascontiguousarray(array, "<f8").tobytes())
        answers.flush()

    for line in iter(sys.stdin.buffer.readline, b""):
        wanted = json.loads(line)
        content = sys.stdin.buffer.read(wanted["size"])
        limit_memory(wanted["size"])
        limit_time(wanted["seconds"])
        try:
            joints = read(content, wanted["take"], wanted["frame_joints"], lambda done, of: answer({"done": done, "of": of}))
            about, rest, frames = in_world(*joints)
            if len(rest) > wanted["joints"]:
                raise Refusal(f"there are {len(rest):,} joints, and at most {wanted['joints']:,} are read.")
        except ImportError:
            answer({"missing": True})
        except MemoryError:
            answer({"fault": "the file needs more memory than a file of its size may."})
        except Refusal as refusal:
            answer({"fault": str(refusal)})
        except Exception as error:  # whatever the libraries raise
            answer({"fault": f"the file is damaged{words_of(error)}."})
        else:
            answer(about, rest, frames)
        limit_time(0.0)


if __name__ == "__main__":
    try:
        main()
    finally:
        shutil.rmtree(sys.argv[2], ignore_errors=True)
