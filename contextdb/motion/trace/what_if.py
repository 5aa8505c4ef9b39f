"""What a session would have been with other weights, biases, thresholds, tables or databases.

First every recorded search is asked again as it was, and the choices that differ are counted. Then the session is run again in
closed loop: the wished path, the facts and the valid assets of each update stay as they were recorded, what plays follows from the
new choices, and so does the pose in the query, wherever the recorded one was that of the frame that would play on. Between two
recorded searches the valid assets are those of the first of them, unless their table is asked again. What varies at random is drawn
from a generator of its own, so that a session with variation is compared with itself run again, not with the recording.
"""

from __future__ import annotations

import random
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from contextdb.console import progress
from contextdb.errors import Fault, MotionError
from contextdb.motion.arguments import ValidRanges
from contextdb.motion.clips.quaternions import Floats
from contextdb.motion.search.database import MotionDatabase
from contextdb.motion.search.filters import Filter
from contextdb.motion.selection.controller import Controller
from contextdb.motion.selection.decision import Decision, Playing
from contextdb.motion.selection.selector import Entry, Selector
from contextdb.motion.trace.cost_views import PATH
from contextdb.motion.trace.other_filters import asked_of_table
from contextdb.motion.trace.reasked import Reasked
from contextdb.motion.trace.stats import measures_of

ALIKE = 1e-4
"""A recorded query whose pose is as near as this to that of a frame was made of it."""


@dataclass(frozen=True)
class ChangedChoice:
    """A recorded search that chooses otherwise."""

    tick: int
    time_s: float
    was: str | None
    becomes: str | None


@dataclass(frozen=True)
class WhatIf:
    """What a change makes of a session.

    Attributes
    ----------
    searches : int
        How many recorded searches were asked again.
    other_frames : int
        How many of them choose another frame.
    other_assets : tuple of ChangedChoice
        Those that choose another asset.
    before, after : dict of str to float or None
        Measures of the session run again without and with the change.
    is_reproduced : bool
        Whether the session run again without the change plays what was recorded.
    """

    searches: int
    other_frames: int
    other_assets: tuple[ChangedChoice, ...]
    before: Mapping[str, float | None]
    after: Mapping[str, float | None]
    is_reproduced: bool

    def to_json(self) -> dict[str, object]:
        """The same as JSON has it."""
        return {
            "searches": self.searches,
            "other_frames": self.other_frames,
            "other_assets": [vars(each) for each in self.other_assets],
            "before": dict(self.before),
            "after": dict(self.after),
            "is_reproduced": self.is_reproduced,
        }


def what_if(recorded: Reasked, changed: Reasked) -> WhatIf:
    """What a change makes of a session: asked again without and with it, and run again without and with it.

    Raises MotionError where the session does not say how its updates were made.
    """
    asked = [each for each in progress(changed, "asking again") if each.choice is not None]
    others = tuple(
        ChangedChoice(each.decision.tick, each.decision.time_s, _asset(each.decision.choice), _asset(each.choice))
        for each in asked
        if each.is_other_asset
    )
    before, after = run_again(recorded), run_again(changed)
    return WhatIf(
        searches=len(asked),
        other_frames=sum(each.is_changed for each in asked),
        other_assets=others,
        before=measures_of(before, recorded.about),
        after=measures_of(after, changed.about),
        is_reproduced=[each.playing for each in before] == [each.playing for each in recorded.decisions],
    )


def run_again(asked: Reasked, on_step: Callable[[], None] | None = None) -> list[Decision]:
    """The decisions of a session run again in closed loop, with what is asked otherwise; `on_step` is called after each.

    Raises
    ------
    MotionError
        The session does not say how its updates were made.
    """
    decisions = list(asked.decisions)
    if any(each.inputs is None or each.query is None for each in decisions):
        raise MotionError(
            Fault(
                "the session does not say how its updates were made: it is of an older version, or was to keep no candidates.",
                "a session that this version records",
            )
        )
    runner = _Runner.of(asked, decisions)
    steps = progress(decisions, "running the session again") if on_step is None else decisions
    found = []
    for each in steps:
        found.append(runner.update(each))
        if on_step is not None:
            on_step()
    return found


@dataclass(eq=False)
class _Runner:
    """A controller that is given again what a session recorded."""

    asked: Reasked
    controller: Controller
    chosen: dict[str, Filter] = field(default_factory=dict)
    databases: dict[str, MotionDatabase] = field(default_factory=dict)

    @classmethod
    def of(cls, asked: Reasked, decisions: Sequence[Decision]) -> _Runner:
        """A controller at the start of a session."""
        first = next((each for each in decisions if each.choice is not None), None)
        if first is None or first.choice is None or first.inputs is None:
            raise MotionError(Fault("the session has no search.", "one with at least a search"))
        tags = sorted({tag for each in decisions for tag in _tags_of(each)})
        entries = [
            Entry(each.database, asked.databases.get(each.database), asked.thresholds.get(each.database, each.threshold))
            for each in first.choice.searches
        ]
        return cls(asked, Controller(Selector(entries, tags), first.inputs.settings, rng=random.Random(0)))

    def update(self, recorded: Decision) -> Decision:
        """The update of a recorded decision, made again."""
        inputs = recorded.inputs
        assert inputs is not None, "was looked at before"
        if recorded.choice is not None:
            searches = self.asked.of(recorded).searches
            self.chosen = {name: each.chosen for name, each in searches.items()}
        self.controller.settings = inputs.settings
        databases = self.controller.selector.databases
        chosen = {name: self._asked(name, each, recorded) for name, each in self.chosen.items() if name in databases}
        tags: dict[str, Any] = {name: each.frames if len(each.frames) else inputs.tags_of(name) for name, each in chosen.items()}
        return self.controller.update(
            inputs.dt_s,
            self._query(recorded, inputs.dt_s),
            {name: ValidRanges(each.ranges, each.range_biases) for name, each in chosen.items()},
            {name: each for name, each in tags.items() if each is not None},
            recorded.context,
            bias={name: each.frame_biases for name, each in chosen.items() if len(each.frame_biases)},
            among=inputs.among,
            force=inputs.force,
            interrupt=inputs.interrupt,
        )

    def _asked(self, name: str, chosen: Filter, recorded: Decision) -> Filter:
        """A filter with what its table says at this update, where it is asked again."""
        table = self.asked.tables.get(self.asked.stock.table_of.get(name, ""))
        if table is None or recorded.context is None:
            return chosen
        return asked_of_table(self.asked.databases[name], chosen, table, recorded.context)

    def _query(self, recorded: Decision, dt_s: float) -> Floats:
        """The recorded wish with the pose that would play on now."""
        query, upcoming = recorded.query, self.controller.upcoming(dt_s)
        assert query is not None, "was looked at before"
        if upcoming is None or recorded.before is None or _same(upcoming, recorded.before):
            return query
        database = self.controller.selector.databases[upcoming.database]
        pose = [part for name, part in zip(database.channel_names, database.slices, strict=True) if not name.startswith(PATH)]
        if database.schema is None or not self._is_of_frame(recorded, pose):
            return query
        found, raw = query.copy(), database.raw(upcoming.frame).astype(np.float32)
        for part in pose:
            found[part] = raw[part]
        return found

    def _is_of_frame(self, recorded: Decision, pose: Sequence[slice]) -> bool:
        """Whether the pose of a recorded query was that of the frame that would have played on."""
        before, query = recorded.before, recorded.query
        assert before is not None, "was looked at before"
        assert query is not None, "was looked at before"
        if before.database not in self.asked.databases or before.database in self.asked.changed:
            return True
        raw = self.asked.databases[before.database].raw(before.frame)
        return all(np.allclose(query[part], raw[part], rtol=ALIKE, atol=ALIKE) for part in pose)


def _same(one: Playing, other: Playing) -> bool:
    return (one.database, one.asset, one.frame) == (other.database, other.asset, other.frame)


def _tags_of(decision: Decision) -> set[str]:
    """Every tag that a decision's filters name."""
    tags = None if decision.inputs is None else decision.inputs.tags
    each = list(tags.values()) if isinstance(tags, Mapping) else [] if tags is None else [tags]
    hard = {tag for one in each for tag in (*one.include, *one.every, *one.exclude)}
    return hard | {tag for one in each for tag, _ in (*one.prefer, *one.avoid)}


def _asset(choice: Any) -> str | None:
    return None if choice is None else choice.hit.asset
