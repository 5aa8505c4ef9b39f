"""Priority databases: the rule of the talk as scenarios, and chains against a plain recursion."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from lines import line

from contextdb import Table
from contextdb.errors import MotionError, QueryError
from contextdb.motion import Entry, MotionDatabase, Selector
from contextdb.motion.answers import NamedAssets
from contextdb.motion.markup.left_out import LeftOut, Skip
from contextdb.motion.markup.marks import TagFilter
from contextdb.motion.selection.choice import Reason, Status


def database(*places, asset="clip"):
    """Frames at some places on a line: the cost of one is its squared distance to the query."""
    return MotionDatabase.from_features(np.array(places, float).reshape(-1, 1), [0], [len(places)], [asset])


TIRED = database(10.0, 20.0, asset="jog_tired")
JOG = database(9.0, 15.0, 20.0, asset="jog")
SELECTOR = Selector([Entry("jog_tired", TIRED, threshold=2.75), Entry("jog", JOG)])


def test_nothing_valid_anywhere_is_a_false_choice():
    choice = SELECTOR.search([9.0], valid=NamedAssets(["swim"]))
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
        ([Entry("a", TIRED, 1.0), Entry("a", JOG)], 'the database "a" appears twice'),
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


# ---- buckets


START, STOP = database(1.0, 2.0, asset="start"), database(1.5, 5.0, asset="stop")
BUCKETS = Selector([Entry("starts", START, threshold=0.3), Entry("stops", STOP, threshold=0.1), Entry("cycles", database(0.0))])


def test_only_the_buckets_of_the_moment_are_searched():
    choice = BUCKETS.search([1.0], among=["stops", "cycles"])
    assert (choice.database, choice.hit.cost) == ("stops", 0.25)
    assert [search.status for search in choice.searches] == [Status.NOT_AMONG, Status.WINNER, Status.BEATEN]
    assert (
        choice.why
        == "starts: not among; stops: cost 0.25, not under its threshold 0.1; cycles: cost 1. stops has the lowest cost and wins."
    )


def test_a_table_whose_rows_are_databases_names_the_buckets_and_may_name_those_of_others():
    choice = BUCKETS.search([1.0], among=NamedAssets(["cycles", "swimming"]))
    assert choice.database == "cycles"
    compiled = Table.from_columns({"Database": ["starts", "stops", "cycles"], "moving": ["False", "True", "True"]}).compile()
    assert BUCKETS.search([1.0], among=compiled.query({"moving": False})).database == "starts"
    assert not BUCKETS.search([1.0], among=[])


def test_one_bucket_may_be_named_without_a_list_and_an_unknown_one_is_refused():
    assert BUCKETS.search([1.0], among="cycles").database == "cycles"
    with pytest.raises(QueryError, match=r'the selector has no database "stop"\. .*Did you mean "stops"\?'):
        BUCKETS.search([1.0], among=["stop"])


def test_a_playing_frame_in_no_bucket_of_the_moment_does_not_continue_by_search():
    choice = BUCKETS.search([1.5], among=["cycles"], current=("stops", 0))
    assert choice.database == "cycles"


# ---- tags, penalties and skips


def test_one_tag_filter_serves_databases_whose_markup_does_not_know_its_tags():
    tired, jog = line("tired,Worn,,,", tired=[0.0, 1.0]), line("jog,Fresh,,0.05,", jog=[0.0, 1.0])
    selector = Selector([Entry("tired", tired, 0.5), Entry("jog", jog)])
    assert selector.search([1.0], tags=TagFilter("Worn")).database == "tired"
    fresh = selector.search([1.0], tags=TagFilter("Fresh"))
    assert (fresh.database, fresh.hit.frame) == ("jog", 0)
    assert fresh.searches[0].status is Status.NOTHING_VALID
    worn_out = selector.search([1.0], tags=TagFilter(prefer={"Fresh": 4.0}))
    assert (worn_out.database, worn_out.hit.cost) == ("jog", 1.0)
    assert selector.search([1.0], tags={"jog": TagFilter("Fresh")}).database == "tired"
    assert selector.with_database("jog", None).search([1.0], tags=TagFilter(exclude="Fresh")).database == "tired"


def test_a_tag_of_a_database_that_comes_later_may_be_announced():
    tired = line("tired,Worn,,,", tired=[0.0])
    entries = [Entry("tired", None, 0.5), Entry("jog", line(jog=[0.0]))]
    with pytest.raises(QueryError, match='there is no tag "Worn"'):
        Selector(entries).search([0.0], tags=TagFilter(exclude="Worn"))
    selector = Selector(entries, tags=["Worn"])
    assert selector.search([0.0], tags=TagFilter(exclude="Worn")).database == "jog"
    assert selector.with_database("tired", tired).search([0.0], tags=TagFilter("Worn")).database == "tired"


def test_knowing_the_tags_of_another_database_copies_no_features():
    tired, jog = line("tired,Worn,,,", tired=[0.0]), line(jog=[0.0])
    selector = Selector([Entry("tired", tired, 0.5), Entry("jog", jog)])
    assert selector.databases["tired"] is tired
    assert selector.databases["jog"].layout is jog.layout


def test_penalties_are_of_assets_or_of_databases():
    assert SELECTOR.search([9.0], penalties={"jog_tired": 2.0}).database == "jog"
    assert SELECTOR.search([9.0], penalties={"jog_tired": np.array([1.5])}).hit.cost == 2.5
    assert SELECTOR.search([9.0], penalties={"jog_tired": {"jog_tired": 2.0, "walk": 9.0}}).database == "jog"
    assert SELECTOR.search([9.0], penalties={}).database == "jog_tired"
    with pytest.raises(QueryError, match='the selector has no database "walk"'):
        SELECTOR.search([9.0], penalties={"walk": np.array([1.5])})


def test_frames_are_skipped_in_the_database_that_they_are_named_for():
    skip = {"jog_tired": [Skip(0, 1, LeftOut.HISTORY)]}
    assert SELECTOR.search([10.0], skip=skip).database == "jog"
    ((_, tired), (_, jog)) = SELECTOR.candidates([10.0], skip=skip)
    assert tired.why.tolist() == [LeftOut.HISTORY, LeftOut.NO]
    assert jog.why.tolist() == [LeftOut.NO] * 3


# ---- candidates


@given(st.lists(st.lists(st.integers(0, 6), min_size=1, max_size=4), min_size=1, max_size=4), st.integers(0, 6), st.data())
def test_the_first_candidate_of_each_database_is_the_hit_of_the_choice(places, query, data):
    thresholds = [data.draw(st.sampled_from([None, 0.5, 4.5])) for _ in places]
    entries = [Entry(str(i), database(*each), thresholds[i]) for i, each in enumerate(places)]
    selector, current = Selector(entries), ("0", 0) if data.draw(st.booleans()) else None
    choice = selector.search([query], current=current)
    searched = [(search.database, search.hit.frame, search.hit.cost) for search in choice.searches if search.hit is not None]
    found = selector.candidates([query], 1, current=current)
    assert [(name, rows.rows[0].frame, rows.rows[0].cost) for name, rows in found] == searched


def test_the_best_of_each_range_is_had_of_one_database():
    several = line(p=[0.0, 3.0], q=[0.1], r=[2.0])
    selector = Selector([Entry("a", several), Entry("b", database(0.0))])
    assert [hit.asset for hit in selector.best_of_ranges("a", [0.0], 0.5)] == ["p", "q"]
    assert selector.best_of_ranges("a", [0.0], 0.5, among=["b"]) == []
    with pytest.raises(QueryError, match='the selector has no database "c"'):
        selector.best_of_ranges("c", [0.0], 0.5)


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"among": 3}, r"the databases of the moment are 3\. Accepted: "),
        ({"tags": [True, False]}, r"tags is a list\. Accepted: a TagFilter, or a mapping of databases"),
        ({"bias": np.zeros(2)}, r"bias is a ndarray\. Accepted: a mapping of databases"),
        ({"skip": [Skip(0, 1)]}, "skip is a list"),
        ({"penalties": [1.0]}, r"penalties is a list\. Accepted: a mapping of assets to costs"),
        ({"current": 5}, r"what plays now is 5\. Accepted: a Choice, or such as"),
    ],
)
def test_what_a_selector_cannot_be_asked_with_is_refused(given, message):
    with pytest.raises(QueryError, match=message):
        SELECTOR.search([9.0], **given)


# ---- many characters at once


@st.composite
def chains(draw):
    """Up to three databases of two assets, with thresholds, some of them not loaded."""
    places = st.lists(st.integers(-4, 4), min_size=1, max_size=5)
    entries = []
    for name in "abc"[: draw(st.integers(1, 3))]:
        made = draw(st.one_of(st.none(), st.builds(lambda walk, run: line(walk=walk, run=run), places, places)))
        entries.append(Entry(name, made, draw(st.sampled_from([None, 0.0, 2.0, 10.0]))))
    return Selector(entries)


@given(chains(), st.data())
def test_many_choices_are_those_of_each_search_alone(selector, data):
    n = data.draw(st.integers(0, 5))
    queries = np.array(data.draw(st.lists(st.integers(-5, 5), min_size=n, max_size=n)), float).reshape(n, 1)
    table = Table.from_columns({"Asset": ["walk", "run"], "speed": ["<2", ">1"]}, {"speed": {"type": "number"}}).compile()
    many = table.query_many({"speed": data.draw(st.lists(st.sampled_from([0.0, 1.5, 3.0]), min_size=n, max_size=n))})
    name = data.draw(st.sampled_from(selector.names))
    currents = st.one_of(st.none(), st.just((name, 0)), st.sampled_from([selector.search([0.0])]))
    given = {
        "current": data.draw(st.lists(currents, min_size=n, max_size=n)),
        "among": data.draw(st.sampled_from([None, [name]])),
        "penalties": data.draw(st.sampled_from([None, {"walk": 3.0}])),
    }
    for valid, each in ((many, list(many)), (list(many), list(many)), ({name: many}, [{name: one} for one in many])):
        singly = [
            selector.search(query, own, current=now, among=given["among"], penalties=given["penalties"])
            for query, own, now in zip(queries, each, given["current"], strict=True)
        ]
        assert selector.search_many(queries, valid, **given) == singly
    assert selector.search_many(queries) == [selector.search(query) for query in queries]


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"queries": [0.0]}, r"the queries have shape \(1,\)"),
        ({"valid": {"jgo": None}}, r'the selector has no database "jgo".*Did you mean "jog"\?'),
        ({"valid": [None]}, "1 mask for 2 queries"),
        ({"current": [None]}, "1 current frame for 2 characters"),
        ({"among": ["x"]}, 'the selector has no database "x"'),
    ],
)
def test_many_choices_that_cannot_be_made_are_refused(given, message):
    with pytest.raises(QueryError, match=message):
        SELECTOR.search_many(**{"queries": [[0.0], [1.0]], **given})
