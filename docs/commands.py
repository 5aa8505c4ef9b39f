"""Write docs/commands.md: the help of every command, out of the parsers that read their arguments.

python docs/commands.py
"""

from __future__ import annotations

import os
import sys
from collections.abc import Iterator
from pathlib import Path
from unittest import mock

sys.path.insert(0, str(Path(__file__).parent.parent))

from contextdb.cli import COMMANDS, Group

PAGE = Path(__file__).parent / "commands.md"
HEAD = """# Commands

Every command with its help, as `contextdb COMMAND --help` prints it in a terminal of 100 columns.
[Recipes](recipes.md) show the commands at work, [messages](messages.md) say what they may report, and [ci](ci.md#exit-codes) what
their exit codes mean. `make docs` writes this page.
"""


def page() -> str:
    """The page as it should be now."""
    with mock.patch.dict(os.environ, {"COLUMNS": "100", "NO_COLOR": "1"}):
        return "\n".join([HEAD, *_helps(Group((), COMMANDS))])


def _helps(group: Group) -> Iterator[str]:
    for name in group.commands:
        command = group.command(name)
        words = (*group.words, name)
        if hasattr(command, "COMMANDS"):
            inner = Group(words, command.COMMANDS, command.__doc__)
            yield _help(words, inner.overview)
            yield from _helps(inner)
        else:
            yield _help(words, group.parser(name, command).format_help())


def _help(words: tuple[str, ...], text: str) -> str:
    return f"## contextdb {' '.join(words)}\n\n```text\n{text.strip()}\n```\n"


if __name__ == "__main__":
    PAGE.write_text(page(), encoding="utf-8")
