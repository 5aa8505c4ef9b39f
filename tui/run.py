"""Run the editor or the debugger in this terminal: what `contextdb edit` and `contextdb motion debug` call. An edge."""

from __future__ import annotations

import gc
import os

from contextdb.errors import ContextDBError, Fault, in_quotes, mend_for

from .app import EditorApp
from .editor_settings import EditorSettings, SettingsError, read_settings, settings_path
from .keyboard import read_whole_keys
from .model.conflicted import conflicts_in
from .model.workspace import Workspace

FEW_COLOURS = ("ansi", "linux", "vt100", "vt220", "xterm", "xterm-color", "screen", "tmux", "rxvt", "cygwin")
"""Terminals of 16 colours or fewer, by TERM, unless COLORTERM says that they can do more."""


def edit(path: str | None, theme: str | None = None, follow: str = "") -> int:
    """Open a table or a folder of tables, and stay until the editor is left; gives the exit code. A game of the name `follow` is
    followed as soon as it asks the first table.

    Raises
    ------
    ContextDBError
        There is no such table, it cannot be read, or the settings cannot be taken.
    ScreenCrash
        The editor ended by an error of its own.
    """
    workspace = Workspace(path)
    themes = EditorApp.theme_names()
    settings = read_settings(settings_path(), themes)
    if theme is not None and theme not in themes:
        problem = f"there is no theme {in_quotes(theme)}."
        raise SettingsError(Fault(problem, ", ".join(themes), mend_for(theme, themes)))
    _require_readable(workspace)
    forget_exported_size()
    read_whole_keys()
    pass_over_what_stays()
    return EditorApp(workspace, settings, theme or theme_for(settings), follow=follow).stay()


def pass_over_what_stays() -> None:
    """Let the collector of garbage pass over the table and the modules, which stay: else it walks through all of them at every
    other key, for a tenth of a second in a large table."""
    gc.freeze()
    gc.set_threshold(20_000, 20, 50)


def forget_exported_size() -> None:
    """Go by the size that the terminal has: one that a shell exports stays as it was at first, and would hide every change."""
    for name in ("COLUMNS", "LINES"):
        os.environ.pop(name, None)


def _require_readable(workspace: Workspace) -> None:
    """Say what cannot be read before the screen is taken; a file with a conflict between marks is resolved there, and so is
    one of another program, that can be imported."""
    if not workspace.first:
        return
    try:
        workspace.session(workspace.first)
    except ContextDBError:
        path = workspace.files[workspace.first]
        if conflicts_in(path) is None and not workspace.begin_from(path):
            raise


def theme_for(settings: EditorSettings) -> str:
    """The theme of the settings; without one, in a terminal of few colours, the terminal's own colours."""
    has_few = os.environ.get("TERM", "") in FEW_COLOURS and not os.environ.get("COLORTERM")
    return settings.theme or ("ansi-dark" if has_few else "")
