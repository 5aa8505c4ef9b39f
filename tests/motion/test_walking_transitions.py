"""Transitions by name: which clip leads from a state to another, and which pairs have none."""

import pytest

from contextdb.motion import MotionError
from contextdb.motion.walking.transitions import Transitions

CLIPS = ["walk", "run", "idle_to_walk", "walk_to_idle", "walk_to_rum", "run-idle"]


@pytest.mark.parametrize(
    ("from_state", "to_state", "clip"),
    [
        ("idle", "walk", "idle_to_walk"),
        ("walk", "idle", "walk_to_idle"),
        ("walk", "run", None),
        ("run", "idle", "run-idle"),
        ("idle", "run", None),
        ("run", "walk", None),
        ("walk", "walk", None),
    ],
)
def test_a_transition_is_found_by_its_name_or_there_is_none(from_state, to_state, clip):
    assert Transitions(CLIPS, ("{from}_to_{to}", "{from}-{to}")).find(from_state, to_state) == clip


def test_the_first_pattern_with_a_clip_counts():
    clips = ["a_to_b", "b_from_a"]
    assert Transitions(clips, ("{to}_from_{from}", "{from}_to_{to}")).find("a", "b") == "b_from_a"
    assert Transitions(clips).find("a", "b") == "a_to_b"


def test_pairs_without_a_clip_are_listed_with_its_name_and_what_may_be_misspelt():
    missing = Transitions(CLIPS).missing(["walk", "run", "walk"])
    assert [(each.from_state, each.to_state, each.wanted, each.near) for each in missing] == [
        ("walk", "run", ("walk_to_run",), "walk_to_rum"),
        ("run", "walk", ("run_to_walk",), ""),
    ]
    assert Transitions(CLIPS).missing(["idle", "walk"]) == []


def test_every_pair_is_either_found_or_missing():
    states, found = ["idle", "walk", "run"], Transitions(CLIPS)
    pairs = {(a, b) for a in states for b in states if a != b}
    assert {(each.from_state, each.to_state) for each in found.missing(states)} == {p for p in pairs if found.find(*p) is None}


@pytest.mark.parametrize(
    "pattern", ["{from}", "from_to", "{from}_{to}_{x}", "{from!r}_{to}", "{from:>9}_{to}", "{", "{from.x}_{to}", "{}_{}"]
)
def test_a_pattern_without_both_states_is_refused(pattern):
    with pytest.raises(MotionError, match=r"\{from\}"):
        Transitions(CLIPS, [pattern])


def test_no_pattern_is_refused():
    with pytest.raises(MotionError, match="no pattern"):
        Transitions(CLIPS, [])
