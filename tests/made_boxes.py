"""Random boxes to count, and files of them for c_programs/count.c."""

import random

import numpy as np
from numpy.typing import NDArray

from contextdb.covering.count import _whole, table_of
from contextdb.covering.space import Box

Made = tuple[list[Box], Box, list[NDArray[np.float64]]]


def made(n_boxes: int, n_factors: int, seed: int, most: int = 5) -> Made:
    """Boxes that restrict a third of the factors, of up to so many classes, the whole, and weights of which some are 0."""
    rng = random.Random(seed)
    sizes = [rng.choice((2, 2, 3, most)) for _ in range(n_factors)]
    weights = [np.array([1.0, *(rng.choice((0.0, 0.5, rng.random())) for _ in range(n - 1))]) for n in sizes]
    full = tuple((1 << n) - 1 for n in sizes)
    boxes = [tuple(rng.randrange(1, side + 1) if rng.random() < 0.35 else side for side in full) for _ in range(n_boxes)]
    return [box for box in boxes if box != full], full, [own / own.sum() for own in weights]


def bytes_of(space: Made, work: int) -> bytes:
    """What c_programs/count.c reads."""
    boxes, full, weights = space
    cells, runs, first, hashes, edges = table_of(boxes, full, [len(own) for own in weights])
    known: dict[Box, int] = {}
    alike = np.array([known.setdefault(box, i) for i, box in enumerate(boxes)], np.int64)
    head = np.array([*cells.shape, len(hashes), len(runs), work * 6 // 8, work, 0], np.int64)
    whole = np.concatenate([_whole(own) for own in weights])
    return b"".join(part.tobytes() for part in (head, edges, first, hashes, whole, alike, runs, cells))
