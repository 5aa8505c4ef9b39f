"""Why an asset was not chosen: each reason is named, and what is proposed is what a search with it gives."""

from dataclasses import replace

import numpy as np
import pytest
from lines import DT, RATE, line

import contextdb as cdb
from contextdb.motion import Controller, ControllerSettings, Entry, Selector, TagFilter, Trace
from contextdb.motion.trace.stock import Stock
from contextdb.motion.trace.why_not import why_not
from contextdb.tables.project import Project

WALKS = range(20)


def told(asset, *, markup="", entries=None, times=1, settings=None, **given):
    """Why an asset was not chosen at the last of some updates that ask for place 5; and the selector."""
    database = line(markup, walk=WALKS, jog=[5.25] * 20, idle=[9.0] * 20)
    selector = Selector(entries or [Entry("moves", database)], tags=("Calm",))
    trace = Trace(3, selector.databases)
    own = settings or ControllerSettings(search_every_s=0.0, jump_threshold_s=0.0, history_s=0.0, rate=RATE)
    controller = Controller(selector, own, recorder=trace)
    for _ in range(times):
        controller.update(DT, [5.0], **given)
    return trace.reasked().why_not(times - 1, asset)


def kinds(found):
    return [(change.kind, change.what, change.wins) for change in found.changes]


def test_an_asset_that_costs_more_needs_a_bias():
    found = told("jog")
    assert (found.winner, found.winner_cost, found.cost, found.rank) == ("walk", 0.0, 0.0625, 2)
    assert found.reasons == ("cost: 0.06250, 0.06250 more than walk",)
    assert found.changes[0].kind == "bias"
    assert found.changes[0].to == pytest.approx(-0.0625, rel=1e-2)
    assert found.changes[0].wins


def test_a_mark_that_keeps_an_asset_out_is_named_and_without_it_the_asset_wins():
    found = told("walk", markup="walk,DoNotChoose,,,")
    assert found.winner == "jog"
    assert found.reasons == ("markup: DoNotChoose",)
    assert kinds(found) == [("mark", "DoNotChoose on walk", True)]
    assert told("walk").winner == "walk"  # as it is without the mark


def test_a_mark_and_a_cost_need_both():
    found = told("idle", markup="idle,DoNotChoose,,,")
    assert found.reasons[0] == "markup: DoNotChoose"
    assert found.reasons[1].startswith("cost: ")
    assert kinds(found)[:2] == [("mark", "DoNotChoose on idle", False), ("mark + bias", "DoNotChoose on idle + idle", True)]


def test_tags_that_were_asked_for_are_named():
    found = told("walk", markup="jog,Calm,,,", tags=TagFilter("Calm"))
    assert found.reasons == ("tags: its frames do not have the tags that were requested",)
    assert kinds(found) == [("tags", "tags on walk", True)]


def test_flags_of_frames_are_tags_too():
    flags = [False] * 20 + [True] * 40
    found = told("walk", tags={"moves": flags})
    assert kinds(found) == [("tags", "tags on walk", True)]


@pytest.mark.parametrize(("setting", "reason"), [("history_s", "played just now"), ("asset_history_s", "asset played lately")])
def test_what_was_played_lately_is_named_with_its_setting(setting, reason):
    settings = ControllerSettings(**{"search_every_s": 0.0, "jump_threshold_s": 0.0, "history_s": 0.0, "rate": RATE, setting: 5.0})
    database = line(walk=[5.0, 5.0], jog=[5.25] * 20)
    selector = Selector([Entry("moves", database)])
    trace = Trace(3, selector.databases)
    controller = Controller(selector, settings, recorder=trace)
    for interrupt in (False, True):
        controller.update(DT, [5.0], interrupt=interrupt)
    found = trace.reasked().why_not(1, "walk")
    assert (found.winner, found.rank) == ("jog", 1)
    assert found.reasons == (f"history: {reason}",)
    assert kinds(found) == [("setting", setting, True)]


def test_a_priority_database_that_won_outright_is_named_with_its_threshold():
    first, second = line(tired=[6.0] * 3), line(walk=WALKS)
    found = told("walk", entries=[Entry("first", first, 2.0), Entry("second", second)])
    assert (found.winner, found.database) == ("tired", "second")
    assert found.reasons == ("threshold: first won outright, second was not searched",)
    assert kinds(found) == [("threshold", "first", True)]
    assert found.changes[0].to <= 1.0
    other = told("tired", entries=[Entry("first", first, 0.5), Entry("second", second)])
    assert other.winner == "walk"
    assert ("threshold", "first", True) in kinds(other)


def test_an_asset_that_no_table_lets_in_needs_its_range_let_in():
    found = told("walk", valid=[False, True, True])
    assert found.reasons == ("valid: the asset was not among the valid ones",)
    assert kinds(found) == [("mask", "walk", True)]


def test_the_failing_cell_is_named_and_the_cell_with_which_it_wins():
    table = cdb.Table.from_columns(
        {"Asset": ["walk", "jog", "idle"], "speed": ["0..1", "Any", "Any"]}, {"speed": {"type": "number"}}
    )
    database = line(walk=WALKS, jog=[5.25] * 20, idle=[9.0] * 20)
    trace = Trace(3)
    controller = Controller(Selector([Entry("moves", database)]), recorder=trace)
    context = {"speed": 2.0}
    controller.update(DT, [5.0], table.compile().query(context), context=context)
    asked = trace.reasked()[0]
    asked = type(asked)(asked.decision, asked.entries, asked.searches, Stock(trace.databases, {"t": table}, {"moves": "t"}))
    found = why_not(asked, "walk")
    assert found.reasons == ("table: row 1 of t: speed is 2, the cell says 0..1",)
    (change,) = found.changes
    assert (change.kind, change.what, change.wins) == ("cell", "row 1 of t: speed", True)
    edited = table.with_cell(0, "speed", str(change.to)).compile()
    assert database.search([5.0], edited.query(context)).asset == "walk"


def test_a_mirrored_range_needs_the_cell_for_mirrored_facts():
    database = line(left=WALKS, jog=[5.25] * 20)
    database = replace(database, mirrored=np.array([True, False]))
    table = cdb.Table.from_columns({"Asset": ["left", "jog"], "turn": ["60..90", "Any"]}, {"turn": {"type": "angle"}})
    trace = Trace(3)
    controller = Controller(Selector([Entry("moves", database)]), recorder=trace)
    context = {"turn": 70.0}
    controller.update(DT, [5.0], table.compile().query(context), context=context)
    asked = trace.reasked()[0]
    asked = type(asked)(asked.decision, asked.entries, asked.searches, Stock(trace.databases, {"t": table}, {"moves": "t"}))
    found = why_not(asked, "left")
    assert found.reasons == ("table: row 1 of t, with mirrored facts: turn is -70, the cell says 60..90",)
    (change,) = found.changes
    assert (change.kind, change.what, change.wins) == ("cell", "row 1 of t: turn", True)


def test_the_table_of_a_database_that_names_none_is_the_only_one_that_has_its_assets(tmp_path):
    for name, text in {
        "contextdb.toml": '[conditions.speed]\ntype = "number"\n',
        "moves.csv": "Asset,speed\nwalk,0..2\nrun,2..9\n",
        "ends.csv": "Asset,speed\nstop,0..2\nrun,9\n",
    }.items():
        (tmp_path / name).write_text(text)
    databases = {"moves": line(walk=WALKS, jog=WALKS), "none": line(jog=WALKS), "two": line(run=WALKS)}
    assert Stock.with_tables(databases, Project.load(tmp_path)).table_of == {"moves": "moves"}
