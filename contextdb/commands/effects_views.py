"""What a change of a table does, for people: below the differences in a terminal, and in Markdown for a pull request."""

from __future__ import annotations

import sys
from collections.abc import Iterator, Sequence

from contextdb.checks.effects import Box, Effects, Reach
from contextdb.console import printable, styled
from contextdb.errors import Fault, plural, shown
from contextdb.findings import Finding
from contextdb.report.render_markdown import escaped

TITLE = "what it does"
MOST = 10
"""Assets and gaps that are shown, unless all are asked for."""
MOST_BOXES = 2
"""Boxes of one asset that are shown, the largest."""

Told = tuple[str, list[str]]
"""A heading and the lines below it."""


def effects_json(effect: Effects | Fault | None) -> dict[str, object] | None:
    """Effects as plain data; None where they were not asked for or nothing could change."""
    if effect is None:
        return None
    return {"unknown": str(effect)} if isinstance(effect, Fault) else effect.to_json()


def effects_text(effect: Effects | Fault | None, colour: bool, shows_all: bool = False) -> str:
    """Effects as lines under a heading; nothing where there is nothing to tell."""
    if effect is None:
        return ""
    lines = ["", TITLE]
    for heading, told in _told(effect, shows_all):
        lines.append(styled(f"  {printable(heading)}", "bold" if told else "dim", colour))
        lines += [f"    {printable(line)}" for line in told]
    return "".join(f"{line}\n" for line in lines)


def effects_markdown(effect: Effects | Fault | None, shows_all: bool = False) -> str:
    """Effects as nested lists of Markdown."""
    if effect is None:
        return ""
    lines = ["", f"#### {TITLE.capitalize()}", ""]
    for heading, told in _told(effect, shows_all):
        lines.append(f"- {escaped(heading)}")
        lines += [f"  - {escaped(line)}" for line in told]
    return "".join(f"{line}\n" for line in lines)


def _told(effect: Effects | Fault, shows_all: bool) -> Iterator[Told]:
    if isinstance(effect, Fault):
        yield f"That cannot be determined: {effect}", []
        return
    most = sys.maxsize if shows_all else MOST
    if effect.before is not None and effect.after is not None:
        yield _covered(effect), []
    for reach in effect.assets[:most]:
        yield from _reach(reach, shows_all)
    left = max(0, len(effect.assets) - most)
    if left:
        yield f"… and {plural(left, 'asset')} more; --all shows every one", []
    if effect.n_left_out:
        yield f"{plural(effect.n_left_out, 'more changed asset')} not looked at", []
    yield from _boxes("gaps opened", effect.opened, most)
    yield from _boxes("gaps closed", effect.closed, most)
    yield from _findings("rows that can no longer be chosen", effect.dead, most)
    yield from _findings("rows that may not be valid together", effect.overlaps, most)
    if not effect:
        yield "no context gains or loses an asset", []
    elif not effect.is_complete:
        yield "gaps may be missing here: the change is large", []


def _covered(effect: Effects) -> str:
    from contextdb.checks.effects import covered_text

    assert effect.before is not None
    assert effect.after is not None
    before, after = covered_text(effect.before), covered_text(effect.after)
    return f"covered: {after}, as before" if before == after else f"covered: {before} → {after}"


def _reach(reach: Reach, shows_all: bool) -> Iterator[Told]:
    for verb, boxes, share in (("gains", reach.gained, reach.share_gained), ("loses", reach.lost, reach.share_lost)):
        if boxes:
            most = len(boxes) if shows_all else MOST_BOXES
            more = [f"… and {len(boxes) - most:,} more"] if len(boxes) > most else []
            yield f"{shown(reach.asset)} {verb} {_percent(share)}", [*(_line(box) for box in boxes[:most]), *more]


def _boxes(title: str, boxes: Sequence[Box], most: int) -> Iterator[Told]:
    if boxes:
        more = [f"… and {len(boxes) - most:,} more; --all shows every one"] if len(boxes) > most else []
        yield title, [*(_line(box) for box in boxes[:most]), *more]


def _findings(title: str, findings: Sequence[Finding], most: int) -> Iterator[Told]:
    if findings:
        more = [f"… and {len(findings) - most:,} more; --all shows every one"] if len(findings) > most else []
        yield title, [*(_finding(finding) for finding in findings[:most]), *more]


def _finding(finding: Finding) -> str:
    line = "" if finding.line is None else f", line {finding.line}"
    return f"{shown(finding.asset or '(no name)')}{line}: {shown(finding.message, 300)}"


def _line(box: Box) -> str:
    return f"{_percent(box.share)}  {shown(box.text, 400)}"


def _percent(share: float) -> str:
    from contextdb.covering import format_percent

    return "single points" if share <= 0.0 else format_percent(share)
