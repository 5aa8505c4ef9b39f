"""Small dialogs: ask for a line of text, let one choose from a list, or ask a question with an answer on each key."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import ClassVar

from rich.text import Text
from textual.app import ComposeResult
from textual.binding import Binding, BindingType
from textual.widgets import Input, OptionList, Static
from textual.widgets.option_list import Option

from ..widgets.cursor_lines import FIRST_LAST, UP_DOWN
from ..widgets.list_filter import ListFilter
from .dialog import Answer, Dialog, buttons


class AskDialog(Dialog[str]):
    """Ask for one line of text. `check` says what is wrong with it, or nothing."""

    DEFAULT_CSS = """
    AskDialog > #dialog > #dialog-body > Input { margin: 1 0; }
    AskDialog #ask-fault { color: $text-error; height: auto; }
    """
    keys_text = "Enter OK · Esc cancel"

    def __init__(self, title: str, question: str, text: str, check: Callable[[str], str]) -> None:
        super().__init__()
        self.title_text = title
        self._question, self._text, self._check = question, text, check

    def compose_body(self) -> ComposeResult:
        yield Static(Text(self._question))
        yield Input(self._text, compact=True)
        yield Static(id="ask-fault")

    def on_mount(self) -> None:
        self.query_one(Input).focus()

    def on_input_changed(self) -> None:
        self.query_one("#ask-fault", Static).update("")

    def on_input_submitted(self, event: Input.Submitted) -> None:
        event.stop()
        fault = self._check(event.value)
        if fault:
            self.query_one("#ask-fault", Static).update(Text(f"! {fault}"))
        else:
            self.dismiss(event.value)


class ChooseDialog(Dialog[int]):
    """Choose one of some lines; what is typed filters them. Gives the number of the line."""

    DEFAULT_CSS = """
    ChooseDialog OptionList { height: auto; max-height: 60vh; border: none; background: $surface; margin-top: 1; }
    """
    BINDINGS: ClassVar[list[BindingType]] = [
        *UP_DOWN,
        *FIRST_LAST,
        Binding("pageup", "move(-10)", "Page up", show=False),
        Binding("pagedown", "move(10)", "Page down", show=False),
    ]
    keys_text = "↑↓ choose · Enter OK · Esc cancel"

    def __init__(self, title: str, lines: Sequence[str], chosen: int = 0, about: str = "") -> None:
        """`about`: what one should know before choosing."""
        super().__init__()
        self.title_text, self._about = title, about
        self._lines = list(lines)
        self._chosen = chosen

    def compose_body(self) -> ComposeResult:
        if self._about:
            yield Static(Text(f"{self._about}\n"))
        yield ListFilter(compact=True, placeholder="type to filter")
        yield OptionList()

    def on_mount(self) -> None:
        self._show("", self._chosen)
        self.query_one(Input).focus()

    def _show(self, word: str, chosen: int | None = None) -> None:
        options = self.query_one(OptionList)
        options.clear_options()
        matching = [i for i, line in enumerate(self._lines) if word.casefold() in line.casefold()]
        options.add_options([Option(Text(self._lines[i]), id=str(i)) for i in matching])
        if matching:
            options.highlighted = matching.index(chosen) if chosen in matching else 0

    def action_move(self, by: int) -> None:
        options = self.query_one(OptionList)
        if options.option_count:
            options.highlighted = max(0, min((options.highlighted or 0) + by, options.option_count - 1))

    def on_input_changed(self, event: Input.Changed) -> None:
        event.stop()
        self._show(event.value)

    def on_input_submitted(self, event: Input.Submitted) -> None:
        event.stop()
        options = self.query_one(OptionList)
        if options.highlighted is not None:
            self._take(options.get_option_at_index(options.highlighted))

    def on_option_list_option_selected(self, event: OptionList.OptionSelected) -> None:
        event.stop()
        self._take(event.option)

    def _take(self, option: Option) -> None:
        self.dismiss(int(option.id or 0))


class StepsDialog(ChooseDialog):
    """The undo history: every step by its name, where one is, and what is on the disk. Gives how many steps shall lie behind."""

    keys_text = "↑↓ choose · Enter go there · Esc cancel"

    def __init__(self, names: Sequence[str], position: int) -> None:
        texts = ["the table as it was opened", *names]
        lines = [f"{_sign(i, position)} {i:>4}  {text}" for i, text in enumerate(texts)]
        super().__init__("Undo history", lines, position, about="▶ where the table is · ↷ undone")


def _sign(step: int, position: int) -> str:
    if step == position:
        return "▶"
    return " " if step < position else "↷"


class Question(Dialog[Answer]):
    """A text, and its answers to click; children bind the keys of `answer(...)`."""

    def __init__(self, title: str, text: str, answers: Sequence[tuple[str, str]]) -> None:
        """`answers` are actions of the screen with their labels."""
        super().__init__()
        self.title_text, self._text, self._answers = title, text, answers

    def compose_body(self) -> ComposeResult:
        yield Static(Text(f"{self._text}\n"))
        yield Static(buttons(self._answers))

    def action_answer(self, answer: Answer) -> None:
        self.dismiss(answer)


class SureDialog(Question[bool]):
    """A question before something is lost."""

    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("y,enter", "answer(True)", "Yes"),
        Binding("n", "answer(False)", "No"),
    ]
    keys_text = "Enter yes · Esc no"

    def __init__(self, title: str, question: str) -> None:
        super().__init__(title, question, [("answer(True)", "Yes"), ("answer(False)", "No")])
