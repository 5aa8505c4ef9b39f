"""What the commands `motion search`, `select` and `run` play with: a project, its databases and tables, and the query."""

from __future__ import annotations

import argparse
import math
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

from contextdb.cells.facts import UNKNOWN_MODES, Fact, Unknown
from contextdb.commands import missing_facts_by_option
from contextdb.commands.motion_build_command import LeftOut, MotionProject, warn
from contextdb.commands.numbers import number_of, number_type, whole_type
from contextdb.commands.progress import building_bar
from contextdb.commands.query_command import read_facts
from contextdb.compiled.matches import Matches
from contextdb.compiled.table import CompiledTable
from contextdb.errors import ContextDBError, Fault, QueryError, in_quotes, nearest, some
from contextdb.motion import (
    FeatureSchema,
    MotionConfig,
    MotionDatabase,
    TagFilter,
    open_or_build,
    query_from,
    steady_path,
    with_path,
)
from contextdb.motion.clips.source import ClipSource, take_at
from contextdb.motion.features.extraction import Features
from contextdb.motion.markup.reserved import MOST_COST
from contextdb.motion.storage.clip_files import Rig
from contextdb.motion.storage.config import JOINTLY
from contextdb.motion.trace.cost_views import View
from contextdb.tables.project import SCHEMA_FILE, Project

MOST_SPEED_MPS, MOST_SECONDS = 100.0, 1e6
LEAST_REACH_S, MOST_REACH_S = 2.0, 60.0
CLIP_AT = "CLIP@SECONDS"
_SPEED = number_type(f"a speed. Accepted: 0 to {MOST_SPEED_MPS:g} m/s, such as 1.3.", 0.0, MOST_SPEED_MPS)
_DEGREES = number_type("an angle. Accepted: -3600 to 3600 degrees, such as 45.", -3600.0, 3600.0)
_COUNT = whole_type("a number of candidates. Accepted: 1 to 10000, such as 10.", 1, 10_000)


@dataclass(frozen=True)
class Stage:
    """A project with its databases."""

    folder: Path
    config: MotionConfig
    databases: Mapping[str, MotionDatabase]
    project: Project

    @classmethod
    def of(cls, path: str, names_of: Callable[[MotionConfig], Collection[str]]) -> Stage:
        """Read a project, open some of its databases where they are saved and up to date, and build the others.

        `names_of` says which are needed. Those of the same features are taken too, as they share a normalisation; what is wrong
        with one of these is reported, and it is left out.
        """
        motion, project = MotionProject.load(path), Project.load(path)
        needed = names_of(motion.config)
        features = {motion.config.databases[name].features for name in needed}
        others = [name for name, each in motion.config.databases.items() if each.features in features and name not in needed]
        left_out = LeftOut()

        def tolerates(name: str, error: ContextDBError) -> bool:
            return name not in needed and left_out.take(name, error)

        with building_bar() as progress:
            names = [*needed, *others]
            databases = open_or_build(motion.config, motion.folder, motion.assets, progress, names=names, tolerates=tolerates)
        warn(left_out.sentences())
        return cls(motion.folder, motion.config, databases, project)

    @cached_property
    def _compiled(self) -> dict[str, CompiledTable]:
        return {}

    def tables(self, names: Collection[str]) -> dict[str, CompiledTable]:
        wanted = dict.fromkeys(self.config.databases[name].table for name in names)
        for table in wanted:
            if table is not None and table not in self._compiled:
                self._compiled[table] = self.project[table].compile()
        return {table: self._compiled[table] for table in wanted if table is not None}

    def schema(self, name: str) -> FeatureSchema:
        """What the databases of a name, and those that it is compared with, compare."""
        return self.config.features[self.config.database(name).features]

    def valid(self, names: Collection[str], given: Sequence[str], unknown: Unknown) -> tuple[dict[str, Matches], dict[str, Fact]]:
        """The valid rows for each of some databases by FACT=VALUE arguments, and the facts. Without any, nothing is filtered.
        Raises ContextDBError for a fact that no table of these databases asks for, or facts that a table misses."""
        if not given:
            return {}, {}
        for name in names:
            if self.config.databases[name].roles:
                fault = f"[databases.{name}] has roles: its clips are cast and chosen together, by facts of several actors."
                raise ContextDBError(Fault(fault, JOINTLY))
        tables = self.tables(names)
        if not tables:
            fault = f"no table says which assets of {some(names)} are valid, so facts change nothing."
            raise ContextDBError(Fault(fault, f"table = … in [databases.NAME] of {SCHEMA_FILE}"))
        facts = facts_of(given, tables)
        with missing_facts_by_option():
            matches = {table: tables[table].query(facts[table], unknown=unknown) for table in tables}
        every = {name: fact for each in facts.values() for name, fact in each.items()}
        return {name: matches[table] for name in names if (table := self.config.databases[name].table) is not None}, every

    def query(self, text: str, names: Sequence[str], path: argparse.Namespace) -> Features:
        """A query from CLIP@SECONDS, of one of some databases, and the path that --speed, --turn and --strafe wish for. Raises
        ContextDBError where there is no such clip (with the nearest), or no such moment of it."""
        clip, at_s = clip_at(text)
        schema = self.schema(names[0])
        file, take = take_at(clip)
        if file is not None:
            settings = self.config.database(names[0])
            loaded = ClipSource.of(file).clip(take, metres_per_unit=settings.metres_per_unit, up=settings.up)
            rig = Rig.of(settings, self.folder, self.config.file)
            loaded = loaded if rig is None else rig.clip(loaded)
            query = query_from(schema, loaded, frame_at(clip, at_s, loaded.duration_s, schema.rate))
        else:
            query = self._pose(clip, at_s, names)
        wanted = wished(path)
        if wanted is None:
            return query
        speed, turn, strafe = wanted
        return with_path(
            schema, query, steady_path(speed, turn, strafe_deg=strafe, reach_s=reach_s(schema, speed), rate=schema.rate)
        )

    def _pose(self, clip: str, at_s: float, names: Sequence[str]) -> Features:
        """The features of a moment of a clip that is in one of the databases, or in another of the same features."""
        features = self.config.database(names[0]).features
        others = [name for name in self.databases if self.config.databases[name].features == features and name not in names]
        for name in (*names, *others):
            database = self.databases[name]
            if clip in database.assets:
                at = database.assets.index(clip)
                length_s = (int(database.stops[at]) - int(database.starts[at]) - 1) / self.schema(name).rate
                frame = int(database.starts[at]) + frame_at(clip, at_s, length_s, self.schema(name).rate)
                return database.raw(frame).astype("float32")
        known = list(dict.fromkeys(asset for name in (*names, *others) for asset in self.databases[name].assets))
        near = nearest(clip, known)
        accepted = f"{some(known)}, or a file of clips" if known else "a file of clips; the databases are empty"
        raise QueryError(Fault(f"there is no clip {in_quotes(clip)}.", accepted, in_quotes(f"{near}@{at_s:g}") if near else ""))


def add_query_arguments(parser: argparse.ArgumentParser) -> None:
    """The arguments that say what is searched for."""
    parser.add_argument("facts", metavar="FACT=VALUE", nargs="*", default=[], help="facts: only assets that are valid may play")
    parser.add_argument("--query", metavar=CLIP_AT, required=True, help="the pose: a moment of a clip, such as walk@1.5")
    parser.add_argument(
        "--speed", metavar="M/S", type=_SPEED, help="the desired path: metres per second (default: the clip's own path)"
    )
    parser.add_argument("--turn", metavar="DEG/S", type=_DEGREES, help="with --speed: degrees per second, positive to the left")
    parser.add_argument(
        "--strafe", metavar="DEG", type=_DEGREES, help="with --speed: the direction of movement relative to the facing"
    )
    parser.add_argument(
        "--tags", metavar="TAGS", type=read_tags, help='"Move": must have it; "-Stun": must not; "Move~2": costs 2 without it'
    )
    parser.add_argument("--unknown", choices=UNKNOWN_MODES, default="error", help="how to treat a missing fact (default: error)")
    parser.add_argument("--k", metavar="N", type=_COUNT, default=10, help="the number of candidates (default: 10)")
    parser.add_argument("--left-out", action="store_true", help="also list frames that may not be chosen, with the reasons")
    parser.add_argument("--json", action="store_true", help="a JSON document instead of text")


def add_view(parser: argparse.ArgumentParser, what: str, default: View | None = None) -> None:
    """The option for which costs to print."""
    views = list(map(str, View))
    parser.add_argument(
        "--view", metavar="VIEW", choices=views, default=default, help=f"{what}: {', '.join(views)} (default: summary)"
    )


def facts_of(given: Sequence[str], tables: Mapping[str, CompiledTable]) -> dict[str, dict[str, Fact]]:
    """FACT=VALUE arguments for each table that has the condition; one that none has is reported as the first table's fault."""
    of_table = {name: [text for text in given if _is_fact_of(text, table)] for name, table in tables.items()}
    known = {text for texts in of_table.values() for text in texts}
    first = next(iter(of_table))
    of_table[first] = [text for text in given if text in of_table[first] or text not in known]
    return {name: read_facts(texts, tables[name]) for name, texts in of_table.items()}


def _is_fact_of(text: str, table: CompiledTable) -> bool:
    return any(text[:i] in table.asked for i, character in enumerate(text) if character == "=")


def clip_at(text: str) -> tuple[str, float]:
    """Name and seconds of CLIP@SECONDS."""
    clip, _, seconds = text.rpartition("@")
    at_s = number_of(seconds.removesuffix("s").strip())
    if not clip or at_s is None or not 0.0 <= at_s <= MOST_SECONDS:
        mend = "" if clip or not text else in_quotes(f"{text}@0")
        raise QueryError(Fault(f"{in_quotes(text)} is not a moment of a clip.", f"{CLIP_AT}, such as walk@1.5", mend))
    return clip, at_s


def frame_at(clip: str, at_s: float, length_s: float, rate: float) -> int:
    """The frame nearest to a moment of a clip; one behind its end is refused."""
    if at_s > length_s + 0.5 / rate:
        raise QueryError(Fault(f"there is no moment {at_s:g} s of {in_quotes(clip)}.", f"seconds from 0 to {length_s:.2f}"))
    return min(round(at_s * rate), round(length_s * rate))


def wished(path: argparse.Namespace) -> tuple[float, float, float] | None:
    """Speed, turn and strafe that are wished for, or None."""
    if path.speed is None:
        for option in ("turn", "strafe"):
            if getattr(path, option) is not None:
                raise QueryError(Fault(f"--{option} without --speed wishes for nothing.", f"--speed M/S and --{option}"))
        return None
    return path.speed, path.turn or 0.0, path.strafe or 0.0


def reach_s(schema: FeatureSchema, speed_mps: float) -> float:
    """How far ahead and back a path must be known, in seconds."""
    points = [abs(point) for channel in schema.channels if channel.type == "trajectory" for point in channel.at]
    metres = [abs(point) for channel in schema.channels if channel.type == "trajectory" for point in channel.along]
    along_s = max(metres, default=0.0) / speed_mps if speed_mps > 0.0 else 0.0
    return min(MOST_REACH_S, max(LEAST_REACH_S, *points, along_s + 1.0 / schema.rate, 0.0))


def read_tags(text: str) -> TagFilter:
    """Tags as an option gives them: NAME (at least one of these), +NAME (all of these), -NAME (none), NAME~COST and -NAME~COST."""
    hard: dict[str, list[str]] = {"": [], "+": [], "-": []}
    soft: dict[str, dict[str, float]] = {"": {}, "-": {}}
    for word in text.split():
        sign, body = (word[0], word[1:]) if word[0] in "+-" else ("", word)
        name, tilde, cost_text = body.partition("~")
        cost = number_of(cost_text)
        if not name or (tilde and (cost is None or not 0.0 <= cost <= MOST_COST or sign == "+")):
            accepted = 'Move, +Move, -Move, "Move~2.5" or "-Move~2.5"'
            raise argparse.ArgumentTypeError(Fault(f"{in_quotes(word)} is not a tag to filter by.", accepted).message)
        if tilde and cost is not None:
            soft[sign][name] = cost
        else:
            hard[sign].append(name)
    return TagFilter(hard[""], hard["+"], hard["-"], prefer=soft[""], avoid=soft["-"])


def context_text(facts: Mapping[str, object]) -> dict[str, object]:
    """Facts as a recorded session and JSON have them."""
    return {name: _plain(fact) for name, fact in facts.items() if fact is not None}


def _plain(fact: object) -> object:
    if isinstance(fact, frozenset):
        return sorted(fact)
    is_plain = isinstance(fact, (bool, str)) or (isinstance(fact, float) and math.isfinite(fact))
    return fact if is_plain else str(fact)
