"""Make features of different units comparable: `(x - offset) / scale`. Weights are no part of it: turning one rebuilds nothing.

The offset is each feature's mean. The scale is one number for all features of a group (a channel, unless the schema says
otherwise): the mean of their standard deviations, and at least the floor of the group's channels. Databases whose costs are
compared, as in a selector, must share one.

A floor keeps a channel that hardly varies in the clips from being all that a cost is made of: of clips that go straight, the least
turn would cost more than the worst pose. Each is in the channel's own unit. The pose of a query comes from clips, so its floors are
differences that nobody sees. The path of a query comes from a stick, which asks for turns and speeds whatever the clips have, so
its floors are differences that a player feels.

Source: orangeduck/Motion-Matching, `database.h`, `normalize_feature`; there the weight is folded into the scale. The floors are
ours.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from contextdb.motion.clips.quaternions import Floats
from contextdb.motion.features.channels import Channel
from contextdb.motion.features.extraction import Features
from contextdb.motion.features.schema import FeatureSchema

SMALLEST_SCALE = 1e-5
"""A group without a floor that varies less tells no frames apart; its features stay in their own units, instead of blowing up
rounding errors."""

FLOORS: dict[str, tuple[float, str]] = {
    "position": (0.01, "m"),
    "velocity": (0.1, "m/s"),
    "angular_velocity": (0.1, "rad/s"),
    "direction": (0.02, "of a unit vector"),
    "orientation": (0.02, "of a unit vector"),
    "phase": (0.2, "of a sine"),
    "permutation_time": (0.1, "s"),
    "trajectory position": (0.1, "m"),
    "trajectory velocity": (0.2, "m/s"),
    "trajectory speed": (0.2, "m/s"),
    "trajectory direction": (0.2, "of a unit vector"),
    "trajectory direction_to_velocity": (0.2, "of a unit vector"),
}
"""The least scale of each kind of channel, and its unit. A custom channel has none: its unit is its function's."""


@dataclass(frozen=True, slots=True)
class RaisedScale:
    """A group of channels that varies less than its floor, which is its scale therefore; `spread` is the mean of the standard
    deviations of their features."""

    channels: tuple[str, ...]
    spread: float
    floor: float
    unit: str


@dataclass(frozen=True, eq=False)
class Normalisation:
    """Offset and scale of each feature: float64 [N] each; and which groups of channels vary too little for a scale of their own."""

    offset: Floats
    scale: Floats
    raised: tuple[RaisedScale, ...] = ()

    def apply(self, features: Features | Floats) -> Floats:
        """Features [..., N] in the schema's units, normalised."""
        return np.asarray((np.asarray(features, np.float64) - self.offset) / self.scale)

    def undo(self, features: Features | Floats) -> Floats:
        """Normalised features [..., N], in the schema's units."""
        return np.asarray(np.asarray(features, np.float64) * self.scale + self.offset)

    @classmethod
    def none(cls, n_features: int) -> Normalisation:
        """The one that changes nothing."""
        return cls(np.zeros(n_features), np.ones(n_features))

    @classmethod
    def of(cls, blocks: Sequence[Features], schema: FeatureSchema) -> Normalisation:
        """The normalisation that fits all frames of some blocks [F, N] of features, which are looked at one by one."""
        n_frames = sum(map(len, blocks))
        if not n_frames:
            return cls.none(schema.n_features)
        mean = _sum(block.astype(np.float64) for block in blocks) / n_frames
        deviations = np.sqrt(_sum((block.astype(np.float64) - mean) ** 2 for block in blocks) / n_frames)
        scale, raised = np.ones(schema.n_features), []
        for channels in _groups(schema):
            columns = np.concatenate([np.arange(schema.n_features)[schema.slices[channel.name]] for channel in channels])
            spread = float(deviations[columns].mean())
            floor, unit = min(map(floor_of, channels))
            if spread < floor:
                raised.append(RaisedScale(tuple(channel.name for channel in channels), spread, floor, unit))
            scale[columns] = max(spread, floor) if max(spread, floor) > SMALLEST_SCALE else 1.0
        return cls(mean, scale, tuple(raised))


def _sum(blocks: Iterable[Floats]) -> Floats:
    """The sum of all rows of some blocks, one row after another: to the last bit that of the blocks in one."""
    total: Floats | None = None
    for block in blocks:
        rows = block if total is None else np.concatenate((total[None], block))
        total = np.add.reduce(rows, axis=0)
    return np.zeros(0) if total is None else total


def floor_of(channel: Channel) -> tuple[float, str]:
    """The least scale of a channel, and its unit; 0 for a custom channel."""
    kind = f"trajectory {channel.what}" if channel.type == "trajectory" else channel.type
    return FLOORS.get(kind, (0.0, ""))


def _groups(schema: FeatureSchema) -> list[list[Channel]]:
    groups: dict[str, list[Channel]] = {}
    for channel in schema.channels:
        key = f"group {channel.group}" if channel.group else f"channel {channel.name}"
        groups.setdefault(key, []).append(channel)
    return list(groups.values())
