"""The part of `contextdb diff` that asks both versions in recorded moments."""

from __future__ import annotations

import argparse
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

from contextdb.cells.words import cells_text
from contextdb.checks.effects import Box, Effects
from contextdb.checks.effects_space import shared_space
from contextdb.commands.motion_replay_command import databases_of, project_of
from contextdb.commands.progress import bar, has_many_bytes
from contextdb.compiled.table import data_of
from contextdb.console import note, printable, progress, terminal_width
from contextdb.covering.report import format_percent
from contextdb.errors import Fault, MotionError, Place, plural, safe_text
from contextdb.motion.trace.reasked import Reasked
from contextdb.motion.trace.reasked_decision import ReaskedDecision, asset_of, chosen_of
from contextdb.motion.trace.session import Trace
from contextdb.motion.trace.stock import Stock
from contextdb.report.document import Block, Document, Numbered, Section, as_markdown, section_lines
from contextdb.report.results import Gate
from contextdb.tables.project import Project
from contextdb.tables.table import Table
from contextdb.telemetry.backtest import EMPTIED, FILLED, GAINS, LOSES, Backtest, ChangedBox, Comparison, Example, backtest
from contextdb.telemetry.characters import by_character, per_minute
from contextdb.telemetry.contexts import context_files

MOST_BOXES = 64
"""Boxes in which moments are counted."""
WORDS = {EMPTIED: "no row any more", FILLED: "a row at last", GAINS: "gains", LOSES: "loses"}


@dataclass(frozen=True)
class Replayed:
    """What recorded moments say of a change, and the bars of the command."""

    result: Backtest
    gates: tuple[Gate, ...]

    def to_json(self) -> dict[str, object]:
        document: dict[str, object] = {"backtest": self.result.to_json()}
        return document | ({"gates": [gate.to_json() for gate in self.gates]} if self.gates else {})

    def text(self, colour: bool, shows_all: bool) -> str:
        return "\n" + "\n".join(section_lines(self._section, colour, terminal_width(), shows_all)) + "\n"

    @property
    def markdown(self) -> str:
        return "\n" + as_markdown(Document("diff", "part", (self._section,))).partition("\n")[2].lstrip("\n")

    @property
    def _section(self) -> Section:
        result = self.result
        moments, parts = plural(result.moments, "recorded moment"), self._parts
        return Section(moments, parts, self._unread, tuple(self._blocks()), self.gates)

    @property
    def sentences(self) -> list[str]:
        """What becomes of the moments, and which files were not read."""
        return [f"Of {plural(self.result.moments, 'recorded moment')}: {self._parts}.", *self._unread]

    @property
    def blocks(self) -> list[Block]:
        """By assets, by boxes, and moments to open."""
        return [replace(b, title=f"Recorded moments: {b.title}") if isinstance(b, Numbered) else b for b in self._blocks()]

    @property
    def _parts(self) -> str:
        shares = [(f"{_percent(n, self.result.moments)} {what}", n) for what, n in self._counts]
        return ", ".join(text for text, n in shares if n) or "nothing changes"

    @property
    def _unread(self) -> list[str]:
        return [f"{printable(file)} was not read: {faults[0].message}" for file, faults in self.result.unread]

    @property
    def _counts(self) -> list[tuple[str, int]]:
        result = self.result
        return [("change", result.changed), ("are left without a row", result.emptied), ("have a row at last", result.filled)]

    def _blocks(self) -> Iterator[Block]:
        result = self.result
        assets = sorted({*result.gains, *result.loses}, key=lambda asset: (-result.gains[asset] - result.loses[asset], asset))
        if assets:
            lines = [f"{safe_text(a)}: {_both(result.gains[a], result.loses[a], result.moments)}" for a in assets]
            yield Numbered("assets", lines)
        if result.characters:
            yield Numbered(_per_minute(result), list(_characters(result)))
        if boxes := result.ordered_boxes:
            yield Numbered("where", [f"{_percent(n, result.moments)}  {_words(box)}: {_cells(box)}" for box, n in boxes])
        if result.examples:
            yield Numbered("moments to open", list(map(_example, result.examples)))


def replayed_moments(arguments: argparse.Namespace, before: Table, after: Table, effect: Effects | Fault | None) -> Replayed:
    """Ask both versions in the moments that were recorded."""
    boxes = _boxes(effect) if isinstance(effect, Effects) else []
    own = data_of(shared_space(before, after).table([[dict(box.cells) for box in boxes]]).compile()) if boxes else None
    old, new = (data_of(table.flat().compile()) for table in (before, after))
    comparison = Comparison(old, new, arguments.count, arguments.character, arguments.time, tuple(boxes), own)
    files = [file for pattern in arguments.telemetry for file in context_files(pattern)]
    with bar("asking in recorded moments", has_many_bytes(files)) as tell:
        result = backtest(comparison, arguments.telemetry, arguments.engine, arguments.scheduler, tell)
    for file, faults in result.unread:
        note(f"{printable(file)} was not read: {faults[0].message}")
    bars = (("max-changed", arguments.max_changed, result.changed), ("max-emptied", arguments.max_emptied, result.emptied))
    return Replayed(result, tuple(_gate(name, limit, n, result.moments) for name, limit, n in bars if limit is not None))


def _gate(name: str, limit: float, n: int, moments: int) -> Gate:
    """A bar of the share of moments; without a moment it fails."""
    if not moments:
        return Gate(name, limit, None, False, "no moment was recorded.")
    share = n / moments
    verb = "change" if name == "max-changed" else "are left without a row"
    return Gate(
        name, limit, share, share <= limit, f"{_percent(n, moments)} of the moments {verb}; allowed {format_percent(limit)}."
    )


def _boxes(effect: Effects) -> list[ChangedBox]:
    """The boxes of what a change does, those that lose their last row first."""
    boxes = [ChangedBox(EMPTIED, _items(box)) for box in effect.opened]
    boxes += [ChangedBox(FILLED, _items(box)) for box in effect.closed]
    for reach in effect.assets:
        for what, parts in ((LOSES, reach.lost), (GAINS, reach.gained)):
            boxes += [ChangedBox(what, _items(box), reach.asset) for box in parts]
    return list(dict.fromkeys(boxes))[:MOST_BOXES]


def _items(box: Box) -> tuple[tuple[str, str], ...]:
    return tuple(box.cells.items())


def _words(box: ChangedBox) -> str:
    return WORDS[box.what] if box.asset is None else f"{safe_text(box.asset)} {WORDS[box.what]}"


def _cells(box: ChangedBox) -> str:
    return safe_text(cells_text(dict(box.items)), 400)


def _both(gains: int, loses: int, moments: int) -> str:
    parts = [f"{verb} {_percent(n, moments)}" for verb, n in (("gains", gains), ("loses", loses)) if n]
    return ", ".join(parts)


def _example(example: Example) -> str:
    place = f"line {example.line}" if example.line is not None else f"row {example.row + 1}"
    facts = " ".join(f"{name}={value}" for name, value in example.context.items())
    before, after = (", ".join(assets) or "no row" for assets in (example.before, example.after))
    return safe_text(f"{example.file}, {place}: {facts}: {before} → {after}", 400)


CHANGES = (("changed", "change"), ("emptied", "are left without a row"), ("filled", "have a row at last"))


def _per_minute(result: Backtest) -> str:
    """How many moments change per character and minute, as a title."""
    rates = per_minute(result.characters)
    if rates is None:
        return "characters"
    return "per character and minute " + ", ".join(f"{rates[name]:.3g} {verb}" for name, verb in CHANGES)


def _characters(result: Backtest) -> Iterator[str]:
    for name, minutes, counts in by_character(result.characters):
        how = ", ".join(f"{counts[key]:,} {verb}" for key, verb in CHANGES if counts[key]) or "none changes"
        lasting = f" in {minutes:,.1f} minutes" if minutes else ""
        yield f"{safe_text(name)}: {plural(counts['moments'], 'moment')}{lasting}: {how}"


def _percent(n: int, moments: int) -> str:
    return format_percent(n / moments) if moments else "none"


# ---- the part of `contextdb diff` that repeats the searches of recorded motion sessions, with both versions of a table


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
