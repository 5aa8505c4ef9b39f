"""A compiled table with every way to ask it: one context or many, kept between frames, explained, picked from, saved."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Never, Self

import numpy as np
from numpy.typing import NDArray

from contextdb.cells.arguments import by_name, require_path
from contextdb.cells.facts import Context, Unknown, check_mode, require_context
from contextdb.compiled.artefact import open_artefact, save
from contextdb.compiled.batch import query_codes, query_many
from contextdb.compiled.casting.explaining import explain_with_actors
from contextdb.compiled.casting.facts import Actors, Ask, Prefer
from contextdb.compiled.casting.many import query_many_with_actors
from contextdb.compiled.casting.stage import query_with_actors
from contextdb.compiled.data import CompiledData
from contextdb.compiled.explain import Explanation, explain
from contextdb.compiled.live import LiveContext, live_context
from contextdb.compiled.lookup import UNUSUAL
from contextdb.compiled.many import ManyMatches
from contextdb.compiled.matches import Matches
from contextdb.compiled.memory import Rng
from contextdb.compiled.pick import pick
from contextdb.compiled.picker import Picker
from contextdb.compiled.preparing import prepare
from contextdb.errors import ContextError, Fault, WrongType

if TYPE_CHECKING:
    import polars as pl

    ManyContexts = Mapping[str, Sequence[object] | NDArray[Any]] | pl.DataFrame


@dataclass(frozen=True, eq=False, repr=False)
class CompiledTable(CompiledData):
    """A table as masks. Get one from `Table.compile()` or `CompiledTable.open(path)`.

    It can be pickled at any time. The copy gives the same answers; only the memory of `pick` is not pickled.
    """

    def query(
        self, context: Context, *old: Never, unknown: Unknown = "error", actors: Actors | None = None, prefer: Prefer = None
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
        if old:
            return self.query(context, **by_name("query", old, unknown=unknown, actors=actors, prefer=prefer))
        if actors is not None:
            cast = query_with_actors(self, context, Ask(actors, prefer, unknown))
            if self.heard is not None:
                self.heard.asked(context, cast, actors)
            return cast
        if unknown != "error":
            return super().query(context, unknown=unknown)
        try:  # as there, without a call more: the way of every question
            return self._ask(context)
        except UNUSUAL:
            return self.query_with_care(context)
        except Exception:  # no mapping, which can raise anything, or a fault of ours
            require_context(context)
            raise

    def query_many(
        self,
        contexts: ManyContexts,
        *old: Never,
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
        if old:
            return self.query_many(contexts, **by_name("query_many", old, unknown=unknown, actors=actors, prefer=prefer))
        if actors is not None:
            return query_many_with_actors(self, contexts, Ask(actors, prefer, unknown))  # type: ignore[arg-type]
        return query_many(self, contexts, unknown)

    def live(
        self,
        facts: Context | None = None,
        *old: Never,
        unknown: Unknown = "error",
        actors: Actors | None = None,
        prefer: Prefer = None,
    ) -> LiveContext:
        """Keep a context between frames: `live["speed"] = 3.2`, then `live.matches()`. Actors are offered from then on, as with
        `LiveContext.actors`.

        Raises
        ------
        ContextError
            A fact cannot be used, or its name looks misspelt. Facts may be missing until `matches()` is called.
        """
        if old:
            return self.live(facts, **by_name("live", old, unknown=unknown, actors=actors, prefer=prefer))
        check_mode(unknown)
        live = live_context(self, unknown)
        live.update({} if facts is None else facts)
        live.actors(actors, prefer=prefer)
        return live

    def prepare(self, casting: bool = False, batches: bool = False) -> None:
        """Do the work of the first queries now, while the game loads; answers stay the same.

        Parameters
        ----------
        casting : bool
            Also the work of the first query with actors.
        batches : bool
            Also the work of the first batches: numba is loaded, where it is installed, and the kernels are compiled or
            read from its cache, which takes about a second.

        Raises nothing: it asks without facts.
        """
        prepare(self, casting, batches)

    def query_codes(self, codes: NDArray[np.int32]) -> Matches:
        """The rows for codes that `encode` made; raises ContextError for other codes."""
        return query_codes(self, codes)

    def explain(
        self, context: Context, *old: Never, unknown: Unknown = "error", actors: Actors | None = None, prefer: Prefer = None
    ) -> Explanation:
        """Why each row is valid or not: the cells that fail and the facts they fail with, nearest rows first. With actors also
        which role cannot be filled, and whose fact fails. Raises what `query` raises."""
        if old:
            return self.explain(context, **by_name("explain", old, unknown=unknown, actors=actors, prefer=prefer))
        if actors is not None:
            return explain_with_actors(self, context, Ask(actors, prefer, unknown))
        return explain(self, context, unknown)

    def penalties(
        self, context: Context, *old: Never, unknown: Unknown = "error", actors: Actors | None = None, prefer: Prefer = None
    ) -> NDArray[np.float64]:
        """What each row's soft cells cost in a search: float64 [n_rows], the sum of the penalties of those that do not match.

        A soft cell whose fact is missing costs nothing with unknown="any", its penalty with "never". A set-valued fact costs
        nothing where some value of the set matches. With actors a row costs what it does with its best casting.
        Raises what `query` raises.
        """
        if old:
            return self.penalties(context, **by_name("penalties", old, unknown=unknown, actors=actors, prefer=prefer))
        if actors is not None:
            return self.query(context, unknown=unknown, actors=actors, prefer=prefer).penalties
        return self.plain_penalties(context, unknown)

    def pick(
        self,
        context: Context | Matches,
        rng: Rng | int | None = None,
        last: str | None = None,
        *old: Never,
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
        if old:
            return self.pick(context, rng, last, **by_name("pick", old, unknown=unknown, actors=actors, prefer=prefer))
        if isinstance(context, ManyMatches):
            raise WrongType(Fault("pick is given the answers for many contexts.", "a context, or the answer for one", "many[i]"))
        if not isinstance(context, Matches):
            context = self.query(context, unknown=unknown, actors=actors, prefer=prefer)
        elif actors is not None:
            found = "actors are for a query, and this is the answer to one."
            raise ContextError(Fault(found, "facts with actors, or the answer to a query with actors"))
        return pick(self, context, rng, last)

    def picker(self, seed: int = 0, memory: int = 1) -> Picker:
        """Picks for one character or for many, which it remembers: see `contextdb.compiled.picker.Picker`.

        Parameters
        ----------
        seed : int
            The same seed gives the same picks, on every system.
        memory : int
            So many of the last assets of a character are not picked again while there is another choice.

        Raises
        ------
        ContextError
            The seed or the memory is no whole number, or the memory is out of range.
        """
        return Picker(self.name, seed, memory)

    def save(self, path: str | Path) -> None:
        """Write the compiled file for the game, a .safetensors file, atomically; raises FileError where it cannot be written."""
        save(self, require_path(path))

    @classmethod
    def open(cls, path: str | Path) -> Self:
        """Open a compiled file by memory map.

        Raises
        ------
        ArtefactError
            The file is truncated, altered, of another program or of a later version.
        FileError
            It is missing, or cannot be read.
        """
        return open_artefact(require_path(path), cls)
