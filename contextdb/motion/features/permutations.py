"""Permutations: each clip is searched several times over, each time with its permuted channels so many seconds ahead of its frame.

So a query can say what shall be when: a hand at the ball in 0.4 s. Permutation i looks from_s + i x step_s ahead.

Source: NumberOfPermutations, PermutationsSampleRate and PermutationsTimeOffset of Unreal's PoseSearch.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

from contextdb.errors import ContextError
from contextdb.files.settings import Declared, Section, number, settings_of
from contextdb.motion.features.channels import MOST_SECONDS

ACCEPTED = "{ count = 5, step_s = 0.1 }"
LEAST_STEP_S = 1e-3


@dataclass(frozen=True)
class Permutations(Declared, error=ContextError):
    """How often each clip is searched, and how far ahead the permuted channels look each time.

    Raises
    ------
    ContextError
        A number out of range.
    """

    count: int = number("How often each clip is searched.", least=1, most=100, unit="a whole number", such_as=5, is_whole=True)
    step_s: float = number(
        "Seconds between one permutation and the next.",
        0.0,
        0.0,
        MOST_SECONDS,
        "seconds",
        0.1,
        without="required where `count` is above 1",
    )
    from_s: float = number("Seconds that the first looks ahead.", 0.0, 0.0, MOST_SECONDS, "seconds", 0.2)

    @cached_property
    def seconds(self) -> tuple[float, ...]:
        """How far ahead each permutation looks."""
        return tuple(round(self.from_s + i * self.step_s, 9) for i in range(self.count))


PERMUTATIONS = settings_of(Permutations)


def read_permutations(parent: Section, value: Mapping[str, object]) -> Permutations | None:
    """Those of `[features.NAME]`; None when a fault is left behind."""
    n_faults = len(parent.faults)
    section = parent.inside("permutations", value, PERMUTATIONS)
    values = section.values(PERMUTATIONS)
    accepted = f"seconds from {LEAST_STEP_S:g} to {MOST_SECONDS:g}, such as 0.1"
    if values.get("count", 1) > 1 and "step_s" not in value:
        section.add(f'{section.where} has no "step_s".', accepted)
    if values.get("step_s", 1.0) < LEAST_STEP_S:
        section.wrong("step_s", "this is out of range", accepted)
    if len(parent.faults) > n_faults:
        return None
    permutations = Permutations(**values)
    if permutations.seconds[-1] > MOST_SECONDS:
        section.add(f"{section.where}: the last looks {permutations.seconds[-1]:g} s ahead.", f"at most {MOST_SECONDS:g} s")
    return permutations
