"""Run the editor in this terminal or in a browser: what `contextdb edit` calls. An edge."""

from __future__ import annotations

import gc
import os
import sys
import webbrowser
from collections.abc import Sequence

from contextdb.disk import refuse_writing
from contextdb.disk.boundary import real_path
from contextdb.errors import ContextDBError, Fault, in_quotes, mend_for

from .app import EditorApp
from .editor_settings import EditorSettings, SettingsError, read_settings, settings_path
from .keyboard import read_whole_keys
from .model.conflicted import conflicts_in
from .model.workspace import Workspace

FEW_COLOURS = ("ansi", "linux", "vt100", "vt220", "xterm", "xterm-color", "screen", "tmux", "rxvt", "cygwin")
"""Terminals of 16 colours or fewer, by TERM, unless COLORTERM says that they can do more."""


class BrowserError(ContextDBError):
    """What shows the editor in a browser is not installed."""


def edit(path: str | None, theme: str | None = None, reads_only: bool = False, follow: str = "") -> int:
    """Open a table or a folder of tables, and stay until the editor is left; gives the exit code. A game of the name `follow` is
    followed as soon as it asks the first table. Raises ContextDBError where there is no such table, it cannot be read, or the
    settings cannot be taken; ScreenCrash where the editor ended by an error of its own."""
    if reads_only:
        refuse_writing("the editor was started with --read-only.")
    workspace, settings = _opened(path, theme, reads_only)
    if not is_in_browser():  # there the window says how large it is
        forget_exported_size()
    read_whole_keys()
    pass_over_what_stays()
    return EditorApp(workspace, settings, theme or theme_for(settings), follow=follow).stay()


def edit_in_browser(path: str | None, theme: str | None, options: Sequence[str], host: str, port: int) -> int:
    """Show the editor, started with options, in a browser until it is left; gives the exit code. Errors as of `edit`, and of the
    server."""
    try:
        from .browser.server import serve
    except ImportError:
        mend = 'to install it: pip install "contextdb[browser]"'
        raise BrowserError(Fault("textual-serve is not installed, which shows the editor in a browser.", "", mend)) from None
    workspace, _ = _opened(path, theme, True)
    title = workspace.first or real_path(workspace.folder).name
    workspace.close(keep_journals=True)
    command = [sys.executable, "-m", "contextdb", "edit", *options, *(["--", path] if path else [])]

    def ready(address: str) -> None:
        print(f"The editor is at {address}", flush=True)
        print("Ctrl+C ends it; edits that are not saved are there the next time.", file=sys.stderr, flush=True)
        webbrowser.open(address)

    return serve(command, f"{title} - contextdb", host, port, ready)


def is_in_browser() -> bool:
    """Whether this process was started to be shown in a browser."""
    return os.environ.get("TEXTUAL_DRIVER", "").endswith(":WebDriver")


def _opened(path: str | None, theme: str | None, reads_only: bool) -> tuple[Workspace, EditorSettings]:
    """The tables and the settings, when all can be read."""
    workspace = Workspace(path, reads_only)
    themes = EditorApp.theme_names()
    settings = read_settings(settings_path(), themes)
    if theme is not None and theme not in themes:
        problem = f"there is no theme {in_quotes(theme)}."
        raise SettingsError(Fault(problem, ", ".join(themes), mend_for(theme, themes)))
    _require_readable(workspace)
    return workspace, settings


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
