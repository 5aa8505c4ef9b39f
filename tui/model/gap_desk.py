"""The work on the gaps of the table that is edited: which gap has which state and owner, and changes of these.

An edge: it reads and writes `NAME.gaps.csv`.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from contextdb.errors import ContextDBError
from contextdb.tables.gap_work import MOST_OWNER, STATES, GapWork, Key, Work, write_work
from contextdb.tables.table import Table

from .coverage_lines import cells_text

STEPS: tuple[str, ...] = ("", *STATES)
"""The states in turn; none takes the gap off the list."""


class GapDesk:
    """The list of work."""

    def __init__(self) -> None:
        self._work = GapWork({})
        self.problem = ""
        """Why the file cannot be read."""
        self.last_owner = ""
        self._closed: list[Key] = []

    def read(self, table: Table, every: Sequence[Mapping[str, str]] | None = None) -> None:
        """Read the file as it is now. `every`: all gaps of the saved table, where they are known; the next change takes the lines
        off the list that none of them meets."""
        try:
            self._work, self.problem = GapWork({}) if table.path is None else GapWork.beside(table.path), ""
        except ContextDBError as error:
            self._work, self.problem = GapWork({}), str(error.faults[0])
        conditions = [column.condition for column in table.conditions]
        self._closed = [] if every is None or not self._work.lines else self._work.closed(every, conditions)

    def of(self, table: Table, gaps: Sequence[Mapping[str, str]]) -> list[Work | None]:
        """The work on each of some gaps."""
        return (
            self._work.of_gaps(gaps, [column.condition for column in table.conditions])[0]
            if self._work.lines
            else [None] * len(gaps)
        )

    def step(self, table: Table, gaps: Sequence[Mapping[str, str]], at: int) -> str:
        """Give one of some gaps its next state; gives what was done. Raises FileError."""
        work = self.of(table, gaps)[at]
        state = STEPS[(STEPS.index(work.state if work else "") + 1) % len(STEPS)]
        return self._write(table, gaps, at, Work(state, work.owner if work else "") if state else None)

    def give(self, table: Table, gaps: Sequence[Mapping[str, str]], at: int, owner: str) -> str:
        """Give one of some gaps to somebody, or to nobody; gives what was done. Raises FileError."""
        work, self.last_owner = self.of(table, gaps)[at], owner.strip() or self.last_owner
        return self._write(table, gaps, at, Work(work.state if work else STATES[0], owner.strip()))

    def _write(self, table: Table, gaps: Sequence[Mapping[str, str]], at: int, work: Work | None) -> str:
        if table.path is None:
            return "The table has no file yet: Ctrl+S saves it."
        sources = self._work.sources(gaps, [column.condition for column in table.conditions])
        source = [key for key in sources if key is not None and key == sources[at]]
        replaced = source if len(source) == 1 else []  # else it is another gap's, too
        self._work = write_work(table.path, gaps[at], work, [*replaced, *self._closed])
        done = "The gap is off the list of work." if work is None else f"The gap is {work.text}."
        if not self._closed:
            return done
        first, n_more = cells_text(dict(self._closed[0])), len(self._closed) - 1
        return f"{done} Closed, and off the list, too: {first}{f', and {n_more} more' if n_more else ''}."


def owner_fault(text: str) -> str:
    """What is wrong with the name of an owner."""
    is_good = len(text) <= MOST_OWNER and text.isprintable()
    return "" if is_good else f"a name of at most {MOST_OWNER} printable characters"
