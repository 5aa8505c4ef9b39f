"""What a session would have been with other weights, biases, thresholds, tables or databases.

First every recorded search is repeated as it was, and the choices that differ are counted. Then the session is run again in
closed loop: the wished path, the facts and the valid assets of each update stay as they were recorded, what plays follows from the
new choices, and so does the pose in the query, wherever the recorded one was that of the frame that would play on. Between two
recorded searches the valid assets are those of the first of them, unless their table is repeated. What varies at random is drawn
from a seed of its own, so that a session with variation is compared with itself run again, not with the recording.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np

from contextdb.console import progress
from contextdb.errors import Fault, MotionError
from contextdb.motion.arguments import Flags, ValidRanges
from contextdb.motion.clips.quaternions import Floats
from contextdb.motion.search.filters import Filter
from contextdb.motion.selection.controller import Controller
from contextdb.motion.selection.decision import Decision, Playing
from contextdb.motion.selection.inputs import Inputs
from contextdb.motion.selection.search_options import SearchOptions
from contextdb.motion.selection.selector import Entry, Selector
from contextdb.motion.trace.cost_views import PATH
from contextdb.motion.trace.other_filters import filter_by_table
from contextdb.motion.trace.reasked import Reasked
from contextdb.motion.trace.reasked_decision import asset_of
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
    """What a change makes of a session."""

    searches: int
    """How many recorded searches were repeated."""
    other_frames: int
    """How many of them choose another frame."""
    other_assets: tuple[ChangedChoice, ...]
    """Those that choose another asset."""
    before: Mapping[str, float | None]
    after: Mapping[str, float | None]
    """`before`, `after`: measures of the session run again without and with the change."""
    is_reproduced: bool
    """Whether the session run again without the change plays what was recorded."""

    def to_json(self) -> dict[str, object]:
        return {
            "searches": self.searches,
            "other_frames": self.other_frames,
            "other_assets": [vars(each) for each in self.other_assets],
            "before": dict(self.before),
            "after": dict(self.after),
            "is_reproduced": self.is_reproduced,
        }


def what_if(recorded: Reasked, changed: Reasked) -> WhatIf:
    """What a change makes of a session: repeated without and with it, and run again without and with it.

    Raises MotionError where the session does not say how its updates were made.
    """
    is_of_one, decisions = changed.decisions is recorded.decisions, list(recorded.decisions)
    recorded, changed = recorded.over(decisions), changed.over(decisions if is_of_one else list(changed.decisions))
    queried = [each for each in progress(changed, "asking again") if each.choice is not None]
    others = tuple(
        ChangedChoice(each.decision.tick, each.decision.time_s, asset_of(each.decision.choice), asset_of(each.choice))
        for each in queried
        if each.is_other_asset
    )
    before, after = run_again(recorded), run_again(changed)
    return WhatIf(
        searches=len(queried),
        other_frames=sum(each.is_changed for each in queried),
        other_assets=others,
        before=measures_of(before, recorded.about),
        after=measures_of(after, changed.about),
        is_reproduced=[each.playing for each in before] == [each.playing for each in recorded.decisions],
    )


def run_again(reasked: Reasked, on_step: Callable[[], None] | None = None) -> list[Decision]:
    """The decisions of a session run again in closed loop, with what is changed; `on_step` is called after each. Raises
    MotionError where the session does not say how its updates were made."""
    decisions = list(reasked.decisions)
    if any(each.inputs is None or each.query is None for each in decisions):
        raise MotionError(
            Fault(
                "the session does not say how its updates were made: it is of an older version, or was to keep no candidates.",
                "a session that this version records",
            )
        )
    runner = _Runner.of(reasked, decisions)
    steps = progress(decisions, "running the session again") if on_step is None else decisions
    made = []
    for at, each in enumerate(steps):
        made.append(runner.update(each, at))
        if on_step is not None:
            on_step()
    return made


@dataclass(eq=False)
class _Runner:
    """A controller that is given again what a session recorded."""

    reasked: Reasked
    controller: Controller
    is_of_frame: Flags
    """Whether the pose of each recorded query was that of the frame that would have played on."""
    chosen: dict[str, Filter] = field(default_factory=dict)
    given: tuple[Inputs, SearchOptions] | None = None
    """What the last update was given; it is so again until something is searched, or the inputs change."""
    raws: dict[tuple[str, int], Floats] = field(default_factory=dict)

    @classmethod
    def of(cls, reasked: Reasked, decisions: Sequence[Decision]) -> _Runner:
        """A controller at the start of a session."""
        first = next((each for each in decisions if each.choice is not None), None)
        if first is None or first.choice is None or first.inputs is None:
            raise MotionError(Fault("the session has no search.", "one with at least a search"))
        each_inputs = {id(each.inputs): each.inputs for each in decisions if each.inputs is not None}
        tags = sorted({tag for each in each_inputs.values() for tag in _tags_of(each)})
        entries = [
            Entry(each.database, reasked.databases.get(each.database), reasked.thresholds.get(each.database, each.threshold))
            for each in first.choice.searches
        ]
        controller = Controller(Selector(entries, tags), first.inputs.settings)
        return cls(reasked, controller, _are_of_frames(reasked, decisions))

    @cached_property
    def poses(self) -> Flags:
        """Which features are of the pose: bool [F]."""
        database = next(iter(self.controller.selector.databases.values()))
        flags = np.zeros(database.n_features, np.bool_)
        for name, part in zip(database.channel_names, database.slices, strict=True):
            flags[part] = not name.startswith(PATH)
        return flags

    def update(self, recorded: Decision, at: int) -> Decision:
        """The update of a recorded decision, the one at a place, made again."""
        inputs, controller = recorded.inputs, self.controller
        assert inputs is not None, "was looked at before"
        if recorded.choice is not None:
            self.chosen = {name: each.chosen for name, each in self.reasked.of(recorded).searches.items()}
            self.given = None
        controller.settings = inputs.settings
        if self.given is None or self.given[0] is not inputs or self.reasked.tables:
            self.given = inputs, self._inputs_of(recorded, inputs)
        query = self._query(recorded, inputs.dt_s, at)
        asked = self.given[1]
        return controller.update(
            inputs.dt_s,
            query,
            asked.valid,
            asked.tags,
            recorded.context,
            bias=asked.bias,
            among=asked.among,
            force=inputs.force,
            interrupt=inputs.interrupt,
            event=inputs.event,
        )

    def _inputs_of(self, recorded: Decision, inputs: Inputs) -> SearchOptions:
        """What an update is given but its query."""
        databases = self.controller.selector.databases
        chosen = {name: self._filter(name, each, recorded) for name, each in self.chosen.items() if name in databases}
        tags: dict[str, Any] = {name: each.frames if len(each.frames) else inputs.tags_of(name) for name, each in chosen.items()}
        return SearchOptions(
            valid={name: ValidRanges(each.ranges, each.range_biases) for name, each in chosen.items()},
            tags={name: each for name, each in tags.items() if each is not None},
            bias={name: each.frame_biases for name, each in chosen.items() if len(each.frame_biases)},
            among=inputs.among,
        )

    def _filter(self, name: str, chosen: Filter, recorded: Decision) -> Filter:
        """A filter with what its table says at this update, where that table is queried again."""
        table = self.reasked.tables.get(self.reasked.stock.table_of.get(name, ""))
        if table is None or recorded.context is None:
            return chosen
        return filter_by_table(self.reasked.databases[name], chosen, table, recorded.context)

    def _query(self, recorded: Decision, dt_s: float, at: int) -> Floats:
        """The recorded wish with the pose that would play on now."""
        query, upcoming = recorded.query, self.controller.upcoming(dt_s)
        assert query is not None, "was looked at before"
        if upcoming is None or recorded.before is None or _same(upcoming, recorded.before) or not self.is_of_frame[at]:
            return query
        key = upcoming.database, upcoming.frame
        raw = self.raws.get(key)
        if raw is None:
            database = self.controller.selector.databases[upcoming.database]
            if database.schema is None:
                return query
            raw = self.raws[key] = database.raw(upcoming.frame).astype(np.float32).astype(np.float64)
        return np.where(self.poses, raw, query)


def _are_of_frames(reasked: Reasked, decisions: Sequence[Decision]) -> Flags:
    """Whether the pose of each recorded query was that of the frame that would have played on: bool [T]."""
    flags = np.ones(len(decisions), np.bool_)
    for name, database in reasked.databases.items():
        places = [i for i, each in enumerate(decisions) if each.before is not None and each.before.database == name]
        frames = np.array([each.before.frame for i in places if (each := decisions[i]).before is not None], np.int64)
        if name in reasked.changed or not places or not database.layout.are_in_ranges(frames).all():
            continue
        pose = [part for channel, part in zip(database.channel_names, database.slices, strict=True) if not channel.startswith(PATH)]
        queries, raws = np.array([decisions[i].query for i in places]), database.raw_many(frames)
        are_near = [np.isclose(queries[:, part], raws[:, part], rtol=ALIKE, atol=ALIKE).all(axis=1) for part in pose]
        flags[places] = np.logical_and.reduce(are_near) if are_near else True
    return flags


def _same(one: Playing, other: Playing) -> bool:
    return (one.database, one.asset, one.frame) == (other.database, other.asset, other.frame)


def _tags_of(inputs: Inputs) -> set[str]:
    """Every tag that the filters of inputs name."""
    tags = inputs.tags
    each = list(tags.values()) if isinstance(tags, Mapping) else [] if tags is None else [tags]
    hard = {tag for one in each for tag in (*one.include, *one.every, *one.exclude)}
    return hard | {tag for one in each for tag, _ in (*one.prefer, *one.avoid)}
