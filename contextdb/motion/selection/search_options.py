"""What several databases are asked with next to the query: some of it is for all alike, some for each by its name."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass
from types import NoneType
from typing import Any, TypeAlias, TypedDict, TypeVar, cast

import numpy as np
from numpy.typing import ArrayLike

from contextdb.cells.arguments import require_many
from contextdb.errors import Fault, QueryError, plural
from contextdb.motion.answers import Answer
from contextdb.motion.arguments import Valid, ValidForMany
from contextdb.motion.markup.left_out import Skip
from contextdb.motion.markup.tag_filter import TagFilter
from contextdb.motion.records import quickly_made
from contextdb.motion.search.database import MotionDatabase
from contextdb.motion.search.filtering import Penalties, Tags
from contextdb.motion.selection.choice import Choice

Among: TypeAlias = Collection[str] | Answer
OfValid: TypeAlias = Valid | Mapping[str, Valid]
OfTags: TypeAlias = TagFilter | Mapping[str, Tags]
OfPenalties: TypeAlias = Mapping[str, float] | Mapping[str, Penalties]
Current: TypeAlias = Choice | tuple[str, int]


class Options(TypedDict, total=False):
    """The parameters of `Selector.search` next to the query, by name."""

    valid: OfValid | None
    tags: OfTags | None
    current: Current | None
    bias: Mapping[str, ArrayLike] | None
    among: Among | None
    skip: Mapping[str, Sequence[Skip]] | None
    penalties: OfPenalties | None


@quickly_made
@dataclass(frozen=True, slots=True)
class SearchOptions:
    """The same as one thing; see `Selector.search`."""

    valid: OfValid | None = None
    tags: OfTags | None = None
    current: Current | None = None
    bias: Mapping[str, ArrayLike] | None = None
    among: Among | None = None
    skip: Mapping[str, Sequence[Skip]] | None = None
    penalties: OfPenalties | None = None

    def __post_init__(self) -> None:
        for what, given in (("bias", self.bias), ("skip", self.skip), ("penalties", self.penalties)):
            if given is not None and not isinstance(given, (dict, Mapping)):
                accepted = f"{'a mapping of assets to costs, or ' if what == 'penalties' else ''}a mapping of databases"
                raise QueryError(Fault(f"{what} is a {type(given).__name__}.", accepted))
        if self.tags is not None and not isinstance(self.tags, (TagFilter, Mapping)):
            raise QueryError(Fault(f"tags is a {type(self.tags).__name__}.", "a TagFilter, or a mapping of databases"))
        if self.current is not None and not isinstance(self.current, Choice) and not _is_pair(self.current):
            raise QueryError(Fault(f"what plays now is {self.current!r}.", 'a Choice, or such as ("jog", 120)'))

    def searched(self, valid: OfValid | None, current: Current | None, skip: Mapping[str, Sequence[Skip]]) -> SearchOptions:
        """The same of a search by what plays: with what may play, what would play on, and what is left out."""
        return SearchOptions(valid, self.tags, current, self.bias, self.among, skip, self.penalties)

    def of(self, name: str) -> dict[str, Any]:
        """What one database is given, by the names of the parameters of `MotionDatabase.search`."""
        return {
            "valid": self.valid_of(name),
            "tags": self.tags if isinstance(self.tags, (NoneType, TagFilter)) else self.tags.get(name),
            "current": self._current_in(name),
            "bias": self.bias.get(name) if self.bias else None,
            "skip": self.skip.get(name, ()) if self.skip else (),
            "penalties": self._penalties_of(name),
        }

    def valid_of(self, name: str) -> Valid | None:
        """What may play of one database."""
        return self.valid.get(name) if isinstance(self.valid, (dict, Mapping)) else self.valid

    @property
    def is_plain(self) -> bool:
        """Whether nothing but what may play is given to a database."""
        return self.tags is None and self.current is None and self.bias is None and self.skip is None and self.penalties is None

    def options(self) -> Options:
        """The same as keyword arguments."""
        return {
            "valid": self.valid,
            "tags": self.tags,
            "current": self.current,
            "bias": self.bias,
            "among": self.among,
            "skip": self.skip,
            "penalties": self.penalties,
        }

    def databases(self) -> Iterator[str]:
        """Every name of a database in it, but for those in `among` and `current`."""
        for given in (self.valid, self.tags, self.bias, self.skip):
            if given is not None and isinstance(given, (dict, Mapping)):
                yield from given
        if self.penalties and not _are_of_assets(self.penalties):
            yield from self.penalties

    def _current_in(self, name: str) -> int | None:
        if self.current is None:
            return None
        if isinstance(self.current, Choice):
            return self.current.hit.frame if self.current.database == name else None
        return self.current[1] if self.current[0] == name else None

    def _penalties_of(self, name: str) -> object:
        return self.penalties if not self.penalties or _are_of_assets(self.penalties) else self.penalties.get(name)


def _is_pair(current: object) -> bool:
    return isinstance(current, tuple) and len(current) == 2


def _are_of_assets(penalties: OfPenalties) -> bool:
    """Costs are of assets, mappings and arrays of databases."""
    return not any(isinstance(each, (Mapping, Sequence, np.ndarray)) for each in penalties.values())


# ---- of many characters: one for all, or one for each


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
