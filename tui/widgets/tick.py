"""A switch that says without colour whether it is on."""

from __future__ import annotations

from textual.content import Content
from textual.widgets import Checkbox


class Tick(Checkbox):
    """A `Checkbox` with [x] or [ ] before its label; the stock one tells the two apart by colour alone."""

    DEFAULT_CSS = """
    Tick { border: none; padding: 0; height: 1; background: transparent; &:focus { border: none; text-style: underline; } }
    """

    def __init__(self, label: str, value: bool = False, id: str | None = None) -> None:  # noqa: A002 - Textual's name
        super().__init__(label, value, compact=True, id=id)

    @property
    def _button(self) -> Content:
        return Content("[x]" if self.value else "[ ]")
