"""`Table.save` beside others who write the same file: merged cell by cell, or refused with the cells that disagree."""

import subprocess
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st
from warm_start import python

from contextdb.errors import FileError
from contextdb.tables.project import load
from contextdb.tables.table import Table

ROOT = Path(__file__).parent.parent
RAW = b"Asset,speed,hit\r\nwalk,0..5,True\r\nrun,5..9,Any\r\njump,Any,False\r\n"

EDITING = """
import sys
import contextdb as cdb

file, column, n = sys.argv[1], sys.argv[2], int(sys.argv[3])
for i in range(n):
    table = cdb.load(file)
    table.with_cell(i % table.n_rows, column, str(i)).save()
"""


@pytest.fixture(params=["t.csv", "t.parquet"])
def path(tmp_path: Path, request: pytest.FixtureRequest) -> Path:
    file = tmp_path / "t.csv"
    file.write_bytes(RAW)
    load(file).save(tmp_path / request.param)
    return tmp_path / request.param


def cells(path: Path) -> list[list[str]]:
    return [column.to_list() for column in load(path, strict=False).columns]


def told(table: Table) -> str:
    with pytest.raises(FileError) as caught:
        table.save()
    (fault,) = caught.value.faults
    assert fault.rule == "merge-conflict"
    return fault.message


def test_edits_of_two_who_read_the_same_file_are_both_in_it(path):
    a, b = load(path).with_cell(0, "speed", "1"), load(path).with_cell(2, "speed", "2")
    a.save()
    saved = b.save()
    assert cells(path)[1] == saved.text_column("speed").to_list() == ["1", "5..9", "2"]
    assert [str(c) for c in saved.assets] == ["walk", "run", "jump"]


def test_a_merged_table_goes_on_from_what_stands_in_the_file(path):
    a, b = load(path).with_cell(0, "speed", "1"), load(path).with_cell(2, "speed", "2")
    a.save()
    b.save().with_cell(0, "hit", "False").save()
    assert cells(path)[1:] == [["1", "5..9", "2"], ["False", "Any", "False"]]


def test_lines_that_others_wrote_keep_their_bytes(tmp_path):
    file = tmp_path / "t.csv"
    file.write_bytes(RAW)
    table = load(file).with_cell(2, "speed", "2")
    file.write_bytes(RAW.replace(b"walk,0..5", b'"walk","0..4"') + b"\r\nland,,\r\n")
    table.save()
    assert file.read_bytes() == RAW.replace(b"walk,0..5", b'"walk","0..4"').replace(b"jump,Any", b"jump,2") + b"\r\nland,,\r\n"


def test_a_cell_that_both_changed_is_named_with_both_ways_out_and_the_file_stays(path):
    a, b = load(path).with_cell(0, "speed", "1"), load(path).with_cell(0, "speed", "2").with_cell(1, "speed", "3")
    a.save()
    raw = path.read_bytes()
    said = told(b)
    assert 'in 1 place differently than here: walk, speed is "2" here and "1" in the file.' in said
    assert "to load it again and repeat the edits, or save(overwrite=True)" in said
    assert path.read_bytes() == raw
    assert list(path.parent.glob(".contextdb-*")) == []


def test_many_cells_that_both_changed_are_counted(path):
    a, b = load(path), load(path)
    for row in range(3):
        a, b = (t.with_cell(row, "speed", str(i)).with_cell(row, "hit", h) for i, (t, h) in enumerate([(a, "True"), (b, "False")]))
    a.save()
    assert "; and 1 more." in told(b) or "; and 2 more." in told(b)


def test_overwrite_writes_over_what_others_wrote(path):
    a, b = load(path).with_cell(0, "speed", "1"), load(path).with_cell(0, "speed", "2")
    a.save()
    b.save(overwrite=True)
    assert cells(path)[1] == ["2", "5..9", "Any"]


def test_another_file_is_written_over_whatever_it_holds(path):
    other = path.with_name(f"other{path.suffix}")
    load(path).with_cell(0, "speed", "1").save(other)
    load(path).with_cell(0, "speed", "2").save(other)
    assert cells(other)[1] == ["2", "5..9", "Any"]


def test_the_own_file_under_another_name_is_the_own_file(path, monkeypatch):
    a, b = load(path).with_cell(0, "speed", "1"), load(path).with_cell(2, "speed", "2")
    a.save()
    monkeypatch.chdir(path.parent)
    b.save(path.name)
    assert cells(path)[1] == ["1", "5..9", "2"]


def test_a_file_that_is_gone_is_made_anew(path):
    table = load(path).with_cell(0, "speed", "1")
    path.unlink()
    table.save()
    assert cells(path)[1] == ["1", "5..9", "Any"]


@pytest.mark.parametrize("theirs", [b"", b'a,b\n"open', b"Asset,x\nfoo,1\nbar,2\n", b"PAR1 nothing"])
def test_a_file_that_is_no_table_any_more_or_another_one_is_refused(path, theirs):
    table = load(path).with_cell(0, "speed", "1")
    path.write_bytes(theirs)
    assert "the file has been changed since it was read" in told(table)
    assert path.read_bytes() == theirs


def test_a_table_that_nobody_edited_does_not_take_back_what_others_wrote(path):
    untouched = load(path)
    load(path).with_cell(0, "speed", "1").save()
    untouched.save()
    assert cells(path)[1] == ["1", "5..9", "Any"]


@given(st.data())
def test_two_sides_edits_of_different_cells_are_both_in_the_file(tmp_path_factory, data):
    file = tmp_path_factory.mktemp("save") / "t.csv"
    file.write_bytes(RAW)
    places = [(row, column) for row in range(3) for column in ("speed", "hit")]
    owners = [data.draw(st.sampled_from(["a", "b", ""])) for _ in places]
    sides = {"a": load(file), "b": load(file)}
    expected = {(row, column): sides["a"].text(row, column) for row, column in places}
    for (row, column), owner in zip(places, owners, strict=True):
        if owner:
            expected[row, column] = data.draw(st.sampled_from(["1", "2..3", "Any"] if column == "speed" else ["True", "False"]))
            sides[owner] = sides[owner].with_cell(row, column, expected[row, column])
    sides["a"].save()
    sides["b"].save()
    now = load(file)
    assert {place: now.text(*place) for place in places} == expected


def test_two_processes_that_load_edit_and_save_lose_nothing(tmp_path):
    n_rows, n = 10, 20
    file = tmp_path / "t.csv"
    file.write_text("Asset,a,b\n" + "".join(f"r{i},Any,Any\n" for i in range(n_rows)), encoding="utf-8")
    commands = [python("-c", EDITING, file, column, str(n)) for column in ("a", "b")]
    started = [subprocess.Popen(command, cwd=ROOT, stderr=subprocess.PIPE, text=True) for command in commands]
    for process in started:
        said = process.communicate()[1]
        assert (process.returncode, said) == (0, "")
    last = [str(i) for i in range(n - n_rows, n)]
    assert cells(file)[1:] == [last, last]
    assert [p.name for p in tmp_path.iterdir()] == ["t.csv"]
