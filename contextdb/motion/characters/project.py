"""The parts of a character that a project declares: databases, pose banks and tables. An edge: this touches the disk."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Protocol, runtime_checkable

from contextdb.cells.arguments import require_kind
from contextdb.motion.characters.tables import Table
from contextdb.motion.features.schema import FeatureSchema
from contextdb.motion.output.bank import PoseBank
from contextdb.motion.search.database import MotionDatabase
from contextdb.motion.storage.build_inputs import Assets
from contextdb.motion.storage.building import open_or_build
from contextdb.motion.storage.config import MotionConfig
from contextdb.motion.storage.pose_files import open_or_build_poses


@runtime_checkable
class HasTables(Protocol):
    """A project, as `cdb.Project.load` reads it."""

    @property
    def folder(self) -> Path:
        """Where its contextdb.toml is."""

    @property
    def schema(self) -> Any:
        """What that says; `motion` is its part for this package, `file` its name."""

    @property
    def tables(self) -> Mapping[str, Any]:
        """Its tables, by name; each compiles."""


@dataclass(frozen=True, eq=False)
class Parts:
    """What the characters of one controller share."""

    config: MotionConfig
    databases: Mapping[str, MotionDatabase]
    banks: Mapping[str, PoseBank] | None
    tables: Mapping[str, Table]
    schema: FeatureSchema

    @classmethod
    def of(cls, project: HasTables, controller: str, poses: bool) -> Parts:
        """Open or build them. Databases of the same features share their normalisation, so they are read too."""
        require_kind(project, HasTables, "project", "a Project, such as cdb.Project.load gives")
        config = MotionConfig.from_dict(project.schema.motion, tables=project.tables, file=project.schema.file)
        names = config.databases_of(config.selector_of(controller))
        features = config.databases[names[0]].features
        joint = config.joint_databases_of(controller) if poses else []
        sharing = [name for name, each in config.databases.items() if each.features == features or name in joint]
        table_of = {name: table for name in sharing if (table := config.databases[name].table) is not None}
        compiled = {table: project.tables[table].compile() for table in dict.fromkeys(table_of.values())}
        assets: dict[str, Sequence[str]] = {table: each.leaves for table, each in compiled.items()}
        databases = open_or_build(config, project.folder, assets, names=sharing)
        banks = banks_of(config, project.folder, assets, {name: databases[name] for name in (*names, *joint)}) if poses else None
        tables = {name: compiled[table_of[name]] for name in names if name in table_of}
        return cls(config, databases, banks, tables, config.features[features])


def banks_of(
    config: MotionConfig, folder: Path, assets: Assets, databases: Mapping[str, MotionDatabase]
) -> dict[str, PoseBank] | None:
    """The pose banks of some databases, of those that have any frame; None where none has."""
    names = [name for name, database in databases.items() if database.n_frames]
    return open_or_build_poses(config, folder, assets, names=names) if names else None
