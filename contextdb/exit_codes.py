"""What a command says to the shell."""

from __future__ import annotations

from enum import IntEnum


class ExitCode(IntEnum):
    """The exit codes of every command."""

    OK = 0
    FOUND = 1
    """No asset is valid; findings at the level that fails."""
    BAD_USE = 2
    """A wrong argument, no such file, a table that cannot be read."""
    INTERRUPTED = 130
