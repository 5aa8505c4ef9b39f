"""The frames of a database in groups of a few that follow one another, so that a search of numpy can leave most of them out early.

    |x - q| ≥ |c - q| - r,  c the centre of x's group and r how far the farthest of its frames is from c

Points are frames [F] counted from the mean frame and multiplied by the roots of their weights. N frames in ranges, F features, P
places, SIZE of them a group; a group is of one range. What fills up, in a group or at the end, repeats a frame, and its squares are
inf: it is never the nearest.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from contextdb.motion.clips.quaternions import Floats
from contextdb.motion.clips.skeleton import Ints
from contextdb.motion.search.layout import LANES, Features, Layout

SIZE = 4
PIECE = 7000
"""Points are kept in pieces of so many numbers: each product fits the nearest cache, and BLAS starts no threads for it."""


@dataclass(frozen=True, eq=False)
class Groups:
    """Points and their groups, ready for a product with queries. They take a third more memory than the features.

    Attributes
    ----------
    mean : float64 array, shape (F,)
        The mean frame: the nearer features are to 0, the less is rounded away.
    roots : float64 array, shape (F,)
        The roots of the weights.
    frames : int64 array, shape (P,)
        The frame at each place, ascending.
    n_places : int64 array
        How many places each range has, in the order of their frames; the last has those at the end too.
    points : float32 array, shape (pieces, W, F)
        -2 x the points.
    squares : float32 array, shape (P,)
        The squared distances of points from the mean.
    centres : float32 array, shape (pieces, F, W)
        -2 x the centres of groups.
    centre_squares : float32 array, shape (P / SIZE,)
    radii : float32 array, shape (P / SIZE,)
    greatest : float
        The largest of the squares of frames.
    """

    mean: Floats
    roots: Floats
    frames: Ints
    n_places: Ints
    points: Features
    squares: Features
    centres: Features
    centre_squares: Features
    radii: Features
    greatest: float

    @classmethod
    def of(cls, layout: Layout, weights: Floats) -> Groups:
        """Those of a database that has frames in ranges, with a weight for each feature."""
        width = max(LANES, PIECE // max(1, layout.n_features) // LANES * LANES)
        frames, is_extra, n_places = _places(layout, width)
        with np.errstate(over="ignore", invalid="ignore"):
            mean = np.asarray(layout.take(frames[~is_extra]).mean(axis=0, dtype=np.float64))
            roots = np.sqrt(weights)
            shape = (len(frames) // width, width, layout.n_features)
            points, centres = np.empty(shape, np.float32), np.zeros((len(frames) // SIZE, layout.n_features), np.float32)
            squares, centre_squares, radii = np.empty(len(frames)), np.empty(len(centres)), np.empty(len(centres))
            for i, piece in enumerate(points):
                own = (layout.take(frames[i * width : (i + 1) * width]) - mean) * roots
                groups = own.reshape(width // SIZE, SIZE, own.shape[1])
                middle = groups.mean(axis=1)
                piece[:] = -2.0 * own
                squares[i * width : (i + 1) * width] = np.einsum("nf,nf->n", own, own)
                at = slice(i * width // SIZE, (i + 1) * width // SIZE)
                centres[at], centre_squares[at] = -2.0 * middle, np.einsum("nf,nf->n", middle, middle)
                groups -= middle[:, None]
                radii[at] = np.sqrt(np.einsum("gnf,gnf->gn", groups, groups).max(axis=1))
            greatest = float(squares[~is_extra].max())
            squares[is_extra] = np.inf
            narrow = [array.astype(np.float32) for array in (squares, centre_squares, radii)]
        return cls(mean, roots, frames, n_places, points, narrow[0], _in_pieces(centres, width), narrow[1], narrow[2], greatest)

    @cached_property
    def n_groups(self) -> Ints:
        return self.n_places // SIZE

    @cached_property
    def ranges(self) -> Ints:
        """Which of these ranges each group is of."""
        return np.arange(len(self.n_groups)).repeat(self.n_groups)

    @cached_property
    def _points_of_groups(self) -> Features:
        return self.points.reshape(len(self.radii), SIZE * self.points.shape[2])

    def frames_of(self, groups: Ints | None) -> Ints:
        """The frames at the places of some groups, None for all."""
        return self.frames if groups is None else self.frames.reshape(-1, SIZE).take(groups, 0).ravel()

    def product(self, group: int, point: Features) -> Features:
        """A point times those of one group: [SIZE]."""
        found: Features = self._points_of_groups[group].reshape(SIZE, -1) @ point
        return found

    def products(self, groups: Ints, point: Features) -> Features:
        """A point times those of some groups, as they are kept: [len(groups), SIZE]."""
        width, points = (
            self.points.shape[1],
            self._points_of_groups.take(groups, 0).reshape(len(groups) * SIZE, self.points.shape[2]),
        )
        found = np.empty(len(points), np.float32)
        for i in range(0, len(points), width):
            np.dot(points[i : i + width], point, out=found[i : i + width])
        return found.reshape(-1, SIZE)


def _places(layout: Layout, width: int) -> tuple[Ints, NDArray[np.bool_], Ints]:
    """The frame at each place, whether it fills up, and how many places each range has; as many as fill pieces of a width."""
    n_places = -(-layout.box_sizes.astype(np.int64) // SIZE) * SIZE
    n_places[-1] += -n_places.sum() % width
    boxes = np.arange(len(n_places)).repeat(n_places)
    within = np.arange(len(boxes)) - (np.cumsum(n_places) - n_places)[boxes]
    frames = layout.box_starts[boxes] + np.minimum(within, layout.box_sizes[boxes] - 1)
    of_ranges = np.bincount(layout.box_ranges, n_places)[layout.range_order]
    return frames, within >= layout.box_sizes[boxes], of_ranges.astype(np.int64)


def _in_pieces(groups: Features, width: int) -> Features:
    """Rows [n, F] as columns, in pieces of a width: [ceil(n / W), F, W]."""
    n_pieces = -(-len(groups) // width)
    filled = np.zeros((n_pieces * width, groups.shape[1]), np.float32)
    filled[: len(groups)] = groups
    return np.ascontiguousarray(filled.reshape(n_pieces, width, groups.shape[1]).transpose(0, 2, 1))
