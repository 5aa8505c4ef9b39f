"""Run the editor or the debugger in this terminal: what `contextdb edit` and `contextdb motion debug` call. An edge."""

from __future__ import annotations

import gc
import os
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING

from contextdb.errors import ContextDBError, Fault, in_quotes, nearest
from tui.app import EditorApp
from tui.editor_settings import EditorSettings, SettingsError, read_settings, settings_path
from tui.keyboard import read_whole_keys
from tui.messages import GoToCell
from tui.model.conflicted import conflicts_in
from tui.model.workspace import Workspace

if TYPE_CHECKING:
    from contextdb.motion import MotionDatabase, Trace
    from tui.debug.game import Live
    from tui.debug.recording import Recording

FEW_COLOURS = ("ansi", "linux", "vt100", "vt220", "xterm", "xterm-color", "screen", "tmux", "rxvt", "cygwin")
"""Terminals of 16 colours or fewer, by TERM, unless COLORTERM says that they can do more."""


def edit(path: str | None, theme: str | None = None) -> None:
    """Open a table or a folder of tables, and stay until the editor is left.

    Raises
    ------
    ContextDBError
        There is no such table, it cannot be read, or the settings cannot be taken.
    """
    workspace = Workspace(path)
    themes = EditorApp.theme_names()
    settings = read_settings(settings_path(), themes)
    if theme is not None and theme not in themes:
        near = nearest(theme, themes)
        found = f"there is no theme {in_quotes(theme)}."
        raise SettingsError(Fault(found, ", ".join(themes), in_quotes(near) if near else ""))
    _require_readable(workspace)
    _forget_exported_size()
    read_whole_keys()
    pass_over_what_stays()
    EditorApp(workspace, settings, theme or _theme_for(settings)).run()


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
    from tui.debug.recording import Recording

    settings = read_settings(settings_path(), EditorApp.theme_names())
    recording = Recording(file, trace, folder, databases, missing)
    _forget_exported_size()
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
    from tui.debug.game import Live

    settings = read_settings(settings_path(), EditorApp.theme_names())
    _forget_exported_size()
    read_whole_keys()
    live = Live(game, path, who, folder, databases)
    try:
        _debugged(live, settings)
    finally:
        live.close()


def _debugged(shown: Recording | Live, settings: EditorSettings) -> None:
    """Show the debugger; where a row is wanted the editor with it, and then the debugger again."""
    from tui.debug.app import DebugApp
    from tui.debug.recording import Recording

    theme, start = _theme_for(settings), None
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


def pass_over_what_stays() -> None:
    """Let the collector of garbage pass over the table and the modules, which stay: else it walks through all of them at every
    other key, for a tenth of a second in a large table."""
    gc.freeze()
    gc.set_threshold(20_000, 20, 50)


def _forget_exported_size() -> None:
    """Go by the size that the terminal has: one that a shell exports stays as it was at first, and would hide every change."""
    for name in ("COLUMNS", "LINES"):
        os.environ.pop(name, None)


def _require_readable(workspace: Workspace) -> None:
    """Say what cannot be read before the screen is taken; a file with a conflict between marks is asked about there, and so is
    one of another program, that can be imported."""
    if not workspace.first:
        return
    try:
        workspace.session(workspace.first)
    except ContextDBError:
        path = workspace.files[workspace.first]
        if conflicts_in(path) is None and not workspace.begin_from(path):
            raise


def _theme_for(settings: EditorSettings) -> str:
    """The theme of the settings; without one, in a terminal of few colours, the terminal's own colours."""
    has_few = os.environ.get("TERM", "") in FEW_COLOURS and not os.environ.get("COLORTERM")
    return settings.theme or ("ansi-dark" if has_few else "")
