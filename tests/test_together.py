"""Files that are replaced together, killed at any call; what killed saves leave; and what a record from a stranger cannot do."""

import errno
import json
import os
import subprocess
import sys
import warnings
from pathlib import Path

import pytest
from running import ROOT, run

from contextdb.disk import folder_lock, staged, write_atomic
from contextdb.disk.folder_lock import UNFINISHED, folder_turn, sweep, temporary_folder, temporary_name
from contextdb.disk.together import NewFile, UnfinishedWarning, finish, write_together
from contextdb.errors import FileError
from contextdb.tables.project import Project

KILLED_AT_EACH_CALL = """
import os, signal, sys, warnings
from pathlib import Path
from contextdb import disk
from contextdb.disk import folder_lock
from contextdb.disk import together
from contextdb.disk.together import NewFile, finish, write_together

root, below = Path(sys.argv[1]), sys.argv[2]
files = [root / below / "t.csv", root / "contextdb.toml"]
(root / below).mkdir(exist_ok=True)

def said():
    return [path.read_text() if path.exists() else "none" for path in files]

def kill_at(k):
    left = [k]
    for module in (disk, folder_lock, together):
        module.os = Killing(left)

class Killing:
    def __init__(self, left):
        self.left = left
    def __getattr__(self, name):
        real = getattr(os, name)
        if name not in ("open", "write", "fsync", "replace", "close", "link", "chmod"):
            return real
        def call(*given, **more):
            self.left[0] -= 1
            if self.left[0] < 0:
                os.kill(os.getpid(), signal.SIGKILL)
            return real(*given, **more)
        return call

k, is_alive = 0, False
while not is_alive:
    for path in files:
        path.unlink(missing_ok=True)
    if sys.argv[3] == "old":
        for path in files:
            path.write_text("old")
    child = os.fork()
    if not child:
        kill_at(k)
        write_together(root, [NewFile(path, b"new") for path in files])
        os._exit(0)
    _, status = os.waitpid(child, 0)
    is_alive = not os.WIFSIGNALED(status)
    half = said()
    with warnings.catch_warnings(record=True) as told:
        warnings.simplefilter("always")
        finish(root)
    now = said()
    for folder in {root, root / below}:
        disk.write_atomic(folder / "other", b"x")
    left = [p.name for p in root.rglob(".contextdb-*")]
    print(k, *half, *now, len(told), len(left), flush=True)
    k += 1
"""


@pytest.mark.skipif(not hasattr(os, "fork"), reason="kills forked processes")
@pytest.mark.parametrize("below", [".", "below"])
@pytest.mark.parametrize("before", ["old", "none"])
def test_two_files_whose_writer_is_killed_at_any_call_are_both_old_or_both_new(tmp_path, below, before):
    command = [sys.executable, "-c", KILLED_AT_EACH_CALL, str(tmp_path), below, before]
    ran = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=True)
    found = [line.split() for line in ran.stdout.splitlines()]
    assert len(found) > 20
    assert [now for _, _, _, *now, _, _ in found if now not in ([before] * 2, ["new"] * 2)] == []
    assert [line for line in found if line[-1] != "0"] == []
    halves = [line for line in found if line[1] != line[2]]
    assert halves
    assert all((line[3:5], line[5]) == (["new", "new"], "1") for line in halves)


# ---- what is told


def interrupted(folder: Path, **others: str | None) -> None:
    """A folder in which the writer of an import was killed before it wrote contextdb.toml."""
    toml = '[conditions.speed]\ntype = "number"\n[tables.t]\n'
    new, old = temporary_name(), temporary_name()
    (folder / "t.csv").write_text("A,speed\na,1\n", encoding="utf-8", newline="\n")
    (folder / new).write_text(toml, encoding="utf-8", newline="\n")
    (folder / old).write_text("", encoding="utf-8")
    (folder / "contextdb.toml").write_text("", encoding="utf-8")
    entry = {"file": "contextdb.toml", "new": new, "is": sha(toml), "old": old, "was": sha(""), **others}
    (folder / UNFINISHED).write_text(json.dumps({"format": 1, "files": [entry]}), encoding="utf-8")


def sha(text: str) -> str:
    import hashlib

    return hashlib.sha256(text.encode()).hexdigest()


@pytest.mark.parametrize("read", [("check", "."), ("query", "t.csv", "speed=1"), ("coverage", ".")], ids=lambda a: a[0])
def test_the_next_command_completes_an_interrupted_import_and_says_so(tmp_path, monkeypatch, read):
    monkeypatch.chdir(tmp_path)
    interrupted(tmp_path)
    said = run(*read).err
    assert 'contextdb: .: a process was killed while it wrote "contextdb.toml"; ' in said
    assert "[conditions.speed]" in (tmp_path / "contextdb.toml").read_text(encoding="utf-8")
    assert list(tmp_path.glob(".contextdb-*")) == []
    assert "killed" not in run(*read).err


def test_what_was_changed_since_is_not_written_over(tmp_path):
    interrupted(tmp_path)
    (tmp_path / "contextdb.toml").write_text("# mine\n", encoding="utf-8")
    with pytest.warns(UnfinishedWarning, match="were changed since"):
        Project.load(tmp_path)
    assert (tmp_path / "contextdb.toml").read_text(encoding="utf-8") == "# mine\n"
    assert list(tmp_path.glob(".contextdb-*")) == []


@pytest.mark.parametrize(
    "others",
    [
        {"file": "../victim.csv"},
        {"file": ".git/hooks/post-checkout"},
        {"new": "mine.txt"},
        {"old": "t.csv"},
        {"new": "../victim.csv"},
        {"is": None},
    ],
    ids=str,
)
def test_a_record_that_came_with_a_clone_replaces_and_deletes_nothing_else(tmp_path, others):
    folder, victim = tmp_path / "clone", tmp_path / "victim.csv"
    (folder / ".git" / "hooks").mkdir(parents=True)
    victim.write_text("mine", encoding="utf-8")
    (folder / "mine.txt").write_text("mine", encoding="utf-8")
    interrupted(folder, **others)
    with pytest.warns(UnfinishedWarning):
        finish(folder)
    assert victim.read_text(encoding="utf-8") == (folder / "mine.txt").read_text(encoding="utf-8") == "mine"
    assert (folder / "t.csv").exists()
    assert list((folder / ".git" / "hooks").iterdir()) == []
    assert (folder / "contextdb.toml").read_text(encoding="utf-8") == ""


@pytest.mark.parametrize("text", ["", "{", "[]", '{"format": 2, "files": []}', '{"format": 1, "files": [1]}', "\0", "[" * 5000])
def test_a_record_that_says_nothing_is_deleted(tmp_path, text):
    (tmp_path / UNFINISHED).write_text(text, encoding="utf-8")
    with pytest.warns(UnfinishedWarning, match="names no files"):
        finish(tmp_path)
    assert list(tmp_path.iterdir()) == []


# ---- only if nobody wrote meanwhile


def test_files_of_which_one_is_another_by_now_are_both_left(tmp_path):
    a, b = tmp_path / "a.csv", tmp_path / "contextdb.toml"
    a.write_bytes(b"a")
    b.write_bytes(b"theirs")
    assert not write_together(tmp_path, [NewFile(a, b"new", b"a"), NewFile(b, b"new", b"b")])
    assert (a.read_bytes(), b.read_bytes()) == (b"a", b"theirs")
    assert not write_atomic(a, b"new", was=None)
    assert not write_atomic(tmp_path / "c", b"new", was=b"c")
    assert sorted(os.listdir(tmp_path)) == ["a.csv", "contextdb.toml"]


def test_a_file_behind_a_link_out_of_the_folder_is_replaced_there(tmp_path):
    folder, other = tmp_path / "here", tmp_path / "there.csv"
    folder.mkdir()
    other.write_bytes(b"old")
    try:
        (folder / "t.csv").symlink_to(other)
    except OSError:
        pytest.skip("no links here")
    assert write_together(folder, [NewFile(folder / "t.csv", b"new"), NewFile(folder / "contextdb.toml", b"new")])
    assert (other.read_bytes(), (folder / "contextdb.toml").read_bytes()) == (b"new", b"new")
    assert sorted(os.listdir(tmp_path)) == ["here", "there.csv"]


# ---- what killed saves left


def test_a_save_sweeps_files_and_folders_of_dead_saves_and_no_others(tmp_path):
    dead, folder = tmp_path / temporary_name(), tmp_path / temporary_name()
    dead.write_bytes(b"half")
    folder.mkdir()
    (folder / "part").write_bytes(b"half")
    stranger = tmp_path / ".contextdb-00000000-0123456789abcdef.tmp"  # of another machine
    stranger.write_bytes(b"half")
    with staged(tmp_path / "living.csv", b"half") as living, temporary_folder(tmp_path) as growing:
        write_atomic(tmp_path / "t.csv", b"new")
        assert sorted(p for p in tmp_path.iterdir() if p.name != "t.csv") == sorted([stranger, living.temporary, growing])
    assert sorted(os.listdir(tmp_path)) == sorted([stranger.name, "t.csv"])


def test_a_file_that_cannot_be_put_back_is_said_to_be_new(tmp_path, monkeypatch):
    a, b = tmp_path / "a.csv", tmp_path / "b.csv"
    for path in (a, b):
        path.write_text("old")
    replace, n_done = os.replace, 0

    def refusing(old: Path, new: Path) -> None:
        nonlocal n_done
        if Path(new).suffix == ".csv":
            n_done += 1
            if n_done > 1:  # the second file, and then the first one's old bytes
                raise OSError(errno.EROFS, "Read-only file system")
        replace(old, new)

    monkeypatch.setattr(os, "replace", refusing)
    with pytest.raises(FileError) as caught:
        write_together(tmp_path, [NewFile(a, b"new"), NewFile(b, b"new")])
    assert a.read_text() == "new"
    assert "this one is new already" in str(caught.value)
    assert "as it was" not in str(caught.value)
    assert (tmp_path / UNFINISHED).exists()
    monkeypatch.undo()
    with pytest.warns(UnfinishedWarning, match="as they were before"):
        finish(tmp_path)
    assert (a.read_text(), b.read_text()) == ("old", "old")


def test_files_that_an_unfinished_record_wants_are_not_swept(tmp_path):
    wanted = tmp_path / temporary_name()
    wanted.write_bytes(b"new")
    (tmp_path / UNFINISHED).write_text("{}", encoding="utf-8")
    assert sweep(tmp_path) == 0
    assert wanted.exists()


def test_saves_into_one_folder_wait_for_each_other(tmp_path):
    command = [sys.executable, "-c", "import sys; from contextdb.disk import write_atomic; print(1, flush=True); "
               "write_atomic(sys.argv[1], b'theirs'); print(2, flush=True)", str(tmp_path / "t.csv")]  # fmt: skip
    with folder_turn(tmp_path):
        process = subprocess.Popen(command, cwd=ROOT, stdout=subprocess.PIPE, text=True)
        assert process.stdout is not None
        assert process.stdout.readline() == "1\n"
        (tmp_path / "t.csv").write_bytes(b"ours")
        assert (tmp_path / "t.csv").read_bytes() == b"ours"
    assert process.communicate()[0] == "2\n"
    assert (tmp_path / "t.csv").read_bytes() == b"theirs"


def test_the_names_of_temporary_files_are_in_the_advice_of_what_to_ignore():
    import fnmatch

    text = (ROOT / "docs" / "version-control.md").read_text(encoding="utf-8")
    assert ".contextdb-*" in text
    assert fnmatch.fnmatch(temporary_name(), ".contextdb-*")
    assert fnmatch.fnmatch(UNFINISHED, ".contextdb-*")


def test_nothing_is_warned_of_in_a_folder_at_rest(tmp_path):
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        finish(tmp_path)
        finish(tmp_path / "missing")


# ---- turns as Windows has them


def test_the_file_of_a_turn_that_nobody_gives_back_does_not_stop_saves_for_ever(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr(folder_lock, "fcntl", None)
    monkeypatch.setattr(folder_lock, "_MOST_TURN_S", 0.0)
    (tmp_path / ".contextdb-turn").write_bytes(b"")
    assert write_atomic(tmp_path / "t.csv", b"new")
    assert (tmp_path / "t.csv").read_bytes() == b"new"
