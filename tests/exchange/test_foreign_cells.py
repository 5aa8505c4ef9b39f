"""Every cell of a file of another program means here what it meant there, or the report names it."""

import csv
import datetime
import io
import json
from collections.abc import Callable
from dataclasses import dataclass

import pytest
import xlsxwriter
from hypothesis import given
from hypothesis import strategies as st
from strategies import examples

from contextdb.cells.grammar import parse_cell
from contextdb.cells.sets import Cell, NumberSet, ValueSet
from contextdb.cells.words import truth_of
from contextdb.errors import CellError
from contextdb.exchange.formats import ReadOptions, read
from contextdb.exchange.importing import plan_import, table_of
from contextdb.exchange.mapping import Mapped, propose
from contextdb.exchange.reading import ERRORS, Reading
from contextdb.schema.settings import EMPTY, TableSettings, read_schema
from contextdb.tables.project import Project

NAMES = [
    "Mid Air",
    "On Ground",
    "Mid",
    "Air",
    "CB",
    "Half Back",
    'say "no"',
    "it's",
    "not CB",
    "CB ~2",
    "5",
    "nan",
    "Any Team",
    "#1",
]
NUMBERS = ["1,5", "1.234,5", "1,234", "1'234", "1 234", "1.234.567", "12%", "€ 5", "1e3", ".5", "-3", "007", "∞", "1/2"]
DATES = ["2026-01-02", "02.01.2026", "1/2/26", "12:30"]
EMPTY_TEXTS = ["", "-", "Any", " "]
TRUTHS = ["True", "false", "yes", "NO"]
OTHERS = [*sorted(ERRORS)[:3], "walk, then run!", "a; b"]

# The first row's text of the first column of a grid is the asset; the others are drawn column by column.
TEXTS: dict[str, list[str]] = {"names": NAMES, "numbers": NUMBERS, "dates": DATES, "truths": TRUTHS, "others": OTHERS}
Value = str | int | float | bool | None


@st.composite
def columns(draw: st.DrawFn) -> list[Value]:
    """A column mostly of one kind, with some texts of others in it."""
    kind = draw(st.sampled_from([*TEXTS, "typed", "distinct"]))
    n_rows = 24
    if kind == "distinct":
        return [f"name {i % draw(st.sampled_from([3, 1000]))}" for i in range(n_rows)]
    if kind == "typed":
        return draw(st.lists(st.one_of(st.integers(-99, 99), st.just(2.5), st.booleans()), min_size=n_rows, max_size=n_rows))
    usual = st.sampled_from(TEXTS[kind])
    odd = st.sampled_from([text for texts in TEXTS.values() for text in texts] + EMPTY_TEXTS)
    rows = draw(st.lists(usual, min_size=n_rows, max_size=n_rows))
    for at, text in draw(st.dictionaries(st.integers(0, n_rows - 1), odd, max_size=6)).items():
        rows[at] = text
    return list(rows)


def as_csv(grid: dict[str, list[Value]], mark: str) -> bytes:
    out = io.StringIO(newline="")
    writer = csv.writer(out, delimiter=mark, lineterminator="\n")
    writer.writerow(grid)
    writer.writerows(zip(*grid.values(), strict=True))
    return out.getvalue().encode()


def as_json(grid: dict[str, list[Value]]) -> bytes:
    return json.dumps([dict(zip(grid, row, strict=True)) for row in zip(*grid.values(), strict=True)]).encode()


def as_workbook(grid: dict[str, list[Value]]) -> bytes:
    out = io.BytesIO()
    book = xlsxwriter.Workbook(out, {"strings_to_formulas": False})
    sheet = book.add_worksheet()
    for column, (name, values) in enumerate(grid.items()):
        for row, value in enumerate([name, *values]):
            if isinstance(value, str) and value in ERRORS:
                sheet.write_formula(row, column, "=NA()", None, value)
            elif isinstance(value, str):
                sheet.write_string(row, column, value)
            else:
                sheet.write(row, column, value)
    book.close()
    return out.getvalue()


FORMATS: dict[str, tuple[str, Callable[[dict[str, list[Value]]], bytes]]] = {
    "commas": ("x.csv", lambda grid: as_csv(grid, ",")),
    "semicolons": ("x.csv", lambda grid: as_csv(grid, ";")),
    "tabs": ("x.tsv", lambda grid: as_csv(grid, "\t")),
    "json": ("x.json", as_json),
    "workbook": ("x.xlsx", as_workbook),
}


@dataclass(frozen=True)
class Report:
    """What a person is told of an import, and what became of it."""

    reading: Reading
    mapped: dict[str, Mapped]

    def says(self, text: str) -> bool:
        """Whether a remark or a reason has these words."""
        return any(text in line for line in (*map(str, self.reading.remarks), *(column.why for column in self.mapped.values())))


def meant(value: Value) -> Value:
    """What a value means by itself, apart from its locale: None for nothing, a truth, a number, else a text."""
    if not isinstance(value, str):
        return value
    text = value.strip()
    if text.casefold() in ("", "-", "any"):
        return None
    return text


def is_same(value: Value, cell: Cell, kind: str) -> bool:
    """Whether a cell accepts what a value means, and nothing else."""
    wanted = meant(value)
    if wanted is None or cell.is_any:
        return (wanted is None) is cell.is_any
    if kind == "bool":
        truth = wanted if isinstance(wanted, bool) else truth_of(str(wanted))
        return cell.accepts == ValueSet(frozenset((truth,))) and truth is not None
    if kind in ("number", "int", "angle"):
        number = float(wanted) if not isinstance(wanted, str) or wanted.strip("+-.").replace(".", "", 1).isdigit() else None
        number = 1000.0 if wanted == "1e3" else number
        return isinstance(cell.accepts, NumberSet) and number is not None and cell.accepts.spans == ((number, number),)
    text = wanted if isinstance(wanted, str) else read_text(wanted)
    if kind == "date":
        day = float((datetime.date.fromisoformat(text) - datetime.date(1970, 1, 1)).days)
        return cell.accepts == NumberSet(((day, day),))
    return cell.accepts == ValueSet(frozenset((text,)))


def read_text(value: Value) -> str:
    return f"{value:g}" if isinstance(value, float) else str(value)


@pytest.mark.parametrize("form", FORMATS)
@examples(0.3)
@given(st.lists(columns(), min_size=1, max_size=3))
def test_every_cell_of_a_foreign_file_means_what_it_meant_or_is_listed(form: str, given_columns: list[list[Value]]):
    grid: dict[str, list[Value]] = {"Asset": [f"asset {i}" for i in range(24)]}
    grid |= {f"fact {at}": values for at, values in enumerate(given_columns)}
    name, write = FORMATS[form]
    reading = read(write(grid), name)
    settings = TableSettings("t")
    mapped = propose(reading, EMPTY, settings)
    table, _ = table_of(reading, mapped, EMPTY, settings)
    report = Report(reading, {column.source: column for column in mapped})
    assert [asset.strip() for asset in table.assets] == grid["Asset"]
    for source, values in grid.items():
        column = report.mapped[source]
        if column.job != "condition":
            continue
        domain = table.condition(column.name).condition.domain
        n_unread = 0
        for row, value in enumerate(values):
            text = table.text_column(column.name)[row]
            try:
                cell = parse_cell(text, domain, wants_mend=False)
            except CellError:
                n_unread += 1
                continue
            has_comma = isinstance(value, str) and "," in value
            told = has_comma and (report.says("is read as centre and tolerance") or report.says("decimal commas became points"))
            assert told or is_same(value, cell, domain.kind), (value, text, domain.kind)
        assert column.n_unreadable == n_unread
        assert n_unread == 0 or "cannot be read so" in column.why


@pytest.mark.parametrize("form", FORMATS)
def test_a_text_with_blanks_is_one_name_and_two_names_stay_two(form: str):
    states = ["Mid Air", "On Ground", "Mid Air", "Mid", "Air", '"Mid Air"']
    name, write = FORMATS[form]
    reading = read(write({"Asset": [f"a{i}" for i in range(6)], "state": list(states)}), name)
    settings = TableSettings("t")
    table, _ = table_of(reading, propose(reading, EMPTY, settings), EMPTY, settings)
    assert table.condition("state").condition.domain.values is not None
    assert set(table.condition("state").condition.domain.values) == set(states)
    assert table.compile().query({"state": "Mid"}).assets == ["a3"]
    assert table.compile().query({"state": "Mid Air"}).assets == ["a0", "a2"]


def test_a_list_of_json_and_a_set_of_unreal_are_several_names():
    rows = [{"Asset": "a", "state": "Mid Air"}, {"Asset": "b", "state": ["Mid", "Air"]}, {"Asset": "c", "s": {"t": ["x y", "z"]}}]
    reading = read(json.dumps(rows).encode(), "x.json")
    texts = {column.source: column.cells for column in propose(reading, EMPTY, TableSettings("t"))}
    assert texts["state"] is not None
    assert texts["state"].to_list() == ['"Mid Air"', "Mid Air", ""]
    assert reading.column("s.t").to_list()[2] == '"x y" z'
    reading = read(b'---,state,Role__on\na,Mid Air,On\nb,"(""Mid"",""Air"")",On Off\n', "x.csv")
    texts = {column.source: column.cells for column in propose(reading, EMPTY, TableSettings("t"))}
    assert texts["state"] is not None
    assert texts["state"].to_list() == ['"Mid Air"', "Mid Air"]
    assert texts["Role.on"] is not None


def test_a_declared_condition_reads_its_cells_by_their_grammar_and_else_as_whole_names():
    schema = read_schema('[conditions.state]\ntype = "enum"\nvalues = ["Mid Air", "CB", "FS"]\n', "contextdb.toml")
    reading = read(b'Asset;state\na;CB FS\nb;Mid Air\nc;not CB\nd;"""Mid Air"" CB"\ne;Mid Ground\n', "x.csv")
    (_, state) = propose(reading, schema, TableSettings("t"))
    assert state.cells is not None
    assert state.cells.to_list() == ["CB FS", '"Mid Air"', "not CB", '"Mid Air" CB', "Mid Ground"]
    assert state.n_unreadable == 1


def test_names_may_be_asked_for_word_by_word():
    raw = b"Asset;state\na;CB FS\nb;CB\n"
    assert propose(read(raw, "x.csv", ReadOptions(has_whole_names=False)), EMPTY, TableSettings("t"))[1].cells is None


def test_what_is_written_of_whole_names_reads_as_they_were(tmp_path):  # type: ignore[no-untyped-def]
    reading = read(b"Asset,state\na,Mid Air\nb,Mid\n", "x.csv")
    plan_import(reading, tmp_path / "t.csv").write()
    assert (tmp_path / "t.csv").read_text(encoding="utf-8") == 'Asset,state\na,"""Mid Air"""\nb,Mid\n'
    assert Project.load(tmp_path)["t"].compile().query({"state": "Mid Air"}).assets == ["a"]


def test_a_date_of_a_workbook_is_named_with_its_cell_whatever_its_column_becomes():
    reading = read(as_workbook({"Asset": ["a", "b"], "day": [None, None]}), "x.xlsx")
    assert reading.n_rows == 2
    out = io.BytesIO()
    book = xlsxwriter.Workbook(out, {"default_date_format": "yyyy-mm-dd"})
    sheet = book.add_worksheet()
    sheet.write_row(0, 0, ["Asset", "day"])
    sheet.write(1, 0, "a")
    sheet.write_datetime(1, 1, datetime.datetime(2026, 1, 2))
    book.close()
    assert "cell B2: a date, 2026-01-02" in "\n".join(map(str, read(out.getvalue(), "x.xlsx").remarks))
