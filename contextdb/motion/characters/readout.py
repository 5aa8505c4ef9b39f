"""What a game's screen may say of a character: what plays and why, the valid rows, and where none is valid, what is missing.

A game draws it how it likes: these are words. Explaining a gap takes longer than asking, so it is done once for each gap.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Protocol, runtime_checkable

from contextdb.cells.arguments import require_kind
from contextdb.motion.characters.updates import Updated
from contextdb.motion.selection.decision import Action, Decision, Playing
from contextdb.motion.selection.guards import Held


@runtime_checkable
class Explains(Protocol):
    """A compiled table, which can say why a row is not valid."""

    @property
    def asked(self) -> Mapping[str, Any]:
        """Its conditions, by name."""

    @property
    def assets(self) -> Any:
        """Those of its rows."""

    def query(self, context: Any, *, unknown: Any = "error") -> Any:
        """The valid rows of a context."""

    def explain(self, context: Any, *, unknown: Any = "error") -> Any:
        """Why each row is valid or not."""


class Readout:
    """What is to be said of a character after each update.

    Attributes
    ----------
    valid : Matches or None
        The rows that are valid with the facts of the last update; None before the first.
    why : str
        Why what plays was chosen, in one sentence; where a guard holds what is no longer valid, its name.
    """

    def __init__(self) -> None:
        self.valid: Any = None
        self.why, self._chosen = "", ""
        self._updated: Updated | None = None
        self._table: Any = None
        self._displayed: Playing | None = None
        self._gap: tuple[object, object, str] = (None, None, "")

    def update(self, updated: Updated, table: Explains, shown: Decision | Playing | None = None) -> None:
        """Take note of an update, and of the table that said what was valid; facts that it lacks are taken as any.

        `shown` is what is seen, where that is not what was decided: the decision of a one-off, or what plays of it.
        Raises ContextError for arguments of another kind, and for facts that the table refuses.
        """
        require_kind(updated, Updated, "updated", "an Updated, what Character.update gives")
        require_kind(table, Explains, "table", "a compiled table")
        require_kind(shown, (Decision, Playing, type(None)), "shown", "a Decision, a Playing, or None")
        decision = updated.decision
        seen = decision if shown is None else shown
        self._updated, self._table, self._displayed = updated, table, seen.playing if isinstance(seen, Decision) else seen
        if not self._chosen or decision.action in (Action.START, Action.JUMP):
            self._chosen = decision.why
        self.why = Held(decision.held).waits or self._chosen
        if isinstance(shown, Decision):
            self.why = shown.why
        self.valid = table.query(updated.facts, unknown="any")

    @property
    def title(self) -> str:
        """The asset that is displayed, and the time in it."""
        return "nothing" if self._displayed is None else f"{self._displayed.asset}   {self._displayed.time_s:.2f} s"

    @property
    def facts(self) -> str:
        """What the table was asked, in its order."""
        if self._updated is None:
            return ""
        facts = {name: self._updated.facts.get(name) for name in self._table.asked}
        return "  ".join(f"{name} {fact:.1f}" if isinstance(fact, float) else f"{name} {fact}" for name, fact in facts.items())

    @property
    def rows(self) -> list[tuple[str, bool]]:
        """The valid rows, numbered from 1, and whether each is of the asset that plays."""
        if self._updated is None:
            return []
        assets, name = self._table.assets, None if self._displayed is None else self._displayed.asset
        return [(f"{row + 1:>3}  {assets[row]}", assets[row] == name) for row in self.valid.rows.tolist()]

    @property
    def gap(self) -> str:
        """The row that is nearest to being valid, and what keeps it from that; "" while a row is valid."""
        if self._updated is None or self.valid:
            return ""
        facts = {name: round(fact, 1) if isinstance(fact, float) else fact for name, fact in self._updated.facts.items()}
        table, known, text = self._gap
        if table is not self._table or known != facts:
            nearest = self._table.explain(facts, unknown="any").nearest(1)
            text = str(nearest[0]) if nearest else "the table has no row"
            self._gap = self._table, facts, text
        return text
