"""Do for a compiled table, while a game loads, what is otherwise done when it is first asked.

Modules are loaded, look-ups are made, and kernels are compiled, or read from numba's cache, for the arrays that this table has.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from contextdb.compiled.table import CompiledTable


def prepare(compiled: CompiledTable, casting: bool = False, batches: bool = False) -> None:
    """Make a table ready; see `CompiledTable.prepare`."""
    import contextdb.compiled.pick  # noqa: F401

    compiled.query({}, unknown="any")
    compiled.live(unknown="any").matches()
    _ = compiled.memory
    if compiled.ways is not None:
        _ = compiled.ways.pickable
    if casting and compiled.slots is not None:
        _prepare_casting(compiled)
    if batches:
        _prepare_batches(compiled)


def _prepare_casting(compiled: CompiledTable) -> None:
    import contextdb.compiled.casting.live
    import contextdb.compiled.casting.many  # noqa: F401

    nobody: dict[str, list[dict[str, object]]] = {role: [] for role in compiled.roles.conditions}
    compiled.query({}, "any", nobody)


def _prepare_batches(compiled: CompiledTable) -> None:
    from contextdb.compiled.batch import load_kernels

    load_kernels()
    name = next(iter(compiled.asked), None)
    many = compiled.query_many({} if name is None else {name: [None]}, "any")
    _ = many.counts, many.mask
    if compiled.when is None:
        compiled.query_codes(compiled.encode({}, "any"))
