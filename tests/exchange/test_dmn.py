"""DMN decision tables: what a cell can say comes through both ways, what it cannot is told with its place, bombs are refused."""

from collections.abc import Iterator
from xml.etree import ElementTree

import numpy as np
import pytest
from hypothesis import given
from strategies import for_each, tables

from contextdb.cells.domains import ANGLE, BOOL, NUMBER, TEXT
from contextdb.cells.grammar import parse_cell
from contextdb.cells.kinds import KINDS
from contextdb.errors import TableError
from contextdb.exchange.dmn_write import NAMESPACE
from contextdb.exchange.feel import cell_of, string_of, unary_tests, value_of
from contextdb.exchange.formats import FORMATS, ReadOptions, read, write
from contextdb.exchange.importing import table_of
from contextdb.exchange.mapping import propose
from contextdb.exchange.reading import Reading
from contextdb.schema.settings import EMPTY, TableSettings
from contextdb.tables.table import Table

DISHES = """<?xml version="1.0" encoding="UTF-8"?>
<definitions xmlns="https://www.omg.org/spec/DMN/20191111/MODEL/" id="d" name="DRD" namespace="x">
  <decision id="Dish" name="dish">
    <decisionTable id="t" {policy}>
      <input id="i1" label="Season"><inputExpression id="e1" typeRef="string"><text>season</text></inputExpression>
        <inputValues><text>"Winter","Spring","Half Year"</text></inputValues></input>
      <input id="i2" label="How many"><inputExpression typeRef="integer"><text>guests</text></inputExpression></input>
      <input id="i3"><inputExpression typeRef="boolean"><text>Guest.vegetarian</text></inputExpression></input>
      <output id="o1" name="desiredDish" typeRef="string"><outputValues><text>"Stew","Roast"</text></outputValues></output>
      <output id="o2" name="price" typeRef="number"/>
      <annotation name="why"/>
      <rule><inputEntry><text>"Winter","Spring"</text></inputEntry><inputEntry><text>&lt;= 8</text></inputEntry>
        <inputEntry><text>true</text></inputEntry><outputEntry><text>"Roast"</text></outputEntry>
        <outputEntry><text>12.5</text></outputEntry><annotationEntry><text>it is cold</text></annotationEntry></rule>
      <rule><inputEntry><text>not("Half Year")</text></inputEntry><inputEntry><text>]8..20],30</text></inputEntry>
        <inputEntry><text>-</text></inputEntry><outputEntry><text>"Stew"</text></outputEntry>
        <outputEntry><text></text></outputEntry></rule>
    </decisionTable>
  </decision>
</definitions>
"""


def dishes(policy: str = "", old: str = "", new: str = "") -> Reading:
    text = DISHES.replace("{policy}", policy)
    assert old in text
    return read(text.replace(old, new).encode(), "dish.dmn")


def texts(reading: Reading) -> dict[str, list[str]]:
    return {column.name: column.to_list() for column in reading.columns}


def told(reading: Reading) -> str:
    return "\n".join(map(str, reading.remarks))


def refused(text: str, decision: str | None = None) -> str:
    with pytest.raises(TableError) as caught:
        read(text.encode(), "x.dmn", ReadOptions(sheet=decision))
    return str(caught.value)


def test_a_decision_table_becomes_rows_with_the_first_output_as_the_asset():
    reading = dishes()
    assert texts(reading) == {
        "desiredDish": ["Roast", "Stew"],
        "season": ["Winter Spring", 'not "Half Year"'],
        "guests": ["<=8", "(8..20] | 30"],
        "Guest.vegetarian": ["True", "-"],
        "price": ["12.5", ""],
        "why": ["it is cold", ""],
    }
    table, _ = table_of(reading, propose(reading, EMPTY, TableSettings("dish")), EMPTY, TableSettings("dish"))
    kinds = {c.condition.name: c.condition.domain.kind for c in table.conditions}
    assert kinds == {"season": "enum", "guests": "int", "Guest.vegetarian": "bool"}
    assert (table.asset_column, table.settings.outputs) == ("desiredDish", ("price", "why"))
    assert table.compile().query({"season": "Spring", "guests": 8, "Guest.vegetarian": True}).assets == ["Roast"]


@pytest.mark.parametrize(
    ("said", "policy", "is_lost"),
    [
        ("", "unique", False),
        ('hitPolicy="UNIQUE"', "unique", False),
        ('hitPolicy="FIRST"', "first", False),
        ('hitPolicy="ANY"', "collect", False),
        ('hitPolicy="COLLECT"', "collect", False),
        ('hitPolicy="COLLECT" aggregation="SUM"', "collect", True),
        ('hitPolicy="RULE ORDER"', "collect", True),
        ('hitPolicy="OUTPUT ORDER"', "collect", True),
        ('hitPolicy="PRIORITY"', "priority", False),
    ],
)
def test_the_hit_policy_becomes_the_policy_and_what_is_lost_is_told(said: str, policy: str, is_lost: bool):
    reading = dishes(said)
    assert reading.schema.tables["dish"].policy == policy
    assert any(remark.is_loss for remark in reading.remarks) is is_lost
    assert "hit policy" in told(reading)


def test_the_order_of_the_outputs_values_becomes_priorities():
    reading = dishes('hitPolicy="PRIORITY"')
    assert texts(reading)["Priority"] == ["1", "2"]
    assert reading.schema.tables["dish"].priority == "Priority"


@for_each(
    [
        ("-", "-"),
        ("", "-"),
        ('"a"', "a"),
        ('"a, b", "c"', '"a, b" c'),
        (r'"say \"no\"\n"', '"say ""no""\n"'),
        ('not("a","b")', "not a b"),
        ("true", "True"),
        ("not(true)", "not True"),
        ("true, false", "-"),
        ("5", "5"),
        ("-5.5", "-5.5"),
        (">= 5", ">=5"),
        ("[1..5]", "1..5"),
        ("(1..5)", "(1..5)"),
        ("]1..5[", "(1..5)"),
        ("[1..5)", "[1..5)"),
        ("<1, [2..3], 7", "<1 | 2..3 | 7"),
        ("not([2..3])", "not 2..3"),
        ("[1..2),(3..4]", "[1..2) | (3..4]"),
        ("x", None),
        ('date("2026-01-01")', "2026-01-01"),
        ('< @"2026-01-01"', "<2026-01-01"),
        ('[date("2026-01-01")..date( "2026-03-31" ))', "[2026-01-01..2026-03-31)"),
        ('[date("2026-03-31")..date("2026-01-01")]', None),
        ('time("10:00:00")', None),
        ("? > 5", ">5"),
        ("[5..1]", None),
        ('"a", 5', None),
        ('"unclosed', None),
        ("not(-)", None),
        ("null", None),
        ("[a..b]", None),
    ]
)
def test_a_unary_test_becomes_the_cell_that_means_the_same_or_none(test: str, cell: str | None):
    assert cell_of(test) == cell


@pytest.mark.parametrize(
    ("cell", "domain", "test"),
    [
        ("Any", NUMBER, "-"),
        ("5", NUMBER, "5"),
        ("20, 9.5", NUMBER, "[10.5..29.5]"),
        ("(1..2] | >=7", NUMBER, "(1..2],>= 7"),
        ("<5", NUMBER, "< 5"),
        ("not 5", NUMBER, "< 5,> 5"),
        ("True", BOOL, "true"),
        ('not A "B C"', TEXT, 'not("A","B C")'),
        ("5..3", NUMBER, None),
        ("5 ~2", NUMBER, None),
        ("inf", NUMBER, None),
        ("90..-66", ANGLE, "[-180..-66],[90..180]"),  # a game may give the angle behind as either half turn
        ("180", ANGLE, "-180,180"),
        ("-180..20", ANGLE, "[-180..20],180"),
        ("20..180)", ANGLE, "[20..180)"),
        ("-180..180", ANGLE, "[-180..180]"),
    ],
)
def test_a_cell_becomes_the_unary_test_that_means_the_same_or_none(cell: str, domain, test: str | None):  # type: ignore[no-untyped-def]
    assert unary_tests(parse_cell(cell, domain), domain) == test


def test_literals_have_values_and_expressions_have_none():
    assert [value_of(text) for text in ('"a"', "5", "true", "null", "", "x + 1")] == ["a", "5", "True", "", "", None]
    assert string_of(r'"\u00e9\\n"') == r"é\n"


def _unsayable(table: Table) -> Iterator[tuple[int, str, str]]:
    """The cells that no unary test can say, each to be Any instead."""
    for column in table.conditions:
        for row in range(table.n_rows):
            if unary_tests(column.cell(row), column.condition.domain) is None:
                yield row, column.condition.name, "Any"


@given(table=tables(kinds=tuple(kind for kind in KINDS if kind != "tags")))
def test_cells_that_dmn_can_say_come_back_as_the_same_cells(table: Table):
    table = table.with_cells([*_unsayable(table), *((row, "Enabled", "True") for row in np.flatnonzero(~table.enabled).tolist())])
    raw, remarks = write(table, FORMATS["dmn"])
    ElementTree.fromstring(raw)
    assert not [remark for remark in remarks if remark.is_loss]
    reading = read(raw, "x.dmn")
    again, _ = table_of(reading, propose(reading, table.schema, TableSettings("table")), table.schema, TableSettings("table"))
    assert again.assets == table.assets
    for column in table.conditions:
        other = again.condition(column.condition.name)
        assert [other.cell(row) for row in range(table.n_rows)] == [column.cell(row) for row in range(table.n_rows)]


def test_what_cannot_be_said_in_dmn_is_listed_with_its_place():
    columns = {
        "Asset": ["jog", "run", "off", "never"],
        "speed": ["5 ~2", "6", "7", "5..3"],
        "tags": ["+A", "-B", "Any", "Any"],
        "Enabled": ["True", "True", "False", "True"],
    }
    table = Table.from_columns(columns, settings=TableSettings("t", enabled="Enabled", fallback="jog"))
    raw, remarks = write(table, FORMATS["dmn"])
    said = "\n".join(map(str, remarks))
    assert 'row 1, "jog", column "speed": "5 ~2" becomes -: DMN has no penalties.' in said
    assert 'row 3, "off": left out: it is disabled.' in said
    assert 'row 4, "never": left out: its cell of "speed" accepts nothing.' in said
    assert 'column "tags": tags become an annotation' in said
    assert texts(read(raw, "x.dmn"))["tags"] == ["+A", "-B"]


def test_an_entry_that_no_cell_can_say_is_told_and_becomes_no_other_meaning():
    reading = dishes(old="&lt;= 8", new="maximum(guests)")
    assert texts(reading)["guests"][0] == "= maximum(guests)"
    assert 'rule 1, column "guests": "maximum(guests)" is not a test that a cell or a rule can express' in told(reading)
    table, _ = table_of(reading, propose(reading, EMPTY, TableSettings("dish")), EMPTY, TableSettings("dish"))
    assert [fault.place.row for fault in table.faults] == [0]
    reading = dishes(old='"Roast"</text>', new="price * 2</text>")
    assert 'rule 1, column "desiredDish": "price * 2" is an expression' in told(reading)
    reading = dishes(old="<text>guests</text>", new="<text>guests * 2</text>")
    assert 'input "How many": "guests * 2" is an expression' in told(reading)
    assert "How many" in texts(reading)


def test_descriptions_of_rules_are_kept_as_data():
    reading = dishes(old="<rule><inputEntry><text>not", new="<rule><description>Less work</description><inputEntry><text>not")
    assert texts(reading)["description"] == ["", "Less work"]
    assert reading.outputs == ("price", "why", "description")


def test_types_may_have_a_prefix_and_priorities_of_further_outputs_are_told():
    reading = dishes('hitPolicy="P"', old='typeRef="boolean"', new='typeRef="feel:boolean"')
    assert reading.schema.conditions["Guest.vegetarian"].domain == BOOL
    two = dishes('hitPolicy="PRIORITY"', 'typeRef="number"/>', '><outputValues><text>"a","b"</text></outputValues></output>')
    assert "that of others is not kept" in told(two)


@pytest.mark.parametrize("date", ["20151101", "20180521", "20211108", "20230324"])
def test_later_and_earlier_versions_are_read(date: str):
    assert dishes(old=NAMESPACE, new=NAMESPACE.replace("20191111", date)).remarks == dishes().remarks


def test_a_version_that_nobody_knows_is_told():
    assert "the version of DMN is not known" in told(dishes(old="20191111", new="20990101"))


BOMB = '<!DOCTYPE x [<!ENTITY a "aaaa"><!ENTITY b "&a;&a;&a;&a;">]>'
OUTSIDE = '<!DOCTYPE x [<!ENTITY a SYSTEM "file:///etc/passwd">]>'


@pytest.mark.parametrize("start", [BOMB, OUTSIDE, "<!doctype html>"])
@pytest.mark.parametrize("encoding", ["utf-8", "utf-16"])
def test_bombs_and_external_entities_are_refused(start: str, encoding: str):
    text = DISHES.replace("{policy}", "").replace("<definitions", f"{start}<definitions", 1)
    with pytest.raises(TableError, match="declares a document type"):
        read(text.encode(encoding), "x.dmn")


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("", "not readable XML"),
        ("<definitions>", "line 1: this is not readable XML"),
        ("<html/>", "this is not DMN: its root is <html>"),
        ("<definitions/>", "the file has no decision table"),
        ("<definitions><decision><decisionTable/></decision></definitions>", "has no output"),
        ("<a>" * 20_000 + "</a>" * 20_000, "its root is <a>"),
    ],
)
def test_what_is_no_decision_table_is_refused_in_words(text: str, said: str):
    assert said in refused(text)


def test_of_several_decisions_one_is_named():
    text = DISHES.replace("{policy}", "")
    two = text.replace(
        "</definitions>", text[text.index("  <decision ") :].replace('name="dish"', 'name="drink"').replace('"Dish"', '"D2"')
    )
    assert 'the file has 2 decision tables: "dish", "drink".' in refused(two)
    assert read(two.encode(), "x.dmn", ReadOptions(sheet="drink")).schema.tables.keys() == {"drink"}
    assert 'Did you mean "drink"?' in refused(two, "drinks")
