"""Write docs/keys.md: every command of the editor and of the debugger with its keys, out of the lists that these are made from.

python docs/keys.py
"""

from __future__ import annotations

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent.parent))

from tui.commands import COMMANDS, Command, key_names
from tui.debug.keys import KEYS, names_of

PAGE = Path(__file__).parent / "keys.md"
HEAD = """# Keys

Every command of [the editor](editor.md), with its keys, and its name for a
[file of your own keys](editor.md#keys-and-colours-of-your-own). The first key of each command works in every terminal, the others
[where the terminal sends them](editor.md#terminals). A command without keys is in the palette (Ctrl+P) or in the
toolbar. A dialog shows its keys at the bottom. `python docs/keys.py` writes this page.
"""


def page() -> str:
    """The page as it should be now."""
    groups = dict.fromkeys(command.group for command in COMMANDS)
    return "\n".join([HEAD, *(_section(group) for group in groups), _debugger()])


def _section(group: str) -> str:
    lines = [_line(command) for command in COMMANDS if command.group == group]
    return "\n".join([f"## {group}", "", "| keys | name | does |", "| --- | --- | --- |", *lines, ""])


def _debugger() -> str:
    """The keys of the debugger, which have no names."""
    lines = [f"| {_shown(key.keys)} | {key.about} |" for key in KEYS]
    about = "Those of [the debugger](debugging.md). The arrows up and down move the cursor of the pane that has the focus."
    return "\n".join(["## In the debugger", "", about, "", "| keys | does |", "| --- | --- |", *lines, ""])


def _shown(keys: str) -> str:
    return ", ".join(f"`{name}`" for name in names_of(keys).split("  "))


def _line(command: Command) -> str:
    return f"| {', '.join(key_names(command.keys))} | `{command.id}` | {command.about} |"


if __name__ == "__main__":
    PAGE.write_text(page(), encoding="utf-8")
