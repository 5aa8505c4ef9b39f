"""The files of a database's clips, and their features: computed, or from the cache.

A file is read once, and what is computed from it is stored under the digest of just these bytes, so that a file that changes
meanwhile does no harm. An edge: this touches the disk.

A clip of the same bones and lengths stays what it is, to the last bit. An edge: this touches the disk.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

import numpy as np

from contextdb.disk import matching, path_in_quotes
from contextdb.disk.boundary import inside
from contextdb.errors import Fault, MotionError, Place, in_quotes
from contextdb.files.toml_shapes import as_toml
from contextdb.motion.clips import mirror
from contextdb.motion.clips.clip import Clip
from contextdb.motion.clips.clip_measures import Measures, measure
from contextdb.motion.clips.feet import NO_MARKS, ContactMarks
from contextdb.motion.clips.on_the_spot import by_feet
from contextdb.motion.clips.skeleton import Skeleton
from contextdb.motion.clips.source import ClipSource, clip_name, takes_of
from contextdb.motion.features.extraction import ClipFeatures, clip_permutations
from contextdb.motion.features.schema import FeatureSchema
from contextdb.motion.markup.markup import Markup
from contextdb.motion.output.retargeting import retargeted
from contextdb.motion.storage.database_settings import DatabaseSettings
from contextdb.motion.storage.stored import FeatureCache, key_of

ON_THE_SPOT = "feet 2"
"""The version of the motion that standing feet give: another whenever the same clip would become another."""
UNEVEN_M = 0.005
"""Sides that differ by more metres are reported."""

MEND_WITHOUT_CLIPS = "to put clips there; `contextdb demo --keep FOLDER` makes some to experiment with"


@dataclass(frozen=True)
class ClipFile:
    """A clip of a database: its file, and what its features depend on next to the file's bytes."""

    path: Path
    settings: DatabaseSettings
    schema: FeatureSchema
    is_looping: bool = False
    contacts: ContactMarks = NO_MARKS
    rig: Rig | None = None
    """What the clip is put on."""
    take: str = ""
    """Which one it is of a file with several."""

    @property
    def asset(self) -> str:
        return clip_name(self.path, self.take)

    @property
    def sides(self) -> tuple[bool, ...]:
        """As what the clip plays: whether it is mirrored. Each has a range for every permutation of the schema."""
        return (False, True) if self.settings.mirror else (False,)

    @property
    def ranges(self) -> list[tuple[bool, int]]:
        """For each range of the clip whether it is mirrored, and which permutation it is."""
        return [(side, i) for side in self.sides for i in range(len(self.schema.permutation_s))]

    def source(self) -> ClipSource:
        """The file, read; raises FileError or ClipError."""
        return ClipSource.of(self.path)

    def keys(self, source: ClipSource) -> list[str]:
        """For each range the key of its features."""
        unit, up, of = self.settings.metres_per_unit, self.settings.up, source.format
        reader = "" if of.name == "BVH" else f"{of.name} {of.version} {self.take}"
        reader += f" {ON_THE_SPOT}" if self.settings.root == "feet" else ""
        key = partial(key_of, source.content, self.schema, metres_per_unit=unit, up=up, reader=reader)
        key = partial(key, looping=self.is_looping, contacts=self.contacts)
        rig = "" if self.rig is None else self.rig.digest
        return [key(mirrored=side, permutation=i, rig=rig) for side, i in self.ranges]


@dataclass(frozen=True, eq=False)
class Extracted:
    """The features of a clip's ranges and its measures, with the keys of the ranges, and whether any had to be computed."""

    file: ClipFile
    parts: list[ClipFeatures]
    measures: Measures
    keys: list[str]
    is_computed: bool
    unevenness: Mapping[str, float]
    """Of a clip that is mirrored too, how far each bone is off when mirrored rotations are played with the rig's own offsets: in
    metres, the farthest first."""


def clip_files(
    settings: DatabaseSettings,
    schema: FeatureSchema,
    folder: Path,
    assets: Collection[str] | None = None,
    file: str | None = None,
    markup: Markup | None = None,
) -> list[ClipFile]:
    """The clips of a database in the order of their paths; with `assets` those of these names alone. The markup says which loop,
    and when feet are down. Raises MotionError where no file fits the pattern, or two of the files have one name; `file` is that of
    the settings in messages; FileError or MotionError where the rig cannot be read; see `Rig.of`."""
    named = named_takes(settings, folder, file)
    if not named:
        problem = f"[databases.{settings.name}] no file matches clips = {as_toml(settings.clips)}."
        raise MotionError(Fault(problem, mend=MEND_WITHOUT_CLIPS, place=Place(file), rule="file"))
    wanted = [(name, path, take) for name, path, take in named if assets is None or settings.asset_of(name) in assets]
    faults = list(_twice_named(settings.name, wanted, file))
    if faults:
        raise MotionError(*faults)
    loops = {name for name, _, _ in wanted if markup is not None and markup.is_looping(name)}
    marks = {name: NO_MARKS if markup is None else markup.contacts_of(name) for name, _, _ in wanted}
    rig = Rig.of(settings, folder, file)
    return [ClipFile(path, settings, schema, name in loops, marks[name], rig, take) for name, path, take in wanted]


def paths_of(settings: DatabaseSettings, folder: Path, file: str | None = None) -> list[Path]:
    """The files that fit the pattern of a database, sorted; a MotionError where it is none."""
    try:
        return matching(folder, settings.clips)
    except (ValueError, NotImplementedError):
        problem = f"[databases.{settings.name}] clips = {as_toml(settings.clips)} is not a pattern."
        raise MotionError(Fault(problem, '"clips/*.bvh", "clips/**/*.bvh"', place=Place(file), rule="file")) from None


def named_takes(settings: DatabaseSettings, folder: Path, file: str | None = None) -> list[tuple[str, Path, str]]:
    """The clips of a database in the order of their paths: the name of each, its file, and its take in a file with several."""
    return [(clip_name(path, take), path, take) for path in paths_of(settings, folder, file) for take in takes_of(path) or ("",)]


def unmatched(
    databases: Iterable[DatabaseSettings], folder: Path, assets: Mapping[str, Collection[str]]
) -> tuple[dict[str, list[str]], list[str]]:
    """What has no counterpart: for each table the assets of which no database has a clip, and the clips that no database holds.

    `assets` gives for a table's name the assets in it. A table that no database names is passed over.
    """
    clips: dict[str, set[str]] = {}
    matched: set[str] = set()
    held: set[str] = set()
    for settings in databases:
        names = {settings.asset_of(name) for name, _, _ in named_takes(settings, folder)}
        matched |= names
        if settings.table is not None:
            clips.setdefault(settings.table, set()).update(names)
        held |= names if settings.table is None else names.intersection(assets[settings.table])
    missing = {table: [asset for asset in dict.fromkeys(assets[table]) if asset not in names] for table, names in clips.items()}
    return {table: names for table, names in missing.items() if names}, sorted(matched - held)


def extract(file: ClipFile, cache: FeatureCache | None = None) -> Extracted:
    """The features of a clip's ranges: from the cache, or computed and then stored in it.

    Nothing is stored of a schema with functions: whether they still are what they were cannot be reported. Raises MotionError or
    FileError where the clip cannot be read, has no frame, or lacks a bone of the schema.
    """
    source = file.source()
    keys = file.keys(source)
    cache = None if file.schema.functions else cache
    cached = [_cached(file, key, side, cache) for key, (side, _) in zip(keys, file.ranges, strict=True)]
    parts = [part for part in cached if part is not None]
    if len(parts) == len(cached):
        unevenness = _unevenness(file, *_rest_of(file, source)) if file.settings.mirror else {}
        return Extracted(file, [part for part, _ in parts], parts[0][1], keys, is_computed=False, unevenness=unevenness)
    clip = _parsed(file, source)
    if clip.n_frames == 0:
        accepted = "a clip with at least one frame, and three for its velocities"
        mend = "to export it again, or take it out of the folder"
        raise MotionError(Fault("the clip has no frame (Frames: 0).", accepted, mend, Place(str(file.path))))
    measures = measure(clip)
    computed = [
        part
        for side in file.sides
        for part in clip_permutations(clip, file.schema, mirrored=side, looping=file.is_looping, contacts=file.contacts)
    ]
    if cache is not None:
        for key, part in zip(keys, computed, strict=True):
            cache.write(file.settings.name, key, part, measures)
    unevenness = _unevenness(file, clip.skeleton, clip.metres_per_unit) if file.settings.mirror else {}
    return Extracted(file, computed, measures, keys, is_computed=True, unevenness=unevenness)


def read_clip(file: ClipFile) -> Clip:
    """The clip itself, on the rig of its database; raises ClipError, MotionError and FileError."""
    return _parsed(file, file.source())


def _rest_of(file: ClipFile, source: ClipSource) -> tuple[Skeleton, float]:
    """The skeleton and its unit of a clip whose features are known, so that it could be read."""
    if file.rig is not None:
        return file.rig.skeleton, file.rig.metres_per_unit
    clip = _parsed(file, source)
    return clip.skeleton, clip.metres_per_unit


def _unevenness(file: ClipFile, skeleton: Skeleton, metres_per_unit: float) -> dict[str, float]:
    apart = mirror.unevenness(skeleton, file.schema.mirror)
    return {bone: metres for bone, units in apart.items() if (metres := units * metres_per_unit) > UNEVEN_M}


def _cached(file: ClipFile, key: str, is_mirrored: bool, cache: FeatureCache | None) -> tuple[ClipFeatures, Measures] | None:
    return None if cache is None else cache.read(file.settings.name, key, file.asset, mirrored=is_mirrored)


def _parsed(file: ClipFile, source: ClipSource) -> Clip:
    clip = source.clip(file.take, metres_per_unit=file.settings.metres_per_unit, up=file.settings.up)
    clip = by_feet(clip) if file.settings.root == "feet" else clip
    return clip if file.rig is None or not clip.n_frames else file.rig.clip(clip)


def _twice_named(database: str, named: Sequence[tuple[str, Path, str]], file: str | None) -> Iterator[Fault]:
    first: dict[str, Path] = {}
    for name, path, _ in named:
        other = first.setdefault(name, path)
        if other is not path:
            both = f"{path_in_quotes(other)} and {path_in_quotes(path)}"
            problem = f"[databases.{database}] two clips are named {in_quotes(name)}: {both}."
            yield Fault(problem, "a different name for each asset", place=Place(file), rule="duplicate")


# ---- the rig of a database: clips of other bodies become clips of it before anything else is made of them


RETARGETING = 2
"""The version of what a clip becomes: one more whenever the same clip would become another."""
SAME_M = 1e-4
"""Bones that differ by less are of one body: files round their numbers."""


@dataclass(frozen=True, eq=False)
class Rig:
    """What clips are put on: a skeleton, the unit of its offsets, for bones of it those of clips that name them otherwise, clips
    whose first frames show one pose of reference, and a digest of all that."""

    skeleton: Skeleton
    metres_per_unit: float
    bones: Mapping[str, str]
    references: tuple[Clip, ...]
    digest: str

    @classmethod
    def of(cls, settings: DatabaseSettings, folder: Path, file: str | None = None) -> Rig | None:
        """The rig of a database; None where it has none. `file` is that of the settings in messages. Raises FileError or ClipError
        where the rig's file cannot be read, MotionError where it has no such bone as one of `rig_bones`."""
        if settings.rig is None:
            return None
        unit = settings.metres_per_unit if settings.rig_metres_per_unit is None else settings.rig_metres_per_unit
        source = ClipSource.of(inside(folder / settings.rig, folder))
        clip = source.clip(next(iter(source.takes), ""), metres_per_unit=unit)
        skeleton, unit = clip.skeleton, clip.metres_per_unit
        if unknown := [skeleton.missing_bone(bone) for bone in settings.rig_bones if bone not in skeleton]:
            where = f"[databases.{settings.name}] rig_bones:"
            raise MotionError(*(replace(fault, found=f"{where} {fault.found}", place=Place(file)) for fault in unknown))
        about = json.dumps([RETARGETING, float(unit).hex(), sorted(settings.rig_bones.items())])
        digest = hashlib.blake2b(about.encode(), digest_size=16)
        digest.update(source.content)
        references = []
        for path in _poses_of_reference(settings, folder, file):
            shown = ClipSource.of(path)
            digest.update(shown.content)
            references.append(shown.clip(next(iter(shown.takes), ""), metres_per_unit=unit, up=settings.up))
        return cls(skeleton, unit, settings.rig_bones, tuple(references), digest.hexdigest())

    def clip(self, clip: Clip) -> Clip:
        """A clip on this rig. Raises MotionError where it has no legs, or rests otherwise."""
        if self._is_of(clip):
            return clip
        missing = [
            clip.skeleton.missing_bone(other).at(Place(clip.name))
            for bone, other in self.bones.items()
            if other not in clip.skeleton and bone not in clip.skeleton
        ]
        if missing:
            raise MotionError(*missing)
        names = {bone: other for bone, other in self.bones.items() if other in clip.skeleton}
        return retargeted(clip, self.skeleton, metres_per_unit=self.metres_per_unit, names=names, references=self.references)

    def _is_of(self, clip: Clip) -> bool:
        own, other = self.skeleton, clip.skeleton
        if own.names != other.names or own.parents.tolist() != other.parents.tolist():
            return False
        apart = self.metres_per_unit * own.offsets[1:] - clip.metres_per_unit * other.offsets[1:]
        return bool(np.abs(apart).max(initial=0.0) < SAME_M)


def _poses_of_reference(settings: DatabaseSettings, folder: Path, file: str | None) -> list[Path]:
    """The files of `rig_pose`, sorted; a MotionError where there is none."""
    paths = [] if settings.rig_pose is None else matching(folder, settings.rig_pose)
    if settings.rig_pose is not None and not paths:
        problem = f"[databases.{settings.name}] no file matches rig_pose = {as_toml(settings.rig_pose)}."
        raise MotionError(Fault(problem, place=Place(file), rule="file"))
    return paths
