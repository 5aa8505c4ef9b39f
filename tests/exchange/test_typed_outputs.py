"""Typed outputs that leave a project and come back: with their values, and with their types as far as the format has types."""

import math
import re
from pathlib import Path

import pytest
from hypothesis import assume, given
from test_outputs import plain, same, tables

from contextdb.errors import TableError
from contextdb.exchange.formats import FORMATS, read, write
from contextdb.exchange.importing import plan_import, table_of
from contextdb.exchange.mapping import propose
from contextdb.schema.sections import settings_with
from contextdb.schema.settings import EMPTY, TableSettings
from contextdb.tables.project import load
from contextdb.tables.table import Table

TYPED = {
    "hit": {"type": "bool"},
    "damage": {"type": "int", "default": 3},
    "blend": {"type": "number", "min": 0, "max": 1},
    "kind": {"type": "enum", "values": ["Fire", "Half Back"]},
    "line": {"type": "text"},
    "offset": {"type": "numbers", "size": 2},
}
COLUMNS = {
    "Asset": ["jog", "run"],
    "on": ["True", "False"],
    "hit": ["True", "F"],
    "damage": ["12", ""],
    "blend": ["0.25", "1"],
    "kind": ["Fire", '"Half Back"'],
    "line": ["Get down!", ""],
    "offset": ["0, 1.5", "2 3"],
}


def typed() -> Table:
    said = {"outputs": TYPED, "fallback": {"asset": "idle", "outputs": {"hit": True, "kind": "Fire"}}}
    return Table.from_columns(COLUMNS, {"on": {"type": "bool"}}, settings_with(TableSettings("t", asset="Asset"), said))


def through_dmn(table: Table) -> Table:
    reading = read(write(table, FORMATS["dmn"])[0], "t.dmn")
    return table_of(reading, propose(reading, EMPTY, TableSettings("t")), EMPTY, TableSettings("t"))[0]


def types_of(table: Table) -> dict[str, str]:
    return {output.name: output.kind for output in table.settings.declared_outputs}


@given(tables())
def test_outputs_come_back_from_dmn_with_their_types_and_values(drawn: tuple[Table, dict, list[dict], dict]):
    table, declared, rows, _ = drawn
    declares = [text for o in table.settings.declared_outputs for text in (*o.values, o.default) if isinstance(text, str)]
    gives = [value for _, value in table.settings.fallback_outputs if isinstance(value, str)]
    assume(all(text.isprintable() for text in (*declares, *gives, *(text for column in table.columns for text in column.texts))))
    again = through_dmn(table)
    outputs = again.compile().outputs
    assert outputs.names == tuple(declared)
    for name, said in declared.items():
        values, kind = [row[name] for row in rows], said["type"]
        if kind == "number" and any(map(math.isinf, values)):
            assert types_of(again)[name] == "text"
        elif kind != "numbers":
            assert types_of(again)[name] == {"int": "number"}.get(kind, kind)
            wanted = list(map(float, values)) if kind == "int" else values
            assert all(map(same, wanted, map(plain, outputs.column(name))))
        else:
            texts = [tuple(map(float, text.split())) for text in outputs.column(name)]
            assert all(map(same, values, texts))
    for name, value in table.settings.fallback_outputs:
        if declared[name]["type"] in ("bool", "enum", "text"):
            assert same(outputs.fallback[name], value)


def test_a_typed_output_is_written_with_its_type_its_values_and_what_the_fallback_gives():
    raw, remarks = write(typed(), FORMATS["dmn"])
    found = re.findall(r'<output id="\w+" name="(\w+)" typeRef="(\w+)">(.*?)</output>', raw.decode())
    plain_text = {name: (kind, re.sub(r"<.*?>", " ", inner).split()) for name, kind, inner in found}
    assert plain_text == {
        "Asset": ("string", ["&quot;idle&quot;"]),
        "hit": ("boolean", ["true"]),
        "damage": ("number", ["3"]),
        "blend": ("number", ["[0..1]"]),
        "kind": ("string", ["&quot;Fire&quot;,&quot;Half", "Back&quot;", "&quot;Fire&quot;"]),
        "line": ("string", []),
        "offset": ("string", []),
    }
    assert b"<outputEntry><text>false</text></outputEntry><outputEntry><text>3</text></outputEntry>" in raw
    assert [str(remark) for remark in remarks if remark.is_loss] == [
        'column "damage": whole numbers become numbers: FEEL has one type for both.',
        'column "offset": lists of numbers become texts.',
    ]


def test_bounds_and_values_come_back_from_dmn_into_the_proposed_declaration(tmp_path: Path):
    (tmp_path / "contextdb.toml").write_text("", encoding="utf-8")
    plan_import(read(write(typed(), FORMATS["dmn"])[0], "t.dmn"), tmp_path / "new.csv").write()
    text = (tmp_path / "contextdb.toml").read_text(encoding="utf-8")
    assert 'hit = { type = "bool" }' in text
    assert 'blend = { type = "number", min = 0, max = 1 }' in text
    assert 'kind = { type = "enum", values = ["Fire", "Half Back"] }' in text


def test_infinite_numbers_become_empty_and_are_told():
    declared = settings_with(TableSettings("t", asset="Asset"), {"outputs": {"far": {"type": "number"}}})
    raw, remarks = write(Table.from_columns({"Asset": ["a"], "far": ["inf"]}, settings=declared), FORMATS["dmn"])
    assert b"<outputEntry><text></text></outputEntry>" in raw
    assert [str(remark) for remark in remarks] == ['column "far": infinite numbers become empty: FEEL has none.']


def test_a_declared_value_that_xml_cannot_hold_is_refused():
    declared = settings_with(TableSettings("t", asset="Asset"), {"outputs": {"kind": {"type": "enum", "values": ["a", "b\x01"]}}})
    with pytest.raises(TableError, match="a character that XML cannot hold"):
        write(Table.from_columns({"Asset": ["x"], "kind": ["a"]}, settings=declared), FORMATS["dmn"])


@pytest.mark.parametrize("entry", ["", "x + 1", '"much"'])
def test_a_typed_output_with_an_entry_of_no_such_value_is_text_and_told(entry: str):
    raw = write(typed(), FORMATS["dmn"])[0].decode().replace("<text>0.25</text>", f"<text>{entry}</text>")
    reading = read(raw.encode(), "t.dmn")
    assert reading.schema.tables["t"].output("blend") is None
    assert any("so it is read as text" in str(remark) and '"blend"' in str(remark) for remark in reading.remarks)


@pytest.mark.parametrize("name", ["csv", "tsv", "xlsx", "parquet", "json", "jsonl"])
def test_every_other_format_keeps_the_texts_of_typed_outputs(name: str):
    table = typed()
    reading = read(write(table, FORMATS[name])[0], f"t.{name}")
    again, _ = table_of(reading, propose(reading, table.schema, table.settings), table.schema, table.settings)
    assert again.settings == table.settings
    assert all(again.text(row, column) == texts[row] for column, texts in COLUMNS.items() for row in range(2))


@pytest.mark.parametrize("is_renamed", [False, True])
def test_a_workbook_carries_the_types_of_outputs_into_another_project(tmp_path: Path, is_renamed: bool):
    reading = read(write(typed(), FORMATS["xlsx"])[0], "t.xlsx")
    (tmp_path / "contextdb.toml").write_text("", encoding="utf-8")
    plan_import(reading, tmp_path / "new.csv", renames={"hit": "strike"} if is_renamed else None).write()
    again = load(tmp_path / "new.csv")
    expected = {("strike" if is_renamed and name == "hit" else name): said["type"] for name, said in TYPED.items()}
    assert types_of(again) == expected
    assert again.settings.output("kind") == typed().settings.output("kind")
