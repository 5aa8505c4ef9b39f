"""Edit tables in the terminal, or in a browser of this machine: cells, a test context, coverage, priorities.

Exits with 2 without a terminal. --browser needs none: it prints an address, opens it, and stays until the editor is left. Whoever
has the address can edit; a second window follows the first and cannot. Needs: pip install "contextdb[browser]".

  contextdb edit tables/
  contextdb edit tables/hit_mid_air.csv --theme contextdb-light
  contextdb edit tables/ --browser
  contextdb edit tables/ --browser --read-only
  contextdb edit tables/ --follow my_game
"""

from __future__ import annotations

import argparse
import os
import sys
from importlib import import_module
from importlib.util import find_spec
from typing import Any

from contextdb.commands.numbers import whole_type
from contextdb.console import ExitCode
from contextdb.errors import ContextDBError, Fault

LOOPBACK = "127.0.0.1"
PORT = whole_type("a port. Accepted: 0 to 65535; 0 is a free one.", 0, 65535)


class TerminalError(ContextDBError):
    """There is no terminal for an editor."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("path", metavar="PATH", nargs="?", help="a table, or a folder of tables (default: tables/, or here)")
    parser.add_argument("--theme", metavar="NAME", help="the colours (default: from the settings)")
    parser.add_argument("--read-only", action="store_true", help="look only: nothing is edited or written")
    parser.add_argument("--browser", action="store_true", help="show the editor in a browser of this machine")
    parser.add_argument("--port", metavar="N", type=PORT, default=0, help="with --browser: the port; 0 is a free one (default: 0)")
    parser.add_argument(
        "--host",
        metavar="ADDRESS",
        default=LOOPBACK,
        help="with --browser: an address of this machine to listen at (default: 127.0.0.1)",
    )
    parser.add_argument("--follow", metavar="GAME", default="", help="the running game that the test row follows, once it is there")


def run(arguments: argparse.Namespace) -> ExitCode:
    """Open the editor, and stay in it until it is left."""
    run_in = screens("run")
    if arguments.browser:
        given = {"--theme": arguments.theme, "--follow": arguments.follow}
        words = [word for name, text in given.items() if text for word in (name, text)]
        words += ["--read-only"] if arguments.read_only else []
        return ExitCode(run_in.edit_in_browser(arguments.path, arguments.theme, words, arguments.host, arguments.port))
    if (arguments.host, arguments.port) != (LOOPBACK, 0):
        raise TerminalError(Fault("--port and --host are of the editor in a browser.", "--browser with them"))
    if not run_in.is_in_browser():
        require_terminal()
    return ExitCode(run_in.edit(arguments.path, arguments.theme, arguments.read_only, arguments.follow))


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
