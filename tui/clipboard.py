"""The clipboard of the machine, as far as a terminal lets us: an edge.

Out: the system's own clipboard where there is one, tmux's buffer inside tmux, and OSC 52 to the terminal, which works over SSH.
In: what was copied here last, unless the system's clipboard holds something newer. A terminal's own paste needs none of this.
"""

from __future__ import annotations

import os
import subprocess
from collections.abc import Callable

MOST_OSC_BYTES = 75_000
"""Terminals drop longer ones without a word."""


class Clipboard:
    """What was copied, here and in the system. Reading and writing never fail: the least there is, is the copy in memory."""

    def __init__(self, to_terminal: Callable[[str], None]) -> None:
        self.text = ""
        self._to_terminal = to_terminal
        self._of_system: str | None = None
        """What the system's clipboard held after the last copy; None where it cannot be read."""

    def copy(self, text: str) -> str:
        """Keep a text, and hand it to the system; gives what a person should know of it, or nothing."""
        self.text = text
        raw = text.encode(errors="replace")  # half of a surrogate pair is not text for other programs
        in_system = _to_system(raw.decode())
        self._of_system = _from_system()
        in_tmux = "TMUX" in os.environ and _to_tmux(raw)
        if len(raw) <= MOST_OSC_BYTES:
            self._to_terminal(raw.decode())
            return ""
        return "" if in_system or in_tmux else "too long for the terminal's clipboard; it can be pasted here."

    def paste(self) -> str:
        """The newest text: of the system, when somebody else put one there since the last copy."""
        there = _from_system()
        return there if there and there != self._of_system else self.text


def _to_system(text: str) -> bool:
    import pyperclip

    try:
        pyperclip.copy(text)
    except (pyperclip.PyperclipException, OSError):
        return False
    return True


def _from_system() -> str | None:
    import pyperclip

    try:
        return str(pyperclip.paste())
    except (pyperclip.PyperclipException, OSError, UnicodeError):
        return None


def _to_tmux(raw: bytes) -> bool:
    try:
        done = subprocess.run(["tmux", "load-buffer", "-w", "-"], input=raw, capture_output=True, timeout=2, check=False)
    except (OSError, subprocess.SubprocessError):
        return False
    return done.returncode == 0
