"""The count without numba is the compiled one to the last bit and step, and gives what going through every context gives."""

from __future__ import annotations

import itertools
import math
import random

import numpy as np
import pytest
from numpy.typing import NDArray

from contextdb.covering import kernels
from contextdb.covering.count import Bounds, _count
from contextdb.covering.progress import SILENT, Cancelled, Progress
from contextdb.covering.questions import Questions
from contextdb.covering.space import Box
from contextdb.covering.witness import BoxSet

Made = tuple[list[Box], Box, list[NDArray[np.float64]]]


def made(n_boxes: int, n_factors: int, seed: int) -> Made:
    """Boxes that restrict a third of the factors, the whole, and weights of which some are 0."""
    rng = random.Random(seed)
    sizes = [rng.choice((2, 2, 3, 5)) for _ in range(n_factors)]
    weights = [np.array([1.0, *(rng.choice((0.0, 0.5, rng.random())) for _ in range(n - 1))]) for n in sizes]
    full = tuple((1 << n) - 1 for n in sizes)
    boxes = [tuple(rng.randrange(1, side + 1) if rng.random() < 0.35 else side for side in full) for _ in range(n_boxes)]
    return [box for box in boxes if box != full], full, [own / own.sum() for own in weights]


def counted(space: Made, work: int, is_compiled: bool, monkeypatch: pytest.MonkeyPatch, progress: Progress = SILENT) -> Bounds:
    monkeypatch.setattr(kernels, "IS_COMPILED", is_compiled)
    return _count(*space, work, progress)


@pytest.mark.parametrize(("n_boxes", "n_factors"), [(1, 9), (2, 9), (20, 12), (64, 18), (65, 18), (150, 18), (150, 24)])
@pytest.mark.parametrize("work", [0, 3_000, 40_000])
def test_without_numba_the_bounds_and_the_steps_are_the_same(
    n_boxes: int, n_factors: int, work: int, monkeypatch: pytest.MonkeyPatch
):
    for seed in range(2):
        space = made(n_boxes, n_factors, seed)
        assert counted(space, work, True, monkeypatch) == counted(space, work, False, monkeypatch)


def test_without_numba_questions_have_the_same_answers_in_the_same_steps(monkeypatch: pytest.MonkeyPatch):
    answers = set()
    for (n_boxes, n_factors), seed in itertools.product([(5, 6), (64, 18), (150, 18), (150, 24), (400, 8), (400, 24)], range(4)):
        boxes, full, _ = made(n_boxes, n_factors, seed)
        rng = random.Random(seed)
        asked = tuple(rng.randrange(1, side + 1) if rng.random() < 0.2 else side for side in full)
        rows = BoxSet.of(full, boxes)
        by = rows.all
        for f, side in enumerate(asked):
            by &= rows.meeting(f, side)
        for most in (500, 1_000_000):
            found = []
            for is_compiled in (True, False):
                monkeypatch.setattr(kernels, "IS_COMPILED", is_compiled)
                found.append(Questions(boxes, full).are_held(asked, by, most))
            assert found[0] == found[1]
            answers.add(found[0][:2])
    assert answers == {(True, True), (False, True), (False, False)}


def test_some_of_these_counts_are_cut_short_and_some_are_not(monkeypatch: pytest.MonkeyPatch):
    assert not counted(made(64, 18, 0), 3_000, False, monkeypatch).is_exact
    assert not counted(made(150, 24, 0), 40_000, False, monkeypatch).is_exact
    exact = counted(made(64, 18, 0), 40_000, False, monkeypatch)
    assert exact.is_exact
    assert 0.0 < exact.lower < 1.0


@pytest.mark.parametrize("seed", range(12))
def test_the_share_is_that_of_every_context_one_by_one(seed: int, monkeypatch: pytest.MonkeyPatch):
    boxes, full, weights = made(4 + 3 * seed, 6, seed)
    share = math.fsum(
        math.prod(own[k] for own, k in zip(weights, context, strict=True))
        for context in itertools.product(*(range(len(own)) for own in weights))
        if not any(all(side >> k & 1 for side, k in zip(box, context, strict=True)) for box in boxes)
    )
    found = counted((boxes, full, weights), 10**6, False, monkeypatch)
    assert found.is_exact
    assert found.lower == pytest.approx(share, abs=1e-12)


def test_a_long_count_is_told_of_and_can_be_stopped(monkeypatch: pytest.MonkeyPatch):
    shares: list[float] = []
    counted(made(300, 24, 0), 100_000, False, monkeypatch, Progress(lambda _, share: shares.append(share)))
    assert shares == sorted(shares)
    assert len(shares) > 3
    with pytest.raises(Cancelled):
        counted(made(300, 24, 0), 100_000, False, monkeypatch, Progress(None, lambda: True))
