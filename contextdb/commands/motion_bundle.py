"""The bundle that `contextdb motion build --bundle` writes: all that a game in C needs of a project, in one file."""

from __future__ import annotations

import tempfile
from collections.abc import Mapping
from pathlib import Path
from random import Random

from contextdb.disk import make_folder, path_in_quotes, write_atomic
from contextdb.errors import ContextDBError, Fault, FileError, Place
from contextdb.motion.search.database import MotionDatabase
from contextdb.motion.storage.bundle import Played, bundle_of
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
    compiled = {}
    for name, table in used.items():
        with tempfile.TemporaryDirectory() as scratch:
            file = Path(scratch, "table.safetensors")
            table.save(file)
            compiled[name] = file.read_bytes(), table.leaves
    players = {}
    for name in config.controllers:
        names = config.databases_of(config.selector_of(name))
        schema = config.features[config.databases[names[0]].features]
        own = {each: banks[each] for each in names if each in banks}
        players[name] = Played(config.controller(name, databases, rng=Random(0)), schema, own or None, config.output_of(name))
    return bundle_of(players, table_of, compiled)
