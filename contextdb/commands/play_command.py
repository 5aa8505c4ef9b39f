"""Play a small game whose characters obey tables, with the editor of its tables beside it.

The game opens a window and leads through its first minute. The editor opens in this terminal, or in tmux in a pane beside it, and
follows the game; a table that is saved there changes the game at once. Needs Panda3D: pip install "contextdb[playground]".

  contextdb play my_game/
  contextdb play --clips clips/
"""

from __future__ import annotations

import argparse
import os
import shlex
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Mapping
from importlib.util import find_spec
from pathlib import Path
from typing import IO

import contextdb
from contextdb.commands.edit_command import require_terminal, screens
from contextdb.console import ExitCode, note
from contextdb.disk import make_folder
from contextdb.disk.boundary import real_path
from contextdb.errors import ContextDBError, Fault, FileError, Place
from contextdb.tables.project import SCHEMA_FILE
from contextdb.telemetry.link.doors import doors

GAME, OPENS_WITHIN_S, LOOK_EVERY_S = "playground", 120.0, 0.2
"""The name of its link; how long its first start may take (it makes its clips), and how often to look whether it is there."""
OWN_FOLDER = "contextdb-playground"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "folder",
        metavar="FOLDER",
        nargs="?",
        help=f"its tables; a folder that does not exist yet gets a copy. Without it: those of a checkout, else {OWN_FOLDER}/ here",
    )
    parser.add_argument("--clips", metavar="FOLDER", help="BVH clips to play with; their table is made")
    parser.add_argument("--crowd", type=int, metavar="N", help="this many others, coloured by the row that they play")
    parser.add_argument("--no-editor", action="store_true", help="open the game alone")


def run(arguments: argparse.Namespace) -> ExitCode:
    """Open the game, and the editor beside it; stay until the one in this terminal is left."""
    _require_window()
    words = [*_game_words(), *([] if arguments.crowd is None else ["--crowd", str(arguments.crowd)])]
    if arguments.clips is not None:
        return ExitCode(subprocess.run([*words, "--clips", arguments.clips], env=_environment()).returncode)
    tables = tables_in(None if arguments.folder is None else Path(arguments.folder))
    words += ["--tables", str(tables)]
    if arguments.no_editor or not _has_terminal():
        note(f"The tables of the game: {_edit_line(tables)}")
        return ExitCode(subprocess.run(words, env=_environment()).returncode)
    if os.environ.get("TMUX") and shutil.which("tmux"):
        subprocess.run(["tmux", "split-window", "-h", shlex.join([*_contextdb(), *_edit_words(tables)])], check=True)
        return ExitCode(subprocess.run(words, env=_environment()).returncode)
    with tempfile.TemporaryFile("w+", encoding="utf-8", errors="replace") as log:
        return _beside(words, tables, log)


def tables_in(folder: Path | None) -> Path:
    """The folder of the game's tables: as it is where it holds a project, else a new copy of the tables that contextdb brings."""
    source = playground() / "tables"
    if folder is None:
        folder = Path(OWN_FOLDER) if source.parent.name == "_playground" else source
    if (folder / SCHEMA_FILE).is_file():
        return folder
    if folder.exists() and (not folder.is_dir() or any(folder.iterdir())):
        accepted = "the folder of an earlier game, or a name that is free"
        raise FileError(Fault(f"this has no {SCHEMA_FILE}.", accepted, place=Place(str(folder))))
    try:
        make_folder(folder.parent)
        shutil.copytree(source, folder, ignore=shutil.ignore_patterns(".*", "*.bvh"), dirs_exist_ok=True)
    except OSError as error:
        raise FileError(Fault(f"cannot be written: {error.strerror or error}.", place=Place(str(folder)))) from None
    note(f"Copied the tables of the game to {folder}")
    return folder


def playground() -> Path:
    """Where the game is: inside an installed package, or in the checkout next to it. Raises FileError where it is in neither."""
    package = Path(contextdb.__file__).parent
    for folder in (package / "_playground", package.parent / "examples" / "playground"):
        if (folder / "game.py").is_file():
            return folder
    raise FileError(Fault("the game is missing.", "examples/playground of the checkout", place=Place(str(package))))


def _beside(words: list[str], tables: Path, log: IO[str]) -> ExitCode:
    """The game in a window, the editor in this terminal; what the game prints is printed after the editor is left."""
    game = subprocess.Popen(words, env=_environment(), stdout=log, stderr=log, stdin=subprocess.DEVNULL)
    note("The game opens; the first time, its clips are made.")
    try:
        if _has_opened(game):
            screens("run").edit(str(tables), follow=GAME)
    finally:
        if game.poll() is None:
            game.terminate()
            game.wait()
    log.seek(0)
    print(log.read(), end="", file=sys.stderr)
    return ExitCode.OK if game.returncode in (0, -15, 1) else ExitCode.BAD_USE


def _has_opened(game: subprocess.Popen[bytes]) -> bool:
    """Wait for the game's link; False where it ended before."""
    for _ in range(round(OPENS_WITHIN_S / LOOK_EVERY_S)):
        if game.poll() is not None:
            return False
        if any(name == GAME for name, _ in doors()):
            return True
        time.sleep(LOOK_EVERY_S)
    return True


def _require_window() -> None:
    """Raise FileError where no game can be drawn."""
    if find_spec("panda3d") is None:
        raise FileError(Fault("Panda3D draws the game and is not installed.", mend="pip install 'contextdb[playground]'"))
    if sys.platform == "linux" and not any(os.environ.get(name) for name in ("DISPLAY", "WAYLAND_DISPLAY")):
        raise FileError(Fault("the game needs a screen, and there is none (DISPLAY is not set).", "a desktop session"))


def _has_terminal() -> bool:
    try:
        require_terminal()
    except ContextDBError:
        return False
    return True


def _game_words() -> list[str]:
    module = "contextdb._playground" if playground().name == "_playground" else "examples.playground"
    return [sys.executable, "-m", module, "--link", GAME]


def _environment() -> Mapping[str, str]:
    """Of the game: a checkout is on the path of its imports."""
    path = [str(playground().parent.parent), *filter(None, [os.environ.get("PYTHONPATH")])]
    return {**os.environ, "PYTHONPATH": os.pathsep.join(path)}


def _contextdb() -> list[str]:
    return [sys.executable, "-m", "contextdb"]


def _edit_words(tables: Path) -> list[str]:
    return ["edit", str(real_path(tables)), "--follow", GAME]


def _edit_line(tables: Path) -> str:
    return shlex.join(["contextdb", "edit", str(tables), "--follow", GAME])
