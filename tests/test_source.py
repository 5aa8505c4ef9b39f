"""Reading CSV: the same texts as Python's csv module, and every fault with its place, what is accepted and the nearest mend."""

import csv
import io
import zipfile
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


@pytest.mark.parametrize(
    ("raw", "found"), [(b"", "the file is empty."), (b"\xef\xbb\xbf", "blank lines only"), (b"\r\n\n", "blank lines only")]
)
def test_an_empty_file_is_refused(raw: bytes, found: str):
    message = fault_of(raw)
    assert message.startswith("t.csv: the file ")
    assert found in message
    assert "Accepted: a header line" in message


def workbook() -> bytes:
    out = io.BytesIO()
    with zipfile.ZipFile(out, "w") as archive:
        archive.writestr("[Content_Types].xml", "<Types/>")
        archive.writestr("xl/workbook.xml", "<workbook/>")
    return out.getvalue()


def archive() -> bytes:
    out = io.BytesIO()
    with zipfile.ZipFile(out, "w") as file:
        file.writestr("table.csv", "a,b\n")
    return out.getvalue()


@pytest.mark.parametrize(
    ("raw", "kind"),
    [
        (b"\x89PNG\r\n\x1a\n\0\0\0\rIHDR", "a PNG image"),
        (workbook(), 'an Excel workbook (.xlsx). Accepted: CSV text in UTF-8. Try to save it as "CSV UTF-8"'),
        (archive(), "a ZIP archive"),
        (b"PAR1\x15\x04\0\0", "a Parquet file. Accepted: CSV text in UTF-8. Did you mean the suffix .parquet?"),
        (b"\xd0\xcf\x11\xe0\xa1\xb1\x1a\xe1", "an old Excel workbook (.xls)"),
        (b"SQLite format 3\0", "an SQLite database"),
        (b"\x1f\x8b\x08\0", "a gzip archive"),
    ],
)
def test_a_binary_file_named_csv_is_told_by_its_first_bytes(raw: bytes, kind: str):
    assert f"t.csv: not a text file: looks like {kind}" in fault_of(raw)


def test_other_binary_data_is_refused_with_the_line_of_its_first_nul_byte():
    assert fault_of(b"a,b\n1,\0\n\0,2\n") == (
        "t.csv, line 2: not a text file: it contains 2 NUL bytes, the first on this line. Accepted: CSV text in UTF-8."
    )


@pytest.mark.parametrize("raw", ["a,b\n".encode("utf-16"), "a,b\n1,é\n".encode("utf-16-le"), "a,b\n".encode("utf-16-be")])
def test_utf16_is_named_and_utf8_asked_for(raw: bytes):
    assert fault_of(raw) == (
        "t.csv: the file is UTF-16 text. Accepted: UTF-8, with or without BOM. "
        'Try to save it as UTF-8 (Excel calls it "CSV UTF-8").'
    )


def test_bytes_of_an_old_encoding_are_refused_with_line_and_byte():
    assert fault_of("a,b\n1,2\ncafé,3\n".encode("latin-1")) == (
        't.csv, line 3: byte 0xE9 on this line is not UTF-8 (in Windows-1252 it would be "é"). '
        'Accepted: UTF-8, with or without BOM. Try to save it as UTF-8 (Excel calls it "CSV UTF-8").'
    )


@pytest.mark.parametrize(("mark", "said"), [(";", "2 semicolons"), ("\t", "2 tabs"), ("|", "2 vertical bars")])
def test_another_delimiter_is_named(mark: str, said: str):
    text = (
        '\n"Asset, Name",speed,mode\nA,"20, 9.99",x\n'.replace(",", mark)
        .replace(f"Asset{mark}", "Asset,")
        .replace(f"20{mark}", "20,")
    )
    assert fault_of(text) == (
        f"t.csv, line 2: the header has no comma but {said}. Accepted: commas between fields. Try to save it with commas."
    )


def test_semicolons_in_quotes_or_beside_commas_are_text():
    assert read('"a;b"\n1\n')[1] == [["a;b"], ["1"]]
    assert read("a;b,c\n1,2\n")[1][0] == ["a;b", "c"]


def test_a_git_lfs_pointer_is_not_taken_for_a_table():
    raw = b"version https://git-lfs.github.com/spec/v1\noid sha256:4d7a\nsize 12345\n"
    assert (
        fault_of(raw) == 't.csv: this is a Git LFS pointer, not the table itself. Accepted: the table. Try to run "git lfs pull".'
    )


def test_git_conflicts_are_named_and_never_read_as_rows():
    text = "a,b\n<<<<<<< HEAD\n1,2\n=======\n1,3\n>>>>>>> theirs\n4,5\n<<<<<<< HEAD\n6,7\n"
    first, second = faults_of(text)
    assert first.startswith(
        "t.csv, line 2: an unresolved git conflict starts here and ends on line 6. Accepted: one version of each row."
    )
    assert "keep one side and delete the lines" in first
    assert second.startswith("t.csv, line 8: an unresolved git conflict starts here. ")


def test_a_conflict_in_the_header_is_named_too():
    assert "git conflict starts here and ends on line 5" in fault_of("<<<<<<< HEAD\na,b\n=======\na,c\n>>>>>>> x\n1,2\n")


def test_a_cell_that_quotes_a_conflict_is_text():
    assert read('a,b\n"x\n<<<<<<< HEAD",1\n"<<<<<<< y",2\n')[1][1:] == [["x\n<<<<<<< HEAD", "1"], ["<<<<<<< y", "2"]]


@pytest.mark.parametrize(
    ("text", "kind"),
    [
        ('{"a": 1,\n "b": [2, 3]}\n', "JSON"),
        ("<!DOCTYPE html>\n<html>\n<p>Sign in</p>\n</html>\n", "HTML or XML"),
        ("<!DOCTYPE html>\n<html>a,b\n", "HTML or XML"),
        ('<?xml version="1.0"?>\n<a>1,2</a>\n', "HTML or XML"),
    ],
)
def test_json_and_html_are_named_before_their_faults(text: str, kind: str):
    assert faults_of(text)[0] == f"t.csv: not a CSV file: looks like {kind}. Accepted: CSV text in UTF-8."


# ---- headers


def test_a_name_that_stands_twice_is_refused_with_both_places():
    assert fault_of("a,b,c,b\n1,2,3,4\n") == (
        't.csv, line 1: the column name "b" appears twice, in fields 2 and 4. Accepted: each name once.'
    )


def test_a_name_three_times_is_two_faults():
    assert len(faults_of("a,a,a\n")) == 2


def test_an_empty_name_is_refused_with_its_field():
    first, second = faults_of("a, ,b,\n1,2,3,4\n")
    assert first == "t.csv, line 1: field 2 of 4 column names is empty. Accepted: a name for each column."
    assert second == "t.csv, line 1: the last of 4 column names is empty. Accepted: a name for each column."


# ---- records


def test_ragged_rows_are_listed_each_with_its_line_and_how_many_fields_it_has():
    text = 'a,b,c\n1,2,3\n1,2\n"x\ny",2,3\nB,20, 9.99,5\n1,2,3\n'
    assert faults_of(text) == [
        "t.csv, line 3: found 2 fields, the header has 3. Accepted: a field for each column, empty ones for Any.",
        "t.csv, line 6: found 4 fields, the header has 3. Accepted: a cell with a comma in it in double quotes. "
        'Did you mean "20, 9.99", in quotes?',
    ]


def test_of_many_ragged_rows_the_first_are_listed_and_the_others_counted():
    messages = faults_of("a,b\n" + "1,2\n" * 5000 + "1,2,3\n" * 1000)
    assert len(messages) == MOST_FAULTS + 1
    assert messages[0].startswith("t.csv, line 5002: found 3 fields")
    assert messages[-1] == "t.csv: 980 more rows of another length; the header has 2."


def test_when_most_rows_agree_the_header_is_at_fault():
    first, second = faults_of("a,b\n1,2,3\n1,2,3\n4,5\n1,2,3\n")
    assert first == "t.csv, line 1: the header has 2 fields, but 3 of 4 rows have 3. Accepted: one name for each field of a row."
    assert second.startswith("t.csv, line 4: found 2 fields, most rows have 3.")


def test_an_unclosed_quote_is_named_at_the_line_where_it_opens():
    assert fault_of('a,b\n1,2\n3,"4\n5,6\n') == (
        "t.csv, line 3: the quoted field that opens here is never closed: '\"4'. "
        "Accepted: a field in double quotes from its start to its end, each quote in it doubled. "
        "Try to close it on this line."
    )


def test_an_unclosed_quote_before_quoted_cells_is_named_where_it_opens_and_hides_nothing_after():
    messages = faults_of('a,b\nA,"20, 9.99\nB,"30, 5"\nC,1\nD,1,2\n"E""e,3\n')
    assert [m.split(":")[0] for m in messages] == ["t.csv, line 2", "t.csv, line 5", "t.csv, line 6"]
    assert "the quoted field that opens here runs on for 1 line and past the next quote: '\"20, 9.99'" in messages[0]
    assert "found 3 fields" in messages[1]
    assert "never closed" in messages[2]


def test_a_quote_inside_a_field_must_be_doubled():
    assert fault_of('a,b\n1,5" tall\n') == (
        "t.csv, line 2: a quote is inside the field '5\" tall'. "
        'Accepted: a field in double quotes from its start to its end, each quote in it doubled. Did you mean "5"" tall"?'
    )
    assert 'Did you mean "say ""hi"" now"?' in fault_of('a,b\n1,"say "hi" now"\n')


def test_every_stray_quote_of_a_file_is_reported_up_to_a_number():
    text = "a,b\n" + 'x"y,1\n' * 3 + "1,2\n" * 3
    assert [m.split(":")[0] for m in faults_of(text)] == ["t.csv, line 2", "t.csv, line 3", "t.csv, line 4"]
    many = faults_of("a,b\n" + 'x"y,1\n' * 300)
    assert len(many) == MOST_FAULTS + 1
    assert "more fields with wrong quotes" in many[-1]


def test_faults_of_all_kinds_come_together_in_the_order_of_lines():
    messages = faults_of('a,a\n1\n"x"y,2\n3,4,5\n' + "z" * 70_000 + ",1\n")
    assert [m.split(":")[0] for m in messages] == [f"t.csv, line {n}" for n in (1, 2, 3, 4, 5)]


def test_a_cell_of_ten_megabytes_is_refused_by_its_size_and_not_printed():
    message = fault_of("a,b\n1,2\n3,é" + "x" * 10_000_000 + "\n")
    assert message == "t.csv, line 3: field 2 has 10,000,001 characters. Accepted: at most 65,536 characters in a cell."


def test_the_longest_cell_that_may_be_is_read():
    text = "é" * MOST_CHARACTERS
    assert read(f"a,b\n1,{text}\n")[1][1][1] == text
    assert "65,537" in fault_of(f'a,b\n1,"{text}\n"\n')


def test_a_long_record_of_short_cells_is_no_fault():
    names = ",".join(f"c{i}" for i in range(20_000))
    assert len(read(f"{names}\n{names}\n")[1][0]) == 20_000
