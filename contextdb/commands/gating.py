"""The gates that compare measured tables with a baseline, and the options that accept what they find.

Every table is compared with something or fails: one that is gone, one that is new, and one whose possible contexts are declared
otherwise pass only where an option names them. An option that accepts nothing is refused, so that none stays by mistake.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TypeVar

from contextdb.covering.baseline import Baseline, CaseCounts, Change, Earlier, compared, differences, of_another_space
from contextdb.disk import read_bytes
from contextdb.errors import ContextError, Fault, Place, in_quotes, mend_for, some
from contextdb.report.coverage_results import (
    Measured,
    fewer_cases,
    fewer_expected,
    max_drop,
    space_changed,
    table_emptied,
    table_gone,
    table_new,
)
from contextdb.report.results import Gate
from contextdb.tables.table import EitherTable

AnyReport = TypeVar("AnyReport")

OPTIONS = {
    "gone": "a table of the baseline that is missing or empty on purpose",
    "new": "a table that the baseline does not have, on purpose",
    "redefined": "a table whose conditions, bounds, values, assumptions or policy changed on purpose",
    "fewer-cases": "a table whose saved contexts expect less on purpose",
}
"""What may be accepted, by option: for which tables."""


@dataclass
class Accepted:
    """The tables that options name, and those that they are needed for."""

    names: Mapping[str, Sequence[str]]
    needed: dict[str, list[str]] = field(default_factory=dict)

    @classmethod
    def of(cls, arguments: argparse.Namespace) -> Accepted:
        return cls({option: getattr(arguments, option.replace("-", "_"), []) for option in OPTIONS})

    def holds(self, option: str, name: str) -> bool:
        """Whether an option names a table that fails without it."""
        self.needed.setdefault(option, []).append(name)
        return name in self.names[option]

    def require_needed(self) -> None:
        """Raise ContextError for each name that accepts nothing: a misspelt one, or one of an earlier change."""
        faults = []
        for option, names in self.names.items():
            needed = self.needed.get(option, [])
            for name in names:
                if name not in needed:
                    sentence = f"--{option} {in_quotes(name)} accepts nothing: no gate fails that it is for."
                    faults.append(Fault(sentence, some(needed) or f"no --{option} at all", mend_for(name, needed)))
        if faults:
            raise ContextError(*faults)


def add_accepting_arguments(parser: argparse.ArgumentParser, options: Iterable[str] = OPTIONS) -> None:
    """The options that accept a difference from the baseline, each for a table by name."""
    for option in options:
        parser.add_argument(f"--{option}", action="append", default=[], metavar="TABLE", help=OPTIONS[option])


def require_baseline(arguments: argparse.Namespace, has_baseline: bool, wants: str = "--baseline FILE") -> None:
    """Refuse options about a baseline where there is none."""
    for option in ("max-drop", *OPTIONS):
        if not has_baseline and getattr(arguments, option.replace("-", "_"), None):
            raise ContextError(Fault(f"--{option} compares with a baseline.", f"{wants} with it"))


def earlier_report(file: str, read: Callable[[str, str], AnyReport], accepted: str) -> AnyReport:
    """The baseline in a file, by what reads its text; `accepted` is what it may be."""
    try:
        text = read_bytes(Path(file)).decode("utf-8-sig")
    except UnicodeDecodeError:
        raise ContextError(Fault("the baseline is not text.", accepted, place=Place(file))) from None
    return read(text, file)


def space_gates(name: str, changes: Sequence[str], accepted: Accepted) -> list[Gate]:
    """The gate of what is declared otherwise than in the baseline; none where nothing is."""
    return [space_changed(name, changes, accepted.holds("redefined", name))] if changes else []


def with_gates(
    measured: Measured, table: EitherTable, baseline: Baseline, limit: float, accepted: Accepted, missing: Sequence[str]
) -> Measured:
    """A measured table with what changed since the baseline, and its gates after those that it has; `missing` are the tables of
    the baseline that are not there any more."""
    name = table.name
    earlier = baseline.tables.get(name)
    if earlier is None:
        return replace(measured, gates=(*measured.gates, table_new(name, accepted.holds("new", name), missing)))
    changes = differences(earlier.space, measured.space)
    gates = space_gates(name, changes, accepted)
    n_expected = 0 if measured.expected is None else len(measured.expected.situations)
    if n_expected < earlier.n_expected:
        gates.append(fewer_expected(n_expected, earlier.n_expected, name, accepted.holds("redefined", name)))
    change = _change(measured, table, earlier, changes)
    if earlier.n_rows and not table.n_rows:
        gates.append(table_emptied(name, earlier.n_rows, accepted.holds("gone", name)))
    elif not changes:
        gates.append(max_drop(change, limit))
    return replace(measured, change=change, gates=(*measured.gates, *gates))


def _change(measured: Measured, table: EitherTable, earlier: Earlier, changes: tuple[str, ...]) -> Change:
    from contextdb.covering.assumed import opened

    ready = opened(table, size="any")
    if changes or not ready.space.is_fitting:
        return of_another_space(measured.report, earlier, changes)
    return compared(ready, measured.report, earlier)


def gone_gates(missing: Sequence[str], new: Sequence[str], accepted: Accepted) -> list[tuple[str, Gate]]:
    """A gate for each table of the baseline that is not there any more."""
    return [(name, table_gone(name, accepted.holds("gone", name), new)) for name in missing]


def case_gates(before: Mapping[str, CaseCounts], now: Mapping[str, CaseCounts], accepted: Accepted) -> dict[str, list[Gate]]:
    """For each table that is there and had saved contexts in the baseline whether they expect no less."""
    both = [name for name in before if name in now]
    failed = [name for name in both if not all(gate.passed for gate in fewer_cases(name, before[name], now[name], False))]
    holds = {name: accepted.holds("fewer-cases", name) for name in failed}
    return {name: fewer_cases(name, before[name], now[name], holds.get(name, False)) for name in both}
