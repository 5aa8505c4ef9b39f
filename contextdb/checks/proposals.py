"""Contracts that hold of a table today and are likely meant: what `contextdb check --propose` lists."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

from contextdb.covering.contracts import Proof, prove
from contextdb.expressions.tokens import written_name, written_text
from contextdb.files.toml_text import as_toml
from contextdb.schema.contracts import Contract
from contextdb.schema.parts import header, keys_of
from contextdb.tables.table import Table

ANY_ROW = "asset like '*'"
MOST_VALUES = 20
"""Of an enum with more values none is proposed for each."""


def proposals(table: Table) -> Iterator[Proof]:
    """Contracts of a table that hold and that contextdb.toml does not have: some row always plays, so that a fallback is never
    reached; else one plays for each value of an enum; and never two are valid at once."""
    known = {replace(contract, name="", why="") for contract in table.schema.contracts.values()}
    always = prove(_contract(table, "always_a_row", some=ANY_ROW), table)
    held = [always] if _is_meant(always) else [p for c in _of_values(table) if _is_meant(p := prove(c, table))]
    single = prove(_contract(table, "one_at_a_time", at_most=1), table)
    held += [single] if table.n_rows > 1 and _is_meant(single) else []
    yield from (proof for proof in held if replace(proof.contract, name="", why="") not in known)


def proposal_toml(contract: Contract) -> str:
    """A contract as contextdb.toml has it."""
    keys = ((key, getattr(contract, key)) for key in keys_of("contracts"))
    given = ((key, value[0] if key == "at_most" and value else value) for key, value in keys)
    lines = [f"{key} = {as_toml(value)}" for key, value in given if value not in (None, "")]
    return "\n".join([header(("contracts", contract.name)), *lines, ""])


def _contract(table: Table, name: str, when: str | None = None, **demand: object) -> Contract:
    return Contract(f"{table.name}_{name}", table=table.name, when=when, **demand)  # type: ignore[arg-type]


def _of_values(table: Table) -> Iterator[Contract]:
    """That some row plays for each value of an enum."""
    for column in table.conditions:
        condition = column.condition
        values = condition.domain.values if condition.domain.type.needs_values else None
        for value in values if values is not None and len(values) <= MOST_VALUES else ():
            text = written_text(value) if "'" in value else f"'{value}'"
            when = f"{written_name(condition.name)} == {text}"
            yield _contract(table, f"{condition.name}_{value}_has_a_row", when, some=ANY_ROW)


def _is_meant(proof: Proof) -> bool:
    return proof.holds is True and not proof.is_vacuous
