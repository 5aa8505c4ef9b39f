"""The test row of a screen that follows a game, or plays a recording: one moment after the other, paused, a step back, saved."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from threading import Thread
from typing import Any, Protocol

from textual.app import App
from textual.timer import Timer

from contextdb.console import printable
from contextdb.errors import ContextDBError, plural
from contextdb.tables.table import Table

from ..model.context_list import ContextList
from ..model.game_answer import GameAnswer, played_row
from ..model.listening import Listening
from ..model.moments import Key, Moment, RecordedTrack, Session, Track
from ..model.session import Session as TableSession
from ..model.table_answer import Offered
from ..widgets.bar import Item
from ..widgets.live_line import LiveState
from .context_forms import KeepDialog, SavedCase

RATE = 10
"""So many moments a second are displayed at most, the newest: nobody reads a table faster. All of them can be stepped through."""
ITEMS = (
    ("live-pause", "Pause ⇧F7"), ("previous-context", "◂ F7"), ("next-context", "F8 ▸"), ("live-back", "−1 s"),
    ("live-ahead", "+1 s"), ("live-keep", "Keep ⇧F8"), ("live", "Who Alt+U"), ("live-stop", "Stop"),
)  # fmt: skip


class Shows(Protocol):
    """What shows the table: the pane of assets."""

    def follow(self, facts: dict[str, str], actors: Offered, played: int | None, name: str) -> None:
        """Show a moment."""

    def show_live(self, state: LiveState | None, items: Sequence[Item] = ()) -> None:
        """Say how it stands with the game."""


class Follows(Protocol):
    """What following needs of the screen: `tui.screens.main.MainScreen`."""

    session: TableSession

    @property
    def app(self) -> App[Any]: ...

    @property
    def assets(self) -> Shows: ...

    def say(self, text: str, level: str = "information") -> None:
        """Say something in a line below."""

    def show_summary(self) -> None:
        """Say how much of the table is valid."""

    def set_interval(self, interval: float, callback: Callable[[], None]) -> Timer: ...


@dataclass(frozen=True)
class Followed:
    """What is followed: a character of a game that is listened to, or of a recording."""

    key: Key
    listening: Listening | None = None
    recording: Session | None = None

    @property
    def track(self) -> Track | None:
        """What the character queried; None where it has queried nothing yet."""
        if self.listening is not None:
            return self.listening.tracks.get(self.key)
        return self.recording.tracks.get(self.key) if self.recording is not None else None

    @property
    def name(self) -> str:
        """The game and the character."""
        game = self.listening.game if self.listening is not None else self.recording.path.name if self.recording else ""
        return printable(f"{game} · {self.key[0]}" if self.key[0] is not None else game)

    @property
    def version(self) -> object:
        """The version of the table in the game; None where it is not known."""
        tables = self.listening.tables if self.listening is not None else self.recording.tables if self.recording else {}
        return tables.get(self.key[1], {}).get("version")


class Following:
    """The game that a screen follows, if it follows one."""

    def __init__(self, screen: Follows, clock: Callable[[], float] = time.monotonic) -> None:
        self.screen, self.session = screen, screen.session
        self.followed: Followed | None = None
        self.is_paused = False
        self.at = -1
        """The moment that is displayed."""
        self.moment: Moment | None = None
        self._clock = clock
        self._began = (0.0, 0.0)
        """When a recording began to play, and at which of its seconds."""
        self._timer: Timer | None = None
        self._displayed: tuple[Table, Moment] | None = None
        self._texts: dict[str, str] | None = None
        """The facts that were displayed; others were typed since."""
        self.is_typed = False
        self._own_version = OwnVersion()

    # ---- begin and end

    def start(self, followed: Followed) -> None:
        self.stop()
        self.followed, self.is_paused, self.is_typed, self.at, self.moment = followed, False, False, -1, None
        self._begin_playing(0)
        self.session.sheet.ask(f"the game {followed.name}")  # what was typed before comes back with Ctrl+Z
        if self._timer is None:
            self._timer = self.screen.set_interval(1 / RATE, self.tick)
        self._timer.resume()
        self.tick()

    def stop(self) -> None:
        """Follow nothing any more; the facts stay."""
        if self.followed is not None:
            self.close()
            self.screen.assets.show_live(None)

    def close(self) -> None:
        if self.followed is not None and self.followed.listening is not None:
            self.followed.listening.close()
        self.followed, self.moment, self._displayed, self._texts = None, None, None, None
        if self._timer is not None:
            self._timer.pause()

    @property
    def followed_moments(self) -> tuple[str, Callable[[], list[Moment]]] | None:
        """What is followed, in words, and what reads its moments: the last minute of a game, a whole recording; None where nothing
        is followed."""
        track = self.followed.track if self.followed is not None else None
        if self.followed is None or track is None:
            return None
        what = "the recording" if isinstance(track, RecordedTrack) else "the last minute of"
        return f"{what} {self.followed.name}", lambda: track.moments

    # ---- moments

    def tick(self) -> None:
        """Show the moment that it is now, if it is another one than before."""
        followed = self.followed
        if followed is None:
            return
        if self._texts is not None and self.session.sheet.query.texts != self._texts:
            self.is_typed = self.is_paused = True
        if self.is_typed:
            self.screen.assets.show_live(LiveState("❚❚", followed.name, "", "held: facts were typed"), self._items())
            return
        track = followed.track
        if track is not None and not self.is_paused:
            self.at = self._now(track)
        if track is not None and track.stop and not track.first <= self.at < track.stop:
            self.at = track.first if self.at < track.first else track.stop - 1
        moment = track.moment(self.at) if track is not None else None
        if moment is not None:
            self.moment = moment
        if self.moment is not None:
            self._show(self.moment)
        self.screen.assets.show_live(self._live_state(), self._items())

    def pause(self, is_paused: bool | None = None) -> None:
        """Hold the moment that is displayed, or go on."""
        if self._require():
            self.is_paused = not self.is_paused if is_paused is None else is_paused
            self._forget_typed()
            if not self.is_paused:
                self._begin_playing(self.at)
            self.tick()

    def step(self, by: int) -> None:
        """Hold the next moment, or the one before."""
        track = self._track()
        if track is not None:
            self._hold(max(track.first, min(self.at + by, track.stop - 1)))

    def seconds(self, by: float) -> None:
        """Hold the moment that was so many seconds later."""
        track = self._track()
        if track is None:
            return
        wanted, at, way = track.time(self.at) + by, self.at, 1 if by > 0 else -1
        while track.first <= at + way < track.stop and (track.time(at + way) - wanted) * way <= 0:
            at += way
        self._hold(at if at != self.at else max(track.first, min(at + way, track.stop - 1)))

    def keep(self) -> None:
        """Hold the moment, and save it as a context."""
        if self._track() is None or self.moment is None:
            return
        self._hold(self.at)
        sheet = self.session.sheet
        contexts, facts, actors = ContextList.beside(sheet.table), dict(sheet.query.texts), bool(sheet.query.actors)

        def save(answer: SavedCase) -> None:
            try:
                contexts.keep(answer.name, facts, answer.expected, answer.note)
            except ContextDBError as error:
                self.screen.say(str(error), "error")
            else:
                self.screen.say(f"{answer.name} is saved. F9 shows the saved contexts.")

        KeepDialog(contexts, facts, has_actors=actors).ask(self.screen.app, save)

    def _hold(self, at: int) -> None:
        self.at, self.is_paused = at, True
        self._forget_typed()
        self.tick()

    def _forget_typed(self) -> None:
        self.is_typed, self._displayed, self._texts = False, None, None

    def _require(self) -> bool:
        if self.followed is None:
            self.screen.say("No game is followed. Alt+U shows the games that run.")
        return self.followed is not None

    def _track(self) -> Track | None:
        if not self._require() or self.followed is None:
            return None
        track = self.followed.track
        if track is None or not track.stop:
            self.screen.say("The game has made no query yet.")
            return None
        return track

    def _begin_playing(self, at: int) -> None:
        track = self.followed.track if self.followed is not None else None
        is_at_end = track is not None and at >= track.stop - 1
        self._began = self._clock(), track.time(0 if is_at_end else at) if track is not None else 0.0
        if is_at_end:
            self.at = 0

    def _now(self, track: Track) -> int:
        """The newest moment of a game; of a recording the one that its clock has come to."""
        if self.followed is not None and self.followed.recording is None:
            return track.stop - 1
        now, at = self._began[1] + self._clock() - self._began[0], max(self.at, 0)
        while at + 1 < track.stop and track.time(at + 1) <= now:
            at += 1
        return at

    def _show(self, moment: Moment) -> None:
        sheet, followed = self.session.sheet, self.followed
        if followed is None or (self._displayed is not None and self._displayed[0] is sheet.table and self._displayed[1] is moment):
            return
        is_first, self._displayed = self._displayed is None or self._displayed[1] is not moment, (sheet.table, moment)
        played = played_row(sheet.table, moment.pick)
        texts = moment.texts(sheet.query.wanted.given)
        if is_first or played != sheet.played:
            self._texts = texts
            self.screen.assets.follow(texts, moment.actors or {}, played, followed.name)
            self.screen.show_summary()

    # ---- messages

    def _live_state(self) -> LiveState:
        followed = self.followed
        assert followed is not None
        trouble = followed.listening.trouble if followed.listening is not None else ""
        is_over = followed.listening is not None and followed.listening.is_over
        sign = "❚❚" if self.is_paused else "■" if is_over else "▷" if followed.recording is not None else "●"
        track = followed.track
        if self.moment is None or track is None:
            return LiveState(sign, followed.name, "", trouble or "no query yet")
        answer = GameAnswer(self.moment, self.session.sheet.query, self.session.sheet.table, self._game_table)
        back = track.time(track.stop - 1) - self.moment.t
        when = f"{self.moment.t:.1f} s"
        if followed.recording is not None:
            when = f"{when} of {track.time(track.stop - 1):.1f}"
        elif self.is_paused and back > 0:
            when = f"{back:.1f} s ago"
        notes = [trouble, answer.differs, "" if self._is_own_version in (True, None) else "the game has another version"]
        if followed.listening is not None and followed.listening.n_lost:
            notes.append(f"{plural(followed.listening.n_lost, 'line')} lost")
        return LiveState(sign, followed.name, f"{when} · {answer.summary}", " · ".join(filter(None, notes)))

    def _items(self) -> list[Item]:
        return [Item(name, "Go on ⇧F7" if name == "live-pause" and self.is_paused else label) for name, label in ITEMS]

    @property
    def _is_own_version(self) -> bool | None:
        """Whether the game has the table as it is on the screen; None where that is not known."""
        theirs = self.followed.version if self.followed is not None else None
        own = self._own_version.of(self.session.sheet.table) if isinstance(theirs, str) else None
        return None if own is None else own == theirs

    @property
    def _game_table(self) -> Table:
        """The table that the game has: the one on the screen where that is so, else most likely the one on the disk."""
        return self.session.sheet.table if self._is_own_version else self.session.saved_table


class OwnVersion:
    """The version of the table on the screen, worked out in a thread."""

    def __init__(self) -> None:
        self._known: tuple[Table, str | None] | None = None
        self._thread: Thread | None = None

    def of(self, table: Table) -> str | None:
        """The version; None while it is not known, and where cells cannot be read."""
        known = self._known
        if known is not None and known[0] is table:
            return known[1]
        if self._thread is None or not self._thread.is_alive():
            self._thread = Thread(target=self._work, args=(table,), daemon=True)
            self._thread.start()
        return None

    def _work(self, table: Table) -> None:
        try:
            version: str | None = table.compile().version
        except ContextDBError:
            version = None
        self._known = table, version
