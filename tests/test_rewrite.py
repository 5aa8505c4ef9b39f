"""Writing CSV: what nobody changed keeps its bytes, whatever freedom the file took with the format."""

import codecs
import csv
import io

import numpy as np
from csv_files import CELLS, CsvFile, csv_files, raw_lines, strict_records
from hypothesis import given
from hypothesis import strategies as st

from contextdb.columns import TextColumn
from contextdb.files.csv_rewrite import rewritten
from contextdb.files.csv_source import Source, read_csv

EDITS = st.one_of(CELLS, st.sampled_from(["<<<<<<< HEAD", "\ufeffx", "a;b", "x\r\ny", "-1"]))


def reread(raw: bytes) -> list[list[str]]:
    _, columns = read_csv(raw, "t.csv")
    return [[c.name for c in columns], *map(list, zip(*(c.to_list() for c in columns), strict=True))]


def lines_of(raw: bytes) -> list[str]:
    """The lines that hold a record, without their line ends."""
    text = raw.decode().removeprefix("\ufeff")
    return [line for line in (one.rstrip("\r\n") for one in raw_lines(text)) if line]


def same(source: Source) -> np.ndarray:
    return np.arange(source.n_records)


@given(csv_files())
def test_a_file_that_was_opened_and_saved_is_the_same_file(file: CsvFile):
    source, columns = read_csv(file.raw, "t.csv")
    assert rewritten(columns, source, same(source)).raw == file.raw


@given(csv_files(), st.data())
def test_an_edit_changes_its_field_and_no_other_byte(file: CsvFile, data: st.DataObject):
    source, columns = read_csv(file.raw, "t.csv")
    if not source.n_records:
        return
    row = data.draw(st.integers(0, source.n_records - 1))
    at = data.draw(st.integers(0, len(columns) - 1))
    text = data.draw(EDITS)
    start, stop = int(source.starts[row + 1]), int(source.stops[row + 1])
    new = rewritten([c.with_text(row, text) if i == at else c for i, c in enumerate(columns)], source, same(source)).raw
    assert new.startswith(file.raw[:start])
    assert new.endswith(file.raw[stop:])
    assert reread(new)[1:] == [[text if (r, c) == (row, at) else t for c, t in enumerate(ts)] for r, ts in enumerate(file.rows)]
    (before,) = strict_records(file.raw[start:stop].decode())
    (after,) = strict_records(new[start : len(new) - len(file.raw) + stop].decode())
    assert [f for i, f in enumerate(after) if i != at] == [f for i, f in enumerate(before) if i != at]


@given(csv_files(), st.data())
def test_rows_that_are_moved_taken_away_or_put_between_leave_the_bytes_of_all_others(file: CsvFile, data: st.DataObject):
    source, columns = read_csv(file.raw, "t.csv")
    rows = data.draw(st.lists(st.integers(-1, source.n_records - 1), max_size=8))
    new_texts = [data.draw(EDITS) for _ in columns]
    origin = np.array(rows, np.int64)
    taken = [TextColumn.of(c.name, [t if r < 0 else c[r] for r in rows]) for c, t in zip(columns, new_texts, strict=True)]
    result = rewritten(taken, source, origin)
    before, after = lines_of(file.raw), lines_of(result.raw)
    assert len(after) == len(rows) + 1
    assert after[0] == before[0]
    assert [line for line, r in zip(after[1:], rows, strict=True) if r >= 0] == [before[r + 1] for r in rows if r >= 0]
    assert reread(result.raw)[1:] == [new_texts if r < 0 else file.rows[r] for r in rows]


@given(csv_files(), st.data())
def test_the_new_source_is_what_reading_the_new_bytes_gives(file: CsvFile, data: st.DataObject):
    source, columns = read_csv(file.raw, "t.csv")
    origin = np.array(data.draw(st.lists(st.integers(-1, source.n_records - 1), max_size=8)), np.int64)
    texts = [[data.draw(EDITS) if r < 0 or data.draw(st.booleans()) else c[r] for r in origin.tolist()] for c in columns]
    result = rewritten([TextColumn.of(c.name, t) for c, t in zip(columns, texts, strict=True)], source, origin)
    again, read = read_csv(result.raw, "t.csv")
    assert [c.to_list() for c in read] == texts
    assert again.starts.tolist() == result.starts.tolist()
    assert again.stops.tolist() == result.stops.tolist()
    assert again.ends_with_line_end == source.ends_with_line_end
    assert again.raw.startswith(codecs.BOM_UTF8) == source.raw.startswith(codecs.BOM_UTF8)
    assert [again.line(r) for r in range(again.n_records)] == [result.line(r) for r in range(result.n_records)]


@given(csv_files(), st.data())
def test_columns_that_are_moved_renamed_added_or_taken_away_keep_their_raw_fields(file: CsvFile, data: st.DataObject):
    source, columns = read_csv(file.raw, "t.csv")
    field_of = data.draw(st.lists(st.integers(-1, len(columns) - 1), min_size=1, max_size=5))
    fresh = TextColumn.of("", data.draw(st.lists(EDITS, min_size=source.n_records, max_size=source.n_records)))
    names = data.draw(st.lists(CELLS.filter(str.strip), min_size=len(field_of), max_size=len(field_of), unique=True))
    moved = [(columns[f] if f >= 0 else fresh).renamed(n) for f, n in zip(field_of, names, strict=True)]
    new = rewritten(moved, source, same(source), field_of).raw
    assert reread(new) == [names, *map(list, zip(*(c.to_list() for c in moved), strict=True))]
    before, after = strict_records(file.text.removeprefix("\ufeff")), strict_records(new.decode().removeprefix("\ufeff"))
    for old, now in zip(before[1:], after[1:], strict=True):
        kept = [(old[f], now[i]) for i, f in enumerate(field_of) if f >= 0 and i > 0]
        assert all(a == b for a, b in kept)


@given(st.lists(st.lists(EDITS, min_size=2, max_size=2), max_size=5))
def test_a_fresh_file_is_what_pythons_csv_module_writes(rows: list[list[str]]):
    out = io.StringIO()
    csv.writer(out, lineterminator="\n").writerows([["a", "b"], *rows])
    columns = [TextColumn.of(name, [row[i] for row in rows]) for i, name in enumerate("ab")]
    raw = rewritten(columns, None, np.full(len(rows), -1)).raw
    assert reread(raw) == [["a", "b"], *rows]
    if not any(row[0].startswith("<<<<<<<") or "\r" in "".join(row) for row in rows):  # csv.writer forgets to quote a lone return
        assert raw.decode() == out.getvalue()


def written_after(text: str, change, origin=None) -> str:
    """The file after a change of its columns."""
    source, columns = read_csv(text.encode(), "t.csv")
    return rewritten(change(columns), source, same(source) if origin is None else np.array(origin, np.int64)).raw.decode()


def test_a_field_in_quotes_without_need_stays_in_quotes_when_it_is_edited():
    assert written_after('a,b\n"x",y\n', lambda cs: [c.with_text(0, "z") for c in cs]) == 'a,b\n"z",z\n'


def test_a_field_that_needed_its_quotes_loses_them_when_it_does_not():
    assert written_after('a,b\nx,"20, 9.99"\n', lambda cs: [cs[0], cs[1].with_text(0, "5")]) == "a,b\nx,5\n"


def test_a_new_row_is_written_in_the_files_own_style():
    assert written_after('"a","b"\r\n"x",1\r\n', lambda cs: [c.with_inserted(1, ["y"]) for c in cs], [0, -1]) == (
        '"a","b"\r\n"x",1\r\n"y",y\r\n'
    )


def test_a_new_row_ends_as_most_records_do():
    assert written_after("a\r\n1\n2\n", lambda cs: [c.with_inserted(0, ["0"]) for c in cs], [-1, 0, 1]) == "a\r\n0\n1\n2\n"


def test_a_file_without_a_last_line_end_stays_so_when_rows_are_added_moved_or_taken_away():
    text = "a,b\n1,2\n3,4"
    assert written_after(text, lambda cs: [c.with_inserted(2, ["5"]) for c in cs], [0, 1, -1]) == "a,b\n1,2\n3,4\n5,5"
    assert written_after(text, lambda cs: [c.with_rows_taken(np.array([1, 0])) for c in cs], [1, 0]) == "a,b\n3,4\n1,2"
    assert written_after(text, lambda cs: [c.with_rows_taken(np.array([0])) for c in cs], [0]) == "a,b\n1,2"
    assert written_after(text, lambda cs: [c.with_text(1, "9") for c in cs]) == "a,b\n1,2\n9,9"
    assert written_after(text, lambda cs: [c.with_rows_taken(np.array([], int)) for c in cs], []) == "a,b"


def test_blank_lines_stay_with_the_row_above_them():
    assert written_after("a\n\n1\n\n2\n", lambda cs: [c.with_rows_taken(np.array([1])) for c in cs], [1]) == "a\n\n2\n"
    assert written_after("a\n1\n\n2\n", lambda cs: [c.with_text(0, "x") for c in cs]) == "a\nx\n\n2\n"


def test_an_empty_text_in_a_table_of_one_column_is_no_blank_line():
    assert written_after("a\n1\n", lambda cs: [c.with_text(0, "") for c in cs]) == 'a\n""\n'


def test_a_text_that_reads_like_a_git_conflict_is_written_in_quotes():
    assert written_after("a,b\nx,1\n", lambda cs: [cs[0].with_text(0, "<<<<<<< HEAD"), cs[1]]) == 'a,b\n"<<<<<<< HEAD",1\n'


def test_a_header_that_reads_like_another_delimiter_is_written_in_quotes():
    assert rewritten([TextColumn.of("a;b", ["1;2"])], None, np.array([-1])).raw == b'"a;b"\n1;2\n'


def test_a_renamed_column_keeps_the_fields_of_the_header_beside_it():
    source, (a, b) = read_csv(b'"a",b\n1,"2"\n', "t.csv")
    assert rewritten([a, b.renamed("c")], source, same(source), [0, 1]).raw == b'"a",c\n1,"2"\n'


def test_rows_can_be_added_to_a_header_alone():
    assert written_after("\ufeffa,b\r\n", lambda cs: [c.with_inserted(0, ["1"]) for c in cs], [-1]) == "\ufeffa,b\r\n1,1\r\n"
