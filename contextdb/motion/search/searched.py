"""What a motion database holds: data only. `MotionDatabase` says what each part is, and asks it."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

from contextdb.motion.arguments import Flags
from contextdb.motion.clips.quaternions import Floats
from contextdb.motion.clips.skeleton import Ints
from contextdb.motion.features.normalisation import Normalisation
from contextdb.motion.features.schema import FeatureSchema
from contextdb.motion.markup.marks import Marks
from contextdb.motion.search import cost
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

    @cached_property
    def n_permutations(self) -> int:
        """How many ranges each clip has, as it is and as many mirrored; they follow one another."""
        return 1 if self.schema is None else len(self.schema.permutation_s)

    def permutation_s(self, range_number: int) -> float | None:
        """How many seconds ahead the permuted channels of a range look; None for a database without permutations."""
        if self.schema is None or self.schema.permutations is None:
            return None
        return self.schema.permutation_s[range_number % self.n_permutations]

    def in_permutations(self, range_number: int, start: int, stop: int) -> list[tuple[int, int]]:
        """Frames [start, stop) of a range as each permutation of its clip has them."""
        n = self.n_permutations
        if n == 1:
            return [(start, stop)]
        length = int(self.stops[range_number] - self.starts[range_number])
        steps = [(i - range_number % n) * length for i in range(n)]
        return [(start + step, stop + step) for step in steps]

    @cached_property
    def cost_weights(self) -> Floats:
        """What each channel's squared differences are multiplied by in a cost: float64 [C].

        The weights divided by the sum of weight x features over all channels, so that a cost is a weighted mean and means the same
        for every schema. Of a database made from features the weights themselves.
        """
        return self.weights if self.schema is None else cost.shares_of(self.slices, self.weights)
