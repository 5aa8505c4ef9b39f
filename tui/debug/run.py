"""Show the debugger of a recorded session, or of a running game, and stay until it is left."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from contextdb.motion import MotionDatabase, Trace

from ..app import EditorApp
from ..editor_settings import EditorSettings, read_settings, settings_path
from ..keyboard import read_whole_keys
from ..messages import GoToCell
from ..model.workspace import Workspace
from ..run import forget_exported_size, theme_for
from .app import DebugApp
from .game import Live
from .recording import Recording


def debug(file: str, trace: Trace, folder: str, databases: Mapping[str, MotionDatabase], missing: str) -> None:
    """Show a recorded session, and stay until it is left.

    Parameters
    ----------
    file : str
        Its name.
    trace : Trace
        With a decision at least.
    folder : str
        Of its project; "" where there is none.
    databases : mapping of name to MotionDatabase
    missing : str
        Why its searches cannot be repeated, in a sentence; "" when they can.

    Raises
    ------
    ContextDBError
        The settings cannot be taken.
    """
    settings = read_settings(settings_path(), EditorApp.theme_names())
    recording = Recording(file, trace, folder, databases, missing)
    forget_exported_size()
    read_whole_keys()
    _debugged(recording, settings)


def debug_live(game: str, path: Path, character_id: str | None, folder: str, databases: Mapping[str, MotionDatabase]) -> None:
    """Follow a running game, and stay until it is left.

    Parameters
    ----------
    game, path
        Its name and its door.
    character_id : str or None
        The character; None for the first that decides.
    folder, databases
        As for `debug`.

    Raises
    ------
    ContextDBError
        The settings cannot be taken.
    """
    settings = read_settings(settings_path(), EditorApp.theme_names())
    forget_exported_size()
    read_whole_keys()
    live = Live(game, path, character_id, folder, databases)
    try:
        _debugged(live, settings)
    finally:
        live.close()


def _debugged(recorded: Recording | Live, settings: EditorSettings) -> None:
    """Show the debugger; where a row is wanted the editor with it, and then the debugger again."""
    theme, start = theme_for(settings), None
    while True:
        app = DebugApp(recorded, theme, start=start)
        app.stay()
        wanted = app.wanted
        if wanted is None:
            return
        start = wanted.start
        EditorApp(Workspace(wanted.table), settings, theme, at=GoToCell(wanted.row, wanted.column)).stay()
        recording = recorded if isinstance(recorded, Recording) else recorded.recording
        if recording is not None:
            recording.edited()
