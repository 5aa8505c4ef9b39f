"""Coverage where it is easily wrong: ends that touch, numbers that nearly round, domains without bounds, input that cannot be."""

import json
from collections.abc import Mapping
from dataclasses import replace
from functools import cache
from types import SimpleNamespace

import numpy as np
import pytest

import contextdb as cdb
from contextdb.covering import count, coverage, format_percent
from contextdb.covering.report import distinct_percents, share_at_once, wilson
from contextdb.covering.sample import MOST_WORDS, samples_of
from contextdb.schema.settings import TableSettings

SPEED = {"speed": {"type": "number", "min": 0.0, "max": 10.0}}


def report_of(
    columns: Mapping[str, list[str]], schema: Mapping[str, Mapping[str, object]], **options: object
) -> cdb.CoverageReport:
    n_rows = len(next(iter(columns.values())))
    policy = options.pop("policy", "collect")
    table = cdb.Table.from_columns(
        {"Asset": [f"A{r}" for r in range(n_rows)], **columns}, schema, TableSettings("table", policy=policy)
    )
    return coverage(table, **options)


@cache
def of_wide_intervals(**options: object) -> cdb.CoverageReport:
    """40 rows over 12 numbers, each of them within 39 hundredths of each number."""
    names = [f"n{i}" for i in range(12)]
    columns = {name: [f"{(7 * i + 13 * r) % 61}..{(7 * i + 13 * r) % 61 + 39}" for r in range(40)] for i, name in enumerate(names)}
    return report_of(columns, {name: {"type": "number", "min": 0, "max": 100} for name in names}, max_gaps=1, **options)


def gaps(report: cdb.CoverageReport) -> list[dict[str, str]]:
    return [gap.cells for gap in report.gaps]


def test_two_open_ends_leave_one_point_of_no_volume():
    report = report_of({"speed": ["..5)", "(5.."]}, SPEED)
    assert (report.covered, gaps(report), report.gaps[0].share, report.gaps_complete) == (1.0, [{"speed": "5"}], 0.0, True)


def test_a_gap_between_neighbouring_doubles_is_not_rounded_away():
    report = report_of(
        {"speed": ["20, 9.99", "29.990000000000002..100", "..10"]}, {"speed": {"type": "number", "min": 0, "max": 100}}
    )
    assert report.covered < 1.0
    assert len(report.gaps) == 1
    assert 0.0 < report.gaps[0].share < 1e-3


def test_assumptions_that_leave_no_context_are_an_error():
    report = report_of({"in_air": ["True"]}, {"in_air": {"type": "bool"}}, impossible=[{"in_air": "True"}, {"in_air": "False"}])
    assert [(f.rule, f.level) for f in report.findings] == [("no-context", "error")]
    assert (report.covered, gaps(report)) == (1.0, [])


def test_weights_say_how_often_values_come_up():
    schema = {"gait": {"type": "enum", "values": ["Walk", "Run", "Stand"]}, **SPEED}
    columns = {"gait": ["Walk", "Any"], "speed": ["Any", "..5)"]}
    weights = {"gait": {"Walk": 6, "Run": 1, "Stand": 1}, "speed": {"..5)": 1, "5..": 3}}
    report = report_of(columns, schema, weights=weights)
    assert report.covered == pytest.approx(0.75 + 0.25 * 0.25)
    assert report.weighted == ("gait", "speed")


@pytest.mark.parametrize(
    "options",
    [
        {"weights": {"sped": {"1": 1}}},
        {"weights": {"speed": {"1": -1}}},
        {"weights": {"speed": {"20..30": 1}}},
        {"weights": {"speed": {"1 to 2": 1}}},
        {"impossible": [{"sped": "1"}]},
        {"impossible": [{"speed": "1 to 2"}]},
        {"samples": -1},
        {"work": 1.5},
    ],
)
def test_arguments_that_cannot_be_meant_are_refused(options):
    with pytest.raises(cdb.ContextDBError, match=r"\w"):
        report_of({"speed": ["..5"]}, SPEED, **options)


def test_a_table_without_rows_covers_nothing():
    report = report_of({"speed": []}, SPEED)
    assert (report.covered, report.method, gaps(report)) == (0.0, "exact", [{}])
    assert report.gaps[0].nearest is None


def test_a_table_without_conditions_covers_everything():
    report = report_of({"Note": ["x"]}, {}, max_gaps=3)
    assert coverage(cdb.Table.from_columns({"Asset": ["A"]})).covered == 1.0
    assert coverage(cdb.Table.from_columns({"Asset": []})).covered == 0.0
    assert report.n_conditions == 1


def test_what_is_assumed_of_a_domain_without_bounds_is_said():
    report = report_of({"speed": ["0..10"], "word": ["A B"]}, {"speed": {"type": "number"}, "word": {"type": "text"}})
    assert report.covered == pytest.approx(0.5 * 2 / 3)
    assert report.assumed["speed"] == "..0) counts 5, (10.. counts 5"
    assert "any other text" in report.assumed["word"]


def test_a_broken_promise_of_one_row_shows_the_overlap():
    report = report_of({"speed": ["..5", "4..6"]}, SPEED, policy="unique")
    found = [f for f in report.findings if f.rule == "policy-overlap"]
    assert [(f.row, f.by, f.level) for f in found] == [(1, (0,), "error")]
    assert "speed: 4..5" in found[0].message


def test_little_covered_is_estimated_out_of_the_rows():
    exact = of_wide_intervals(samples=0)
    report = of_wide_intervals(work=0, samples=50_000)
    assert exact.method == "exact"
    assert report.method == "estimate"
    assert report.lower <= exact.covered <= report.upper
    assert report.upper - report.lower < 0.1 * exact.covered


def test_a_sample_without_a_valid_row_never_says_that_no_context_has_one():
    names = [f"n{i}" for i in range(12)]
    schema = {name: {"type": "number", "min": 0, "max": 100} for name in names}
    exact = report_of({name: ["0..10"] for name in names}, schema)
    sampled = replace(exact, overlap=replace(exact.overlap, histogram=(1.0,), method="estimate"))
    assert share_at_once(sampled, 0) == format_percent(1.0 - exact.covered) == "99.9999999999 %"
    assert share_at_once(replace(sampled, method="estimate", upper=0.25), 0) == "at least 75.00 %"


def test_an_estimate_holds_the_exact_share_and_depends_on_the_seed_alone():
    names = [f"b{i}" for i in range(40)]
    schema = {name: {"type": "bool"} for name in names}
    columns = {name: ["True" if (r * 31 + i * 17) % 13 == 0 else "Any" for r in range(30)] for i, name in enumerate(names)}
    exact = report_of(columns, schema, samples=0, max_gaps=1)
    one, two = (report_of(columns, schema, work=0, seed=5, max_gaps=1) for _ in range(2))
    assert one == two
    assert (exact.method, one.method) == ("exact", "estimate")
    assert one.lower <= exact.covered <= one.upper


@pytest.mark.parametrize("budget", ["MOST_BYTES", "WORDS_A_STEP"])
def test_a_count_that_is_too_much_is_left_out_and_the_share_is_between_certain_bounds(budget: str, monkeypatch: pytest.MonkeyPatch):
    exact = of_wide_intervals(samples=0)
    monkeypatch.setattr(count, budget, 0)
    report, sampled = of_wide_intervals.__wrapped__(samples=0), of_wide_intervals.__wrapped__(samples=50_000)
    assert (exact.method, report.method, sampled.method) == ("exact", "bounds", "estimate")
    assert report.work == 0
    assert 0.39**12 <= report.lower <= exact.covered <= report.upper <= 40 * 0.39**12 + 2 * count.ROUNDING
    assert report.certain == sampled.certain
    assert sampled.lower <= exact.covered <= sampled.upper


def test_boxes_that_are_compared_with_each_other_are_too_many_for_a_small_count():
    """What it takes to find those within others is estimated too: it grows with their square."""
    n = 4000
    boxes = np.full((n, 9), -1, np.int32)
    table = boxes, np.zeros((0, 2), np.int32), np.zeros(1, np.int64), np.zeros((0, 2), np.uint64), np.arange(0, 20, 2)
    assert count._is_countable(table, 40_000_000)
    assert not count._is_countable(table, n * (n // 64 + 1) * 9 // count.WORDS_A_STEP - 1)


def test_samples_are_fewer_where_boxes_are_very_many():
    few, many = (SimpleNamespace(factors=[None] * 9, boxes=range(n)) for n in (1000, 10_000_000))
    assert [samples_of(None, 200_000, space) for space in (few, many)] == [200_000, MOST_WORDS // (9 * 156_250)]
    assert samples_of(123, 200_000, many) == 123


def test_more_gaps_than_asked_for_are_not_called_complete():
    schema = {"speed": {"type": "number", "min": 0, "max": 10}, "run": {"type": "bool"}}
    columns = {"speed": ["..3", "3..", "5"], "run": ["True", "False", "Any"]}
    assert len(report_of(columns, schema).gaps) == 2
    cut = report_of(columns, schema, max_gaps=1)
    assert (len(cut.gaps), cut.gaps_complete) == (1, False)
    assert cut.gaps[0].share == max(g.share for g in report_of(columns, schema).gaps)


def test_the_report_as_json_has_the_fixed_fields():
    data = json.loads(json.dumps(report_of({"speed": ["..5"]}, SPEED).to_json()))
    assert {"table", "rows", "conditions", "covered", "gaps", "findings", "overlap"} <= data.keys()
    assert {"method", "value", "lower", "upper"} <= data["covered"].keys()
    assert data["gaps"]["complete"] is True
    assert {"id", "share", "new_share", "cells"} <= data["gaps"]["items"][0].keys()
    assert {"mean", "histogram"} <= data["overlap"].keys()


def test_more_than_64_conditions_are_counted():
    names = [f"b{i}" for i in range(70)]
    columns = {name: ["True" if i == r else "Any" for r in range(70)] for i, name in enumerate(names)}
    report = report_of(columns, {name: {"type": "bool"} for name in names}, samples=100)
    assert report.method == "exact"
    assert report.covered == 1.0 - 2.0**-53
    assert report.covered < 1.0


@pytest.mark.parametrize(
    ("share", "text"),
    [
        (0.0, "0 %"),
        (1.0, "100 %"),
        (0.5, "50.00 %"),
        (0.999999, "99.9999 %"),
        (0.99999, "99.999 %"),
        (1.0 - 2.0**-53, "> 99.9999999999 %"),
        (1e-9, "0.0000001 %"),
        (0.00004, "0.004 %"),
    ],
)
def test_a_percentage_never_rounds_to_0_or_100(share, text):
    assert format_percent(share) == text


@pytest.mark.parametrize(
    ("one", "other", "texts"),
    [
        (0.41, 0.43, ("41.00 %", "43.00 %")),
        (0.037901, 0.037914, ("3.790 %", "3.791 %")),
        (0.5, 0.5, ("50.00 %", "50.00 %")),
        (0.0, 1e-9, ("0 %", "0.0000001 %")),
    ],
)
def test_two_ends_are_written_so_that_they_can_be_told_apart(one, other, texts):
    assert distinct_percents(one, other) == texts


def test_an_interval_of_samples_holds_the_share_that_was_seen():
    for n_hits in (0, 1, 50, 99, 100):
        low, high = wilson(n_hits, 100)
        assert 0.0 <= low <= n_hits / 100 <= high <= 1.0
    assert wilson(0, 0) == (0.0, 1.0)


def test_a_text_whose_values_nobody_declares_leaves_every_other_text_open():
    report = report_of({"mood": ["calm", "angry"]}, {"mood": {"type": "text"}})
    assert [gap.cells for gap in report.gaps] == [{"mood": "not angry calm"}]
    assert (report.method, round(report.covered, 12)) == ("exact", round(2 / 3, 12))
    assert "any other text" in report.assumed["mood"]
