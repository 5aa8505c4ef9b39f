"""Features of clips kept on the disk, so that building again computes only the clips that changed.

    FOLDER/DATABASE.features/KEY.safetensors      one clip, as recorded or mirrored, in one permutation: features
                                                  and root, in raw units; its measures in the metadata

The key is a digest of all that the features depend on: the bytes of the file, what the settings say of its unit and axis, the
channels without their weights, and `EXTRACTION`. An entry is written in one step and checked when it is read; one that is missing,
broken or of another version is as if it were not there; so is one that another version of numpy made, which may round otherwise.
So builds may be interrupted, and run next to each other.
"""

from __future__ import annotations

import hashlib
import json
import re
from collections.abc import Collection
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from contextdb.disk.own_files import (
    has_own,
    is_own_folder,
    make_own_folder,
    own_names,
    remove_own,
    remove_own_folder,
    write_own,
)
from contextdb.errors import ArtefactError, FileError
from contextdb.files.tensors import SUFFIX, FileKind, Tensors, digest_of, read_tensors, to_bytes
from contextdb.motion.clips.clip import BY_SIZE, Unit, Up
from contextdb.motion.clips.clip_measures import Measures
from contextdb.motion.clips.feet import NO_MARKS, ContactMarks
from contextdb.motion.features.extraction import ClipFeatures
from contextdb.motion.features.schema import FeatureSchema, unweighted

EXTRACTION = 6
"""The version of what features are made of a clip: one more whenever the same clip would give other features."""

CLIP_FEATURES = FileKind(
    "contextdb.features", 1, "features of a clip", "features of a clip that this version computed", "to build again"
)
FOLDER_SUFFIX = ".features"

_ENTRY = re.compile(r"[0-9a-f]{32}\.safetensors|(?:\.contextdb-[0-9a-f]{8}-)?[0-9a-f]{16}\.tmp")


def key_of(
    content: bytes,
    schema: FeatureSchema,
    *,
    metres_per_unit: Unit,
    up: Up,
    mirrored: bool,
    looping: bool,
    contacts: ContactMarks = NO_MARKS,
    permutation: int = 0,
    rig: str = "",
    reader: str = "",
) -> str:
    """The key of a clip's features, from the bytes of its file and all else that they depend on."""
    about = {
        "extraction": EXTRACTION,
        "features": unweighted(schema),
        "unit": metres_per_unit if metres_per_unit == BY_SIZE else float(metres_per_unit).hex(),
        "up": up,
        "mirrored": mirrored,
        "looping": looping,
        "contacts": contacts if any(channel.type == "phase" for channel in schema.channels) else NO_MARKS,
    }
    if permutation:
        about["permutation"] = permutation
    if rig:
        about["rig"] = rig
    if reader:
        about["reader"] = reader
    digest = hashlib.blake2b(json.dumps(about, sort_keys=True).encode(), digest_size=16)
    digest.update(content)
    return digest.hexdigest()


@dataclass(frozen=True)
class FeatureCache:
    """A folder of features. One that cannot be written is no error: nothing is stored then."""

    folder: Path

    def read(self, database: str, key: str, asset: str, *, mirrored: bool) -> tuple[ClipFeatures, Measures] | None:
        """The features of a key and the measures of its clip; None when they are missing, or not whole."""
        entry = self._entry(database, key)
        try:
            if not (is_own_folder(self.folder) and has_own(entry)):
                return None
            tensors, metadata = read_tensors(entry, CLIP_FEATURES)
        except (ArtefactError, FileError, OSError):
            return None
        text = metadata.get("measures", "")
        if not text or metadata.get("digest") != _digest(tensors, key, text):
            return None
        return ClipFeatures(asset, mirrored, tensors["features"], tensors["root"]), Measures.of_json(json.loads(text))

    def write(self, database: str, key: str, part: ClipFeatures, measures: Measures) -> None:
        """Keep the features of a key, and the measures of its clip.

        The system is not asked to put them on the disk at once, which would take longer than to compute them: an entry that a loss
        of power spoils is seen when it is read.
        """
        tensors = {"features": part.features, "root": part.root}
        text = json.dumps(measures.to_json())
        metadata = CLIP_FEATURES.metadata({"measures": text, "digest": _digest(tensors, key, text)})
        entry = self._entry(database, key)
        with suppress(FileError, OSError, ValueError):  # ValueError: no system can have a file of this name
            make_own_folder(self.folder, is_ignored=not is_own_folder(self.folder))  # one that a person made stays as it is
            make_own_folder(entry.parent, is_ignored=False)
            write_own(entry, to_bytes(tensors, metadata), syncs=False)

    def prune(self, database: str, keys: Collection[str]) -> None:
        """Remove all that is stored of a database but some keys."""
        name = file_name(database, FOLDER_SUFFIX)
        if name in own_names(self.folder):
            _remove(self.folder / name, {key + SUFFIX for key in keys})

    def prune_databases(self, databases: Collection[str]) -> None:
        """Remove what is stored of all databases but some."""
        retained = {file_name(database, FOLDER_SUFFIX).casefold() for database in databases}
        with suppress(OSError):
            for name in own_names(self.folder):
                if name.casefold() not in retained and name.endswith(FOLDER_SUFFIX):
                    _remove(self.folder / name)
                    remove_own_folder(self.folder / name)

    def _entry(self, database: str, key: str) -> Path:
        return self.folder / file_name(database, FOLDER_SUFFIX) / (key + SUFFIX)


def _remove(folder: Path, retained: Collection[str] = ()) -> None:
    """Remove the entries of a folder but some; what is no entry stays."""
    with suppress(OSError):
        for name in own_names(folder):
            if name not in retained and _ENTRY.fullmatch(name):
                remove_own(folder / name)


def _digest(tensors: Tensors, key: str, measures: str) -> str:
    return digest_of(tensors, key, np.__version__, measures)


def file_name(name: str, suffix: str) -> str:
    """A file's name for a database's: what some system's file names cannot hold is as %XX."""
    return "".join(f"%{ord(c):02X}" if c in '%<>:"/\\|?*' or not c.isprintable() else c for c in name) + suffix
