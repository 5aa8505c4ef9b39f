"""The contexts of a file: look through them, load one into the test row, save the test row, see which do not hold."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray
from rich.cells import cell_len
from textual import events, on, work
from textual.app import ComposeResult
from textual.binding import Binding, BindingType
from textual.content import Content
from textual.message import Message
from textual.widgets import Static
from textual.worker import Worker, get_current_worker

from contextdb.checks.cases import Verdict, mismatch
from contextdb.errors import ContextDBError, in_quotes, plural
from contextdb.tables.table import Table

from ..model.context_list import ContextList, cases_file, summary
from ..widgets.line_list import LineList, ListCell, ListColumn
from .ask import AskDialog, SureDialog
from .context_forms import KeepDialog, OpenDialog, SavedCase
from .dialog import Dialog, buttons

MARKS: Mapping[bool | None, ListCell] = {True: "✓ holds", False: ("✗ fails", "error"), None: ("– open", "muted")}
WIDTHS = (32, 24, 18, 14, 12)
"""How many terminal cells a column of facts has at most: the first with which all of them fit."""

LEAST, GAP = 8, 2

LOOKED_THROUGH = 2000
"""So many contexts are looked through at a time for one without a valid row."""


@dataclass(frozen=True)
class Loaded:
    """What the dialog gives back: the contexts, standing on the one to load. Keep the list: F7 and F8 step through it."""

    contexts: ContextList


class ContextLines(LineList):
    """The contexts; letters typed here filter them."""

    @dataclass
    class Filtered(Message):
        """A letter was typed, or taken back."""

        text: str

    def __init__(self) -> None:
        super().__init__([ListColumn("Name", 12, 1)], empty="No context.", id="contexts-lines")
        self.text = ""

    def on_key(self, event: events.Key) -> None:
        """Letters make the filter longer, Backspace shorter."""
        if event.key == "backspace" and self.text:
            text = self.text[:-1]
        elif event.is_printable and event.character and (self.text or event.character != " "):
            text = self.text + event.character
        else:
            return
        event.stop()
        event.prevent_default()
        self.filter(text)

    def on_paste(self, event: events.Paste) -> None:
        """A text that is pasted filters too."""
        event.stop()
        self.filter(self.text + " ".join(event.text.split()))

    def filter(self, text: str) -> None:
        """Ask for the contexts with this text."""
        self.text = text
        self.post_message(self.Filtered(text))


class ContextsDialog(Dialog[Loaded]):
    """The saved or recorded contexts of a table."""

    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("f2", "rename", "Rename"),
        Binding("f3", "next_without", "Next without a row"),
        Binding("f4,ctrl+o", "open_file", "Open a file"),
        Binding("f5", "update", "Save in this place"),
        Binding("f6,insert", "keep", "Save the test row"),
        Binding("delete", "delete", "Delete"),
    ]
    DEFAULT_CSS = """
    ContextsDialog {
        & > #dialog { width: 96%; max-width: 150; height: 92%; padding: 0 1; }
        & > #dialog > #dialog-body { height: 1fr; }
        & #contexts-state { height: auto; max-height: 2; padding: 0 1; text-style: bold; }
        & #contexts-lines { height: 1fr; margin: 1 0; }
        & #contexts-detail { height: auto; min-height: 3; max-height: 6; padding: 0 1; }
        & #contexts-keys { height: auto; margin: 1 0 0 0; padding: 0 1; color: $text-muted; }
        &.-tall > #dialog, &.-tall > #dialog > #dialog-body { height: auto; }
        &.-tall #contexts-lines { height: auto; min-height: 8; max-height: 60vh; }
        &.-tall #contexts-detail { height: 6; }
    }
    """
    title_text = "Contexts"
    keys_text = "type to filter · Esc close"

    def __init__(
        self, table: Table, facts: Mapping[str, str], contexts: ContextList | None = None, has_actors: bool = False
    ) -> None:
        """`facts` are those of the test row; `contexts` the list that is being stepped through, if there is one. `has_actors`: the
        test row is queried with actors, which a saved context does not keep."""
        super().__init__()
        self.table, self.facts, self.has_actors = table, facts, has_actors
        self.message = ""
        """What went wrong, or what was done; displayed until the cursor moves on."""
        self._told_at = -1
        self.contexts = contexts or self._beside()
        self.contexts.show(table)
        self.matching: NDArray[np.int64] | None = None
        """The contexts that the filter leaves; None: all."""
        self.is_busy = ""
        self.displayed_facts: dict[str, int] = {}
        """The facts that have a column, and how wide it is."""

    def _beside(self) -> ContextList:
        try:
            return ContextList.beside(self.table)
        except ContextDBError as error:
            self.message = refusal(error)
            return ContextList.empty(self.table)

    def compose_body(self) -> ComposeResult:
        """What file, the list, the chosen context, what can be done."""
        yield Static(id="contexts-state")
        yield ContextLines()
        yield Static(id="contexts-detail")
        yield Static(id="contexts-keys")

    def on_mount(self) -> None:
        self.lines.focus()
        self._show_all(self.contexts.at or 0)

    @property
    def lines(self) -> ContextLines:
        return self.query_one(ContextLines)

    @property
    def chosen(self) -> int | None:
        if not self.lines.n_lines:
            return None
        return self.lines.index if self.matching is None else int(self.matching[self.lines.index])

    # ---- display

    def _show_all(self, index: int = 0) -> None:
        """Another file, or another state of it: columns, lines, and no filter."""
        self.lines.text, self.matching = "", None
        self._lay_out()
        self._show_lines(index)

    def _lay_out(self) -> None:
        """Columns for the room that there is."""
        frame = self.query_one("#dialog-body").size.width or self.size.width * 96 // 100 - 4
        self.displayed_facts = displayed_facts(self.contexts, frame - 2)
        self.lines.columns = columns_of(self.contexts, self.displayed_facts)
        self.lines.refresh()

    def on_resize(self) -> None:
        self.call_after_refresh(self._lay_out)

    def _show_lines(self, index: int = 0) -> None:
        n_lines = len(self.contexts) if self.matching is None else len(self.matching)
        filtered = "No context has this text." if self.lines.text else "No context is saved yet: F6 saves the test row."
        self.lines.empty = filtered
        self.lines.show(n_lines, self._cells, index)
        self._say()

    def _cells(self, line: int) -> Sequence[ListCell]:
        i = line if self.matching is None else int(self.matching[line])
        return cells_of(self.contexts, i, self.displayed_facts)

    def _say(self) -> None:
        self.query_one("#contexts-state", Static).update(Content(self._state()))
        self.query_one("#contexts-detail", Static).update(Content(self._detail()))
        self.query_one("#contexts-keys", Static).update(self._keys())

    def _state(self) -> str:
        if self.message or self.is_busy:
            return self.message or self.is_busy
        contexts, text = self.contexts, self.lines.text
        failing = contexts.n_failing
        holds = (
            f", {failing:,} of them {'fails' if failing == 1 else 'fail'}" if failing else ", none fails" if contexts.cases else ""
        )
        state = f"{contexts.rows.path.name}: {plural(len(contexts), 'context')}{holds}"
        return f"{state}   filter: {text}▏ {self.lines.n_lines:,} found" if text else state

    def _detail(self) -> str:
        i = self.chosen
        return "" if i is None else detail_of(self.contexts, i)

    def _keys(self) -> Content:
        named = [("load", "Enter Load"), *([] if self.contexts.cases else [("next_without", "F3 No row")])]
        named += [("open_file", "F4 Open"), ("keep", "F6 Save")]
        if self.contexts.cases:
            named += [("update", "F5 Update"), ("rename", "F2 Rename"), ("delete", "Del Delete")]
        return buttons(named)

    # ---- what happens

    @on(LineList.Moved)
    def _moved(self, event: LineList.Moved) -> None:
        if event.index != self._told_at:
            self.message = ""
        self._say()

    @on(LineList.Chosen)
    def action_load(self) -> None:
        """Give back the list, standing on the chosen context."""
        i = self.chosen
        if i is None:
            return
        try:
            self.contexts.facts(i)
        except ContextDBError as error:
            self._tell(error)
            return
        self.contexts.go(i)
        self.dismiss(Loaded(self.contexts))

    def action_next_without(self) -> None:
        """Go to the next context that no row is valid for; it is looked for a piece at a time."""
        start, n_lines = self.lines.index + 1, self.lines.n_lines
        stop = min(start + LOOKED_THROUGH, n_lines)
        lines = (line if self.matching is None else int(self.matching[line]) for line in range(start, stop))
        at = next((start + n for n, i in enumerate(lines) if self.contexts.n_valid(i) == 0), None)
        self.lines.go(stop - 1 if at is None else at)
        self._told_at = self.lines.index
        self.message = (
            "" if at is not None else "No further one is without a valid row." if stop == n_lines else "None so far: F3 goes on."
        )
        self._say()

    def action_cancel(self) -> None:
        """Take the filter off, or leave."""
        if self.lines.text:
            self.lines.filter("")
        else:
            self.dismiss(None)

    @on(ContextLines.Filtered)
    def _filtered(self, event: ContextLines.Filtered) -> None:
        self.message = ""
        self.workers.cancel_group(self, "search")
        if not event.text.strip():
            self.matching, self.is_busy = None, ""
            self._show_lines()
        elif self.contexts.cases:
            self.matching = next(self.contexts.rows.search(event.text))
            self._show_lines()
        else:  # what was displayed before stays until something matches
            self.is_busy = ""
            self._search(self.contexts, event.text)

    @work(thread=True, group="search", exclusive=True, exit_on_error=False)
    def _search(self, contexts: ContextList, text: str) -> None:
        """Look through a recording; matches are displayed as they come."""
        worker, matching = get_current_worker(), np.empty(0, np.int64)
        try:
            for part in contexts.rows.search(text):
                if worker.is_cancelled:
                    return
                is_first_page = len(part) and not len(matching)
                matching = np.concatenate([matching, part])
                if is_first_page:  # the first matches are displayed at once, the rest when all is known
                    self._from_thread(worker, self._show_matching, matching, f"searching for {in_quotes(text)} …")
            self._from_thread(worker, self._show_matching, matching, "")
        except ContextDBError as error:
            self._from_thread(worker, self._tell, error)

    def _from_thread(self, worker: Worker[None], call: Callable[..., None], *arguments: object) -> None:
        if not worker.is_cancelled and self.is_running:
            self.app.call_from_thread(call, *arguments)

    def _show_matching(self, matching: NDArray[np.int64], busy: str) -> None:
        at = self.lines.index if self.is_busy else 0
        self.matching, self.is_busy = matching, busy
        self._show_lines(at)

    def action_open_file(self) -> None:
        self.app.push_screen(OpenDialog(cases_file(self.table).parent), self._open)

    def _open(self, path: Path | None) -> None:
        if path is not None:
            self.is_busy = f"reading {path.name} …"
            self._say()
            self._read(path)

    @work(thread=True, group="read", exclusive=True, exit_on_error=False)
    def _read(self, path: Path) -> None:
        worker = get_current_worker()
        try:
            contexts = ContextList.open(path, self.table)
            self._from_thread(worker, self._opened, contexts)
        except ContextDBError as error:
            self._from_thread(worker, self._tell, error)

    def _opened(self, contexts: ContextList) -> None:
        self.workers.cancel_group(self, "search")
        self.contexts, self.is_busy, self.message = contexts, "", ""
        self._show_all()

    def action_keep(self) -> None:
        KeepDialog(self.contexts, self.facts, has_actors=self.has_actors).ask(self.app, self._keep)

    def action_update(self) -> None:
        """Save the test row in the place of the chosen case."""
        i = self.chosen
        if i is None or not self.contexts.cases:
            return
        case = self.contexts.cases[i]
        KeepDialog(self.contexts, self.facts, SavedCase(case.name, case.expected, case.note), self.has_actors).ask(
            self.app, self._keep
        )

    def _keep(self, case: SavedCase) -> None:
        self._change(
            lambda: self.contexts.keep(case.name, self.facts, case.expected, case.note), f"{in_quotes(case.name)} is saved."
        )

    def action_rename(self) -> None:
        """Give the chosen case another name."""
        i = self.chosen
        if i is None or not self.contexts.cases:
            return
        name = self.contexts.cases[i].name

        taken = {case.name for case in self.contexts.cases} - {name}

        def check(to: str) -> str:
            return "Enter a name." if not to.strip() else "There is a context of this name already." if to.strip() in taken else ""

        def rename(text: str | None) -> None:
            if text is not None and (to := text.strip()) != name:
                self._change(lambda: self.contexts.rename(i, to), f"{in_quotes(name)} is {in_quotes(to)} now.", i)

        question = f"Another name for {in_quotes(name)}; messages name the context by it"
        self.app.push_screen(AskDialog("Rename the context", question, name, check), rename)

    def action_delete(self) -> None:
        """Take the chosen case out of the file, when one is sure."""
        i = self.chosen
        if i is None or not self.contexts.cases:
            return
        name, file = self.contexts.cases[i].name, self.contexts.rows.path.name

        def delete(is_sure: bool | None) -> None:
            if is_sure:
                self._change(lambda: self.contexts.delete(i), f"{in_quotes(name)} is deleted.", i)

        self.app.push_screen(
            SureDialog("Delete the context", f"Delete {in_quotes(name)} from {file}? It cannot be undone."), delete
        )

    def _change(self, change: Callable[[], None], done: str, index: int | None = None) -> None:
        try:
            change()
        except ContextDBError as error:
            self._tell(error)
            return
        at = self.contexts.at if index is None and self.contexts.cases else index
        self._show_all(self.lines.index if at is None else at)
        self._tell(f"✓ {done}")

    def _tell(self, what: ContextDBError | str) -> None:
        self.is_busy, self._told_at = "", self.lines.index if self.lines.n_lines else -1
        self.message = what if isinstance(what, str) else refusal(what)
        self._say()


# ---- a context in words


def displayed_facts(contexts: ContextList, width: int) -> dict[str, int]:
    """The facts that get a column in so many terminal cells, each with its width.

    Where there is no room for all, those that are the same in every case are left out first.
    """
    room = width + GAP - sum(column.width + GAP for column in _head(contexts))
    names = list(contexts.conditions)
    for most in WIDTHS:
        widths = {name: min(max(cell_len(name), LEAST), most) for name in names}
        if sum(widths.values()) + GAP * len(names) <= room:
            return widths
    differing = {name for name in names if len({case.facts.get(name, "") for case in contexts.cases}) != 1}
    fitting: dict[str, int] = {}
    for name in sorted(names, key=lambda name: name not in differing):
        if sum(fitting.values()) + GAP * (len(fitting) + 1) + widths[name] <= room:
            fitting[name] = widths[name]
    return {name: fitting[name] for name in names if name in fitting}


def columns_of(contexts: ContextList, facts: Mapping[str, int]) -> tuple[ListColumn, ...]:
    """The columns of the list: the name, for cases whether it holds, and the facts displayed."""
    return (*_head(contexts), *(ListColumn(name, width) for name, width in facts.items()))


def _head(contexts: ContextList) -> tuple[ListColumn, ...]:
    widest = max((cell_len(case.name) for case in contexts.cases), default=len(f"row {len(contexts):,}"))
    name = ListColumn("Context", min(max(widest, 8), 28))
    return (name, ListColumn("Expected", 9) if contexts.cases else ListColumn("Valid", 6, 0, True))


def cells_of(contexts: ContextList, i: int, displayed: Mapping[str, int]) -> list[ListCell]:
    """The cells of a context, as `columns_of` has them."""
    verdict = contexts.verdict(i)
    head: list[ListCell] = [contexts.rows.name(i)]
    if contexts.cases:
        head.append(("✗ unread", "error") if verdict and verdict.faults else MARKS[verdict.holds if verdict else None])
    else:
        n_valid = contexts.n_valid(i)
        head.append(("?", "error") if n_valid is None else ("none", "warning") if n_valid == 0 else f"{n_valid:,}")
    try:
        facts = contexts.facts(i)
    except ContextDBError:
        return [*head, *(("?", "error") for _ in displayed)]
    return [*head, *(facts.get(name) or ("·", "muted") for name in displayed)]


def detail_of(contexts: ContextList, i: int) -> str:
    """A context in full: what came out, what is expected, its facts, its note."""
    try:
        facts = summary(contexts.facts(i)) or "no fact is given"
    except ContextDBError as error:
        return refusal(error)
    verdict = contexts.verdict(i)
    if verdict is None:
        return facts
    case = contexts.cases[i]
    lines = [outcome(verdict, contexts.assets), f"Expected: {case.expected.strip() or 'nothing'}", facts]
    return "\n".join([*([case.note] if case.note else []), *lines])


def refusal(error: ContextDBError) -> str:
    """What was refused, with the name of the file in the place of its path, which may be long."""
    fault = error.faults[0]
    name = f"{Path(fault.place.file).name}: " if fault.place.file else ""
    return f"✗ {name}{fault.message}"


def outcome(verdict: Verdict, assets: Sequence[str]) -> str:
    """What came out of a case, in a sentence."""
    if verdict.faults:
        return f"✗ It cannot be evaluated: {verdict.faults[0]}"
    if verdict.holds is None:
        return f"– Nothing is expected; {plural(verdict.n_valid, 'row')} valid."
    return f"✓ It holds; {plural(verdict.n_valid, 'row')} valid." if verdict.holds else f"✗ {mismatch(verdict, assets)}."
