"""Pairs of conditions as a heat map: all pairs, and on Enter the values of one pair."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar

from rich.cells import cell_len
from textual.binding import Binding, BindingType
from textual.message import Message

from contextdb.covering import PairTable, Slice

from ..model import coverage_lines as lines
from ..widgets.heat_map import HeatMap, Square

WIDEST = 14
CORNER = "least covered, %"


class PairMap(HeatMap):
    """The overview has a square for each two conditions, of their least covered combination; on the diagonal stand single ones."""

    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("enter", "choose", "Open the pair"),
        Binding("backspace", "back", "All pairs"),
    ]

    @dataclass
    class Described(Message):
        """What the square under the cursor means, in words."""

        text: str

    def __init__(self, *, id: str | None = None) -> None:  # noqa: A002
        super().__init__(id=id)
        self.pairs: PairTable | None = None
        self.pair: tuple[int, int] | None = None
        """The pair that is displayed, that with more parts first; None: all of them."""
        self._left_out = ""
        self._opened_at = (0, 1)
        self._worst: dict[tuple[int, int], Slice | None] = {}

    def show_pairs(self, pairs: PairTable | None, left_out: str = "") -> None:
        """Show these, or say why there are none; the pair that is open stays so where it is still there."""
        before, self.pairs, self._worst, self._left_out = self.pairs, pairs, {}, left_out
        if self.pair and (before is None or pairs is None or before.conditions != pairs.conditions):
            self.pair = None
        self._show(self.place if before is not None else (0, 1))

    def back(self) -> None:
        """From one pair to all of them."""
        if self.pair is not None:
            self.pair = None
            self._show(self._opened_at)

    def action_back(self) -> None:
        """From one pair to all of them."""
        self.back()

    def check_action(self, action: str, parameters: tuple[object, ...]) -> bool | None:
        """A pair is opened from all of them, and left from within."""
        if action in ("choose", "back"):
            return (self.pair is None) == (action == "choose")
        return True

    def cells_here(self) -> dict[str, str] | None:
        """The slice under the cursor as cells; in the overview the least covered one of the pair."""
        slice_here = self._slice(*self.place) if self.pair else self._worst_of(*self.place)
        return None if slice_here is None else slice_here.cells

    def action_choose(self) -> None:
        """Open the pair of the square."""
        if self.pairs is not None and self.pair is None and self.pairs.conditions:
            self._opened_at = self.place
            one, other = self.place
            has_more = len(self.pairs.parts[one]) >= len(self.pairs.parts[other])
            self.pair = (one, other) if has_more else (other, one)
            self._show((0, 0))

    def go(self, row: int, column: int) -> None:
        """Choose a square, and say what it means."""
        super().go(row, column)
        if self.pairs is None or not self.rows:
            self.post_message(self.Described(self._left_out))
        elif self.pair is None:
            self.post_message(self.Described(lines.pair_text(self.pairs, *self.place)))
        else:
            slice_here = self._slice(*self.place)
            self.post_message(self.Described("" if slice_here is None else lines.slice_text(slice_here)))

    def _show(self, place: tuple[int, int]) -> None:
        self.refresh_bindings()
        if self.pairs is None:
            self.show([], [], self._overview_square, (0, 0))
            return
        if self.pair is None:
            names = self.pairs.conditions
            rows = [f"{at + 1} {name}" for at, name in enumerate(names)]
            self.show(rows, self._numbered(rows), self._overview_square, place, WIDEST, CORNER)
            return
        one, other = self.pair
        rows = [f"{part}" for part in self.pairs.parts[one]]
        columns = [self.pairs.conditions[one]] if one == other else list(self.pairs.parts[other])
        names = self.pairs.conditions
        corner = names[one] if one == other else f"{names[one]} \\ {names[other]}"
        self.show(rows, columns, self._slice_square, place, WIDEST, corner)

    def _numbered(self, rows: Sequence[str]) -> Sequence[str]:
        """The labels of the columns of the overview: names where all have room, else their numbers."""
        longest = max(map(cell_len, rows), default=0)
        room = (self.scrollable_content_region.width - max(longest, cell_len(CORNER)) - 1) // max(1, len(rows))
        has_room = longest + 2 <= min(room, WIDEST)
        return rows if has_room else [row.split(" ")[0] for row in rows]

    def _overview_square(self, row: int, column: int) -> Square:
        return _square(self._worst_of(row, column))

    def _slice_square(self, row: int, column: int) -> Square:
        return _square(self._slice(row, column))

    def _worst_of(self, row: int, column: int) -> Slice | None:
        if self.pairs is None or not self.pairs.conditions:
            return None
        key = min(row, column), max(row, column)
        if key not in self._worst:
            self._worst[key] = self.pairs.worst(*key)
        return self._worst[key]

    def _slice(self, row: int, column: int) -> Slice | None:
        if self.pairs is None or self.pair is None:
            return None
        one, other = self.pair
        return self.pairs.slice(one, other, row, row if one == other else column)


def _square(part: Slice | None) -> Square:
    return Square(None) if part is None else Square(part.covered, part.lower, part.upper)
