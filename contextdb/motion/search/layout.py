"""Where a database keeps its features: boxes of frames, as the core searches them.

N frames, F features, R ranges, B boxes, L = 8 lanes. A box is up to 8 frames of one range, one after another; it never straddles
two ranges, so that a mask over ranges is a mask over boxes. Its features lie feature by feature, 8 frames next to each other, so
that one instruction works on all; a box of fewer frames repeats its last one. The core makes the bounds of boxes; see
`contextdb/core/frame_boxes.h`.

The features are in the order of `order`: those first that tell most boxes from a query, so that most frames are given up early.

Source: the boxes of 16 frames of orangeduck/Motion-Matching, `database.h`; the lanes are ours.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from contextdb.files import scratch
from contextdb.motion.clips.quaternions import Floats
from contextdb.motion.clips.skeleton import Ints
from contextdb.motion.ranges import frames_between

Features = NDArray[np.float32]

LANES = 8
BOXES_AT_ONCE = 4096
N_FRAMES, N_BOXES = 32, 2048
"""So many frames and boxes, spread evenly, are compared to find the order of features."""


@dataclass(frozen=True, eq=False)
class Layout:
    """The features of a database in boxes."""

    n_frames: int
    """N; frames between ranges are counted, but not kept."""
    blocks: Features
    """The features of each box's frames: float32 [B, F, L]."""
    order: Ints
    """Which feature is at each place: int64 [F]."""
    box_starts: Ints
    """The first frame of each box, ascending: int64 [B]."""
    box_sizes: NDArray[np.int32]
    box_ranges: NDArray[np.int32]
    """`box_sizes`, `box_ranges`: how many frames it has, and of which range they are: int32 [B]."""
    range_boxes: Ints
    """The boxes of each range: from the first up to, not including, the second. Int64 [R, 2]."""

    @classmethod
    def of(cls, features: Features, starts: Ints, stops: Ints, feature_weights: Floats) -> Layout:
        """Lay out features [N, F]; the weights [F] only decide the order of features."""
        filled = np.flatnonzero(stops > starts)
        ranges = filled[np.argsort(starts[filled], kind="stable")]
        counts = -(-(stops[ranges] - starts[ranges]) // LANES)
        ends = np.cumsum(counts)
        of_range = np.repeat(np.arange(len(ranges)), counts)
        within = np.arange(len(of_range)) - (ends - counts)[of_range]
        box_starts = starts[ranges][of_range] + LANES * within
        box_sizes = np.minimum(LANES, stops[ranges][of_range] - box_starts)
        range_boxes = np.zeros((len(starts), 2), np.int64)
        range_boxes[ranges] = np.stack((ends - counts, ends), axis=1)
        order = _order(features, box_starts, box_sizes, feature_weights)
        return cls(
            len(features),
            _blocks(features, order, box_starts, box_sizes),
            order,
            box_starts.astype(np.int64),
            box_sizes.astype(np.int32),
            ranges[of_range].astype(np.int32),
            range_boxes,
        )

    @property
    def n_features(self) -> int:
        return int(self.blocks.shape[1])

    @property
    def n_bytes(self) -> int:
        return sum(array.nbytes for array in vars(self).values() if isinstance(array, np.ndarray))

    def take(self, frames: Ints) -> Features:
        """The features of some frames, each in a range: float32 [len(frames), F]."""
        boxes = np.searchsorted(self.box_starts, frames, side="right") - 1
        return np.asarray(self.blocks[boxes, :, frames - self.box_starts[boxes]][:, self.rank])

    @cached_property
    def rank(self) -> Ints:
        """Where each feature is: int64 [F]."""
        return np.argsort(self.order)

    def range_of(self, frame: int) -> int:
        """The range that holds a frame, or -1 for a frame between ranges."""
        box = int(self.box_starts.searchsorted(frame, side="right")) - 1
        return int(self.box_ranges[box]) if box >= 0 and frame < self.box_starts[box] + self.box_sizes[box] else -1

    def ranges_of(self, frames: Ints) -> NDArray[np.int32]:
        """The range of each of some frames, each in one: int32 [len(frames)]."""
        return self.box_ranges[self.box_starts.searchsorted(frames, side="right") - 1]

    def are_in_ranges(self, frames: Ints) -> NDArray[np.bool_]:
        """Which frames are in a range, and not between two: bool [len(frames)]."""
        boxes = self.box_starts.searchsorted(frames, side="right") - 1
        return np.asarray((boxes >= 0) & (frames < self.box_starts[boxes] + self.box_sizes[boxes]))

    def kinds_of_boxes(self, kinds: NDArray[np.integer]) -> NDArray[np.int32]:
        """The kind of all frames of each box, -1 where they are of several: int32 [B], from the kind of every frame."""
        box_kinds = np.empty(len(self.box_starts), np.int32)
        for box in range(0, len(box_kinds), BOXES_AT_ONCE):
            part = slice(box, box + BOXES_AT_ONCE)
            own = kinds[_frames_of(self.box_starts[part], self.box_sizes[part])]
            box_kinds[part] = np.where((own == own[:, :1]).all(axis=1), own[:, 0].astype(np.int64), -1)
        return box_kinds

    @cached_property
    def frame_ranges(self) -> Ints:
        """The range of each frame, -1 between ranges: int64 [N]."""
        ranges = np.full(self.n_frames, -1, np.int64)
        ranges[self.frames] = np.repeat(self.box_ranges, self.box_sizes)
        return ranges

    @property
    def frames(self) -> Ints:
        """Every frame that is in a range, ascending: int64."""
        return frames_between(self.box_starts, self.box_starts + self.box_sizes)


def _blocks(features: Features, order: Ints, box_starts: Ints, box_sizes: Ints) -> Features:
    """The features of each box's frames, [B, F, L]; filled part by part, so that no copy of all is made."""
    blocks = scratch.zeros((len(box_starts), features.shape[1], LANES), np.float32)
    for box in range(0, len(box_starts), BOXES_AT_ONCE):
        part = slice(box, box + BOXES_AT_ONCE)
        blocks[part] = features[_frames_of(box_starts[part], box_sizes[part])].transpose(0, 2, 1)[:, order]
    return blocks


def _frames_of(box_starts: Ints, box_sizes: NDArray[np.integer]) -> Ints:
    """The frames in the lanes of some boxes, the last repeated: int64 [n, L]."""
    return np.asarray(box_starts[:, None] + np.minimum(np.arange(LANES), box_sizes[:, None] - 1))


def _order(features: Features, box_starts: Ints, box_sizes: Ints, weights: Floats) -> Ints:
    """The features, those first that put most weighted squared distance between a frame and boxes: measured on some of both."""
    n_boxes, n_features = len(box_starts), features.shape[1]
    some = np.unique(np.linspace(0, n_boxes - 1, min(n_boxes, N_BOXES)).astype(np.int64)) if n_boxes else np.empty(0, np.int64)
    boxes = features[_frames_of(box_starts[some], box_sizes[some])]
    low, high = boxes.min(axis=1), boxes.max(axis=1)
    distance = np.zeros(n_features)
    for frame in boxes[:: max(1, len(some) // N_FRAMES), 0]:
        with np.errstate(over="ignore"):
            apart = np.maximum(np.maximum(low - frame, frame - high), np.float32(0.0))
        distance += np.einsum("bf,bf->f", apart, apart, dtype=np.float64)
    return np.argsort(-distance * weights, kind="stable").astype(np.int64)
