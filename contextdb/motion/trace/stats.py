"""A session in figures: how often it jumps and for how much, why it searched, how long a clip stays, what never plays."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass, field
from itertools import pairwise
from statistics import median
from typing import Any

import numpy as np

from contextdb.motion.clips.quaternions import Floats
from contextdb.motion.selection.decision import Action, Decision, Playing
from contextdb.motion.trace.rows import PERMUTATION_S
from contextdb.motion.trace.stock import Queryable, failing_rows
from contextdb.motion.trace.views import cause_of

SMALL_GAIN = 0.2
"""A jump that spares less than this share of the cost of playing on gains little."""
GAINS = (0.05, 0.1, 0.2, 0.5, 1.0)
"""The histogram of gains has a bar up to each."""

ENTERED = (Action.START, Action.JUMP)
"""Actions with which something begins to play."""
About = Mapping[str, Mapping[str, Any]]


@dataclass(frozen=True)
class SessionStats:
    """The figures of a session."""

    seconds: float
    updates: int
    searches: int
    jumps: int
    forced_jumps: int
    loops: int
    """`updates`, `searches`, `jumps`, `forced_jumps`, `loops`: a forced jump is one for which nothing could play on."""
    jumps_per_s: float
    causes: dict[str, int] = field(default_factory=dict)
    """How many searches there were for each cause."""
    gain_median: float | None = None
    """What a jump spares of the cost of playing on, as a share; None without a jump from what could play on. Negative for a jump
    that costs more: one that variation drew, or to a database that wins outright under its threshold. See `gains_of`."""
    gain_small_share: float | None = None
    """The share of such jumps that spare less than a fifth."""
    gains: tuple[int, ...] = ()
    """How many spare up to 5, 10, 20, 50 and 100 %."""
    stay_s: float | None = None
    """How long an animation plays until a jump, in the mean."""
    assets_used: int = 0
    assets_never_used: tuple[str, ...] | None = None
    """None where the session does not say what its databases hold."""
    frames_used_share: float | None = None
    """How much of the databases is played: at each moment a frame, and those passed since the moment before."""

    def to_json(self) -> dict[str, object]:
        document = asdict(self)
        document["gains"] = list(self.gains)
        document["assets_never_used"] = None if self.assets_never_used is None else list(self.assets_never_used)
        return document


def stats_of(decisions: Iterable[Decision], about: About) -> SessionStats:
    """The figures of a session; `about` is what a `Trace` says of its databases."""
    recorded = list(decisions)
    jumps = [each for each in recorded if each.action is Action.JUMP]
    seconds = recorded[-1].time_s - recorded[0].time_s if recorded else 0.0
    pairs = [(each.continuing_cost, each.cost) for each in jumps if each.cost is not None and each.continuing_cost is not None]
    gains: list[float] = gains_of(*np.array(pairs).reshape(-1, 2).T).tolist()
    causes: dict[str, int] = {}
    for each in recorded:
        if each.searched:
            cause = cause_of(each) or "other"
            causes[cause] = causes.get(cause, 0) + 1
    used = {each.playing.asset for each in recorded if each.playing is not None}
    known = [asset for each in about.values() for asset in each.get("assets", ())]
    return SessionStats(
        seconds=seconds,
        updates=len(recorded),
        searches=sum(each.searched for each in recorded),
        jumps=len(jumps),
        forced_jumps=sum(each.continuing_cost is None for each in jumps),
        loops=sum(each.action is Action.LOOP for each in recorded),
        jumps_per_s=len(jumps) / seconds if seconds > 0.0 else 0.0,
        causes=dict(sorted(causes.items(), key=lambda item: (-item[1], item[0]))),
        gain_median=median(gains) if gains else None,
        gain_small_share=sum(gain < SMALL_GAIN for gain in gains) / len(gains) if gains else None,
        gains=tuple(int(n) for n in np.bincount(np.searchsorted(GAINS, gains), minlength=len(GAINS))[: len(GAINS)]),
        stay_s=_stay_s(recorded),
        assets_used=len(used),
        assets_never_used=tuple(asset for asset in dict.fromkeys(known) if asset not in used) if known else None,
        frames_used_share=_frames_used(recorded, about),
    )


def measures_of(decisions: Sequence[Decision], about: About) -> dict[str, float | None]:
    """What is compared before and after a change, by the names that `motion measure` gives them."""
    stats = stats_of(decisions, about)
    never = None if stats.assets_never_used is None else float(len(stats.assets_never_used))
    return {
        "jumps_per_s": stats.jumps_per_s,
        "forced_jumps": float(stats.forced_jumps),
        "stay_s": stats.stay_s,
        "frames_used_share": stats.frames_used_share,
        "assets_never_used": never,
    }


def gains_of(continuing: Floats, costs: Floats) -> Floats:
    """What jumps of some costs spare of what playing on would have cost, as a share from -1 to 1.

    It is a share of the larger of both costs. For a jump that costs less than playing on that is the cost of playing on; where
    playing on costs about nothing, and a jump is made all the same, the share stays readable.
    """
    larger = np.maximum(np.abs(continuing), np.abs(costs))
    return np.clip((continuing - costs) / np.where(larger > 0.0, larger, 1.0), -1.0, 1.0)


def _stay_s(decisions: Sequence[Decision]) -> float | None:
    plays_s = sum(after.time_s - each.time_s for each, after in pairwise(decisions) if each.playing is not None)
    n_entered = sum(each.action in ENTERED for each in decisions)
    return plays_s / n_entered if n_entered else None


def _place(playing: Playing, about: About) -> tuple[str, int, int]:
    """The database, range and frame of what plays, in the first permutation of its clip: all show the same."""
    each = about.get(playing.database, {})
    at = playing.range % len(each.get(PERMUTATION_S, [0]))
    length = each["stops"][playing.range] - each["starts"][playing.range] if at else 0
    return playing.database, playing.range - at, playing.frame - at * length


def _frames_used(decisions: Sequence[Decision], about: About) -> float | None:
    if not about or not all("stops" in each for each in about.values()):
        return None
    every = sum((sum(each["stops"]) - sum(each["starts"])) // len(each.get(PERMUTATION_S, [0])) for each in about.values())
    used, last = set[tuple[str, int]](), None
    for each in decisions:
        if each.playing is None:
            last = None
            continue
        place = database, number, frame = _place(each.playing, about)
        goes_on = each.action not in ENTERED and database in about
        first = last[2] if goes_on and last is not None and last[:2] == place[:2] else frame
        if first <= frame:
            passed = [*range(first, frame + 1)]
        else:
            start, stop = (about[database][end][number] for end in ("starts", "stops"))
            passed = [*range(first, stop), *range(start, frame + 1)]
        used.update((database, at) for at in passed)
        last = place
    return len(used) / every if every else None


# ---- which columns of the tables force jumps: what played was not valid any more, and which of its cells do not accept the
# facts
#
# Of the asset's rows the one with the fewest failing cells counts. A jump because an animation ended is forced by no column.


@dataclass(frozen=True, slots=True)
class ForcedBy:
    """Columns that together forced jumps: how many, and what the most expensive of these cost."""

    columns: tuple[str, ...]
    jumps: int
    cost: float | None

    def sentence(self, n_forced: int) -> str:
        """It as people read it; of so many forced jumps."""
        cost = "" if self.cost is None else f", at a cost of up to {self.cost:.3g}"
        return f"forced by {' and '.join(self.columns)}: {self.jumps:,} of {n_forced:,} forced jumps{cost}"

    def to_json(self) -> dict[str, object]:
        return {"columns": list(self.columns), "jumps": self.jumps, "cost": self.cost}


def forced_by(decisions: Iterable[Decision], tables: Mapping[str, Queryable]) -> list[ForcedBy]:
    """The columns that forced jumps, those of most jumps first. `tables` is the compiled table of each database."""
    forced = []
    for decision in decisions:
        before = decision.before
        if before is None or not decision.is_forced or before.database not in tables or decision.context is None:
            continue
        rows = failing_rows(tables[before.database], before.asset, decision.context, before.mirrored)
        columns = min((tuple(each.condition for each in row.failures) for row in rows), key=len, default=())
        if columns:
            forced.append(ForcedBy(columns, 1, decision.cost))
    return together(forced)


def together(parts: Iterable[ForcedBy]) -> list[ForcedBy]:
    """Those of the same columns in one, those of most jumps first."""
    of_columns: dict[tuple[str, ...], list[ForcedBy]] = {}
    for each in parts:
        of_columns.setdefault(each.columns, []).append(each)
    forced = [
        ForcedBy(columns, sum(each.jumps for each in own), max((each.cost for each in own if each.cost is not None), default=None))
        for columns, own in of_columns.items()
    ]
    return sorted(forced, key=lambda each: -each.jumps)
