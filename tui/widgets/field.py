"""A line of a form: a label, what one types or picks into, what it means, and what is wrong with it."""

from __future__ import annotations

from textual.app import ComposeResult
from textual.containers import Horizontal, Vertical
from textual.content import Content
from textual.widget import Widget
from textual.widgets import Static


class Field(Vertical):
    """A labelled control. Whatever the control posts bubbles on."""

    DEFAULT_CSS = """
    Field {
        height: auto;
        & > Horizontal { height: auto; }
        & .field--label { width: 17; padding: 0 1 0 0; color: $text; }
        & .field--says { color: $text-muted; padding: 0 1 0 17; height: auto; display: none; }
        &.-says .field--says { display: block; }
        &.-wrong .field--says { color: $text-error; display: block; }
        &:focus-within { height: auto; }  /* Textual follows the focus only where this stands last in a selector */
        &:focus-within .field--label { text-style: bold underline; color: $text; }
        & .field--control { width: 1fr; }
        & Input, & Input.-textual-compact { padding: 0 1; background: $panel; }
        & Input:focus { background: $primary 30%; }
        & SelectCurrent { background: $panel; padding: 0 1; }
        & Select:focus > SelectCurrent { background: $primary 30%; text-style: bold; }
        & Select.-textual-compact > SelectCurrent { padding: 0 1; }
        & Input:ansi:focus, & Select:focus > SelectCurrent:ansi { background: ansi_blue; color: ansi_bright_white; }
        & Select:focus > SelectCurrent:ansi #label { color: ansi_bright_white; }
        & SelectionList { background: $panel; height: auto; max-height: 5; padding: 0 1; }
        & SelectionList:focus { background: $primary 20%; }
    }
    """

    def __init__(self, label: str, control: Widget, meaning: str = "", key: str = "") -> None:
        """`control` is one widget, or a container of several; `key` says which field this is."""
        super().__init__(id=f"field-{key}" if key else None)
        self.label = label
        self.control = control
        self.meaning = meaning
        self.key = key
        self.wrong = ""
        control.add_class("field--control")
        self.set_class(bool(meaning), "-says")

    def compose(self) -> ComposeResult:
        """The label and the control, and below them what it means or what is wrong."""
        with Horizontal():
            yield Static(Content(self.label), classes="field--label")
            yield self.control
        yield Static(Content(self.meaning), classes="field--says")

    def say(self, wrong: str = "", meaning: str | None = None) -> None:
        """Show what is wrong with what was typed, or, when nothing is, what the field means."""
        meaning = self.meaning if meaning is None else meaning
        if (wrong, meaning) == (self.wrong, self.meaning):
            return
        self.wrong, self.meaning = wrong, meaning
        self.set_class(bool(wrong), "-wrong")
        self.set_class(bool(meaning), "-says")
        self.query_one(".field--says", Static).update(Content(f"✗ {wrong}" if wrong else meaning))
