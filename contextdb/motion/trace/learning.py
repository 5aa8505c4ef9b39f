"""Weights of channels learned from what people would have chosen in recorded sessions.

The choices make pairs of frames (`contextdb.motion.trace.choice_pairs`) to which weights are fitted
(`contextdb.motion.trace.learning`). The searches are then repeated with them, and where yet another asset comes before a
preferred one, that is a pair too; so on until no new one comes. Weights belong to features: databases with the same features
learn together.

P pairs, C channels. With the differences x of a pair (each channel's sum of squares of the frame that should cost more, less that
of the other) it comes out right where w·x > 0. The weights are the least of

    sum over pairs of log(1 + exp(-u·x)) + PULL/2 · sum over channels of (r (u - t w))²        over u ≥ 0

with the root mean square r of each channel's differences, and the present weights w times the t with which w·x is SURE in the root
mean square. So few pairs change the weights little, and a channel that no pair says anything of keeps its weight; how sure the
choices are is the length of u. One coordinate after the other takes a step that cannot overshoot, as its curvature is bounded.

Source: Bradley and Terry, "Rank analysis of incomplete block designs", Biometrika 1952; Böhning and Lindsay, "Monotonicity of
quadratic-approximation algorithms", 1988, for the bound. The pull is ours.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass

import numpy as np

from contextdb.motion.clips.quaternions import Floats
from contextdb.motion.trace.choice_pairs import ChoicePairs, ChoiceSession, Weights

MOST_REPEATS = 10
FOLDS = 5
DIGITS = 3
"""So many digits of a weight are learned."""


@dataclass(frozen=True, slots=True)
class LearnedWeight:
    """A channel's weight as it is, and as it was learned."""

    features: str
    channel: str
    now: float
    learned: float


@dataclass(frozen=True, slots=True)
class Score:
    """In how many searches what people would choose is chosen, and how many pairs come out right."""

    searches: int
    pairs: int


@dataclass(frozen=True)
class Learned:
    """What choices teach."""

    choices: int
    searches: int
    pairs: int
    """`choices`, `searches`, `pairs`: how many choices there are, in how many searches, and how many pairs of frames they make."""
    now: Score
    after: Score
    """`now`, `after`: with the present weights, and with the learned ones."""
    held_out: int
    """How many pairs come out right with weights that were learned without the searches that they are of."""
    weights: tuple[LearnedWeight, ...]
    """All channels of the features that the pairs are of."""
    unusable: tuple[str, ...]
    """Choices that no weight can follow, each with the reason."""

    @property
    def is_better(self) -> bool:
        """Whether the learned weights follow more choices than the present ones."""
        return (self.after.searches, self.after.pairs) > (self.now.searches, self.now.pairs)

    @property
    def of_features(self) -> dict[str, dict[str, float]]:
        """The learned weights by features and channel, where they differ from the present ones."""
        weights: dict[str, dict[str, float]] = {}
        for each in self.weights:
            if each.learned != each.now:
                weights.setdefault(each.features, {})[each.channel] = each.learned
        return weights

    def to_json(self) -> dict[str, object]:
        return asdict(self)


def learn(sessions: Sequence[ChoiceSession]) -> Learned:
    """The weights that the choices of some sessions ask for. Raises MotionError for choices that are of no search or asset."""
    present = _present(sessions)
    pairs = ChoicePairs.of(sessions)
    weights = _learned(pairs, present)
    for _ in range(MOST_REPEATS):
        if not pairs.add_winners(weights):
            break
        weights = _learned(pairs, present)
    now = {name: present[name].weights for name in weights}
    return Learned(
        sum(len(session.preferences) for session in sessions),
        sum(len(session.moments) for session in sessions),
        len(pairs),
        _score(pairs, now),
        _score(pairs, weights),
        sum(_n_held_out(pairs, name, present[name]) for name in weights),
        tuple(LearnedWeight(name, channel, now[name][channel], to) for name in weights for channel, to in weights[name].items()),
        tuple(pairs.unusable),
    )


@dataclass(frozen=True)
class _Channels:
    """The present weights of the channels of some features, and of how many features each is."""

    weights: Mapping[str, float]
    sizes: Floats

    def learned(self, differences: Floats) -> dict[str, float]:
        """The weights that pairs [P, C] ask for, of few digits; over all features their sum is the present one."""
        now = np.array(list(self.weights.values()))
        fitted = fitted_weights(differences, now) if len(differences) else now
        scaled = fitted * (float(now @ self.sizes) / float(fitted @ self.sizes))
        return {name: float(f"{weight:.{DIGITS}g}") for name, weight in zip(self.weights, scaled.tolist(), strict=True)}


def _present(sessions: Sequence[ChoiceSession]) -> dict[str, _Channels]:
    present: dict[str, _Channels] = {}
    for session in sessions:
        for name, each in session.stock.databases.items():
            sizes = np.array([part.stop - part.start for part in each.slices], np.float64)
            weights = dict(zip(each.channel_names, each.weights.tolist(), strict=True))
            present.setdefault(session.features_of[name], _Channels(weights, sizes))
    return present


def _learned(pairs: ChoicePairs, present: Mapping[str, _Channels]) -> dict[str, dict[str, float]]:
    return {name: present[name].learned(pairs.differences(name)[1]) for name in pairs.of_features}


def _score(pairs: ChoicePairs, weights: Weights) -> Score:
    n_right = sum(_n_right(pairs.differences(name)[1], own) for name, own in weights.items())
    return Score(sum(session.n_followed(weights) for session in pairs.sessions), n_right)


def _n_right(differences: Floats, weights: Mapping[str, float]) -> int:
    return int(np.count_nonzero(differences @ np.array(list(weights.values())) > 0.0)) if len(differences) else 0


def _n_held_out(pairs: ChoicePairs, features: str, present: _Channels) -> int:
    """How many pairs come out right with what the other folds teach."""
    parts = [pairs.differences(features, fold, FOLDS) for fold in range(FOLDS)]
    return sum(_n_right(held_out, present.learned(rest)) for rest, held_out in parts)


# ---- weights of channels fitted to pairs of frames of which one should cost less: convex, and never below 0


PULL, SURE = 0.03, 10.0
"""Measured: of PULL 0.03 to 1 and SURE 1 to 10, hidden weights come back best with these from 60 pairs, and one pair, which is then
always right, changes the weights least."""
SMALLEST = 1e-3
"""The differences of a channel are taken for so much of the largest at least, so that one without any is pulled too."""
MOST_ROUNDS = 2000
ENOUGH = 1e-6


def fitted_weights(differences: Floats, weights: Floats) -> Floats:
    """The weights, float64 [C], that the pairs [P, C] ask for; their scale has no meaning. `weights` [C] are the present ones."""
    size = np.sqrt((differences**2).mean(axis=0))
    size = np.maximum(size, SMALLEST * size.max())
    scaled, present = differences / size, weights * size
    present = present * (SURE / max(float(np.sqrt(((scaled @ present) ** 2).mean())), 1e-9))
    fitted, margins = present.copy(), scaled @ present
    curvature = (scaled**2).sum(axis=0) / 4.0 + PULL
    for _ in range(MOST_ROUNDS):
        largest = 0.0
        for c, (column, bound) in enumerate(zip(scaled.T, curvature.tolist(), strict=True)):
            wrong = 0.5 - 0.5 * np.tanh(0.5 * margins)
            step = max(-fitted[c], (float(column @ wrong) - PULL * (fitted[c] - present[c])) / bound)
            margins += step * column
            fitted[c] += step
            largest = max(largest, abs(step))
        if largest <= ENOUGH * fitted.max():
            break
    return np.asarray(fitted / size)
