"""Remove what `contextdb git install` wrote: its lines of .gitattributes and its sections of git's configuration.

contextdb git uninstall tables/
"""

from __future__ import annotations

import argparse

from contextdb.commands.git_setup import LINES, Setup, add_arguments, changed
from contextdb.console import ExitCode
from contextdb.errors import plural

__all__ = ["add_arguments", "run"]


def run(arguments: argparse.Namespace) -> ExitCode:
    """Remove what is there, and say so."""
    return changed(arguments, (_attributes, _configuration), "nothing is set")


def _attributes(setup: Setup) -> list[str]:
    lines = setup.raw().splitlines(keepends=True)
    remaining = [line for line in lines if line.strip() not in LINES]
    if len(remaining) == len(lines):
        return []
    setup.write(b"".join(remaining))
    return [f"{setup.attributes}: {plural(len(lines) - len(remaining), 'line')} removed"]


def _configuration(setup: Setup) -> list[str]:
    present = [key for key in setup.settings if setup.value(key) is not None]
    for key in present:
        setup.unset(key)
    return [f"{setup.where}: {', '.join(present)} removed"] if present else []
