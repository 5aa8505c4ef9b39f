"""Unsaved edits come back after a kill at any byte, and two editors know of each other."""

import subprocess
import sys
from pathlib import Path
from tempfile import TemporaryDirectory

from edit_strategies import edits_of
from hypothesis import given
from hypothesis import strategies as st

import contextdb as cdb
from contextdb.disk import write_atomic
from contextdb.edits import edits
from contextdb.files.csv_rewrite import rewritten
from contextdb.tables.table import Table
from tui.model.journal import Journal, base_path, journal_path, recover
from tui.model.lock import Holder, Lock
from tui.model.sheet import Sheet
from tui.model.watched import digest_of

RAW = b"Asset,speed,hit\nwalk,0..5,True\nrun,5..9,Any\njump,Any,False\n"


def open_sheet(folder: str | Path) -> Sheet:
    path = Path(folder) / "t.csv"
    if not path.exists():
        write_atomic(path, RAW)
    return reopened(path)


def reopened(path: Path) -> Sheet:
    """The sheet as an editor opens it: with what a journal brings back."""
    table = cdb.load(path, strict=False)
    found = recover(table)
    assert not (found and found.problem)
    history = found.history if found else None
    return Sheet(table, Journal(path, digest_of(table.source.raw), history), history)


def bytes_of(table: Table) -> bytes:
    return rewritten(table.columns, table.source, table.origin).raw


def save(sheet: Sheet) -> None:
    """As the session does, which has looked before at what others wrote."""
    sheet.recorder.saving(bytes_of(sheet.table))
    sheet.saved(sheet.table.save(overwrite=True))
    sheet.recorder.saved(sheet.table.source.raw, sheet.history.position)


@given(st.data())
def test_a_journal_cut_at_any_byte_loses_at_most_the_edit_in_progress(data):
    with TemporaryDirectory() as folder:
        sheet = open_sheet(folder)
        states, sizes, journal = [RAW], [0], journal_path(sheet.path)
        for _ in range(data.draw(st.integers(1, 6))):
            step = data.draw(st.sampled_from(["do", "do", "undo", "redo"]))
            sheet.apply(data.draw(edits_of(sheet.table))) if step == "do" else getattr(sheet, step)()
            states.append(bytes_of(sheet.table))
            sizes.append(journal.stat().st_size if journal.exists() else 0)
        raw = journal.read_bytes() if journal.exists() else b""
        cut = data.draw(st.integers(0, len(raw)))
        if raw:
            journal.write_bytes(raw[:cut])
        expected = [state for state, size in zip(states, sizes, strict=True) if size <= cut][-1]
        again = reopened(sheet.path)
        assert bytes_of(again.table) == expected
        again.apply(edits.set_cells(again.table, [(0, again.table.asset_column, "more")])) if again.table.n_rows else None
        assert bytes_of(reopened(sheet.path).table) == bytes_of(again.table)


@given(st.data())
def test_edits_before_and_after_saves_and_back_past_them_come_back(data):
    with TemporaryDirectory() as folder:
        sheet = open_sheet(folder)
        for _ in range(data.draw(st.integers(1, 10))):
            step = data.draw(st.sampled_from(["do", "do", "undo", "undo", "redo", "save"]))
            if step == "do":
                sheet.apply(data.draw(edits_of(sheet.table)))
            else:
                save(sheet) if step == "save" else getattr(sheet, step)()
        expected = {c.name: c.to_list() for c in sheet.table.columns}
        assert {c.name: c.to_list() for c in reopened(sheet.path).table.columns} == expected


def test_what_comes_back_can_be_undone(tmp_path):
    sheet = open_sheet(tmp_path)
    sheet.go(1, 1)
    sheet.type_text("1..2")
    again = reopened(sheet.path)
    assert again.table.text(1, "speed") == "1..2"
    assert again.is_modified
    assert again.undo().name == "Undo: Type speed of run"
    assert bytes_of(again.table) == RAW


def test_a_kill_between_the_save_and_the_end_of_the_journal_brings_nothing_back_twice(tmp_path):
    sheet = open_sheet(tmp_path)
    sheet.apply(edits.duplicate_rows(sheet.table, [0]))
    sheet.recorder.saving(bytes_of(sheet.table))
    sheet.table.save()
    assert recover(cdb.load(sheet.path)) is None


def test_a_journal_of_another_version_of_the_file_says_so_and_stays(tmp_path):
    sheet = open_sheet(tmp_path)
    sheet.apply(edits.delete_rows(sheet.table, [0]))
    write_atomic(sheet.path, RAW + b"new,Any,Any\n")
    found = recover(cdb.load(sheet.path))
    assert found.n_edits == 0
    assert "1 unsaved edit" in found.problem.found
    assert journal_path(sheet.path).exists()


def test_an_altered_line_ends_the_journal(tmp_path):
    sheet = open_sheet(tmp_path)
    for row in (2, 1, 0):
        sheet.apply(edits.delete_rows(sheet.table, [row]))
    journal = journal_path(sheet.path)
    journal.write_bytes(journal.read_bytes().replace(b"Delete run", b"Delete rum"))
    altered = journal.read_bytes()
    found = recover(cdb.load(sheet.path))
    assert found.history.table.assets == ["walk", "run"]
    assert "line 3 was altered, so 2 edits from there on could not be made again" in found.problem.found
    assert (journal.parent / "t.csv.damaged").read_bytes() == altered


def test_a_journal_whose_first_line_is_altered_is_kept_and_told(tmp_path):
    sheet = open_sheet(tmp_path)
    sheet.apply(edits.delete_rows(sheet.table, [0]))
    journal = journal_path(sheet.path)
    journal.write_bytes(b"0" + journal.read_bytes()[1:])
    found = recover(cdb.load(sheet.path))
    assert (found.n_edits, "line 1 was altered" in found.problem.found) == (0, True)
    assert (journal.parent / "t.csv.damaged").exists()


def test_a_journal_whose_edit_does_not_fit_says_how_far_it_came(tmp_path):
    sheet = open_sheet(tmp_path)
    sheet.apply(edits.delete_rows(sheet.table, [0]))
    sheet.recorder.did(edits.set_cells(cdb.load(sheet.path), [(2, "speed", "1")]))
    found = recover(cdb.load(sheet.path))
    assert found.n_edits == 1
    assert "only 1 unsaved edit " in found.problem.found
    assert found.history.table.assets == ["run", "jump"]


def test_a_saved_table_leaves_no_journal_and_git_would_not_see_one(tmp_path):
    sheet = open_sheet(tmp_path)
    sheet.apply(edits.delete_rows(sheet.table, [0]))
    folder = journal_path(sheet.path).parent
    assert (folder / ".gitignore").read_text() == "*\n"
    save(sheet)
    assert not journal_path(sheet.path).exists()


def test_a_folder_that_cannot_be_written_is_told_and_editing_goes_on(tmp_path):
    sheet = open_sheet(tmp_path)
    (tmp_path / ".contextdb-journal").write_text("a file in the way")
    sheet.apply(edits.delete_rows(sheet.table, [0]))
    assert sheet.table.n_rows == 2
    assert "not stored" in sheet.recorder.problem.found


def test_a_second_editor_is_told_who_has_the_table_and_a_killed_one_holds_nothing(tmp_path):
    script = "import sys; from pathlib import Path; from tui.model.lock import Lock\n"
    script += "lock = Lock(Path(sys.argv[1])); print(lock.acquire(), lock.id, flush=True); sys.stdin.read()"
    path = tmp_path / "t.csv"
    command = [sys.executable, "-c", script, str(path)]
    other = subprocess.Popen(
        command,
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
        cwd=Path(__file__).parents[2],
    )
    said, name = other.stdout.readline().split()
    assert said == "None"
    mine = Lock(path)
    assert mine.acquire() == Holder(other.pid, name)
    assert not mine.is_held
    other.kill()
    other.communicate()
    assert mine.acquire() is None
    assert mine.is_held
    mine.release()


# ---- a file that others replace


def test_edits_come_back_on_the_file_as_it_was_when_it_was_replaced_after_a_kill(tmp_path):
    sheet = open_sheet(tmp_path)
    sheet.recorder.keep_base()
    sheet.apply(edits.delete_rows(sheet.table, [0]))
    write_atomic(sheet.path, RAW + b"new,Any,Any\n")
    found = recover(cdb.load(sheet.path))
    assert (found.n_edits, found.problem) == (1, None)
    assert found.history.table.assets == ["run", "jump"]
    assert bytes_of(found.base) == RAW


def test_a_link_that_was_written_through_brings_nothing_back_wrongly(tmp_path):
    sheet = open_sheet(tmp_path)
    sheet.recorder.keep_base()
    sheet.apply(edits.delete_rows(sheet.table, [0]))
    sheet.path.write_bytes(RAW + b"new,Any,Any\n")  # in place: the link holds these bytes too
    found = recover(cdb.load(sheet.path))
    assert (found.n_edits, found.base) == (0, None)
    assert "1 unsaved edit" in found.problem.found


def test_the_link_to_the_file_goes_with_the_journal(tmp_path):
    sheet = open_sheet(tmp_path)
    sheet.recorder.keep_base()
    assert base_path(sheet.path).read_bytes() == RAW
    sheet.apply(edits.delete_rows(sheet.table, [0]))
    save(sheet)
    assert base_path(sheet.path).read_bytes() == sheet.path.read_bytes() != RAW
    sheet.recorder.discard()
    assert not base_path(sheet.path).exists()


@given(st.data())
def test_edits_after_a_merge_and_back_past_it_come_back(data):
    with TemporaryDirectory() as folder:
        sheet = open_sheet(folder)
        for _ in range(data.draw(st.integers(0, 2))):
            sheet.apply(data.draw(edits_of(sheet.table)))
        raw = bytes_of(sheet.table)
        write_atomic(sheet.path, RAW)
        table = cdb.load(sheet.path, strict=False)
        unsaved = edits.edit_between(table, sheet.table, sheet.table.origin, "Unsaved edits")
        sheet.recorder.rebased(RAW, unsaved, sheet.history.position)
        assert bytes_of(reopened(sheet.path).table) == raw
        for _ in range(data.draw(st.integers(1, 6))):
            step = data.draw(st.sampled_from(["do", "undo", "redo"]))
            sheet.apply(data.draw(edits_of(sheet.table))) if step == "do" else getattr(sheet, step)()
        expected = {c.name: c.to_list() for c in sheet.table.columns}
        assert {c.name: c.to_list() for c in reopened(sheet.path).table.columns} == expected
