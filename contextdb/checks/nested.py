"""What a check finds wrong with rows that refer to another table or are of a base, and what it says of a flat table's rows.

A finding of a table is about that table's own rows: what concerns rows of an inner table alone is reported there, once.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace

import numpy as np

from contextdb.errors import ContextDBError, Fault, in_quotes, plural
from contextdb.findings import Finding
from contextdb.tables.data import TableData
from contextdb.tables.nesting.expansion import FlatColumn
from contextdb.tables.nesting.flat import FlatTable
from contextdb.tables.nesting.links import inner_rows, is_nested, nesting_faults, require_sound
from contextdb.tables.table import flat_of
from contextdb.tables.variants import WholeTable, whole_of
from contextdb.tables.variety import finding_at


def whole_faults(whole: WholeTable, told: Sequence[Finding]) -> Iterator[Finding]:
    """What cannot be read in all rows of a variant beside what its own file has and `told` says: a finding for each cell that a new
    row lacks, and one for all that is of its base, whose faults are reported there."""
    places = {(finding.row, finding.column) for finding in told}
    faults = [*whole.faults, *nesting_faults(whole, whole.around or {})]
    of_base = []
    for fault in faults:
        row, column = fault.place.row, fault.place.column
        if row is None or (row, column) in places:
            continue
        if whole.is_inherited(row, column):
            of_base.append(fault)
        else:
            yield Finding.of(fault, "error", whole.name, whole.assets[row])
    if of_base and whole.base is not None:
        message = _cannot_be_used("base", whole.base.name, of_base)
        file = str(whole.path) if whole.path else None
        yield Finding("unusable-table", "error", f"{message}: {of_base[0].found}", whole.name, file)


def new_findings(whole: TableData, findings: Iterable[Finding]) -> Iterator[Finding]:
    """The findings of all rows of a table; of a variant those that its base does not have, and tables that cannot be used."""
    if not isinstance(whole, WholeTable):
        yield from findings
        return
    for finding in findings:
        rows = () if finding.row is None else (finding.row, *finding.by)
        if not rows or finding.rule == "unusable-table" or not all(whole.is_inherited(row, finding.column) for row in rows):
            yield finding


def check_nesting(table: TableData) -> Iterator[Finding]:
    """What is wrong with the rows of a readable table that refer to others; nothing where no others are known."""
    if not is_nested(table) or table.around is None or table.faults or nesting_faults(table, table.around):
        return
    unusable = list(_unusable(table))
    yield from unusable
    if unusable:
        return
    try:
        flat = flat_of(table, table.around)
    except ContextDBError as error:
        yield from (Finding.of(fault, "error", table.name) for fault in error.faults)
        return
    if isinstance(flat, FlatTable):
        yield from own_findings(flat, _shut_out(flat))


def _unusable(table: TableData) -> Iterator[Finding]:
    """A finding for each inner table that has faults, which are reported there."""
    for name, rows in inner_rows(table).items():
        try:
            assert table.around is not None
            require_sound(whole_of(table.around[name], table.around), table.around)
        except ContextDBError as error:
            message = _cannot_be_used("table", name, error.faults)
            yield finding_at(table, rows[0], "unusable-table", "error", f"{message}.", table.asset_column)


def _cannot_be_used(what: str, name: str, faults: Sequence[Fault]) -> str:
    n_faults = plural(len(faults), "fault")
    return f"the {what} {in_quotes(name)} cannot be used here: it has {n_faults}, the first in {faults[0].place}"


def _shut_out(flat: FlatTable) -> Iterator[Finding]:
    """The rows of inner tables that no context lets through, though each cell of their way lets some."""
    reasons: dict[int, str] = {}
    for column in flat.conditions:
        if not isinstance(column, FlatColumn):
            continue
        for code in [i for i, cell in enumerate(column.cells) if cell.is_empty and not cell.is_soft]:
            for row in np.flatnonzero((column.texts.codes == code) & flat.enabled).tolist():
                origins = column.layers.said(row)
                if len(origins) > 1 and row not in reasons:
                    texts = " and ".join(in_quotes(text) for _, text in origins)
                    reasons[row] = f"it can never be valid here: {column.condition.name} must be {texts}, which share nothing."
    for row, why in sorted(reasons.items()):
        yield Finding("shut-out-row", "info", why, flat.name, None, row, flat.assets[row])


def own_findings(flat: FlatTable, findings: Iterable[Finding]) -> Iterator[Finding]:
    """Findings about rows of a flat table as findings about the rows of its outer table."""
    for finding in outer_findings(flat, findings):
        yield finding if finding.row is None else _own(flat, finding, finding.row)


def outer_findings(flat: FlatTable, findings: Iterable[Finding]) -> Iterator[Finding]:
    """The findings about rows of a flat table, without those that the check of an inner table reports."""
    return (f for f in findings if f.row is None or not _is_of_inner(flat, (f.row, *f.by)))


def _is_of_inner(flat: FlatTable, rows: Sequence[int]) -> bool:
    """Whether several rows all are in one place of one inner table, whose own check reports them."""
    way = flat.expansion.rows
    return len(rows) > 1 and all(way[0, row] == way[0, rows[0]] and flat.leaves[row] != flat.assets[row] for row in rows)


def _own(flat: FlatTable, finding: Finding, row: int) -> Finding:
    outer = flat.expansion.rows[0]
    own, places = int(outer[row]), flat.places(row)
    by = tuple(dict.fromkeys(int(outer[other]) for other in finding.by if outer[other] != own))
    where = f" The row is in {places[-1]}." if len(places) > 1 else ""
    place = places[0]
    return replace(
        finding, message=finding.message + where, row=own, by=by, file=place.file, line=place.line, column=finding.column
    )
