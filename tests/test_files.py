"""The disk: whole files or a message that says what to do, also when the disk is full or the process is killed."""

import errno
import os
import signal
import socket
import stat
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
import polars as pl
import pytest

from contextdb.columns import TextColumn
from contextdb.disk import read_bytes, real_path, write_atomic
from contextdb.errors import FileError, TableError
from contextdb.files.csv_source import Source
from contextdb.files.parquet import ParquetSource
from contextdb.files.texts import read_texts, write_texts

ROOT = Path(__file__).parent.parent
needs_links = pytest.mark.skipif(os.name == "nt", reason="links and modes as POSIX has them")


def refused(action: Callable[[], object]) -> str:
    """The one message of what the system refuses."""
    with pytest.raises(FileError) as caught:
        action()
    (fault,) = caught.value.faults
    return str(fault)


@pytest.fixture
def table(tmp_path: Path) -> Path:
    path = tmp_path / "hit_mid_air.csv"
    path.write_bytes(b"a,b\r\nx,1\r\n")
    return path


# ---- tables


def test_a_csv_is_read_edited_and_written(table: Path):
    source, (a, b) = read_texts(table)
    assert isinstance(source, Source)
    new = write_texts(table, [a, b.with_text(0, "20, 9.99")], source, np.array([0]))
    assert table.read_bytes() == new.raw == b'a,b\r\nx,"20, 9.99"\r\n'
    assert isinstance(new, Source)
    assert new.line(0) == 2


def test_a_table_saved_twice_goes_on_from_what_it_wrote(table: Path):
    source, (a, b) = read_texts(table)
    b = b.with_inserted(1, ["2"])
    a = a.with_inserted(1, ["y"])
    new = write_texts(table, [a, b], source, np.array([0, -1]))
    write_texts(table, [a, b.with_text(1, "3")], new, np.array([0, 1]))
    assert table.read_bytes() == b"a,b\r\nx,1\r\ny,3\r\n"


def test_a_parquet_file_is_read_edited_and_written(tmp_path: Path):
    path = tmp_path / "T.PARQUET"
    pl.DataFrame({"a": ["x"], "b": [1]}).write_parquet(path)
    source, (a, b) = read_texts(path)
    assert isinstance(source, ParquetSource)
    write_texts(path, [a, b.with_text(0, "2")], source, np.array([0]))
    assert pl.read_parquet(path).rows() == [("x", 2)]


def test_a_table_is_saved_in_the_other_format_by_its_suffix(table: Path):
    source, columns = read_texts(table)
    parquet, again = table.with_suffix(".parquet"), table.with_name("again.csv")
    write_texts(parquet, columns, source, np.array([0]))
    assert pl.read_parquet(parquet).rows() == [("x", "1")]
    source, columns = read_texts(parquet)
    write_texts(again, columns, source, np.array([0]))
    assert again.read_bytes() == b"a,b\nx,1\n"


def test_a_new_table_is_written(tmp_path: Path):
    write_texts(tmp_path / "new.csv", [TextColumn.of("a", ["x"])], None, np.array([-1]))
    assert (tmp_path / "new.csv").read_bytes() == b"a\nx\n"


def test_faults_of_a_table_name_the_file(table: Path):
    table.write_bytes(b"a,b\n1\n")
    with pytest.raises(TableError) as caught:
        read_texts(table)
    assert str(caught.value).startswith(f"{table}, line 2: found 1 field")


def test_a_text_that_cannot_be_written_leaves_the_file_as_it_was(table: Path):
    source, (a, b) = read_texts(table)
    with pytest.raises(TableError):
        write_texts(table, [a, b.with_text(0, "\0")], source, np.array([0]))
    assert table.read_bytes() == b"a,b\r\nx,1\r\n"


def test_another_suffix_is_refused_with_the_nearest_mend(table: Path):
    wrong = table.with_suffix(".cvs")
    wrong.touch()
    assert refused(lambda: read_texts(wrong)) == (
        f'{wrong}: a table file does not end in ".cvs". Accepted: .csv or .parquet. Did you mean "{table}"?'
    )
    sheet = table.with_suffix(".xlsx")
    sheet.touch()
    assert refused(lambda: read_texts(sheet)).endswith("Try to save it as CSV.")
    assert "the name has no suffix" in refused(lambda: write_texts(table.with_suffix(""), [], None, np.array([])))


# ---- reading


def test_a_missing_file_is_named_with_the_nearest_there_is(table: Path):
    wrong = table.with_name("hit_midair.csv")
    assert refused(lambda: read_bytes(wrong)) == f'{wrong}: there is no such file. Did you mean "{table}"?'


def test_a_missing_folder_is_named_with_the_nearest_there_is(table: Path):
    folder = table.parent / "tables"
    folder.mkdir()
    wrong = table.parent / "tabels" / "deep" / "a.csv"
    assert refused(lambda: read_bytes(wrong)) == (
        f'{wrong}: there is no such folder "{table.parent / "tabels"}". Did you mean "{folder}"?'
    )


def test_a_missing_file_in_the_working_folder_is_named(table: Path, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.chdir(table.parent)
    assert refused(lambda: read_bytes("hit_mid_ar.csv")) == 'hit_mid_ar.csv: there is no such file. Did you mean "hit_mid_air.csv"?'


def test_a_file_taken_for_a_folder_is_named(table: Path):
    assert f'"{table}" is not a folder' in refused(lambda: read_bytes(table / "a.csv"))


def test_a_folder_taken_for_a_file_is_named_with_a_table_in_it(table: Path):
    assert (
        refused(lambda: read_bytes(table.parent))
        == f'{table.parent}: this is a folder. Accepted: one file. Did you mean "{table}"?'
    )


def test_a_file_that_may_not_be_read_is_named(table: Path, monkeypatch: pytest.MonkeyPatch):
    def denied(*_: object) -> int:
        raise PermissionError(errno.EACCES, "Permission denied")

    monkeypatch.setattr(os, "open", denied)
    assert refused(lambda: read_bytes(table)) == (
        f"{table}: the file may not be read. Accepted: a file that you have the permission to read."
    )


def test_other_refusals_give_the_systems_reason(table: Path, monkeypatch: pytest.MonkeyPatch):
    def broken(*_: object) -> int:
        raise OSError(errno.EIO, "Input/output error")

    monkeypatch.setattr(os, "open", broken)
    assert refused(lambda: read_bytes(table)) == f"{table}: the file cannot be read: Input/output error."


def test_a_path_with_a_nul_character_is_refused():
    assert "this is not a valid path" in refused(lambda: read_bytes("a\0b.csv"))


@needs_links
def test_a_pipe_is_refused_and_not_waited_for(tmp_path: Path):
    os.mkfifo(tmp_path / "a.csv")
    assert "this is not a regular file" in refused(lambda: read_bytes(tmp_path / "a.csv"))


@needs_links
def test_a_link_to_nothing_is_named(tmp_path: Path):
    (tmp_path / "a.csv").symlink_to("gone.csv")
    assert 'this is a link to "gone.csv", which does not exist' in refused(lambda: read_bytes(tmp_path / "a.csv"))


@needs_links
def test_a_link_that_leads_to_itself_has_a_whole_path(tmp_path: Path):
    (tmp_path / "a.csv").symlink_to("b.csv")
    (tmp_path / "b.csv").symlink_to("a.csv")
    assert real_path(tmp_path / "b.csv").parent == tmp_path.resolve()


def test_no_path_is_made_whole_in_the_way_that_fails_at_such_a_link():
    sources = [path for package in ("contextdb", "tui") for path in (ROOT / package).rglob("*.py")]
    assert [str(path) for path in sources if ".resolve()" in path.read_text(encoding="utf-8")] == []


# ---- writing


def test_a_file_is_replaced_and_nothing_else_stays(table: Path):
    write_atomic(table, b"new")
    assert table.read_bytes() == b"new"
    assert os.listdir(table.parent) == [table.name]


def test_a_file_that_is_not_there_is_made(tmp_path: Path):
    write_atomic(tmp_path / "new.csv", b"")
    assert (tmp_path / "new.csv").read_bytes() == b""


@needs_links
def test_the_mode_stays_and_a_new_file_gets_the_usual_one(table: Path):
    table.chmod(0o640)
    write_atomic(table, b"new")
    assert stat.S_IMODE(table.stat().st_mode) == 0o640
    usual = table.with_name("usual")
    usual.touch()
    write_atomic(table.with_name("other.csv"), b"")
    assert table.with_name("other.csv").stat().st_mode == usual.stat().st_mode


@needs_links
def test_a_link_stays_a_link_and_its_file_is_replaced(table: Path, tmp_path: Path):
    folder = tmp_path / "elsewhere"
    folder.mkdir()
    link = folder / "link.csv"
    link.symlink_to(table)
    write_atomic(link, b"new")
    assert link.is_symlink()
    assert table.read_bytes() == b"new"
    assert os.listdir(folder) == ["link.csv"]


def test_a_write_in_small_pieces_is_whole(table: Path, monkeypatch: pytest.MonkeyPatch):
    write = os.write
    monkeypatch.setattr(os, "write", lambda handle, data: write(handle, data[:3]))
    write_atomic(table, b"0123456789")
    assert table.read_bytes() == b"0123456789"


def fails_with(number: int) -> Callable[..., None]:
    def fail(*_: object, **__: object) -> None:
        raise OSError(number, os.strerror(number))

    return fail


@pytest.mark.parametrize("call", ["write", "fsync"])
def test_on_a_full_disk_the_old_file_is_whole_and_no_temporary_file_stays(table: Path, monkeypatch: pytest.MonkeyPatch, call: str):
    monkeypatch.setattr(os, call, fails_with(errno.ENOSPC))
    assert refused(lambda: write_atomic(table, b"x" * 1234)) == (
        f"{table}: the disk is full. The old file is as it was. Accepted: 1,234 free bytes. Try to free some space and save again."
    )
    assert table.read_bytes() == b"a,b\r\nx,1\r\n"
    assert os.listdir(table.parent) == [table.name]


def test_a_limit_on_the_size_of_files_is_told_from_a_full_disk(table: Path, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr(os, "write", fails_with(errno.EFBIG))
    said = refused(lambda: write_atomic(table, b"x" * 1234))
    assert "the file is larger than files may be here. The old file is as it was. Accepted: room for 1,234 bytes." in said
    assert said.endswith('Try to raise the limit that "ulimit -f" shows.')


def test_on_a_disk_that_fills_up_half_way_nothing_half_written_stays(table: Path, monkeypatch: pytest.MonkeyPatch):
    write, calls = os.write, []

    def fill_up(handle: int, data: memoryview) -> int:
        calls.append(len(data))
        if len(calls) > 1:
            raise OSError(errno.ENOSPC, "No space left on device")
        return write(handle, data[:100])

    monkeypatch.setattr(os, "write", fill_up)
    assert "the disk is full" in refused(lambda: write_atomic(table.with_name("new.csv"), b"x" * 1000))
    assert calls == [1000, 900]
    assert os.listdir(table.parent) == [table.name]


@pytest.mark.parametrize(
    ("call", "number", "said"),
    [
        ("open", errno.EACCES, "may not be written in"),
        ("open", errno.EROFS, "is on a disk that cannot be written."),
        ("replace", errno.EACCES, "may not be written in"),
        ("write", errno.EIO, "the file cannot be written: Input/output error."),
    ],
)
def test_a_folder_that_refuses_is_named_and_the_old_file_is_whole(
    table: Path, monkeypatch: pytest.MonkeyPatch, call: str, number: int, said: str
):
    monkeypatch.setattr(os, call, fails_with(number))
    message = refused(lambda: write_atomic(table, b"new"))
    assert message.startswith(f"{table}: the f")
    assert said in message
    assert message.endswith("The old file is as it was. Try to save elsewhere.")
    monkeypatch.undo()
    assert table.read_bytes() == b"a,b\r\nx,1\r\n"
    assert os.listdir(table.parent) == [table.name]


def test_a_file_marked_read_only_is_not_replaced(table: Path):
    table.chmod(0o444)
    assert refused(lambda: write_atomic(table, b"new")) == (
        f"{table}: the file is marked read-only. Accepted: a file that may be written. "
        "Try to check it out of version control, or to make it writable."
    )
    assert table.read_bytes() == b"a,b\r\nx,1\r\n"


def test_a_folder_that_is_missing_or_in_the_way_is_named(table: Path):
    missing = table.parent / "gone" / "a.csv"
    assert refused(lambda: write_atomic(missing, b"")) == (
        f'{missing}: there is no folder "{missing.parent}". Accepted: an existing folder.'
    )
    assert "this is a folder" in refused(lambda: write_atomic(table.parent, b""))
    assert "there is no folder" in refused(lambda: write_atomic(table / "a.csv", b""))


def test_an_interrupt_leaves_the_old_file_and_nothing_else(table: Path, monkeypatch: pytest.MonkeyPatch):
    def interrupt(_: int) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(os, "fsync", interrupt)
    with pytest.raises(KeyboardInterrupt):
        write_atomic(table, b"new")
    assert table.read_bytes() == b"a,b\r\nx,1\r\n"
    assert os.listdir(table.parent) == [table.name]


# ---- killed

KILLED_AT_A_CALL = """
import os, signal, sys
from contextdb.disk import write_atomic

def die_at(call, number):
    system, calls = getattr(os, call), []
    def dying(*arguments, **options):
        calls.append(arguments)
        if len(calls) == number:
            if call == "write":
                system(arguments[0], arguments[1][:1000])
            os.kill(os.getpid(), signal.SIGKILL)
        return system(*arguments, **options)
    setattr(os, call, dying)

for call, number in [line.split() for line in sys.argv[2:]]:
    child = os.fork()
    if not child:
        die_at(call, int(number))
        write_atomic(sys.argv[1], b"new" * 1000)
        os._exit(0)
    _, status = os.waitpid(child, 0)
    with open(sys.argv[1], "rb") as file:
        text = file.read()
    print(call, number, os.WTERMSIG(status), text[:3].decode(), len(text), flush=True)
    with open(sys.argv[1], "wb") as file:
        file.write(b"old" * 1000)
"""

SAVING_FOR_EVER = """
import sys
from contextdb.disk import write_atomic

while True:
    for letter in b"ab":
        write_atomic(sys.argv[1], bytes([letter]) * 300_000)
        print(letter, flush=True)
"""


@pytest.mark.skipif(not hasattr(os, "fork"), reason="kills forked processes")
def test_a_save_killed_at_any_call_leaves_the_old_file_or_the_new_one(table: Path):
    table.write_bytes(b"old" * 1000)
    left = {
        "open 1": "old",  # the folder's, for the turn in which the temporary file is made
        "open 2": "old",
        "close 1": "old",
        "write 1": "old",
        "chmod 1": "old",
        "fsync 1": "old",
        "open 3": "old",  # the folder's, for the turn in which the file is replaced
        "close 2": "old",
        "replace 1": "old",
        "fsync 2": "new",
        "close 3": "new",
    }
    command = [sys.executable, "-c", KILLED_AT_A_CALL, str(table), *left]
    ran = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=True)
    found = [line.split() for line in ran.stdout.splitlines()]
    assert {f"{call} {number}": text for call, number, _, text, _ in found} == left
    assert {(killed, size) for _, _, killed, _, size in found} == {(str(int(signal.SIGKILL)), "3000")}


@pytest.mark.skipif(os.name == "nt", reason="SIGKILL")
@pytest.mark.parametrize("n_saves", [1, 2, 5, 9])
def test_a_save_killed_at_no_matter_what_moment_leaves_a_whole_file(table: Path, n_saves: int):
    child = subprocess.Popen([sys.executable, "-c", SAVING_FOR_EVER, table], cwd=ROOT, stdout=subprocess.PIPE)
    with child:
        assert child.stdout is not None
        for _ in range(n_saves):
            child.stdout.readline()
        child.kill()
    raw = table.read_bytes()
    assert raw in (b"a" * 300_000, b"b" * 300_000)
    left = [name for name in os.listdir(table.parent) if name != table.name]
    assert all(name.startswith(".contextdb-") and name.endswith(".tmp") for name in left)
    assert len(left) <= 1


def test_what_a_killed_save_left_is_no_table(table: Path):
    (table.parent / ".contextdb-0123.tmp").write_bytes(b"half")
    source, columns = read_texts(table)
    write_texts(table, columns, source, np.array([0]))
    assert table.read_bytes() == b"a,b\r\nx,1\r\n"
    assert list(table.parent.glob("*.csv")) == [table]


@pytest.mark.skipif(not hasattr(socket, "AF_UNIX"), reason="sockets in folders")
def test_what_is_neither_file_nor_stream_is_not_replaced(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.chdir(tmp_path)  # the path of a socket is short
    with socket.socket(socket.AF_UNIX) as game:
        game.bind("game")
        assert "this is not a regular file" in refused(lambda: write_atomic(Path("game"), b"x"))
