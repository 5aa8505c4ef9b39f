"""A moment inside a box of contexts, as facts that a person may type: what is computed must come out inside the box too."""

from __future__ import annotations

import random
from collections.abc import Iterator, Mapping

from contextdb.cells.conditions import Condition
from contextdb.cells.grammar import parse_cell
from contextdb.cells.sets import Cell
from contextdb.cells.words import format_number
from contextdb.covering.gaps import facts_inside
from contextdb.errors import ContextError, Fault, safe_text
from contextdb.telemetry.recordings import fact_text

from .wanted import Wanted

MOST_TRIED = 4000
"""So many combinations of facts are tried for what is computed from them."""
FAR = 100.0
"""Facts without bounds are looked for so far from 0."""


def moment_inside(cells: Mapping[str, str], wanted: Wanted) -> dict[str, str]:
    """The texts of facts with which every cell of a box holds; facts that nothing restricts are left out. Raises ContextError where
    there are no facts from which what is computed comes out so; CellError where a cell cannot be read."""
    given = facts_inside(cells, list(wanted.given.values()))
    derived = {n: parse_cell(text, wanted.conditions[n].domain) for n, text in cells.items() if n in wanted.computed}
    derived = {name: cell for name, cell in derived.items() if not cell.is_any}
    if not derived or wanted.derivation is None:
        return given
    inputs = wanted.derivation.only(derived).inputs
    known = {c.name: parse_cell(cells[c.name], c.domain) for c in inputs if c.name in cells}
    for texts in _tries(inputs, known, given):
        facts = wanted.read({**given, **texts})[0]
        if all(facts[name] is not None and cell.holds(facts[name]) for name, cell in derived.items()):
            return {**given, **texts}
    named = ", ".join(map(safe_text, derived))
    raise ContextError(Fault(f"no facts were found from which {named} is computed as this says.", "facts typed into the test row"))


def _tries(inputs: tuple[Condition, ...], known: Mapping[str, Cell], given: Mapping[str, str]) -> Iterator[dict[str, str]]:
    """Values for the inputs, inside their own cells: first those available, then drawn ones, the same each time."""
    rng = random.Random(0)
    for n in range(MOST_TRIED):
        is_first = n == 0
        texts = {c.name: given[c.name] if is_first and c.name in given else fact_text(_drawn(c, rng), c) for c in inputs}
        if all(_holds(cell, name, texts, inputs) for name, cell in known.items()):
            yield texts


def _drawn(condition: Condition, rng: random.Random) -> object:
    domain = condition.domain
    if domain.type.is_numeric:
        low, high = (-180.0, 180.0) if domain.type.is_circular else (max(domain.minimum, -FAR), min(domain.maximum, FAR))
        number = rng.uniform(low, high)
        places = rng.choice((0, 0, 1, 3))
        return domain.type.given(round(number)) if domain.type.is_whole else float(format_number(round(number, places)))
    if domain.type.is_truth:
        return rng.random() < 0.5
    values = list(domain.known) or [""]
    return sorted(v for v in map(str, values) if rng.random() < 0.5) if domain.type.is_tags else str(rng.choice(values))


def _holds(cell: Cell, name: str, texts: Mapping[str, str], inputs: tuple[Condition, ...]) -> bool:
    condition = next(c for c in inputs if c.name == name)
    fact = Wanted({name: condition}, None).read(texts)[0][name]
    return fact is not None and cell.holds(fact)
