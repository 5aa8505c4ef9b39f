"""The part of `contextdb diff` that repeats the searches of recorded motion sessions, with both versions of a table."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from contextdb.commands.motion_replay_command import databases_of, project_of
from contextdb.console import printable, progress
from contextdb.errors import Fault, MotionError, Place
from contextdb.motion.trace.reasked import Reasked
from contextdb.motion.trace.reasked_decision import ReaskedDecision, asset_of, chosen_of
from contextdb.motion.trace.session import Trace
from contextdb.motion.trace.stock import Stock
from contextdb.tables.project import Project
from contextdb.tables.table import Table
from contextdb.telemetry.contexts import context_files

MOST_EXAMPLES = 3


@dataclass(frozen=True)
class OtherChoice:
    """A search that chooses otherwise."""

    tick: int
    time_s: float
    before: str | None
    after: str | None
    is_other_asset: bool

    @property
    def text(self) -> str:
        before, after = (asset or "nothing" for asset in (self.before, self.after))
        return (
            f"{self.time_s:.2f} s: {before} → {after}" if self.is_other_asset else f"{self.time_s:.2f} s: another frame of {after}"
        )

    def to_json(self) -> dict[str, object]:
        return {"tick": self.tick, "time_s": self.time_s, "before": self.before, "after": self.after}


@dataclass(frozen=True)
class RepeatedSession:
    """What both versions choose in the searches of one session."""

    file: str
    searches: int
    others: tuple[OtherChoice, ...]

    @property
    def examples(self) -> list[OtherChoice]:
        """A few of the searches that choose otherwise, those with another asset first."""
        return sorted(self.others, key=lambda each: not each.is_other_asset)[:MOST_EXAMPLES]

    def to_json(self) -> dict[str, object]:
        return {
            "file": self.file,
            "searches": self.searches,
            "changed": len(self.others),
            "other_assets": sum(each.is_other_asset for each in self.others),
            "examples": [each.to_json() for each in self.examples],
        }

    @property
    def lines(self) -> list[str]:
        n = sum(each.is_other_asset for each in self.others)
        more = f", {n:,} of them another asset" if self.others else ""
        head = f"{self.file}: {len(self.others):,} of {self.searches:,} searches would choose otherwise{more}"
        return [printable(head), *(printable(f"  {each.text}") for each in self.examples)]


def repeated_sessions(patterns: Sequence[str], project: str | None, before: Table, after: Table) -> list[RepeatedSession]:
    """Repeat the searches of sessions. Raises MotionError where one cannot be repeated, or no database of it takes its assets from
    the table."""
    files = [str(path) for pattern in patterns for path in context_files(pattern)]
    return [_repeated(file, project, before, after) for file in progress(files, "asking again")]


def _repeated(file: str, project: str | None, before: Table, after: Table) -> RepeatedSession:
    trace = Trace.load(file)
    databases, missing = databases_of(trace, project, file)
    if missing:
        raise MotionError(Fault(f"the session cannot be searched again: {missing}", place=Place(file)))
    stock = Stock.with_tables(databases, Project.load(project_of(trace, project, file)[0]))
    old, new = (Reasked(trace, trace.about, stock, {"tables": {before.name: table}}) for table in (before, after))
    n_searches, others = 0, list[OtherChoice]()
    for one, other in zip(old, new, strict=True):
        if one.choice is not None:
            n_searches += 1
            others += _other(one, other)
    return RepeatedSession(file, n_searches, tuple(others))


def _other(one: ReaskedDecision, other: ReaskedDecision) -> Iterator[OtherChoice]:
    was, now = (chosen_of(each.choice, {n: s.database.starts.tolist() for n, s in each.searched.items()}) for each in (one, other))
    if was != now:
        before, after = asset_of(one.choice), asset_of(other.choice)
        yield OtherChoice(one.decision.tick, one.decision.time_s, before, after, before != after)
