"""An event that is to happen at a moment: only frames that lead there in time are chosen, and it happens on time."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from lines import DT, RATE, line
from made_once import make_clip
from strategies import examples

from contextdb import Table
from contextdb.errors import QueryError
from contextdb.motion import (
    Character,
    Controller,
    ControllerGroup,
    ControllerSettings,
    Crowd,
    Entry,
    FeatureSchema,
    MotionDatabase,
    Selector,
    Trace,
)
from contextdb.motion.markup.left_out import LeftOut
from contextdb.motion.markup.markup import Markup
from contextdb.motion.selection.events import seconds_to
from contextdb.motion.trace.what_if import run_again

FEW = ControllerSettings(search_every_s=60.0, history_s=0.0, jump_threshold_s=0.0, min_play_rate=0.8, max_play_rate=1.25, rate=RATE)


@st.composite
def scenes(draw):
    """Assets with hits at some seconds, loops and frames that are excluded, and in how many seconds one shall be hit."""
    assets, hits, loops, excluded = {}, {}, set(), {}
    for name in "pqr"[: draw(st.integers(1, 3))]:
        n = draw(st.integers(1, 14))
        assets[name] = draw(st.lists(st.integers(0, 6), min_size=n, max_size=n))
        hits[name] = draw(st.sets(st.integers(0, n), max_size=3))
        excluded[name] = draw(st.sets(st.integers(0, n), max_size=1))
        if draw(st.booleans()):
            loops.add(name)
    return assets, hits, loops, excluded, draw(st.sampled_from([0.05, 0.1, 0.3, 0.4, 0.75, 1.1])), draw(st.integers(0, 6))


def made(assets, hits, loops, excluded):
    rows = [f"{name},Looping,,," for name in sorted(loops)]
    rows += [f"{name},Hit,{i / RATE},{i / RATE}," for name, own in hits.items() for i in sorted(own - {j + 1 for j in own})]
    rows += [f"{name},Excluded,{i / RATE},{i / RATE}," for name, own in excluded.items() for i in own]
    return line("\n".join(["none,Hit,,,", *rows]), **assets)


def to_hit(n, hits, loops, excluded, frame):
    """Frames from one to the next hit, walked one by one; None where there is none."""
    for steps in range(2 * n):
        at = frame + steps
        if loops and n > 1 and at >= n and 0 not in excluded:
            at -= n - 1  # the last frame is the first once more
        if at >= n or (steps and at in excluded) or (not steps and frame in excluded):
            return None
        if at in hits and at > 0:
            return steps
    return None


@examples(10)
@given(scenes())
def test_only_frames_that_lead_to_the_event_in_time_are_chosen_and_it_happens_on_time(scene):
    assets, hits, loops, excluded, in_s, place = scene
    hits = {name: own - {j + 1 for j in own} for name, own in hits.items()}
    database = made(assets, hits, loops, excluded)
    cheapest, least, away = None, math.inf, {}
    for i, name in enumerate(assets):
        for k, own in enumerate(assets[name]):
            steps = to_hit(len(assets[name]), hits[name], name in loops, excluded[name], k)
            away[int(database.starts[i]) + k] = steps
            leads = steps is not None and any(
                abs(steps / RATE - rate * in_s) <= 0.05 + 1e-9 for rate in np.linspace(0.8, 1.25, 1000)
            )
            if leads and (own - place) ** 2 < least:
                cheapest, least = int(database.starts[i]) + k, (own - place) ** 2
    told = seconds_to(database, "Hit", RATE)
    assert [None if math.isnan(each) else round(each * RATE) for each in told] == [away[frame] for frame in range(len(told))]
    one = Controller(Selector([Entry("a", database)]), FEW)
    decision = one.update(DT, [float(place)], event=("Hit", in_s))
    assert (decision.playing and decision.playing.frame) == cheapest
    if cheapest is not None:
        rate = away[cheapest] / RATE / in_s
        assert decision.play_rate == pytest.approx(min(max(rate, 0.8), 1.25))
        assert abs(away[cheapest] / RATE - decision.play_rate * in_s) <= 0.05 + 1e-9


STEPS = """asset,tag,from,to,value
walk,Looping,,,
walk,Contact.Left,0.2,0.5,
walk,Contact.Left,0.8,0.9,
walk,Contact.Right,0.5,0.75,
jog,Contact.Left,0.1,0.3,
jog,Contact.Right,0.4,0.6,
"""
SCHEMA = FeatureSchema.from_dict(
    "loco", {"rate": 30.0, "channels": [{"type": "position", "bone": "LeftFoot"}], "mirror": [["Left*", "Right*"]]}
)
CLIPS = [make_clip(name).clip for name in ("walk", "jog", "idle")]
WALKS = MotionDatabase.build(CLIPS, SCHEMA, mirror=True, markup=Markup.parse(STEPS))


def landings(playing):
    """When the left foot comes down in what plays, as its marks say; in a walk again after its end."""
    left, right = {"walk": ((0.2, 0.8), (0.5,)), "jog": ((0.1,), (0.4,)), "idle": ((), ())}[playing.asset]
    own = right if playing.mirrored else left
    return (*own, *(each + CLIPS[0].duration_s for each in own if playing.asset == "walk"))


def heard(one, in_s, steps, seed):
    """When a foot came down after `in_s` was asked for, with searches on the way, as seconds; frames that are entered there too."""
    times = []
    for tick in range(steps):
        left_s, before, rate = in_s - tick / 60, one.playing, one.state.play_rate
        query = [0.1, 0.2, math.sin(seed + tick) * 0.5]
        event = ("contact.left", max(left_s, 0.0)) if left_s > -1e-6 else None
        playing = one.update(1 / 60 if tick else 0.0, query, event=event).playing
        passed_s = rate / 60 if tick else 0.0
        away = [each - before.time_s for each in landings(before)]
        times += [(tick - 1) / 60 + each / rate for each in away if 1e-6 < each <= passed_s + 1e-6]
        times += [tick / 60 for each in landings(playing) if abs(each - playing.time_s) < 1e-6]
    return times


@pytest.mark.parametrize("in_s", [0.15, 0.4, 0.7])
def test_a_foot_comes_down_on_time_though_it_is_searched_meanwhile(in_s):
    one = Controller(Selector([Entry("a", WALKS)]), ControllerSettings())
    for seed in range(40):
        one.update(1 / 30, [0.1, 0.2, seed / 40 - 0.5], interrupt=True)
        times = heard(one, in_s, math.ceil(in_s * 60) + 3, seed)
        assert min(abs(each - in_s) for each in times) <= 0.5 / 30 + 1e-6


def test_the_limits_of_a_row_say_how_far_its_frames_lead():
    none = dict.fromkeys("pq", ())
    database = made({"p": range(8), "q": range(8)}, {"p": {6}, "q": {6}}, set(), none)
    rows = Table.from_columns({"Asset Name": ["p", "q"], "play_rate": ["1", "0.5..3"]}, {}, {"outputs": ["play_rate"]})
    one = Controller(Selector([Entry("a", database)]), FEW)
    decision = one.update(DT, [0.0], rows.compile().query({}), event=("Hit", 0.2))
    assert (decision.playing.asset, decision.playing.frame, round(decision.play_rate, 9)) == ("q", 8, 3.0)
    assert one.update(0.2, [0.0], rows.compile().query({}), event=("Hit", 0.0)).playing.frame == 14


def test_one_of_a_crowd_is_asked_for_an_event_and_plays_as_it_does_alone():
    def crowd(n):
        return ControllerGroup(Controller(Selector([Entry("a", WALKS)])) for _ in range(n))

    together, alone, other = crowd(2), crowd(1), crowd(1)
    for tick in range(40):
        queries, event = [[0.1, 0.0, 0.3], [0.1, 0.0, -0.3]], ("Contact.Right", 1.0 - tick / 60)
        both = together.update(1 / 60, queries, event=[event, None])
        each = [*alone.update(1 / 60, queries[:1], event=event), *other.update(1 / 60, queries[1:])]
        assert [(one.playing, one.play_rate) for one in both] == [(one.playing, one.play_rate) for one in each]


def test_what_an_event_leaves_out_is_recorded_and_read_and_the_session_runs_again_with_it():
    database = made({"p": [3.0] * 8, "q": [3.5] * 8}, {"p": set(), "q": {5}}, set(), dict.fromkeys("pq", ()))
    selector = Selector([Entry("a", database)])
    trace = Trace(8, selector.databases)
    one = Controller(selector, FEW, trace)
    for tick in range(4):
        one.update(DT, [3.0], event=("Hit", max(0.2 - tick * DT, 0.0)))
    loaded = Trace.from_bytes(trace.to_bytes())
    assert [each.inputs.event for each in loaded] == [("Hit", 0.2), ("Hit", 0.1), ("Hit", 0.0), ("Hit", 0.0)]
    loaded.use(selector.databases)
    reasked = loaded.reasked()
    found = reasked.why_not(0, "p")
    assert (found.winner, found.reasons[0]) == ("q", "event: does not lead to Hit in 0.2 s")
    assert [(each.kind, each.what, each.wins) for each in found.changes] == [("event", "Hit", True)]
    assert {row.left_out for _, own in loaded[0].candidates for row in own} == {LeftOut.NO, LeftOut.EVENT}
    assert [(each.playing, each.play_rate) for each in run_again(reasked)] == [(each.playing, each.play_rate) for each in trace]


def test_what_plays_and_does_not_lead_to_an_event_is_left_and_says_so():
    database = made({"p": [3.0] * 8, "q": [3.5] * 8}, {"p": set(), "q": {5}}, set(), dict.fromkeys("pq", ()))
    one = Controller(Selector([Entry("a", database)]), FEW)
    assert one.update(DT, [3.0]).playing.asset == "p"
    decision = one.update(DT, [3.0], event=("Hit", 0.2))
    assert decision.why == "p does not lead to Hit in 0.2 s: q at 0.20 s costs 0.25."
    assert one.update(DT, [3.5], force=True, event=("Hit", 0.1)).why.startswith("A search was forced: ")


def test_a_database_without_the_event_does_not_lead_to_it_and_one_that_none_has_is_refused():
    without, with_hit = line(p=[3.0] * 8), made({"q": [3.5] * 8}, {"q": {5}}, set(), {"q": ()})
    one = Controller(Selector([Entry("a", without), Entry("b", with_hit)]), FEW)
    assert one.update(DT, [3.0], event=("Hit", 0.2)).playing.asset == "q"
    with pytest.raises(QueryError, match='Accepted: "Hit"'):
        one.update(DT, [3.0], event=("Hti", 0.2))


def test_a_crowd_is_asked_for_events_as_its_characters_are():
    def characters(n):
        settings = ControllerSettings(search_every_s=0.1)
        return [Character(Controller(Selector([Entry("a", WALKS)]), settings), SCHEMA) for _ in range(n)]

    crowd, alone = Crowd(characters(3)), characters(3)
    for tick in range(40):
        events = [("Contact.Right", 1.0 - tick / 60), None, ("Contact.Left", 1.2 - tick / 60)]
        together = crowd.update(1 / 60, [(0.0, 1.0)] * 3, event=events)
        each = [one.update(1 / 60, (0.0, 1.0), event=event) for one, event in zip(alone, events, strict=True)]
        decided = [[(one.decision.playing, one.decision.play_rate, one.decision.why) for one in own] for own in (together, each)]
        assert decided[0] == decided[1]
    with pytest.raises(QueryError, match="character 0"):
        crowd.update(1 / 60, [(0.0, 1.0)] * 3, event=("Hti", 0.2))
    assert crowd.states == [one.state for one in alone]


@pytest.mark.parametrize(
    ("event", "message"),
    [
        ("Hit", "the event is 'Hit'. Accepted: a tag and the seconds until it begins"),
        (("Hit", -1.0), "the event is ('Hit', -1.0)."),
        (("Hti", 0.4), 'there is no tag "Hti". Accepted: "Hit". Did you mean "Hit"?'),
        (("Looping", 0.4), 'there is no event "Looping". Accepted: "Hit", "Contact.Left", "Contact.Right".'),
    ],
)
def test_what_is_no_event_is_refused_and_the_controller_stands(event, message):
    one = Controller(Selector([Entry("a", made({"p": range(4)}, {"p": {2}}, set(), {"p": ()}))]), FEW)
    with pytest.raises(QueryError) as error:
        one.update(DT, [0.0], event=event)
    assert message in str(error.value)
    assert one.playing is None
