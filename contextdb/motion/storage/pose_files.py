"""Pose banks on disk, beside their databases: .safetensors, opened by memory map, never pickled. An edge: this touches the disk.

Tensors, as `PoseBank` has them, R ranges, N frames, J joints, M of them with positions of their own; every number little-endian:

    starts, stops          int64 [R]
    mirrored, looping      bool [R]
    assets                 uint8                 JSON list of R texts
    parents                int64 [J]             of the rig, as are
    offsets                float64 [J, 3]
    moving                 int64 [M]
    rotations              float32 [N, J, 4]
    positions              float32 [N, M, 3]
    root                   float32 [N, 3]
    contacts               bool [N, feet]

The metadata hold `contextdb.poses` (the version of this layout), `about` (JSON: rate, feet, and what of the rig is no array),
`inputs` (the digest of the database of the same clips), `digest` of all but the large arrays, and `large_digest` of these.
"""

from __future__ import annotations

import json
from collections.abc import Collection, Mapping
from os import PathLike
from pathlib import Path
from typing import Any

from contextdb.cells.arguments import require_kind, require_path, require_text
from contextdb.disk.boundary import inside
from contextdb.disk.engines import Engines, here, in_order
from contextdb.errors import ArtefactError, ContextDBError, FileError
from contextdb.files.tensors import (
    FileKind,
    Tensors,
    digest_of,
    divided,
    read_tensors,
    texts_from_array,
    texts_to_array,
    write_tensors,
)
from contextdb.motion.clips.skeleton import Skeleton
from contextdb.motion.markup.markup import Markup
from contextdb.motion.output.bank import PoseBank, moving_alike
from contextdb.motion.output.clip_parts import ClipParts, parts_of
from contextdb.motion.search.database import MotionDatabase
from contextdb.motion.storage.build_inputs import Assets, Inputs
from contextdb.motion.storage.building import checked
from contextdb.motion.storage.clip_files import read_clip
from contextdb.motion.storage.config import MotionConfig
from contextdb.motion.storage.database_settings import DatabaseSettings
from contextdb.motion.storage.extracting import CHUNK, MANY, Chunk, named_chunk
from contextdb.motion.storage.stored import file_name

STORED_POSES = FileKind(
    "contextdb.poses",
    1,
    "a pose bank of contextdb",
    "a pose bank that this version of contextdb built",
    "to build it again with `contextdb motion build --poses`",
)
LARGE = ("rotations", "positions", "root", "contacts")
"""What grows with frames, and holds no index."""
ARRAYS = ("starts", "stops", "mirrored", "looping", "moving", *LARGE)
SAVED_SUFFIX = ".poses.safetensors"


def save_poses(bank: PoseBank, path: str | PathLike[str], *, inputs: str = "") -> None:
    """Write a bank to a path whose name ends in .safetensors, as a rule in .poses.safetensors; the old file is whole until the new
    one is. The same bank gives the same bytes.

    `inputs` is the digest of what the bank was built of; see `inputs_of`. Raises FileError where the disk refuses, ContextError
    where `bank` or `path` is none.
    """
    require_kind(bank, PoseBank, "bank", "a PoseBank")
    target = require_path(path)
    rig = bank.skeleton
    tensors: Tensors = {name: getattr(bank, name) for name in ARRAYS}
    tensors |= {"assets": texts_to_array(list(bank.assets)), "parents": rig.parents, "offsets": rig.offsets}
    about = json.dumps(
        {"rate": bank.rate, "feet": bank.feet, "names": rig.names, "channels": rig.channels, "end_sites": rig.end_sites}
    )
    small, large = divided(tensors, LARGE)
    digests = {"digest": digest_of(small, about, inputs), "large_digest": digest_of(large)}
    write_tensors(target, STORED_POSES, tensors, {"about": about, "inputs": inputs, **digests})


def open_poses(path: str | PathLike[str], *, verify: bool = False) -> PoseBank:
    """Open a saved bank by memory map: poses are read from the disk when they are first shown.

    All but the poses is checked; `verify` reads all of them and compares with their digest too. Raises ArtefactError, with the
    reason and the mend, where the file is truncated, altered, of another layout, or no pose bank; FileError where it cannot be
    read.
    """
    file = require_path(path)
    tensors, metadata = read_tensors(file, STORED_POSES, writeable=True)
    with STORED_POSES.reading(file):
        small, large = divided(tensors, LARGE)
        is_whole = digest_of(small, metadata["about"], metadata["inputs"]) == metadata["digest"]
        if not is_whole or (verify and digest_of(large) != metadata["large_digest"]):
            raise STORED_POSES.refused(file, "the file was altered: its contents do not match its digest.")
        about = json.loads(metadata["about"])
        channels = tuple(map(tuple, about["channels"]))
        ends = tuple((joint, tuple(offset)) for joint, offset in about["end_sites"])
        rig = Skeleton(tuple(about["names"]), tensors["parents"], tensors["offsets"], channels, ends)
        arrays: dict[str, Any] = {name: tensors[name] for name in ARRAYS}
        assets = tuple(texts_from_array(tensors["assets"]))
        return PoseBank(skeleton=rig, rate=about["rate"], feet=tuple(about["feet"]), assets=assets, **arrays)


def poses_path(folder: str | PathLike[str], name: str) -> Path:
    """Where the bank of the database of a name is saved. Raises ContextError for what is no path and no name, FileError where a
    link there leads out of the folder."""
    place = require_path(folder, "folder")
    return inside(place / file_name(require_text(name, "name"), SAVED_SUFFIX), place)


def saved_poses(folder: str | PathLike[str], databases: Mapping[str, MotionDatabase]) -> dict[str, PoseBank]:
    """The banks that are saved in a folder and hold the frames of these databases; the others are left out."""
    banks = {}
    for name, database in databases.items():
        try:
            bank = open_poses(poses_path(folder, name))
        except ContextDBError:
            continue
        once = slice(None, None, database.n_permutations)
        if bank.assets == database.assets[once] and bank.n_frames == int((database.stops - database.starts)[once].sum()):
            banks[name] = bank
    return moving_alike(banks)


def open_or_build_poses(
    config: MotionConfig,
    folder: str | PathLike[str],
    assets: Assets | None = None,
    *,
    names: Collection[str] | None = None,
    saved: str | PathLike[str] | None = None,
) -> dict[str, PoseBank]:
    """The pose banks of the databases of a project: those that are saved and up to date opened, the others built in memory.

    `config`, `folder`, `assets` and `names` are as for `build`. `saved` is where `contextdb motion build --poses` has put them; a
    relative path lies in `folder`, which is the default. Raises what `build` raises. A saved bank that cannot be used is built
    anew.
    """
    return moving_alike(poses_alone(config, folder, assets, names=names, saved=saved))


def poses_alone(
    config: MotionConfig,
    folder: str | PathLike[str],
    assets: Assets | None = None,
    *,
    names: Collection[str] | None = None,
    saved: str | PathLike[str] | None = None,
    engines: Engines = here,
) -> dict[str, PoseBank]:
    """The same, each as it is without the others: as it is saved. `engines` says where clips are read."""
    root = checked(config, folder, assets, names)
    place = root / (require_path(saved, "saved") if saved else "")
    inputs = Inputs.of(config, root, assets or {}, names)
    digests = inputs.digests(inputs.keys())
    return {name: _open(poses_path(place, name), digests[name]) or _built(inputs, name, engines) for name in inputs.wanted}


def _built(inputs: Inputs, name: str, engines: Engines) -> PoseBank:
    settings, files = inputs.config.databases[name], inputs.files[name]
    size = CHUNK if len(files) > MANY else 1
    chunks = [tuple(files[i : i + size]) for i in range(0, len(files), size)]
    schema = inputs.config.features[settings.features]
    run = here if schema.functions else engines
    worked = run(_parts, (settings, inputs.markups.get(name)), chunks, named_chunk, is_much=len(files) > MANY)
    return PoseBank.of_parts((each for parts in in_order(worked) for each in parts), schema.rate)


def _parts(about: tuple[DatabaseSettings, Markup | None], chunk: Chunk) -> list[ClipParts]:
    """What the clips of a chunk give to a bank."""
    settings, markup = about
    return [parts_of(read_clip(file), file.schema, settings.mirror, markup) for file in chunk]


def _open(path: Path, digest: str) -> PoseBank | None:
    try:
        return open_poses(path) if digest and read_tensors(path, STORED_POSES)[1].get("inputs") == digest else None
    except (ArtefactError, FileError):
        return None
