"""The debugger by itself: an app with its one screen."""

from __future__ import annotations

from tui.debug.game import Live
from tui.debug.recording import Recording
from tui.debug.screen import DebugScreen, RowWanted, Start
from tui.debug.waiting import WaitingScreen
from tui.one_key import OneKeyAtATime
from tui.themes import DARK, THEMES


class DebugApp(OneKeyAtATime):
    """The debugger of a session."""

    TITLE = "contextdb"
    ENABLE_COMMAND_PALETTE = False

    def __init__(self, shown: Recording | Live, theme: str = "", *, measures: bool = True, start: Start | None = None) -> None:
        super().__init__()
        self._shown, self._start = shown, start
        self.wanted: RowWanted | None = None
        """The row for which the screen was left."""
        self._measures = measures
        for one in THEMES:
            self.register_theme(one)
        self.theme = theme or DARK

    def on_row_wanted(self, message: RowWanted) -> None:
        """Leave, so that the editor can show the row."""
        self.wanted = message
        self.exit()

    def on_mount(self) -> None:
        shown = self._shown
        if isinstance(shown, Recording):
            self.push_screen(DebugScreen(shown, measures=self._measures, start=self._start))
        elif shown.recording is None:
            self.push_screen(WaitingScreen(shown, self._begun, self.exit))
        else:
            self.push_screen(self._live_screen(shown))

    def _begun(self) -> None:
        """The game has decided something."""
        assert isinstance(self._shown, Live), "a recording is never waited for"
        self.switch_screen(self._live_screen(self._shown))

    def _live_screen(self, live: Live) -> DebugScreen:
        assert live.recording is not None, "was waited for"
        return DebugScreen(live.recording, measures=self._measures, live=live, start=self._start)
