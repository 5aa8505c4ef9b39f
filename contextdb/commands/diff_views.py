"""Differences of two tables for people: as text for a terminal, as Markdown for a pull request.

Text from tables cannot move a cursor or become markup.
"""

from __future__ import annotations

import sys
from bisect import bisect_right
from collections.abc import Iterator, Sequence
from itertools import accumulate, groupby

from contextdb.checks.effects import Box, Effects, Reach
from contextdb.console import aligned, printable, styled
from contextdb.edits.diffing import CellChange, Diff
from contextdb.errors import Fault, plural, row_name, safe_text
from contextdb.findings import Finding
from contextdb.report.render_markdown import MOST_BYTES, escaped
from contextdb.tables.table import EitherTable

MARKS = {"added": ("+", "green"), "removed": ("-", "red"), "renamed": ("~", "yellow"), "moved": (">", "cyan")}
MOST = 40
"""Differences of one kind that are listed without --all."""
MOST_CHARACTERS = 40
"""Of a cell's text in a terminal."""

Part = tuple[str, str]
"""What became of a row or a column, and which."""


def as_text(changes: Diff, colour: bool, shows_all: bool = False, first: Sequence[str] = ()) -> str:
    """Differences as aligned lines; `first` is what to look at first."""
    name = printable(str(changes.after.path or changes.after.name))
    lines = [styled(f"{name}: {changes.summary}", "bold", colour), *map(printable, [*first, *owners(changes)])]
    for title, parts in (("columns", columns_changed(changes)), ("rows", rows_changed(changes))):
        if parts:
            displayed = [styled(f"  {MARKS[verb][0]} {printable(text)}", MARKS[verb][1], colour) for verb, text in parts]
            lines += ["", title, *_first(displayed, sys.maxsize if shows_all else MOST)]
    lines += _cell_lines(changes, colour, shows_all)
    return "".join(f"{line}\n" for line in lines)


def as_markdown(changes: Diff, shows_all: bool = False, more: str = "", first: Sequence[str] = ()) -> str:
    """Differences as Markdown with more below it, together small enough for a comment; `first` is what to look at first."""
    name = str(changes.after.path or changes.after.name)
    lines = [
        f"### {escaped(name)}",
        "",
        f"{escaped(changes.summary)}",
        *(f"\n{escaped(text)}" for text in [*first, *owners(changes)]),
    ]
    parts = [f"- column {verb}: {escaped(text)}" for verb, text in columns_changed(changes)]
    parts += [f"- row {verb}: {escaped(text)}" for verb, text in rows_changed(changes)]
    rows = [f"| {' | '.join(escaped(safe_text(t, 200)) for t in _markdown_texts(c))} |" for c in changes.cells]
    room = sys.maxsize if shows_all else MOST_BYTES - len(more.encode())
    for head, listed in (([], parts), (["| asset | column | before | after |", "| --- | --- | --- | --- |"], rows)):
        ends = list(accumulate(map(_size, listed)))
        fitting = listed[: bisect_right(ends, room)]
        room -= sum(map(_size, fitting))
        left = len(listed) - len(fitting)
        lines += ["", *head, *fitting] if fitting else []
        lines += ["", f"… and {left:,} more; `contextdb diff --all` shows every one."] if left else []
    return "\n".join(lines) + "\n" + more


def look_first(effect: Effects | Fault | None) -> list[str]:
    """What a reviewer looks at first, in a sentence; nothing where the effect is not known."""
    if not isinstance(effect, Effects):
        return []
    if effect.opened:
        gaps = plural(len(effect.opened), "gap")
        return [f"Look first at {gaps} that it opens, the largest {gap_line(effect.opened[0])}."]
    if effect.dead:
        return [f"Look first at {plural(len(effect.dead), 'row')} that can no longer be chosen."]
    if not effect:
        return ["Nothing to look at: every context keeps its assets."]
    return ["No context loses its last asset." if effect.is_complete else "No gap is known that it opens."]


def owners(changes: Diff) -> list[str]:
    """Who answers for the table, and for the conditions whose cells change, in a sentence; nothing where nobody is named."""
    columns = {changes.after.columns[at].name for at in changes.changed} | {*changes.columns_added, *changes.columns_removed}
    known = {c.condition.name: c.condition.owner for table in (changes.before, changes.after) for c in table.conditions}
    parts = [f"the table by {safe_text(changes.after.settings.owner)}"] if changes.after.settings.owner else []
    parts += [f"{safe_text(name)} by {safe_text(owner)}" for name, owner in known.items() if owner and name in columns]
    return [f"Owned: {', '.join(parts)}."] if parts else []


def _size(line: str) -> int:
    return len(line.encode()) + 1


def _markdown_texts(change: CellChange) -> tuple[str, str, str, str]:
    after = change.after if change.is_meaning else f"{change.after} (means the same)"
    return change.asset, change.column, change.before, after


def columns_changed(changes: Diff) -> list[Part]:
    """What became of the columns that are not where they were."""
    parts = [("added", safe_text(name)) for name in changes.columns_added]
    parts += [("removed", safe_text(name)) for name in changes.columns_removed]
    parts += [("renamed", f"{safe_text(one.before)} → {safe_text(one.after)}") for one in changes.columns_renamed]
    return parts + [
        ("moved", f"{safe_text(c.name)}, from column {c.place_before + 1} to {c.place_after + 1}") for c in changes.columns_moved
    ]


def rows_changed(changes: Diff) -> list[Part]:
    """What became of the rows that are not where they were."""
    before, after = changes.before, changes.after
    parts = [("added", f"{_asset(after.assets[row])}, {_place(after, row)}") for row in changes.rows_added]
    parts += [("removed", f"{_asset(before.assets[row])}, {_place(before, row)} before") for row in changes.rows_removed]
    parts += [("renamed", f"{_asset(one.before)} → {_asset(one.after)}") for one in changes.rows_renamed]
    places = ((one.name, _place(before, one.place_before), _place(after, one.place_after)) for one in changes.rows_moved)
    return parts + [("moved", f"{_asset(name)}, from {old} to {new}") for name, old, new in places]


def _place(table: EitherTable, row: int) -> str:
    line = table.place(row).line
    return row_name(row) if line is None else f"line {line}"


def _cell_lines(difference: Diff, colour: bool, shows_all: bool) -> Iterator[str]:
    changes = list(difference.cells)
    for title, part in (
        ("cells", [c for c in changes if c.is_meaning]),
        ("written differently", [c for c in changes if not c.is_meaning]),
    ):
        if not part:
            continue
        yield from ("", title)
        listed = part if shows_all else part[:MOST]
        yield from _assets(listed, colour)
        if len(part) > len(listed):
            yield f"  … and {len(part) - len(listed):,} more; --all shows every one"


def _assets(changes: Sequence[CellChange], colour: bool) -> Iterator[str]:
    """Changes under their assets, aligned across all of them."""
    rows = [(safe_text(c.column), _text(c.before), "→", _text(c.after)) for c in changes]
    lines = iter(aligned(rows, indent="    "))
    for _, group in groupby(changes, key=lambda c: c.row):
        same = list(group)
        yield styled(f"  {printable(_asset(same[0].asset))}", "bold", colour)
        for _ in same:
            yield next(lines)


def _text(text: str) -> str:
    return safe_text(text, MOST_CHARACTERS) if text else "(empty)"


def _asset(name: str) -> str:
    return safe_text(name) if name.strip() else "(no name)"


def _first(lines: Sequence[str], most: int, more: str = "  … and {:,} more; --all shows every one") -> list[str]:
    return [*lines[:most], *([more.format(len(lines) - most)] if len(lines) > most else [])]


# ---- what a change does: below the differences


TITLE = "what it does"
MOST_EFFECTS = 10
"""Assets and gaps that are listed without --all."""
MOST_BOXES = 2
"""Boxes of one asset that are listed, the largest."""

Heading = tuple[str, list[str]]
"""A heading and the lines below it."""


def effects_json(effect: Effects | Fault | None) -> dict[str, object] | None:
    """Effects as plain data; None where they are not wanted or nothing could change."""
    if effect is None:
        return None
    return {"unknown": str(effect)} if isinstance(effect, Fault) else effect.to_json()


def effects_text(effect: Effects | Fault | None, colour: bool, shows_all: bool = False) -> str:
    """Effects as lines under a heading; nothing where there is nothing to tell."""
    if effect is None:
        return ""
    lines = ["", TITLE]
    for heading, items in headings(effect, shows_all):
        lines.append(styled(f"  {printable(heading)}", "bold" if items else "dim", colour))
        lines += [f"    {printable(line)}" for line in items]
    return "".join(f"{line}\n" for line in lines)


def effects_markdown(effect: Effects | Fault | None, shows_all: bool = False) -> str:
    """Effects as a list of Markdown under a heading; nothing where there is nothing to tell."""
    if effect is None:
        return ""
    lines = ["", f"#### {TITLE.capitalize()}", ""]
    for heading, items in headings(effect, shows_all):
        lines.append(f"- {escaped(heading)}")
        lines += [f"  - {escaped(line)}" for line in items]
    return "".join(f"{line}\n" for line in lines)


def headings(effect: Effects | Fault, shows_all: bool) -> Iterator[Heading]:
    """What a change does, under headings."""
    if isinstance(effect, Fault):
        yield f"That cannot be determined: {effect}", []
        return
    most = sys.maxsize if shows_all else MOST_EFFECTS
    if effect.before is not None and effect.after is not None:
        yield _covered(effect), []
    for reach in effect.assets[:most]:
        yield from _reach(reach, shows_all)
    left = max(0, len(effect.assets) - most)
    if left:
        yield f"… and {plural(left, 'asset')} more; --all shows every one", []
    if effect.n_left_out:
        yield f"{plural(effect.n_left_out, 'more changed asset')} not looked at", []
    yield from _listed("gaps opened", [gap_line(box) for box in effect.opened], most)
    yield from _listed("gaps closed", [gap_line(box) for box in effect.closed], most)
    yield from _listed("rows that can no longer be chosen", [_finding(each) for each in effect.dead], most)
    yield from _listed("rows that may not be valid together", [_finding(each) for each in effect.overlaps], most)
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


def _reach(reach: Reach, shows_all: bool) -> Iterator[Heading]:
    for verb, boxes, share in (("gains", reach.gained, reach.share_gained), ("loses", reach.lost, reach.share_lost)):
        if boxes:
            most = len(boxes) if shows_all else MOST_BOXES
            yield f"{safe_text(reach.asset)} {verb} {_percent(share)}", _first(list(map(gap_line, boxes)), most, "… and {:,} more")


def _listed(title: str, lines: Sequence[str], most: int) -> Iterator[Heading]:
    if lines:
        yield title, _first(lines, most, "… and {:,} more; --all shows every one")


def _finding(finding: Finding) -> str:
    line = "" if finding.line is None else f", line {finding.line}"
    return f"{safe_text(finding.asset or '(no name)')}{line}: {safe_text(finding.message, 300)}"


def gap_line(box: Box) -> str:
    """A gap with its share."""
    return f"{_percent(box.share)}  {safe_text(box.text, 400)}"


def _percent(share: float) -> str:
    from contextdb.covering import format_percent

    return "single points" if share <= 0.0 else format_percent(share)
