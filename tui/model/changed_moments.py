"""What the edits since the last save do to saved contexts and recorded moments: those in which something else may play. An edge: it
reads the files of both."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from itertools import islice
from pathlib import Path

import numpy as np

from contextdb.checks.cases import Case, judge, read_cases
from contextdb.compiled.choosing import Choosing
from contextdb.compiled.data import CompiledData
from contextdb.disk.boundary import why_outside
from contextdb.errors import ContextDBError, plural
from contextdb.tables.table import Table
from contextdb.telemetry.backtest import Comparison, Example, backtest

from .context_list import ContextList, cases_file
from .moments import text_of

MOST_FILES, MOST_LISTED = 50, 200
NOTHING = "nothing"


@dataclass(frozen=True)
class ChangedMoment:
    """A moment in which something else may play."""

    where: str
    """The name of a saved context, or the file and line of a recorded moment."""
    facts: Mapping[str, str]
    before: str
    after: str
    """The assets that may play, with commas between them."""


@dataclass(frozen=True)
class Changes:
    """The moments that change, those of saved contexts first."""

    moments: tuple[ChangedMoment, ...]
    summary: str
    """How many were looked at, how many change, and what could not be read."""


def recordings_near(folder: Path) -> list[Path]:
    """The recordings of games in a project's folder, two folders deep."""
    paths = (path for pattern in ("*.jsonl", "*/*.jsonl", "*/*/*.jsonl") for path in sorted(folder.glob(pattern)))
    return [path for path in islice(paths, MOST_FILES) if why_outside(path, folder) is None]


def changed_moments(before: Table, after: Table, folder: Path) -> Changes:
    """Ask two versions of a table in its saved contexts and in the recordings near it. Raises TableError or FileError where a
    version cannot be used, or the saved contexts cannot be read."""
    versions = _Asked(before, after)
    cases = read_cases(cases_file(after)) if after.path is not None else []
    of_cases = [moment for case in cases if (moment := versions.changed(case.name, case.facts)) is not None]
    parts = [f"{len(of_cases):,} of {plural(len(cases), 'saved context')}"]
    of_files: list[ChangedMoment] = []
    if paths := recordings_near(folder):
        comparison = Comparison(*versions.compiled, n_examples=MOST_LISTED)
        try:
            result = backtest(comparison, [str(path) for path in paths])
        except ContextDBError as error:
            parts.append(f"no recording can be read: {error.faults[0].found}")
        else:
            parts.append(f"{result.changed:,} of {plural(result.moments, 'recorded moment')}")
            parts += [f"{plural(len(result.unread), 'recording')} cannot be read"] if result.unread else []
            of_files = list(_of_examples(result.examples, versions))
    return Changes((*of_cases, *of_files), f"{' and '.join(parts[:2])} play something else.{_rest(parts[2:])}")


# ---- parts


class _Asked:
    """Two versions of a table, asked in the same moments."""

    def __init__(self, before: Table, after: Table) -> None:
        self._sides = [ContextList.empty(table).compiled for table in (before, after)]
        self._conditions = {**ContextList.empty(before).conditions, **ContextList.empty(after).conditions}

    @property
    def compiled(self) -> tuple[CompiledData, CompiledData]:
        return self._sides[0][0], self._sides[1][0]

    def texts(self, context: Mapping[str, object]) -> dict[str, str]:
        """The facts of a recorded moment as they are typed."""
        texts = {name: text_of(context.get(name), condition) for name, condition in self._conditions.items()}
        return {name: text for name, text in texts.items() if text}

    def changed(self, where: str, facts: Mapping[str, str]) -> ChangedMoment | None:
        """The moment, where other assets may play; None where the same do, or a fact cannot be read."""
        known = {name: text for name, text in facts.items() if name in self._conditions}
        plays = []
        for compiled, readable in self._sides:
            verdict = judge(
                compiled, Case("", {name: text for name, text in known.items() if name in compiled.asked}, ""), readable
            )
            if verdict.faults:
                return None
            flags = np.array([[verdict.valid >> row & 1 for row in range(compiled.n_rows)]], np.bool_)
            rows = np.flatnonzero(compiled.once(Choosing.of).pickable_of(flags)[0]).tolist()
            plays.append(list(dict.fromkeys(compiled.assets[row] for row in rows)) or [compiled.fallback or NOTHING])
        if set(plays[0]) == set(plays[1]):
            return None
        return ChangedMoment(where, known, ", ".join(plays[0]), ", ".join(plays[1]))


def _of_examples(examples: list[Example], versions: _Asked) -> Iterator[ChangedMoment]:
    for example in examples:
        place = f"line {example.line}" if example.line is not None else f"row {example.row + 1}"
        moment = versions.changed(f"{Path(example.file).name}, {place}", versions.texts(example.context))
        if moment is not None:
            yield moment


def _rest(parts: list[str]) -> str:
    return "".join(f" {part}." for part in parts)
