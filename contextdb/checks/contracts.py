"""What a check says of contracts: each is proved, and one that is broken, open, about nothing or unreadable is a finding.

broken-contract      some context breaks it
unreadable-contract  it names a table, a condition or an output that there is not
open-contract        it could be neither proved nor broken
empty-contract       no context is as it says
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

from contextdb.cells.facts import fact_text
from contextdb.cells.words import quoted
from contextdb.covering.contracts import Proof, Witness, prove
from contextdb.covering.progress import Stops, Tell
from contextdb.errors import TableError, in_quotes, mend_for, plural, some
from contextdb.findings import Finding, Level
from contextdb.schema.contracts import header
from contextdb.schema.settings import Schema
from contextdb.schema.toml_lines import Path
from contextdb.tables.table import Table

MOST_ASSETS = 3
"""Valid rows of a counterexample that a message names."""


def proofs_of(table: Table, progress: Tell | None = None, should_stop: Stops | None = None) -> Iterator[Proof]:
    """The contracts of a table, proved one after the other."""
    for contract in table.schema.contracts.values():
        if contract.table == table.name:
            yield prove(contract, table, progress=progress, should_stop=should_stop)


def contract_findings(proofs: Sequence[Proof], tables: Sequence[Table], schema: Schema, lines: Mapping[Path, int]) -> list[Finding]:
    """What is to be said of proved contracts of some tables; `lines` are those of contextdb.toml."""
    findings, faulty = [], {table.name for table in tables if _is_unusable(table)}
    for proof in proofs:
        name = proof.contract.name
        if (verdict := _verdict(proof, proof.contract.table in faulty)) is not None:
            rule, level, sentence = verdict
            message = f"{header(('contracts', name))} {sentence}"
            findings.append(Finding(rule, level, message, None, schema.file, line=lines.get(("contracts", name))))
    return findings


def strayed(schema: Schema, tables: Sequence[str], unread: Sequence[str]) -> Iterator[Proof]:
    """The contracts of tables that there are not, or that could not be read."""
    for contract in schema.contracts.values():
        if contract.table in unread:
            yield Proof(contract, None, 0.0, 1.0, problem="the table cannot be read.")
        elif contract.table not in tables:
            near = mend_for(contract.table, tables)
            mend = f" Did you mean {near}?" if near else ""
            problem = f"there is no table {in_quotes(contract.table)}. Accepted: {some(tables)}.{mend}"
            yield Proof(contract, None, 0.0, 1.0, problem=problem)


def _is_unusable(table: Table) -> bool:
    """Whether the table, or one that it is made of, has faults, which are findings of their own."""
    try:
        table.compile()
    except TableError:
        return True
    return False


def _verdict(proof: Proof, is_faulty: bool) -> tuple[str, Level, str] | None:
    """The rule, the level and the sentence of a contract that does not simply hold; None for one that does."""
    if proof.problem and is_faulty:
        return "open-contract", "warning", f"cannot be proved until the table {in_quotes(proof.contract.table)} can be used."
    if proof.problem:
        return "unreadable-contract", "error", f"cannot be proved: {proof.problem}"
    if proof.holds is None:
        return "open-contract", "warning", f"is neither proved nor broken: {proof.sentence}"
    if proof.is_vacuous:
        of_nothing = f"no context that can happen is as {in_quotes(proof.contract.when or '')}"
        return "empty-contract", "warning", f"says nothing: {of_nothing}."
    if proof.witness is None:
        return None
    why = f" {proof.contract.why.rstrip('.')}." if proof.contract.why else ""
    return "broken-contract", "error", f"is broken: {proof.sentence} {_example(proof.witness)}{why}"


def _example(witness: Witness) -> str:
    """One moment, and who is valid there, in a sentence."""
    facts = " ".join(f"{name}={_written(value)}" for name, value in witness.context.items())
    assets = [in_quotes(asset) for asset in witness.assets[:MOST_ASSETS]]
    more = [f"{len(witness.assets) - MOST_ASSETS} more"] if len(witness.assets) > MOST_ASSETS else []
    verb = "is" if len(witness.assets) == 1 else "are"
    valid = f"{plural(len(witness.assets), 'row')} {verb} valid: {', '.join([*assets, *more])}" if assets else "no row is valid"
    return f"At {facts}, for example, {valid}." if facts else f"Then {valid}."


def _written(value: object) -> str:
    """A fact as `contextdb query` takes it."""
    text = fact_text(value)
    return quoted(text) if isinstance(value, list) and len(value) > 1 else text.lower() if isinstance(value, bool) else text
