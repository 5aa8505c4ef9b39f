"""A recorded session: every decision of a controller, kept compactly, and saved as one Parquet file.

    trace = Trace(databases=selector.databases)
    controller = Controller(selector, settings, recorder=trace)
    ...
    trace.save("session.parquet")

Each decision is packed at once, so that no update waits for the work of others. With 12 candidates of two databases, an hour at 30
updates and 10 searches a second takes about 100 MB, and to save it half a minute and 1 GB. Of a session that continues and on, the
last `most` decisions stay.

A file has one row a decision, its columns as `contextdb.motion.trace.rows` says, and in its metadata the format's number and what
the databases' features and channels are. The same session gives the same bytes, if the timings are left out.
"""

from __future__ import annotations

import hashlib
import io
import json
import marshal
import zlib
from collections import deque
from collections.abc import Iterator, Mapping, Sequence
from itertools import islice
from os import PathLike
from typing import TYPE_CHECKING, overload

from contextdb.cells.arguments import require_kind, require_mapping, require_path, require_place, require_text
from contextdb.disk import read_bytes, write_atomic
from contextdb.errors import ArtefactError, Fault, MotionError, Place, in_quotes, plural
from contextdb.files.parquet_frame import MAGIC, UNSEALED, DamagedFrame, Frame, require_whole, sealed
from contextdb.motion.search.database import MotionDatabase
from contextdb.motion.selection.decision import Decision
from contextdb.motion.trace.filter_rows import fingerprint
from contextdb.motion.trace.rows import FILTERS, OPTIONAL, TIMINGS, Events, Row, columns, decision_of, events_in, row_of

if TYPE_CHECKING:
    import polars as pl

FORMAT = 1
FORMAT_KEY, ABOUT_KEY, DIGEST_KEY = "contextdb.trace", "about", "digest"
CHUNK = 512
"""So many decisions become Parquet at a time."""
MOST = 108_000
"""So many decisions stay unless another number is given: an hour at 30 a second."""

ACCEPTED = "a session recorded by contextdb.motion.Trace"
MEND = "to record the session again"


class Trace(Sequence[Decision]):
    """Decisions in order. A recorder for a `Controller`, and what a saved session is read into.

    Parameters
    ----------
    n_candidates : int
        How many candidates of each searched database are kept with a decision; 0 for none, which is much faster.
    databases : mapping of name to MotionDatabase, optional
        Those of the selector, so that the markup of candidates is recorded too, and what the features are.
    most : int
        How many recorded decisions stay; older ones are forgotten.

    Attributes
    ----------
    n_forgotten : int
        How many decisions came before the first that is kept.
    about : mapping
        For the name of each database `rate`, `features`, `channels`, and the `digest` of what costs come from.
    """

    def __init__(self, n_candidates: int = 12, databases: Mapping[str, MotionDatabase] | None = None, *, most: int = MOST) -> None:
        for what, number, least in (("n_candidates", n_candidates, 0), ("most", most, 1)):
            if isinstance(number, bool) or not isinstance(number, int) or number < least:
                raise MotionError(Fault(f"{what} is {number!r}.", f"a whole number, {least} or more"))
        for name, each in require_mapping(
            {} if databases is None else databases, "databases", "a mapping of names to databases"
        ).items():
            require_text(name, "one of databases")
            require_kind(each, MotionDatabase, "one of databases", "a MotionDatabase")
        self.n_candidates, self.most, self.n_forgotten = n_candidates, most, 0
        self.about: Mapping[str, Mapping[str, object]] = {name: _about(each) for name, each in (databases or {}).items()}
        self._databases = dict(databases or {})
        self._loaded: pl.DataFrame | None = None
        self._rows: deque[bytes] = deque(maxlen=most)
        self._events: Events = {}
        self._file = ""

    def record(self, decision: Decision) -> None:
        """Keep a decision; raises ContextError for what is none."""
        require_kind(decision, Decision, "decision", "a Decision")
        packed = _packed(row_of(decision, self._events_of))
        self.n_forgotten += len(self._rows) == self.most
        self._rows.append(packed)

    def __len__(self) -> int:
        return self._n_loaded + len(self._rows)

    @overload
    def __getitem__(self, index: int) -> Decision: ...
    @overload
    def __getitem__(self, index: slice) -> list[Decision]: ...
    def __getitem__(self, index: int | slice) -> Decision | list[Decision]:
        if isinstance(index, slice):
            return [self._decision(i) for i in range(*index.indices(len(self)))]
        return self._decision(self._place(index))

    def __iter__(self) -> Iterator[Decision]:
        return (self._decision_of(row, place) for place, row in enumerate(self._every_row()))

    def brief(self) -> Iterator[Decision]:
        """The decisions in order without their queries and candidates: much faster than with them."""
        for place, row in enumerate(self._every_row("query", "candidates", FILTERS)):
            yield self._decision_of({**row, "query": None, "candidates": [], FILTERS: []}, place)

    def events(self, index: int) -> Events:
        """What the markup says of the frames that a decision mentions, by (database, frame), as far as it says anything."""
        return events_in(self._row(self._place(index)))

    def save(self, path: str | PathLike[str], *, timings: bool = True) -> None:
        """Write the session to a Parquet file, in one step.

        Parameters
        ----------
        timings : bool
            Whether to write how long searches took, which no two sessions have alike.

        Raises
        ------
        FileError
            The disk refuses; the old file is then whole.
        """
        write_atomic(require_path(path), self.to_bytes(timings=timings))

    def to_bytes(self, *, timings: bool = True) -> bytes:
        """The bytes of the file that `save` writes."""
        import polars as pl

        frames = [] if self._loaded is None else [self._loaded]
        rows = map(_unpacked, self._rows)
        while len(part := _frame(list(islice(rows, CHUNK)))) or not frames:
            frames.append(part)
        whole = pl.concat(frames)
        frame, about = whole if timings else whole.drop(TIMINGS), json.dumps(self.about)
        out = io.BytesIO()
        frame.write_parquet(out, metadata={FORMAT_KEY: str(FORMAT), ABOUT_KEY: about, **UNSEALED})
        return sealed(out.getvalue())

    @classmethod
    def load(cls, path: str | PathLike[str]) -> Trace:
        """Read a saved session.

        Raises
        ------
        ArtefactError
            The file is no session, cut off, damaged or of another version; with the reason. A row that holds no decision is told
            when it is asked for.
        FileError
            The file cannot be read.
        """
        return cls.from_bytes(read_bytes(require_path(path)), str(path))

    @classmethod
    def from_bytes(cls, raw: bytes, file: str = "") -> Trace:
        """Read the bytes of a saved session; `file` is its name in messages."""
        require_kind(raw, bytes, "raw", "the bytes of a saved session")
        trace = cls()
        trace._loaded, trace.about = _read(raw, file)
        trace._file = file
        return trace

    # ---- what is kept

    @property
    def _n_loaded(self) -> int:
        return 0 if self._loaded is None else len(self._loaded)

    def _every_row(self, *without: str) -> Iterator[Row]:
        """All rows in order; those of a file without some columns, which need not be read then."""
        if self._loaded is not None:
            yield from self._loaded.drop(without).iter_rows(named=True)
        yield from map(_unpacked, self._rows)

    def _events_of(self, database: str, frame: int) -> tuple[str, ...]:
        told = self._events.get((database, frame))
        if told is None:
            known = self._databases.get(database)
            told = () if known is None or not 0 <= frame < known.n_frames else known.marks.events(frame)
            self._events[database, frame] = told
        return told

    def _place(self, index: int) -> int:
        return require_place(index, len(self), "decision")

    def _decision(self, place: int) -> Decision:
        return self._decision_of(self._row(place), place)

    def _decision_of(self, row: Row, place: int) -> Decision:
        try:
            return decision_of(row)
        except (ValueError, TypeError, KeyError, AttributeError, RecursionError) as error:
            raise _refused(f"row {place} holds no decision ({type(error).__name__}).", self._file) from error

    def _row(self, place: int) -> Row:
        if self._loaded is not None and place < self._n_loaded:
            return self._loaded.row(place, named=True)
        return _unpacked(self._rows[place - self._n_loaded])


def _about(database: MotionDatabase) -> dict[str, object]:
    rate = None if database.schema is None else database.schema.rate
    names = {"features": list(database.feature_names), "channels": list(database.channel_names)}
    return {"rate": rate, **names, "digest": fingerprint(database)}


def _packed(row: Row) -> bytes:
    """A row in little memory; these bytes never leave the process."""
    return zlib.compress(marshal.dumps(row), 1)


def _unpacked(packed: bytes) -> Row:
    row: Row = marshal.loads(zlib.decompress(packed))
    return row


# ---- rows as Parquet


def _frame(rows: list[Row]) -> pl.DataFrame:
    import polars as pl

    return pl.DataFrame(rows, schema=columns())


def _old_digest(raw: bytes, frame: Frame) -> str:
    """What the sessions of versions without a seal hold: the digest of the columns and of what the databases' features are."""
    return hashlib.blake2b(raw[: frame.start] + frame.metadata[ABOUT_KEY].encode(), digest_size=16).hexdigest()


def _read(raw: bytes, file: str) -> tuple[pl.DataFrame, Mapping[str, Mapping[str, object]]]:
    """The rows of a file and what it says of databases, checked."""
    import polars as pl

    why = _no_parquet(raw)
    if why:
        raise _refused(why, file)
    try:
        parquet = require_whole(raw)
        metadata = parquet.metadata
        _check_format(metadata, file)
        if metadata.get(DIGEST_KEY, expected := _old_digest(raw, parquet)) != expected:
            raise _refused("the file was altered after it was saved.", file)
        about = {name: dict(part) for name, part in json.loads(metadata[ABOUT_KEY]).items()}
        frame = pl.read_parquet(io.BytesIO(raw))
    except ArtefactError:
        raise
    except DamagedFrame as error:
        raise _refused(f"the file is damaged: {error}.", file) from None
    except (Exception, pl.exceptions.PanicException) as error:  # some damage makes polars stumble instead of complain
        raise _refused(f"the file is damaged ({type(error).__name__}).", file) from None
    _check_columns(frame, file)
    missing = [pl.lit(None, dtype).alias(name) for name, dtype in columns().items() if name not in frame.columns]
    return frame.with_columns(missing).select(list(columns())), about


def _no_parquet(raw: bytes) -> str:
    """What is wrong with the file's first and last bytes, if anything."""
    if not raw.startswith(MAGIC):
        return "this is not a Parquet file." if raw else "the file is empty."
    size = int.from_bytes(raw[-8:-4], "little")
    is_whole = len(raw) >= 12 and raw.endswith(MAGIC) and size <= len(raw) - 12
    return "" if is_whole else "the file is cut off: its end, where Parquet lists its columns, is missing."


def _check_format(metadata: Mapping[str, str], file: str) -> None:
    if FORMAT_KEY not in metadata:
        raise _refused("this Parquet file is not a recorded session.", file)
    if metadata[FORMAT_KEY] != str(FORMAT):
        found = f"the session has format {in_quotes(metadata[FORMAT_KEY])}; this version reads format {FORMAT}."
        raise _refused(found, file)


def _check_columns(frame: pl.DataFrame, file: str) -> None:
    wanted = columns()
    present = [name for name in wanted if name in frame.columns or name not in OPTIONAL]
    wrong = [name for name in present if frame.schema.get(name) != wanted[name]]
    if wrong:
        found = f"{plural(len(wrong), 'column')} of the session missing, or of another type: {', '.join(map(in_quotes, wrong))}."
        raise _refused(found, file)


def _refused(found: str, file: str) -> ArtefactError:
    return ArtefactError(Fault(found, ACCEPTED, MEND, Place(file or None), "bad-artefact"))
