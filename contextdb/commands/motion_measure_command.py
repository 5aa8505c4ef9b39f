"""Measure how good the motion of recorded sessions is: jumps, sliding feet, accelerations, path errors, and what is never played.

The poses of a session are made again from the clips of its project, whose raw clips are measured too. A SESSION may also be a
.npz file of poses, with --project for the clips.

Exits with 1 if a measure is over its bar, more than 1 % worse than in the baseline, or not measured any more; with 2 if a bar
cannot be judged, or the baseline is of other sessions.

  contextdb motion measure session.parquet --max-skate 8 --max-jumps 1.5
  contextdb motion measure session.parquet --json > before.json
  contextdb motion measure session.parquet --baseline before.json
"""

from __future__ import annotations

import argparse
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

from contextdb import report
from contextdb.commands import add_format_arguments, deliver, is_coloured
from contextdb.commands.gating import earlier_report
from contextdb.commands.motion_build_command import MotionProject, warn
from contextdb.commands.motion_replay_command import project_of
from contextdb.commands.numbers import number_type
from contextdb.compiled.table import CompiledTable
from contextdb.console import ExitCode, terminal_width
from contextdb.errors import ContextDBError, ContextError, Fault, Place, in_quotes, plural
from contextdb.motion import Measures, MotionDatabase, PoseBank, PoseSettings, measure, open_or_build, open_or_build_poses
from contextdb.motion.storage.written_poses import NPZ
from contextdb.motion.trace.filter_rows import fingerprint
from contextdb.motion.trace.session import Trace
from contextdb.motion.trace.stats import forced_by
from contextdb.report.measure_results import BASELINE, Bar, MeasureResults, SessionMeasures, compared, held_to, read_baseline
from contextdb.report.results import Gate, as_path

BARS = {
    "skate": ("skate_cm_s", "CM_S", "the most that planted feet may slide, cm/s"),
    "toe-skate": ("skate_toe_cm_s", "CM_S", "the most that toes may slide that are low and slow in their clips, cm/s"),
    "dip": ("hip_dip_cm", "CM", "the most that hips may be lower than in their clips, cm"),
    "balance": ("hips_off_feet_cm", "CM", "the most that hips may be off their place over the feet at rest, cm"),
    "jumps": ("jumps_per_s", "PER_S", "the most jumps a second"),
    "accel": ("accel_p99", "M_S2", "the most that 99 %% of joint accelerations may be, m/s²"),
    "path": ("path_rms_m", "M", "the most that the path error may be, RMS, m"),
    "heading": ("heading_rms_deg", "DEG", "the most that the heading error may be, RMS, degrees"),
    "reach": ("reach_s", "S", "the most seconds until a new velocity is reached"),
    "forced": ("forced_jumps", "N", "the most forced jumps"),
    "forced-cost": ("forced_cost", "COST", "the most that a forced jump may cost"),
}


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("sessions", metavar="SESSION", nargs="+", help="a recorded session, .parquet; or its poses, .npz")
    parser.add_argument("--poses", metavar="FILE", action="append", help="the poses of the session, .npz; once for each")
    parser.add_argument("--project", metavar="FOLDER", help="the project with the clips (default: as recorded)")
    parser.add_argument("--controller", metavar="NAME", help="whose [output.NAME] makes the poses (default: as recorded)")
    add_bars(parser)
    parser.add_argument("--baseline", metavar="FILE", help="an earlier report by --json; what got worse fails")
    parser.add_argument("--all", action="store_true", help="every asset that is never played, and every comparison")
    add_format_arguments(parser, report.formats("measures"))


def run(arguments: argparse.Namespace) -> ExitCode:
    poses = arguments.poses or []
    if poses and len(poses) != len(arguments.sessions):
        fault = f"{plural(len(poses), 'file')} of poses for {plural(len(arguments.sessions), 'session')}."
        raise ContextError(Fault(fault, "--poses FILE once for each session, in their order"))
    results = _results(arguments, poses)
    colour = is_coloured(arguments)
    text = report.render(arguments.format, results, colour=colour, width=terminal_width(), shows_all=arguments.all)
    deliver(text, arguments)
    return ExitCode.OK if results.passed else ExitCode.FOUND


def _results(arguments: argparse.Namespace, poses: Sequence[str]) -> MeasureResults:
    earlier: Mapping[str, Mapping[str, object]] = {}
    if arguments.baseline:
        earlier = earlier_report(arguments.baseline, read_baseline, BASELINE)
    _require_same_sessions(earlier, arguments)
    clips: dict[str, Clips] = {}
    every = [
        _measured(arguments, file, poses[i] if poses else None, clips, _before(earlier, file))
        for i, file in enumerate(arguments.sessions)
    ]
    return MeasureResults(tuple(every))


def _require_same_sessions(earlier: Mapping[str, object], arguments: argparse.Namespace) -> None:
    """Raise ContextError unless the baseline has the sessions that are measured, or one session and one is measured."""
    names = list(map(as_path, arguments.sessions))
    if not arguments.baseline or (len(earlier) == len(names) == 1):
        return
    faults = [
        Fault(f"the baseline has no session {in_quotes(name)}.", "a report of the same sessions")
        for name in names
        if name not in earlier
    ]
    left = [name for name in earlier if name not in names]
    faults += [Fault(f"the session {in_quotes(name)} of the baseline is not measured.", "the same sessions") for name in left]
    if faults:
        raise ContextError(*(fault.at(Place(arguments.baseline)) for fault in faults))


def _before(earlier: Mapping[str, Mapping[str, object]], file: str) -> Mapping[str, object]:
    """The session of the baseline: of this name, or the only one where there is one only."""
    return earlier.get(as_path(file)) or next(iter(earlier.values()), {})


@dataclass(frozen=True)
class Clips:
    """The clips of a project: its databases and pose banks, opened or built when they are first used."""

    project: MotionProject

    @cached_property
    def banks(self) -> dict[str, PoseBank]:
        return open_or_build_poses(self.project.config, self.project.folder, self.project.assets)

    @cached_property
    def databases(self) -> dict[str, MotionDatabase]:
        return open_or_build(self.project.config, self.project.folder, self.project.assets)

    @cached_property
    def tables(self) -> dict[str, CompiledTable]:
        """The compiled table of each database that has one."""
        compiled = {name: table.compile() for name, table in self.project.tables.items()}
        return {name: compiled[each.table] for name, each in self.project.config.databases.items() if each.table in compiled}


def _measured(
    arguments: argparse.Namespace, file: str, poses: str | None, known: dict[str, Clips], before: Mapping[str, object]
) -> SessionMeasures:
    trace = None if Path(file).suffix == NPZ else Trace.load(file)
    if trace is None and poses:
        raise ContextError(Fault("--poses goes with a session, and these are poses.", "a .parquet session", place=Place(file)))
    folder, why = (arguments.project, "") if trace is None else project_of(trace, arguments.project, file)
    clips = known.setdefault(folder, Clips(MotionProject.load(folder))) if folder else None
    try:
        banks, databases = _of(clips, trace, file)
        measures = measure(
            file if trace is None else trace,
            banks or None,
            poses=poses,
            databases=databases or None,
            settings=_settings(arguments, clips, trace),
        )
    except ContextDBError as error:
        raise type(error)(*(fault if fault.place.file else fault.at(Place(file)) for fault in error.faults)) from None
    if why:
        warn([f"{file}: without clips to compare with: {why}"])
    gates = (*gates_of(arguments, measures, file), *compared(before, measures))
    forced = [] if clips is None or trace is None else forced_by(trace.brief(), clips.tables)
    return SessionMeasures(file, measures, before, gates, tuple(forced))


def add_bars(parser: argparse.ArgumentParser) -> None:
    """The options of the bars, `--max-NAME`."""
    for name, (_, unit, meaning) in BARS.items():
        parser.add_argument(f"--max-{name}", metavar=unit, type=number_type("a bar. Accepted: a number from 0 up."), help=meaning)


def gates_of(arguments: argparse.Namespace, measures: Measures, file: str) -> list[Gate]:
    """The gate of each bar that the options set. Raises ContextError for one that cannot be judged."""
    limits = {name: getattr(arguments, f"max_{name.replace('-', '_')}") for name in BARS}
    bars = [Bar(f"max-{name}", BARS[name][0], most) for name, most in limits.items() if most is not None]
    return [held_to(bar, measures, file) for bar in bars]


def _of(clips: Clips | None, trace: Trace | None, file: str) -> tuple[Mapping[str, PoseBank], Mapping[str, MotionDatabase]]:
    """The pose banks and databases of a session, with a word where a database is another than the recorded one."""
    if clips is None:
        return {}, {}
    if trace is None:
        return clips.banks, clips.databases
    names = [name for name in trace.about if name in clips.databases]
    others = [name for name in names if fingerprint(clips.databases[name]) != trace.about[name].get("digest")]
    warn(f"{file}: the database {in_quotes(name)} is another than the one that the session was recorded with" for name in others)
    return {name: clips.banks[name] for name in names}, {name: clips.databases[name] for name in names}


def _settings(arguments: argparse.Namespace, clips: Clips | None, trace: Trace | None) -> PoseSettings | None:
    if clips is None:
        return None
    recorded = [] if trace is None else [str(about["controller"]) for about in trace.about.values() if "controller" in about]
    name = arguments.controller or (recorded[0] if recorded else "")
    if arguments.controller:
        clips.project.config.selector_of(name)
    return clips.project.config.output_of(name)
