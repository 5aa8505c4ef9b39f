"""Work on many items: the same results wherever they are worked out, also when workers die."""

from __future__ import annotations

import multiprocessing
import os
import signal
import time
from pathlib import Path

import numpy as np
import pytest

from contextdb.disk.engines import EngineError, here, in_order, on_cores
from contextdb.files import scratch
from contextdb.files.scratch import Pile

N = 40


def squared(offset: int, item: int) -> int:
    return item * item + offset


def dies_once(folder: str, item: int) -> int:
    """Ends its process the first time that it sees an odd tenth item."""
    mark = Path(folder) / str(item)
    if item % 10 == 7 and not mark.exists():
        mark.touch()
        os._exit(1)
    return item


def dies_at_seven(_: None, item: int) -> int:
    if item == 7:
        os._exit(1)
    return item


def slow(_: None, item: int) -> int:
    time.sleep(30.0)
    return item


def refuses(_: None, item: int) -> int:
    if item == 3:
        raise ValueError("three")
    return item


def test_all_cores_give_what_one_process_gives():
    assert sorted(on_cores(squared, 1, range(N), n_processes=2)) == list(here(squared, 1, range(N)))
    assert list(on_cores(squared, 1, [])) == []


def test_results_come_in_the_order_of_their_items():
    assert list(in_order([(2, "c"), (0, "a"), (1, "b"), (3, "d")])) == ["a", "b", "c", "d"]


def test_what_a_dead_worker_did_is_done_again(tmp_path):
    assert sorted(on_cores(dies_once, str(tmp_path), range(N), n_processes=2)) == [(i, i) for i in range(N)]
    assert len(list(tmp_path.iterdir())) == 4


def test_an_item_that_ends_every_worker_is_named_after_all_others():
    done = []
    with pytest.raises(EngineError, match=r'1 file could not be finished: "item 7"'):
        done.extend(on_cores(dies_at_seven, None, range(9), "item {}".format, n_processes=2))
    assert sorted(done) == [(i, i) for i in range(9) if i != 7]


def test_what_the_work_raises_comes_here_and_ends_the_workers():
    with pytest.raises(ValueError, match="three"):
        list(on_cores(refuses, None, range(N), n_processes=2))
    assert not multiprocessing.active_children()


@pytest.mark.skipif(not hasattr(signal, "setitimer"), reason="no interval timers here")
def test_an_interruption_ends_the_workers_at_once():
    def interrupt(*_: object) -> None:
        raise KeyboardInterrupt

    before = signal.signal(signal.SIGALRM, interrupt)
    signal.setitimer(signal.ITIMER_REAL, 2.0)
    start = time.monotonic()
    try:
        with pytest.raises(KeyboardInterrupt):
            list(on_cores(slow, None, range(4), n_processes=2))
    finally:
        signal.signal(signal.SIGALRM, before)
    assert time.monotonic() - start < 20.0
    assert not multiprocessing.active_children()


# ---- arrays larger than memory


@pytest.mark.parametrize("large_bytes", [1, 200, 1 << 20])
def test_arrays_in_a_file_are_those_in_memory(large_bytes: int, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr(scratch, "LARGE_BYTES", large_bytes)
    random = np.random.default_rng(1)
    arrays = [random.random((n, 3)).astype(np.float32) for n in (3, 0, 40, 1, 7)]
    others = [random.random((n, 2, 2)) > 0.5 for n in (2, 9, 0, 4, 5)]
    pile = Pile()
    numbers = [pile.put(each) for pair in zip(arrays, others, strict=True) for each in pair]
    found = pile.arrays()
    for number, each in zip(numbers, (each for pair in zip(arrays, others, strict=True) for each in pair), strict=True):
        assert found[number].dtype == each.dtype
        assert np.array_equal(found[number], each)
    assert np.array_equal(scratch.joined(arrays, arrays[0][:0]), np.concatenate(arrays))
    assert scratch.zeros((0, 3), np.float32).shape == (0, 3)
    assert not scratch.zeros((5, 3), np.float32).any()
