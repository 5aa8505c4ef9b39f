"""A table that is being edited: its file, its journal, its saves."""

import errno
import os
import shutil
from pathlib import Path
from tempfile import TemporaryDirectory

import pytest
from edit_strategies import edits_of
from hypothesis import given
from hypothesis import strategies as st
from saved_bytes import bytes_for

from contextdb.disk import staged
from contextdb.disk.folder_lock import temporary_name
from contextdb.edits import edits
from contextdb.errors import ContextDBError, FileError, TableError
from contextdb.files.csv_source import read_csv
from contextdb.files.journal_lines import line_of
from contextdb.files.parquet import rewritten_parquet
from contextdb.tables.project import load
from contextdb.tables.table import Table
from tui.model import session as session_module
from tui.model.journal import journal_path
from tui.model.lock import Holder, Lock
from tui.model.session import MERGE_NAME, OnDisk, Session
from tui.model.views import Filter, Sort

RAW = b'Asset,speed,hit\r\nwalk,"0..5",True\nrun,5; 9,Any\njump,Any,False\n'


@pytest.fixture
def path(tmp_path: Path) -> Path:
    file = tmp_path / "t.csv"
    file.write_bytes(RAW)
    return file


def made(file: Path) -> Path:
    """The table as a file of the suffix that is asked for."""
    source, columns = read_csv(RAW, "t.csv")
    file.write_bytes(RAW if file.suffix == ".csv" else rewritten_parquet(columns, None, -1 + 0 * source.starts[:3]).raw)
    return file


def replace_file(file: Path, raw: bytes) -> None:
    """What another program does that saves as git or an editor does."""
    other = file.with_name("other.tmp")
    other.write_bytes(raw)
    os.replace(other, file)


def polled(session: Session) -> OnDisk:
    """What the second look finds, after the file has settled."""
    session.poll()
    return session.poll()


def texts(table: Table) -> dict[str, list[str]]:
    return {c.name: c.to_list() for c in table.columns}


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


def test_a_save_merges_what_somebody_else_wrote_first(path):
    session = Session(path)
    type_into(session, 0, 0, "stroll")
    replace_file(path, RAW + b"new,Any,Any\n")
    session.save()
    session.close()
    assert path.read_bytes() == RAW.replace(b"walk", b"stroll") + b"new,Any,Any\n"


def test_a_save_stops_where_the_two_disagree_unless_it_shall_overwrite(path):
    session = Session(path)
    type_into(session, 0, 2, "False")
    type_into(session, 2, 1, "1..2")
    theirs = RAW.replace(b"jump,Any", b"jump,3..4")
    replace_file(path, theirs)
    with pytest.raises(FileError, match="changed since it was read, in 1 place") as caught:
        session.save()
    assert caught.value.faults[0].rule == "merge-conflict"
    assert path.read_bytes() == theirs
    session.save(overwrite=True)
    assert path.read_bytes() == RAW.replace(b"True", b"False").replace(b"jump,Any", b"jump,1..2")
    assert not session.poll()
    session.close()


def test_a_file_that_became_no_table_is_not_written_over_unasked(path):
    session = Session(path)
    type_into(session, 0, 0, "stroll")
    replace_file(path, b"<html>\n<p>,</p>\n")
    with pytest.raises(FileError, match="cannot be read any more"):
        session.save()
    assert path.read_bytes() == b"<html>\n<p>,</p>\n"
    assert session.sheet.table.assets[0] == "stroll"
    session.close()


@pytest.mark.parametrize("raw", [b"Asset,speed,hit\r\n", b"x,y\nq,1\n"])
def test_a_file_that_became_another_table_takes_no_rows_away_unasked(path, raw):
    session = Session(path)
    replace_file(path, raw)
    with pytest.raises(TableError, match="no row in common"):
        session.merge_from_disk()
    assert bytes_for(session.sheet.table, path) == RAW
    session.close()


def test_a_file_that_is_gone_is_told_and_made_anew_by_a_save(path):
    session = Session(path)
    type_into(session, 0, 0, "stroll")
    path.unlink()
    assert polled(session) == OnDisk("gone")
    with pytest.raises(FileError, match="no such file"):
        session.merge_from_disk()
    session.save()
    assert path.read_bytes() == RAW.replace(b"walk", b"stroll")
    assert not polled(session)
    session.close()


# ---- merges while it is open


def test_a_change_on_disk_is_told_once_it_has_settled(path):
    session = Session(path)
    assert not polled(session)
    replace_file(path, RAW + b"new,Any,Any\n")
    assert not session.poll()
    assert session.poll() == OnDisk("changed")
    assert session.poll() == OnDisk("changed")
    session.merge_from_disk()
    assert not polled(session)
    session.close()


def test_a_file_written_anew_with_the_same_bytes_has_not_changed(path):
    session = Session(path)
    replace_file(path, RAW)
    assert not polled(session)
    session.close()


def test_what_others_wrote_comes_in_as_one_step_and_unsaved_edits_stay(path):
    session = Session(path)
    type_into(session, 0, 2, "False")
    theirs = RAW.replace(b"jump,Any", b"jump,1..2") + b"new,Any,Any\n"
    replace_file(path, theirs)
    assert session.merge_from_disk().conflicts == ()
    sheet = session.sheet
    assert bytes_for(sheet.table, path) == theirs.replace(b"True", b"False")
    assert sheet.history.undo_name == MERGE_NAME
    assert sheet.is_modified
    sheet.undo()
    assert bytes_for(sheet.table, path) == RAW.replace(b"True", b"False")
    assert sheet.is_modified
    sheet.redo()
    session.save()
    assert path.read_bytes() == theirs.replace(b"True", b"False")
    assert not sheet.is_modified
    session.close()


def test_without_unsaved_edits_a_merge_leaves_nothing_to_save_and_no_journal(path):
    session = Session(path)
    theirs = b"hit,Asset,speed\nTrue,walk,0..5\n"
    replace_file(path, theirs)
    session.merge_from_disk()
    assert not session.sheet.is_modified
    assert bytes_for(session.sheet.table, path) == theirs
    assert not journal_path(path).exists()
    session.sheet.undo()
    assert session.sheet.is_modified
    session.close()


def test_both_typed_the_same_so_that_nothing_is_left_to_save(path):
    session = Session(path)
    type_into(session, 0, 2, "False")
    replace_file(path, RAW.replace(b"True", b"False"))
    session.merge_from_disk()
    assert not session.sheet.is_modified
    assert session.sheet.history.undo_name == "Type hit of walk"
    session.close()


def test_sort_filter_and_selection_stay_on_their_rows_through_a_merge(path):
    session = Session(path)
    session.sheet.set_sort(Sort("Asset", True))
    session.sheet.set_filter(Filter(columns=(("Asset", "u"),)))
    assert [session.sheet.text(r, 0) for r in range(2)] == ["run", "jump"]
    session.sheet.go(0, 1)
    chosen = session.sheet.text(0, 0)
    replace_file(path, RAW.replace(b"run,", b"hop,Any,Any\nrun,"))
    session.merge_from_disk()
    assert session.sheet.view.is_sorted
    assert session.sheet.text(session.sheet.cursor[0], 0) == chosen
    assert session.sheet.table.assets == ["walk", "hop", "run", "jump"]
    session.close()


def test_conflicts_change_nothing_until_they_are_decided(path):
    session = Session(path)
    type_into(session, 2, 1, "1..2")
    type_into(session, 0, 2, "False")
    before = bytes_for(session.sheet.table, path)
    replace_file(path, RAW.replace(b"jump,Any", b"jump,3..4").replace(b"run", b"sprint"))
    found = session.merge_from_disk()
    assert [(c.asset, c.column, c.ours, c.theirs) for c in found.conflicts] == [("jump", "speed", "1..2", "3..4")]
    assert bytes_for(session.sheet.table, path) == before
    done = session.take(found.resolved({0: "theirs"}))
    assert done.name == MERGE_NAME
    expected = RAW.replace(b"jump,Any", b"jump,3..4").replace(b"run", b"sprint").replace(b"True", b"False")
    assert bytes_for(session.sheet.table, path) == expected
    session.save()
    session.close()
    assert path.read_bytes() == expected


@given(st.data(), st.sampled_from(["t.csv", "t.parquet"]))
def test_after_any_merge_a_killed_editor_brings_back_what_it_showed(data, name):
    with TemporaryDirectory() as folder:
        path = made(Path(folder) / name)
        session = Session(path)
        for _ in range(data.draw(st.integers(0, 2))):
            session.sheet.apply(data.draw(edits_of(session.sheet.table)))
        table = load(path, strict=False)
        table.with_cell(0, table.asset_column, "other").with_rows(1, [{}]).save()
        merged = session.merge_from_disk()
        if merged.conflicts:
            session.take(merged.resolved(dict.fromkeys(range(len(merged.conflicts)), "theirs")))
        for step in data.draw(st.lists(st.sampled_from(["do", "undo", "redo"]), max_size=4)):
            sheet = session.sheet
            sheet.apply(data.draw(edits_of(sheet.table))) if step == "do" else getattr(sheet, step)()
        shown = texts(session.sheet.table)
        session.lock.release()
        again = Session(path)
        assert again.problem is None
        assert texts(again.sheet.table) == shown
        again.save()
        assert texts(load(path, strict=False)) == shown
        again.close()


def test_a_file_replaced_after_a_kill_is_merged_with_the_edits_that_come_back(path):
    killed = Session(path)
    type_into(killed, 0, 2, "False")
    killed.lock.release()
    theirs = RAW.replace(b"jump", b"hop")
    replace_file(path, theirs)
    session = Session(path)
    assert (session.n_recovered, session.problem) == (1, None)
    assert polled(session) == OnDisk("changed")
    session.save()
    session.close()
    assert path.read_bytes() == theirs.replace(b"True", b"False")


def test_a_journal_that_fits_nothing_any_more_is_told_and_kept_aside(path):
    killed = Session(path)
    type_into(killed, 0, 2, "False")
    killed.lock.release()
    path.write_bytes(RAW + b"new,Any,Any\n")  # in place, so that the bytes of before are gone
    session = Session(path)
    assert session.n_recovered == 0
    assert "1 unsaved edit" in session.problem.found
    assert "t.csv.unread.journal" in session.problem.mend
    assert path.with_name(".contextdb-journal").joinpath("t.csv.unread.journal").exists()
    session.close()


def test_a_journal_that_comes_back_in_part_is_gone_on_with(path):
    killed = Session(path)
    type_into(killed, 0, 2, "False")
    killed.journal.did(edits.set_cells(load(path, strict=False), [(2, "speed", "1")]))
    with journal_path(path).open("ab") as journal:
        journal.write(line_of({"do": {"name": "?", "changes": [{"change": "cells", "cells": [["nowhere", [0], ["x"]]]}]}}))
    killed.lock.release()
    session = Session(path)
    assert session.n_recovered == 2
    assert "only 2 unsaved edits" in session.problem.found
    type_into(session, 1, 0, "sprint")
    shown = texts(session.sheet.table)
    session.lock.release()
    again = Session(path)
    assert again.problem is None
    assert texts(again.sheet.table) == shown
    again.close()


# ---- contextdb.toml


TOML = '[conditions.speed]\ntype = "number"\nmax = 10.0\n'


def test_a_changed_schema_is_told_read_anew_and_edits_stay(path):
    toml = path.with_name("contextdb.toml")
    toml.write_text(TOML)
    session = Session(path)
    type_into(session, 0, 2, "False")
    replace_file(toml, TOML.replace("10.0", "20.0").encode() + b'unit = "m/s"\n[conditions.hit]\ntype = "bool"\n')
    assert polled(session) == OnDisk(schema="changed")
    session.reload_schema()
    assert not polled(session)
    table = session.sheet.table
    assert table.condition("speed").condition.unit == "m/s"
    assert table.condition("hit").condition.domain.kind == "bool"
    assert table.text(0, "hit") == "False"
    assert session.sheet.header(1).unit == "m/s"
    session.sheet.undo()
    assert session.sheet.table.condition("speed").condition.unit == "m/s"
    assert not session.sheet.is_modified
    session.close()


def test_what_was_edited_of_the_schema_stays_when_it_is_read_anew(path):
    toml = path.with_name("contextdb.toml")
    toml.write_text(TOML)
    session = Session(path)
    session.sheet.apply(edits.set_condition(session.sheet.table, "speed", max=30.0))
    replace_file(toml, TOML.replace("10.0", "20.0").encode() + b'[conditions.hit]\ntype = "bool"\n')
    session.reload_schema()
    assert session.sheet.table.condition("speed").condition.domain.maximum == 30.0
    assert session.sheet.table.condition("hit").condition.is_declared
    assert session.saved_table.condition("speed").condition.domain.maximum == 20.0
    session.close()


def test_a_merge_reads_a_changed_schema_first_and_keeps_settings_edited_here(path):
    toml = path.with_name("contextdb.toml")
    toml.write_text(TOML)
    session = Session(path)
    session.sheet.apply(edits.set_settings(session.sheet.table, policy="first"))
    replace_file(toml, TOML.replace("10.0", "20.0").encode())
    replace_file(path, RAW.replace(b"jump", b"hop"))
    session.merge_from_disk()
    table = session.sheet.table
    assert (table.settings.policy, session.saved_table.settings.policy) == ("first", "collect")
    assert table.condition("speed").condition.domain.maximum == 20.0
    assert session.sheet.is_modified
    session.lock.release()
    again = Session(path)
    assert again.sheet.table.settings.policy == "first"
    assert again.sheet.table.assets == ["walk", "run", "hop"]
    again.close()


def test_a_schema_that_appears_or_goes_is_told(path):
    session = Session(path)
    toml = path.with_name("contextdb.toml")
    toml.write_text(TOML)
    assert polled(session) == OnDisk(schema="changed")
    session.reload_schema()
    assert session.sheet.table.condition("speed").condition.is_declared
    toml.unlink()
    assert polled(session) == OnDisk(schema="gone")
    session.reload_schema()
    assert not session.sheet.table.condition("speed").condition.is_declared
    assert not polled(session)
    session.close()


def test_a_schema_that_cannot_be_meant_changes_nothing(path):
    session = Session(path)
    toml = path.with_name("contextdb.toml")
    toml.write_text('[tables.t]\nenabled = "Enabeld"\n')
    before = session.sheet.table
    with pytest.raises(ContextDBError, match="Enabeld"):
        session.reload_schema()
    assert session.sheet.table is before
    toml.write_text("[conditions")
    with pytest.raises(ContextDBError):
        session.reload_schema()
    session.close()


def test_a_schema_written_here_is_known(path):
    session = Session(path)
    path.with_name("contextdb.toml").write_text(TOML)
    session.schema_written()
    assert not polled(session)
    session.close()


# ---- who may write


def test_a_file_marked_read_only_is_told_when_it_is_opened_and_stays_as_it_was(path):
    path.chmod(0o444)
    session = Session(path)
    assert session.is_read_only
    assert session.why_read_only == "the file is marked read-only"
    type_into(session, 0, 0, "stroll")
    with pytest.raises(FileError, match="read-only"):
        session.save()
    assert path.read_bytes() == RAW
    assert session.sheet.is_modified
    session.close()


def test_a_folder_that_may_not_be_written_in_is_told(path, monkeypatch):
    monkeypatch.setattr(os, "access", lambda target, mode: Path(target) != path.parent.resolve())
    session = Session(path)
    assert session.why_read_only == "its folder may not be written in"
    session.close()


def test_a_file_that_can_be_saved_is_not_read_only(path):
    session = Session(path)
    assert not session.is_read_only
    session.close()


def test_a_second_editor_does_not_save_over_the_first_and_is_told_when_it_has_ended(path):
    first = Session(path)
    second = Session(path)
    assert second.is_read_only
    type_into(second, 0, 0, "amble")
    with pytest.raises(FileError, match="has this table open"):
        second.save()
    assert not second.poll().is_free
    second.save(path.with_name("copy.csv"))
    assert not second.is_read_only
    second.close()
    second = Session(path)
    first.close()
    assert second.poll() == OnDisk(is_free=True)
    second.close()
    third = Session(path)
    assert third.holder is None
    third.close()


def test_a_table_that_comes_free_can_be_saved_with_what_the_other_editor_saved(path):
    first = Session(path)
    second = Session(path)
    type_into(first, 1, 0, "dash")
    type_into(second, 0, 0, "amble")
    first.save()
    first.close()
    second.save()
    assert not second.is_read_only
    assert Session(path).holder is not None
    assert [row.split(",")[0] for row in path.read_text("utf-8").splitlines()[1:3]] == ["amble", "dash"]
    type_into(second, 0, 0, "stroll")
    second.lock.release()  # as when it is killed
    third = Session(path)
    assert third.n_recovered == 1
    assert third.sheet.text(0, 0) == "stroll"
    third.close()


def test_a_table_with_unsaved_edits_of_an_editor_that_was_killed_is_not_saved_over_them(path):
    first = Session(path)
    second = Session(path)
    type_into(first, 1, 0, "dash")
    first.lock.release()  # as when it is killed
    type_into(second, 0, 0, "amble")
    with pytest.raises(FileError, match="the other editor has ended and left edits that are not saved"):
        second.save()
    second.close()
    third = Session(path)
    assert third.sheet.text(1, 0) == "dash"
    third.close()


def test_an_editor_that_was_killed_with_unsaved_edits_is_told_of_as_one_that_left_them(path):
    first = Session(path)
    second = Session(path)
    type_into(first, 1, 0, "dash")
    first.lock.release()  # as when it is killed
    assert second.poll() == OnDisk(has_left=True)
    second.close()


def test_the_editor_that_is_named_is_the_one_that_has_the_table_now(path):
    first = Session(path)
    second = Session(path)
    was = second.holder
    assert not second.poll()
    first.close()
    third = Session(path)
    assert second.poll() == OnDisk(held_by=second.holder)
    assert second.holder != was
    assert second.holder.id == third.lock.id
    assert not second.poll()
    third.close()
    second.close()


def test_an_editor_on_another_machine_is_asked_about_and_can_be_taken_over(path):
    there = Lock(path, host="workstation-7")
    there.acquire()
    os.close(there._descriptor)  # the drive does not carry locks to other machines
    session = Session(path)
    assert session.holder == Holder(os.getpid(), there.id, "workstation-7")
    assert not session.holder.is_certain
    assert "on workstation-7" in session.why_read_only
    session.close()
    session = Session(path, takes_over=True)
    assert session.holder is None
    session.close()
    session = Session(path)
    assert session.holder is None
    session.close()


def test_an_editor_from_which_the_table_was_taken_is_told_and_saves_no_more(path):
    session = Session(path)
    type_into(session, 0, 0, "stroll")
    other = Holder(1, "abc", "workstation-7")
    session.lock.path.write_text('{"pid": 1, "id": "abc", "host": "workstation-7"}')
    assert polled(session).taken_by == other
    with pytest.raises(FileError, match=r"another editor on workstation-7 \(process 1\) has this table open"):
        session.save()
    session.close(keep_journal=True)


def test_what_a_killed_save_left_behind_is_cleared_away_but_not_what_is_being_written(path):
    dead = path.with_name(temporary_name())
    dead.write_bytes(b"half")
    with staged(path.with_name("other.csv"), b"half") as living:
        Session(path).close()
        assert (dead.exists(), living.temporary.exists()) == (False, True)


# ---- bytes


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
        file = made(Path(folder) / name)
        session = Session(file)
        for _ in range(2):
            session.sheet.apply(data.draw(edits_of(session.sheet.table)))
        announced = bytes_for(session.sheet.table, file)
        session.save()
        session.close()
        assert file.read_bytes() == announced
        shutil.rmtree(file.parent / ".contextdb-journal")


def test_what_somebody_writes_in_the_moment_of_a_save_is_merged(path, monkeypatch):
    real = session_module.new_source

    def meanwhile(*given):
        monkeypatch.setattr(session_module, "new_source", real)
        load(path, strict=False).with_cell(2, "speed", "7").save()
        return real(*given)

    session = Session(path)
    type_into(session, 0, 0, "stroll")
    monkeypatch.setattr(session_module, "new_source", meanwhile)
    session.save()
    assert not session.sheet.is_modified
    session.close()
    assert path.read_bytes() == RAW.replace(b"walk", b"stroll").replace(b"jump,Any", b"jump,7")


def test_an_edit_saved_in_python_while_the_editor_is_open_is_merged_by_either(path):
    session = Session(path)
    table = load(path, strict=False)
    type_into(session, 0, 0, "stroll")
    session.save()
    table.with_cell(2, "speed", "7").save()
    type_into(session, 1, 0, "sprint")
    session.save()
    session.close()
    assert [row.split(b",")[0] for row in path.read_bytes().split(b"\n")[1:4]] == [b"stroll", b"sprint", b"jump"]
    assert b"jump,7" in path.read_bytes()


def test_table_and_contextdb_toml_are_both_as_they_were_when_one_of_them_cannot_be_saved(path, monkeypatch):
    toml = path.with_name("contextdb.toml")
    toml.write_text('[conditions.speed]\ntype = "number"\n', encoding="utf-8")
    before = path.read_bytes(), toml.read_bytes()
    session = Session(path)
    session.sheet.apply(edits.set_cells(session.sheet.table, [(0, "speed", "1")]))
    session.sheet.apply(edits.set_settings(session.sheet.table, policy="first"))
    real = os.replace

    def refused(source, target):
        if Path(target).name == toml.name:
            raise PermissionError(13, "no")
        real(source, target)

    monkeypatch.setattr(os, "replace", refused)
    with pytest.raises(FileError, match=r"contextdb\.toml"):
        session.save()
    assert (path.read_bytes(), toml.read_bytes()) == before
    assert session.sheet.is_modified
    monkeypatch.setattr(os, "replace", real)
    session.save()
    session.close()
    assert b'walk,"1",' in path.read_bytes()
    assert b'policy = "first"' in toml.read_bytes()


def test_a_full_disk_says_how_many_bytes_the_file_contextdb_toml_and_the_journal_need_together(path, monkeypatch):
    path.with_name("contextdb.toml").write_text('[conditions.speed]\ntype = "number"\nmin = 0\nmax = 9\n')
    session = Session(path)
    session.sheet.apply(edits.set_settings(session.sheet.table, policy="first"))
    journal = journal_path(path)
    n_before = journal.stat().st_size
    real = os.fsync

    def full(handle: int) -> None:
        if os.fstat(handle).st_ino != journal.stat().st_ino:
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        real(handle)

    with monkeypatch.context() as patch:
        patch.setattr(os, "fsync", full)
        with pytest.raises(FileError) as caught:
            session.save()
    n_record = journal.stat().st_size - n_before
    session.save()
    n_bytes = n_record + sum(file.stat().st_size for file in (path, path.with_name("contextdb.toml")))
    session.close()
    assert n_record > 0
    assert f"Accepted: {n_bytes:,} free bytes." in str(caught.value)
