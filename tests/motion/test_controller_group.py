"""A crowd is decided as its characters are one by one: decision for decision, state for state, whatever they are asked with."""

import random
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from lines import DT, RATE, line
from strategies import examples

import contextdb as cdb
from contextdb.errors import ContextError, MotionError, QueryError
from contextdb.motion import Entry, Selector, Steered
from contextdb.motion.markup.marks import TagFilter
from contextdb.motion.selection.controller import Controller
from contextdb.motion.selection.controller_group import ControllerGroup
from contextdb.motion.selection.controller_settings import ControllerSettings
from contextdb.motion.selection.decision import Action
from contextdb.motion.selection.variation import Variation

NAMES = "pqr"
PLACES = st.integers(0, 8)
SECONDS = st.sampled_from([0.0, 0.1, 0.2, 0.3])
SETTINGS = st.builds(
    ControllerSettings,
    search_every_s=SECONDS,
    jump_threshold_s=SECONDS,
    history_s=SECONDS,
    variation=st.sampled_from([None, None, Variation(1.0), Variation(4.0, 2)]),
    rate=st.just(RATE),
    cost_bar=st.sampled_from([None, 0.0, 1.0, 4.0]),
    grace_s=SECONDS,
    until_natural=st.booleans(),
)


class Recorder:
    def __init__(self, n_candidates):
        self.n_candidates = n_candidates
        self.decisions = []

    def record(self, decision):
        self.decisions.append(decision)


@st.composite
def databases(draw):
    """A few short assets with markup."""
    assets = {name: draw(st.lists(PLACES, min_size=1, max_size=9)) for name in NAMES[: draw(st.integers(1, 3))]}
    rows = []
    for name in assets:
        for tag in draw(
            st.lists(st.sampled_from(["Looping", "Move", "Calm", "DoNotChoose", "NextNaturalOnly"]), max_size=2, unique=True)
        ):
            start = draw(st.integers(0, 5)) / RATE
            rows.append(f"{name},{tag},,," if tag == "Looping" else f"{name},{tag},{start},{start + 0.3},")
    return line("\n".join(rows), continuing=draw(st.sampled_from([0.0, -0.5, -3.0])), **assets)


@st.composite
def selectors(draw):
    entries = [Entry("a", draw(databases()), draw(st.sampled_from([None, 1.0, 4.0]))), Entry("b", draw(databases()))]
    return Selector(entries[draw(st.integers(0, 1)) :] if draw(st.booleans()) else entries, tags=("Move", "Calm"))


@st.composite
def crowds(draw):
    """Makes the same characters again each time that it is called."""
    choices = draw(st.lists(selectors(), min_size=1, max_size=2))
    each = draw(st.lists(st.tuples(st.sampled_from(choices), SETTINGS, st.integers(0, 3)), max_size=5))
    n_candidates = draw(st.sampled_from([0, 0, 3]))

    def make():
        return [Controller(s, t, Recorder(n_candidates), rng=random.Random(seed)) for s, t, seed in each]

    return make


def answers(data, n):
    """What a table whose rows are the assets answers to n contexts."""
    cells = data.draw(st.lists(st.sampled_from(["Any", "<2", ">1", "<2 ~0.5"]), min_size=3, max_size=3))
    speed = {"type": "number", "hysteresis": data.draw(st.sampled_from([0.0, 1.25]))}
    compiled = cdb.Table.from_columns({"Asset": list(NAMES), "speed": cells}, {"speed": speed}).compile()
    return compiled.query_many({"speed": data.draw(st.lists(st.sampled_from([0.0, 1.5, 3.0]), min_size=n, max_size=n))})


def given_to_all(data, selector_names, n):
    """What an update is given, and what each of the n characters is given of it."""
    asked, own = {}, [{} for _ in range(n)]

    def draw_each(name, values):
        if data.draw(st.booleans()):
            asked[name] = data.draw(st.lists(values, min_size=n, max_size=n))
            for one, value in zip(own, asked[name], strict=True):
                one[name] = value
        elif data.draw(st.booleans()):
            asked[name] = data.draw(values)
            for one in own:
                one[name] = asked[name]

    draw_each("tags", st.sampled_from([None, TagFilter("Move"), TagFilter(exclude=["Calm"]), TagFilter(prefer={"Move": 0.7})]))
    draw_each("penalties", st.sampled_from([None, {"p": 1.5}, {"q": 0.25, "r": 3.0}]))
    draw_each("among", st.sampled_from([None, ["b"], ("b",)]) if "b" in selector_names else st.none())
    draw_each("force", st.booleans())
    draw_each("interrupt", st.sampled_from([False, False, True]))
    if data.draw(st.booleans()):
        places = data.draw(st.lists(st.tuples(PLACES, PLACES, PLACES), min_size=n, max_size=n))
        asked["body"] = np.array(places, float).reshape(-1, 3)
        for one, place in zip(own, places, strict=True):
            one["body"] = place
    if data.draw(st.booleans()):
        many = answers(data, n)
        how = data.draw(st.sampled_from(["many", "list", "one", "of databases"])) if n else "many"
        asked["valid"] = {"many": many, "list": list(many), "one": many[0] if n else None, "of databases": {"b": many}}[how]
        for one, matches in zip(own, many, strict=True):
            one["valid"] = {"many": matches, "list": matches, "one": many[0], "of databases": {"b": matches}}[how]
    return asked, own


def told(decision):
    """A decision without its arrays."""
    rows = [(name, [(row.frame, row.cost, row.left_out) for row in found.rows]) for name, found in decision.candidates]
    return replace(decision, query=None, candidates=(), filters=()), decision.query.tolist(), rows


@examples(2)
@given(st.data())
def test_a_group_decides_tick_by_tick_as_its_controllers_do_alone(data):
    make = data.draw(crowds())
    alone, group = make(), ControllerGroup(make())
    names = set.intersection(*(set(one.selector.names) for one in alone)) if alone else {"b"}
    for _ in range(data.draw(st.integers(1, 8))):
        dt_s = data.draw(st.sampled_from([DT, DT, 0.0, 0.25]))
        queries = np.array(data.draw(st.lists(PLACES, min_size=len(alone), max_size=len(alone))), float).reshape(-1, 1)
        asked, own = given_to_all(data, names, len(alone))
        expected = [one.update(dt_s, query, **each) for one, query, each in zip(alone, queries, own, strict=True)]
        assert [told(decision) for decision in group.update(dt_s, queries, **asked)] == [told(decision) for decision in expected]
        assert group.states == [one.state for one in alone]
        assert group.playing == [one.playing for one in alone]
        assert group.upcoming(DT) == [one.upcoming(DT) for one in alone]
        for one, own_of_group in zip(alone, group, strict=True):
            assert [told(d) for d in own_of_group.recorder.decisions] == [told(d) for d in one.recorder.decisions]
        if alone and data.draw(st.integers(0, 3)) == 0:
            i = data.draw(st.integers(0, len(alone) - 1))
            group.remove(group[i])
            del alone[i]


def one_on(selector, **changes):
    return Controller(selector, ControllerSettings(**{"search_every_s": 0.0, "history_s": 0.0, "rate": RATE, **changes}))


def test_characters_come_and_go_between_updates():
    selector = Selector([Entry("a", line(walk=range(10)))])
    first, second = one_on(selector), one_on(selector)
    group = ControllerGroup([first])
    assert [d.action for d in group.update(DT, [[1.0]])] == [Action.START]
    group.add(second)
    assert [d.action for d in group.update(DT, [[2.0], [5.0]])] == [Action.CONTINUE, Action.START]
    group.remove(first)
    assert (len(group), group[0]) == (1, second)
    assert group.playing == [second.playing]
    with pytest.raises(MotionError, match="has this controller already"):
        group.add(second)
    with pytest.raises(MotionError, match="does not have this controller"):
        group.remove(first)


def test_a_group_goes_on_from_its_states():
    selector = Selector([Entry("a", line(walk=range(10), run=range(3, 13)))])
    group = ControllerGroup([one_on(selector), one_on(selector, search_every_s=0.2)])
    group.update(DT, [[1.0], [4.0]])
    states = group.states
    first = [d.playing for d in group.update(DT, [[7.0], [9.0]])]
    group.restore(states)
    assert [d.playing for d in group.update(DT, [[7.0], [9.0]])] == first
    with pytest.raises(QueryError, match="1 state for 2 characters"):
        group.restore(states[:1])


def test_poses_are_the_features_of_the_frames_that_come_up():
    selector = Selector([Entry("a", line(walk=[1, 2, 4, 8])), Entry("b", line(run=[3, 9, 27]))])
    group = ControllerGroup([one_on(selector) for _ in range(3)])
    assert group.poses(DT).tolist() == [[0.0], [0.0], [0.0]]
    group.update(0.0, [[2.0], [9.0], [50.0]], {"a": [[True], [True], [False]], "b": [[True], [True], [False]]})
    assert group.poses(DT).tolist() == [[4.0], [27.0], [0.0]]
    assert ControllerGroup().poses(DT).shape == (0, 0)


def test_the_time_of_a_search_is_shared_by_those_who_searched():
    ticks = iter([1.0, 1.5])
    selector, settings = Selector([Entry("a", line(walk=range(10)))]), ControllerSettings(rate=RATE)
    group = ControllerGroup([Controller(selector, settings, clock=lambda: next(ticks)) for _ in range(2)])
    assert [d.search_us for d in group.update(DT, [[1.0], [2.0]])] == [250000.0, 250000.0]
    assert [d.search_us for d in group.update(0.0, [[1.0], [2.0]])] == [None, None]


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"queries": [[0.0]]}, r"the queries have shape \(1, 1\)\. Accepted: one for each of 2 characters"),
        ({"queries": [[0.0], [np.nan]]}, 'character 1: .*"feature 0" is nan'),
        ({"dt_s": -1.0}, "character 0: an update of -1.0 seconds"),
        ({"tags": [None, TagFilter("Clam")]}, r'character 1: there is no tag "Clam"'),
        ({"tags": [None]}, "1 tag filter for 2 characters"),
        ({"force": [True]}, "1 flag to force for 2 characters"),
        ({"among": [["a"], ["z"]]}, r'character 1: the selector has no database "z"'),
        ({"valid": [None]}, "1 mask for 2 characters"),
        ({"valid": {"z": None}}, r'the selector has no database "z"'),
        ({"contexts": [{}]}, "1 context for 2 characters"),
        ({"body": [None]}, "1 body for 2 characters"),
    ],
)
def test_what_cannot_be_meant_is_refused_and_nobody_moves(given, message):
    group = ControllerGroup([one_on(Selector([Entry("a", line("walk,Calm,,,", walk=range(10)))])) for _ in range(2)])
    group.update(DT, [[0.0], [3.0]])
    before = group.states
    with pytest.raises(QueryError, match=message):
        group.update(**{"dt_s": DT, "queries": [[0.0], [0.0]], **given})
    assert group.states == before


def test_the_bodies_of_a_crowd_are_recorded_each_with_its_own_character():
    group = ControllerGroup([one_on(Selector([Entry("a", line(walk=range(10)))])) for _ in range(2)])
    at_left, at_right = Steered(position=(1.0, 2.0), heading=0.5), Steered(position=(-1.0, 4.0))
    places = [(1.0, 2.0, 0.5), (-1.0, 4.0, 0.0)]
    for body in ([at_left, at_right], places, np.array(places)):
        assert [d.body for d in group.update(DT, [[0.0], [3.0]], body=body)] == places
    assert [d.body for d in group.update(DT, [[0.0], [3.0]], body=[None, at_left])] == [None, places[0]]
    assert [d.body for d in group.update(DT, [[0.0], [3.0]])] == [None, None]
    before = group.states
    with pytest.raises(ContextError, match=r"character 1: body is 7\. Accepted: a Steered"):
        group.update(DT, [[0.0], [3.0]], body=[None, 7])
    assert group.states == before
