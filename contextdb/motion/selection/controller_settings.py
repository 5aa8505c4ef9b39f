"""What `[controllers.NAME]` of contextdb.toml says: when a character searches, and where it may not jump.

    [controllers.player]
    selector = "locomotion"
    search_every_s = 0.1       # between two searches, unless one is forced
    jump_threshold_s = 0.2     # frames so near to the playing one, in its own range, are not candidates
    history_s = 0.5            # frames played within so many seconds are not entered again
    min_play_rate = 0.8        # clips are played as fast as the character is asked to go, within these limits; 1 and 1 is never
    max_play_rate = 1.25
    cost_bar = 1.0             # a jump out of an asset that is no longer valid waits if it costs more
    grace_s = 0.3              # for at most so long
    until_natural = true       # and an asset without a loop then plays on to its end
    variation_within = 0.05    # frames that cost at most so much more than the best are as good as it; without the key, none are
    variation_memory = 2       # and none of the last so many assets is chosen while another is as good

Source: SearchThrottleTime, PoseJumpThresholdTime and PoseReselectHistory of Unreal's PoseSearch. The default history is the
shortest one with which a steered character without fitting clips still showed new frames half of the time. Bar and grace time are
those with which, on captured clips, no forced jump is taken over the bar and turns and changes of speed come no later.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Iterator, Mapping
from dataclasses import dataclass, fields
from typing import Any

from contextdb.cells.arguments import as_number
from contextdb.errors import Fault, MotionError, in_quotes, some
from contextdb.files.toml_shapes import Mapped, Section
from contextdb.motion.search.database import MotionDatabase
from contextdb.motion.selection.variation import Variation

SECONDS = {
    "search_every_s": ("seconds from 0 to 60, such as 0.1; 0 is every update", 60.0),
    "jump_threshold_s": ("seconds from 0 to 60, such as 0.2", 60.0),
    "history_s": ("seconds from 0 to 60, such as 0.5; 0 is no memory", 60.0),
    "grace_s": ("seconds from 0 to 60, such as 0.3; 0 is no grace", 60.0),
}
RATES = {
    "min_play_rate": ("a number from 0.1 to 1, such as 0.8; 1 plays nothing slower", 0.1, 1.0),
    "max_play_rate": ("a number from 1 to 10, such as 1.25; 1 plays nothing faster", 1.0, 10.0),
}
VARIATION = ("variation_within", "variation_memory")
BAR = "a cost from 0 to 1e30, such as 1.0"
WITHIN = "a cost from 0 to 1e30, such as 0.05"
MEMORY = "a whole number from 0 to 1000, such as 2"
MOST_COST, MOST_ASSETS = 1e30, 1000
USUAL_BAR = 1.0
"""Half of what two frames cost on average that have nothing to do with each other."""
KEYS = ("selector", *SECONDS, *RATES, "cost_bar", "until_natural", *VARIATION)


@dataclass(frozen=True, slots=True)
class ControllerSettings:
    """How a controller goes about it.

    Attributes
    ----------
    search_every_s : float
        Seconds between two searches; a search that is forced, or needed because the clip has ended, does not wait.
    jump_threshold_s : float
        Frames of the playing range that are within so many seconds of the playing frame are not candidates.
    history_s : float
        Frames that were played within the last so many seconds are not entered again.
    cost_bar : float, optional
        A jump out of an asset that is no longer valid waits while it costs more. Default: `USUAL_BAR` where a database was built
        with a schema; into one made from features, whose costs have a scale of their own, none waits.
    grace_s : float
        For how long it waits at most; then it is taken, as the last resort.
    until_natural : bool
        Whether an asset that does not loop plays on to its end when it is no longer valid.
    variation : Variation, optional
        Random choice among near ties. Default: always the best.
    rate : float
        Frames a second of databases made from features; those built from clips know theirs.
    min_play_rate, max_play_rate : float
        Between which limits a clip is played slower or faster, so that it goes about as fast as the query asks for.

    Raises
    ------
    MotionError
        Seconds or a bar that are no finite numbers of 0 or more, a rate that is not above 0, a play rate out of its limits, or
        `until_natural` is no bool.
    """

    search_every_s: float = 0.1
    jump_threshold_s: float = 0.2
    history_s: float = 0.5
    variation: Variation | None = None
    rate: float = 30.0
    min_play_rate: float = 0.8
    max_play_rate: float = 1.25
    cost_bar: float | None = None
    grace_s: float = 0.3
    until_natural: bool = False

    def bar_of(self, database: MotionDatabase) -> float:
        """What a forced jump into a database may cost at once."""
        if self.cost_bar is not None:
            return self.cost_bar
        return math.inf if database.schema is None else USUAL_BAR

    def __post_init__(self) -> None:
        faults = [
            Fault(f"{field.name} is {value!r}.", _accepted(field.name))
            for field in fields(self)
            if field.name not in ("variation", "until_natural") and not _is_accepted(field.name, value := getattr(self, field.name))
        ]
        if not isinstance(self.until_natural, bool):
            faults.append(Fault(f"until_natural is {self.until_natural!r}.", "True or False"))
        if faults:
            raise MotionError(*faults)


def _accepted(name: str) -> str:
    return RATES[name][0] if name in RATES else f"a number, {'above 0' if name == 'rate' else '0 or more'}"


def _is_accepted(name: str, value: object) -> bool:
    if name == "cost_bar" and value is None:
        return True
    number = as_number(value)
    if name in RATES:
        return number is not None and RATES[name][1] <= number <= RATES[name][2]
    return number is not None and (number > 0.0 or (number == 0.0 and name != "rate"))


def read_controllers(
    parts: Mapping[str, Mapped], selectors: Collection[str], faults: list[Fault], file: str | None
) -> Iterator[tuple[str, str, ControllerSettings]]:
    """Name, selector and settings of each part without a fault; the faults of the others are kept."""
    for name, part in parts.items():
        n_faults = len(faults)
        section = Section(f"[controllers.{name}]", part, KEYS, faults, file)
        selector = _read_selector(section, list(selectors))
        values: dict[str, Any] = {
            key: section.number(key, accepted, 0.0, most) for key, (accepted, most) in SECONDS.items() if key in part
        }
        if "cost_bar" in part:
            values["cost_bar"] = section.number("cost_bar", BAR, 0.0, MOST_COST)
        if "until_natural" in part:
            values["until_natural"] = section.flag("until_natural")
        values |= {key: section.number(key, *RATES[key]) for key in RATES if key in part}
        variation = _read_variation(section)
        if len(faults) == n_faults and selector is not None:
            yield name, selector, ControllerSettings(**values, variation=variation)


def _read_selector(section: Section, selectors: list[str]) -> str | None:
    accepted = some(selectors) or "the name of a [selectors.NAME]"
    return section.one_of("selector", selectors, "selector") if section.has("selector", accepted) else None


def _read_variation(section: Section) -> Variation | None:
    """Variation, if the part asks for any."""
    within = section.number("variation_within", WITHIN, 0.0, MOST_COST) if "variation_within" in section.part else None
    memory: float | None = 1.0
    if "variation_memory" in section.part:
        memory = section.number("variation_memory", MEMORY, 0.0, MOST_ASSETS)
        if memory is not None and not memory.is_integer():
            section.wrong("variation_memory", "this is not a whole number", MEMORY, f"variation_memory = {math.floor(memory)}")
        if "variation_within" not in section.part:
            found = (
                f"{section.where} has {in_quotes('variation_memory')}, but without {in_quotes('variation_within')} nothing varies."
            )
            section.add(found, f"variation_within, {WITHIN}")
    return None if within is None or memory is None else Variation(within, int(memory))
