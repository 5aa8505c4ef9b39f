"""A project is data from strangers: what is in its folder writes and reads nothing elsewhere, and nothing waits for it.

Every command, and the editor, in a made clone. Each file that it writes, and each that it finds by itself, is made in turn a link
to a file, to a folder and to nothing elsewhere, a folder, a pipe, a file of another user. What a person typed is followed.
"""

from __future__ import annotations

import atexit
import json
import os
import re
import shutil
import signal
import subprocess
import sys
from collections.abc import Callable, Iterator
from contextlib import chdir, contextmanager
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory, mkdtemp
from threading import Event, Thread
from types import FrameType
from unittest.mock import patch

import pytest
from motion_project import STICK, write_project
from motion_project import TOML as MOTION
from running import ROOT, Result, run
from strategies import IS_FULL, some
from telemetry.links import FACTS, table
from watched_disk import touched

import contextdb
from contextdb.cli import COMMANDS, Group
from contextdb.commands.ci_command import REPORTS
from contextdb.commands.demo_command import sample_folder
from contextdb.disk.folder_lock import UNFINISHED, temporary_name
from contextdb.edits.edits import set_settings
from contextdb.errors import ContextDBError, FileError
from contextdb.files.journal_lines import line_of
from contextdb.motion import Trace, build
from contextdb.tables.project import Project, load
from tui.model.journal import journal_path
from tui.model.session import Session
from tui.model.teams import Teams, teams_path
from tui.model.visible_columns import VisibleColumns
from tui.model.watched import digest_of

pytestmark = pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="links and pipes as POSIX has them")

TABLE = "Asset Name,speed,hit\nwalk,0..5,True\nrun,5..9,Any\n"
SCHEMA = '[conditions.speed]\ntype = "number"\n[tables.t]\n[tables.other]\nfile = "below/other.csv"\n'
FILES = {
    "contextdb.toml": SCHEMA,
    "t.csv": TABLE,
    "below/other.csv": TABLE,
    "t.cases.csv": "Case,Expected,speed\nslow,walk,1\n",
    "t.notes.csv": "Asset,Column,Note,Colour\nwalk,speed,why,\n",
    "t.gaps.csv": "State,Owner,speed\nopen,Ana,>9\n",
    "in/f.csv": "Name;pace\njog;1,5\nrun;2,5\n",
    "in/base.csv": TABLE,
    "in/theirs.csv": TABLE.replace("5..9", "6..9"),
    "in/moments.csv": "speed,hit\n1,True\n6,True\n",
}


def edited() -> Result:
    """A table opened in the editor, an edit of a cell and one of a setting, notes, and all of it saved."""
    try:
        session = Session("t.csv")
        problem = session.problem
        session.sheet.go(0, 1)
        assert session.sheet.type_text("1..2") is None
        session.sheet.apply(set_settings(session.sheet.table, policy="first"))
        session.poll()
        session.save()
        session.sheet.marks.with_note("walk", "speed", "new").write(session.path)
        Teams.beside(session.sheet.table).save(teams_path(session.sheet.table) or session.path)
        session.close()
    except ContextDBError as error:
        return Result(2, "", str(error))
    return Result(0, "", "" if problem is None else str(problem))


def left() -> Result:
    """The same, left in the middle as by a kill, and opened again."""
    try:
        session = Session("t.csv")
        session.sheet.go(0, 1)
        session.sheet.type_text("1..2")
        session.sheet.show_columns(VisibleColumns(hidden=frozenset(["hit"])))
        session.close(keep_journal=True)
        again = Session("t.csv")
        problem = again.problem
        again.close()
    except ContextDBError as error:
        return Result(2, "", str(error))
    return Result(0, "", "" if problem is None else str(problem))


def heard() -> Result:
    """What a running game asks, compared with the tables of the folder."""
    is_over, jog = Event(), table()

    def play() -> None:
        while not is_over.wait(0.002):
            jog.pick(FACTS, rng=1)

    game = Thread(target=play)
    with (
        TemporaryDirectory(prefix="cdb") as meeting,
        patch.dict(os.environ, XDG_RUNTIME_DIR=meeting),
        contextdb.link("game") as link,
    ):
        link.watch(jog, "player")
        game.start()
        try:
            return run("live", "game", "--most", "1", "--tables", ".", "--record", "new.jsonl")
        finally:
            is_over.set()
            game.join()


def debugged() -> Result:
    """The debugger, up to its screen."""
    with (
        patch("contextdb.commands.motion_debug_command.require_terminal", lambda instead: None),
        patch("tui.debug.run.debug", lambda file, trace, folder, databases, why: print(why)),
    ):
        return run("motion", "debug", SESSION)


@dataclass(frozen=True)
class Work:
    """A command, and the files that it writes or finds without that anybody typed them."""

    call: Callable[[], Result]
    writes: tuple[str, ...] = ()
    finds: tuple[str, ...] = ()


def command(*words: str, writes: tuple[str, ...] = (), finds: tuple[str, ...] = ()) -> Work:
    return Work(lambda: run(*words), writes, finds)


SESSION = "in/session.parquet"
HAS_GIT = shutil.which("git") is not None
OF_FOLDER = ("contextdb.toml", "t.csv", "below/other.csv", UNFINISHED)
OF_TABLE = ("contextdb.toml", UNFINISHED)
TABLES = {
    "check": command("check", ".", finds=(*OF_FOLDER, "t.cases.csv")),
    "coverage": command("coverage", ".", finds=OF_FOLDER),
    "cases": command("cases", "t.csv", "--write", writes=("t.cases.csv",), finds=OF_TABLE),
    "tidy": command("tidy", "t.csv", "--write", finds=OF_TABLE),
    "index": command("index", ".", "--out", "out/rows.parquet", finds=OF_FOLDER),
    "query": command("query", "t.csv", "speed=1", "hit=True", finds=OF_TABLE),
    "query by name": command("query", "t", "speed=1", "hit=True", finds=("contextdb.toml", "t.csv")),
    "compile": command("compile", ".", writes=("t.safetensors", "below/other.safetensors"), finds=OF_FOLDER),
    "compile into a folder": command("compile", ".", "-o", "out", writes=("out/t.safetensors", "out/other.safetensors")),
    "import": command("import", "in/f.csv", "new.csv", "--force", writes=("contextdb.toml",)),
    "export": command("export", "t.csv", "x.json", "--force", finds=OF_TABLE),
    "diff": command("diff", "t.csv", "in/theirs.csv", finds=OF_TABLE),
    "merge": command("merge", "in/base.csv", "t.csv", "in/theirs.csv", finds=OF_TABLE),
    "evaluate": command("evaluate", "t.csv", "in/moments.csv", "--out", "answers.csv", finds=OF_TABLE),
    "coverage of moments": command("coverage", "t.csv", "--telemetry", "in/moments.csv", "--resume", "parts", finds=OF_TABLE),
    "ci": command(
        *("ci", ".", "--out", "report"),
        writes=tuple(f"report/{name}" for name in REPORTS),
        finds=(*OF_FOLDER, "t.cases.csv"),
    ),
    **({"ci against a commit": command("ci", ".", "--against", "HEAD", finds=("contextdb.toml", "t.csv"))} if HAS_GIT else {}),
    "live": Work(heard, finds=OF_FOLDER),
    "verify": command("verify", ".", finds=("t.csv", "below/other.csv")),
    "git install": command("git", "install", ".", writes=(".gitattributes",)),
    "git uninstall": command("git", "uninstall", ".", finds=(".gitattributes",)),
    "git status": command("git", "status", ".", finds=(".gitattributes",)),
    "git text": command("git", "text", "t.csv"),
    "edit": Work(
        edited,
        ("contextdb.toml", "t.notes.csv", "t.actors.json"),
        (".contextdb-journal/t.csv.journal", ".contextdb-journal/t.csv.lock", ".contextdb-journal/t.csv.base", UNFINISHED),
    ),
    "edit again": Work(
        left,
        (".contextdb-journal/t.csv.journal", ".contextdb-journal/t.csv.lock", ".contextdb-journal/.gitignore"),
        (".contextdb-journal/t.csv.base", ".contextdb-journal/t.csv.columns.json"),
    ),
}
OF_GAME = ("contextdb.toml", "moves.csv", "clips/jog.bvh", "clips/marks.csv", ".contextdb-cache/.gitignore")
GAMES = {
    "motion build": command(
        *("motion", "build", ".", "--poses", "--database", "free"),
        writes=("free.motion.safetensors", "free.poses.safetensors", ".contextdb-cache/.gitignore"),
        finds=("contextdb.toml", "moves.csv", "clips/jog.bvh", "clips/marks.csv"),
    ),
    "motion check": command("motion", "check", ".", finds=("contextdb.toml", "clips/jog.bvh", "clips/marks.csv")),
    "motion prepare": command(
        *("motion", "prepare", ".", "--write"),
        writes=("clips/marks.csv", "contextdb.toml", ".contextdb-cache/prepared.json"),
        finds=("clips/jog.bvh",),
    ),
    "motion describe": command(
        *("motion", "describe", ".", "--into", "moves.csv", "--update"), writes=("contextdb.toml",), finds=("clips/jog.bvh",)
    ),
    "motion bones": command("motion", "bones", "clips", finds=("clips/jog.bvh",)),
    "motion search": command(
        *("motion", "search", ".", "free", "--query", "jog@0.5", "--speed", "1.3"),
        finds=("free.motion.safetensors", ".contextdb-cache", "contextdb.toml"),
    ),
    "motion select": command(
        *("motion", "select", ".", "moves", "--query", "jog@0.5", "--speed", "1.3"),
        finds=("all.motion.safetensors", *OF_GAME),
    ),
    "motion coverage": command("motion", "coverage", ".", finds=("all.motion.safetensors", *OF_GAME)),
    "motion run": command(
        "motion", "run", ".", "player", "in/stick.csv", "--out", "new.parquet", "--poses", "new.npz", finds=OF_GAME
    ),
    "motion probe": command(
        *("motion", "probe", ".", "player", "--drive", "straight", "--speed", "1.3", "--out", "probed"),
        writes=("probed/style-normal_straight_1.3.parquet", "probed/style-tired_straight_1.3.parquet"),
        finds=OF_GAME,
    ),
    "motion measure": command("motion", "measure", SESSION, finds=OF_GAME),
    "motion replay": command("motion", "replay", SESSION, "--what-if", "continuing=-0.1", finds=OF_GAME),
    "motion debug": Work(debugged, finds=OF_GAME),
    "motion learn": command(
        "motion", "learn", SESSION, "--write", writes=("contextdb.toml",), finds=(*OF_GAME, "in/session.choices.csv")
    ),
}
DEMO = {
    "demo": command(
        "demo", "--tables", ".", "--keep", "kept", finds=("contextdb.toml", "locomotion.csv", "clips/marks.csv", "a note.txt")
    ),
}
WORKS = {**TABLES, **GAMES, **DEMO}


# ---- a clone


@cache
def sample(work: str) -> Path:
    """A clone for a command of tables, of a game or of the demo, and around it what is none of its business."""
    around = Path(os.path.realpath(mkdtemp(prefix="strangers-")))
    atexit.register(shutil.rmtree, around, ignore_errors=True)
    clone = around / "clone"
    if work == "demo":
        shutil.copytree(sample_folder(), clone, ignore=shutil.ignore_patterns(".*"))
    elif work == "game":
        write_project(clone, MOTION, stick="time_s\n")
        (clone / "in").mkdir()
        (clone / "in/stick.csv").write_text(STICK)
        with chdir(clone):
            assert run("motion", "run", ".", "player", "in/stick.csv", "--out", SESSION).code == 0
        (clone / "in/session.choices.csv").write_text("tick,asset,choice\n120,walk_tired,+\n")
        shutil.rmtree(clone / ".contextdb-cache")
    else:
        for name, text in FILES.items():
            (clone / name).parent.mkdir(parents=True, exist_ok=True)
            (clone / name).write_text(text, encoding="utf-8", newline="\n")
        (clone / "out").mkdir()
        (clone / "parts").mkdir()
    if HAS_GIT:
        own = ("-c", "user.name=a", "-c", "user.email=a@example.com", "-c", "commit.gpgsign=false")
        for words in (("init",), ("add", "."), (*own, "commit", "-m", "a clone")):
            subprocess.run(["git", *words, *(() if words == ("add", ".") else ("-q",))], cwd=clone, check=True)
    (around / "home").mkdir()
    (around / "home" / "key").write_text("a key\n")
    return around


@dataclass(frozen=True)
class Place:
    """A clone in a folder of its own, and a home beside it that it shall not touch."""

    around: Path

    @property
    def clone(self) -> Path:
        return self.around / "clone"

    @property
    def home(self) -> Path:
        return self.around / "home"

    def contents(self) -> dict[str, bytes]:
        """All that is around the clone."""
        return {str(path): path.read_bytes() for path in sorted(self.home.rglob("*")) if path.is_file()}


def sample_of(work: str) -> str:
    return "game" if work in GAMES else "demo" if work in DEMO else "tables"


@contextmanager
def cloned(work: str, tmp_path: Path, name: str) -> Iterator[Place]:
    around = tmp_path / name
    shutil.copytree(sample(sample_of(work)), around, symlinks=True)
    here = os.getcwd()
    os.chdir(around / "clone")
    try:
        yield Place(around)
    finally:
        os.chdir(here)
        shutil.rmtree(around, ignore_errors=True)


@contextmanager
def at_most(seconds: int) -> Iterator[None]:
    """Fail where something waits, as for the other end of a pipe."""

    def late(number: int, frame: FrameType | None) -> None:
        raise AssertionError("it waits")

    before = signal.signal(signal.SIGALRM, late)
    signal.alarm(seconds)
    try:
        yield
    finally:
        signal.alarm(0)
        signal.signal(signal.SIGALRM, before)


# ---- what stands in the place of a file


def link_to_file(path: Path, home: Path) -> None:
    shutil.copyfile(path, home / "victim") if path.is_file() else (home / "victim").write_text("precious\n")
    path.unlink(missing_ok=True)
    path.symlink_to(home / "victim")


def link_to_folder(path: Path, home: Path) -> None:
    path.unlink(missing_ok=True)
    path.symlink_to(home)


def dangling_link(path: Path, home: Path) -> None:
    path.unlink(missing_ok=True)
    path.symlink_to(home / "none yet")


def relative_link(path: Path, home: Path) -> None:
    shutil.copyfile(path, home / "victim") if path.is_file() else (home / "victim").write_text("precious\n")
    path.unlink(missing_ok=True)
    path.symlink_to(os.path.relpath(home / "victim", path.parent))


def loop(path: Path, home: Path) -> None:
    path.unlink(missing_ok=True)
    path.symlink_to(path.name)


def folder(path: Path, home: Path) -> None:
    path.unlink(missing_ok=True)
    path.mkdir()


def pipe(path: Path, home: Path) -> None:
    path.unlink(missing_ok=True)
    os.mkfifo(path)


def folder_behind_link(path: Path, home: Path) -> None:
    """The folder of the file is elsewhere, with all that is in it."""
    shutil.copytree(path.parent, home / "moved")
    shutil.rmtree(path.parent)
    path.parent.symlink_to(home / "moved")


KINDS = (link_to_file, link_to_folder, dangling_link, relative_link, loop, folder, pipe, folder_behind_link)
TYPED = {
    ("compile into a folder", "out/"),
    ("motion bones", "clip"),
    ("ci", "repo"),
    ("motion probe", "prob"),
    ("motion learn", "in/s"),
}
"""Folders that are named on the command line, so that a link there is followed."""
OWN = (".contextdb-journal", ".contextdb-cache")


def cases() -> list[tuple[str, str, Callable[[Path, Path], None]]]:
    """Command, file and what is in its place: each file with every kind, or with some of them every day."""
    found = []
    for number, (name, work) in enumerate(WORKS.items()):
        for file in dict.fromkeys((*work.writes, *work.finds)):
            kinds = [kind for kind in KINDS if kind is not folder_behind_link or ("/" in file and (name, file[:4]) not in TYPED)]
            step = 3 if name in TABLES else 7
            found += [(name, file, kind) for kind in (kinds if IS_FULL else kinds[number % step :: step])]
    return found


@pytest.mark.parametrize(("name", "file", "kind"), [pytest.param(*c, id=f"{c[0]}, {c[1]}, {c[2].__name__}") for c in cases()])
def test_nothing_is_read_or_written_where_a_file_of_a_clone_leads_to(tmp_path, name, file, kind):
    with cloned(name, tmp_path, "a") as place:
        path = place.clone / file
        path.parent.mkdir(parents=True, exist_ok=True)
        kind(path, place.home)
        before = place.contents()
        with touched() as found, at_most(60):
            result = WORKS[name].call()
        assert place.contents() == before
        assert found.outside(place.clone, place.around) == []
        assert result.code in (0, 1, 2)
        assert "Traceback" not in result.err
        if kind in (link_to_file, relative_link) and file != UNFINISHED and not file.startswith(OWN):
            assert result.code or name in ("merge", "motion debug"), "they go on without the file, and report it"
            assert "link" in result.err + result.out
            assert path.name in result.err + result.out


def commands(group: Group) -> Iterator[str]:
    """The words of each command, and of those that begin with it."""
    for name in group.commands:
        module, words = group.command(name), (*group.words, name)
        yield from commands(Group(words, module.COMMANDS)) if hasattr(module, "COMMANDS") else [" ".join(words)]


def test_every_command_is_in_the_table():
    of_the_user = {"desktop install", "desktop uninstall"}  # they know no project
    assert set(commands(Group((), COMMANDS))) - set(WORKS) == {*of_the_user, "play"}  # a game in a window


@pytest.mark.parametrize("name", WORKS)
def test_a_command_writes_in_its_project_and_reads_nothing_around_it(tmp_path, name):
    with cloned(name, tmp_path, "a") as place:
        before = {path.relative_to(place.clone).as_posix(): path.read_bytes() for path in place.clone.rglob("*") if path.is_file()}
        with touched() as found, at_most(120):
            result = WORKS[name].call()
        assert result.code in (0, 1), result.err
        assert found.outside(place.clone, place.around) == []
        there = {path.relative_to(place.clone).as_posix(): path.read_bytes() for path in place.clone.rglob("*") if path.is_file()}
        typed = {
            "t.csv",
            "new.csv",
            "x.json",
            "answers.csv",
            "out/rows.parquet",
            "moves.csv",
            "new.jsonl",
            "new.parquet",
            "new.npz",
        }
        new = {file for file in there if there[file] != before.get(file) and not file.startswith(".git/")} - typed
        own = {file for file in new if file.startswith((*OWN, "parts/", "kept/"))}
        assert new - own <= set(WORKS[name].writes)


@pytest.mark.skipif(not hasattr(os, "geteuid") or os.geteuid() != 0, reason="only root can give a file to another user")
@pytest.mark.parametrize("own", ["t.csv.journal", "t.csv.lock", "t.csv.columns.json"])
def test_a_file_of_another_user_in_our_folder_stays_as_it_is(tmp_path, own):
    with cloned("check", tmp_path, "a") as place:
        path = place.clone / ".contextdb-journal" / own
        path.parent.mkdir()
        path.write_text("theirs\n")
        os.chown(path, 12345, 12345)
        result = edited()
        assert (result.code, path.read_text()) == (0, "theirs\n")
        if own == "t.csv.journal":
            assert "another user" in result.err


@pytest.mark.parametrize("own", ["t.csv.journal", "t.csv.lock"])
def test_a_second_name_of_a_file_elsewhere_is_not_written_into(tmp_path, own):
    with cloned("check", tmp_path, "a") as place:
        path = place.clone / ".contextdb-journal" / own
        path.parent.mkdir()
        head = line_of({"format": 1, "file": "t.csv", "digest": digest_of(TABLE.encode())})
        edit = load("t.csv").with_cell(0, "speed", "1..3")
        (place.home / "victim").write_bytes(head + b"half")
        os.link(place.home / "victim", path)
        before = place.contents()
        result = edited()
        assert edit.n_rows == 2
        assert place.contents() == before
        assert own == "t.csv.lock" or "second name" in result.err


# ---- journals


def saving(victim: object, text: object = "written by opening a table\n", was: object = None) -> bytes:
    """A journal whose last save is to go on with another file."""
    schema = {"was": was, "text": text} | ({} if victim is None else {"path": victim})
    record = {"saving": digest_of(TABLE.encode()), "schema": schema}
    return line_of({"format": 1, "file": "t.csv", "digest": "x"}) + line_of({"do": {}}) + line_of(record)


def with_journal(clone: Path, raw: bytes) -> Path:
    path = journal_path(clone / "t.csv")
    path.parent.mkdir(exist_ok=True)
    path.write_bytes(raw)
    return path


@pytest.mark.parametrize("victim", ["new", "../home/new", "/absolute", 5, ["a"], "t.csv", "below/contextdb.toml"])
def test_a_journal_writes_no_file_that_it_names(tmp_path, victim):
    with cloned("check", tmp_path, "a") as place:
        named = str(place.home / "new") if victim == "/absolute" else victim
        with_journal(place.clone, saving(named))
        before = place.contents()
        with touched() as found:
            session = Session("t.csv")
            problem = session.problem
            session.close()
        assert place.contents() == before
        assert found.outside(place.clone, place.around) == []
        assert not (place.clone / "new").exists()
        assert problem is not None
        assert "another contextdb.toml" in str(problem)
        assert (place.clone / "contextdb.toml").read_text() == SCHEMA
        assert (place.clone / "t.csv").read_text() == TABLE


@pytest.mark.parametrize("is_old_form", [False, True])
def test_a_save_that_was_killed_before_contextdb_toml_is_brought_to_an_end(tmp_path, is_old_form):
    with cloned("check", tmp_path, "a") as place:
        new = SCHEMA.replace("[tables.t]\n", '[tables.t]\npolicy = "first"\n')
        own = str(place.clone / "contextdb.toml") if is_old_form else None
        with_journal(place.clone, saving(own, new, digest_of(SCHEMA.encode())))
        session = Session("t.csv")
        assert session.problem is None
        assert session.sheet.table.settings.policy == "first"
        session.close()
        assert (place.clone / "contextdb.toml").read_text() == new


@pytest.mark.parametrize("text", ["\ud800", 5, None, "[[", "[conditions.speed]\ntype = 5\n", {"a": 1}], ids=ascii)
def test_a_journal_leaves_contextdb_toml_alone_where_its_text_is_none(tmp_path, text):
    with cloned("check", tmp_path, "a") as place:
        with_journal(place.clone, saving(None, text, digest_of(SCHEMA.encode())))
        Session("t.csv").close()
        assert (place.clone / "contextdb.toml").read_text() == SCHEMA


@pytest.mark.parametrize("record", [[], 5, "text", None, True, [[]]], ids=str)
def test_a_line_of_a_journal_that_is_no_object_is_a_damaged_line(tmp_path, record):
    with cloned("check", tmp_path, "a") as place:
        head = line_of({"format": 1, "file": "t.csv", "digest": digest_of(TABLE.encode())})
        with_journal(place.clone, head + line_of(record))
        session = Session("t.csv")
        assert "line 2 was altered" in str(session.problem)
        session.close()


def test_a_journal_of_today_names_no_path(tmp_path):
    with cloned("check", tmp_path, "a") as place:
        session = Session("t.csv")
        session.sheet.apply(set_settings(session.sheet.table, policy="first"))
        session.journal.saving(b"x", None)
        raw = journal_path(place.clone / "t.csv").read_bytes()
        session.close()
        assert str(tmp_path).encode() not in raw


# ---- links that stay inside, and what was typed


def test_links_that_stay_in_the_project_are_followed(tmp_path):
    with cloned("check", tmp_path, "a") as place:
        (place.clone / "deep").mkdir()
        for name in ("t.csv", "t.cases.csv", "contextdb.toml"):
            os.replace(name, f"deep/{name}")
            os.symlink(f"deep/{name}", name)
        os.symlink("deep/t.safetensors", "t.safetensors")
        assert run("check", ".").code == 0
        assert run("compile", ".").code == 0
        assert os.path.islink("t.safetensors")
        assert Path("deep/t.safetensors").is_file()
        result = edited()
        assert (result.code, result.err) == (0, "")
        assert "first" in Path("deep/contextdb.toml").read_text()


def test_a_link_that_was_typed_is_followed_wherever_it_leads(tmp_path):
    with cloned("check", tmp_path, "a") as place:
        os.symlink(place.home / "typed.safetensors", "typed.safetensors")
        (place.home / "typed.csv").write_text(TABLE)
        os.symlink(place.home / "typed.csv", "typed.csv")
        assert run("compile", "t.csv", "-o", "typed.safetensors").code == 0
        assert (place.home / "typed.safetensors").is_file()
        assert run("query", "typed.csv", "speed=1", "hit=True").code == 0
        os.symlink(place.clone, place.home / "project")
        os.unlink("typed.csv")
        assert run("check", str(place.home / "project")).code == 0


def test_all_links_out_of_a_folder_are_reported_together_with_place_and_mend(tmp_path):
    with cloned("check", tmp_path, "a") as place:
        for name in ("t.csv", "below/other.csv"):
            link_to_file(place.clone / name, place.home)
        with pytest.raises(FileError) as caught:
            Project.load(".")
        assert [fault.place.file for fault in caught.value.faults] == ["t.csv", "below/other.csv"]
        assert str(caught.value.faults[0]) == (
            f't.csv: a link leads to "{place.home}/victim", which is not in the folder ".". '
            "Accepted: files of that folder. Try to put the file itself there."
        )


def test_the_folder_of_the_cache_is_a_link_only_where_it_was_named(tmp_path):
    with cloned("motion build", tmp_path, "a") as place:
        schema = Project.load(".").schema
        from contextdb.motion import MotionConfig

        config = MotionConfig.from_dict(schema.motion)
        (place.home / "cache").mkdir()
        os.symlink(place.home / "cache", ".contextdb-cache")
        entry = place.home / "cache" / "free.features" / ("0" * 32 + ".safetensors")
        entry.parent.mkdir()
        entry.write_text("mine\n")
        build(config, ".", names=["free"])
        assert [path.name for path in (place.home / "cache").rglob("*.safetensors")] == [entry.name]
        assert entry.read_text() == "mine\n"
        os.unlink(".contextdb-cache")
        os.symlink(place.home / "cache", "mine")
        build(config, ".", names=["free"], cache="mine")
        assert len(list((place.home / "cache").rglob("*.safetensors"))) > 1
        assert not entry.exists()


def test_a_table_that_becomes_a_link_out_of_a_watched_folder_is_told_and_the_old_version_stays(tmp_path):
    with cloned("check", tmp_path, "a") as place, contextdb.watch(".", poll_s=None, settle_s=0.0) as watched:
        link_to_file(place.clone / "t.csv", place.home)
        (place.home / "victim").write_text(TABLE.replace("walk", "stolen"))
        with touched() as found:
            for _ in range(3):
                watched.poll()
        assert found.outside(place.clone, place.around) == []
        assert [fault.rule for fault in watched.faults] == ["link-outside"]
        assert list(watched["t"].assets) == ["walk", "run"]


@pytest.mark.parametrize("project", ["../../home", "absolute", "../linked", "\0"], ids=ascii)
def test_a_session_leads_to_no_project_around_its_work_tree(tmp_path, project):
    with cloned("motion replay", tmp_path, "a") as place:
        named = str(place.clone) if project == "absolute" else project
        shutil.copytree(place.clone / "clips", place.home / "clips")
        for name in ("contextdb.toml", "moves.csv"):
            shutil.copy(name, place.home)
        os.symlink(place.home, "linked")
        trace = Trace.load(SESSION)
        trace.about = {name: {**about, "project": named} for name, about in trace.about.items()}
        trace.save(SESSION)
        before = place.contents()
        with touched() as found:
            results = [run("motion", "replay", SESSION, "--at", "1s"), run("motion", "measure", SESSION), debugged()]
        assert place.contents() == before
        assert [path for path in found.read | found.written if path.is_relative_to(place.home)] == []
        assert [result.code for result in results] == [0, 0, 0]
        if project != "\0":
            assert all("is not in the folder of the session" in result.out + result.err for result in results)
        (place.clone / ".git").rename(place.around / ".git")
        if project == "../../home":
            result = run("motion", "replay", SESSION, "--at", "1s")
            assert "folder of the session" not in result.out + result.err


# ---- what a killed command is said to have left


@pytest.mark.parametrize("kind", [link_to_file, pipe, dangling_link, folder], ids=lambda kind: kind.__name__)
def test_a_record_of_unfinished_work_names_no_file_that_waits_or_leads_elsewhere(tmp_path, kind):
    with cloned("check", tmp_path, "a") as place:
        new, target = temporary_name(), "s.csv"
        (place.clone / new).write_text("x")
        kind(place.clone / target, place.home)
        entry = {"file": target, "new": new, "is": digest_of(b"x"), "old": None, "was": None}
        (place.clone / UNFINISHED).write_text(json.dumps({"format": 1, "files": [entry]}))
        before = place.contents()
        with touched() as found, at_most(30):
            result = run("query", "t.csv", "speed=1", "hit=True")
        assert place.contents() == before
        assert found.outside(place.clone, place.around) == []
        assert "Traceback" not in result.err


def test_what_killed_saves_left_is_removed_and_nothing_that_a_link_of_such_a_name_leads_to(tmp_path):
    with cloned("check", tmp_path, "a") as place:
        os.symlink(place.home / "key", temporary_name())
        os.symlink(place.home, temporary_name())
        os.mkfifo(temporary_name())
        before = place.contents()
        with touched() as found, at_most(30):
            assert edited().code == 0
        assert place.contents() == before
        assert found.outside(place.clone, place.around) == []


# ---- the whole editor


@pytest.mark.parametrize("file", some(["t.csv.lock", "t.csv.journal", "", "t.csv.columns.json"], 1))
def test_the_editor_opens_a_table_of_a_hostile_clone_and_says_what_is_not_used(tmp_path, file):
    from terminal import press, screen_text, with_editor

    with cloned("check", tmp_path, "a") as place:
        own = place.clone / ".contextdb-journal"
        if file:
            own.mkdir()
            link_to_file(own / file, place.home)
        else:
            own.symlink_to(place.home)
        before = place.contents()

        async def script(app, pilot):
            await press(pilot, "down", "right")
            return screen_text(app)

        with touched() as found:
            screen = with_editor(place.clone / "t.csv", script)
        assert "walk" in screen
        assert place.contents() == before
        assert found.outside(place.clone, place.around) == []


# ---- the list of threats


def test_every_threat_of_the_list_names_a_test_that_there_is():
    rows = re.findall(r"^\| [^|]+ \| [^|]+ \| ([^|]+) \|$", (ROOT / "SECURITY.md").read_text(encoding="utf-8"), re.M)
    named = [name for row in rows for name in re.findall(r"`([^`]+)`", row)]
    assert len(named) >= 30
    for name in named:
        file, _, test = name.partition("::")
        assert (ROOT / file).exists(), name
        assert not test or f"def {test}(" in (ROOT / file).read_text(encoding="utf-8"), name


# ---- by the system, where what is not Python opens files


@pytest.mark.skipif(not shutil.which("strace"), reason="strace is not installed")
@pytest.mark.parametrize("name", some(["compile", "verify", "evaluate", "check"], 4))
def test_the_system_sees_no_file_opened_around_the_project(tmp_path, name):
    words = {"compile": ("compile", "."), "verify": ("verify", "."), "check": ("check", ".")}
    words["evaluate"] = ("evaluate", "t.csv", "in/moments.csv", "--out", "answers.parquet")
    with cloned("check", tmp_path, "a") as place:
        log = tmp_path / "log"
        calls = "trace=openat,open,creat,unlink,unlinkat,rename,renameat,renameat2,mkdir,mkdirat,symlinkat,linkat,truncate"
        done = subprocess.run(
            ["strace", "-f", "-y", "-o", str(log), "-e", calls, sys.executable, "-m", "contextdb", *words[name]],
            cwd=place.clone,
            env={**os.environ, "PYTHONPATH": str(ROOT)},
            capture_output=True,
        )
        if "ptrace" in done.stderr.decode():
            pytest.skip("processes may not be traced here")
        assert done.returncode in (0, 1), done.stderr
        around = str(place.around)
        lines = [line for line in log.read_text(errors="replace").splitlines() if around in line and " = -1 " not in line]
        assert lines
        assert [line for line in lines if f'"{around}' in line and f"{place.clone}" not in line] == []
        assert [line for line in lines if str(place.home) in line] == []
