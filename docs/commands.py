"""Write docs/commands.md: the help of every command, out of the parsers that read their arguments; what all share stands once.

python docs/commands.py
"""

from __future__ import annotations

import os
import re
import sys
from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from unittest import mock

sys.path.insert(0, str(Path(__file__).parent.parent))

from contextdb.cli import COMMANDS, Group

PAGE = Path(__file__).parent / "commands.md"
HEAD = """# Commands

Every command with its arguments and options, as `contextdb COMMAND --help` prints them; options that several commands have
alike are written once. [Recipes](recipes.md) show the commands at work, [messages](messages.md) explain what they report, and
[ci](ci.md#exit-codes) lists their exit codes. `make docs` writes this page. Each command also accepts:

```text
{common}
```

Many commands have some of these, as the last line of their section says:

```text
options:
{shared}
```
"""
HELP = re.compile(r"^  -h, --help .*\n?", re.M)
COMMON = re.compile(r"\n\n(limits:\n.*?\n\nproject:\n.*?)(?=\n\n|\Z)", re.S)
USAGE = re.compile(r"\Ausage: .*?(?=\n\n)", re.S)
OPTION = re.compile(r"\[-[^]|]*\] ?")
"""An optional argument of the usage that excludes no other one."""
ENTRY = re.compile(r"^  (-\S.*(?:\n   .*)*)\n?", re.M)
"""An option with its help."""
NAME = re.compile(r"--[\w-]+")
EMPTY = re.compile(r"\n\n[a-z ]+:\n?(?=\n\n|\Z)")
"""The heading of options that are all written elsewhere."""
MANY = 5
"""Options that as many commands have alike are at the top; where a command has as many of another one, they are only named."""


def page() -> str:
    """The page as it should be now."""
    with mock.patch.dict(os.environ, {"COLUMNS": "100", "NO_COLOR": "1"}):
        helps = list(_helps(Group((), COMMANDS)))
    common = next(part[1] for _, text in reversed(helps) if (part := COMMON.search(text)))
    short = {name: _short(text) for name, text in helps}
    owners: dict[str, list[str]] = {}
    for name, text in short.items():
        for entry in ENTRY.findall(text):
            owners.setdefault(_line(entry), []).append(name)
    shared = [line for line, names in owners.items() if len(names) >= MANY]
    head = HEAD.format(common=common, shared="\n".join(f"  {line}" for line in shared))
    return "\n".join([head, *(_section(name, text, owners) for name, text in short.items())])


def _line(entry: str) -> str:
    """An option with its help on one line: the same of every command, however wide its columns are."""
    option, text = re.split(r"\n +|  +", entry.strip(), maxsplit=1)
    return f"{option:30}  {' '.join(text.split())}"


def _section(name: str, text: str, owners: dict[str, list[str]]) -> str:
    """The section of a command, without the options that the top of the page or an earlier command has alike."""
    firsts = Counter(owners[_line(entry)][0] for entry in ENTRY.findall(text))
    elsewhere: dict[str, list[str]] = {}

    def written(match: re.Match[str]) -> str:
        first, *others = owners[_line(match[1])]
        if len(others) < MANY - 1 and (first == name or firsts[first] < MANY):
            return match[0]
        place = "above" if len(others) >= MANY - 1 else f"in [{first}](#contextdb-{first.replace(' ', '-')})"
        elsewhere.setdefault(place, []).extend(f"`{option}`" for option in NAME.findall(match[1])[:1])
        return ""

    own = EMPTY.sub("", ENTRY.sub(written, text).strip())
    also = "; ".join(f"as {place} {', '.join(options)}" for place, options in sorted(elsewhere.items()))
    return f"## contextdb {name}\n\n```text\n{own}\n```\n" + (f"\nAlso {also}.\n" if also else "")


def _helps(group: Group) -> Iterator[tuple[str, str]]:
    """The name of each command, and its help."""
    for name in group.commands:
        command = group.command(name)
        words = (*group.words, name)
        if hasattr(command, "COMMANDS"):
            inner = Group(words, command.COMMANDS, command.__doc__)
            yield " ".join(words), inner.overview.partition("\ncommands:\n")[0].strip()
            yield from _helps(inner)
        else:
            yield " ".join(words), group.parser(name, command).format_help().strip()


def _short(text: str) -> str:
    """A help without the options of every command, and with its own listed once."""
    own = EMPTY.sub("", COMMON.sub("", HELP.sub("", text))).strip()
    return USAGE.sub(lambda usage: " ".join(OPTION.sub("", f"{usage[0]} ").split()), own)


if __name__ == "__main__":
    PAGE.write_text(page(), encoding="utf-8")
