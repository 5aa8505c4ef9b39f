"""What two sets have in common, against asking both of every value there is."""

from itertools import chain, combinations, product

import pytest

from contextdb.cells.sets import Accepted, Cell, TagSet, ValueSet, meet, meet_exactly

NAMES = ("A", "B", "C")


def subsets(names: tuple[str, ...]) -> list[frozenset[str]]:
    return [frozenset(found) for found in chain.from_iterable(combinations(names, n) for n in range(len(names) + 1))]


VALUES = [ValueSet(values, is_complement) for values, is_complement in product(subsets(NAMES), (False, True))]
TAGS = [
    TagSet(needs, bans, is_complement)
    for needs, bans, is_complement in product(subsets(NAMES[:2]), subsets(NAMES), (False, True))
    if not needs & bans and (needs or bans)
]


def held(accepts: Accepted) -> list[bool]:
    facts = subsets(NAMES) if isinstance(accepts, TagSet) else (*NAMES, "other")
    return [Cell(accepts).holds(fact) for fact in facts]


@pytest.mark.parametrize("sets", [VALUES, TAGS], ids=["values", "tags"])
def test_a_meet_holds_what_both_hold_and_one_in_a_cell_at_least_that(sets: list[Accepted]):
    for one, other in product(sets, repeat=2):
        both = [a and b for a, b in zip(held(one), held(other), strict=True)]
        assert held(meet_exactly(one, other)) == both, (one, other)


def test_penalties_of_soft_cells_are_added_one_after_the_other():
    penalties = [1.0, 1.0 / 3.0, 1.0]  # what `sum` rounds in one way up to Python 3.11 and in another from 3.12 on
    assert meet([Cell(ValueSet(frozenset("A")), penalty) for penalty in penalties]).penalty == 1.0 + 1.0 / 3.0 + 1.0
