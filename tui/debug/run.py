"""Show the debugger of a recorded session, or of a running game, and stay until it is left."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from contextdb.motion import MotionDatabase, Trace
from tui.app import EditorApp
from tui.debug.app import DebugApp
from tui.debug.game import Live
from tui.debug.recording import Recording
from tui.editor_settings import EditorSettings, read_settings, settings_path
from tui.keyboard import read_whole_keys
from tui.messages import GoToCell
from tui.model.workspace import Workspace
from tui.run import forget_exported_size, theme_for


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
        Why its searches cannot be asked again, in a sentence; "" when they can.

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


def debug_live(game: str, path: Path, who: str | None, folder: str, databases: Mapping[str, MotionDatabase]) -> None:
    """Follow a running game, and stay until it is left.

    Parameters
    ----------
    game, path
        Its name and its door.
    who : str or None
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
    live = Live(game, path, who, folder, databases)
    try:
        _debugged(live, settings)
    finally:
        live.close()


def _debugged(shown: Recording | Live, settings: EditorSettings) -> None:
    """Show the debugger; where a row is wanted the editor with it, and then the debugger again."""
    theme, start = theme_for(settings), None
    while True:
        app = DebugApp(shown, theme, start=start)
        app.run()
        wanted = app.wanted
        if wanted is None:
            return
        start = wanted.start
        EditorApp(Workspace(wanted.table), settings, theme, at=GoToCell(wanted.row, wanted.column)).run()
        recording = shown if isinstance(shown, Recording) else shown.recording
        if recording is not None:
            recording.edited()
