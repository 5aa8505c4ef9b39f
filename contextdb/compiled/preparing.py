"""Do for a compiled table, while a game loads, what is otherwise done when it is first asked.

Look-ups are made, and kernels are compiled, or read from numba's cache, for the arrays that this table has.
"""

from __future__ import annotations

from contextdb.compiled.batch import load_kernels, query_codes, query_many
from contextdb.compiled.casting.facts import Ask
from contextdb.compiled.casting.roles import roles_of_table
from contextdb.compiled.casting.stage import query_with_actors
from contextdb.compiled.choosing import Choosing
from contextdb.compiled.data import CompiledData
from contextdb.compiled.live_asking import live_context


def prepare(compiled: CompiledData, casting: bool = False, batches: bool = False) -> None:
    """Make a table ready; see `CompiledTable.prepare`."""
    compiled.query({}, unknown="any")
    live_context(compiled, "any").matches()
    _ = compiled.memory
    if compiled.ways is not None:
        _ = compiled.ways.pickable
    _ = compiled.once(Choosing.of).plain
    if casting and compiled.slots is not None:
        nobody = Ask({role: [] for role in roles_of_table(compiled).conditions}, None, "any")
        query_with_actors(compiled, {}, nobody)
    if batches:
        _prepare_batches(compiled)


def _prepare_batches(compiled: CompiledData) -> None:
    load_kernels()
    name = next(iter(compiled.asked), None)
    many = query_many(compiled, {} if name is None else {name: [None]}, "any")
    _ = many.counts, many.mask
    if compiled.when is None:
        query_codes(compiled, compiled.encode({}, unknown="any"))
