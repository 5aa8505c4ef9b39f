"""The next picks for the facts of the test row, by the picker that a game has: what rests, what was played lately, what chance
gives. No Textual here.

The same seed gives the same picks. Rows are those of the table that is picked from, with the rows of tables inside it.
"""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass
from enum import IntEnum

from contextdb.compiled.data import CompiledData
from contextdb.compiled.matches import Matches
from contextdb.compiled.pick import Outcome
from contextdb.compiled.picker import Pick, Picker

N_PICKS = 50


class Turn(IntEnum):
    """What a row is at one pick, the strongest last."""

    NONE = 0
    """Others are preferred to it."""
    RESTS = 1
    """It was picked: once, or not long enough ago."""
    RECENT = 2
    """Its asset was played lately, and there is another choice."""
    CHOICE = 3
    """Chance may take it."""
    PICKED = 4


@dataclass(frozen=True)
class Way:
    """How it is picked."""

    seed: int = 0
    memory: int = 1
    """So many of the last assets are not repeated."""
    gap_s: float = 1.0
    """Seconds between two picks."""


@dataclass(frozen=True)
class PickedRow:
    """A valid row over the picks."""

    row: int
    asset: str
    turns: tuple[Turn, ...]
    standing: str
    """How it stands before the first pick: "picked, chance 40 %", "outranked by B (priority 5)"."""

    @property
    def n_picked(self) -> int:
        return self.turns.count(Turn.PICKED)


@dataclass(frozen=True)
class NextPicks:
    """The picks in their order, and the valid rows, those picked most first."""

    picks: tuple[Pick, ...]
    rows: tuple[PickedRow, ...]
    fallbacks: tuple[Turn, ...]
    """The picks in which no row could be picked."""


def next_picks(compiled: CompiledData, matches: Matches, way: Way, n_picks: int = N_PICKS) -> NextPicks:
    """Pick so often from an answer of a table, for one character that has picked nothing. Raises PolicyError where the policy
    refuses to pick."""
    outcome = Outcome(compiled, matches)
    if outcome.refusal is not None:
        raise outcome.refusal
    picker = Picker(compiled.name, way.seed, way.memory)
    picks = tuple(picker.pick(matches, time_s=turn * way.gap_s) for turn in range(n_picks))
    columns = [_turns(pick) for pick in picks]
    counts = Counter(pick.row for pick in picks)
    rows = sorted(outcome.rows.tolist(), key=lambda row: (-counts[row], row))

    def over_picks(row: int) -> PickedRow:
        turns = tuple(column.get(row, Turn.NONE) for column in columns)
        return PickedRow(row, compiled.assets[row], turns, outcome.said_of([row]))

    fallbacks = tuple(Turn.PICKED if pick.row is None else Turn.NONE for pick in picks)
    return NextPicks(picks, tuple(map(over_picks, rows)), fallbacks)


def _turns(pick: Pick) -> dict[int, Turn]:
    """What each valid row was at a pick."""
    left = pick.left
    if left is None:
        return {}
    awake = set(left.awake)
    turns = {row: Turn.RESTS for row in left.matches.indices.tolist() if row not in awake}
    turns |= dict.fromkeys(left.may, Turn.RECENT) | dict.fromkeys(left.fresh, Turn.CHOICE)
    return turns | ({} if pick.row is None else {pick.row: Turn.PICKED})
