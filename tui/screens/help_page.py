"""A page of help: sections of two columns, what one sees or presses and what it means."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import ClassVar

from rich.table import Table
from rich.text import Text
from textual.app import ComposeResult
from textual.binding import Binding, BindingType
from textual.containers import VerticalScroll
from textual.widgets import Static

from .dialog import Dialog

Lines = Sequence[tuple[str, str]]


class HelpPage(Dialog[None]):
    """A page that scrolls. Children say `sections`."""

    DEFAULT_CSS = """
    HelpPage VerticalScroll { height: 1fr; scrollbar-size-vertical: 1; }
    HelpPage Static { height: auto; margin: 0 0 1 0; }
    """
    BINDINGS: ClassVar[list[BindingType]] = [Binding("f1,q", "cancel", "Close", show=False)]
    title_text = "Help"
    keys_text = "↑↓ scroll · Esc close"
    widest: int | None = None
    """The left column is cut into lines of so many cells; None: it is not."""

    def __init__(self) -> None:
        super().__init__(classes="-wide")

    def sections(self) -> Iterator[tuple[str, Lines]]:
        """The titles, and the lines under each."""
        raise NotImplementedError

    def compose_body(self) -> ComposeResult:
        with VerticalScroll():
            for title, lines in self.sections():
                yield Static(self._section(title, lines))

    def on_mount(self) -> None:
        self.query_one(VerticalScroll).focus()

    def _section(self, title: str, lines: Lines) -> Table:
        heading = Text(title, style="bold underline")
        table = Table(title=heading, title_justify="left", box=None, show_header=False, pad_edge=False, padding=(0, 2, 0, 0))
        table.add_column(no_wrap=self.widest is None, min_width=22, max_width=self.widest)
        table.add_column()
        for left, right in lines:
            table.add_row(Text(left, style="bold"), Text(right))
        table.caption = ""
        return table
