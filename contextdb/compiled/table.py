"""A compiled table with every way to ask it: one context or many, kept between frames, explained, picked from, saved.

A `CompiledTable` is what a user sees, and its public names are those of docs/api.md. What they work with is its `CompiledData`: the
rest of the package takes that, through `data_of` where a user gives a table.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, Never, Self

import numpy as np
from numpy.typing import NDArray

from contextdb.cells.arguments import require_path
from contextdb.cells.conditions import Condition
from contextdb.cells.facts import Context, Unknown, check_mode, require_context
from contextdb.cells.notebook import as_html
from contextdb.columns import polars as pl
from contextdb.compiled.data import CompiledData
from contextdb.compiled.matches import Matches
from contextdb.compiled.memory import Rng
from contextdb.compiled.outputs import Outputs
from contextdb.compiled.pick import pick
from contextdb.compiled.unchanging import Unchanging
from contextdb.compiled.ways import Step
from contextdb.errors import ContextError, Fault, WrongType, in_quotes
from contextdb.schema.policies import Policy

if TYPE_CHECKING:
    from contextdb.compiled.casting.facts import Actors, Prefer
    from contextdb.compiled.explain import Explanation
    from contextdb.compiled.live import LiveContext
    from contextdb.compiled.live_many import LiveMany
    from contextdb.compiled.many import ManyMatches
    from contextdb.compiled.picker import Picker

    ManyContexts = Mapping[str, Any] | pl.DataFrame  # Any: a dict of lists and arrays is one of objects for a type checker

NO_FACTS: Context = MappingProxyType({})


@dataclass(frozen=True, eq=False, repr=False)
class CompiledTable(Unchanging):
    """A table as masks. Get one from `Table.compile()` or `CompiledTable.open(path)`.

    It can be pickled at any time. The copy gives the same answers; only the memory of `pick` is not pickled.
    """

    _data: CompiledData

    def __repr__(self) -> str:
        return self._data.described(type(self).__name__)

    def _repr_html_(self) -> str:
        """A notebook's table of the conditions."""
        rows = [(c.name, c.domain.kind, c.unit, c.description) for c in self.asked.values()]
        return as_html(repr(self), ("condition", "type", "unit", "description"), rows)

    @property
    def name(self) -> str:
        """The name of the table."""
        return self._data.name

    @property
    def n_rows(self) -> int:
        """The number of rows."""
        return self._data.n_rows

    @property
    def assets(self) -> Sequence[str]:
        """The asset of each row."""
        return self._data.assets

    @property
    def leaves(self) -> Sequence[str]:
        """The asset of each row, without the path that it has in a table inside the table."""
        return self._data.leaves

    @property
    def conditions(self) -> tuple[Condition, ...]:
        """The columns that are conditions."""
        return self._data.conditions

    @property
    def asked(self) -> dict[str, Condition]:
        """The conditions whose facts a caller gives: those of the table and of its rules, and for derived ones those that they are
        computed from."""
        return self._data.asked

    @property
    def policy(self) -> Policy:
        """How `pick` chooses among the valid rows."""
        return self._data.policy

    @property
    def fallback(self) -> str | None:
        """The asset that `pick` gives where no row is valid."""
        return self._data.fallback

    @property
    def priorities(self) -> NDArray[np.int64]:
        """The priority of each row: int64 [n_rows]."""
        return self._data.priorities

    @property
    def row_weights(self) -> NDArray[np.float64]:
        """The weight of each row: float64 [n_rows]."""
        return self._data.row_weights

    @property
    def outputs(self) -> Outputs:
        """What the rows give the game besides their assets; one without columns where the table has none."""
        return self._data.outputs

    @property
    def version(self) -> str:
        """A digest of the table's contents: the same for two tables with the same contents, wherever they were compiled."""
        return self._data.version

    @property
    def nbytes(self) -> int:
        """Bytes that the masks take."""
        return self._data.nbytes

    def way(self, row: int) -> tuple[Step, ...]:
        """The rows of tables that a row comes from, outermost first, each with its file and line; for a table without tables inside
        one step, the row itself. Raises NoSuchPlace for a row that there is not."""
        return self._data.way(row)

    def query(
        self,
        context: Context = NO_FACTS,
        *,
        unknown: Unknown = "error",
        actors: Actors | None = None,
        prefer: Prefer = None,
        **slips: Never,
    ) -> Matches:
        """Find the rows whose cells all accept their facts, and whose roles can be filled.

        Parameters
        ----------
        context : mapping of str to fact
            A value for each condition of `asked`; a set of values as `cdb.cell("0 ± 90")`. Facts that the table does not use
            are passed over.
        unknown : {"error", "any", "never"}
            How to treat a missing fact (absent, None or NaN): raise; ignore its condition; let only cells that are Any accept it.
        actors : mapping of str to sequence of mapping, optional
            Who may play each role: `{"Defender": [{"id": 7, "DepthChart": "CB"}]}`. `m.casting(row)` then says who plays what.
            An actor offered for several roles, as one object or with an equal "id", plays one. A role whose facts are in the
            context instead is not cast; one with neither has nobody.
        prefer : str, mapping of role to str, or function of role and actor, optional
            The number fact by which actors are preferred, lowest first ("-speed": highest first). The casting with the lowest sum
            is the best; actors without it come last. Default: in the order in which they are offered.

        Raises
        ------
        ContextError
            A fact is missing (named, with a misspelt one near it), of the wrong type, or outside an enum's or tag's domain; a
            derived fact is given, or cannot be computed.

        Notes
        -----
        With set-valued facts the answer holds the rows that may match; `Matches.always` those that match for every value.
        """
        data = self._data
        if slips:
            raise _facts_by_name("query", slips)
        if actors is not None:
            from contextdb.compiled.casting.facts import Ask
            from contextdb.compiled.casting.stage import query_with_actors

            answer: Matches = query_with_actors(data, context, Ask(actors, prefer, unknown))
        elif unknown != "error":
            answer = data.query(context, unknown)
        else:
            try:  # as there, without a call more: the way of every question
                plain = data._ask(context)
                answer = data.query_with_care(context) if plain is None else plain
                if not data.is_bound and "query" not in self.__dict__:
                    object.__setattr__(self, "query", data.core.query_or(type(self)(data).query))  # comes before the method
            except Exception:  # no mapping, which can raise anything, or a fault of ours
                require_context(context)
                raise
        if (watcher := data._watcher) is not None and watcher.feed.is_open:
            watcher.answered(context, answer, actors)
        return answer

    def query_many(
        self,
        contexts: ManyContexts,
        *,
        unknown: Unknown = "error",
        actors: Actors | Sequence[Actors] | None = None,
        prefer: Prefer = None,
    ) -> ManyMatches:
        """Find the valid rows for many contexts at once: counts, hits and masks.

        Parameters
        ----------
        contexts : polars DataFrame, or mapping of str to list or array
            One column for each condition, equally long; others are ignored.
        actors : mapping, or sequence of one mapping for each context, optional
            Who may play each role, as in `query`; one mapping is for all contexts. `many[i]` is then the answer of context i.

        Raises
        ------
        ContextError
            As `query`, naming the first contexts concerned.
        """
        if actors is not None:
            from contextdb.compiled.casting.facts import Ask
            from contextdb.compiled.casting.many import query_many_with_actors

            return query_many_with_actors(self._data, contexts, Ask(actors, prefer, unknown))  # type: ignore[arg-type]
        from contextdb.compiled.batch import query_many

        return query_many(self._data, contexts, unknown)

    def live(
        self,
        facts: Context | None = None,
        *,
        unknown: Unknown = "error",
        actors: Actors | None = None,
        prefer: Prefer = None,
        **slips: Never,
    ) -> LiveContext:
        """Keep a context between frames: `live["speed"] = 3.2`, then `live.query()`. Actors are offered from then on, as with
        `LiveContext.actors`. Raises ContextError where a fact cannot be used, or its name looks misspelt. Facts may be missing
        until `query()` is called."""
        from contextdb.compiled.live import LiveContext

        if slips:
            raise _facts_by_name("live", slips)
        check_mode(unknown)
        live = LiveContext(self._data, unknown)
        live.update({} if facts is None else facts)
        live.actors(actors, prefer=prefer)
        return live

    def live_many(self, facts: ManyContexts, *, unknown: Unknown = "error") -> LiveMany:
        """Keep the facts of many characters: `crowd["speed"] = speeds`, then `crowd.query()`. The columns are as in `query_many`,
        one fact for each character; those that change are set whole or by character. Raises ContextError where a fact cannot be
        used, or a name looks misspelt."""
        from contextdb.compiled.live_many import LiveMany

        return LiveMany(self._data, facts, unknown)

    def prepare(self, casting: bool = False, batches: bool = False) -> None:
        """Do the work of the first queries now, while the game loads; answers stay the same, and nothing is raised: it asks without
        facts.

        `casting` also does the work of the first query with actors; `batches` that of the first batches.
        """
        from contextdb.compiled.preparing import prepare

        prepare(self._data, casting, batches)

    def explain(
        self, context: Context, *, unknown: Unknown = "error", actors: Actors | None = None, prefer: Prefer = None
    ) -> Explanation:
        """Why each row is valid or not: the cells that fail and the facts they fail with, nearest rows first. With actors also
        which role cannot be filled, and whose fact fails. Raises what `query` raises."""
        if actors is not None:
            from contextdb.compiled.casting.explaining import explain_with_actors
            from contextdb.compiled.casting.facts import Ask

            return explain_with_actors(self._data, context, Ask(actors, prefer, unknown))
        from contextdb.compiled.explain import explain

        return explain(self._data, context, unknown)

    def penalties(
        self, context: Context, *, unknown: Unknown = "error", actors: Actors | None = None, prefer: Prefer = None
    ) -> NDArray[np.float64]:
        """What each row's soft cells cost in a search: float64 [n_rows], the sum of the penalties of those that do not match.

        A soft cell whose fact is missing costs nothing with unknown="any", its penalty with "never". A set-valued fact costs
        nothing where some value of the set matches. With actors a row costs what it does with its best casting.
        Raises what `query` raises.
        """
        if actors is not None:
            return self.query(context, unknown=unknown, actors=actors, prefer=prefer).penalties
        return self._data.plain_penalties(context, unknown)

    def pick(
        self,
        context: Context | Matches,
        rng: Rng | int | None = None,
        last: str | None = None,
        *,
        unknown: Unknown = "error",
        actors: Actors | None = None,
        prefer: Prefer = None,
    ) -> str | None:
        """One asset by the table's policy, of a context or of an answer; None where nothing is valid and there is no fallback.

        Parameters
        ----------
        context : mapping or Matches
            The facts, or an answer of this table in this version.
        rng : random.Random, numpy.random.Generator or int, optional
            Where chance comes from: one generator a character. A number seeds a new one, for the same pick each time. Default: the
            table's own.
        last : str, optional
            The asset not to repeat, "" for none. Default: what this generator picked last in this table.

        Raises
        ------
        ContextError
            As `query`; the answer is of another table or version, or comes with actors; `rng` or `last` cannot be used.
        PolicyError
            The policy is "unique" and several rows are valid.
        """
        if not isinstance(context, (dict, Matches)):
            from contextdb.compiled.many import ManyMatches

            if isinstance(context, ManyMatches):
                problem = "pick is given the answers for many contexts."
                raise WrongType(Fault(problem, "a context, or the answer for one", "many[i]"))
        if not isinstance(context, Matches):
            context = self.query(context, unknown=unknown, actors=actors, prefer=prefer)
        elif actors is not None:
            problem = "actors are for a query, and this is the answer to one."
            raise ContextError(Fault(problem, "facts with actors, or the answer to a query with actors"))
        return pick(self._data, context, rng, last)

    def picker(self, seed: int = 0, memory: int = 1) -> Picker:
        """Picks for one character or for many, which it remembers: see `contextdb.compiled.picker.Picker`.

        The same `seed` gives the same picks, on every system. So many of the last assets of a character as `memory` says are not
        picked again while there is another choice. Raises ContextError where either is no whole number, or the memory is out of
        range.
        """
        from contextdb.compiled.picker import Picker

        return Picker(self.name, seed, memory)

    def save(self, path: str | Path) -> None:
        """Write the compiled file for the game, a .safetensors file, atomically; raises FileError where it cannot be written."""
        from contextdb.compiled.artefact import save

        save(self._data, require_path(path))

    @classmethod
    def open(cls, path: str | Path) -> Self:
        """Open a compiled file by memory map. Raises ArtefactError where the file is truncated, altered, of another program or of a
        later version; FileError where it is missing, or cannot be read."""
        from contextdb.compiled.artefact import open_artefact

        return cls(open_artefact(require_path(path)))


def _facts_by_name(method: str, slips: Mapping[str, object]) -> WrongType:
    first = next(iter(slips))
    problem = f"{method} is given {in_quotes(first)} as an argument."
    accepted = "the facts as one mapping"
    return WrongType(Fault(problem, accepted, f"{method}({{{in_quotes(first)}: ...}})"))


def data_of(table: CompiledTable) -> CompiledData:
    """What is inside a compiled table, for the rest of the package; a game has no use for it."""
    return table._data
