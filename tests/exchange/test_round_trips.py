"""A table written in any format and read back is the table it was; our own CSV keeps its bytes."""

import math
from pathlib import Path

import numpy as np
import pytest
from csv_files import CsvFile, csv_files
from hypothesis import assume, given
from hypothesis import strategies as st
from strategies import examples, tables

from contextdb.cells.domains import Domain
from contextdb.columns import TextColumn
from contextdb.exchange.formats import FORMATS, ReadOptions, read, write
from contextdb.exchange.importing import plan_import, table_of
from contextdb.exchange.mapping import propose
from contextdb.exchange.xlsx_write import NEVER
from contextdb.files.csv_source import read_csv
from contextdb.schema.settings import EMPTY, TableSettings
from contextdb.tables.table import Table

NAMES = ("csv", "tsv", "xlsx", "parquet", "json", "jsonl")
TEXTS = st.one_of(
    st.sampled_from(
        ["5..10", "1-2", "007", "True", "1e5", "=1+1", "3,5", "20, 9.99", " x ", "_x000D_", "zwei\nZeilen", 'say "no"']
    ),
    st.lists(st.sampled_from(["_x0041", "_", "x0041_", "\x01", "<r>", "</r>"]), min_size=1, max_size=5).map("".join),
    st.text(st.characters(exclude_characters="\0\ufffe\uffff", exclude_categories=["Cs"]), max_size=8),
)


def texts_of(columns: tuple[TextColumn, ...]) -> dict[str, list[str]]:
    return {column.name: column.to_list() for column in columns}


def is_declarable(domain: Domain) -> bool:
    """Whether contextdb.toml can say it: the bounds of an int are whole."""
    bounds = [bound for bound in (domain.minimum, domain.maximum) if math.isfinite(bound)]
    return domain.kind != "int" or all(bound.is_integer() for bound in bounds)


def back(table: Table, name: str) -> Table:
    """The table that comes back of a format, in a project that declares what the table's schema does."""
    raw, remarks = write(table, FORMATS[name])
    assert not [remark for remark in remarks if remark.is_loss]
    reading = read(raw, f"x.{name}", ReadOptions(name))
    schema = EMPTY if name == "xlsx" else table.schema
    settings = TableSettings("table") if name == "xlsx" else table.settings
    return table_of(reading, propose(reading, schema, settings), schema, settings)[0]


@pytest.mark.parametrize("name", NAMES)
@given(table=tables(least_conditions=1))
def test_every_format_gives_the_same_cells_and_meaning_back(name: str, table: Table):
    assume(table.n_rows or name not in ("json", "jsonl"))
    assume(name != "xlsx" or all(is_declarable(c.condition.domain) for c in table.conditions))
    again = back(table, name)
    assert texts_of(again.columns) == texts_of(table.columns)
    assert [c.condition.domain for c in again.conditions] == [c.condition.domain for c in table.conditions]
    assert [[c.cell(r) for r in range(again.n_rows)] for c in again.conditions] == [
        [c.cell(r) for r in range(table.n_rows)] for c in table.conditions
    ]
    assert np.array_equal(again.enabled, table.enabled)


@examples(0.5)
@given(
    names=st.lists(TEXTS.filter(str.strip), min_size=1, max_size=3, unique=True),
    data=st.data(),
)
def test_a_workbook_gives_any_text_back_as_it_was(names: list[str], data: st.DataObject):
    n_rows = data.draw(st.integers(0, 4))
    columns = {name: data.draw(st.lists(TEXTS, min_size=n_rows, max_size=n_rows)) for name in names}
    assume(not any(NEVER.search(text) for text in (*names, *(t for c in columns.values() for t in c))))
    table = Table.build("t", [TextColumn.of(name, texts) for name, texts in columns.items()])
    reading = read(write(table, FORMATS["xlsx"])[0], "t.xlsx")
    assert texts_of(reading.columns) == columns


@examples(0.5)
@given(rows=st.lists(st.tuples(TEXTS, TEXTS), max_size=4))
def test_tab_separated_text_and_json_give_any_text_back_as_it_was(rows: list[tuple[str, str]]):
    columns = {"name": [f"A{i}{a}" for i, (a, _) in enumerate(rows)], "cell": [b for _, b in rows]}
    assume(rows)
    table = Table.build("t", [TextColumn.of(name, texts) for name, texts in columns.items()])
    for name in ("tsv", "json", "jsonl"):
        assert texts_of(read(write(table, FORMATS[name])[0], f"t.{name}").columns) == columns


@given(file=csv_files())
def test_a_csv_of_our_own_is_exported_byte_for_byte(file: CsvFile):
    source, columns = read_csv(file.raw, "x.csv")
    table = Table.build("x", columns, source=source)
    assert write(table, FORMATS["csv"])[0] == file.raw


@examples(0.5)
@given(file=csv_files())
def test_a_csv_of_our_own_is_imported_byte_for_byte(tmp_path_factory: pytest.TempPathFactory, file: CsvFile):
    reading = read(file.raw, "x.csv", ReadOptions(has_whole_names=False))  # --names words: its cells are cells of ours
    assume(reading.source is not None)  # one column with a semicolon in its name is told as another dialect
    path: Path = tmp_path_factory.mktemp("tables") / "x.csv"
    mapped = propose(reading, EMPTY, TableSettings("x"))
    assume(all(column.name == column.source for column in mapped))  # contextdb.toml takes no name with spaces around it
    plan_import(reading, path, mapped=mapped).write()
    assert path.read_bytes() == file.raw


def test_what_a_workbook_keeps_of_a_table_survives_a_project_that_knows_nothing_of_it():
    columns = [TextColumn.of(n, t) for n, t in {"P": ["2"], "A": ["x"], "pos": ["CB"], "note": ["a, b"], "speed": ["5"]}.items()]
    declared = {
        "pos": {"type": "enum", "values": ["CB", "Half Back"]},
        "speed": {"type": "int", "min": -3, "max": 9, "unit": 'm/"s"', "description": "Größe"},
    }
    table = Table.from_columns({"A": ["x"]}, declared)
    settings = TableSettings("t", asset="A", outputs=("note",), priority="P", fallback="idle", policy="priority")
    table = Table.build("t", columns, table.schema, settings)
    again = back(table, "xlsx")
    assert [c.condition for c in again.conditions] == [c.condition for c in table.conditions]
    assert (again.settings.outputs, again.settings.priority, again.settings.policy) == (("note",), "P", "priority")
    assert (again.settings.fallback, again.asset_column) == ("idle", "A")


@pytest.mark.parametrize("name", NAMES)
def test_a_column_of_rules_comes_back_as_one(name: str):
    columns = [TextColumn.of(n, t) for n, t in {"A": ["x", "y"], "speed": ["5", "Any"], "only": ["speed > 3", ""]}.items()]
    schema = Table.from_columns({"A": ["x"]}, {"speed": {"type": "number"}}).schema
    table = Table.build("table", columns, schema, TableSettings("table", asset="A", when="only"))
    again = back(table, name)
    assert again.settings.when == "only"
    assert [c.condition for c in again.conditions] == [c.condition for c in table.conditions]
    assert texts_of(again.columns) == texts_of(table.columns)


def test_a_column_that_is_called_when_is_no_column_of_rules_by_its_name():
    reading = read(b"A,When\nx,True\ny,False\n", "x.csv")
    assert [column.job for column in propose(reading, EMPTY, TableSettings("x"))] == ["asset", "condition"]


@pytest.mark.parametrize("name", ["unreal-csv", "unreal-json"])
def test_an_unreal_table_gives_the_same_cells_back(name: str):
    columns = {
        "Asset": ["jog", "run"],
        "Defender.pos": ["CB FS", '"Half Back"'],
        "speed": ["(5..10)", "20, 9.99"],
        "on": ["True", "Any"],
    }
    table = Table.from_columns(columns, {"Defender.pos": {"type": "enum", "values": ["CB", "FS", "Half Back"]}})
    reading = read(write(table, FORMATS[name])[0], "x", ReadOptions(name))
    assert texts_of(reading.columns) == {"Asset Name": columns.pop("Asset"), **columns}
