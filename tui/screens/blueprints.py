"""The dialog Blueprints: sets of conditions that tables share. Insert what the table lacks, or keep the selected columns as one.

What it gives back is decided and not yet done: a `BlueprintAnswer`.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar

from textual import on
from textual.app import ComposeResult
from textual.binding import Binding, BindingType
from textual.containers import Horizontal
from textual.content import Content
from textual.widgets import Button, Input, OptionList, Static
from textual.widgets.option_list import Option

from contextdb.edits import edits
from contextdb.edits.edits import NewColumn
from contextdb.errors import safe_text
from contextdb.tables.changes import Edit
from contextdb.tables.table import Table

from ..model.column_choices import Blueprint, Insertion, blueprint_fault, blueprints, conditions_of
from ..widgets.field import Field
from .dialog import Dialog


@dataclass(frozen=True)
class Keep:
    """Keep conditions as a blueprint."""

    name: str
    conditions: tuple[str, ...]

    def edit(self, table: Table) -> Edit:
        """The edit that declares it; saving the table writes it into contextdb.toml."""
        return edits.set_blueprint(table, self.name, self.conditions)


@dataclass(frozen=True)
class Drop:
    """Take a blueprint away; the columns that were made of it stay."""

    name: str

    def edit(self, table: Table) -> Edit:
        """The edit that takes it away."""
        return edits.set_blueprint(table, self.name, None)


BlueprintAnswer = Insertion | Keep | Drop
"""What was decided; each has `edit(table)`."""


class Blueprints(Dialog[BlueprintAnswer]):
    """Shows the blueprints of the project."""

    BINDINGS: ClassVar[list[BindingType]] = [Binding("delete", "drop", "Remove", show=False)]

    DEFAULT_CSS = """
    Blueprints {
        & #blueprint-list { height: auto; max-height: 10; border: none; padding: 0; background: $surface; }
        & #blueprint-list { text-wrap: nowrap; text-overflow: ellipsis; }
        & #blueprint-list > .option-list--option-highlighted { background: $primary 30%; color: $text; text-style: bold; }
        & #blueprint-detail { height: auto; margin: 1 0; color: $text-muted; }
        & #blueprint-buttons { height: 1; margin: 1 0 0 0; }
    }
    """

    title_text = "Blueprints"
    keys_text = "Enter insert what is missing · Del remove · Tab next · Esc cancel"

    def __init__(self, table: Table, selected: Sequence[str], column: int) -> None:
        """`selected` are the names of the selected columns, `column` is that of the cursor."""
        super().__init__(classes="-broad")
        self.table = table
        self.selected = conditions_of(table, selected)
        self.at = min(column + 1, len(table.columns))
        self.blueprints = blueprints(table)

    def compose_body(self) -> ComposeResult:
        """The blueprints, what the highlighted one holds, and the name of a new one."""
        yield OptionList(*(Option(_line(one, self._width)) for one in self.blueprints), id="blueprint-list", compact=True)
        yield Static(id="blueprint-detail")
        what = ", ".join(map(safe_text, self.selected))
        meaning = f"Keeps {what}" if what else "Select columns in the sheet first: the conditions among them are saved."
        yield Field(
            "Keep selection", Input(compact=True, placeholder="name of a new blueprint", id="blueprint-name"), meaning, "keep"
        )
        with Horizontal(id="blueprint-buttons"):
            yield Button("Insert missing", compact=True, id="blueprint-insert")
            yield Button("Keep selection", compact=True, id="blueprint-keep")
            yield Button("Remove", compact=True, id="blueprint-drop")
            yield Button("Cancel", compact=True, id="blueprint-cancel")

    def on_mount(self) -> None:
        listed = self.query_one("#blueprint-list", OptionList)
        listed.display = bool(self.blueprints)
        if self.blueprints:
            listed.highlighted = 0
            listed.focus()
        else:
            self.query_one("#blueprint-name").focus()
        self._show_detail()

    @property
    def _width(self) -> int:
        return min(max((len(safe_text(one.name)) for one in self.blueprints), default=1), 30)

    def _chosen(self) -> Blueprint | None:
        at = self.query_one("#blueprint-list", OptionList).highlighted
        return self.blueprints[at] if at is not None and at < len(self.blueprints) else None

    @on(OptionList.OptionHighlighted)
    def _show_detail(self) -> None:
        chosen, detail = self._chosen(), self.query_one("#blueprint-detail", Static)
        detail.update(
            "There is no blueprint yet. A blueprint is a set of conditions that several tables share."
            if chosen is None
            else _detail(chosen)
        )

    @on(OptionList.OptionSelected)
    def _insert(self) -> None:
        chosen = self._chosen()
        if chosen is not None and chosen.missing:
            self.dismiss(Insertion(self.at, tuple(NewColumn(name) for name in chosen.missing)))

    @on(Input.Submitted)
    def _keep(self) -> None:
        name = self.query_one("#blueprint-name", Input).value
        fault = blueprint_fault(self.table, name, self.selected)
        self.query_one("#field-keep", Field).say(fault)
        if not fault:
            self.dismiss(Keep(name.strip(), tuple(self.selected)))

    def action_drop(self) -> None:
        """Take the highlighted blueprint away."""
        chosen = self._chosen()
        if chosen is not None and not self.query_one("#blueprint-name").has_focus:
            self.dismiss(Drop(chosen.name))

    @on(Button.Pressed)
    def _pressed(self, event: Button.Pressed) -> None:
        actions = {"insert": self._insert, "keep": self._keep, "drop": self.action_drop, "cancel": self.action_cancel}
        actions[(event.button.id or "").removeprefix("blueprint-")]()


def _line(one: Blueprint, width: int) -> Content:
    return Content.assemble((f"{safe_text(one.name, width):<{width}}", "bold"), f"  {one.about}")


def _detail(one: Blueprint) -> Content:
    """Each condition, with a tick where the table has it already."""
    return Content(
        "\n".join(f"[{' ' if name in one.missing else 'x'}] {safe_text(name)}" for name in one.conditions) or "no conditions"
    )
