"""Selectors for the test context: which assets are valid, what wins, and other orders of databases."""

import shutil
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from contextdb.tables.project import load
from tui.model.priorities import (
    EXAMPLE,
    DatabaseNow,
    Priorities,
    moved,
    rule_of,
    with_database,
    with_threshold,
    without_database,
)
from tui.model.sheet import Sheet

TABLES = Path(__file__).parents[2] / "tables"


@pytest.fixture
def game(tmp_path: Path) -> Path:
    """The sample tables, without a clip."""
    shutil.copytree(TABLES, tmp_path / "game")
    return tmp_path / "game"


def sheet_of(path: Path, **facts: str) -> Sheet:
    sheet = Sheet(load(path))
    for name, text in facts.items():
        sheet.set_fact(name, text)
    return sheet


def now(name: str, threshold: float | None, n_valid: int) -> DatabaseNow:
    assets = tuple(f"{name}{i}" for i in range(4))
    return DatabaseNow(name, threshold, assets, assets[:n_valid])


def test_assets_are_counted_from_rows_where_there_are_no_clips(game: Path):
    [selector] = Priorities(sheet_of(game / "locomotion.csv", gait="Walk", style="tired")).selectors()
    tired, fresh = selector.databases
    table = load(game / "locomotion.csv").compile()
    valid = table.query({"gait": "Walk", "style": "tired"}, unknown="any").assets
    assert tired.valid == tuple(asset for asset in valid if asset.endswith("_tired"))
    assert fresh.valid == tuple(valid)
    assert len(tired.assets) == sum(asset.endswith("_tired") for asset in load(game / "locomotion.csv").assets)
    assert "no clips yet" in tired.note
    assert selector.rule == "loco_tired wins outright when its best cost is under 0.1, otherwise the cheaper of both plays."


def test_assets_are_those_with_clips_that_stand_in_the_table(game: Path):
    for name in ("walk", "walk_tired", "no_row_tired"):
        (game / "clips" / f"{name}.bvh").write_bytes(b"")
    priorities = Priorities(sheet_of(game / "locomotion.csv", gait="Walk", style="normal"))
    [selector] = priorities.selectors()
    assert [one.assets for one in selector.databases] == [("walk_tired",), ("walk", "walk_tired")]
    assert [one.valid for one in selector.databases] == [(), ("walk",)]
    assert selector.rule == "loco_tired has no valid asset for this context: loco decides."
    (game / "clips" / "walk_slow.bvh").write_bytes(b"")
    assert priorities.selectors() == [selector]
    priorities.reload()
    assert priorities.selectors()[0].databases[1].valid == ("walk", "walk_slow")


def test_a_pattern_in_capitals_means_the_same_before_there_are_clips_as_after(game: Path):
    toml = game / "contextdb.toml"
    toml.write_text(toml.read_text(encoding="utf-8").replace('_tired.bvh"', '_tired.BVH"'), encoding="utf-8")
    priorities = Priorities(sheet_of(game / "locomotion.csv"))
    assets = [asset for asset in load(game / "locomotion.csv").assets if asset.endswith("_tired")]
    assert priorities.selectors()[0].databases[0].assets == tuple(assets)
    for i, asset in enumerate(assets):
        (game / "clips" / f"{asset}.{'bvh' if i % 2 else 'Bvh'}").write_bytes(b"")
    priorities.reload()
    assert set(priorities.selectors()[0].databases[0].assets) == set(assets)


def test_a_fact_that_is_typed_and_a_row_that_is_edited_count_at_once(game: Path):
    sheet = sheet_of(game / "locomotion.csv", gait="Walk")
    priorities = Priorities(sheet)
    before = priorities.selectors()[0].databases[1].valid
    sheet.set_fact("speed", "0.1")
    fewer = priorities.selectors()[0].databases[1].valid
    assert set(fewer) < set(before)
    sheet.go(sheet.table.assets.index(fewer[0]), 1)
    sheet.type_text("Run")
    assert fewer[0] not in priorities.selectors()[0].databases[1].valid


def test_another_table_is_asked_with_the_facts_that_it_knows(game: Path):
    sheet = sheet_of(game / "hit_mid_air.csv", IsInCatchAnim="True")
    sheet.query.texts["gait"] = "Walk"  # a fact of the other table
    [selector] = Priorities(sheet).selectors()
    expected = load(game / "locomotion.csv").compile().query({"gait": "Walk"}, unknown="any").assets
    assert selector.databases[1].valid == tuple(expected)


@pytest.mark.parametrize(
    ("spoil", "note"), [(lambda p: p.unlink(), "cannot be read"), (lambda p: p.write_bytes(b"\xff"), "cannot be read")]
)
def test_a_table_that_cannot_be_read_is_told(game: Path, spoil, note: str):
    spoil(game / "locomotion.csv")
    [selector] = Priorities(sheet_of(game / "hit_mid_air.csv")).selectors()
    assert note in selector.databases[0].note
    assert selector.rule == "No database has a valid asset for this context: nothing may play."


def test_a_pattern_that_no_file_can_fit_finds_no_clips(game: Path):
    toml = game / "contextdb.toml"
    toml.write_text(toml.read_text(encoding="utf-8").replace('"clips/*.bvh"', '"clips/**x.bvh"'), encoding="utf-8")
    [selector] = Priorities(sheet_of(game / "locomotion.csv")).selectors()
    assert "no clips yet" in selector.databases[1].note


def test_faults_of_the_file_are_told_and_no_selector_is_shown(game: Path):
    toml = game / "contextdb.toml"
    toml.write_text(toml.read_text(encoding="utf-8").replace("threshold = 0.1", 'threshold = "low"'), encoding="utf-8")
    priorities = Priorities(sheet_of(game / "locomotion.csv"))
    assert priorities.selectors() == []
    assert "not a number" in priorities.faults()[0].message


def test_a_project_without_databases_has_no_selectors(tmp_path: Path):
    (tmp_path / "t.csv").write_text("Asset,x\na,True\n", encoding="utf-8")
    priorities = Priorities(sheet_of(tmp_path / "t.csv"))
    assert priorities.selectors() == []
    assert priorities.faults() == ()


def test_the_example_reads_with_its_features(tmp_path: Path):
    features = '[features.loco]\nrate = 30\nchannels = [{ type = "position", bone = "Foot", weight = 1 }]\n'
    (tmp_path / "contextdb.toml").write_text(EXAMPLE + "\n" + features, encoding="utf-8")
    (tmp_path / "locomotion.csv").write_text("Asset,x\na,True\n", encoding="utf-8")
    [selector] = Priorities(sheet_of(tmp_path / "locomotion.csv")).selectors()
    assert selector.order == (("jog_tired", 0.1), ("jog", None))


# ---- the rule


def test_the_rule_names_what_decides():
    assert rule_of([now("a", 1, 0), now("b", None, 0)]) == "No database has a valid asset for this context: nothing may play."
    assert rule_of([now("a", None, 2)]) == "a decides: it is the only database."
    assert rule_of([now("a", 1, 2), now("b", None, 0)]) == "b has no valid asset for this context: a decides."
    assert (
        rule_of([now("a", 1, 0), now("b", 2, 0), now("c", None, 1)]) == "a and b have no valid asset for this context: c decides."
    )
    chain = rule_of([now("a", 1, 1), now("b", 2.5, 1), now("c", None, 1)])
    assert chain == (
        "a wins outright when its best cost is under 1. If not, b is searched too: when its best cost is under 2.5, the cheaper of "
        "both plays. If not, c is searched too, and the cheapest of all 3 plays."
    )


# ---- other orders

ORDERS = st.lists(st.sampled_from("abcdef"), min_size=1, unique=True).flatmap(
    lambda names: st.tuples(
        *(st.tuples(st.just(name), st.floats(0, 9)) for name in names[:-1]), st.tuples(st.just(names[-1]), st.none())
    )
)


def is_order(order) -> bool:
    """Whether a selector could have the order: each once, thresholds for all but the last."""
    names = [name for name, _ in order]
    return len(set(names)) == len(names) and [t is None for _, t in order] == [False] * (len(order) - 1) + [True]


@given(ORDERS, st.integers(0, 5), st.sampled_from([-1, 1]))
def test_a_move_gives_an_order_and_the_move_back_the_one_before(order, at: int, down: int):
    now = moved(order, at, down)
    assert is_order(now)
    if now != order:
        assert [n for n, _ in now][at + down] == order[at][0]
        assert moved(now, at + down, -down) == order


@given(ORDERS, st.data())
def test_databases_come_and_go(order, data):
    at = data.draw(st.integers(0, len(order) - 1))
    more = with_database(order, at, "new")
    assert is_order(more)
    assert without_database(more, at) == order
    if len(order) > 1:
        less = without_database(order, at)
        assert is_order(less)
        assert [n for n, _ in less] == [n for n, _ in order if n != order[at][0]]
        if at < len(order) - 1:
            assert with_threshold(order, at, 5.5)[at] == (order[at][0], 5.5)
