"""Keep the newest good version of a folder of tables available while its files change. An edge: this looks at disk and clock.

The files are read when they have rested (`contextdb.tables.watching.rest`), so that half-written ones, rapid saves and editors that
delete or rename on their way are passed over. A version is swapped in by one assignment: whoever asks in another thread has the old
one or the new one. A version with a fault is not swapped in; its faults are reported once.

Equal stamps (`contextdb.tables.watching.rest`) are believed when the last change lies `COARSEST_TICK_S` back; until then the
bytes are read and their digests compared.
"""

from __future__ import annotations

import logging
import os
import sys
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path

from contextdb.cells.arguments import require_callable, require_number, require_path
from contextdb.cells.notebook import one_line
from contextdb.compiled.table import CompiledTable
from contextdb.errors import ContextDBError, Fault, FileError, Place, plural
from contextdb.schema.settings import Schema
from contextdb.tables.project import SCHEMA_FILE, ByName, Project, folder_of, table_files
from contextdb.tables.watching.rest import COARSEST_TICK_S, Digests, Rest, Stamps, digests_of, look, read_all
from contextdb.tables.watching.snapshot import Contents, Snapshot, next_snapshot, schema_from, shared_files

POLL_S = 0.25
SETTLE_S = 0.1
SHORTEST_WAIT_S = 0.005

OnChange = Callable[[Snapshot], object]
OnError = Callable[[ContextDBError], object]


def watch(
    path: str | Path,
    on_change: OnChange | None = None,
    on_error: OnError | None = None,
    poll_s: float | None = POLL_S,
    settle_s: float = SETTLE_S,
    clock: Callable[[], float] = time.monotonic,
) -> Watch:
    """Watch a folder of tables: a change to a table or to contextdb.toml swaps in the new version, compiled, between two queries.

    Parameters
    ----------
    path : str or Path
        A folder of tables, or its contextdb.toml.
    on_change : callable, optional
        Called with the new `Snapshot` after each swap; and with the present one, the same object, when files that had faults are
        again as they were when it was read.
    on_error : callable, optional
        Called with a ContextDBError that holds the new faults, each once, when the files on disk cannot be used; the last good
        version stays. Default: they are logged, to the logger "contextdb".
    poll_s : float or None, optional
        Seconds between two looks at the files, in a thread of the watch, which also makes the calls. None: no thread; call `poll`.
    settle_s : float, optional
        Seconds without a change before the files are read. A change is thus swapped in at most `poll_s + settle_s`,
        and the time that reading takes, after the last write. Where files are replaced without a pause, a version is taken about
        every second.
    clock : callable, optional
        Seconds from any start, never backwards.

    Raises
    ------
    ContextDBError
        The files cannot be used as they are now, with every fault: there is no good version to start from.
    """
    require_callable(on_change, "on_change")
    require_callable(on_error, "on_error")
    require_callable(clock, "clock")
    if poll_s is not None:
        require_number(poll_s, "poll_s")
    watch = Watch(folder_of(require_path(path)), on_change, on_error, require_number(settle_s, "settle_s"), clock)
    if poll_s is not None:
        watch._start(poll_s)
    return watch


class Watch(ByName[CompiledTable]):
    """The newest good version of a folder of tables. Get one from `contextdb.watch`; close it, or use it in a `with`."""

    def __init__(
        self, folder: Path, on_change: OnChange | None, on_error: OnError | None, settle_s: float, clock: Callable[[], float]
    ) -> None:
        self.folder = folder
        self._on_change, self._on_error, self._clock = on_change, on_error or _log, clock
        self._polling = threading.RLock()
        self._is_closed = threading.Event()
        self._thread: threading.Thread | None = None
        self._reported: tuple[Fault, ...] = ()
        self._read_s = clock()
        self._schema = schema_from(folder, read_all([folder / SCHEMA_FILE], folder), None)
        self._stamps: Stamps = {}
        self._stamps = look(self._paths())
        self._rest = Rest(self._stamps, self._read_s, settle_s)
        contents = read_all(self._stamps, folder, shared_files(self._schema))
        self._digests = self._tried = digests_of(contents)
        self._snapshot = next_snapshot(folder, self._schema, self._tables(self._schema), contents)

    @property
    def project(self) -> Project:
        """The tables of the newest good version."""
        return self._snapshot.project

    def snapshot(self) -> Snapshot:
        """The newest good version: all its tables belong together, whatever happens to the files meanwhile."""
        return self._snapshot

    def __getitem__(self, name: str) -> CompiledTable:
        """One compiled table of the newest good version; NoSuchTable names the nearest when there is none of that name."""
        return self._snapshot[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self._snapshot)

    def __len__(self) -> int:
        return len(self._snapshot)

    def __repr__(self) -> str:
        description = f"version {self._snapshot.number} of {plural(len(self), 'table')}"
        faults = f", {plural(len(self.faults), 'fault')}" if self.faults else ""
        return one_line("Watch", self.folder.name, description + faults + (", closed" if self._is_closed.is_set() else ""))

    @property
    def faults(self) -> tuple[Fault, ...]:
        """Why what is on the disk is not the version available; empty when nothing is wrong with it."""
        return self._reported

    def poll(self) -> bool:
        """Look at the files, and swap in what is on the disk when it is new, rested and good. Gives whether a new version was
        swapped in; `on_change` has then been called, in this thread, as it is where faults have ended without a swap."""
        with self._polling:
            now, stamps = self._clock(), look(self._paths())
            if not self._rest.is_due(stamps, now) or not self._may_be_new(stamps):
                return False
            contents = read_all(stamps, self.folder, shared_files(self._schema))
            if look(self._paths()) != stamps:
                return False  # written while it was read: the next look sees that it moved
            return self._is_new(stamps, digests_of(contents), now) and self._take(contents)

    def _start(self, poll_s: float) -> None:
        """Have a thread poll until the watch is closed. What a callback raises goes to `threading.excepthook`."""
        self._thread = threading.Thread(target=self._run, args=(poll_s,), name="contextdb.watch", daemon=True)
        self._thread.start()

    def close(self) -> None:
        """Stop looking. The last version stays available."""
        self._is_closed.set()
        if self._thread is not None and self._thread is not threading.current_thread():
            self._thread.join()

    def __enter__(self) -> Watch:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def _run(self, poll_s: float) -> None:
        wait_s = poll_s
        while not self._is_closed.wait(wait_s):
            try:
                self.poll()
            except Exception:
                threading.excepthook(threading.ExceptHookArgs([*sys.exc_info(), self._thread]))
            rest_s = self._rest.wait_s(self._clock())
            wait_s = poll_s if rest_s is None else min(poll_s, max(rest_s, SHORTEST_WAIT_S))

    def _paths(self) -> list[Path]:
        """The files that the newest contextdb.toml that could be read makes a project of."""
        try:
            tables = [path for _, path in self._tables(self._schema)]
        except FileError as error:  # links out of the folder: a version without them is never made, and `faults` says why
            tables = [*self._stamps, *(Path(fault.place.file) for fault in error.faults if fault.place.file)]
        return list(dict.fromkeys((self.folder / SCHEMA_FILE, *shared_files(self._schema), *tables)))

    def _tables(self, schema: Schema) -> list[tuple[str, Path]]:
        files: list[tuple[str, Path]] = []
        try:
            files.extend(table_files(self.folder, schema))
        except FileError:
            raise
        except OSError:  # the folder is gone: what was found until then is what contextdb.toml declares
            pass
        return files

    def _may_be_new(self, stamps: Stamps) -> bool:
        return stamps != self._stamps or self._read_s <= self._rest.moved_s + COARSEST_TICK_S

    def _is_new(self, stamps: Stamps, digests: Digests, now: float) -> bool:
        """Whether bytes that were just read are none that were tried before; not yet, where their stamps did not say so."""
        was_silent = stamps == self._stamps and digests != self._digests
        self._read_s, self._stamps, self._digests = now, stamps, digests
        if was_silent:
            self._rest.disturb(now)
        return digests != self._tried and not was_silent

    def _take(self, contents: Contents) -> bool:
        """Make a version of the files and swap it in, or tell what is wrong with it."""
        last = self._snapshot
        try:
            _require_folder(self.folder)
            schema = schema_from(self.folder, contents, last)
            tables = self._tables(schema)
            if not {path for _, path in tables}.union(shared_files(schema)) <= self._stamps.keys():
                self._schema = schema  # these files have to rest too
                return False
            self._tried, self._schema = self._digests, schema
            new = last if self._digests == last._digests else next_snapshot(self.folder, schema, tables, contents, last)
        except ContextDBError as error:
            self._tried = self._digests
            self._refuse(error)
            return False
        is_mended, self._reported = bool(self._reported), ()
        if new is not last:
            self._snapshot = new
            self._rest.taken(self._read_s)
        if self._on_change is not None and (new is not last or is_mended):
            self._on_change(new)
        return new is not last

    def _refuse(self, error: ContextDBError) -> None:
        fresh = [fault for fault in error.faults if fault not in self._reported]
        self._reported = error.faults
        if fresh:
            self._on_error(type(error)(*fresh))


def _require_folder(folder: Path) -> None:
    """Raise FileError for a folder that cannot be listed: its tables are not gone because nobody can see them."""
    place = folder_of(folder)
    try:
        os.listdir(place)
    except OSError as error:
        fault = Fault(f"the folder cannot be read: {error.strerror}.", place=Place(str(folder)))
        raise FileError(fault, errno=error.errno) from None


def _log(error: ContextDBError) -> None:
    logging.getLogger("contextdb").error("%s", error)
