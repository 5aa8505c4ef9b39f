"""Run the editor or the debugger in this terminal: what `contextdb edit` and `contextdb motion debug` call. An edge."""

from __future__ import annotations

import gc
import os

from contextdb.errors import ContextDBError, Fault, in_quotes, mend_for
from tui.app import EditorApp
from tui.editor_settings import EditorSettings, SettingsError, read_settings, settings_path
from tui.keyboard import read_whole_keys
from tui.model.conflicted import conflicts_in
from tui.model.workspace import Workspace

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
        found = f"there is no theme {in_quotes(theme)}."
        raise SettingsError(Fault(found, ", ".join(themes), mend_for(theme, themes)))
    _require_readable(workspace)
    forget_exported_size()
    read_whole_keys()
    pass_over_what_stays()
    EditorApp(workspace, settings, theme or theme_for(settings)).run()


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


def theme_for(settings: EditorSettings) -> str:
    """The theme of the settings; without one, in a terminal of few colours, the terminal's own colours."""
    has_few = os.environ.get("TERM", "") in FEW_COLOURS and not os.environ.get("COLORTERM")
    return settings.theme or ("ansi-dark" if has_few else "")
