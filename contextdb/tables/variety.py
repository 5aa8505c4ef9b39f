"""Variety: rows of different assets that are valid in the same contexts, where the table's policy wants a choice.

A policy "first" or "unique" lets one row play: a row that others make redundant is a slip there, and each has its warning. Under
any other policy several valid rows are what the game chooses from. Such rows are gathered: one finding `variety` for each group,
whose `row` and `by` are the rows of the group. A row that another row *of the same asset* makes redundant adds no choice and keeps
its warning.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import replace

import numpy as np

from contextdb.errors import in_quotes, plural, row_name
from contextdb.findings import Finding, Level
from contextdb.tables.condition_column import ConditionColumn
from contextdb.tables.data import TableData

VARIETY = "variety"
"""The rule of the gathered findings."""
NEEDLESS = ("identical-rows", "equal-row", "subsumed-row", "redundant-row")
"""The rules that tell of a row which others make redundant."""
MOST_NAMED = 3

Named = Callable[[int, int], str]
"""How a sentence about the second row names the first."""
PlaceOf = Callable[[int], Finding]
"""The finding `variety` of a row, without its message."""


def softened(findings: Iterable[Finding], assets: Sequence[str]) -> list[Finding]:
    """The findings of single rows, those of variety as information."""
    return [replace(f, level="info") if _is_variety(f, assets) else f for f in findings]


def gathered(findings: Sequence[Finding], assets: Sequence[str], at: PlaceOf, named: Named) -> list[Finding]:
    """The findings, those of variety in one for each group of rows.

    Rows that are valid in the same contexts are a group; rows within one row and that row are another; rows that several others
    make redundant are the last. What one row holds, a row that holds this row holds too, so a group is at the outermost.
    """
    gathered_findings: list[Finding] = []
    same: dict[int, list[int]] = {}
    within: dict[int, list[int]] = {}
    by_many: list[int] = []
    holder = {f.row: f.by[0] for f in findings if f.rule == "subsumed-row" and f.row is not None and f.by}
    for finding in findings:
        row = finding.row
        if row is None or not _is_variety(finding, assets):
            gathered_findings.append(finding)
        elif finding.rule == "redundant-row" and len(finding.by) > 1:
            by_many.append(row)
        elif finding.rule in ("subsumed-row", "redundant-row"):
            outer = _outermost(finding.by[0], holder)
            if outer not in within.get(row, ()):  # of two that hold each other wherever contexts can happen, one stands for both
                within.setdefault(outer, []).append(row)
        else:
            same.setdefault(finding.by[0], []).append(row)
    sentences = (*_same(same, named), *_within(within, named), *_by_many(by_many, named))
    gathered_findings += [replace(at(row), message=message, by=by) for row, message, by in sentences]
    return sorted(gathered_findings, key=lambda f: (f.row is not None, f.row or 0))


def needless(findings: Iterable[Finding], assets: Sequence[str]) -> list[Finding]:
    """The findings that `gathered` puts into groups."""
    return [f for f in findings if f.row is not None and _is_variety(f, assets)]


def _is_variety(finding: Finding, assets: Sequence[str]) -> bool:
    """Whether a finding says that rows of other assets make a row redundant."""
    return finding.rule in NEEDLESS and any(assets[row] != finding.asset for row in finding.by)


def _outermost(row: int, holder: dict[int, int]) -> int:
    while row in holder:
        row = holder[row]
    return row


Sentence = tuple[int, str, tuple[int, ...]]
"""The row of a finding, its message, and the other rows of the group."""


def _same(groups: dict[int, list[int]], named: Named) -> Iterator[Sentence]:
    for row, others in groups.items():
        be = "is" if len(others) == 1 else "are"
        yield row, f"{_rows(others, row, named)} {be} valid in the same contexts.", tuple(others)


def _within(groups: dict[int, list[int]], named: Named) -> Iterator[Sentence]:
    for row, others in groups.items():
        be = "is" if len(others) == 1 else "are"
        yield row, f"{_rows(others, row, named)} {be} valid only where this row is valid too.", tuple(others)


def _by_many(rows: list[int], named: Named) -> Iterator[Sentence]:
    if rows:
        row, *others = rows
        if others:
            yield row, f"this row and {_rows(others, row, named)} are valid only where several others are.", tuple(others)
        else:
            yield row, "this row is valid only where several others are.", ()


def _rows(others: list[int], row: int, named: Named) -> str:
    """The rows of a group next to one of it: the first by their names, and how many there are."""
    names = [named(other, row) for other in others[:MOST_NAMED]]
    if len(others) == 1:
        return names[0]
    more = [f"{len(others) - MOST_NAMED:,} more"] if len(others) > MOST_NAMED else []
    *first, last = [*names, *more]
    return f"{plural(len(others), 'other row')} ({', '.join(first)} and {last})"


# ---- rows of a table that accept the same, and how a finding names a row of a table


def where(table: TableData, row: int, other: int) -> str:
    """Where a row is, in a sentence about another: its line, else its number; where one is an inner table's with the file."""
    place = table.place(row)
    if place.line is None:
        return row_name(row)
    is_inside = table.path is not None and {place.file, table.place(other).file} != {str(table.path)}
    return f"line {place.line} of {place.file}" if is_inside else f"line {place.line}"


def identical_rows(table: TableData) -> Iterator[Finding]:
    """Rows whose every condition accepts the same values, whatever way it is written. A disabled row is like no other.

    Each is caused by the first such row of the same asset, or else by the first of all.
    """
    if table.n_rows < 2 or not (table.conditions or table.when):
        return
    disabled = np.where(table.enabled, -1, np.arange(table.n_rows))
    rules = [] if table.when is None else [table.when.meanings]
    meanings = [disabled, *rules, *(_meanings(column) for column in table.conditions)]
    group = np.zeros(table.n_rows, np.int64)
    for own in meanings:  # one number at a time: rows of numbers are sorted far more slowly
        group = np.unique(group * (int(own.max()) + 2) + own + 1, return_inverse=True)[1]
    _, first, counts = np.unique(group, return_index=True, return_counts=True)
    first_of: dict[tuple[int, str], int] = {}
    for row in np.flatnonzero(counts[group] > 1).tolist():
        start = int(first[group[row]])
        same = first_of.setdefault((start, table.assets[row]), row)
        other = start if same == row else same
        if other != row:
            message = f"every condition is the same as in {named(table, other, row)}."
            yield finding_at(table, row, "identical-rows", "warning", message, None, (other,))


def named(table: TableData, other: int, row: int) -> str:
    """A row by its place and its asset, in a sentence about another."""
    return f"{where(table, other, row)} ({in_quotes(table.assets[other])})"


def finding_at(
    table: TableData, row: int, rule: str, level: Level, message: str, column: str | None, by: tuple[int, ...] = ()
) -> Finding:
    """A finding at a row of a table, or at one of its cells."""
    place = table.place(row, column)
    return Finding(rule, level, message, table.name, place.file, row, table.assets[row], place.line, column, by)


def _meanings(column: ConditionColumn) -> np.ndarray[tuple[int], np.dtype[np.int64]]:
    """For each row a number that is the same for cells that mean the same; a cell that cannot be read means itself."""
    known: dict[object, int] = {}
    keys = [("fault", i) if i in column.faults else (c.accepts, c.penalty, c.per) for i, c in enumerate(column.cells)]
    numbers = np.array([known.setdefault(k, len(known)) for k in keys], np.int64)
    return numbers[column.texts.codes]
