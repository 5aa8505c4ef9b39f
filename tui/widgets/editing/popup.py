"""What is under the entry line: the picture of a set of numbers or the list of values, what the text means, and the mend."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from rich.cells import cell_len
from textual.app import ComposeResult
from textual.containers import Vertical
from textual.content import Content
from textual.geometry import Region, Size
from textual.message import Message
from textual.widgets import Static

from contextdb.cells.domains import Domain
from contextdb.cells.sets import Cell, NumberSet
from contextdb.errors import Fault, in_quotes

from ...model.interval_picture import DIAL_HEIGHT, DIAL_WIDTH, Run, dial, framed_line
from .choice_list import ChoiceList

NARROWEST, OF_NUMBERS, WIDEST = 34, 54, 64
MOST_ROWS = 8
GUTTER = 4
"""The frame and a space on both sides."""
MUTED = "$foreground 65%"
NOTHING = Cell(NumberSet(()))
_DIAL_SIDE = 3, 4
"""How many cells stand left and right of a dial: "90" and "-90"."""


@dataclass(frozen=True)
class Verdict:
    """What the popup says in words."""

    words: str = ""
    fault: Fault | None = None
    is_refused: bool = False
    """The text was not taken: the fault is reported at length."""
    mend: str = ""


class Mend(Static):
    """The nearest text that reads; a click takes it."""

    @dataclass
    class Taken(Message):
        """It was clicked."""

    def on_click(self) -> None:
        self.post_message(self.Taken())


class Popup(Vertical):
    """A box under or over the entry line. It takes no focus."""

    ALLOW_SELECT = False

    DEFAULT_CSS = """
    Popup {
        overlay: screen; constrain: none none; height: auto; background: $surface;
        border: round $primary; border-subtitle-color: $text-muted; border-title-color: $text-muted; padding: 0 1;
        &.-refused { border: round $error; }
        & > Static { height: auto; width: 1fr; }
        & > Mend:hover { text-style: underline; }
    }
    """

    def __init__(self, choices: ChoiceList) -> None:
        super().__init__()
        self.choices = choices
        self._picture = Static()
        self._words = Static()
        self._mend = Mend()
        self._verdict = Verdict()
        self._cell: Cell | None = None
        self._domain: Domain | None = None
        self._sizes: tuple[int, ...] = ()
        """Its own size, and those of its parts, that it was laid out in last."""

    def compose(self) -> ComposeResult:
        yield self._picture
        yield self.choices
        yield self._words
        yield self._mend

    def tell(self, verdict: Verdict, domain: Domain | None, cell: Cell | None) -> None:
        """Show other words, and the picture of a cell of numbers; `domain` is None where there is no picture."""
        self._verdict, self._domain, self._cell = verdict, domain, cell

    @property
    def is_empty(self) -> bool:
        return not (self._verdict.words or self._verdict.fault or self.choices.rows or self._domain)

    @property
    def wanted_width(self) -> int:
        """How wide it would like to be."""
        words = WIDEST if self._verdict.is_refused else max(map(cell_len, self._verdict.words.splitlines()), default=0)
        wanted = max(words, cell_len(str(self.border_subtitle or "")) + 2, self.choices.wanted_width) + GUTTER
        least = NARROWEST if self._domain is None else WIDEST if self._domain.type.is_circular else OF_NUMBERS
        return max(least, min(wanted, WIDEST))

    def stand(self, entry: Region, screen: Size) -> None:
        """Stand below the entry line or above it, whichever fits; where neither does, on the wider side, with fewer rows."""
        self.display = not self.is_empty
        if self.is_empty:
            return
        width = min(max(self.wanted_width, min(entry.width, NARROWEST)), screen.width)
        parts = self._say(max(width - GUTTER, 1))
        n_lines = sum(parts)
        below, above = screen.height - entry.bottom, entry.y
        wanted = n_lines + min(len(self.choices.rows), MOST_ROWS) + 2
        is_below = wanted <= below or (wanted > above and below >= above)
        height = min(wanted, below if is_below else above)
        self.display = height > 2
        n_rows = max(0, min(len(self.choices.rows), height - n_lines - 2))
        self.choices.styles.height = n_rows
        self.choices.display = n_rows > 0
        self.choices.keep_in_view(max(n_rows, 1))
        self.styles.width, self.styles.height = width, height
        x = max(0, min(entry.x, screen.width - width))
        self.absolute_offset = Region(x, entry.bottom if is_below else entry.y - height, width, height).offset
        before, self._sizes = self._sizes, (width, height, n_rows, *parts)
        self.refresh(layout=before != self._sizes)  # it is moved by who stands it

    def _say(self, width: int) -> tuple[int, int, int]:
        """Fill in picture, words and mend for a width; gives how many lines each takes."""
        verdict, domain = self._verdict, None if self._verdict.is_refused else self._domain
        is_dial = domain is not None and domain.type.is_circular
        self.set_class(verdict.is_refused, "-refused")
        room = width - DIAL_WIDTH - sum(_DIAL_SIDE) - 2 if is_dial else width
        words = list(_worded(verdict, max(room, 8)))
        mend = (
            wrapped(f"Did you mean {in_quotes(verdict.mend)}? Ctrl+T accepts it.", width)
            if verdict.mend and verdict.is_refused
            else []
        )
        picture = self._draw(width, words, domain) if domain is not None else []
        below = [] if is_dial else words
        for part, lines in ((self._picture, picture), (self._words, below), (self._mend, _styled(mend, "bold $text-accent"))):
            part.update(Content("\n").join(lines), layout=False)  # the box is laid out with all that is in it
            part.display = bool(lines)
        return len(picture), len(below), len(mend)

    def _draw(self, width: int, words: Sequence[Content], domain: Domain) -> list[Content]:
        """The line of the numbers, or the dial with the words next to it; without its filling while the text cannot be read."""
        if not domain.type.is_circular:
            return [_coloured(framed_line(self._cell or NOTHING, domain, width))]
        left, right = _DIAL_SIDE
        middle = " " * (left + DIAL_WIDTH // 2)
        drawn = dial(self._cell or NOTHING)
        lines = [_coloured([(f"{middle}0".ljust(left + DIAL_WIDTH + right), False)])]
        for at, line in enumerate(drawn):
            is_middle = at == DIAL_HEIGHT // 2
            lines.append(
                _coloured([("90 " if is_middle else " " * left, False), *line, (" -90" if is_middle else " " * right, False)])
            )
        lines.append(_coloured([(f"{middle[1:]}180".ljust(left + DIAL_WIDTH + right), False)]))
        rows = max(len(lines), len(words) + 2)
        lines += [Content(" " * (left + DIAL_WIDTH + right))] * (rows - len(lines))
        beside = [Content(""), Content(""), *words, *[Content("")] * rows]
        return [Content.assemble(line, "  ", word) for line, word in zip(lines, beside, strict=False)]


def _coloured(line: Iterable[Run]) -> Content:
    return Content.assemble(*((text, "bold $text-primary" if is_accepted else MUTED) for text, is_accepted in line))


def _worded(verdict: Verdict, width: int) -> Iterable[Content]:
    """The words, or the fault: in short while one types, at length when the text was refused."""
    if verdict.fault is None:
        for line in verdict.words.splitlines():
            yield from _styled(wrapped(line, width), MUTED)
    elif not verdict.is_refused:
        yield from _styled(wrapped(f"! {verdict.fault.found}", width)[:2], "$text-warning")
    else:
        yield from _styled(wrapped(f"! {verdict.fault.found}", width), "bold $text-error")
        if verdict.fault.accepted:
            yield from _styled(wrapped(f"Accepted: {verdict.fault.accepted}.", width), MUTED)
        if verdict.fault.mend.startswith("to "):
            yield from _styled(wrapped(f"Try {verdict.fault.mend}.", width), MUTED)


def _styled(lines: Iterable[str], style: str) -> list[Content]:
    return [Content.styled(line, style) for line in lines]


def wrapped(text: str, width: int) -> list[str]:
    """A text in lines of at most so many cells, broken at spaces where it can be."""
    lines, line = [], ""
    for word in text.split():
        if line and cell_len(line) + 1 + cell_len(word) > width:
            lines.append(line)
            line = ""
        line = f"{line} {word}" if line else word
        while cell_len(line) > width:
            n_fit = next(n for n in range(len(line), 0, -1) if n == 1 or cell_len(line[:n]) <= width)
            lines.append(line[:n_fit])
            line = line[n_fit:]
    return [*lines, line] if line else lines
