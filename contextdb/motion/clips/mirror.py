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
that its children lie at the skeleton's own offsets: see `contextdb.motion.clips.own_axes`.

A declared pair is two names, or two patterns with one `*` each, which matches the same rest of the name on both sides.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import TypeVar

import numpy as np

from contextdb.cells.arguments import require_kind, require_many, require_pair
from contextdb.errors import Fault, MotionError, in_quotes, mend_for, some
from contextdb.motion.clips.own_axes import own_axes
from contextdb.motion.clips.poses import LocalPoses, Poses
from contextdb.motion.clips.quaternions import inverse, multiply, rotate
from contextdb.motion.clips.skeleton import Ints, Skeleton, sided_pairs

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
