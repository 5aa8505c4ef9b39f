"""The clipboard: what is copied goes as far as it can, and what is pasted is the newest."""

import subprocess
from dataclasses import dataclass, field
from typing import Any

import pyperclip
import pytest

from tui.clipboard import MOST_OSC_BYTES, Clipboard


@dataclass
class System:
    """A clipboard of the system that may not be there, or only be written."""

    can_copy: bool = True
    can_paste: bool = True
    text: str = ""
    to_terminal: list[str] = field(default_factory=list)
    to_tmux: list[bytes] = field(default_factory=list)
    tmux_fails: bool = False

    def copy(self, text: str) -> None:
        if not self.can_copy:
            raise pyperclip.PyperclipException("none here")
        self.text = text

    def paste(self) -> str:
        if not self.can_paste:
            raise pyperclip.PyperclipException("none here")
        return self.text

    def run(self, command: list[str], input: bytes, **_: Any) -> subprocess.CompletedProcess[bytes]:  # noqa: A002 - subprocess's name
        if self.tmux_fails:
            raise subprocess.TimeoutExpired(command, 2)
        self.to_tmux.append(input)
        return subprocess.CompletedProcess(command, 0)


@pytest.fixture
def system(monkeypatch: pytest.MonkeyPatch) -> System:
    made = System()
    monkeypatch.setattr(pyperclip, "copy", made.copy)
    monkeypatch.setattr(pyperclip, "paste", made.paste)
    monkeypatch.setattr(subprocess, "run", made.run)
    monkeypatch.delenv("TMUX", raising=False)
    return made


@pytest.fixture
def clipboard(system: System) -> Clipboard:
    return Clipboard(system.to_terminal.append)


def test_a_copy_goes_to_the_system_and_to_the_terminal(system, clipboard):
    assert clipboard.copy("a\tb\n") == ""
    assert system.text == "a\tb\n"
    assert system.to_terminal == ["a\tb\n"]


def test_what_was_copied_here_is_pasted_where_there_is_no_system_clipboard(system, clipboard):
    system.can_copy = system.can_paste = False
    assert clipboard.copy("mine") == ""
    assert clipboard.paste() == "mine"


def test_what_somebody_else_copied_since_is_newer(system, clipboard):
    clipboard.copy("mine")
    system.text = "theirs"
    assert clipboard.paste() == "theirs"


def test_what_stood_in_the_system_before_a_copy_that_did_not_reach_it_is_not_newer(system, clipboard):
    system.text, system.can_copy = "old", False
    clipboard.copy("mine")
    assert clipboard.paste() == "mine"


def test_a_system_that_changes_line_ends_does_not_count_as_somebody_else(system, clipboard, monkeypatch):
    monkeypatch.setattr(pyperclip, "copy", lambda text: system.copy(text.replace("\n", "\r\n")))
    clipboard.copy("a\nb\n")
    assert clipboard.paste() == "a\nb\n"


def test_before_the_first_copy_the_system_is_pasted(system, clipboard):
    system.text = "theirs"
    assert clipboard.paste() == "theirs"


def test_an_emptied_system_clipboard_leaves_what_was_copied_here(system, clipboard):
    clipboard.copy("mine")
    system.text = ""
    assert clipboard.paste() == "mine"


def test_a_text_too_long_for_the_terminal_is_not_sent_and_said_so(system, clipboard):
    system.can_copy = False
    assert "too long for the terminal's clipboard" in clipboard.copy("x" * (MOST_OSC_BYTES + 1))
    assert system.to_terminal == []
    assert len(clipboard.paste()) == MOST_OSC_BYTES + 1


def test_the_length_counts_in_bytes(system, clipboard):
    system.can_copy = False
    assert clipboard.copy("日" * (MOST_OSC_BYTES // 3)) == ""
    assert clipboard.copy("日" * (MOST_OSC_BYTES // 3 + 1)) != ""


def test_a_long_text_that_the_system_took_needs_no_word(system, clipboard):
    assert clipboard.copy("x" * (MOST_OSC_BYTES + 1)) == ""


def test_inside_tmux_its_buffer_is_filled_too(system, clipboard, monkeypatch):
    monkeypatch.setenv("TMUX", "socket,1,0")
    clipboard.copy("é")
    assert system.to_tmux == ["é".encode()]


def test_a_tmux_that_does_not_answer_is_no_hindrance(system, clipboard, monkeypatch):
    monkeypatch.setenv("TMUX", "socket,1,0")
    system.tmux_fails = True
    assert clipboard.copy("a") == ""


@pytest.mark.parametrize("text", ["", "\ud800", "\x00", "a\rb"])
def test_any_text_can_be_copied(system, clipboard, text):
    clipboard.copy(text)
    assert clipboard.text == text
