"""The Motion tab: the games that run and the recorded sessions of the project, to see why.

Enter opens the debugger on one; it is the screen of `contextdb motion debug`.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path
from typing import ClassVar

from textual import on, work
from textual.app import ComposeResult
from textual.binding import Binding, BindingType
from textual.message import Message
from textual.widgets import Static
from textual.worker import get_current_worker

from contextdb.console import printable
from contextdb.errors import ContextDBError, plural
from contextdb.telemetry.link.doors import doors

from ..debug.game import Live
from ..debug.opening import databases_of, measures_of, opened
from ..debug.recording import Figures, Recording
from ..messages import Notice
from ..model.sessions import sessions_of
from ..widgets.line_list import LineList, ListCell, ListColumn
from .pane import Pane

LOOK_EVERY_S = 1.0
NONE = 'No session is recorded here: "contextdb motion run" records one, and so does motion.Trace in your game.'


@dataclass
class DebugWanted(Message):
    """Show the debugger of a session, or of a game."""

    recording: Recording | Live


@dataclass(frozen=True)
class Entry:
    """A line: a running game by its door, or a session by its file; and what is known of it."""

    path: Path
    is_game: bool = False
    measures: tuple[float, Figures] | str | None = None
    """None while it is not known; a text where the file cannot be read."""


class SessionList(LineList):
    """The games and sessions."""

    BINDINGS: ClassVar[list[BindingType]] = [Binding("enter", "choose", "See why")]


class MotionPane(Pane):
    """What can be debugged."""

    BINDINGS: ClassVar[list[BindingType]] = [Binding("r", "look", "Look again")]
    DEFAULT_CSS = """
    MotionPane {
        layout: vertical; height: 1fr; background: $surface;
        & > #motion-summary { height: 1; padding: 0 2; text-style: bold; }
        & > LineList { height: 1fr; margin: 1 0 0 0; }
    }
    """

    def __init__(self, folder: Path, *, id: str | None = None) -> None:  # noqa: A002
        super().__init__(id=id)
        self.folder = folder
        self.entries: list[Entry] = []
        self._known: dict[tuple[Path, int], tuple[float, Figures] | str] = {}

    def compose(self) -> ComposeResult:
        yield Static(id="motion-summary", markup=False)
        columns = [ListColumn("Session", 18, 3, is_name=True), ListColumn("When", 12), ListColumn("Lasts", 9, 0, True)]
        columns += [ListColumn("Jumps/s", 8, 0, True), ListColumn("Forced", 7, 0, True)]
        yield SessionList([*columns, ListColumn("In a clip", 10, 0, True)], empty=NONE, id="sessions")

    def on_mount(self) -> None:
        self.set_interval(LOOK_EVERY_S, self._look_again)

    def _look_again(self) -> None:
        """Look for what came while the list is seen, unless somebody is still looking."""
        is_at_it = any(worker.node is self and worker.group == "look" and worker.is_running for worker in self.workers)
        if self.display and self.screen.is_current and not is_at_it:
            self.look()

    def show(self) -> None:
        self.look()

    def take_focus(self) -> None:
        self.query_one(SessionList).focus()

    def action_look(self) -> None:
        self.look()

    # ---- what there is

    @work(thread=True, exclusive=True, group="look")
    def look(self) -> None:
        """Look for what there is, then at each session for its measures."""
        worker = get_current_worker()
        try:
            games = [Entry(path, True) for _, path in doors()]
        except (OSError, ContextDBError):
            games = []
        entries = [*games, *(self._entry(path) for path in sessions_of(self.folder))]
        self.app.call_from_thread(self._take, list(entries))
        for at, entry in enumerate(entries):
            if worker.is_cancelled:
                return
            if not entry.is_game and entry.measures is None:
                entries[at] = Entry(entry.path, False, self._measured(entry.path))
                self.app.call_from_thread(self._take, list(entries))

    def _entry(self, path: Path) -> Entry:
        return Entry(path, False, self._known.get(_key(path)))

    def _measured(self, path: Path) -> tuple[float, Figures] | str:
        key = _key(path)
        try:
            self._known[key] = measures_of(path)
        except ContextDBError as error:
            self._known[key] = error.faults[0].found
        return self._known[key]

    def _take(self, entries: list[Entry]) -> None:
        sessions = self.query_one(SessionList)
        at = sessions.index
        here = self.entries[at].path if 0 <= at < len(self.entries) else None
        self.entries = entries
        n_games = sum(entry.is_game for entry in entries)
        running = f" · {plural(n_games, 'game')} running" if n_games else ""
        self.query_one("#motion-summary", Static).update(f"{plural(len(entries) - n_games, 'session')}{running}")
        sessions.show(len(entries), self._cells, next((i for i, each in enumerate(entries) if each.path == here), 0))
        sessions.refresh()

    def _cells(self, at: int) -> Sequence[ListCell]:
        entry = self.entries[at]
        if entry.is_game:
            return [(f"● {printable(entry.path.stem)}", "strong"), "now", "", "", "", ""]
        name = printable(entry.path.name)
        when = f"{datetime.fromtimestamp(_mtime(entry.path)):%d %b %H:%M}"
        if entry.measures is None or isinstance(entry.measures, str):
            return [name, when, "…" if entry.measures is None else ("damaged", "error"), "", "", ""]
        seconds, figures = entry.measures
        stay = "" if figures.stay_s is None else f"{figures.stay_s:.2f} s"
        return [name, when, f"{seconds:,.1f} s", f"{figures.jumps_per_s:.2f}", f"{figures.forced:,}", stay]

    # ---- what is done

    @on(LineList.Chosen)
    def _chosen(self, event: LineList.Chosen) -> None:
        event.stop()
        if 0 <= event.index < len(self.entries):
            self.post_message(Notice(f"Opening {printable(self.entries[event.index].path.name)} …"))
            self.open(self.entries[event.index])

    @work(thread=True, exclusive=True, group="open")
    def open(self, entry: Entry) -> None:
        """Open a session, or listen to a game; its databases may have to be built."""
        try:
            recording = self._live(entry.path) if entry.is_game else opened(entry.path, self.folder)
        except ContextDBError as error:
            self.post_message(Notice(str(error), "error"))
            return
        self.post_message(Notice(""))
        self.post_message(DebugWanted(recording))

    def _live(self, path: Path) -> Live:
        return Live(path.stem, path, None, str(self.folder), databases_of(self.folder))


def _key(path: Path) -> tuple[Path, int]:
    try:
        return path, path.stat().st_mtime_ns
    except OSError:
        return path, 0


def _mtime(path: Path) -> float:
    return _key(path)[1] / 1e9
