"""A compiled table with every way to ask it: one context or many, kept between frames, explained, picked from, saved."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Self, overload

import numpy as np
from numpy.typing import NDArray

from contextdb.cells.arguments import require_path
from contextdb.cells.facts import Context, Unknown, check_mode, require_context
from contextdb.compiled.artefact import open_artefact, save
from contextdb.compiled.batch import ManyMatches, query_codes, query_many
from contextdb.compiled.casting.explaining import explain_with_actors
from contextdb.compiled.casting.facts import Actors, Ask, Prefer
from contextdb.compiled.casting.many import ManyCastMatches, query_many_with_actors
from contextdb.compiled.casting.stage import query_with_actors
from contextdb.compiled.data import CompiledData
from contextdb.compiled.explain import Explanation, explain
from contextdb.compiled.live import LiveContext, live_context
from contextdb.compiled.lookup import UNUSUAL
from contextdb.compiled.matches import Matches
from contextdb.compiled.memory import Rng
from contextdb.compiled.pick import pick
from contextdb.compiled.picker import Picker
from contextdb.compiled.preparing import prepare
from contextdb.errors import ContextError, Fault

if TYPE_CHECKING:
    import polars as pl

    ManyContexts = Mapping[str, Sequence[object] | NDArray[Any]] | pl.DataFrame


@dataclass(frozen=True, eq=False)
class CompiledTable(CompiledData):
    """A table as masks. Get one from `Table.compile()` or `CompiledTable.open(path)`.

    It can be pickled at any time. The copy gives the same answers; only the memory of `pick` is not pickled.
    """

    def query(self, context: Context, unknown: Unknown = "error", actors: Actors | None = None, prefer: Prefer = None) -> Matches:
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
        if actors is not None:
            return query_with_actors(self, context, Ask(actors, prefer, unknown))
        if unknown != "error":
            return super().query(context, unknown)
        try:  # as there, without a call more: the way of every question
            return self._ask(context)
        except UNUSUAL:
            return self.query_with_care(context)
        except Exception:  # no mapping, which can raise anything, or a fault of ours
            require_context(context)
            raise

    @overload
    def query_many(self, contexts: ManyContexts, unknown: Unknown = "error") -> ManyMatches: ...

    @overload
    def query_many(
        self, contexts: ManyContexts, unknown: Unknown = "error", *, actors: Actors | Sequence[Actors], prefer: Prefer = None
    ) -> ManyCastMatches: ...

    def query_many(
        self,
        contexts: ManyContexts,
        unknown: Unknown = "error",
        *,
        actors: Actors | Sequence[Actors] | None = None,
        prefer: Prefer = None,
    ) -> ManyMatches | ManyCastMatches:
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
            return query_many_with_actors(self, contexts, actors, prefer, unknown)
        return query_many(self, contexts, unknown)

    def live(self, facts: Context | None = None, unknown: Unknown = "error") -> LiveContext:
        """Keep a context between frames: `live["speed"] = 3.2`, then `live.matches()`."""
        check_mode(unknown)
        live = live_context(self, unknown)
        live.update({} if facts is None else facts)
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
        """
        prepare(self, casting, batches)

    def query_codes(self, codes: NDArray[np.int32]) -> Matches:
        """The rows for codes that `encode` made."""
        return query_codes(self, codes)

    def explain(
        self, context: Context, unknown: Unknown = "error", actors: Actors | None = None, prefer: Prefer = None
    ) -> Explanation:
        """Why each row is valid or not: the cells that fail and the facts they fail with, nearest rows first. With actors also
        which role cannot be filled, and whose fact fails."""
        if actors is not None:
            return explain_with_actors(self, context, Ask(actors, prefer, unknown))
        return explain(self, context, unknown)

    def pick(
        self,
        context: Context | Matches,
        rng: Rng | int | None = None,
        last: str | None = None,
        unknown: Unknown = "error",
        *,
        actors: Actors | None = None,
        prefer: Prefer = None,
    ) -> str | None:
        """One asset by the table's policy: see `contextdb.compiled.pick.pick`. Actors are those of `query`."""
        if not isinstance(context, Matches):
            context = self.query(context, unknown, actors, prefer)
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
        """
        return Picker(self.name, seed, memory)

    def save(self, path: str | Path) -> None:
        """Write the compiled file for the game, a .safetensors file, atomically."""
        save(self, require_path(path))

    @classmethod
    def open(cls, path: str | Path) -> Self:
        """Open a compiled file by memory map. A truncated, altered or foreign file is refused with ArtefactError."""
        return open_artefact(require_path(path), cls)
