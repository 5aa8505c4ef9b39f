"""What is wrong with the contracts of a contextdb.toml: each fault with the path of the key it is about."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace

from contextdb.cells.conditions import Condition
from contextdb.cells.outputs import Output
from contextdb.errors import Fault
from contextdb.schema.contracts import VERBS, limit_of, row_conditions
from contextdb.schema.parts import Part, fitting_of, header, parts_of
from contextdb.schema.toml_lines import Path


def contract_faults(path: Path, part: Part) -> Iterator[tuple[Path, Fault]]:
    """What is wrong with how the keys of a contract go together."""
    if "table" not in part:
        yield path, Fault(f"{header(path)} has no table.", 'table = "NAME"')
    given = [verb for verb in VERBS if verb in part]
    if len(given) != 1:
        problem = f"has {' and '.join(given)}" if given else "demands nothing"
        accepted = "exactly one of some, every, none, at_most and winner"
        yield (*path, given[1]) if given else path, Fault(f"{header(path)} {problem}.", accepted)


def contract_expression_faults(
    document: Part, conditions: Mapping[str, Condition], outputs: Mapping[str, Mapping[str, Output]]
) -> Iterator[tuple[Path, Fault]]:
    """What is wrong with the expressions of contracts; `outputs` are those of each declared table. Names that only the table can
    know are left for when it is read."""
    for name in parts_of(document, "contracts"):
        path, fitting = ("contracts", name), fitting_of("contracts", parts_of(document, "contracts")[name])
        if "when" in fitting:
            yield from _faults(path, "when", fitting["when"], conditions, False)
        rows = row_conditions(outputs.get(fitting.get("table", ""), {}))
        for verb in VERBS:
            kind = limit_of(fitting[verb])[1] if verb == "at_most" and verb in fitting else fitting.get(verb)
            if isinstance(kind, str):
                yield from _faults(path, verb, kind, rows, fitting.get("table") in outputs)


def _faults(path: Path, key: str, text: str, conditions: Mapping[str, Condition], knows_all: bool) -> Iterator[tuple[Path, Fault]]:
    from contextdb.expressions import assumption_faults

    for fault in assumption_faults([text], conditions):
        if knows_all or fault.rule != "unknown-fact":
            yield (*path, key), replace(fault, found=f"{header(path)} {key} {fault.found}", rule="unreadable")
