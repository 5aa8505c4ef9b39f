"""What a game made of a moment, beside what the table on the screen makes of it."""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from contextdb import bitmask
from contextdb.console import printable
from contextdb.errors import plural
from contextdb.tables.table import Table

from .asset_rows import rows_of_assets
from .moments import Moment
from .query_row import QueryRow


class GameAnswer:
    """A moment of a game, and the test row that asks the same."""

    def __init__(self, moment: Moment, query: QueryRow, table: Table, game_table: Table) -> None:
        """`table` is the one on the screen, `game_table` the one that the game has, as far as that is known."""
        self.moment, self.query, self.table, self.game_table = moment, query, table, game_table

    @property
    def summary(self) -> str:
        """How many rows are valid here, and what the game picked."""
        return f"{self.query.summary} · the game plays {self._asset}" if self.moment.pick is not None else self.query.summary

    @property
    def _asset(self) -> str:
        asset = self.moment.pick[1] if self.moment.pick is not None else None
        return "nothing" if asset is None else printable(asset)

    @property
    def differs(self) -> str:
        """How the game's answer is another one than that of the table here; nothing where it may be the same.

        A row that only may be valid here agrees with either answer. Rows are compared by their assets, where the table here was
        edited since the game has it.
        """
        query, rows, n_gone = self.query, self.moment.rows, 0
        candidates, sure = query.bits, query.bits & ~query.undecided
        if query.is_nested:
            if query.answer is None or self.table is not self.game_table:
                return ""
            explained = query.answer.explained
            candidates, sure = explained.matches.bits, explained.matches.bits & ~explained.undecided
        elif self.table is not self.game_table:
            rows, n_gone = self._rows_here(rows)
        n_more, n_fewer = (sure & ~rows).bit_count(), (rows & ~candidates).bit_count() + n_gone
        if not n_more and not n_fewer:
            return ""
        parts = [f"{n_more:,} more"] if n_more else []
        parts += [f"{n_fewer:,} fewer"] if n_fewer else []
        return f"≠ the game: {plural(self.moment.n_valid, 'row')} valid there, here {' and '.join(parts)}"

    def _rows_here(self, rows: int) -> tuple[int, int]:
        """The rows of the table here that are those of the game's table, as bits, and how many are not here."""
        n_rows = self.game_table.n_rows
        valid = np.flatnonzero(bitmask.flags_of(rows & ((1 << n_rows) - 1), n_rows))
        here = _rows_of(self.game_table, self.table)[valid]
        here = here[here >= 0]
        return bitmask.int_of(here.tolist()), rows.bit_count() - len(here)


@lru_cache(maxsize=1)
def _rows_of(game_table: Table, table: Table) -> NDArray[np.int64]:
    """For each row of the game's table its row on the screen."""
    return rows_of_assets(game_table.assets, table.assets)


def played_row(table: Table, pick: tuple[object, str | None] | None) -> int | None:
    """The row of a table that a game picked: the one of its number if the asset is the same, else the first with the asset."""
    if pick is None or pick[1] is None or not isinstance(pick[0], int):
        return None
    row, asset = pick[0], pick[1]
    if 0 <= row < table.n_rows and table.assets[row] == asset:
        return row
    return next((at for at, name in enumerate(table.assets) if name == asset), None)
