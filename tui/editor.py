"""What a screen of the editor needs of the app around it."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Mapping

from tui.editor_settings import EditorSettings
from tui.messages import GoToCell
from tui.model.importing import Import
from tui.one_key import OneKeyAtATime


class Editor(OneKeyAtATime):
    """The app around a screen; `tui.app.EditorApp` is the one there is."""

    settings: EditorSettings

    @abstractmethod
    def open_table(self, name: str) -> None:
        """Show a table of the workspace."""

    @abstractmethod
    def go_into(self, name: str, outer: str, facts: Mapping[str, str]) -> None:
        """Show the table that a row of the table `outer` refers to, with the facts of its test row."""

    @abstractmethod
    def go_back(self) -> bool:
        """Show the table that `go_into` came from; False where there is none."""

    @abstractmethod
    def say_renamed(self, text: str) -> None:
        """Say on the screen that is shown now that a condition was renamed, also after its next change."""

    @abstractmethod
    def go_to_cell(self, place: GoToCell) -> None:
        """Go to a cell of the table that was just opened, once it is seen."""

    @abstractmethod
    def begun_with(self, answer: Import) -> None:
        """Put the rows of another file into the table that was just made and opened."""
