"""The rig of a database: clips of other bodies become clips of it before anything else is made of them.

A clip of the same bones and lengths stays what it is, to the last bit. An edge: this touches the disk.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from contextdb.disk import matching
from contextdb.disk.boundary import inside
from contextdb.errors import Fault, MotionError, Place
from contextdb.files.toml_shapes import as_toml
from contextdb.motion.clips.clip import Clip
from contextdb.motion.clips.skeleton import Skeleton
from contextdb.motion.clips.source import ClipSource
from contextdb.motion.output.retargeting import retargeted
from contextdb.motion.storage.database_settings import DatabaseSettings

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
