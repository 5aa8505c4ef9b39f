"""Steer a character along a recorded stick, and record every decision: the same files give the same session.

STICK is a CSV or Parquet file with a row for each moment, which lasts until the next. Its columns are time_s; speed_mps, turn_dps
and strafe_deg as for `motion search`, or x_mps and z_mps, a velocity over the ground, and facing_deg. All other columns are
facts. The facts speed, direction and turn are the character's own where the file does not give them. [output.CONTROLLER] says how
poses are made. Exits with 1 if nothing ever plays.

  contextdb motion run game/ player stick.csv --out session.parquet --poses session.bvh
  contextdb motion replay session.parquet

With --link NAME it plays at its own speed and publishes what it plays, poses too, as a running game does: see `contextdb live`,
`motion debug --live` and examples/web.
"""

from __future__ import annotations

import argparse
import math
import os
from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from time import monotonic, sleep

import numpy as np

from contextdb import motion
from contextdb.authoring.game_link import link
from contextdb.cells.facts import UNKNOWN_MODES, Unknown
from contextdb.commands.motion_stage import Stage, reach_s
from contextdb.commands.motion_stick import Stick, conditions_of, read_moments
from contextdb.commands.numbers import rate_of, whole_type
from contextdb.console import ExitCode, output, progress
from contextdb.disk import path_in_quotes
from contextdb.errors import ContextDBError, Fault, FileError, Place
from contextdb.motion.characters.project import banks_of
from contextdb.motion.characters.tables import Facts
from contextdb.motion.storage.written_poses import pose_file
from contextdb.motion.trace.views import summary_line
from contextdb.report.render_json import as_json
from contextdb.tables.table import leaf_assets

SUFFIX = ".parquet"
_COUNT = whole_type("a number of candidates. Accepted: 0 to 1000, such as 12.", 0, 1000)
_SEED = whole_type("a seed. Accepted: a whole number, such as 7.")
K_HELP = "candidates of each search that replay lists; with 0, none, and no search can be repeated (default: 12)"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("path", metavar="PATH", help="a folder of tables, or its contextdb.toml")
    parser.add_argument("controller", metavar="CONTROLLER", help="the name of a [controllers.NAME]")
    parser.add_argument("stick", metavar="STICK", help="a CSV or Parquet file of what the player requests, moment by moment")
    parser.add_argument("--out", metavar="FILE", required=True, help=f"the session to write: a {SUFFIX} file")
    parser.add_argument("--poses", metavar="FILE", help="write the poses to this file too: .bvh, .npz, .glb or .usda")
    parser.add_argument(
        "--capsules", action="store_true", help="put a body of capsules on the joints of a .glb, as engines want one"
    )
    parser.add_argument("--link", metavar="NAME", help="play at its own speed, and let programs of this machine listen")
    parser.add_argument("--rate", metavar="HZ", type=rate_of, help="updates per second (default: the rate of the features)")
    parser.add_argument("--k", metavar="N", type=_COUNT, default=12, help=K_HELP)
    parser.add_argument("--seed", metavar="N", type=_SEED, default=0, help="seed of the controller's variation (default: 0)")
    parser.add_argument("--unknown", choices=UNKNOWN_MODES, default="error", help="how to treat a missing fact (default: error)")
    parser.add_argument("--json", action="store_true", help="a JSON document instead of text")


def _pose_file(arguments: argparse.Namespace) -> Path | None:
    """Where the poses go, if anywhere."""
    if arguments.poses is None:
        if arguments.capsules:
            raise ContextDBError(Fault("--capsules is about a file of poses.", "--poses FILE.glb with it"))
        return None
    return _checked_file(pose_file(arguments.poses, has_body=arguments.capsules), Path(arguments.stick), "the poses")


def run(arguments: argparse.Namespace) -> ExitCode:
    """Run a controller along a stick."""
    out = _out_file(Path(arguments.out), Path(arguments.stick))
    poses_out = _pose_file(arguments)
    stage = Stage.of(arguments.path, lambda config: config.played_by(arguments.controller))
    character = character_of(stage, arguments.controller, arguments.seed, arguments.unknown)
    trace = character.record(arguments.k)
    say_where(trace, stage, arguments.controller, out)
    tables = stage.tables(character.controller.selector.names)
    path = Path(arguments.stick)
    stick = Stick.read(path, conditions_of(tables))
    moments = read_moments(path, tables, arguments.unknown, character.asked_facts)
    if moments is None:
        character.tables = None
    rate = character.schema.rate if arguments.rate is None else arguments.rate
    if poses_out is not None and character.stream is None:
        raise ContextDBError(Fault("there is no clip to take poses of.", "a database with a clip"))
    updates = steer(character, stick, moments, rate)
    poses = [each.pose for each in (updates if arguments.link is None else published(updates, character, arguments.link, rate))]
    trace.save(out, timings=False)
    if poses_out is not None and character.stream is not None:
        motion.write_poses(
            [pose for pose in poses if pose is not None], character.stream.rig, poses_out, rate, has_body=arguments.capsules
        )
    with output():
        if arguments.json:
            print(as_json({"format": 1, "file": str(out), "updates": len(trace), "bytes": out.stat().st_size}), end="")
        else:
            print(summary_line(trace.brief()))
    return ExitCode.OK if any(decision.playing is not None for decision in trace.brief()) else ExitCode.FOUND


def published(updates: Iterator[motion.Updated], character: motion.Character, name: str, per_s: float) -> Iterator[motion.Updated]:
    """The updates in their time, with what they play on a link, under the link's name."""
    with link(name) as game:
        game.watch(character, game.name)
        began_s = monotonic()
        for i, updated in enumerate(updates):
            if updated.pose is not None and character.stream is not None:
                game.pose(game.name, updated.pose, character.stream.rig)
            yield updated
            sleep(max(0.0, began_s + (i + 1) / per_s - monotonic()))


def say_where(trace: motion.Trace, stage: Stage, controller: str, out: Path) -> None:
    """Keep in a session what it is of, for what reads it later."""
    where = {**_project(stage.folder, out), "controller": controller}
    trace.about = {name: {**about, **where} for name, about in trace.about.items()}


def _project(folder: Path, out: Path) -> dict[str, str]:
    """Where the project is, seen from the session; nothing where no relative path leads there."""
    try:
        return {"project": Path(os.path.relpath(folder, out.parent)).as_posix()}
    except ValueError:  # another drive
        return {}


def character_of(stage: Stage, name: str, seed: int = 0, unknown: Unknown = "error") -> motion.Character:
    """The character of a controller, with its poses; without where its databases have no clips."""
    controller = stage.config.controller(name, stage.databases, rng=seed)
    names = list(controller.selector.names)
    assets = {table: leaf_assets(stage.project[table]) for table in stage.project.tables}
    joint = {each: stage.databases[each] for each in stage.config.joint_databases_of(name)}
    banks = banks_of(stage.config, stage.folder, assets, {**controller.selector.databases, **joint})
    tables = stage.tables(names)
    table_of = {each: tables[table] for each in names if (table := stage.config.databases[each].table) is not None}
    stream = None if banks is None else motion.PoseStream(banks, stage.config.output_of(name))
    return motion.Character(controller, stage.schema(names[0]), table_of or None, stream, unknown=unknown)


def steer(character: motion.Character, stick: Stick, moments: Sequence[Facts] | None, per_s: float) -> Iterator[motion.Updated]:
    """Update a character from the stick's first moment to its last, at a fixed rate."""
    n_updates = math.floor(stick.duration_s * per_s + 1e-6) + 1
    update = _over_ground if stick.is_velocity else _from_body
    for i in progress(range(n_updates), "steering"):
        moment, dt_s = stick.at(i / per_s), 1.0 / per_s if i else 0.0
        yield update(character, stick, moment, dt_s, None if moments is None else moments[moment])


def _over_ground(character: motion.Character, stick: Stick, moment: int, dt_s: float, facts: Facts | None) -> motion.Updated:
    """A body that follows the stick smoothly, as `contextdb.motion.clips.steering` has it."""
    degrees = stick.value("facing_deg", moment, math.nan)
    facing = None if math.isnan(degrees) else math.radians(degrees)
    return character.update(dt_s, (stick.value("x_mps", moment), stick.value("z_mps", moment)), facts, facing)


def _from_body(character: motion.Character, stick: Stick, moment: int, dt_s: float, facts: Facts | None) -> motion.Updated:
    """A body that goes at once at a speed, turns evenly, and keeps both.

    The stick that would make a body turn so points ahead of its facing, by what it turns while it follows.
    """
    speed, turn, strafe = (stick.value(name, moment) for name in ("speed_mps", "turn_dps", "strafe_deg"))
    body = _after(character.body, speed, math.radians(turn), math.radians(strafe), dt_s)
    schema = character.schema
    path = motion.steady_path(speed, turn, strafe_deg=strafe, reach_s=reach_s(schema, speed), rate=schema.rate)
    points = body.heading + math.radians(strafe + turn * body.heading_halflife_s / math.log(2.0))
    wanted = (speed * math.sin(points), speed * math.cos(points))
    return character.update(dt_s, wanted, facts, body=body, path=_placed(path, body))


def _after(body: motion.Steered, speed_mps: float, turn: float, strafe: float, dt_s: float) -> motion.Steered:
    """A body that goes at one speed and turns evenly, some time later: on an arc, whose chord points half the turn ahead."""
    half = turn * dt_s / 2.0
    chord = speed_mps * dt_s * (math.sin(half) / half if abs(half) > 1e-9 else 1.0)
    way, goes = body.heading + half + strafe, body.heading + 2.0 * half + strafe
    x, z = body.position
    return replace(
        body,
        position=(x + chord * math.sin(way), z + chord * math.cos(way)),
        velocity=(speed_mps * math.sin(goes), speed_mps * math.cos(goes)),
        heading=body.heading + 2.0 * half,
        turn_rate=turn,
    )


def _placed(path: motion.Trajectory, body: motion.Steered) -> motion.Trajectory:
    """A path in the body's own frame, over the ground."""
    sin, cos = math.sin(body.heading), math.cos(body.heading)
    left, ahead = path.positions.T
    positions = np.stack((cos * left + sin * ahead, cos * ahead - sin * left), axis=1) + np.array(body.position)
    return motion.Trajectory(path.rate, positions, path.headings + body.heading, path.now)


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
        fault = f"there is no folder {path_in_quotes(out.parent)}."
        raise FileError(Fault(fault, "an existing folder", place=place, rule="no-such-path"))
    if os.path.realpath(out) == os.path.realpath(stick):
        raise FileError(Fault(f"{what} would be written over the stick.", "another file", place=place))
    return out
