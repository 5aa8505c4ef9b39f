"""Mirroring: the same motion with left and right exchanged.

A mirrored body is its reflection in the plane x = 0, with the bones of each pair exchanged, so that its left hand does what the
right one did. Poses, paths and the features computed from them are those of a clip played in a mirror.

    position of bone b in the world     (-x, y, z) of the position of its partner
    rotation of bone b in the world     M R M D, of its partner's rotation R, where M reflects x; of a quaternion, M q M is
                                        (w, x, -y, -z), and D is a turn of the bone about itself, the same in every pose
    heading                             -heading

A bone without a partner is its own. M R M means that the bone's y and z axes are the mirror images of its partner's, and its x axis
the opposite of the image of its partner's. That is what a skeleton wants whose bones are at rest aligned with the world, as in
most BVH files: D is nothing there. On others, whose right bones have axes unlike the left ones' images, D turns each bone so
that its children lie at the skeleton's own offsets: see `contextdb.motion.clips.mirror`.

A declared pair is two names, or two patterns with one `*` each, which matches the same rest of the name on both sides.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import TypeVar

import numpy as np

from contextdb.cells.arguments import require_kind, require_many, require_pair
from contextdb.errors import Fault, MotionError, in_quotes, mend_for, some
from contextdb.motion.clips import quaternions
from contextdb.motion.clips.poses import LocalPoses, Poses
from contextdb.motion.clips.quaternions import Floats, inverse, multiply, rotate
from contextdb.motion.clips.skeleton import POSITIONS, Ints, Skeleton, sided_pairs

Pairs = tuple[tuple[str, str], ...]
Moved = TypeVar("Moved", LocalPoses, Poses)

FLIPPED_X = np.array([-1.0, 1.0, 1.0])
FLIPPED_ROTATION = np.array([1.0, 1.0, -1.0, -1.0])
PLAIN = np.array([1.0, 0.0, 0.0, 0.0])


def mirrored(moved: Moved, pairs: Pairs) -> Moved:
    """The same poses in a mirror: local ones stay local, those in the world in the world; mirrored twice they are as they were.

    Local rotations fit the rig: with the skeleton's own offsets they place its bones where the mirror shows them, but for what its
    two sides differ by. With the local positions they place them there exactly.

    Parameters
    ----------
    moved : LocalPoses or Poses
    pairs : sequence of (left, right)
        Names or patterns of bones, as `[features.NAME]` declares them.

    Raises
    ------
    MotionError
        The pairs do not fit the skeleton; all faults together.
    ContextError
        `moved` are no poses, or `pairs` no pairs of names.
    """
    require_kind(moved, (LocalPoses, Poses), "moved", "LocalPoses or Poses")
    skeleton = moved.skeleton
    partners = partners_of(skeleton, pairs)
    turns = own_axes(skeleton, partners).turns
    positions, rotations = moved.positions[:, partners] * FLIPPED_X, moved.rotations[:, partners] * FLIPPED_ROTATION
    if (turns == PLAIN).all():
        return replace(moved, positions=positions, rotations=rotations)
    rotations = multiply(rotations, turns)
    if isinstance(moved, LocalPoses):
        children = np.flatnonzero(skeleton.parents >= 0)
        back = inverse(turns[skeleton.parents[children]])
        positions[:, children] = rotate(back, positions[:, children])
        rotations[:, children] = multiply(back, rotations[:, children])
    return replace(moved, positions=positions, rotations=rotations)


def partners_of(skeleton: Skeleton, pairs: Pairs) -> Ints:
    """The joint with which each changes places, its own number for one without a partner: int64 [J].

    Raises MotionError for a bone that the skeleton lacks (the nearest is reported), a pattern that fits no bone, a bone in two
    pairs, or bones whose parents do not change places as they do; ContextError where `skeleton` is none, or `pairs` are none.
    """
    require_kind(skeleton, Skeleton, "skeleton", "a Skeleton")
    accepted = 'pairs of names, such as ("LeftFoot", "RightFoot")'
    faults: list[Fault] = []
    partners = np.arange(skeleton.n_joints)
    for pair in require_many(pairs, "pairs", accepted):
        require_pair(pair, "one of pairs", accepted)
        for left, right in _named_by(pair, skeleton, faults):
            taken = [bone for bone in (left, right) if partners[skeleton.index(bone)] != skeleton.index(bone)]
            faults += [Fault(f"mirror: the bone {in_quotes(bone)} is in two pairs.", "each bone in one pair") for bone in taken]
            if not taken:
                a, b = skeleton.index(left), skeleton.index(right)
                partners[a], partners[b] = b, a
    faults += [] if faults else list(_unlike_parents(skeleton, partners))
    if faults:
        raise MotionError(*faults)
    return partners


def pattern_fault(left: str, right: str) -> str:
    """What is wrong with a declared pair, whatever the skeleton; empty when nothing is."""
    if left.count("*") > 1 or right.count("*") > 1:
        return "a name has more than one *"
    return "one name has a * and the other has none" if left.count("*") != right.count("*") else ""


def facing_fault(skeleton: Skeleton, partners: Ints, facing: tuple[str, str] | None) -> Fault | None:
    """A fault when the bones across which the body faces do not change places: it would look behind itself in the mirror."""
    pair = skeleton.facing_pair if facing is None else (skeleton.index(facing[0]), skeleton.index(facing[1]))
    if pair is None or partners[pair[0]] == pair[1]:
        return None
    left, right = (skeleton.names[joint] for joint in pair)
    problem = f"mirror: the body faces across {in_quotes(left)} and {in_quotes(right)}, which are not a pair."
    return Fault(problem, "pairs that hold these two bones", f'["{left}", "{right}"]')


def unevenness(skeleton: Skeleton, pairs: Pairs) -> dict[str, float]:
    """How far from where the mirror shows it, seen from its parent, each bone lies when mirrored rotations are played with the
    skeleton's own offsets: in the file's units, the farthest first, without those that lie there."""
    apart = own_axes(skeleton, partners_of(skeleton, pairs)).apart
    order = np.argsort(-apart, kind="stable")
    return {skeleton.names[joint]: float(apart[joint]) for joint in order.tolist() if apart[joint] > 0.0}


def undeclared(skeleton: Skeleton, schema: str) -> Fault:
    """What to say when a clip is to be mirrored and no pairs are declared."""
    guessed = sided_pairs(skeleton.names)
    mend = f'mirror = [["{guessed[0][0]}", "{guessed[0][1]}"], …]' if guessed else ""
    return Fault(f"[features.{schema}] declares no bone pairs to mirror by.", 'mirror = [["Left*", "Right*"]]', mend)


def _named_by(pair: tuple[str, str], skeleton: Skeleton, faults: list[Fault]) -> Iterator[tuple[str, str]]:
    """The pairs of bones that a declared pair names; what does not fit leaves a fault."""
    why = pattern_fault(*pair)
    rests = [_rests(side, skeleton.names) for side in pair]
    if why:
        faults.append(Fault(f"mirror: {_pair_text(pair)}: {why}.", '["Left*", "Right*"]'))
    elif "*" in pair[0] and not (rests[0] or rests[1]):
        faults.append(Fault(f"mirror: no bone fits {_pair_text(pair)}.", f"patterns for {some(skeleton.names)}"))
    else:
        for rest in dict.fromkeys(rests[0] + rests[1]) if "*" in pair[0] else [""]:
            left, right = (side.replace("*", rest) for side in pair)
            missing = [bone for bone in (left, right) if bone not in skeleton]
            faults += [_missing(bone, pair, skeleton) for bone in missing]
            if not missing:
                yield left, right


def _rests(pattern: str, names: tuple[str, ...]) -> list[str]:
    """What the * of a pattern matches in each name that fits it."""
    before, _, after = pattern.partition("*")
    long = len(before) + len(after)
    return [
        name[len(before) : len(name) - len(after)]
        for name in names
        if len(name) >= long and name.startswith(before) and name.endswith(after)
    ]


def _missing(bone: str, pair: tuple[str, str], skeleton: Skeleton) -> Fault:
    problem = f"mirror: {_pair_text(pair)} names the bone {in_quotes(bone)}, which does not exist."
    return Fault(problem, some(skeleton.names), mend_for(bone, skeleton.names), rule="unknown-bone")


def _unlike_parents(skeleton: Skeleton, partners: Ints) -> Iterator[Fault]:
    """Faults of bones whose parents do not change places as they do: their limbs would be torn apart."""
    for joint, parent in enumerate(skeleton.parents.tolist()):
        partner = int(partners[joint])
        wanted = int(partners[parent]) if parent >= 0 else -1
        if int(skeleton.parents[partner]) != wanted and joint <= partner:
            names = skeleton.names
            bone, other = in_quotes(names[joint]), in_quotes(names[partner])
            problem = f"mirror: {bone} is mirrored to {other}, but their parents do not change places as they do."
            above = "nothing" if wanted < 0 else in_quotes(names[wanted])
            yield Fault(problem, f"a bone below {above} as the partner of {bone}")


def _pair_text(pair: tuple[str, str]) -> str:
    return f'["{pair[0]}", "{pair[1]}"]'


# ---- the axes of bones in a mirror: how a mirrored bone must be turned about itself so that the rig's own offsets fit. M
# reflects x. A bone a whose children lie at the offsets o_b in its own axes is, in the mirror, at M R M of its partner's
# rotation R; that puts a child at M o_b' of the partner's child b', as the partner's axes are. Where the two bones have axes
# unlike each other's images, it wants a rotation D_a of its own before that, the same in every pose: R'_a = M R_a' M D_a with
# D_a o_b = M o_b' for every child b of a Mirrored twice, every bone is as it was. A bone whose children lie on one line may
# be turned about it and leaves them where they are. Of these turns the one nearest to its parent's is taken, as the pose at
# rest wants it. Where the line lies just the other way round than the parent's turn has it, a side whose offsets are the
# other's times -1 has its three axes the other way round, as riggers mirror joints so that equal angles move both sides
# alike; a bone in the middle is mirrored across one of its own axes. Source: the least squares fit of rotations, Kabsch 1976;
# for a bone that is its own partner M D is a reflection, and the fit is one of symmetric matrices

M = np.diag([-1.0, 1.0, 1.0])

ALONG = 0.02
"""Directions that differ by less, in radians, are one: offsets are written with few digits."""
EXACT_SHARE = 1e-7
"""Offsets that fit but for this share of the skeleton's size fit exactly."""
UNEVEN_SHARE = 0.1
"""Left and right offsets that differ by more than this share of their lengths do not fit; measured bodies differ by 0.04."""


@dataclass(frozen=True, eq=False)
class OwnAxes:
    """How each of the J bones of a skeleton is turned about itself in a mirror: `turns` float64 [J, 4] is D of each, as rotations;
    `apart` float64 [J] how far each joint lies from where the mirror shows it, seen from its parent, when the skeleton's offsets
    are retained, in the file's units."""

    turns: Floats
    apart: Floats


def own_axes(skeleton: Skeleton, partners: Ints) -> OwnAxes:
    """The axes of a skeleton's bones in a mirror: those that fit its offsets, and the world's where none do."""
    plain = np.broadcast_to(np.eye(3), (skeleton.n_joints, 3, 3))
    fitted = _fitted(skeleton, partners)
    even, better = (_apart(skeleton, partners, turns) for turns in (plain, fitted))
    size = np.linalg.norm(skeleton.offsets[fixed_joints(skeleton)], axis=1).sum()
    is_uneven = even.sum() > UNEVEN_SHARE * size
    takes = better.sum() <= (UNEVEN_SHARE if is_uneven else EXACT_SHARE) * size
    return OwnAxes(quaternions.from_matrices(fitted if takes else plain), better if takes else even)


def has_even_axes(skeleton: Skeleton, partners: Ints) -> bool:
    """Whether offsets from bone to bone are mirror images of their partners', as far as bodies are even."""
    offsets = skeleton.offsets[1:]
    apart = np.abs(offsets - skeleton.offsets[partners[1:]] @ M).sum()
    return bool(apart <= UNEVEN_SHARE * np.abs(offsets).sum())


def fixed_joints(skeleton: Skeleton) -> Ints:
    """The joints whose offsets are parts of the body: int64. Not those down to the hips that have positions of their own, which say
    where the body is."""
    above = [joint for joint in range(skeleton.n_joints) if joint == skeleton.hips or joint in skeleton.ancestors(skeleton.hips)]
    moving = {joint for joint in above if any(channel in POSITIONS for channel in skeleton.channels[joint])} | {0}
    return np.array([joint for joint in range(skeleton.n_joints) if joint not in moving], np.int64)


def _apart(skeleton: Skeleton, partners: Ints, turns: Floats) -> Floats:
    """The length of D_a o_b - M o_b' of each joint b: float64 [J], 0 of joints that are not fixed."""
    joints = fixed_joints(skeleton)
    turned = np.einsum("jik,jk->ji", turns[skeleton.parents[joints]], skeleton.offsets[joints])
    apart = np.zeros(skeleton.n_joints)
    apart[joints] = np.linalg.norm(turned - skeleton.offsets[partners[joints]] @ M, axis=1)
    return apart


def _fitted(skeleton: Skeleton, partners: Ints) -> Floats:
    """D of each bone that fits its children best: float64 [J, 3, 3]."""
    turns = np.tile(np.eye(3), (skeleton.n_joints, 1, 1))
    correlations = _correlations(skeleton, partners)
    for joint, parent in enumerate(skeleton.parents.tolist()):
        partner = int(partners[joint])
        near = turns[parent] if parent >= 0 else np.eye(3)
        if partner < joint:
            turns[joint] = M @ turns[partner].T @ M
        elif partner == joint:
            turns[joint] = M @ _reflection(M @ correlations[joint], M @ near)
        else:
            turns[joint] = _rotation(correlations[joint], near)
    return turns


def _correlations(skeleton: Skeleton, partners: Ints) -> Floats:
    """Of each bone the sum of M o_b' o_b^T over its children and the ends of its chain: float64 [J, 3, 3]."""
    correlations = np.zeros((skeleton.n_joints, 3, 3))
    for joint in fixed_joints(skeleton).tolist():
        correlations[skeleton.parents[joint]] += np.outer(M @ skeleton.offsets[partners[joint]], skeleton.offsets[joint])
    ends: dict[int, list[Floats]] = {}
    for joint, end in skeleton.end_sites:
        ends.setdefault(joint, []).append(np.array(end))
    for joint, own in ends.items():
        for offset, other in zip(own, ends.get(int(partners[joint]), []), strict=False):
            correlations[joint] += np.outer(M @ other, offset)
    return correlations


def _rotation(correlation: Floats, near: Floats) -> Floats:
    """The rotation D with the largest tr(D^T correlation); of several, the one nearest to another: [3, 3]."""
    left, sizes, right = np.linalg.svd(correlation)
    rank = _rank(sizes)
    if rank == 0:
        return near
    if rank == 1:
        start, stop = right[0], left[:, 0]
        near = -M if near @ start @ stop < -np.cos(ALONG) and -M @ start @ stop > np.cos(ALONG) else near
        return _arc(near @ start, stop) @ near
    signs = np.diag([1.0, 1.0, np.sign(np.linalg.det(left @ right))])
    return np.asarray(left @ signs @ right)


def _reflection(correlation: Floats, near: Floats) -> Floats:
    """The symmetric S, most often a reflection in a plane, with the largest tr(S correlation); of several, one near another."""
    values, vectors = np.linalg.eigh((correlation + correlation.T) / 2.0)
    order = np.argsort(-np.abs(values))
    values, vectors = values[order], vectors[:, order]
    rank = _rank(np.abs(values))
    if rank == 0:
        return near
    if rank == 1 and values[0] > 0.0:
        own = [axis for axis in np.eye(3) if abs(axis @ vectors[:, 0]) < ALONG / 100.0]
        normal = max(own, key=lambda axis: abs(axis @ _normal(near)), default=_normal(near))
        return _reflected(_beside(normal, vectors[:, 0]))
    signs = np.sign(values)
    signs[rank:] = 1.0
    if signs.prod() > 0.0:
        signs[2] *= -1.0
    return np.asarray(vectors * signs @ vectors.T)


def _rank(sizes: Floats) -> int:
    return int((sizes > 1e-9 * max(float(sizes[0]), 1e-12)).sum())


def _reflected(normal: Floats) -> Floats:
    return np.asarray(np.eye(3) - 2.0 * np.outer(normal, normal))


def _normal(reflection: Floats) -> Floats:
    """The normal of the plane of a reflection."""
    return np.asarray(np.linalg.eigh((reflection + reflection.T) / 2.0)[1][:, 0])


def _beside(wanted: Floats, axis: Floats) -> Floats:
    """The unit vector nearest to one that is at right angles to an axis; some axis of the bone's where there is none."""
    for each in (wanted, *np.eye(3)):
        beside = each - axis * (axis @ each)
        if np.linalg.norm(beside) > 1e-6:
            return np.asarray(beside / np.linalg.norm(beside))
    raise AssertionError("one of the three axes is not along the given one")


def _arc(start: Floats, stop: Floats) -> Floats:
    """The shortest rotation of a unit vector to another; of opposite ones about one of the bone's own axes."""
    if start @ stop < -1.0 + 1e-12:
        axis = _beside(np.zeros(3), start)
        return np.asarray(2.0 * np.outer(axis, axis) - np.eye(3))
    cross = np.cross(start, stop)
    skew = np.array([[0.0, -cross[2], cross[1]], [cross[2], 0.0, -cross[0]], [-cross[1], cross[0], 0.0]])
    return np.asarray(np.eye(3) + skew + skew @ skew / (1.0 + start @ stop))
