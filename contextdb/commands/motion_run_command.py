"""Steer a character along a recorded stick, and record every decision: the same files give the same session.

STICK is a CSV or Parquet file with a row for each moment, which lasts until the next. Its columns are time_s; speed_mps, turn_dps
and strafe_deg as for `motion search`, or x_mps and z_mps, a velocity over the ground, and facing_deg. All other columns are facts.

With --poses the poses of the character are written too, as BVH, as arrays of numpy or as glTF; [output.CONTROLLER] says how they
are made.

Exits with 1 if nothing ever plays.

  contextdb motion run game/ player stick.csv --out session.parquet
  contextdb motion run game/ player stick.csv --out session.parquet --poses session.bvh
  contextdb motion replay session.parquet
"""

from __future__ import annotations

import argparse
import math
import os
import random
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from contextdb.cells.facts import UNKNOWN_MODES
from contextdb.commands.motion_stage import Stage, reach_s
from contextdb.commands.motion_stick import Moments, Stick, conditions_of
from contextdb.console import ExitCode, output, progress
from contextdb.disk import path_in_quotes
from contextdb.errors import Fault, FileError, Place, in_quotes
from contextdb.motion import (
    Decision,
    FeatureSchema,
    Pose,
    PoseBank,
    PoseStream,
    Trajectory,
    open_or_build_poses,
    steady_path,
    with_path,
    write_poses,
)
from contextdb.motion.clips.steering import Steered, steered_path
from contextdb.motion.features.extraction import Features
from contextdb.motion.selection.controller import Controller
from contextdb.motion.storage.written_poses import pose_file
from contextdb.motion.trace.session import Trace
from contextdb.motion.trace.views import summary_line
from contextdb.report.render_json import as_json
from contextdb.tables.table import leaf_assets

SUFFIX = ".parquet"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """The arguments of the command."""
    parser.add_argument("path", metavar="PATH", help="a folder of tables, or its contextdb.toml")
    parser.add_argument("controller", metavar="CONTROLLER", help="the name of a [controllers.NAME]")
    parser.add_argument("stick", metavar="STICK", help="a CSV or Parquet file of what the player requests, moment by moment")
    parser.add_argument("--out", metavar="FILE", required=True, help=f"the session to write: a {SUFFIX} file")
    parser.add_argument("--poses", metavar="FILE", help="write the poses to this file too: .bvh, .npz or .glb")
    parser.add_argument("--rate", metavar="HZ", type=_rate, help="updates per second (default: the rate of the features)")
    parser.add_argument("--k", metavar="N", type=_count, default=12, help="candidates of each search to keep (default: 12)")
    parser.add_argument("--seed", metavar="N", type=_seed, default=0, help="seed of the controller's variation (default: 0)")
    parser.add_argument("--unknown", choices=UNKNOWN_MODES, default="error", help="how to treat a missing fact (default: error)")
    parser.add_argument("--json", action="store_true", help="a JSON document instead of text")


def run(arguments: argparse.Namespace) -> ExitCode:
    """Run a controller along a stick."""
    out = _out_file(Path(arguments.out), Path(arguments.stick))
    poses_out = None if arguments.poses is None else _checked_file(pose_file(arguments.poses), Path(arguments.stick), "the poses")
    stage = Stage.of(arguments.path, lambda config: config.databases_of(config.selector_of(arguments.controller)))
    controller = stage.config.controller(arguments.controller, stage.databases, rng=random.Random(arguments.seed))
    trace = controller.recorder = Trace(arguments.k, controller.selector.databases)
    trace.about = {name: {**about, **_project(stage.folder, out)} for name, about in trace.about.items()}
    names = list(controller.selector.names)
    tables = stage.tables(names)
    path = Path(arguments.stick)
    stick = Stick.read(path, conditions_of(tables))
    table_of = {name: table for name in names if (table := stage.config.databases[name].table) is not None}
    moments = Moments.read(path, table_of, tables, arguments.unknown)
    schema = stage.schema(names[0])
    rate = schema.rate if arguments.rate is None else arguments.rate
    show = None if poses_out is None else Show.of(stage, arguments.controller, names)
    steer(controller, schema, stick, moments, rate, show)
    trace.save(out, timings=False)
    if show is not None and poses_out is not None:
        show.write(poses_out, rate)
    with output():
        if arguments.json:
            print(as_json({"format": 1, "file": str(out), "updates": len(trace), "bytes": out.stat().st_size}), end="")
        else:
            print(summary_line(trace.brief()))
    return ExitCode.OK if any(decision.playing is not None for decision in trace.brief()) else ExitCode.FOUND


def _project(folder: Path, out: Path) -> dict[str, str]:
    """Where the project is, seen from the session; nothing where no relative path leads there."""
    try:
        return {"project": Path(os.path.relpath(folder, out.parent)).as_posix()}
    except ValueError:  # another drive
        return {}


@dataclass(frozen=True, eq=False)
class Show:
    """The poses of a character, as they are made."""

    stream: PoseStream
    bank: PoseBank
    poses: list[Pose] = field(default_factory=list)

    @classmethod
    def of(cls, stage: Stage, controller: str, names: Sequence[str]) -> Show:
        """For the controller of a name over some databases."""
        assets = {table: leaf_assets(stage.project[table]) for table in stage.project.tables}
        banks = open_or_build_poses(stage.config, stage.folder, assets, names=names)
        return cls(PoseStream(banks, stage.config.output_of(controller)), banks[names[0]])

    def take(self, decision: Decision, dt_s: float, body: Steered) -> None:
        """Add the pose after a decision."""
        self.poses.append(self.stream.update(decision, dt_s, body))

    def write(self, path: Path, rate: float) -> None:
        """Write all poses."""
        write_poses(self.poses, self.bank, path, rate)


def steer(
    controller: Controller, schema: FeatureSchema, stick: Stick, moments: Moments | None, per_s: float, show: Show | None = None
) -> None:
    """Update a controller from the stick's first moment to its last, so many times a second."""
    n_updates = math.floor(stick.duration_s * per_s + 1e-6) + 1
    paths = _paths(stick, schema, per_s)
    for i in progress(range(n_updates), "steering"):
        moment, dt_s = stick.at(i / per_s), 1.0 / per_s if i else 0.0
        path, body = next(paths)
        query = with_path(schema, _pose(controller, schema, dt_s), path)
        valid, context = (None, None) if moments is None else (moments.valid[moment], moments.contexts[moment])
        decision = controller.update(dt_s, query, valid, context=context)
        if show is not None:
            show.take(decision, dt_s, body)


def _pose(controller: Controller, schema: FeatureSchema, dt_s: float) -> Features:
    """The pose that would play on; the mean pose of all clips where nothing plays."""
    upcoming, databases = controller.upcoming(dt_s), controller.selector.databases
    if upcoming is None:
        mean = next(iter(databases.values())).normalisation.undo(np.zeros(schema.n_features))
        return mean.astype(np.float32)
    return databases[upcoming.database].raw(upcoming.frame).astype(np.float32)


def _paths(stick: Stick, schema: FeatureSchema, per_s: float) -> Iterator[tuple[Trajectory, Steered]]:
    """The wished path at each update, and where the game has the body."""
    return _along_ground(stick, schema, per_s) if stick.is_velocity else _from_body(stick, schema, per_s)


def _from_body(stick: Stick, schema: FeatureSchema, per_s: float) -> Iterator[tuple[Trajectory, Steered]]:
    body = Steered()
    for i in _counting():
        moment = stick.at(i / per_s)
        speed, turn, strafe = (stick.value(name, moment) for name in ("speed_mps", "turn_dps", "strafe_deg"))
        if i:
            body = _after(body, speed, math.radians(turn), math.radians(strafe), 1.0 / per_s)
        yield steady_path(speed, turn, strafe_deg=strafe, reach_s=reach_s(schema, speed), rate=schema.rate), body


def _after(body: Steered, speed_mps: float, turn: float, strafe: float, dt_s: float) -> Steered:
    """A body that goes at one speed and turns evenly, some time later: on an arc, whose chord points half the turn ahead."""
    half = turn * dt_s / 2.0
    chord = speed_mps * dt_s * (math.sin(half) / half if abs(half) > 1e-9 else 1.0)
    way = body.heading + half + strafe
    x, z = body.position
    return replace(body, position=(x + chord * math.sin(way), z + chord * math.cos(way)), heading=body.heading + 2.0 * half)


def _along_ground(stick: Stick, schema: FeatureSchema, per_s: float) -> Iterator[tuple[Trajectory, Steered]]:
    """A body that follows the stick smoothly, as `contextdb.motion.clips.steering` has it."""
    body = Steered()
    past = [body]
    for i in _counting():
        moment = stick.at(i / per_s)
        wanted = (stick.value("x_mps", moment), stick.value("z_mps", moment))
        degrees = stick.value("facing_deg", moment, math.nan)
        facing = None if math.isnan(degrees) else math.radians(degrees)
        if i:
            past.append(past[-1].moved(1.0 / per_s, wanted, facing))
        reach = reach_s(schema, math.hypot(*wanted))
        past = past[-math.ceil(reach * per_s) - 1 :]
        yield steered_path(past, wanted, facing, reach_s=reach, rate=per_s), past[-1]


def _counting() -> Iterator[int]:
    i = 0
    while True:
        yield i
        i += 1


def _out_file(out: Path, stick: Path) -> Path:
    """The file to write to, refused before the work where it could only be refused after."""
    place = Place(str(out))
    if out.suffix != SUFFIX:
        raise FileError(Fault("a session cannot be written to such a file.", f"a name that ends in {SUFFIX}", place=place))
    return _checked_file(out, stick, "the session")


def _checked_file(out: Path, stick: Path, what: str) -> Path:
    """A file in a folder that there is, and not the stick."""
    place = Place(str(out))
    if not os.path.isdir(out.parent):
        found = f"there is no folder {path_in_quotes(out.parent)}."
        raise FileError(Fault(found, "an existing folder", place=place, rule="no-such-path"))
    if out.resolve() == stick.resolve():
        raise FileError(Fault(f"{what} would be written over the stick.", "another file", place=place))
    return out


def _rate(text: str) -> float:
    try:
        rate = float(text)
    except ValueError:
        rate = math.nan
    if not 1.0 <= rate <= 1000.0:
        raise argparse.ArgumentTypeError(f"{in_quotes(text)} is not a rate. Accepted: 1 to 1000 updates a second, such as 30.")
    return rate


def _count(text: str) -> int:
    if not text.isdecimal() or int(text) > 1000:
        raise argparse.ArgumentTypeError(f"{in_quotes(text)} is not a number of candidates. Accepted: 0 to 1000, such as 12.")
    return int(text)


def _seed(text: str) -> int:
    if not text.isdecimal() or len(text) > 18:
        raise argparse.ArgumentTypeError(f"{in_quotes(text)} is not a seed. Accepted: a whole number, such as 7.")
    return int(text)
