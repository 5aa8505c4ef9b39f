"""The editor in this terminal, in which keys do nothing: what each would do is written to a file, a line for each.

python recording_editor.py TABLE FILE [HOLD]

With the name of a third file keys do what they do elsewhere while there is no such file.
"""

import sys
from pathlib import Path
from typing import Any
from unittest.mock import patch

from textual.app import App
from textual.widgets import Input

from tui.run import edit
from tui.widgets.grid import Grid


def record(table: str, file: str, hold: str = ".") -> None:
    """Run the editor so."""
    does_it, types_it = App.run_action, Grid._want_edit

    def note(text: str) -> None:
        with Path(file).open("a", encoding="utf-8") as out:
            out.write(f"{text}\n")

    async def run_action(app: App[Any], action: Any, *more: Any, **others: Any) -> bool:
        if not Path(hold).exists() or str(action).startswith(("scroll_", "page_")):  # Textual's own, for what does not fit
            return await does_it(app, action, *more, **others)
        node, name, parameters = app._parse_action(action, more[0] if more else app)
        if isinstance(node, Input) and not node.check_action(name, parameters):  # what it leaves to the list under it
            return False
        note(action)
        return True

    def want_edit(grid: Grid, text: str, *more: Any, **others: Any) -> None:
        if not Path(hold).exists():
            return types_it(grid, text, *more, **others)
        return note(f"typed {text!r}")

    with patch.object(App, "run_action", run_action), patch.object(Grid, "_want_edit", want_edit):
        edit(table)


if __name__ == "__main__":
    record(*sys.argv[1:])
