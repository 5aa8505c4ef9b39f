"""What the databases of a project are made of: clip files, markup and settings, and a digest of all that.

The digest of a database holds the keys of the features of its clips and, as they share its normalisation, those of all databases of
its schema; its markup; its settings. An edge: this touches the disk.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Collection, Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from contextdb.disk import read_bytes
from contextdb.errors import ClipError, ContextDBError, FileError, MotionError
from contextdb.motion.features.schema_dict import schema_to_dict
from contextdb.motion.markup.markup import Markup
from contextdb.motion.storage import stored
from contextdb.motion.storage.clip_files import ClipFile, clip_files
from contextdb.motion.storage.database_settings import DatabaseSettings

if TYPE_CHECKING:
    from contextdb.motion.storage.config import MotionConfig

Assets = Mapping[str, Collection[str]]
"""For a table's name the assets in it."""

Keys = Mapping[str, list[list[str]]]
"""For a database's name and each of its clips the keys of its ranges; see `key_of`."""


@dataclass(frozen=True, eq=False)
class Inputs:
    """What some databases are made of.

    Attributes
    ----------
    config : MotionConfig
    root : Path
        The folder of contextdb.toml.
    wanted : list of str
        The names of the databases, in the order of the configuration.
    files : dict of str to list of ClipFile
        The clips of these and of all other databases of their schemas.
    markups : dict of str to Markup
        Of those that have some.
    """

    config: MotionConfig
    root: Path
    wanted: list[str]
    files: dict[str, list[ClipFile]]
    markups: dict[str, Markup]

    @classmethod
    def of(cls, config: MotionConfig, root: Path, assets: Assets, names: Collection[str] | None = None) -> Inputs:
        """Find the files and read the markup; all faults together."""
        asked = config.databases if names is None else [config.database(name).name for name in names]
        wanted = [name for name in config.databases if name in asked]
        schemas = {config.databases[name].features for name in wanted}
        faults = Faults()
        files, markups = {}, {}
        for name, settings in config.databases.items():
            if settings.features in schemas:
                if settings.markup is not None:
                    with faults:
                        markups[name] = Markup.load(root / settings.markup)
                with faults:
                    found = assets.get(settings.table or "")
                    schema = config.features[settings.features]
                    files[name] = clip_files(settings, schema, root, found, config.file, markups.get(name))
        faults.tell()
        return cls(config, root, wanted, files, markups)

    @property
    def schemas(self) -> list[str]:
        """The names of their feature schemas."""
        return list(dict.fromkeys(self.config.databases[name].features for name in self.wanted))

    def keys(self) -> Keys:
        """The keys of all clips, from the contents of their files."""
        faults = Faults()
        found: dict[str, list[list[str]]] = {name: [] for name in self.files}
        for name, files in self.files.items():
            for file in files:
                with faults:
                    found[name].append(file.keys(read_bytes(file.path)))
        faults.tell()
        return found

    def digests(self, keys: Keys) -> dict[str, str]:
        """The digest of each wanted database, from the keys of all clips; empty where a schema has functions."""
        clips = {name: [[file.asset, *each] for file, each in zip(self.files[name], keys[name], strict=True)] for name in keys}
        return {name: self._digest(self.config.databases[name], clips) for name in self.wanted}

    def _digest(self, settings: DatabaseSettings, clips: Mapping[str, object]) -> str:
        schema, markup = self.config.features[settings.features], self.markups.get(settings.name)
        if schema.functions:
            return ""
        about = {
            "layout": stored.STORED.layout,
            "features": schema_to_dict(schema),
            "clips": {name: each for name, each in clips.items() if self.config.databases[name].features == settings.features},
            "markup": None if markup is None else [[s.asset, s.tag, s.from_s, s.to_s, s.value] for s in markup.spans],
            "settings": asdict(settings),
        }
        return hashlib.blake2b(json.dumps(about, sort_keys=True).encode(), digest_size=16).hexdigest()


class Faults:
    """Collects the faults of several things that are tried, to tell them together."""

    def __init__(self) -> None:
        self.errors: list[ContextDBError] = []

    def __enter__(self) -> None:
        pass

    def __exit__(self, kind: object, error: BaseException | None, trace: object) -> bool:
        if isinstance(error, (MotionError, FileError)):
            self.errors.append(error)
            return True
        return False

    def tell(self) -> None:
        """Raise what was collected, if anything."""
        if not self.errors:
            return
        faults = dict.fromkeys(fault for error in self.errors for fault in error.faults)  # a clip may be in several databases
        kinds = {type(error) for error in self.errors}
        raise (kinds.pop() if len(kinds) == 1 else ClipError if ClipError in kinds else MotionError)(*faults)
