"""What recorded moments say of the table on the screen, worked out in a thread: gaps that the game was in, and rows it never used.

The numbers are those of `contextdb coverage --telemetry`. Rows are those of the table's file.
"""

from __future__ import annotations

import tempfile
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from threading import Thread

import numpy as np

from contextdb.cells.grammar import parse_cell
from contextdb.disk import write_atomic
from contextdb.errors import ContextDBError, Fault, TableError, plural
from contextdb.tables.table import Table, rows_of_file
from contextdb.telemetry import Observed, observe
from contextdb.telemetry.contexts import context_files
from contextdb.telemetry.link.lines import ASK, FORMAT, HEADER, dumped
from contextdb.telemetry.observed import SeenGap

from .context_list import ContextList
from .moments import Moment
from .wanted import wanted_by

MOST_LOOKED = 200_000
"""So many recorded moments are looked through for one in a gap."""
LIVE = "live.jsonl"


@dataclass(frozen=True)
class Played:
    """The result."""

    table: Table
    name: str
    """What was read, as a text."""
    files: Sequence[Path]
    observed: Observed
    gaps: Sequence[SeenGap]
    unused: Sequence[int]
    """The rows of the file that no moment was valid for."""

    @property
    def headline(self) -> str:
        """The covered share, and what could not be read."""
        unread = f" {plural(len(self.observed.unread), 'file')} could not be read." if self.observed.unread else ""
        return f"{self.name}: {self.observed.headline}{unread}"


class PlayedRun:
    """What is known of the recorded moments of a table."""

    def __init__(self) -> None:
        self.result: Played | None = None
        self.problem = ""
        self.reading = ""
        """What is being read."""
        self._folder: tempfile.TemporaryDirectory[str] | None = None
        self._thread: Thread | None = None
        self._turn = 0

    def start(self, table: Table, pattern: str, name: str, tell: Callable[[], None]) -> None:
        """Read files, in a thread; `tell` is called there when that is done."""
        self._start(table, lambda: (pattern, name), name, tell)

    def start_live(self, table: Table, moments: Callable[[], Sequence[Moment]], name: str, tell: Callable[[], None]) -> None:
        """Read the moments that are stored of a game, or a recording."""
        if self._folder is None:
            self._folder = tempfile.TemporaryDirectory(prefix="contextdb-")
        path = Path(self._folder.name) / LIVE
        self._start(table, lambda: (str(path), _written_moments(path, table, moments(), name)), name, tell)

    def _start(self, table: Table, source: Callable[[], tuple[str, str]], name: str, tell: Callable[[], None]) -> None:
        self._turn += 1
        self.problem, self.reading = "", name
        self._thread = Thread(target=self._work, args=(self._turn, table, source, tell), daemon=True)
        self._thread.start()

    def close(self) -> None:
        self._turn += 1
        if self._folder is not None:
            self._folder.cleanup()
            self._folder = None

    def _work(self, turn: int, table: Table, source: Callable[[], tuple[str, str]], tell: Callable[[], None]) -> None:
        try:
            pattern, name = source()
            files = context_files(pattern)
            played, problem = _of_file(table, name, files, observe(table.flat(), files)), ""
        except ContextDBError as error:
            played, problem = None, str(error.faults[0])
        if turn == self._turn:
            self.result, self.problem, self.reading = played or self.result, problem, ""
            tell()


def _written_moments(path: Path, table: Table, moments: Sequence[Moment], name: str) -> str:
    """Write moments as a recording; gives how they are called. One with actors is left out: it is counted by facts alone."""
    plain = [moment for moment in moments if not moment.actors]
    if not plain:
        why = "every query had actors" if moments else "there was no query yet"
        raise TableError(Fault(f"{name} has no moment to count: {why}.", "queries without actors"))
    conditions = sorted({fact for moment in plain for fact in moment.facts})
    tables = {table.name: {"version": None, "conditions": dict.fromkeys(conditions, "")}}
    lines: list[dict[str, object]] = [{"line": HEADER, "format": FORMAT, "game": name, "pid": 0, "tables": tables}]
    lines += [
        {"line": ASK, "t": m.t, "who": None, "table": table.name, "facts": m.facts, "rows": f"{m.rows:x}", "valid": m.n_valid}
        for m in plain
    ]
    write_atomic(path, b"".join(map(dumped, lines)), syncs=False)
    n_left = len(moments) - len(plain)
    return f"{name} ({plural(n_left, 'moment')} with actors left out)" if n_left else name


def _of_file(table: Table, name: str, files: Sequence[Path], observed: Observed) -> Played:
    """What was observed, with the rows of the table's file."""
    own, hits = rows_of_file(table.flat()), np.asarray(observed.hits)
    if own is None:
        return Played(table, name, files, observed, observed.gaps, observed.never_used)
    gaps = [replace(g, nearest=replace(g.nearest, row=int(own[g.nearest.row]))) if g.nearest else g for g in observed.gaps]
    used = np.bincount(own, weights=hits, minlength=table.n_rows) > 0
    return Played(table, name, files, observed, gaps, np.flatnonzero(~used).tolist())


def moment_in(played: Played, gap: SeenGap) -> tuple[dict[str, str], str] | None:
    """The first recorded moment that lies in a gap, as the test row takes it, and where it is; None where there is none."""
    wanted = wanted_by(played.table)
    cells = {
        name: parse_cell(text, wanted.conditions[name].domain) for name, text in gap.cells.items() if name in wanted.conditions
    }
    n_looked = 0
    for path in played.files:
        try:
            contexts = ContextList.open(path, played.table)
            for i in range(min(len(contexts), MOST_LOOKED - n_looked)):
                texts = contexts.facts(i)
                facts = wanted.read(texts)[0]
                if all((fact := facts.get(name)) is not None and cell.holds(fact) for name, cell in cells.items()):
                    return texts, f"moment {i + 1:,} of {path.name}"
        except ContextDBError:
            continue
        n_looked += len(contexts)
    return None
