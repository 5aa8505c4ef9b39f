"""The dialogs of the contexts: save one, open a file of them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import ClassVar

from textual import on
from textual.app import ComposeResult
from textual.binding import Binding, BindingType
from textual.content import Content
from textual.widgets import Input, RadioButton, RadioSet, Static

from contextdb.checks.cases import exactly
from contextdb.disk import CONTEXT_SUFFIXES
from contextdb.errors import ContextDBError

from ..model.context_list import ContextList, expectation_fault, summary
from ..model.paths import resolved
from ..widgets.cursor_lines import FIRST_LAST, UP_DOWN
from ..widgets.field import Field
from .dialog import Dialog
from .path_dialog import PathDialog


@dataclass(frozen=True)
class SavedCase:
    """A context to save: its name, what is expected of it, and why in words."""

    name: str
    expected: str
    note: str = ""


class Choice(RadioButton):
    """A radio button that says without colour which one is taken."""

    def render(self) -> Content:
        self.BUTTON_INNER = "●" if self.value else "○"
        return super().render()


class KeepDialog(Dialog[SavedCase]):
    """Save the test row under a name, with what is expected."""

    BINDINGS: ClassVar[list[BindingType]] = [Binding("f6", "keep", "Save")]
    DEFAULT_CSS = """
    KeepDialog {
        & > #dialog { padding: 0 2; }
        & #keep-facts { height: auto; max-height: 3; margin: 0 0 1 0; }
        & RadioSet, & RadioSet:focus { border: none; background: $surface; padding: 0; height: auto; width: 100%; }
        & RadioSet > RadioButton > .toggle--button { color: $foreground; background: $surface; }
        & RadioSet > RadioButton.-on > .toggle--button { color: $foreground; background: $surface; text-style: bold; }
        & RadioSet:blur > RadioButton.-selected > .toggle--label { background: $surface; color: $foreground; text-style: none; }
    }
    """
    title_text = "Save the test row"
    keys_text = "Enter save · Tab next field · Esc cancel"

    def __init__(
        self, contexts: ContextList, facts: Mapping[str, str], case: SavedCase | None = None, has_actors: bool = False
    ) -> None:
        """`case` is the case that is to be written again; its name may be changed all the same. `has_actors` as in
        `ContextsDialog`."""
        super().__init__()
        self.about_actors = "The actors are not saved: these assets are valid without them." if has_actors else ""
        self.facts = facts
        self.case = case or SavedCase("", "")
        self.is_new = case is None
        self.unreadable = ""
        self.valid: list[str] = []
        try:
            self.valid = contexts.valid_assets(facts)
        except ContextDBError as error:
            self.unreadable = error.faults[0].message
        try:
            self.taken = {case.name for case in contexts.own_cases}
        except ContextDBError:  # reported when it is saved
            self.taken = set()

    def compose_body(self) -> ComposeResult:
        given = summary({name: text for name, text in self.facts.items() if text.strip()}) or "no fact is given"
        yield Static(Content(given), id="keep-facts")
        yield Field(
            "Name", Input(self.case.name, id="keep-name", compact=True), "Says in messages which context fails.", key="name"
        )
        labels = (
            "Nothing: only to be looked at",
            f"Exactly the assets that can be valid now ({len(self.valid)})",
            "As written below",
        )
        yield Field(
            "Expected",
            RadioSet(*(Choice(label, compact=True) for label in labels), id="keep-choice"),
            self.about_actors,
            key="choice",
        )
        text = self.case.expected or exactly(self.valid)
        meaning = 'Assets: exactly these. "+walk -run": walk is valid and run is not. "(none)": no asset.'
        yield Field("", Input(text, id="keep-expected", compact=True), meaning, key="expected")
        yield Field("Note", Input(self.case.note, id="keep-note", compact=True), "Why, in words; may be empty.", key="note")

    def on_mount(self) -> None:
        """Take what is most likely wanted, and say at once what cannot be stored."""
        taken = 2 if self.case.expected.strip() else 0 if self.unreadable or not self.is_new else 1
        self.query(Choice)[taken].value = True
        if self.unreadable:
            self.query_one("#field-choice", Field).say(f"The valid assets cannot be determined: {self.unreadable}")

    @on(Input.Changed, "#keep-expected")
    def _written(self, event: Input.Changed) -> None:
        if event.input.has_focus:
            self.query_one("#keep-choice", RadioSet).query(Choice)[2].value = True
        fault = expectation_fault(event.value)
        self.query_one("#field-expected", Field).say(fault.message if fault else "")

    @on(Input.Changed, "#keep-name")
    def _named(self, event: Input.Changed) -> None:
        is_there = event.value.strip() in self.taken
        meaning = "Written over: there is a context of this name." if is_there else "Says in messages which context fails."
        self.query_one("#field-name", Field).say("", meaning)

    @on(Input.Submitted)
    def action_keep(self) -> None:
        """Give back what is to be saved, unless something is wrong with it."""
        name = self.query_one("#keep-name", Input).value.strip()
        if not name:
            self.query_one("#field-name", Field).say("Enter a name.")
            self.query_one("#keep-name", Input).focus()
            return
        choice = self.query_one("#keep-choice", RadioSet).pressed_index
        written = self.query_one("#keep-expected", Input).value.strip()
        if choice == 2 and expectation_fault(written):
            self.query_one("#keep-expected", Input).focus()
            return
        if choice == 1 and self.unreadable:
            return
        expected = ("", exactly(self.valid), written)[max(choice, 0)]
        self.dismiss(SavedCase(name, expected, self.query_one("#keep-note", Input).value.strip()))


class OpenDialog(PathDialog[Path]):
    """Which file of contexts to open; names are completed as one types."""

    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("tab", "complete", "Complete", priority=True),
        *UP_DOWN,
        *FIRST_LAST,
        Binding("pagedown", "move(8)", "Page down", show=False),
        Binding("pageup", "move(-8)", "Page up", show=False),
    ]
    DEFAULT_CSS = """
    OpenDialog { & #dialog-body { height: auto; } & LineList { height: 12; margin: 1 0 0 0; } }
    """
    title_text = "Open a file of contexts"
    keys_text = "Enter open · Tab complete · ↑↓ choose · Esc cancel"

    def __init__(self, folder: Path) -> None:
        super().__init__(folder, CONTEXT_SUFFIXES)

    def compose_body(self) -> ComposeResult:
        """The path, and what it may go on to be."""
        yield Field("File", self.path_entry("open"), "Saved contexts (.cases.csv), or recorded ones.", key="path")
        yield self.path_names("open", "No such file.")

    def on_mount(self) -> None:
        self.entry.focus()
        self.show_names("")

    def show_names(self, text: str) -> None:
        """List what a path may go on to be; what was wrong with it goes."""
        super().show_names(text)
        self.query_one("#field-path", Field).say("")

    def take(self, text: str) -> None:
        """Go into a folder, or give back a file."""
        if self.is_folder(text):
            return
        path = resolved(text, self.folder)
        try:
            is_file = path.is_file()
        except (OSError, ValueError):
            is_file = False
        if is_file and text.lower().endswith(CONTEXT_SUFFIXES):
            self.dismiss(path)
        else:
            wrong = f"Contexts are in {', '.join(CONTEXT_SUFFIXES)} files." if is_file else "There is no such file."
            self.query_one("#field-path", Field).say(wrong)
