"""Telemetry against an oracle: a plain loop over every recorded moment, with every cell of every row read anew."""

import math
import tempfile
from dataclasses import replace
from pathlib import Path

import oracles
import polars as pl
import pytest
import strategies
from hypothesis import given
from hypothesis import strategies as st

from contextdb.errors import ContextDBError
from contextdb.report.coverage_words import facts_sentences
from contextdb.schema.settings import EMPTY, conditions_from_dict
from contextdb.tables.table import Table
from contextdb.telemetry import observe
from contextdb.telemetry import parts as parts_module

SCHEMA = {
    "speed": {"type": "number", "min": 0.0, "max": 10.0},
    "turn": {"type": "angle"},
    "steps": {"type": "int", "min": 0, "max": 9},
    "mode": {"type": "enum", "values": ["CB", "FS", "Half Back"]},
    "air": {"type": "bool"},
    "tags": {"type": "tags", "values": ["InAir", "Move", "Move.Run"]},
}
TABLE = Table.from_columns(
    {
        "Asset": ["a", "b", "c", "d"],
        "speed": ["0..5", "not 3..12", "Any", "(5..9)"],
        "turn": ["Any", "170, 20", "Any", "-90..90"],
        "steps": ["1..3", "Any", "<2", "not 4"],
        "mode": ["CB FS", "Any", "not CB", "Any"],
        "air": ["Any", "True", "False", "Any"],
        "tags": ["Any", "+Move -InAir", "Any", "not +Move.Run"],
    },
    SCHEMA,
)
SMALL = Table.from_columns({"Asset": ["a", "b"], "speed": ["0..2", "4..5"]}, {"speed": SCHEMA["speed"]})
VALUES = {
    "speed": [None, math.nan, 0.0, 3.0, 5.0, 7.5, 9.0, 10.0, 11.0, -1.0, math.inf],
    "turn": [None, math.nan, 0.0, 90.0, 170.0, 190.0, -175.0, 725.0, math.inf],
    "steps": [None, 0, 1, 3, 4, 9, 12, -1],
    "mode": [None, "CB", "FS", "Half Back", "Nobody", ""],
    "air": [None, True, False],
    "tags": [None, [], ["Move"], ["Move.Run", "InAir"], ["InAir"], ["Flying"]],
}
OUTSIDE = {
    "speed": lambda v: v < 0.0 or v > 10.0,
    "turn": math.isinf,
    "steps": lambda v: v < 0 or v > 9,
    "mode": lambda v: v not in ("CB", "FS", "Half Back"),
    "air": lambda v: False,
    "tags": lambda v: "Flying" in v,
}
COMPARED_AS_IT_IS = ("speed", "steps")


def is_missing(value: object) -> bool:
    return value is None or value != value


def plain(name: str, value: object) -> object:
    """A recorded value as the oracle takes it."""
    if is_missing(value) or (OUTSIDE[name](value) and name not in COMPARED_AS_IT_IS):
        return None
    return frozenset(value) if name == "tags" else oracles.wrapped(value) if name == "turn" else value


def write(folder: Path, moments: list[dict[str, object]], name: str, columns: list[str]) -> None:
    """Moments as a file; in a CSV tags are words and empty sets quoted quotes."""
    if name.endswith(".parquet"):
        types = {"tags": pl.List(pl.String), "mode": pl.String, "air": pl.Boolean, "steps": pl.Int64}
        series = [pl.Series(c, [m[c] for m in moments], dtype=types.get(c, pl.Float64)) for c in columns if c != "n"]
        series += [pl.Series("n", [m["n"] for m in moments], dtype=pl.Int64)]
        pl.DataFrame(series).write_parquet(folder / name)
        return
    lines = [",".join(columns), *(",".join(text(c, m[c]) for c in columns) for m in moments)]
    (folder / name).write_text("\n".join(lines) + "\n", encoding="utf-8")


def text(name: str, value: object) -> str:
    if value is None or value == "":
        return ""
    if name == "tags":
        return " ".join(value) or '""""""'
    return str(value)


@st.composite
def recordings(draw: st.DrawFn) -> list[dict[str, object]]:
    moment = st.fixed_dictionaries({n: strategies.one_of(*range(len(v))) for n, v in VALUES.items()})
    drawn = draw(st.lists(moment, max_size=12))
    return [{**{n: VALUES[n][i] for n, i in m.items()}, "n": draw(strategies.one_of(0, 1, 2, 1000))} for m in drawn]


@strategies.examples(1)
@given(recordings(), recordings(), st.permutations([*VALUES, "n"]), st.booleans(), st.integers(1, 5))
def test_sums_are_those_of_a_loop_over_every_moment(first, second, order, has_count, at_once):
    moments = [*first, *second]
    # An empty field of a CSV is a missing fact.
    seen = [*first, *({**m, "mode": m["mode"] or None} for m in second)]
    with tempfile.TemporaryDirectory() as name, pytest.MonkeyPatch.context() as patch:
        patch.setattr("contextdb.telemetry.chunks.ROWS", at_once)
        patch.setattr("contextdb.telemetry.chunks.BYTES", 40 * at_once)
        write(Path(name), first, "a.parquet", [*VALUES, "n"])
        write(Path(name), second, "b.csv", order)
        found = observe(TABLE, f"{name}/*", count="n" if has_count else None)
    assert not found.unread
    weights = [m["n"] if has_count else 1 for m in moments]
    contexts = [{n: plain(n, m[n]) for n in VALUES} for m in seen]
    valid = [oracles.rows(TABLE, c, "never") for c in contexts]
    assert (found.rows, found.moments) == (len(moments), sum(weights))
    assert found.hits == tuple(sum(w for w, rows in zip(weights, valid, strict=True) if r in rows) for r in range(TABLE.n_rows))
    assert found.uncovered == sum(w for w, rows in zip(weights, valid, strict=True) if not rows)
    assert {f.condition: f.moments for f in found.missing} == noted(seen, weights, lambda n, v: is_missing(v))
    assert {f.condition: f.moments for f in found.outside} == noted(seen, weights, lambda n, v: not is_missing(v) and OUTSIDE[n](v))
    assert_gaps_are_open(found)


def noted(moments, weights, holds) -> dict[str, int]:
    sums = {n: sum(w for m, w in zip(moments, weights, strict=True) if holds(n, m[n])) for n in VALUES}
    return {n: total for n, total in sums.items() if total}


def assert_gaps_are_open(found) -> None:
    assert sum(gap.new_share for gap in found.gaps) * max(1, found.moments) + found.elsewhere == pytest.approx(found.uncovered)
    assert [gap.moments for gap in found.gaps] == sorted((gap.moments for gap in found.gaps), reverse=True)


@strategies.examples(1)
@given(st.data())
def test_any_table_is_observed_as_it_is_queried(data):
    table = data.draw(strategies.tables(least_conditions=1))
    numeric = [c.condition for c in table.conditions if c.condition.domain.kind in ("int", "number", "angle", "bool")]
    columns = {}
    for condition in numeric:
        texts = next(c.texts.texts for c in table.conditions if c.condition is condition)
        values = strategies.near(texts, condition.domain)
        columns[condition.name] = data.draw(st.lists(values, min_size=4, max_size=4))
    with tempfile.TemporaryDirectory() as name:
        frame = pl.DataFrame({"": [0] * 4}).with_columns(
            pl.Series(n, v, dtype=pl.Boolean if isinstance(v[0], bool) else pl.Float64) for n, v in columns.items()
        )
        frame.write_parquet(f"{name}/a.parquet")
        found = observe(table, f"{name}/a.parquet")
    valid = [oracles.rows(table, {n: v[i] for n, v in columns.items()}, "never") for i in range(4)]
    assert found.uncovered == sum(not rows for rows in valid)
    assert found.hits == tuple(sum(r in rows for rows in valid) for r in range(table.n_rows))
    assert found.elsewhere + sum(g.new_share for g in found.gaps) * 4 == pytest.approx(found.uncovered)


def test_gaps_are_ranked_by_the_moments_in_them(tmp_path):
    cells = {"Asset": ["a", "b"], "speed": ["0..2", "4..5"], "air": ["True", "Any"]}
    table = Table.from_columns(cells, {name: SCHEMA[name] for name in ("speed", "air")})
    moments = {"speed": [1.0, 3.0, 1.0], "air": [False, True, True], "n": [20, 70, 10]}
    pl.DataFrame(moments).write_parquet(tmp_path / "a.parquet")
    found = observe(table, tmp_path / "a.parquet", count="n")
    assert [(gap.text, gap.share) for gap in found.gaps] == [
        ("speed: (2..4) | (5..10]", 0.7),
        ("speed: [0..4) | (5..10], air: False", 0.2),
    ]
    assert found.covered == pytest.approx(0.1)
    assert found.hits == (10, 0)
    assert found.never_used == (1,)


def test_moments_beyond_the_bounds_are_in_no_gap_where_the_table_can_tell(tmp_path):
    (tmp_path / "a.csv").write_text("speed\n-3\n3\n\n", encoding="utf-8")
    found = observe(SMALL, tmp_path / "a.csv")
    assert (found.uncovered, found.elsewhere, len(found.gaps)) == (2, 1, 1)
    assert [(f.condition, f.moments, f.examples) for f in found.outside] == [("speed", 1, ("-3",))]


def test_an_absent_column_is_missing_in_every_moment_and_others_are_named(tmp_path):
    pl.DataFrame({"sped": [1.0, 2.0], "build": ["x", "y"]}).write_parquet(tmp_path / "a.parquet")
    found = observe(SMALL, tmp_path / "a.parquet")
    assert [(f.condition, f.moments) for f in found.missing] == [("speed", 2)]
    assert found.unknown_columns == ("build", "sped")


@pytest.mark.parametrize(
    ("counts", "said"),
    [(["1", "-2"], "-2"), (["1", "0.5"], "0.5"), (["1", ""], "missing"), (["1", "many"], "many"), (["1", "inf"], "inf")],
)
def test_a_count_that_is_none_is_told_with_its_line(tmp_path, counts, said):
    lines = ["speed,n", *(f"1,{n}" for n in counts)]
    (tmp_path / "a.csv").write_text("\n".join(lines) + "\n", encoding="utf-8")
    with pytest.raises(ContextDBError, match=rf'a\.csv, line 3, column "n": the count .*{said}'):
        observe(SMALL, tmp_path / "a.csv", count="n")


def test_the_line_of_a_fault_counts_the_pieces_before_it(tmp_path, monkeypatch):
    monkeypatch.setattr("contextdb.telemetry.chunks.BYTES", 8)
    (tmp_path / "a.csv").write_text("speed,n\n" + "1,1\n" * 50 + "1,x\n" + "1,1\n" * 5, encoding="utf-8")
    with pytest.raises(ContextDBError, match="line 52"):
        observe(SMALL, tmp_path / "a.csv", count="n")


def test_a_zero_count_adds_nothing(tmp_path):
    (tmp_path / "a.csv").write_text("speed,n\n1,3\n99,0\n", encoding="utf-8")
    found = observe(SMALL, tmp_path / "a.csv", count="n")
    assert (found.rows, found.moments, found.distinct, found.outside) == (2, 3, 1, ())


def test_a_missing_count_column_names_the_nearest(tmp_path):
    (tmp_path / "a.csv").write_text("speed,times\n1,3\n", encoding="utf-8")
    with pytest.raises(ContextDBError, match='Did you mean "times"'):
        observe(SMALL, tmp_path / "a.csv", count="time")


def test_a_truncated_file_among_good_ones_is_named_and_not_counted(tmp_path):
    frame = pl.DataFrame({"speed": [1.0] * 1000})
    frame.write_parquet(tmp_path / "a.parquet")
    (tmp_path / "b.parquet").write_bytes((tmp_path / "a.parquet").read_bytes()[:-100])
    (tmp_path / "c.csv").write_text("speed\n1\n2,3\n", encoding="utf-8")
    found = observe(SMALL, tmp_path / "*")
    assert (found.files, found.moments, found.is_complete) == (1, 1000, False)
    assert [Path(f.file).name for f in found.unread] == ["b.parquet", "c.csv"]
    assert "line 3" in str(found.unread[1].faults[0])


def test_files_without_rows_are_read(tmp_path):
    pl.DataFrame({"speed": []}, schema={"speed": pl.Float64}).write_parquet(tmp_path / "a.parquet")
    (tmp_path / "b.csv").write_text("speed\n", encoding="utf-8")
    found = observe(SMALL, tmp_path / "*")
    assert (found.files, found.moments, found.covered, found.gaps) == (2, 0, 1.0, ())
    assert found.headline == "No moment was recorded."


def test_where_no_file_can_be_read_nothing_is_reported(tmp_path):
    (tmp_path / "a.csv").write_text("", encoding="utf-8")
    with pytest.raises(ContextDBError, match="empty"):
        observe(SMALL, tmp_path / "a.csv")


def test_texts_of_a_csv_may_hold_commas_quotes_and_line_ends(tmp_path, monkeypatch):
    monkeypatch.setattr("contextdb.telemetry.chunks.BYTES", 5)
    table = Table.from_columns({"Asset": ["a"], "name": ["CB"]}, {"name": {"type": "text"}})
    (tmp_path / "a.csv").write_text('note,name\n"one\ntwo, ""three""\n",CB\nx,CB\ny,FS\n', encoding="utf-8")
    found = observe(table, tmp_path / "a.csv")
    assert (found.moments, found.hits, found.distinct) == (3, (2,), 2)


def test_with_too_many_contexts_to_keep_moments_stay_exact_and_shares_are_marked(tmp_path, monkeypatch):
    monkeypatch.setattr(parts_module, "MOST_OPEN", 3)
    table = Table.from_columns(
        {"Asset": list("abc"), "speed": ["1", "2", "3"], "steps": ["4", "5", "6"]}, {k: SCHEMA[k] for k in ("speed", "steps")}
    )
    moments = [(s, k) for s in (0.5, 1.0, 1.5, 2.0, 2.5, 3.0, 3.5) for k in range(9)]
    frame = pl.DataFrame({"speed": [m[0] for m in moments], "steps": [m[1] for m in moments]})
    frame.write_parquet(tmp_path / "a.parquet")
    found = observe(table, tmp_path / "a.parquet")
    assert (found.moments, found.uncovered) == (63, 60)
    assert found.gaps
    assert not any(gap.is_exact for gap in found.gaps)


def test_a_derived_fact_is_computed_from_recorded_ones(tmp_path):
    schema = replace(
        EMPTY,
        conditions=conditions_from_dict(
            {
                "speed": SCHEMA["speed"],
                "target": {"type": "number", "min": 0.0, "max": 10.0},
                "closing": {"type": "number", "min": -10.0, "max": 10.0, "expr": "speed - target"},
            }
        ),
    )
    table = Table.from_columns({"Asset": ["a"], "closing": [">0"]}, schema)
    pl.DataFrame({"speed": [3.0, 1.0, None], "target": [1.0, 3.0, 1.0]}).write_parquet(tmp_path / "a.parquet")
    found = observe(table, tmp_path / "a.parquet")
    assert (found.hits, found.uncovered) == ((1,), 2)
    assert [f.condition for f in found.missing] == ["speed"]


def test_an_estimate_of_very_many_contexts_does_not_depend_on_how_they_come(tmp_path, monkeypatch):
    monkeypatch.setattr(parts_module, "MOST_HASHES", 16)
    table = Table.from_columns(
        {"Asset": list("ab"), "steps": ["0 | 2 | 4 | 6 | 8", "3"], "turn": ["0..10 | 20..30", "40..50"]}, SCHEMA
    )
    rows = [(k, t) for k in range(10) for t in (5.0, 15.0, 25.0, 35.0, 45.0, 60.0)]
    frame = pl.DataFrame({"steps": [r[0] for r in rows], "turn": [r[1] for r in rows]})
    frame.write_parquet(tmp_path / "whole.parquet")
    for i in range(4):
        frame[i::4].write_parquet(tmp_path / f"part{i}.parquet")
    whole = observe(table, tmp_path / "whole.parquet")
    monkeypatch.setattr("contextdb.telemetry.chunks.ROWS", 7)
    split = observe(table, [tmp_path / f"part{i}.parquet" for i in (3, 1, 0, 2)])
    assert not whole.distinct_is_exact
    assert replace(split, files=1) == whole


@pytest.mark.parametrize("name", [*SCHEMA, "n"])
def test_columns_of_unlikely_types_are_facts_outside_or_faults(tmp_path, name):
    unlikely = [
        pl.Series(["x"]),
        pl.Series([b"x"]),
        pl.Series([[1, 2]]),
        pl.Series([{"a": 1}]),
        pl.Series([0]).cast(pl.Datetime),
        pl.Series([0]).cast(pl.Duration),
        pl.Series([["x"]]),
    ]
    for at, series in enumerate(unlikely):
        pl.DataFrame({name: series}).write_parquet(tmp_path / f"{at}.parquet")
    pl.DataFrame({"n": [2]}).write_parquet(tmp_path / "good.parquet")
    found = observe(TABLE, f"{tmp_path}/*", count="n" if name == "n" else None)
    if name == "n":
        assert (found.moments, len(found.unread)) == (2, 7)
    else:
        assert {f.condition: f.moments for f in found.outside} == {name: 7}


def test_a_byte_order_mark_and_windows_line_ends_are_read(tmp_path, monkeypatch):
    monkeypatch.setattr("contextdb.telemetry.chunks.BYTES", 4)
    (tmp_path / "a.csv").write_bytes(b"\xef\xbb\xbfspeed,n\r\n1,2\r\n3,4\r\n4.5,1")
    found = observe(SMALL, tmp_path / "a.csv", count="n")
    assert (found.hits, found.uncovered, found.unknown_columns) == ((2, 1), 4, ())


def test_a_piece_of_blank_lines_only_has_no_rows(tmp_path, monkeypatch):
    monkeypatch.setattr("contextdb.telemetry.chunks.BYTES", 4)
    (tmp_path / "a.csv").write_text("speed,n\n1,2\n\n\n\n\n\n\n3,4\n\n\n\n\n\n\n\n", encoding="utf-8")
    found = observe(SMALL, tmp_path / "a.csv", count="n")
    assert (found.moments, found.unread) == (6, ())


def test_progress_is_told_inside_a_file_too(tmp_path, monkeypatch):
    monkeypatch.setattr("contextdb.telemetry.chunks.ROWS", 25)
    for name in "ab":
        pl.DataFrame({"speed": [1.0] * 100}).write_parquet(tmp_path / f"{name}.parquet")
    told = []
    observe(SMALL, f"{tmp_path}/*", progress=lambda *args: told.append(args))
    assert told == [(0, 2), (0.25, 2), (0.5, 2), (0.75, 2), (1, 2), (1.25, 2), (1.5, 2), (1.75, 2), (2, 2)]


def test_files_that_say_nothing_to_the_table_are_counted_in_pieces(tmp_path, monkeypatch):
    monkeypatch.setattr("contextdb.telemetry.chunks.ROWS", 30)
    pl.DataFrame({"frame": list(range(100))}).write_parquet(tmp_path / "a.parquet")
    found = observe(SMALL, tmp_path / "a.parquet")
    assert (found.rows, found.uncovered, found.elsewhere, found.distinct) == (100, 100, 100, 1)


def test_a_table_of_very_many_bounds_is_observed_as_it_is_queried(tmp_path):
    n_rows = 6000 if strategies.IS_FULL else 1500
    cells = [f"{k / 7:.6f}..{k / 7 + 3:.6f}" for k in range(n_rows)]
    table = Table.from_columns({"Asset": ["a"] * n_rows, "x": cells}, {"x": {"type": "number"}})
    facts = [None if k % 11 == 0 else k / 3 - 100 for k in range(3000)]
    pl.DataFrame({"x": facts}).write_parquet(tmp_path / "a.parquet")
    found = observe(table, tmp_path / "a.parquet")
    many = table.compile().query_many({"x": facts}, unknown="never")
    assert found.hits == tuple(many.hits.tolist())
    assert found.uncovered == int((many.counts == 0).sum())


def test_columns_whose_fact_is_missing_everywhere_and_others_like_it_are_told_together(tmp_path):
    pl.DataFrame({"sped": [1.0, 2.0], "build": ["x", "y"]}).write_parquet(tmp_path / "a.parquet")
    sentences = list(facts_sentences(observe(SMALL, tmp_path / "a.parquet")))
    assert sentences[0] == 'missing: speed in 2 moments (is it "sped"?)'


def test_a_column_of_tags_that_no_row_asks_for_is_read(tmp_path):
    table = Table.from_columns({"Asset": ["a"], "speed": ["0..2"], "tags": ["Any"]}, {k: SCHEMA[k] for k in ("speed", "tags")})
    pl.DataFrame({"speed": [1.0, 3.0], "tags": [["Move"], None]}).write_parquet(tmp_path / "a.parquet")
    found = observe(table, tmp_path / "a.parquet")
    assert (found.hits, found.uncovered, found.distinct) == ((1,), 1, 2)
    assert [f.condition for f in found.missing] == ["tags"]
