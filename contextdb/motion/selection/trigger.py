"""Why a controller searches now, and how it says what came of it: one sentence for people."""

from __future__ import annotations

from enum import StrEnum

from contextdb.motion.selection.choice import Choice, Reason
from contextdb.motion.selection.decision import Playing


class Trigger(StrEnum):
    """Why a controller searches, told of the asset or database that played. Where several hold, the first."""

    NOTHING_PLAYS = "Nothing played"
    LOST = "{asset} is no longer loaded"
    ENDED = "{asset} has ended"
    NOT_AMONG = "{database} is not among the databases of the moment"
    INTERRUPTED = "{asset} was interrupted"
    NOT_VALID = "{asset} is not valid any more"
    FORCED = "A search was forced"
    DUE = "A search was due"

    @property
    def may_continue(self) -> bool:
        """Whether playing on takes part in the search."""
        return self in (Trigger.FORCED, Trigger.DUE)

    def told(self, before: Playing | None) -> str:
        """The trigger in words, of what played."""
        return self if before is None else self.format(asset=before.asset, database=before.database)


def not_due(due_s: float) -> str:
    """What is said of an update without a search."""
    return f"The next search is due in {due_s:.3g} s."


def jumped(
    trigger: Trigger, before: Playing | None, playing: Playing, cost: float, choice: Choice, continuing: float | None
) -> str:
    """What is said when another frame is chosen."""
    told = f"{trigger.told(before)}: {playing.asset} at {playing.time_s:.2f} s costs {cost:.4g}"
    threshold = next((search.threshold for search in choice.searches if search.database == choice.database), None)
    if choice.reason is Reason.UNDER_THRESHOLD and threshold is not None:
        told += f", under the threshold {threshold:g} of {choice.database}"
    if continuing is not None:
        told += f", playing on {continuing:.4g}"
    return f"{told}."


def last_resort(why: str, bar: float, waited_s: float) -> str:
    """What is said when a forced jump over the bar has waited long enough."""
    return f"{why.removesuffix('.')}; over the bar {bar:g}, but the last resort after {waited_s:.2f} s."


def held(before: Playing, told: str) -> str:
    """What is said when an asset that is not valid plays on without a search."""
    return f"{Trigger.NOT_VALID.told(before)}, but plays on {told}."


def by_hysteresis(why: str, before: Playing) -> str:
    """The same of an asset that hysteresis alone keeps valid."""
    return f"{why.removesuffix('.')}; {before.asset} is valid by hysteresis alone."


def waiting(before: Playing, playing: Playing, cost: float, bar: float, left_s: float) -> str:
    """What is said when a forced jump over the bar waits."""
    told = f"{Trigger.NOT_VALID.told(before)}: {playing.asset} at {playing.time_s:.2f} s costs {cost:.4g}, over the bar {bar:g}"
    return f"{told}, so {before.asset} plays on, at most {left_s:.2f} s more."


def continued(trigger: Trigger, before: Playing, cost: float, best: float) -> str:
    """What is said when playing on is chosen."""
    told = f"{trigger.told(before)}: playing on costs {cost:.4g}"
    return f"{told}, the least." if cost <= best else f"{told}, about as little as the best, {best:.4g}."


def nothing_else(trigger: Trigger, before: Playing | None, is_held: bool) -> str:
    """What is said when the search finds nothing."""
    if before is None or trigger is Trigger.LOST:
        return f"{trigger.told(before)}, and nothing may play."
    if is_held:
        return f"{trigger.told(before)} and nothing else may play: its last frame is held."
    return f"{trigger.told(before)}, but nothing else may play: {before.asset} plays on."
