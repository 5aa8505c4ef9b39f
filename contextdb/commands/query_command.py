"""Which assets are valid for one context. Exits with 1 when none is.

contextdb query tables/hit_mid_air.csv IsInMidAirAnim=False speed=3.5
contextdb query hit_mid_air --unknown any "heading=0 ± 90" --explain
"""

from __future__ import annotations

import argparse
import json
import sys

from contextdb.compiled import CompiledTable
from contextdb.console import aligned, styled, wants_colour
from contextdb.errors import ContextError, Fault, plural
from contextdb.exit_codes import ExitCode
from contextdb.explain import Explanation, RowExplanation, describe_fact
from contextdb.facts import UNKNOWN_MODES, Fact, no_condition, read_fact_text
from contextdb.places import open_compiled

N_NEAREST = 3
N_EXPLAINED = 10


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """The arguments of the command."""
    parser.add_argument("table", metavar="TABLE", help="a .csv, .parquet or .safetensors file, or the name of a table")
    parser.add_argument("facts", metavar="FACT=VALUE", nargs="*", help="a value, or a set of values written as a cell: speed=3..5")
    parser.add_argument("--unknown", choices=UNKNOWN_MODES, default="error", help="what a missing fact does (default: error)")
    parser.add_argument(
        "--explain", action="store_true", help="for the rows nearest to valid, the cells that fail and what to change"
    )
    parser.add_argument("--most", type=int, metavar="N", help=f"explain so many rows (default: {N_EXPLAINED})")
    parser.add_argument("--json", action="store_true", help="a JSON document instead of text")


def run(arguments: argparse.Namespace) -> ExitCode:
    """Answer one context."""
    compiled = open_compiled(arguments.table)
    context = read_facts(arguments.facts, compiled)
    explanation = compiled.explain(context, arguments.unknown)
    most = arguments.most if arguments.most is not None else N_EXPLAINED
    if arguments.json:
        print(json.dumps(_document(compiled, explanation, arguments.explain, most), ensure_ascii=False, indent=2))
    else:
        _print(compiled, explanation, arguments.explain, most)
    return ExitCode.OK if explanation.matches else ExitCode.FOUND


def read_facts(given: list[str], compiled: CompiledTable) -> dict[str, Fact]:
    """FACT=VALUE arguments as facts in canonical form.

    Raises
    ------
    ContextError
        For every argument that is no fact of the table, together.
    """
    conditions = {c.name: c for c in compiled.conditions}
    facts: dict[str, Fact] = {}
    faults: list[Fault] = []
    for text in given:
        name, equals, value = text.partition("=")
        try:
            if not equals:
                raise ContextError(Fault(f'"{text}" is no fact.', "FACT=VALUE, without spaces round the =", f'"{text}=…"'))
            if name not in conditions:
                raise no_condition(name, conditions)
            if name in facts:
                raise ContextError(Fault(f'the fact "{name}" is given twice.', "each fact once"))
            facts[name] = read_fact_text(value, conditions[name])
        except ContextError as error:
            faults += error.faults
    if faults:
        raise ContextError(*faults)
    return facts


def _document(compiled: CompiledTable, explanation: Explanation, explains: bool, most: int) -> dict[str, object]:
    matches = explanation.matches
    always = set(explanation.always_rows())
    conditions = {c.name: c for c in compiled.conditions}
    context = {
        n: describe_fact(f, conditions[n]) if not isinstance(f, (bool, float, str)) else f
        for n, f in explanation.facts.items()
        if f is not None
    }
    rows = [{"row": r, "asset": compiled.assets[r], "always": r in always} for r in matches]
    document: dict[str, object] = {"format": 1, "table": compiled.name, "context": context, "count": len(matches), "matches": rows}
    if explains:
        document["explain"] = [_explained(r) for r in explanation.nearest(most)]
    return document


def _explained(row: RowExplanation) -> dict[str, object]:
    failures = [{"condition": f.condition, "cell": f.cell, "fact": f.fact, "change_to": f.mend} for f in row.failures]
    return {"row": row.row, "asset": row.asset, "enabled": row.is_enabled, "failures": failures}


def _print(compiled: CompiledTable, explanation: Explanation, explains: bool, most: int) -> None:
    colour = wants_colour(sys.stdout)
    matches = explanation.matches
    said = f"{len(matches)} of {plural(compiled.n_rows, 'row')} valid in {compiled.name}"
    print(styled(said, "green" if matches else "yellow", colour))
    if matches:
        print()
        print(*aligned([("row", "asset"), *((str(r), compiled.assets[r]) for r in matches)], right=(0,)), sep="\n")
    nearest = explanation.nearest(most if explains else 0 if matches else N_NEAREST)
    if nearest:
        print()
        print(styled("nearest rows that are not valid, and the cells to change", "bold", colour))
        print()
        print(
            *aligned([("row", "asset", "condition", "fact", "cell", "change to"), *_failure_lines(nearest)], right=(0,)), sep="\n"
        )


def _failure_lines(rows: list[RowExplanation]) -> list[tuple[str, ...]]:
    lines: list[tuple[str, ...]] = []
    for row in rows:
        failures = [(f.condition, f.fact, f.cell, f.mend) for f in row.failures]
        if not row.is_enabled:
            failures.append(("(the row is disabled)", "", "", ""))
        for i, failure in enumerate(failures):
            lines.append((*((str(row.row), row.asset) if i == 0 else ("", "")), *failure))
    return lines
