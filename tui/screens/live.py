"""The games that run and their characters, to follow one; F4 opens a recording."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path
from threading import Thread
from typing import ClassVar

from textual import on, work
from textual.app import ComposeResult
from textual.binding import Binding, BindingType
from textual.content import Content
from textual.widgets import Static

from contextdb.console import printable
from contextdb.errors import ContextDBError, plural
from contextdb.telemetry.link.doors import doors
from contextdb.telemetry.link.hearing import Wanted

from ..model.listening import Listening
from ..model.moments import Key, Session, Track, open_session
from ..widgets.line_list import LineList, ListCell, ListColumn
from .ask import AskDialog
from .dialog import Dialog
from .following import Followed

LOOK_EVERY_S, SHOW_EVERY_S = 1.0, 0.25
NO_GAME = (
    'No game is running. `contextdb play` starts one to try; yours is here once its code calls contextdb.link("game"). '
    "F4 opens a recording."
)


class LiveDialog(Dialog[Followed]):
    """Who asks this table."""

    BINDINGS: ClassVar[list[BindingType]] = [Binding("f4,ctrl+o", "open_file", "Open a recording")]
    DEFAULT_CSS = """
    LiveDialog {
        & > #dialog { width: 90%; min-width: 76; max-width: 110; padding: 0 1; }
        & #live-state { height: auto; max-height: 3; padding: 0 1; text-style: bold; }
        & #live-lines { height: auto; max-height: 50vh; margin: 1 0; }
    }
    """
    title_text = "Follow a game"
    keys_text = "Enter follow · F4 recording · Esc close"

    def __init__(self, table: str, folder: Path) -> None:
        super().__init__()
        self.table, self.folder = table, folder
        self._games: dict[str, Listening] = {}
        self._recording: Session | None = None
        self._problem = ""
        self._lines: list[tuple[Key, Listening | None]] = []
        self._looking: Thread | None = None
        self._is_closed = False

    def compose_body(self) -> ComposeResult:
        yield Static(id="live-state")
        columns = [ListColumn("Game", 12, 1), ListColumn("Character", 14, 2, is_name=True), ListColumn("Asked", 8, 0, True)]
        yield LineList([*columns, ListColumn("Plays", 14, 2, is_name=True)], empty="", id="live-lines")

    def on_mount(self) -> None:
        """Look for games, and show what they say as it comes."""
        self.query_one(LineList).focus()
        self._look()
        self.set_interval(LOOK_EVERY_S, self._look)
        self.set_interval(SHOW_EVERY_S, self.show)
        self.show()

    def on_unmount(self) -> None:
        self._is_closed = True
        for one in self._games.values():
            one.close()

    def _look(self) -> None:
        """Look for games that have come, in a thread: the folder they meet in may be slow."""
        if self._looking is None or not self._looking.is_alive():
            self._looking = Thread(target=self._find, daemon=True)
            self._looking.start()

    def _find(self) -> None:
        try:
            games = dict(doors())
        except (OSError, ContextDBError):
            games = {}
        for name, path in games.items():
            known = self._games.get(name)
            if (known is None or known.is_over) and not self._is_closed:
                self._games[name] = Listening(name, path, Wanted(tables=(self.table,)))
        for name in [name for name in self._games if name not in games]:
            self._games.pop(name).close()
        if self._is_closed:
            self.on_unmount()

    # ---- display

    def show(self) -> None:
        lines = self.query_one(LineList)
        chosen = self._lines[lines.index][0] if 0 <= lines.index < len(self._lines) else None
        before, self._lines = self._lines, list(self._characters())
        self.query_one("#live-state", Static).update(Content(self._state()))
        if [line[:2] for line in before] != [line[:2] for line in self._lines] or lines.n_lines != len(self._lines):
            at = next((at for at, line in enumerate(self._lines) if line[0] == chosen), 0)
            lines.show(len(self._lines), self._cells, at)
        lines.refresh()

    def _characters(self) -> Iterator[tuple[Key, Listening | None]]:
        if self._recording is not None:
            yield from ((key, None) for key in self._recording.tracks if key[1] == self.table)
        for _, game in sorted(self._games.copy().items()):
            keys = [key for key in game.tracks.copy() if key[1] == self.table]
            yield from ((key, game) for key in sorted(keys, key=lambda key: key[0] or ""))

    def _cells(self, at: int) -> Sequence[ListCell]:
        key, game = self._lines[at]
        track: Track | None = game.tracks.get(key) if game is not None else None
        if game is None and self._recording is not None:
            track = self._recording.tracks[key]
        moment = track.moment(track.stop - 1) if track is not None else None
        asset = moment.pick[1] if moment is not None and moment.pick is not None else None
        name = game.game if game is not None else self._recording.path.name if self._recording is not None else ""
        character: ListCell = printable(key[0]) if key[0] is not None else ("not named", "muted")
        return [printable(name), character, f"{track.stop:,}" if track is not None else "", printable(asset or "–")]

    def _state(self) -> str:
        if self._problem:
            return f"✗ {printable(self._problem)}"
        games = self._games.copy().values()
        if not games and self._recording is None:
            return NO_GAME
        silent = [game for game in games if not any(key[1] == self.table for key in game.tracks.copy())]
        parts = [f"{plural(len(self._lines), 'character')} of {self.table}"]
        for game in silent:
            why = f"does not have {self.table}" if game.state == "on" and self.table not in game.tables else game.trouble
            parts.append(f"{printable(game.game)}: {why or 'has made no query yet'}")
        left_out = sum(game.n_left_out for game in games)
        return " · ".join([*parts, *(["some characters are left out: there are too many"] if left_out else [])])

    # ---- what is done

    @on(LineList.Chosen)
    def _chosen(self, event: LineList.Chosen) -> None:
        event.stop()
        if not 0 <= event.index < len(self._lines):
            return
        key, game = self._lines[event.index]
        if game is None:
            self.dismiss(Followed(key, recording=self._recording))
            return
        wanted = Wanted((key[0],) if key[0] is not None else (), (self.table,))
        self.dismiss(Followed(key, Listening(game.game, game.path, wanted)))

    def action_open_file(self) -> None:
        def named(text: str) -> None:
            if text.strip():
                self._open(self.folder / Path(text.strip()).expanduser())

        dialog = AskDialog("Open a recording", "A file of `contextdb live --record` (.jsonl)", "", lambda _: "")
        dialog.ask(self.app, named)

    @work(thread=True, exclusive=True)
    def _open(self, path: Path) -> None:
        """Read a recording; a long one takes a while."""
        problem, session = "", None
        try:
            session = open_session(path)
            if not any(key[1] == self.table for key in session.tracks):
                problem, session = f"{path.name}: it has no question to {self.table}.", None
        except ContextDBError as error:
            problem = f"{path.name}: {error.faults[0].found}"
        self.app.call_from_thread(self._opened, session, problem)

    def _opened(self, session: Session | None, problem: str) -> None:
        self._recording, self._problem = session or self._recording, problem
        if not self._is_closed:
            self.show()
