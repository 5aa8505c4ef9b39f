"""`contextdb desktop`: a file for the desktop of this user, and nothing else."""

import configparser
import shlex
import sys
from pathlib import Path

import pytest
from running import run


@pytest.fixture
def home(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("XDG_DATA_HOME", str(tmp_path))
    monkeypatch.setenv("PATH", "")
    return tmp_path


def test_install_writes_an_entry_that_opens_a_table_without_a_terminal(home: Path) -> None:
    assert run("desktop", "install").code == 0
    entry = configparser.ConfigParser(interpolation=None)
    entry.read(home / "applications" / "contextdb.desktop")
    values = entry["Desktop Entry"]
    assert shlex.split(values["Exec"]) == [sys.executable, "-m", "contextdb", "edit", "--browser", "--", "%f"]
    assert "text/csv" in values["MimeType"].split(";")
    assert values["Terminal"] == "false"
    assert "all is set" in run("desktop", "install").out


def test_uninstall_removes_it(home: Path) -> None:
    run("desktop", "install")
    assert "removed" in run("desktop", "uninstall").out
    assert not list((home / "applications").iterdir())
    assert "nothing is set" in run("desktop", "uninstall").out


def test_without_what_sets_a_default_one_is_told_how_to_do_it(home: Path) -> None:
    result = run("desktop", "install", "--default")
    assert result.code == 2
    assert "Open with" in result.err


def test_a_program_is_quoted_as_the_entry_reads_it(monkeypatch: pytest.MonkeyPatch, home: Path) -> None:
    monkeypatch.setattr(sys, "executable", "/a b/100%/$x")
    run("desktop", "install")
    assert 'Exec="/a b/100%%/\\\\$x" -m contextdb' in (home / "applications" / "contextdb.desktop").read_text()
