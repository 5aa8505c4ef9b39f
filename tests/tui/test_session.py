"""A table that is being edited: its file, its journal, its saves."""

from __future__ import annotations

import shutil
from pathlib import Path
from tempfile import TemporaryDirectory

import pytest
from edit_strategies import edits_of
from hypothesis import given
from hypothesis import strategies as st

from contextdb.errors import FileError
from contextdb.parquet import rewritten_parquet
from contextdb.source import read_csv
from tui.model.journal import journal_path
from tui.model.session import Session, bytes_for

RAW = b'Asset,speed,hit\r\nwalk,"0..5",True\nrun,5; 9,Any\njump,Any,False\n'


@pytest.fixture
def path(tmp_path: Path) -> Path:
    file = tmp_path / "t.csv"
    file.write_bytes(RAW)
    return file


def type_into(session: Session, row: int, column: int, text: str) -> None:
    session.sheet.go(row, column)
    assert session.sheet.type_text(text) is None


def test_a_table_with_a_cell_that_cannot_be_read_opens_and_saves_the_rest_byte_for_byte(path):
    session = Session(path)
    type_into(session, 0, 2, "False")
    session.save()
    session.close()
    assert path.read_bytes() == RAW.replace(b"True", b"False")
    assert not journal_path(path).exists()


def test_saving_without_an_edit_gives_the_same_bytes(path):
    session = Session(path)
    session.save()
    session.close()
    assert path.read_bytes() == RAW


def test_an_editor_that_was_killed_leaves_its_edits_to_the_next(path):
    killed = Session(path)
    type_into(killed, 0, 0, "stroll")
    killed.lock.release()
    session = Session(path)
    assert session.n_recovered == 1
    assert session.sheet.table.assets[0] == "stroll"
    assert session.sheet.is_modified
    session.sheet.undo()
    assert bytes_for(session.sheet.table, path) == RAW
    session.close()


def test_a_second_editor_is_told_and_takes_no_edits_of_the_first(path):
    first = Session(path)
    type_into(first, 0, 0, "stroll")
    second = Session(path)
    assert second.holder.id == first.lock.id
    assert second.n_recovered == 0
    second.close()
    assert journal_path(path).exists()
    first.close()


def test_a_file_that_somebody_else_changed_is_not_overwritten_unasked(path):
    session = Session(path)
    type_into(session, 0, 0, "stroll")
    path.write_bytes(RAW + b"new,Any,Any\n")
    assert session.is_changed_on_disk
    with pytest.raises(FileError, match="changed since"):
        session.save()
    assert path.read_bytes().endswith(b"new,Any,Any\n")
    session.save(overwrite=True)
    assert path.read_bytes() == RAW.replace(b"walk", b"stroll")
    assert not session.is_changed_on_disk
    session.close()


def test_a_table_saved_elsewhere_goes_on_there(path):
    session = Session(path)
    type_into(session, 0, 0, "stroll")
    other = path.with_name("other.csv")
    session.save(other)
    assert path.read_bytes() == RAW
    type_into(session, 0, 0, "amble")
    session.save()
    session.close()
    assert other.read_bytes() == RAW.replace(b"walk", b"amble")


@given(st.data(), st.sampled_from(["t.csv", "t.parquet"]))
def test_what_is_announced_to_the_journal_is_what_a_save_writes(data, name):
    with TemporaryDirectory() as folder:
        file = Path(folder) / name
        source, columns = read_csv(RAW, "t.csv")
        raw = RAW if name == "t.csv" else rewritten_parquet(columns, None, -1 + 0 * source.starts[:3]).raw
        file.write_bytes(raw)
        session = Session(file)
        for _ in range(2):
            session.sheet.apply(data.draw(edits_of(session.sheet.table)))
        announced = bytes_for(session.sheet.table, file)
        session.save()
        session.close()
        assert file.read_bytes() == announced
        shutil.rmtree(file.parent / ".contextdb-journal")
