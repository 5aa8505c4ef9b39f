"""The facts of many characters that the game keeps: columns are set whole or by character, then all are asked at once.

N characters, P codes each (see `contextdb.compiled.codes`). A column that is set is read into codes then; a question joins
the codes as they are, so what did not change is not read again. Derived facts and rules are computed in every question.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from contextdb.cells.arguments import require_place, require_text
from contextdb.cells.conditions import Condition
from contextdb.cells.fact_columns import listed
from contextdb.cells.facts import NAMES, Unknown, alike, check_mode, missing_error, no_condition
from contextdb.cells.notebook import one_line
from contextdb.compiled.batch import KnownCodes, encode_column, kept_facts, query_known
from contextdb.compiled.batch_columns import common_length, facts_of, kept_columns
from contextdb.compiled.data import CompiledData
from contextdb.compiled.many import ManyMatches
from contextdb.errors import ContextError, Fault, NoSuchFact, in_quotes, plural

if TYPE_CHECKING:
    from contextdb.compiled.batch_columns import Contexts

Column = Sequence[object] | NDArray[Any]


class LiveMany:
    """The facts of many characters. `crowd["speed"] = speeds` sets a column, `crowd.set("speed", [3, 7], [1.2, 0.0])` those of some
    characters; `crowd.query()` answers for all. For one thread at a time.
    """

    def __init__(self, compiled: CompiledData, facts: Contexts, unknown: Unknown = "error") -> None:
        check_mode(unknown)
        self._compiled = compiled
        self._unknown = unknown
        self._places = {condition.name: at for at, condition in enumerate(compiled.conditions)}
        self._columns: dict[str, Any] = {}
        """The facts as they were set, which the caller cannot change any more."""
        self._missing: dict[str, NDArray[np.bool_]] = {}
        """Of columns with missing facts, which of them are."""
        columns = facts_of(facts)
        self._n = common_length(columns)
        self._codes = np.empty((compiled.codes.n_codes, self._n), np.int32)
        self.update(columns)

    def __len__(self) -> int:
        return self._n

    def __bool__(self) -> bool:
        return True

    @property
    def asked(self) -> dict[str, Condition]:
        """The conditions whose facts can be set, by name."""
        return self._compiled.asked

    @property
    def facts(self) -> dict[str, Any]:
        """The columns that are set, by name."""
        return dict(self._columns)

    def __iter__(self) -> Iterator[str]:
        return iter(self._columns)

    def __contains__(self, name: object) -> bool:
        return name in self._columns

    def __getitem__(self, name: str) -> Any:
        if name not in self._columns:
            self._require(name)
            raise NoSuchFact(Fault(f"the facts {in_quotes(name)} are not set.", f"crowd[{in_quotes(name)}] = ..."))
        return self._columns[name]

    def __setitem__(self, name: str, column: Column) -> None:
        self._require(name)
        own = kept_columns(facts_of({name: column}), self.asked)[name]
        if len(own) != self._n:
            problem = f"there are {plural(len(own), 'fact')} of {in_quotes(name)}, for {plural(self._n, 'character')}."
            raise ContextError(Fault(problem, "one fact for each character"))
        self._put(name, own, None)
        self._columns[name] = own

    def update(self, facts: Contexts) -> None:
        """Set several columns. As in a query, other names are passed over; raises ContextError for one that looks like the misspelt
        name of a condition whose facts are not set, and for a fact that is wrong, with its character."""
        columns = facts_of(facts)
        for name in columns:
            near = () if name in self.asked or name in self._compiled.declared else alike(name, self.asked)
            if wanted := next((one for one in near if one not in columns and one not in self._columns), None):
                problem = f"there is no condition {in_quotes(name)}, and {in_quotes(wanted)} is not given."
                raise NoSuchFact(Fault(problem, NAMES, in_quotes(wanted), rule="unknown-fact"))
        for name, column in columns.items():
            if name in self.asked:
                self[name] = column

    def set(self, name: str, who: int | Sequence[int] | NDArray[np.integer[Any]], values: object) -> None:
        """Set a fact of some characters: a value for each, or one for one character.

        Raises ContextError for a name of no condition, a character that there is not, a fact that is wrong, and a column that was
        not set before.
        """
        column = self[require_text(name, "name")]
        one = isinstance(who, (int, np.integer))
        at = self._characters([who] if one else who)
        new = facts_of({name: [values] if one else values})[name]
        if len(new) != len(at):
            problem = f"there are {plural(len(new), 'fact')} of {in_quotes(name)}, for {plural(len(at), 'character')}."
            raise ContextError(Fault(problem, "one fact for each of them"))
        self._put(name, new, at)
        self._columns[name] = _with(column, at, kept_columns({name: new}, self.asked)[name])

    def query(self) -> ManyMatches:
        """The valid rows of all characters now; later changes do not change the answer. Raises what `query_many` raises."""
        compiled = self._compiled
        if self._unknown == "error" and (absent := [name for name in self.asked if name not in self._columns]):
            raise missing_error(absent, [])
        many = query_known(compiled, self._columns, self._n, self._unknown, KnownCodes(self._codes, self._missing))
        return kept_facts(many, self._columns, self._unknown)

    matches = query

    def __repr__(self) -> str:
        characters = f"{plural(self._n, 'character')}, {len(self._columns)} of {plural(len(self.asked), 'fact')} set"
        return one_line("LiveMany", self._compiled.name, characters)

    def _require(self, name: str) -> None:
        if name not in self.asked:
            if self._compiled.derivation is not None:
                self._compiled.derivation.refuse([name])
            raise no_condition(name, self.asked)

    def _characters(self, who: object) -> NDArray[np.int64]:
        if isinstance(who, np.ndarray) and who.dtype.kind in "iu" and who.ndim == 1:
            at = who.astype(np.int64)
            outside = at[(at < 0) | (at >= self._n)]
            if len(outside):
                require_place(int(outside[0]) if outside[0] >= 0 else -self._n - 1, self._n, "character")
            return at
        if not isinstance(who, (list, tuple, range)):
            accepted = "the number of a character, a list of them, or a flat array of whole numbers"
            raise ContextError(Fault(f"characters are given as {type(who).__name__}.", accepted))
        return np.array([require_place(one, self._n, "character") for one in who], np.int64)

    def _put(self, name: str, column: Any, at: NDArray[np.int64] | None) -> None:
        """Read facts into the codes, of all characters or of some; nothing is changed where one is wrong."""
        place = self._places.get(name)
        n = self._n if at is None else len(at)
        if place is None:
            return
        slots = self._compiled.codes.slots[place]
        codes = np.empty((self._compiled.codes.n_codes, n), np.int32)
        missing = encode_column(self._compiled, place, column, codes, self._unknown == "any")
        own = self._codes[slots.start : slots.stop]
        own[:, slice(None) if at is None else at] = codes[slots.start : slots.stop]
        if not len(missing) and (at is None or name not in self._missing):
            self._missing.pop(name, None)
            return
        flags = self._missing.get(name, np.zeros(self._n, np.bool_)) if at is not None else np.zeros(self._n, np.bool_)
        flags[slice(None) if at is None else at] = False
        flags[missing if at is None else at[missing]] = True
        self._missing = {other: own for other, own in self._missing.items() if other != name} | (
            {name: flags} if flags.any() else {}
        )


def _with(column: Any, at: NDArray[np.int64], values: Any) -> Any:
    """A column with other facts of some characters: a new one, since answers may hold the old."""
    if (
        isinstance(column, np.ndarray)
        and isinstance(values, np.ndarray)
        and column.dtype == values.dtype
        and column.dtype.kind != "U"
    ):
        new = column.copy()
        new[at] = values
        return new
    facts = list(listed(column))
    for one, value in zip(at.tolist(), listed(values), strict=True):
        facts[one] = value
    return facts
