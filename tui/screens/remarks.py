"""What a person should know of what was just done, each remark whole."""

from __future__ import annotations

from collections.abc import Sequence

from textual.app import ComposeResult
from textual.containers import VerticalScroll
from textual.content import Content
from textual.widgets import Static

from .dialog import Dialog


class RemarksDialog(Dialog[None]):
    """Remarks, to scroll through."""

    DEFAULT_CSS = """
    RemarksDialog {
        & #remarks { height: auto; max-height: 60vh; scrollbar-size-vertical: 1; }
        & #remarks Static { height: auto; margin: 0 1 1 0; }
    }
    """
    keys_text = "↑↓ PgUp PgDn read on · Esc close"

    def __init__(self, what: str, remarks: Sequence[str]) -> None:
        """`what` was done, as the name of its step."""
        super().__init__()
        self.title_text = what
        self.remarks = tuple(remarks)

    def compose_body(self) -> ComposeResult:
        with VerticalScroll(id="remarks"):
            for remark in self.remarks:
                yield Static(Content(f"· {remark}"))

    def on_mount(self) -> None:
        self.query_one("#remarks").focus()
