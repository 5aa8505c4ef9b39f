"""Saved contexts of a table, and what is expected of them: `hit_mid_air.cases.csv` beside `hit_mid_air.csv`.

One row is one case. `Case` names it, `Expected` says which assets are valid, every other column is a fact, written as in
`contextdb query`; an empty fact is left out of the question.

    walk "Half Way"     exactly these assets
    +walk -run          walk is valid and run is not, whatever else is
    (none)              no asset is valid
    (empty)             nothing is expected: a context that is kept to be looked at

An edge: it reads and writes the file of cases.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from contextdb.cell_words import quoted
from contextdb.cells import TagSet, ValueSet, parse_cell
from contextdb.columns import TextColumn
from contextdb.compiled import CompiledTable
from contextdb.domains import TAGS, TEXT
from contextdb.errors import CellError, ContextError, Fault, Place, TableError, in_quotes, nearest, some
from contextdb.facts import Fact, read_fact_text
from contextdb.files import read_texts, write_texts
from contextdb.findings import Finding
from contextdb.project import CASES_SUFFIX
from contextdb.table import Table

NAME, EXPECTED, NONE = "Case", "Expected", "(none)"


@dataclass(frozen=True)
class Case:
    """A context that was kept: its name, its facts as texts, and what is expected of it."""

    name: str
    facts: Mapping[str, str]
    expected: str = ""
    line: int | None = None


def cases_path(table: Path) -> Path:
    """The file of the cases of a table's file."""
    return table.with_name(table.stem + CASES_SUFFIX)


def exactly(assets: Sequence[str]) -> str:
    """What `Expected` says for exactly these assets."""
    return " ".join(quoted(asset) for asset in dict.fromkeys(assets)) or NONE


def read_cases(path: Path) -> list[Case]:
    """The cases of a file; none where there is no file.

    Raises
    ------
    TableError, FileError
        The file cannot be read, or has no column of names.
    """
    if not path.exists():
        return []
    source, columns = read_texts(path)
    texts = {c.name: c.to_list() for c in columns}
    if NAME not in texts:
        near = nearest(NAME, texts)
        found = f"a file of cases has a column {in_quotes(NAME)}."
        raise TableError(
            Fault(found, f"{NAME}, {EXPECTED} and a column for each fact", in_quotes(near) if near else "", Place(str(path)))
        )
    names, expected = texts.pop(NAME), texts.pop(EXPECTED, [""] * columns[0].n_rows)
    return [
        Case(name, {fact: said[row] for fact, said in texts.items() if said[row].strip()}, expected[row], source.line(row))
        for row, name in enumerate(names)
    ]


def keep_case(path: Path, case: Case) -> None:
    """Write a case into a file, in the place of one of its name or at the end. Other lines stay as they are.

    Raises
    ------
    TableError, FileError
        The file cannot be read or written.
    """
    source, columns = read_texts(path) if path.exists() else (None, [TextColumn.of(NAME, ()), TextColumn.of(EXPECTED, ())])
    n_rows = columns[0].n_rows
    said = {NAME: case.name, EXPECTED: case.expected, **case.facts}
    known = {c.name for c in columns}
    columns += [TextColumn.of(name, [""] * n_rows) for name in said if name not in known]
    names = next((c.to_list() for c in columns if c.name == NAME), [])
    row = names.index(case.name) if case.name in names else n_rows
    if row == n_rows:
        columns = [c.with_inserted(row, [said.get(c.name, "")]) for c in columns]
    else:
        columns = [c.with_text(row, said.get(c.name, "")) for c in columns]
    origin = np.append(np.arange(n_rows), -1)[: columns[0].n_rows]
    write_texts(path, columns, source, origin)


def check_cases(table: Table, cases: Sequence[Case], file: str | None = None) -> list[Finding]:
    """What of the cases does not hold: findings of the rules "case-failed" and "unreadable-case".

    A table with cells that cannot be read is not asked; those are findings of their own.
    """
    if table.faults:
        return []
    compiled = table.compile()
    return [finding for case in cases for finding in _case_findings(compiled, case, file)]


def _case_findings(compiled: CompiledTable, case: Case, file: str | None) -> Iterator[Finding]:
    facts: dict[str, Fact] = {}
    try:
        for name, text in case.facts.items():
            if name in compiled.places:
                facts[name] = read_fact_text(text, compiled.conditions[compiled.places[name]])
        wanted, banned, is_exact = _expected(case.expected)
    except (ContextError, CellError) as error:
        for fault in error.faults:
            message = f"the case {in_quotes(case.name)} cannot be asked: {fault.message}"
            yield Finding("unreadable-case", "error", message, compiled.name, file, line=case.line, column=fault.place.column)
        return
    valid = set(compiled.query(facts, unknown="any").assets)
    if not case.expected.strip() or case.expected.strip() == "-":
        return
    missing, extra = wanted - valid, (valid - wanted if is_exact else valid & banned)
    parts = [f"{some(sorted(missing))} should be valid and {_is_not(missing, compiled)}"] if missing else []
    parts += [f"{some(sorted(extra))} should not be valid and is"] if extra else []
    if parts:
        message = f"the case {in_quotes(case.name)} fails: {'; '.join(parts)}."
        yield Finding("case-failed", "error", message, compiled.name, file, line=case.line, column=EXPECTED)


def _is_not(missing: set[str], compiled: CompiledTable) -> str:
    """ "is not", or with a name that the table does not have, the nearest that it has."""
    known = set(compiled.assets)
    strange = next((asset for asset in sorted(missing) if asset not in known), None)
    if strange is None:
        return "is not"
    near = nearest(strange, known)
    hint = f"; did you mean {in_quotes(near)}?" if near else ""
    return f"is not: the table has no asset {in_quotes(strange)}{hint}"


def _expected(text: str) -> tuple[set[str], set[str], bool]:
    """Assets that must be valid, assets that must not, and whether the first are all."""
    body = text.strip()
    if body == NONE:
        return set(), set(), True
    if body[:1] in ("+", "-"):
        accepts = parse_cell(body, TAGS).accepts
        if isinstance(accepts, TagSet) and not accepts.is_complement:
            return set(accepts.needs), set(accepts.bans), False
        return set(), set(), False
    accepts = parse_cell(body, TEXT).accepts
    if isinstance(accepts, ValueSet) and accepts.is_complement:
        place = Place(column=EXPECTED)
        raise ContextError(
            Fault(f"{in_quotes(body)} names no assets.", 'assets with spaces between, "+walk -run", "(none)"', place=place)
        )
    return {str(v) for v in accepts.values} if isinstance(accepts, ValueSet) else set(), set(), True
