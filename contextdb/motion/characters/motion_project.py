"""The motion of a project: its settings, and the frames and poses of all its clips. An edge: this touches the disk."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from contextdb.cells.arguments import require_kind
from contextdb.motion.characters.character import AT_REST, Character
from contextdb.motion.characters.project import HasTables
from contextdb.motion.characters.tables import Tables, Unknown
from contextdb.motion.clips.steering import Steered
from contextdb.motion.output.bank import PoseBank
from contextdb.motion.output.ground import Ground as HeightOf
from contextdb.motion.output.stream import PoseStream
from contextdb.motion.search.database import MotionDatabase
from contextdb.motion.storage.building import open_or_build
from contextdb.motion.storage.config import MotionConfig
from contextdb.motion.storage.pose_files import open_or_build_poses


@dataclass(frozen=True, eq=False)
class MotionProject:
    """What all characters of a game share, one-offs too: read once, it makes as many characters as are wanted.

    `Character.of` reads what one character needs that plays nothing else.

    Attributes
    ----------
    config : MotionConfig
        The motion settings of the project.
    databases : mapping of str to MotionDatabase
    banks : mapping of str to PoseBank
        The poses of each database.
    """

    config: MotionConfig
    databases: Mapping[str, MotionDatabase]
    banks: Mapping[str, PoseBank]

    @classmethod
    def of(cls, project: HasTables) -> MotionProject:
        """Open or build all databases and poses of a project, such as `cdb.Project.load` reads. Raises SchemaError where the
        configuration is wrong, MotionError or FileError as `open_or_build`."""
        require_kind(project, HasTables, "project", "a Project, such as cdb.Project.load gives")
        config = MotionConfig.from_dict(project.schema.motion, tables=project.tables, file=project.schema.file)
        compiled = {
            each.table: project.tables[each.table].compile() for each in config.databases.values() if each.table is not None
        }
        assets = {name: table.leaves for name, table in compiled.items()}
        return cls(config, open_or_build(config, project.folder, assets), open_or_build_poses(config, project.folder, assets))

    def character(
        self,
        name: str,
        tables: Tables = None,
        body: Steered = AT_REST,
        *,
        unknown: Unknown = "error",
        ground: HeightOf | None = None,
    ) -> Character:
        """A character of `[controllers.NAME]`, whose poses may be of any database; the arguments are those of `Character`. Raises
        SchemaError where there is no controller of that name (with the nearest), MotionError where its databases are empty."""
        controller = self.config.controller(name, self.databases)
        schema = self.config.features[self.config.databases[next(iter(controller.selector.databases))].features]
        stream = PoseStream(self.banks, self.config.output_of(name))
        return Character(controller, schema, tables, stream, body, unknown=unknown, ground=ground)
