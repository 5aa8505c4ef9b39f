"""What two boxes of cells have in common."""

from __future__ import annotations

from collections.abc import Mapping

from contextdb.cells.conditions import Condition
from contextdb.cells.grammar import format_cell, parse_cell
from contextdb.cells.plain_ends import cuts_of, plain
from contextdb.cells.sets import Cell, meet_in_a_cell


def meet(one: Mapping[str, str], other: Mapping[str, str], conditions: Mapping[str, Condition]) -> dict[str, str] | None:
    """A box that holds what both hold, as cells; None where that is nothing. Cells are not soft."""
    found: dict[str, str] = {}
    for name in (name for name in conditions if name in one or name in other):
        if not (name in one and name in other):
            found[name] = one[name] if name in one else other[name]  # as somebody wrote it
            continue
        domain = conditions[name].domain
        mine, yours = (parse_cell(box[name], domain).accepts for box in (one, other))
        both = mine if yours is None else yours if mine is None else meet_in_a_cell(mine, yours)
        if both is not None and both.is_empty:
            return None
        found[name] = format_cell(Cell(both and plain(both, cuts_of(mine, yours))), domain)
    return found
