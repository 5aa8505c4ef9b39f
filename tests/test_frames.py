"""Answers, tables and gaps as DataFrames."""

from pathlib import Path

import polars as pl

import contextdb as cdb

TABLE = cdb.Table.from_columns(
    {"Asset": ["walk", "run", "walk"], "speed": ["<3", ">=2", "Any"], "damage": ["1", "2.5", ""], "line": ["Hm.", "", "Oh!"]},
    schema={"speed": {"type": "number", "min": 0, "max": 9}},
    settings={"outputs": {"damage": {"type": "number", "default": 0}, "line": {"type": "text"}}},
)
COMPILED = TABLE.compile()
ROWS = [(0, "walk", 1.0, "Hm."), (1, "run", 2.5, ""), (2, "walk", 0.0, "Oh!")]


def test_an_answer_is_a_frame_of_rows_assets_and_outputs():
    frame = COMPILED.query({"speed": 2.5}).to_polars()
    assert (frame.columns, frame.rows()) == (["row", "asset", "damage", "line"], ROWS)
    assert pl.DataFrame(COMPILED.query({"speed": 1.0})).rows() == [ROWS[0], ROWS[2]]


def test_answers_of_many_contexts_are_one_frame_in_the_order_of_the_contexts():
    many = COMPILED.query_many({"speed": [5.0, 1.0]})
    assert many.to_polars().rows() == [(0, *ROWS[1]), (0, *ROWS[2]), (1, *ROWS[0]), (1, *ROWS[2])]
    assert (many.rows.tolist(), many.starts.tolist()) == ([1, 2, 0, 2], [0, 2, 4])
    assert (many.assets, many.outputs("damage").tolist()) == (["run", "walk", "walk", "walk"], [2.5, 0.0, 1.0, 0.0])
    none = COMPILED.query_many({"speed": []})
    assert (none.to_polars().schema, none.starts.tolist()) == (many.to_polars().schema, [0])


def test_a_table_is_a_frame_of_texts_and_a_sequence_of_rows():
    assert cdb.Table.from_columns(TABLE.to_polars(), TABLE.schema, TABLE.settings).to_polars().equals(pl.DataFrame(TABLE))
    assert TABLE[-1] == {"Asset": "walk", "speed": "Any", "damage": "", "line": "Oh!"}
    assert list(TABLE) == TABLE.to_polars().to_dicts()


def test_gaps_are_a_frame_of_cells():
    gappy = cdb.Table.from_columns(
        {"Asset": ["walk"], "speed": ["<3"], "hurt": ["True"]},
        schema={"speed": {"type": "number", "min": 0, "max": 9}, "hurt": {"type": "bool"}},
    )
    report = cdb.coverage(gappy)
    frame = report.to_polars()
    assert frame.rows() == [(g.id, g.share, g.cells.get("speed"), g.cells.get("hurt")) for g in report.gaps]
    assert cdb.coverage(TABLE).to_polars().is_empty()


def test_in_a_notebook_a_table_says_its_conditions_and_answers_their_assets():
    many, live = COMPILED.query_many({"speed": [5.0] * 30}), COMPILED.live({"speed": 5.0})
    assert "<td>speed</td><td>number</td>" in COMPILED._repr_html_()
    assert "<td>29</td>" not in many._repr_html_()
    assert "<td>0</td><td>2</td><td>run, walk</td>" in many._repr_html_()
    assert "<p>and 10 more</p>" in many._repr_html_()
    assert "<td>speed</td><td>5.0</td>" in live._repr_html_()


def test_in_a_notebook_an_explanation_marks_valid_rows_and_says_whole_reasons():
    moves = cdb.load(Path(__file__).parent.parent / "tables" / "locomotion.csv").compile()
    shown = moves.explain({"gait": "Walk", "speed": 1.3, "direction": 65.0, "style": "normal"})._repr_html_()
    assert "<td>walk_turn_left_45</td><td>valid</td>" in shown
    assert "characters)" not in shown
