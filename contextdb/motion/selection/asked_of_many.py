"""What many characters are asked with: one for all, or one for each."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, TypeAlias, TypeVar, cast

from contextdb.cells.arguments import require_many
from contextdb.errors import Fault, QueryError, plural
from contextdb.motion.arguments import Valid, ValidForMany
from contextdb.motion.search.database import MotionDatabase
from contextdb.motion.selection.asked import OfValid

T = TypeVar("T")
OfValidForMany: TypeAlias = ValidForMany | Mapping[str, ValidForMany] | Sequence[OfValid | None]


def each_of(given: Any, n: int, what: str, *, is_one: bool) -> Sequence[Any]:
    """What each of n characters is given: the same, or one of as many as there are characters."""
    if is_one:
        return [given] * n
    if not isinstance(given, Sequence) or isinstance(given, str):
        given = list(require_many(given, what, f"one {what} for each character"))
    if len(given) != n:
        raise QueryError(Fault(f"{plural(len(given), what)} for {plural(n, 'character')}.", "one for all, or one for each"))
    return cast("Sequence[Any]", given)


def valid_of_each(databases: Mapping[str, MotionDatabase], valid: OfValidForMany | None, n: int) -> Sequence[OfValid | None]:
    """What may play of each of n characters, as `Selector.search` takes it. Masks are read for all characters at once."""
    if valid is None or n == 0:
        return [None] * n
    if isinstance(valid, (list, tuple)) and any(isinstance(each, Mapping) for each in valid):
        return each_of(valid, n, "mask", is_one=False)
    of_databases = valid if isinstance(valid, Mapping) else dict.fromkeys(databases, cast("ValidForMany", valid))
    read = {name: databases[name].valid_of_each(own, n) for name, own in of_databases.items() if name in databases}
    of_others: dict[str, Valid] = {name: () for name in of_databases if name not in databases}  # not loaded, or unknown and refused
    return [of_others | {name: own[i] for name, own in read.items()} for i in range(n)]
