"""The contexts of a table that let other clips play, compared with asking the table every context there is."""

from collections import Counter
from collections.abc import Iterator, Mapping
from dataclasses import replace
from itertools import product
from pathlib import Path
from typing import Any

import nested_files
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

import contextdb as cdb
from contextdb.authoring import clip_contexts as module
from contextdb.authoring.clip_contexts import TableContexts, clip_contexts, queried_axes

CONDITIONS: dict[str, Any] = {
    "turn": {"type": "int", "min": -2, "max": 2, "mirror": "negate"},
    "side": {"type": "enum", "values": ["Left", "Right", "None"], "mirror": {"Left": "Right"}},
    "armed": {"type": "bool"},
    "hands": {"type": "tags", "values": ["Left", "Right"], "mirror": {"Left": "Right"}},
}
FACTS: dict[str, list[Any]] = {
    "turn": [-2, -1, 0, 1, 2],
    "side": ["Left", "Right", "None"],
    "armed": [True, False],
    "hands": [set(), {"Left"}, {"Right"}, {"Left", "Right"}],
}
CELLS = {
    "turn": ["Any", "-1..0", ">0", "2", "not 1", "1 ~0.5"],
    "side": ["Any", "Left", "Right None", "not Left"],
    "armed": ["Any", "True", "False"],
    "hands": ["Any", "+Left", "-Right", "+Left -Right", "not +Left -Right"],
}
ROWS = st.lists(st.tuples(*(st.sampled_from(cells) for cells in CELLS.values())), min_size=1, max_size=6)
Key = tuple[frozenset[str], frozenset[str]]


def table_of(rows: list[tuple[str, ...]]) -> cdb.Table:
    columns = {"Asset": [f"clip{i}" for i in range(len(rows))]}
    columns |= {name: [row[i] for row in rows] for i, name in enumerate(CELLS)}
    return cdb.Table.from_columns(columns, schema=CONDITIONS)


def every_context() -> Iterator[dict[str, Any]]:
    for facts in product(*FACTS.values()):
        yield dict(zip(FACTS, facts, strict=True))


def asked(table: cdb.Table, mirrored: set[str]) -> dict[Key, float]:
    """The share of the contexts of each answer, by asking all of them."""
    compiled, found = table.compile(), Counter[Key]()
    for context in every_context():
        matches = compiled.query(context)
        found[frozenset(matches.assets), frozenset(matches.mirrored.assets) & mirrored] += 1
    return {key: n / found.total() for key, n in found.items()}


def told(found: TableContexts) -> dict[Key, float]:
    return {(each.assets, each.mirrored): each.share for each in found.contexts}


@given(ROWS, st.sets(st.sampled_from(["clip0", "clip1", "clip2", "clip3"])))
@example([("-1..0", "Left", "Any", "+Left -Right"), (">0", "Any", "True", "not +Left -Right")], {"clip0", "clip1"})
def test_the_contexts_are_those_that_asking_every_context_gives(rows: list[tuple[str, ...]], mirrored: set[str]):
    table = table_of(rows)
    mirrored &= set(table.assets)
    found = clip_contexts(table, mirrored=mirrored)
    expected = asked(table, mirrored)
    without = expected.pop((frozenset(), frozenset()), 0.0)
    assert found.method == "exact"
    assert told(found) == pytest.approx(expected)
    assert found.without == pytest.approx(without)
    valid = {asset for plain, _ in expected for asset in plain}
    assert found.never_valid == tuple(asset for asset in table.assets if asset not in valid)


@given(ROWS)
def test_each_context_lies_in_the_box_of_its_cells(rows: list[tuple[str, ...]]):
    table = table_of(rows)
    compiled = table.compile()
    found = {(each.assets, each.mirrored): each.cells for each in clip_contexts(table, mirrored=table.assets).contexts}
    boxes = {key: _box(cells) for key, cells in found.items()}
    for context in every_context():
        matches = compiled.query(context)
        key = frozenset(matches.assets), frozenset(matches.mirrored.assets)
        if any(key):
            assert boxes[key].query(context)


def _box(cells: Mapping[str, str]) -> cdb.CompiledTable:
    columns = {"Asset": ["box"], **{name: [cells.get(name, "Any")] for name in CELLS}}
    return cdb.Table.from_columns(columns, schema=CONDITIONS).compile()


FOOT = {"type": "bool", "mirror": {"Left": "Right"}}
DOWN = st.sampled_from(["Any", "True", "False"])


@given(st.lists(st.tuples(DOWN, DOWN), min_size=1, max_size=4))
def test_conditions_that_change_places_change_them_in_the_boxes_of_mirrored_clips(rows: list[tuple[str, str]]):
    names = "LeftFoot.Down", "RightFoot.Down"
    columns = {"Asset": [f"clip{i}" for i in range(len(rows))]} | dict(zip(names, map(list, zip(*rows, strict=True)), strict=True))
    table = cdb.Table.from_columns(columns, schema=dict.fromkeys(names, FOOT))
    compiled, expected = table.compile(), Counter[Key]()
    for left, right in product([True, False], repeat=2):
        matches = compiled.query({"LeftFoot.Down": left, "RightFoot.Down": right})
        if matches or matches.mirrored:
            expected[frozenset(matches.assets), frozenset(matches.mirrored.assets)] += 1
    found = clip_contexts(table, mirrored=table.assets)
    assert told(found) == pytest.approx({key: n / 4.0 for key, n in expected.items()})
    for each in found.contexts:
        changed = {b: each.cells.get(a, "Any") for a, b in (names, names[::-1])}
        assert each.is_symmetric == (changed == {name: each.cells.get(name, "Any") for name in names})


def test_clips_that_the_table_has_no_clip_of_make_no_difference():
    table = table_of([("Any", "Any", "Any", "Any"), (">0", "Any", "Any", "Any")])
    assert told(clip_contexts(table, ["clip0"])) == {(frozenset(["clip0"]), frozenset()): 1.0}


def test_contexts_that_cannot_happen_are_left_out():
    columns = {"Asset": ["a", "b", "c"], "x": ["0..1", "5", "Any"], "y": ["Any", "Any", "True"]}
    schema = {"x": {"type": "int", "min": 0, "max": 9}, "y": {"type": "bool"}}
    table = cdb.Table.from_columns(columns, schema=schema)
    found = clip_contexts(replace(table, settings=replace(table.settings, assume=("x < 5",))))
    assert found.never_valid == ("b",)
    shares = {tuple(sorted(each.assets)): each.share for each in found.contexts}
    assert shares == pytest.approx({("a",): 0.2, ("a", "c"): 0.2, ("c",): 0.3})
    assert found.without == pytest.approx(0.3)


def test_a_row_of_a_single_point_is_not_called_never_valid():
    schema = {"speed": {"type": "number", "min": 0.0, "max": 5.0}}
    table = cdb.Table.from_columns({"Asset": ["point", "rest"], "speed": ["2", "Any"]}, schema=schema)
    found = clip_contexts(table)
    assert told(found) == {(frozenset(["rest"]), frozenset()): 1.0}
    assert found.never_valid == ()


def test_speeds_and_turns_that_are_asked_for_are_known_by_name_and_unit():
    schema = {
        "Speed": {"type": "number", "min": 0.0, "max": 7.0, "unit": "m/s"},
        "turn": {"type": "number", "unit": "km/h"},
        "direction": {"type": "angle"},
    }
    table = cdb.Table.from_columns({"Asset": ["a"], "Speed": ["1..2"], "turn": ["Any"], "direction": ["0 ± 30"]}, schema=schema)
    assert queried_axes(table) == {"speed": "Speed"}
    (found,) = clip_contexts(table, axes={"speed": "Speed", "direction": "direction"}).contexts
    assert found.asked == {"speed": [(1.0, 2.0)], "direction": [(-30.0, 30.0)]}
    assert found.cells == {"Speed": "1..2", "direction": "-30..30"}


def test_a_number_without_bounds_asks_for_nothing():
    table = cdb.Table.from_columns({"Asset": ["a"], "speed": ["<=1.5"]}, schema={"speed": {"type": "number", "min": 0.0}})
    assert queried_axes(table) == {}


def test_rows_of_inner_tables_count_by_their_own_assets(tmp_path: Path):
    table = cdb.load(nested_files.write(tmp_path) / "tackle.csv")
    found = clip_contexts(table, ["Hit", "Left", "Right"])
    shares = {tuple(sorted(each.assets)): each.share for each in found.contexts}
    assert shares == pytest.approx({("Hit",): 0.5, ("Left",): 0.05, ("Left", "Right"): 0.2, ("Right",): 0.1})
    assert found.without == pytest.approx(0.15)


def test_rules_of_rows_count_and_change_sides_in_a_mirror(tmp_path: Path):
    (tmp_path / "contextdb.toml").write_text(
        '[tables.moves]\nwhen = "When"\n[conditions.turn]\ntype = "number"\nmin = -2.0\nmax = 2.0\nmirror = "negate"\n',
        encoding="utf-8",
    )
    (tmp_path / "moves.csv").write_text("Asset,turn,When\na,Any,turn > 1\nb,..0,\n", encoding="utf-8")
    found = clip_contexts(cdb.load(tmp_path / "moves.csv"), mirrored=["a"])
    assert found.method == "exact"
    names = {("".join(sorted(plain)), "".join(sorted(mirrored))): share for (plain, mirrored), share in told(found).items()}
    assert names == pytest.approx({("a", ""): 0.25, ("b", "a"): 0.25, ("b", ""): 0.25})


def test_contexts_of_one_side_are_not_the_same_in_a_mirror():
    columns = {"Asset": ["left", "right", "ahead"], "to": ["10..180", "-180..-10", "-10..10"]}
    table = cdb.Table.from_columns(columns, schema={"to": {"type": "angle"}})
    found = {next(iter(each.assets)): each.is_symmetric for each in clip_contexts(table).contexts}
    assert found == {"left": False, "right": False, "ahead": True}


def test_contexts_are_drawn_where_the_answers_are_too_many(monkeypatch: pytest.MonkeyPatch):
    table = table_of([("-1..0", "Left", "Any", "Any"), (">0", "Any", "True", "Any"), ("Any", "Right None", "Any", "+Left")])
    mirrored = set(table.assets)
    exact = clip_contexts(table, mirrored=mirrored)
    monkeypatch.setattr(module, "MOST_ANSWERS", 2)
    drawn = clip_contexts(table, mirrored=mirrored)
    assert (drawn.method, drawn.n_samples) == ("drawn", module.SAMPLES)
    assert "more than 2 different answers" in drawn.why
    assert told(drawn) == pytest.approx(told(exact), abs=0.02)
    assert drawn.without == pytest.approx(exact.without, abs=0.02)
    assert [each.share for each in drawn.contexts] == [each.share for each in clip_contexts(table, mirrored=mirrored).contexts]


def test_contexts_are_drawn_where_facts_are_computed_and_mirrored_clips_are_not_held_to_them():
    schema = {
        "turn": {"type": "number", "min": -1.0, "max": 1.0, "mirror": "negate"},
        "lean": {"type": "number", "min": -2.0, "max": 2.0, "expr": "2 * turn"},
        "go": {"type": "bool"},
    }
    columns = {"Asset": ["a", "b"], "lean": ["-2..0", "1..2"], "go": ["True", "Any"]}
    table = cdb.Table.from_columns(columns, schema=schema)
    found = clip_contexts(table, mirrored=["a"])
    assert found.n_samples == module.SAMPLES
    assert "lean" in found.why
    assert found.not_mirrored == ("lean",)
    shares = Counter[frozenset[str]]()
    for each in found.contexts:
        shares[each.assets] += each.share
    assert shares[frozenset(["b"])] == pytest.approx(0.25, abs=0.02)
    assert shares[frozenset(["a"])] == pytest.approx(0.25, abs=0.02)


def test_a_table_is_wanted():
    with pytest.raises(cdb.ContextError, match="a Table"):
        clip_contexts(5)  # type: ignore[arg-type]
