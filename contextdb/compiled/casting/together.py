"""Who may play some roles together: every assignment of distinct actors to these roles, with the rows in which it may be.

A joint search of motion looks at all castings of all rows in one update; asking row by row would take longer than the search. Masks
are Python integers, row r as bit r.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from contextdb import bitmask
from contextdb.compiled.casting.assigning import Chosen, Holds, assignments
from contextdb.compiled.casting.facts import Actor, Offer


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
