"""The small dialogs of the contexts: keep one, give it a name, be sure, open a file."""

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
from tui.model.context_list import ContextList, expectation_fault, summary
from tui.model.paths import common_start, completions, resolved
from tui.screens.dialog import Dialog, buttons
from tui.widgets.field import Field
from tui.widgets.line_list import LineList, ListColumn


@dataclass(frozen=True)
class Kept:
    """A context to save: its name, what is expected of it, and why in words."""

    name: str
    expected: str
    note: str = ""


class Choice(RadioButton):
    """A radio button that says without colour which one is taken."""

    def render(self) -> Content:
        """The button and its label."""
        self.BUTTON_INNER = "●" if self.value else "○"
        return super().render()


class KeepDialog(Dialog[Kept]):
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

    def __init__(self, contexts: ContextList, facts: Mapping[str, str], kept: Kept | None = None, has_actors: bool = False) -> None:
        """`kept` is the case that is to be written again; its name may be changed all the same. `has_actors` as in
        `ContextsDialog`."""
        super().__init__()
        self.about_actors = "The actors are not saved: these assets are valid without them." if has_actors else ""
        self.facts = facts
        self.kept = kept or Kept("", "")
        self.is_new = kept is None
        self.unreadable = ""
        self.valid: list[str] = []
        try:
            self.valid = contexts.valid_assets(facts)
        except ContextDBError as error:
            self.unreadable = error.faults[0].message
        try:
            self.taken = {case.name for case in contexts.own_cases}
        except ContextDBError:  # told when it is saved
            self.taken = set()

    def compose_body(self) -> ComposeResult:
        """Name, what is expected, note."""
        told = summary({name: text for name, text in self.facts.items() if text.strip()}) or "no fact is given"
        yield Static(Content(told), id="keep-facts")
        yield Field(
            "Name", Input(self.kept.name, id="keep-name", compact=True), "Says in messages which context fails.", key="name"
        )
        labels = ("Nothing: only to be looked at", f"Exactly the assets that are valid now ({len(self.valid)})", "As written below")
        yield Field(
            "Expected",
            RadioSet(*(Choice(label, compact=True) for label in labels), id="keep-choice"),
            self.about_actors,
            key="choice",
        )
        text = self.kept.expected or exactly(self.valid)
        meaning = 'Assets: exactly these. "+walk -run": walk is valid and run is not. "(none)": no asset.'
        yield Field("", Input(text, id="keep-expected", compact=True), meaning, key="expected")
        yield Field("Note", Input(self.kept.note, id="keep-note", compact=True), "Why, in words; may be empty.", key="note")

    def on_mount(self) -> None:
        """Take what is most likely wanted, and say at once what cannot be kept."""
        taken = 2 if self.kept.expected.strip() else 0 if self.unreadable or not self.is_new else 1
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
        self.dismiss(Kept(name, expected, self.query_one("#keep-note", Input).value.strip()))


class NameDialog(Dialog[str]):
    """A new name for a context."""

    title_text = "Rename the context"
    keys_text = "Enter rename · Esc cancel"

    def __init__(self, name: str, taken: set[str]) -> None:
        super().__init__()
        self.old, self.taken = name, taken - {name}

    def compose_body(self) -> ComposeResult:
        """One line."""
        yield Field("Name", Input(self.old, compact=True), "Says in messages which context fails.", key="name")

    @on(Input.Submitted)
    def _submitted(self, event: Input.Submitted) -> None:
        name = event.value.strip()
        wrong = "" if name else "Enter a name."
        wrong = "There is a context of this name already." if name in self.taken else wrong
        self.query_one(Field).say(wrong)
        if not wrong:
            self.dismiss(name)


class SureDialog(Dialog[bool]):
    """A question before something is lost."""

    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("y,enter", "answer(True)", "Yes"),
        Binding("n", "answer(False)", "No"),
    ]
    keys_text = "Enter yes · Esc no"

    def __init__(self, title: str, question: str) -> None:
        super().__init__()
        self.title_text = title
        self.question = question

    def compose_body(self) -> ComposeResult:
        """The question, and its answers to click."""
        yield Static(Content(f"{self.question}\n"))
        yield Static(buttons([("answer(True)", "Yes"), ("answer(False)", "No")]))

    def action_answer(self, is_sure: bool) -> None:
        """Give the answer."""
        self.dismiss(is_sure)


class OpenDialog(Dialog[Path]):
    """Which file of contexts to open; names are completed as one types."""

    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("tab", "complete", "Complete", priority=True),
        Binding("down", "move(1)", "Down", show=False),
        Binding("up", "move(-1)", "Up", show=False),
        Binding("pagedown", "move(8)", "Page down", show=False),
        Binding("pageup", "move(-8)", "Page up", show=False),
    ]
    DEFAULT_CSS = """
    OpenDialog { & #dialog-body { height: auto; } & LineList { height: 12; margin: 1 0 0 0; } }
    """
    title_text = "Open a file of contexts"
    keys_text = "Enter open · Tab complete · ↑↓ choose · Esc cancel"

    def __init__(self, folder: Path) -> None:
        super().__init__()
        self.folder = folder
        self.names: list[str] = []
        self.is_chosen = False
        """Whether the list was moved in since the last letter: Enter then takes its line."""

    def compose_body(self) -> ComposeResult:
        """The path, and what it may go on to be."""
        yield Field("File", Input(id="open-path", compact=True), "Saved contexts (.cases.csv), or recorded ones.", key="path")
        yield LineList([ListColumn(f"In {self.folder}", 20, 1)], empty="No such file.", id="open-names")

    def on_mount(self) -> None:
        """Show what there is."""
        self.query_one("#open-names", LineList).can_focus = False
        self.query_one("#open-path", Input).focus()
        self._show("")

    @on(Input.Changed, "#open-path")
    def _typed(self, event: Input.Changed) -> None:
        self._show(event.value)

    def _show(self, text: str) -> None:
        self.is_chosen = False
        self.names = completions(text, self.folder, CONTEXT_SUFFIXES)
        self.query_one("#open-names", LineList).show(len(self.names), lambda at: (self.names[at],))
        self.query_one("#field-path", Field).say("")

    def action_move(self, down: int) -> None:
        """Move in the list."""
        self.is_chosen = True
        self.query_one("#open-names", LineList).action_move(down)

    def action_complete(self) -> None:
        """Write as much of the name as is certain, or the chosen one."""
        entry, names = self.query_one("#open-path", Input), self.query_one("#open-names", LineList)
        if self.names:
            self._write(self.names[names.index] if self.is_chosen else common_start(self.names, entry.value))

    def _write(self, text: str) -> None:
        entry = self.query_one("#open-path", Input)
        entry.value = text
        entry.cursor_position = len(text)

    @on(LineList.Chosen)
    def _clicked(self, event: LineList.Chosen) -> None:
        self._take(self.names[event.index])

    @on(Input.Submitted)
    def _submitted(self, event: Input.Submitted) -> None:
        is_list = self.names and (self.is_chosen or not event.value.strip() or event.value.endswith("/"))
        self._take(self.names[self.query_one("#open-names", LineList).index] if is_list else event.value)

    def _take(self, text: str) -> None:
        path = resolved(text, self.folder)
        try:
            is_folder, is_file = path.is_dir(), path.is_file()
        except (OSError, ValueError):
            is_folder = is_file = False
        if is_folder:
            self._write(text if text.endswith("/") else f"{text}/")
        elif is_file and text.lower().endswith(CONTEXT_SUFFIXES):
            self.dismiss(path)
        else:
            wrong = f"Contexts are in {', '.join(CONTEXT_SUFFIXES)} files." if is_file else "There is no such file."
            self.query_one("#field-path", Field).say(wrong)
