"""A recorded decision asked again: what was recorded comes out bit for bit, and every other asset has its cost and reason too."""

import random
from dataclasses import replace

import numpy as np
import pytest
from made_once import make_clip

from contextdb.errors import ContextDBError, MotionError
from contextdb.motion import Controller, ControllerSettings, Entry, FeatureSchema, Selector, TagFilter, Trace
from contextdb.motion.markup.left_out import LeftOut
from contextdb.motion.markup.markup import Markup
from contextdb.motion.search import candidates
from contextdb.motion.search.database import MotionDatabase
from contextdb.motion.search.filters import Biases
from contextdb.motion.trace.reasked import require_known, why_not_asked

SCHEMA = FeatureSchema.from_dict(
    "loco",
    {
        "rate": 30.0,
        "channels": [
            {"type": "position", "bone": "LeftFoot"},
            {"type": "velocity", "bone": "Hips"},
            {"type": "trajectory", "what": "position", "at": [0.33, 1.0]},
        ],
    },
)
MARKUP = Markup.parse(
    "asset,tag,from,to,value\nwalk,Fast,0.2,0.6,\nwalk,Contact.Left,0.4,0.7,\nrun,Contact.Left,0.2,0.3,\njog,DoNotChoose,0.1,0.4,\nidle,CostModifier,0,0.5,0.5\n"
)
LANDINGS = Markup.parse("asset,tag,from,to,value\nwalk_tired,Contact.Left,0.2,0.5,\n")
LOCO = MotionDatabase.build([make_clip(name).clip for name in ("walk", "jog", "idle", "run")], SCHEMA, markup=MARKUP)
TIRED = MotionDatabase.build([make_clip(name).clip for name in ("walk_tired", "jog_tired")], SCHEMA, markup=LANDINGS)
DATABASES = {"tired": TIRED, "loco": LOCO}


@pytest.fixture(scope="module")
def trace() -> Trace:
    """A session in which facts, tags, penalties, biases and events change; saved and read again."""
    rng = random.Random(5)
    selector = Selector([Entry("tired", TIRED, 0.4), Entry("loco", LOCO)])
    trace = Trace(8, selector.databases)
    controller = Controller(selector, ControllerSettings(search_every_s=0.1, jump_threshold_s=0.2, history_s=0.5), trace)
    for i in range(60):
        frame = rng.randrange(LOCO.n_frames)
        query = LOCO.raw(frame) + np.array([rng.gauss(0.0, 0.1) for _ in range(LOCO.n_features)])
        valid = {"loco": np.array([rng.random() < 0.8 for _ in LOCO.assets])} if i % 3 else None
        tags = TagFilter(("Fast",)) if i % 7 == 0 else TagFilter(prefer={"Fast": 0.3}) if i % 2 else None
        penalties = {"walk": rng.random()} if i % 4 == 0 else None
        bias = {"loco": np.array([rng.choice([0.0, 0.1, np.inf]) for _ in range(LOCO.n_frames)])} if i % 5 == 0 else None
        event = ("Contact.Left", rng.uniform(0.1, 0.6)) if i % 6 == 4 else None
        controller.update(1 / 30, query, valid, tags, {"i": i}, penalties=penalties, bias=bias, force=i % 2 == 0, event=event)
    loaded = Trace.from_bytes(trace.to_bytes())
    assert all(decision.candidates == () for decision in loaded)
    assert loaded.use(DATABASES) == ""
    for live, kept in zip(trace, loaded, strict=True):
        assert [(name, found.rows, found.counts) for name, found in live.candidates] == [
            (name, found.rows, found.counts) for name, found in kept.candidates
        ]
    return loaded


def test_every_candidate_is_one_of_the_frames_that_the_search_compared(trace):
    n_rows = 0
    for decision in trace:
        assert bool(decision.filters) == decision.searched
        for name, kept in decision.candidates:
            chosen = dict(decision.filters)[name]
            database = DATABASES[name]
            again = candidates.of(database, database.normalised(decision.query), chosen, database.n_frames, True)
            assert again.counts == kept.counts
            by_frame = {row.frame: row for row in again}
            assert all(by_frame[row.frame] == row for row in kept)
            n_rows += len(kept)
    assert n_rows > 300


def test_every_asset_has_its_best_frame_rank_cost_parts_and_reason(trace):
    for asked in trace.reasked(DATABASES):
        decision = asked.decision
        rows = asked.best_of_assets()
        assert sorted((each.database, each.row.range) for each in rows) == sorted(
            (name, i) for name in asked.searched for i in range(len(DATABASES[name].assets))
        )
        assert [each.row.cost for each in rows] == sorted(each.row.cost for each in rows)
        for each in rows:
            parts = sum(each.row.channels.values()) + sum(each.row.biases.values())
            assert each.row.cost == pytest.approx(parts, abs=1e-9) or each.row.left_out is LeftOut.FORBIDDEN
            assert asked.rank(each.row.asset) == each.rank
        free = [each for each in rows if each.row.left_out is LeftOut.NO]
        hits = [] if decision.choice is None else [search.hit.cost for search in decision.choice.searches if search.hit]
        assert min((each.row.cost for each in free), default=None) == min(hits, default=None)


def test_a_name_gives_its_assets_alone_in_any_case(trace):
    asked = next(each for each in trace.reasked(DATABASES) if len(each.searched) == 2)
    assert {each.row.asset for each in asked.best_of_assets("WALK")} == {"walk", "walk_tired"}


def test_what_is_missing_to_ask_again_is_said(trace):
    searched = next(decision for decision in trace if decision.searched)
    about = trace.about
    assert why_not_asked(searched, about, DATABASES) == ""
    assert "nothing was searched" in why_not_asked(next(d for d in trace if not d.searched), about, DATABASES)
    assert "holds no filters" in why_not_asked(replace(searched, filters=()), about, DATABASES)
    assert 'no database "tired"' in why_not_asked(searched, about, {"loco": LOCO})
    heavier = {"tired": TIRED.with_weights({"Hips velocity": 3.0}), "loco": LOCO}
    assert 'the database "tired" is another' in why_not_asked(searched, about, heavier)


def test_candidates_are_worked_out_from_the_recorded_databases_alone(trace):
    loaded = Trace.from_bytes(trace.to_bytes())
    assert loaded.use({"loco": LOCO}) == 'there is no database "tired" in the project.'
    assert not any(decision.candidates for decision in loaded)
    other = replace(TIRED, marks=replace(TIRED.marks, kind_biases=TIRED.marks.kind_biases + 1.0))
    assert loaded.use({"tired": other, "loco": LOCO}) == (
        'the database "tired" is another than the one that the session was recorded with.'
    )
    assert list(loaded.databases) == ["loco"]


def test_a_name_that_no_asset_holds_is_refused_with_the_nearest():
    with pytest.raises(MotionError, match=r'no asset\'s name contains "wlak".*Did you mean "walk"\?'):
        require_known("wlak", DATABASES, "session.parquet")


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"weights": {"LeftFoot positon": 2.0}}, 'no channel "LeftFoot positon".*Did you mean "LeftFoot position"'),
        ({"weights": {"Hips velocity": -1.0}}, "a finite number, 0 or more"),
        ({"weights": [1.0]}, "weights"),
        ({"biases": {"loko": Biases()}}, 'no database "loko".*Did you mean "loco"'),
        ({"biases": {"loco": 1.0}}, "Biases"),
        ({"thresholds": {"tierd": 1.0}}, 'no database "tierd".*Did you mean "tired"'),
        ({"tables": {"moves": None}}, "tables|table"),
    ],
)
def test_a_change_of_what_there_is_not_is_refused(trace, changes, message):
    with pytest.raises(ContextDBError, match=message):
        trace.reasked(DATABASES, **changes)


def test_a_change_that_there_is_not_is_refused_with_the_nearest(trace):
    with pytest.raises(MotionError, match=r'there is no change "weight".*Did you mean "weights"'):
        trace.reasked(weight={"pose": 2.0})


def test_an_asset_that_there_is_not_is_refused_with_the_nearest(trace):
    place = next(i for i, decision in enumerate(trace) if decision.searched)
    with pytest.raises(MotionError, match=r'no asset "jgo".*Did you mean "jog"'):
        trace.reasked(DATABASES).why_not(place, "jgo")
    unsearched = next(i for i, decision in enumerate(trace) if not decision.searched)
    with pytest.raises(MotionError, match="nothing was searched"):
        trace.reasked(DATABASES).why_not(unsearched, "jog")


def test_recording_works_no_candidate_out_until_it_is_asked_for(monkeypatch):
    asked = []
    of = candidates.of
    monkeypatch.setattr(candidates, "of", lambda *given: asked.append(given) or of(*given))
    recorder = Trace(4)
    controller = Controller(Selector([Entry("loco", LOCO)]), recorder=recorder)
    decisions = [controller.update(1 / 30, LOCO.raw(frame), force=True) for frame in (3, 40, 90)]
    assert (len(recorder), len(asked)) == (3, 0)
    assert decisions[1].candidates[0][1].rows[0].cost == decisions[1].choice.hit.cost
    assert len(asked) == 2


def test_a_session_without_candidates_holds_nothing_to_ask_again():
    recorder = Trace(0)
    controller = Controller(Selector([Entry("loco", LOCO)]), recorder=recorder)
    controller.update(1 / 30, LOCO.raw(3))
    assert (recorder[0].candidates, recorder[0].filters, recorder[0].inputs) == ((), (), None)
    with pytest.raises(MotionError, match="it was to keep no candidates"):
        recorder.reasked({"loco": LOCO})[0]


def test_a_caller_that_changes_its_arrays_later_changes_no_recorded_search():
    recorder = Trace(4)
    controller = Controller(Selector([Entry("loco", LOCO)]), recorder=recorder)
    valid, bias = np.ones(len(LOCO.assets), np.bool_), np.zeros(LOCO.n_frames)
    decision = controller.update(1 / 30, LOCO.raw(3), {"loco": valid}, bias={"loco": bias})
    valid[:], bias[:] = False, np.inf
    assert decision.candidates[0][1].rows[0].cost == decision.choice.hit.cost
    assert recorder.reasked()[0].choice == decision.choice
