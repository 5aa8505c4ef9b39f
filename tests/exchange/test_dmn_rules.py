"""Tests of a decision table that no cell can say: rules of their rows where an expression can, else unreadable, never data."""

from pathlib import Path
from xml.sax.saxutils import escape

import pytest
from strategies import for_each

from contextdb.exchange.feel import rule_of
from contextdb.exchange.formats import read
from contextdb.exchange.importing import plan_import, table_of
from contextdb.exchange.mapping import propose
from contextdb.exchange.reading import Reading
from contextdb.schema.settings import EMPTY, TableSettings
from contextdb.tables.project import Project

KNOWN = ["speed", "limit", "top speed", "Passenger2.Miles", "name", "other name"]
START = '<definitions xmlns="https://www.omg.org/spec/DMN/20191111/MODEL/">'


def decision(inputs: dict[str, str], *rules: list[str], before: str = "", policy: str = "COLLECT") -> Reading:
    """A decision table over inputs of some types, each rule its tests; the assets are a0, a1, …"""
    parts = [
        f'<input><inputExpression typeRef="{kind}"><text>{escape(name)}</text></inputExpression></input>'
        for name, kind in inputs.items()
    ]
    parts.append('<output name="asset"/>')
    for at, tests in enumerate(rules):
        entries = "".join(f"<inputEntry><text>{escape(test)}</text></inputEntry>" for test in tests)
        parts.append(f'<rule>{entries}<outputEntry><text>"a{at}"</text></outputEntry></rule>')
    table = f'<decisionTable hitPolicy="{policy}">{"".join(parts)}</decisionTable>'
    return read(f'{START}{before}<decision name="d">{table}</decision></definitions>'.encode(), "x.dmn")


def datum(name: str, kind: str) -> str:
    return f'<inputData name="{name}"><variable name="{name}" typeRef="{kind}"/></inputData>'


def told(reading: Reading) -> str:
    return "\n".join(map(str, reading.remarks))


@for_each(
    [
        ("> limit", "speed > limit"),
        ("limit", "speed == limit"),
        ("= limit + 1", "speed == limit + 1"),
        ("!= limit", "speed != limit"),
        (">= top speed * 2", "speed >= `top speed` * 2"),
        ("[limit..top speed)", "speed >= limit and speed < `top speed`"),
        ("]1..limit[", "speed > 1 and speed < limit"),
        ("< limit, > top speed", "speed < limit or speed > `top speed`"),
        ("not(limit, > 5)", "not (speed == limit or speed > 5)"),
        ("? > 3 and ? < limit", "(speed > 3 and speed < limit)"),
        (">= Passenger2.Miles", "speed >= Passenger2.Miles"),
        ('"a\\"b"', 'speed == "a""b"'),
        ("> (limit + 1) * 2", "speed > ( limit + 1 ) * 2"),
        ("maximum(limit)", None),
        ("limit..3", None),
        ("[1..2]..limit", None),
        ("not((limit)", None),
        ("limit(1)", None),
        ("unknown", None),
        ('date("2026-01-02")', None),
        ("[1, 2]", None),
        ("null", None),
        ("limits", None),
        ("> ", None),
        (",", None),
        ("not(", None),
        ("limit " * 2_000, None),
        ("not(" * 500 + "limit" + ")" * 500, None),
    ]
)
def test_a_test_becomes_the_rule_that_means_the_same(test: str, rule: str | None):
    found = rule_of(test, "speed", KNOWN)
    assert (found and found[0]) == rule


def test_tests_against_other_facts_become_rules_of_their_rows():
    reading = decision(
        {"speed": "number", "name": "string"},
        ["> limit", '"x"'],
        ["5", "other name"],
        ["[1..limit]", 'not(other name, "y")'],
        ["-", "-"],
        before=datum("limit", "number") + datum("other name", "string"),
    )
    assert [column.job for column in propose(reading, EMPTY, TableSettings("d"))] == ["asset", "condition", "condition", "when"]
    table, _ = table_of(reading, propose(reading, EMPTY, TableSettings("d")), EMPTY, TableSettings("d"))
    assert not table.faults
    compiled = table.compile()
    facts = {"speed": 5.0, "name": "x", "limit": 4.0, "other name": "x"}
    assert compiled.query(facts).assets == ["a0", "a1", "a3"]
    assert compiled.query({**facts, "limit": 6.0}).assets == ["a1", "a3"]
    assert compiled.query({**facts, "limit": 6.0, "other name": "z"}).assets == ["a2", "a3"]
    assert "4 tests that no cell can say became rules of their rows" in told(reading)
    assert '"limit", "other name"' in told(reading)
    assert not any(remark.is_loss for remark in reading.remarks)


def test_an_imported_rule_and_the_facts_that_it_names_are_declared(tmp_path: Path):
    reading = decision({"speed": "number"}, ["> limit"], before=datum("limit", "number"))
    plan_import(reading, tmp_path / "t.csv").write()
    project = Project.load(tmp_path)
    assert project["t"].settings.when == "When"
    assert project.schema.conditions["limit"].domain.kind == "number"
    assert project["t"].compile().query({"speed": 5.0, "limit": 4.0}).assets == ["a0"]


@for_each(
    ["date", "time", "dayTimeDuration", "string", "number", "boolean", "Any", "tUnknown", ""],
    ['time("10:00:00")', "> duration(1)", "every x in y satisfies x", 'list contains(?, "a")'],
)
def test_a_test_that_nothing_can_say_is_an_unreadable_cell_of_a_condition(kind: str, test: str):
    reading = decision({"fact": kind}, [test], [test], [test])
    column = propose(reading, EMPTY, TableSettings("d"))[1]
    assert (column.job, column.n_unreadable) == ("condition", 3)
    table, _ = table_of(reading, propose(reading, EMPTY, TableSettings("d")), EMPTY, TableSettings("d"))
    assert len(table.faults) == 3
    for rule in (1, 2, 3):
        assert f'rule {rule}, column "fact": ' in told(reading)


@pytest.mark.parametrize("kind", ["string", "", "tUnknown", "date"])
def test_an_input_is_a_condition_whatever_its_tests_say(kind: str):
    for tests in (["-", "-"], ['"a b, c!"', '"d; e"'], [f'"n{i}"' for i in range(60)]):
        reading = decision({"fact": kind}, *([test] for test in tests))
        assert propose(reading, EMPTY, TableSettings("d"))[1].job == "condition"


def test_the_rules_find_a_name_that_no_column_has():
    reading = decision({"When": "number", "When 2": "number"}, ["> limit", "-"], before=datum("limit", "number"))
    assert reading.names == ["asset", "When", "When 2", "When 3"]
    assert reading.schema.tables["d"].when == "When 3"


def test_a_rule_over_the_parts_of_a_structure_is_found():
    structure = (
        '<itemDefinition name="tPassenger"><itemComponent name="Miles"><typeRef>number</typeRef></itemComponent></itemDefinition>'
    )
    before = structure + datum("Passenger1", "tPassenger") + datum("Passenger2", "tPassenger")
    reading = decision({"Passenger1.Miles": "number"}, [">= Passenger2.Miles"], before=before)
    table, _ = table_of(reading, propose(reading, EMPTY, TableSettings("d")), EMPTY, TableSettings("d"))
    assert table.compile().query({"Passenger1.Miles": 5.0, "Passenger2.Miles": 4.0}).assets == ["a0"]
    assert table.compile().query({"Passenger1.Miles": 3.0, "Passenger2.Miles": 4.0}).assets == []
