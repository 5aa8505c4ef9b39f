"""Many contexts with actors: one answer for each."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from contextdb.cells.facts import check_mode
from contextdb.compiled.batch_columns import Contexts, common_length, facts_of
from contextdb.compiled.casting.facts import Ask
from contextdb.compiled.casting.stage import query_with_actors
from contextdb.compiled.data import CompiledData
from contextdb.compiled.many import ListedMatches, one_by_one
from contextdb.errors import ContextError, Fault, plural


def query_many_with_actors(compiled: CompiledData, contexts: Contexts, ask: Ask) -> ListedMatches:
    """Answer every context with its actors: one mapping for all, or a sequence of one for each. Raises ContextError as `query`,
    with the number of the context."""
    check_mode(ask.unknown)
    columns = facts_of(contexts)
    actors: Any = ask.actors
    each: Sequence[Any] | None = None if isinstance(actors, Mapping) else actors
    if each is not None and (not isinstance(each, Sequence) or isinstance(each, (str, bytes))):
        accepted = "a mapping of roles for all contexts, or a list of one for each"
        raise ContextError(Fault(f"actors are of type {type(actors).__name__}.", accepted))
    n_contexts = common_length(columns) if columns else 1 if each is None else len(each)
    if each is not None and len(each) != n_contexts:
        problem = f"there are actors for {plural(len(each), 'context')}, and facts for {n_contexts:,}."
        raise ContextError(Fault(problem, "a mapping of roles for all contexts, or one for each"))

    def answer(context: int, facts: Mapping[str, object]) -> Any:
        return query_with_actors(compiled, facts, Ask(actors if each is None else each[context], ask.prefer, ask.unknown))

    return one_by_one(compiled, columns, n_contexts, answer)
