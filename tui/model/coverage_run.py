"""Coverage worked out in the background: one run at a time, with its progress, stopped by an edit.

    none     nothing is known of the table
    running  a thread is at work
    done     the result is that of the table as it is
    stale    the result is that of a table from before an edit
    failed   the table cannot be measured; `problem` says why

Listeners are called from whichever thread made the change.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from threading import Event, Lock, Thread
from typing import Literal

from contextdb.covering import Cancelled, CoverageReport, PairTable, coverage, pairs
from contextdb.covering.pairs import left_out
from contextdb.covering.progress import Stops, Tell
from contextdb.errors import ContextDBError, plural, safe_text
from contextdb.tables.table import Table, rows_of_file

State = Literal["none", "running", "done", "stale", "failed"]
MOST_GAPS = 100
PAIRS_AT = 0.92
"""The part of a run that comes before the pairs of conditions."""
MOST_AT_ONCE = 800
"""A table of so many cells is measured in a fraction of a second."""


@dataclass(frozen=True)
class Result:
    """What a run gives."""

    report: CoverageReport
    pairs: PairTable | None
    """None where the conditions are too many to compare them."""

    @property
    def left_out(self) -> str:
        """That pairs are not compared, as the report of the command says it; "" where they are."""
        return left_out(self.report.n_conditions) if self.pairs is None else ""


Measure = Callable[[Table, Tell, Stops], Result]


def measured(table: Table, tell: Tell, should_stop: Stops) -> Result:
    """The coverage of a table and of its pairs of conditions, in the contexts that its assumptions leave."""
    report = coverage(table, max_gaps=MOST_GAPS, progress=lambda part, share: tell(part, share * PAIRS_AT), should_stop=should_stop)
    if left_out(len(table.flat().conditions)):
        return Result(with_rows_of_file(report, table), None)
    compared = pairs(table, progress=lambda part, share: tell(part, PAIRS_AT + share * (1.0 - PAIRS_AT)), should_stop=should_stop)
    return Result(with_rows_of_file(report, table), compared)


def with_rows_of_file(report: CoverageReport, table: Table) -> CoverageReport:
    """A report whose rows are those of the table's file: where rows refer to other tables it counts the rows behind them."""
    rows = rows_of_file(table.flat())
    if rows is None:
        return report
    own = rows.tolist()
    gaps = [replace(g, nearest=replace(g.nearest, row=own[g.nearest.row])) if g.nearest else g for g in report.gaps]
    crowded = [replace(crowd, rows=tuple(own[row] for row in crowd.rows)) for crowd in report.crowded]
    findings, needless = (
        tuple(replace(f, row=None if f.row is None else own[f.row], by=tuple(own[row] for row in f.by)) for f in part)
        for part in (report.findings, report.needless)
    )
    return replace(report, gaps=tuple(gaps), crowded=tuple(crowded), findings=findings, needless=needless)


@dataclass(eq=False)
class _Task:
    """One thread at work."""

    table: Table
    stopped: Event = field(default_factory=Event)
    part: str = ""
    share: float = 0.0
    thread: Thread | None = None


class CoverageRun:
    """The coverage of the table that is displayed, as far as it is known."""

    def __init__(self, measure: Measure = measured) -> None:
        self._measure = measure
        self._lock = Lock()
        self._task: _Task | None = None
        self._table: Table | None = None
        """The table that is displayed."""
        self._known: tuple[Table, Result] | None = None
        self._failed: tuple[Table, str] | None = None
        self._listeners: list[Callable[[], None]] = []

    # ---- what is known

    @property
    def state(self) -> State:
        with self._lock:
            if self._task is not None:
                return "running"
            if self._failed is not None and _is_same(self._failed[0], self._table):
                return "failed"
            if self._known is None:
                return "none"
            return "done" if _is_same(self._known[0], self._table) else "stale"

    @property
    def result(self) -> Result | None:
        """The last result, stale or not."""
        known = self._known
        return None if known is None else known[1]

    @property
    def table(self) -> Table | None:
        """The table that the last result is about."""
        known = self._known
        return None if known is None else known[0]

    @property
    def progress(self) -> tuple[str, float]:
        """What is being worked out, and which share (0…1) of the whole is done."""
        task = self._task
        return ("", 0.0) if task is None else (task.part, task.share)

    @property
    def problem(self) -> str:
        """Why the last run gave nothing."""
        failed = self._failed
        return "" if failed is None else failed[1]

    def listen(self, listener: Callable[[], None]) -> None:
        self._listeners.append(listener)

    def unlisten(self, listener: Callable[[], None]) -> None:
        self._listeners = [other for other in self._listeners if other != listener]

    # ---- what can be done

    def start(self, table: Table) -> None:
        """Measure a table from now on; what ran before is stopped."""
        task = _Task(table)
        task.thread = Thread(target=self._work, args=(task,), name="coverage", daemon=True)
        with self._lock:
            self._stop()
            self._table, self._task, self._failed = table, task, None
        task.thread.start()
        self._tell_listeners()

    def cancel(self) -> None:
        """Stop what runs; what was known before stays."""
        with self._lock:
            was_running = self._task is not None
            self._stop()
        if was_running:
            self._tell_listeners()

    def follow(self, table: Table) -> None:
        """Say which table is displayed now: a run for another one is stopped, and a result of another one is stale."""
        with self._lock:
            is_same = _is_same(table, self._table)
            self._table = table
            if self._task is not None and not _is_same(self._task.table, table):
                self._stop()
        if not is_same:
            self._tell_listeners()

    def join(self, timeout_s: float | None = None) -> None:
        """Wait until what runs has ended."""
        task = self._task
        if task is not None and task.thread is not None:
            task.thread.join(timeout_s)

    # ---- the thread

    def _stop(self) -> None:
        if self._task is not None:
            self._task.stopped.set()
            self._task = None

    def _work(self, task: _Task) -> None:
        result, problem = None, ""
        try:
            result = self._measure(task.table, lambda part, share: self._advance(task, part, share), task.stopped.is_set)
        except Cancelled:
            pass
        except ContextDBError as error:
            problem = _problem_text(error)
        except MemoryError:
            problem = "There is not enough memory for this table."
        with self._lock:
            if self._task is not task:
                return
            self._task = None
            if result is not None:
                self._known = task.table, result
            elif problem:
                self._failed = task.table, problem
        self._tell_listeners()

    def _advance(self, task: _Task, part: str, share: float) -> None:
        """Note the progress; listeners are called at whole percents."""
        is_new = part != task.part or int(100 * share) != int(100 * task.share)
        task.part, task.share = part, share
        if is_new and self._task is task:
            self._tell_listeners()

    def _tell_listeners(self) -> None:
        for listener in self._listeners:
            listener()


def is_quick(table: Table) -> bool:
    """Whether a table is so small that its coverage is there at once."""
    return table.n_rows * len(table.conditions) <= MOST_AT_ONCE


def _is_same(one: Table, other: Table | None) -> bool:
    """Whether two tables say the same: a table that was saved has another file, but the same cells."""
    if other is None:
        return False
    return one is other or (one.columns is other.columns and one.conditions is other.conditions and one.settings == other.settings)


def _problem_text(error: ContextDBError) -> str:
    first = safe_text(str(error.faults[0]), 400) if error.faults else "The table cannot be measured."
    n_more = len(error.faults) - 1
    return f"{first} ({plural(n_more, 'fault')} more.)" if n_more > 0 else first
