"""Saved contexts of a table, and what is expected of them: `hit_mid_air.cases.csv` beside `hit_mid_air.csv`.

One row is one case. `Case` names it, `Expected` says which assets are valid, `Note` (where there is such a column) says why in
words; every other column is a fact, written as in `contextdb query`. An empty fact is left out of the question.

    walk "Half Way"     exactly these assets
    +walk -run          walk is valid and run is not, whatever else is
    (none)              no asset is valid
    (empty)             nothing is expected: a context that is saved to be looked at

An edge: it reads and writes the file of cases.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from contextdb.cells.domains import TAGS, TEXT
from contextdb.cells.facts import Fact, no_condition, read_fact_text
from contextdb.cells.grammar import parse_cell
from contextdb.cells.sets import TagSet, ValueSet
from contextdb.cells.words import quoted
from contextdb.columns import TextColumn
from contextdb.compiled.data import CompiledData
from contextdb.compiled.table import data_of
from contextdb.covering.baseline import CaseCounts
from contextdb.covering.report import format_percent
from contextdb.disk import write_atomic
from contextdb.errors import CellError, ContextError, Fault, Place, TableError, in_quotes, mend_for, nearest, plural, some
from contextdb.files.csv_rewrite import Origin
from contextdb.files.texts import AnySource, new_source, read_texts
from contextdb.findings import Finding
from contextdb.tables.data import TableData
from contextdb.tables.other_files import CASE_COLUMNS
from contextdb.tables.table import Table

NAME, EXPECTED, NOTE = CASE_COLUMNS
NONE = "(none)"

Columns = Sequence[TextColumn]


@dataclass(frozen=True)
class Case:
    """A saved context: its name, its facts as texts, and what is expected of it."""

    name: str
    facts: Mapping[str, str]
    expected: str = ""
    line: int | None = None
    """Where it is in its file, from 1."""
    note: str = ""


@dataclass(frozen=True, slots=True)
class Expected:
    """What a case expects of the valid assets."""

    wanted: frozenset[str] = frozenset()
    """Must be valid."""
    banned: frozenset[str] = frozenset()
    """Must not be valid."""
    is_exact: bool = False
    """Nothing but `wanted` may be valid."""

    @property
    def is_anything(self) -> bool:
        """Whether whatever is valid is right."""
        return not (self.wanted or self.banned or self.is_exact)


@dataclass(frozen=True, slots=True)
class Verdict:
    """What came out of a case."""

    missing: tuple[str, ...] = ()
    """Assets that should be valid and are not."""
    extra: tuple[str, ...] = ()
    """Assets that should not be valid and are."""
    faults: tuple[Fault, ...] = ()
    """Why the case cannot be evaluated."""
    is_asked: bool = True
    """Whether anything is expected."""
    n_valid: int = 0
    valid: int = 0
    """The valid rows, as bits."""

    @property
    def holds(self) -> bool | None:
        """Whether what is expected came out; None where nothing is expected."""
        if self.faults or self.missing or self.extra:
            return False
        return True if self.is_asked else None


# ---- the file


def exactly(assets: Sequence[str]) -> str:
    """What `Expected` says for exactly these assets."""
    return " ".join(quoted(asset) for asset in dict.fromkeys(assets)) or NONE


def read_cases(path: Path) -> list[Case]:
    """The cases of a file; none where there is no file. Raises TableError or FileError where the file cannot be read, or has no
    column of names."""
    if not os.path.exists(path):
        return []
    source, columns = _read(path)
    texts = {c.name: c.to_list() for c in columns}
    nothing = [""] * columns[0].n_rows
    names, expected, notes = texts.pop(NAME), texts.pop(EXPECTED, nothing), texts.pop(NOTE, nothing)
    return [
        Case(name, {f: facts[row] for f, facts in texts.items() if facts[row].strip()}, expected[row], source.line(row), notes[row])
        for row, name in enumerate(names)
    ]


def keep_case(path: Path, case: Case) -> None:
    """Write a case into a file, in the place of one of its name or at the end. Other lines stay as they are. Raises TableError or
    FileError where the file cannot be read or written, or a condition has a name that such a file uses itself."""
    keep_cases(path, [case])


def keep_cases(path: Path, cases: Sequence[Case]) -> None:
    """The same for several, written at once."""
    if taken := [name for case in cases for name in CASE_COLUMNS if name in case.facts]:
        problem = f"a condition named {in_quotes(taken[0])} cannot be saved: a file of cases has such a column itself."
        raise TableError(Fault(problem, "another name of the condition", place=Place(str(path))))
    empty = [TextColumn.of(NAME, ()), TextColumn.of(EXPECTED, ())]

    def with_cases(source: AnySource | None, columns: Columns) -> tuple[Columns, Origin]:
        columns = columns or empty
        origin: Origin = np.arange(columns[0].n_rows)
        for case in cases:
            columns, at = _with_case(case, source, columns)
            origin = origin if at is None else np.append(origin, -1)
        return columns, origin

    _rewrite(path, with_cases)


def _with_case(case: Case, source: AnySource | None, columns: Columns) -> tuple[Columns, int | None]:
    """The columns with a case, and where it was added; None where one of its name is replaced."""
    texts = {NAME: case.name, EXPECTED: case.expected, **case.facts} | ({NOTE: case.note} if case.note else {})
    row, n_rows = _row_of(case, source, columns), columns[0].n_rows
    known = {c.name for c in columns}
    columns = [*columns, *(TextColumn.of(name, [""] * n_rows) for name in texts if name not in known)]
    if row is not None:
        return [c.with_text(row, texts.get(c.name, "")) for c in columns], None
    return [c.with_inserted(n_rows, [texts.get(c.name, "")]) for c in columns], n_rows


def rename_case(path: Path, case: Case, name: str) -> None:
    """Give a case another name. Raises TableError or FileError where there is no such case, another one has that name, or the file
    cannot be read or written."""

    def renamed(source: AnySource | None, columns: Columns) -> tuple[Columns, Origin]:
        row = _find(path, case, source, columns)
        if name != case.name and name in _names(columns):
            raise TableError(Fault(f"there is a case {in_quotes(name)} already.", "another name", place=Place(str(path))))
        return [c.with_text(row, name) if c.name == NAME else c for c in columns], np.arange(columns[0].n_rows)

    _rewrite(path, renamed, must_exist=True)


def delete_case(path: Path, case: Case) -> None:
    """Take a case out of a file. Raises TableError or FileError where there is no such case, or the file cannot be read
    or written."""

    def without(source: AnySource | None, columns: Columns) -> tuple[Columns, Origin]:
        rest = np.delete(np.arange(columns[0].n_rows), _find(path, case, source, columns))
        return [c.with_rows_taken(rest) for c in columns], rest

    _rewrite(path, without, must_exist=True)


def _rewrite(path: Path, change: Callable[[AnySource | None, Columns], tuple[Columns, Origin]], must_exist: bool = False) -> None:
    """Write a file of cases as `change` makes it; once more where somebody else wrote it in this moment."""
    is_written = False
    while not is_written:
        source, columns = _read(path) if must_exist or os.path.exists(path) else (None, [])
        now, origin = change(source, columns)
        was = None if source is None else source.raw
        is_written = write_atomic(path, new_source(path, now, source, origin).raw, was)


def _read(path: Path) -> tuple[AnySource, list[TextColumn]]:
    source, columns = read_texts(path)
    names = [c.name for c in columns]
    if NAME in names:
        return source, columns
    near = nearest(NAME, names)
    problem = f"there is no column {in_quotes(NAME)}, which names the cases."
    place = Place(str(path), source.line(-1))
    raise TableError(
        Fault(problem, f"{NAME}, {EXPECTED} and a column for each fact", f"to rename {in_quotes(near)}" if near else "", place)
    )


def _names(columns: Sequence[TextColumn]) -> list[str]:
    return next(c.to_list() for c in columns if c.name == NAME)


def _row_of(case: Case, source: AnySource | None, columns: Sequence[TextColumn]) -> int | None:
    """Where a case is: on its line, where the file still has it there, else where its name first stands."""
    rows = [row for row, name in enumerate(_names(columns)) if name == case.name]
    at_line = [row for row in rows if source is not None and source.line(row) == case.line]
    return next(iter(at_line + rows), None)


def _find(path: Path, case: Case, source: AnySource | None, columns: Columns) -> int:
    row = _row_of(case, source, columns)
    if row is None:
        problem = f"there is no case {in_quotes(case.name)} any more."
        raise TableError(Fault(problem, "a case of the file", mend_for(case.name, _names(columns)), Place(str(path))))
    return row


# ---- what comes out


def check_cases(table: Table, cases: Sequence[Case], file: str | None = None) -> list[Finding]:
    """What of the cases does not hold: findings of the rules "case-failed" and "unreadable-case".

    A table with cells that cannot be read is not evaluated; those are findings of their own.
    """
    compiled = _compiled(table)
    if compiled is None:
        return []
    flat = table.flat()
    findings = list(_doubtful(flat, cases, file))
    known = _known_facts(flat)
    for case in cases:
        if not known.issuperset(case.facts):
            continue
        verdict = judge(compiled, case)
        for fault in verdict.faults:
            text = f"the case {in_quotes(case.name)} cannot be evaluated: {fault.message}"
            findings.append(Finding("unreadable-case", "error", text, flat.name, file, line=case.line, column=fault.place.column))
        if not verdict.faults and verdict.holds is False:
            message = f"the case {in_quotes(case.name)} fails: {mismatch(verdict, compiled.assets)}."
            findings.append(Finding("case-failed", "error", message, flat.name, file, line=case.line, column=EXPECTED))
    return sorted(findings, key=lambda finding: finding.line or 0)


def judge(compiled: CompiledData, case: Case, readable: int | None = None) -> Verdict:
    """Whether what a case expects comes out. Facts that the table has no condition for are left out of the question. `readable` are
    the rows that may be valid, as bits, of a table with cells that cannot be read; None: all."""
    expected, facts, faults = question_of(compiled, case)
    if faults:
        return Verdict(faults=faults)
    matches = compiled.query(facts, unknown="any")
    matches = matches if readable is None else compiled.matches(matches.bits & readable)
    valid = set(matches.assets)
    extra = valid - expected.wanted if expected.is_exact else valid & expected.banned
    return Verdict(
        tuple(sorted(expected.wanted - valid)), tuple(sorted(extra)), (), not expected.is_anything, len(matches), matches.bits
    )


def question_of(compiled: CompiledData, case: Case) -> tuple[Expected, dict[str, Fact], tuple[Fault, ...]]:
    """What a case expects, its facts as a query takes them, and why they cannot be read."""
    facts: dict[str, Fact] = {}
    faults: list[Fault] = []
    expected = Expected()
    try:
        expected = read_expected(case.expected)
    except (ContextError, CellError) as error:
        faults += [fault.at(Place(column=EXPECTED)) for fault in error.faults]
    for name, text in case.facts.items():
        try:
            if name in compiled.asked:
                facts[name] = read_fact_text(text, compiled.asked[name])
            elif compiled.derivation is not None:
                compiled.derivation.refuse([name])
        except ContextError as error:
            faults += [fault.at(Place(column=name)) for fault in error.faults]
    return expected, facts, tuple(faults)


def _compiled(table: Table) -> CompiledData | None:
    """A table that can be evaluated; None where it, or one that it is made of, cannot be used, which is a finding of its own."""
    try:
        return data_of(table.compile())
    except TableError:
        return None


def counted(table: Table, cases: Sequence[Case]) -> CaseCounts:
    """How much the cases of a table expect, as `counted_in`. Raises TableError for one that cannot be used."""
    return counted_in(data_of(table.compile()), cases)


def counted_in(compiled: CompiledData, cases: Sequence[Case]) -> CaseCounts:
    """How much the cases of a table expect. One that can only hold, and another of the same facts and expectation, do not count."""
    exact, different, reached = 0, set[tuple[frozenset[tuple[str, str]], str]](), 0
    for case in cases:
        facts = frozenset((name, text.strip()) for name, text in case.facts.items() if name in compiled.asked)
        verdict = judge(compiled, case)
        if verdict.faults or (facts, case.expected.strip()) in different:
            continue
        expected = read_expected(case.expected)
        if expected.is_exact or expected.wanted or not expected.banned.isdisjoint(compiled.assets):
            different.add((facts, case.expected.strip()))
            exact += expected.is_exact
            reached |= verdict.valid
    return CaseCounts(len(different), exact, compiled.n_rows, reached.bit_count())


@dataclass(frozen=True, slots=True)
class CaseBar:
    """How many saved contexts each table must have that expect something, and the share of its rows that they must reach."""

    least: int = 0
    least_share: float = 0.0

    def findings(self, table: Table, cases: Sequence[Case], file: str | None) -> Iterator[Finding]:
        """What a table misses; nothing where it, or one that it is made of, cannot be read, which is a finding of its own."""
        if (compiled := _compiled(table)) is None:
            return
        counts = counted_in(compiled, cases)
        if counts.count < self.least:
            verb = "expects" if counts.count == 1 else "expect"
            sentence = f"{plural(counts.count, 'saved context')} of the table {verb} something; wanted: {self.least:,}."
            yield Finding("few-cases", "error", sentence, table.name, file)
        if counts.rows_reached < self.least_share * counts.rows:
            share = format_percent(counts.rows_reached / counts.rows)
            reached = f"{counts.rows_reached:,} of {plural(counts.rows, 'row')} ({share})"
            sentence = f"{reached} are valid in a saved context that expects something; wanted: {format_percent(self.least_share)}."
            yield Finding("few-cases", "error", sentence, table.name, file)


def mismatch(verdict: Verdict, assets: Sequence[str]) -> str:
    """What is wrong, in words; with a name that the table does not have, the nearest that it has."""
    parts = []
    if missing := verdict.missing:
        strange = next(iter(sorted(set(missing).difference(assets))), None)
        hint = "" if strange is None else f": {_no_asset(strange, assets)}"
        parts.append(f"{some(missing)} should be valid and {'is' if len(missing) == 1 else 'are'} not{hint}")
    if extra := verdict.extra:
        parts.append(f"{some(extra)} should not be valid and {'is' if len(extra) == 1 else 'are'}")
    return "; ".join(parts)


def read_expected(text: str) -> Expected:
    """Read what a case expects. Raises CellError or ContextError where it is not written as asset names, signed names or
    "(none)"."""
    body = text.strip()
    if body == NONE:
        return Expected(is_exact=True)
    cell = parse_cell(body, TAGS if body[:1] in ("+", "-") else TEXT)
    match cell.accepts:
        case None if not cell.is_soft:
            return Expected()
        case TagSet(needs, bans, False) if not cell.is_soft and not needs & bans:
            return Expected(needs, bans)
        case ValueSet(values, False) if not cell.is_soft:
            return Expected(frozenset(map(str, values)), is_exact=True)
    problem = f"{in_quotes(body)} is not a valid expectation."
    raise ContextError(Fault(problem, f'assets with spaces between, "+walk -run", "{NONE}"', place=Place(column=EXPECTED)))


def _no_asset(asset: str, assets: Sequence[str]) -> str:
    near = nearest(asset, assets)
    return f"the table has no asset {in_quotes(asset)}" + (f"; did you mean {in_quotes(near)}?" if near else "")


def _doubtful(table: TableData, cases: Sequence[Case], file: str | None) -> Iterator[Finding]:
    """Facts that no table of the project has a condition for; cases of one name; assets expected not to be valid that are none."""
    facts = set(_known_facts(table))
    assets, first_of = table.assets, dict[str, Case]()
    for case in cases:
        place = Finding("unreadable-case", "error", "", table.name, file, line=case.line)
        about = f"the case {in_quotes(case.name)}"
        for name in [name for name in case.facts if name not in facts]:
            [fault] = no_condition(name, [c.condition.name for c in table.conditions]).faults
            yield replace(place, message=f"{about} cannot be evaluated: {fault.message}", column=name)
            facts.add(name)
        if first := first_of.get(case.name):
            where = f"in line {first.line}" if first.line else "before it"
            yield replace(place, level="warning", message=f"{about} is also {where}: each case needs its own name.", column=NAME)
        first_of.setdefault(case.name, case)
        for asset in _banned(case).difference(assets):
            yield replace(place, level="warning", message=f"{about} always holds: {_no_asset(asset, assets)}", column=EXPECTED)


def _known_facts(table: TableData) -> set[str]:
    """The facts that a case may name: those of this table, and those that its project declares for others."""
    return {c.condition.name for c in table.conditions} | table.schema.conditions.keys()


def _banned(case: Case) -> frozenset[str]:
    try:
        return read_expected(case.expected).banned
    except (ContextError, CellError):
        return frozenset()
