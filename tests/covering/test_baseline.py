"""A coverage report against an earlier one: gaps are compared by the contexts that they hold."""

import json
from contextlib import suppress

import pytest

from contextdb.covering import coverage
from contextdb.covering.assumed import opened
from contextdb.covering.baseline import Change, Earlier, compared, declared, read_baseline
from contextdb.errors import ContextError
from contextdb.files.reports import sealed, with_marks
from contextdb.report.render_json import as_json
from contextdb.schema.settings import TableSettings
from contextdb.tables.table import Table

SCHEMA = {"speed": {"type": "number", "min": 0, "max": 10}, "gait": {"type": "enum", "values": ["Walk", "Run"]}}


def table_of(*rows: tuple[str, str, str], policy: str = "collect") -> Table:
    columns = dict(zip(("Asset", "speed", "gait"), map(list, zip(*rows, strict=True)), strict=True))
    return Table.from_columns(columns, SCHEMA, TableSettings("t", policy=policy))


def written(document: dict[str, object]) -> str:
    return sealed(as_json(with_marks(document)))


def earlier_of(table: Table) -> Earlier:
    report = coverage(table)
    entry = report.to_json() | {"space": declared(table, report.assumed)}
    return read_baseline(written({"format": 1, "tables": [entry], "cases": {}}), "b.json").tables["t"]


def change(before: Table, after: Table) -> Change:
    return compared(opened(after), coverage(after), earlier_of(before))


WALK, RUN = ("walk", "0..4", "Walk"), ("run", "4..10", "Run")


def test_the_same_table_changed_in_nothing():
    found = change(table_of(WALK, RUN), table_of(RUN, WALK))
    assert (found.drop, found.opened, found.closed, found.dead, found.is_complete) == (0.0, (), (), (), True)


def test_a_row_taken_away_opens_a_gap_and_lowers_the_share():
    found = change(table_of(WALK, RUN), table_of(WALK))
    assert found.drop == pytest.approx(0.3)
    assert [gap.cells for gap in found.opened] == [{"speed": "(4..10]"}, {"gait": "Run"}]
    assert found.closed == ()


def test_a_gap_that_became_narrower_is_neither_new_nor_closed():
    found = change(table_of(WALK), table_of(WALK, ("run", "4..6", "Run")))
    assert found.drop < 0
    assert (found.opened, found.closed) == ((), ())


def test_a_gap_that_is_cut_otherwise_is_not_new():
    found = change(table_of(("walk", "0..4", "Any")), table_of(("walk", "0..4", "Any"), ("run", "6..8", "Run")))
    assert (found.opened, found.closed) == ((), ())


def test_a_gap_is_closed_when_every_context_of_it_has_a_row():
    found = change(table_of(WALK), table_of(WALK, ("run", "Any", "Run")))
    assert [gap.cells for gap in found.closed] == [{"gait": "Run"}]
    assert found.opened == ()


def test_rows_that_died_since_are_told_and_those_dead_before_are_not():
    before = table_of(("all", "0..4", "Any"), ("slow", "0..3", "Any"), ("fast", "4..9", "Any"), policy="first")
    after = table_of(("all", "0..9", "Any"), ("slow", "0..3", "Any"), ("fast", "4..9", "Any"), policy="first")
    assert [f.asset for f in change(before, after).dead] == ["fast"]


def test_gaps_over_a_condition_that_is_gone_are_closed():
    plain = Table.from_columns({"Asset": ["walk"], "speed": ["0..4"]}, SCHEMA, TableSettings("t"))
    found = compared(opened(plain), coverage(plain), earlier_of(table_of(WALK)))
    assert [gap.cells for gap in found.closed] == [{"gait": "Run"}]


@pytest.mark.parametrize(
    "text",
    [
        "",
        "no json",
        "[]",
        '{"format": 2, "tables": []}',
        '{"format": 1}',
        '{"format": 1, "tables": [{}]}',
        '{"format": 1, "tables": [{"table": "t", "covered": {"lower": 2}, "gaps": {"complete": true, "items": []}}]}',
        '{"format": 1, "tables": [{"table": "t", "covered": {"lower": NaN}, "gaps": {"complete": true, "items": []}}]}',
        '{"format": 1, "tables": [{"table": "t", "covered": {"lower": 0}, "gaps": {"complete": true, "items": [1]}}]}',
        '{"format": 1, "tables": [{"table": "t", "covered": {"lower": 0}, "gaps": null}]}',
        "[" * 100_000,
        '{"format": 1, "tables": [{"table": "t", "covered": {"lower": 1%s}, "gaps": {"complete": true, "items": []}}]}'
        % ("0" * 400),
        '{{"format": 1, "digest": "", "tables": {}1{}}}'.format("[" * 800, "]" * 800),
        '{\n<<<<<<< HEAD\n"format": 1\n=======\n"format": 1\n>>>>>>> theirs\n}',
    ],
)
def test_what_is_no_report_is_refused_with_its_file(text: str):
    with suppress(ValueError, RecursionError, TypeError):
        text = written(json.loads(text))
    with pytest.raises(ContextError, match=r"^b\.json: the baseline cannot be read: .*coverage --format json"):
        read_baseline(text, "b.json")
