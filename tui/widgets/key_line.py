"""The foot of the screen: which keys do what where the cursor is now. One widget, for it changes with every change of the focus."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any, ClassVar

from rich.cells import cell_len
from rich.segment import Segment
from textual import events
from textual.screen import Screen
from textual.strip import Strip
from textual.widget import Widget

from ..commands import key_name


@dataclass(frozen=True, slots=True)
class Key:
    """One key, and what it does."""

    key: str
    """As Textual names it."""
    name: str
    label: str

    @property
    def width(self) -> int:
        """How many cells it takes, the two between it and the next with it."""
        return cell_len(self.name) + cell_len(self.label) + 3


class KeyLine(Widget):
    """The keys that are bound now and meant to be displayed, those of the focus first. What does not fit is left out whole."""

    ALLOW_SELECT = False
    COMPONENT_CLASSES: ClassVar[set[str]] = {"key-line--key", "key-line--label"}

    DEFAULT_CSS = """
    KeyLine {
        dock: bottom; height: 1; background: $panel;
        .key-line--key { color: $text-primary; text-style: bold; }
        .key-line--label { color: $foreground 75%; }
    }
    """

    def __init__(self) -> None:
        super().__init__()
        self._keys: tuple[Key, ...] = ()
        self._left_out: tuple[str, ...] = ()
        self._is_due = False

    def leave_out(self, actions: tuple[str, ...]) -> None:
        """Leave out the keys of these actions, which stand elsewhere on the screen."""
        if actions != self._left_out:
            self._left_out = actions
            self._changed(self.screen)

    def on_mount(self) -> None:
        self.screen.bindings_updated_signal.subscribe(self, self._changed)

    def _changed(self, screen: Screen[Any]) -> None:
        """Look which keys are bound, once for all that change them in one go."""
        if not self._is_due:
            self._is_due = True
            self.call_later(self._show, screen)

    def _show(self, screen: Screen[Any]) -> None:
        self._is_due = False
        keys = tuple(self._bound()) if screen is self.screen else self._keys
        if keys != self._keys:
            self._keys = keys
            self.refresh()

    def _bound(self) -> Iterator[Key]:
        seen = set()
        for active in self.screen.active_bindings.values():
            binding = active.binding
            if binding.show and active.enabled and binding.action not in seen and binding.action not in self._left_out:
                seen.add(binding.action)
                yield Key(binding.key, key_name(binding.key).replace("Ctrl+", "^"), binding.description)

    def _fitting(self) -> Iterator[tuple[int, Key]]:
        x = 1
        for key in self._keys:
            if x + key.width - 2 > self.size.width:
                return
            yield x, key
            x += key.width

    def render_line(self, y: int) -> Strip:
        key_style, label_style = (self.get_component_rich_style(f"key-line--{part}") for part in ("key", "label"))
        segments = [Segment(" ", label_style)]
        for _, key in self._fitting():
            segments += [Segment(key.name, key_style), Segment(f" {key.label}  ", label_style)]
        return Strip(segments).adjust_cell_length(self.size.width, label_style)

    def on_click(self, event: events.Click) -> None:
        for x, key in self._fitting():
            if x <= event.x < x + key.width - 2:
                self.app.simulate_key(key.key)
