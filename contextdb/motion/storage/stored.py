"""Motion databases on disk: .safetensors, opened by memory map, never pickle. An edge: this touches the disk.

Tensors, R ranges, F features, C channels; every number little-endian:

    starts, stops          int64 [R]
    mirrored               bool [R]
    assets                 uint8                 JSON list of R texts
    weights                float64 [C]
    offset, scale          float64 [F]           of the normalisation
    root                   float32 [N, 3]        not there for a database made from features
    layout.FIELD           as in `Layout`
    marks.FIELD            as in `Marks`

The metadata hold `contextdb.motion` (the version of this layout), `about` (JSON: schema, channels, biases and what of layout and
marks is no array), `inputs` (the digest of what the database was built of), `digest` of all but the large arrays, and
`large_digest` of these. Opening checks `digest`, so that no index leads astray; the large arrays, which hold no index, are read
when a search needs them, and checked when that is requested.

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
from collections.abc import Collection, Mapping
from contextlib import suppress
from dataclasses import asdict, dataclass, fields
from itertools import pairwise
from os import PathLike
from pathlib import Path
from typing import Any, TypeVar

import numpy as np

from contextdb.cells.arguments import require_kind, require_path
from contextdb.disk.own_files import (
    has_own,
    is_own_folder,
    make_own_folder,
    own_names,
    remove_own,
    remove_own_folder,
    write_own,
)
from contextdb.errors import ArtefactError, Fault, FileError, MotionError, SchemaError, in_quotes
from contextdb.files.tensors import (
    SUFFIX,
    FileKind,
    Tensors,
    digest_of,
    divided,
    read_tensors,
    texts_from_array,
    texts_to_array,
    to_bytes,
    write_tensors,
)
from contextdb.motion.clips.clip import BY_SIZE, Unit, Up
from contextdb.motion.clips.clip_measures import Measures
from contextdb.motion.clips.feet import NO_MARKS, ContactMarks
from contextdb.motion.features.extraction import ClipFeatures
from contextdb.motion.features.normalisation import Normalisation
from contextdb.motion.features.schema import FeatureSchema, schema_to_dict, unweighted
from contextdb.motion.markup.marks import Marks
from contextdb.motion.search.database import MotionDatabase
from contextdb.motion.search.filters import Biases
from contextdb.motion.search.layout import Layout

STORED = FileKind(
    "contextdb.motion",
    4,
    "a motion database of contextdb",
    "a motion database that this version of contextdb built",
    "to build it again with `contextdb motion build`",
)
LARGE = ("layout.blocks", "root")
"""What grows with frames times features, and holds no index."""

Part = TypeVar("Part", Layout, Marks)


def save_database(database: MotionDatabase, path: str | PathLike[str], *, inputs: str = "") -> None:
    """Write a database to a path whose name ends in .safetensors, as a rule in .motion.safetensors; the old file is whole until the
    new one is. The same database gives the same bytes.

    `inputs` is the digest of what the database was built of; see `inputs_of`. Raises MotionError where the schema was made in
    Python and could not be read back, FileError where the disk refuses, ContextError where `database` or `path` is none.
    """
    require_kind(database, MotionDatabase, "database", "a MotionDatabase")
    path = require_path(path)
    tensors: Tensors = {
        "starts": database.starts,
        "stops": database.stops,
        "mirrored": database.mirrored,
        "assets": texts_to_array(list(database.assets)),
        "weights": database.weights,
        "offset": database.normalisation.offset,
        "scale": database.normalisation.scale,
        **_arrays("layout", database.layout),
        **_arrays("marks", database.marks),
    }
    if database.root is not None:
        tensors["root"] = database.root
    about = json.dumps(
        {
            "schema": None if database.schema is None else _schema_to_json(database.schema),
            "channels": [[name, columns.stop] for name, columns in zip(database.channel_names, database.slices, strict=True)],
            "biases": asdict(database.biases),
            "layout": _others(database.layout),
            "marks": _others(database.marks),
        }
    )
    small, large = divided(tensors, LARGE)
    shapes = _shapes(large)
    metadata = {
        "about": about,
        "inputs": inputs,
        "digest": digest_of(small, about, inputs, shapes),
        "large_digest": digest_of(large),
    }
    write_tensors(Path(path), STORED, tensors, metadata)


def open_database(path: str | PathLike[str], *, verify: bool = False) -> MotionDatabase:
    """Open a saved database by memory map: its features are read from the disk when a search first needs them.

    Parameters
    ----------
    path : path
    verify : bool
        Read all and compare with the digest of the features too. Default: all but the features is checked.

    Raises
    ------
    ArtefactError
        The file is truncated, altered, of another layout, or no motion database; with the reason and the mend.
    FileError
        The file cannot be read.

    Notes
    -----
    The arrays are private views of the file: a file that is replaced changes nothing, as long as it is replaced by a new one, as
    `save_database` does, and not written into.
    """
    file = require_path(path)
    tensors, metadata = read_tensors(file, STORED, writeable=True)  # as built ones are
    with STORED.reading(file):
        small, large = divided(tensors, LARGE)
        expected = digest_of(small, metadata["about"], metadata["inputs"], _shapes(large))
        if expected != metadata["digest"] or (verify and digest_of(large) != metadata["large_digest"]):
            raise STORED.refused(file, "the file was altered: its contents do not match its digest.")
        try:
            return _database(json.loads(metadata["about"]), tensors)
        except SchemaError as error:
            raise STORED.refused(file, f"this version cannot read its schema: {error.faults[0].found}") from error


def inputs_of(path: str | PathLike[str]) -> str:
    """The digest of what a saved database was built of, without opening it. Raises ArtefactError or FileError as `open_database`
    does for a file that is no motion database of this layout."""
    file = require_path(path)
    metadata = read_tensors(file, STORED)[1]
    with STORED.reading(file):
        return metadata["inputs"]


def _database(about: dict[str, Any], tensors: Tensors) -> MotionDatabase:
    stops = [0, *(stop for _, stop in about["channels"])]
    schema = about["schema"]
    return MotionDatabase(
        _put_together(Layout, "layout", tensors, about["layout"]),
        tensors["starts"],
        tensors["stops"],
        tuple(texts_from_array(tensors["assets"])),
        tensors["mirrored"],
        tuple(name for name, _ in about["channels"]),
        tuple(slice(start, stop) for start, stop in pairwise(stops)),
        tensors["weights"],
        Normalisation(tensors["offset"], tensors["scale"]),
        _put_together(Marks, "marks", tensors, about["marks"]),
        Biases(**about["biases"]),
        tensors.get("root"),
        None if schema is None else FeatureSchema.from_dict(schema["name"], schema["keys"]),
    )


def _schema_to_json(schema: FeatureSchema) -> dict[str, object]:
    """The schema as JSON, after a look whether it can be read back."""
    keys = schema_to_dict(schema)
    try:
        FeatureSchema.from_dict(schema.name, keys)
    except SchemaError as error:
        problem = f"the schema {in_quotes(schema.name)} cannot be saved: {error.faults[0].found}"
        raise MotionError(Fault(problem, "a schema that contextdb.toml could hold")) from error
    return {"name": schema.name, "keys": keys}


def _shapes(tensors: Tensors) -> str:
    return json.dumps({name: [array.dtype.newbyteorder("<").str, array.shape] for name, array in sorted(tensors.items())})


def _arrays(prefix: str, part: Layout | Marks) -> Tensors:
    values = {each.name: getattr(part, each.name) for each in fields(part) if each.init}
    return {f"{prefix}.{name}": value for name, value in values.items() if isinstance(value, np.ndarray)}


def _others(part: Layout | Marks) -> dict[str, object]:
    """What of a part is no array."""
    values = {each.name: getattr(part, each.name) for each in fields(part) if each.init}
    return {name: value for name, value in values.items() if not isinstance(value, np.ndarray)}


def _put_together(kind: type[Part], prefix: str, tensors: Tensors, others: Mapping[str, Any]) -> Part:
    values: dict[str, Any] = {name: tuple(value) if isinstance(value, list) else value for name, value in others.items()}
    values |= {name.removeprefix(f"{prefix}."): array for name, array in tensors.items() if name.startswith(f"{prefix}.")}
    return kind(**values)


# ---- features of clips kept on the disk, so that building again computes only the clips that changed


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
