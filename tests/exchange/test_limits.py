"""Files that are too large, packed too well, or half merged: refused in words, with their place, and soon."""

import io
import tracemalloc
import zipfile

import pytest

from contextdb.errors import TableError
from contextdb.exchange.formats import FORMATS, read, write
from contextdb.tables.table import Table

LONG = "x" * 3_000_000
CONFLICT = "<<<<<<< ours\n{ours}\n=======\n{theirs}\n>>>>>>> theirs\n"


def refused(raw: bytes | str, name: str) -> str:
    with pytest.raises(TableError) as caught:
        read(raw if isinstance(raw, bytes) else raw.encode(), name)
    return str(caught.value)


@pytest.mark.parametrize(
    ("name", "text", "said"),
    [
        ("x.csv", f"a,b\n{LONG},1\n", "line 2: a field has more than 65,536 characters."),
        ("x.tsv", f"a\tb\n1\t{LONG}\n", "line 2: a field has more than 65,536 characters."),
        ("x.csv", f'a,b\n"{LONG}', "line 2: a field has more than 65,536 characters."),
        ("x.tsv", f"a\tb\n1\t{'y' * 70_000}\n", 'column "b": a cell has 70,000 characters: '),
        ("x.json", f'[{{"a": "{LONG}"}}]', '"a" has 3,000,000 characters.'),
        ("x.jsonl", f'{{"a": "{LONG}"}}\n', '"a" has 3,000,000 characters.'),
        ("x.json", f'[{{"a": {"9" * 6000}}}]', "a number has too many digits."),
        ("x.dmn", f"<definitions>{LONG}", "this is not readable XML"),
        ("x.dmn", "<a>" * 200_000, "this is not readable XML"),
        ("x.json", "[" * 200_000, "lists or objects are nested too deeply."),
    ],
    ids=lambda value: value if len(value) < 60 else "",
)
def test_a_text_that_is_too_long_or_too_deep_is_refused_without_being_printed(name: str, text: str, said: str):
    told = refused(text, name)
    assert said in told
    assert len(told) < 600


@pytest.mark.parametrize(("name", "mark"), [("x.csv", ","), ("x.tsv", "\t"), ("x.csv", ";")])
def test_a_line_of_a_million_empty_fields_is_read_as_a_row_without_memory_for_each_of_them_in_columns(name: str, mark: str):
    raw = f"a{mark}b\n1{mark}2{mark * 1_000_000}\n".encode()
    tracemalloc.start()
    try:
        reading = read(raw, name)
        assert tracemalloc.get_traced_memory()[1] < 200_000_000
    finally:
        tracemalloc.stop()
    assert [column.to_list() for column in reading.columns] == [["1"], ["2"]]


def test_of_thousands_of_wrong_column_names_the_first_are_told_and_how_many_more():
    told = refused("a," * 5_000 + "b\n" + "1," * 5_000 + "2\n", "x.csv").splitlines()
    assert len(told) == 21
    assert "4,979 more such column names" in told[-1]


@pytest.mark.parametrize(
    ("name", "before", "ours", "theirs", "after"),
    [
        ("x.json", "[\n", '{"a": 1}', '{"a": 2}', "]"),
        ("x.jsonl", '{"a": 0}\n', '{"a": 1}', '{"a": 2}', ""),
        ("x.dmn", '<definitions xmlns="https://www.omg.org/spec/DMN/20191111/MODEL/">\n', "<decision/>", "<a/>", "</definitions>"),
    ],
)
def test_a_git_conflict_in_a_file_of_any_kind_is_named_with_its_line(name: str, before: str, ours: str, theirs: str, after: str):
    told = refused(before + CONFLICT.format(ours=ours, theirs=theirs) + after, name)
    assert "line 2: an unresolved git conflict starts here" in told


def test_a_part_of_a_workbook_that_is_packed_like_a_bomb_is_named():
    whole = io.BytesIO(write(Table.from_columns({"Asset": ["x"]}), FORMATS["xlsx"])[0])
    packed = io.BytesIO()
    with zipfile.ZipFile(whole) as old, zipfile.ZipFile(packed, "w", zipfile.ZIP_DEFLATED) as new:
        for name in old.namelist():
            new.writestr(name, old.read(name) + b" " * (40_000_000 if name.endswith("sheet1.xml") else 0))
    told = refused(packed.getvalue(), "x.xlsx")
    assert "xl/worksheets/sheet1.xml would unpack from" in told
    assert "as a bomb does" in told
