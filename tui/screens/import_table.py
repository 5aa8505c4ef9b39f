"""Import a file, or what is on the clipboard, into the open table: which file, which sheet, what each column becomes.

Nothing is changed here: the dialog gives back an `Import`, whose edit the sheet makes as one step.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
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
from contextdb.exchange.formats import FORMATS, ReadOptions, format_of, grid_of, sheet_names
from contextdb.exchange.importing import NAMES, Choices, choices_of, remember
from contextdb.exchange.reading import SheetWanted, TableWanted
from contextdb.tables.table import Table

from ..model.importing import DECIMAL_COMMA, MODES, Draft, Import, Mode, suffixes_read, why_not
from ..model.paths import resolved
from ..widgets.cursor_lines import UP_DOWN
from ..widgets.field import Field
from ..widgets.line_list import LineList, ListCell, ListColumn
from ..widgets.pick import Pick
from .ask import ChooseDialog
from .choose_rows import RowsDialog, first_header
from .dialog import buttons
from .path_dialog import PathDialog

BY_ITSELF = "by its content"
THE_ONLY = "the filled sheet"
THE_TABLE, OTHER_ROWS = "all of the table", "choose rows"
THE_USUAL = "names as usual"
DECIMALS = [("0,5 as usual", ""), (DECIMAL_COMMA, "comma"), ("0,5 is 0 ± 5", "point")]
PAIRS = [("min, max joined", ""), ("min, max apart", "apart")]
COLUMNS = (ListColumn("Column", 18, 2, is_name=True), ListColumn("First cells", 12, 3), ListColumn("Becomes", 20, 3))


class ImportDialog(PathDialog[Import]):
    """Import a file into the open table."""

    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("tab", "complete", "Complete", show=False, priority=True),
        Binding("f6,ctrl+j", "import", "Import"),
        Binding("f2", "path", "Another file", show=False),
        Binding("f4", "rows", "Choose rows", show=False),
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
        &.-no-sheets #import-sheet, &.-no-rows #import-rows, &.-no-pairs #import-pairs { display: none; }
        &.-tall > #dialog, &.-tall > #dialog > #dialog-body { height: auto; }
        &.-tall LineList { height: auto; min-height: 8; max-height: 50vh; }
    }
    """
    keys_text = "Enter read · Tab complete · ↑↓ choose · Esc cancel"

    def __init__(self, table: Table, folder: Path, text: str | None = None, path: Path | None = None) -> None:
        """`folder` is where paths start; `text` is imported instead of a file: what is on the clipboard. `path` is read at once."""
        super().__init__(folder, suffixes_read(), classes="-wide -no-sheets -no-rows -no-pairs")
        self.title_text = f"Import into {table.name}"
        self.table = table
        self.text = text
        self.draft: Draft | None = None
        self.reason = ""
        """Why there is no draft."""
        self.path: Path | None = path
        self._columns: Mapping[str, Sequence[str]] = {}
        """What was chosen for the columns of such a file before."""
        self._asked_commas = False

    def compose_body(self) -> ComposeResult:
        """The file and how it is read; then its columns."""
        if self.text is None:
            yield Field("File", self.path_entry("import"), key="path")
        formats = [(BY_ITSELF, ""), *((one.about.split(";")[0], one.name) for one in FORMATS.values() if one.is_read)]
        kind = Pick(formats, value="" if self.text is None else "tsv", allow_blank=False, compact=True, id="import-format")
        sheet = Pick([(THE_ONLY, "")], value="", allow_blank=False, compact=True, id="import-sheet")
        rows = Pick([(THE_TABLE, "")], value="", allow_blank=False, compact=True, id="import-rows")
        yield Field("Format, cells", Horizontal(kind, sheet, rows), key="how")
        modes = [(about, mode) for mode, about in MODES.items()]
        yield Field("Rows", Pick(modes, value="merge", allow_blank=False, compact=True, id="import-mode"), key="mode")
        texts = [(THE_USUAL, ""), *((about, name) for name, about in NAMES.items())]
        names = Pick(texts, value="", allow_blank=False, compact=True, id="import-texts")
        decimal = Pick(DECIMALS, value="", allow_blank=False, compact=True, id="import-decimal")
        pairs = Pick(PAIRS, value="", allow_blank=False, compact=True, id="import-pairs")
        yield Field("How to read", Horizontal(names, decimal, pairs), key="texts")
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
        self._take_over(choices_of(self._home, self.path.name) or Choices())
        self._read()

    @property
    def _home(self) -> Path:
        """The folder that remembers what is chosen."""
        return self.table.path.parent if self.table.path is not None else self.folder

    def _take_over(self, known: Choices) -> None:
        """Choose what was chosen for such a file before."""
        self._columns, self._asked_commas = known.columns, False
        is_range = ":" in known.sheet
        with self.prevent(Select.Changed):
            self._offer_rows([known.sheet] if is_range else [])
            self._pick("rows", known.sheet if is_range else "")
            sheets = [(THE_ONLY, ""), *([(known.sheet, known.sheet)] if known.sheet and not is_range else [])]
            self.query_one("#import-sheet", Select).set_options(sheets)
            for name, value in (("sheet", "" if is_range else known.sheet), ("decimal", known.decimal), ("texts", known.names)):
                self._pick(name, value)
            self._pick("pairs", known.pairs)
            self._pick("mode", known.mode or "merge")

    def _pick(self, name: str, value: str) -> None:
        select = self.query_one(f"#import-{name}", Select)
        if value in (each for _, each in select._options):
            select.value = value

    def action_path(self) -> None:
        """Go back to the path."""
        if self.text is None:
            self.entry.focus()

    # ---- reading

    @on(Select.Changed, "#import-format")
    @on(Select.Changed, "#import-sheet")
    @on(Select.Changed, "#import-texts")
    @on(Select.Changed, "#import-decimal")
    @on(Select.Changed, "#import-pairs")
    def _read_otherwise(self) -> None:
        if self.path is not None or (self.text is not None and self.draft is not None):
            self._read()

    @on(Select.Changed, "#import-rows")
    def _rows_picked(self, event: Select.Changed) -> None:
        if event.value == OTHER_ROWS:
            self.action_rows()
        else:
            self._read_otherwise()

    def action_rows(self) -> None:
        """Show the sheet, to choose its header and its last row."""
        try:
            name, raw = self._source()
            sheet, grid = grid_of(raw, name, replace(self._options(), sheet=self._value("sheet") or None))
        except ContextDBError as error:
            self._say(wrong=why_not(error))
            return
        if not grid or not grid[0]:
            return

        def chosen(cells: str | None) -> None:
            many = len(self.query_one("#import-sheet", Select)._options) > 2
            cells = f"{sheet}!{cells}" if cells and many else cells
            with self.prevent(Select.Changed):
                self._offer_rows([cells] if cells else [])
                self._pick("rows", cells or "")
            self._read()

        self.app.push_screen(RowsDialog(grid, sheet, first_header(grid, self._value("rows"))), chosen)

    def _offer_rows(self, blocks: Sequence[str]) -> None:
        """Offer these cells of the sheet, and to choose others."""
        select = self.query_one("#import-rows", Select)
        chosen = select.value if select.value in blocks else ""
        select.set_options([(THE_TABLE, ""), *((block, block) for block in blocks), (f"{OTHER_ROWS} …", OTHER_ROWS)])
        select.value = chosen

    def _value(self, name: str) -> str:
        value = str(self.query_one(f"#import-{name}", Select).value)
        return "" if value == OTHER_ROWS else value

    def _options(self) -> ReadOptions:
        return ReadOptions(self._value("format") or None)

    def _source(self) -> tuple[str, bytes]:
        """What is read: a name for messages, and its bytes. Raises FileError."""
        if self.path is None:
            return "the clipboard", (self.text or "").encode("utf-8", "replace")
        return str(self.path), read_bytes(self.path)

    def _read(self) -> None:
        self._say("Reading …")
        sheet, decimal, names, pairs = map(self._value, ("sheet", "decimal", "texts", "pairs"))
        chosen = Choices(self._value("rows") or sheet, decimal, names, pairs, self._value("mode"), self._columns)
        self._read_file(self._options(), chosen)

    @work(thread=True, exclusive=True)
    def _read_file(self, options: ReadOptions, chosen: Choices) -> None:
        """Read in the background, so that a large file does not hold the keys."""
        sheets: list[str] = []
        result: Draft | ContextDBError
        has_rows = False
        try:
            name, raw = self._source()
            kind = format_of(name, options.format, raw).name
            sheets, has_rows = sheet_names(raw, name) if kind == "xlsx" else [], kind in ("xlsx", "csv", "tsv")
            is_there = ":" in chosen.sheet or chosen.sheet in sheets
            result = Draft.read(self.table, raw, name, options, chosen if is_there else replace(chosen, sheet=""))
            result.summary()
        except ContextDBError as error:
            result = error
        except Exception as error:  # a file that we fail at must not take the edits of the open table with it
            result = _unexpected(error)
        if not get_current_worker().is_cancelled:
            self.app.call_from_thread(self._show, result, sheets, has_rows)

    def _show(self, result: Draft | ContextDBError, sheets: Sequence[str], has_rows: bool = False) -> None:
        self._show_sheets(sheets)
        self.set_class(not has_rows, "-no-rows")
        is_read = isinstance(result, Draft)
        self.set_class(is_read, "-read")
        if isinstance(result, ContextDBError):
            self.draft, self.reason = None, why_not(result)
            if isinstance(result, SheetWanted):
                self._ask("sheet", self.reason)
            elif isinstance(result, TableWanted):
                with self.prevent(Select.Changed):
                    self._offer_rows(result.blocks)
                self._ask("rows", self.reason)
            else:
                self._say(wrong=self.reason)
            return
        self.draft = result
        self.set_class(not result.has_pairs, "-no-pairs")
        with self.prevent(Select.Changed):
            rows = self._value("rows")
            self._offer_rows([rows] if rows else [])
        self._show_columns()
        self._show_keys("F6 import · Enter a column · F4 rows · F2 another file · Esc cancel")
        self.set_focus(self.query_one("#import-columns", LineList))  # before it is painted: a key then goes there
        if result.comma_doubts and not self._asked_commas:
            self._asked_commas = True
            self._ask("decimal", result.summary(), result.notes)

    def _ask(self, name: str, message: str, notes: Sequence[str] = ()) -> None:
        """Open the list of what one has to choose from."""
        self._say(message, notes=notes)
        select = self.query_one(f"#import-{name}", Select)
        select.focus()
        select.action_show_overlay()

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

        choices, now = draft.choices_for(at), draft.label(at)
        width = max(len(choice.label) for choice in choices)
        here = next((place for place, choice in enumerate(choices) if choice.label == now), 0)

        def decided(place: int) -> None:
            draft.choose(at, choices[place].mapped)
            self._columns = draft.choices.columns
            self._show_columns(at)

        lines = [f"{choice.label:<{width}}  {choice.about}" for choice in choices]
        ChooseDialog(f"What {draft.columns[at].source} becomes", lines, here).ask(self.app, decided)

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
            if self.path is not None:
                remember(self._home, self.path.name, self.draft.choices)
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
