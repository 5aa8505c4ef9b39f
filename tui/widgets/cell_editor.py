"""The editor of one cell: a line exactly over the cell, and under it what the text means and what it may become.

Opened by typing it is in Excel's Enter mode, where arrows take the text and move on; F2 changes to Edit mode, where they move in
the text. A text that cannot be read stays, with the reason; only Escape or a good text leaves.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, ClassVar, Self

from rich.cells import cell_len
from textual import events, on
from textual.app import ComposeResult
from textual.binding import BindingType
from textual.dom import DOMNode
from textual.errors import NoWidget
from textual.geometry import Region, Size
from textual.markup import escape
from textual.screen import Screen
from textual.widget import Widget
from textual.widgets import Input

from contextdb.cells.conditions import Condition
from contextdb.cells.grammar import format_cell, parse_cell, reads
from contextdb.errors import Fault, plural
from contextdb.schema.sections import has_place

from ..messages import Notice
from ..model.chooser import Chooser, Offer, Row
from ..model.condition_form import undeclared
from ..model.layout import cut
from ..model.meaning import Meaning, meaning, mend_of
from ..model.number_forms import nudged, other_form
from ..model.rule_builder import RuleBuilder, RuleChooser
from .editing.choice_list import ChoiceList
from .editing.entry import Entry
from .editing.keys import KEYS
from .editing.popup import MOST_ROWS, Mend, Popup, Verdict
from .key_line import KeyLine

OF_MOUSE = (
    events.MouseDown,
    events.MouseUp,
    events.Click,
    events.MouseScrollDown,
    events.MouseScrollUp,
    events.MouseScrollLeft,
    events.MouseScrollRight,
)


class CellEditor(Widget):
    """Mounted once on the screen over the grid: `place` says where, `open` for which cell and who takes the outcome. It is closed
    then: another one for each cell would cost more than all that a typed cell paints."""

    BINDINGS: ClassVar[list[BindingType]] = KEYS

    DEFAULT_CSS = """
    CellEditor {
        overlay: screen; constrain: none none; height: 1; background: $surface;
        & > Entry, & > Entry:focus {
            background: $background; background-tint: $background 0%; color: $foreground; text-style: none; width: 100%; height: 1;
        }
        & > Entry.-refused { color: $text-error; text-style: underline; }
    }
    """

    @dataclass(frozen=True)
    class Committed:
        """A good text was given."""

        text: str
        down: int = 0
        """Where the cursor goes next."""
        right: int = 0
        is_fill: bool = False
        """Fill every selected cell."""
        is_tab: bool = False
        """It was taken by Tab."""

    @dataclass(frozen=True)
    class Declared:
        """Take the text, and declare the values in it that there are not yet."""

        text: str

    @dataclass(frozen=True)
    class Cancelled:
        """The cell stays as it was."""

    Outcome = Committed | Declared | Cancelled

    def __init__(self) -> None:
        super().__init__()
        self.is_open = False
        self.entry = Entry(self._typed)
        self._choices = ChoiceList()
        self._popup = Popup(self._choices)
        self._cell, self._screen = Region(0, 0, 20, 1), Size(80, 24)
        self._is_ready = False

    def open(
        self,
        condition: Condition | None,
        kind: str,
        text: str,
        *,
        check: Callable[[str], Fault | None],
        on_done: Callable[[Outcome], None],
        known: Sequence[str],
        is_fact: bool = False,
        is_typing: bool = False,
        open_list: bool = False,
        rule: RuleBuilder | None = None,
    ) -> None:
        """Edit a cell, and take the keys; nothing is left of the cell before. `on_done` is called once with the outcome, before
        anything else happens."""
        self.condition = condition
        self.kind = kind
        self.is_fact = is_fact
        self.is_typing = is_typing
        """Enter mode: arrows take the text. Else they move in it."""
        self.is_list_open = False
        """The keys go to the list."""
        self._check, self._on_done = check, on_done
        self._began_with = None if is_typing else text
        self._rule = rule
        self._chooser = Chooser(condition, kind, known, is_fact) if rule is None else RuleChooser(rule)
        self._choices.begin("(not given)" if is_fact else "Any")
        self.entry.begin(text)
        self._offer = Offer()
        self._meaning = Meaning()
        self._refused: Fault | None = None
        self._mend = ""
        self._seen = "", -1
        self._has_ticked = self._has_moved = self._is_done = self._is_tab = False
        if open_list and self._chooser.has_list:
            self._open()
        self.is_open = self.display = True
        self._begin()

    def close(self) -> None:
        """Be seen no more. Who closes it gives the keys on."""
        self._is_done, self.is_open, self.display = True, False, False

    def compose(self) -> ComposeResult:
        yield self.entry
        yield self._popup

    def on_mount(self) -> None:
        self._is_ready = True
        self._begin()

    def _begin(self) -> None:
        """Show the cell once there is a line to show it in."""
        if self._is_ready and self.is_open:
            self.screen.set_focus(self.entry)  # at once: a word that it lost the keys, to the cell before, then means nothing
            self._update()

    def focus(self, scroll_visible: bool = True) -> Self:
        """Give the keys to the entry line, at once."""
        self.screen.set_focus(self.entry, scroll_visible)
        return self

    # ---- what is seen

    @property
    def text(self) -> str:
        return self.entry.text

    @property
    def fault(self) -> Fault | None:
        return self._refused

    @property
    def is_numeric(self) -> bool:
        """Whether the cell is a set of numbers."""
        return self.condition is not None and self.condition.domain.type.is_numeric

    def place(self, cell: Region, screen: Size) -> None:
        """Stand so that the entry line lies on the cell, wider where the text is, and the popup below or above it."""
        self._cell, self._screen = cell, screen
        if not (self._is_ready and self.is_open):
            return
        width = min(max(cell.width, cell_len(self.entry.value) + 1), screen.width)
        x, y = max(0, min(cell.x, screen.width - width)), max(0, min(cell.y, screen.height - 1))
        self.styles.width = width
        self.absolute_offset = Region(x, y, width, 1).offset
        self._popup.stand(Region(x, y, width, 1), screen)
        self.refresh(layout=True)

    def refuse(self, fault: Fault) -> None:
        """Show why a text was not taken, and go on editing."""
        self._is_done, self._refused = False, fault
        domain = self.condition.domain if self.condition is not None else None
        self._mend = mend_of(self.text, fault, domain, self._check)
        self._update()

    def _update(self) -> None:
        """Bring the popup to the text as it is."""
        text = self.text
        self._seen = text, self.entry.cursor_position
        self._offer = self._chooser.offer(text, self.entry.cursor_position, self.is_list_open)
        self._meaning = meaning(text, self.condition, self.is_fact) if self.condition is not None else Meaning()
        if self._rule is not None:
            self._meaning = Meaning(self._rule.words(text))
        has_boxes = self._chooser.has_ticks and self._offer.word is None and self.is_list_open
        highlight = self._highlight() if self.is_list_open else None
        ticks = None if self._chooser.has_ticks and not has_boxes else self._chooser.ticks(text)
        self._choices.show(self._offer.rows, ticks, has_boxes, highlight)
        domain = self.condition.domain if self.condition is not None and self.is_numeric else None
        self._popup.tell(self._verdict(), domain, self._meaning.cell)
        self._popup.border_subtitle = escape(self._hint())
        self._popup.border_title = plural(self._offer.n_values, "value") if self._offer.n_values > MOST_ROWS else ""
        self.entry.set_class(self._refused is not None, "-refused")
        keys = {"space": "tick", "plus": "sign", "minus": "sign"}
        self.entry.keys_of_list = frozenset(key for key, action in keys.items() if self.check_action(action, ()))
        self.place(self._cell, self._screen)
        self.refresh_bindings()

    def _verdict(self) -> Verdict:
        if self._refused is not None:
            return Verdict("", self._refused, True, self._mend)
        if self._meaning.fault is not None and self._offer.word is not None and self._offer.rows:
            return Verdict(f"{plural(self._offer.n_values, 'value')} possible")
        return Verdict(self._meaning.words, self._meaning.fault)

    def _hint(self) -> str:
        if self._refused is not None:
            adds = "Ctrl+N add the value · " if self._is_declarable() else ""
            return f"{adds}Ctrl+T accept · Esc cancel" if self._mend else f"{adds}Esc leave"
        if self.is_list_open and self._offer.word is not None:
            return "Enter this value · Esc leave"
        if self.is_list_open and self._chooser.has_ticks:
            is_one = self._has_moved and not self._has_ticked
            return "Enter this one · Space tick several" if is_one else "Enter OK · Space tick · Esc cancel"
        if self.is_list_open:
            return "Enter this one · Esc leave"
        if self._completes:
            return f"Ctrl+T {cut(str(self._offer.rows[0]), 20).rstrip()} · F4 list"
        if self.is_numeric:
            arrows = "F2 then ↑ ↓ more, less" if self.is_typing else "↑ ↓ more, less"
            return f"{arrows} · F4 other form" if self._form() else arrows
        return "F4 list · Esc leave" if self._chooser.has_list else "Esc leave"

    @property
    def _completes(self) -> bool:
        """Whether the first row of the list is what the word, or a name, may become."""
        is_name = self.condition is None and not self.is_list_open and self.kind in ("asset", "output")
        return bool(self._offer.rows) and (self._offer.word is not None or is_name)

    def _highlight(self) -> int | None:
        rows, now = self._offer.rows, self._choices.highlight
        if rows and now is not None and self._choices.rows and len(rows) == len(self._choices.rows):
            return now
        if self._offer.word is not None:
            return 0
        tick = self._chooser.ticks(self.text)
        return next((at for at, row in enumerate(rows) if tick(row) != "off"), 0)

    # ---- the text changes

    @on(Input.Changed)
    def _changed(self, event: Input.Changed) -> None:
        event.stop()
        if self.is_open:
            self._refused, self._mend = None, ""
            self._update()

    @on(Entry.CaretMoved)
    def _caret_moved(self, event: Entry.CaretMoved) -> None:
        """Another word possible."""
        event.stop()
        follows = self._chooser.has_ticks or self._rule is not None
        if self.is_open and follows and self._seen != (self.text, self.entry.cursor_position):
            self._update()

    def _typed(self, typed: str) -> bool:
        """What is typed or pasted while the list is open begins a word, or another text."""
        if not self.is_list_open or self._is_done:
            return False
        is_new = self._offer.word is None
        self._close()
        if not is_new:
            return False
        self._write(*self._chooser.typed(self.text, typed))
        return True

    def _write(self, text: str, caret: int | None = None) -> None:
        """Change the text. What follows from it is seen when the entry line reports the change."""
        is_same = text == self.text
        self.entry.write(text, caret)
        if is_same:
            self._update()

    # ---- leaving

    def check_action(self, action: str, parameters: tuple[object, ...]) -> bool | None:
        """Which keys mean something at present; the others are the entry line's."""
        is_open, has_list = self.is_list_open, self._chooser.has_list
        can = {
            "vertical": is_open or self.is_typing or self.is_numeric or has_list,
            "sideways": self.is_typing and not is_open,
            "page": is_open or self.is_numeric,
            "to_end": is_open,
            "edit_mode": self.is_typing or is_open,
            "list": has_list,
            "other_form": self.is_numeric and self._form() is not None,
            "nudge": self.is_numeric,
            "tick": is_open and self._chooser.has_ticks and self._offer.word is None,
            "sign": is_open and self._chooser.has_signs and not self.is_fact and self._offer.word is None,
            "declare": action == "declare" and self._is_declarable(),
            "take": bool(self._mend or self._meaning.fault or self._completes),
        }
        return can.get(action, True)

    def action_commit(self, down: int, right: int, is_fill: bool = False) -> None:
        """Take the text, if it is good."""
        if self._is_done:
            return
        text = self._finished()
        fault = self._check(text)
        if fault is not None and self._is_begun():
            self._pick(self._offer.rows[0])
            text = self._finished()
            fault = self._check(text)
        if fault is not None:
            self.refuse(fault)
            return
        self._is_done = True
        self._on_done(self.Committed(text, down, right, is_fill, self._is_tab))

    def action_tab(self) -> None:
        """Take the text and go right; Enter then goes back to where the run of such cells began."""
        self._is_tab = True
        self.action_commit(0, 1)
        self._is_tab = False

    def _is_begun(self) -> bool:
        """Whether the word at the caret is the beginning of one value, and of no other."""
        offer = self._offer
        row = offer.rows[0] if len(offer.rows) == 1 and offer.word is not None else None
        return row is not None and offer.word is not None and row.casefold().startswith(offer.word.name.casefold())

    def action_declare(self) -> None:
        """Take the text with its new values."""
        if not self._is_done:
            self._is_done = True
            self._on_done(self.Declared(self.text.strip()))

    def _is_declarable(self) -> bool:
        """Whether a text that was refused says values that the condition could have, too."""
        condition = self.condition
        if self._refused is None or self.is_fact or condition is None or not has_place("values", condition.domain.kind):
            return False
        return bool(undeclared(self.text, condition.domain.values or ()))

    def _finished(self) -> str:
        """The text as it is taken: True for "t", and a condition without spaces round it."""
        text = self.text
        if text == self._began_with or not text.strip():
            return text
        if self._chooser.is_truth:
            begun = [row for row in self._chooser.offer(text, 0, True).rows if self._chooser.same(text, row)]
            if len(begun) == 1:
                return self._chooser.pick(text, begun[0], None)[0]
        if self.condition is None:
            return text
        domain = self.condition.domain
        return format_cell(parse_cell(text, domain), domain) if domain.type.is_truth and reads(text, domain) else text.strip()

    def action_enter(self) -> None:
        """Take the text, or what is highlighted in the list."""
        row = self._highlighted()
        if row is not None and self._offer.word is not None:
            self._pick(row[0])
            return
        if row is not None and self._has_moved and not self._has_ticked:
            self._pick(row[0])
        self.action_commit(1, 0)

    def action_fill(self) -> None:
        """Take the text for every selected cell."""
        self.action_commit(0, 0, True)

    def action_cancel(self) -> None:
        if not self._is_done:
            self._is_done = True
            if self._refused is not None:
                self.post_message(Notice(""))  # what it lacked
            self._on_done(self.Cancelled())

    def leave(self) -> bool:
        """Take a good text, since something else is to be shown; False where it cannot be taken: then it stays, with the reason."""
        if self.text == self._began_with:
            self.action_cancel()
        else:
            self.action_commit(0, 0)
        if self.is_open:
            self.post_message(Notice("Correct the cell first, or press Esc to leave it as it was.", "warning"))
        return not self.is_open

    def on_descendant_blur(self, event: events.DescendantBlur) -> None:
        """Another part takes the keys: the cell is left, or keeps them."""
        if self._is_done or not self.app.is_running or not self.app.app_focus or self.screen.focused is self.entry:
            return
        if not self.leave():
            self.screen.set_focus(self.entry)

    # ---- moving

    def action_edit_mode(self) -> None:
        self.is_typing = False
        self._close()
        self._update()

    def action_sideways(self, right: int) -> None:
        """Left and right in Enter mode."""
        self.action_commit(0, right)

    def action_vertical(self, down: int) -> None:
        """Up and down: in the list, to the next cell, a number more or less, or into the list."""
        if self.is_list_open:
            self._move(down)
        elif self.is_typing:
            self.action_commit(down, 0)
        elif self.is_numeric:
            self.action_nudge(-down)
        elif down > 0:
            self.action_list()

    def action_page(self, down: int) -> None:
        """A page of the list, or ten steps of a number."""
        if self.is_list_open:
            self._move(down * max(self._choices.size.height - 1, 1))
        else:
            self.action_nudge(-10 * down)

    def action_to_end(self, last: int) -> None:
        """The first or last row of the list."""
        self._move(len(self._offer.rows) * (1 if last else -1))

    def _move(self, down: int) -> None:
        self._has_moved = True
        self._choices.move_to((self._choices.highlight or 0) + down)
        self._popup.border_subtitle = escape(self._hint())

    # ---- numbers

    def action_nudge(self, steps: int) -> None:
        """Move the number at the caret."""
        assert self.condition is not None
        moved = nudged(self.text, self.entry.cursor_position, self.condition.domain, steps)
        if moved is not None:
            self._write(*moved)

    def _form(self) -> str | None:
        return other_form(self.text, self.condition.domain) if self.condition is not None and self.is_numeric else None

    def action_other_form(self) -> None:
        """Bounds for centre and tolerance, or the other way round."""
        if (form := self._form()) is not None:
            self._write(form)

    # ---- the list

    def _open(self) -> None:
        self.is_list_open, self.is_typing = True, False
        self._has_moved = self._has_ticked = False

    def _close(self) -> None:
        self.is_list_open = False

    def action_list(self) -> None:
        """Open the list, or close it."""
        if self.is_list_open:
            self._close()
        else:
            self._open()
        self._update()

    def _highlighted(self) -> tuple[Row] | None:
        at = self._choices.highlight
        return (self._offer.rows[at],) if self.is_list_open and at is not None and at < len(self._offer.rows) else None

    def _pick(self, row: Row) -> None:
        """Complete the word with a row, or make it the text."""
        word = self._offer.word
        self._close()
        self._write(*self._chooser.pick(self.text, row, word))

    def _toggle(self, row: Row, sign: str = "") -> None:
        self._has_ticked = True
        self._write(self._chooser.toggle(self.text, row, sign))

    def action_tick(self) -> None:
        """Tick or untick the row."""
        if (row := self._highlighted()) is not None:
            self._toggle(row[0])

    def action_sign(self, sign: str) -> None:
        """Give a tag a sign."""
        if (row := self._highlighted()) is not None:
            self._toggle(row[0], sign)

    @on(ChoiceList.Clicked)
    def _clicked(self, event: ChoiceList.Clicked) -> None:
        event.stop()
        row = self._offer.rows[event.at]
        if self._offer.word is not None:
            self._pick(row)
        elif self._chooser.has_ticks:
            if not self.is_list_open:
                self._open()
            self._choices.highlight = event.at
            self._toggle(row)
        else:
            self._pick(row)
            self.action_commit(0, 0)

    # ---- mends

    @on(Mend.Taken)
    def _mend_clicked(self, event: Mend.Taken) -> None:
        event.stop()
        self.action_take()

    def action_take(self) -> None:
        """Take the mend of a bad text, or the first value that the word may be."""
        if not self._mend and self._completes:
            self._pick(self._offer.rows[0])
        elif not self._mend and self._meaning.fault is not None:
            self.refuse(self._check(self.text) or self._meaning.fault)
        if self._mend:
            self._write(self._mend)


# ---- what is done beside a cell that is edited takes that cell first: `tui.editor` asks for each action, a screen for the mouse


def open_beside(node: DOMNode) -> CellEditor | None:
    """The editor that is open over a cell on the screen of a part; None for its own parts."""
    focused = node.screen.focused
    editor = focused.parent if focused is not None else None
    is_beside = isinstance(editor, CellEditor) and editor.is_open and editor not in node.ancestors_with_self
    return editor if isinstance(editor, CellEditor) and is_beside else None


def is_free_for(screen: Screen[Any], event: events.Event) -> bool:
    """Whether the mouse may do something on a screen. A press beside a cell that is edited takes the cell; where it cannot be taken
    the press does nothing. Nor does a wheel beside an open cell: the cell stays in sight."""
    if not isinstance(event, OF_MOUSE) or screen.app.mouse_captured is not None:
        return True
    try:
        under = screen.get_widget_at(event.x, event.y)[0]
    except NoWidget:  # beside all there is: nothing is done there
        return True
    editor = open_beside(under)
    if editor is None or isinstance(under, KeyLine):  # its keys are actions
        return True
    return isinstance(event, events.MouseDown) and editor.leave()
