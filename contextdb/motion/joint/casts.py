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
from contextdb.motion.arguments import Flags
from contextdb.motion.clips.quaternions import Floats
from contextdb.motion.joint.database import JointDatabase
from contextdb.motion.search.table_ranges import TableRanges

Cast = tuple[Hashable, ...]
"""The actors of the roles, in their order."""


@dataclass(frozen=True, eq=False)
class Casts:
    """The casts of one search of one database.

    Attributes
    ----------
    listed : list of Cast, length C
    valid : bool array, shape (C, J)
        Which may play which joint range.
    range_biases : float64 array, shape (J,)
        What the soft cells of the table cost.
    """

    listed: list[Cast]
    valid: Flags
    range_biases: Floats
    rows: tuple[dict[Cast, int], dict[Cast, int]] = ({}, {})
    """For each cast the rows, as bits, in which it may be: as it is, and in a mirror."""
    table_assets: Sequence[str] = ()

    def row(self, cast: Cast, asset: str, mirrored: bool) -> int | None:
        """The first row of an asset in which a cast may be; None for an answer without rows."""
        bits = self.rows[mirrored].get(cast, 0)
        return next((i for i, name in enumerate(self.table_assets) if name == asset and bits >> i & 1), None)


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
        if hasattr(valid, "table_assets"):
            return self._of_answer(valid, listed, actors)
        if listed is None:
            listed = list(permutations(actors, len(self.joint.roles)))
        n_ranges = len(self.joint.assets)
        flags = np.ones(n_ranges, np.bool_) if valid is None else arguments.flags_of(valid, n_ranges, "valid", "joint range")
        return Casts(listed, np.tile(flags, (len(listed), 1)), np.zeros(n_ranges))

    def _of_answer(self, answer: Any, listed: list[Cast] | None, actors: Sequence[Hashable]) -> Casts:
        sides = [self.joint.mirrored == side for side in (False, True)]
        seen = answer.mirrored if sides[1].any() and hasattr(answer, "mirrored") else answer
        table = self._table_ranges(answer.table_assets)
        n_ranges = len(self.joint.assets)
        wanted = None if listed is None else dict.fromkeys(listed)
        rows: list[dict[Cast, int]] = []
        biases = np.zeros(n_ranges)
        for each, side in zip((answer, seen), sides, strict=True):
            found = _rows_of_casts(each, self.joint.roles, listed, actors) if side.any() else {}
            rows.append(found if wanted is None else {cast: bits for cast, bits in found.items() if cast in wanted})
            penalties = table.valid(each)[1] if side.any() else None
            if penalties is not None:
                biases = np.where(side, np.where(np.isfinite(penalties), penalties, 0.0), biases)
        both = list(dict.fromkeys([*rows[0], *rows[1]]))
        valid = np.zeros((len(both), n_ranges), np.bool_)
        n_bytes = 8 * bitmask.n_words(len(answer.table_assets))
        for found, side in zip(rows, sides, strict=True):
            if found:
                octets = b"".join(found.get(cast, 0).to_bytes(n_bytes, "little") for cast in both)
                valid |= table.valid_of_many(np.frombuffer(octets, "<u8").astype(np.uint64).reshape(len(both), -1)) & side
        return Casts(both, valid, biases, (rows[0], rows[1]), answer.table_assets)

    def _table_ranges(self, table_assets: Sequence[str]) -> TableRanges:
        known = self._tables.get(id(table_assets))
        if known is None or known.assets is not table_assets:
            known = TableRanges.of(table_assets, self._ranges_of_asset, len(self.joint.assets))
            self._tables = {id(table_assets): known}
        return known


def _rows_of_casts(answer: Any, roles: Sequence[str], listed: list[Cast] | None, actors: Sequence[Hashable]) -> dict[Cast, int]:
    """The rows of each cast: by the castings of an answer to a query with actors, else those of the answer for every cast."""
    if not hasattr(answer, "casts"):
        every = list(permutations(actors, len(roles))) if listed is None else listed
        return dict.fromkeys(every, answer.bits)
    found: dict[Cast, int] = {}
    known: dict[int, Hashable] = {}
    for cast, bits in answer.casts(roles):
        for actor, role in zip(cast, roles, strict=True):
            if id(actor) not in known:
                known[id(actor)] = _id_of(actor, role)
        key = tuple([known[id(actor)] for actor in cast])
        found[key] = found.get(key, 0) | bits
    return found


def _id_of(actor: Mapping[str, Any], role: str) -> Hashable:
    known = actor.get("id")
    if known is None or not isinstance(known, Hashable):
        told = "has no id" if known is None else f"has the id {known!r}"
        raise QueryError(Fault(f"an actor offered for {in_quotes(role)} {told}.", 'an "id" by which its query and place are given'))
    return known


def _read_casts(casts: object, roles: Sequence[str]) -> list[Cast]:
    """Casts that a game lists: mappings of all roles to different actors, each once."""
    accepted = "a list of mappings of each role to an actor, such as {" + ", ".join(f"{in_quotes(r)}: …" for r in roles) + "}"
    found: dict[Cast, None] = {}
    for cast in require_many(casts, "casts", accepted):
        given = require_mapping(cast, "one of casts", accepted)
        if set(given) != set(roles):
            raise QueryError(Fault(f"a cast has the roles {some(list(map(str, given))) or 'none'}.", some(roles)))
        actors = tuple(given[role] for role in roles)
        if not all(isinstance(actor, Hashable) for actor in actors) or len(set(actors)) < len(actors):
            raise QueryError(Fault(f"a cast has the actors {actors!r}.", "a different one for each role"))
        found[actors] = None
    return list(found)
