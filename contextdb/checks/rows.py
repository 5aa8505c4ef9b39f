"""What a check finds wrong with rows and assumptions, within so much work that it can run before every commit.

    no-context       assumptions that leave no context, the first that does so named
    bad-assumption   an assumption that cannot be read
    always-any       a condition whose every cell is Any
    unused-condition a declared condition that no table uses
    undecided-rows   rows that would have taken more work

The others are those of `contextdb.covering.judge`. Shares are not worked out: that is what coverage is for.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping

import numpy as np

from contextdb.checks.nested import new_findings, outer_findings, own_findings
from contextdb.checks.run import capped
from contextdb.covering.assumed import assumptions_of, opened
from contextdb.covering.engine import finding_steps
from contextdb.covering.judge import Judge
from contextdb.covering.progress import Progress, Stops, Tell
from contextdb.errors import ContextDBError, plural
from contextdb.expressions import ExpressionError, names_in
from contextdb.findings import Finding
from contextdb.schema.settings import Schema
from contextdb.schema.toml_lines import Path
from contextdb.tables.data import TableData
from contextdb.tables.nesting.flat import FlatTable
from contextdb.tables.table import EitherTable
from contextdb.tables.variants import whole_of

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
