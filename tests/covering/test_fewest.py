"""The fewest sets that hold everything, as trying every choice says."""

from itertools import combinations

from hypothesis import given
from hypothesis import strategies as st

from contextdb.covering.fewest import fewest


def union(sets: list[int]) -> int:
    whole = 0
    for one in sets:
        whole |= one
    return whole


def shortest(sets: list[int]) -> int:
    wanted = union(sets)
    return next(n for n in range(len(sets) + 1) if any(union(list(few)) == wanted for few in combinations(sets, n)))


@given(st.lists(st.integers(0, 2**9 - 1), max_size=9))
def test_few_sets_hold_all_and_none_fewer_would(sets):
    numbers, is_fewest = fewest(sets)
    assert union([sets[i] for i in numbers]) == union(sets)
    assert is_fewest
    assert len(numbers) == shortest(sets)


@given(st.lists(st.integers(0, 2**9 - 1), max_size=9))
def test_a_search_that_is_cut_says_so_and_still_holds_all_with_none_too_many(sets):
    numbers, is_fewest = fewest(sets, steps=1)
    assert union([sets[i] for i in numbers]) == union(sets)
    assert all(union([sets[j] for j in numbers if j != i]) != union(sets) for i in numbers)
    assert not is_fewest or len(numbers) == shortest(sets)
