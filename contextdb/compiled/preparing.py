"""Do for a compiled table, while a game loads, what is otherwise done when it is first asked.

Look-ups and joined masks are made for the arrays that this table has.
"""

from __future__ import annotations

from contextdb.compiled.batch import query_many
from contextdb.compiled.casting.facts import Ask
from contextdb.compiled.casting.roles import roles_of_table
from contextdb.compiled.casting.stage import query_with_actors
from contextdb.compiled.choosing import Choosing
from contextdb.compiled.data import CompiledData
from contextdb.compiled.live import LiveContext
from contextdb.compiled.picker import Picker


def prepare(compiled: CompiledData, casting: bool = False, batches: bool = False) -> None:
    """Make a table ready; see `CompiledTable.prepare`."""
    compiled.query({}, unknown="any")
    LiveContext(compiled, "any").matches()
    Picker(compiled.name, 0, 1)
    _ = compiled.memory
    if compiled.ways is not None:
        _ = compiled.ways.pickable
    _ = compiled.once(Choosing.of)._without_memory
    if casting and compiled.slots is not None:
        nobody = Ask({role: [] for role in roles_of_table(compiled).conditions}, None, "any")
        query_with_actors(compiled, {}, nobody)
    if batches:
        _prepare_batches(compiled)


def _prepare_batches(compiled: CompiledData) -> None:
    name = next(iter(compiled.asked), None)
    many = query_many(compiled, {} if name is None else {name: [None]}, "any")
    _ = many.counts, many.mask
