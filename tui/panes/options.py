"""The tab Options: the settings of the table, each with what it means, and the condition of the column under the cursor.

Whatever is picked or typed becomes an edit at once, one step of the sheet's history. What is invalid stays in its field with
the reason.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, ClassVar

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
from contextdb.files.settings import Settings
from contextdb.schema.policies import POLICIES
from contextdb.schema.sections import has_place
from contextdb.schema.table_settings import JOBS
from contextdb.tables.changes import Edit
from contextdb.tables.condition_column import ConditionColumn

from ..messages import Edited
from ..model.condition_form import TYPED, ConditionForm, plain
from ..model.options import CONDITION_OPTIONS, OPTIONS, columns_for, with_expression
from ..model.sheet import Sheet
from ..widgets.field import Field
from ..widgets.pick import Pick
from ..widgets.ticks import TickList
from .pane import Pane

WIDE = 120
"""From so many columns on the condition is next to the table's settings."""


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
        """The condition that is displayed."""
        self._displayed_version = -1
        """The version of the sheet that is displayed."""
        self._added: set[tuple[str, str]] = {("table", "policy"), ("table", "asset"), ("condition", "type")}
        """Fields that are seen also where nothing is set: their part, and what they set."""

    def compose(self) -> ComposeResult:
        with Vertical(id="options-table", classes="options--part"):
            yield Static(id="options-title", classes="options--title")
            for key, option in OPTIONS.items():
                yield Field(option.label, self._control(key), option.meaning, key)
            yield Pick[str]([], compact=True, prompt="Add a setting", id="add-table")
        with Vertical(id="options-condition", classes="options--part"):
            yield Static(id="condition-title", classes="options--title")
            for key, option in CONDITION_OPTIONS.items():
                yield Field(option.label, self._condition_control(key), option.meaning, key)
            yield Pick[str]([], compact=True, prompt="Add to the condition", id="add-condition")

    def _condition_control(self, key: str) -> Widget:
        if key == "type":
            kinds = [(f"{name:<8}{kind.words}", name) for name, kind in KINDS.items()]
            return Pick(kinds, compact=True, allow_blank=False, id="condition-type")
        return Input(compact=True, placeholder=CONDITION_OPTIONS[key].without, id=f"condition-{key}")

    def _control(self, key: str) -> Widget:
        if key == "policy":
            choices = [(f"{word:<10}{kind.words}", word) for word, kind in POLICIES.items()]
            return Pick(choices, compact=True, allow_blank=False, id=f"option-{key}")
        if key == "outputs":
            return TickList(compact=True, id="option-outputs")
        if key == "assume":
            return Vertical(Input(compact=True), id="options-assume")
        if key in JOBS:
            return Pick[str]([], compact=True, prompt="none", id=f"option-{key}")
        return Input(compact=True, placeholder="none", id=f"option-{key}")

    # ---- show

    def on_mount(self) -> None:
        self.show()

    def on_show(self) -> None:
        """The tab is opened: the cursor may be elsewhere."""
        self.show()

    def on_resize(self) -> None:
        """Put the condition next to the settings where there is room."""
        self.set_class(self.size.width >= WIDE, "-wide")

    def show(self) -> None:
        """The sheet has changed: show it as it is now. What was typed and not taken is gone then."""
        if self._displayed_version == self.sheet.version:
            return
        self._displayed_version = self.sheet.version
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
        first = table.columns[0].name if table.columns else ""
        self.query_one("#option-asset", Select).prompt = escape(f"the first column: {first}")
        for key, option in OPTIONS.items():
            value = getattr(settings, key)
            if key in JOBS:
                _show_column(self.query_one(f"#option-{key}", Select), columns_for(table, key), value)
            elif option.shape.words:
                self.query_one(f"#option-{key}", Select).value = value
            elif key not in ("outputs", "assume"):
                self.query_one(f"#option-{key}", Input).value = value or ""
        outputs = self.query_one("#option-outputs", TickList)
        highlighted = outputs.highlighted
        outputs.clear_options()
        outputs.add_options([Selection(Content(name), name, name in settings.outputs) for name in columns_for(table, "outputs")])
        outputs.highlighted = highlighted
        outputs.display = outputs.option_count > 0
        self._field("outputs").say(meaning=self._outputs_meaning(outputs.option_count))
        fallback = self.query_one("#option-fallback", Input)
        fallback.suggester = SuggestFromList(table.text_column(table.asset_column).texts, case_sensitive=False)
        is_row = settings.fallback is None or settings.fallback in table.text_column(table.asset_column).texts
        meaning = OPTIONS["fallback"].meaning
        self._field("fallback").say(meaning=meaning if is_row else f"{meaning} No row of this table has it.")
        self._show_assumptions([*settings.assume, ""])
        self._show_set("table", OPTIONS, lambda key: getattr(settings, key))

    def _show_set(self, part: str, options: Settings, value: Callable[[str], object]) -> None:
        """Show the fields in which something is set, and offer the others; one that was seen stays, to be filled again."""
        self._added |= {(part, key) for key in options if value(key)}
        missing = [key for key in options if (part, key) not in self._added and self._has_place(part, key)]
        for key in options:
            self._field(key, part).display = (part, key) in self._added and self._has_place(part, key)
        add = self.query_one(f"#add-{part}", Select)
        add.set_options([(Content(f"{options[key].label}: {options[key].meaning}"), key) for key in missing])
        add.display = bool(missing)

    def _has_place(self, part: str, key: str) -> bool:
        return part == "table" or key == "type" or has_place(key, str(self.query_one("#condition-type", Select).value))

    @on(Select.Changed, "#add-table")
    @on(Select.Changed, "#add-condition")
    def _add(self, event: Select.Changed) -> None:
        """Show one more field, and go into it."""
        event.stop()
        part = (event.select.id or "").partition("-")[2]
        if event.select.is_blank():
            return
        key = str(event.value)
        self._added.add((part, key))
        with self.prevent(Select.Changed):
            self._show_sets()
        field = self._field(key, part)
        next(one for one in field.query(Widget) if one.focusable).focus()

    def _show_sets(self) -> None:
        self._show_set("table", OPTIONS, lambda key: getattr(self.sheet.table.settings, key))
        column = self._column()
        if column is not None:
            form = ConditionForm.of(column.condition)
            self._show_set("condition", CONDITION_OPTIONS, lambda key: getattr(form, key) if key in TYPED else True)

    def _outputs_meaning(self, n_columns: int) -> str:
        meaning = OPTIONS["outputs"].meaning
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
        if self._condition != column.condition.name:
            self._added = {one for one in self._added if one[0] == "table" or one[1] == "type"}
        self._condition = column.condition.name
        note = "" if column.condition.is_declared else "  not declared: the type is a guess from its cells"
        self.query_one("#condition-title", Static).update(
            Content.assemble(("Condition ", "bold"), (self._condition, "bold"), (note, "$text-warning"))
        )
        form = ConditionForm.of(column.condition)
        self.query_one("#condition-type", Select).value = form.kind
        self.query_one("#condition-mirror", Input).placeholder = "negate" if KINDS[form.kind].is_circular else "none"
        for key in TYPED:
            self.query_one(f"#condition-{key}", Input).value = getattr(form, key)
            self._field(key, "condition").say()
        self._field("type", "condition").say()
        self._show_set("condition", CONDITION_OPTIONS, lambda key: getattr(form, key) if key in TYPED else True)

    def _column(self) -> ConditionColumn | None:
        """The condition under the cursor, else the one displayed last, else the first."""
        conditions = {c.condition.name: c for c in self.sheet.table.conditions}
        at = min(self.sheet.selection.column, self.sheet.shape[1] - 1)
        under = self.sheet.condition(at) if at >= 0 else None
        return under or conditions.get(self._condition) or next(iter(conditions.values()), None)

    def _field(self, key: str, part: str = "table") -> Field:
        return self.query_one(f"#options-{part} #field-{key}", Field)

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
        elif (event.select.id or "").startswith("option-"):
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
        self._added.add(("condition", key))
        self._show_sets()
        declared, wrong = form.declared()
        for field in ("type", *TYPED):
            self._field(field, "condition").say(wrong.get(field, ""))
        if wrong or form == before:
            return
        plainly = {name: declared.get(name) for name in ("type", *TYPED)}
        try:
            self._apply(edits.set_condition(self.sheet.table, self._condition, **plainly))
        except ContextDBError as error:
            self._field(key, "condition").say(plain(error.faults[0]))

    def _form(self) -> ConditionForm:
        texts = {key: self.query_one(f"#condition-{key}", Input).value for key in TYPED}
        return ConditionForm(str(self.query_one("#condition-type", Select).value), **texts)

    def _apply(self, edit: Edit) -> None:
        done = self.sheet.apply(edit)
        self.show()
        if done.name:
            self.post_message(Edited(done))

    def action_put_back(self) -> None:
        """Forget what was typed and not taken."""
        self._displayed_version = -1
        self.show()


def _show_column(select: Select[str], names: list[str], value: str | None) -> None:
    select.set_options([(Content(name), name) for name in names])
    select.value = value if value in names else Select.NULL
