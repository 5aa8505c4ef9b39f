"""What a policy is: one entry that tells how rows are ranked, what decides among equals, and its words.

Everything that asks about a policy reads its entry: the reader of contextdb.toml, the picks in Python and in C (which get the ranks
and `choose`, and never the name), the findings, the files of other tools, the editor and docs/format.md.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

Policy = str
"""The name of one, a key of `POLICIES`."""
Numbers = NDArray[np.float64]
Choose = Literal["chance", "top", "refuse"]
"""What decides among rows of the highest rank: chance by their weights, where one of weight 0 is never picked; nothing, as no two
have a rank; nothing, so that several are refused."""


@dataclass(frozen=True)
class RankKey:
    """Something that rows are ranked by."""

    values: Callable[[Numbers, Numbers | None], Numbers | None]
    """Higher first, float64 [R], of the priorities and the specificities of the rows; None where the table has none."""
    won: str
    """Why a row was picked, with its value."""
    winning: str
    """What another row has that is preferred, with its value."""
    above: str
    """What every row that comes before another one is or has."""
    is_narrowing: bool = False
    """Whether a row is to be preferred to the rows that hold all of its contexts."""


PLACE = RankKey(lambda numbers, _: -np.arange(len(numbers), dtype=np.float64), "first valid row", "an earlier row", "is above it")
PRIORITY = RankKey(lambda numbers, _: numbers, "highest priority {:g}", "priority {:g}", "has a higher priority")
SPECIFICITY = RankKey(lambda _, numbers: numbers, "most specific: {:g}", "specificity {:g}", "is more specific", is_narrowing=True)


@dataclass(frozen=True)
class PolicyKind:
    """One policy."""

    words: str
    """What it means, in a few words."""
    ranked_by: tuple[RankKey, ...] = (PRIORITY,)
    """What decides before all else, in this order."""
    choose: Choose = "chance"
    by_cost: bool = False
    """Whether of the highest rank those are left whose soft cells cost least."""
    is_order: bool = False
    """Whether it is there to prefer some rows, so that a row which is never chosen is worth a warning."""
    synonyms: tuple[str, ...] = ()
    dmn: tuple[str, ...] = ()
    """The hit policies of DMN that mean it; the first is written."""

    @property
    def needs_specificities(self) -> bool:
        return SPECIFICITY in self.ranked_by

    @property
    def is_narrowing(self) -> bool:
        """Whether a row may be preferred for being narrower than others."""
        return any(key.is_narrowing for key in self.ranked_by)


POLICIES: dict[Policy, PolicyKind] = {
    "collect": PolicyKind("several may be valid: that is variety", synonyms=("all", "any"), dmn=("COLLECT", "ANY")),
    "first": PolicyKind("the first valid row of the file plays", (PLACE,), "top", is_order=True, dmn=("FIRST",)),
    "unique": PolicyKind("at most one may be valid; two are a fault", (), "refuse", synonyms=("single",), dmn=("UNIQUE",)),
    "priority": PolicyKind("the highest priority plays", is_order=True, synonyms=("highest",), dmn=("PRIORITY",)),
    "specific": PolicyKind(
        "the row with most cells that are not Any plays", (PRIORITY, SPECIFICITY), is_order=True,
        synonyms=("most specific", "specificity", "score", "best"),
    ),
    "cheapest": PolicyKind(
        "the row whose soft cells cost least plays", by_cost=True, is_order=True,
        synonyms=("cost", "least cost", "least penalty", "lowest"),
    ),
}  # fmt: skip
POLICY_SYNONYMS = {synonym: name for name, kind in POLICIES.items() for synonym in kind.synonyms}


def decided_by(choose: Choose, policies: Iterable[Policy]) -> bool:
    """Whether it decides under one of some policies."""
    return any(POLICIES[policy].choose == choose for policy in policies)


def lets_choose(policies: Iterable[Policy]) -> bool:
    """Whether the game chooses among several valid rows, under the policies of a table and of those inside it."""
    return all(POLICIES[policy].choose == "chance" for policy in policies)


def rank_columns(policy: Policy, priorities: NDArray[np.int64], specificities: Numbers | None) -> list[tuple[RankKey, Numbers]]:
    """What a policy ranks rows by, as far as the table has it: each key with its values."""
    columns = [(key, key.values(priorities.astype(np.float64), specificities)) for key in POLICIES[policy].ranked_by]
    return [(key, values) for key, values in columns if values is not None]


def ranks_of(policy: Policy, priorities: NDArray[np.int64], specificities: Numbers | None) -> Numbers:
    """What a policy ranks rows by before chance, apart from costs: higher first, float64 [R]; of several keys the place
    among those of all rows."""
    columns = [values for _, values in rank_columns(policy, priorities, specificities)]
    if len(columns) < 2:
        return columns[0] if columns else np.zeros(len(priorities))
    return np.unique(np.stack(columns, axis=1), axis=0, return_inverse=True)[1].reshape(-1).astype(np.float64)
