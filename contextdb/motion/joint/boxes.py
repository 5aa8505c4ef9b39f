"""Joint frames in boxes of 8, beside the boxes of the motion database, as the core searches them.

Each role's range has as many frames as the others', so box i of a joint range is box i of the range of each role, and its lanes are
the same joint frames. B joint boxes, K roles, P ordered pairs of roles, F features of a role, 8 lanes.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from contextdb.motion.clips.quaternions import Floats
from contextdb.motion.clips.skeleton import Ints
from contextdb.motion.joint.database import N_RELATIVE, JointDatabase
from contextdb.motion.search.layout import LANES, Features


class JointBoxes(NamedTuple):
    """The joint boxes of a database, B of K roles: `boxes` int64 [B, K], that of each role in the motion database; `ranges`,
    `firsts` and `sizes` int64 [B], the joint range, the first joint frame, and how many frames there are; `own_lows` and
    `own_highs` float32 [K, F, B], the bounds of each role's features; `relative` float32 [B, P, 4, 8], what roles see of each
    other, where a box of fewer frames repeats its last one; `lows` and `highs` float32 [P, 4, B], the bounds of that."""

    boxes: Ints
    ranges: Ints
    firsts: Ints
    sizes: Ints
    own_lows: Features
    own_highs: Features
    relative: Features
    lows: Features
    highs: Features


def boxes_of(joint: JointDatabase) -> JointBoxes:
    layout = joint.database.layout
    counts = -(-joint.lengths // LANES)
    ranges = np.repeat(np.arange(len(counts)), counts)
    within = np.arange(len(ranges)) - np.repeat(np.cumsum(counts) - counts, counts)
    firsts = joint.firsts[ranges] + LANES * within
    sizes = np.minimum(LANES, joint.lengths[ranges] - LANES * within)
    frames = firsts[:, None] + np.minimum(np.arange(LANES), sizes[:, None] - 1)
    relative = joint.relative[:, frames].transpose(1, 0, 3, 2)
    boxes = layout.range_boxes[joint.ranges[ranges], 0] + within[:, None]
    own = layout.blocks[boxes][:, :, layout.rank]
    parts = own.min(axis=3), own.max(axis=3), relative.min(axis=3), relative.max(axis=3)
    own_lows, own_highs, lows, highs = (np.ascontiguousarray(each.transpose(1, 2, 0)) for each in parts)
    return JointBoxes(
        np.ascontiguousarray(boxes, np.int64),
        ranges,
        firsts,
        sizes.astype(np.int64),
        own_lows,
        own_highs,
        np.ascontiguousarray(relative).reshape(-1, len(joint.pairs), N_RELATIVE, LANES),
        lows,
        highs,
    )


def in_boxes(boxes: JointBoxes, values: Floats) -> Floats:
    """A number of each joint frame [M] in boxes, inf in lanes without a frame: [B, 8]."""
    lanes = np.arange(LANES)
    frames = boxes.firsts[:, None] + np.minimum(lanes, boxes.sizes[:, None] - 1)
    return np.where(lanes < boxes.sizes[:, None], values[frames], np.inf)
