"""The bundle that `contextdb motion build --bundle` writes: all that a game in C needs of a project, in one file."""

from __future__ import annotations

import tempfile
from collections.abc import Mapping
from pathlib import Path
from random import Random

from contextdb.cells.conditions import Condition
from contextdb.cells.mirroring import changed_in_mirror, mirrored_fact, partner_of, way_of
from contextdb.compiled.table import CompiledTable
from contextdb.disk import make_folder, path_in_quotes, write_atomic
from contextdb.errors import ContextDBError, Fault, FileError, MotionError, Place, in_quotes
from contextdb.motion.characters.facts import FACTS, is_asked
from contextdb.motion.nodes.match_node import MatchNode
from contextdb.motion.search.database import MotionDatabase
from contextdb.motion.storage.bundle import Played, TableFile, bundle_of
from contextdb.motion.storage.config import MotionConfig
from contextdb.motion.storage.pose_files import poses_alone
from contextdb.tables.table import Table, leaf_assets

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
        own = {each: banks[each] for each in names if each in banks}
        ends = {each: MatchNode(databases[each]).ends for each in own}
        controller = config.controller(name, databases, rng=Random(0))
        players[name] = Played(controller, schema, own or None, config.output_of(name), ends)
    return bundle_of(players, table_of, compiled)


def file_of(name: str, table: CompiledTable) -> TableFile:
    """A table as a bundle has it. Raises MotionError for what a bundle cannot say of it yet."""
    with tempfile.TemporaryDirectory() as scratch:
        file = Path(scratch, "table.safetensors")
        table.save(file)
        octets = file.read_bytes()
    conditions = table.asked
    own = {each: each[0] for each, of in FACTS.items() if each in conditions and is_asked(each, of, conditions[each])}
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
