"""A copy of a character that is told what its owner plays, over a line that may lose it."""

import math
import random

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from strategies import examples
from test_character import DT, character, gait, stick_at
from test_rows_played import moves

from contextdb import ContextError, motion

N_TICKS = 150


def driven(owner, copy, lost, sticks=stick_at, ticks=N_TICKS):
    """How far the farthest joint of the copy is from the owner's, metres, at each tick; packets of `lost` ticks do not arrive."""
    apart = []
    for tick in range(ticks):
        stick = sticks(tick)
        own = owner.update(DT, stick, gait(stick))
        data = b"" if tick in lost else owner.pack()
        other = copy.unpack(data, DT, stick, body=own.body)
        apart.append(float(np.linalg.norm(own.pose.positions - other.pose.positions, axis=1).max()))
    return apart


@given(st.lists(st.tuples(st.floats(-2.5, 2.5), st.floats(-2.5, 2.5)), min_size=1, max_size=5))
@examples(0.2)
def test_a_copy_that_hears_all_shows_the_poses_of_its_owner_to_the_bit(turns):
    apart = driven(character(), character(), frozenset(), lambda tick: turns[tick // 30 % len(turns)])
    assert apart == [0.0] * N_TICKS


def test_a_copy_needs_no_tables():
    copy = character()
    copy.tables = None
    assert driven(character(), copy, frozenset()) == [0.0] * N_TICKS


@pytest.mark.parametrize("seed", range(4))
def test_after_any_loss_a_copy_comes_back_to_its_owner(seed):
    lost = {tick for tick in range(100) if random.Random(seed * 1000 + tick // 7).random() < 0.5}
    apart = driven(character(), character(), lost, ticks=220)
    assert max(apart) > 0.05, "something was lost"
    assert max(apart[160:]) < 0.03, "two seconds after the last loss"


def test_a_copy_that_joins_late_plays_what_its_owner_plays_at_the_first_packet():
    owner, copy = character(), character()
    for tick in range(70):
        owner.update(DT, stick_at(tick), gait(stick_at(tick)))
    own = owner.update(DT, (0.0, 1.2), gait((0.0, 1.2)))
    other = copy.unpack(owner.pack(), DT, body=own.body)
    assert other.decision.playing.asset == own.decision.playing.asset
    assert abs(other.decision.playing.frame - own.decision.playing.frame) <= 1


def test_a_packet_is_a_few_bytes():
    owner, sizes = character(), []
    assert owner.pack() == b""
    for tick in range(100):
        owner.update(DT, stick_at(tick), gait(stick_at(tick)))
        sizes.append(len(owner.pack()))
    assert max(sizes) <= 6


def test_how_a_row_plays_is_told_too():
    tables = moves(play_rate="0.9..1.1", blend_s="0.4", until="natural")
    assert driven(character(tables=tables), character(), frozenset()) == [0.0] * N_TICKS


@given(st.binary(max_size=24))
@examples(2)
def test_other_bytes_are_refused_or_play_something_and_leave_no_fault(data):
    copy = character()
    before = copy.state
    try:
        updated = copy.unpack(data, DT, (0.0, 1.0))
    except ContextError:
        assert copy.state == before
    else:
        assert np.isfinite(updated.pose.positions).all()


@pytest.mark.parametrize("data", [None, "x", b"\x04", b"\x04\x09\x00\x00", b"\x04\x00\xff\xff\x7f\x00", b"\x84\x00\x00\x00"])
def test_what_is_no_packet_is_refused(data):
    with pytest.raises(ContextError, match="its owner's `pack`"):
        character().unpack(data, DT)


def test_a_state_in_which_something_varies_has_equal_futures():
    def varying(seed):
        one = character()
        one.controller = motion.Controller(
            one.controller.selector,
            motion.ControllerSettings(variation=motion.Variation(within=5.0), search_every_s=0.1),
            rng=random.Random(seed),
        )
        return one

    def played(one, ticks):
        return [one.update(DT, stick_at(tick), gait(stick_at(tick))).decision.playing for tick in ticks]

    one, other = varying(1), varying(2)
    played(one, range(40))
    other.restore(one.state)
    assert other.state == one.state
    assert played(other, range(40, 120)) == played(one, range(40, 120))
    with pytest.raises(ContextError):
        other.restore(one.state + b"{")
    assert math.isclose(other.body.position[0], one.body.position[0])
