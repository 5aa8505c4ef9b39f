"""contextdb's own ways of asking, as engines."""

from __future__ import annotations

import random
from collections.abc import Sequence
from typing import Any

import contextdb as cdb
from benchmarks.generator import Contexts, GameTable
from benchmarks.timing import Engine

QUERY = "contextdb query"
CHANGED = 3


def build(table: GameTable) -> cdb.Table:
    """The table as contextdb reads it."""
    return cdb.Table.from_columns(table.cells(), schema=table.schema())


def engines(compiled: cdb.CompiledTable, contexts: Contexts, dicts: list[dict[str, Any]], answers: list[list[int]]) -> list[Engine]:
    """A full dict, and live contexts in which three facts change before each question."""
    query = compiled.query
    numbers = contexts.table.number_names[:CHANGED]
    return [
        Engine(QUERY, lambda context: query(context).indices, dicts, answers),
        _live_engine(compiled, f"contextdb live, the same {CHANGED} numbers change", dicts, [numbers] * len(dicts)),
        _live_engine(compiled, f"contextdb live, any {CHANGED} facts change", dicts, _some_names(dicts)),
    ]


def _some_names(dicts: list[dict[str, Any]]) -> list[list[str]]:
    rng = random.Random(1)
    names = sorted(dicts[0])
    return [rng.sample(names, CHANGED) for _ in dicts]


def _live_engine(compiled: cdb.CompiledTable, name: str, dicts: list[dict[str, Any]], changing: Sequence[Sequence[str]]) -> Engine:
    """A context kept from call to call: call k takes the named facts of context k."""
    live = compiled.live(dicts[0])
    inputs = [tuple((n, context[n]) for n in names) for context, names in zip(dicts, changing, strict=True)]

    def ask(changes: tuple[tuple[str, object], ...]) -> Any:
        (first, a), (second, b), (third, c) = changes
        live[first] = a
        live[second] = b
        live[third] = c
        return live.matches().indices

    facts = dict(dicts[0])
    for changes in inputs:
        facts.update(changes)
        if ask(changes).tolist() != compiled.query(facts).indices.tolist():
            raise AssertionError(f"{name}: a live context answers otherwise than a query of its facts")
    return Engine(name, ask, inputs)
