"""Build the motion databases that contextdb.toml declares from their clips, and save them.

Each becomes a memory-mapped file NAME.motion.safetensors; with --poses its clips' poses become NAME.poses.safetensors next to it.
The features of each clip are cached in .contextdb-cache: the next build, also after one that was killed, computes only the
others.

  contextdb motion build tables/                       all databases, next to contextdb.toml
  contextdb motion build tables/ --out build/ --database jog
  contextdb motion build tables/ --bundle game.motion    and one file with all that a game in C needs
  contextdb motion build tables/ --engine dask --scheduler tcp://10.0.0.5:8786

More than 64 clips are computed on all cores; with --engine dask on workers, which see the files under the same paths. The
databases are the same, byte for byte. If a clip cannot be read, nothing is saved, all faults are reported, and the exit code is
2.
"""

from __future__ import annotations

import argparse
import json
import os
import sys
import tempfile
import time
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path

from contextdb.cells.conditions import Condition
from contextdb.cells.mirroring import changed_in_mirror, mirrored_fact, partner_of, way_of
from contextdb.commands.engine_options import add_engine_arguments, engines_of
from contextdb.commands.numbers import unit_of
from contextdb.commands.progress import building_bar
from contextdb.compiled.table import CompiledTable
from contextdb.console import ExitCode, aligned, note, output
from contextdb.disk import TABLE_SUFFIXES, make_folder, path_in_quotes, write_atomic
from contextdb.disk.engines import Engines
from contextdb.errors import ContextDBError, Fault, FileError, MotionError, Place, in_quotes, plural, some
from contextdb.files.tensors import other_layout
from contextdb.motion.characters.facts import FACTS, is_asked
from contextdb.motion.characters.played import of_played
from contextdb.motion.clips.clip import UPS
from contextdb.motion.clips.doubts import grouped
from contextdb.motion.clips.source import ENDINGS
from contextdb.motion.nodes.match_node import MatchNode
from contextdb.motion.search.database import MotionDatabase
from contextdb.motion.storage import building
from contextdb.motion.storage.build_inputs import distinct_faults
from contextdb.motion.storage.building import Built, saved_path
from contextdb.motion.storage.bundle import Played, TableFile, bundle_of
from contextdb.motion.storage.clip_files import unmatched
from contextdb.motion.storage.config import MotionConfig
from contextdb.motion.storage.database_settings import ROOTS
from contextdb.motion.storage.pose_files import poses_alone, poses_path, save_poses
from contextdb.motion.storage.stored import STORED, save_database
from contextdb.tables.project import SCHEMA_FILE, Project, folder_of
from contextdb.tables.table import Table, leaf_assets
from contextdb.tables.watching.rest import Rest, Stamps, look
from contextdb.tables.watching.watcher import POLL_S, SETTLE_S, SHORTEST_WAIT_S

HEADER = ("database", "assets", "clips", "frames", "features", "MB", "computed", "cached", "file")


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("path", metavar="PATH", help=f"a folder of tables, or its {SCHEMA_FILE}")
    parser.add_argument("--out", metavar="FOLDER", help=f"where the databases are saved (default: next to {SCHEMA_FILE})")
    parser.add_argument("--database", metavar="NAME", action="append", help="only this database; may be repeated")
    parser.add_argument(
        "--keep-going", action="store_true", help="leave out faulty clips and databases, build the rest, and exit with 1"
    )
    parser.add_argument("--poses", action="store_true", help="save the poses of the clips too; not with --keep-going")
    parser.add_argument(
        "--bundle",
        metavar="FILE",
        help="also write all databases, poses, controllers and tables as one file for games: a .motion file; not with --keep-going",
    )
    parser.add_argument("--no-cache", action="store_true", help="compute every clip, and cache nothing")
    parser.add_argument(
        "--watch", action="store_true", help="build again whenever a clip, a table, markup or contextdb.toml is saved"
    )
    add_engine_arguments(parser)
    parser.add_argument("--json", action="store_true", help="print a JSON document instead of a table")


def run(arguments: argparse.Namespace) -> ExitCode:
    """Build and save; prints a line for each database."""
    return watched(arguments.path, partial(_build, arguments)) if arguments.watch else _build(arguments)


def _build(arguments: argparse.Namespace) -> ExitCode:
    project = MotionProject.load(arguments.path)
    targets = project.targets(arguments.out, arguments.database)
    if arguments.poses and arguments.keep_going:
        raise ContextDBError(Fault("--poses takes the poses of all clips, --keep-going leaves faulty ones out.", "one of the two"))
    bundle = None if arguments.bundle is None else bundle_path(arguments.bundle, arguments.keep_going or arguments.database)
    left_out, engines = LeftOut(), engines_of(arguments)
    with building_bar() as progress:
        built = building.build_all(
            project.config,
            project.folder,
            project.assets,
            progress,
            names=arguments.database,
            cache=None if arguments.no_cache else building.CACHE_FOLDER,
            tolerates=left_out.take if arguments.keep_going else None,
            engines=engines,
        )
    targets = {name: target for name, target in targets.items() if name in built}
    replaced = [sentence for target in targets.values() for sentence in _replaced(target)]
    for name, target in targets.items():
        make_folder(target.parent)
        save_database(built[name].database, target, inputs=built[name].digest)
    if arguments.poses:
        _save_poses(project, built, targets, engines)
    if bundle is not None:
        write_bundle(bundle, project.tables, project.config, {name: each.database for name, each in built.items()}, project.folder)
    warn([*replaced, *project.warnings(built)])
    with output():
        if arguments.json:
            rows = [_as_json(project, name, built[name], target) for name, target in targets.items()]
            print(json.dumps({"format": 1, "databases": rows, "left_out": left_out.messages}, ensure_ascii=False))
        else:
            cells = [_cells(project, name, built[name], target) for name, target in targets.items()]
            print("\n".join(aligned([HEADER, *cells], right=range(1, 8))))
    warn(left_out.sentences())
    return ExitCode.FOUND if left_out.errors else ExitCode.OK


def _replaced(target: Path) -> Iterator[str]:
    """The message where a database of a layout that this version cannot read is replaced."""
    layout = other_layout(target, STORED)
    if layout is not None:
        yield f"{target} was of layout {layout} and is replaced by one of layout {STORED.layout}."


def _save_poses(project: MotionProject, built: Mapping[str, Built], targets: Mapping[str, Path], engines: Engines) -> None:
    """Save the poses of some databases next to them."""
    banks = poses_alone(project.config, project.folder, project.assets, names=list(targets), engines=engines)
    for name, bank in banks.items():
        save_poses(bank, poses_path(targets[name].parent, name), inputs=built[name].digest)


def warn(sentences: Iterable[str]) -> None:
    """Print warnings on standard error."""
    note(*(f"warning: {sentence}" for sentence in sentences))


@dataclass
class LeftOut:
    """What a build continues without: for each database what is wrong with it, or with some of its clips."""

    errors: dict[str, list[ContextDBError]] = field(default_factory=dict)

    def take(self, database: str, error: ContextDBError) -> bool:
        """Take down what is wrong, and let the build go on."""
        self.errors.setdefault(database, []).append(error)
        return True

    @property
    def messages(self) -> list[str]:
        """Each fault, once."""
        return [
            str(fault) for fault in distinct_faults(fault for errors in self.errors.values() for e in errors for fault in e.faults)
        ]

    def sentences(self) -> Iterator[str]:
        """Each fault, then what was left out."""
        yield from (f"left out: {message}" for message in self.messages)
        for name, errors in self.errors.items():
            yield f"[databases.{name}] is left out, or lacks what is reported above ({plural(len(errors), 'error')})."


@dataclass(frozen=True)
class MotionProject:
    """What a folder of tables says of motion, and which assets each table has."""

    folder: Path
    config: MotionConfig
    assets: Mapping[str, list[str]]
    tables: Mapping[str, Table]

    @classmethod
    def load(cls, path: str) -> MotionProject:
        """Read contextdb.toml and the tables. Raises ContextDBError with every fault; also when no database is declared."""
        project = Project.load(path)
        config = MotionConfig.from_dict(project.schema.motion, tables=project.tables, file=project.schema.file)
        if not config.databases:
            place = Place(str(project.folder / SCHEMA_FILE))
            accepted = 'a section such as [databases.jog] with features and clips = "clips/*.bvh"'
            raise ContextDBError(Fault("no motion database is declared.", accepted, place=place))
        return cls(project.folder, config, {name: leaf_assets(table) for name, table in project.tables.items()}, project.tables)

    def targets(self, out: str | None, names: list[str] | None) -> dict[str, Path]:
        """Where the databases of some names, or all, are saved."""
        chosen = None if names is None else {self.config.database(name).name for name in names}
        wanted = [name for name in self.config.databases if chosen is None or name in chosen]
        folder = self.folder if out is None else Path(out)
        targets = {name: saved_path(folder, name) for name in wanted}
        taken: dict[str, str] = {}
        for name, path in targets.items():
            other = taken.setdefault(path.name.casefold(), name)
            if other != name:
                fault = "two databases would be written to one file, on a disk that ignores case."
                raise FileError(Fault(fault, f"another name for {some([other, name])}", place=Place(str(path))))
        return targets

    def warnings(self, built: Mapping[str, Built]) -> Iterator[str]:
        """What a build passed over: assets without a clip, clips without a row, markup that does nothing."""
        missing, unlisted = unmatched(self.config.databases.values(), self.folder, self.assets)
        for table, assets in missing.items():
            yield f"[tables.{table}] no database has a clip of {plural(len(assets), 'asset')}: {some(assets)}"
        if unlisted:
            yield f"no table has a row for {plural(len(unlisted), 'clip')}: {some(unlisted)}"
        yield from dict.fromkeys(
            str(fault) for each in built.values() for fault in (*each.markup_faults, *each.mirror_faults, *each.scale_faults)
        )
        for name, each in built.items():
            n_clips = len(each.computed) + len(each.cached)
            yield from (f"[databases.{name}] {sentence}" for sentence in grouped(each.doubts, n_clips))


def _as_json(project: MotionProject, name: str, built: Built, target: Path) -> dict[str, object]:
    table, database = project.config.databases[name].table, built.database
    return {
        "database": name,
        "file": str(target),
        "bytes": target.stat().st_size,
        "table": table,
        "assets": None if table is None else len(set(project.assets[table])),
        "clips": len(built.computed) + len(built.cached),
        "ranges": len(database.assets),
        "frames": database.n_frames,
        "features": database.n_features,
        "computed": list(built.computed),
        "cached": list(built.cached),
        "doubts": [doubt.to_json() for doubt in built.doubts],
    }


def _cells(project: MotionProject, name: str, built: Built, target: Path) -> list[str]:
    values = _as_json(project, name, built, target)
    numbers = [values[key] for key in ("assets", "clips", "frames", "features")]
    counts = ["" if number is None else f"{number:,}" for number in numbers]
    return [
        name,
        *counts,
        f"{target.stat().st_size / 1e6:.1f}",
        f"{len(built.computed):,}",
        f"{len(built.cached):,}",
        str(target),
    ]


# ---- the bundle that `contextdb motion build --bundle` writes: all that a game in C needs of a project, in one file


SUFFIX = ".motion"


def bundle_path(text: str, is_partial: object) -> Path:
    """Where a bundle is written. Raises ContextDBError where only a part is built, FileError for another name."""
    if is_partial:
        raise ContextDBError(Fault("--bundle takes all databases.", "neither --keep-going nor --database with it"))
    path = Path(text)
    if path.suffix == SUFFIX and not path.is_dir():
        return path
    mend = path_in_quotes(path.with_suffix(SUFFIX)) if path.name else ""
    raise FileError(Fault("this is not a valid name for a bundle.", f"a name that ends in {SUFFIX}", mend, Place(text)))


def write_bundle(
    path: Path, tables: Mapping[str, Table], config: MotionConfig, databases: Mapping[str, MotionDatabase], folder: Path
) -> None:
    """Write the bundle of a project; the old file is whole until the new one is. Raises MotionError for what it cannot hold."""
    make_folder(path.parent)
    write_atomic(path, bundled(tables, config, databases, folder))


def bundled(tables: Mapping[str, Table], config: MotionConfig, databases: Mapping[str, MotionDatabase], folder: Path) -> bytes:
    """The bytes of that bundle: of each controller whose databases are there."""
    assets = {name: leaf_assets(table) for name, table in tables.items()}
    filled = [name for name, database in databases.items() if database.n_frames]
    banks = poses_alone(config, folder, assets, names=filled) if filled else {}
    table_of = {name: each.table for name, each in config.databases.items() if each.table is not None}
    used = {name: tables[name].compile() for name in dict.fromkeys(table_of.values())}
    compiled = {name: file_of(name, table) for name, table in used.items()}
    players = {}
    for name in config.controllers:
        names = config.databases_of(config.selector_of(name))
        schema = config.features[config.databases[names[0]].features]
        own = {each: banks[each] for each in config.played_by(name) if each in banks}
        ends = {each: MatchNode(databases[each]).ends for each in names if each in own}
        controller = config.controller(name, databases)
        players[name] = Played(controller, schema, own or None, config.output_of(name), ends)
    joint = dict.fromkeys(each for names in config.joint_clips.values() for each in names)
    return bundle_of(players, table_of, compiled, {each: config.joint_searcher(each, databases) for each in joint})


def file_of(name: str, table: CompiledTable) -> TableFile:
    """A table as a bundle has it. Raises MotionError for what a bundle cannot say of it yet."""
    with tempfile.TemporaryDirectory() as scratch:
        file = Path(scratch, "table.safetensors")
        table.save(file)
        octets = file.read_bytes()
    conditions = table.asked
    played = {each: of_played(each, condition) for each, condition in conditions.items()}
    own = {each: fact.letter for each, fact in played.items() if fact is not None}
    own |= {each: each[0] for each, of in FACTS.items() if each in conditions and is_asked(each, of, conditions[each])}
    changed = {each.name: _mirror_text(name, each) for each in changed_in_mirror(conditions.values()).values()}
    return TableFile(octets, table.leaves, own, changed)


def _mirror_text(table: str, condition: Condition) -> str:
    """How the facts of a condition change, as a bundle says it. Raises MotionError for tags, which it cannot say yet."""
    if (partner := partner_of(condition)) is not None:
        return f"p={partner}"
    if way_of(condition) == "negate":
        return "n"
    values = list(condition.domain.values or ())
    if condition.domain.type.is_tags or not values:
        problem = f"a bundle cannot exchange the facts of the condition {in_quotes(condition.name)} in a mirror yet."
        raise MotionError(Fault(problem, 'mirror = "negate", or names of an enum', place=Place(f"[tables.{table}]")))
    return "v=" + " ".join(str(values.index(str(mirrored_fact(value, condition)))) for value in values)


# ---- work on a folder of clips done again whenever its files change: `--watch` of `motion build` and `motion prepare`. An
# edge: this looks at disk and clock

SUFFIXES = (*ENDINGS, *TABLE_SUFFIXES)
"""What clips, tables and markup are in, next to contextdb.toml."""

sleep, clock = time.sleep, time.monotonic


def watched(path: str, work: Callable[[], ExitCode]) -> ExitCode:
    """Do some work on a folder now, and again when files in it have changed and rested; ends with Ctrl+C.

    Says what is wrong; the next change may mend it. Raises FileError where there is no such folder.
    """
    folder = folder_of(Path(path))
    seen: Stamps = look(_files(folder))
    rest = Rest(seen, clock(), SETTLE_S)
    try:
        while True:
            _done(work)
            note(f"watching {folder}. Ctrl+C ends it.")
            seen = _next(folder, seen, rest)
    except KeyboardInterrupt:  # how it ends
        return ExitCode.OK


def _next(folder: Path, before: Stamps, rest: Rest) -> Stamps:
    """The stamps of the files when they have changed, and rest."""
    while True:
        seen, now = look(_files(folder)), clock()
        if rest.is_due(seen, now) and seen != before:
            rest.taken(now)
            return seen
        rest_s = rest.wait_s(now)
        sleep(POLL_S if rest_s is None else min(POLL_S, max(rest_s, SHORTEST_WAIT_S)))


def _done(work: Callable[[], ExitCode]) -> None:
    try:
        work()
    except ContextDBError as error:
        note(*error.faults)
    sys.stdout.flush()


def _files(folder: Path) -> list[Path]:
    """What the work may depend on, in the folder and below; hidden folders, such as that of the cache, are passed over."""
    files = []
    for at, folders, names in os.walk(folder):
        folders[:] = [name for name in folders if not name.startswith(".")]
        files += [Path(at) / name for name in names if name == SCHEMA_FILE or name.lower().endswith(SUFFIXES)]
    return sorted(files)


# ---- what the commands on clips share: the folder, the unit and the axis as arguments, and progress clip by clip


def add_clip_arguments(parser: argparse.ArgumentParser) -> None:
    """The folder, and what its files leave open."""
    parser.add_argument("path", metavar="FOLDER", help=f"a folder of clips, or of tables with {SCHEMA_FILE}")
    parser.add_argument(
        "--metres-per-unit", metavar="M", type=unit_of, help="the unit of the files (default: as the project says, else by size)"
    )
    parser.add_argument(
        "--up", choices=UPS, help="the axis that points up (default: as the project says, else in which bodies stand)"
    )
    parser.add_argument(
        "--root-from",
        choices=ROOTS,
        help="where clips that run on the spot get their motion: from themselves, or from their standing feet; in a project its "
        "databases say it",
    )
    add_engine_arguments(parser)


progress_of = partial(building_bar, tells_few=False)
"""The progress of work on clips, one by one."""
