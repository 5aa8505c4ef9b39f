"""Import a file, or what is on the clipboard, into the open table: which file, which sheet, what each column becomes.

Nothing is changed here: the dialog gives back an `Import`, whose edit the sheet makes as one step.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import ClassVar

from textual import on, work
from textual.app import ComposeResult
from textual.binding import Binding, BindingType
from textual.containers import Horizontal, VerticalScroll
from textual.content import Content
from textual.widgets import Input, Select, Static
from textual.worker import get_current_worker

from contextdb.disk import read_bytes
from contextdb.errors import ContextDBError, Fault, safe_text
from contextdb.exchange.formats import FORMATS, ReadOptions, format_of, sheet_names
from contextdb.exchange.importing import NAMES
from contextdb.exchange.reading import SheetWanted
from contextdb.tables.table import Table

from ..model.importing import MODES, Choice, Draft, Import, Mode, suffixes_read, why_not
from ..model.paths import resolved
from ..widgets.cursor_lines import UP_DOWN
from ..widgets.field import Field
from ..widgets.line_list import LineList, ListCell, ListColumn
from ..widgets.pick import Pick
from .dialog import Dialog, buttons
from .path_dialog import PathDialog

BY_ITSELF = "by its content"
THE_ONLY = "the filled sheet"
THE_USUAL = "each text is one name, but in our own files"
DECIMALS = [("by the cells", ""), ("comma: 0,5 is 0.5", "comma"), ("point: 0,5 is 0 ± 5", "point")]
COLUMNS = (ListColumn("Column", 18, 2, is_name=True), ListColumn("First cells", 12, 3), ListColumn("Becomes", 20, 3))


class ChoiceDialog(Dialog[Choice]):
    """What one column of the file becomes."""

    DEFAULT_CSS = """
    ChoiceDialog { & LineList { height: 14; } }
    """
    keys_text = "Enter choose · ↑↓ · Esc as it was"

    def __init__(self, column: str, choices: Sequence[Choice], becomes: str) -> None:
        super().__init__()
        self.title_text = f"What {column} becomes"
        self.choices = choices
        self.becomes = becomes

    def compose_body(self) -> ComposeResult:
        yield LineList([ListColumn("Becomes", 24, 1), ListColumn("", 20, 1)], id="choice-lines")

    def on_mount(self) -> None:
        """Stand on what it becomes now."""
        here = next((at for at, choice in enumerate(self.choices) if choice.label == self.becomes), 0)
        lines = self.query_one(LineList)
        lines.show(len(self.choices), lambda at: (self.choices[at].label, (self.choices[at].about, "muted")), here)
        lines.focus()

    @on(LineList.Chosen)
    def _chosen(self, event: LineList.Chosen) -> None:
        self.dismiss(self.choices[event.index])


class ImportDialog(PathDialog[Import]):
    """Import a file into the open table."""

    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("tab", "complete", "Complete", show=False, priority=True),
        Binding("f6,ctrl+j", "import", "Import"),
        Binding("f2", "path", "Another file", show=False),
        *UP_DOWN,
    ]
    DEFAULT_CSS = """
    ImportDialog {
        & Field:focus-within { height: auto; }
        & > #dialog { padding: 0 2; }
        & LineList { height: 1fr; margin: 1 0 0 0; }
        & #import-columns, & #field-mode, & #field-texts { display: none; }
        &.-read #import-columns { display: block; }
        &.-read #import-names { display: none; }
        &.-read #field-mode, &.-read #field-texts { display: block; }
        & #field-how Horizontal, & #field-texts Horizontal { height: auto; }
        & #field-how Select, & #field-texts Select { width: 1fr; }
        & #import-why { height: auto; max-height: 2; color: $text-muted; display: none; }
        &.-read #import-why { display: block; }
        & #import-summary { height: auto; margin: 1 0 0 0; text-style: bold; }
        & #import-notes { height: auto; max-height: 18%; color: $text-muted; }
        & #import-buttons { height: 1; }
        &.-no-sheets #import-sheet { display: none; }
        &.-tall > #dialog, &.-tall > #dialog > #dialog-body { height: auto; }
        &.-tall LineList { height: auto; min-height: 8; max-height: 50vh; }
    }
    """
    keys_text = "Enter read · Tab complete · ↑↓ choose · Esc cancel"

    def __init__(self, table: Table, folder: Path, text: str | None = None, path: Path | None = None) -> None:
        """`folder` is where paths start; `text` is imported instead of a file: what is on the clipboard. `path` is read at once."""
        super().__init__(folder, suffixes_read(), classes="-wide -no-sheets")
        self.title_text = f"Import into {table.name}"
        self.table = table
        self.text = text
        self.draft: Draft | None = None
        self.reason = ""
        """Why there is no draft."""
        self.path: Path | None = path

    def compose_body(self) -> ComposeResult:
        """The file and how it is read; then its columns."""
        if self.text is None:
            yield Field("File", self.path_entry("import"), key="path")
        formats = [(BY_ITSELF, ""), *((one.about.split(";")[0], one.name) for one in FORMATS.values() if one.is_read)]
        kind = Pick(formats, value="" if self.text is None else "tsv", allow_blank=False, compact=True, id="import-format")
        sheet = Pick([(THE_ONLY, "")], value="", allow_blank=False, compact=True, id="import-sheet")
        yield Field("Format, sheet", Horizontal(kind, sheet), key="how")
        modes = [(about, mode) for mode, about in MODES.items()]
        yield Field("Rows", Pick(modes, value="merge", allow_blank=False, compact=True, id="import-mode"), key="mode")
        texts = [(THE_USUAL, ""), *((about, name) for name, about in NAMES.items())]
        names = Pick(texts, value="", allow_blank=False, compact=True, id="import-texts")
        decimal = Pick(DECIMALS, value="", allow_blank=False, compact=True, id="import-decimal")
        yield Field("Names, decimals", Horizontal(names, decimal), key="texts")
        yield self.path_names("import", "No such file.")
        yield LineList(COLUMNS, empty="No column.", id="import-columns")
        yield Static("", id="import-why")
        yield Static("", id="import-summary")
        with VerticalScroll(id="import-notes", can_focus=False):
            yield Static("")
        yield Static(buttons([("import", "Import"), ("cancel", "Cancel")]), id="import-buttons")

    def on_mount(self) -> None:
        """Show what files there are, or read the clipboard."""
        if self.text is not None:
            self._read()
            return
        self.entry.focus()
        path = self.path
        self.show_names("")
        if path is not None:
            self.take(str(path.absolute()))

    # ---- which file

    def show_names(self, text: str) -> None:
        """List what a path may go on to be; what was read goes."""
        self.draft, self.path, self.reason = None, None, ""
        self.set_class(False, "-read")
        self._show_keys(self.keys_text)
        super().show_names(text)
        self._say()

    def action_move(self, down: int) -> None:
        """Move in the list of names, while there is one."""
        if not self.has_class("-read"):
            super().action_move(down)

    def action_complete(self) -> None:
        """As in every such dialog, while a path is wanted."""
        if self.text is None and not self.has_class("-read"):
            super().action_complete()
        else:
            self.focus_next()

    def take(self, text: str) -> None:
        """Go into a folder, or read a file."""
        if self.is_folder(text):
            return
        with self.prevent(Input.Changed):
            self.write(text)
        self.path = resolved(text, self.folder)
        self._read()

    def action_path(self) -> None:
        """Go back to the path."""
        if self.text is None:
            self.entry.focus()

    # ---- reading

    @on(Select.Changed, "#import-format")
    @on(Select.Changed, "#import-sheet")
    @on(Select.Changed, "#import-texts")
    @on(Select.Changed, "#import-decimal")
    def _read_otherwise(self) -> None:
        if self.path is not None or (self.text is not None and self.draft is not None):
            self._read()

    def _read(self) -> None:
        self._say("Reading …")
        choices = (str(self.query_one(f"#import-{name}", Select).value) or None for name in ("format", "sheet", "texts", "decimal"))
        kind, sheet, names, sign = choices
        is_comma = None if sign is None else sign == "comma"
        self._read_file(self.path, ReadOptions(kind, sheet, is_decimal_comma=is_comma), names)

    @work(thread=True, exclusive=True)
    def _read_file(self, path: Path | None, options: ReadOptions, names: str | None) -> None:
        """Read in the background, so that a large file does not hold the keys."""
        sheets: list[str] = []
        result: Draft | ContextDBError
        try:
            name = str(path) if path is not None else "the clipboard"
            raw = (self.text or "").encode("utf-8", "replace") if path is None else read_bytes(path)
            sheets = sheet_names(raw, name) if format_of(name, options.format, raw).name == "xlsx" else []
            options = options if options.sheet in sheets else replace(options, sheet=None)
            result = Draft.read(self.table, raw, name, options, names)
            result.summary()
        except ContextDBError as error:
            result = error
        except Exception as error:  # a file that we fail at must not take the edits of the open table with it
            result = _unexpected(error)
        if not get_current_worker().is_cancelled:
            self.app.call_from_thread(self._show, result, sheets)

    def _show(self, result: Draft | ContextDBError, sheets: Sequence[str]) -> None:
        self._show_sheets(sheets)
        is_read = isinstance(result, Draft)
        self.set_class(is_read, "-read")
        if isinstance(result, ContextDBError):
            self.draft, self.reason = None, why_not(result)
            if isinstance(result, SheetWanted):
                self._say(self.reason)
                self.query_one("#import-sheet", Select).action_show_overlay()
            else:
                self._say(wrong=self.reason)
            return
        if self.draft is not None:
            result.mode = self.draft.mode
        self.draft = result
        self._show_columns()
        self._show_keys("F6 import · Enter change a column · F2 another file · Esc cancel")
        self.set_focus(self.query_one("#import-columns", LineList))  # before it is painted: a key then goes there

    def _show_sheets(self, sheets: Sequence[str]) -> None:
        self.set_class(len(sheets) < 2, "-no-sheets")
        select = self.query_one("#import-sheet", Select)
        chosen = select.value if select.value in sheets else ""
        with self.prevent(Select.Changed):
            select.set_options([(THE_ONLY, ""), *((name, name) for name in sheets)])
            select.value = chosen

    # ---- columns

    def _show_columns(self, at: int = 0) -> None:
        draft = self.draft
        assert draft is not None, "only a file that was read has columns"
        self.query_one("#import-columns", LineList).show(len(draft.columns), self._line, at)
        self.query_one("#import-why", Static).update(Content(draft.why(at)))
        self._say(draft.summary(), notes=draft.notes)

    def _line(self, at: int) -> Sequence[ListCell]:
        draft = self.draft
        assert draft is not None, "as above"
        mapped = draft.columns[at]
        tone = "muted" if mapped.job == "left out" else "warning" if draft.is_doubtful(at) else ""
        return mapped.source, (draft.preview(at), "muted"), (draft.becomes(at), tone)

    @on(LineList.Moved, "#import-columns")
    def _explain(self, event: LineList.Moved) -> None:
        if self.draft is not None and event.index >= 0:
            self.query_one("#import-why", Static).update(Content(self.draft.why(event.index)))

    @on(LineList.Chosen, "#import-columns")
    def _change(self, event: LineList.Chosen) -> None:
        draft, at = self.draft, event.index
        if draft is None:
            return

        def decided(choice: Choice | None) -> None:
            if choice is not None:
                draft.choose(at, choice.mapped)
                self._show_columns(at)

        self.app.push_screen(ChoiceDialog(draft.columns[at].source, draft.choices(at), draft.label(at)), decided)

    @on(Select.Changed, "#import-mode")
    def _mode(self, event: Select.Changed) -> None:
        if self.draft is not None:
            self.draft.mode = mode_of(str(event.value))
            self._show_columns(self.query_one("#import-columns", LineList).index)

    def action_import(self) -> None:
        """Give back the edit, unless it cannot be made."""
        if self.draft is None:
            self._say(wrong=self.reason or "Choose a file first.")
            return
        try:
            answer = self.draft.answer()
        except ContextDBError as error:
            self._say(wrong=why_not(error))
            return
        except Exception as error:  # as when it is read
            self._say(wrong=why_not(_unexpected(error)))
            return
        if answer.edit.changes:
            self.dismiss(answer)
        else:
            self._say("Nothing would change: the table says all of this already.")

    # ---- messages

    def _say(self, message: str = "", wrong: str = "", notes: Sequence[str] = ()) -> None:
        summary = Content.styled(f"✗ {wrong}", "$text-error") if wrong else Content(message)
        self.query_one("#import-summary", Static).update(summary)
        self.query_one("#import-notes Static", Static).update(Content("\n".join(f"· {note}" for note in notes)))

    def _show_keys(self, text: str) -> None:
        self.query_one("#dialog").border_subtitle = text


def _unexpected(error: Exception) -> ContextDBError:
    return ContextDBError(
        Fault(f"contextdb fails at this file ({type(error).__name__}: {safe_text(str(error), 80)}).", "another file")
    )


def mode_of(text: str) -> Mode:
    """The mode of a name."""
    return next(mode for mode in MODES if mode == text)
