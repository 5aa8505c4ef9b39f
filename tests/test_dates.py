"""Conditions of type date, from contextdb.toml to each way to ask: one fact, columns, expressions, files and the editor."""

import datetime
from datetime import date
from pathlib import Path

import numpy as np
import polars as pl
import pytest

import contextdb as cdb
from contextdb.cells.conditions import Condition
from contextdb.cells.dates import LIMITS, date_of
from contextdb.cells.domains import DATE, Domain
from contextdb.cells.facts import describe, read_fact, read_fact_text
from contextdb.cells.grammar import parse_cell
from contextdb.columns import TextColumn
from contextdb.compiled.stubs import stubs_of
from contextdb.errors import ContextDBError
from contextdb.exchange.formats import FORMATS, write
from contextdb.exchange.proposals import propose_type
from contextdb.exchange.reading import text_of_value
from contextdb.tables.table import Table
from contextdb.telemetry.contexts import read_contexts
from tui.model.interval_picture import framed_line, number_words
from tui.model.number_forms import nudged, other_form

DAY = Condition("day", DATE)
YEAR = {"type": "date", "min": "2026-01-01", "max": "2026-12-31"}
CELLS = ["2026-01-01..2026-03-31", "not 2026-12-24", "Any"]
DAYS = [date(2025, 12, 31), date(2026, 1, 1), date(2026, 3, 31), date(2026, 12, 24), date(2026, 12, 25)]
ROWS = [[2], [0, 1, 2], [0, 1, 2], [2], [1, 2]]


def table(**declared: object) -> Table:
    return Table.from_columns({"Asset": ["spring", "year", "ever"], "day": CELLS}, {"day": {**YEAR, **declared}})


# ---- facts


@pytest.mark.parametrize("given", [date(2026, 1, 31), "2026-01-31", np.datetime64("2026-01-31"), np.datetime64("2026-01-31T00:00")])
def test_a_day_is_given_as_a_date_or_as_its_text(given: object):
    assert read_fact(given, DAY) == 20484.0
    assert describe(20484.0, DATE) == "2026-01-31"


@pytest.mark.parametrize(
    "given",
    [
        *(20484, True, "20484", datetime.datetime(2026, 1, 31), np.datetime64("2026-01-31T12"), "2026-02-30"),
        *(1e9, 1.5, np.datetime64("20000-01-01")),
    ],
)
def test_what_is_no_day_is_refused(given: object):
    with pytest.raises(ContextDBError) as caught:
        read_fact(given, DAY)
    assert 'column "day"' in str(caught.value)


def test_what_means_nothing_is_a_missing_date():
    assert [read_fact(value, DAY) for value in (None, float("nan"), np.datetime64("NaT", "D"), "")] == [None] * 4


def test_the_first_and_the_last_day_of_the_calendar_are_facts():
    assert [read_fact_text(str(day), DAY) for day in (date.min, date.max)] == list(LIMITS)
    assert [date_of(day) for day in LIMITS] == [date.min, date.max]


def test_an_interval_without_an_end_may_say_inf():
    assert parse_cell("-inf..2026-01-31", DATE) == parse_cell("<=2026-01-31", DATE)


# ---- asked


def test_one_day_after_the_other_is_answered_as_all_at_once():
    compiled = table().compile()
    assert [compiled.query({"day": day}).indices.tolist() for day in DAYS] == ROWS
    columns = [
        DAYS,
        list(map(str, DAYS)),
        pl.Series(DAYS),
        pl.Series(DAYS, dtype=pl.Date),
        np.array(DAYS, "datetime64[D]"),
        np.array(DAYS, object),
    ]
    for column in columns:
        assert [rows.tolist() for rows in compiled.query_many({"day": column}).lists()] == ROWS
    frame = pl.DataFrame({"day": [*DAYS, None]})
    assert [rows.tolist() for rows in compiled.query_many(frame, unknown="any").lists()] == [*ROWS, [0, 1, 2]]


def test_a_set_of_days_is_written_as_a_cell():
    found = table().compile().query({"day": cdb.cell("2026-12-24..")})
    assert found.assets == ["year", "ever"]


def test_an_artefact_with_dates_answers_as_its_table(tmp_path: Path):
    compiled = table().compile()
    compiled.save(tmp_path / "t.safetensors")
    opened = type(compiled).open(tmp_path / "t.safetensors")
    assert [opened.query({"day": day}).indices.tolist() for day in DAYS] == ROWS
    assert opened.conditions == compiled.conditions


def test_coverage_measures_days_within_the_declared_ones():
    measured = cdb.coverage(table().with_cells([(2, "day", "2026-01-05")]))
    assert measured.covered == pytest.approx(364 / 365)
    assert [gap.cells for gap in measured.gaps] == [{"day": "2026-12-24"}]


def test_coverage_without_declared_days_says_what_it_took_for_the_endless_ones():
    measured = cdb.coverage(Table.from_columns({"Asset": ["a"], "day": ["2026-01-01..2026-03-31"]}, {"day": {"type": "date"}}))
    assert [gap.cells for gap in measured.gaps] == [{"day": "..2025-12-31 | 2026-04-01.."}]
    assert measured.assumed == {"day": "..2025-12-31 counts 44, 2026-04-01.. counts 44"}


# ---- declared and derived


def test_bounds_are_dates_of_toml_or_texts():
    assert table(min=date(2026, 1, 1)).condition("day").condition == table().condition("day").condition
    assert table().condition("day").condition.domain == Domain("date", None, 20454.0, 20818.0)


@pytest.mark.parametrize(
    ("key", "bound", "why"),
    [
        ("min", 5, '[conditions.day] min = 5: this is a number, not a date. Accepted: a date, such as "2026-01-31".'),
        ("max", "2026-02-30", '[conditions.day] max = "2026-02-30": the calendar has no day "2026-02-30".'),
        ("min", "soon", '[conditions.day] min = "soon": this is not a date.'),
        ("min", "2027-01-01", '[conditions.day] min = "2027-01-01" is above max = "2026-12-31".'),
    ],
)
def test_bounds_that_are_no_days_are_refused(key: str, bound: object, why: str):
    with pytest.raises(ContextDBError) as caught:
        table(**{key: bound})
    assert why in str(caught.value)


@pytest.mark.parametrize(
    ("expr", "day", "value"),
    [
        ('day >= "2026-03-01"', date(2026, 3, 1), True),
        ('"2026-03-01" < day < date("2026-04-01")', date(2026, 4, 1), False),
        ('day in "2026-12-24..2026-12-26"', date(2026, 12, 25), True),
        ('day in ["2026-12-24", "2026-12-26"]', date(2026, 12, 25), False),
        ('day - date("2026-01-01") == 30', date(2026, 1, 31), True),
        ('day + 1 == date("2026-02-01")', date(2026, 1, 31), True),
    ],
)
def test_an_expression_compares_days_and_counts_between_them(expr: str, day: date, value: bool):
    schema = {"day": {"type": "date"}, "x": {"type": "bool", "expr": expr}}
    compiled = Table.from_columns({"Asset": ["a"], "x": ["True"]}, schema).compile()
    assert bool(compiled.query({"day": day})) is value
    assert [len(rows) for rows in compiled.query_many({"day": [day, day]}).lists()] == [value, value]


def test_a_date_is_derived_from_another_and_one_beyond_the_calendar_is_missing():
    schema = {"day": {"type": "date"}, "end": {"type": "date", "expr": "day + 7"}}
    compiled = Table.from_columns({"Asset": ["a", "b"], "end": ["2026-01-08", "not 2026-01-08"]}, schema).compile()
    assert compiled.query({"day": "2026-01-01"}).assets == ["a"]
    assert [r.tolist() for r in compiled.query_many({"day": [date(2026, 1, 1), date.max]}, unknown="never").lists()] == [[0], []]
    with pytest.raises(ContextDBError):
        compiled.query({"day": date.max})


def test_a_text_that_is_no_day_is_refused_in_an_expression():
    schema = {"day": {"type": "date"}, "x": {"type": "bool", "expr": 'day > "soon"'}}
    with pytest.raises(ContextDBError) as caught:
        Table.from_columns({"Asset": ["a"], "x": ["True"]}, schema).compile()
    assert 'cannot read "soon" as a date' in str(caught.value)


# ---- other formats


def test_a_column_of_days_that_nobody_declares_is_read_as_dates():
    guessed = Table.from_columns({"Asset": ["a", "b"], "day": ["2026-01-01..2026-03-31", "2026-04-01.."]})
    assert guessed.condition("day").condition.domain == DATE


def test_stubs_say_that_a_fact_is_a_date():
    text = stubs_of({"t": table().compile()})
    assert "\nimport datetime\n" in text
    assert "'day': datetime.date | cdb.FactSet,  # 2026-01-01..2026-12-31\n" in text


def test_dmn_keeps_type_bounds_and_cells():
    raw, _ = write(table(), FORMATS["dmn"])
    assert 'typeRef="date"' in raw.decode()
    assert "[date(&quot;2026-01-01&quot;)..date(&quot;2026-12-31&quot;)]" in raw.decode()


def test_a_workbook_of_dates_becomes_a_table_of_days():
    rows = [["Asset", "day"], ["a", date(2026, 1, 31)], ["b", datetime.datetime(2026, 2, 1)], ["c", "<2026-01-01"]]
    assert [text_of_value(row[1]) for row in rows[1:]] == ["2026-01-31", "2026-02-01", "<2026-01-01"]
    proposed = propose_type(TextColumn.of("day", [text_of_value(row[1]) for row in rows[1:]]))
    assert proposed.declared == {"type": "date"}


def test_a_parquet_table_with_a_column_of_dates_is_read_and_keeps_its_type(tmp_path: Path):
    frame = pl.DataFrame({"Asset": ["a", "b"], "day": [date(2026, 1, 31), None]})
    frame.write_parquet(tmp_path / "t.parquet")
    read = cdb.load(tmp_path / "t.parquet")
    assert read.condition("day").condition.domain == DATE
    changed = read.with_cells([(1, "day", "2026-02-01")])
    changed.save(tmp_path / "t.parquet")
    assert pl.read_parquet(tmp_path / "t.parquet")["day"].to_list() == [date(2026, 1, 31), date(2026, 2, 1)]


def test_recorded_days_are_counted_from_text_and_from_parquet(tmp_path: Path):
    compiled = table().compile()
    (tmp_path / "c.csv").write_text("day\n2026-01-05\n2026-12-24\n", encoding="utf-8")
    pl.DataFrame({"day": [date(2026, 1, 5), date(2026, 12, 24)]}).write_parquet(tmp_path / "c.parquet")
    for name in ("c.csv", "c.parquet"):
        answers = read_contexts(tmp_path / name, compiled).ask(compiled, "any")
        assert [rows.tolist() for rows in answers.lists()] == [[0, 1, 2], [2]]


# ---- the editor


def test_the_day_under_the_caret_is_moved_by_days_and_stays_within_the_declared_ones():
    year = Domain("date", None, 20454.0, 20818.0)
    assert nudged("2026-01-31..2026-03-31", 3, year, 1) == ("2026-02-01..2026-03-31", 10)
    assert nudged("2026-01-31..2026-03-31", 22, year, -31) == ("2026-01-31..2026-02-28", 22)
    assert nudged("2026-12-30", 4, year, 5) == ("2026-12-31", 10)


def test_the_other_form_of_an_interval_is_a_day_and_days_around_it():
    assert other_form("2026-01-24..2026-02-07", DATE) == "2026-01-31, 7"
    assert other_form("2026-01-31, 7", DATE) == "2026-01-24..2026-02-07"


def test_an_interval_of_days_is_drawn_and_told_with_its_days():
    year = Domain("date", None, 20454.0, 20818.0)
    cell = parse_cell("2026-01-01..2026-03-31", year)
    line = "".join(text for text, _ in framed_line(cell, year, 60))
    assert line.startswith("2026-01-01 ├")
    assert line.endswith("┤ 2026-12-31")
    assert number_words(cell, year) == "2026-01-01 to 2026-03-31, ends included"
    assert number_words(parse_cell("Any", year), year) == "every date"


def test_a_set_of_days_ends_with_the_calendar():
    compiled = Table.from_columns({"Asset": ["all"], "day": ["<=9999-12-31"]}, {"day": {"type": "date"}}).compile()
    for some in ("Any", ">=2026-01-01", "not 2026-12-24"):
        assert compiled.query({"day": cdb.cell(some)}).always.tolist() == [1], some
