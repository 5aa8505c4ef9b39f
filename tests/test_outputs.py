"""Outputs are read by row as they were written: in memory, out of a compiled file, pickled, for many contexts, through tables."""

import json
import math
import pickle
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any, get_args, get_type_hints

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from running import run
from strategies import examples

import contextdb as cdb
from contextdb.commands.check_command import check_path
from contextdb.compiled.stubs import stubs_of
from contextdb.compiled.table import CompiledTable, data_of
from contextdb.files.tensors import read_tensors, write_tensors
from contextdb.schema.sections import settings_to_dict, settings_with
from contextdb.schema.settings import TableSettings, read_schema
from contextdb.tables.table import Table

NAMES = ("damage", "line", "a b", 'x"y', "Élan")
VALUES = ("Fire", "Ice", "Half Back", 'say "no"')
TRUTHS = {"True": True, "no": False, " 1 ": True, "F": False}
NUMBERS = st.sampled_from([0.0, -0.5, 1e300, 5e-324, 0.1, math.inf, -math.inf, 2.0**53]) | st.floats(allow_nan=False)
WHOLE = st.sampled_from([0, 1, -(2**63), 2**63 - 1, 2**53 + 1]) | st.integers(-1000, 1000)
ABSENT: dict[str, Any] = {"bool": False, "int": 0, "number": math.nan, "enum": "", "text": ""}
DTYPES = {"bool": "bool", "int": "int64", "number": "float64", "enum": "object", "text": "object", "numbers": "float64"}


# ---- declarations and cells whose values are known before anything reads them


def values_of(kind: str, size: int) -> st.SearchStrategy:
    """Pairs of what a cell says and what that means."""
    if kind == "bool":
        return st.sampled_from(sorted(TRUTHS.items()))
    if kind == "int":
        return WHOLE.map(lambda n: (str(n), n))
    if kind == "number":
        return NUMBERS.map(lambda x: (repr(x), x))
    if kind == "enum":
        return st.sampled_from([*((v, v) for v in VALUES), ('"Fire"', "Fire"), (" Ice ", "Ice")])
    if kind == "text":
        words = st.text(st.characters(exclude_categories=("Cs",), exclude_characters="\0"), min_size=1, max_size=6)
        return words.filter(str.strip).map(lambda text: (text, text))
    numbers = st.lists(NUMBERS, min_size=size, max_size=size)
    return st.tuples(numbers, st.sampled_from([" ", ", ", ","])).map(
        lambda pair: (pair[1].join(map(repr, pair[0])), tuple(pair[0]))
    )


@st.composite
def declarations(draw: st.DrawFn) -> dict[str, Any]:
    kind = draw(st.sampled_from(sorted(DTYPES)))
    said: dict[str, Any] = {"type": kind}
    said |= {"values": list(VALUES)} if kind == "enum" else {}
    said |= {"size": draw(st.integers(1, 4))} if kind == "numbers" else {}
    if draw(st.booleans()):
        value = draw(values_of(kind, said.get("size", 1)))[1]
        said["default"] = list(value) if isinstance(value, tuple) else value
    return said


def default_of(said: Mapping[str, Any]) -> Any:
    """What there is without a cell."""
    absent = (math.nan,) * said["size"] if said["type"] == "numbers" else ABSENT[said["type"]]
    found = said.get("default", absent)
    return tuple(found) if isinstance(found, list) else found


@st.composite
def cells_of(draw: st.DrawFn, said: Mapping[str, Any], n_rows: int) -> list[tuple[str, Any]]:
    """For each row a text and its value; an empty cell means the default."""
    read = values_of(said["type"], said.get("size", 1))
    if "default" in said or said["type"] == "text":
        read = read | st.sampled_from([("", default_of(said)), ("  ", default_of(said))])
    return draw(st.lists(read, min_size=n_rows, max_size=n_rows))


@st.composite
def tables(draw: st.DrawFn, names: tuple[str, ...] = NAMES, most: int = 5) -> tuple[Table, dict, list[dict], dict]:
    """A table, what is declared, the outputs of each row, and those of the fallback."""
    n_rows = draw(st.integers(0, most))
    declared = {name: draw(declarations()) for name in draw(st.lists(st.sampled_from(names), unique=True, max_size=3))}
    cells = {name: draw(cells_of(said, n_rows)) for name, said in declared.items()}
    fallback = {name: default_of(said) for name, said in declared.items()}
    settings: dict[str, Any] = {"outputs": declared} if declared else {}
    if declared and draw(st.booleans()):
        given = draw(st.sets(st.sampled_from(sorted(declared))))
        own = {name: draw(values_of(declared[name]["type"], declared[name].get("size", 1)))[1] for name in sorted(given)}
        fallback |= own
        settings["fallback"] = {"asset": "idle", "outputs": {n: list(v) if isinstance(v, tuple) else v for n, v in own.items()}}
    columns = {
        "Asset": [f"A{row}" for row in range(n_rows)],
        "on": [draw(st.sampled_from(["True", "False", "Any"])) for _ in range(n_rows)],
        **{name: [text for text, _ in found] for name, found in cells.items()},
    }
    table = Table.from_columns(columns, {"on": {"type": "bool"}}, settings_with(TableSettings("t"), settings))
    return table, declared, [{name: found[row][1] for name, found in cells.items()} for row in range(n_rows)], fallback


def same(one: Any, other: Any) -> bool:
    """Whether two values are of one type and equal; NaN is NaN."""
    if isinstance(one, tuple):
        return type(other) is tuple and len(one) == len(other) and all(map(same, one, other))
    if isinstance(one, float) and math.isnan(one):
        return isinstance(other, float) and math.isnan(other)
    return type(one) is type(other) and one == other


def plain(value: Any) -> Any:
    """A value out of an array as Python has it."""
    value = value.tolist() if isinstance(value, (np.ndarray, np.generic)) else value
    return tuple(value) if isinstance(value, list) else value


def require_outputs(compiled: CompiledTable, declared: Mapping, rows: list[dict], fallback: Mapping) -> None:
    """Every way to read an output gives what was written."""
    outputs = compiled.outputs
    assert outputs.names == tuple(declared)
    assert outputs.fallback.keys() == fallback.keys()
    assert all(same(fallback[name], outputs.fallback[name]) for name in fallback)
    for row, expected in enumerate(rows):
        found = outputs.of_row(row)
        assert found.keys() == expected.keys()
        assert all(same(expected[name], found[name]) for name in expected)
    chosen = np.array([-1, *range(len(rows)), *reversed(range(len(rows)))], np.int64)
    for name, said in declared.items():
        column, taken = outputs.column(name), outputs.of(chosen, name)
        assert column.dtype == DTYPES[said["type"]]
        assert column.shape == ((len(rows), said["size"]) if said["type"] == "numbers" else (len(rows),))
        assert not column.flags.writeable
        assert not taken.flags.writeable
        assert taken.dtype == column.dtype
        assert all(same(rows[row][name], plain(column[row])) for row in range(len(rows)))
        wanted = [fallback[name] if row < 0 else rows[row][name] for row in chosen.tolist()]
        assert all(same(value, plain(found)) for value, found in zip(wanted, taken, strict=True))


@given(tables(), st.booleans())
@examples(1)
def test_outputs_are_read_as_they_were_written(drawn, is_on: bool):
    table, declared, rows, fallback = drawn
    compiled = table.compile()
    require_outputs(compiled, declared, rows, fallback)
    matches = compiled.query({"on": is_on})
    valid = [row for row in range(table.n_rows) if table.text(row, "on") in (str(is_on), "Any")]
    many = compiled.query_many({"on": [is_on, not is_on]})
    for found in (matches, pickle.loads(pickle.dumps(matches)), many[0], compiled.live({"on": is_on}).matches()):
        for name in declared:
            read = found.outputs(name)
            assert not read.flags.writeable
            assert len(read) == len(valid)
            assert all(same(rows[row][name], plain(value)) for row, value in zip(valid, read, strict=True))


@given(drawn=tables())
@examples(1)
def test_outputs_are_the_same_in_a_compiled_file_and_in_a_pickle(tmp_path_factory: pytest.TempPathFactory, drawn):
    table, declared, rows, fallback = drawn
    compiled, path = table.compile(), tmp_path_factory.getbasetemp() / "outputs.safetensors"
    compiled.save(path)
    for other in (
        CompiledTable.open(path),
        pickle.loads(pickle.dumps(compiled)),
        pickle.loads(pickle.dumps(CompiledTable.open(path))),
    ):
        require_outputs(other, declared, rows, fallback)
        assert other.outputs.declared == compiled.outputs.declared
        assert other.version == compiled.version


@given(tables(most=3), st.data())
@examples(0.5)
def test_outputs_follow_the_rows_through_edits(drawn, data: st.DataObject):
    table, declared, rows, fallback = drawn
    if not table.n_rows:
        return
    taken = data.draw(st.lists(st.integers(0, table.n_rows - 1), max_size=4))
    require_outputs(table.with_rows_taken(taken).compile(), declared, [rows[row] for row in taken], fallback)
    if not declared:
        return
    row, name = data.draw(st.integers(0, table.n_rows - 1)), data.draw(st.sampled_from(sorted(declared)))
    text, value = data.draw(values_of(declared[name]["type"], declared[name].get("size", 1)))
    table.compile()
    edited = table.with_cell(row, name, text)
    rows[row] = rows[row] | {name: value}
    require_outputs(edited.compile(), declared, rows, fallback)
    assert data_of(edited.compile()).masks[0] is data_of(table.compile()).masks[0]


@given(st.data())
@examples(0.7)
def test_a_row_behind_a_reference_has_the_innermost_output_that_is_said(data: st.DataObject):
    said = {name: data.draw(declarations()) for name in NAMES[:3]}
    own = {t: [n for n in said if data.draw(st.booleans())] for t in ("outer", "inner", "low")}
    assets = {"outer": ["A", "@inner", "@low", "@inner"], "inner": ["B", "@low", "C"], "low": ["D", "E"]}
    cells: dict[str, dict[str, list[tuple[str, Any]]]] = {}
    known: dict[str, Table] = {}
    for name in ("low", "inner", "outer"):
        cells[name] = {}
        for output in own[name]:
            found = data.draw(cells_of(said[output], len(assets[name])))
            for row, asset in enumerate(assets[name]):  # a row that refers to a table may say nothing
                if asset.startswith("@") and data.draw(st.booleans()):
                    found[row] = ("", None)
            cells[name][output] = found
        columns = {"Asset": assets[name], **{o: [text for text, _ in found] for o, found in cells[name].items()}}
        settings = settings_with(TableSettings(name), {"outputs": {o: said[o] for o in own[name]}} if own[name] else {})
        known[name] = Table.from_columns(columns, {}, settings)

    def ways(name: str) -> list[list[tuple[str, int]]]:
        found = []
        for row, asset in enumerate(assets[name]):
            below = ways(asset[1:]) if asset.startswith("@") else [[]]
            found += [[(name, row), *way] for way in below]
        return found

    def value(way: list[tuple[str, int]], output: str) -> Any:
        for name, row in reversed(way):
            if output in own[name] and cells[name][output][row][0].strip():
                return cells[name][output][row][1]
        return default_of(said[output])

    order = [o for name in ("outer", "inner", "low") for o in own[name]]
    declared = {o: said[o] for o in dict.fromkeys(order)}
    rows = [{o: value(way, o) for o in declared} for way in ways("outer")]
    compiled = known["outer"].compile(known)
    assert set(compiled.outputs.names) == set(declared)
    declared = {name: declared[name] for name in compiled.outputs.names}
    require_outputs(compiled, declared, rows, {name: default_of(part) for name, part in declared.items()})


# ---- what is wrong with a cell

FAULTY = {
    "damage": {"type": "int", "min": 0, "max": 10},
    "scale": {"type": "number", "default": 1.0},
    "loud": {"type": "bool", "default": False},
    "element": {"type": "enum", "values": ["Fire", "Ice"]},
    "at": {"type": "numbers", "size": 3, "default": [0, 0, 0], "max": 5},
}


DAMAGE = "a whole number, such as 3, 0..10"


def table_of(column: str, text: str) -> Table:
    fine = {"damage": "1", "scale": "", "loud": "", "element": "Ice", "at": ""} | {column: text}
    columns = {"Asset": ["A"], **{name: [said] for name, said in fine.items()}}
    return Table.from_columns(columns, {}, settings_with(TableSettings("t"), {"outputs": FAULTY}))


@pytest.mark.parametrize(
    ("column", "text", "rule", "message"),
    [
        ("damage", "x", "unreadable-output", 'cannot read "x" as an int. Accepted: {DAMAGE}.'),
        (
            "damage",
            "2.5",
            "unreadable-output",
            'cannot read "2.5" as an int: this is not a whole number. Accepted: {DAMAGE}. Did you mean "2"?',
        ),
        (
            "damage",
            "11",
            "output-out-of-bounds",
            '"11" is outside the declared bounds. Accepted: {DAMAGE}. Did you mean "10"?',
        ),
        (
            "damage",
            " ",
            "missing-output",
            "the cell is empty, and the output has no default. Accepted: {DAMAGE}. "
            "Try to fill in the cell, or to declare a default in contextdb.toml.",
        ),
        (
            "damage",
            "9223372036854775808",
            "unreadable-output",
            'cannot read "9223372036854775808" as an int: 64 bits do not hold it. Accepted: {DAMAGE}.',
        ),
        (
            "scale",
            "0,5",
            "unreadable-output",
            'cannot read "0,5" as a number. Accepted: a number, such as 0.5. Did you mean "0.5"?',
        ),
        (
            "scale",
            "Any",
            "unreadable-output",
            'cannot read "Any" as a number. Accepted: a number, such as 0.5. Try to leave the cell empty, which means the default.',
        ),
        ("scale", "nan", "unreadable-output", 'cannot read "nan" as a number. Accepted: a number, such as 0.5.'),
        (
            "scale",
            "1e999",
            "unreadable-output",
            'cannot read "1e999" as a number: this is too large for a number. Accepted: a number, such as 0.5.',
        ),
        ("loud", "tru", "unreadable-output", 'cannot read "tru" as a bool. Accepted: "True" or "False". Did you mean "True"?'),
        (
            "element",
            "Fyre",
            "unreadable-output",
            '"Fyre" is not a declared value. Accepted: "Fire", "Ice". Did you mean "Fire"?',
        ),
        (
            "at",
            "1 2",
            "unreadable-output",
            'cannot read "1 2" as 3 numbers: this has 2 parts. Accepted: 3 numbers with spaces or commas between, up to 5.',
        ),
        (
            "at",
            "(X=1, Y=2, Z=3)",
            "unreadable-output",
            'cannot read "(X=1, Y=2, Z=3)" as 3 numbers. Accepted: 3 numbers with spaces or commas between, up to 5. '
            'Did you mean "1, 2, 3"?',
        ),
    ],
)
def test_a_wrong_cell_is_said_with_what_is_accepted(column: str, text: str, rule: str, message: str):
    with pytest.raises(cdb.TableError) as error:
        table_of(column, text)
    [fault] = error.value.faults
    assert (fault.message, fault.rule) == (message.replace("{DAMAGE}", DAMAGE), rule)
    assert (fault.place.row, fault.place.column) == (0, column)


def test_all_wrong_cells_of_a_file_are_said_together(tmp_path: Path):
    (tmp_path / "contextdb.toml").write_text('[tables.t]\noutputs = { a = { type = "int" }, b = { type = "bool" } }\n')
    (tmp_path / "t.csv").write_text("Asset,a,b\nA,x,\nB,1,y\n")
    with pytest.raises(cdb.TableError) as error:
        cdb.load(tmp_path / "t.csv")
    assert [(f.place.line, f.place.column, f.rule) for f in error.value.faults] == [
        (2, "a", "unreadable-output"),
        (2, "b", "missing-output"),
        (3, "b", "unreadable-output"),
    ]


# ---- what is asked wrongly


def test_outputs_are_shown_in_one_line():
    said = "<Outputs: damage (int), scale (number), loud (bool), element (enum), at (numbers)>"
    assert repr(table_of("damage", "3").compile().outputs) == said
    assert repr(Table.from_columns({"Asset": ["a"]}).compile().outputs) == "<Outputs: none>"


def test_rows_of_any_shape_give_outputs_of_that_shape():
    outputs = table_of("damage", "3").compile().outputs
    assert outputs.of([[0, -1]], "damage").tolist() == [[3, 0]]
    assert outputs.of([[0, -1]], "at").shape == (1, 2, 3)
    assert outputs.of([], "damage").dtype == np.int64
    assert outputs.of(0, "element").shape == ()


# ---- versions and files


def test_what_an_output_says_is_part_of_the_version():
    table = table_of("damage", "3")
    assert table.compile().version != table.with_cell(0, "damage", "4").compile().version
    assert table.compile().version == table.with_cell(0, "damage", "3.0").compile().version
    other = settings_with(table.settings, {"fallback": {"asset": "A", "outputs": {"damage": 9}}})
    texts = {c.name: c.to_list() for c in table.columns}
    assert Table.from_columns(texts, {}, other).compile().version != table.compile().version


@pytest.mark.parametrize("damage", [1, 2, 3, 4, 5])
def test_a_file_whose_outputs_do_not_fit_is_refused(tmp_path: Path, damage: int):
    """The digest is made anew: the shapes are looked at too."""
    from contextdb.compiled.artefact import COMPILED
    from contextdb.files.tensors import digest_of

    path = tmp_path / "t.safetensors"
    table_of("damage", "3").compile().save(path)
    tensors, metadata = read_tensors(path, COMPILED)
    declared = json.loads(tensors["outputs.declared"].tobytes())
    if damage == 1:
        tensors["outputs.000.values"] = tensors["outputs.000.values"][:-1]
    elif damage == 2:
        tensors["outputs.003.codes"] = tensors["outputs.003.codes"] + np.int32(9)
    elif damage == 3:
        tensors["outputs.002.values"] = tensors["outputs.002.values"] + np.uint8(2)
    elif damage == 4:
        del tensors["outputs.004.values"]
    else:
        declared[1]["type"] = "nothing"
        tensors["outputs.declared"] = np.frombuffer(json.dumps(declared).encode(), np.uint8)
    digest = digest_of(tensors, metadata["about"], str(COMPILED.layout))
    write_tensors(path, COMPILED, dict(tensors), {"about": metadata["about"], "digest": digest})
    with pytest.raises(cdb.ArtefactError, match="does not hold what its header says"):
        CompiledTable.open(path)


def test_a_table_inside_with_another_type_is_refused():
    low = Table.from_columns(
        {"Asset": ["B"], "n": ["1"]}, {}, settings_with(TableSettings("low"), {"outputs": {"n": {"type": "int"}}})
    )
    outer = Table.from_columns({"Asset": ["@low"], "n": ["1"]}, {}, TableSettings("outer", outputs=("n",)))
    with pytest.raises(cdb.TableError, match="the output is of type int here and of type text in the table") as error:
        outer.compile({"outer": outer, "low": low})
    assert error.value.faults[0].rule == "unlike-outputs"


def test_check_reports_tables_inside_each_other_whose_outputs_differ(tmp_path: Path):
    (tmp_path / "contextdb.toml").write_text('[tables.low]\noutputs = { n = { type = "int" } }\n[tables.outer]\noutputs = ["n"]\n')
    (tmp_path / "low.csv").write_text("Asset,n\nA,1\n")
    (tmp_path / "outer.csv").write_text("Asset,n\n@low,1\n")
    found = [f for f in check_path(str(tmp_path)).findings if f.level == "error"]
    assert [(f.rule, f.column) for f in found] == [("unlike-outputs", "n")]


# ---- contextdb.toml

TOML = """
[tables.t]
outputs = { damage = { type = "int", default = 0, max = 10 }, line = { type = "text" }, at = { type = "numbers", size = 2 } }
fallback = { asset = "idle", outputs = { damage = 3, at = [1, 2.5] } }
[tables.u]
outputs = ["Slots"]
fallback = "idle"
[tables.v.outputs.element]
type = "enum"
values = ["Fire", "Ice"]
default = "Ice"
unit = "e"
description = "what burns"
"""


def test_contextdb_toml_declares_outputs_in_both_forms():
    tables = read_schema(TOML, "contextdb.toml").tables
    assert tables["t"].outputs == ("damage", "line", "at")
    assert tables["t"].fallback == "idle"
    assert dict(tables["t"].fallback_outputs) == {"damage": 3, "at": (1.0, 2.5)}
    assert tables["u"] == TableSettings("u", outputs=("Slots",), fallback="idle")
    [element] = tables["v"].declared_outputs
    assert (element.kind, element.values, element.default, element.unit) == ("enum", ("Fire", "Ice"), "Ice", "e")


@given(tables())
@examples(0.3)
def test_settings_come_back_from_what_the_file_says_of_them(drawn):
    settings = drawn[0].settings
    assert settings_with(TableSettings("t"), settings_to_dict(settings)) == settings


# ---- other faces


def abilities() -> Table:
    columns = {"Asset": ["slash", "@inner"], "n": ["-3", ""], "x": ["inf", "0.5"], "at": ["1 2", ""], "e": ["A", ""], "b": ["", ""]}
    inner = {"Asset": ["bolt"], "line": ["zap"]}
    declared = {
        "n": {"type": "int", "unit": "points", "description": "what it costs"},
        "x": {"type": "number", "min": 0},
        "at": {"type": "numbers", "size": 2},
        "e": {"type": "enum", "values": ["A", "B b"]},
        "b": {"type": "bool", "default": True},
    }
    outer = Table.from_columns(columns, {}, {"outputs": declared}, "outer")
    return replace(outer, around={"outer": outer, "inner": Table.from_columns(inner, {}, {"outputs": ["line"]}, "inner")})


def test_a_query_tells_the_outputs_of_each_match_in_json(tmp_path: Path):
    abilities().compile().save(tmp_path / "outer.safetensors")
    assert Table.from_columns({"Asset": ["a"]}).compile().outputs.of_row(0) == {}
    ran = run("query", str(tmp_path / "outer.safetensors"), "--json")
    assert [match["outputs"] for match in json.loads(ran.out)["matches"]] == [
        {"n": -3, "x": "inf", "at": [1.0, 2.0], "e": "A", "b": True, "line": ""},
        {"n": 0, "x": 0.5, "at": [None, None], "e": "", "b": True, "line": "zap"},
    ]


def test_stubs_have_the_outputs_of_a_row():
    names: dict[str, Any] = {}
    exec(stubs_of({"outer": abilities().compile()}), names)
    found = get_type_hints(names["OuterOutputs"])
    pair = tuple[float, float]
    assert found == {"n": int, "x": float, "at": pair, "e": names["OuterE"], "b": bool, "line": str}
    assert get_args(names["OuterE"]) == ("A", "B b", "")
    assert "'n': int,  # points: what it costs\n" in stubs_of({"outer": abilities().compile()})
    assert "'x': float,  # 0..\n" in stubs_of({"outer": abilities().compile()})


def test_settings_given_in_python_are_those_of_the_file():
    with pytest.raises(cdb.SchemaError, match='output "n" type = "itn"'):
        Table.from_columns({"Asset": ["a"], "n": ["1"]}, {}, {"outputs": {"n": {"type": "itn"}}})
    table = Table.from_columns({"Asset": ["a"], "n": ["1"]}, {}, {"outputs": {"n": {"type": "int"}}, "policy": "first"}, name="x")
    assert (table.name, table.settings.policy, table.compile().outputs.of_row(0)) == ("x", "first", {"n": 1})


def test_a_workbook_carries_the_types_of_outputs_along(tmp_path: Path):
    (tmp_path / "a").mkdir()
    (tmp_path / "a" / "contextdb.toml").write_text(TOML.replace("[tables.t]", '[conditions.on]\ntype = "bool"\n[tables.t]'))
    (tmp_path / "a" / "t.csv").write_text("Asset,on,damage,line,at\nx,True,3,hey,1 2\n")
    assert run("export", str(tmp_path / "a" / "t.csv"), str(tmp_path / "t.xlsx")).code == 0
    assert run("import", str(tmp_path / "t.xlsx"), str(tmp_path / "t.csv")).code == 0
    before, after = cdb.load(tmp_path / "a" / "t.csv"), cdb.load(tmp_path / "t.csv")
    assert set(after.settings.typed) == set(before.settings.typed)
    assert after.settings.fallback_outputs == before.settings.fallback_outputs
    assert after.compile().outputs.of_row(0) == before.compile().outputs.of_row(0)


def test_a_hot_reload_takes_over_outputs_that_changed(tmp_path: Path):
    (tmp_path / "contextdb.toml").write_text('[tables.t]\noutputs = { n = { type = "int" } }\n')
    (tmp_path / "t.csv").write_text("Asset,n\nA,1\n")
    with cdb.watch(tmp_path, poll_s=None, settle_s=0.0) as watch:
        before = watch["t"]
        (tmp_path / "t.csv").write_text("Asset,n\nA,12\n")
        watch.poll()
        assert (before.outputs.of_row(0), watch["t"].outputs.of_row(0)) == ({"n": 1}, {"n": 12})
        (tmp_path / "t.csv").write_text("Asset,n\nA,x\n")
        watch.poll()
        assert watch["t"].outputs.of_row(0) == {"n": 12}
        assert [fault.rule for fault in watch.faults] == ["unreadable-output"]


def test_outputs_are_a_mapping_of_names_to_columns():
    columns = {"Asset": ["a", "b"], "damage": ["1", "2"], "line": ["x", "y"]}
    settings = settings_with(TableSettings("t"), {"outputs": {"damage": {"type": "int"}, "line": {"type": "text"}}})
    outputs = Table.from_columns(columns, {}, settings).compile().outputs
    assert {name: column.tolist() for name, column in outputs.items()} == {"damage": [1, 2], "line": ["x", "y"]}
    assert (outputs["damage"] is outputs.column("damage")) or outputs["damage"].tolist() == [1, 2]
    assert outputs.get("damge") is None
    with pytest.raises(cdb.NoSuchOutput, match='"damage"'):
        outputs["damge"]
    assert outputs == outputs
    assert len({outputs, Table.from_columns(columns, {}, settings).compile().outputs}) == 2
