"""A session as columns: what played when, what was searched and what it cost, without a look into queries and candidates.

T updates. A session of ten minutes has 18,000; columns of them are read at once, and no `Decision` is made.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from contextdb.motion.clips.quaternions import Floats
from contextdb.motion.clips.skeleton import Ints
from contextdb.motion.selection.decision import Action
from contextdb.motion.trace.rows import BODY, FILTERS
from contextdb.motion.trace.session import Trace

if TYPE_CHECKING:
    from polars import Expr, Series

Flags = NDArray[np.bool_]
CHANGES = (str(Action.START), str(Action.JUMP))
READ = ("tick", "time_s", "action", "searched", "playing", "cost", "continuing_cost", "context", "root_motion", *BODY, FILTERS)


@dataclass(frozen=True, eq=False)
class Timeline:
    """The updates of a session."""

    ticks: Ints
    """Int64 [T]."""
    times_s: Floats
    """Float64 [T]."""
    assets: tuple[str, ...]
    """What plays anywhere, in the order in which it first does."""
    playing: Ints
    """Which of `assets` plays; -1 for nothing: int64 [T]."""
    mirrored: Flags
    searched: Flags
    jumped: Flags
    forced: Flags
    """`mirrored`, `searched`, `jumped`, `forced`: `jumped` where something begins to play, by a jump or at the start; `forced`
    where it had to jump: nothing could play on. Bool [T]."""
    new_facts: Flags
    """Whether the context is another than one update before: bool [T]."""
    costs: Floats
    continuing: Floats
    """`costs`, `continuing`: of the last search: the chosen frame, and playing on; NaN where there was none. Float64 [T]."""
    n_valid: Floats
    """How many ranges could play at the last search; NaN where the session does not say: float64 [T]."""
    roots: Floats
    """x, z and heading of the body: the game's, or, where the session does not say it, what the animations moved. Float64 [T, 3].
    """

    def __len__(self) -> int:
        return len(self.ticks)

    @property
    def rate(self) -> float:
        """About how many updates a second has."""
        return 1.0 / float(np.median(np.diff(self.times_s))) if len(self) > 1 and self.times_s[-1] > self.times_s[0] else 30.0

    @property
    def seconds(self) -> float:
        """From the first update to the last."""
        return float(self.times_s[-1] - self.times_s[0]) if len(self) else 0.0

    def uses(self) -> dict[tuple[str, bool], int]:
        """In how many updates each asset plays, as it is and mirrored."""
        keys, counts = np.unique(2 * self.playing[self.playing >= 0] + self.mirrored[self.playing >= 0], return_counts=True)
        return {(self.assets[key // 2], bool(key % 2)): n for key, n in zip(keys.tolist(), counts.tolist(), strict=True)}


def timeline_of(trace: Trace) -> Timeline:
    import polars as pl

    playing, ranges = pl.col("playing").struct, pl.element().struct.field("ranges")
    motion = [pl.col("root_motion").struct.field(name).fill_null(0.0) for name in ("left_m", "ahead_m", "turn_rad")]
    action = pl.col("action")
    frame = trace.columns(READ).select(
        "tick",
        "time_s",
        playing.field("asset"),
        playing.field("mirrored").fill_null(False),
        "searched",
        *BODY,
        jumped=action.is_in(CHANGES),
        forced=(action == str(Action.JUMP)) & pl.col("continuing_cost").is_null(),
        new_facts=(pl.col("context") != pl.col("context").shift(1)).fill_null(False),
        cost=_last_searched(pl.col("cost")),
        continuing=_last_searched(pl.col("continuing_cost")),
        n_valid=_last_searched(pl.col(FILTERS).list.eval(ranges.list.sum()).list.sum().cast(pl.Float64())),
        left=motion[0],
        ahead=motion[1],
        turn=motion[2],
    )
    names = frame["asset"].drop_nulls().unique(maintain_order=True).to_list()
    numbers = {name: i for i, name in enumerate(names)}
    roots = frame.select(*BODY).to_numpy().astype(np.float64)
    if np.isnan(roots).any():
        roots = _moved(*(frame[name].to_numpy() for name in ("left", "ahead", "turn")))
    return Timeline(
        ticks=frame["tick"].to_numpy().astype(np.int64),
        times_s=frame["time_s"].to_numpy().astype(np.float64),
        assets=tuple(names),
        playing=np.array([-1 if name is None else numbers[name] for name in frame["asset"]], np.int64),
        **{name: frame[name].to_numpy().astype(np.bool_) for name in ("mirrored", "searched", "jumped", "forced", "new_facts")},
        costs=_numbers(frame["cost"]),
        continuing=_numbers(frame["continuing"]),
        n_valid=_numbers(frame["n_valid"]),
        roots=roots,
    )


def _last_searched(value: Expr) -> Expr:
    """A value of the last search; NaN where it had none."""
    import polars as pl

    return pl.when("searched").then(value.fill_null(float("nan"))).forward_fill()


def _numbers(values: Series) -> Floats:
    return values.fill_null(float("nan")).to_numpy().astype(np.float64)


def _moved(left: Floats, ahead: Floats, turn: Floats) -> Floats:
    """Where a body comes to that begins at the origin: x, z and heading."""
    heading = np.cumsum(turn)
    facing = heading - turn
    sin, cos = np.sin(facing), np.cos(facing)
    return np.stack((np.cumsum(cos * left + sin * ahead), np.cumsum(cos * ahead - sin * left), heading), axis=1)
