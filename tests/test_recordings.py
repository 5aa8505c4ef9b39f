"""Recorded contexts, looked at a few rows at a time."""

from pathlib import Path

import numpy as np
import polars as pl
import pytest
from hypothesis import given
from hypothesis import strategies as st

from contextdb.cells.conditions import Condition
from contextdb.cells.domains import BOOL, NUMBER, TAGS, TEXT, Domain
from contextdb.cells.facts import read_fact, read_fact_text
from contextdb.errors import FileError, TableError
from contextdb.telemetry import recordings
from contextdb.telemetry.recordings import fact_text, open_recording

CSV = 'frame,gait,speed\n1,Walk,"1, 2"\n\n2,Run,\n3,Idle,0\n'


def csv_of(tmp_path: Path, text: str | bytes = CSV, name: str = "m.csv") -> Path:
    path = tmp_path / name
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    return path


def parquet_of(tmp_path: Path, n_rows: int = 1000) -> Path:
    path = tmp_path / "m.parquet"
    frame = pl.DataFrame(
        {
            "frame": np.arange(n_rows),
            "speed": np.arange(n_rows) / 10,
            "gait": ["Idle", "Walk"] * (n_rows // 2),
            "tags": [["InAir", "Going Up"], None] * (n_rows // 2),
        }
    )
    frame.write_parquet(path, row_group_size=100)
    return path


def test_only_the_columns_that_are_asked_for_are_facts(tmp_path: Path):
    for path in (csv_of(tmp_path), parquet_of(tmp_path)):
        assert open_recording(path, {"speed", "gait", "height"}).facts in (("gait", "speed"), ("speed", "gait"))
        nothing = open_recording(path, {"height"})
        assert nothing.facts == ()
        assert nothing.read(0, 1).width == 0


def test_rows_of_a_csv_are_texts_and_blank_lines_are_none(tmp_path: Path):
    recording = open_recording(csv_of(tmp_path), {"speed", "gait"})
    assert recording.n_rows == 3
    assert recording.read(0, 1).rows() == [("Walk", "1, 2")]
    assert [row[0] for row in recording.read(1, 3).rows()] == ["Run", "Idle"]


@pytest.mark.parametrize("end", ["\n", "\r\n", "\r"])
def test_a_csv_may_have_any_line_ends_and_line_breaks_in_quotes(tmp_path: Path, end: str):
    recording = open_recording(csv_of(tmp_path, end.join(["speed,gait", '1,"a\nb"', "2,c"])), {"speed", "gait"})
    assert recording.read(0, recording.n_rows).rows() == [("1", "a\nb"), ("2", "c")]


def test_rows_of_a_parquet_file_keep_their_types(tmp_path: Path):
    recording = open_recording(parquet_of(tmp_path), {"speed", "tags"})
    assert recording.n_rows == 1000
    assert recording.read(998, 1000).rows() == [(99.8, ["InAir", "Going Up"]), (99.9, None)]


@pytest.mark.parametrize("suffix", [".csv", ".parquet"])
@pytest.mark.parametrize(
    ("text", "expected"),
    [("", [0, 1, 2]), ("gait=wa", [0]), ("RUN", [1]), ("i 0", [2]), ("speed=", [0, 2]), ("frame", []), ("walk idle", [])],
)
def test_a_search_finds_the_rows_with_every_word(tmp_path: Path, monkeypatch, suffix: str, text: str, expected: list[int]):
    monkeypatch.setattr(recordings, "SEARCHED_AT_ONCE", 2)
    path = csv_of(tmp_path)
    if suffix == ".parquet":
        pl.DataFrame({"gait": ["Walk", "Run", "Idle"], "speed": ["1, 2", None, "0"]}).write_parquet(tmp_path / "m.parquet")
        path = tmp_path / "m.parquet"
    found = list(open_recording(path, {"speed", "gait"}).search(text))
    assert len(found) == 2
    assert np.concatenate(found).tolist() == expected


def test_a_search_finds_tags_and_numbers(tmp_path: Path):
    recording = open_recording(parquet_of(tmp_path), {"speed", "tags"})
    assert np.concatenate(list(recording.search("going speed=9.8"))).tolist() == [98]


def test_names_that_polars_reads_as_patterns_are_names(tmp_path: Path):
    pl.DataFrame({"^a$": ["x", "y"], "*": ["y", "z"], "a": ["q", "q"]}).write_parquet(tmp_path / "m.parquet")
    recording = open_recording(tmp_path / "m.parquet", {"^a$", "*"})
    assert recording.facts == ("^a$", "*")
    assert np.concatenate(list(recording.search("*=y"))).tolist() == [0]


@pytest.mark.parametrize("raw", [b"", b"PK\x03\x04" + bytes(50), b"a,b\n1,2,3\n", b'a,b\n1,"2\n', b"a,a\n1,2\n", b"a,\n1,2\n"])
def test_a_csv_that_is_none_is_refused_with_its_place(tmp_path: Path, raw: bytes):
    with pytest.raises(TableError, match=r"m\.csv"):
        open_recording(csv_of(tmp_path, raw), {"a"})


def test_a_parquet_file_that_is_cut_short_is_refused(tmp_path: Path):
    path = parquet_of(tmp_path)
    path.write_bytes(path.read_bytes()[:-20])
    with pytest.raises(TableError, match=r"m\.parquet"):
        open_recording(path, {"speed"})


def test_a_parquet_file_that_goes_away_is_told_when_it_is_read(tmp_path: Path):
    path = parquet_of(tmp_path)
    recording = open_recording(path, {"speed"})
    path.unlink()
    with pytest.raises(FileError, match=r"m\.parquet"):
        recording.read(0, 1)


@pytest.mark.parametrize("name", ["m.csv", "m.parquet", "m.txt"])
def test_a_file_that_is_not_there_is_refused(tmp_path: Path, name: str):
    with pytest.raises(FileError):
        open_recording(tmp_path / name, {"speed"})


GAIT = Domain("enum", values=("Walk", "Half Way"))


@pytest.mark.parametrize(
    ("value", "domain", "text"),
    [
        (None, NUMBER, ""),
        (float("nan"), NUMBER, ""),
        (3.0, NUMBER, "3"),
        (0.1 + 0.2, NUMBER, "0.30000000000000004"),
        (-5, NUMBER, "-5"),
        ("0..5", NUMBER, "0..5"),
        (True, BOOL, "True"),
        ("Half Way", GAIT, "Half Way"),
        ("Any", TEXT, '"Any"'),
        ("a b", TEXT, '"a b"'),
        ([], TAGS, '""'),
        (["InAir", "Going Up"], TAGS, 'InAir "Going Up"'),
    ],
)
def test_a_value_becomes_the_text_of_a_fact(value, domain: Domain, text: str):
    assert fact_text(value, Condition("c", domain)) == text


@given(
    st.one_of(
        st.tuples(st.just(NUMBER), st.floats(allow_nan=False, allow_infinity=False)),
        st.tuples(st.just(BOOL), st.booleans()),
        st.tuples(st.just(TEXT), st.text(st.characters(exclude_categories=["Cs", "Cc"]), min_size=1)),
        st.tuples(st.just(GAIT), st.sampled_from(GAIT.values)),
        st.tuples(st.just(TAGS), st.lists(st.text("ab .+-", min_size=1).filter(str.strip))),
    )
)
def test_the_text_reads_as_the_value(case):
    condition = Condition("c", case[0])
    assert read_fact_text(fact_text(case[1], condition), condition) == read_fact(case[1], condition)
