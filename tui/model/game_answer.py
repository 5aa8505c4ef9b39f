"""What a game made of a moment, beside what the table on the screen makes of it."""

from __future__ import annotations

from contextdb.console import printable
from contextdb.errors import plural
from contextdb.tables.table import Table
from tui.model.moments import Moment
from tui.model.query_row import QueryRow


class GameAnswer:
    """A moment of a game, and the test row that asks the same."""

    def __init__(self, moment: Moment, query: QueryRow) -> None:
        self.moment, self.query = moment, query

    @property
    def said(self) -> str:
        """How many rows are valid here, and what the game picked."""
        return f"{self.query.said} · the game plays {self._asset}" if self.moment.pick is not None else self.query.said

    @property
    def _asset(self) -> str:
        asset = self.moment.pick[1] if self.moment.pick is not None else None
        return "nothing" if asset is None else printable(asset)

    @property
    def differs(self) -> str:
        """How the game's answer is another one than that of the table here; nothing where it may be the same.

        A row that only may be valid here agrees with either answer.
        """
        query, rows = self.query, self.moment.rows
        may, sure = query.bits, query.bits & ~query.undecided
        if query.is_nested:
            explained = query.asked.explained if query.asked is not None and query.asked.fault is None else None
            if explained is None:
                return ""
            may, sure = explained.matches.bits, explained.matches.bits & ~explained.undecided
        n_more, n_fewer = (sure & ~rows).bit_count(), (rows & ~may).bit_count()
        if not n_more and not n_fewer:
            return ""
        parts = [f"{n_more:,} more"] if n_more else []
        parts += [f"{n_fewer:,} fewer"] if n_fewer else []
        return f"≠ the game: {plural(self.moment.n_valid, 'row')} valid there, here {' and '.join(parts)}"


def played_row(table: Table, pick: tuple[object, str | None] | None) -> int | None:
    """The row of a table that a game picked: the one of its number if the asset is the same, else the first with the asset."""
    if pick is None or pick[1] is None or not isinstance(pick[0], int):
        return None
    row, asset = pick[0], pick[1]
    if 0 <= row < table.n_rows and table.assets[row] == asset:
        return row
    return next((at for at, name in enumerate(table.assets) if name == asset), None)
