"""Let git merge and show tables cell by cell: write lines to .gitattributes and git's configuration.

Existing lines stay, and running it again changes nothing. Commit .gitattributes; run this once in every clone.

  contextdb git install
  contextdb git install tables/ --global
"""

from __future__ import annotations

import argparse

from contextdb.commands import git_setup
from contextdb.commands.git_setup import Setup, changed
from contextdb.console import ExitCode
from contextdb.errors import plural


def add_arguments(parser: argparse.ArgumentParser) -> None:
    git_setup.add_arguments(parser)
    help_text = "how git calls contextdb (default: contextdb, or the Python that runs now)"
    parser.add_argument("--command", metavar="TEXT", dest="command_line", help=help_text)


def run(arguments: argparse.Namespace) -> ExitCode:
    """Write what is missing, and say so."""
    return changed(arguments, (_attributes, _configuration), "all is set")


def _attributes(setup: Setup) -> list[str]:
    missing = setup.missing_lines()
    if not missing:
        return []
    raw = setup.raw()
    end = b"\r\n" if b"\r\n" in raw else b"\n"
    gap = end if raw and not raw.endswith(b"\n") else b""
    setup.write(raw + gap + b"".join(line + end for line in missing))
    return [f"{setup.attributes}: {plural(len(missing), 'line')} written; commit it"]


def _configuration(setup: Setup) -> list[str]:
    wrong = {key: value for key, value in setup.settings.items() if setup.value(key) != value}
    for key, value in wrong.items():
        setup.set(key, value)
    return [f"{setup.where}: {', '.join(wrong)} set"] if wrong else []
