"""Ranges that are played mirrored are valid by the answer with mirrored facts: in searches, choices, reasons and commands."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import oracles
import pytest
from hypothesis import given
from hypothesis import strategies as st
from lines import DT
from made_once import make_clip
from running import run
from strategies import contexts, examples
from test_mirroring import mirroring_tables, plain_in_mirror

import contextdb as cdb
from contextdb.motion import Entry, FeatureSchema, MotionDatabase, Selector, write_bvh
from contextdb.motion.answers import NamedAssets
from contextdb.motion.markup.left_out import LeftOut
from contextdb.motion.nodes.pose_match import best_start
from contextdb.motion.selection.controller import Controller
from contextdb.motion.selection.controller_settings import ControllerSettings
from contextdb.motion.selection.decision import Action
from contextdb.motion.trace.session import Trace

TURNS = ("walk_turn_left_90", "walk_turn_right_90")
COLUMNS = {"Asset": [*TURNS, "walk"], "direction": ["45..135", "-135..-45", "-45..45"]}


@pytest.fixture(scope="module")
def database():
    """Turns and a walk, each there mirrored too."""
    channels = [{"type": "position", "bone": "LeftFoot"}, {"type": "trajectory", "what": "direction", "at": [0.5, 1.0]}]
    schema = FeatureSchema.from_dict("loco", {"rate": 30.0, "channels": channels, "mirror": [["Left*", "Right*"]]})
    return MotionDatabase.build([make_clip(name).clip for name in (*TURNS, "walk")], schema, mirror=True)


def table(**more):
    return cdb.Table.from_columns({**COLUMNS, **more}, {"direction": {"type": "angle"}}).compile()


def test_searches_starts_and_reasons_all_go_by_the_mirror(database):
    valid = table().query({"direction": 88.0})
    left_mirrored = next(i for i, a in enumerate(database.assets) if a == TURNS[0] and database.mirrored[i])
    right_mirrored = next(i for i, a in enumerate(database.assets) if a == TURNS[1] and database.mirrored[i])
    wrong, good = (int(database.starts[at]) + 10 for at in (left_mirrored, right_mirrored))
    assert database.search(database.raw(good), valid).frame == good
    assert database.search(database.raw(wrong), valid).range != left_mirrored
    assert best_start(database, database.raw(good), valid).frame == good
    many = table().query_many({"direction": [88.0, 88.0]})
    for masks in (valid, [valid, valid], many, list(many)):
        assert database.search_many([database.raw(good)] * 2, masks)[0].frame == good
    reasons = {row.range: row.left_out for row in database.candidates(database.raw(wrong), 10_000, valid, left_out=True).rows}
    assert (reasons[left_mirrored], reasons[right_mirrored]) == (LeftOut.NOT_VALID, LeftOut.NO)


def test_what_plays_mirrored_plays_on_while_the_mirrored_facts_allow_it(database):
    settings = ControllerSettings(search_every_s=60.0, jump_threshold_s=0.0, history_s=0.0, rate=30.0, grace_s=0.0)
    one, compiled = Controller(Selector([Entry("a", database)]), settings), table()
    at = next(i for i, a in enumerate(database.assets) if a == TURNS[1] and database.mirrored[i])
    query = database.raw(int(database.starts[at]))
    live = compiled.live({"direction": 88.0})
    started = one.update(DT, query, live.matches())
    assert (started.playing.asset, started.playing.mirrored) == (TURNS[1], True)
    assert one.update(DT, query, live.matches()).action is Action.CONTINUE
    live["direction"] = -88.0
    jumped = one.update(DT, query, live.matches())
    assert (jumped.playing.asset, jumped.playing.mirrored) in {(TURNS[0], True), (TURNS[1], False)}
    assert "not valid" in jumped.why


def test_where_no_clip_is_mirrored_no_answer_with_mirrored_facts_is_asked_for():
    class Unmirrored(NamedAssets):
        @property
        def mirrored(self):
            raise AssertionError("nobody asks")

    schema = FeatureSchema.from_dict("loco", {"rate": 30.0, "channels": [{"type": "position", "bone": "LeftFoot"}]})
    plain = MotionDatabase.build([make_clip(name).clip for name in TURNS], schema)
    one = Controller(Selector([Entry("a", plain)]))
    assert one.update(DT, plain.raw(0), Unmirrored([TURNS[1]])).playing.asset == TURNS[1]


def test_what_plays_mirrored_stays_valid_by_the_hysteresis_of_mirrored_facts(database):
    direction = {"type": "angle", "hysteresis": 10.0}
    compiled = cdb.Table.from_columns(COLUMNS, {"direction": direction}).compile()
    one = Controller(Selector([Entry("a", database)]), ControllerSettings(60.0, 0.0, 0.0, rate=30.0, grace_s=0.0))
    at = next(i for i, a in enumerate(database.assets) if a == TURNS[1] and database.mirrored[i])
    query = database.raw(int(database.starts[at]))
    decisions = [one.update(DT, query, compiled.query({"direction": degrees})) for degrees in (50.0, 36.0, 34.0)]
    assert [(d.playing.asset, d.playing.mirrored, d.held) for d in decisions[:2]] == [
        (TURNS[1], True, ""),
        (TURNS[1], True, "hysteresis"),
    ]
    assert (decisions[2].action, decisions[2].playing.asset) == (Action.JUMP, "walk")


def test_soft_cells_cost_a_mirrored_range_what_they_cost_with_mirrored_facts(database):
    soft = cdb.Table.from_columns({**COLUMNS, "direction": ["45..135 ~3", "-135..-45 ~5", "Any"]}, {"direction": {"type": "angle"}})
    biases = database.filter(soft.compile().query({"direction": 88.0})).range_biases
    found = {(a, bool(m)): b for a, m, b in zip(database.assets, database.mirrored, biases.tolist(), strict=True)}
    assert found == {
        (TURNS[0], False): 0.0, (TURNS[0], True): 3.0, (TURNS[1], False): 5.0, (TURNS[1], True): 0.0,
        ("walk", False): 0.0, ("walk", True): 0.0,
    }  # fmt: skip


def test_names_of_assets_and_flags_of_ranges_stand_for_what_they_say(database):
    assert database.filter(NamedAssets([TURNS[0]])).ranges.tolist() == [a == TURNS[0] for a in database.assets]
    in_mirror = NamedAssets([TURNS[0]], NamedAssets(["walk"]))
    wanted = [a == ("walk" if m else TURNS[0]) for a, m in zip(database.assets, database.mirrored, strict=True)]
    assert database.filter(in_mirror).ranges.tolist() == wanted
    flags = np.array([True, False] * 3)
    assert database.filter(flags).ranges.tolist() == flags.tolist()


@examples(1)
@given(st.data())
def test_a_range_is_valid_when_some_row_of_its_asset_accepts_the_facts_as_it_plays(data):
    rows = data.draw(mirroring_tables())
    facts, plain = data.draw(contexts(rows, has_sets=True))
    rng = np.random.default_rng(data.draw(st.integers(0, 2**20)))
    names = [*dict.fromkeys(rows.assets), "nobody"]
    assets = [names[i] for i in rng.integers(0, len(names), rng.integers(1, 9))]
    edges = np.cumsum([0, *rng.integers(1, 4, len(assets))])
    starts, stops = (np.array(side) for side in zip(*pairwise(edges.tolist()), strict=True))
    flags = rng.random(len(assets)) < 0.5
    plainly = MotionDatabase.from_features(np.zeros((edges[-1], 1)), starts, stops, assets)
    found = replace(plainly, mirrored=flags).filter(rows.compile().query(facts, unknown="never"))
    seen = plain_in_mirror(rows, plain, facts)
    for at, (asset, is_mirrored) in enumerate(zip(assets, flags, strict=True)):
        context = seen if is_mirrored else plain
        valid = [row for row in oracles.rows(rows, context, "never") if rows.assets[row] == asset]
        assert found.ranges[at] == bool(valid)
        if valid:
            costs = oracles.costs(rows, context, "never")
            assert found.range_biases[at] == pytest.approx(min(costs[row] for row in valid))


PROJECT = """
[conditions.direction]
type = "angle"

[features.loco]
rate = 30.0
mirror = [["Left*", "Right*"]]
channels = [
  { type = "position", bone = "LeftFoot" },
  { type = "trajectory", what = "direction", at = [0.5, 1.0] },
]

[databases.turns]
table = "turns"
clips = "clips/*.bvh"
features = "loco"
mirror = true

[selectors.turns]
order = [{ database = "turns" }]

[controllers.player]
selector = "turns"
grace_s = 0
"""


@pytest.fixture
def project(tmp_path):
    (tmp_path / "contextdb.toml").write_text(PROJECT, encoding="utf-8")
    rows = zip(*COLUMNS.values(), strict=True)
    (tmp_path / "turns.csv").write_text("Asset,direction\n" + "".join(f"{a},{d}\n" for a, d in rows), encoding="utf-8")
    (tmp_path / "clips").mkdir()
    for name in COLUMNS["Asset"]:
        write_bvh(make_clip(name).clip, tmp_path / "clips" / f"{name}.bvh")
    return tmp_path


def test_the_commands_search_and_run_go_by_the_mirror(project, tmp_path_factory):
    asked = ["--query", f"{TURNS[0]}@0.5", "--k", "500", "--left-out", "--json"]
    found = run("motion", "search", project, "turns", "direction=88", *asked)
    assert found.code == 0, found.err
    rows = found.json["rows"]
    valid = {(row["asset"], row["mirrored"]) for row in rows if row["left_out"] == LeftOut.NO.text}
    assert valid == {(TURNS[0], False), (TURNS[1], True)}
    assert run("motion", "search", project, "turns", "direction=88", *asked[:2]).lines[0].endswith(", 1 mirrored")
    stick = tmp_path_factory.mktemp("stick") / "moves.csv"
    lines = "".join(f"{i / 10},1.2,{88 if i < 20 else -88}\n" for i in range(40))
    stick.write_text(f"time_s,speed_mps,direction\n{lines}", encoding="utf-8")
    done = run("motion", "run", project, "player", stick, "--out", stick.with_name("s.parquet"))
    assert done.code == 0, done.err
    for decision in Trace.load(stick.with_name("s.parquet")):
        is_left = (decision.playing.asset == TURNS[0]) is not decision.playing.mirrored
        assert is_left == (decision.time_s < 2.0 - 1e-6)
