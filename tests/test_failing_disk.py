"""Whatever call to the system fails in a command that writes: the old file or the new one, whole, nothing else, and a sentence.

Each command runs once to count its calls, then once for each of them on a disk where that call fails.
"""

import ast
import os
import re
import shutil
import subprocess
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import pytest
from faulty_disk import ERRORS, WRITERS, faulty
from made_once import make_clip
from running import ROOT, Result, run
from strategies import some

from contextdb.edits.edits import set_cells, set_settings
from contextdb.errors import ContextDBError
from contextdb.motion import write_bvh
from contextdb.tables.project import load
from tui.model.session import Session

RAW = b"Asset,speed,hit\r\nwalk,0..5,True\r\nrun,5..9,Any\r\n"
TOML = b'[conditions.speed]\ntype = "number"\nmin = 0.0\nmax = 9.0\n'
GAME = """
[features.loco]
rate = 30.0
channels = [{ type = "position", bone = "LeftFoot" }]
[databases.loco]
clips = "*.bvh"
features = "loco"
"""
FOREIGN = b"Name;pace\njog;1,5\nrun;2,5\n"
FORMATS = {
    "tsv": "tsv",
    "xlsx": "xlsx",
    "json": "json",
    "jsonl": "jsonl",
    "dmn": "dmn",
    "unreal.csv": "unreal-csv",
    "parquet": "parquet",
}

Files = dict[str, bytes]


def done(action: Callable[[], object]) -> Result:
    """What a command would leave that does this."""
    try:
        action()
    except ContextDBError as error:
        return Result(2, "", str(error))
    return Result(0, "", "")


def edit(name: str) -> Callable[[], Result]:
    return lambda: done(lambda: load(name).with_cell(0, "speed", "1..2").save())


def edit_in_the_editor() -> None:
    """An edit of a cell and one of the declarations, saved."""
    session = Session("t.csv")
    try:
        type_speed(session, 0, "1..2")
        session.sheet.apply(set_settings(session.sheet.table, policy="first"))
        session.save()
    finally:
        session.close(keep_journal=True)


@dataclass(frozen=True)
class Writing:
    """A command that writes."""

    call: Callable[[], Result]
    targets: tuple[str, ...]
    """What it writes; a message names one of them."""
    is_together: bool = False
    """Whether all of them are old, or all new."""


def command(*arguments: str, targets: tuple[str, ...], is_together: bool = False) -> Writing:
    return Writing(lambda: run(*arguments), targets, is_together)


WRITINGS = {
    "save CSV": Writing(edit("t.csv"), ("t.csv",)),
    "save Parquet": Writing(edit("p.parquet"), ("p.parquet",)),
    "import": command("import", "f.csv", "new.csv", targets=("new.csv", "contextdb.toml"), is_together=True),
    "import over": command("import", "f.csv", "t.csv", "--force", targets=("t.csv", "contextdb.toml"), is_together=True),
    "import into a folder": command("import", "f.csv", "below/b.csv", targets=("b.csv", "contextdb.toml"), is_together=True),
    **{
        f"export {suffix}": command("export", "t.csv", f"out.{suffix}", "--as", kind, "--force", targets=(f"out.{suffix}",))
        for suffix, kind in FORMATS.items()
    },
    "merge": command("merge", "base.csv", "t.csv", "theirs.csv", targets=("t.csv",)),
    "merge lines": command("merge", "base.csv", "t.csv", "broken.csv", targets=("t.csv",)),
    "merge contextdb.toml": command("merge", "base.toml", "contextdb.toml", "theirs.toml", targets=("contextdb.toml",)),
    "compile": command(
        "compile", "t.csv", "--stubs", "facts.py", "--c-header", "t.h", targets=("t.safetensors", "facts.py", "t.h")
    ),
    "evaluate": command("evaluate", "t.csv", "moments.csv", "--out", "answers.csv", targets=("answers.csv",)),
    "coverage page": command("coverage", "t.csv", "--format", "html", "-o", "page.html", targets=("page.html",)),
    "coverage baseline": command("coverage", "t.csv", "--format", "json", "-o", "b.json", targets=("b.json",)),
    "telemetry": command(
        "coverage", "t.csv", "--telemetry", "moments.csv", "--resume", "parts", "-o", "page.txt", targets=("page.txt", "parts")
    ),
    "motion build": command("motion", "build", "game", targets=("loco.motion.safetensors",)),
    "git install": command("git", "install", ".", targets=(".gitattributes",)),
    "editor": Writing(lambda: done(edit_in_the_editor), ("t.csv", "contextdb.toml"), is_together=True),
    "clip": Writing(lambda: done(lambda: write_bvh(make_clip("walk").clip, "walk.bvh", digits=1)), ("walk.bvh",)),
}


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A project, with old files where commands write."""
    here = tmp_path / "first"
    for name in ("below", "game"):
        (here / name).mkdir(parents=True)
    files = {
        "t.csv": RAW,
        "contextdb.toml": TOML + b'[tables.b]\nfile = "below/b.csv"\nasset = "Name"\n',
        "f.csv": FOREIGN,
        "base.csv": RAW,
        "theirs.csv": RAW.replace(b"5..9", b"6..9"),
        "broken.csv": RAW.replace(b"5..9", b'"6..9'),
        "base.toml": TOML,
        "theirs.toml": TOML.replace(b"0.0", b"1.0"),
        "moments.csv": b"speed,hit\n1,True\n6,True\n",
        **dict.fromkeys(("t.safetensors", "t.h", "answers.csv", "page.html", "b.json", "walk.bvh", "out.json"), b"old"),
    }
    for name, raw in files.items():
        (here / name).write_bytes(raw)
    load(here / "t.csv").save(here / "p.parquet")
    (here / "game" / "contextdb.toml").write_text(GAME, encoding="utf-8")
    write_bvh(make_clip("walk").clip, here / "game" / "walk.bvh", digits=1)
    if shutil.which("git"):
        subprocess.run(["git", "init", "-q"], cwd=here, check=True)
    monkeypatch.chdir(here)
    return here


def files_in(folder: Path) -> Files:
    """The files of a folder, but for journals, which keep unsaved edits, locks, and the cache of features, which may lack some. Of
    sums of finished files, which carry the time, the first bytes."""
    found = {path.relative_to(folder).as_posix(): path for path in folder.rglob("*") if path.is_file()}
    return {
        name if path.suffix != ".npz" else "npz": path.read_bytes() if path.suffix != ".npz" else path.read_bytes()[:4]
        for name, path in found.items()
        if not any(part in name for part in (".contextdb-journal", ".contextdb-cache", ".git/"))
    }


def left_beside(folder: Path) -> list[str]:
    return [path.name for path in folder.rglob(".contextdb-*") if path.name not in (".contextdb-journal", ".contextdb-cache")]


@pytest.mark.parametrize("name", WRITINGS)
def test_a_call_that_fails_leaves_old_or_new_files_and_nothing_beside_them(folder, name, monkeypatch):
    if name == "git install" and not shutil.which("git"):
        pytest.skip("git is not installed")
    writing = WRITINGS[name]
    fresh = folder.with_name("fresh")
    shutil.copytree(folder, fresh)
    before = files_in(fresh)
    with faulty() as counting:
        result = writing.call()
    assert result.code in (0, 1), result.err
    after, code = files_in(folder), result.code
    assert after != before
    assert counting.n_calls > 5
    for k in some(range(counting.n_calls), 3):
        here = folder.with_name(f"at {k}")
        shutil.copytree(fresh, here)
        monkeypatch.chdir(here)
        with faulty(k, ERRORS[k % len(ERRORS)]) as system:
            result = writing.call()
        where = f"call {k}, {system.failed}: {result.err}"
        now = files_in(here)
        assert left_beside(here) == [], where
        odd = [file for file in {**now, **before} if now.get(file) not in (before.get(file), after.get(file))]
        assert odd == [], where
        if writing.is_together:
            assert now in (before, after), where
        if result.code == code:
            assert now == after, where
        else:
            assert result.code == 2, where
            assert any(target in result.err for target in writing.targets), where
            assert "Traceback" not in result.err, where


def test_every_error_of_a_save_is_refused_in_a_sentence(folder):
    before = files_in(folder)
    with faulty() as counting:
        assert edit("t.csv")().code == 0
    after = files_in(folder)
    for k in range(counting.n_calls):
        for error in ERRORS:
            (folder / "t.csv").write_bytes(RAW)
            with faulty(k, error):
                result = edit("t.csv")()
            assert files_in(folder) == (after if result.code == 0 else before)
            assert result.code == 0 or "t.csv: " in result.err
            assert os.strerror(error) in result.err or result.err.count(".") > 1 or result.code == 0


# ---- unsaved edits


def type_speed(session: Session, row: int, text: str) -> None:
    session.sheet.apply(set_cells(session.sheet.table, [(row, "speed", text)], "Type"))


def test_edits_after_one_that_could_not_be_kept_do_not_come_back_without_it(folder):
    session = Session("t.csv")
    states = [session.sheet.table.text_column("speed").to_list()]
    with faulty() as counting:
        for row, text in ((0, "1..2"), (1, "3..4"), (0, "5..6")):
            type_speed(session, row, text)
            states.append(session.sheet.table.text_column("speed").to_list())
    session.close()
    for k in range(counting.n_calls):
        session = Session("t.csv")
        with faulty(k):
            for row, text in ((0, "1..2"), (1, "3..4"), (0, "5..6")):
                type_speed(session, row, text)
        is_told = session.journal.problem is not None
        session.close(keep_journal=True)
        again = Session("t.csv")
        found = again.sheet.table.text_column("speed").to_list()
        again.close()
        assert found in states, k
        assert is_told or found == states[-1], k


# ---- every writer is counted


OPENERS = {"write_text", "write_bytes", "touch", "mkdir", "rmdir", "unlink", "symlink_to", "hardlink_to", "chmod"}
OPENERS |= {"NamedTemporaryFile", "TemporaryDirectory", "mkstemp", "mkdtemp"}
OPENERS |= {"sink_csv", "sink_parquet"}
SYSTEM = {"open", "write", "replace", "rename", "renames", "link", "symlink", "fsync", "truncate", "ftruncate", "chmod", "chown"}
SYSTEM |= {"remove", "unlink", "mkdir", "makedirs", "rmdir", "removedirs", "mkfifo", "mknod"}
SHUTIL = {"rmtree", "copyfile", "copy", "copy2", "copytree", "move"}
CALLED = re.compile(rf"\b({'|'.join(OPENERS | SYSTEM | SHUTIL)})\s*\(")
ALLOWED = {
    "contextdb/console.py": {"os.open"},  # nowhere
    "contextdb/commands/limits.py": {"os.open", "open"},  # nowhere, and a second number of standard error
    "contextdb/telemetry/evaluate_file.py": {"write_parquet"},  # into the folder of what is not finished
    "contextdb/commands/evaluate_command.py": {"sink_csv", "sink_parquet"},  # into the same
    "contextdb/edits/diffing/markers.py": {"TemporaryDirectory", "write_bytes"},  # into a temporary folder, for git to read
    "contextdb/commands/ci_command.py": {"TemporaryDirectory"},  # into a temporary folder
    "contextdb/commands/motion_build_command.py": {"TemporaryDirectory"},  # into a temporary folder
    "contextdb/commands/demo_command.py": {"TemporaryDirectory", "shutil.copyfile"},  # into a folder that nobody has yet
    "contextdb/commands/play_command.py": {"shutil.copytree"},  # into a folder that nobody has yet
    "contextdb/motion/clips/parser_process.py": {"TemporaryDirectory"},  # what the child writes, away with it
    "contextdb/motion/clips/parser_child.py": {"open", "os.open", "os.remove", "shutil.rmtree"},  # in that folder; nowhere
    "tui/model/played_run.py": {"TemporaryDirectory"},
    "contextdb/telemetry/link/game.py": {"path.open"},  # a recording, which grows while the game runs
    "contextdb/telemetry/link/doors.py": {"os.open", "mkdir", "os.chmod", "unlink"},  # a lock, sockets, and the token of a door
}


def writes_of(path: Path) -> set[str]:
    """The calls of a module that write to the disk."""
    found: set[str] = set()
    source = path.read_text(encoding="utf-8")
    if not CALLED.search(source):
        return found
    for node in ast.walk(ast.parse(source)):
        if not isinstance(node, ast.Call):
            continue
        called = ast.unparse(node.func)
        last = called.rpartition(".")[2]
        if called in {f"os.{name}" for name in SYSTEM} | {f"shutil.{name}" for name in SHUTIL}:
            found.add(called)
        elif last in OPENERS:
            found.add(last)
        elif last == "open" and any(isinstance(a, ast.Constant) and set(str(a.value)) & set("wax+") for a in node.args[-1:]):
            found.add(called)
    return found


def test_no_other_module_writes_to_the_disk():
    known = {Path(str(module.__file__)).resolve() for module in WRITERS}
    for path in [*(ROOT / "contextdb").rglob("*.py"), *(ROOT / "tui").rglob("*.py")]:
        if path.resolve() not in known:
            name = path.relative_to(ROOT).as_posix()
            assert writes_of(path) <= ALLOWED.get(name, set()), name
