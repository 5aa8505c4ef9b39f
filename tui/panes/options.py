"""The tab Options: the settings of the table, each with what it means, and the condition of the column under the cursor.

Whatever is picked or typed becomes an edit at once, one step of the sheet's history. What is invalid stays in its field with
the reason.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, ClassVar, get_args

from rich.markup import escape
from textual import on
from textual.app import ComposeResult
from textual.binding import Binding, BindingType
from textual.containers import Vertical
from textual.content import Content
from textual.events import DescendantBlur
from textual.suggester import SuggestFromList
from textual.widget import Widget
from textual.widgets import Input, Select, Static
from textual.widgets.selection_list import Selection

from contextdb.cells.kinds import KINDS
from contextdb.edits import edits
from contextdb.errors import ContextDBError
from contextdb.schema.jobs import PlainJob
from contextdb.schema.sections import has_place
from contextdb.schema.shapes import POLICIES
from contextdb.tables.changes import Edit
from contextdb.tables.condition_column import ConditionColumn
from tui.messages import Edited
from tui.model.condition_form import ConditionForm, plain
from tui.model.options import OPTIONS, POLICY_WORDS, columns_for, with_expression
from tui.model.sheet import Sheet
from tui.panes.pane import Pane
from tui.widgets.field import Field
from tui.widgets.pick import Pick
from tui.widgets.ticks import TickList

WIDE = 120
"""From so many columns on the condition is next to the table's settings."""

_BY_COLUMN = ("asset", *get_args(PlainJob))
_FORM = {
    "min": "minimum",
    "max": "maximum",
    "unit": "unit",
    "values": "values",
    "mirror": "mirror",
    "weight": "weight",
    "description": "description",
}
"""The keys of a condition that are typed, and the fields of the form that hold them."""


class OptionsPane(Pane):
    """The settings of a sheet's table."""

    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("down", "app.focus_next", "Next field; a choice: open its list", show=False),
        Binding("up", "app.focus_previous", "Previous field; a choice: open its list", show=False),
        Binding("escape", "put_back", "Reset", show=False),
    ]

    DEFAULT_CSS = """
    OptionsPane {
        layout: vertical; overflow-y: auto; height: 1fr; background: $surface;
        & > .options--part { height: auto; padding: 0 1; width: 1fr; }
        &.-wide { layout: horizontal; }
        & .options--title { color: $text; margin: 0 0 1 0; height: auto; }
        & #options-condition { margin: 1 0 0 0; }
        &.-wide #options-condition { margin: 0; }
        & Field { margin: 0 0 1 0; }
        & #options-assume { height: auto; }
    }
    """

    def __init__(self, sheet: Sheet, *, id: str | None = None) -> None:  # noqa: A002
        super().__init__(id=id)
        self.sheet = sheet
        self._condition = ""
        """The condition that is shown."""
        self._shown = -1
        """The version of the sheet that is shown."""

    def compose(self) -> ComposeResult:
        """The table's settings, and the condition's."""
        with Vertical(id="options-table", classes="options--part"):
            yield Static(id="options-title", classes="options--title")
            for option in OPTIONS:
                yield Field(option.label, self._control(option.key), option.meaning, option.key)
        with Vertical(id="options-condition", classes="options--part"):
            yield Static(id="condition-title", classes="options--title")
            kinds = [(f"{name:<8}{kind.words}", name) for name, kind in KINDS.items()]
            yield Field("Type", Pick(kinds, compact=True, allow_blank=False, id="condition-type"), "What a fact of it is.", "type")
            yield Field(
                "Least",
                Input(compact=True, placeholder="no bound", id="condition-min"),
                "The least number. Empty: no bound.",
                "min",
            )
            yield Field(
                "Most",
                Input(compact=True, placeholder="no bound", id="condition-max"),
                "The greatest number. Empty: no bound.",
                "max",
            )
            yield Field(
                "Unit", Input(compact=True, placeholder="none", id="condition-unit"), "Such as m/s: shown in the header.", "unit"
            )
            meaning = "The names there are, with spaces between them; one with a space in it in quotes."
            yield Field("Values", Input(compact=True, placeholder="none", id="condition-values"), meaning, "values")
            meaning = "For clips played mirrored: negate, none, or names that change places, such as Left = Right."
            yield Field("Mirror", Input(compact=True, placeholder="none", id="condition-mirror"), meaning, "mirror")
            meaning = 'What a cell counts where the policy is "specific": 2 as much as two other cells, 0 nothing.'
            yield Field("Weight", Input(compact=True, placeholder="1", id="condition-weight"), meaning, "weight")
            yield Field(
                "Description",
                Input(compact=True, placeholder="none", id="condition-description"),
                "One sentence for whoever fills cells.",
                "description",
            )

    def _control(self, key: str) -> Widget:
        if key == "policy":
            words = [(f"{policy:<10}{POLICY_WORDS[policy]}", policy) for policy in POLICIES]
            return Pick(words, compact=True, allow_blank=False, id="option-policy")
        if key == "outputs":
            return TickList(compact=True, id="option-outputs")
        if key == "fallback":
            return Input(compact=True, placeholder="none", id="option-fallback")
        if key == "assume":
            return Vertical(Input(compact=True), id="options-assume")
        return Pick[str]([], compact=True, prompt="none", id=f"option-{key}")

    # ---- show

    def on_mount(self) -> None:
        """Show the table."""
        self.show()

    def on_show(self) -> None:
        """The tab is opened: the cursor may be elsewhere."""
        self.show()

    def on_resize(self) -> None:
        """Put the condition next to the settings where there is room."""
        self.set_class(self.size.width >= WIDE, "-wide")

    def show(self) -> None:
        """The sheet has changed: show it as it is now. What was typed and not taken is gone then."""
        if self._shown == self.sheet.version:
            return
        self._shown = self.sheet.version
        with self.prevent(Select.Changed, TickList.SelectedChanged):
            self._show_table()
            self._show_condition()

    def _show_table(self) -> None:
        table = self.sheet.table
        settings = table.settings
        title = Content.assemble(
            ("Table ", "bold"), (settings.name, "bold"), (f"  {table.path.name}" if table.path else "", "$text-muted")
        )
        self.query_one("#options-title", Static).update(title)
        self.query_one("#option-policy", Select).value = settings.policy
        first = table.columns[0].name if table.columns else ""
        self.query_one("#option-asset", Select).prompt = escape(f"the first column: {first}")
        for key in _BY_COLUMN:
            _show_column(self.query_one(f"#option-{key}", Select), columns_for(table, key), getattr(settings, key))
        outputs = self.query_one("#option-outputs", TickList)
        highlighted = outputs.highlighted
        outputs.clear_options()
        outputs.add_options([Selection(Content(name), name, name in settings.outputs) for name in columns_for(table, "outputs")])
        outputs.highlighted = highlighted
        outputs.display = outputs.option_count > 0
        self._field("outputs").say(meaning=self._outputs_meaning(outputs.option_count))
        fallback = self.query_one("#option-fallback", Input)
        fallback.value = settings.fallback or ""
        fallback.suggester = SuggestFromList(table.text_column(table.asset_column).texts, case_sensitive=False)
        is_row = settings.fallback is None or settings.fallback in table.text_column(table.asset_column).texts
        meaning = next(option.meaning for option in OPTIONS if option.key == "fallback")
        self._field("fallback").say(meaning=meaning if is_row else f"{meaning} No row of this table has it.")
        self._show_assumptions([*settings.assume, ""])

    def _outputs_meaning(self, n_columns: int) -> str:
        meaning = next(option.meaning for option in OPTIONS if option.key == "outputs")
        return meaning if n_columns else f"{meaning} All columns here are declared as conditions, or have another job."

    def _show_assumptions(self, texts: list[str]) -> None:
        box = self.query_one("#options-assume", Vertical)
        inputs = list(box.query(Input))
        for extra in inputs[len(texts) :]:
            extra.remove()
        new = [Input(compact=True) for _ in texts[len(inputs) :]]
        if new:
            box.mount(*new)
        for field, text in zip([*inputs, *new], texts, strict=False):
            field.value = text
            field.placeholder = "" if text else "another one" if len(texts) > 1 else "none"
        self._field("assume").say()

    def _show_condition(self) -> None:
        column = self._column()
        part = self.query_one("#options-condition")
        part.display = column is not None
        if column is None:
            return
        self._condition = column.condition.name
        note = "" if column.condition.is_declared else "  not declared: the type is a guess from its cells"
        self.query_one("#condition-title", Static).update(
            Content.assemble(("Condition ", "bold"), (self._condition, "bold"), (note, "$text-warning"))
        )
        form = ConditionForm.of(column.condition)
        self.query_one("#condition-type", Select).value = form.kind
        self.query_one("#condition-mirror", Input).placeholder = "negate" if KINDS[form.kind].is_circular else "none"
        for key, name in _FORM.items():
            self.query_one(f"#condition-{key}", Input).value = getattr(form, name)
            self._field(key).display = has_place(key, form.kind)
            self._field(key).say()
        self._field("type").say()

    def _column(self) -> ConditionColumn | None:
        """The condition under the cursor, else the one shown last, else the first."""
        conditions = {c.condition.name: c for c in self.sheet.table.conditions}
        at = min(self.sheet.selection.column, self.sheet.shape[1] - 1)
        under = self.sheet.condition(at) if at >= 0 else None
        return under or conditions.get(self._condition) or next(iter(conditions.values()), None)

    def _field(self, key: str) -> Field:
        return self.query_one(f"#field-{key}", Field)

    def take_focus(self) -> None:
        """Give the keys to the first field."""
        self.query_one("#option-policy").focus()

    # ---- edit

    @on(Select.Changed)
    def _picked(self, event: Select.Changed) -> None:
        event.stop()
        key = (event.select.id or "").partition("-")[2]
        value = None if event.select.is_blank() else event.select.value
        if event.select.id == "condition-type":
            self._set_condition("type")
        elif key:
            self._set_setting(key, value)

    @on(TickList.SelectedChanged)
    def _ticked(self, event: TickList.SelectedChanged[str]) -> None:
        event.stop()
        chosen = set(event.selection_list.selected)
        names = [c.name for c in self.sheet.table.columns if c.name in chosen]
        if set(self.sheet.table.settings.outputs) != chosen:
            self._set("outputs", lambda: edits.set_outputs(self.sheet.table, names))

    @on(Input.Submitted)
    def _typed(self, event: Input.Submitted) -> None:
        event.stop()
        self._take(event.input)

    def on_descendant_blur(self, event: DescendantBlur) -> None:
        """What was typed holds when the field is left too."""
        if isinstance(event.widget, Input):
            self._take(event.widget)

    def _take(self, field: Input) -> None:
        section, _, key = (field.id or "").partition("-")
        if section == "condition":
            self._set_condition(key)
        elif section == "option":
            self._set_setting(key, field.value.strip() or None)
        elif field.parent is not None and field.parent.id == "options-assume":
            inputs = list(self.query_one("#options-assume").query(Input))
            assume = list(self.sheet.table.settings.assume)
            self._set_setting("assume", with_expression(assume, inputs.index(field), field.value))

    def _set_setting(self, key: str, value: Any) -> None:
        if value == getattr(self.sheet.table.settings, key):
            self._field(key).say()
            return
        is_fallback = key == "fallback"
        self._set(
            key,
            lambda: (
                edits.set_fallback(self.sheet.table, value) if is_fallback else edits.set_settings(self.sheet.table, **{key: value})
            ),
        )

    def _set(self, key: str, edit: Callable[[], Edit]) -> None:
        """Apply an edit, or say under its field why it cannot be."""
        try:
            self._apply(edit())
        except ContextDBError as error:
            self._field(key).say(plain(error.faults[0]))

    def _set_condition(self, key: str) -> None:
        """Declare the condition as the form says, when it says something else than before."""
        column = self._column()
        if column is None or self._condition != column.condition.name:
            return
        before, form = ConditionForm.of(column.condition), self._form()
        if key == "type":
            form = form.of_kind(form.kind)
        for other in _FORM:
            self._field(other).display = has_place(other, form.kind)
        said, wrong = form.declared()
        for field in ("type", *_FORM):
            self._field(field).say(wrong.get(field, ""))
        if wrong or form == before:
            return
        plainly = {name: said.get(name) for name in ("type", *_FORM)}
        try:
            self._apply(edits.set_condition(self.sheet.table, self._condition, **plainly))
        except ContextDBError as error:
            self._field(key).say(plain(error.faults[0]))

    def _form(self) -> ConditionForm:
        texts = {name: self.query_one(f"#condition-{key}", Input).value for key, name in _FORM.items()}
        return ConditionForm(str(self.query_one("#condition-type", Select).value), **texts)

    def _apply(self, edit: Edit) -> None:
        done = self.sheet.apply(edit)
        self.show()
        if done.name:
            self.post_message(Edited(done))

    def action_put_back(self) -> None:
        """Forget what was typed and not taken."""
        self._shown = -1
        self.show()


def _show_column(select: Select[str], names: list[str], value: str | None) -> None:
    select.set_options([(Content(name), name) for name in names])
    select.value = value if value in names else Select.NULL
