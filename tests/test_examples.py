"""What property tests draw: the same examples from one seed, others from another, and what failed once first."""

from pathlib import Path

import pytest
from conftest import seed_test
from hypothesis import core, given, settings
from hypothesis import strategies as st
from hypothesis.database import DirectoryBasedExampleDatabase


def drawn(seed: str, folder: Path, largest: int = 10**9) -> list[int]:
    """The numbers that a test draws, which fails for one that is greater than `largest`."""
    numbers = []

    @settings(derandomize=False, database=DirectoryBasedExampleDatabase(folder), max_examples=30)
    @given(st.integers(0, 10**9))
    def test(number: int) -> None:
        numbers.append(number)
        assert number <= largest

    seed_test(test, seed)
    test()
    return numbers


def test_a_seed_draws_the_same_examples_again_and_another_draws_others(tmp_path: Path):
    assert drawn("1", tmp_path) == drawn("1", tmp_path)
    assert drawn("1", tmp_path) != drawn("2", tmp_path)


def test_an_example_that_failed_is_tried_first_by_the_next_run_whatever_its_seed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr(core, "global_force_seed", None)  # what --hypothesis-seed sets; with it nothing is kept
    with pytest.raises(AssertionError):
        drawn("1", tmp_path, largest=1000)
    with pytest.raises(AssertionError):
        drawn("2", tmp_path, largest=1000)
    assert drawn("3", tmp_path)[0] == 1001
