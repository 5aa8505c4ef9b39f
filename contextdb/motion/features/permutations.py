"""Permutations: each clip is searched several times over, each time with its permuted channels so many seconds ahead of its frame.

So a query can say what shall be when: a hand at the ball in 0.4 s. Permutation i looks from_s + i x step_s ahead.

Source: NumberOfPermutations, PermutationsSampleRate and PermutationsTimeOffset of Unreal's PoseSearch.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

from contextdb.cells.arguments import require_real, require_whole
from contextdb.files.toml_shapes import Section
from contextdb.files.toml_text import what
from contextdb.motion.features.channels import MOST_SECONDS

MOST_PERMUTATIONS = 100
ACCEPTED = "{ count = 5, step_s = 0.1 }"


@dataclass(frozen=True)
class Permutations:
    """How often each clip is searched, and how far ahead the permuted channels look each time.

    Attributes
    ----------
    count : int
    step_s : float
        Seconds between one permutation and the next.
    from_s : float
        Seconds that the first looks ahead.

    Raises
    ------
    ContextError
        A number out of range: 1 to 100 permutations, seconds from 0 to 60.
    """

    count: int
    step_s: float = 0.0
    from_s: float = 0.0

    def __post_init__(self) -> None:
        require_real(require_whole(self.count, "count"), "count", 1, MOST_PERMUTATIONS)
        for name in ("step_s", "from_s"):
            require_real(getattr(self, name), name, 0.0, MOST_SECONDS)

    @cached_property
    def seconds(self) -> tuple[float, ...]:
        """How far ahead each permutation looks."""
        return tuple(round(self.from_s + i * self.step_s, 9) for i in range(self.count))


def read_permutations(parent: Section) -> Permutations | None:
    """Those of `[features.NAME]`; None when a fault is left behind."""
    value = parent.part["permutations"]
    if not isinstance(value, Mapping):
        parent.wrong("permutations", f"this is {what(value)}, not a table", ACCEPTED)
        return None
    n_faults = len(parent.faults)
    section = parent.inside("permutations", value, ("count", "step_s", "from_s"))
    accepted = f"how often each clip is searched, a whole number from 1 to {MOST_PERMUTATIONS}"
    count = section.whole("count", accepted, 1, MOST_PERMUTATIONS) if section.has("count", accepted) else None
    accepted = f"seconds, above 0 and at most {MOST_SECONDS:g}, such as 0.1"
    step_s = 0.0
    if "step_s" in value or (count is not None and count > 1 and section.has("step_s", accepted)):
        step_s = section.number("step_s", accepted, 1e-3, MOST_SECONDS) or 0.0
    from_s = 0.0
    if "from_s" in value:
        from_s = section.number("from_s", f"seconds, from 0 to {MOST_SECONDS:g}, such as 0.2", 0.0, MOST_SECONDS) or 0.0
    if count is None or len(parent.faults) > n_faults:
        return None
    found = Permutations(count, step_s, from_s)
    if found.seconds[-1] > MOST_SECONDS:
        section.add(f"{section.where}: the last looks {found.seconds[-1]:g} s ahead.", f"at most {MOST_SECONDS:g} s")
    return found
