"""The candidates of a decision, worked out when they are first requested: what a recorder keeps costs next to nothing.

With the databases that were searched, the query and the filters the costs are to the last bit those of the search.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from functools import cached_property
from typing import overload

from contextdb.motion.clips.quaternions import Floats
from contextdb.motion.search import candidates
from contextdb.motion.search.candidates import Candidates
from contextdb.motion.search.database import MotionDatabase
from contextdb.motion.search.filters import Filter
from contextdb.motion.selection.choice import Choice

Named = tuple[str, Candidates]


class WorkedOut(Sequence[Named]):
    """For each database that was searched, as the choice says, its name and its k candidates: the best frames, and those left out
    that cost as little. `query` float64 [F]; the filters are by the names of databases."""

    def __init__(
        self,
        databases: Mapping[str, MotionDatabase],
        query: Floats,
        filters: Sequence[tuple[str, Filter]],
        choice: Choice,
        k: int,
    ) -> None:
        self.databases, self._query, self._choice, self._k = databases, query, choice, k
        self._filters = filters

    @cached_property
    def _pairs(self) -> tuple[Named, ...]:
        searched = ((name, self.databases[name], chosen) for name, chosen in of_searched(self._filters, self._choice))
        return tuple(
            (name, candidates.with_left_out(each, each.normalised(self._query), chosen, self._k)) for name, each, chosen in searched
        )

    @overload
    def __getitem__(self, index: int) -> Named: ...
    @overload
    def __getitem__(self, index: slice) -> tuple[Named, ...]: ...
    def __getitem__(self, index: int | slice) -> Named | tuple[Named, ...]:
        return self._pairs[index]

    def __len__(self) -> int:
        return len(of_searched(self._filters, self._choice))

    def __iter__(self) -> Iterator[Named]:
        return iter(self._pairs)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Sequence) and self._pairs == tuple(other)

    __hash__ = None  # type: ignore[assignment]

    def __repr__(self) -> str:
        return repr(self._pairs)


def of_searched(filters: Sequence[tuple[str, Filter]], choice: Choice) -> list[tuple[str, Filter]]:
    """Those filters whose database a choice searched."""
    searched = {search.database for search in choice.searches if search.hit is not None}
    return [(name, chosen) for name, chosen in filters if name in searched]
