"""Two checkouts of contextdb in one process, asked in turns: how many times as long this one takes.

Both read the same table and must give the same rows. In each round both answer the same contexts, which a first pass has brought
into the caches, and the one that begins changes from round to round; a time is the best round.
"""

from __future__ import annotations

import importlib
import sys
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from types import ModuleType
from typing import Any

from benchmarks import ours
from benchmarks.generator import SHAPES, GameTable, Shape, make_contexts, make_table
from benchmarks.timing import Effort, no_collection

N_CONTEXTS = 2000
OF_A_ROUND = 100
ROUNDS = 40
"""Rounds for each of the usual ones, in which whole engines take turns: these are short."""

Ask = Callable[[Any], Any]


def load(checkout: Path) -> ModuleType:
    """The contextdb of another checkout; its modules stay its own when ours are imported again."""
    own = {name: sys.modules.pop(name) for name in list(sys.modules) if name.partition(".")[0] == "contextdb"}
    sys.path.insert(0, str(checkout))
    try:
        other = importlib.import_module("contextdb")
        _ = other.Table, other.CompiledTable
    finally:
        sys.path.remove(str(checkout))
        for name in [name for name in sys.modules if name.partition(".")[0] == "contextdb"]:
            del sys.modules[name]
        sys.modules.update(own)
    if not Path(str(other.__file__)).is_relative_to(checkout.resolve()):
        raise SystemExit(f"{checkout}: no checkout of contextdb.")
    return other


def measure(checkout: Path, effort: Effort) -> dict[str, Any]:
    """The ways of `query.py`'s single queries, here and there, for every shape."""
    other = load(checkout)
    return {shape.name: _measured(shape, other, effort) for shape in SHAPES}


def _measured(shape: Shape, other: ModuleType, effort: Effort) -> dict[str, Any]:
    table = make_table(shape)
    contexts = make_contexts(table, N_CONTEXTS)
    dicts, answers = contexts.dicts(), contexts.answers()
    here = ours.engines(ours.build(table).compile(), contexts, dicts, answers)
    there = ours.engines(_built(table, other), contexts, dicts, answers)
    print(f"\n{shape.name}: microseconds, the best round; here / there\n  {'':44}{'there':>8}{'here':>8}{'ratio':>8}")
    found = {}
    for one, two in zip(here, there, strict=True):
        best = _best(one.name, one.inputs, one.ask, two.ask, effort)
        found[one.name] = {"here_us": best[0], "there_us": best[1], "ratio": best[0] / best[1]}
        print(f"  {one.name:44}{best[1]:8.2f}{best[0]:8.2f}{best[0] / best[1]:8.2f}")
    return found


def _built(table: GameTable, other: ModuleType) -> Any:
    return other.Table.from_columns(table.cells(), schema=table.schema()).compile()


def _best(name: str, inputs: Sequence[Any], here: Ask, there: Ask, effort: Effort) -> tuple[float, float]:
    """Microseconds of a call in the best round, here and there; a live context is at the same facts in both."""
    best = {here: float("inf"), there: float("inf")}
    asks = [here, there]
    with no_collection():
        for i in range(ROUNDS * effort.rounds):
            at = i * OF_A_ROUND % len(inputs)
            part = inputs[at : at + OF_A_ROUND]
            for each in part:
                if here(each).tolist() != there(each).tolist():
                    raise AssertionError(f"{name}: the two checkouts answer differently")
            asks.reverse()
            for ask in asks:
                start = time.perf_counter_ns()
                for each in part:
                    ask(each)
                best[ask] = min(best[ask], (time.perf_counter_ns() - start) / 1e3 / len(part))
    return best[here], best[there]
