"""An error of contextdb's own: exit code 70, and a report that says what and where, and nothing of the user's files."""

import os
import re
import subprocess
import sys
from contextlib import suppress
from importlib import import_module
from pathlib import Path

import polars as pl
import pytest
from running import ROOT, run
from strategies import some
from warm_start import python

from contextdb import cli
from contextdb.console import ExitCode
from tui.model.session import Session

SECRET = "hush_hush"
ERRORS = (MemoryError, RecursionError, KeyError, IndexError, AssertionError, SystemError, pl.exceptions.PanicException)
READ = "contextdb.files.texts.read_csv"
COMMANDS = {
    "check": (READ, ["check", "."]),
    "coverage": ("contextdb.covering.coverage", ["coverage", "t.csv"]),
    "query": (READ, ["query", "t.csv", "ok=True"]),
    "evaluate": (READ, ["evaluate", "t.csv", "t.csv"]),
    "diff": (READ, ["diff", "t.csv", "t.csv"]),
    "import": ("contextdb.commands.import_command.run", ["import", "t.csv", "new.csv"]),
    "export": (READ, ["export", "t.csv", "new.json"]),
    "compile": (READ, ["compile", "t.csv"]),
    "verify": ("contextdb.files.csv_source.read_csv", ["verify", "t.csv"]),
    "git status": ("contextdb.commands.git_status_command.run", ["git", "status"]),
    "motion check": ("contextdb.commands.motion_check_command.run", ["motion", "check", "."]),
    "the parser": ("contextdb.cli.Parser.parse", ["check", "."]),
}
EDITOR = """
import os, sys
from unittest import mock
from polars.exceptions import PanicException
from contextdb.cli import main

def fails(*_):
    raise {error}("{secret}")

with mock.patch("{place}", fails):
    sys.exit(main(["edit", "t.csv"]))
"""
SCREEN_OPENED, SCREEN_LEFT = "\x1b[?1049h", "\x1b[?1049l"
PLACES = ("tui.app.EditorApp.open_table", "tui.screens.main.MainScreen.compose", "tui.widgets.key_line.KeyLine._show")
DELETE = b"\x1b[3~"
WAIT_S = 120


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    (tmp_path / "t.csv").write_text(f"Asset,ok\n{SECRET},True\n", encoding="utf-8")
    monkeypatch.chdir(tmp_path)
    return tmp_path


def files() -> list[str]:
    return sorted(os.listdir())


@pytest.mark.parametrize("error", some(ERRORS))
@pytest.mark.parametrize("name", some(COMMANDS))
def test_whatever_fails_in_a_command_is_code_70_and_tells_nothing_of_the_files(name, error, monkeypatch):
    place, arguments = COMMANDS[name]

    def fails(*_: object, **__: object) -> None:
        raise error(SECRET)

    import_module(place.rpartition(".")[0].removesuffix(".Parser"))
    monkeypatch.setattr(place, fails)
    before = files()
    result = run(*arguments)
    assert (result.code, files()) == (70, before)
    assert SECRET not in result.err
    command = " ".join(arguments[: len(name.split())]) if name != "the parser" else "check"
    assert result.err.startswith(f"contextdb: {cli.CRASH}\n  {error.__name__} in contextdb {command}\n")
    assert re.search(r"\n  at .*test_crash.py:\d+, fails\n  contextdb \d", result.err)
    assert re.search(r"\n  numpy +\d", result.err)
    assert str(ROOT) not in result.err
    assert "Traceback" not in result.err


def test_a_report_names_options_and_neither_their_values_nor_what_is_behind_the_dashes(monkeypatch):
    monkeypatch.setattr("contextdb.commands.check_command.run", lambda _: 1 // 0)
    result = run("check", "--fail-on=none", f"{SECRET}.csv")
    assert "  ZeroDivisionError in contextdb check --fail-on\n" in result.err
    assert SECRET not in run("check", "--", f"--{SECRET}").err


def test_calls_that_repeat_each_other_are_counted(monkeypatch):
    def deeper(arguments: object) -> object:
        return deeper(arguments)

    monkeypatch.setattr("contextdb.commands.check_command.run", deeper)
    result = run("check", ".")
    assert result.code == 70
    assert re.search(r", deeper, \d+ times\n", result.err)
    assert len(result.err.splitlines()) < 50


@pytest.mark.parametrize(("error", "code"), [(KeyboardInterrupt, 130), (BrokenPipeError, 0), (OSError, 2)])
def test_what_is_no_error_of_contextdb_keeps_its_code(error, code, monkeypatch):
    def fails(_: object) -> None:
        raise error

    monkeypatch.setattr("contextdb.commands.check_command.run", fails)
    assert run("check", ".").code == code


def in_a_terminal(script: str, folder: Path, keys: bytes = b"") -> tuple[int, str]:
    """The exit code, and all that the terminal got. The keys are pressed once the screen has opened."""
    import pty

    master, slave = pty.openpty()
    environment = {**os.environ, "TERM": "xterm-256color", "PYTHONPATH": str(ROOT), "XDG_STATE_HOME": str(folder / "state")}
    process = subprocess.Popen(python("-c", script), cwd=folder, env=environment, stdin=slave, stdout=slave, stderr=slave)
    os.close(slave)
    painted = bytearray()
    with suppress(OSError):  # how a terminal ends on Linux
        while part := os.read(master, 65536):
            painted += part
            if keys and SCREEN_OPENED.encode() in painted:
                os.write(master, keys)
                keys = b""
    try:
        return process.wait(WAIT_S), painted.decode().replace("\r\n", "\n")
    finally:
        process.kill()
        os.close(master)


@pytest.mark.skipif(os.name == "nt", reason="there is no pty there")
@pytest.mark.parametrize("error", ["IndexError", "MemoryError", "SystemError", "PanicException"])
@pytest.mark.parametrize("place", PLACES)
def test_a_crash_of_the_editor_restores_the_screen_and_is_code_70(place, error, folder):
    code, painted = in_a_terminal(EDITOR.format(error=error, place=place, secret=SECRET), folder)
    assert code == ExitCode.INTERNAL
    screen, _, report = painted.rpartition(SCREEN_LEFT)
    assert SCREEN_OPENED in screen
    assert SCREEN_OPENED not in report
    assert f"  {error} in contextdb edit\n" in report
    assert "The edits since the last save are in the journal" in report
    assert "Traceback" not in report
    assert SECRET not in report


@pytest.mark.skipif(os.name == "nt", reason="there is no pty there")
@pytest.mark.parametrize("error", ["IndexError", "PanicException"])
def test_a_crash_at_a_key_keeps_what_was_typed_before_in_the_journal(error, folder):
    script = EDITOR.format(error=error, place="tui.model.sheet.Sheet.clear", secret=SECRET)
    code, painted = in_a_terminal(script, folder, b"typed\r" + DELETE)
    assert code == ExitCode.INTERNAL
    assert f"  {error} in contextdb edit\n" in painted.rpartition(SCREEN_LEFT)[2]
    session = Session(folder / "t.csv")
    assert list(session.sheet.table.assets) == ["typed"]
    session.close()


@pytest.mark.skipif(os.name == "nt", reason="links need a permission there")
def test_a_table_that_is_a_link_to_itself_is_refused_in_words_by_every_command(folder):
    Path("loop.csv").symlink_to("loop.csv")
    for command in ("check", "query", "import", "evaluate t.csv", "diff t.csv", "compile", "verify"):
        result = run(*command.split(), "loop.csv")
        assert result.code in (1, 2), result
        assert result.out + result.err


NOT_BUILT = """
import sys
sys.modules["contextdb.core._core"] = None
from contextdb.cli import main
sys.exit(main(["query", "t.csv", "ok=True"]))
"""


def test_a_checkout_whose_core_is_not_built_says_how_to_build_it(folder):
    done = subprocess.run([sys.executable, "-c", NOT_BUILT], cwd=folder, capture_output=True, text=True)
    assert done.returncode == ExitCode.BAD_USE
    assert done.stderr.startswith(
        "contextdb: contextdb's core is not built for this Python: run `python build_core.py` in the checkout"
    )
    assert len(done.stderr.splitlines()) == 1
