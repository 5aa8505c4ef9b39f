"""A coverage report against an earlier one: gaps that opened and closed, rows that died, how much the covered share fell.

The earlier report is the JSON of `contextdb coverage --format json`. Gaps are compared by what they hold, not by how they are cut:
a gap is new when it holds a context that no earlier gap held, and an earlier one is closed when every context of it has a valid row
now. Where that cannot be reported (the search is too long, a condition is gone) gaps of one id are the same.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, fields, replace
from typing import Any

from contextdb.cells.conditions import Condition
from contextdb.cells.domains import Domain
from contextdb.cells.grammar import parse_cell
from contextdb.cells.kinds import KINDS
from contextdb.cells.sets import Cell
from contextdb.cells.words import InCells
from contextdb.covering.assumed import Opened, assumptions_of
from contextdb.covering.report import CoverageReport, Gap
from contextdb.covering.ruled import without_rules
from contextdb.covering.space import Box, Space
from contextdb.covering.witness import BoxSet, Steps
from contextdb.errors import ContextDBError, ContextError, Fault, Place, in_quotes, joined
from contextdb.expressions.expression import read_expression
from contextdb.files.reports import baseline_of
from contextdb.findings import Finding
from contextdb.tables.table import EitherTable

DEAD_RULES = ("dead-row", "never-chosen")
STEPS = 20_000
"""Search steps for one comparison."""
ACCEPTED = 'the document that "contextdb coverage --format json" writes'


@dataclass(frozen=True)
class EarlierGap(InCells):
    """A gap of an earlier report."""

    id: str
    cells: dict[str, str]
    share: float

    def to_json(self) -> dict[str, object]:
        return {"id": self.id, "share": self.share, "cells": self.cells}


@dataclass(frozen=True)
class Earlier:
    """What an earlier report says of one table."""

    lower: float
    gaps: tuple[EarlierGap, ...]
    is_complete: bool
    dead: Counter[tuple[str, str]]
    """Rule and asset of each dead row."""
    n_rows: int
    space: Declared
    """What its shares are shares of."""
    n_expected: int = 0
    """How many situations were expected of it."""


@dataclass(frozen=True)
class CaseCounts:
    """How many saved contexts of a table expect something, how many of these expect exactly some assets, and how many of the
    table's rows are valid in one of them."""

    count: int
    exact: int
    rows: int
    rows_reached: int

    def to_json(self) -> dict[str, int]:
        return asdict(self)


@dataclass(frozen=True)
class Baseline:
    """What an earlier report says: of each measured table, and of the saved contexts of each table."""

    tables: Mapping[str, Earlier]
    cases: Mapping[str, CaseCounts]


@dataclass(frozen=True)
class Change:
    """What became of a table since an earlier report."""

    before: float
    """The lower bound of the covered share then."""
    drop: float
    """How much the lower bound fell; below 0 where it rose."""
    opened: tuple[Gap, ...]
    closed: tuple[EarlierGap, ...]
    dead: tuple[Finding, ...]
    """Rows that became dead, or are never chosen any more."""
    is_complete: bool
    """Whether both reports list all their gaps; else a gap that was too small for the earlier list may seem new, as may one that
    names a rule that was rewritten."""
    space: tuple[str, ...] = ()
    """What is declared otherwise than before. With any of it the shares are of other contexts: nothing is compared."""

    def to_json(self) -> dict[str, object]:
        return {
            "before": self.before,
            "drop": self.drop,
            "complete": self.is_complete,
            "space": list(self.space),
            "opened": [gap.id for gap in self.opened],
            "closed": [gap.to_json() for gap in self.closed],
            "dead": [finding.to_json() for finding in self.dead],
        }


def read_baseline(text: str, file: str) -> Baseline:
    """What an earlier report says. Raises ContextError where it is no such report, or has no tables; the place names the file."""
    try:
        document = baseline_of(text)
        tables = {_text(entry["table"]): _earlier(entry) for entry in document["tables"]}
        if not tables:
            raise ValueError("it has no tables, so nothing would be compared")
        return Baseline(tables, {_text(name): _case_counts(counts) for name, counts in document["cases"].items()})
    except (ValueError, KeyError, TypeError, AttributeError) as error:
        why = f"{error} is missing" if isinstance(error, KeyError) else str(error)
        raise ContextError(Fault(f"the baseline cannot be read: {why}.", ACCEPTED, "to write it again", Place(file))) from None


def _earlier(entry: Mapping[str, Any]) -> Earlier:
    gaps = entry["gaps"]
    items = [
        EarlierGap(_text(g["id"]), {_text(n): _text(c) for n, c in g["cells"].items()}, _share(g["share"])) for g in gaps["items"]
    ]
    findings = entry.get("findings", [])
    dead = Counter((_text(f["rule"]), str(f.get("asset"))) for f in findings if f["rule"] in DEAD_RULES)
    lower, n_rows = _share(entry["covered"]["lower"]), _count(entry["rows"])
    n_expected = len((entry.get("expected") or {"situations": ()})["situations"])
    return Earlier(lower, tuple(items), gaps["complete"] is True, dead, n_rows, require_declared(entry["space"]), n_expected)


def _case_counts(counts: Mapping[str, Any]) -> CaseCounts:
    return CaseCounts(**{field.name: _count(counts[field.name]) for field in fields(CaseCounts)})


def _count(value: object) -> int:
    if isinstance(value, bool) or not isinstance(value, int):
        raise TypeError(f"{value!r:.60} is not a whole number")
    return value


def _text(value: object) -> str:
    if not isinstance(value, str):
        raise TypeError(f"{value!r:.60} is not text")
    return value


def _share(value: object) -> float:
    if isinstance(value, bool) or not isinstance(value, (int, float)) or not (math.isfinite(value) and 0 <= value <= 1):
        raise ValueError(f"{value!r:.60} is not a share from 0 to 1")
    return float(value)


def compared(ready: Opened, report: CoverageReport, earlier: Earlier) -> Change:
    """What became of a table; `report` is that of the table that `ready` holds, in the space of the earlier one."""
    now, before = [gap.cells for gap in report.gaps], [gap.cells for gap in earlier.gaps]
    exact = replace(ready.space, is_strict=True)
    excluded = [exact.cells(exact.sides_of(box)) for box in ready.space.impossible]
    space, boxes = _boxes(ready, [*excluded, *now, *before])
    impossible = [box for box in boxes[: len(excluded)] if box is not None]
    now_boxes, before_boxes = boxes[len(excluded) :][: len(now)], boxes[len(excluded) + len(now) :]
    held_before = BoxSet.of(space.full, [*impossible, *(box for box in before_boxes if box is not None), *space.boxes])
    rows = BoxSet.of(space.full, [*impossible, *space.boxes])
    ids_now, ids_before = {gap.id for gap in report.gaps}, {gap.id for gap in earlier.gaps}
    opened = (
        g for g, box in zip(report.gaps, now_boxes, strict=True) if g.id not in ids_before and not _is_held(box, held_before, False)
    )
    closed = (g for g, box in zip(earlier.gaps, before_boxes, strict=True) if g.id not in ids_now and _is_held(box, rows, True))
    listed = (
        *zip((g.id for g in report.gaps), now_boxes, strict=True),
        *zip((g.id for g in earlier.gaps), before_boxes, strict=True),
    )
    has_rules = ready.ruled is not None and ready.ruled.column is not None
    is_told = not has_rules or all(box is not None for gap_id, box in listed if gap_id not in ids_now & ids_before)
    is_complete = report.gaps_complete and earlier.is_complete and is_told
    dead = tuple(_newly_dead(report.findings, earlier.dead))
    return Change(earlier.lower, earlier.lower - report.lower, tuple(opened), tuple(closed), dead, is_complete)


def of_another_space(report: CoverageReport, earlier: Earlier, space: tuple[str, ...]) -> Change:
    """What is known of a table whose space differs in `space`: which rows died."""
    dead = tuple(_newly_dead(report.findings, earlier.dead))
    return Change(earlier.lower, earlier.lower - report.lower, (), (), dead, False, space)


def _boxes(ready: Opened, boxes: Sequence[Mapping[str, str]]) -> tuple[Space, list[Box | None]]:
    """Boxes of cells in a space that tells them apart; None for those that the table cannot say any more."""
    domains = {condition.name: condition.domain for condition in ready.space.conditions}
    readable = [cells if _reads(cells, domains) else None for cells in boxes]
    space = Space.of(ready.compiled, [cells for cells in readable if cells is not None])
    return space, [None if cells is None else space.box(_parsed(cells, domains)) for cells in readable]


def _parsed(cells: Mapping[str, str], domains: Mapping[str, Domain]) -> dict[str, Cell]:
    return {name: parse_cell(text, domains[name], wants_mend=False) for name, text in cells.items()}


def _reads(cells: Mapping[str, str], domains: Mapping[str, Domain]) -> bool:
    try:
        return bool(_parsed(cells, domains)) or not cells
    except (KeyError, ContextDBError):
        return False


def _is_held(box: Box | None, boxes: BoxSet, otherwise: bool) -> bool:
    """Whether some boxes hold a whole box; `otherwise` where the table cannot say it any more, or the search is too long."""
    return otherwise if box is None else boxes.hold(box, Steps(STEPS), otherwise)


def _newly_dead(findings: Iterable[Finding], before: Counter[tuple[str, str]]) -> Iterable[Finding]:
    left = before.copy()
    for finding in findings:
        if finding.rule in DEAD_RULES:
            key = (finding.rule, str(finding.asset))
            left[key] -= 1
            if left[key] < 0:
                yield finding


# ---- what the shares of a table are shares of: its conditions with their types, bounds and values, and what contextdb.toml
# assumes. A baseline keeps this as plain data, so that shares of two different spaces are never compared without a word, and
# the difference can be named. Data only

Declared = Mapping[str, Any]
MOST_VALUES = 8
NOTHING: Declared = {"conditions": {}, "facts": {}, "assume": [], "assumed": {}, "when": None, "policy": None}
"""Where no table says which contexts there are."""


def declared(table: EitherTable, assumed: Mapping[str, str]) -> dict[str, Any]:
    """What the shares of a table rest on, as JSON has it; `assumed` is what its report had to assume of what is not declared."""
    flat = table.flat()
    own = {column.condition.name: column.condition for column in flat.conditions}
    ruled = without_rules(flat)
    named = {c.name: c for expression in assumptions_of(ruled.table).expressions for c in expression.conditions}
    behind = _inputs({**named, **ruled.others, **own}, flat.schema.conditions)
    return {
        "conditions": {name: _about(condition) for name, condition in own.items()},
        "facts": {name: _about(condition) for name, condition in behind.items() if name not in own},
        "assume": list(flat.settings.assume),
        "assumed": dict(assumed),
        "when": flat.settings.when,
        "policy": flat.settings.policy,
    }


def _inputs(conditions: Mapping[str, Condition], known: Mapping[str, Condition]) -> dict[str, Condition]:
    """Some conditions, and all that they are computed from."""
    conditions_by_name, remaining = dict[str, Condition](), list(conditions.values())
    while remaining:
        condition = remaining.pop()
        if condition.name in conditions_by_name:
            continue
        conditions_by_name[condition.name] = condition
        if condition.expr:
            remaining += read_expression(condition.expr, known).conditions
    return dict(sorted(conditions_by_name.items()))


def _about(condition: Condition) -> dict[str, Any]:
    domain = condition.domain
    about = {
        "type": domain.kind,
        "values": None if domain.values is None else list(domain.values),
        "min": domain.minimum if math.isfinite(domain.minimum) else None,
        "max": domain.maximum if math.isfinite(domain.maximum) else None,
        "expr": condition.expr,
    }
    return {key: value for key, value in about.items() if value is not None}


def require_declared(value: object) -> Declared:
    """What a document says, checked. Raises TypeError for what `declared` does not give."""
    mappings, texts = ("conditions", "facts", "assumed"), ("when", "policy")
    is_sound = (
        isinstance(value, dict)
        and all(isinstance(value.get(name), dict) for name in mappings)
        and isinstance(value.get("assume"), list)
        and all(isinstance(value.get(name), (str, type(None))) for name in texts)
    )
    if not isinstance(value, dict) or not is_sound:
        raise TypeError('"space" of a table is not what was written')
    parts = [*value["conditions"].values(), *value["facts"].values()]
    if not all(isinstance(part, dict) and isinstance(part.get("values", []), list) for part in parts):
        raise TypeError('"space" of a table is not what was written')
    return value


def differences(before: Declared, now: Declared) -> tuple[str, ...]:
    """What is declared otherwise than before, a phrase for each difference; nothing where the spaces are the same."""
    return tuple(_differences(before, now))


def _differences(before: Declared, now: Declared) -> Iterator[str]:
    for name, about in before["conditions"].items():
        if name not in now["conditions"]:
            yield f"{in_quotes(name)} is no condition any more (it was {_words(about)})"
    for name, about in now["conditions"].items():
        if name not in before["conditions"]:
            yield f"{in_quotes(name)} is a new condition ({_words(about)})"
    old, new = ({**part["facts"], **part["conditions"]} for part in (before, now))
    both = [name for name in new if name in old]
    for name in both:
        yield from (f"{in_quotes(name)}: {words}" for words in _changes(old[name], new[name]))
    for text in before["assume"]:
        if text not in now["assume"]:
            yield f"assume no longer has {in_quotes(text)}"
    for text in now["assume"]:
        if text not in before["assume"]:
            yield f"assume now has {in_quotes(text)}"
    for name in both:
        was, is_now = (part["assumed"].get(name, "as declared") for part in (before, now))
        if was != is_now:
            yield f"{in_quotes(name)} is not fully declared, and counts otherwise: before {was}, now {is_now}"
    for key, what in (("when", "the column of rules"), ("policy", "the policy")):
        if before[key] != now[key]:
            yield f"{what} was {before[key] or 'none'}, now {now[key] or 'none'}"


def _changes(before: Mapping[str, Any], now: Mapping[str, Any]) -> Iterator[str]:
    if before.get("type") != now.get("type"):
        yield f"type {before.get('type')}, now {now.get('type')}"
    for key in ("min", "max"):
        if before.get(key) != now.get(key):
            yield f"{key} {_written(before, key)}, now {_written(now, key)}"
    old, new = before.get("values", []), now.get("values", [])
    if lost := [value for value in old if value not in new]:
        yield f"the values are without {_listed(lost)}"
    if added := [value for value in new if value not in old]:
        yield f"the values are with {_listed(added)} too"
    if before.get("expr") != now.get("expr"):
        yield f"computed as {before.get('expr') or 'nothing (it was given)'}, now {now.get('expr') or 'nothing (it is given)'}"


def _words(about: Mapping[str, Any]) -> str:
    """A condition in a few words: its type and its bounds or values."""
    bounds = f"{_written(about, 'min')} to {_written(about, 'max')}" if about.keys() & {"min", "max"} else ""
    values = _listed(about["values"]) if "values" in about else ""
    expr = f"= {about['expr']}" if "expr" in about else ""
    return " ".join(part for part in (str(about.get("type")), bounds, values, expr) if part)


def _written(about: Mapping[str, Any], key: str) -> str:
    """A bound as contextdb.toml has it."""
    kind = KINDS.get(about.get("type", ""))
    return "none" if key not in about else kind.spelling.write(about[key]) if kind else str(about[key])


def _listed(values: Sequence[object]) -> str:
    return joined([str(value) for value in values], MOST_VALUES)
