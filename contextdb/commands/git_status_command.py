"""Show how git is set up for tables. Exits with 1 if something is missing.

contextdb git status tables/
"""

from __future__ import annotations

import argparse

from contextdb.commands.git_setup import LINES, add_arguments, setup_of
from contextdb.console import ExitCode, aligned, output, printable

__all__ = ["add_arguments", "run"]


def run(arguments: argparse.Namespace) -> ExitCode:
    """List every line and key with what it says."""
    setup = setup_of(arguments)
    missing = setup.missing_lines()
    lines = [("missing" if line in missing else "set", line.decode()) for line in LINES]
    values = {key: setup.value(key) for key in setup.settings}
    keys = [("missing" if value is None else "set", key if value is None else f"{key} = {value}") for key, value in values.items()]
    with output():
        print(printable(str(setup.attributes)), *aligned(lines, indent="  "), sep="\n")
        print(setup.where, *aligned(keys, indent="  "), sep="\n")
    return ExitCode.FOUND if missing or None in values.values() else ExitCode.OK
