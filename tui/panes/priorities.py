"""The tab Priorities: databases in order with their thresholds, and what wins for the context of the test row."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import ClassVar

import numpy as np
from textual import on
from textual.app import ComposeResult
from textual.binding import Binding, BindingType
from textual.containers import Horizontal, Vertical
from textual.content import Content
from textual.widget import Widget
from textual.widgets import Button, Input, OptionList, Select, Static
from textual.widgets.option_list import Option

from contextdb.authoring.weights import set_selector
from contextdb.errors import ContextDBError, Fault, plural, safe_text

from ..messages import Edited, Notice
from ..model.priorities import (
    EXAMPLE,
    DatabaseNow,
    Order,
    Priorities,
    SelectorNow,
    moved,
    with_database,
    with_threshold,
    without_database,
)
from ..model.sheet import Sheet
from ..widgets.pick import Pick
from .pane import Pane
from .rows_below import RowsBelow

NO_DATABASES = (
    "A database is a set of clips to search. A selector puts databases in order: the best frame of one wins outright when its cost "
    "is under its threshold; otherwise the next is searched too, and the cheapest plays. Declare them in contextdb.toml:"
)
NO_SELECTORS = "No selector puts the databases of this project in order. Declare one in contextdb.toml:"

TOOLS = {"threshold": "Threshold", "up": "Up", "down": "Down", "add": "Add", "remove": "Remove"}


class PrioritiesPane(Pane):
    """The selectors of a sheet's project."""

    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("t,f2", "threshold", "Threshold"),
        Binding("u,ctrl+up", "move(-1)", "Move up"),
        Binding("d,ctrl+down", "move(1)", "Move down"),
        Binding("a,insert", "add", "Add"),
        Binding("delete,x", "remove", "Remove"),
        Binding("escape", "close", "Close", show=False),
    ]

    DEFAULT_CSS = """
    PrioritiesPane {
        layout: vertical; height: 1fr; overflow-y: auto; background: $surface;
        & #priorities-context { height: auto; padding: 0 1; color: $text-muted; }
        & #priorities-list { height: auto; max-height: 50vh; border: none; padding: 0 1; background: transparent; margin: 1 0 0 0; }
        & #priorities-list > .option-list--option-disabled { color: $text; }
        & #priorities-list > .option-list--option-highlighted { text-style: bold; }
        & #priorities-list:focus > .option-list--option-highlighted { background: $primary 40%; color: $text; text-style: bold; }
        & #priorities-list:focus:ansi > .option-list--option-highlighted { background: ansi_blue; color: ansi_bright_white; }
        & #priorities-detail { height: auto; max-height: 8; padding: 0 1; color: $text-muted; overflow-y: auto; }
        & #priorities-empty { height: auto; padding: 0 1; }
        & #priorities-foot { height: auto; dock: bottom; padding: 0 1; background: $surface; }
        & #priorities-tools { height: 1; }
        & #priorities-entry { height: auto; display: none; }
        & #priorities-entry.-open { display: block; }
        & #priorities-entry Horizontal { height: 1; }
        & #priorities-entry Static { width: auto; padding: 0 1 0 0; }
        & #priorities-entry Input { width: 20; background: $panel; }
        & #priorities-entry Select { width: 40; }
        & #priorities-wrong { color: $text-error; height: auto; }
    }
    """

    def __init__(self, sheet: Sheet, *, id: str | None = None) -> None:  # noqa: A002
        super().__init__(id=id)
        self.sheet = sheet
        self.priorities = Priorities(sheet)
        self.selectors: list[SelectorNow] = []
        self._places: list[tuple[int, int] | None] = []
        """For each line of the list its selector and its place in the order; None for a heading."""

    def compose(self) -> ComposeResult:
        """The selectors, what the highlighted database holds, and what one can do."""
        yield Static(id="priorities-context")
        yield OptionList(id="priorities-list", compact=True)
        yield Static(id="priorities-detail")
        yield RowsBelow(id="priorities-rows")
        yield Static(id="priorities-empty")
        with Vertical(id="priorities-foot"):
            with Vertical(id="priorities-entry"):
                with Horizontal():
                    yield Static(id="priorities-query")
                    yield Input(id="priorities-threshold", compact=True)
                    yield Pick[str]([], id="priorities-database", compact=True, prompt="pick a database")
                yield Static(id="priorities-wrong")
            with Horizontal(id="priorities-tools"):
                for key, label in TOOLS.items():
                    yield Button(label, id=f"priorities-do-{key}", compact=True)

    # ---- show

    def on_mount(self) -> None:
        self.show()

    def on_show(self) -> None:
        """The tab is opened: look again for clips and for other tables."""
        self.priorities.reload()
        self.show()

    def show(self) -> None:
        """The sheet, or a fact of its test row, has changed: show what wins now."""
        faults = self.priorities.faults()
        self.selectors = self.priorities.selectors()
        self._show_list()
        self._show_detail()
        is_empty = not self.selectors
        for name in ("#priorities-list", "#priorities-detail", "#priorities-context", "#priorities-tools"):
            self.query_one(name).display = not is_empty
        empty = self.query_one("#priorities-empty", Static)
        empty.display = is_empty
        empty.update(_faults(faults) if faults else _nothing_yet(list(self.sheet.table.schema.databases)))
        self.query_one("#priorities-context", Static).update(self._query_line())

    def _query_line(self) -> Content:
        query = self.sheet.query
        facts = [f"{name} {text}" for name, text in query.texts.items() if text.strip()]
        if not facts:
            return Content("The test row is empty, so every row counts as valid. Fill it in the tab Assets.")
        return Content.assemble(("For the test row  ", ""), (", ".join(facts), "bold"))

    def _show_list(self) -> None:
        listed = self.query_one("#priorities-list", OptionList)
        before = self._place()
        self._places = []
        options: list[Option] = []
        for at, selector in enumerate(self.selectors):
            self._add(options, None, Content.assemble(("Selector ", ""), (selector.name, "bold")))
            for n, database in enumerate(selector.databases):
                self._add(options, (at, n), _line(n, database, _width(self.selectors)))
            self._add(options, None, Content(f"\n{selector.rule}\n"))
        listed.clear_options()
        listed.add_options(options)
        places = [place for place in self._places if place is not None]
        if places:
            listed.highlighted = self._places.index(before if before in places else places[0])

    def _add(self, options: list[Option], place: tuple[int, int] | None, text: Content) -> None:
        self._places.append(place)
        options.append(Option(text, disabled=place is None))

    def _place(self) -> tuple[int, int] | None:
        at = self.query_one("#priorities-list", OptionList).highlighted
        return self._places[at] if at is not None and at < len(self._places) else None

    @on(OptionList.OptionHighlighted)
    def _highlighted(self, event: OptionList.OptionHighlighted) -> None:
        event.stop()
        self._show_detail()

    def _show_detail(self) -> None:
        chosen = self._chosen()
        self.query_one("#priorities-detail", Static).update(_detail(chosen[0].databases[chosen[1]]) if chosen else "")
        self._show_rows(chosen[0].databases[chosen[1] :] if chosen else ())

    def _show_rows(self, databases: Sequence[DatabaseNow]) -> None:
        """The rows of databases of this table, each database's valid ones first; of the others the cells that fail are marked."""
        below, table, query = self.query_one(RowsBelow), self.sheet.table, self.sheet.query
        own = [one for one in databases if self.priorities.config.databases[one.name].table == table.settings.name]
        if own[:1] != list(databases[:1]):
            own = []
        database_of: dict[int, str] = {}
        for one in own:
            members = set(one.assets)
            rows = [row for row, asset in enumerate(table.assets) if asset in members and row not in database_of]
            database_of |= dict.fromkeys(sorted(rows, key=lambda row: not query.bits >> row & 1), one.name)
        if not database_of:
            below.show_none()
            return
        rows, names = list(database_of), [column.condition.name for column in table.conditions]
        fails = np.nonzero(query.failing(rows))
        tones = {(rows[row], names[column]): "warning" for row, column in zip(*fails, strict=True)}
        tones |= {(row, table.asset_column): "info" for row in rows if database_of[row] == own[0].name}
        then = "".join(f", then of {safe_text(one.name)}" for one in own[1:])
        below.show_rows(table, f"Rows of {safe_text(own[0].name)}{then}: the valid ones first", rows, tones)

    def _chosen(self) -> tuple[SelectorNow, int] | None:
        """The selector and the place in it of the highlighted database."""
        place = self._place()
        if place is None or place[0] >= len(self.selectors) or place[1] >= len(self.selectors[place[0]].databases):
            return None
        return self.selectors[place[0]], place[1]

    def take_focus(self) -> None:
        """Give the keys to the first field."""
        self.query_one("#priorities-list").focus()

    # ---- edit

    def action_threshold(self) -> None:
        """Ask for the threshold of the highlighted database."""
        chosen = self._chosen()
        if chosen is None:
            return
        selector, at = chosen
        database = selector.databases[at]
        if database.threshold is None:
            self.post_message(
                Notice(f"{database.name} is the last: it has no threshold, as nothing follows that it could spare a search.")
            )
            return
        field = self.query_one("#priorities-threshold", Input)
        self._open(f"{database.name} wins outright under", field)
        field.value = f"{database.threshold:g}"
        field.action_select_all()

    @on(OptionList.OptionSelected)
    def _selected(self, event: OptionList.OptionSelected) -> None:
        event.stop()
        self.action_threshold()

    @on(Input.Submitted)
    def _typed(self, event: Input.Submitted) -> None:
        event.stop()
        chosen, value = self._chosen(), _cost(event.value)
        if chosen is None:
            return
        if value is None:
            self._wrong("A cost is a number, such as 0.1.")
            return
        selector, at = chosen
        name = selector.databases[at].name
        self._set(selector, with_threshold(selector.order, at, value), f"Set the threshold of {safe_text(name)}")

    def action_move(self, down: int) -> None:
        """Move the highlighted database up or down."""
        chosen = self._chosen()
        if chosen is None:
            return
        selector, at = chosen
        name = selector.databases[at].name
        if self._set(selector, moved(selector.order, at, down), f"Move {safe_text(name)} {'down' if down > 0 else 'up'}"):
            self._highlight(selector.name, name)

    def action_remove(self) -> None:
        """Take the highlighted database out of its selector."""
        chosen = self._chosen()
        if chosen is None:
            return
        selector, at = chosen
        if len(selector.databases) == 1:
            self.post_message(Notice("A selector has at least one database.", "warning"))
            return
        name = selector.databases[at].name
        self._set(selector, without_database(selector.order, at), f"Remove {safe_text(name)} from {safe_text(selector.name)}")

    def action_add(self) -> None:
        """Ask for a database to put before the highlighted one."""
        chosen = self._chosen()
        if chosen is None:
            return
        unused = self.priorities.unused(chosen[0])
        if not unused:
            self.post_message(
                Notice("Every database of the same features is in the selector already. Declare another in contextdb.toml.")
            )
            return
        select = self.query_one("#priorities-database", Select)
        with self.prevent(Select.Changed):
            select.set_options([(Content(name), name) for name in unused])
        self._open("Put before it", select)
        select.action_show_overlay()

    @on(Select.Changed)
    def _picked(self, event: Select.Changed) -> None:
        event.stop()
        chosen = self._chosen()
        if chosen is None or event.select.is_blank():
            return
        (selector, at), name = chosen, str(event.select.value)
        if self._set(selector, with_database(selector.order, at, name), f"Add {safe_text(name)} to {safe_text(selector.name)}"):
            self._highlight(selector.name, name)
            self.action_threshold()

    @on(Button.Pressed)
    def _pressed(self, event: Button.Pressed) -> None:
        event.stop()
        actions: dict[str, Callable[[], None]] = {
            "priorities-do-threshold": self.action_threshold,
            "priorities-do-up": lambda: self.action_move(-1),
            "priorities-do-down": lambda: self.action_move(1),
            "priorities-do-add": self.action_add,
            "priorities-do-remove": self.action_remove,
        }
        actions[event.button.id or ""]()

    def action_close(self) -> None:
        """Leave a question unanswered."""
        self.query_one("#priorities-entry").remove_class("-open")
        self.query_one("#priorities-list").focus()

    def _open(self, question: str, control: Widget) -> None:
        self.query_one("#priorities-query", Static).update(Content(question))
        self._wrong("")
        for name in ("#priorities-threshold", "#priorities-database"):
            self.query_one(name).display = self.query_one(name) is control
        self.query_one("#priorities-entry").add_class("-open")
        control.focus()

    def _wrong(self, text: str) -> None:
        self.query_one("#priorities-wrong", Static).update(Content(f"✗ {text}") if text else "")

    def _set(self, selector: SelectorNow, order: Order, what: str) -> bool:
        try:
            done = self.sheet.apply(set_selector(self.sheet.table, selector.name, order, what))
        except ContextDBError as error:
            self._wrong(error.faults[0].message)
            return False
        self.action_close()
        self.show()
        if done.name:
            self.post_message(Edited(done))
        return bool(done.name)

    def _highlight(self, selector: str, database: str) -> None:
        for line, place in enumerate(self._places):
            if place is not None:
                one = self.selectors[place[0]]
                if one.name == selector and one.databases[place[1]].name == database:
                    self.query_one("#priorities-list", OptionList).highlighted = line


# ---- texts


def _cost(text: str) -> float | None:
    try:
        value = float(text)
    except ValueError:
        return None
    return value if math.isfinite(value) else None


def _width(selectors: list[SelectorNow]) -> int:
    return min(max(len(safe_text(one.name)) for selector in selectors for one in selector.databases), 36)


def _line(n: int, database: DatabaseNow, width: int) -> Content:
    """A database: its place, its name, its threshold, and how many of its assets are valid."""
    threshold = "searched last" if database.threshold is None else f"wins under {database.threshold:g}"
    count = f"{len(database.valid)} of {plural(len(database.assets), 'asset')} valid" if database.assets else "no assets"
    mark = "●" if database.valid else "○"
    return Content(f"  {n + 1}  {safe_text(database.name, width):<{width}}  {threshold:<18}  {mark} {count}")


def _detail(database: DatabaseNow) -> Content:
    """The valid assets of a database."""
    note = f"  ({database.note})" if database.note else ""
    names = ", ".join(map(safe_text, database.valid[:60])) + (" …" if len(database.valid) > 60 else "")
    assets = names or ("no asset is valid now" if database.assets else "no assets")
    return Content.assemble((f"{safe_text(database.name)}: ", "bold"), assets, note)


def _nothing_yet(databases: list[str]) -> Content:
    if not databases:
        return Content.assemble(NO_DATABASES, "\n\n", (EXAMPLE, "bold"))
    first, *rest = databases
    steps = [f'{{ database = "{name}", threshold = 0.1 }}' for name in rest] + [f'{{ database = "{first}" }}']
    return Content.assemble(NO_SELECTORS, "\n\n", (f"[selectors.main]\norder = [ {', '.join(steps)} ]", "bold"))


def _faults(faults: tuple[Fault, ...]) -> Content:
    text = "\n".join(f"✗ {fault}" for fault in faults)
    return Content.assemble((f"contextdb.toml has {plural(len(faults), 'fault')} in what it says of motion:\n\n", "bold"), text)
