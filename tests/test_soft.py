"""Soft cells whose cost grows with the distance: what they cost in known cases, in every way of asking, and out of a file."""

import pickle
from pathlib import Path

import numpy as np
import pytest

import contextdb as cdb

CELLS = ["20..30 ~2.5/10", "20..30 ~2.5", "Any ~3/2", "5 | 100.. ~1/0.5", "not 10..20 ~2/5", "(20..30) ~1/10", "3"]
KNOWN = {
    25.0: [0.0, 0.0, 0.0, 40.0, 0.0, 0.0, 0.0],
    35.0: [1.25, 2.5, 0.0, 60.0, 0.0, 0.5, 0.0],
    0.0: [5.0, 2.5, 0.0, 10.0, 0.0, 2.0, 0.0],
    15.0: [1.25, 2.5, 0.0, 20.0, 2.0, 0.5, 0.0],
    90.0: [15.0, 2.5, 0.0, 20.0, 0.0, 6.0, 0.0],
}


def compiled(cells: list[str] = CELLS, kind: str = "number") -> cdb.CompiledTable:
    columns = {"asset": [f"a{i}" for i in range(len(cells))], "x": cells}
    return cdb.Table.from_columns(columns, {"x": {"type": kind}}, {"policy": "cheapest"}).compile()


@pytest.mark.parametrize("x", KNOWN)
def test_the_cost_is_the_penalty_for_each_distance(x: float, tmp_path: Path):
    table = compiled()
    table.save(tmp_path / "table.safetensors")
    opened, live = cdb.CompiledTable.open(tmp_path / "table.safetensors"), table.live({"x": x})
    ways = [table.query({"x": x}), opened.query({"x": x}), live.matches(), table.query({"x": cdb.cell(str(x))})]
    for answer in ways:
        assert answer.penalties.tolist() == pytest.approx(KNOWN[x])
    many = table.query_many({"x": [x, 25.0]})
    np.testing.assert_allclose(many.penalties, [KNOWN[x], KNOWN[25.0]])


def test_a_fact_as_far_as_numbers_go_costs_without_end_in_every_way_of_asking():
    table, far = compiled(["0 ~2.5/0.5", "0 ~2.5"]), float(np.finfo(np.float64).max)
    for x in (far, -far):
        assert table.query({"x": x}).penalties.tolist() == [np.inf, 2.5]
        assert pickle.loads(pickle.dumps(table.query({"x": x}))).penalties.tolist() == [np.inf, 2.5]
        assert table.query_many({"x": [x]}).penalties.tolist() == [[np.inf, 2.5]]
        assert table.query({"x": cdb.cell(repr(x))}).penalties.tolist() == [np.inf, 2.5]


def test_an_angle_is_away_the_short_way_round_and_a_date_in_days():
    angles = compiled(["170, 10 ~1/90", "-10..10 ~1/90"], "angle")
    assert angles.penalties({"x": -170.0}).tolist() == pytest.approx([10.0 / 90.0, 160.0 / 90.0])
    dates = compiled(["2026-01-10.. ~1/7"], "date")
    assert dates.penalties({"x": "2026-01-03"}).tolist() == pytest.approx([1.0])


def test_a_set_of_facts_costs_what_its_nearest_value_does_and_a_missing_one_a_penalty():
    table = compiled()
    assert table.penalties({"x": cdb.cell("35 ± 3")}).tolist() == pytest.approx([0.5, 2.5, 0.0, 54.0, 0.0, 0.2, 0.0])
    assert table.penalties({}, unknown="any").tolist() == [0.0] * 7
    assert table.penalties({}, unknown="never").tolist() == [2.5, 2.5, 0.0, 1.0, 2.0, 1.0, 0.0]


def test_the_cheapest_row_is_the_nearest():
    table = compiled(["0..10 ~1/10", "20..30 ~1/10", "50..60 ~1/10"])
    picker = table.picker(seed=0, memory=0)
    assert [picker.pick(table.query({"x": x})).row for x in (12.0, 19.0, 38.0, 45.0)] == [0, 1, 1, 2]
    assert table.picker(memory=0).pick_many(table.query_many({"x": [12.0, 19.0, 38.0, 45.0]})).tolist() == [0, 1, 1, 2]


def test_inner_tables_cost_at_each_depth(tmp_path: Path):
    (tmp_path / "contextdb.toml").write_text('[conditions.x]\ntype = "number"\n', encoding="utf-8")
    (tmp_path / "moves.csv").write_text("Asset,x\n@inner,0..10 ~1/10\nrest,Any\n", encoding="utf-8")
    (tmp_path / "inner.csv").write_text("Asset,x\nwalk,20.. ~1/5\nrun,Any\n", encoding="utf-8")
    table = cdb.Project.load(tmp_path)["moves"].compile()
    costs = dict(zip(table.leaves, table.penalties({"x": 15.0}).tolist(), strict=True))
    assert costs == pytest.approx({"walk": 0.5 + 1.0, "run": 0.5, "rest": 0.0})
