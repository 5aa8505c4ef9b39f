"""What `[controllers.NAME]` of contextdb.toml says: when a character searches, and where it may not jump.

Source: SearchThrottleTime, PoseJumpThresholdTime and PoseReselectHistory of Unreal's PoseSearch. The default history is the
shortest one with which a steered character without fitting clips still showed new frames half of the time. Bar and grace time are
those with which, on captured clips, no forced jump is taken over the bar and turns and changes of speed come no later.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Iterator, Mapping
from dataclasses import dataclass, replace
from typing import Any

from contextdb.errors import Fault, MotionError, in_quotes
from contextdb.files.settings import Declared, Section, Setting, flag, number, settings_of
from contextdb.files.toml_shapes import Mapped, Shape, filled, one_of
from contextdb.motion.search.database import MotionDatabase
from contextdb.motion.selection.variation import Variation

USUAL_BAR = 1.0
"""Half of what two frames cost on average that have nothing to do with each other."""

USUAL_SETTLING = -0.6
"""Measured with `settle_s` on halves of captured clips: the smallest with which circles and eights jump less than once a second;
turns and stops are reached as soon as without."""


def _seconds(about: str, default: float, note: str = "") -> Any:
    return number(about, default, 0.0, unit="seconds", note=note)


@dataclass(frozen=True, slots=True)
class ControllerSettings(Declared, error=MotionError):
    """How a controller goes about it. `variation` is the random choice among near ties; by default, always the best.

    Raises
    ------
    MotionError
        A setting that is not accepted; all faults together.
    """

    search_every_s: float = _seconds(
        "The time between two searches; one that is forced, or needed because the clip has ended, does not wait.",
        0.1,
        "0 is every update",
    )
    jump_threshold_s: float = _seconds("Frames of the playing range so near to the playing one are not candidates.", 0.2)
    history_s: float = _seconds("Frames that were played so shortly ago are not entered again.", 0.5, "0 is no memory")
    variation: Variation | None = None
    rate: float = number(
        "Frames a second of databases made from features; those built from clips know theirs.", 30.0, 1e-3, unit="frames a second"
    )
    min_play_rate: float = number(
        "How much slower a clip may be played, so that it goes about as fast as the query's trajectory asks for.", 0.8, 0.1, 1.0,
        note="1 plays nothing slower",
    )  # fmt: skip
    max_play_rate: float = number(
        "How much faster a clip may be played, so that it goes about as fast as the query's trajectory asks for.", 1.25, 1.0, 10.0,
        note="1 plays nothing faster",
    )  # fmt: skip
    cost_bar: float | None = number(
        "A jump out of an asset that is no longer valid waits while it costs more.", None, 0.0, unit="a cost", such_as=USUAL_BAR,
        without=f"{USUAL_BAR}; into a database made from features, whose costs have a scale of their own, none waits",
    )  # fmt: skip
    grace_s: float = _seconds("For how long such a jump waits at most; then it is taken, as the last resort.", 0.3, "0 is no grace")
    settle_bias: float | None = number(
        "Added to the cost of what was entered just now, so that a small gain brings no other jump soon.", None, -1e3, 0.0,
        unit="a cost", such_as=USUAL_SETTLING, without=f"{USUAL_SETTLING}; 0 where a database is made from features",
    )  # fmt: skip
    settle_s: float = number("The time in which that fades to nothing.", 1.5, 1e-3, unit="seconds")
    asset_history_s: float = _seconds(
        "An asset that was played so shortly ago is not entered again, mirrored or not. "
        "Where nothing else may play, the last frame is held.",
        0.0, "0 is no such bar",
    )  # fmt: skip
    until_natural: bool = flag("Whether an asset that does not loop plays on to its end when it is no longer valid.", False)

    def bar_of(self, database: MotionDatabase) -> float:
        """What a forced jump into a database may cost at once."""
        if self.cost_bar is not None:
            return self.cost_bar
        return math.inf if database.schema is None else USUAL_BAR

    def settle_of(self, database: MotionDatabase) -> float:
        """What is added to the cost of a frame of a database that was entered just now."""
        if self.settle_bias is not None:
            return self.settle_bias
        return 0.0 if database.schema is None else USUAL_SETTLING


_VARIATION = {f"variation_{key}": each for key, each in settings_of(Variation).items()}


def _wrong_names(value: object) -> str | None:
    listed = value if isinstance(value, (list, tuple)) else ()
    is_good = bool(listed) and all(isinstance(name, str) and name for name in listed) and len(set(listed)) == len(listed)
    return None if is_good else "these are not names, each once"


CONTROLLER = {
    "selector": Setting(filled("the name of a [selectors.NAME]"), "The name of a selector."),
    "joint": Setting(
        Shape('names of selectors or databases with roles, each once, such as ["tackles"]', _wrong_names, read=tuple),
        "Joint clips that its characters may be cast for: their characters and bundles have the poses.",
        (),
        more="See [joint clips](motion.md#several-characters-at-once).",
        without="none",
    ),
    **{key: each for key, each in settings_of(ControllerSettings).items() if key != "rate"},
    **_VARIATION,
    "variation_within": replace(_VARIATION["variation_within"], default=None, without="none are"),
}
"""The keys of `[controllers.NAME]`."""


def read_controllers(
    parts: Mapping[str, Mapped], selectors: Collection[str], faults: list[Fault], file: str | None
) -> Iterator[tuple[str, str, tuple[str, ...], ControllerSettings]]:
    """Name, selector, names of joint clips and settings of each part without a fault; the faults of the others are collected."""
    for name, part in parts.items():
        n_faults = len(faults)
        section = Section(f"[controllers.{name}]", part, CONTROLLER, faults, file)
        values = section.values(CONTROLLER, selector=one_of(list(selectors), "selector"))
        if "variation_memory" in part and "variation_within" not in part:
            problem = (
                f"{section.where} has {in_quotes('variation_memory')}, but without {in_quotes('variation_within')} nothing varies."
            )
            section.add(problem, f"variation_within, {CONTROLLER['variation_within'].shape.accepted}")
        if len(faults) == n_faults:
            varied = {key.removeprefix("variation_"): values.pop(key) for key in _VARIATION if key in values}
            names = values.pop("selector"), tuple(values.pop("joint", ()))
            yield name, *names, ControllerSettings(**values, variation=Variation(**varied) if varied else None)
