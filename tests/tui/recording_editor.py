"""The editor in this terminal, in which keys do nothing: what each would do is written to a file, a line for each.

python recording_editor.py TABLE FILE
"""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any
from unittest.mock import patch

from textual.app import App

from tui.run import edit
from tui.widgets.grid import Grid


def record(table: str, file: str) -> None:
    """Run the editor so."""

    def note(text: str) -> None:
        with Path(file).open("a", encoding="utf-8") as out:
            out.write(f"{text}\n")

    async def run_action(app: App[Any], action: str, *_: object, **__: object) -> bool:
        note(action)
        return True

    def want_edit(grid: Grid, text: str, *_: object, **__: object) -> None:
        note(f"typed {text!r}")

    with patch.object(App, "run_action", run_action), patch.object(Grid, "_want_edit", want_edit):
        edit(table)


if __name__ == "__main__":
    record(*sys.argv[1:])
