"""The debugger by itself: an app with its one screen."""

from __future__ import annotations

from tui.debug.recording import Recording
from tui.debug.screen import DebugScreen
from tui.one_key import OneKeyAtATime
from tui.themes import DARK, THEMES


class DebugApp(OneKeyAtATime):
    """The debugger of a session."""

    TITLE = "contextdb"
    ENABLE_COMMAND_PALETTE = False

    def __init__(self, recording: Recording, theme: str = "", *, measures: bool = True) -> None:
        super().__init__()
        self.recording = recording
        self._measures = measures
        for one in THEMES:
            self.register_theme(one)
        self.theme = theme or DARK

    def on_mount(self) -> None:
        self.push_screen(DebugScreen(self.recording, measures=self._measures))
