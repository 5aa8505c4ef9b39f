"""What `motion coverage` hands to its renderers: each table's motion, its thresholds, and an earlier report. Data only."""

from __future__ import annotations

import json
import math
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any, ClassVar

import numpy as np

from contextdb.authoring.motion_coverage import TableMotion
from contextdb.cells.words import cells_text
from contextdb.covering import format_percent
from contextdb.covering.baseline import NOTHING, Declared, require_declared
from contextdb.errors import ContextError, Fault, Place, in_quotes, plural, some
from contextdb.files.reports import baseline_of, with_marks
from contextdb.motion.clips.quaternions import Floats
from contextdb.motion.measuring.coverage import ContextCoverage, ToCapture, about_bins
from contextdb.motion.measuring.moves import DIRECTION, MAPS, Counts, Map
from contextdb.motion.measuring.usage import Near
from contextdb.report.coverage_results import bar
from contextdb.report.results import CheckReport, Gate, Subject

AHEAD_ALONE = "Every clip moves straight ahead, and no other direction is wanted."
BASELINE = "the document that `contextdb motion coverage --format json` writes"
EXACT, DRAWN = 1e-9, 0.02
"""A share of contexts fell when it is less by more than this: by roundings, or where contexts are drawn by chance."""
MOST_NAMED = 6


@dataclass(frozen=True)
class Lost:
    """A bin that clips filled in some contexts before, and fill in fewer now."""

    map: str
    row: int
    column: int
    before: float
    now: float

    @property
    def words(self) -> str:
        return MAPS[self.map].words(self.row, self.column)

    def to_json(self) -> dict[str, object]:
        where = {"map": self.map, "row": self.row, "column": self.column, "what": self.words}
        return {**where, "before": self.before, "now": self.now}


@dataclass(frozen=True, eq=False)
class MotionMeasured:
    """One table with its thresholds, and what it lost since the baseline; None without one."""

    motion: TableMotion
    lost: tuple[Lost, ...] | None = None
    gates: tuple[Gate, ...] = ()
    space: Declared = field(default_factory=lambda: NOTHING)
    """What its shares of contexts are shares of."""

    @property
    def headline(self) -> str:
        """The covered share in words."""
        coverage = self.motion.coverage
        about = "about " if not self.motion.is_exact else ""
        return f"{about}{format_percent(coverage.covered, 1)} of the wanted movements have a valid clip"

    @property
    def size(self) -> str:
        """How much there is of what."""
        coverage = self.motion.coverage
        parts = [plural(len(coverage.clips), "clip"), plural(coverage.n_frames, "frame")]
        parts += ["mirrored too"] if coverage.is_mirrored else []
        return ", ".join([*parts, f"of {plural(len(coverage.databases), 'database')}: {some(coverage.databases)}"])

    def notes(self) -> Iterator[str]:
        """What shares are of, and what they leave out, in sentences."""
        coverage, contexts = self.motion.coverage, self.motion.contexts
        if contexts is None:
            yield "No table says when these clips are valid: they are measured together."
            return
        n = len(coverage.contexts)
        sets = f"{plural(n, 'set')} of valid clips, in {format_percent(1.0 - contexts.without, 1)} of the contexts"
        without = f"; in the others no clip is valid (see contextdb coverage {coverage.table})" if contexts.without else ""
        yield f"{sets}{without}."
        if contexts.n_samples:
            yield f"Shares are of {contexts.n_samples:,} contexts drawn, as {contexts.why}."
        if self.motion.axes:
            axes = ", ".join(f"{axis} by {in_quotes(name)}" for axis, name in self.motion.axes.items())
            yield f"Wanted movements come from: {axes}."
        if contexts.not_mirrored:
            yield f"Mirrored clips ignore {some(contexts.not_mirrored)}: computed from facts that mirroring changes."

    def asides(self) -> Iterator[tuple[str, str, list[str]]]:
        """What else there is to say of clips: a title, a sentence, and its items."""
        coverage = self.motion.coverage
        yield "never valid", "no context lets these clips play", list(coverage.never_valid)
        yield "no clip", "rows whose asset no database has a clip of", list(self.motion.without_clip)
        dead = [f"{clip.asset} {format_percent(clip.n_dead / clip.n_frames, 0)}" for clip in coverage.dead]
        yield "dead frames", "the markup never lets these shares of clips play", dead
        yield (
            "near-duplicates",
            "95 % of the frames of the first clip are within this cost of the other",
            list(_near_words(coverage.near)),
        )
        transitions = coverage.transitions
        missing = [transitions.name_of(pair) for pair in transitions.missing]
        yield "no transition", f"states of {transitions.pattern} without a clip", missing

    def to_json(self) -> dict[str, Any]:
        """One entry of `tables` in the JSON document."""
        lost = None if self.lost is None else {"lost": [each.to_json() for each in self.lost]}
        return self.motion.to_json() | {
            "space": dict(self.space),
            "baseline": lost,
            "gates": [gate.to_json() for gate in self.gates],
        }


@dataclass(frozen=True, eq=False)
class MotionCoverageResults:
    """All tables of a project."""

    subject: ClassVar[Subject] = "motion coverage"
    tables: tuple[MotionMeasured, ...]
    unlisted: tuple[str, ...] = ()
    gone: Mapping[str, Gate] = field(default_factory=dict)
    """For each table of the baseline that has no clips now the gate of that."""

    @property
    def gates(self) -> list[Gate]:
        return [*self.gone.values(), *(gate for measured in self.tables for gate in measured.gates)]

    @property
    def passed(self) -> bool:
        return all(gate.passed for gate in self.gates)

    @property
    def verdict(self) -> str:
        """Whether the thresholds are met, in one sentence; "" where there are none."""
        n_missed = sum(not gate.passed for gate in self.gates)
        if n_missed:
            return f"{n_missed} of {plural(len(self.gates), 'threshold')} missed."
        return f"{plural(len(self.gates), 'threshold')} met." if self.gates else ""

    def to_json(self) -> dict[str, object]:
        return with_marks(
            {
                "format": 1,
                "passed": self.passed,
                "bins": about_bins(),
                "tables": [measured.to_json() for measured in self.tables],
                "clips_without_row": list(self.unlisted),
                "gone": list(self.gone),
            }
        )

    def as_check(self) -> CheckReport:
        """The thresholds that are missed, or met by an option, as findings."""
        named = [(name, gate) for name, gate in self.gone.items()]
        named += [(measured.motion.name, gate) for measured in self.tables for gate in measured.gates]
        return CheckReport((), tuple(finding for name, gate in named for finding in gate.findings(name)))


def _near_words(near: Iterable[Near]) -> Iterator[str]:
    """Near-duplicates; of two clips that are near each other one pair."""
    listed = set()
    for each in near:
        if (each.other, each.asset) not in listed:
            listed.add((each.asset, each.other))
            cost = "<0.0001" if each.cost < 0.0001 else f"{each.cost:.4f}"
            yield f"{each.asset} ~ {each.other}{' mirrored' if each.is_mirrored else ''} ({cost})"


# ---- bars


def fail_under(motion: TableMotion, limit: float) -> Gate:
    """The gate of a least covered share."""
    value = motion.coverage.covered if motion.is_exact else max(0.0, motion.coverage.covered - DRAWN)
    at_least = "" if motion.is_exact else "at least "
    return bar("fail-under", value, limit, f"{at_least}{{}} of the wanted movements have a valid clip")


def no_loss(lost: tuple[Lost, ...]) -> Gate:
    """Require that no movement was lost since the baseline."""
    if not lost:
        return Gate("baseline", 0.0, 0.0, True, "no movement was lost since the baseline.")
    message = f"{plural(len(lost), 'movement')} lost since the baseline: {some([each.words for each in lost])}."
    return Gate("baseline", 0.0, float(len(lost)), False, message)


# ---- an earlier report


@dataclass(frozen=True, eq=False)
class Earlier:
    """What an earlier report says of one table: for each map in what share of the contexts each bin was filled."""

    filled: Mapping[str, Floats]
    is_exact: bool
    space: Declared
    axes: Mapping[str, str]
    """The conditions that defined which movements are wanted."""


def read_baseline(text: str, file: str) -> dict[str, Earlier]:
    """What an earlier report says, by the name of each table. Raises ContextError where it is no such report, or its bins are
    others."""
    try:
        document = baseline_of(text)
        if document["bins"] != json.loads(json.dumps(about_bins())):
            raise ValueError("its bins are others, of another version")
        if not document["tables"]:
            raise ValueError("it has no tables, so nothing would be compared")
        return {_name(entry): _earlier(entry) for entry in document["tables"]}
    except (ValueError, KeyError, TypeError, AttributeError) as error:
        why = f"{error} is missing" if isinstance(error, KeyError) else str(error)
        raise ContextError(Fault(f"the baseline cannot be read: {why}.", BASELINE, "to write it again", Place(file))) from None


def _name(entry: Mapping[str, Any]) -> str:
    return str(entry["table"]) if entry["table"] is not None else ", ".join(map(str, entry["databases"]))


def _earlier(entry: Mapping[str, Any]) -> Earlier:
    filled = {name: np.array(entry["maps"][name]["filled"], np.float64) for name in MAPS}
    for name, shares in filled.items():
        if shares.shape != MAPS[name].shape or not all(
            math.isfinite(share) and 0 <= share <= 1 for share in shares.ravel().tolist()
        ):
            raise ValueError(f'"filled" of the map {in_quotes(name)} are no shares from 0 to 1')
    contexts = entry["contexts"]
    axes = {str(axis): str(name) for axis, name in contexts["asked_by"].items()}
    return Earlier(filled, contexts["method"] == "exact", require_declared(entry["space"]), axes)


def lost_since(motion: TableMotion, earlier: Earlier) -> tuple[Lost, ...]:
    """The bins that are filled in a smaller share of the contexts than they were; those that lost most first. Movement ahead is
    reported in the map of turns."""
    slack = EXACT if motion.is_exact and earlier.is_exact else DRAWN
    lost = []
    for name, before in earlier.filled.items():
        now = motion.coverage.filled_shares[name]
        for row, column in np.argwhere(now < before - slack).tolist():
            if name == DIRECTION and column == MAPS[name].centre:
                continue
            lost.append(Lost(name, row, column, float(before[row, column]), float(now[row, column])))
    return tuple(sorted(lost, key=lambda each: (each.now - each.before, each.map, each.row, each.column)))


# ---- words that several formats share


def is_ahead_alone(of: Map, frames: Counts, holes: Floats) -> bool:
    """Whether the map of directions has nothing to show but what goes ahead, of which the map of turns tells more."""
    others = np.arange(of.shape[1]) != of.centre
    return of.name == DIRECTION and not frames[:, others].any() and not (holes > 0.0).any()


def capture_sentence(each: ToCapture) -> str:
    """What to capture, what that brings, and where it is missing."""
    sides = ", and the other side by its mirror" if each.is_both_sides else ""
    moves = (
        f"; {some(each.elsewhere)} {'moves' if len(each.elsewhere) == 1 else 'move'} like this, but not valid there"
        if each.elsewhere
        else ""
    )
    fills, contexts = format_percent(each.fills, 1), format_percent(each.contexts, 1)
    return f"{each.words}: fills {fills} of what is wanted{sides}; missing in {contexts} of the contexts{moves}"


def worst_contexts(measured: MotionMeasured) -> list[ContextCoverage]:
    """The contexts with holes, those first in which most is missing: share times the holes' share of what is wanted."""
    with_holes = [each for each in measured.motion.coverage.contexts if each.n_holes]
    return sorted(with_holes, key=lambda each: (-each.contexts.share * (1.0 - each.covered), each.contexts.id))


def context_words(each: ContextCoverage) -> str:
    return cells_text(each.contexts.cells)


def hole_words(each: ContextCoverage) -> list[str]:
    """The holes of some contexts."""
    return [MAPS[name].words(row, column) for name, holes in each.holes.items() for row, column in np.argwhere(holes).tolist()]
