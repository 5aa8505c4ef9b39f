"""Edit tables in the terminal: cells, a test context, coverage, priorities.

Exits with 2 without a terminal.

  contextdb edit tables/
  contextdb edit tables/hit_mid_air.csv --theme contextdb-light
  contextdb edit tables/ --follow my_game
"""

from __future__ import annotations

import argparse
import os
import sys
from importlib import import_module
from importlib.util import find_spec
from typing import Any

from contextdb.console import ExitCode
from contextdb.errors import ContextDBError, Fault


class TerminalError(ContextDBError):
    """There is no terminal for an editor."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("path", metavar="PATH", nargs="?", help="a table, or a folder of tables (default: tables/, or here)")
    parser.add_argument("--theme", metavar="NAME", help="the colours (default: from the settings)")
    parser.add_argument("--follow", metavar="GAME", default="", help="the running game that the test row follows, once it is there")


def run(arguments: argparse.Namespace) -> ExitCode:
    """Open the editor, and stay in it until it is left."""
    require_terminal()
    return ExitCode(screens("run").edit(arguments.path, arguments.theme, arguments.follow))


def screens(module: str) -> Any:
    """A module of the terminal editor, which is inside this package in a wheel and next to it in a checkout."""
    home = "contextdb._tui" if find_spec("contextdb._tui") else "tui"
    return import_module(f"{home}.{module}")


def require_terminal(instead: str = 'to use "contextdb query" and "contextdb check" in scripts') -> None:
    """Raise TerminalError where there is no terminal to show a screen on."""
    term = os.environ.get("TERM", "" if os.name != "nt" else "windows")
    if not (sys.stdin.isatty() and sys.stdout.isatty()):
        raise TerminalError(Fault("standard input and output are not a terminal.", "a terminal", instead))
    if term in ("", "dumb", "unknown"):
        fault = f"the terminal cannot move its cursor (TERM is {term or 'not set'})."
        raise TerminalError(Fault(fault, "a terminal such as xterm", "to set TERM=xterm-256color where the terminal is one"))
