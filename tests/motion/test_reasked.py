"""A recorded decision asked again: what was recorded comes out bit for bit, and every other asset has its cost and reason too."""

from __future__ import annotations

import random
from dataclasses import replace

import numpy as np
import polars as pl
import pytest

from contextdb.errors import MotionError
from contextdb.motion import Controller, ControllerSettings, Entry, FeatureSchema, LeftOut, Selector, TagFilter, Trace, make_clip
from contextdb.motion.markup.markup import Markup
from contextdb.motion.search import candidates
from contextdb.motion.search.database import MotionDatabase
from contextdb.motion.trace.reasked import reasked, require_known, why_not_asked

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
MARKUP = Markup.parse("asset,tag,from,to,value\nwalk,Fast,0.2,0.6,\njog,DoNotChoose,0.1,0.4,\nidle,CostModifier,0,0.5,0.5\n")
LOCO = MotionDatabase.build([make_clip(name).clip for name in ("walk", "jog", "idle", "run")], SCHEMA, markup=MARKUP)
TIRED = MotionDatabase.build([make_clip(name).clip for name in ("walk_tired", "jog_tired")], SCHEMA)
DATABASES = {"tired": TIRED, "loco": LOCO}


@pytest.fixture(scope="module")
def trace() -> Trace:
    """A session in which facts, tags, penalties and biases change; saved and read again."""
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
        controller.update(1 / 30, query, valid, tags, {"i": i}, penalties=penalties, bias=bias, force=i % 2 == 0)
    return Trace.from_bytes(trace.to_bytes())


def test_every_recorded_cost_comes_out_again_bit_for_bit(trace):
    n_rows = 0
    for decision in trace:
        assert bool(decision.filters) == decision.searched
        for (name, kept), (other, chosen) in zip(decision.candidates, decision.filters, strict=True):
            assert name == other
            database = DATABASES[name]
            again = candidates.of(database, database.normalised(decision.query), chosen, database.n_frames, True)
            assert again.counts == kept.counts
            by_frame = {row.frame: row for row in again}
            assert all(by_frame[row.frame] == row for row in kept)
            n_rows += len(kept)
    assert n_rows > 300


def test_every_asset_has_its_best_frame_rank_cost_parts_and_reason(trace):
    for decision in trace:
        if not decision.searched:
            continue
        rows = reasked(decision, DATABASES, "")
        searched = [name for name, _ in decision.filters]
        assert sorted((each.database, each.row.range) for each in rows) == sorted(
            (name, i) for name in searched for i in range(len(DATABASES[name].assets))
        )
        assert [each.row.cost for each in rows] == sorted(each.row.cost for each in rows)
        for each in rows:
            parts = sum(each.row.channels.values()) + sum(each.row.biases.values())
            assert each.row.cost == pytest.approx(parts, abs=1e-9) or each.row.left_out is LeftOut.FORBIDDEN
        free = [each for each in rows if each.row.left_out is LeftOut.NO]
        hits = [search.hit.cost for search in decision.choice.searches if search.hit]
        assert [each.rank for each in free[:1]] == ([1] if free else [])
        assert min((each.row.cost for each in free), default=None) == min(hits, default=None)


def test_a_name_gives_its_assets_alone_in_any_case(trace):
    decision = next(decision for decision in trace if len(decision.filters) == 2)
    assert {each.row.asset for each in reasked(decision, DATABASES, "WALK")} == {"walk", "walk_tired"}


def test_what_is_missing_to_ask_again_is_said(trace):
    searched = next(decision for decision in trace if decision.searched)
    about = trace.about
    assert why_not_asked(searched, about, DATABASES) == ""
    assert "nothing was searched" in why_not_asked(next(d for d in trace if not d.searched), about, DATABASES)
    assert "holds no filters" in why_not_asked(replace(searched, filters=()), about, DATABASES)
    assert 'no database "tired"' in why_not_asked(searched, about, {"loco": LOCO})
    heavier = {"tired": TIRED.with_weights({"Hips velocity": 3.0}), "loco": LOCO}
    assert 'the database "tired" is another' in why_not_asked(searched, about, heavier)


def test_a_name_that_no_asset_holds_is_refused_with_the_nearest():
    with pytest.raises(MotionError, match=r'no asset\'s name contains "wlak".*Did you mean "walk"\?'):
        require_known("wlak", DATABASES, "session.parquet")


def test_a_session_of_an_older_version_is_read_without_filters(trace, tmp_path):
    path = tmp_path / "old.parquet"
    raw = tmp_path / "new.parquet"
    raw.write_bytes(trace.to_bytes())
    metadata = pl.read_parquet_metadata(raw)
    pl.read_parquet(raw).drop("filters").write_parquet(path, metadata={k: metadata[k] for k in ("contextdb.trace", "about")})
    old = Trace.load(path)
    assert len(old) == len(trace)
    assert all(decision.filters == () for decision in old)
