"""The controllers of one selector and one settings, for the core: see `contextdb/core/controller.h`.

A character is a row of numbers, and so are what has moved, a decision, and what each database has found. Q characters, D databases
of the selector, those that are not loaded too; R ranges, K kinds and N frames, of all databases one after the other; W numbers in a
row. Nothing here keeps where a character is.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from functools import cached_property
from itertools import pairwise
from typing import Any, NamedTuple, cast

import numpy as np
from numpy.typing import ArrayLike, NDArray

from contextdb.cells.row_play import LEAST, MOST, RowPlay
from contextdb.core import Controllers, fill_ranges
from contextdb.errors import Fault, QueryError, plural
from contextdb.motion import arguments
from contextdb.motion.answers import are_answers, is_answer
from contextdb.motion.arguments import Flags, ValidRanges
from contextdb.motion.clips.quaternions import Floats
from contextdb.motion.markup.left_out import LeftOut, Skip
from contextdb.motion.markup.tag_filter import TagFilter
from contextdb.motion.search.database import MotionDatabase
from contextdb.motion.search.filters import NO_FLAGS, Filter
from contextdb.motion.search.hit import NOTHING, Hit
from contextdb.motion.search.searcher import THREAD_QUERIES, in_blocks
from contextdb.motion.selection.choice import Choice
from contextdb.motion.selection.controller_settings import ControllerSettings
from contextdb.motion.selection.controller_state import ControllerState, Played
from contextdb.motion.selection.decision import Playing
from contextdb.motion.selection.events import Event, astray, checked, leads, seconds_to
from contextdb.motion.selection.search_options import Among, OfPenalties, OfTags, OfValidForMany, SearchOptions
from contextdb.motion.selection.selector import Selector, choice_of

ASK, CHOOSE, DECIDE = 1, 2, 4
N_STATE, N_PLAYED, N_MOVED, N_DECISION = 19, 4, 16, 39
TIME, PLAYING, N_REMEMBERED, PLAY, ENTERED = 1, slice(5, 9), 9, slice(10, 18), 18
ACTION, CAUSE, HELD, STANDING, WINNER, IS_UNDER, CHOSEN, CURRENT = 2, 3, 4, 5, 16, 17, slice(18, 22), 29
"""Columns of a row, and of a decision."""
NEW, WIDENED = (0.0, 2.0), 1.0
"""Actions that enter another frame, and what stands by hysteresis."""
NO_DATABASE, GONE, GO_ON = -1, -2, -2
MOST_PLAYED, MOST_JUMPS_PER_S = 1024, 60.0
"""So much of what was played is remembered at most, and so many jumps of each second."""
MOST_CHOOSERS, MOST_ANSWERS = 16, 64


class Shared(NamedTuple):
    """What characters may choose from but for ranges, as the core takes it: the kinds of frames that may be chosen and may play on,
    and what they cost; frames and their biases, None for all and for none; and the same as a filter of each loaded database."""

    allowed: Flags
    playable: Flags
    kind_biases: Floats
    flags: Flags | None
    frame_biases: Floats | None
    filters: dict[str, Filter]

    @classmethod
    def of(cls, chooser: Chooser, inputs: SearchOptions) -> Shared:
        """That of tags and biases."""
        filters = {}
        for name, database in chooser.selector.databases.items():
            given = inputs.of(name)
            filters[name] = database.filter(tags=given["tags"], bias=given["bias"])
        each = [(filters[name], database.n_frames) for name, database in chooser.selector.databases.items()]
        flags = [own.frames if len(own.frames) else np.ones(n, np.bool_) for own, n in each]
        biases = [own.frame_biases if len(own.frame_biases) else np.zeros(n) for own, n in each]
        return cls(
            np.concatenate([NO_FLAGS, *(own.kinds.allowed for own, _ in each)]),
            np.concatenate([NO_FLAGS, *(own.kinds.playable for own, _ in each)]),
            np.concatenate([np.empty(0), *(own.kinds.biases for own, _ in each)]),
            np.concatenate(flags) if any(len(own.frames) for own, _ in each) else None,
            np.concatenate(biases) if any(len(own.frame_biases) for own, _ in each) else None,
            filters,
        )


class Plays(NamedTuple):
    """How rows play, float64 [P, 8], and which of them each range has in each of n updates, -1 for none: int64 [n or 1, R]."""

    rows: Floats
    of: NDArray[np.int64]

    def of_range(self, at: int) -> RowPlay | None:
        """That of a range in the first update."""
        row = int(self.of[0, at])
        return None if row < 0 else RowPlay.of(self.rows[row].tolist())


class Ranges(NamedTuple):
    """Which ranges may play in each of n updates, bool [n or 1, R], their biases, float64 [n or 1, R], and how they play; None
    where no row says."""

    flags: Flags
    biases: Floats
    plays: Plays | None = None

    @classmethod
    def joined(cls, each: Sequence[Ranges]) -> Ranges:
        """Those of several updates of one each."""
        plays = [own.plays for own in each if own.plays is not None]
        joined = None
        if plays:
            starts = iter(np.cumsum([0, *(len(own.rows) for own in plays)]).tolist())
            none = np.full(each[0].flags.shape, -1, np.int64)
            of = [none if own.plays is None else _shifted(own.plays.of, next(starts)) for own in each]
            joined = Plays(np.concatenate([own.rows for own in plays]), np.concatenate(of))
        return cls(np.concatenate([own.flags for own in each]), np.concatenate([own.biases for own in each]), joined)


def _shifted(of: NDArray[np.int64], by: int) -> NDArray[np.int64]:
    return np.where(of < 0, of, of + by)


class Given(NamedTuple):
    """What Q characters are asked with."""

    queries: Floats
    dt_s: float
    ranges: Flags
    range_biases: Floats
    shared: Shared
    among: Flags
    urgent: NDArray[np.uint8]
    wide: Floats | None = None
    plays: Plays | None = None
    to_event: Floats | None = None
    event_s: float = 1.0
    leading: Flags | None = None


class Updates(NamedTuple):
    """Updates of Q characters under way: their rows before and after, what has moved, what is decided, and what was found."""

    chooser: Chooser
    before: Floats
    moved: Floats
    given: Given
    after: Floats
    decisions: Floats
    found: Floats

    def run(self, parts: int) -> None:
        """Do some steps of the updates, on as many cores as this process may use."""
        given, n, done = self.given, len(self.before), list[bool]()
        what = (
            given.ranges,
            given.range_biases,
            *given.shared[:5],
            given.among,
            given.urgent,
            *(given.plays or (None, None)),
            given.wide,
            given.to_event,
            given.event_s,
        )
        arrays = (self.before, self.moved, given.queries, given.dt_s, *what, self.after, self.decisions, self.found)
        if n < 2 * THREAD_QUERIES:
            done.append(self.chooser.core.update(parts, 0, n, *arrays))
        else:
            in_blocks(n, lambda start, stop: done.append(self.chooser.core.update(parts, start, stop, *arrays)))
        if not all(done):
            for query in given.queries:
                for database in self.chooser.selector.databases.values():
                    database.normalised(query)  # says what is wrong

    def filter_of(self, i: int, d: int) -> Filter:
        """What one character may choose from in one database."""
        chooser, given, moved = self.chooser, self.given, self.moved[i].tolist()
        part, decision = chooser.ranges_at[d], self.decisions[i].tolist()
        ranges = given.ranges[i if len(given.ranges) > 1 else 0, part].copy()
        biases = given.range_biases[i if len(given.range_biases) > 1 else 0, part].copy()
        current = int(decision[CURRENT]) if moved[0] == d else -1
        if current >= 0 and decision[STANDING] == WIDENED and given.wide is not None:
            ranges[int(moved[1])], biases[int(moved[1])] = True, given.wide[i]
        skips = tuple(self._skips(i, d))
        if given.leading is not None:
            leading = given.leading[chooser.frames_at[d]]
            current = current if current >= 0 and leading[current] else -1
            skips += tuple(astray(leading))
        chosen = given.shared.filters[chooser.names[d]]
        return chosen._replace(ranges=ranges, is_whole=bool(ranges.all()), range_biases=biases, skips=skips, current=current)

    def _skips(self, i: int, d: int) -> Iterable[Skip]:
        database = self.chooser.databases[d]
        assert database is not None, "of a database that is not loaded nothing is left out"
        most = (self.chooser.n_played + 4) * database.n_permutations + 3 * len(database.assets) + 1
        spans, whys = np.empty((most, 2), np.int64), np.empty(most, np.uint8)
        each = slice(i, i + 1)
        row = self.after[each].copy()
        if self.decisions[i, ACTION] in NEW and row[0, N_REMEMBERED]:
            row[0, N_REMEMBERED] -= 1  # what was entered only now was left out of no search
        row[0, PLAY] = self.before[i, PLAY]
        plays = self.given.plays
        own = (None, None) if plays is None else (plays.rows, plays.of[each] if len(plays.of) > 1 else plays.of)
        n = self.chooser.core.skips(row, self.moved[each], self.decisions[each], d, spans, whys, *own)
        return (Skip(start, stop, LeftOut(why)) for (start, stop), why in zip(spans[:n].tolist(), whys[:n].tolist(), strict=True))

    def choice(self, i: int) -> Choice:
        """The selector's answer to one character that searched."""
        chooser, hits = self.chooser, {}
        row = self.given.among[i if len(self.given.among) > 1 else 0].tolist()
        among = frozenset(name for name, is_among in zip(chooser.names, row, strict=True) if is_among)
        for name, database, (at, frame, cost) in zip(chooser.names, chooser.databases, self.found[i].tolist(), strict=True):
            if frame != -2.0 and database is not None:
                hits[name] = Hit(database.assets[int(at)], int(at), int(frame), cost) if frame >= 0.0 else NOTHING
        winner, is_under = int(self.decisions[i, WINNER]), bool(self.decisions[i, IS_UNDER])
        return choice_of(chooser.selector.entries, hits, among, chooser.names[winner] if is_under else None)


class Chooser:
    """What the core must know of a selector and the settings of its controllers."""

    def __init__(self, selector: Selector, settings: ControllerSettings) -> None:
        self.selector, self.settings = selector, settings
        self.names = selector.names
        self.databases = [selector.databases.get(name) for name in self.names]
        sizes = [(0, 0, 0) if d is None else (len(d.assets), d.marks.n_kinds, d.n_frames) for d in self.databases]
        starts = np.cumsum([(0, 0, 0), *sizes], axis=0).tolist()
        parts = [[slice(*ends) for ends in pairwise(column)] for column in zip(*starts, strict=True)]
        self.ranges_at, self.kinds_at, self.frames_at = parts
        self.n_ranges, self.n_kinds, self.n_frames = starts[-1]
        self.rates = [settings.rate if d is None or d.schema is None else d.schema.rate for d in self.databases]
        a_second = max(self.rates) * settings.max_play_rate + MOST_JUMPS_PER_S
        self.n_played = self._most_played(a_second)
        self.core = Controllers(
            tuple(self.part(*each) for each in zip(selector.entries, self.databases, self.rates, strict=True)),
            self.n_played,
            settings.search_every_s,
            settings.jump_threshold_s,
            settings.history_s,
            settings.min_play_rate,
            settings.max_play_rate,
            settings.grace_s,
            settings.settle_s,
            settings.asset_history_s,
            settings.until_natural,
        )
        self.width: int = self.core.width
        self.n_features = next((d.n_features for d in self.databases if d is not None), 0)
        self._tables: dict[object, tuple[object, tuple[Any, ...]]] = {}
        self._shared: dict[TagFilter | None, Shared] = {}
        self._answers: dict[object, tuple[object, Ranges]] = {}
        self._to_event: dict[str, Floats] = {}

    def _most_played(self, a_second: float) -> int:
        """How much of what was played is remembered at most: all for a while, then each asset once."""
        history_s, barred_s = (min(each, 1e3) for each in (self.settings.history_s, self.settings.asset_history_s))
        n_assets = sum(len(set(database.assets)) for database in self.databases if database is not None) if barred_s else 0
        n_played = 16 + math.ceil(history_s * a_second) + min(n_assets, math.ceil(barred_s * MOST_JUMPS_PER_S))
        return min(n_played, MOST_PLAYED) if history_s or barred_s else 0

    def __reduce__(self) -> tuple[Callable[..., Chooser], tuple[Selector, ControllerSettings]]:
        return Chooser.of, (self.selector, self.settings)

    @classmethod
    def of(cls, selector: Selector, settings: ControllerSettings) -> Chooser:
        """That of a selector and some settings; the last ones are cached."""
        known = selector.choosers.get(settings)
        if known is None:
            if len(selector.choosers) >= MOST_CHOOSERS:
                selector.choosers.clear()
            known = selector.choosers[settings] = cls(selector, settings)
        return cast("Chooser", known)

    def part(self, entry: Any, database: MotionDatabase | None, rate: float) -> tuple[Any, ...]:
        """One database as the core takes it."""
        threshold = math.nan if entry.threshold is None else float(entry.threshold)
        if database is None:
            return (None,) * 8 + (rate, threshold, math.inf, 0.0, 0.0, 1, 0, 0, 1.0)
        marks, root = database.marks, database.root
        pace = None if database.schema is None else database.schema.speed_features
        columns, pace_s = (slice(0, 0), 1.0) if pace is None else pace
        arrays = (marks.looping, root if root is None else np.asarray(root, np.float32), marks.kind_marks, marks.kind_root_weights)
        first: dict[str, int] = {}
        same = [first.setdefault(asset, number) for number, asset in enumerate(database.assets)]
        bounds = (np.asarray(each, np.int64) for each in (database.starts, database.stops, same))
        return (
            database.frames,
            *(each if each is None else np.ascontiguousarray(each) for each in (*bounds, *arrays)),
            rate,
            threshold,
            self.settings.bar_of(database),
            database.biases.continuing,
            self.settings.settle_of(database),
            database.n_permutations,
            columns.start,
            columns.stop - columns.start,
            pace_s,
        )

    # ---- rows

    def begun(self) -> Floats:
        """The row of a character that plays nothing yet: [1, W]."""
        return self.encode(ControllerState())

    def encode(self, state: ControllerState) -> Floats:
        """A state as a row [1, W]; what plays in no database that is there is gone."""
        row = np.zeros((1, self.width))
        waiting_s = math.nan if state.waiting_since_s is None else state.waiting_since_s
        row[0, :5] = state.tick, state.time_s, state.since_search_s, state.play_rate, waiting_s
        row[0, PLAYING] = NO_DATABASE, 0.0, 0.0, 0.0
        row[0, PLAY] = np.nan if state.play is None else state.play.numbers
        row[0, ENTERED] = state.entered_s
        if (playing := state.playing) is not None:
            at = self._range_of(playing)
            row[0, PLAYING] = (GONE, 0.0, 0.0, 0.0) if at is None else (*at, self._frame_at(at, playing.time_s), playing.time_s)
        known = [each for each in state.history if each.database in self.names][-self.n_played :] if self.n_played else []
        row[0, N_REMEMBERED] = len(known)
        for i, each in enumerate(known):
            start = N_STATE + N_PLAYED * i
            row[0, start : start + N_PLAYED] = self.names.index(each.database), each.start, each.stop, each.time_s
        return row

    def _range_of(self, playing: Playing) -> tuple[int, int] | None:
        """The database and the range that play, also in a database that was built again."""
        database = self.selector.databases.get(playing.database)
        if database is None:
            return None
        places = range(len(database.assets))
        near = [at for at in (playing.range, playing.range + 1) if at in places]
        for at in (*near, *places):
            is_it = database.assets[at] == playing.asset and database.mirrored[at] == playing.mirrored
            if is_it and database.stops[at] > database.starts[at]:
                return self.names.index(playing.database), at
        return None

    def _frame_at(self, at: tuple[int, int], time_s: float) -> int:
        database = self.databases[at[0]]
        assert database is not None, "what plays is of a database that is there"
        start, stop = int(database.starts[at[1]]), int(database.stops[at[1]])
        return min(max(start, start + round(time_s * self.rates[at[0]])), stop - 1)

    def state(self, row: Sequence[float], playing: Playing | None, recent: tuple[str, ...]) -> ControllerState:
        """A row as a state; `playing` is what plays, also where that is gone."""
        tick, time_s, since_s, rate, waiting_s = row[:5]
        each = [row[N_STATE + N_PLAYED * i : N_STATE + N_PLAYED * (i + 1)] for i in range(int(row[N_REMEMBERED]))]
        history = tuple(Played(self.names[int(d)], int(start), int(stop), played_s) for d, start, stop, played_s in each)
        waiting_since_s = None if math.isnan(waiting_s) else waiting_s
        known = waiting_since_s, RowPlay.of(row[PLAY]), row[ENTERED]
        return ControllerState(int(tick), time_s, playing, since_s, history, recent, rate, *known)

    def playing(self, numbers: Sequence[float]) -> Playing | None:
        """What plays, of its database, range, frame and second; None for nothing."""
        if numbers[0] < 0.0:
            return None
        d, at = int(numbers[0]), int(numbers[1])
        assets, mirrored, permutation_s = self._ranges[d]
        return Playing(self.names[d], assets[at], at, int(numbers[2]), numbers[3], mirrored[at], permutation_s(at))

    @cached_property
    def _ranges(self) -> list[tuple[tuple[str, ...], list[bool], Callable[[int], float | None]]]:
        """Of the ranges of each database: their assets, whether they are mirrored, and how far they look ahead."""
        return [((), [], lambda _: None) if d is None else (d.assets, d.mirrored.tolist(), d.permutation_s) for d in self.databases]

    def move(self, rows: Floats, dt_s: float, poses: bool = False) -> tuple[Floats, Floats | None]:
        """What plays some time later, [Q, 16], and the features of its frames, [Q, F], zeros for a character that plays nothing."""
        moved, features = np.empty((len(rows), N_MOVED)), np.zeros((len(rows), self.n_features)) if poses else None
        self.core.move(rows, dt_s, moved, features)
        return moved, features

    def are_rows(self, rows: Floats) -> bool:
        """Whether rows may be those of characters, such as of bytes that come from elsewhere."""
        known = rows[:, [0, 1, 2, 3, 5, 6, 7, 8, N_REMEMBERED]]
        if not np.isfinite(known).all():
            return False
        try:
            self.move(np.ascontiguousarray(rows), 0.0)
        except ValueError:
            return False
        databases = rows[:, N_STATE::N_PLAYED]
        return bool(np.isin(databases, np.arange(len(self.names))).all() if databases.size else True)

    # ---- what may be chosen

    def shared(self, tags: OfTags | None, bias: Mapping[str, ArrayLike] | None) -> Shared:
        """What characters with the same tags, and the same biases of frames, may choose from."""
        is_plain = not bias and (tags is None or isinstance(tags, TagFilter))
        known = self._shared.get(tags) if is_plain else None  # type: ignore[arg-type]
        if known is None:
            known = Shared.of(self, SearchOptions(tags=tags, bias=bias))
            if is_plain:
                if len(self._shared) >= MOST_CHOOSERS:
                    self._shared.clear()
                self._shared[tags] = known  # type: ignore[index]
        return known

    def among(self, among: Among | None) -> Flags:
        """The databases of the moment: bool [1, D]."""
        if among is None:
            return self._all_among
        names = self.selector.among(among)
        return np.array([[name in names for name in self.names]])

    @cached_property
    def _all_among(self) -> Flags:
        return np.ones((1, len(self.names)), np.bool_)

    def to_event(self, event: Event) -> Floats:
        """The seconds from each frame to an event, see `seconds_to`: float64 [N]. Raises QueryError for what is none, and for a tag
        that no markup has."""
        name, _ = checked(event)
        if name not in self._to_event:
            each = zip(self.databases, self.rates, strict=True)
            self._to_event[name] = np.concatenate([np.empty(0), *(seconds_to(d, name, rate) for d, rate in each if d is not None)])
        return self._to_event[name]

    def leading(self, event: Event, plays: Plays | None) -> Flags:
        """Which frames lead to an event in time, by the play rates of their rows or the settings: bool [N]."""
        rates = np.tile([[self.settings.min_play_rate], [self.settings.max_play_rate]], self.n_ranges)
        if plays is not None:
            own = np.where(plays.of[0] < 0, np.nan, plays.rows[plays.of[0], LEAST : MOST + 1].T)
            rates = np.where(np.isnan(own), rates, own)
        parts, seconds = [np.zeros(0, np.bool_)], self.to_event(event)
        for database, rate, ranges, frames in zip(self.databases, self.rates, self.ranges_at, self.frames_at, strict=True):
            if database is not None:
                of_frames = np.append(rates[:, ranges], [[np.nan]] * 2, axis=1)[:, database.layout.frame_ranges]
                parts.append(leads(seconds[frames], event[1], (of_frames[0], of_frames[1]), rate))
        return np.concatenate(parts)

    def check_names(self, inputs: SearchOptions, valid: Any) -> None:
        """Refuse a database that the selector does not have."""
        given = valid if are_mappings(valid) else [valid]
        names = [name for each in given if isinstance(each, Mapping) for name in each]
        self.selector.check_names([*names, *inputs.databases()])

    def ranges(self, valid: OfValidForMany | None, n: int) -> Ranges:
        """Which ranges may play in each of n updates."""
        if valid is None:
            return self._all_ranges
        key = _answered_key(valid)
        if key is None:
            return self._ranges_of(valid, n)
        if (known := self._answers.get(key)) is None:
            if len(self._answers) >= MOST_ANSWERS:
                self._answers.clear()
            known = self._answers[key] = valid, self._ranges_of(valid, n)
        return known[1]

    def _ranges_of(self, valid: OfValidForMany, n: int) -> Ranges:
        if are_mappings(valid):
            return Ranges.joined([self.ranges(own, 1) for own in cast("Sequence[Any]", valid)])
        if not isinstance(valid, Mapping) and (answers := AnswersOfMany.of(valid, n)) is not None:
            return self._answered({None: answers}, n)
        of_databases = valid if isinstance(valid, Mapping) else dict.fromkeys(self.selector.databases, valid)
        answers_of = {name: AnswersOfMany.of(each, n) for name, each in of_databases.items() if name in self.selector.databases}
        answered = self._answered({name: each for name, each in answers_of.items() if each is not None}, n)
        others = [name for name, each in answers_of.items() if each is None]
        return self._with_flags(answered, of_databases, others, n) if others else answered

    def _answered(self, answers: Mapping[str | None, AnswersOfMany], n: int) -> Ranges:
        """By the answers of tables, of databases or, without a name, of all."""
        n_masks = max(len(each.masks[0]) for each in answers.values()) if answers else 1
        (all_ranges, all_biases, _), has_costs = self._all_ranges, any(each.costs is not None for each in answers.values())
        is_every = None in answers
        ranges = np.empty((n_masks, self.n_ranges), np.bool_) if is_every else np.repeat(all_ranges, n_masks, axis=0)
        biases = np.repeat(all_biases, n_masks, axis=0) if has_costs else all_biases
        saying = {name: each.plays for name, each in answers.items() if each.plays is not None}
        chosen = np.full((n_masks, self.n_ranges), -1, np.int64) if saying else None
        n_before = 0
        for name, each in answers.items():
            masks, costs = each.of_length(n_masks)
            table, written = self.rows_of(name, each.assets), None if costs is None else biases
            plays = each.plays, None if each.plays is None else chosen
            fill_ranges(*table, *masks, *(costs or (None, None)), all_biases[0], ranges, written, *plays)
            if each.plays is not None and chosen is not None and n_before:
                own = slice(table[3], table[3] + len(table[2]))
                chosen[:, own] = _shifted(chosen[:, own], n_before)
            n_before += 0 if each.plays is None else len(each.plays)
        rows = list(saying.values())
        return Ranges(
            ranges, biases, None if chosen is None else Plays(rows[0] if len(rows) == 1 else np.concatenate(rows), chosen)
        )

    def _with_flags(self, answered: Ranges, of_databases: Mapping[str, Any], names: Sequence[str], n: int) -> Ranges:
        """The same where some databases are given flags of ranges, or something else that is no answer."""
        ranges, biases = (
            np.repeat(answered.flags, n // len(answered.flags), 0),
            np.repeat(answered.biases, n // len(answered.biases), 0),
        )
        for name in names:
            part = self.ranges_at[self.names.index(name)]
            flags, own = self.selector.databases[name].ranges_of_many(of_databases[name], n)
            ranges[:, part] = flags
            if own is not None:
                biases[:, part] = own
        return Ranges(ranges, biases, answered.plays)

    def penalised(self, biases: Floats, penalties: Sequence[OfPenalties | None]) -> Floats:
        """Biases of ranges with the penalties of each update: float64 [n, R]."""
        biases = np.array(np.broadcast_to(biases, (len(penalties), self.n_ranges)), order="C")
        for row, own in zip(biases, penalties, strict=True):
            for name, part in zip(self.names, self.ranges_at, strict=True):
                if own is not None and name in self.selector.databases:
                    given = SearchOptions(penalties=own).of(name)["penalties"]
                    row[part] += 0.0 if given is None else self.selector.databases[name].range_penalties(given)
        return biases

    @cached_property
    def _all_ranges(self) -> Ranges:
        """All ranges, and their biases where nothing else is given: [1, R] each."""
        biases = [database.filter().range_biases for _, database in self._loaded()]
        return Ranges(np.ones((1, self.n_ranges), np.bool_), np.concatenate([np.zeros(0), *biases])[None])

    def _loaded(self) -> list[tuple[str, MotionDatabase]]:
        return list(self.selector.databases.items())

    def rows_of(self, name: str | None, assets: Sequence[str]) -> tuple[Any, ...]:
        """The rows of a table for each range of a database, or of all: as `fill_ranges` takes them."""
        known = self._tables.get((name, id(assets)))
        if known is None or known[0] is not assets:
            rows_of: dict[str, list[int]] = {}
            for row, asset in enumerate(assets):
                rows_of.setdefault(asset, []).append(row)
            own = [database for each, database in self._loaded() if name in (None, each)]
            rows = [rows_of.get(asset, []) for database in own for asset in database.assets]
            mirrored = np.concatenate([np.zeros(0, np.bool_), *(database.mirrored for database in own)])
            at = 0 if name is None else self.ranges_at[self.names.index(name)].start
            numbers = np.array([row for each in rows for row in each], np.int64)
            known = assets, (np.cumsum([0, *map(len, rows)], dtype=np.int64), numbers, mirrored, at)
            if len(self._tables) >= MOST_CHOOSERS * len(self.names):
                self._tables.clear()
            self._tables[name, id(assets)] = known
        return known[1]


class AnswersOfMany(NamedTuple):
    """The answers of one table in n contexts, or one for all: the assets of its rows, and the masks of valid rows and what rows
    cost, [n or 1, ...], each as it is and with mirrored facts; no costs where rows have none. And how its rows play."""

    assets: Sequence[str]
    masks: tuple[Any, Any]
    costs: tuple[Floats, Floats] | None
    plays: Floats | None

    @classmethod
    def of(cls, valid: object, n: int) -> AnswersOfMany | None:
        """What is given as valid; None where it is no answers of one table."""
        if is_answer(valid):
            if valid.has_penalties:
                return cls._of([valid])
            mask, mirrored = valid.mask[None], valid.mirrored
            return cls(valid.table_assets, (mask, mask if mirrored is valid else mirrored.mask[None]), None, valid.plays)
        if are_answers(valid):
            if len(valid) != n:
                raise QueryError(Fault(f"{plural(len(valid), 'mask')} for {n} queries.", "one for all, or one for each query"))
            if not n or valid[0].has_penalties:
                return cls._of([valid[i] for i in range(n)]) if n else None
            return cls(valid.table_assets, (valid.mask, valid.mirrored.mask), None, valid[0].plays)
        if isinstance(valid, (list, tuple)) and len(valid) == n and n and all(map(is_answer, valid)):
            assets = valid[0].table_assets
            return cls._of(valid) if all(each.table_assets is assets for each in valid) else None
        return None

    @classmethod
    def _of(cls, answers: Sequence[Any]) -> AnswersOfMany:
        mirrored = [each.mirrored for each in answers]
        sides = (answers, mirrored)
        masks = [np.ascontiguousarray([each.mask for each in side]) for side in sides]
        has_costs = any(each.has_penalties for each in answers)
        costs = [np.array([each.penalties for each in side], np.float64) for side in sides] if has_costs else None
        return cls(answers[0].table_assets, (masks[0], masks[1]), None if costs is None else (costs[0], costs[1]), answers[0].plays)

    def of_length(self, n: int) -> tuple[tuple[Any, ...], tuple[Floats, ...] | None]:
        """Its arrays for n updates."""
        if len(self.masks[0]) == n:
            return self.masks, self.costs
        masks = tuple(np.repeat(each, n, axis=0) if len(each) < n else each for each in self.masks)
        costs = self.costs and tuple(np.repeat(each, n, axis=0) if len(each) < n else each for each in self.costs)
        return masks, costs


def _answered_key(valid: Any) -> tuple[object, ...] | None:
    """What tells one answer without costs, or those of some databases, from all others while it is kept; None for anything else."""
    if isinstance(valid, dict):
        keys = [(name, _answered_key(each)) for name, each in valid.items()]
        return None if any(key is None for _, key in keys) else tuple(keys)
    if not hasattr(valid, "bits") or valid.has_penalties:
        return None
    return id(valid.table_assets), valid.bits, valid.mirrored.bits


def widens(valid: object) -> bool:
    """Whether something that is given as valid may be another for what plays already."""
    if is_answer(valid) or are_answers(valid):
        return bool(valid.is_widening)
    if isinstance(valid, Mapping):
        return any(map(widens, valid.values()))
    if isinstance(valid, (list, tuple)) and not isinstance(valid, ValidRanges):
        return any(map(widens, valid))
    return isinstance(valid, ValidRanges) and valid.widened is not None


def own_valid(valid: Any, i: int) -> Any:
    """What one of many characters is given as valid."""
    if isinstance(valid, Mapping):
        return {name: own_valid(each, i) for name, each in valid.items()}
    return valid[i] if arguments.is_one_for_each(valid) or are_mappings(valid) else valid


def are_mappings(valid: object) -> bool:
    """Whether it is what each of many characters is given as valid, some by database."""
    return isinstance(valid, (list, tuple)) and any(isinstance(each, Mapping) for each in valid)
