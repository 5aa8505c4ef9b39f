"""The dialog of the next picks: a strip of them for each valid row, how often it was picked, and why at the pick of the cursor."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import ClassVar

from textual import on
from textual.app import ComposeResult
from textual.binding import Binding, BindingType
from textual.content import Content
from textual.widgets import Static

from contextdb.errors import plural

from ..messages import GoToCell
from ..model.next_picks import N_PICKS, NextPicks, Turn, Way, next_picks
from ..model.table_answer import TableAnswer
from ..widgets.fitted import bar
from ..widgets.line_list import LineList, ListCell, ListColumn
from .dialog import Dialog

SIGNS = {Turn.NONE: " ", Turn.RESTS: "-", Turn.RECENT: "'", Turn.CHOICE: "·", Turn.PICKED: "█"}
HERE = {Turn.PICKED: "█"}
"""The signs at the pick of the cursor: of other rows there is a line."""
LEGEND = "█ picked  · could have been  ' played lately  - rests"
GAPS_S = (0.25, 0.5, 1.0, 2.0, 5.0, 10.0)
MOST_MEMORY = 3
NAME, LEAST_BAR = 12, 6


class NextPicksDialog(Dialog[GoToCell]):
    """The next picks for the test row. Enter goes to the row."""

    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("left", "step(-1)", "The pick before", show=False),
        Binding("right", "step(1)", "The next pick", show=False),
        Binding("n", "seed(1)", "Another seed", show=False),
        Binding("p", "seed(-1)", "The seed before", show=False),
        Binding("m", "memory", "How many assets are not repeated", show=False),
        Binding("t", "gap", "The time between picks", show=False),
    ]
    DEFAULT_CSS = """
    NextPicksDialog {
        & > #dialog { width: 120; height: 92%; }
        & > #dialog > #dialog-body { height: 1fr; }
        & #picks-way { height: auto; }
        & LineList { height: 1fr; margin: 1 0; }
        & #picks-here { height: auto; min-height: 2; max-height: 4; }
        & #picks-legend { height: 1; color: $text-muted; }
    }
    """
    title_text = f"The next {N_PICKS} picks for the test row"
    keys_text = "←→ pick · N P seed · M memory · T time · Enter to the row · Esc close"

    def __init__(self, answer: TableAnswer, asset_column: str) -> None:
        """`answer` is that to the test row. Raises PolicyError where the policy refuses to pick."""
        super().__init__()
        self.answer, self._asset_column = answer, asset_column
        self.way = Way()
        self.turn = 0
        self.picks: NextPicks = next_picks(answer.compiled, answer.matches, self.way)

    def compose_body(self) -> ComposeResult:
        """How it is picked, the strips, why at one pick, the signs."""
        yield Static(id="picks-way", markup=False)
        columns = [ListColumn("Asset", NAME, 1, is_name=True), ListColumn("Picks", N_PICKS), ListColumn("", 3, 0, True)]
        yield LineList([*columns, ListColumn("", 0, 1)], empty="No row is valid: the fallback plays, where there is one.")
        yield Static(id="picks-here", markup=False)
        yield Static(LEGEND, id="picks-legend", markup=False)

    def on_mount(self) -> None:
        self.query_one(LineList).focus()
        self._show()

    def _show(self, index: int = 0) -> None:
        picks, way = self.picks, self.way
        memory = {0: "repeats are free", 1: "no repeat of the last"}.get(way.memory, f"no repeat of the last {way.memory} assets")
        used = len({pick.row for pick in picks.picks if pick.row is not None})
        parts = [f"seed {way.seed}", memory, f"every {way.gap_s:g} s", f"{used} of {plural(len(picks.rows), 'valid row')} picked"]
        n_undecided = self.answer.undecided.bit_count()
        parts += [f"{plural(n_undecided, 'row')} only may be valid"] if n_undecided else []
        self.query_one("#picks-way", Static).update(" · ".join(parts))
        self._titles()
        n_lines = len(picks.rows) + any(picks.fallbacks)
        self.query_one(LineList).show(n_lines, self._line, index)

    def _titles(self) -> None:
        """The pick of the cursor is marked over the strips."""
        lines = self.query_one(LineList)
        asset, _, n, share = lines.columns
        lines.columns = (asset, ListColumn(" " * self.turn + "▾", N_PICKS), n, share)
        lines.refresh()

    def _line(self, at: int) -> Sequence[ListCell]:
        rows, n_picks = self.picks.rows, len(self.picks.picks)
        turns = rows[at].turns if at < len(rows) else self.picks.fallbacks
        n_picked = turns.count(Turn.PICKED)
        name = rows[at].asset if at < len(rows) else f"fallback {self.answer.compiled.fallback or '(none)'}"
        strip = "".join((HERE.get(turn, "│") if i == self.turn else SIGNS[turn]) for i, turn in enumerate(turns))
        tone = "" if n_picked else "muted"
        share = n_picked / n_picks
        return [(name, tone), (strip, tone), str(n_picked), lambda width: bar(share, share, width) if width >= LEAST_BAR else ""]

    @on(LineList.Moved)
    def _moved(self, event: LineList.Moved) -> None:
        event.stop()
        self._say()

    def _say(self) -> None:
        pick, at = self.picks.picks[self.turn], self.query_one(LineList).index
        time = f" at {self.turn * self.way.gap_s:g} s"
        lines = [f"Pick {self.turn + 1}{time}: {pick.asset or 'nothing'} ({pick.why})"]
        if 0 <= at < len(self.picks.rows):
            row = self.picks.rows[at]
            lines.append(f"{row.asset}: {plural(row.n_picked, 'pick')}; before the first one it is {row.standing}")
        self.query_one("#picks-here", Static).update(Content("\n".join(lines)))

    # ---- keys

    def action_step(self, by: int) -> None:
        """Go to the pick before, or the next."""
        self.turn = min(max(self.turn + by, 0), len(self.picks.picks) - 1)
        self._titles()
        self._say()

    def action_seed(self, by: int) -> None:
        """Pick with another seed."""
        self._pick(replace(self.way, seed=max(0, self.way.seed + by)))

    def action_memory(self) -> None:
        """Leave more of the last assets out, or none."""
        self._pick(replace(self.way, memory=(self.way.memory + 1) % (MOST_MEMORY + 1)))

    def action_gap(self) -> None:
        """Pick more seldom, or often again."""
        self._pick(replace(self.way, gap_s=GAPS_S[(GAPS_S.index(self.way.gap_s) + 1) % len(GAPS_S)]))

    def _pick(self, way: Way) -> None:
        self.way, self.picks = way, next_picks(self.answer.compiled, self.answer.matches, way)
        self._show(self.query_one(LineList).index)

    @on(LineList.Chosen)
    def _chosen(self, event: LineList.Chosen) -> None:
        event.stop()
        if event.index < len(self.picks.rows):
            self.dismiss(GoToCell(self.answer.row_of_sheet(self.picks.rows[event.index].row), self._asset_column))
