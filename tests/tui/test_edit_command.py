"""`contextdb edit`: where it cannot run it says so in one message, with exit code 2, and leaves the terminal alone."""

import os
import subprocess
import sys
from pathlib import Path

import pytest
from strategies import some
from warm_start import python

ROOT = Path(__file__).parent.parent.parent
WAIT_S = 120


def environment(folder: Path, **more: str) -> dict[str, str]:
    settings = {
        "PYTHONPATH": str(ROOT),
        "XDG_STATE_HOME": str(folder),
        "XDG_CONFIG_HOME": str(folder),
        "NO_COLOR": "1",
        "COLUMNS": "200",
    }
    return {**os.environ, "TERM": "xterm-256color", **settings, **more}


def in_a_terminal(folder: Path, *arguments: str, **more: str) -> tuple[int, str]:
    """The exit code and what is printed, of the command with a terminal for its input and output."""
    import pty

    master, slave = pty.openpty()
    process = subprocess.Popen(
        python("-m", "contextdb", "edit", *arguments),
        cwd=folder,
        env=environment(folder, **more),
        stdin=slave,
        stdout=slave,
        stderr=subprocess.PIPE,
        encoding="utf-8",
    )
    os.close(slave)
    try:
        _, said = process.communicate(timeout=WAIT_S)
    finally:
        process.kill()
        os.close(master)
    return process.returncode, said


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    (tmp_path / "t.csv").write_text("Asset,hit\nwalk,True\n")
    return tmp_path


needs_pty = pytest.mark.skipif(os.name == "nt", reason="there is no pty there")


def test_without_a_terminal_it_says_what_to_use_instead(folder):
    done = subprocess.run(
        python("-m", "contextdb", "edit", "t.csv"),
        cwd=folder,
        env=environment(folder),
        stdin=subprocess.DEVNULL,
        capture_output=True,
        encoding="utf-8",
        timeout=WAIT_S,
        check=False,
    )
    assert done.returncode == 2
    assert done.stdout == ""
    assert "standard input and output are not a terminal" in done.stderr
    assert 'use "contextdb query"' in done.stderr
    assert "Traceback" not in done.stderr


UNOPENED = {
    "dumb": (["t.csv"], {"TERM": "dumb"}, "the terminal cannot move its cursor (TERM is dumb)"),
    "unset": (["t.csv"], {"TERM": ""}, "the terminal cannot move its cursor (TERM is not set)"),
    "no-file": (["no/where.csv"], {}, "no/where.csv: there is no such"),
    "unreadable": (["twice.csv"], {}, 'the column name "a" appears twice'),
    "settings": (["t.csv"], {"CONTEXTDB_EDITOR": "bad.toml"}, "cannot read the settings of the editor"),
}


@needs_pty
@pytest.mark.parametrize(("arguments", "more", "said"), some(UNOPENED.values()), ids=some(UNOPENED))
def test_what_cannot_be_opened_is_said_in_one_message(folder, arguments, more, said):
    (folder / "bad.toml").write_text("[keys")
    (folder / "twice.csv").write_text("a,a\nx,y\n")
    code, found = in_a_terminal(folder, *arguments, **more)
    assert code == 2
    assert said in found
    assert found.count("contextdb:") <= 1
    assert "Traceback" not in found


@needs_pty
def test_a_theme_nearly_right_is_mended(folder):
    code, found = in_a_terminal(folder, "t.csv", "--theme", "contextdb-drak")
    assert code == 2
    assert 'there is no theme "contextdb-drak"' in found
    assert 'Did you mean "contextdb-dark"?' in found
    assert found.count("contextdb:") <= 1
    assert "Traceback" not in found


def test_the_command_is_listed_and_explains_itself(folder):
    done = subprocess.run(
        python("-m", "contextdb", "edit", "--help"),
        cwd=folder,
        env=environment(folder),
        capture_output=True,
        encoding="utf-8",
        timeout=WAIT_S,
        check=False,
    )
    assert done.returncode == 0
    assert "contextdb edit tables/" in done.stdout
    assert "--theme" in done.stdout


@pytest.mark.parametrize(
    ("term", "colorterm", "settings_theme", "theme"),
    [
        ("xterm", "", None, "ansi-dark"),
        ("xterm", "truecolor", None, ""),
        ("xterm-256color", "", None, ""),
        ("linux", "", "nord", "nord"),
    ],
)
def test_a_terminal_of_few_colours_shows_its_own(monkeypatch, term, colorterm, settings_theme, theme):
    from tui.editor_settings import EditorSettings
    from tui.run import theme_for

    monkeypatch.setenv("TERM", term)
    monkeypatch.setenv("COLORTERM", colorterm)
    assert theme_for(EditorSettings(theme=settings_theme)) == theme


def test_the_editor_starts_without_what_the_first_screen_does_not_need(tmp_path):
    code = "import sys, tui.app; print([m for m in sys.modules if m.startswith(('contextdb.motion', 'numba', 'openpyxl'))])"
    run = subprocess.run([sys.executable, "-c", code], cwd=ROOT, capture_output=True, encoding="utf-8", check=True)
    assert run.stdout.strip() == "[]"
