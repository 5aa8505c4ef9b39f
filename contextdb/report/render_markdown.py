"""Findings as Markdown for a pull request or a job summary: a table for each table of assets, small enough to be posted.

Text from tables cannot become markup: what means something to GitHub's Markdown is escaped, so that it shows as it is. What forges
find in plain text, mentions, numbers of issues and addresses, is cut in two by an empty comment, which nobody sees.
"""

from __future__ import annotations

import re
import sys
from collections.abc import Iterator

from contextdb.console import printable
from contextdb.errors import plural, row_name
from contextdb.findings import Finding
from contextdb.report.results import CheckReport, Group, as_path, fitted, n_hidden

MOST_BYTES = 60_000
"""GitHub takes a comment of 65,536 characters and a job summary of 1 MiB."""

MOST_CLEAN = 20
"""Tables without a finding that are listed by name."""

_HEAD = "| level | rule | place | asset | column | finding |\n| --- | --- | --- | --- | --- | --- |\n"
_MARKUP = re.compile(r"[\\`*{}\[\]<>#|~&$]|(?<![^\W_])_|_(?![^\W_])")
_LIVE = re.compile(r'[@#!%~&$](?=[\w"])|(?i:https?:|ftp:|mailto:|xmpp:|www\.|gh-)(?=\S)')
"""Where a mention, a label, a milestone or an address begins."""
_HASH = re.compile(r"\b(?=[0-9]*[a-f])[0-9a-f]{7,}\b")
_HASH_PART = re.compile(r".{6}(?=.)")
DEAD = "<!-- -->"


def render(report: CheckReport, shows_all: bool = False) -> str:
    groups = report.groups()
    faulty, clean = [g for g in groups if g.findings], [g for g in groups if not g.findings]

    def sections_at(most: int) -> list[str]:
        return [_section(group, most) for group in faulty]

    sections, most = (sections_at(sys.maxsize), sys.maxsize) if shows_all else fitted(sections_at, _n_bytes, MOST_BYTES)
    hidden = n_hidden(faulty, len(sections), most)
    parts = ["## contextdb check\n", f"{escaped(report.summary)}\n", *sections]
    if hidden:
        parts.append(f"{plural(hidden, 'finding')} not shown; `contextdb check --all` shows every one.\n")
    if clean:
        parts.append(_clean(clean, len(clean) if shows_all else MOST_CLEAN))
    return "\n".join(parts)


def escaped(text: str) -> str:
    """Text that Markdown shows as it is, on one line, and that names and links nobody."""
    cut = _LIVE.sub(lambda match: f"{match[0]}\0", printable(text))
    cut = _HASH.sub(lambda match: _HASH_PART.sub(r"\g<0>\0", match[0]), cut)
    return _MARKUP.sub(lambda match: f"\\{match[0]}", cut).replace("\0", DEAD)


def _n_bytes(section: str) -> int:
    return len(section.encode()) + 1


def _section(group: Group, most: int) -> str:
    size = group.table.size if group.table else "not read"
    file = f", in {escaped(as_path(group.file))}" if group.file else ""
    return f"### {escaped(group.label)}\n\n{size}{file}\n\n{_HEAD}{''.join(_rows(group, most))}"


def _rows(group: Group, most: int) -> Iterator[str]:
    for level, rule, findings in group.blocks():
        yield from (_row(f) for f in findings[:most])
        if len(findings) > most:
            yield f"| {level} | {escaped(rule)} | | | | … and {len(findings) - most:,} more |\n"


def _row(finding: Finding) -> str:
    place = f"line {finding.line}" if finding.line is not None else "" if finding.row is None else row_name(finding.row)
    texts = (finding.level, finding.rule, place, finding.asset or "", finding.column or "", finding.message)
    return f"| {' | '.join(map(escaped, texts))} |\n"


def _clean(clean: list[Group], most: int) -> str:
    listed = [f"{escaped(g.label)} ({g.table.size})" for g in clean[:most] if g.table]
    rest = [f"{len(clean) - most:,} more tables"] if len(clean) > most else []
    return f"Nothing found in {', '.join([*listed, *rest])}.\n"
