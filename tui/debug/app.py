"""The debugger by itself: an app with its one screen."""

from __future__ import annotations

from collections.abc import Sequence

from textual.filter import LineFilter

from ..contrast import READABLE
from ..one_key import OneKeyAtATime
from ..themes import DARK, THEMES
from .game import Live
from .recording import Recording
from .screen import DebugScreen, RowWanted, Start
from .waiting import WaitingScreen


class DebugApp(OneKeyAtATime):
    """The debugger of a session."""

    TITLE = "contextdb"
    ENABLE_COMMAND_PALETTE = False

    def __init__(self, recording: Recording | Live, theme: str = "", *, measures: bool = True, start: Start | None = None) -> None:
        super().__init__()
        self._recording, self._start = recording, start
        self.wanted: RowWanted | None = None
        """The row for which the screen was left."""
        self._measures = measures
        for one in THEMES:
            self.register_theme(one)
        self.theme = theme or DARK

    def get_line_filters(self) -> Sequence[LineFilter]:
        """What is read is readable in every theme."""
        return [*super().get_line_filters(), READABLE]

    def on_row_wanted(self, message: RowWanted) -> None:
        """Leave, so that the editor can show the row."""
        self.wanted = message
        self.exit()

    def on_mount(self) -> None:
        recording = self._recording
        if isinstance(recording, Recording):
            self.push_screen(DebugScreen(recording, measures=self._measures, start=self._start))
        elif recording.recording is None:
            self.push_screen(WaitingScreen(recording, self._begun, self.exit))
        else:
            self.push_screen(self._live_screen(recording))

    def _begun(self) -> None:
        """The game has decided something."""
        assert isinstance(self._recording, Live), "a recording is never waited for"
        self.switch_screen(self._live_screen(self._recording))

    def _live_screen(self, live: Live) -> DebugScreen:
        assert live.recording is not None, "was waited for"
        return DebugScreen(live.recording, measures=self._measures, live=live, start=self._start)
