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
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from time import monotonic, sleep

import numpy as np

from contextdb import motion
from contextdb.authoring.game_link import link
from contextdb.cells.facts import UNKNOWN_MODES, Unknown
from contextdb.columns import TextColumn
from contextdb.commands import answer, missing_facts_by_option
from contextdb.commands.motion_stage import Stage, reach_s
from contextdb.commands.numbers import number_of, rate_of, whole_type
from contextdb.compiled.table import CompiledTable
from contextdb.console import ExitCode, progress
from contextdb.disk import path_in_quotes
from contextdb.errors import ContextDBError, Fault, FileError, Place, TableError, in_quotes, mend_for, some
from contextdb.files.texts import AnySource, read_texts
from contextdb.motion.characters.project import banks_of
from contextdb.motion.characters.tables import Facts
from contextdb.motion.clips.quaternions import Floats
from contextdb.motion.storage.written_poses import pose_file
from contextdb.motion.trace.views import summary_line
from contextdb.tables.table import leaf_assets
from contextdb.telemetry.contexts import Contexts, read_contexts

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
    about = {"file": str(out), "updates": len(trace), "bytes": out.stat().st_size}
    answer(arguments, lambda: about, lambda: [summary_line(trace.brief())])
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


# ---- A recorded stick: what a player wanted, moment by moment, read from a CSV or Parquet file. Columns: `time_s`,
# ascending; then either `speed_mps` and, if wanted, `turn_dps` and `strafe_deg`, seen from the body as in `contextdb motion
# search`; or `x_mps` and `z_mps`, a velocity over the ground, and, if wanted, `facing_deg`. All other columns are facts. A
# moment lasts until the next one

BY_SPEED = ("speed_mps", "turn_dps", "strafe_deg")
BY_VELOCITY = ("x_mps", "z_mps", "facing_deg")
STICK = ("time_s", *BY_SPEED, *BY_VELOCITY)
LIMITS = {
    "time_s": (-1e9, 1e9),
    "speed_mps": (0.0, 100.0),
    "turn_dps": (-3600.0, 3600.0),
    "strafe_deg": (-3600.0, 3600.0),
    "x_mps": (-100.0, 100.0),
    "z_mps": (-100.0, 100.0),
    "facing_deg": (-3600.0, 3600.0),
}
LONGEST_S = 24 * 3600.0


@dataclass(frozen=True, eq=False)
class Stick:
    """What was wanted at some moments, `times_s` float64 [T], ascending from 0: `wanted` float64 [T] by the column's name, NaN
    where it says nothing."""

    path: Path
    times_s: Floats
    wanted: Mapping[str, Floats]

    @property
    def is_velocity(self) -> bool:
        """Whether it asks for velocities over the ground, not for speeds."""
        return "x_mps" in self.wanted

    @property
    def duration_s(self) -> float:
        return float(self.times_s[-1])

    def at(self, time_s: float) -> int:
        return max(0, int(np.searchsorted(self.times_s, time_s + 1e-9, side="right")) - 1)

    def value(self, name: str, moment: int, otherwise: float = 0.0) -> float:
        """What a column says at a moment, or something else where it says nothing."""
        value = float(self.wanted[name][moment]) if name in self.wanted else float("nan")
        return otherwise if np.isnan(value) else value

    @classmethod
    def read(cls, path: Path, conditions: Sequence[str]) -> Stick:
        """Read a file; `conditions` are the columns that are facts. Raises TableError or FileError where the file cannot be read;
        with every column that is neither the stick's nor a fact, and every value that is not a number."""
        source, columns = read_texts(path)
        faults = [_unknown(path, column.name, conditions) for column in columns if column.name not in (*STICK, *conditions)]
        by_name = {column.name: column for column in columns if column.name in STICK}
        faults += _missing(path, by_name)
        wanted = {name: _numbers(path, source, column, faults) for name, column in by_name.items()}
        if not faults:
            _check_times(path, source, wanted["time_s"], faults)
        if faults:
            raise TableError(*faults)
        times_s = wanted.pop("time_s")
        return cls(path, times_s - times_s[0], wanted)


def read_moments(
    path: Path, tables: Mapping[str, CompiledTable], unknown: Unknown, own: Collection[str] = ()
) -> list[dict[str, object]] | None:
    """Read the facts of each moment of a stick; those named `own` the character computes where the file does not give them.

    None when the file has no facts, and the tables ask for others than the character's own: nothing is filtered. Raises
    ContextDBError for facts that a query cannot use; with file, line and fact.
    """
    read = {name: read_contexts(path, table) for name, table in tables.items()}
    known = {name: [c for c in each.facts.columns if c in tables[name].asked] for name, each in read.items()}
    is_own = bool(tables) and all(set(own).issuperset(table.asked) for table in tables.values())
    if not any(known.values()) and not is_own:
        return None
    for name, each in read.items():
        with missing_facts_by_option():
            _with_own(each, tables[name], own).ask(tables[name], unknown)  # tells all that is wrong, with its line
    facts = [each.facts.select(known[name]).to_dicts() for name, each in read.items() if known[name]]
    n_moments = max((len(each.facts) for each in read.values()), default=0)
    return [_given([each[i] for each in facts]) for i in range(n_moments)]


def _with_own(contexts: Contexts, table: CompiledTable, own: Collection[str]) -> Contexts:
    """Contexts in which no fact that is computed later is missing."""
    import polars as pl

    columns = contexts.facts.columns
    filled = [pl.col(name).fill_null(0) if name in columns else pl.lit(0.0).alias(name) for name in own if name in table.asked]
    return replace(contexts, facts=contexts.facts.with_columns(filled))


def _given(rows: Sequence[Mapping[str, object]]) -> dict[str, object]:
    """The facts of some rows that are not missing."""
    return {key: value for row in rows for key, value in row.items() if value is not None}


def conditions_of(tables: Mapping[str, CompiledTable]) -> list[str]:
    """The facts that some tables ask for; a column of the stick's is none."""
    names = [name for table in tables.values() for name in table.asked]
    taken = [name for name in names if name in STICK]
    if taken:
        fault = f"the condition {in_quotes(taken[0])} has the name of a column of the stick's."
        raise ContextDBError(Fault(fault, f"other names for conditions than {some(STICK, len(STICK))}"))
    return list(dict.fromkeys(names))


# ---- what is wrong with a file


def _unknown(path: Path, name: str, conditions: Sequence[str]) -> Fault:
    known = [*STICK, *conditions]
    fault = f"the column {in_quotes(name)} is neither the stick's nor a fact of the tables."
    return Fault(fault, some(known, len(known)), mend_for(name, known), Place(str(path)))


def _missing(path: Path, columns: Mapping[str, TextColumn]) -> list[Fault]:
    place, faults = Place(str(path)), []
    if "time_s" not in columns:
        faults.append(Fault(f"the file has no column {in_quotes('time_s')}.", "seconds, ascending", place=place))
    by_speed = [name for name in BY_SPEED if name in columns]
    by_velocity = [name for name in BY_VELOCITY if name in columns]
    if by_speed and by_velocity:
        faults.append(
            Fault(f"the file has {some([*by_speed, *by_velocity])}.", f"{some(BY_SPEED)}; or {some(BY_VELOCITY)}", place=place)
        )
    elif "speed_mps" not in columns and not {"x_mps", "z_mps"} <= columns.keys():
        message = f"no column says where to go: there is no {in_quotes('speed_mps')}."
        faults.append(
            Fault(message, "speed_mps, metres a second; or both x_mps and z_mps, a velocity over the ground", place=place)
        )
    if columns and not next(iter(columns.values())).n_rows:
        faults.append(Fault("the file has no rows.", "a row for each moment", place=place))
    return faults


def _numbers(path: Path, source: AnySource, column: TextColumn, faults: list[Fault]) -> Floats:
    """The numbers of a column, NaN where it is empty; what is none leaves a fault."""
    least, most = LIMITS[column.name]
    values = np.full(len(column.texts), np.nan)
    for code, text in enumerate(column.texts):
        number = number_of(text)
        if number is not None and least <= number <= most:
            values[code] = number
        elif text.strip() or column.name == "time_s":
            row = int((column.codes == code).argmax())
            place = Place(str(path), source.line(row), column.name, row)
            faults.append(Fault(f"{in_quotes(text)} is not a valid number.", f"{least:g} to {most:g}", place=place))
    return np.asarray(values[column.codes])


def _check_times(path: Path, source: AnySource, times_s: Floats, faults: list[Fault]) -> None:
    late = np.flatnonzero(np.diff(times_s) <= 0.0)
    if len(late):
        row = int(late[0]) + 1
        place = Place(str(path), source.line(row), "time_s", row)
        faults.append(Fault(f"{times_s[row]:g} s comes after {times_s[row - 1]:g} s.", "times that ascend", place=place))
    elif times_s[-1] - times_s[0] > LONGEST_S:
        fault = f"the file {path_in_quotes(path)} lasts {times_s[-1] - times_s[0]:g} s."
        faults.append(Fault(fault, f"at most {LONGEST_S:g} s", place=Place(str(path))))
