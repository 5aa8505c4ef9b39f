"""Pairs of frames of which one should cost less, from what people would have chosen in recorded sessions.

At a search with choices, every preferred asset should cost less than every rejected one. Without a rejected one it should cost less
than what was chosen; without a preferred one the chosen asset should cost less than the rejected ones, or, where it is rejected
itself, the cheapest that is not. Each asset takes part with its best frame.

C channels. A frame takes part with the sums of squares of its channels; its bias is shared out among them, so that it stays what it
is for weights of every scale. A pair between databases with other features is left out: a cost of one is no cost of the other.

They are a CSV file beside the session, `session.choices.csv`, with a row for each asset:

    tick,asset,choice
    30,start_jog,+
    30,idle,-

The debugger writes it; any editor or script may. An edge: this touches the disk.
"""

from __future__ import annotations

import os
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path

import numpy as np

from contextdb.disk import read_bytes, write_atomic
from contextdb.disk.boundary import inside
from contextdb.errors import Fault, MotionError, Place, in_quotes, mend_for, some
from contextdb.files.csv_records import as_field
from contextdb.motion.clips.quaternions import Floats
from contextdb.motion.markup import file as rows_file
from contextdb.motion.markup.left_out import LeftOut
from contextdb.motion.search.database import MotionDatabase
from contextdb.motion.trace.reasked import Reasked
from contextdb.motion.trace.reasked_decision import ReaskedDecision, asset_of
from contextdb.motion.trace.session import Trace
from contextdb.motion.trace.stock import Stock
from contextdb.motion.trace.winning_changes import Place as Standing
from contextdb.motion.trace.winning_changes import place_of

Weights = Mapping[str, Mapping[str, float]]
"""Of the channels of features, by their names."""


@dataclass(frozen=True, eq=False)
class ChoiceSession:
    """A recorded session, what people would have chosen in it, and its databases and tables as they are now; `features_of` names
    the features of each database."""

    file: str
    trace: Trace
    preferences: Sequence[Preference]
    stock: Stock
    features_of: Mapping[str, str]

    @cached_property
    def moments(self) -> dict[int, list[Preference]]:
        """The choices by the place of their decision. Raises MotionError for a tick without a search, and for an unknown asset."""
        if not self.preferences:
            return {}
        ticks = {decision.tick: i for i, decision in enumerate(self.trace.brief()) if decision.choice is not None}
        assets = list(dict.fromkeys(asset for each in self.stock.databases.values() for asset in each.assets))
        moments: dict[int, list[Preference]] = {}
        faults = []
        for each in self.preferences:
            place = Place(str(choices_path(self.file)), each.line)
            if each.tick not in ticks:
                near = min(ticks, key=lambda tick: abs(tick - each.tick), default=None)
                mend = "" if near is None else f"{near}"
                faults.append(Fault(f"nothing was searched at tick {each.tick}.", "the tick of a search", mend, place))
            elif each.asset not in assets:
                problem = f"no database has an asset {in_quotes(each.asset)}."
                faults.append(Fault(problem, some(assets), mend_for(each.asset, assets), place))
            else:
                moments.setdefault(ticks[each.tick], []).append(each)
        if faults:
            raise MotionError(*faults)
        return moments

    def reasked(self, weights: Weights | None = None) -> Reasked:
        """The session repeated with the present weights, or with others."""
        databases = {name: self._weighed(name, each, weights or {}) for name, each in self.stock.databases.items()}
        return Reasked(self.trace, self.trace.about, Stock(databases, self.stock.tables, self.stock.table_of), {})

    def _weighed(self, name: str, database: MotionDatabase, weights: Weights) -> MotionDatabase:
        own = weights.get(self.features_of[name])
        return database.with_weights(own) if own else database

    def n_followed(self, weights: Weights) -> int:
        """How many moments choose as people would: a preferred asset where there is one, and no rejected one."""
        reasked = self.reasked(weights)
        return sum(_is_followed(reasked[place], preferences) for place, preferences in self.moments.items())


def _is_followed(decision: ReaskedDecision, preferences: Sequence[Preference]) -> bool:
    preferred, rejected = _sides(preferences)
    asset = asset_of(decision.choice)
    return asset in preferred if preferred else asset not in rejected


def _sides(preferences: Sequence[Preference]) -> tuple[set[str], set[str]]:
    """The assets that are preferred, and those that are rejected."""
    return {each.asset for each in preferences if each.is_preferred}, {each.asset for each in preferences if not each.is_preferred}


@dataclass(frozen=True, eq=False)
class _Side:
    """A frame of a pair: which it is, with which features, and what of it is weighed, float64 [C]."""

    features: str
    frame: tuple[str, int]
    sums: Floats

    @classmethod
    def of(cls, session: ChoiceSession, at: Standing) -> _Side:
        sizes = np.array([part.stop - part.start for part in at.search.database.slices])
        sums = at.search.sums[:, at.frame] + sizes * at.search.biases[at.frame]
        return cls(session.features_of[at.name], (at.name, at.frame), sums)


Moment = tuple[int, int]
"""The number of a session and the place of a decision in it."""


@dataclass(eq=False)
class ChoicePairs:
    """The pairs of some sessions."""

    sessions: Sequence[ChoiceSession]
    of_features: dict[str, dict[Moment, dict[object, Floats]]] = field(default_factory=dict)
    """For features the pairs of each moment: by their two frames the differences of the channels, float64 [C], of the frame that
    should cost more, less those of the one that should cost less."""
    unusable: list[str] = field(default_factory=list)
    """Choices that no weight can follow, each with the reason."""
    _better: dict[Moment, list[_Side]] = field(default_factory=dict)

    @classmethod
    def of(cls, sessions: Sequence[ChoiceSession]) -> ChoicePairs:
        """Those of the searches as they are now."""
        pairs = cls(sessions)
        for number, session in enumerate(sessions):
            reasked = session.reasked()
            for place, preferences in session.moments.items():
                pairs._add_moment((number, place), session, reasked[place], preferences)
        return pairs

    def differences(self, features: str, fold: int = 0, n_folds: int = 1) -> tuple[Floats, Floats]:
        """The differences of the pairs, [P, C]: without those of a fold of the moments, and those of it alone; one fold holds
        them all."""
        parts: tuple[list[Floats], list[Floats]] = ([], [])
        for i, pairs in enumerate(self.of_features[features].values()):
            parts[i % n_folds == fold].extend(pairs.values())
        return np.array(parts[0]), np.array(parts[1])

    def __len__(self) -> int:
        return sum(len(pairs) for moments in self.of_features.values() for pairs in moments.values())

    def add_winners(self, weights: Weights) -> bool:
        """Add a pair wherever weights choose what people would not; whether there was a new one."""
        n = len(self)
        for number, session in enumerate(self.sessions):
            reasked = session.reasked(weights)
            for place, preferences in session.moments.items():
                decision = reasked[place]
                worse = [] if _is_followed(decision, preferences) else _winner(decision, ())
                for winner in worse:
                    for better in self._better.get((number, place), []):
                        self._add((number, place), better, _Side.of(session, winner))
        return len(self) > n

    def _add_moment(
        self, moment: Moment, session: ChoiceSession, decision: ReaskedDecision, preferences: Sequence[Preference]
    ) -> None:
        usable = []
        for each in preferences:
            at = place_of(decision, each.asset)
            why = at.left_out.text or ("" if at.name in decision.searched else "another database won before it was searched")
            if why:
                where = f"{session.file}, tick {each.tick:,}"
                self.unusable.append(f"{where}: {each.asset} cannot be chosen whatever the weights are: {why}")
            else:
                usable.append((each.is_preferred, at))
        preferred, rejected = ([at for is_preferred, at in usable if is_preferred is side] for side in (True, False))
        if not usable:
            return
        if not rejected:
            rejected = _winner(decision, {at.asset for at in preferred})
        if not preferred:
            preferred = _cheapest_but(decision, {at.asset for at in rejected})
        self._better[moment] = [_Side.of(session, at) for at in preferred]
        for worse in rejected:
            for better in self._better[moment]:
                self._add(moment, better, _Side.of(session, worse))

    def _add(self, moment: Moment, better: _Side, worse: _Side) -> None:
        """Add a pair, of frames with the same features that differ in them."""
        if better.features != worse.features:
            return
        differences = worse.sums - better.sums
        if differences.any():
            pairs = self.of_features.setdefault(better.features, {}).setdefault(moment, {})
            pairs.setdefault((better.frame, worse.frame), differences)


def _winner(decision: ReaskedDecision, but: Collection[str]) -> list[Standing]:
    """What is chosen, unless it is one of some assets."""
    choice = decision.choice
    if choice is None or choice.database is None or choice.hit.asset in but:
        return []
    return [Standing(decision.searches[choice.database], choice.hit.range, choice.hit.frame)]


def _cheapest_but(decision: ReaskedDecision, assets: Collection[str]) -> list[Standing]:
    """What is chosen, or where that is one of some assets the cheapest other."""
    return _winner(decision, assets) or list(_others(decision, assets))[:1]


def _others(decision: ReaskedDecision, assets: Collection[str]) -> Iterator[Standing]:
    """What else may be chosen, the cheapest first."""
    for each in decision.best_of_assets():
        if each.row.asset not in assets and each.row.left_out is LeftOut.NO:
            yield Standing(decision.searches[each.database], each.row.range, each.row.frame)


# ---- what a person would have chosen in a recorded session: assets that should have played at a search, and assets that
# should not


COLUMNS = ("tick", "asset", "choice")
PREFERRED, REJECTED = "+", "-"


@dataclass(frozen=True, slots=True)
class Preference:
    """An asset that should have been chosen by the search at a tick, or should not; `line` is that of its file."""

    tick: int
    asset: str
    is_preferred: bool
    line: int | None = None


def choices_path(session: str | Path) -> Path:
    """Where the choices of a session are. Raises FileError where a link leads out of its folder."""
    return inside(Path(session).with_suffix(".choices.csv"), Path(session).parent)


def read_choices(session: str | Path) -> list[Preference]:
    """The choices of a session; none where there is no such file. Raises MotionError with every fault of the file, FileError where
    it cannot be read."""
    path = choices_path(session)
    if not os.path.exists(path):
        return []
    text = rows_file.text_of(read_bytes(path), str(path), "CSV text in UTF-8 with the columns tick, asset and choice")
    rows = rows_file.rows_of(text, str(path), COLUMNS, COLUMNS)
    choices = {}
    faults = list(rows.faults)
    for row in rows.rows:
        wrong = list(_faults(row, str(path)))
        faults += wrong
        if not wrong:
            tick, asset, choice = (row.fields[name] for name in COLUMNS)
            choices[int(tick), asset] = Preference(int(tick), asset, choice == PREFERRED, row.line)
    if faults:
        raise MotionError(*faults)
    return list(choices.values())


def write_choices(session: str | Path, choices: Mapping[tuple[int, str], bool]) -> None:
    """Write the choices of a session, by tick and asset, whether it is preferred. Raises FileError where the disk refuses."""
    lines = [",".join(COLUMNS).encode()]
    for (tick, asset), is_preferred in sorted(choices.items()):
        lines.append(b"%d,%s,%s" % (tick, as_field(asset), (PREFERRED if is_preferred else REJECTED).encode()))
    write_atomic(choices_path(session), b"\n".join([*lines, b""]))


def _faults(row: rows_file.Row, file: str) -> Iterator[Fault]:
    tick, asset, choice = (row.fields[name] for name in COLUMNS)
    if not (tick.isascii() and tick.isdecimal() and len(tick) <= 18):
        yield Fault(f"{in_quotes(tick)} is not a tick.", "a whole number, 0 or more", place=Place(file, row.line, "tick"))
    if not asset:
        yield Fault("no asset is named.", "the name of an asset", place=Place(file, row.line, "asset"))
    if choice not in (PREFERRED, REJECTED):
        accepted = "+ for an asset that should have been chosen, - for one that should not"
        yield Fault(f"{in_quotes(choice)} is not a choice.", accepted, place=Place(file, row.line, "choice"))
