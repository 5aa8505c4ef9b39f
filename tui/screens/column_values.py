"""The dialog Values: what a column holds and how often; filter by values, mend them, replace or rename one everywhere."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar, Literal

from textual import on
from textual.app import ComposeResult
from textual.binding import Binding, BindingType
from textual.content import Content
from textual.widgets import Static

from ..model.column_values import ColumnValue, described, mends_of, values_of
from ..model.displayed_table import DisplayedTable
from ..widgets.line_list import LineList, ListCell, ListColumn
from .dialog import Dialog

Act = Literal["only", "without", "mend", "replace", "rename"]
BAR = 12
"""So wide is the bar of the most frequent value."""


@dataclass(frozen=True)
class ValuesAnswer:
    """What is to be done with some texts of the column."""

    act: Act
    texts: tuple[str, ...]


class ValuesDialog(Dialog[ValuesAnswer]):
    """The texts of one column with their counts."""

    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("space", "tick", "Tick", show=False),
        *(
            Binding(key, f"act('{act}')", act, show=False)
            for key, act in (("n", "without"), ("m", "mend"), ("r", "replace"), ("e", "rename"))
        ),
    ]
    DEFAULT_CSS = """
    ValuesDialog {
        & > #dialog { width: 100; }
        & #values-about { height: auto; max-height: 4; }
        & #values-lines { height: auto; max-height: 50vh; margin: 1 0; }
        & #values-detail { height: auto; min-height: 1; max-height: 3; color: $text-muted; }
    }
    """
    keys_text = "Enter only · N not · Space tick · M mend · R replace · E rename · Esc"

    def __init__(self, sheet: DisplayedTable, column: int) -> None:
        super().__init__()
        self.title_text = f"Values of {sheet.table.columns[column].name}"
        self.values = values_of(sheet, column)
        self._sheet, self._column = sheet, column
        self.about = described(sheet, column, self.values)
        self.ticked: set[str] = set()
        self._most = max((value.n_rows for value in self.values), default=1)
        self._text = ""
        here = sheet.text(*sheet.cursor) if len(sheet.view) else ""
        self._first = next((at for at, value in enumerate(self.values) if value.text == here), 0)

    def compose_body(self) -> ComposeResult:
        """What the column is, its texts, and the chosen one in full."""
        yield Static(Content(self.about), id="values-about")
        columns = [
            ListColumn("", 3),
            ListColumn("Value", 20, 1),
            ListColumn("Rows", 9, 0, True),
            ListColumn("", BAR),
            ListColumn("Valid", 9, 0, True),
        ]
        yield LineList(columns, empty="The column holds nothing.", id="values-lines")
        yield Static(id="values-detail")

    def on_mount(self) -> None:
        """Stand on the text of the cursor."""
        lines = self.query_one(LineList)
        lines.show(len(self.values), lambda at: self._line(self.values[at]), self._first)
        lines.focus()

    def _line(self, value: ColumnValue) -> Sequence[ListCell]:
        tone = "error" if value.fault is not None else "muted" if not value.text.strip() else ""
        tick = "[x]" if value.text in self.ticked else " ! " if value.fault is not None else ""
        bar = "█" * max(1, round(BAR * value.n_rows / self._most))
        valid = "" if value.n_valid is None else f"{value.n_valid:,}"
        return tick, (value.text or "(empty)", tone), f"{value.n_rows:,}", (bar, "muted"), valid

    @property
    def _here(self) -> ColumnValue | None:
        return self.values[self.query_one(LineList).index] if self.values else None

    @on(LineList.Moved)
    def _moved(self) -> None:
        value = self._here
        message = ""
        if value is not None and value.fault is not None:
            mend = mends_of(self._sheet, self._column, [value.text]).get(value.text)
            message = f'{value.fault.message} M writes "{mend}".' if mend else value.fault.message
        self.query_one("#values-detail", Static).update(Content(message))

    def action_tick(self) -> None:
        """Tick a value, or tick it off."""
        if (value := self._here) is not None:
            self.ticked ^= {value.text}
            self.query_one(LineList).refresh()
            self.query_one(LineList).action_move(1)

    @on(LineList.Chosen)
    def _chosen(self) -> None:
        self.action_act("only")

    def action_act(self, act: Act) -> None:
        """Give back what is to be done with the ticked values, or with the one of the cursor."""
        value = self._here
        texts = tuple(v.text for v in self.values if v.text in self.ticked) or ((value.text,) if value is not None else ())
        if act == "mend":
            wrong = tuple(value.text for value in self.values if value.fault is not None)
            texts = tuple(text for text in wrong if text in self.ticked) if self.ticked else wrong
        if act == "rename":
            texts = texts[:1]
        if texts:
            self.dismiss(ValuesAnswer(act, texts))
