"""What `motion measure` hands to its renderers: the measures of each session, their thresholds, and an earlier report.

Data only; the same results give the same bytes.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import ClassVar

from contextdb.covering import format_percent
from contextdb.errors import ContextError, Fault, Place, in_quotes, plural
from contextdb.files.reports import baseline_of, with_marks
from contextdb.findings import Finding
from contextdb.motion.measuring.measures import Measures
from contextdb.motion.measuring.parts import NO_CHANGE, NO_FORCED, NO_JUMP, NO_REST
from contextdb.motion.trace.stats import ForcedBy
from contextdb.report.document import Block, Document, Listing, Section, Table
from contextdb.report.results import CheckReport, Gate, Subject, as_path

NOTHING_TO_EXCEED = (NO_FORCED, NO_JUMP, NO_CHANGE, NO_REST)
"""A measure that is missing for such a reason meets every threshold."""
SLACK = 0.01
"""A measure is worse than before when it is larger by more than this share."""
_AGAIN = "to write the baseline again"
BASELINE = "a report of `contextdb motion measure --json`"


@dataclass(frozen=True, slots=True)
class Line:
    """A measure as people read it: its name, those of its keys, and how many decimals it has; percent where they are negative."""

    label: str
    key: str
    raw: str = ""
    decimals: int = 1
    is_worse_when_larger: bool = False

    def text(self, value: object) -> str:
        """A value in words; "-" where there is none."""
        if not isinstance(value, (int, float)):
            return "-"
        return format_percent(value, 1).removesuffix(" %") if self.decimals < 0 else f"{value:,.{self.decimals}f}"


LINES = (
    Line("jumps a second", "jumps_per_s", decimals=2, is_worse_when_larger=True),
    Line("forced jumps", "forced_jumps", decimals=0, is_worse_when_larger=True),
    Line("most expensive forced jump", "forced_cost", decimals=3, is_worse_when_larger=True),
    Line("jump, cm", "jump_cm", is_worse_when_larger=True),
    Line("jump, worst joint, 95 %, cm", "jump_worst_cm", is_worse_when_larger=True),
    Line("jump, velocity, m/s", "jump_mps", decimals=2, is_worse_when_larger=True),
    Line("skate, cm/s", "skate_cm_s", "skate_raw_cm_s", is_worse_when_larger=True),
    Line("of it in the clips' frames, cm/s", "skate_played_cm_s"),
    Line("skate, worst second, cm/s", "skate_worst_cm_s"),
    Line("skate, toe down in the clip, cm/s", "skate_toe_cm_s", "skate_toe_raw_cm_s", is_worse_when_larger=True),
    Line("that in the worst second, cm/s", "skate_toe_worst_cm_s"),
    Line("skate, m/min", "skate_m_min", "skate_raw_m_min", is_worse_when_larger=True),
    Line("weighted skate, cm/s", "skate_weighted_cm_s", "skate_weighted_raw_cm_s"),
    Line("skate ratio, %", "skate_ratio", "skate_ratio_raw", decimals=-1),
    Line("feet below the floor, cm", "penetration_cm", "penetration_raw_cm"),
    Line("knees at their limit, %", "knee_limit_share", "knee_limit_raw_share", decimals=-1),
    Line("deepest dip of the hips, cm", "hip_dip_cm", is_worse_when_larger=True),
    Line("hips off the feet at rest, cm", "hips_off_feet_cm", is_worse_when_larger=True),
    Line("lean at rest, degrees", "lean_deg", "lean_raw_deg"),
    Line("acceleration, 99 %, m/s²", "accel_p99", "accel_raw_p99", is_worse_when_larger=True),
    Line("acceleration, worst second", "accel_worst"),
    Line("snaps, %", "snap_share", decimals=-1, is_worse_when_larger=True),
    Line("path error, RMS, m", "path_rms_m", decimals=3, is_worse_when_larger=True),
    Line("path error, 95 %, m", "path_p95_m", decimals=3),
    Line("heading error, RMS, degrees", "heading_rms_deg", is_worse_when_larger=True),
    Line("heading error, 95 %, degrees", "heading_p95_deg"),
    Line("new velocity reached, s", "reach_s", decimals=2, is_worse_when_larger=True),
    Line("new direction, s", "reach_direction_s", decimals=2),
    Line("new speed, s", "reach_speed_s", decimals=2),
    Line("stop, s", "reach_stop_s", decimals=2),
    Line("new velocities not reached", "n_missed", decimals=0),
    Line("stay in a clip, s", "stay_s", decimals=2),
    Line("frames used, %", "frames_used_share", decimals=-1),
    Line("assets used, %", "assets_used_share", decimals=-1),
    Line("frames that can never play, %", "frames_unusable_share", decimals=-1),
)
OF_KEY = {line.key: line for line in LINES}
COMPARED = tuple(line for line in LINES if line.is_worse_when_larger)


@dataclass(frozen=True, slots=True)
class Bar:
    """The most that a measure may be, by an option of the command."""

    option: str
    key: str
    most: float


@dataclass(frozen=True)
class SessionMeasures:
    """One session: its file, its measures, those of the baseline by name, its gates, and which columns forced jumps."""

    file: str
    measures: Measures
    before: Mapping[str, object]
    gates: tuple[Gate, ...]
    forced_by: tuple[ForcedBy, ...] = ()

    @property
    def headline(self) -> str:
        return f"{self.measures.seconds:.2f} s, {plural(self.measures.updates, 'update')}, {plural(self.measures.jumps, 'jump')}"

    def rows(self) -> Iterator[tuple[str, str, str, str]]:
        """Each measure that exists: its name, its value, that of the raw clips, and that of the baseline."""
        values = self.measures.to_json()
        for line in LINES:
            value, raw = values[line.key], values.get(line.raw)
            if value is not None or raw is not None:
                before = line.text(self.before[line.key]) if self.before.get(line.key) is not None else ""
                yield line.label, line.text(value), "" if raw is None else line.text(raw), before

    def not_measured(self) -> Iterator[str]:
        """Why measures are missing, one sentence a reason; that there was nothing to measure is no reason."""
        of: dict[str, list[str]] = {}
        for key, why in self.measures.missing.items():
            if why not in NOTHING_TO_EXCEED and key in OF_KEY:
                of.setdefault(why, []).append(OF_KEY[key].label)
        return (f"not measured, as {why}: {'; '.join(labels)}" for why, labels in of.items())

    @property
    def to_do(self) -> str:
        """What to do first, in a sentence; where no bar is set, which would hold what is measured now."""
        over = [gate for gate in self.gates if not gate.passed]
        if over:
            return f"To do first: {over[0].message}"
        if self.forced_by:
            columns, jumps = " and ".join(self.forced_by[0].columns), plural(self.forced_by[0].jumps, "forced jump")
            return f"To do first: make the cells of {columns} soft, or Any, where they end what plays: {jumps}."
        if self.gates:
            is_baseline = all(gate.name.startswith("baseline") for gate in self.gates)
            return f"Nothing to do: {'nothing is worse than before' if is_baseline else 'every measure is within its bar'}."
        now = {"--max-skate": self.measures.skate_cm_s, "--max-jumps": self.measures.jumps_per_s}
        bars = " ".join(f"{option} {math.floor(value * 10 + 1) / 10:g}" for option, value in now.items() if value is not None)
        return f"To do first: let a build hold what is reached: {bars}." if bars else "Nothing to do: no bar is set."

    def to_json(self) -> dict[str, object]:
        forced = [each.to_json() for each in self.forced_by]
        gates = [gate.to_json() for gate in self.gates]
        return {
            "file": as_path(self.file),
            **self.measures.to_json(),
            "to_do": self.to_do,
            "forced_by": forced,
            "bars": gates,
        }


@dataclass(frozen=True)
class MeasureResults:
    """All sessions."""

    subject: ClassVar[Subject] = "measures"
    sessions: tuple[SessionMeasures, ...]

    @property
    def passed(self) -> bool:
        """Whether every threshold is met and nothing is worse than in the baseline."""
        return all(gate.passed for session in self.sessions for gate in session.gates)

    def to_json(self) -> dict[str, object]:
        return with_marks({"format": 1, "sessions": [session.to_json() for session in self.sessions]})

    def as_check(self) -> CheckReport:
        """The missed thresholds, as findings."""
        broken = ((session.file, gate) for session in self.sessions for gate in session.gates if not gate.passed)
        return CheckReport((), tuple(Finding(gate.name, "error", gate.message, file=file) for file, gate in broken))


def held_to(bar: Bar, measures: Measures, file: str) -> Gate:
    """The gate of a threshold. Raises ContextError where the measure is missing and the answer therefore unknown."""
    value, line = getattr(measures, bar.key), OF_KEY[bar.key]
    limit = line.text(bar.most)
    if value is None:
        why = measures.missing.get(bar.key, "")
        if why not in NOTHING_TO_EXCEED:
            fault = f"--{bar.option} cannot be judged: {why}."
            raise ContextError(Fault(fault, "a session of a project, or --poses and --project with it", place=Place(file)))
        return Gate(bar.option, bar.most, None, True, f"{line.label}: {why}.")
    passed = bool(value <= bar.most)
    message = f"{line.label}: {line.text(value)}, {'within' if passed else 'more than'} {limit}."
    return Gate(bar.option, bar.most, float(value), passed, message)


def compared(before: Mapping[str, object], measures: Measures) -> Iterator[Gate]:
    """A gate for each measure of an earlier report: it is worse when it is larger by more than 1 %, or not measured any more."""
    for line in COMPARED:
        old, new = before.get(line.key), getattr(measures, line.key)
        if not isinstance(old, (int, float)):
            continue
        name, why = f"baseline {line.key}", measures.missing.get(line.key, "")
        if new is None:
            passed = why in NOTHING_TO_EXCEED
            yield Gate(name, float(old), None, passed, f"{line.label}: not measured, before {line.text(old)}: {why}.")
            continue
        passed = bool(new <= old + SLACK * abs(old) + 1e-9)
        verdict = "no worse" if passed else "worse"
        yield Gate(name, float(old), float(new), passed, f"{line.label}: {line.text(new)}, {verdict} than {line.text(old)} before.")


def read_baseline(text: str, file: str) -> dict[str, Mapping[str, object]]:
    """The sessions of an earlier report, by file. Raises ContextError for what is none."""
    try:
        document = baseline_of(text)
        sessions: list[tuple[str, dict[str, object]]] = [(as_path(str(each["file"])), dict(each)) for each in document["sessions"]]
    except (ValueError, KeyError, TypeError, AttributeError) as error:
        why = str(error) if type(error) is ValueError else "it has no format and sessions"
        raise ContextError(Fault(f"the baseline is not a report of measures: {why}.", BASELINE, place=Place(file))) from None
    found_in = dict[str, Mapping[str, object]]()
    for name, session in sessions:
        if why := "is there twice" if name in found_in else _no_measure(session):
            raise ContextError(Fault(f"in the baseline {in_quotes(name)} {why}.", BASELINE, _AGAIN, Place(file)))
        found_in[name] = session
    return found_in


def _no_measure(session: Mapping[str, object]) -> str:
    """Which measure of a session of a report is none, as the end of a sentence; empty where all are numbers or null."""
    for line in COMPARED:
        value = session.get(line.key, "missing")
        is_number = isinstance(value, (int, float)) and not isinstance(value, bool) and math.isfinite(value)
        if value is not None and not is_number:
            return f"has no number as {in_quotes(line.key)}"
    return ""


# ---- measures as a document: one table a session with columns for raw clips and the baseline

HEADERS = ("measure", "session", "raw clips", "before")


def document(results: MeasureResults, shows_all: bool = False, is_page: bool = False) -> Document:
    return Document("motion measure", "session", [_section(session, shows_all) for session in results.sessions])


def _section(session: SessionMeasures, shows_all: bool) -> Section:
    rows = list(session.rows())
    used = [i for i in range(len(HEADERS)) if i < 2 or any(row[i] for row in rows)]
    head, *body = [[row[i] for i in used] for row in (HEADERS, *rows)]
    never = [in_quotes(name) for name in session.measures.assets_never_used or ()]
    forced = [each.sentence(session.measures.forced_jumps) for each in session.forced_by]
    blocks: list[Block] = [
        Table(head, body),
        *forced,
        *session.not_measured(),
        *([Listing("never played", never)] if never else []),
    ]
    return Section(session.file, session.headline, [session.to_do], blocks, _gates(session, shows_all))


def _gates(session: SessionMeasures, shows_all: bool) -> list[Gate]:
    """The thresholds; of the comparisons with the baseline those that fail, or one that says that none does."""
    compared = [gate for gate in session.gates if gate.name.startswith("baseline")]
    gates = [gate for gate in session.gates if shows_all or gate not in compared or not gate.passed]
    is_no_worse = bool(compared) and all(gate.passed for gate in compared)
    return [*gates, Gate("baseline", 0.0, 0.0, True, "nothing is worse")] if is_no_worse else gates
