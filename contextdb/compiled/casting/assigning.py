"""Which actor plays which role: assignments of distinct actors, and the best of them.

Pure combinatorics over offers; which rows take whom, and which rules must hold, are arguments.

A joint search of motion looks at all castings of all rows in one update; asking row by row would take longer than the search. Masks
are Python integers, row r as bit r.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import reduce
from itertools import combinations
from operator import add
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from contextdb import bitmask
from contextdb.compiled.casting.facts import Actor, Offer

Part = tuple[str, list[Offer]]
"""A role, and the actors who fit it."""
Chosen = list[tuple[str, Offer]]
Holds = Callable[[Mapping[str, Offer]], bool]
"""Whether a casting may be, when each of its actors fits."""
Key = tuple[int, float, tuple[int, ...]]
EMPTY = 1 << 30
"""The place of nobody: after everybody."""


def best(needed: list[Part], wanted: list[Part], holds: Holds | None = None) -> Chosen:
    """The best assignment that fills the needed roles and as many others as can be."""
    order = [name for name, _ in needed + wanted]
    for most in range(len(wanted), -1, -1):
        parts = [needed + chosen for chosen in _subsets(wanted, most)]
        castings = [c for p in parts if (c := _best_of(p) if holds is None else _best_that_holds(p, order, holds)) is not None]
        if castings:
            return min(castings, key=lambda c: _key(c, order))
    return []


def every(needed: list[Part], wanted: list[Part], holds: Holds | None = None) -> list[Chosen]:
    """Every assignment of the needed roles with the most others, best first."""
    most = len(best(needed, wanted, holds)) - len(needed)
    castings = [c for chosen in _subsets(wanted, most) for c in assignments(needed + chosen)]
    order = [name for name, _ in needed + wanted]
    return sorted((c for c in castings if holds is None or holds(dict(c))), key=lambda c: _key(c, order))


def assignments(parts: Sequence[Part], taken: frozenset[object] = frozenset()) -> Iterator[Chosen]:
    """Every way to give each role one of its actors, none of them two."""
    if not parts:
        yield []
        return
    (name, fitting), rest = parts[0], parts[1:]
    for offer in fitting:
        if offer.key not in taken:
            for others in assignments(rest, taken | {offer.key}):
                yield [(name, offer), *others]


def _best_of(parts: list[Part]) -> Chosen | None:
    """The best assignment of all roles. Of each role only as many actors as there are roles can matter: one of its best is free."""
    few = [(name, fitting[: len(parts)]) for name, fitting in parts]
    order = [name for name, _ in parts]
    return min(assignments(few), key=lambda c: _key(c, order), default=None)


def _best_that_holds(parts: list[Part], order: Sequence[str], holds: Holds) -> Chosen | None:
    """The same of those that hold: branch and bound, the bound being that roles still open go to their cheapest actors."""
    least = {name: (min(o.cost[0] for o in f), min(o.cost[1] for o in f)) for name, f in parts if f}
    best_so_far: Chosen | None = None
    limit: Key | None = None

    def extend(chosen: Chosen) -> None:
        nonlocal best_so_far, limit
        key = _key(chosen, order, least)
        if limit is not None and key >= limit:
            return
        if len(chosen) == len(parts):
            if holds(dict(chosen)):
                best_so_far, limit = chosen, key
            return
        name, fitting = parts[len(chosen)]
        taken = {offer.key for _, offer in chosen}
        for offer in fitting:
            if offer.key not in taken:
                extend([*chosen, (name, offer)])

    if len(least) == len(parts):
        extend([])
    return best_so_far


def _subsets(parts: Sequence[Part], size: int) -> Iterator[list[Part]]:
    return (list(c) for c in combinations(parts, size))


def _key(chosen: Chosen, order: Sequence[str], least: Mapping[str, tuple[int, float]] | None = None) -> Key:
    """What castings are compared by: actors without a preference, the sum of costs, and the places at which they are offered.

    With `least`, the lowest that it can become when roles of `least` are filled too.
    """
    offers = dict(chosen)
    if least is None:
        least = {}
    costs = [offers[n].cost if n in offers else least[n] for n in order if n in offers or n in least]
    places = tuple(offers[n].place if n in offers else -1 if n in least else EMPTY for n in order)
    return sum(c[0] for c in costs), reduce(add, (c[1] for c in costs), 0.0), places  # `sum` rounds otherwise from Python 3.12 on


# ---- who may play some roles together: every assignment of distinct actors to these roles, with the rows in which it may be


class CastRows(NamedTuple):
    """A cast of some roles, in their order, and where it may be: the rows as bits, and what their soft cells cost with it, float64
    [n_rows]; None for a table without any."""

    actors: tuple[Actor, ...]
    rows: int
    penalties: NDArray[np.float64] | None

    def joined(self, other: CastRows, n_rows: int) -> CastRows:
        """The rows of both, which share none."""
        penalties = self.penalties
        if penalties is not None and other.penalties is not None:
            penalties = np.where(bitmask.flags_of(self.rows, n_rows), penalties, other.penalties)
        return CastRows(self.actors, self.rows | other.rows, penalties)


def casts_of(
    rows: int,
    roles: Sequence[str],
    offers: Mapping[str, Sequence[Offer]],
    required: Mapping[str, int],
    ruled: int,
    rule_of: Callable[[int], Holds | None],
) -> Iterator[tuple[Chosen, int]]:
    """The casts of some roles in some rows, in the order of actors, each with the rows in which it may be.

    `offers` and `required` are those of all roles; `ruled` the rows with a rule about roles, which `rule_of` gives. A row is left
    out where its rule does not hold with the cast, or where nobody is left for another role that it needs.
    """
    others = [role for role in offers if role not in roles]
    for role in others:
        ruled |= required[role]
    for cast in assignments([(role, list(offers.get(role, ()))) for role in roles]) if rows else ():
        left = rows
        for _, offer in cast:
            left &= offer.some
        for row in _numbers(left & ruled):
            if not _can_be(row, cast, [(role, offers[role]) for role in others if required[role] >> row & 1], rule_of(row)):
                left &= ~(1 << row)
        if left:
            yield cast, left


def _can_be(row: int, cast: Chosen, needed: Sequence[tuple[str, Sequence[Offer]]], holds: Holds | None) -> bool:
    """Whether the other roles that a row needs can be filled beside a cast, so that its rule holds."""
    parts = [(role, [offer for offer in fitting if offer.some >> row & 1]) for role, fitting in needed]
    taken = frozenset(offer.key for _, offer in cast)
    return any(holds is None or holds(dict([*cast, *rest])) for rest in assignments(parts, taken))


def _numbers(rows: int) -> list[int]:
    return bitmask.rows(bitmask.from_int(rows, rows.bit_length())).tolist() if rows else []
