"""A dialog that asks for a path: what is typed filters the names below it, and Tab completes it."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from textual import on
from textual.widgets import Input

from ..model.paths import common_start, completions, resolved
from ..widgets.line_list import LineList, ListColumn
from ..widgets.list_filter import ListFilter
from .dialog import Answer, Dialog


class PathDialog(Dialog[Answer]):
    """Children compose `path_entry` and `path_names`, and say which files are listed."""

    takes_first = True
    """Whether Enter takes the first name where no more than a folder is typed."""

    def __init__(self, folder: Path, suffixes: Sequence[str], classes: str | None = None) -> None:
        """`folder` is where paths start; files that end in other `suffixes` are not listed."""
        super().__init__(classes=classes)
        self.folder, self.suffixes = folder, suffixes
        self.names: list[str] = []
        self.is_chosen = False
        """Whether the list was moved in since the last letter: Enter then takes its line."""

    def path_entry(self, name: str, text: str = "") -> Input:
        """The line that the path is typed into."""
        return ListFilter(text, id=f"{name}-path", classes="path--entry", compact=True)

    def path_names(self, name: str, empty: str) -> LineList:
        """The list of what the path may go on to be; the keys stay in the entry."""
        columns = [ListColumn(f"In {self.folder.name or self.folder}", 20, 1)]
        names = LineList(columns, empty=empty, id=f"{name}-names")
        names.add_class("path--names")
        names.can_focus = False
        return names

    @property
    def entry(self) -> Input:
        return self.query_one(".path--entry", Input)

    @property
    def _listed(self) -> LineList:
        return self.query_one(".path--names", LineList)

    @property
    def chosen(self) -> str:
        """The name under the cursor of the list."""
        return self.names[self._listed.index]

    @on(Input.Changed, ".path--entry")
    def _typed(self, event: Input.Changed) -> None:
        self.show_names(event.value)

    def show_names(self, text: str) -> None:
        """List what a path may go on to be."""
        self.is_chosen = False
        self.names = completions(text, self.folder, self.suffixes)
        self._listed.show(len(self.names), lambda at: (self.names[at],))

    def action_move(self, down: int) -> None:
        self.is_chosen = True
        self._listed.action_move(down)

    def action_complete(self) -> None:
        """Write the chosen name, or as much of the path as is certain; elsewhere go to the next field."""
        text = self.entry.value
        completed = self.chosen if self.is_chosen and self.names else common_start(self.names, text)
        if self.entry.has_focus and completed != text:
            self.write(completed)
        else:
            self.focus_next()

    @on(LineList.Chosen, ".path--names")
    def _clicked(self, event: LineList.Chosen) -> None:
        self.take(self.names[event.index])

    @on(Input.Submitted, ".path--entry")
    def _submitted(self, event: Input.Submitted) -> None:
        text = event.value
        is_of_list = self.is_chosen or (self.takes_first and (not text.strip() or text.endswith("/")))
        self.take(self.chosen if self.names and is_of_list else text)

    def take(self, text: str) -> None:
        """Do what Enter does with a path."""

    def write(self, text: str) -> None:
        self.entry.value = text
        self.entry.cursor_position = len(text)

    def is_folder(self, text: str) -> bool:
        """Whether a path is a folder, which is then gone into."""
        try:
            is_folder = resolved(text, self.folder).is_dir()
        except (OSError, ValueError):
            is_folder = False
        if is_folder:
            self.write(text if text.endswith("/") else f"{text}/")
        return is_folder
