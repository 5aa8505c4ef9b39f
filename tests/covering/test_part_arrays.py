"""Parts of a count by numpy are those of the loops, bit for bit."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.random import default_rng

import contextdb as cdb
from contextdb.compiled.table import data_of
from contextdb.covering import part_arrays, part_kernels, search_kernels
from contextdb.covering.count import table_of
from contextdb.covering.space import Space


def made_table() -> cdb.Table:
    rng, n = default_rng(0), 200
    bools = {f"is_{i}": rng.choice(["True", "False", "Any", "Any"], n).tolist() for i in range(12)}
    numbers = {f"speed_{i}": [f"{low}..{low + 7}" for low in rng.integers(0, 40, n).tolist()] for i in range(3)}
    gaits = {"gait": rng.choice(["Walk", "Run Idle", "not Run", "Any"], n).tolist()}
    schema = {name: {"type": "bool"} for name in bools} | {name: {"type": "number", "min": 0, "max": 50} for name in numbers}
    schema["gait"] = {"type": "enum", "values": ["Walk", "Run", "Idle"]}
    return cdb.Table.from_columns({"Asset": [f"A{r}" for r in range(n)], **bools, **numbers, **gaits}, schema)


@pytest.mark.parametrize("n_boxes", [1, 3, 64, 65, 200])
@pytest.mark.parametrize("kept", [1.0, 0.3])
def test_a_part_by_numpy_is_that_of_the_loops(n_boxes: int, kept: float):
    space, rng = Space.of(data_of(made_table().compile())), default_rng(n_boxes)
    table = table_of(space.boxes, space.full, [len(f.weights) for f in space.factors])
    weights = np.concatenate([f.weights for f in space.factors])
    weights = weights * (rng.random(len(weights)) < kept)
    boxes = np.sort(rng.choice(len(space.boxes), min(n_boxes, len(space.boxes)), replace=False))
    salts = rng.integers(0, 2**62, len(space.full)).astype(np.uint64)
    arguments = boxes, rng.permutation(len(space.full))[:12], weights, salts, table
    with np.errstate(over="ignore"):
        loops, arrays = part_kernels.part_of(*arguments), part_arrays.part_of(*arguments)
    assert [(a.dtype, a.shape, a.tobytes()) for a in loops] == [(a.dtype, a.shape, a.tobytes()) for a in arrays]


@pytest.mark.parametrize("n_boxes", [1, 3, 64, 65, 200])
def test_the_first_box_around_each_by_numpy_is_that_of_the_loops(n_boxes: int):
    space, rng = Space.of(data_of(made_table().compile())), default_rng(n_boxes)
    table = table_of(space.boxes, space.full, [len(f.weights) for f in space.factors])
    weights = np.concatenate([f.weights for f in space.factors])
    boxes = np.sort(rng.choice(len(space.boxes), min(n_boxes, len(space.boxes)), replace=False))
    factors = np.arange(3, 9)
    part = part_kernels.part_of(boxes, factors, weights, np.zeros(len(space.full), np.uint64), table)
    alike = rng.integers(0, 4, len(boxes))
    found = np.zeros((2, len(boxes)), np.int64)
    half = len(boxes) // 2
    for start, stop in ((0, half), (half, len(boxes))):
        search_kernels.first_holders(part, alike, found[0], start, stop)
        part_arrays.first_holders(part, alike, found[1], start, stop)
    assert found[0].tolist() == found[1].tolist()
