"""What the databases of a project are made of: clip files, markup and settings, and a digest of all that.

The digest of a database holds the keys of the features of its clips and, as they share its normalisation, those of all databases of
its schema; its markup; its settings. An edge: this touches the disk.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable, Collection, Iterable, Mapping
from dataclasses import asdict, dataclass, replace
from pathlib import Path

from contextdb.disk.boundary import inside
from contextdb.errors import ClipError, ContextDBError, Fault, FileError, MotionError, Place, plural
from contextdb.motion.features.schema import schema_to_dict
from contextdb.motion.markup.markup import Markup
from contextdb.motion.storage import stored
from contextdb.motion.storage.clip_files import ClipFile, clip_files
from contextdb.motion.storage.config import MotionConfig
from contextdb.motion.storage.database_settings import JOINT_KEYS, RIG_KEYS, DatabaseSettings

NOWHERE = Place()
Assets = Mapping[str, Collection[str]]
"""For a table's name the assets in it."""

Tolerates = Callable[[str, ContextDBError], bool]
"""Called with a database's name and what is wrong with it or one of its clips: whether to go on without."""

Keys = Mapping[str, list[list[str]]]
"""For a database's name and each of its clips the keys of its ranges; see `key_of`."""


@dataclass(frozen=True, eq=False)
class Inputs:
    """What some databases are made of: `root` is the folder of contextdb.toml, `wanted` are their names in the order of the
    configuration, `files` the clips of these and of all other databases of their schemas, `markups` those that have some."""

    config: MotionConfig
    root: Path
    wanted: list[str]
    files: dict[str, list[ClipFile]]
    markups: dict[str, Markup]

    @classmethod
    def of(
        cls, config: MotionConfig, root: Path, assets: Assets, names: Collection[str] | None = None, faults: Faults | None = None
    ) -> Inputs:
        """Find the files and read the markup; all faults together, or with others where they are collected.

        A database of which something is wrong has no files.
        """
        queried = config.databases if names is None else [config.database(name).name for name in names]
        wanted = [name for name in config.databases if name in queried]
        schemas = {config.databases[name].features for name in wanted}
        collected = Faults() if faults is None else faults
        files, markups = {}, {}
        for name, settings in config.databases.items():
            if settings.features in schemas:
                with collected.of(name):
                    if settings.markup is not None:
                        markups[name] = Markup.load(inside(root / settings.markup, root))
                with collected.of(name):
                    own_files = assets.get(settings.table or "")
                    schema = config.features[settings.features]
                    files[name] = clip_files(settings, schema, root, own_files, config.file, markups.get(name))
        if faults is None:
            collected.tell()
        unmarked = {name for name in files if config.databases[name].markup is not None and name not in markups}
        files = {name: own_files for name, own_files in files.items() if name not in unmarked}
        return cls(config, root, [name for name in wanted if name in files], files, markups)

    @property
    def schemas(self) -> list[str]:
        """The names of their feature schemas."""
        return list(dict.fromkeys(self.config.databases[name].features for name in self.wanted))

    def keys(self, collected: Faults | None = None) -> Keys:
        """The keys of all clips, from the contents of their files."""
        faults = Faults() if collected is None else collected
        keys: dict[str, list[list[str]]] = {name: [] for name in self.files}
        for name, files in self.files.items():
            for file in files:
                with faults.of(name):
                    keys[name].append(file.keys(file.source()))
        if collected is None:
            faults.tell()
        return keys

    def digests(self, keys: Keys) -> dict[str, str]:
        """The digest of each wanted database, from the keys of all clips; empty where a schema has functions."""
        clips = {
            name: [[file.asset, *each] for file, each in zip(self.files[name], keys[name], strict=True)] for name in self.files
        }
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
            "settings": {key: value for key, value in asdict(settings).items() if key not in (*JOINT_KEYS, *RIG_KEYS)},
        }
        return hashlib.blake2b(json.dumps(about, sort_keys=True).encode(), digest_size=16).hexdigest()


def distinct_faults(faults: Iterable[Fault]) -> list[Fault]:
    """The faults; one that all clips of a rig share is reported for the first, with how many others have it. Each once."""
    clips: dict[Fault, list[Place]] = {}
    for fault in dict.fromkeys(faults):  # a clip may be in several databases
        clips.setdefault(fault.at(NOWHERE) if fault.rule == "unknown-bone" else fault, []).append(fault.place)
    return [fault if places == [fault.place] else _of_all(fault, places) for fault, places in clips.items()]


def _of_all(fault: Fault, places: list[Place]) -> Fault:
    more = f" ({plural(len(places) - 1, 'other clip')} lack it too.)" if len(places) > 1 else ""
    return replace(fault, found=fault.found + more.replace("clip lack", "clip lacks"), place=places[0])


class Faults:
    """Collects the faults of several things that are tried, to tell them together. What is tolerated is left out, and no fault.

    `tolerates` is called with the name of the database and the error.
    """

    def __init__(self, tolerates: Tolerates | None = None) -> None:
        self.errors: list[ContextDBError] = []
        self.tolerates = tolerates
        self.name = ""

    def of(self, name: str) -> Faults:
        """These faults, for something of a database that is tried next."""
        self.name = name
        return self

    def __enter__(self) -> None:
        pass

    def __exit__(self, kind: object, error: BaseException | None, trace: object) -> bool:
        if not isinstance(error, (MotionError, FileError)):
            return False
        if self.tolerates is None or not self.tolerates(self.name, error):
            self.errors.append(error)
        return True

    def tell(self) -> None:
        """Raise what was collected, if anything."""
        if not self.errors:
            return
        faults = distinct_faults(fault for error in self.errors for fault in error.faults)
        kinds = {type(error) for error in self.errors}
        raise (kinds.pop() if len(kinds) == 1 else ClipError if ClipError in kinds else MotionError)(*faults)
