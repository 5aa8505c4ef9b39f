"""Findings for people in a terminal: by table, then by rule, each with its `file:line`; about 40 lines, unless `shows_all`."""

from __future__ import annotations

import sys
from collections.abc import Iterator

from contextdb.console import printable, styled, width_of
from contextdb.errors import plural
from contextdb.findings import Finding, Level
from contextdb.report.results import Block, CheckReport, Group, fitted, message_of, n_hidden, place_of

MOST_LINES = 40
MOST_CLEAN = 8
"""Tables without a finding that are listed by name."""

LEAST_ROOM = 40
"""With fewer terminal cells next to its place, a message is under it."""

INDENT = "   "
STYLES: dict[Level, str] = {"error": "red", "warning": "yellow", "info": "cyan"}


def render(report: CheckReport, colour: bool = False, width: int = 100, shows_all: bool = False) -> str:
    """The findings as aligned text; messages are wrapped to `width` terminal cells."""
    groups = report.groups()
    faulty, clean = [g for g in groups if g.findings], [g for g in groups if not g.findings]
    calm = list(_clean_lines(clean, len(clean) if shows_all else MOST_CLEAN, width))

    def sections_at(most: int) -> list[str]:
        return [_section(group, most, width, colour) for group in faulty]

    room = sys.maxsize if shows_all else MOST_LINES - len(calm) - 2
    sections, most = (sections_at(sys.maxsize), sys.maxsize) if shows_all else fitted(sections_at, _n_lines, room)
    n_left_out, hidden = len(faulty) - len(sections), n_hidden(faulty, len(sections), most)
    if n_left_out:
        sections.append(f"… and {plural(n_left_out, 'more file')} with findings\n")
    if calm:
        sections.append("".join(f"{line}\n" for line in calm))
    hint = f" {hidden:,} of them not shown; --all shows every one." if hidden else ""
    return "\n".join([*sections, f"{styled(report.summary, 'bold', colour)}{hint}\n"])


def _n_lines(section: str) -> int:
    return section.count("\n") + 1


def _section(group: Group, most: int, width: int, colour: bool) -> str:
    size = f": {group.table.size}" if group.table else ""
    lines = [styled(line, "bold", colour) for line in wrapped(f"{group.label}{size}", width)]
    blocks = group.blocks()
    places = [width_of(place_of(f)) for _, _, findings in blocks for f in findings[:most]]
    for block in blocks:
        lines += _block(block, most, max(places), width, colour)
    return "".join(f"{line}\n" for line in lines)


def _block(block: Block, most: int, place_width: int, width: int, colour: bool) -> Iterator[str]:
    level, rule, findings = block
    yield f"  {styled(level, STYLES[level], colour)}  {printable(rule)}"
    for finding in findings[:most]:
        yield from _finding_lines(finding, place_width, width)
    if len(findings) > most:
        yield f"    … and {len(findings) - most:,} more"


def _finding_lines(finding: Finding, place_width: int, width: int) -> Iterator[str]:
    place, message = place_of(finding), message_of(finding, names_asset=False)
    indent = 4 + place_width + 2 if place_width else 4
    if width - indent < LEAST_ROOM:
        yield f"    {place}"
        yield from (f"      {line}" for line in wrapped(message, width - 6))
        return
    for i, line in enumerate(wrapped(message, width - indent)):
        head = f"    {place}" if i == 0 else ""
        yield f"{head}{' ' * (indent - width_of(head))}{line}"


def _clean_lines(clean: list[Group], most: int, width: int) -> Iterator[str]:
    for group in clean[:most]:
        size = group.table.size if group.table else ""
        yield from wrapped(f"{group.label}: {size}, nothing found", width)
    if len(clean) > most:
        yield f"… and {len(clean) - most:,} more tables with nothing found"


def wrapped(text: str, width: int) -> list[str]:
    """Text in lines of at most `width` terminal cells, broken at spaces, and inside a word only where it is longer than a line."""
    lines, line, used = [], "", 0
    for word in text.split(" "):
        room = width_of(word)
        if line and used + 1 + room <= width:
            line, used = f"{line} {word}", used + 1 + room
            continue
        lines += [line] if line else []
        *full, line = _cut(word, width) if room > width else [word]
        lines, used = lines + full, width_of(line)
    return [*lines, line]


def hanging(head: str, text: str, width: int) -> Iterator[str]:
    """A text next to a head, wrapped in its own column; where that would be narrow, under it."""
    text, indent = printable(text), width_of(head)
    if width - indent < 30:
        yield head.rstrip()
        yield from (f"{INDENT}{INDENT}{line}" for line in wrapped(text, max(20, width - 2 * len(INDENT))))
        return
    for i, line in enumerate(wrapped(text, width - indent)):
        yield (head if i == 0 else " " * indent) + line


def _cut(word: str, width: int) -> list[str]:
    pieces, used = [""], 0
    for character in word:
        room = width_of(character)
        if used + room > width and pieces[-1]:
            pieces.append("")
            used = 0
        pieces[-1] += character
        used += room
    return pieces
