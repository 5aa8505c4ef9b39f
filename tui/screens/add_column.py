"""The dialog Add Column: a declared condition, what is missing of a blueprint, or a new column.

One field filters what there is and names what is new. Up and Down go through the list, Enter inserts what is highlighted
or goes on to what a new column is; F6 inserts from every field.
"""

from __future__ import annotations

from typing import ClassVar

from textual import on
from textual.app import ComposeResult
from textual.binding import Binding, BindingType
from textual.containers import Horizontal, Vertical
from textual.content import Content
from textual.widgets import Button, Input, OptionList, Select, Static
from textual.widgets.option_list import Option

from contextdb.cells.kinds import KINDS
from contextdb.edits.edits import JOBS
from contextdb.errors import safe_text
from contextdb.schema.sections import has_place
from contextdb.tables.table import Table

from ..model.column_choices import JOB_NAMES, JOB_WORDS, Choice, Insertion, NewColumnForm, choices, places
from ..model.condition_form import ConditionForm
from ..model.layout import cut_middle
from ..widgets.field import Field
from ..widgets.list_filter import ListFilter
from ..widgets.pick import Pick
from .dialog import Dialog

_TYPED = {"min": "Least", "max": "Most", "unit": "Unit", "values": "Values", "description": "Description"}


class AddColumn(Dialog[Insertion]):
    """Asks which columns to insert, and where."""

    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("up", "highlight(-1)", "Up", show=False),
        Binding("down", "highlight(1)", "Down", show=False),
        Binding("home", "end_of_list(False)", "First", show=False),
        Binding("end", "end_of_list(True)", "Last", show=False),
        Binding("f6", "insert", "Insert", show=False, priority=True),
    ]

    DEFAULT_CSS = """
    AddColumn {
        & #dialog-body { overflow-y: auto; }
        & #column-list { height: auto; max-height: 6; border: none; padding: 0; margin: 1 0 0 0; background: $surface; }
        & #column-list { text-wrap: nowrap; text-overflow: ellipsis; }
        &.-tall #column-list { max-height: 12; }
        & #column-about { height: auto; color: $text-muted; margin: 1 0 0 0; }
        & #column-form, & #field-where { margin: 1 0 0 0; }
        & #field-where.-tight { margin: 0; }
        & #column-list > .option-list--option-highlighted { background: $primary 30%; color: $text; text-style: bold; }
        & #column-form { height: auto; }
        & #column-buttons { height: 1; margin: 1 0 0 0; }
        & Field .field--label { width: 13; }
        & Field .field--says { padding: 0 0 0 13; }
    }
    """

    title_text = "Add a column"
    keys_text = "↑↓ Enter choose · F6 insert · Tab next field · Esc cancel"

    def __init__(self, table: Table, column: int) -> None:
        """`column` is that of the cursor."""
        super().__init__(classes="-broad")
        self.table = table
        self.places = places(table, column)
        self.matching: list[Choice | None] = []
        """What the lines of the list are; None: a new column of the typed name."""

    def compose_body(self) -> ComposeResult:
        """What there is, and the form of a new column."""
        yield Field(
            "Name",
            ListFilter(compact=True, id="column-name", placeholder="type to filter, or the name of a new column"),
            key="name",
        )
        yield OptionList(id="column-list", compact=True)
        yield Static(id="column-about")
        with Vertical(id="column-form"):
            width = max(map(len, JOB_WORDS)) + 2
            jobs = [(f"{JOB_NAMES.get(job, job):<{width}}{words}", job) for job, words in JOB_WORDS.items()]
            yield Field("What it is", Pick(jobs, compact=True, allow_blank=False, id="column-job"), key="job")
            kinds = [(f"{name:<8}{kind.words}", name) for name, kind in KINDS.items()]
            yield Field("Type", Pick(kinds, compact=True, allow_blank=False, id="column-type"), key="type")
            for key, label in _TYPED.items():
                placeholder = (
                    "names with spaces between them" if key == "values" else "no bound" if key in ("min", "max") else "none"
                )
                yield Field(label, Input(compact=True, id=f"column-{key}", placeholder=placeholder), key=key)
        where = [(Content(words), at) for words, at in self.places.items()]
        yield Field("Where", Pick(where, compact=True, allow_blank=False, id="column-where"), key="where")
        with Horizontal(id="column-buttons"):
            yield Button("Insert", compact=True, id="column-insert")
            yield Button("Cancel", compact=True, id="column-cancel")

    def on_mount(self) -> None:
        self._filter()
        self.query_one("#column-name").focus()

    # ---- the list

    @on(Input.Changed, "#column-name")
    def _filter(self) -> None:
        text = self.query_one("#column-name", Input).value
        matching = choices(self.table, text)
        is_new = bool(text.strip()) and all(c.is_blueprint or c.name != text.strip() for c in matching)
        self.matching = [*matching, *([None] if is_new or not matching else [])]
        listed = self.query_one("#column-list", OptionList)
        listed.clear_options()
        listed.add_options([Option(_line(choice, text.strip(), self._width)) for choice in self.matching])
        listed.highlighted = 0
        self._show_form()

    @property
    def _width(self) -> int:
        return min(max((len(safe_text(c.name)) for c in self.matching if c), default=8), 30)

    @on(OptionList.OptionHighlighted)
    def _show_form(self) -> None:
        choice, job, kind = self._choice(), self._picked("job"), self._picked("type")
        form, detail = self.query_one("#column-form"), self.query_one("#column-about", Static)
        form.display, detail.display = choice is None, choice is not None
        self._field("where").set_class(choice is None, "-tight")
        detail.update(Content(choice.about if choice is not None else ""))
        self._field("type").display = job == "condition"
        for key in _TYPED:
            self._field(key).display = job == "condition" and has_place(key, kind)

    def _choice(self) -> Choice | None:
        at = self.query_one("#column-list", OptionList).highlighted
        return self.matching[at] if at is not None and at < len(self.matching) else None

    def action_highlight(self, down: int) -> None:
        """Go through the list from the field of the name; elsewhere from field to field."""
        listed = self.query_one("#column-list", OptionList)
        if not self.query_one("#column-name").has_focus:
            (self.focus_next if down > 0 else self.focus_previous)()
        elif listed.option_count:
            listed.highlighted = ((listed.highlighted or 0) + down) % listed.option_count
            self._show_form()

    def action_end_of_list(self, is_last: bool) -> None:
        """Go to the first or the last line of the list."""
        listed = self.query_one("#column-list", OptionList)
        if listed.option_count:
            listed.highlighted = listed.option_count - 1 if is_last else 0

    # ---- the form

    @on(Select.Changed)
    def _changed(self) -> None:
        self._show_form()

    def _picked(self, key: str) -> str:
        return str(self.query_one(f"#column-{key}", Select).value)

    def _field(self, key: str) -> Field:
        return self.query_one(f"#field-{key}", Field)

    def _form(self) -> NewColumnForm:
        name, low, high, unit, values, description = (self.query_one(f"#column-{key}", Input).value for key in ("name", *_TYPED))
        condition = ConditionForm(self._picked("type"), low, high, unit, values, description)
        job = self._picked("job")
        assert job in JOBS
        return NewColumnForm(name, job, condition)

    # ---- the answer

    @on(Input.Submitted)
    def _submitted(self, event: Input.Submitted) -> None:
        """Insert; from the name of a new column one continues to what it is first."""
        if event.input.id == "column-name" and self._choice() is None and event.value.strip():
            self._say()
            self.query_one("#column-job").focus()
        else:
            self.action_insert()

    @on(OptionList.OptionSelected)
    def _selected(self) -> None:
        if self._choice() is None:
            self.query_one("#column-job").focus()
        else:
            self.action_insert()

    @on(Button.Pressed)
    def _pressed(self, event: Button.Pressed) -> None:
        if event.button.id == "column-insert":
            self.action_insert()
        else:
            self.action_cancel()

    def action_insert(self) -> None:
        """Give back what to insert, unless something is wrong with it: that is displayed then."""
        at = int(str(self.query_one("#column-where", Select).value))
        choice = self._choice()
        if choice is not None:
            self.dismiss(Insertion(at, choice.columns))
            return
        column, wrong = self._form().read(self.table)
        self._say(wrong)
        if not wrong:
            self.dismiss(Insertion(at, (column,)))
            return
        next(field for field in self.query(Field) if field.wrong).control.focus()

    def _say(self, wrong: dict[str, str] | None = None) -> None:
        for field in self.query(Field):
            field.say((wrong or {}).get(field.key, ""))


def _line(choice: Choice | None, text: str, width: int) -> Content:
    if choice is None:
        return Content(f'+ New column "{safe_text(text)}"' if text else "+ New column: type its name")
    name = cut_middle(safe_text(choice.name), width)
    return Content.assemble((name, "bold"), f"  {'blueprint, ' if choice.is_blueprint else ''}{choice.about}")
