"""The thread of a link: it takes connections, and writes lines of what the game put into the feed, for those that listen.

While nobody listens it sleeps in the system, and the feed is closed. It works in short pieces with rests between them, since all
of Python waits while it works: no frame of the game waits long for it.
"""

from __future__ import annotations

import os
import selectors
import socket
import sys
import threading
import time
from collections.abc import Mapping, Sequence
from contextlib import suppress

from contextdb.console import __version__
from contextdb.telemetry.link.doors import Door, is_same_user
from contextdb.telemetry.link.feed import Decisions, Moment, Moments, Source
from contextdb.telemetry.link.lines import END, FORMAT, HEADER, TABLES, dumped
from contextdb.telemetry.link.listeners import FileListener, Listener, SocketListener
from contextdb.telemetry.link.watched import Watched

AT_ONCE = 128
"""Entries of the feed that are taken without a rest."""
PIECE_S = 0.0003
"""It works no longer before it rests."""
REST_S = 0.0005
WELCOME_REST_S = 0.001
"""After each connection: a thousand of them take little of the game's time."""
MOST_LISTENERS = 16
"""Who connects when there are this many is disconnected."""
CLOSE_S = 2.0
"""The game waits no longer for the last lines."""


class Writer:
    """Sends lines to those that listen. `lock` is held while it takes entries and while `watched` is changed."""

    decisions: Decisions | None = None
    """What makes plain data of decisions, once one is published."""

    def __init__(self, door: Door, watched: Watched, file: FileListener | None, every_s: float) -> None:
        self.door, self.watched, self.feed, self.file = door, watched, watched.feed, file
        self.lock = threading.RLock()
        self._every_s = every_s
        self._moments = Moments(time.monotonic())
        self._head = {"line": HEADER, "format": FORMAT, "game": door.name, "pid": os.getpid(), "contextdb": __version__}
        self._head["began"] = round(time.time(), 3)
        self._sources: Mapping[str, Source] = {}
        self._header = b""
        self._published: Mapping[str, Source] | None = None
        """The tables that those who listen know of."""
        self._listeners: list[SocketListener] = []
        self._is_closing = False
        self._rested_s = 0.0
        self._waking, self._wake = socket.socketpair()
        self._waking.setblocking(False)
        self._selector = selectors.DefaultSelector()
        self._selector.register(door.server, selectors.EVENT_READ)
        self._selector.register(self._waking, selectors.EVENT_READ)
        if file is not None:
            file.offer(self.header())
            self._published = self._sources
            self.feed.is_open = True
        self._thread = threading.Thread(target=self._run, name="contextdb.link", daemon=True)
        self._thread.start()

    def close(self) -> None:
        """Send what is there and hang up; wait for it, but not long."""
        self.feed.is_open = False
        self._is_closing = True
        with suppress(OSError):
            self._wake.send(b"\0")
        if self._thread is not threading.current_thread():
            self._thread.join(CLOSE_S)

    def drop(self) -> None:
        """In a process that was forked off: let go what is the game's, which goes on without it."""
        self.lock = threading.RLock()
        self.feed.is_open = False
        self._selector.close()
        for each in (self.door.server, self._waking, self._wake, *(one.connection for one in self._listeners)):
            each.close()
        self._listeners, self.file = [], None

    def _run(self) -> None:
        try:
            next_s = time.monotonic()
            while not self._is_closing:
                is_idle = not (self._listeners or self.feed.is_open)
                self._serve(None if is_idle else max(0.0, next_s - time.monotonic()))
                if time.monotonic() >= next_s:
                    next_s = time.monotonic() + self._every_s
                    self._tick()
            self._tick()
        except Exception:
            threading.excepthook(threading.ExceptHookArgs([*sys.exc_info(), self._thread]))
        finally:
            self._hang_up()

    def _hang_up(self) -> None:
        self.feed.is_open = False
        end = dumped({"line": END})
        for listener in self._listeners:
            listener.offer(end)
            listener.send()
            listener.close()
        if self.file is not None:
            self.file.offer(end)
            self.file.close()
        self._selector.close()
        self._waking.close()
        self._wake.close()
        self.door.close()

    def _rest(self) -> None:
        """Rest, if it is time to."""
        if time.perf_counter() - self._rested_s > PIECE_S:
            time.sleep(REST_S)
            self._rested_s = time.perf_counter()

    # ---- who listens

    def _serve(self, timeout_s: float | None) -> None:
        """Wait for connections and what listeners send, and take them."""
        for key, _ in self._selector.select(timeout_s):
            if key.fileobj is self.door.server:
                self._welcome()
            elif key.fileobj is self._waking:
                with suppress(BlockingIOError):
                    self._waking.recv(64)
            else:
                key.data.read()
                key.data.send()
            self._rest()
        self._send_away()

    def _welcome(self) -> None:
        """Take a connection; a stranger's, and one too many, is closed."""
        connection = None
        with suppress(OSError):  # it has gone, or there are no numbers for files left
            connection, _ = self.door.server.accept()
            if len(self._listeners) < MOST_LISTENERS and is_same_user(connection):
                listener = SocketListener(connection, self.door.token, self.header)
                self._selector.register(connection, selectors.EVENT_READ, listener)
                self._listeners.append(listener)
                self._published = self._published or self._sources
                listener.send()
                connection = None
        if connection is not None:
            connection.close()
        time.sleep(WELCOME_REST_S)

    def _send_away(self) -> None:
        """Close the connections of those that are gone."""
        for listener in [one for one in self._listeners if one.is_gone]:
            self._listeners.remove(listener)
            self._selector.unregister(listener.connection)
            listener.close()

    # ---- what is sent

    def _tick(self) -> None:
        """Open or close the feed, and send what there is."""
        listeners: list[Listener] = [one for one in self._listeners if one.is_let_in]
        if self.file is not None:
            listeners.append(self.file)
        self.feed.is_open = bool(listeners) and not self._is_closing
        self.feed.wants_filters = any(one.wants_trace for one in listeners)
        self.feed.wants_poses = any(one.wants_poses for one in listeners)
        if not listeners:
            self._published = None if not self._listeners else self._published
            self._moments.newest()
            for _ in self.feed.take(len(self.feed.entries)):
                self._rest()
            self.feed.dropped()
        else:
            self._publish_tables(listeners)
            self._publish(listeners)
        for one in (*listeners, *(one for one in self._listeners if not one.is_let_in)):
            one.send()
            self._rest()
        self._send_away()

    def _publish(self, listeners: Sequence[Listener]) -> None:
        """Send the moments since the last tick: all to who wants them, the newest to the others."""
        every = [one for one in listeners if one.wants_every]
        for _ in range(len(self.feed.entries) // AT_ONCE + 1):
            with self.lock:
                moments = self._moments.of(self.feed.take(AT_ONCE))
            for moment in moments:
                self._offer(moment, every)
                self._rest()
        others = [one for one in listeners if not one.wants_every]
        for moment in self._moments.newest():
            self._offer(moment, others)
            self._rest()
        n_dropped = self.feed.dropped()
        for one in every:
            one.n_lost += n_dropped

    def _offer(self, moment: Moment, listeners: Sequence[Listener]) -> None:
        for one in listeners:
            try:
                if one.wants(moment):
                    one.take(moment, self.decisions)
            except Exception:  # facts that changed while they were read, or that no JSON can be made of
                one.n_lost += 1

    def _publish_tables(self, listeners: Sequence[Listener]) -> None:
        """Tell of tables that are new, or of a new version."""
        with self.lock:
            self.watched.follow()
        self.header()
        if self._sources is not self._published:
            self._published = self._sources
            line = dumped({"line": TABLES, "tables": {name: one.line() for name, one in self._sources.items()}})
            for listener in listeners:
                listener.offer(line)

    def header(self) -> bytes:
        """The first line, with the tables that are watched now."""
        with self.lock:
            sources = self.watched.sources()
        if sources != self._sources or not self._header:
            self._sources = sources
            self._header = dumped({**self._head, "tables": {name: one.line() for name, one in sources.items()}})
        return self._header
