"""A line that shows what is picked, and makes its list of what there is to pick from when that is opened."""

from __future__ import annotations

from collections.abc import Hashable
from typing import TypeVar

from rich.console import RenderableType
from textual.app import ComposeResult
from textual.content import Content
from textual.geometry import Size
from textual.widgets import Select
from textual.widgets._select import SelectCurrent, SelectOverlay
from textual.widgets.select import NoSelection

Value = TypeVar("Value", bound=Hashable)
FAINT = "$foreground 50%"


class Picked(SelectCurrent):
    """What is picked, in one line: the stock one is made of three widgets more."""

    def compose(self) -> ComposeResult:
        return iter(())

    def get_content_height(self, container: Size, viewport: Size, width: int) -> int:
        """One line, also where a style sheet gives every container the height of its parts."""
        return 1

    def update(self, label: RenderableType | NoSelection) -> None:
        self.label = label
        self.has_value = not isinstance(label, NoSelection)
        self.refresh()

    def render(self) -> Content:
        """The label, cut to the line, and an arrow."""
        is_label = not isinstance(self.label, NoSelection)
        text = self.label if is_label else self.placeholder
        content = text if isinstance(text, Content) else Content.from_markup(str(text))
        line = content.truncate(max(self.content_size.width - 2, 0), ellipsis=True, pad=True)
        return Content.assemble(line if self.has_value else line.stylize(FAINT), (" ▲" if self._is_expanded else " ▼", FAINT))

    @property
    def _is_expanded(self) -> bool:
        return isinstance(self.parent, Select) and self.parent.expanded


class Pick(Select[Value]):
    """A compact `Select` of two widgets, not six: its list is made when it is first opened, and of a form few are."""

    def compose(self) -> ComposeResult:
        yield Picked(self.prompt)

    @property
    def _has_list(self) -> bool:
        return bool(self.query(SelectOverlay))

    def _setup_options_renderables(self) -> None:
        if self._has_list:
            super()._setup_options_renderables()

    def _watch_value(self, value: Value | NoSelection) -> None:
        if self._has_list:
            super()._watch_value(value)
            return
        self._value = value
        for line in self.query(Picked):
            label = None if value == self.NULL else next(prompt for prompt, each in self._options if each == value)
            line.update(self.NULL if label is None else label)
            self.post_message(self.Changed(self, value))

    def _watch_prompt(self, prompt: str) -> None:
        if self._has_list:
            super()._watch_prompt(prompt)
        for line in self.query(Picked):
            line.placeholder = prompt
            line.refresh()

    def _watch_expanded(self, expanded: bool) -> None:
        if expanded and not self._has_list:
            overlay = SelectOverlay(type_to_search=self._type_to_search)
            overlay.compact = self.compact
            self.mount(overlay)
            self._setup_options_renderables()
        super()._watch_expanded(expanded)
        self.query_one(Picked).refresh()
