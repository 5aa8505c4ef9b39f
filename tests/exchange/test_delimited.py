"""Texts with delimiters: the dialects that Excel writes are told apart, and what was decided is said."""

import pytest

from contextdb.exchange.formats import ReadOptions, read
from contextdb.exchange.importing import decimal_commas_reported
from contextdb.exchange.mapping import propose
from contextdb.exchange.reading import Reading
from contextdb.schema.settings import EMPTY, TableSettings


def texts(reading: Reading) -> dict[str, list[str]]:
    return {column.name: column.to_list() for column in reading.columns}


def told(reading: Reading) -> str:
    return "\n".join(map(str, reading.remarks))


@pytest.mark.parametrize(("mark", "named"), [(";", "semicolons"), ("\t", "tabs"), ("|", "vertical bars")])
def test_the_delimiter_is_told_from_the_first_records_and_explained(mark: str, named: str):
    raw = mark.join("abc").encode() + b"\n" + mark.join(["jog", "20, 9.99", f'"x{mark}y"']).encode() + b"\n"
    reading = read(raw, "x.csv")
    assert texts(reading) == {"a": ["jog"], "b": ["20, 9.99"], "c": [f"x{mark}y"]}
    assert f"{named} between the fields: 3 in the first line and in 1 of the next 1." in told(reading)


def test_the_sep_line_of_excel_is_obeyed_and_is_no_row():
    reading = read(b"sep=;\r\na;b\r\n1;2\r\n", "x.csv")
    assert texts(reading) == {"a": ["1"], "b": ["2"]}
    assert "semicolons between the fields, as the line" in told(reading)


@pytest.mark.parametrize("encoding", ["utf-8-sig", "utf-16", "utf-16-le", "utf-16-be"])
def test_unicode_in_every_dress_is_read(encoding: str):
    raw = "Größe;b\r\nä;ß\r\nplain ascii follows;here\r\n".encode(encoding)
    assert texts(read(raw, "x.csv"))["Größe"][0] == "ä"


def test_text_of_old_windows_programs_is_read_and_said_to_be_a_guess():
    reading = read("a;b\ngrün;1\n".encode("cp1252"), "x.csv")
    assert texts(reading)["a"] == ["grün"]
    assert 'line 2: byte 0xFC is not UTF-8; the file is read as Windows-1252: "a;b\\ngrün;1"' in told(reading)
    assert any(remark.is_loss for remark in reading.remarks)


@pytest.mark.parametrize(
    ("cell", "point"),
    [
        ("3,5", "3.5"),
        ("0,5..1,25", "0.5..1.25"),
        ("20,5, 9,99", "20.5, 9.99"),
        ("<=1,5 | >9", "<=1.5 | >9"),
        ("not 1,5", "not 1.5"),
    ],
)
def test_decimal_commas_become_points_where_no_number_has_one(cell: str, point: str):
    reading = read(f"a;speed\nCB,FS;{cell}\nx;{cell}\n".encode(), "x.csv")
    assert texts(reading) == {"a": ["CB,FS", "x"], "speed": [point, point]}
    assert 'column "speed": decimal commas became points' in told(reading)


def commas(reading: Reading) -> str:
    columns = propose(reading, EMPTY, TableSettings("t"))
    return "\n".join(decimal_commas_reported(columns, reading, EMPTY, "--decimal comma"))


def test_a_comma_is_a_pair_where_other_numbers_have_points():
    reading = read(b"a;speed\nx;3,5\ny;3.5\n", "x.csv")
    assert texts(reading)["speed"] == ["3,5", "3.5"]
    assert 'with a comma, "3,5" in row 1, read as centre and tolerance, 3 ± 5; --decimal comma reads 3.5.' in commas(reading)


def test_in_tab_separated_text_a_comma_is_a_pair_unless_said_otherwise():
    reading = read(b"a\tspeed\nx\t3,5\n", "x.tsv")
    assert texts(reading)["speed"] == ["3,5"]
    assert "read as centre and tolerance, 3 ± 5; --decimal comma reads 3.5." in commas(reading)
    assert texts(read(b"a\tspeed\nx\t3,5\n", "x.tsv", ReadOptions(is_decimal_comma=True)))["speed"] == ["3.5"]


def test_a_person_may_say_what_a_comma_is():
    raw = b"a;speed\nx;3,5\n"
    assert texts(read(raw, "x.csv", ReadOptions(is_decimal_comma=False)))["speed"] == ["3,5"]
    assert texts(read(raw + b"y;2.5\n", "x.csv", ReadOptions(is_decimal_comma=True)))["speed"] == ["3.5", "2.5"]


def test_two_texts_that_become_one_with_points_stay_two_rows():
    reading = read(b"a;b\nx;1,0\ny;1.0\n", "x.csv", ReadOptions(is_decimal_comma=True))
    assert texts(reading)["b"] == ["1.0", "1.0"]


def test_line_ends_of_every_kind_and_line_ends_in_quotes_are_read():
    for end in ("\n", "\r\n", "\r"):
        assert texts(read(f'a;b{end}"x{end}y";2{end}{end}z;3'.encode(), "x.csv"))["a"] == [f"x{end}y", "z"]


def test_blank_lines_are_left_out_and_told_with_the_first_of_them():
    reading = read(b"a;b\n1;2\n;\n\n3;4\n;;\n", "x.csv")
    assert texts(reading) == {"a": ["1", "3"], "b": ["2", "4"]}
    assert "2 blank lines left out." in told(reading)


def test_missing_fields_at_the_end_of_a_line_are_empty_and_told():
    reading = read(b"a;b;c\nx;1\ny;1;2\n", "x.csv")
    assert texts(reading)["c"] == ["", "2"]
    assert "line 2: 1 line with fewer than 3 fields" in told(reading)


def test_a_line_of_equal_signs_alone_is_no_conflict():
    assert texts(read(b"a\tb\n=======\t1\n", "x.tsv"))["a"] == ["======="]


def test_one_column_needs_no_delimiter():
    reading = read("name\njog\nrün\n".encode("utf-16"), "x.csv")
    assert texts(reading) == {"name": ["jog", "rün"]}
