"""Reading CSV: the same texts as Python's csv module, and every fault with its place, what is accepted and the nearest mend."""

import csv
import io
from unittest.mock import patch

import numpy as np
import pytest
from csv_files import CsvFile, csv_files, strict_records
from hypothesis import given
from hypothesis import strategies as st

from contextdb.errors import TableError
from contextdb.files import csv_source
from contextdb.files.csv_source import MOST_CHARACTERS, MOST_FAULTS, Source, read_csv


def as_python_reads(text: str) -> list[list[str]]:
    """The records of a CSV by the csv module, blank lines left out."""
    return [row for row in csv.reader(io.StringIO(text.removeprefix("\ufeff"), newline=""), strict=True) if row]


def read(text: str) -> tuple[Source, list[list[str]]]:
    """Source, and the rows that were read, the header first."""
    source, columns = read_csv(text.encode(), "t.csv")
    return source, [[c.name for c in columns], *map(list, zip(*(c.to_list() for c in columns), strict=True))]


def outcome(raw: bytes) -> Source | TableError:
    """What comes of some bytes; anything but these two fails the test."""
    try:
        return read_csv(raw, "t.csv")[0]
    except TableError as error:
        return error


def faults_of(raw: bytes | str) -> list[str]:
    """The messages of a file that is refused."""
    with pytest.raises(TableError) as caught:
        read_csv(raw if isinstance(raw, bytes) else raw.encode(), "t.csv")
    return str(caught.value).split("\n")


def fault_of(raw: bytes | str) -> str:
    """The one message of a file that is refused."""
    (message,) = faults_of(raw)
    return message


# ---- what is read


@given(csv_files())
def test_a_file_reads_as_pythons_csv_module_reads_it(file: CsvFile):
    _, rows = read(file.text)
    assert rows == as_python_reads(file.text) == [file.names, *file.rows]


@given(csv_files())
def test_texts_and_codes_are_the_same_by_polars_and_by_python(file: CsvFile):
    def columns() -> list[tuple[str, tuple[str, ...], str, list[int]]]:
        return [(c.name, c.texts, str(c.codes.dtype), c.codes.tolist()) for c in read_csv(file.text.encode(), "t.csv")[1]]

    assert len(file.rows) <= csv_source.FEW_ROWS
    by_python = columns()
    with patch.object(csv_source, "FEW_ROWS", -1):
        assert columns() == by_python


@given(st.text(st.sampled_from('ab,"\n\r '), max_size=24))
def test_any_text_is_read_as_the_strict_grammar_says_or_refused(body: str):
    text = "a,b\n" + body
    records = strict_records(text)
    if records is None or any(len(fields) != 2 for fields in records):
        with pytest.raises(TableError):
            read(text)
    else:
        assert read(text)[1] == as_python_reads(text)


@given(st.text(st.sampled_from('ab,"\n;'), min_size=1, max_size=12))
def test_any_text_at_all_gives_a_table_or_a_message(text: str):
    found = outcome(text.encode())
    assert found.n_records >= 0 if isinstance(found, Source) else found.faults[0].place.file == "t.csv"


@given(st.binary(max_size=40))
def test_any_bytes_give_a_table_or_a_message(raw: bytes):
    found = outcome(raw)
    assert found.columns[0].n_rows == found.n_records if isinstance(found, Source) else found.faults[0].found


@given(csv_files())
def test_each_record_knows_its_line(file: CsvFile):
    source, _ = read(file.text)
    for record in range(source.n_records):
        before = file.raw[: source.starts[record + 1]].decode()
        assert source.line(record) == 1 + before.replace("\r\n", "\n").replace("\r", "\n").count("\n")


def test_records_that_cross_a_word_or_a_block_of_bits_are_read_whole():
    rows = [["x" * (n % 70), f'a,"{n}"\nb' * (n % 3)] for n in range(30_000)]
    out = io.StringIO()
    csv.writer(out).writerows([["a", "b"], *rows])
    assert len(out.getvalue()) > 2**20
    assert read(out.getvalue())[1][1:] == rows


def test_texts_are_kept_once_and_in_the_order_they_appear():
    _, columns = read_csv(b'a,b\nAny,1\nx,2\nAny,\n"x",""\n', "t.csv")
    assert columns[0].texts == ("Any", "x")
    assert columns[0].codes.tolist() == [0, 1, 0, 1]
    assert columns[0].codes.dtype == np.int32
    assert columns[1].texts == ("1", "2", "")


def test_a_header_alone_is_a_table_without_rows():
    source, rows = read("Asset Name,speed\n")
    assert rows == [["Asset Name", "speed"]]
    assert source.n_records == 0


def test_spaces_belong_to_the_text():
    assert read("a, b\n x ,\ty\n")[1] == [["a", " b"], [" x ", "\ty"]]


def test_line_ends_inside_quotes_come_through_unchanged():
    assert read('a,b\r\n"x\r\ny","p\nq\rr"\r\n')[1][1] == ["x\r\ny", "p\nq\rr"]


def test_blank_lines_are_no_rows():
    assert read("\n\na,b\n\n1,2\n\r\n\n3,4\n\n")[1] == [["a", "b"], ["1", "2"], ["3", "4"]]


def test_a_first_cell_that_begins_with_a_byte_order_mark_keeps_it():
    assert read("\ufeffa,b\n\ufeffx,1\n")[1] == [["a", "b"], ["\ufeffx", "1"]]
    assert read("a,b\n\n\ufeffx,1\n")[1] == [["a", "b"], ["\ufeffx", "1"]]


def test_a_file_says_which_line_ends_it_has_and_whether_they_are_mixed():
    assert read("a,b\n1,2\n")[0].line_ends == {"\n": 2}
    assert read("a,b\r\n1,2")[0].line_ends == {"\r\n": 1}
    assert read("a,b\r1,2\r")[0].line_ends == {"\r": 2}
    assert read('a,b\r\n"1\n",2\r\n3,4\n')[0].line_ends == {"\r\n": 2, "\n": 1}


def test_a_classic_mac_file_is_read_by_its_lone_returns():
    source, rows = read("a,b\r1,2\r3,4\r")
    assert rows == [["a", "b"], ["1", "2"], ["3", "4"]]
    assert source.line(1) == 3


# ---- files that are no CSV


def test_semicolons_in_quotes_or_beside_commas_are_text():
    assert read('"a;b"\n1\n')[1] == [["a;b"], ["1"]]
    assert read("a;b,c\n1,2\n")[1][0] == ["a;b", "c"]


def test_a_cell_that_quotes_a_conflict_is_text():
    assert read('a,b\n"x\n<<<<<<< HEAD",1\n"<<<<<<< y",2\n')[1][1:] == [["x\n<<<<<<< HEAD", "1"], ["<<<<<<< y", "2"]]


# ---- headers


# ---- records


def test_of_many_ragged_rows_the_first_are_listed_and_the_others_counted():
    messages = faults_of("a,b\n" + "1,2\n" * 5000 + "1,2,3\n" * 1000)
    assert len(messages) == MOST_FAULTS + 1
    assert messages[0].startswith("t.csv, line 5002: found 3 fields")
    assert messages[-1] == "t.csv: 980 more rows of another length; the header has 2."


def test_an_unclosed_quote_before_quoted_cells_is_named_where_it_opens_and_hides_nothing_after():
    messages = faults_of('a,b\nA,"20, 9.99\nB,"30, 5"\nC,1\nD,1,2\n"E""e,3\n')
    assert [m.split(":")[0] for m in messages] == ["t.csv, line 2", "t.csv, line 5", "t.csv, line 6"]
    assert "the quoted field that opens here runs on for 1 line and past the next quote: '\"20, 9.99'" in messages[0]
    assert "found 3 fields" in messages[1]
    assert "never closed" in messages[2]


def test_every_stray_quote_of_a_file_is_reported_up_to_a_number():
    text = "a,b\n" + 'x"y,1\n' * 3 + "1,2\n" * 3
    assert [m.split(":")[0] for m in faults_of(text)] == ["t.csv, line 2", "t.csv, line 3", "t.csv, line 4"]
    many = faults_of("a,b\n" + 'x"y,1\n' * 300)
    assert len(many) == MOST_FAULTS + 1
    assert "more fields with wrong quotes" in many[-1]


def test_the_longest_cell_that_may_be_is_read():
    text = "é" * MOST_CHARACTERS
    assert read(f"a,b\n1,{text}\n")[1][1][1] == text
    assert "65,537" in fault_of(f'a,b\n1,"{text}\n"\n')


def test_a_long_record_of_short_cells_is_no_fault():
    names = ",".join(f"c{i}" for i in range(20_000))
    assert len(read(f"{names}\n{names}\n")[1][0]) == 20_000
