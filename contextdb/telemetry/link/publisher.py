"""The thread of a link: it takes connections, and makes lines of what the game told, for those that listen.

While nobody listens it sleeps in the system, and the taps are closed. It works in short pieces with rests between them, since all
of Python waits while it works: no frame of the game waits long for it.
"""

from __future__ import annotations

import os
import selectors
import socket
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import suppress

from contextdb.console import __version__
from contextdb.telemetry.link.doors import Door, is_same_user
from contextdb.telemetry.link.lines import END, FORMAT, HEADER, TABLES, dumped
from contextdb.telemetry.link.listeners import FileListener, Listener, SocketListener
from contextdb.telemetry.link.ring import Entry, Moment, Moments, Ring, newest
from contextdb.telemetry.link.taps import Tap, Taps

PIECE_S = 0.0003
"""So long it works before it rests."""
REST_S = 0.0005
MOST_WELCOMES = 32
"""Between two ticks; who connects then waits for the next."""
MOST_LISTENERS = 16
"""Who connects when there are so many is sent away."""


class Pace:
    """Rests when it has worked for a while."""

    def __init__(self) -> None:
        self._began_s = time.perf_counter()

    def __call__(self) -> None:
        """Rest, if it is time to."""
        if time.perf_counter() - self._began_s > PIECE_S:
            time.sleep(REST_S)
            self._began_s = time.perf_counter()


class Publisher:
    """Sends lines to those that listen. `lock` is held while taps are changed."""

    def __init__(self, door: Door, taps: Taps, ring: Ring, file: FileListener | None, every_s: float) -> None:
        self.door, self.taps, self.ring, self.file = door, taps, ring, file
        self.lock = threading.RLock()
        self.began_s = time.monotonic()
        self._began_unix_s = time.time()
        self._every_s = every_s
        self._listeners: list[SocketListener] = []
        self._is_closing = False
        self._pid = os.getpid()
        self._pace = Pace()
        self._moments = Moments()
        self._n_welcomes = 0
        self.is_heard = False
        """Whether somebody listens, or a file takes the lines, and all taps are open."""
        self._told = taps.sources()
        self._ears, self._mouth = socket.socketpair()
        self._ears.setblocking(False)
        self._selector = selectors.DefaultSelector()
        self._selector.register(door.server, selectors.EVENT_READ)
        self._selector.register(self._ears, selectors.EVENT_READ)
        if file is not None:
            file.offer(self._header())
            ring.keeps_all = True
            self._open_taps()
        self._thread = threading.Thread(target=self._run, name="contextdb.link", daemon=True)
        self._thread.start()

    def close(self) -> None:
        """Send what is there, hang up, and close the taps."""
        self._is_closing = True
        with suppress(OSError):
            self._mouth.send(b"\0")
        if self._thread is not threading.current_thread():
            self._thread.join()

    def drop(self) -> None:
        """In a process that was forked off: let go what is the game's, which goes on without it."""
        self.lock = threading.RLock()
        self._close_taps()
        self._selector.close()
        for each in (self.door.server, self._ears, self._mouth, *(one.connection for one in self._listeners)):
            each.close()
        self._listeners, self.file = [], None

    def _run(self) -> None:
        try:
            next_s = time.monotonic()
            while not self._is_closing:
                is_idle = not (self.taps.are_open or self._listeners or self._n_welcomes)
                self._serve(None if is_idle else max(0.0, next_s - time.monotonic()))
                if time.monotonic() >= next_s:
                    next_s = time.monotonic() + self._every_s
                    self._welcome_again()
                    self._tick()
            self._tick()
        except Exception:
            threading.excepthook(threading.ExceptHookArgs([*sys.exc_info(), self._thread]))
        finally:
            self._hang_up()

    def _hang_up(self) -> None:
        self._close_taps()
        end = dumped({"line": END})
        for listener in self._listeners:
            listener.offer(end)
            listener.send()
            listener.close()
        if self.file is not None:
            self.file.offer(end)
            self.file.close()
        self._selector.close()
        self.door.close()
        self._ears.close()
        self._mouth.close()

    # ---- who listens

    def _serve(self, timeout_s: float | None) -> None:
        """Wait for connections and what listeners send, and take them."""
        for key, _ in self._selector.select(timeout_s):
            if key.fileobj is self.door.server:
                self._welcome()
            elif key.fileobj is self._ears:
                with suppress(BlockingIOError):
                    self._ears.recv(64)
            else:
                listener: SocketListener = key.data
                listener.read()
                listener.send()
            self._pace()
        self._send_away()

    def _welcome(self) -> None:
        """Take a connection; a stranger's, and one too many, is closed."""
        self._n_welcomes += 1
        if self._n_welcomes == MOST_WELCOMES:
            self._selector.unregister(self.door.server)
        try:
            connection, _ = self.door.server.accept()
        except OSError:  # it has gone, or there are no numbers for files left
            time.sleep(REST_S)
            return
        try:
            is_welcome = len(self._listeners) < MOST_LISTENERS and is_same_user(connection)
        except OSError:
            is_welcome = False
        if not is_welcome:
            connection.close()
            return
        listener = SocketListener(connection, self.door.token, self._header)
        self._listeners.append(listener)
        self._selector.register(connection, selectors.EVENT_READ, listener)
        listener.send()

    def _welcome_again(self) -> None:
        """Take connections again where there were too many."""
        if self._n_welcomes >= MOST_WELCOMES:
            self._selector.register(self.door.server, selectors.EVENT_READ)
        self._n_welcomes = 0

    def _send_away(self) -> None:
        """Close the connections of those that are gone."""
        for listener in [one for one in self._listeners if one.is_gone]:
            self._listeners.remove(listener)
            self._selector.unregister(listener.connection)
            listener.close()

    # ---- what is sent

    def _tick(self) -> None:
        """Open or close the taps, and send what there is."""
        listeners: list[Listener] = [one for one in self._listeners if one.is_let_in]
        if self.file is not None:
            listeners.append(self.file)
        with self.lock:
            self.taps.sweep()
        if not listeners:
            self._close_taps()
            self.ring.forget(self._pace)
            return
        self.ring.keeps_all = any(one.wants_every for one in listeners)
        self.ring.keeps_filters = any(one.wants_trace for one in listeners)
        with self.lock:
            self.taps.follow()
        self._open_taps()
        self._tell_tables(listeners)
        self._publish(listeners)
        for listener in listeners:
            listener.send()  # type: ignore[attr-defined]
            self._pace()
        self._send_away()

    def _publish(self, listeners: list[Listener]) -> None:
        """Send the moments since the last time."""
        pieces = self.ring.pieces()
        while True:
            with self.lock:
                entries = next(pieces, None)
            if lost := self.ring.lost():
                for listener in listeners:
                    listener.lose(lost)
            if entries is None:
                return
            self._publish_piece(entries, listeners)
            self._pace()

    def _publish_piece(self, entries: list[Entry], listeners: list[Listener]) -> None:
        for moment, takers in self._shared_out(entries, listeners):
            takers = [one for one in takers if one.has_room or one.lose(1)]  # type: ignore[func-returns-value]
            if takers:
                self._offer(moment, takers)
                self._pace()

    def _shared_out(self, entries: list[Entry], listeners: list[Listener]) -> Iterator[tuple[Moment, list[Listener]]]:
        """Each moment with those that want it."""
        kept = newest(entries)
        new = set(map(id, kept))
        for moment in self._moments.of(entries if any(one.wants_every for one in listeners) else kept):
            is_new = id(moment.entry) in new
            takers = [one for one in listeners if (is_new or one.wants_every) and one.wants(moment)]
            if takers:
                yield moment, takers

    def _offer(self, moment: Moment, takers: list[Listener]) -> None:
        try:
            moment.time_s -= self.began_s
            for one in takers:
                if one.wants_trace:
                    one.offer_in_full(moment)
                else:
                    one.offer(moment.line())
        except Exception:  # facts that changed while they were read, or that no JSON can be made of
            for listener in takers:
                listener.lose(1)

    def _tell_tables(self, listeners: list[Listener]) -> None:
        """Tell of tables that are new, or of a new version."""
        with self.lock:
            sources = self.taps.sources()
        if sources != self._told:
            line = dumped({"line": TABLES, "tables": {name: one.told() for name, one in sources.items()}})
            self._told = sources
            for listener in listeners:
                listener.offer(line)

    def _header(self) -> bytes:
        with self.lock:
            tables = {name: source.told() for name, source in self.taps.sources().items()}
        head = {"line": HEADER, "format": FORMAT, "game": self.door.name, "pid": self._pid, "contextdb": __version__}
        return dumped({**head, "began": round(self._began_unix_s, 3), "tables": tables})

    # ---- the taps

    def _open_taps(self) -> None:
        if not self.taps.are_open:
            self.ring.forget(self._pace)
            with self.lock:
                self._told = self.taps.sources()  # as the headers of those that listen have it
                self.taps.are_open = True
            self._each(lambda tap: tap.open())
            self.is_heard = True

    def _close_taps(self) -> None:
        if self.taps.are_open:
            self.taps.are_open = False
            self._each(lambda tap: tap.close())
            self.is_heard = False

    def _each(self, do: Callable[[Tap], None]) -> None:
        """Open or close every tap; the game may put on another meanwhile."""
        with self.lock:
            taps = list(self.taps)
        for tap in taps:
            with self.lock:
                do(tap)
            self._pace()
