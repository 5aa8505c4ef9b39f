"""What lets an asset play on that is no longer valid, so that a character is not thrown into the first frame that is.

The jump out of such an asset is forced: playing on does not compete with it, whatever it costs. Three guards hold it back.

- NextNaturalOnly: while such a frame plays, nothing is searched; the jump waits for the end of the span or of a round of a loop.
- Until natural, a setting: an asset that does not loop plays on to its end.
- Cost bar, on unless it is set otherwise: a jump that costs more waits. The search goes on at each update, and the first jump under
  the bar is taken. After the grace time the bar counts no longer: the best jump is taken, as the last resort, and `why` says so.

An interruption passes all guards, and so does the end of a clip: then nothing can play on.

Before that, an asset may be valid by hysteresis alone: its row's cells accept the facts when they are widened by what the
conditions declare. It then competes in searches as any that plays, but no other frame of it may be entered.
"""

from __future__ import annotations

from enum import StrEnum


class Held(StrEnum):
    """Which guard let an asset play on, as `Decision.held` tells it."""

    NOTHING = ""
    NEXT_NATURAL = "next natural"
    UNTIL_NATURAL = "until natural"
    COST_BAR = "cost bar"
    HYSTERESIS = "hysteresis"

    @property
    def sentence(self) -> str:
        """What lets it play on without a search, in words."""
        return "while its NextNaturalOnly span lasts" if self is Held.NEXT_NATURAL else "to its natural end"

    @property
    def waits(self) -> str:
        """What the jump away from it waits for, in words for a player."""
        return _WAITS[self]


_WAITS = {
    Held.NOTHING: "",
    Held.NEXT_NATURAL: "No longer valid: it waits for a natural transition.",
    Held.UNTIL_NATURAL: "No longer valid: it plays to its natural end.",
    Held.COST_BAR: "No longer valid: it waits for a jump that fits better.",
    Held.HYSTERESIS: "Valid within the hysteresis of a condition.",
}
