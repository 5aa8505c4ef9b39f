"""Drive a character by itself over the contexts of its tables, and measure how well it moves.

Speeds and contexts are chosen from what the tables ask and allow, and reported. Each drive is measured as by `contextdb motion
measure`. Exits with 1 if a drive is over a bar; with 2 if a bar cannot be judged.

  contextdb motion probe game/ player --drive straight --drive circle --speed 1.3
  contextdb motion probe game/ player --out probed/ --max-skate 6 --max-jumps 1.5
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from contextdb.commands import answer
from contextdb.commands.motion_measure_command import add_bars, gates_of
from contextdb.commands.motion_run_command import character_of, say_where
from contextdb.commands.motion_stage import Stage, context_text
from contextdb.commands.numbers import number_type, rate_of
from contextdb.compiled.table import CompiledTable
from contextdb.console import ExitCode, aligned, note, progress
from contextdb.disk import make_folder
from contextdb.disk.boundary import inside
from contextdb.errors import ContextDBError, Fault, FileError, Place, plural, some
from contextdb.motion import Character, Measures, Pose, Trace, measure
from contextdb.motion.characters.drives import Drive, drives, steered
from contextdb.motion.characters.probing import Plan, Scene, plan_of
from contextdb.motion.trace.stats import ForcedBy, forced_by, together

_SPEED = number_type("a speed to drive at. Accepted: 0.1 to 100 m/s, such as 1.3.", 0.1, 100.0)
KINDS = ("straight", "turns", "circle", "eight", "speeds", "stops")
COLUMNS = {
    "jumps_per_s": ("jumps/s", 2),
    "forced_jumps": ("forced", 0),
    "skate_cm_s": ("skate cm/s", 1),
    "skate_toe_cm_s": ("toe down", 1),
    "skate_toe_raw_cm_s": ("in clips", 1),
    "accel_p99": ("accel m/s²", 0),
    "accel_raw_p99": ("in clips", 0),
    "path_rms_m": ("path m", 2),
    "heading_rms_deg": ("heading °", 1),
    "reach_s": ("reach s", 2),
    "stay_s": ("stay s", 1),
}


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("path", metavar="PATH", help="a folder of tables, or its contextdb.toml")
    parser.add_argument("controller", metavar="CONTROLLER", help="the name of a [controllers.NAME]")
    parser.add_argument(
        "--drive", metavar="KIND", choices=KINDS, action="append", help=f"only this: {', '.join(KINDS)}; repeatable"
    )
    parser.add_argument("--speed", metavar="M/S", type=_SPEED, action="append", help="drive at this speed; may be repeated")
    parser.add_argument("--rate", metavar="HZ", type=rate_of, help="updates per second (default: the rate of the features)")
    parser.add_argument("--out", metavar="FOLDER", help="save the session of each drive in this folder")
    add_bars(parser)
    parser.add_argument("--json", action="store_true", help="a JSON document instead of text")


@dataclass(frozen=True, eq=False)
class Probe:
    """One drive in one scene, and its measures."""

    scene: Scene
    drive: Drive
    file: str
    measures: Measures
    forced_by: Sequence[ForcedBy]

    @property
    def name(self) -> str:
        return f"{self.scene.name} {self.drive.name} at {self.drive.speed_mps:g} m/s".strip()


def run(arguments: argparse.Namespace) -> ExitCode:
    """Drive, measure and report."""
    stage = Stage.of(arguments.path, lambda config: config.played_by(arguments.controller))
    character = character_of(stage, arguments.controller, unknown="any")
    if character.stream is None:
        raise ContextDBError(Fault("there is no clip that the character could play.", "a database with a clip"))
    plan = plan_of(character, arguments.speed or ())
    note(*_chosen(plan))
    wanted = [(scene, drive) for scene in plan.scenes for drive in _drives(scene, arguments.drive)]
    if not wanted:
        fault = "no context of the tables lets the character move: nothing can be driven."
        raise ContextDBError(Fault(fault, "rows for moving clips; contextdb check says more"))
    folder = None if arguments.out is None else _folder(Path(arguments.out))
    rate = character.schema.rate if arguments.rate is None else arguments.rate
    probes = []
    for scene, drive in progress(wanted, "driving"):
        probe, trace = _probe(character, scene, drive, rate, folder)
        if probe.file:
            say_where(trace, stage, arguments.controller, Path(probe.file))
            trace.save(probe.file, timings=False)
        probes.append(probe)
    over = list(_over(probes, arguments))
    answer(arguments, lambda: _document(plan, probes), lambda: _lines(probes))
    note(*over)
    return ExitCode.FOUND if over else ExitCode.OK


def _chosen(plan: Plan) -> Iterator[str]:
    for scene in plan.scenes:
        speeds = ", ".join(f"{speed:g}" for speed in scene.speeds_mps)
        yield f"drives {scene.name or 'without a context'} at {speeds} m/s"
        for facts, served in scene.following:
            facts_text = " ".join(f"{name}={value}" for name, value in facts.items())
            yield f"  {facts_text} while the stick asks for about {served[0]:.1f} to {served[-1]:.1f} m/s"
    if plan.left_open:
        yield f"left open, as their values cannot be listed: {some(plan.left_open)}"


def _drives(scene: Scene, kinds: Sequence[str] | None) -> Iterator[Drive]:
    for speed in scene.speeds_mps:
        yield from (each for each in drives(speed) if kinds is None or any(kind in each.name for kind in kinds))


def _probe(character: Character, scene: Scene, drive: Drive, rate: float, folder: Path | None) -> tuple[Probe, Trace]:
    """Drive a copy of the character and measure it; the file that its session is to be saved to, if any, and the session."""
    driven = character.copy()
    trace = driven.record(0)
    poses: list[Pose] = []
    sticks = []
    for stick, updated in steered(driven, drive, rate, scene.at):
        assert updated.pose is not None, "a character with a stream has a pose"
        poses.append(updated.pose)
        sticks.append(stick)
    words = f"{scene.name} {drive.name} {drive.speed_mps:g}".replace("=", "-").split()
    file = "" if folder is None else str(inside(folder / f"{'_'.join(words)}.parquet", folder))
    tables = character.tables if isinstance(character.tables, Mapping) else {}
    forced = forced_by(trace.brief(), {name: table for name, table in tables.items() if isinstance(table, CompiledTable)})
    return Probe(scene, drive, file, _measured(driven, trace, poses, sticks), forced), trace


def _measured(character: Character, trace: Trace, poses: Sequence[Pose], sticks: Sequence[tuple[float, float]]) -> Measures:
    assert character.stream is not None, "a character with poses has a stream"
    databases = character.controller.selector.databases
    return measure(trace, character.stream.banks, poses=poses, databases=databases, wanted=sticks)


def _over(probes: Sequence[Probe], arguments: argparse.Namespace) -> Iterator[str]:
    """Each bar that a drive is over."""
    for probe in probes:
        for gate in gates_of(arguments, probe.measures, probe.name):
            if not gate.passed:
                yield f"{probe.name}: {gate.message}"


def _document(plan: Plan, probes: Sequence[Probe]) -> dict[str, Any]:
    sessions = [
        {
            "file": probe.file,
            "drive": probe.drive.name,
            "speed_mps": probe.drive.speed_mps,
            "facts": context_text(probe.scene.facts),
            **probe.measures.to_json(),
            "forced_by": [each.to_json() for each in probe.forced_by],
        }
        for probe in probes
    ]
    return {"contexts": plan.n_contexts, "left_open": list(plan.left_open), "sessions": sessions}


def _lines(probes: Sequence[Probe]) -> Iterator[str]:
    """A table for each context: a line for each drive."""
    for scene in dict.fromkeys(probe.scene for probe in probes):
        own = [probe for probe in probes if probe.scene is scene]
        yield from ((scene.name, "") if scene.name else ())
        header = ("drive", "m/s", *(name for name, _ in COLUMNS.values()))
        rows = [(each.drive.name, f"{each.drive.speed_mps:g}", *_cells(each.measures)) for each in own]
        yield from aligned([header, *rows], right=range(1, len(header)))
        n_forced = sum(each.measures.forced_jumps for each in own)
        yield from (each.sentence(n_forced) for each in together(part for probe in own for part in probe.forced_by))
        yield ""
    yield plural(len(probes), "drive")


def _cells(measures: Measures) -> Iterator[str]:
    for key, (_, digits) in COLUMNS.items():
        value = getattr(measures, key)
        yield "" if value is None else f"{value:.{digits}f}"


def _folder(folder: Path) -> Path:
    if folder.is_file():
        raise FileError(Fault("this is a file.", "a folder", place=Place(str(folder))))
    make_folder(folder)
    return folder
