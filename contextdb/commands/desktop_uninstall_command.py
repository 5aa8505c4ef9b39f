"""Remove what `contextdb desktop install` wrote.

contextdb desktop uninstall
"""

from __future__ import annotations

import argparse

from contextdb.commands.desktop_install_command import entry_path, refresh
from contextdb.console import ExitCode, printable
from contextdb.disk import remove


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """There are none."""


def run(_: argparse.Namespace) -> ExitCode:
    """Remove the file, and say so."""
    path = entry_path()
    was_there = path.exists()
    remove(path)
    refresh(path.parent)
    print(printable(f"{path}: removed" if was_there else "nothing is set"))
    return ExitCode.OK
