"""Who may play which role of which joint clip: the castings of a table's answer, or casts that the game lists, as flags.

C casts, J joint ranges, K roles, W words a mask. An actor is known by what the game calls it, the `"id"` of an actor of a query.
"""

from __future__ import annotations

from collections.abc import Hashable, Mapping, Sequence
from dataclasses import dataclass
from itertools import permutations
from typing import Any

import numpy as np

from contextdb import bitmask
from contextdb.cells.arguments import require_many, require_mapping
from contextdb.errors import Fault, QueryError, in_quotes, some
from contextdb.motion import arguments
from contextdb.motion.answers import Answer, has_casts, is_answer
from contextdb.motion.clips.quaternions import Floats
from contextdb.motion.joint.database import JointDatabase
from contextdb.motion.search.filtering import TableRanges

Cast = tuple[Hashable, ...]
"""The actors of the roles, in their order."""


@dataclass(frozen=True, eq=False)
class Casts:
    """The C casts of one search of one database.

    `biases` float64 [C, J] is what the soft cells of a table cost with each cast in each joint range, the cheapest row of its
    asset; inf where it may not play. `sides`, as it is and in a mirror, is what each row costs with each cast, float64 [C, n_rows];
    None for an answer without rows, whose assets are `table_assets`.
    """

    listed: list[Cast]
    biases: Floats
    sides: tuple[Floats, Floats] | None = None
    table_assets: Sequence[str] = ()

    def row(self, cast: int, asset: str, mirrored: bool) -> int | None:
        """The row of an asset that costs least with a cast, the first of several; None for an answer without rows."""
        if self.sides is None:
            return None
        costs = self.sides[mirrored][cast]
        return min((i for i, name in enumerate(self.table_assets) if name == asset), key=lambda i: costs[i], default=None)


class CastMaker:
    """Makes the casts of one joint database."""

    def __init__(self, joint: JointDatabase) -> None:
        self.joint = joint
        self._tables: dict[int, TableRanges] = {}
        self._ranges_of_asset: dict[str, list[int]] = {}
        for i, asset in enumerate(joint.assets):
            self._ranges_of_asset.setdefault(asset, []).append(i)

    def make(self, valid: object, casts: object, actors: Sequence[Hashable]) -> Casts:
        """The casts for an answer, flags, or None for all clips; for listed casts, or None for all that may be.

        `actors` are all there are, for casts that neither the answer nor the game lists.
        """
        listed = None if casts is None else _read_casts(casts, self.joint.roles)
        if is_answer(valid):
            return self._of_answer(valid, listed, actors)
        if listed is None:
            listed = list(permutations(actors, len(self.joint.roles)))
        n_ranges = len(self.joint.assets)
        flags = np.ones(n_ranges, np.bool_) if valid is None else arguments.flags_of(valid, n_ranges, "valid", "joint range")
        return Casts(listed, np.broadcast_to(np.where(flags, 0.0, np.inf), (len(listed), n_ranges)))

    def _of_answer(self, answer: Answer, listed: list[Cast] | None, actors: Sequence[Hashable]) -> Casts:
        mirrored = self.joint.mirrored
        seen = answer.mirrored if mirrored.any() else answer
        both = [_rows_of_casts(answer, self.joint.roles, listed, actors)]
        both.append(_rows_of_casts(seen, self.joint.roles, listed, actors) if seen is not answer else both[0])
        every = list(dict.fromkeys([*both[0], *both[1]]))
        plain = _costs_of_rows(both[0], every, answer)
        sides = plain, plain if seen is answer else _costs_of_rows(both[1], every, answer)
        table = self._table_ranges(answer.table_assets)
        biases = table.least_of_each(sides[0])
        if seen is not answer:
            biases = np.where(mirrored, table.least_of_each(sides[1]), biases)
        return Casts(every, biases, sides, answer.table_assets)

    def _table_ranges(self, table_assets: Sequence[str]) -> TableRanges:
        known = self._tables.get(id(table_assets))
        if known is None or known.assets is not table_assets:
            known = TableRanges.of(table_assets, self._ranges_of_asset, len(self.joint.assets))
            self._tables = {id(table_assets): known}
        return known


def _rows_of_casts(
    answer: Any, roles: Sequence[str], listed: list[Cast] | None, actors: Sequence[Hashable]
) -> dict[Cast, tuple[int, Floats | None]]:
    """The rows of each cast, as bits, and what rows cost with it: by the castings of an answer to a query with actors, else those
    of the answer for every cast."""
    if not has_casts(answer):
        every = list(permutations(actors, len(roles))) if listed is None else listed
        return dict.fromkeys(every, (bitmask.to_int(answer.mask), answer.penalties if answer.has_penalties else None))
    wanted = None if listed is None else set(listed)
    rows: dict[Cast, tuple[int, Floats | None]] = {}
    known: dict[int, Hashable] = {}
    for cast, bits, penalties in answer.casts(roles):
        for actor, role in zip(cast, roles, strict=True):
            if id(actor) not in known:
                known[id(actor)] = _id_of(actor, role)
        key = tuple([known[id(actor)] for actor in cast])
        if wanted is None or key in wanted:
            rows[key] = bits, penalties
    return rows


def _costs_of_rows(rows: Mapping[Cast, tuple[int, Floats | None]], every: Sequence[Cast], answer: Any) -> Floats:
    """What each row costs with each of some casts, inf where it may not be: float64 [C, n_rows]."""
    n_rows = len(answer.table_assets)
    n_bytes = 8 * bitmask.n_words(n_rows)
    nowhere = 0, None
    octets = b"".join(rows.get(cast, nowhere)[0].to_bytes(n_bytes, "little") for cast in every)
    masks = np.frombuffer(octets, "<u8").astype(np.uint64).reshape(len(every), n_bytes // 8)
    costs = np.where(bitmask.unpack(masks, n_rows), 0.0, np.inf)
    for i, cast in enumerate(every):
        penalties = rows.get(cast, nowhere)[1]
        if penalties is not None:
            costs[i] += penalties
    return costs


def _id_of(actor: Mapping[str, Any], role: str) -> Hashable:
    known = actor.get("id")
    if known is None or not isinstance(known, Hashable):
        id_text = "has no id" if known is None else f"has the id {known!r}"
        raise QueryError(
            Fault(f"an actor offered for {in_quotes(role)} {id_text}.", 'an "id" by which its query and place are given')
        )
    return known


def _read_casts(casts: object, roles: Sequence[str]) -> list[Cast]:
    """Casts that a game lists: mappings of all roles to different actors, each once."""
    accepted = "a list of mappings of each role to an actor, such as {" + ", ".join(f"{in_quotes(r)}: …" for r in roles) + "}"
    distinct: dict[Cast, None] = {}
    for cast in require_many(casts, "casts", accepted):
        given = require_mapping(cast, "one of casts", accepted)
        if set(given) != set(roles):
            raise QueryError(Fault(f"a cast has the roles {some(list(map(str, given))) or 'none'}.", some(roles)))
        actors = tuple(given[role] for role in roles)
        if not all(isinstance(actor, Hashable) for actor in actors) or len(set(actors)) < len(actors):
            raise QueryError(Fault(f"a cast has the actors {actors!r}.", "a different one for each role"))
        distinct[actors] = None
    return list(distinct)
