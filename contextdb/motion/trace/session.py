"""A recorded session: every decision of a controller, stored compactly, and saved as one Parquet file.

    trace = Trace(databases=selector.databases)
    controller = Controller(selector, settings, recorder=trace)
    ...
    trace.save("session.parquet")

Each decision is packed at once, so that no update waits for the work of others. Candidates are not stored: the query and the inputs
of a search are, and the databases give the costs of every frame again, bit for bit, when they are requested. Of a session that
continues and on, the last `most` decisions stay.

A file has one row a decision, its columns as `contextdb.motion.trace.rows` says, and in its metadata the format's number and what
the databases' ranges, features and channels are. The same session gives the same bytes, if the timings are left out.
"""

from __future__ import annotations

import io
import json
import marshal
import sys
import zlib
from collections import deque
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, replace
from itertools import islice
from os import PathLike
from typing import Any, Unpack

from contextdb.cells.arguments import require_kind, require_many, require_mapping, require_path, require_place, require_text
from contextdb.cells.sequences import Made
from contextdb.columns import polars as pl
from contextdb.disk import read_bytes, write_atomic
from contextdb.errors import (
    ContextDBError,
    ContextError,
    Fault,
    MotionError,
    in_quotes,
    nearest,
    plural,
    some,
)
from contextdb.files.parquet_frame import UNSEALED, sealed
from contextdb.motion.search.database import MotionDatabase
from contextdb.motion.selection.decision import Decision, Playing
from contextdb.motion.selection.worked_out import WorkedOut, of_searched
from contextdb.motion.trace.filter_rows import fingerprint, is_recorded, markup_digest
from contextdb.motion.trace.reasked import Changes, Reasked
from contextdb.motion.trace.rows import (
    FILTERS,
    INPUTS,
    PERMUTATION_S,
    TIMINGS,
    Events,
    Row,
    columns,
    decision_of,
    events_in,
    row_of,
)
from contextdb.motion.trace.session_diff import SessionDiff, diff_sessions
from contextdb.motion.trace.session_file import (
    ABOUT_KEY,
    FORMAT,
    FORMAT_KEY,
    N_CANDIDATES,
    SHOWN_KEY,
    frame_of_rows,
    read_rows,
    refused,
)
from contextdb.motion.trace.stats import SessionStats, stats_of
from contextdb.motion.trace.stock import Stock
from contextdb.motion.trace.what_if import WhatIf, what_if

CHUNK = 512
"""So many decisions become Parquet at a time."""
MOST = 108_000
"""So many decisions stay unless another number is given: an hour at 30 a second."""


class Trace(Made[Decision]):
    """Decisions in order. A recorder for a `Controller`, and what a saved session is read into.

    Parameters
    ----------
    n_candidates : int
        How many candidates of each searched database a decision shows. With 0 it shows none, and nothing is recorded by which it
        could be repeated.
    databases : mapping of name to MotionDatabase, optional
        Those of the selector. Default: those that the first decisions were made with.
    most : int
        How many recorded decisions stay; older ones are forgotten.

    Attributes
    ----------
    n_forgotten : int
        How many decisions came before the first that is stored.
    about : mapping
        For the name of each database `rate`, `features`, `channels`, its ranges (`assets`, `starts`, `stops`, `mirrored`), the
        `digest` of what costs come from, and `permutation_s` where it has permutations.
    """

    def __init__(
        self, n_candidates: int = N_CANDIDATES, databases: Mapping[str, MotionDatabase] | None = None, *, most: int = MOST
    ) -> None:
        for what, number, least in (("n_candidates", n_candidates, 0), ("most", most, 1)):
            if isinstance(number, bool) or not isinstance(number, int) or not least <= number <= sys.maxsize:
                raise MotionError(Fault(f"{what} is {number!r}.", f"a whole number, {least} or more"))
        for name, each in require_mapping(
            {} if databases is None else databases, "databases", "a mapping of names to databases"
        ).items():
            require_text(name, "one of databases")
            require_kind(each, MotionDatabase, "one of databases", "a MotionDatabase")
        self.n_candidates, self.most, self.n_forgotten = n_candidates, most, 0
        self.about: dict[str, dict[str, Any]] = {name: _about(each) for name, each in (databases or {}).items()}
        self._databases = dict(databases or {})
        self._takes_databases = databases is None
        self._loaded: pl.DataFrame | None = None
        self._rows: deque[bytes] = deque(maxlen=most)
        self._events: Events = {}
        self._file = ""

    def record(self, decision: Decision) -> None:
        """Keep a decision; raises ContextError for what is none."""
        require_kind(decision, Decision, "decision", "a Decision")
        if self._takes_databases and isinstance(decision.candidates, WorkedOut):
            self._take(decision.candidates.databases)
        packed = _packed(row_of(decision, self._events_of))
        self.n_forgotten += len(self._rows) == self.most
        self._rows.append(packed)

    @property
    def controller(self) -> str:
        """The controller that recorded it; "" where the session does not say."""
        return next((str(about["controller"]) for about in self.about.values() if "controller" in about), "")

    def __repr__(self) -> str:
        return f"<Trace: {plural(len(self), 'decision')}>"

    def __len__(self) -> int:
        return self._n_loaded + len(self._rows)

    def _at(self, index: int) -> Decision:
        return self._decision(self._place(index))

    def __iter__(self) -> Iterator[Decision]:
        return (self._decision_of(row, place) for place, row in enumerate(self._every_row()))

    def brief(self) -> Iterator[Decision]:
        """The decisions in order without their queries, candidates and inputs: much faster than with them."""
        for place, row in enumerate(self._every_row("query", "candidates", FILTERS, INPUTS)):
            yield self._decision_of({**row, "query": None, "candidates": [], FILTERS: [], INPUTS: None}, place)

    def columns(self, names: Sequence[str]) -> pl.DataFrame:
        """Some columns of all rows, as the file has them. Raises ContextError for one that there is not, with the nearest."""
        import polars as pl

        own = frame_of_rows([{**dict.fromkeys(columns()), **row} for row in map(_unpacked, self._rows)])
        frames = [own] if self._loaded is None else [self._loaded, own]
        names = [require_text(name, "one of names") for name in require_many(names, "names", "a list of names")]
        for name in names:
            if name not in frames[0].columns:
                near, problem = nearest(name, frames[0].columns), f"a session has no column {in_quotes(name)}."
                raise ContextError(Fault(problem, some(frames[0].columns), in_quotes(near) if near else ""))
        return pl.concat([frame.select(names) for frame in frames])

    def events(self, index: int) -> Events:
        """What the markup says of the frames that a decision mentions, by (database, frame), as far as it says anything. Raises
        NoSuchPlace where there is no such decision."""
        place = self._place(index)
        events = events_in(self._row(place))
        for name, candidates in self._decision(place).candidates:
            events |= {(name, row.frame): texts for row in candidates if (texts := self._events_of(name, row.frame))}
        return events

    def use(self, databases: Mapping[str, MotionDatabase]) -> str:
        """Work candidates out from these databases, and say in a sentence why some cannot be; "" when all can.

        Those that are not what the session was recorded with are passed over. Raises ContextError for what are no databases.
        """
        given = require_mapping(databases, "databases", "a mapping of names to databases")
        for each in given.values():
            require_kind(each, MotionDatabase, "one of databases", "a MotionDatabase")
        self._databases = {name: each for name, each in given.items() if self._is_recorded(name, each)}
        self._events = {}
        return missing(self.about, given, self._databases)

    @property
    def databases(self) -> Mapping[str, MotionDatabase]:
        """Those of the session that there are, each what it was at its recording."""
        return self._databases

    def reasked(self, project: object = None, **changes: Unpack[Changes]) -> Reasked:
        """Every search of the session repeated, of the same databases or of changed ones; see `Reasked`.

        Parameters
        ----------
        project : Project, or mapping of name to MotionDatabase, optional
            Where the databases and tables are. Default: the databases that `use` was given, or that recorded it.
        weights : mapping of channel to float, optional
            Other weights, for all databases.
        biases : mapping of database name to Biases, optional
        thresholds : mapping of database name to float or None, optional
        tables : mapping of table name to Table, optional
            Tables to ask again, with the recorded facts, instead of taking their recorded answers.

        Raises
        ------
        MotionError
            A channel, database or table that there is not, with the nearest; or a session that holds nothing to ask again.
        """
        stock = Stock(self._databases) if project is None else Stock.of(project, self.about)
        return Reasked(self, self.about, stock, changes)

    def what_if(self, project: object = None, **changes: Unpack[Changes]) -> WhatIf:
        """How many recorded searches choose otherwise with changes, and the measures of the session run again in closed loop.

        The parameters are those of `reasked`, and so is what it raises. Before is the session with the databases that it was
        recorded with, where `use` was given these, or they recorded it; else with those of the project.
        """
        stock = Stock(self._databases) if project is None else Stock.of(project, self.about)
        recorded = Stock(self._databases) if set(self.about) <= set(self._databases) else stock
        return what_if(Reasked(self, self.about, recorded, {}), Reasked(self, self.about, stock, changes))

    def stats(self) -> SessionStats:
        """The session in figures."""
        return stats_of(self.brief(), self.about)

    def diff(self, other: Trace) -> SessionDiff:
        """Where this session and another one part, and the measures of both. Raises ContextError for what is no Trace."""
        require_kind(other, Trace, "other", "a Trace")
        return diff_sessions(self.brief(), other.brief(), self.about, other.about)

    def save(self, path: str | PathLike[str], *, timings: bool = True) -> None:
        """Write the session to a Parquet file, in one step; with `timings` also how long searches took, which no two sessions have
        alike. Raises FileError where the disk refuses; the old file is then whole."""
        write_atomic(require_path(path), self.to_bytes(timings=timings))

    def to_bytes(self, *, timings: bool = True) -> bytes:
        """The bytes of the file that `save` writes. Never fails."""
        import polars as pl

        frames = [] if self._loaded is None else [self._loaded]
        rows = map(_unpacked, self._rows)
        while len(part := frame_of_rows(list(islice(rows, CHUNK)))) or not frames:
            frames.append(part)
        whole = pl.concat(frames)
        frame, about = whole if timings else whole.drop(TIMINGS), json.dumps(self.about)
        out = io.BytesIO()
        count_text = str(self.n_candidates)
        frame.write_parquet(out, metadata={FORMAT_KEY: str(FORMAT), ABOUT_KEY: about, SHOWN_KEY: count_text, **UNSEALED})
        return sealed(out.getvalue())

    @classmethod
    def load(cls, path: str | PathLike[str]) -> Trace:
        """Read a saved session. Raises ArtefactError where the file is no session, cut off, damaged or of another version; with the
        reason. A row that holds no decision is reported when it is requested. FileError where the file cannot be read."""
        return cls.from_bytes(read_bytes(require_path(path)), str(path))

    @classmethod
    def from_bytes(cls, raw: bytes, file: str = "") -> Trace:
        """Read the bytes of a saved session; `file` is its name in messages. Raises what `load` raises."""
        require_kind(raw, bytes, "raw", "the bytes of a saved session")
        trace = cls()
        trace._loaded, trace.about, trace.n_candidates = read_rows(raw, file)
        trace._file = file
        return trace

    # ---- what is stored

    @property
    def _n_loaded(self) -> int:
        return 0 if self._loaded is None else len(self._loaded)

    def _every_row(self, *without: str) -> Iterator[Row]:
        """All rows in order; those of a file without some columns, which need not be read then."""
        if self._loaded is not None:
            yield from self._loaded.drop(without).iter_rows(named=True)
        yield from map(_unpacked, self._rows)

    def _events_of(self, database: str, frame: int) -> tuple[str, ...]:
        events = self._events.get((database, frame))
        if events is None:
            known = self._databases.get(database)
            events = () if known is None or not 0 <= frame < known.n_frames else known.marks.events(frame)
            self._events[database, frame] = events
        return events

    def _place(self, index: int) -> int:
        return require_place(index, len(self), "decision")

    def _decision(self, place: int) -> Decision:
        return self._decision_of(self._row(place), place)

    def _decision_of(self, row: Row, place: int) -> Decision:
        try:
            decision = decision_of(row)
        except (ValueError, TypeError, KeyError, AttributeError, RecursionError, ContextDBError) as error:
            raise refused(f"row {place} holds no decision ({type(error).__name__}).", self._file) from error
        if any(PERMUTATION_S in about for about in self.about.values()):
            now, before = self._permuted(decision.playing), self._permuted(decision.before)
            decision = replace(decision, playing=now, before=before)
        return self._with_candidates(decision)

    def _permuted(self, playing: Playing | None) -> Playing | None:
        """What plays, with how far ahead its permutation looks: not in its row, but known of its database."""
        looks = [] if playing is None else self.about.get(playing.database, {}).get(PERMUTATION_S, [])
        return replace(playing, permutation_s=looks[playing.range % len(looks)]) if playing is not None and looks else playing

    def _with_candidates(self, decision: Decision) -> Decision:
        """A decision with candidates that are worked out when they are requested, where all that they need is there."""
        if decision.candidates or decision.choice is None or decision.query is None or not self.n_candidates:
            return decision
        searched = of_searched(decision.filters, decision.choice)
        if not searched or not all(name in self._databases for name, _ in searched):
            return decision
        worked_out = WorkedOut(self._databases, decision.query, decision.filters, decision.choice, self.n_candidates)
        return replace(decision, candidates=worked_out)

    def _is_recorded(self, name: str, database: MotionDatabase) -> bool:
        return name in self.about and is_recorded(self.about[name], database)

    def _take(self, databases: Mapping[str, MotionDatabase]) -> None:
        for name, database in databases.items():
            if name not in self._databases and (name not in self.about or self._is_recorded(name, database)):
                self._databases[name] = database
                self.about.setdefault(name, _about(database))

    def _row(self, place: int) -> Row:
        if self._loaded is not None and place < self._n_loaded:
            return self._loaded.row(place, named=True)
        return _unpacked(self._rows[place - self._n_loaded])


def _about(database: MotionDatabase) -> dict[str, Any]:
    rate = None if database.schema is None else database.schema.rate
    names = {"features": list(database.feature_names), "channels": list(database.channel_names)}
    ranges = {name: getattr(database, name).tolist() for name in ("starts", "stops", "mirrored")}
    biases = {"looping": database.marks.looping.tolist(), "biases": asdict(database.biases)}
    digests = {"digest": fingerprint(database), "markup": markup_digest(database)}
    about = {"rate": rate, **names, "assets": list(database.assets), **ranges, **biases, **digests}
    if database.schema is not None and database.schema.permutations is not None:
        about[PERMUTATION_S] = list(database.schema.permutation_s)
    return about


def missing(
    about: Mapping[str, Mapping[str, Any]], given: Mapping[str, MotionDatabase], usable: Mapping[str, MotionDatabase]
) -> str:
    """Why some databases of a session cannot be used, in a sentence; "" when all can."""
    for name in about:
        if name not in given:
            return f"there is no database {in_quotes(name)} in the project."
        if name not in usable:
            return f"the database {in_quotes(name)} is another than the one that the session was recorded with."
    return ""


def _packed(row: Row) -> bytes:
    """A row in little memory; these bytes never leave the process."""
    return zlib.compress(marshal.dumps(row), 1)


def _unpacked(packed: bytes) -> Row:
    row: Row = marshal.loads(zlib.decompress(packed))
    return row
