"""Write docs/commands.md: the help of every command, out of the parsers that read their arguments; what all share stands once.

python docs/commands.py
"""

from __future__ import annotations

import argparse
import os
import re
import sys
import textwrap
from collections.abc import Iterator
from pathlib import Path
from unittest import mock

sys.path.insert(0, str(Path(__file__).parent.parent))

from contextdb.cli import COMMANDS, Group

PAGE = Path(__file__).parent / "commands.md"
HEAD = """# Commands

Every command with its options. `contextdb COMMAND --help` says more of each, [recipes](recipes.md) show them at work,
[messages](messages.md) explain what they report, [ci](ci.md#exit-codes) lists exit codes.

Every command accepts:

```text
{common}
```

Several accept these, as the last line of their section says:

```text
{shared}
```
"""
OPTION = re.compile(r"\[-[^]|]*\] ?")
"""An optional argument of the usage that excludes no other one."""
EXAMPLE = re.compile(r"(  |contextdb )\S")
NAME = re.compile(r"--[\w-]+")
WIDTH = 90
"""What the site shows of a line without cutting it."""
MANY = 5
"""Options that as many commands have alike are at the top."""
COMMON = ("limits", "project")
"""The groups of options that every command has."""
GUIDES = {
    "cases": "ci.md#cases",
    "ci": "ci.md#one-command-for-a-build",
    "coverage": "ci.md#coverage",
    "diff": "version-control.md#what-changed-contextdb-diff",
    "live": "live.md#watch-it",
    "merge": "version-control.md#two-people-one-table-contextdb-merge",
    "motion bones": "choosing.md#checking-clips",
    "motion build": "choosing.md#building",
    "motion check": "choosing.md#checking-clips",
    "motion coverage": "preparing.md#motion-coverage",
    "motion debug": "sessions.md#see-why-the-debugger",
    "motion describe": "preparing.md#a-table-from-clips",
    "motion learn": "sessions.md#weights-from-choices",
    "motion measure": "sessions.md#measuring-motion",
    "motion prepare": "preparing.md#markup-from-clips",
    "motion probe": "sessions.md#a-probe",
    "motion replay": "sessions.md",
    "motion run": "sessions.md",
    "play": "playground.md",
}
"""Where a page says of a command, and shows, what its help says after the first paragraph."""


def page() -> str:
    """The page as it should be now."""
    with mock.patch.dict(os.environ, {"COLUMNS": str(WIDTH), "NO_COLOR": "1"}):
        helps = list(_helps(Group((), COMMANDS)))
    owners: dict[str, list[str]] = {}
    for name, _, lines, _ in helps:
        for line in lines:
            owners.setdefault(line, []).append(name)
    shared = [line for line, names in owners.items() if line.startswith("-") and len(names) >= MANY]
    common = next(lines for *_, lines in helps if lines)
    head = HEAD.format(common="\n".join(common), shared="\n".join(shared))
    return "\n".join([head, *(_section(name, text, lines, owners) for name, text, lines, _ in helps)])


def _section(name: str, text: str, lines: list[str], owners: dict[str, list[str]]) -> str:
    """The section of a command, without the options that the top of the page or an earlier command has alike."""
    elsewhere: dict[str, list[str]] = {}
    own = []
    for line in lines:
        first, *others = owners[line]
        if line.startswith("-") and (len(others) >= MANY - 1 or first != name):
            place = "above" if len(others) >= MANY - 1 else f"in [{first}](#contextdb-{first.replace(' ', '-')})"
            elsewhere.setdefault(place, []).extend(f"`{option}`" for option in NAME.findall(line)[:1])
        else:
            own.append(line)
    body = "\n\n".join(part for part in (text, "\n".join(own)) if part)
    also = "; ".join(f"as {place} {', '.join(options)}" for place, options in sorted(elsewhere.items()))
    more = [*([f"Also {also}."] if also else []), *([f"[More]({GUIDES[name]})."] if name in GUIDES else [])]
    return f"## contextdb {name}\n\n```text\n{body}\n```\n" + (f"\n{' '.join(more)}\n" if more else "")


def _helps(group: Group) -> Iterator[tuple[str, str, list[str], list[str]]]:
    """The name of each command; its usage, words and examples; its own arguments and options, and those of every command."""
    for name in group.commands:
        command = group.command(name)
        words = (*group.words, name)
        if hasattr(command, "COMMANDS"):
            inner = Group(words, command.COMMANDS, command.__doc__)
            about = inner.overview.partition("\ncommands:\n")[0].partition("\noptions:\n")[0].strip()
            yield " ".join(words), _shortened(about, 0), [], []
            yield from _helps(inner)
        else:
            parser = group.parser(name, command)
            lines: list[list[str]] = [[], []]
            for part in parser._action_groups:
                for action in part._group_actions:
                    if action.dest != "help":
                        lines[part.title in COMMON].append(_line(parser, action))
            text = parser.format_help().partition("\n\npositional arguments:")[0].partition("\n\noptions:")[0]
            has_guide = " ".join(words) in GUIDES
            yield " ".join(words), _shortened(text.strip(), int(not has_guide), has_guide), *lines


def _line(parser: argparse.ArgumentParser, action: argparse.Action) -> str:
    """An argument or an option with its help."""
    form = parser._get_formatter()
    line = f"{form._format_action_invocation(action):20}  {' '.join(form._expand_help(action).split())}"
    return textwrap.fill(line, WIDTH, subsequent_indent=22 * " ", break_on_hyphens=False)


def _shortened(text: str, n_examples: int, has_guide: bool = False) -> str:
    """A help with its first examples, whose usage names only what must be given; of one with a guide the first paragraph."""
    usage, about, *rest = text.split("\n\n")
    paragraphs = [f"{' '.join(OPTION.sub('', f'{usage} ').split()).removeprefix('usage: ')}", about]
    for paragraph in rest:
        lines = paragraph.splitlines()
        if EXAMPLE.match(lines[0]):
            paragraphs += ["\n".join(lines[:n_examples])] * (n_examples > 0)
            n_examples = 0
        elif not has_guide:
            paragraphs.append(paragraph)
    return "\n\n".join(paragraphs)


if __name__ == "__main__":
    PAGE.write_text(page(), encoding="utf-8")
