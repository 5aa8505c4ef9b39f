"""Priority databases: the rule of the talk as scenarios, and chains against a plain recursion."""

from __future__ import annotations

import math
from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from contextdb.errors import MotionError, QueryError
from contextdb.motion import Entry, MotionDatabase, Reason, Selector, Status


def database(*places, asset="clip"):
    """Frames at some places on a line: the cost of one is its squared distance to the query."""
    return MotionDatabase.from_features(np.array(places, float).reshape(-1, 1), [0], [len(places)], [asset])


TIRED = database(10.0, 20.0, asset="jog_tired")
JOG = database(9.0, 15.0, 20.0, asset="jog")
SELECTOR = Selector([Entry("jog_tired", TIRED, threshold=2.75), Entry("jog", JOG)])


def test_the_priority_database_wins_outright_below_its_threshold_though_the_default_is_nearer():
    choice = SELECTOR.search([9.0])  # tired costs 1.0, jog would cost nothing
    assert (choice.database, choice.hit.asset, choice.hit.cost) == ("jog_tired", "jog_tired", 1.0)
    assert choice.reason is Reason.UNDER_THRESHOLD
    assert [search.status for search in choice.searches] == [Status.WINNER, Status.NOT_SEARCHED]
    assert choice.searches[1].hit is None


def test_above_the_threshold_the_default_is_searched_and_the_lower_of_the_two_wins():
    choice = SELECTOR.search([15.5])  # tired costs 20.25, jog 0.25
    assert (choice.database, choice.hit.cost) == ("jog", 0.25)
    assert choice.reason is Reason.LOWEST
    assert [search.status for search in choice.searches] == [Status.BEATEN, Status.WINNER]


def test_above_the_threshold_the_priority_database_still_wins_when_it_is_lower():
    choice = SELECTOR.search([12.0])  # tired costs 4.0, jog 9.0
    assert (choice.database, choice.hit.cost) == ("jog_tired", 4.0)
    assert choice.reason is Reason.LOWEST


def test_a_cost_equal_to_the_threshold_is_not_below_it():
    selector = Selector([Entry("priority", database(2.0), threshold=4.0), Entry("default", database(1.0))])
    assert selector.search([0.0]).database == "default"


def test_on_a_tie_the_priority_database_wins():
    choice = SELECTOR.search([20.0 + 1e9])
    assert choice.searches[0].hit.cost == choice.searches[1].hit.cost
    assert choice.database == "jog_tired"


def test_a_priority_database_without_a_valid_asset_leaves_the_choice_to_the_default():
    choice = SELECTOR.search([9.0], valid=SimpleNamespace(assets=["jog"]))
    assert choice.database == "jog"
    assert [search.status for search in choice.searches] == [Status.NOTHING_VALID, Status.WINNER]


def test_nothing_valid_anywhere_is_a_false_choice():
    choice = SELECTOR.search([9.0], valid=SimpleNamespace(assets=["swim"]))
    assert not choice
    assert (choice.database, choice.hit.cost, choice.reason) == (None, math.inf, Reason.NOTHING_VALID)
    assert choice.why == "jog_tired: nothing valid; jog: nothing valid. Nothing may play."


def test_a_database_may_be_dropped_and_loaded_at_run_time():
    without = SELECTOR.with_database("jog_tired", None)
    choice = without.search([9.0])
    assert (choice.database, choice.hit.cost) == ("jog", 0.0)
    assert choice.searches[0].status is Status.NOT_LOADED
    assert without.with_database("jog_tired", TIRED).search([9.0]).database == "jog_tired"


def test_a_choice_tells_in_a_sentence_why_the_winner_won():
    told = SELECTOR.search([9.0]).why
    assert told == "jog_tired: cost 1, under its threshold 2.75; jog: not searched. jog_tired wins outright."
    told = SELECTOR.search([15.5]).why
    assert told == "jog_tired: cost 20.25, not under its threshold 2.75; jog: cost 0.25. jog has the lowest cost and wins."


def test_the_current_frame_wins_ties_in_its_own_database():
    selector = Selector([Entry("priority", database(0.0, 0.0), 1.0), Entry("default", database(0.0, 0.0))])
    assert selector.search([0.0], current=("priority", 1)).hit.frame == 1
    assert selector.search([0.0], current=("default", 1)).hit.frame == 0
    again = selector.search([0.0], current=selector.search([0.0], current=("priority", 1)))
    assert again.hit.frame == 1
    nothing = selector.search([0.0], valid=[False])
    assert selector.search([0.0], current=nothing).hit.frame == 0


def test_masks_tags_and_biases_may_differ_between_databases():
    assert SELECTOR.search([10.0], valid={"jog_tired": [False]}).database == "jog"
    assert SELECTOR.search([10.0], tags={"jog_tired": [False, True]}).database == "jog"
    assert SELECTOR.search([10.0], bias={"jog_tired": [5.0, 0.0]}).database == "jog"
    assert SELECTOR.search([9.9], bias={"jog_tired": [2.0, 0.0]}).reason is Reason.UNDER_THRESHOLD


COSTS = st.lists(st.sampled_from([0.0, 1.0, 4.0, 9.0, math.inf]), min_size=1, max_size=5)


@given(COSTS, st.data())
def test_a_chain_chooses_as_the_rule_applied_to_each_database_and_the_rest_of_the_chain(costs, data):
    thresholds = [*data.draw(st.lists(st.integers(0, 10), min_size=len(costs) - 1, max_size=len(costs) - 1)), None]

    def rule(i):
        """The winner among database i and those behind it."""
        if thresholds[i] is None or costs[i] < thresholds[i]:
            return i
        rest = rule(i + 1)
        return rest if costs[rest] < costs[i] else i

    def entry(i):
        frames = (
            database(math.sqrt(costs[i])) if costs[i] < math.inf else MotionDatabase.from_features(np.zeros((0, 1)), [], [], [])
        )
        return Entry(str(i), frames, thresholds[i])

    choice = Selector([entry(i) for i in range(len(costs))]).search([0.0])
    if math.isinf(costs[rule(0)]):
        assert not choice
    else:
        assert choice.database == str(rule(0))
        assert [search.status for search in choice.searches].count(Status.WINNER) == 1


@pytest.mark.parametrize(
    ("entries", "message"),
    [
        ([], "the selector has no database"),
        ([Entry("a", TIRED, 1.0), Entry("a", JOG)], 'the database "a" stands twice'),
        ([Entry("a", TIRED, math.nan), Entry("b", JOG)], 'the threshold of "a" is not a number'),
        (
            [Entry("a", TIRED, 1.0), Entry("b", MotionDatabase.from_features(np.zeros((1, 2)), [0], [1], ["x"]))],
            "have different channels",
        ),
    ],
)
def test_a_selector_that_cannot_choose_is_refused(entries, message):
    with pytest.raises(MotionError, match=message):
        Selector(entries)


@pytest.mark.parametrize("key", ["valid", "tags", "bias"])
def test_an_unknown_database_is_refused_with_the_nearest(key):
    with pytest.raises(QueryError, match=r'the selector has no database "jog_tird".*Did you mean "jog_tired"\?'):
        SELECTOR.search([0.0], **{key: {"jog_tird": [True]}})
    with pytest.raises(QueryError, match="the selector has no database"):
        SELECTOR.with_database("run", None)
