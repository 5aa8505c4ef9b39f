"""See why in the terminal: a recorded session, moment by moment.

A timeline of what plays, the cost of every frame of every asset, why an asset was not chosen, the poses, and weights that can be
turned: everything is searched again at once. F1 says what the screen shows and which keys there are.

The databases are those of the project that the session was recorded with, or of FOLDER. Exits with 2 without a terminal; "contextdb
motion replay" answers the same questions in scripts.

  contextdb motion debug session.parquet
  contextdb motion debug session.parquet game/
"""

from __future__ import annotations

import argparse

from contextdb.commands.edit_command import require_terminal
from contextdb.commands.motion_replay_command import databases_of, project_of
from contextdb.console import ExitCode
from contextdb.errors import ContextDBError, Fault, MotionError, Place
from contextdb.motion.trace.session import Trace

INSTEAD = 'to use "contextdb motion replay" in scripts'


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """The arguments of the command."""
    parser.add_argument("file", metavar="SESSION", help="a recorded session, a .parquet file")
    parser.add_argument("folder", metavar="FOLDER", nargs="?", help="the project with the databases (default: as recorded)")


def run(arguments: argparse.Namespace) -> ExitCode:
    """Show the session, and stay until it is left."""
    trace = Trace.load(arguments.file)
    if not len(trace):
        raise MotionError(Fault("the session has no decision.", "one with at least an update", place=Place(arguments.file)))
    folder, _ = project_of(trace, arguments.folder, arguments.file)
    try:
        databases, why = databases_of(trace, arguments.folder, arguments.file)
    except ContextDBError as error:
        if arguments.folder is not None:
            raise
        databases, why = {}, error.faults[0].message
    why = why or trace.use(databases)
    require_terminal(INSTEAD)
    from tui.run import debug

    debug(arguments.file, trace, folder, databases, why)
    return ExitCode.OK
