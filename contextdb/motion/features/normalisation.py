"""Make features of different units comparable: `(x - offset) / scale`. Weights are no part of it: turning one rebuilds nothing.

The offset is each feature's mean. The scale is one number for all features of a group (a channel, unless the schema says
otherwise): the mean of their standard deviations. Databases whose costs are compared, as in a selector, must share one.

Source: orangeduck/Motion-Matching, `database.h`, `normalize_feature`; there the weight is folded into the scale.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from contextdb.motion.clips.quaternions import Floats
from contextdb.motion.features.extraction import Features
from contextdb.motion.features.schema import FeatureSchema

SMALLEST_SCALE = 1e-5
"""A group that varies less tells no frames apart; its features stay in their own units, instead of blowing up rounding errors."""


@dataclass(frozen=True, eq=False)
class Normalisation:
    """Offset and scale of each feature: float64 [N] each."""

    offset: Floats
    scale: Floats

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
        """The normalisation that fits all frames of some blocks [F, N] of features."""
        features = np.concatenate([np.zeros((0, schema.n_features), np.float32), *blocks]).astype(np.float64)
        if not len(features):
            return cls.none(schema.n_features)
        deviations = features.std(axis=0)
        scale = np.ones(schema.n_features)
        for columns in _groups(schema):
            mean = float(deviations[columns].mean())
            scale[columns] = mean if mean > SMALLEST_SCALE else 1.0
        return cls(features.mean(axis=0), scale)


def _groups(schema: FeatureSchema) -> list[list[int]]:
    """The features of each group."""
    groups: dict[str, list[int]] = {}
    for channel in schema.channels:
        key = f"group {channel.group}" if channel.group else f"channel {channel.name}"
        block = schema.slices[channel.name]
        groups.setdefault(key, []).extend(range(block.start, block.stop))
    return list(groups.values())
