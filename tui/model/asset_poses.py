"""The poses of a table's assets, to be looked at: out of saved pose banks, or read from the clips. No Textual here.

A clip that was looked at is kept, up to `MOST_KEPT`. This reads the disk, and reading a clip takes its time: call `poses` from a
thread.
"""

from __future__ import annotations

import math
from collections import OrderedDict
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np

from contextdb.authoring.clip_folder import clips_below
from contextdb.errors import ContextDBError, Fault, in_quotes, mend_for, plural
from contextdb.motion.clips.clip import Clip
from contextdb.motion.clips.clip_measures import measure, unit_of
from contextdb.motion.clips.quaternions import Floats
from contextdb.motion.clips.source import ClipSource, clip_name, takes_of
from contextdb.motion.features.schema import FeatureSchema
from contextdb.motion.output.bank import PoseBank
from contextdb.motion.storage.clip_files import ClipFile, Rig, named_takes, read_clip
from contextdb.motion.storage.config import MotionConfig
from contextdb.motion.storage.database_settings import DatabaseSettings
from contextdb.motion.storage.pose_files import open_poses, poses_path
from contextdb.tables.table import Table

MOST_KEPT = 64
MOST_S = 600.0
"""Of a longer clip nobody sees the end in a pane: it is refused rather than read for minutes."""
RATE = 30.0
PLAIN = FeatureSchema.from_dict(
    "preview", {"rate": RATE, "channels": [{"type": "trajectory", "what": "position", "at": [1.0], "weight": 1.0}]}
)
"""How the body is found in a clip of no database; its channels are not looked at."""
NO_CLIPS = (
    'No clips: contextdb.toml names them in [databases.NAME], as clips = "clips/*.bvh" and table = {}, and none lies in the folder.'
    " Autofill (Shift+F4) reads a folder of clips."
)


@dataclass(frozen=True, eq=False)
class AssetPoses:
    """The poses of one asset."""

    asset: str
    bank: PoseBank
    number: int
    """Its range in the bank."""
    source: str
    """The file, for people."""

    @property
    def last_s(self) -> float:
        """From its first frame to its last."""
        return self.bank.last_s(self.number)

    def bones_at(self, time_s: float) -> Floats:
        """The joints at a moment [J, 3], the body at the origin."""
        return self.bank.joints_at(self.number, time_s)

    def root_at(self, time_s: float) -> tuple[float, float, float]:
        """Where the body is on the ground, and its heading."""
        return self.bank.moment_of(self.number, time_s).root

    @cached_property
    def way(self) -> Floats:
        """Where the body is in each frame [F, 3]: x, z and heading."""
        own = slice(int(self.bank.starts[self.number]), int(self.bank.stops[self.number]))
        return np.asarray(self.bank.root[own], np.float64)


@dataclass(frozen=True)
class _Place:
    """Where the clip of an asset is."""

    name: str
    path: Path
    take: str
    settings: DatabaseSettings | None
    """None for a clip of no database."""


class PosesOfAssets:
    """The clips of a table's assets."""

    def __init__(self, table: Table) -> None:
        self._schema, self._name = table.schema, table.settings.name
        self._seen: OrderedDict[str, AssetPoses | Fault] = OrderedDict()
        self._banks: dict[str, PoseBank | None] = {}

    def known(self, asset: str) -> AssetPoses | Fault | None:
        """What was read of an asset, or why it could not be; None where it was not looked at."""
        return self._seen.get(asset)

    def poses(self, asset: str) -> AssetPoses | Fault:
        """The poses of an asset, or why there are none."""
        if asset not in self._seen:
            try:
                self._seen[asset] = self._read(asset)
            except ContextDBError as error:
                self._seen[asset] = error.faults[0]
            while len(self._seen) > MOST_KEPT:
                self._seen.popitem(last=False)
        self._seen.move_to_end(asset)
        return self._seen[asset]

    # ---- parts

    @cached_property
    def _config(self) -> MotionConfig:
        return MotionConfig.from_dict(self._schema.motion, file=self._schema.file)

    @cached_property
    def _folder(self) -> Path | None:
        return Path(self._schema.file).parent if self._schema.file else None

    @cached_property
    def _databases(self) -> list[DatabaseSettings]:
        """Those of the table first: an asset of another table may be played by this one, too."""
        return sorted(self._config.databases.values(), key=lambda one: one.table != self._name)

    @cached_property
    def _places(self) -> dict[str, _Place]:
        """The clips by the assets that they are for."""
        places: dict[str, _Place] = {}
        for place in self._clips():
            asset = place.name if place.settings is None else place.settings.asset_of(place.name)
            places.setdefault(asset, place)
        return places

    def _clips(self) -> Iterator[_Place]:
        if self._folder is None:
            return
        for settings in self._databases:
            for name, path, take in named_takes(settings, self._folder, self._schema.file):
                yield _Place(name, path, take, settings)
        if not self._databases:
            for path in clips_below(self._folder):
                for take in takes_of(path) or ("",):
                    yield _Place(clip_name(path, take), path, take, None)

    def _read(self, asset: str) -> AssetPoses | Fault:
        place = self._places.get(asset)
        if place is None:
            return self._no_clip(asset)
        bank = self._saved(place)
        if bank is None:
            clip, schema = self._clip(place)
            if clip.duration_s > MOST_S:
                return Fault(f"the clip of {in_quotes(asset)} lasts {clip.duration_s:.0f} s.", f"at most {MOST_S:.0f} s")
            bank = PoseBank.build([clip], schema)
        return AssetPoses(asset, bank, bank.range_of(place.name), self._file_text(place))

    def _no_clip(self, asset: str) -> Fault:
        names = list(self._places)
        if not names:
            return Fault(NO_CLIPS.format(in_quotes(self._name)))
        return Fault(f"No clip is named {in_quotes(asset)}.", f"one of {plural(len(names), 'clip')}", mend_for(asset, names))

    def _saved(self, place: _Place) -> PoseBank | None:
        """The saved bank with the clip, unless the clip is newer."""
        if place.settings is None or self._folder is None:
            return None
        name = place.settings.name
        try:
            path = poses_path(self._folder, name)
            if name not in self._banks:
                self._banks[name] = open_poses(path) if path.is_file() else None
            bank = self._banks[name]
            is_older = bank is None or path.stat().st_mtime < place.path.stat().st_mtime
        except (ContextDBError, OSError):
            self._banks.setdefault(name, None)
            return None
        return None if is_older or bank is None or place.name not in bank.assets else bank

    def _clip(self, place: _Place) -> tuple[Clip, FeatureSchema]:
        """The clip as its database has it, and how its root is found; of no database in the likeliest unit."""
        settings = place.settings
        if settings is None or self._folder is None:
            source = ClipSource.of(place.path)
            clip = source.clip(place.take)
            unit = None if source.format.states_unit else unit_of(measure(clip))
            if unit is not None and not math.isclose(unit, clip.metres_per_unit):
                clip = source.clip(place.take, metres_per_unit=unit)
            return clip, PLAIN
        rig, schema = Rig.of(settings, self._folder, self._schema.file), self._config.features[settings.features]
        return read_clip(ClipFile(place.path, settings, schema, take=place.take, rig=rig)), schema

    def _file_text(self, place: _Place) -> str:
        folder = self._folder or Path()
        text = place.path.relative_to(folder).as_posix() if place.path.is_relative_to(folder) else place.path.name
        return f"{text} {place.take}".rstrip()
