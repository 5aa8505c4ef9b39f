"""Write docs/commands.md: the help of every command, out of the parsers that read their arguments; what all share stands once.

python docs/commands.py
"""

from __future__ import annotations

import os
import re
import sys
from collections.abc import Iterator
from pathlib import Path
from unittest import mock

sys.path.insert(0, str(Path(__file__).parent.parent))

from contextdb.cli import COMMANDS, Group

PAGE = Path(__file__).parent / "commands.md"
HEAD = """# Commands

Every command with its arguments and options, as `contextdb COMMAND --help` prints them. [Recipes](recipes.md) show the commands at
work, [messages](messages.md) explain what they report, and [ci](ci.md#exit-codes) lists their exit codes. `make docs` writes this
page. Each command also accepts:

```text
{common}
```
"""
HELP = re.compile(r"^  -h, --help .*\n?", re.M)
COMMON = re.compile(r"\n\n(limits:\n.*?\n\nproject:\n.*?)(?=\n\n|\Z)", re.S)
USAGE = re.compile(r"\Ausage: .*?(?=\n\n)", re.S)
OPTION = re.compile(r"\[-[^]|]*\] ?")
"""An optional argument of the usage that excludes no other one."""


def page() -> str:
    """The page as it should be now."""
    with mock.patch.dict(os.environ, {"COLUMNS": "100", "NO_COLOR": "1"}):
        helps = list(_helps(Group((), COMMANDS)))
    common = next(part[1] for _, text in reversed(helps) if (part := COMMON.search(text)))
    return "\n".join(
        [HEAD.format(common=common), *(f"## contextdb {name}\n\n```text\n{_short(text)}\n```\n" for name, text in helps)]
    )


def _helps(group: Group) -> Iterator[tuple[str, str]]:
    """The name of each command, and its help."""
    for name in group.commands:
        command = group.command(name)
        words = (*group.words, name)
        if hasattr(command, "COMMANDS"):
            inner = Group(words, command.COMMANDS, command.__doc__)
            yield " ".join(words), inner.overview.strip()
            yield from _helps(inner)
        else:
            yield " ".join(words), group.parser(name, command).format_help().strip()


def _short(text: str) -> str:
    """A help without the options of every command, and with its own listed once."""
    own = COMMON.sub("", HELP.sub("", text))
    own = re.sub(r"\n\noptions:\n?(?=\n\n|\Z)", "", own).strip()
    return USAGE.sub(lambda usage: " ".join(OPTION.sub("", f"{usage[0]} ").split()), own)


if __name__ == "__main__":
    PAGE.write_text(page(), encoding="utf-8")
