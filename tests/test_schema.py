"""contextdb.toml: what is read from it, and how each fault is said."""

from __future__ import annotations

import json
import math
import pickle

import oracles
import pytest
from hypothesis import given
from hypothesis import strategies as st
from strategies import for_each

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

KINDS_SAID = '"bool", "int", "number", "angle", "date", "enum", "text", "tags"'
NAMES_SAID = 'a list of different names, such as ["A", "B"]'
FILE_SAID = "a .csv or .parquet file in the folder of contextdb.toml or below it"
A_NUMBER = "a number, such as -1.5"


@pytest.mark.parametrize(
    ("line", "message"),
    [
        ("min = '0'", f'min = "0": this is text, not a number. Accepted: {A_NUMBER}. Did you mean min = 0?'),
        ("max = 2020-01-01", f"max = 2020-01-01: this is a date, not a number. Accepted: {A_NUMBER}."),
        (
            "max = 9007199254740993",
            f"max = 9007199254740993: no double is equal to it; the nearest is 9007199254740992.0. Accepted: {A_NUMBER}.",
        ),
        ("min = inf", "min = inf leaves no number. Accepted: a finite number. Try to leave it out."),
        ("max = -inf", "max = -inf leaves no number. Accepted: a finite number. Try to leave it out."),
        ("unit = 5", 'unit = 5: this is a number, not text. Accepted: text, such as "m/s". Did you mean unit = "5"?'),
        ("expr = 5", 'expr = 5: this is a number, not text. Accepted: an expression as text, such as "speed - target_speed". '
                     'Did you mean expr = "5"?'),
        ("values = ['A']", 'values = ["A"] has no place here: a number is declared by min and max. '
                           'Accepted: values in a condition of type enum or tags. Did you mean type = "enum"?'),
    ],
)  # fmt: skip
def test_a_wrong_value_in_a_number_condition_is_said(line: str, message: str):
    assert fault(f"[conditions.speed]\ntype = 'number'\n{line}") == f"contextdb.toml, line 3: [conditions.speed] {message}"


@pytest.mark.parametrize(
    ("line", "message"),
    [
        ("values = 'A B'", f'values = "A B": this is text, not a list. Accepted: {NAMES_SAID}. Did you mean values = ["A", "B"]?'),
        ("values = []", f"values = []: the list is empty. Accepted: {NAMES_SAID}."),
        ("values = ['A', 'B', 'A']", f'values = ["A", "B", "A"]: "A" appears twice. Accepted: {NAMES_SAID}. '
                                     'Did you mean values = ["A", "B"]?'),
        ("values = ['A', 2]", 'values = ["A", 2]: entry 2 cannot be used: this is a number, not text. '
                              f'Accepted: {NAMES_SAID}. Did you mean values = ["A", "2"]?'),
        ("values = ['A', '']", 'values = ["A", ""]: entry 2 cannot be used: this is empty. '
                               f'Accepted: {NAMES_SAID}. Did you mean values = ["A"]?'),
        ("values = ['A ']", 'values = ["A "]: entry 1 cannot be used: a space is before or after it. '
                            f'Accepted: {NAMES_SAID}. Did you mean values = ["A"]?'),
    ],
)  # fmt: skip
def test_a_wrong_list_of_values_is_said(line: str, message: str):
    assert fault(f"[conditions.position]\ntype = 'enum'\n{line}") == f"contextdb.toml, line 3: [conditions.position] {message}"


@pytest.mark.parametrize(
    ("found", "mend"),
    [
        ("float", "number"), ("boolean", "bool"), ("string", "text"), ("integer", "int"), ("degrees", "angle"), ("Bool", "bool"),
        ("choice", "enum"), ("nubmer", "number"), ("tag", "tags"),
    ],
)  # fmt: skip
def test_a_type_of_another_language_is_mended(found: str, mend: str):
    assert fault(f"[conditions.x]\ntype = '{found}'\n") == (
        f'contextdb.toml, line 2: [conditions.x] type = "{found}": there is no such type. Accepted: {KINDS_SAID}. '
        f'Did you mean type = "{mend}"?'
    )


@pytest.mark.parametrize(
    ("section", "message"),
    [
        (
            "type = 'number'\nmin = 5\nmax = 1",
            "line 3: [conditions.x] min = 5 is above max = 1. Accepted: a min that is not above max. "
            "Did you mean min = 1 and max = 5?",
        ),
        (
            "type = 'int'\nmax = 2.5",
            "line 3: [conditions.x] max = 2.5: an int has whole bounds. Accepted: a whole number. Did you mean max = 2?",
        ),
        (
            "type = 'int'\nmin = 2.5",
            "line 3: [conditions.x] min = 2.5: an int has whole bounds. Accepted: a whole number. Did you mean min = 3?",
        ),
        (
            "type = 'angle'\nmin = -180",
            "line 3: [conditions.x] min = -180 has no place here: an angle wraps around, so it has no ends and no list. "
            "Accepted: min in a condition of type int or number or date. Try to leave it out.",
        ),
        (
            "type = 'enum'\nmax = 3\nvalues = ['A']",
            "line 3: [conditions.x] max = 3 has no place here: names have no order. "
            "Accepted: max in a condition of type int or number or date. Try to leave it out.",
        ),
        (
            "type = 'text'\nvalues = ['A']",
            'line 3: [conditions.x] values = ["A"] has no place here: a text can be anything. '
            'Accepted: values in a condition of type enum or tags. Did you mean type = "enum"?',
        ),
        (
            "type = 'enum'",
            'line 1: [conditions.x] is an enum without values. Accepted: values = ["A", "B"]. '
            'Did you mean type = "text", whose values are not declared?',
        ),
        ("unit = 'm'", f"line 1: [conditions.x] has no type. Accepted: {KINDS_SAID}."),
        ("min = 1", f'line 1: [conditions.x] has no type. Accepted: {KINDS_SAID}. Did you mean type = "number"?'),
        (
            "tpye = 'bool'",
            'line 2: [conditions.x] has no key "tpye". '
            'Accepted: "type", "min", "max", "values", "unit", "description", "expr", '
            '"mirror", "weight", "hysteresis", "owner". Did you mean "type"?',
        ),
        (
            "type = 'enum'\noptions = ['A']",
            'line 3: [conditions.x] has no key "options". '
            'Accepted: "type", "min", "max", "values", "unit", "description", "expr", '
            '"mirror", "weight", "hysteresis", "owner". Did you mean "values"?',
        ),
    ],
)
def test_keys_of_a_condition_that_do_not_go_together_are_said(section: str, message: str):
    assert fault(f"[conditions.x]\n{section}") == f"contextdb.toml, {message}"


@pytest.mark.parametrize(
    ("line", "message"),
    [
        (
            "outputs = 'x'",
            f'outputs = "x": this is text, not a list. Accepted: {NAMES_SAID}, or typed outputs, such as '
            '{ damage = { type = "number" } }. Did you mean outputs = ["x"]?',
        ),
        (
            "policy = 'frist'",
            'policy = "frist": there is no such policy. '
            'Accepted: "collect", "first", "unique", "priority", "specific", "cheapest". Did you mean policy = "first"?',
        ),
        (
            "assume = 'not a'",
            'assume = "not a": this is text, not a list. Accepted: a list of expressions, such as ["not (IsRunning and IsIdle)"]. '
            'Did you mean assume = ["not a"]?',
        ),
        ("file = '/data/a.csv'", f'file = "/data/a.csv": it names a place on one machine. Accepted: {FILE_SAID}. '
                                 'Did you mean file = "a.csv"?'),
        ("file = 'C:/a.csv'", f'file = "C:/a.csv": it names a place on one machine. Accepted: {FILE_SAID}. '
                              'Did you mean file = "a.csv"?'),
        ("file = '../a.csv'", f'file = "../a.csv": it leaves the folder of contextdb.toml. Accepted: {FILE_SAID}. '
                              'Did you mean file = "a.csv"?'),
        ("file = 'b/../../a.csv'", f'file = "b/../../a.csv": it leaves the folder of contextdb.toml. Accepted: {FILE_SAID}. '
                                   'Did you mean file = "b/a.csv"?'),
        ("file = 'b\\a.csv'", f'file = "b\\\\a.csv": folders are separated by "/" on every system. Accepted: {FILE_SAID}. '
                              'Did you mean file = "b/a.csv"?'),
        ("file = 'a'", f'file = "a": its ending is that of no table file. Accepted: {FILE_SAID}. Did you mean file = "a.csv"?'),
        ("file = 'a.xlsx'", f'file = "a.xlsx": its ending is that of no table file. Accepted: {FILE_SAID}.'),
        (
            "asset = 'A'\nenabled = 'A'",
            'enabled and asset both name the column "A". Accepted: one job for a column.',
        ),
        ("asset = 'A'\noutputs = ['A']", 'outputs and asset both name the column "A". Accepted: one job for a column.'),
    ],
)  # fmt: skip
def test_a_wrong_value_in_a_table_is_said(line: str, message: str):
    number = 2 + line.count("\n")
    assert fault(f"[tables.hit]\n{line}") == f"contextdb.toml, line {number}: [tables.hit] {message}"


SECTIONS_SAID = (
    "[project], [conditions.NAME], [tables.NAME], [blueprints.NAME], [contracts.NAME], [features.NAME], "
    "[databases.NAME], [selectors.NAME], [controllers.NAME], [output.NAME]"
)


@for_each(
    [
        (
            "[condition.x]\ntype = 'bool'",
            f'line 1: "condition" is not a section. Accepted: {SECTIONS_SAID}. Did you mean [conditions.x]?',
        ),
        ("[tabels.x]", f'line 1: "tabels" is not a section. Accepted: {SECTIONS_SAID}. Did you mean [tables.x]?'),
        ("[Project]\nname = ''", f'line 1: "Project" is not a section. Accepted: {SECTIONS_SAID}. Did you mean [project]?'),
        ("[qqq]", f'line 1: "qqq" is not a section. Accepted: {SECTIONS_SAID}.'),
        (
            "[roles.Prey]",
            f'line 1: "roles" is not a section. Accepted: {SECTIONS_SAID}. Did you mean [conditions."Defender.speed"]?',
        ),
        (
            "[conditions.x]\ntype = 'int'\nbounds = [0, 9]",
            'line 3: [conditions.x] has no key "bounds". Accepted: "type", "min", "max", "values", "unit", "description", "expr", '
            '"mirror", "weight", "hysteresis", "owner". Did you mean min = 0 and max = 9?',
        ),
        ("\nname = 'x'", f'line 2: "name" is not a section. Accepted: {SECTIONS_SAID}.'),
        (
            "[project]\nnmae = 'x'",
            'line 2: [project] has no key "nmae". Accepted: "name", "extends", "transitions". Did you mean "name"?',
        ),
        (
            "[project]\ntransitions = 'to_{to}'",
            'line 2: [project] transitions = "to_{to}": this is not a pattern for names of transitions. Accepted: {from} and '
            '{to}, each once, with text between them, such as "{from}_to_{to}". Did you mean transitions = "{from}_to_{to}"?',
        ),
        ("conditions = 5", "line 1: conditions = 5: this is a number, not a section. Accepted: [conditions.NAME]."),
        ("project = 'x'", 'line 1: project = "x": this is text, not a section. Accepted: [project].'),
        ("[[tables]]", "line 1: tables = [ {} ]: this is a list, not a section. Accepted: [tables.NAME]."),
        (
            "[conditions]\nspeed = 'number'",
            'line 2: [conditions] speed = "number": this is text, not a table. Accepted: [conditions.NAME]. '
            'Did you mean speed = { type = "number" }?',
        ),
        ("[features]\nrate = 30", "line 2: [features] rate = 30: this is a number, not a table. Accepted: [features.NAME]."),
        ("[databases]\njog = []", "line 2: [databases] jog = []: this is a list, not a table. Accepted: [databases.NAME]."),
        (
            "[conditions.Defender.Tags]\ntype = 'tags'",
            'line 1: [conditions.Defender] Tags = { type = "tags" }: this is a table, not a key. '
            'Accepted: a name with a dot in quotes. Did you mean [conditions."Defender.Tags"]?',
        ),
        (
            "[conditions.' x']\ntype = 'bool'",
            'line 1: [conditions." x"]: the name cannot be used: a space is before or after it. '
            "Accepted: a name without spaces around it. Did you mean [conditions.x]?",
        ),
        (
            "[conditions.'']\ntype = 'bool'",
            'line 1: [conditions.""]: the name cannot be used: this is empty. Accepted: a name without spaces around it.',
        ),
        (
            "[tables.'../x']",
            'line 1: [tables."../x"] has no file, and its name cannot be that of one: it leaves the folder of contextdb.toml. '
            'Accepted: file = "NAME.csv".',
        ),
        (
            "[tables.a]\nfile = 'x/A.csv'\n[tables.b]\nfile = './x/a.csv'",
            'line 4: [tables.b] uses the file "x/a.csv", as [tables.a] does. Accepted: one file for each table.',
        ),
        (
            "[tables.a]\n[tables.b]\nfile = 'a.csv'",
            'line 3: [tables.b] uses the file "a.csv", as [tables.a] does. Accepted: one file for each table.',
        ),
        (
            "[conditions.speed]\ntype = 'number'\n[tables.a]\noutputs = ['speed']",
            'line 4: [tables.a] outputs names "speed", which is declared as a condition. Accepted: a column that is not a '
            "condition. Try to leave out [conditions.speed].",
        ),
        (
            "[conditions.speed]\ntype = 'number'\n[blueprints.b]\nconditions = ['sped']",
            'line 4: [blueprints.b] names the condition "sped", which is not declared. Accepted: "speed". Did you mean "speed"?',
        ),
        (
            "[tables.a]\n[contracts.c]\ntable = 'a'",
            "line 2: [contracts.c] demands nothing. Accepted: exactly one of some, every, none, at_most and winner.",
        ),
        (
            "[tables.a]\n[contracts.c]\ntable = 'a'\nsome = 'weight > 1'\nnone = 'weight > 2'",
            "line 5: [contracts.c] has some and none. Accepted: exactly one of some, every, none, at_most and winner.",
        ),
        (
            "[tables.a]\n[contracts.c]\nsome = 'weight > 1'",
            'line 2: [contracts.c] has no table. Accepted: table = "NAME".',
        ),
        (
            "[tables.a]\n[contracts.c]\ntable = 'a'\nsome = 'wait > 1'",
            'line 4: [contracts.c] some "wait > 1", character 1: there is no condition "wait". Accepted: "asset", "weight", '
            '"priority". Did you mean "weight > 1"?',
        ),
        (
            "[conditions.p]\ntype = 'bool'\n[tables.a]\n[contracts.c]\ntable = 'a'\nwhen = 'p > 1'\nat_most = 1",
            'line 6: [contracts.c] when "p > 1", character 1: True or False is compared with a number. Accepted: two values of one '
            "type.",
        ),
    ]
)
def test_a_wrong_section_is_said(text: str, message: str):
    assert fault(text) == f"contextdb.toml, {message}"


TOML_SAID = 'Accepted: [section.name], key = "text", key = 1.5, key = ["A", "B"].'


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (
            "\n[conditions.speed\ntype = 'bool'",
            "line 2: cannot read \"[conditions.speed\" as TOML: expected ']' at the end of a table declaration, at character 18. "
            f"{TOML_SAID} Did you mean [conditions.speed]?",
        ),
        (
            "[conditions.x]\ntype = bool",
            f'line 2: cannot read "type = bool" as TOML: invalid value, at character 8. {TOML_SAID} Did you mean type = "bool"?',
        ),
        (
            "[conditions.Asset Name]",
            "line 1: cannot read \"[conditions.Asset Name]\" as TOML: expected ']' at the end of a table declaration, "
            f'at character 19. {TOML_SAID} Did you mean [conditions."Asset Name"]?',
        ),
        (
            "[tables.t]\noutputs = [A, B]",
            f'line 2: cannot read "outputs = [A, B]" as TOML: invalid value, at character 12. {TOML_SAID} '
            'Did you mean outputs = ["A", "B"]?',
        ),
        ("[a]\nx = 1\n[a]", 'line 3: "[a]" appears twice. Accepted: each section once, and each key once in it.'),
        ("a = 1\na = 2", 'line 2: "a = 2" appears twice. Accepted: each section once, and each key once in it.'),
        ("x = [\n'a',\n\n", f"line 2: cannot read \"'a',\" as TOML: invalid value, the file ends here. {TOML_SAID}"),
    ],
)  # fmt: skip
def test_a_line_that_is_no_toml_is_said_with_its_line(text: str, message: str):
    assert fault(text) == f"contextdb.toml, {message}"


def test_a_git_conflict_is_named_with_its_lines_and_not_as_wrong_toml():
    text = '[a]\n<<<<<<< ours\nx = ["B"]\n||||||| base\nx = []\n=======\nx = ["C"]\n>>>>>>> theirs\n'
    mend = 'Try to keep one side and delete the lines "<<<<<<<", "=======" and ">>>>>>>".'
    said = "line 2: an unresolved git conflict starts here and ends on line 8. Accepted: one version of each key."
    assert fault(text) == f"contextdb.toml, {said} {mend}"
    assert fault("x = [\n<<<<<<< ours\n'A']") == (
        f"contextdb.toml, line 2: an unresolved git conflict starts here. Accepted: one version of each key. {mend}"
    )
    for mark in ("||||||| base", "=======", ">>>>>>> theirs"):
        said = "line 2: this line is a conflict mark of git. Accepted: one version of each key. Try to delete the line."
        assert fault(f"x = ['A']\n{mark}\n") == f"contextdb.toml, {said}"


def test_hostile_sizes_are_refused_without_a_traceback():
    assert fault("a = " + "[" * 5000) == ("contextdb.toml: lists are nested too deeply to be read. Accepted: lists of names.")
    assert fault("a = " + "9" * 5000) == (
        "contextdb.toml: a whole number has too many digits to be read. Accepted: a number, such as -1.5."
    )
    assert len(fault("[project]\nname" + ".a" * 3000 + " = 1")) < 300
    assert len(fault(f"[conditions.x]\ntype = '{'y' * 1_000_000}'")) < 300


def test_all_faults_of_a_file_are_said_at_once_in_the_order_of_its_lines():
    said = faults(
        "[blueprints.b]\nconditions = ['nowhere']\n[conditions.a]\ntpye = 'bool'\n[conditions.b]\ntype = 'int'\nmin = 0.5\n"
        "max = '3'\n[tables.t]\npolicy = 3\nfile = 'C:x.csv'\n[tabels.u]\n"
    )
    assert [line.split(":")[0] for line in said] == [f"contextdb.toml, line {n}" for n in (2, 4, 7, 8, 10, 11, 12)]


# ---- schemas given in Python


def test_conditions_given_in_python_are_checked_as_those_of_a_file():
    given_in_python = {"speed": {"type": "number", "min": 0}, "position": {"type": "enum", "values": ("CB", "FS")}}
    assert conditions_from_dict(given_in_python) == {
        "speed": Condition("speed", Domain("number", None, 0.0)),
        "position": Condition("position", Domain("enum", ("CB", "FS"))),
    }


@pytest.mark.parametrize(
    ("mapping", "message"),
    [
        (5, "conditions = 5: this is a number, not a section. Accepted: [conditions.NAME]."),
        ({"speed": None}, "[conditions] speed = None: this is nothing, not a table. Accepted: [conditions.NAME]."),
        (
            {5: {"type": "bool"}},
            "[conditions.5]: the name cannot be used: this is a number, not text. Accepted: a name without spaces around it.",
        ),
        (
            {"speed": {"type": "number", "min": 10**400}},
            "[conditions.speed] min = 1000000000000000000000000000000000 … (407 characters): this is too large for a number. "
            "Accepted: a number, such as -1.5.",
        ),
        (
            {"speed": {"type": "number", 7: 1}},
            '[conditions.speed] has no key "7". '
            'Accepted: "type", "min", "max", "values", "unit", "description", "expr", "mirror", "weight", "hysteresis", "owner".',
        ),
    ],
)
def test_a_wrong_schema_given_in_python_is_said_without_a_file(mapping: object, message: str):
    with pytest.raises(SchemaError) as caught:
        conditions_from_dict(mapping)  # type: ignore[arg-type]
    assert str(caught.value) == message


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
WRONG_MIRRORS = [
    ("enum", SIDES, '"negate"',
     'mirror = "negate": a condition of type enum has no sign.'
     ' Accepted: names that change places, or "none". Did you mean mirror = { Left = "Right" }?'),
    ("enum", SIDES, '{ Left = "Rigth" }',
     'mirror = { Left = "Rigth" }: there is no value "Rigth".'
     ' Accepted: "Left", "Right", "Both". Did you mean "Right"?'),
    ("enum", SIDES, '{ Left = "Left" }',
     'mirror = { Left = "Left" }: "Left": it changes places with itself.'
     ' Accepted: each name in one pair, such as { Left = "Right" }.'),
    ("enum", SIDES, '{ Left = "Right", Both = "Right" }',
     'mirror = { Left = "Right", Both = "Right" }: "Right": it has two partners.'
     ' Accepted: each name in one pair, such as { Left = "Right" }.'),
    ("number", "", '{ Left = "Right" }',
     'mirror = { Left = "Right" }: none of these is in the name "side".'
     ' Accepted: a name in that of the condition, as Left is in "LeftFoot.Down"; "negate" or "none".'),
    ("number", 'expr = "2"', '"negate"',
     'mirror = "negate" has no place here: a derived fact is computed from mirrored facts.'
     ' Accepted: mirror in the conditions that it is computed from. Try to leave it out.'),
    ("tags", 'values = ["Left.Hand", "Right.Hand", "Left.Foot"]', '{ Left = "Right" }',
     'mirror = { Left = "Right" }: "Left.Foot" is exchanged with "Right.Foot", which is not a declared value.'
     ' Accepted: values that hold both. Try to add "Right.Foot" to the values.'),
    ("tags", "", '{ A = "B", "A.x" = "C" }',
     'mirror = { A = "B", "A.x" = "C" }: "A.x": it is below "A", with which it is exchanged anyway.'
     ' Accepted: each name in one pair, such as { Left = "Right" }.'),
]  # fmt: skip
LONE = """contextdb.toml, line 3: [conditions."LeftFoot.Down"] mirror = { Left = "Right" }: "RightFoot.Down", with which it \
changes places, does not change places with it. Accepted: a condition of type bool with the same mirror. Did you mean \
[conditions."RightFoot.Down"] with mirror = { Left = "Right" }?"""


@pytest.mark.parametrize("other", ["", "type = 'bool'", "type = 'number'\nmirror = { Left = 'Right' }"])
def test_a_condition_changes_places_only_with_one_of_its_type_that_changes_places_with_it(other: str):
    text = "[conditions.'LeftFoot.Down']\ntype = 'bool'\nmirror = { Left = 'Right' }\n"
    found = faults_of(text + (f"[conditions.'RightFoot.Down']\n{other}" if other else ""))
    assert str(found[0]) == LONE
    assert not faults_of(text + "[conditions.'RightFoot.Down']\ntype = 'bool'\nmirror = { Right = 'Left' }")


MIRRORS_ACCEPTED = 'Accepted: "negate" (the other sign), "none", or names that change places, such as { Left = "Right" }.'


@pytest.mark.parametrize(("kind", "more", "mirror", "message"), WRONG_MIRRORS)
def test_a_mirror_that_does_not_fit_its_condition_is_told(kind: str, more: str, mirror: str, message: str):
    text = f"[conditions.side]\ntype = '{kind}'\nmirror = {mirror}\n{more}"
    assert fault(text) == f"contextdb.toml, line 3: [conditions.side] {message}"


@pytest.mark.parametrize(
    ("mirror", "mend"),
    [
        ('"Negate"', 'mirror = "negate"'),
        ('"flip"', 'mirror = "negate"'),
        ("false", 'mirror = "none"'),
        ('[["Left", "Right"]]', 'mirror = { Left = "Right" }'),
        ('"Left = Right"', 'mirror = { Left = "Right" }'),
        ("3", ""),
        ("{}", ""),
        ("{ Left = 3 }", ""),
    ],
)
def test_a_mirror_of_another_form_is_told_with_what_was_likely_meant(mirror: str, mend: str):
    told = fault(f"[conditions.side]\ntype = 'text'\nmirror = {mirror}")
    assert MIRRORS_ACCEPTED in told
    assert told.endswith(f"Did you mean {mend}?" if mend else MIRRORS_ACCEPTED)


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


def test_a_mirror_of_a_condition_without_a_type_is_no_excuse():
    assert "has no type" in fault("[conditions.side]\nmirror = { Left = 'Right' }")
