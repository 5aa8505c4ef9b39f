"""Random variation: near ties alone, evenly, with a memory, and the same again from the same seed."""

import random
from collections import Counter
from dataclasses import replace

import numpy as np
import pytest
from lines import DT, RATE, line

from contextdb.errors import ContextError
from contextdb.motion import Controller, ControllerSettings, Entry, Selector, Variation


def places(names):
    """A database of assets that are as near to 0 as each other, and that are all over after a frame."""
    return line(**{name: [0.0, 50.0] for name in names})


def varying(databases, variation, rng=None):
    selector = databases if isinstance(databases, Selector) else Selector([Entry("a", databases)])
    every = {"search_every_s": 0.0, "jump_threshold_s": 0.0, "history_s": 0.0, "rate": RATE}
    return Controller(selector, ControllerSettings(**every, variation=variation), rng=rng)


def played(one, n, **asked):
    return "".join(one.update(DT, [0.0], **asked).playing.asset for _ in range(n))


def test_every_near_tie_is_as_likely():
    counts = Counter(played(varying(places("abc"), Variation(0.1), seed), 1) for seed in range(3000))
    assert all(900 < counts[asset] < 1100 for asset in "abc")
    counts = Counter(played(varying(places("abc"), Variation(0.1, 0), 1), 3000))
    assert all(900 < counts[asset] < 1100 for asset in "abc")


def test_what_was_chosen_lately_is_not_chosen_again_while_there_is_another():
    chosen = played(varying(places("abcd"), Variation(0.1, 2), 2), 200)
    assert all(chosen[i] not in chosen[max(0, i - 2) : i] for i in range(len(chosen)))
    assert set(chosen) == set("abcd")
    assert played(varying(places("a"), Variation(0.1, 2)), 5) == "aaaaa"


@pytest.mark.parametrize("at", [19, 20])
@pytest.mark.parametrize("number", [-1.0, 2.0**53, np.nan, np.inf])
def test_a_seed_that_is_none_is_no_state(at, number):
    chooser = varying(places("ab"), Variation(0.1)).chooser
    row = chooser.begun()
    assert chooser.are_rows(row)
    row[0, at] = number
    assert not chooser.are_rows(row)


def test_a_state_with_another_generator_is_refused_and_one_without_goes_on_with_its_own():
    one = varying(places("abc"), Variation(0.1), 3)
    played(one, 2)
    before = one.state
    for wrong in (random.Random(1).getstate(), (1,), (-1, 0), (1, 1 << 53), "12", (1.0, 2)):
        with pytest.raises(ContextError, match="the rng of the state is no seed and count"):
            one.restore(replace(before, rng=wrong))
    assert one.state == before
    one.restore(replace(before, rng=None))
    assert one.state == before


def test_a_seed_is_a_number_or_drawn_from_a_generator():
    def drawn(rng):
        return played(varying(places("pqrstuvw"), Variation(0.1), rng), 12)

    assert drawn(None) == drawn(0) == drawn(1 << 53) != drawn(1)
    assert drawn(random.Random(1)) == drawn(int(random.Random(1).random() * (1 << 53))) != drawn(random.Random(2))
    assert drawn(np.random.default_rng(1)) == drawn(np.random.default_rng(1)) != drawn(np.random.default_rng(2))
    assert drawn(-1) == drawn((1 << 53) - 1)
    for wrong in ("1", 1.5, random.Random):
        with pytest.raises(ContextError, match="rng is of type"):
            varying(places("p"), Variation(0.1), wrong)


def test_an_asset_that_played_in_another_database_is_remembered_too():
    selector = Selector([Entry("a", places("p")), Entry("b", places("pq"))])
    one = varying(selector, Variation(0.5))
    one.update(DT, [0.0], among=["a"])
    assert one.state.recent == ("p",)
    assert played(one, 4, among=["b"]) == "qpqp"


def test_settings_with_another_memory_keep_the_assets_that_were_played_last():
    one = varying(places("pqrs"), Variation(0.5, 3), 1)
    last = played(one, 5)[-3:]
    assert one.state.recent == tuple(last)
    drawn = one.state.rng
    one.settings = replace(one.settings, variation=Variation(0.5, 1))
    one.restore(one.state)
    assert (one.state.recent, one.state.rng) == ((last[-1],), drawn)
    one.settings = replace(one.settings, variation=None)
    one.restore(one.state)
    assert (one.state.recent, one.state.rng) == ((), drawn)
