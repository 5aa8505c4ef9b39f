"""What a table alone can show to be wrong: a table in, findings out. Each rule has a paragraph in docs/messages.md.

inferred-mirror     angles, negated because that is what angles do in a mirror
undeclared-mirror   a condition with names of both sides that says nothing of a mirror, or changes places
                    with a condition that the table does not ask for, so that its facts stay as they are
uneven-mirror       a negated number whose min is not the opposite of its max; whoever plays it
"""

from __future__ import annotations

import math
from collections import Counter, defaultdict
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import replace
from functools import partial
from typing import cast

import numpy as np

from contextdb import bitmask
from contextdb.cells.conditions import Condition
from contextdb.cells.domains import Domain
from contextdb.cells.mirroring import SIDES, partner_of, sided_pairs, way_of
from contextdb.cells.sets import Cell, NumberSet, TagSet, ValueSet
from contextdb.cells.words import format_number
from contextdb.checks.nested import check_nesting, new_findings, outer_findings, own_findings, whole_faults
from contextdb.covering.assumed import assumptions_of, opened
from contextdb.covering.engine import finding_steps
from contextdb.covering.judge import Judge
from contextdb.covering.progress import Progress, Stops, Tell
from contextdb.errors import ContextDBError, in_quotes, nearest, plural, some
from contextdb.expressions import ExpressionError, constant_truth, names_in
from contextdb.expressions.rules import WhenRules
from contextdb.files.csv_source import Source
from contextdb.files.toml_shapes import as_toml
from contextdb.findings import Finding, Level
from contextdb.schema.policies import lets_choose
from contextdb.schema.settings import Schema, derivation_of
from contextdb.schema.table_settings import missing_job
from contextdb.schema.toml_lines import Path
from contextdb.tables.condition_column import ConditionColumn
from contextdb.tables.data import TableData, known_conditions
from contextdb.tables.nesting.flat import FlatTable
from contextdb.tables.nesting.links import reached
from contextdb.tables.nesting.names import inner_name
from contextdb.tables.table import EitherTable, Table
from contextdb.tables.variants import known_whole, whole_of
from contextdb.tables.variety import finding_at, gathered, identical_rows, named, where

LINE_ENDS = {"\n": "LF", "\r\n": "CRLF", "\r": "CR"}
MOST_ROWS = 1000
"""A rule reports at most so many rows of one column, then says how many more there are."""


def check(table: Table) -> list[Finding]:
    """Every finding of a table, in the order of its rows, those of the whole table first."""
    findings = [*_whole_table(table), *_unreadable(table)]
    with suppress(ContextDBError):  # of a base that cannot be used, which is among what cannot be read
        whole = whole_of(table, table.around)
        rules = (_undeclared_conditions, _cells, _constant_rules, _assets, _identical, check_nesting, check_mirroring)
        findings += new_findings(whole, (finding for rule in rules for finding in rule(whole)))
    findings = list(capped(findings))
    return sorted(findings, key=lambda f: (f.row is not None, f.row or 0))


def capped(findings: Iterable[Finding]) -> Iterator[Finding]:
    """The findings; of those of one rule in one column the first `MOST_ROWS`, and one that says how many more there are."""
    counts: Counter[tuple[str, str | None]] = Counter()
    first_left: dict[tuple[str, str | None], Finding] = {}
    for finding in findings:
        kind = (finding.rule, finding.column)
        counts[kind] += 1
        if counts[kind] <= MOST_ROWS:
            yield finding
        else:
            first_left.setdefault(kind, finding)
    for kind, finding in first_left.items():
        yield replace(finding, message=f"{finding.message} ({counts[kind] - MOST_ROWS:,} rows like this one are not listed.)")


def _whole_table(table: TableData) -> Iterator[Finding]:
    file = str(table.path) if table.path else None
    if table.n_rows == 0:
        yield Finding("no-rows", "warning", "the table has no rows, so no context has an asset.", table.name, file)
    if isinstance(table.source, Source) and len(table.source.line_ends) > 1:
        ends = ", ".join(f"{n:,} in {LINE_ENDS[end]}" for end, n in table.source.line_ends.items())
        message = f"the lines end in different ways: {ends}; they are kept as they are."
        yield Finding("mixed-line-ends", "info", message, table.name, file)


def _undeclared_conditions(table: TableData) -> Iterator[Finding]:
    file = str(table.path) if table.path else None
    present = {c.name for c in table.columns}
    absent = [name for name in table.schema.conditions if name not in present]
    for column in table.conditions:
        if not column.condition.is_declared:
            yield _undeclared(table, column, file, absent)


def _undeclared(table: TableData, column: ConditionColumn, file: str | None, absent: Sequence[str]) -> Finding:
    name, kind = column.condition.name, column.condition.domain.kind
    near = nearest(name, absent)
    meant = missing_job(name, vars(table.settings)) or (in_quotes(near) if near else "")
    hint = f" Did you mean {meant}?" if meant else ""
    level: Level = "warning" if table.schema.conditions else "info"
    message = f"the condition is not declared in contextdb.toml; type inferred from its cells: {kind}.{hint}"
    return Finding("undeclared-condition", level, message, table.name, file, column=name)


def _unreadable(table: TableData) -> list[Finding]:
    findings = [
        Finding.of(fault, "error", table.name, None if fault.place.row is None else table.assets[fault.place.row])
        for fault in table.faults
    ]
    whole = known_whole(table)
    if whole is None:
        return findings
    rows = {own: row for row, own in enumerate(whole.own_rows.tolist()) if own >= 0}
    findings = [f if f.row is None else replace(f, row=rows.get(f.row)) for f in findings]
    return [*findings, *whole_faults(whole, findings)]


def _cells(table: TableData) -> Iterator[Finding]:
    for column in table.conditions:
        texts: dict[int, tuple[str, Level, str]] = {}
        for i, cell in enumerate(column.cells):
            verdict = verdict_of(cell, column.condition.domain)
            if verdict and i not in column.faults:
                texts[i] = verdict
        rows = np.flatnonzero(np.isin(column.texts.codes, list(texts))).tolist() if texts else []
        for row in rows:
            rule, level, why = texts[int(column.texts.codes[row])]
            yield finding_at(table, row, rule, level, f"{in_quotes(column.texts[row])} {why}", column.condition.name)


def verdict_of(cell: Cell, domain: Domain) -> tuple[str, Level, str] | None:
    """The rule that a cell breaks, its level and why."""
    if cell.is_empty:
        so = "its penalty always counts" if cell.is_soft else "the row never matches"
        return "empty-cell", "error", f"accepts no value at all, so {so}."
    if not isinstance(cell.accepts, NumberSet) or domain.type.is_circular:
        return None
    low, high = domain.minimum, domain.maximum
    spans = cell.accepts.spans
    bounds = _declared(domain)
    if spans[-1][1] < low or spans[0][0] > high:
        return "outside-domain", "warning", f"is wholly outside {bounds}, so the row matches no expected value."
    ends = [e for span in spans for e in span if np.isfinite(e)]
    if ends and (min(ends) < low or max(ends) > high):
        return "beyond-domain", "info", f"reaches beyond {bounds}."
    return None


def _declared(domain: Domain) -> str:
    low, high = map(domain.type.spelling.write, domain.ends)
    if np.isinf(domain.maximum):
        return f"the declared min {low}"
    return f"the declared max {high}" if np.isinf(domain.minimum) else f"the declared {low} to {high}"


def _constant_rules(table: TableData) -> Iterator[Finding]:
    """Rules that say the same of every context of the declared values and bounds."""
    when = WhenRules.of(table.when)
    for rule in when.rules if when is not None else ():
        truth = constant_truth(rule.expression)
        if truth is None:
            continue
        kind, level = ("always-true", "info") if truth else ("never-true", "warning")
        so = "so it excludes nothing" if truth else "so the row never matches"
        message = f"the rule {in_quotes(rule.expression.text)} is {truth} in every context of the declared values and bounds, {so}."
        for row in bitmask.rows_of(rule.rows):
            yield finding_at(table, row, kind, cast(Level, level), message, table.settings.when)


def _assets(table: TableData) -> Iterator[Finding]:
    rows_of: dict[str, list[int]] = defaultdict(list)
    for row, asset in enumerate(table.assets):
        rows_of[asset].append(row)
    for asset, rows in rows_of.items():
        if not asset.strip():
            for row in rows:
                yield finding_at(table, row, "no-asset", "error", "the row names no asset.", table.asset_column)
        elif len(rows) > 1 and inner_name(asset) is None:
            for row in rows[1:]:
                message = f"the asset {in_quotes(asset)} is also in {where(table, rows[0], row)}."
                yield finding_at(table, row, "duplicate-asset", "warning", message, table.asset_column, (rows[0],))


def _identical(table: TableData) -> Iterator[Finding]:
    findings = list(identical_rows(table))
    if lets_choose([table.settings.policy]):
        findings = gathered(
            findings, table.assets, lambda row: finding_at(table, row, "variety", "info", "", None), partial(named, table)
        )
    yield from findings


# ---- what a check says of tables whose assets are played mirrored too: how facts change in the mirror, where nobody declared
# it


def check_mirroring(table: TableData) -> Iterator[Finding]:
    """What is to be said of one table."""
    conditions = _queried(table)
    for condition in conditions.values():
        if _is_uneven(condition):
            yield Finding("uneven-mirror", "warning", _uneven(condition), table.name, _file(table), column=condition.name)
    databases = _mirroring_databases(table)
    if not databases:
        return
    by = f"the database{'s' if len(databases) > 1 else ''} {some(databases)}"
    inferred = [c.name for c in conditions.values() if c.mirror is None and way_of(c) == "negate"]
    if inferred:
        message = f"{some(inferred)} {'is' if len(inferred) == 1 else 'are'} negated for mirrored clips of {by}, as angles are."
        yield Finding("inferred-mirror", "info", message, table.name, _file(table))
    columns = {c.condition.name: c for c in table.conditions}
    for condition in conditions.values():
        if (partner := partner_of(condition)) is not None and partner not in conditions:
            message = f"{partner} is not a column, so this fact stays as it is for mirrored clips of {by}."
            message += f" Try a column {partner}, Any in each row."
            yield Finding("undeclared-mirror", "info", message, table.name, _file(table), column=condition.name)
        pairs = _sides(condition, columns.get(condition.name)) or _other_sides(condition, conditions)
        if condition.mirror is None and condition.expr is None and pairs:
            message = f"no mirror is declared, so its facts stay as they are for mirrored clips of {by}."
            message += f' Try mirror = {as_toml(pairs)}, or "none".'
            yield Finding("undeclared-mirror", "info", message, table.name, _file(table), column=condition.name)


def _queried(table: TableData) -> dict[str, Condition]:
    """The conditions whose facts the table is queried with: its columns, those of rules, and the inputs of derived ones."""
    conditions = {c.condition.name: c.condition for c in table.conditions}
    if table.when is not None:
        known = known_conditions(table)
        conditions |= {name: known[name] for name in table.when.names if name in known}
    derivation = derivation_of(table.schema, conditions)
    return conditions | {c.name: c for c in (derivation.inputs if derivation is not None else ())}


def _mirroring_databases(table: TableData) -> list[str]:
    """The databases that play assets of the table mirrored: its own, and those of tables that it is in."""
    around = table.around or {}
    names = []
    for name, part in table.schema.databases.items():
        owner = part.get("table")
        if part.get("mirror") is True and isinstance(owner, str):
            outer = around.get(owner)
            if owner == table.name or (outer is not None and table.name in reached(outer, around)):
                names.append(name)
    return names


def _sides(condition: Condition, column: ConditionColumn | None) -> dict[str, str]:
    """The pairs of names of a condition that differ by their side alone."""
    if not condition.domain.type.is_swapped:
        return {}
    if condition.domain.values is not None or column is None:
        return sided_pairs(condition.domain.values or ())
    return sided_pairs(sorted({name for cell in column.cells for name in _names(cell)}))


def _other_sides(condition: Condition, conditions: Collection[str]) -> dict[str, str]:
    """The sides by which the name of a condition without names differs from another's."""
    if condition.domain.type.is_swapped or condition.domain.type.is_circular:
        return {}
    return next(
        ({a: b} for a, b in SIDES for one, other in ((a, b), (b, a)) if _is_other(condition.name, one, other, conditions)), {}
    )


def _is_other(name: str, one: str, other: str, conditions: Collection[str]) -> bool:
    return one in name and name.replace(one, other) in conditions


def _names(cell: Cell) -> frozenset[str]:
    accepts = cell.accepts
    if isinstance(accepts, TagSet):
        return accepts.needs | accepts.bans
    return frozenset(map(str, accepts.values)) if isinstance(accepts, ValueSet) else frozenset()


def _is_uneven(condition: Condition) -> bool:
    domain = condition.domain
    return condition.mirror == "negate" and domain.type.is_bounded and domain.minimum != -domain.maximum


def _uneven(condition: Condition) -> str:
    bounds = {"min": condition.domain.minimum, "max": condition.domain.maximum}
    low, high = (f"{key} {format_number(b)}" if math.isfinite(b) else f"no {key}" for key, b in bounds.items())
    return f'mirror = "negate", with {low} and {high}: the mirrored facts are outside the bounds.'


def _file(table: TableData) -> str | None:
    return str(table.path) if table.path else None


# ---- what a check finds wrong with rows and assumptions, within so much work that it can run before every commit. no-context
# assumptions that leave no context, the first that does so named bad-assumption an assumption that cannot be read always-any
# a condition whose every cell is Any unused-condition a declared condition that no table uses undecided-rows rows that would
# have taken more work The others are those of `contextdb.covering.judge`. Shares are not worked out: that is what coverage is
# for

WORK = 4_000_000
"""A tenth of what coverage may spend."""


def check_rows(
    table: EitherTable, work: int = WORK, progress: Tell | None = None, should_stop: Stops | None = None
) -> list[Finding]:
    """What is wrong with the rows of a table that can be read, those of the whole table first; nothing where cells cannot be read.

    The same table and work give the same findings. Rows that could not be decided within the work have none, and one
    finding counts them; of a rule that many rows break the first are named, and how many more there are. Raises Cancelled
    when `should_stop` says so.
    """
    if table.faults:
        return []
    try:
        whole = whole_of(table, table.around)
    except ContextDBError:  # of the base: reported there
        return []
    try:
        contradictions = assumptions_of(whole).contradictions
    except ExpressionError as error:
        return [_of_schema(table, "bad-assumption", fault.message) for fault in error.faults]
    if contradictions:
        return [_of_schema(table, "no-context", f"no context is possible: {fault.message}") for fault in contradictions]
    judged = _judged(table, work, Progress(progress, should_stop)) if whole.n_rows else []
    findings = capped([*_always_any(whole), *new_findings(whole, judged)])
    return sorted(findings, key=lambda f: (f.row is not None, f.row or 0))


def _judged(table: EitherTable, work: int, progress: Progress) -> list[Finding]:
    try:
        ready = opened(table, size="cut")
    except ContextDBError:  # such as a domain without a value: reported for the cells already
        return []
    judging = progress.within("Comparing rows", 0.0, 1.0)
    steps = finding_steps(work, len(ready.space.boxes))
    judge = Judge(ready.space, ready.compiled, ready.table, steps, judging, ready.drawer)
    findings = [finding for finding in judge.findings() if finding.rule != "identical-rows"]
    undecided = judge.unsure - {finding.row for finding in findings}
    findings = [*findings, *([_undecided(table, len(undecided), ready.compiled.n_rows)] if undecided else [])]
    findings = findings if ready.ruled is None else list(ready.ruled.findings(findings))
    if isinstance(ready.table, FlatTable):
        return list(own_findings(ready.table, judge.gathered(list(outer_findings(ready.table, findings)))))
    return judge.gathered(findings)


def _undecided(table: EitherTable, n_undecided: int, n_rows: int) -> Finding:
    file = str(table.path) if table.path else None
    message = (
        f"{n_undecided:,} of {plural(n_rows, 'row')} could not be decided within the work limit of a check, so other rows may "
        "make them redundant. To decide more, use contextdb coverage with --work."
    )
    return Finding("undecided-rows", "info", message, table.name, file)


def _always_any(table: TableData) -> Iterator[Finding]:
    if not table.enabled.any():
        return
    file = str(table.path) if table.path else None
    for column in table.conditions:
        says_any = np.array([cell.accepts is None for cell in column.cells], np.bool_)
        if says_any[column.texts.codes[table.enabled]].all():
            message = "every cell is Any, so the condition excludes no row."
            yield Finding("always-any", "info", message, table.name, file, column=column.condition.name)


def unused_conditions(schema: Schema, tables: Iterable[EitherTable], lines: Mapping[Path, int]) -> list[Finding]:
    """Declared conditions that none of the tables has, and that nothing these use is computed from.

    `lines` are the lines of the keys of contextdb.toml, as `toml_lines.key_lines` gives them.
    """
    tables = list(tables)
    used = {column.name for table in tables for column in table.columns}
    used.update(name for table in tables for text in table.settings.assume for name in names_in(text))
    used.update(name for table in tables if table.when is not None for name in table.when.names)
    used.update(name for contract in schema.contracts.values() if contract.when for name in names_in(contract.when))
    waiting = [name for name in used if name in schema.conditions]
    while waiting:
        expr = schema.conditions[waiting.pop()].expr
        new = [name for name in (names_in(expr) if expr else ()) if name in schema.conditions and name not in used]
        used.update(new)
        waiting += new
    message = "the condition is declared, and no table uses it."
    return [
        Finding("unused-condition", "info", message, None, schema.file, line=lines.get(("conditions", name)), column=name)
        for name in schema.conditions
        if name not in used and ("conditions", name) not in schema.shared
    ]


def _of_schema(table: EitherTable, rule: str, message: str) -> Finding:
    text = f"[tables.{table.name}] assume {message}" if rule == "bad-assumption" else message
    return Finding(rule, "error", text, table.name, str(table.path) if table.path else table.schema.file)
