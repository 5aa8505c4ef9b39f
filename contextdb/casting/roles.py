"""The roles of a table: their conditions, the rows that constrain them, and the rows whose slots name them."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from functools import reduce
from operator import or_
from typing import TYPE_CHECKING

from contextdb import bitmask

if TYPE_CHECKING:
    from contextdb.columns import TextColumn
    from contextdb.compiled import CompiledTable

_WORDS = re.compile(r'"((?:[^"]|"")*)"|[^\s,;|"]+')


class TableRoles:
    """What a compiled table says of its roles, worked out once. Masks are Python integers, row r as bit r."""

    def __init__(self, compiled: CompiledTable) -> None:
        self.conditions: dict[str, tuple[int, ...]] = {}
        """The roles, and the numbers of the conditions that belong to each."""
        for at, condition in enumerate(compiled.conditions):
            role, dot, fact = condition.name.partition(".")
            if dot and role and fact:
                self.conditions[role] = (*self.conditions.get(role, ()), at)
        everything = (1 << compiled.n_rows) - 1
        self._constrained = [everything & ~compiled.condition_bits(at, None, "never")[0] for at in range(len(compiled.conditions))]
        self.slot_rows: Mapping[str, Mapping[str, int]] = {c.name: _slot_rows(c) for c in compiled.slots or ()}
        """For each column of slots, for each word, the rows that say it."""

    def constrained(self, places: Sequence[int]) -> int:
        """The rows with a cell that is not Any among some conditions; soft cells exclude nothing, and so need nobody."""
        return reduce(or_, (self._constrained[at] for at in places), 0)


def _slot_rows(column: TextColumn) -> dict[str, int]:
    found: dict[str, int] = {}
    for code, text in enumerate(column.texts):
        rows = bitmask.to_int(bitmask.pack(column.codes == code))
        for word in slot_words(text):
            found[word] = found.get(word, 0) | rows
    return found


def slot_words(text: str) -> list[str]:
    """The words of one cell of slots: apart by spaces, commas, semicolons or bars; a name with spaces in double quotes."""
    return [m[1].replace('""', '"') if m[1] is not None else m[0] for m in _WORDS.finditer(text)]
