"""Random variation: near ties alone, evenly, with a memory, and the same again from the same seed."""

import random
from collections import Counter

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from contextdb.motion import Hit
from contextdb.motion.selection.variation import Variation, restore, state_of


def ties(*assets):
    return [Hit(asset, i, i, 0.0) for i, asset in enumerate(assets)]


def test_every_near_tie_is_as_likely():
    rng = random.Random(1)
    counts = Counter(Variation(0.1).choose(ties("a", "b", "c"), (), rng).asset for _ in range(3000))
    assert all(900 < counts[asset] < 1100 for asset in "abc")


def test_what_was_chosen_lately_is_not_chosen_again_while_there_is_another():
    variation, rng = Variation(0.1, memory=2), random.Random(2)
    recent, chosen = (), []
    for _ in range(200):
        chosen.append(variation.choose(ties("a", "b", "c", "d"), recent, rng).asset)
        recent = variation.remember(recent, chosen[-1])
    assert all(chosen[i] not in chosen[max(0, i - 2) : i] for i in range(len(chosen)))
    assert set(chosen) == set("abcd")
    assert variation.choose(ties("a"), ("a",), rng).asset == "a"


@given(st.integers(0, 4), st.lists(st.sampled_from("abc"), max_size=8))
def test_the_memory_holds_the_last_assets(memory, played):
    recent = ()
    for asset in played:
        recent = Variation(0.1, memory).remember(recent, asset)
    assert list(recent) == played[len(played) - min(memory, len(played)) :]


@pytest.mark.parametrize("make", [lambda: random.Random(7), lambda: np.random.default_rng(7)])
def test_the_same_seed_and_a_restored_generator_choose_the_same_again(make):
    variation, rng, other = Variation(0.1), make(), make()
    first = [variation.choose(ties(*"abcde"), (), rng) for _ in range(20)]
    assert [variation.choose(ties(*"abcde"), (), other) for _ in range(20)] == first
    state = state_of(rng)
    following = [variation.choose(ties(*"abcde"), (), rng) for _ in range(20)]
    restore(rng, state)
    assert [variation.choose(ties(*"abcde"), (), rng) for _ in range(20)] == following
    assert state_of(None) is None
