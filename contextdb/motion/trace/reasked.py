"""A recorded decision asked again of its databases: what any asset would have cost, where it stood, and why it was left out.

A session keeps of each search the best candidates, the query and the filter. With the databases that it was recorded with, query
and filter give the cost of every frame again, bit for bit.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from contextdb.errors import Fault, MotionError, Place, in_quotes, nearest, some
from contextdb.motion.clips.quaternions import Floats
from contextdb.motion.search import candidates
from contextdb.motion.search.candidates import Candidate
from contextdb.motion.search.database import MotionDatabase
from contextdb.motion.selection.decision import Decision
from contextdb.motion.trace.cost_views import Ranked
from contextdb.motion.trace.filter_rows import fingerprint
from contextdb.motion.trace.views import role_of


def why_not_asked(decision: Decision, about: Mapping[str, Mapping[str, object]], databases: Mapping[str, MotionDatabase]) -> str:
    """Why a decision cannot be asked again, in a sentence; "" when it can."""
    if not decision.searched:
        return "nothing was searched at this update: what played, played on."
    if decision.query is None or not decision.filters:
        return "the session holds no filters, as an older version or code of your own recorded it: record it again."
    for name, _ in decision.filters:
        if name not in databases:
            return f"there is no database {in_quotes(name)} in the project."
        if about.get(name, {}).get("digest") != fingerprint(databases[name]):
            return f"the database {in_quotes(name)} is another than the one that the session was recorded with."
    return ""


def reasked(decision: Decision, databases: Mapping[str, MotionDatabase], name: str) -> list[Ranked]:
    """Of each range whose asset's name holds a text the best frame, cheapest first, chosen or not.

    The rank counts the frames of all databases that were searched which may be chosen and cost less. Ranges that are not valid come
    with their cost all the same, and with the reason.
    """
    assert decision.query is not None, "without a query nothing was searched"
    found: list[tuple[str, Candidate]] = []
    free: list[Floats] = []
    for database, chosen in decision.filters:
        wanted = databases[database].normalised(decision.query)
        rows, totals = candidates.best_of_assets(databases[database], wanted, chosen, name)
        found += [(database, row) for row in rows]
        free.append(totals)
    ordered = np.sort(np.concatenate(free)) if free else np.empty(0)
    found.sort(key=lambda each: each[1].cost)
    return [Ranked(_rank(ordered, row), database, row, role_of(decision, database, row.frame)) for database, row in found]


def require_known(name: str, databases: Mapping[str, MotionDatabase], file: str) -> None:
    """Raise MotionError when no asset's name contains a text, with the nearest."""
    known = list(dict.fromkeys(asset for database in databases.values() for asset in database.assets))
    if not any(name.casefold() in asset.casefold() for asset in known):
        near = nearest(name, known)
        found = f"no asset's name contains {in_quotes(name)}."
        raise MotionError(Fault(found, some(known), in_quotes(near) if near else "", Place(file)))


def _rank(free: Floats, row: Candidate) -> int:
    return int(np.searchsorted(free, row.cost, side="left")) + 1
