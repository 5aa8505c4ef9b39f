"""See why in the terminal: a recorded session, moment by moment.

What plays, the cost of every frame of every asset, why an asset was not chosen, the poses, and weights that you can change. F1
says what the screen shows and which keys there are. Exits with 2 without a terminal; "contextdb motion replay" answers the same
questions in scripts.

With --live the screen follows a running game whose link watches its controllers. SESSION is then the name of the game, which may
be left out if only one game runs; FOLDER is its project, by default the current folder.

  contextdb motion debug session.parquet
  contextdb motion debug --live game/
"""

from __future__ import annotations

import argparse
import os

from contextdb.commands.edit_command import require_terminal, screens
from contextdb.commands.motion_build_command import MotionProject
from contextdb.commands.motion_replay_command import databases_of, project_of
from contextdb.commands.progress import building_bar
from contextdb.console import ExitCode
from contextdb.errors import ContextDBError, Fault, MotionError, Place
from contextdb.motion import open_or_build
from contextdb.motion.trace.session import Trace
from contextdb.tables.project import SCHEMA_FILE
from contextdb.telemetry.link.hearing import the_game

INSTEAD = 'to use "contextdb motion replay" in scripts'


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("file", metavar="SESSION", nargs="?", help="a recorded session, a .parquet file; with --live a game")
    parser.add_argument("folder", metavar="FOLDER", nargs="?", help="the project with the databases (default: as recorded)")
    parser.add_argument("--live", action="store_true", help="follow a running game")
    parser.add_argument("--who", metavar="NAME", help="with --live: this character (default: the first that decides)")


def run(arguments: argparse.Namespace) -> ExitCode:
    """Show the session, or the game, and stay until it is left."""
    if arguments.live:
        return _live(arguments.file, arguments.folder, arguments.who)
    if arguments.file is None:
        raise MotionError(Fault("no session is named.", "SESSION, a .parquet file; or --live for a running game"))
    if arguments.who is not None:
        raise MotionError(Fault("--who is of a running game.", "--live with it"))
    trace = Trace.load(arguments.file)
    if not len(trace):
        raise MotionError(Fault("the session has no decision.", "one with at least an update", place=Place(arguments.file)))
    folder, _ = project_of(trace, arguments.folder, arguments.file)
    try:
        databases, why = databases_of(trace, arguments.folder, arguments.file)
    except ContextDBError as error:
        if arguments.folder is not None:
            raise
        databases, why = {}, str(error.faults[0])
    why = why or trace.use(databases)
    require_terminal(INSTEAD)
    screens("debug.run").debug(arguments.file, trace, folder, databases, why)
    return ExitCode.OK


def _live(name: str | None, folder: str | None, character_id: str | None) -> ExitCode:
    """Follow a running game; a folder alone is that of the project."""
    if folder is None and name is not None and os.path.isdir(name):
        name, folder = None, name
    game, path = the_game(name)
    if folder is None and os.path.isfile(SCHEMA_FILE):
        folder = os.curdir
    databases = {}
    if folder is not None:
        motion = MotionProject.load(folder)
        with building_bar() as progress:
            databases = open_or_build(motion.config, motion.folder, motion.assets, progress)
    require_terminal('to use "contextdb live" in scripts')
    screens("debug.run").debug_live(game, path, character_id, folder or "", databases)
    return ExitCode.OK
