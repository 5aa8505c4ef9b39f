"""What is odd about a cell that can be read: values wholly outside the bounds of its condition, a name that another row has too.

The same as `contextdb check` warns of, and fit for every paint: a text is looked at once.
"""

from __future__ import annotations

import numpy as np

from contextdb.bitmask import Rows
from contextdb.cells.domains import Domain
from contextdb.checks.run import verdict_of
from contextdb.columns import TextColumn
from contextdb.tables.condition_column import ConditionColumn
from contextdb.tables.nesting.names import inner_name

DOUBTFUL = "?"
"""Stands before the text of such a cell."""
SHOWN = ("outside-domain", "empty-cell")


class Doubts:
    """What is known of the columns of a table that is displayed."""

    def __init__(self) -> None:
        self._texts: dict[str, tuple[Domain, dict[str, str]]] = {}
        """By column the domain, and for the texts that were looked at what is odd."""
        self._counts: tuple[TextColumn | None, Rows] = None, np.zeros(0, np.int64)

    def of_cell(self, column: ConditionColumn, row: int) -> str:
        """What is odd about a cell of a condition; "" where nothing is."""
        name, domain, code = column.condition.name, column.condition.domain, int(column.texts.codes[row])
        known = self._texts.get(name)
        if known is None or known[0] is not domain:
            known = self._texts[name] = domain, {}
        text = column.texts.texts[code]
        if text not in known[1]:
            verdict = None if code in column.faults else verdict_of(column.cells[code], domain)
            known[1][text] = "" if verdict is None or verdict[0] not in SHOWN else verdict[2].rstrip(".")
        return known[1][text]

    def of_name(self, assets: TextColumn, row: int) -> str:
        """Whether another row has the asset of a row, too."""
        if self._counts[0] is not assets:
            self._counts = assets, np.bincount(assets.codes, minlength=len(assets.texts))
        asset = assets[row]
        is_twice = self._counts[1][assets.codes[row]] > 1 and bool(asset.strip()) and inner_name(asset) is None
        return "another row has this name, too" if is_twice else ""
