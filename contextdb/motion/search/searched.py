"""What a motion database holds: data only. `MotionDatabase` says what each part is, and asks it."""

from __future__ import annotations

from dataclasses import dataclass

from contextdb.motion.arguments import Flags
from contextdb.motion.clips.quaternions import Floats
from contextdb.motion.clips.skeleton import Ints
from contextdb.motion.features.normalisation import Normalisation
from contextdb.motion.features.schema import FeatureSchema
from contextdb.motion.markup.marks import Marks
from contextdb.motion.search.filters import NO_BIAS, Biases
from contextdb.motion.search.layout import Features, Layout


@dataclass(frozen=True, eq=False)
class Searched:
    """The parts of a motion database."""

    layout: Layout
    starts: Ints
    stops: Ints
    assets: tuple[str, ...]
    mirrored: Flags
    channel_names: tuple[str, ...]
    slices: tuple[slice, ...]
    weights: Floats
    normalisation: Normalisation
    marks: Marks
    biases: Biases = NO_BIAS
    root: Features | None = None
    schema: FeatureSchema | None = None
