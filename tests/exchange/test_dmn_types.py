"""Types, defaults and every hit policy of DMN files: what they say of an input's values is kept, or told with its place."""

import math
from dataclasses import replace
from itertools import product
from xml.sax.saxutils import escape

import pytest
from strategies import for_each

from contextdb.cells.conditions import Condition
from contextdb.cells.domains import ANGLE, BOOL, INT, NUMBER, TEXT, Domain
from contextdb.cells.grammar import parse_cell
from contextdb.exchange.dmn_read import read_dmn
from contextdb.exchange.feel import string_of
from contextdb.exchange.formats import FORMATS, read, write
from contextdb.exchange.reading import Reading
from contextdb.schema.settings import EMPTY, TableSettings
from contextdb.tables.table import Table

NAMESPACES = [
    "http://www.omg.org/spec/DMN/20151101/dmn.xsd",
    "http://www.omg.org/spec/DMN/20180521/MODEL/",
    "https://www.omg.org/spec/DMN/20191111/MODEL/",
    "https://www.omg.org/spec/DMN/20211108/MODEL/",
    "https://www.omg.org/spec/DMN/20230324/MODEL/",
]

ONE_OUTPUT = '<output name="asset" typeRef="string"/>'

TESTS = {
    "boolean": {"true": "True", "false": "False", "True": "True", "FALSE": "False", "-": "-", "": "-", "not(true)": "not True"},
    "number": {
        "5": "5",
        "-2.5": "-2.5",
        "< 5": "<5",
        "<=5": "<=5",
        "> 5": ">5",
        ">= 5": ">=5",
        "[1..5]": "1..5",
        "(1..5)": "(1..5)",
        "]1..5[": "(1..5)",
        "[1..5)": "[1..5)",
        "(1..5]": "(1..5]",
        "1,2,[5..7]": "1 | 2 | 5..7",
        "not(5)": "not 5",
        "not([1..5],9)": "not 1..5 | 9",
        "? >= 5": ">=5",
    },
    "string": {
        '"CB"': "CB",
        '"CB","FS"': "CB FS",
        '"Half Back"': '"Half Back"',
        'not("CB","FS")': "not CB FS",
        '"say \\"no\\""': '"say ""no"""',
        '"5"': '"5"',
    },
}
UNSAYABLE = [
    'time("10:00:00")',
    "speed",
    "> speed",
    "[a..b]",
    "5 + 1",
    "null",
    "inf",
    "< inf",
    'contains(?, "a")',
    "not(-)",
    '"a" "b"',
]


def document(
    inputs: str, rules: str, before: str = "", table: str = "", namespace: str = NAMESPACES[2], outputs: str = ONE_OUTPUT
) -> bytes:
    return (
        f'<?xml version="1.0" encoding="UTF-8"?><definitions xmlns="{namespace}" name="d">{before}'
        f'<decision id="moves" name="Moves"><decisionTable {table}>'
        f"{inputs}{outputs}{rules}</decisionTable></decision></definitions>"
    ).encode()


def with_input(kind: str, *tests: str, before: str = "", allowed: str = "", table: str = "") -> Reading:
    values = f"<inputValues><text>{escape(allowed)}</text></inputValues>" if allowed else ""
    reference = f' typeRef="{kind}"' if kind else ""
    inputs = f"<input><inputExpression{reference}><text>fact</text></inputExpression>{values}</input>"
    rules = "".join(
        f'<rule><inputEntry><text>{escape(t)}</text></inputEntry><outputEntry><text>"a{i}"</text></outputEntry></rule>'
        for i, t in enumerate(tests)
    )
    return read_dmn(document(inputs, rules, before, table), "moves.dmn")


def item(name: str, base: str, allowed: str = "", tag: str = "allowedValues") -> str:
    values = f"<{tag}><text>{escape(allowed)}</text></{tag}>" if allowed else ""
    return f'<itemDefinition name="{name}"><typeRef>{base}</typeRef>{values}</itemDefinition>'


def domain(reading: Reading) -> Domain | None:
    assert reading.schema is not None
    found = reading.schema.conditions.get("fact")
    return found.domain if found else None


def losses(reading: Reading) -> list[str]:
    return [str(remark) for remark in reading.remarks if remark.is_loss]


@for_each([(k, t, c) for k, tests in TESTS.items() for t, c in tests.items()])
def test_a_test_of_each_kind_becomes_its_cell_without_a_loss(kind: str, test: str, cell: str):
    reading = with_input(kind, test)
    assert reading.columns[1].to_list() == [cell]
    assert losses(reading) == []


@pytest.mark.parametrize("test", UNSAYABLE)
def test_a_test_that_no_cell_can_say_is_kept_as_it_stands_and_told_with_its_rule(test: str):
    reading = with_input("", '"CB"', test)
    assert reading.columns[1].to_list() == ["CB", f"= {test}"]
    (loss,) = losses(reading)
    assert loss.startswith('rule 2, column "fact": ')


POLICIES = {
    "UNIQUE": ("unique", False),
    "FIRST": ("first", False),
    "PRIORITY": ("priority", False),
    "ANY": ("collect", False),
    "COLLECT": ("collect", False),
    "RULE ORDER": ("collect", True),
    "OUTPUT ORDER": ("collect", True),
}


@for_each(list(product(POLICIES, NAMESPACES)))
def test_every_hit_policy_of_every_version_is_kept_or_told(said: str, namespace: str):
    raw = document("", "", table=f'hitPolicy="{said}"', namespace=namespace)
    reading = read_dmn(raw, "moves.dmn")
    policy, is_lost = POLICIES[said]
    assert reading.schema is not None
    assert reading.schema.tables["Moves"].policy == policy
    assert [said in loss for loss in losses(reading)] == [True] * is_lost


@pytest.mark.parametrize("aggregation", ["SUM", "MIN", "MAX", "COUNT"])
def test_aggregations_are_told(aggregation: str):
    (loss,) = losses(with_input("number", "1", table=f'hitPolicy="COLLECT" aggregation="{aggregation}"'))
    assert aggregation in loss


def test_an_item_definition_with_allowed_values_is_an_enum():
    reading = with_input("tRole", '"CB"', before=item("tRole", "string", '"CB", "FS","Half Back"'))
    assert domain(reading) == Domain("enum", ("CB", "FS", "Half Back"))
    assert losses(reading) == []


@pytest.mark.parametrize("tag", ["allowedValues", "typeConstraint"])
def test_an_item_definition_may_stand_for_another_and_its_own_values_come_first(tag: str):
    before = item("tShort", "tRole", '"CB"', tag) + item("tRole", "string", '"CB","FS"', tag)
    assert domain(with_input("tShort", "-", before=before)) == Domain("enum", ("CB",))


def test_item_definitions_in_a_circle_come_to_an_end():
    assert domain(with_input("a", '"CB"', before=item("a", "b") + item("b", "a"))) is None


def test_the_values_of_an_input_go_before_those_of_its_type():
    reading = with_input("tRole", "-", before=item("tRole", "string", '"CB","FS"'), allowed='"FS"')
    assert domain(reading) == Domain("enum", ("FS",))


@pytest.mark.parametrize(
    ("base", "allowed", "expected"),
    [
        ("number", "[0..10]", Domain("number", None, 0.0, 10.0)),
        ("number", ">= 0", Domain("number", None, 0.0)),
        ("number", "<= 9.5", Domain("number", None, -math.inf, 9.5)),
        ("integer", "[ 1 .. 11 ]", Domain("int", None, 1.0, 11.0)),
        ("long", "", INT),
        ("boolean", "true,false", BOOL),
    ],
)
def test_allowed_values_of_numbers_are_bounds(base: str, allowed: str, expected: Domain):
    reading = with_input("t", "-", before=item("t", base, allowed))
    assert domain(reading) == expected
    assert losses(reading) == []


@pytest.mark.parametrize(
    ("base", "allowed"), [("number", "(0..10)"), ("number", "1,2,3"), ("integer", "[0.5..2]"), ("number", "[5..5]")]
)
def test_allowed_values_that_no_domain_can_say_are_told(base: str, allowed: str):
    (loss,) = losses(with_input("t", "-", before=item("t", base, allowed)))
    assert loss == f'input "fact": the allowed values "{allowed}" are not kept.'


def test_an_input_without_a_type_has_that_of_the_datum_it_names():
    datum = '<inputData name="fact"><variable name="fact" typeRef="feel:number"/></inputData>'
    assert domain(with_input("", "-", before=datum)) == NUMBER


def test_a_part_of_a_structure_has_its_own_type():
    parts = (
        '<itemDefinition name="tActor"><itemComponent name="role"><typeRef>string</typeRef><allowedValues>'
        '<text>"CB","FS"</text></allowedValues></itemComponent></itemDefinition>'
        '<inputData name="Defender"><variable name="Defender" typeRef="tActor"/></inputData>'
    )
    inputs = "<input><inputExpression><text>Defender.role</text></inputExpression></input>"
    reading = read_dmn(document(inputs, "", parts), "moves.dmn")
    assert reading.schema is not None
    assert reading.schema.conditions["Defender.role"].domain == Domain("enum", ("CB", "FS"))


def test_strings_that_look_like_truths_stay_texts():
    reading = with_input("string", '"True"', '"False","x"')
    assert domain(reading) == TEXT
    assert reading.columns[1].to_list() == ["True", "False x"]


def test_the_default_outputs_are_the_fallback():
    outputs = (
        '<output name="asset"><defaultOutputEntry><text>"MidAir_Default"</text></defaultOutputEntry></output>'
        '<output name="slots"><defaultOutputEntry><text>"Ball"</text></defaultOutputEntry></output>'
    )
    reading = read_dmn(document("", "", outputs=outputs), "moves.dmn")
    assert reading.schema is not None
    assert reading.schema.tables["Moves"].fallback == "MidAir_Default"
    assert reading.schema.tables["Moves"].fallback_outputs == (("slots", "Ball"),)
    assert not losses(reading)


def test_a_default_of_an_output_without_one_of_the_asset_is_told():
    outputs = '<output name="asset"/><output name="slots"><defaultOutputEntry><text>"Ball"</text></defaultOutputEntry></output>'
    (loss,) = losses(read_dmn(document("", "", outputs=outputs), "moves.dmn"))
    assert loss == 'output "slots": the default \'"Ball"\' is not kept.'


def test_an_input_that_another_decision_gives_is_told():
    other = '<decision id="o" name="Gait"><variable name="fact"/></decision>'
    (loss,) = losses(with_input("string", '"Run"', before=other))
    assert loss.startswith('input "fact": another decision')


def test_a_note_on_an_entry_is_told():
    entry = "<inputEntry><description>why</description><text>1</text></inputEntry>"
    rule = f"<rule>{entry}<outputEntry><text>1</text></outputEntry></rule>"
    (loss,) = losses(read_dmn(document("<input label='x'/>", rule), "moves.dmn"))
    assert loss == 'rule 1: the note "why" on an entry is not kept.'


def test_a_table_in_a_business_knowledge_model_is_found():
    raw = document("", "").replace(b"<decision ", b"<businessKnowledgeModel ").replace(b"</decision>", b"</businessKnowledgeModel>")
    assert read_dmn(raw, "moves.dmn", "Moves").names == ["asset"]


@pytest.mark.parametrize(
    ("literal", "text"), [('"\\u00e4"', "ä"), ('"\\uD83D\\uDE00"', "😀"), ('"\\U01F600"', "😀"), ('"\\uD83D"', "�")]
)
def test_escapes_are_characters_that_a_file_can_hold(literal: str, text: str):
    assert string_of(literal) == text
    assert text.encode()


@pytest.mark.parametrize(
    ("kind", "cells"),
    [
        (BOOL, ["True", "False", "Any", "not True"]),
        (Domain("int", None, 0.0, 10.0), ["5", "1..4", "not 5", "<=3", ">3", "1 | 3", "4, 2"]),
        (NUMBER, ["5", "(1..5]", "..3", "(2..", "20, 9.99", "not 1..2", "1 | 3..4"]),
        (ANGLE, ["170, 20", "170..-170", "-90..90", "not 0..10"]),
        (Domain("enum", ("CB", "FS", "Half Back")), ["CB", 'CB "Half Back"', "not CB", "Any"]),
        (TEXT, ["CB", '"a ""b"" c" x', "not CB", '"5"', "True"]),
    ],
    ids=["bool", "int", "number", "angle", "enum", "text"],
)
def test_cells_of_each_type_come_back_through_a_file_with_the_same_meaning(kind: Domain, cells: list[str]):
    schema = replace(EMPTY, conditions={"fact": Condition("fact", kind)})
    table = Table.from_columns({"asset": [f"a{i}" for i in range(len(cells))], "fact": cells}, schema)
    raw, _ = write(table, FORMATS["dmn"])
    again = read(raw, "t.dmn")
    assert domain(again) == {"angle": NUMBER, "int": replace(kind, kind="number")}.get(kind.kind, kind)
    found = [parse_cell(text, kind) for text in again.columns[1].to_list()]
    assert found == list(table.condition("fact").cells)


def test_bounds_and_the_fallback_come_back_through_a_file():
    conditions = {
        name: Condition(name, Domain("number", None, low, high))
        for name, low, high in [
            ("both", -1.5, 10.0),
            ("least", 0.0, math.inf),
            ("most", -math.inf, 1e20),
            ("none", -math.inf, math.inf),
        ]
    }
    columns = {"asset": ["a"], **{name: ["5"] for name in conditions}}
    table = Table.from_columns(columns, replace(EMPTY, conditions=conditions), TableSettings("table", fallback='the "last"'))
    again = read(write(table, FORMATS["dmn"])[0], "t.dmn")
    assert again.schema is not None
    assert again.schema.conditions == conditions
    assert again.schema.tables["table"].fallback == 'the "last"'
