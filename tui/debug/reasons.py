"""Why an asset was chosen, or was not, as lines: what it costs, what it would take, and its row of the table cell by cell."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

from contextdb.errors import ContextDBError
from contextdb.motion.trace.cost_views import cost_text
from contextdb.motion.trace.stock import UNKNOWN
from contextdb.motion.trace.why_not import why_not

from .landscape import Row
from .recording import Moment, Recording


@dataclass(frozen=True, slots=True)
class Line:
    """A line of text, and what it is: "head", "plain", "bad", "good" or "dim"."""

    text: str
    kind: str = "plain"


def reason_lines(recording: Recording, moment: Moment, row: Row) -> list[Line]:
    """Why the asset of a row is chosen at a moment, or is not."""
    return [*_why(moment, row), *_table(recording, moment, row)]


def _why(moment: Moment, row: Row) -> Iterator[Line]:
    assert moment.turned is not None, "a row is of a search"
    exclusion = why_not(moment.turned, row.asset)
    place = "" if exclusion.time_s is None else f" at {exclusion.time_s:.2f} s"
    if exclusion.winner == exclusion.asset:
        yield Line(f"{exclusion.asset} is chosen: cost {cost_text(exclusion.cost)}", "good")
        if moment.searched is not None:
            yield Line(moment.searched.why, "dim")
        return
    yield Line(f"why not {exclusion.asset}{place}: rank {exclusion.rank:,}", "head")
    for reason in exclusion.reasons:
        yield Line(f"  {reason}", "bad")
    yield Line("it would win with" if any(each.wins for each in exclusion.changes) else "no single change is enough", "head")
    for each in sorted(exclusion.changes, key=lambda change: not change.wins):
        to = each.to if isinstance(each.to, str) else f"{each.to:.4g}"
        sign, kind = ("✓", "good") if each.wins else ("– not enough:", "dim")
        yield Line(f"  {sign} {each.kind} {each.what} → {to}", kind)


def _table(recording: Recording, moment: Moment, row: Row) -> Iterator[Line]:
    """The asset's rows of the table, each cell with its fact."""
    table: Any = recording.stock.table(row.database)
    context = None if moment.searched is None else moment.searched.context
    if table is None or context is None:
        yield Line("no table says when it is valid" if table is None else "the session holds no facts", "dim")
        return
    try:
        explained = table.compile().explain(dict(context), unknown=UNKNOWN).asset(row.asset)
    except ContextDBError as error:
        yield Line(str(error.faults[0].message), "dim")
        return
    name = recording.stock.table_of[row.database]
    for each in explained:
        state = "valid" if each.is_valid else "disabled" if not each.is_enabled else "not valid"
        yield Line(f"table {name}, row {each.row + 1}: {state}", "head")
        fails = {failing.condition: failing for failing in each.failures}
        width = max((len(c.condition.name) for c in table.conditions), default=0)
        for column in table.conditions:
            condition = column.condition.name
            cell, fact = table.text(each.row, condition) or "Any", fact_text(context.get(condition))
            failing = fails.pop(condition, None)
            if failing is None:
                yield Line(f"    {condition:<{width}}  is {fact}, cell {cell}", "dim" if cell == "Any" else "plain")
            else:
                yield Line(f"  × {condition:<{width}}  is {fact}, cell {cell}; {failing.mend} would accept it", "bad")
        for failing in fails.values():
            yield Line(f"  × {failing}", "bad")


def fact_text(value: object) -> str:
    """A fact as a line shows it."""
    if value is None:
        return "not given"
    if isinstance(value, float):
        return f"{value:g}"
    return " ".join(map(str, value)) if isinstance(value, (list, tuple, set, frozenset)) else str(value)


def table_row(recording: Recording, row: Row) -> tuple[str, int] | None:
    """The file of the table and the row, from 0, that holds an asset; None where no table does."""
    table: Any = recording.stock.table(row.database)
    if table is None or table.path is None:
        return None
    for i in range(table.n_rows):
        if table.text(i, table.asset_column) == row.asset:
            return str(table.path), i
    return None


def failing_column(recording: Recording, moment: Moment, row: Row) -> str | None:
    """The first condition of the asset's row whose cell does not accept its fact; None where all do, or none is known."""
    table: Any = recording.stock.table(row.database)
    context = None if moment.searched is None else moment.searched.context
    if table is None or context is None:
        return None
    try:
        explained = table.compile().explain(dict(context), unknown=UNKNOWN).asset(row.asset)
    except ContextDBError:
        return None
    return next((failing.condition for each in explained for failing in each.failures), None)
