"""Many contexts with actors: one answer for each."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, cast

import numpy as np

from contextdb.bitmask import Rows, Words, read_only
from contextdb.cells.facts import Unknown, check_mode
from contextdb.compiled.batch import Answers
from contextdb.compiled.batch_columns import Contexts, common_length, facts_of
from contextdb.compiled.casting.facts import Actors, Ask, Prefer
from contextdb.compiled.casting.stage import CastMatches, query_with_actors
from contextdb.compiled.data import CompiledData
from contextdb.compiled.unchanging import Unchanging
from contextdb.errors import ContextError, Fault, Place, plural


@dataclass(frozen=True, eq=False)
class ManyCastMatches(Unchanging, Answers[CastMatches]):
    """The answers for N contexts with actors, as `ManyMatches` tells them, and each with its castings: `many[i].casting(row)`."""

    compiled: CompiledData
    answers: Sequence[CastMatches]

    @cached_property
    def mirrored(self) -> ManyCastMatches:
        """The answers with the facts of contexts and actors as a mirror shows them; see `Matches.mirrored`."""
        return ManyCastMatches(self.compiled, tuple(cast("CastMatches", m.mirrored) for m in self.answers))

    @cached_property
    def counts(self) -> Rows:
        """How many rows are valid in each context: int64 [N]."""
        return read_only(np.array([len(m) for m in self.answers], np.int64))

    @cached_property
    def hits(self) -> Rows:
        """In how many contexts each row is valid: int64 [n_rows]."""
        hits = np.zeros(self.compiled.n_rows, np.int64)
        for matches in self.answers:
            hits[matches.indices] += 1
        return read_only(hits)

    @cached_property
    def mask(self) -> Words:
        """The rows of each context as bits: uint64 [N, W]."""
        masks = np.array([m.mask for m in self.answers], np.uint64)
        return read_only(masks.reshape(len(self.answers), len(self.compiled.enabled)))

    def lists(self) -> list[Rows]:
        """The row numbers of each context: a list of int64 arrays."""
        return [m.indices for m in self.answers]

    def __len__(self) -> int:
        return len(self.answers)

    def _answer(self, context: int) -> CastMatches:
        return self.answers[context]

    def __iter__(self) -> Iterator[CastMatches]:
        return iter(self.answers)


def query_many_with_actors(
    compiled: CompiledData, contexts: Contexts, actors: Actors | Sequence[Actors], prefer: Prefer, unknown: Unknown
) -> ManyCastMatches:
    """Answer every context with its actors; raises ContextError as `query`, with the number of the context."""
    check_mode(unknown)
    columns = facts_of(contexts)
    each: Sequence[Any] | None = None if isinstance(actors, Mapping) else actors
    if each is not None and (not isinstance(each, Sequence) or isinstance(each, (str, bytes))):
        accepted = "a mapping of roles for all contexts, or a list of one for each"
        raise ContextError(Fault(f"actors are of type {type(actors).__name__}.", accepted))
    n_contexts = common_length(columns) if columns else 1 if each is None else len(each)
    if each is not None and len(each) != n_contexts:
        found = f"there are actors for {plural(len(each), 'context')}, and facts for {n_contexts:,}."
        raise ContextError(Fault(found, "a mapping of roles for all contexts, or one for each"))
    answers = []
    for row in range(n_contexts):
        offered: Any = actors if each is None else each[row]
        try:
            facts = {name: values[row] for name, values in columns.items()}
            answers.append(query_with_actors(compiled, facts, Ask(offered, prefer, unknown)))
        except ContextError as error:
            raise ContextError(*(f.at(Place(row=row, column=f.place.column)) for f in error.faults)) from None
    return ManyCastMatches(compiled, tuple(answers))
