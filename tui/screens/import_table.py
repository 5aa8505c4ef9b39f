"""Import a file, or what is on the clipboard, into the open table: which file, which sheet, what each column becomes.

Nothing is changed here: the dialog gives back an `Import`, whose edit the sheet makes as one step.
"""

from __future__ import annotations

from collections.abc import Sequence
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
from contextdb.errors import ContextDBError
from contextdb.exchange.formats import FORMATS, ReadOptions, format_of, sheet_names
from contextdb.exchange.importing import NAMES
from contextdb.exchange.reading import SheetWanted
from contextdb.tables.table import Table
from tui.model.importing import MODES, Choice, Draft, Import, Mode, suffixes_read, why_not
from tui.model.paths import common_start, completions, resolved
from tui.screens.dialog import Dialog, buttons
from tui.widgets.field import Field
from tui.widgets.line_list import LineList, ListCell, ListColumn
from tui.widgets.pick import Pick

BY_ITSELF = "by its content"
THE_ONLY = "the filled sheet"
THE_USUAL = "each text is one name, but in our own files"
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
        """The choices."""
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


class ImportDialog(Dialog[Import]):
    """Import a file into the open table."""

    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("tab", "complete", "Complete", show=False, priority=True),
        Binding("f6,ctrl+j", "import", "Import"),
        Binding("f2", "path", "Another file", show=False),
        Binding("down", "move(1)", "Down", show=False),
        Binding("up", "move(-1)", "Up", show=False),
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
        & #field-how Horizontal { height: auto; }
        & #field-how Select { width: 1fr; }
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
        super().__init__(classes="-wide -no-sheets")
        self.title_text = f"Import into {table.name}"
        self.table = table
        self.folder = folder
        self.text = text
        self.names: list[str] = []
        self.is_chosen = False
        """Whether the list of names was moved in since the last letter: Enter then takes its line."""
        self.draft: Draft | None = None
        self.reason = ""
        """Why there is no draft."""
        self.path: Path | None = path

    def compose_body(self) -> ComposeResult:
        """The file and how it is read; then its columns."""
        if self.text is None:
            yield Field("File", Input(id="import-path", compact=True), key="path")
        formats = [(BY_ITSELF, ""), *((one.about.split(";")[0], one.name) for one in FORMATS.values() if one.is_read)]
        kind = Pick(formats, value="" if self.text is None else "tsv", allow_blank=False, compact=True, id="import-format")
        sheet = Pick([(THE_ONLY, "")], value="", allow_blank=False, compact=True, id="import-sheet")
        yield Field("Format, sheet", Horizontal(kind, sheet), key="how")
        modes = [(about, mode) for mode, about in MODES.items()]
        yield Field("Rows", Pick(modes, value="merge", allow_blank=False, compact=True, id="import-mode"), key="mode")
        texts = [(THE_USUAL, ""), *((about, name) for name, about in NAMES.items())]
        yield Field("Names", Pick(texts, value="", allow_blank=False, compact=True, id="import-texts"), key="texts")
        yield LineList(
            [ListColumn(f"In {self.folder.name or self.folder}", 20, 1)],
            empty="No such file.",
            id="import-names",
        )
        yield LineList(COLUMNS, empty="No column.", id="import-columns")
        yield Static("", id="import-why")
        yield Static("", id="import-summary")
        with VerticalScroll(id="import-notes", can_focus=False):
            yield Static("")
        yield Static(buttons([("import", "Import"), ("cancel", "Cancel")]), id="import-buttons")

    def on_mount(self) -> None:
        """Show what files there are, or read the clipboard."""
        self.query_one("#import-names", LineList).can_focus = False
        if self.text is not None:
            self._read()
            return
        self.query_one("#import-path", Input).focus()
        path = self.path
        self._show_names("")
        if path is not None:
            self._take(str(path.absolute()))

    # ---- which file

    @on(Input.Changed, "#import-path")
    def _typed(self, event: Input.Changed) -> None:
        self._show_names(event.value)

    def _show_names(self, text: str) -> None:
        self.is_chosen, self.draft, self.path, self.reason = False, None, None, ""
        self.set_class(False, "-read")
        self._show_keys("Enter read · Tab complete · ↑↓ choose · Esc cancel")
        self.names = completions(text, self.folder, suffixes_read())
        self.query_one("#import-names", LineList).show(len(self.names), lambda at: (self.names[at],))
        self._say()

    def action_move(self, down: int) -> None:
        """Move in the list of names."""
        if not self.has_class("-read"):
            self.is_chosen = True
            self.query_one("#import-names", LineList).action_move(down)

    def action_complete(self) -> None:
        """Write as much of the path as is certain; elsewhere go to the next field."""
        entry = self.query("#import-path").first(Input) if self.text is None else None
        if entry is None or not entry.has_focus or self.has_class("-read"):
            self.focus_next()
        elif self.names:
            names = self.query_one("#import-names", LineList)
            self._write(self.names[names.index] if self.is_chosen else common_start(self.names, entry.value))

    def _write(self, text: str) -> None:
        entry = self.query_one("#import-path", Input)
        entry.value = text
        entry.cursor_position = len(text)

    @on(LineList.Chosen, "#import-names")
    def _clicked(self, event: LineList.Chosen) -> None:
        self._take(self.names[event.index])

    @on(Input.Submitted, "#import-path")
    def _submitted(self, event: Input.Submitted) -> None:
        is_list = self.names and (self.is_chosen or not event.value.strip())
        self._take(self.names[self.query_one("#import-names", LineList).index] if is_list else event.value)

    def _take(self, text: str) -> None:
        """Go into a folder, or read a file."""
        path = resolved(text, self.folder)
        try:
            is_folder = path.is_dir()
        except (OSError, ValueError):
            is_folder = False
        if is_folder:
            self._write(text if text.endswith("/") else f"{text}/")
            return
        with self.prevent(Input.Changed):
            self._write(text)
        self.path = path
        self._read()

    def action_path(self) -> None:
        """Go back to the path."""
        if self.text is None:
            self.query_one("#import-path", Input).focus()

    # ---- reading

    @on(Select.Changed, "#import-format")
    @on(Select.Changed, "#import-sheet")
    @on(Select.Changed, "#import-texts")
    def _read_otherwise(self) -> None:
        if self.path is not None or (self.text is not None and self.draft is not None):
            self._read()

    def _read(self) -> None:
        self._say("Reading …")
        said = (str(self.query_one(f"#import-{name}", Select).value) or None for name in ("format", "sheet", "texts"))
        kind, sheet, names = said
        self._read_file(self.path, ReadOptions(kind, sheet), names)

    @work(thread=True, exclusive=True)
    def _read_file(self, path: Path | None, options: ReadOptions, names: str | None) -> None:
        """Read in the background, so that a large file does not hold the keys."""
        sheets: list[str] = []
        found: Draft | ContextDBError
        try:
            name = str(path) if path is not None else "the clipboard"
            raw = (self.text or "").encode("utf-8", "replace") if path is None else read_bytes(path)
            sheets = sheet_names(raw, name) if format_of(name, options.format, raw).name == "xlsx" else []
            options = options if options.sheet in sheets else ReadOptions(options.format)
            found = Draft.read(self.table, raw, name, options, names)
        except ContextDBError as error:
            found = error
        if not get_current_worker().is_cancelled:
            self.app.call_from_thread(self._show, found, sheets)

    def _show(self, found: Draft | ContextDBError, sheets: Sequence[str]) -> None:
        self._show_sheets(sheets)
        is_read = isinstance(found, Draft)
        self.set_class(is_read, "-read")
        if isinstance(found, ContextDBError):
            self.draft, self.reason = None, why_not(found)
            if isinstance(found, SheetWanted):
                self._say(self.reason)
                self.query_one("#import-sheet", Select).action_show_overlay()
            else:
                self._say(wrong=self.reason)
            return
        if self.draft is not None:
            found.mode = self.draft.mode
        self.draft = found
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
        if answer.edit.changes:
            self.dismiss(answer)
        else:
            self._say("Nothing would change: the table says all of this already.")

    # ---- what is said

    def _say(self, told: str = "", wrong: str = "", notes: Sequence[str] = ()) -> None:
        summary = Content.styled(f"✗ {wrong}", "$text-error") if wrong else Content(told)
        self.query_one("#import-summary", Static).update(summary)
        self.query_one("#import-notes Static", Static).update(Content("\n".join(f"· {note}" for note in notes)))

    def _show_keys(self, text: str) -> None:
        self.query_one("#dialog").border_subtitle = text


def mode_of(text: str) -> Mode:
    """The mode of a name."""
    return next(mode for mode in MODES if mode == text)
