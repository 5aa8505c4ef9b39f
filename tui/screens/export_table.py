"""Export the open table for another program: where to, and in which format.

Nothing is written here: the dialog gives back an `Export`, whose bytes are then written with `contextdb.disk.write_atomic`.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import ClassVar

from textual import on, work
from textual.app import ComposeResult
from textual.binding import Binding, BindingType
from textual.content import Content
from textual.widgets import Input, Select, Static
from textual.worker import get_current_worker

from contextdb.errors import ContextDBError, in_quotes
from contextdb.exchange.formats import FORMATS, format_of, write
from contextdb.tables.table import Table
from tui.model.importing import suffixes_written, why_not
from tui.model.paths import common_start, completions, resolved
from tui.screens.context_forms import SureDialog
from tui.screens.dialog import Dialog, buttons
from tui.widgets.field import Field
from tui.widgets.line_list import LineList, ListColumn
from tui.widgets.pick import Pick

BY_SUFFIX = "as the file is named"


@dataclass(frozen=True)
class Export:
    """What the dialog gives back: the bytes of a file, where they go, and what could not be kept."""

    path: Path
    raw: bytes
    notes: tuple[str, ...] = ()


class ExportDialog(Dialog[Export]):
    """Export the open table."""

    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("tab", "complete", "Complete", show=False, priority=True),
        Binding("f6,ctrl+j", "export", "Export"),
        Binding("down", "move(1)", "Down", show=False),
        Binding("up", "move(-1)", "Up", show=False),
    ]
    DEFAULT_CSS = """
    ExportDialog {
        & Field:focus-within { height: auto; }
        & LineList { height: auto; max-height: 8; margin: 1 0 0 0; }
        & #export-told { height: auto; margin: 1 0 0 0; }
        & #export-buttons { height: 1; margin: 1 0 0 0; }
    }
    """
    keys_text = "Enter export · Tab complete · ↑↓ choose · Esc cancel"

    def __init__(self, table: Table, folder: Path) -> None:
        """`folder` is where paths start."""
        super().__init__()
        self.title_text = f"Export {table.name}"
        self.table = table
        self.folder = folder
        self.names: list[str] = []
        self.is_chosen = False

    def compose_body(self) -> ComposeResult:
        """The path, the format, and what lies in the folder."""
        entry = Input(f"{self.table.name}.xlsx", id="export-path", compact=True)
        yield Field("File", entry, f"Ends in {', '.join(suffixes_written())}.", key="path")
        formats = [(BY_SUFFIX, ""), *((one.about.split(";")[0], one.name) for one in FORMATS.values() if one.is_written)]
        yield Field("Format", Pick(formats, value="", allow_blank=False, compact=True, id="export-format"), key="format")
        yield LineList(
            [ListColumn(f"In {self.folder.name or self.folder}", 20, 1)], empty="No file of this name yet.", id="export-names"
        )
        yield Static("", id="export-told")
        yield Static(buttons([("export", "Export"), ("cancel", "Cancel")]), id="export-buttons")

    def on_mount(self) -> None:
        """Begin with the path, its stem chosen, so that typing gives another name."""
        self.query_one("#export-names", LineList).can_focus = False
        entry = self.query_one("#export-path", Input)
        entry.focus()
        self._show_names(entry.value)

    @on(Input.Changed, "#export-path")
    def _typed(self, event: Input.Changed) -> None:
        self._show_names(event.value)

    def _show_names(self, text: str) -> None:
        self.is_chosen = False
        self.names = completions(text, self.folder, suffixes_written())
        self.query_one("#export-names", LineList).show(len(self.names), lambda at: (self.names[at],))
        self._say()

    def action_move(self, down: int) -> None:
        """Move in the list of names."""
        self.is_chosen = True
        self.query_one("#export-names", LineList).action_move(down)

    def action_complete(self) -> None:
        """Write as much of the path as is certain; elsewhere go to the next field."""
        entry, names = self.query_one("#export-path", Input), self.query_one("#export-names", LineList)
        wanted = self.names[names.index] if self.is_chosen and self.names else common_start(self.names, entry.value)
        if not entry.has_focus or wanted == entry.value:
            self.focus_next()
        else:
            self._write(wanted)

    def _write(self, text: str) -> None:
        entry = self.query_one("#export-path", Input)
        entry.value = text
        entry.cursor_position = len(text)

    @on(LineList.Chosen)
    def _clicked(self, event: LineList.Chosen) -> None:
        self._write(self.names[event.index])

    @on(Input.Submitted)
    def action_export(self) -> None:
        """Make the bytes; ask first where a file is there already."""
        names = self.query_one("#export-names", LineList)
        if self.is_chosen and self.names:
            self._write(self.names[names.index])
            self.is_chosen = False
            return
        path = resolved(self.query_one("#export-path", Input).value, self.folder)
        try:
            if wrong := self._wrong(path):
                self._say(wrong)
                return
            is_there = path.exists()
        except (OSError, ValueError):
            self._say("This is not the path of a file.")
            return
        if not is_there:
            self._make(path)
            return

        def answered(is_sure: bool | None) -> None:
            if is_sure:
                self._make(path)

        question = f"{in_quotes(path.name)} is there already. Write over it?"
        self.app.push_screen(SureDialog("The file is there", question), answered)

    def _wrong(self, path: Path) -> str:
        """Why nothing can be written to a path, as far as it can be reported beforehand."""
        if path.is_dir():
            return "This is a folder; a file is wanted."
        if not path.parent.is_dir():
            return f"There is no folder {in_quotes(str(path.parent))}."
        if self.table.path is not None and path.resolve() == self.table.path.resolve():
            return "This is the open table itself; Ctrl+S saves it."
        return ""

    def _make(self, path: Path) -> None:
        self._say(told="Writing …")
        self._make_bytes(path, str(self.query_one("#export-format", Select).value) or None)

    @work(thread=True, exclusive=True)
    def _make_bytes(self, path: Path, wanted: str | None) -> None:
        """Make the bytes in the background."""
        found: Export | ContextDBError
        try:
            raw, remarks = write(self.table, format_of(str(path), wanted, for_writing=True))
            found = Export(path, raw, tuple(map(str, remarks)))
        except ContextDBError as error:
            found = error
        if not get_current_worker().is_cancelled:
            self.app.call_from_thread(self._made, found)

    def _made(self, found: Export | ContextDBError) -> None:
        if isinstance(found, Export):
            self.dismiss(found)
        else:
            self._say(why_not(found))

    def _say(self, wrong: str = "", told: str = "") -> None:
        self.query_one("#export-told", Static).update(Content.styled(f"✗ {wrong}", "$text-error") if wrong else Content(told))
