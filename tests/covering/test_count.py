"""The core counts what going through every context counts, in as many steps as ever, and can be stopped; bad parts are refused."""

import _thread
import itertools
import math
import random
import threading
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from c_compilers import PROGRAMS, C, built, compiler_for, ran, sanitizers
from hypothesis import given
from hypothesis import strategies as st
from made_boxes import bytes_of, made
from strategies import IS_FULL, for_each, some

from contextdb.core import Boxes, count_holders
from contextdb.covering.count import Bounds, _count, table_of
from contextdb.covering.points import Questions
from contextdb.covering.progress import SILENT, Cancelled, Progress
from contextdb.covering.witness import BoxSet

CORE = Path(__file__).parent.parent.parent / "contextdb" / "core"
ENDLESS = 1 << 40


def counted(n_boxes: int, n_factors: int, seed: int, work: int, progress: Progress = SILENT) -> Bounds:
    return _count(*made(n_boxes, n_factors, seed), work, progress)


@pytest.mark.parametrize("seed", range(12))
def test_the_share_is_that_of_every_context_one_by_one(seed: int):
    boxes, full, weights = made(4 + 3 * seed, 6, seed)
    share = math.fsum(
        math.prod(own[k] for own, k in zip(weights, context, strict=True))
        for context in itertools.product(*(range(len(own)) for own in weights))
        if not any(all(side >> k & 1 for side, k in zip(box, context, strict=True)) for box in boxes)
    )
    bounds = _count(boxes, full, weights, 10**6, SILENT)
    assert bounds.is_exact
    assert bounds.lower == pytest.approx(share, abs=1e-12)


# ---- work


@pytest.mark.parametrize(
    ("n_boxes", "n_factors", "steps"), [(1, 9, 2), (20, 12, 1_429), (64, 18, 10_103), (150, 18, 36_031), (150, 24, 670_965)]
)
def test_the_steps_of_a_count_are_as_many_as_they_were(n_boxes: int, n_factors: int, steps: int):
    """A change that prunes less, or remembers less, is seen here; one that prunes more changes these numbers."""
    bounds = counted(n_boxes, n_factors, 0, 10_000_000)
    assert (bounds.is_exact, bounds.work) == (True, steps)


def test_bounds_within_some_steps_are_as_near_as_they_were():
    assert [(b.lower, b.upper, b.work) for b in (counted(150, 24, 0, 40_000), counted(150, 24, 0, 400_000))] == [
        (0.05991704052121236, 0.12409050495686161, 40_018),
        (0.10545347379104328, 0.10563100811794204, 400_290),
    ]


def test_the_steps_of_questions_are_as_many_as_they_were():
    steps = []
    for n_boxes, n_factors in [(5, 6), (64, 18), (150, 24), (400, 8), (400, 24)]:
        boxes, full, _ = made(n_boxes, n_factors, 0)
        steps.append(Questions(boxes, full).are_held(full, (1 << len(boxes)) - 1, 10_000_000)[2])
    assert steps == [12, 237, 654, 391, 1771]


def test_some_counts_are_cut_short_and_some_are_not():
    assert not counted(64, 18, 0, 3_000).is_exact
    assert not counted(150, 24, 0, 40_000).is_exact
    exact = counted(64, 18, 0, 40_000)
    assert exact.is_exact
    assert 0.0 < exact.lower < 1.0


def test_questions_that_are_cut_short_are_not_certain_and_the_others_are_right():
    answers = set()
    for (n_boxes, n_factors), seed in itertools.product([(5, 6), (64, 18), (150, 24), (400, 8), (400, 24)], range(4)):
        boxes, full, _ = made(n_boxes, n_factors, seed)
        rng = random.Random(seed)
        box = tuple(rng.randrange(1, side + 1) if rng.random() < 0.2 else side for side in full)
        rows = BoxSet.of(full, boxes)
        by = rows.all
        for f, side in enumerate(box):
            by &= rows.meeting(f, side)
        exact = Questions(boxes, full).are_held(box, by, 1_000_000)
        assert exact[1]
        for most in (0, 100, 500):
            is_held, is_certain, steps = Questions(boxes, full).are_held(box, by, most)
            assert (is_held, is_certain, steps) == exact if is_certain else not is_held
            answers.add((is_held, is_certain))
    assert answers == {(True, True), (False, True), (False, False)}


# ---- stopping


def test_a_long_count_is_told_of_in_order_and_can_be_stopped():
    shares: list[float] = []
    counted(300, 24, 0, 2_000_000, Progress(lambda _, share: shares.append(share)))
    assert shares == sorted(shares)
    assert len(shares) > 3
    with pytest.raises(Cancelled):
        counted(300, 24, 0, ENDLESS, Progress(None, lambda: True))


def test_another_thread_runs_while_boxes_are_counted_and_can_stop_the_count():
    stopped, ended = threading.Event(), []

    def count() -> None:
        with pytest.raises(Cancelled):
            counted(900, 40, 0, ENDLESS, Progress(None, stopped.is_set))
        ended.append(True)

    thread = threading.Thread(target=count)
    thread.start()
    stopped.set()
    thread.join()
    assert ended == [True]


def test_control_c_ends_a_count_that_nobody_watches():
    interrupter = threading.Thread(target=_thread.interrupt_main)
    boxes, full, weights = made(900, 40, 0)
    table = Boxes(*table_of(boxes, full, [len(own) for own in weights]))
    with pytest.raises(KeyboardInterrupt):  # noqa: PT012 - the count is what it interrupts
        interrupter.start()
        table.uncovered(np.concatenate(weights), ENDLESS, ENDLESS, None)
    interrupter.join()


def test_a_question_is_stopped_too():
    """Whether eleven pigeons leave one of ten holes to each: no box is needless, and nothing is seen twice."""
    n = 10
    full = ((1 << n) - 1,) * (n + 1)
    pairs = itertools.combinations(range(n + 1), 2)
    boxes = [tuple(1 << hole if f in pair else side for f, side in enumerate(full)) for pair in pairs for hole in range(n)]
    told: list[bool] = []
    with pytest.raises(Cancelled):
        Questions(boxes, full, Progress(None, lambda: len(told) > 3 or told.append(True) is not None)).are_held(
            full, (1 << len(boxes)) - 1, ENDLESS
        )
    assert len(told) == 4


def test_comparisons_are_told_of_in_order_and_are_stopped_too():
    boxes, full, _ = made(6000, 30, 0)
    questions, shares = Questions(boxes, full), list[float]()
    questions.holders(len(boxes), Progress(lambda _, share: shares.append(share)))
    assert shares == sorted(shares)
    assert len(shares) > 3
    with pytest.raises(Cancelled):
        questions.holders(len(boxes), Progress(None, lambda: True))


# ---- depth


@pytest.mark.parametrize(("n", "answer"), [(900, (True, True)), (1200, (False, False))])
def test_a_search_goes_so_deep_and_no_deeper_and_needs_no_stack(n: int, answer: tuple[bool, bool]):
    """Of a chain of facts each follows from the one before, the first is true and the last is false."""
    full = (3,) * n
    chain = [tuple(2 if f == i else 1 if f == i + 1 else 3 for f in range(n)) for i in range(n - 1)]
    boxes = [*chain, (1, *full[1:]), (*full[1:], 2)]
    answers: list[tuple[bool, bool]] = []
    before = threading.stack_size(256 * 1024)
    try:
        ask = threading.Thread(target=lambda: answers.append(Questions(boxes, full).are_held(full, (1 << n + 1) - 1, ENDLESS)[:2]))
        ask.start()
        ask.join()
    finally:
        threading.stack_size(before)
    assert answers == [answer]


# ---- memory and bad parts


@pytest.mark.parametrize(("n_boxes", "n_factors", "most"), some([(40, 12, 70), (130, 14, 9), (1, 3, 5)], 3))
def test_sanitizers_find_nothing_and_a_count_that_is_stopped_or_refused_memory_gives_all_back(
    n_boxes: int, n_factors: int, most: int, tmp_path: Path
):
    for part in ("core.h", *(file.name for file in CORE.glob("*.h"))):
        (tmp_path / part).write_bytes((CORE / part).read_bytes())
    program = built(PROGRAMS / "count.c", tmp_path / "count.exe", C, *sanitizers(compiler_for(C)), "-ffp-contract=off")
    for seed in range(20 if IS_FULL else 3):
        (tmp_path / "in").write_bytes(bytes_of(made(n_boxes, n_factors, seed, most), 20_000))
        ran(program, tmp_path / "in", tmp_path / "out", "end")
        boxes, full, weights = made(n_boxes, n_factors, seed, most)
        holders = np.frombuffer((tmp_path / "out").read_bytes(), np.int64)[8:]
        assert holders.tolist() == Questions(boxes, full).holders(len(boxes)).tolist() or any((own == 0.0).any() for own in weights)


def parts() -> dict[str, Any]:
    """Three boxes over two factors of two and three classes."""
    return {
        "cells": np.array([[0, -1], [-1, 1], [0, 1]], np.int32),
        "runs": np.array([[0, 1], [0, 1], [2, 3]], np.int32),
        "first": np.array([0, 1, 3], np.int64),
        "hashes": np.array([[1, 2], [3, 4]], np.uint64),
        "edges": np.array([0, 2, 5], np.int64),
    }


WEIGHTS = np.array([1.0, 1.0, 1.0, 2.0, 1.0])


def test_these_parts_go_together():
    boxes = Boxes(*parts().values())
    assert boxes.uncovered(WEIGHTS, 100, 100, None)[:2] == (0.25, 0.25)
    assert boxes.leaves_open(np.array([0, 1], np.int32), WEIGHTS, 0, 100, None)[0] == 1
    assert boxes.leaves_open(np.array([], np.int32), WEIGHTS, 0, 100, None)[0] == 1


@for_each(
    [
        ("cells", np.array([[2, -1]], np.int32)),
        ("cells", np.array([[-2, -1]], np.int32)),
        ("cells", np.array([[1, -1]], np.int32)),
        ("cells", np.array([[0, 0]], np.int32)),
        ("cells", np.zeros((3, 3), np.int32)),
        ("cells", np.zeros((3, 2), np.int64)),
        ("cells", np.zeros((2, 6), np.int32)[:, ::3]),
        ("cells", [[0, -1]]),
        ("runs", np.array([[1, 0], [0, 1], [2, 3]], np.int32)),
        ("runs", np.array([[0, 3], [0, 1], [2, 3]], np.int32)),
        ("runs", np.array([[0, 1], [2, 3], [0, 1]], np.int32)),
        ("runs", np.array([[-1, 1], [0, 1], [2, 3]], np.int32)),
        ("runs", np.array([[0, 1], [0, 1]], np.int32)),
        ("first", np.array([0, 3, 1], np.int64)),
        ("first", np.array([0, 1, 4], np.int64)),
        ("first", np.array([1, 1, 3], np.int64)),
        ("first", np.array([0, 1], np.int64)),
        ("hashes", np.zeros((3, 2), np.uint64)),
        ("edges", np.array([0, 6, 5], np.int64)),
        ("edges", np.array([0, -2, 5], np.int64)),
        ("edges", np.array([0, 2, -5], np.int64)),
        ("edges", np.array([0, 2, 1 << 62], np.int64)),
    ]
)
def test_boxes_that_do_not_go_together_are_refused(name: str, value: object):
    with pytest.raises((ValueError, TypeError, BufferError)):
        Boxes(*(parts() | {name: value}).values())


def test_boxes_that_were_refused_answer_nothing():
    boxes = Boxes.__new__(Boxes)
    with pytest.raises(ValueError, match="do not go together"):
        boxes.uncovered(WEIGHTS, 100, 100, None)
    with pytest.raises(ValueError, match="do not go together"):
        Boxes(*parts().values()).__init__(*parts().values())  # type: ignore[misc]


@pytest.mark.parametrize("weights", [WEIGHTS[:4], -WEIGHTS, WEIGHTS * np.nan, WEIGHTS * np.inf, WEIGHTS.astype(np.float32)])
def test_weights_that_do_not_go_with_the_boxes_are_refused(weights: object):
    boxes, chosen = Boxes(*parts().values()), np.arange(3, dtype=np.int32)
    places = np.zeros(3, np.int64)
    for ask in (
        lambda: boxes.uncovered(weights, 1, 1, None),  # type: ignore[arg-type]
        lambda: boxes.leaves_open(chosen, weights, 0, 1, None),  # type: ignore[arg-type]
        lambda: boxes.first_holders(chosen, weights, places, places, None),  # type: ignore[arg-type]
    ):
        with pytest.raises(ValueError, match=r"do not go together|another type"):
            ask()


def test_numbers_that_do_not_go_with_the_boxes_are_refused():
    boxes, chosen, places = Boxes(*parts().values()), np.arange(3, dtype=np.int32), np.zeros(3, np.int64)
    for ask in (
        lambda: boxes.uncovered(WEIGHTS, -1, 1, None),
        lambda: boxes.uncovered(WEIGHTS, 1, 1 << 62, None),
        lambda: boxes.uncovered(WEIGHTS, 1, 1 << 80, None),
        lambda: boxes.leaves_open(chosen + np.int32(1), WEIGHTS, 0, 1, None),
        lambda: boxes.leaves_open(chosen - np.int32(1), WEIGHTS, 0, 1, None),
        lambda: boxes.leaves_open(chosen[::-1].copy(), WEIGHTS, 0, 1, None),
        lambda: boxes.first_holders(chosen, WEIGHTS, places[:2], places, None),
        lambda: boxes.first_holders(chosen, WEIGHTS, places, places[:2].copy(), None),
        lambda: boxes.first_holders(chosen, WEIGHTS, places),  # type: ignore[call-arg]
    ):
        with pytest.raises((ValueError, OverflowError)):
            ask()
    places.flags.writeable = False
    with pytest.raises((ValueError, BufferError)):
        boxes.first_holders(chosen, WEIGHTS, np.zeros(3, np.int64), places, None)


# ---- contexts that are looked up


@given(st.integers(0, 130), st.integers(0, 4), st.integers(0, 40), st.integers(0, 2**32))
def test_the_boxes_that_hold_each_context_are_counted_and_weighed_one_by_one(n_boxes: int, n_factors: int, n: int, seed: int):
    rng = np.random.default_rng(seed)
    sizes = rng.integers(1, 5, n_factors)
    flags = rng.random((int(sizes.sum()), n_boxes)) < 0.8
    packed = np.packbits(np.pad(flags, ((0, 0), (0, -n_boxes % 64))), axis=1, bitorder="little").view(np.uint64)
    masks = packed.reshape(len(flags), -(-n_boxes // 64))
    starts = np.cumsum([0, *sizes])[:-1].astype(np.int64)
    codes = (rng.random((n, n_factors)) * sizes).astype(np.int32)
    weights = rng.random(n)
    held = [[all(flags[starts[f] + code[f], box] for f in range(n_factors)) for box in range(n_boxes)] for code in codes]
    for own in (None, weights):
        counts, firsts, hits, expected = np.zeros(n, np.int64), np.zeros(n, np.int64), np.zeros(n_boxes), [0.0] * n_boxes
        count_holders(codes, starts, masks, own, counts, firsts, hits)
        for i, boxes in enumerate(held):
            for box in range(n_boxes):
                expected[box] += (1.0 if own is None else float(own[i])) * boxes[box]
        assert (counts.tolist(), hits.tolist()) == ([sum(boxes) for boxes in held], expected)
        assert firsts.tolist() == [boxes.index(True) if any(boxes) else -1 for boxes in held]


def test_contexts_that_do_not_go_with_the_masks_are_refused():
    codes, starts, masks = np.zeros((2, 1), np.int32), np.zeros(1, np.int64), np.ones((1, 1), np.uint64)
    counts, firsts, hits = np.zeros(2, np.int64), np.zeros(2, np.int64), np.zeros(1)
    count_holders(codes, starts, masks, None, counts, firsts, hits)
    assert (counts.tolist(), firsts.tolist(), hits.tolist()) == ([1, 1], [0, 0], [2.0])
    good = codes, starts, masks, None, counts, firsts, hits
    for at, bad in [
        (0, codes + np.int32(1)),
        (0, codes - np.int32(1)),
        (0, np.zeros((2, 2), np.int32)),
        (1, starts - 1),
        (1, starts + (1 << 62)),
        (2, np.ones((1, 2), np.uint64)),
        (2, np.ones((1, 1), np.int64)),
        (3, np.ones(3)),
        (4, np.zeros(3, np.int64)),
        (5, np.zeros(1, np.int64)),
        (6, np.zeros(65)),
    ]:
        with pytest.raises(ValueError, match=r"do not go together|another type"):
            count_holders(*good[:at], bad, *good[at + 1 :])  # type: ignore[arg-type]
