"""Export the open table for another program: where to, and in which format.

Nothing is written here: the dialog gives back an `Export`, whose bytes are then written with `contextdb.disk.write_atomic`.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import ClassVar

from textual import work
from textual.app import ComposeResult
from textual.binding import Binding, BindingType
from textual.content import Content
from textual.widgets import Select, Static
from textual.worker import get_current_worker

from contextdb.disk import real_path
from contextdb.edits.notes import NO_NOTES, Notes
from contextdb.errors import ContextDBError, in_quotes
from contextdb.exchange.formats import FORMATS, format_of, write
from contextdb.tables.table import Table

from ..model.importing import suffixes_written, why_not
from ..model.paths import resolved
from ..widgets.cursor_lines import UP_DOWN
from ..widgets.field import Field
from ..widgets.pick import Pick
from .ask import SureDialog
from .dialog import buttons
from .path_dialog import PathDialog

BY_SUFFIX = "as the file is named"


@dataclass(frozen=True)
class Export:
    """What the dialog gives back: the bytes of a file, where they go, and what could not be stored."""

    path: Path
    raw: bytes
    notes: tuple[str, ...] = ()


class ExportDialog(PathDialog[Export]):
    """Export the open table."""

    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("tab", "complete", "Complete", show=False, priority=True),
        Binding("f6,ctrl+j", "export", "Export"),
        *UP_DOWN,
    ]
    DEFAULT_CSS = """
    ExportDialog {
        & Field:focus-within { height: auto; }
        & LineList { height: auto; max-height: 8; margin: 1 0 0 0; }
        & #export-message { height: auto; margin: 1 0 0 0; }
        & #export-buttons { height: 1; margin: 1 0 0 0; }
    }
    """
    takes_first = False
    keys_text = "Enter export · Tab complete · ↑↓ choose · Esc cancel"

    def __init__(self, table: Table, folder: Path, notes: Notes = NO_NOTES) -> None:
        """`folder` is where paths start; `notes` are those of the table."""
        super().__init__(folder, suffixes_written())
        self.title_text = f"Export {table.name}"
        self.table, self.notes = table, notes

    def compose_body(self) -> ComposeResult:
        """The path, the format, and what lies in the folder."""
        entry = self.path_entry("export", f"{self.table.name}.xlsx")
        yield Field("File", entry, f"Ends in {', '.join(self.suffixes)}.", key="path")
        formats = [(BY_SUFFIX, ""), *((one.about.split(";")[0], one.name) for one in FORMATS.values() if one.is_written)]
        yield Field("Format", Pick(formats, value="", allow_blank=False, compact=True, id="export-format"), key="format")
        yield self.path_names("export", "No file of this name yet.")
        yield Static("", id="export-message")
        yield Static(buttons([("export", "Export"), ("cancel", "Cancel")]), id="export-buttons")

    def on_mount(self) -> None:
        """Begin with the path, its stem chosen, so that typing gives another name."""
        self.entry.focus()
        self.show_names(self.entry.value)

    def show_names(self, text: str) -> None:
        """List what a path may go on to be; what was wrong with it goes."""
        super().show_names(text)
        self._say()

    def take(self, text: str) -> None:
        """Write the name that is chosen in the list; export to what is typed."""
        if text in self.names and text != self.entry.value:
            self.write(text)
        else:
            self.action_export()

    def action_export(self) -> None:
        """Make the bytes; ask first where a file is there already."""
        path = resolved(self.entry.value, self.folder)
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
        if self.table.path is not None and real_path(path) == real_path(self.table.path):
            return "This is the open table itself; Ctrl+S saves it."
        return ""

    def _make(self, path: Path) -> None:
        self._say(message="Writing …")
        self._make_bytes(path, str(self.query_one("#export-format", Select).value) or None)

    @work(thread=True, exclusive=True)
    def _make_bytes(self, path: Path, wanted: str | None) -> None:
        """Make the bytes in the background."""
        result: Export | ContextDBError
        try:
            raw, remarks = write(self.table, format_of(str(path), wanted, for_writing=True), notes=self.notes)
            result = Export(path, raw, tuple(map(str, remarks)))
        except ContextDBError as error:
            result = error
        if not get_current_worker().is_cancelled:
            self.app.call_from_thread(self._made, result)

    def _made(self, result: Export | ContextDBError) -> None:
        if isinstance(result, Export):
            self.dismiss(result)
        else:
            self._say(why_not(result))

    def _say(self, wrong: str = "", message: str = "") -> None:
        self.query_one("#export-message", Static).update(Content.styled(f"✗ {wrong}", "$text-error") if wrong else Content(message))
