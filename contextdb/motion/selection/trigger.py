"""Why a controller searches now, and how it says what came of it: one sentence for people."""

from __future__ import annotations

from enum import StrEnum

from contextdb.motion.selection.choice import Choice, Reason
from contextdb.motion.selection.decision import Playing
from contextdb.motion.selection.events import Event, not_led_to


class Trigger(StrEnum):
    """Why a controller searches, told of the asset or database that played. Where several hold, the first."""

    NOTHING_PLAYS = "Nothing was playing"
    LOST = "{asset} is no longer loaded"
    ENDED = "{asset} has ended"
    NOT_AMONG = "{database} is not among the databases of the moment"
    INTERRUPTED = "{asset} was interrupted"
    NOT_VALID = "{asset} is not valid any more"
    FORCED = "A search was forced"
    DUE = "A search was due"

    def sentence(self, before: Playing | None) -> str:
        """The trigger in words, of what played."""
        return self if before is None else self.format(asset=before.asset, database=before.database)


def not_due(due_s: float) -> str:
    """The reason of an update without a search."""
    return f"The next search is due in {due_s:.3g} s."


def jumped(
    trigger: Trigger, before: Playing | None, playing: Playing, cost: float, choice: Choice, continuing: float | None
) -> str:
    """The reason when another frame is chosen."""
    text = f"{trigger.sentence(before)}: {playing.asset} at {playing.time_s:.2f} s costs {cost:.4g}"
    threshold = next((search.threshold for search in choice.searches if search.database == choice.database), None)
    if choice.reason is Reason.UNDER_THRESHOLD and threshold is not None:
        text += f", under the threshold {threshold:g} of {choice.database}"
    if continuing is not None:
        text += f", playing on {continuing:.4g}"
    return f"{text}."


def last_resort(why: str, bar: float, waited_s: float) -> str:
    """The reason when a forced jump over the bar has waited long enough."""
    return f"{why.removesuffix('.')}; over the bar {bar:g}, but the last resort after {waited_s:.2f} s."


def held(before: Playing, reason: str) -> str:
    """The reason when an asset that is not valid plays on without a search."""
    return f"{Trigger.NOT_VALID.sentence(before)}, but plays on {reason}."


def by_hysteresis(why: str, before: Playing) -> str:
    """The same of an asset that hysteresis alone keeps valid."""
    return f"{why.removesuffix('.')}; {before.asset} is valid by hysteresis alone."


def astray(why: str, before: Playing, event: Event) -> str:
    """The same where what plays does not lead to an event in time."""
    return why.replace(Trigger.FORCED, f"{before.asset} {not_led_to(event)}", 1)


def waiting(before: Playing, playing: Playing, cost: float, bar: float, left_s: float) -> str:
    """The reason when a forced jump over the bar waits."""
    text = f"{Trigger.NOT_VALID.sentence(before)}: {playing.asset} at {playing.time_s:.2f} s costs {cost:.4g}, over the bar {bar:g}"
    return f"{text}, so {before.asset} plays on, at most {left_s:.2f} s more."


def continued(trigger: Trigger, before: Playing, cost: float, best: float) -> str:
    """The reason when playing on is chosen."""
    if cost <= best:
        return f"{trigger.sentence(before)}: playing on is cheapest, at cost {cost:.4g}."
    return f"{trigger.sentence(before)}: playing on, at cost {cost:.4g}, is about as cheap as the best, {best:.4g}."


def settling(trigger: Trigger, before: Playing, cost: float, best: float, stayed_s: float) -> str:
    """The reason when something else costs less, and what plays was entered only now."""
    text = f"{trigger.sentence(before)}: playing on costs {cost:.4g}"
    return f"{text}; the best, {best:.4g}, is not cheap enough to leave it {stayed_s:.2f} s after it was entered."


def nothing_else(trigger: Trigger, before: Playing | None, is_held: bool) -> str:
    """The reason when the search finds nothing."""
    if before is None or trigger is Trigger.LOST:
        return f"{trigger.sentence(before)}, and nothing may play."
    if is_held:
        return f"{trigger.sentence(before)} and nothing else may play: its last frame is held."
    return f"{trigger.sentence(before)}, but nothing else may play: {before.asset} plays on."
