"""What a screen of the editor needs of the app around it."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Mapping
from functools import partial

from textual.dom import DOMNode

from .editor_settings import EditorSettings
from .messages import GoToCell
from .model.importing import Import
from .one_key import OneKeyAtATime
from .widgets.cell_editor import open_beside

OVER_A_CELL = frozenset(("app.command_palette", "help"))
"""Actions that only lay something over the screen: the cell that is edited below stays open."""


class Editor(OneKeyAtATime):
    """The app around a screen; `tui.app.EditorApp` is the one there is."""

    settings: EditorSettings

    async def _check_bindings(self, key: str, priority: bool = False) -> bool:
        """Run what a key is bound to. Hints name keys by capitals: with Shift or Caps Lock a letter means the same, unless the
        capital is bound to something else."""
        is_bound = await super()._check_bindings(key, priority)
        is_capital = len(key) == 1 and key.isupper()
        return is_bound or (is_capital and await super()._check_bindings(key.lower(), priority))

    async def run_action(
        self,
        action: str | tuple[str, str, tuple[object, ...]],
        default_namespace: DOMNode | None = None,
        namespaces: Mapping[str, DOMNode] | None = None,
    ) -> bool:
        """Run an action of a key, the palette, a bar or a menu. One of something else than the cell that is edited takes that cell
        first; it is not run where the cell cannot be taken."""
        run = partial(super().run_action, action, default_namespace, namespaces)
        editor = open_beside(self.screen if default_namespace is None else default_namespace)
        if editor is None or action in OVER_A_CELL:
            return await run()
        if editor.leave():
            editor.screen.call_later(run)  # once the screen has shown the cell, and said what was done
        return True

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
