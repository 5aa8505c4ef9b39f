"""contextdb.toml: what is read from it, and how each fault is said."""

from __future__ import annotations

import json
import math
import pickle

import oracles
import pytest
from hypothesis import given
from hypothesis import strategies as st

from contextdb.cells.conditions import Condition
from contextdb.cells.domains import Domain
from contextdb.cells.kinds import KINDS
from contextdb.errors import Fault, SchemaError
from contextdb.expressions.tokens import written_text
from contextdb.schema.sections import condition_to_dict
from contextdb.schema.settings import EMPTY, Schema, TableSettings, conditions_from_dict, derivation_of, read_schema
from contextdb.schema.toml_lines import key_lines

FULL = """
[project]
name = "gridiron"

[conditions.IsInMidAirAnim]
type = "bool"

[conditions.heading]
type = "angle"
description = "From the tackler to the target"

[conditions.speed]
type = "number"
min = 0
max = 10.5
unit = "m/s"

[conditions."Defender.Tags"]
type = "tags"
values = ["InAir", "Stunned"]

[conditions.target_speed]
type = "number"
unit = "m/s"

[conditions.closing_speed]
type = "number"
max = inf
expr = "speed - target_speed"

[tables.hit]
file = "sub/hit.parquet"
asset = "Asset Name"
outputs = ["Mandatory_Slots"]
enabled = "Enabled"
priority = "Priority"
weight = "Weight"
fallback = "MidAir_Default"
policy = "first"
assume = ["not (IsInMidAirAnim and IsInCatchAnim)"]

[tables.plain]

[blueprints.tackle]
conditions = ["IsInMidAirAnim", "Defender.Tags"]

[features.loco]
rate = 30.0
channels = [{ type = "position", bone = "LeftFoot" }]

[databases.jog]
table = "hit"

[selectors.loco]
order = [{ database = "jog" }]

[controllers.player]
selector = "loco"

[output.player]
root = "code"
"""


def faults(text: str) -> list[str]:
    with pytest.raises(SchemaError) as caught:
        read_schema(text, "contextdb.toml")
    return str(caught.value).split("\n")


def fault(text: str) -> str:
    (only,) = faults(text)
    return only


def test_a_whole_file_is_read_as_it_says():
    schema = read_schema(FULL, "contextdb.toml")
    assert schema.name == "gridiron"
    assert schema.file == "contextdb.toml"
    assert schema.conditions == {
        "IsInMidAirAnim": Condition("IsInMidAirAnim", Domain("bool")),
        "heading": Condition("heading", Domain("angle"), description="From the tackler to the target"),
        "speed": Condition("speed", Domain("number", None, 0.0, 10.5), unit="m/s"),
        "Defender.Tags": Condition("Defender.Tags", Domain("tags", ("InAir", "Stunned"))),
        "target_speed": Condition("target_speed", Domain("number"), unit="m/s"),
        "closing_speed": Condition("closing_speed", Domain("number"), expr="speed - target_speed"),
    }
    assert schema.tables == {
        "hit": TableSettings(
            "hit",
            file="sub/hit.parquet",
            asset="Asset Name",
            outputs=("Mandatory_Slots",),
            enabled="Enabled",
            priority="Priority",
            weight="Weight",
            fallback="MidAir_Default",
            policy="first",
            assume=("not (IsInMidAirAnim and IsInCatchAnim)",),
        ),
        "plain": TableSettings("plain"),
    }
    assert schema.blueprints == {"tackle": ("IsInMidAirAnim", "Defender.Tags")}
    assert schema.features == {"loco": {"rate": 30.0, "channels": [{"type": "position", "bone": "LeftFoot"}]}}
    assert schema.databases == {"jog": {"table": "hit"}}
    assert schema.selectors == {"loco": {"order": [{"database": "jog"}]}}
    assert schema.controllers == {"player": {"selector": "loco"}}
    assert schema.output == {"player": {"root": "code"}}
    sections = ("features", "databases", "selectors", "controllers", "output")
    assert schema.motion == {name: getattr(schema, name) for name in sections}


@pytest.mark.parametrize("text", ["", "# nothing\n", "\ufeff", "[conditions]\n[tables]\n"])
def test_a_file_that_declares_nothing_is_an_empty_schema(text: str):
    assert read_schema(text, "contextdb.toml") == Schema(file="contextdb.toml")


def test_a_byte_order_mark_and_windows_line_ends_change_nothing():
    assert read_schema("\ufeff" + FULL.replace("\n", "\r\n"), "contextdb.toml") == read_schema(FULL, "contextdb.toml")


def test_a_schema_can_be_pickled_for_other_processes():
    schema = read_schema(FULL, "contextdb.toml")
    assert derivation_of(schema, schema.conditions) is not None
    assert pickle.loads(pickle.dumps(schema)) == schema


def test_a_table_is_found_by_its_file():
    schema = read_schema(FULL, "contextdb.toml")
    assert schema.settings_for("sub/hit.parquet").name == "hit"
    assert schema.settings_for("plain.csv").name == "plain"
    assert schema.settings_for("plain.parquet").name == "plain"
    assert schema.settings_for("other/plain.csv") == TableSettings("plain")
    assert schema.settings_for("hit.csv") == TableSettings("hit")
    assert read_schema("[tables.a]\nfile = './b//c.csv'", "contextdb.toml").tables["a"].files == ("b/c.csv",)
    assert EMPTY.settings_for("hit.csv") == TableSettings("hit")


# ---- faults of one value: section and line, what was found, what is accepted, and the mend


# ---- schemas given in Python


def test_conditions_given_in_python_are_checked_as_those_of_a_file():
    given_in_python = {"speed": {"type": "number", "min": 0}, "position": {"type": "enum", "values": ("CB", "FS")}}
    assert conditions_from_dict(given_in_python) == {
        "speed": Condition("speed", Domain("number", None, 0.0)),
        "position": Condition("position", Domain("enum", ("CB", "FS"))),
    }


# ---- properties

TEXTS = st.text(st.characters(exclude_categories=("Cs", "Cc")), max_size=8)
WORDS = TEXTS.map(str.strip).filter(bool)
WORD_LISTS = st.lists(WORDS, unique=True, max_size=4)
FINITE = st.floats(allow_nan=False, allow_infinity=False)


ASSUMED = st.lists(st.sampled_from(["True", "not `of no table`", "1 < 2"]), unique=True)
CONSTANTS = {"bool": "1 < 2", "int": "2 ** 3", "number": "0.5", "angle": "wrap_angle(270)", "date": 'date("2026-01-31")'}


@st.composite
def condition_sections(draw: st.DrawFn) -> dict[str, object]:
    kind = draw(st.sampled_from(list(KINDS)))
    section: dict[str, object] = {"type": kind, "description": draw(TEXTS), "unit": draw(TEXTS)}
    if kind in ("int", "number"):
        numbers = st.integers(-(2**53), 2**53) if kind == "int" else FINITE
        section["min"], section["max"] = sorted((draw(numbers), draw(numbers)))
    elif kind == "date":
        section["min"], section["max"] = sorted((draw(st.dates()).isoformat(), draw(st.dates()).isoformat()))
    elif kind in ("enum", "tags"):
        section["values"] = draw(WORD_LISTS.filter(bool))
    if kind != "tags" and draw(st.booleans()):
        section["expr"] = CONSTANTS.get(kind) or written_text(draw(st.sampled_from(section.get("values", ["any text"]))))
    return section


@st.composite
def documents(draw: st.DrawFn) -> dict[str, dict[str, dict[str, object]]]:
    conditions = draw(st.dictionaries(WORDS, condition_sections(), max_size=5))
    columns = draw(st.lists(WORDS.filter(lambda w: w not in conditions), unique=True, min_size=4, max_size=7))
    table = {"asset": columns[0], "enabled": columns[1], "priority": columns[2], "weight": columns[3], "outputs": columns[4:]}
    table |= {"file": draw(st.sampled_from(["a.csv", "b/c.parquet"])), "fallback": draw(WORDS), "assume": draw(ASSUMED)}
    table["policy"] = draw(st.sampled_from(["collect", "first", "unique", "priority"]))
    names = st.lists(st.sampled_from(sorted(conditions)), unique=True) if conditions else st.just([])
    return {"conditions": conditions, "tables": {draw(WORDS): table}, "blueprints": {draw(WORDS): {"conditions": draw(names)}}}


def toml_value(value: object) -> str:
    if isinstance(value, list) and value:
        return "[  # ]\n  " + ",\n  ".join(map(toml_value, value)) + ",\n]"
    return repr(value) if isinstance(value, float) else json.dumps(value, ensure_ascii=False)


@given(documents(), st.data())
def test_a_schema_reads_back_as_it_was_written_and_each_key_has_its_line(document, data):
    noise = st.sampled_from([[], [""], ["# [conditions.x]"], ["  # a = '"]])
    lines: list[str] = []
    stands: dict[tuple[str, ...], int] = {}
    for section, parts in document.items():
        for name, part in parts.items():
            lines += [*data.draw(noise), f"[{section}.{json.dumps(name, ensure_ascii=False)}]  # ]"]
            stands[section, name] = len(lines)
            for key, value in part.items():
                lines += [*data.draw(noise), f"{key} = {toml_value(value)}"]
                stands[section, name, key] = len(lines)
                lines = "\n".join(lines).split("\n")
    text = "\n".join(lines)
    schema = read_schema(text, "f.toml")
    assert schema.conditions == conditions_from_dict(document["conditions"])
    for name, condition in schema.conditions.items():
        assert_says(condition, document["conditions"][name])
    for name, settings in schema.tables.items():
        assert {key: as_list(getattr(settings, key)) for key in document["tables"][name]} == document["tables"][name]
    assert {name: {"conditions": list(names)} for name, names in schema.blueprints.items()} == document["blueprints"]
    found = key_lines(text)
    assert {path: found[path] for path in stands} == stands


def as_list(value: object) -> object:
    return list(value) if isinstance(value, tuple) else value


def assert_says(condition: Condition, section: dict[str, object]) -> None:
    domain = condition.domain
    assert domain.kind == section["type"]
    ends = (section.get("min", -math.inf), section.get("max", math.inf))
    assert (domain.minimum, domain.maximum) == tuple(float(oracles.with_days(str(end))) for end in ends)
    assert as_list(domain.values) == section.get("values")
    assert (condition.unit, condition.description, condition.expr) == (section["unit"], section["description"], section.get("expr"))
    assert condition.is_declared


def faults_of(text: str) -> tuple[Fault, ...]:
    """Why the text is refused; nothing for a schema."""
    try:
        assert isinstance(read_schema(text, "contextdb.toml"), Schema)
    except SchemaError as error:
        return error.faults
    return ()


HEADERS = ["[conditions.x]", "[tables.x]", "[blueprints.b]", "[project]", "[[features]]", "[condition.'a.b']", "[tables]"]
KEYS = ["type", "min", "max", "values", "unit", "expr", "tpye", "file", "asset", "outputs", "policy", "assume", "conditions"]
VALUES = [
    *("'number'", "'int'", "'enum'", "'flaot'", "'a.csv'", "'../a.csv'", "'a'", "''", "' '", '"\\u0000"', "[\n'#', # ]\n]"),
    *("0", "-0.5", "nan", "inf", "true", "1979-05-27", "[]", "['a', 'a']", "['a', 'b']", "[1]", "[[1]]", "{}", "{ a.b = 1 }"),
]
SIGNS = [
    *(" = ", "=", ".", ",", "#", " ", "é"),
    *("'", '"', "[", "]", "{", "'''\na", "'''''", '"""\\"""""', "\u2028", "\r", "\x00"),
]


@given(st.one_of(st.text(), st.lists(st.sampled_from([*HEADERS, *KEYS, *VALUES, *SIGNS, *("\n" * 20)]), max_size=25).map("".join)))
def test_any_text_is_a_schema_or_refused_with_faults_of_one_line(text: str):
    for fault in faults_of(text):
        assert fault.found
        assert fault.place.file == "contextdb.toml"
        assert str(fault).isprintable()


PARTS = st.sampled_from(["conditions.a", "conditions.'b.c'", "tables.t", "tables.a", "blueprints.b", "project"])
STATEMENTS = st.dictionaries(st.sampled_from(KEYS), st.sampled_from(VALUES), max_size=6)


@given(st.dictionaries(PARTS, STATEMENTS))
def test_any_mix_of_keys_and_values_is_a_schema_or_refused_with_the_line_of_each_fault(sections: dict[str, dict[str, str]]):
    lines: list[str] = []
    for name, part in sections.items():
        lines += [f"[{name}]", *(line for key, value in part.items() for line in f"{key} = {value}".split("\n"))]
    for fault in faults_of("\n".join(lines)):
        assert fault.place.line is not None
        assert lines[fault.place.line - 1].startswith(("[", *KEYS))


SIDES = 'values = ["Left", "Right", "Both"]'
LONE = """contextdb.toml, line 3: [conditions."LeftFoot.Down"] mirror = { Left = "Right" }: "RightFoot.Down", with which it \
changes places, does not change places with it. Accepted: a condition of type bool with the same mirror. Did you mean \
[conditions."RightFoot.Down"] with mirror = { Left = "Right" }?"""


@pytest.mark.parametrize("other", ["", "type = 'bool'", "type = 'number'\nmirror = { Left = 'Right' }"])
def test_a_condition_changes_places_only_with_one_of_its_type_that_changes_places_with_it(other: str):
    text = "[conditions.'LeftFoot.Down']\ntype = 'bool'\nmirror = { Left = 'Right' }\n"
    found = faults_of(text + (f"[conditions.'RightFoot.Down']\n{other}" if other else ""))
    assert str(found[0]) == LONE
    assert not faults_of(text + "[conditions.'RightFoot.Down']\ntype = 'bool'\nmirror = { Right = 'Left' }")


@pytest.mark.parametrize(
    ("kind", "mirror", "read"),
    [
        ("angle", '"negate"', "negate"),
        ("angle", '"none"', "none"),
        ("bool", '"negate"', "negate"),
        ("text", '{ Left = "Right", "far left" = "far right" }', (("Left", "Right"), ("far left", "far right"))),
        ("tags", '{ Left = "Right" }', (("Left", "Right"),)),
        ("enum", '{ Left = "Right", Right = "Left" }', (("Left", "Right"), ("Right", "Left"))),
    ],
)
def test_a_mirror_is_read_and_said_again_as_it_stands(kind: str, mirror: str, read: object):
    values = SIDES if kind == "enum" else ""
    condition = read_schema(f"[conditions.side]\ntype = '{kind}'\nmirror = {mirror}\n{values}", "t").conditions["side"]
    assert condition.mirror == read
    said = condition_to_dict(condition)
    assert conditions_from_dict({"side": said})["side"] == condition
