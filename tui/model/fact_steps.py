"""The steps of the test row: each change of its facts can be taken back, apart from the steps of the table."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

from .query_row import QueryRow
from .table_answer import Offered


@dataclass(frozen=True, slots=True)
class _State:
    """What is queried: the facts that are not empty, and who is offered."""

    texts: Mapping[str, str]
    actors: Offered

    @classmethod
    def of(cls, query: QueryRow) -> _State:
        return cls({name: text for name, text in query.texts.items() if text.strip()}, dict(query.actors))


class FactSteps:
    """The states that the test row had before the present one, and those that were taken back."""

    def __init__(self) -> None:
        self._before: list[tuple[str, _State]] = []
        self._after: list[tuple[str, _State]] = []

    def do(self, query: QueryRow, name: str, change: Callable[[], object]) -> None:
        """Make a change; one that changes nothing is no step."""
        before = _State.of(query)
        change()
        if _State.of(query) != before:
            self._before.append((name, before))
            self._after.clear()

    def undo(self, query: QueryRow) -> str | None:
        """Take back the last change; gives its name, None where there is none."""
        return _step(query, self._before, self._after)

    def redo(self, query: QueryRow) -> str | None:
        """Make the change again that was taken back last; gives its name, None where there is none."""
        return _step(query, self._after, self._before)


def _step(query: QueryRow, source: list[tuple[str, _State]], target: list[tuple[str, _State]]) -> str | None:
    if not source:
        return None
    name, state = source.pop()
    target.append((name, _State.of(query)))
    query.offer(state.actors)
    query.load(state.texts)
    return name
