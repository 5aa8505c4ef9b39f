"""Show which assets are valid for one context.

Exits with 1 if none is.

  contextdb query locomotion gait=Walk speed=1.3 direction=0 style=normal
  contextdb query tables/locomotion.csv --unknown any "direction=0 ± 90" --explain
  contextdb query contested_catch MidAir_Catch_Direction=Top "Defender[0].DepthChart=CB" "Defender[1].DepthChart=FS" --unknown any
"""

from __future__ import annotations

import argparse
import math
import re
import sys
from collections.abc import Iterator

from contextdb import bitmask
from contextdb.cells.conditions import Condition
from contextdb.cells.facts import UNKNOWN_MODES, Fact, no_condition, read_fact_text
from contextdb.cells.output_types import OutputValue
from contextdb.commands import answer, missing_facts_by_option
from contextdb.commands.numbers import whole_type
from contextdb.compiled.explain import Explanation, RowExplanation, describe_fact
from contextdb.compiled.pick import Outcome
from contextdb.compiled.table import CompiledTable, data_of
from contextdb.console import ExitCode, aligned, printable, styled, terminal_width, wants_colour, width_of
from contextdb.errors import ContextError, Fault, in_quotes, plural
from contextdb.tables.places import open_compiled

ACTOR_FACT = re.compile(r"([^=]+?)\[([0-9]{1,6})\]\.([^=]+)=(.*)", re.DOTALL)
"""Role[number].fact=value."""

N_NEAREST = 3
N_EXPLAINED = 10


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("table", metavar="TABLE", help="a .csv, .parquet or .safetensors file, or the name of a table")
    parser.add_argument(
        "facts", metavar="FACT=VALUE", nargs="*", default=[], help="a value, or a set of values written like a cell: speed=3..5"
    )
    parser.add_argument("--unknown", choices=UNKNOWN_MODES, default="error", help="how to treat a missing fact (default: error)")
    parser.add_argument(
        "--explain", action="store_true", help="show the nearest rows that are not valid, their failing cells, and what to change"
    )
    help_text = f"how many rows to explain (default: {N_EXPLAINED})"
    parser.add_argument(
        "--most", type=whole_type("a number of rows, such as 10."), default=N_EXPLAINED, metavar="N", help=help_text
    )
    parser.add_argument(
        "--prefer", metavar="FACT", help="cast the actors with the lowest FACT first; -FACT, as in --prefer=-speed: the highest"
    )
    parser.add_argument("--json", action="store_true", help="a JSON document instead of text")


def run(arguments: argparse.Namespace) -> ExitCode:
    compiled = open_compiled(arguments.table)
    plain, actors = read_actors(arguments.facts, compiled)
    if arguments.prefer is not None and actors is None:
        raise ContextError(Fault("there are no actors to choose from.", 'facts of actors, such as "Defender[0].distance=2"'))
    context = read_facts(plain, compiled)
    with missing_facts_by_option():
        explanation = compiled.explain(context, unknown=arguments.unknown, actors=actors, prefer=arguments.prefer)
    about = (compiled, explanation, arguments.explain, arguments.most)
    answer(arguments, lambda: _document(*about), lambda: _lines(*about))
    return ExitCode.OK if explanation.matches else ExitCode.FOUND


def read_facts(given: list[str], compiled: CompiledTable) -> dict[str, Fact]:
    """FACT=VALUE arguments as facts in canonical form. Raises ContextError for every argument that is not a fact of the table,
    together."""
    facts: dict[str, Fact] = {}
    faults: list[Fault] = []
    for text in given:
        try:
            name, value = _split(text, compiled)
            if name in facts:
                raise ContextError(Fault(f"the fact {in_quotes(name)} is given twice.", "each fact once"))
            facts[name] = read_fact_text(value, compiled.asked[name])
        except ContextError as error:
            faults += error.faults
    if faults:
        raise ContextError(*faults)
    return facts


def read_actors(given: list[str], compiled: CompiledTable) -> tuple[list[str], dict[str, list[dict[str, object]]] | None]:
    """The arguments that are not facts of actors, and the actors of those that are, in the order of their numbers; None without.
    Raises ContextError for every fact that an actor cannot have or has twice, together."""
    plain: list[str] = []
    actors: dict[str, dict[int, dict[str, object]]] = {}
    faults: list[Fault] = []
    for text in given:
        match = ACTOR_FACT.match(text)
        if match is None or any(text.startswith(f"{name}=") for name in compiled.asked):
            plain.append(text)
            continue
        role, number, name, value = match.groups()
        actor = actors.setdefault(role, {}).setdefault(int(number), {})
        try:
            if name in actor:
                raise ContextError(Fault(f"the fact {in_quotes(f'{role}[{number}].{name}')} is given twice.", "each fact once"))
            condition = compiled.asked.get(f"{role}.{name}")
            actor[name] = _free_value(value) if condition is None else read_fact_text(value, condition)
        except ContextError as error:
            faults += error.faults
    if faults:
        raise ContextError(*faults)
    return plain, {role: [by[n] for n in sorted(by)] for role, by in actors.items()} or None


def _free_value(text: str) -> object:
    """A fact of an actor that is not a condition, such as an id or a distance: a number where it reads as one."""
    try:
        return float(text)
    except ValueError:
        return text


def _split(text: str, compiled: CompiledTable) -> tuple[str, str]:
    """Name and value of FACT=VALUE; a name may hold a "=" itself."""
    ends = [at for at, character in enumerate(text) if character == "="]
    for at in reversed(ends):
        if text[:at] in compiled.asked:
            return text[:at], text[at + 1 :]
    if (derivation := data_of(compiled).derivation) is not None:
        derivation.refuse(text[:at] for at in ends)
    if ends:
        raise no_condition(text[: ends[0]], compiled.asked)
    raise ContextError(Fault(f"{in_quotes(text)} is not a fact.", "FACT=VALUE, without spaces round the =", in_quotes(f"{text}=…")))


def _document(compiled: CompiledTable, explanation: Explanation, explains: bool, most: int) -> dict[str, object]:
    matches = explanation.matches
    always = set(bitmask.rows(matches.always).tolist())
    context = {n: _json_fact(f, n, compiled) for n, f in explanation.facts.items() if f is not None}
    outcome, undecided = Outcome(data_of(compiled), matches), explanation.undecided
    rows: list[dict[str, object]] = []
    for r in matches.rows.tolist():
        rows.append({"row": r, "asset": compiled.assets[r], "always": r in always})
        rows[-1] |= {"outputs": _json_outputs(compiled, r)} if len(compiled.outputs) else {}
        rows[-1] |= {"undecided": True} if undecided >> r & 1 else {}
        if outcome.prefers_some:
            rows[-1] |= (
                {"chance": outcome.chances[r]} if r in outcome.chances else {"chance": 0.0, "not_picked": outcome.why_not(r)}
            )
        if (roles := explanation.roles(r)) is not None:
            rows[-1]["casting"] = roles
    document: dict[str, object] = {"table": compiled.name, "context": context, "count": len(matches), "matches": rows}
    if explains:
        document["explain"] = [_explained(r) for r in explanation.nearest(most)]
    return document


def _json_outputs(compiled: CompiledTable, row: int) -> dict[str, object]:
    """The outputs of a row as JSON has them: NaN as null, an infinite number as text, several numbers as a list."""
    return {name: _json_value(value) for name, value in compiled.outputs.of_row(row).items()}


def _json_value(value: OutputValue) -> object:
    if isinstance(value, tuple):
        return [_json_value(number) for number in value]
    if not isinstance(value, float) or math.isfinite(value):
        return value
    return None if math.isnan(value) else str(value)


def _json_fact(fact: Fact, name: str, compiled: CompiledTable) -> object:
    """A fact as JSON has it: tags as a list, a set of values and an infinite number as text."""
    if isinstance(fact, frozenset):
        return sorted(fact)
    is_plain = isinstance(fact, (bool, str)) or (isinstance(fact, float) and math.isfinite(fact))
    return fact if is_plain else describe_fact(fact, _condition(name, compiled))


def _condition(name: str, compiled: CompiledTable) -> Condition:
    return next(c for c in (*compiled.conditions, *data_of(compiled).ruled) if c.name == name)


def _explained(row: RowExplanation) -> dict[str, object]:
    failures = [
        {"condition": f.condition, "cell": f.cell, "fact": f.fact, "change_to": f.mend} | ({"in": str(f.step)} if f.step else {})
        for f in row.failures
    ]
    return {"row": row.row, "asset": row.asset, "enabled": row.is_enabled, "failures": failures}


def _lines(compiled: CompiledTable, explanation: Explanation, explains: bool, most: int) -> Iterator[str]:
    colour = wants_colour(sys.stdout)
    matches = explanation.matches
    summary = f"{len(matches):,} of {plural(compiled.n_rows, 'row')} valid in {printable(compiled.name)}"
    yield styled(summary, "green" if matches else "yellow", colour)
    if matches:
        yield ""
        yield from aligned(list(_matching(compiled, explanation)), right=(0,))
    nearest = explanation.nearest(most if explains else 0 if matches else N_NEAREST)
    if nearest:
        yield ""
        yield styled("nearest rows that are not valid, and the cells to change", "bold", colour)
        yield ""
        yield from _nearest_lines(nearest, terminal_width())


def _matching(compiled: CompiledTable, explanation: Explanation) -> Iterator[tuple[str, ...]]:
    """The valid rows; where some only may be valid, with a word for that, and where the policy prefers some, how it does."""
    matches, undecided = explanation.matches, explanation.undecided
    outcome = Outcome(data_of(compiled), matches)
    prefers_some = outcome.prefers_some  # looks at every valid row
    casts = {r: roles for r in matches.rows.tolist() if (roles := explanation.roles(r)) is not None}
    columns = {"row": True, "matches": undecided, "asset": True, "cast": casts, "pick": prefers_some}
    yield tuple(column for column, is_there in columns.items() if is_there)
    for r in matches.rows.tolist():
        line = [str(r + 1), *(["may" if undecided >> r & 1 else "always"] if undecided else []), compiled.assets[r]]
        line += [", ".join(f"{role}: {label}" for role, label in casts[r].items())] if casts else []
        line += [outcome.said_of([r])] if prefers_some else []
        yield tuple(line)


def _nearest_lines(rows: list[RowExplanation], width: int) -> Iterator[str]:
    """The failing cells of some rows: a table where the terminal is wide enough for it, else a few lines a row."""
    header = ("row", "asset", "condition", "fact", "cell", "change to")
    has_steps = any(f.step for row in rows for f in row.failures)
    table = list(aligned([(*header, "in") if has_steps else header, *_failures(rows, has_steps)], right=(0,)))
    if max(map(width_of, table)) <= width:
        yield from table
        return
    digits = max(len(str(row.row + 1)) for row in rows)
    for row in rows:
        yield printable(f"{row.row + 1:>{digits}}  {row.asset}")
        for f in row.failures:
            yield printable(f"{' ' * digits}  {f.condition} is {f.fact}")
            where = f" in {f.step}" if f.step else ""
            yield printable(f'{" " * digits}    change "{f.cell}" to "{f.mend}"{where}')
        if not row.is_enabled:
            yield f"{' ' * digits}  the row is disabled"


def _failures(rows: list[RowExplanation], has_steps: bool) -> Iterator[tuple[str, ...]]:
    for row in rows:
        failures = [(f.condition, f.fact, f.cell, f.mend, str(f.step or "")) for f in row.failures]
        if not row.is_enabled:
            failures.append(("(the row is disabled)", "", "", "", ""))
        for i, failure in enumerate(failures):
            yield (*((str(row.row + 1), row.asset) if i == 0 else ("", "")), *failure[: 5 if has_steps else 4])
