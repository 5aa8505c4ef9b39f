"""How the body moves in each frame of a clip, and the bins that motion coverage counts frames in.

Speed is metres a second over the ground; turn is degrees a second of the facing, positive to the left; direction is degrees of the
movement against the facing, positive to the left. All three are means over a second about the frame, in the body's own frame, so
that the sway of each step is no turn and a circle is as fast as its arc. N frames, F of one range.

There are two maps, both with a row for each span of speeds:

    turn         by rate of turning: frames that go ahead, within 67.5 degrees of the facing, and frames that stand
    direction    by direction of movement: frames that move, whatever they turn

All edges are here. A value on an edge is in the bin farther from 0, on both sides alike, so that a mirrored frame is in the bin
opposite.
"""

from __future__ import annotations

import hashlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from contextdb.cells.arguments import require_many, require_mapping, require_point, require_real, require_text
from contextdb.motion.clips.quaternions import Floats
from contextdb.motion.clips.skeleton import Ints
from contextdb.motion.clips.trajectory import rates_of_change

WINDOW_S = 1.0
"""What is measured at a frame is the mean over so many seconds about it."""
LEAST_FRAMES = 5
"""A bin is filled from so many frames on: fewer are passed through by chance."""
SPEED_EDGES_MPS = (0.2, 0.6, 1.0, 1.5, 2.1, 3.0, 4.0, 5.0, 7.0)
"""Slower than the first a body stands; the last bin has no end."""
TURN_EDGES_DPS = (15.0, 35.0, 70.0, 135.0)
"""To the left, and in the same way to the right; the last bins have no end. Turns of 45, 60, 90 and 180 are well inside."""
SECTOR_DEG = 45.0
AHEAD_DEG = 1.5 * SECTOR_DEG
SPEED, TURN, DIRECTION = "speed", "turn", "direction"

Counts = NDArray[np.int64]
Span = tuple[float, float]


@dataclass(frozen=True)
class Bin:
    """A span of one quantity, its words, and its ends; an angle's begin where it is least to the left."""

    name: str
    low: float
    high: float

    @property
    def middle(self) -> float:
        """What lies in its middle; of a bin without an end what is half as far again from the end that it has."""
        if np.isinf(self.high):
            return self.low * 1.25
        return self.high * 1.25 if np.isinf(self.low) else (self.low + self.high) / 2.0

    def to_json(self) -> dict[str, object]:
        """As plain data; an end that is not there is None."""
        low, high = (None if np.isinf(end) else end for end in (self.low, self.high))
        return {"name": self.name, "from": low, "to": high}


@dataclass(frozen=True)
class Map:
    """One map: speeds down, another quantity across, from the left of the body to its right."""

    name: str
    rows: tuple[Bin, ...]
    columns: tuple[Bin, ...]
    opposite: tuple[int, ...]
    """For each column that of the same movement in a mirror."""
    centre: int
    """The column of straight ahead."""
    is_round: bool
    """Whether the last column is beside the first."""
    caption: str
    """What it shows."""

    @property
    def shape(self) -> tuple[int, int]:
        return len(self.rows), len(self.columns)

    def words(self, row: int, column: int) -> str:
        speed = self.rows[row].name
        if self.name == DIRECTION:
            return f"{speed} m/s going {self.columns[column].name}"
        name = self.columns[column].name
        moves = "standing" if row == 0 else f"{speed} m/s ahead"
        if column == self.centre:
            return moves if row == 0 else f"{moves}, straight"
        return f"{moves}, turning {name}°/s"


def _speeds() -> tuple[Bin, ...]:
    edges = (0.0, *SPEED_EDGES_MPS, np.inf)
    names = ["stands", *(f"{low:g}-{high:g}" for low, high in pairwise(edges[1:-1])), f"{edges[-2]:g}+"]
    return tuple(Bin(name, low, high) for name, low, high in zip(names, edges[:-1], edges[1:], strict=True))


def _turns() -> tuple[Bin, ...]:
    ends = (*TURN_EDGES_DPS, np.inf)
    spans = [(f"{low:g}-{high:g}" if high < np.inf else f"{low:g}+", low, high) for low, high in pairwise(ends)]
    left = [Bin(f"left {name}", low, high) for name, low, high in reversed(spans)]
    right = [Bin(f"right {name}", -high, -low) for name, low, high in spans]
    return (*left, Bin("straight", -TURN_EDGES_DPS[0], TURN_EDGES_DPS[0]), *right)


def _directions() -> tuple[Bin, ...]:
    named = {3: "back-left", 2: "left", 1: "ahead-left", 0: "ahead", -1: "ahead-right", -2: "right", -3: "back-right", 4: "back"}
    half = SECTOR_DEG / 2.0
    return tuple(Bin(name, sector * SECTOR_DEG - half, sector * SECTOR_DEG + half) for sector, name in named.items())


SPEEDS = _speeds()
MAPS: Mapping[str, Map] = {
    TURN: Map(TURN, SPEEDS, _turns(), tuple(range(8, -1, -1)), 4, False, "speed by turn, of frames that stand or go ahead"),
    DIRECTION: Map(
        DIRECTION,
        SPEEDS[1:],
        _directions(),
        (6, 5, 4, 3, 2, 1, 0, 7),
        3,
        True,
        "speed by direction against the facing, of all that move",
    ),
}


@dataclass(frozen=True, eq=False)
class Moves:
    """How the body moves in each frame: float64 [N] each; the direction of one that stands still is that of what it does at all."""

    speeds_mps: Floats
    turns_dps: Floats
    directions_deg: Floats

    @classmethod
    def of(cls, root: Floats, rate: float) -> Moves:
        """Of one range of F frames: x, z and heading [F, 3], in metres and radians, `rate` frames a second."""
        root = np.asarray(root, np.float64)
        change = rates_of_change(root, rate)
        sine, cosine = np.sin(root[:, 2]), np.cos(root[:, 2])
        left = change[:, 0] * cosine - change[:, 1] * sine
        ahead = change[:, 0] * sine + change[:, 1] * cosine
        own = _means(np.column_stack((left, ahead, change[:, 2])), round(WINDOW_S * rate) // 2)
        speeds = np.hypot(own[:, 0], own[:, 1])
        return cls(speeds, np.degrees(own[:, 2]), np.degrees(np.arctan2(own[:, 0], own[:, 1])))

    def counts(self, counted: NDArray[np.bool_]) -> dict[str, Counts]:
        """How many of the frames [F] that are counted are in each bin of each map."""
        rows = np.searchsorted(SPEED_EDGES_MPS, _tidy(self.speeds_mps), side="right")
        turns = 4 - np.sign(self.turns_dps).astype(np.int64) * np.searchsorted(
            TURN_EDGES_DPS, _tidy(np.abs(self.turns_dps)), side="right"
        )
        sectors = np.floor(_tidy(np.abs(self.directions_deg)) / SECTOR_DEG + 0.5).astype(np.int64)
        directions = np.where(sectors == 4, 7, 3 - np.sign(self.directions_deg).astype(np.int64) * sectors)
        is_ahead = (rows == 0) | (_tidy(np.abs(self.directions_deg)) < AHEAD_DEG)
        return {
            TURN: _counted(MAPS[TURN], rows, turns, counted & is_ahead),
            DIRECTION: _counted(MAPS[DIRECTION], rows - 1, directions, counted & (rows > 0)),
        }


def _tidy(values: Floats) -> Floats:
    """Values that differ from an edge by rounding only, on it."""
    return np.round(values, 6)


def _counted(of: Map, rows: Ints, columns: Ints, counted: NDArray[np.bool_]) -> Counts:
    counts = np.zeros(of.shape, np.int64)
    np.add.at(counts, (rows[counted], columns[counted]), 1)
    return counts


def _means(values: Floats, half: int) -> Floats:
    """The mean of values [F, ...] over so many frames on both sides of each, as far as there are."""
    sums = np.concatenate((np.zeros_like(values[:1]), np.cumsum(values, axis=0)))
    frames = np.arange(len(values))
    first, behind = np.maximum(frames - half, 0), np.minimum(frames + half + 1, len(values))
    return np.asarray((sums[behind] - sums[first]) / (behind - first)[:, None])


# ---- which bins of the maps a context wants; `contextdb.motion.measuring.coverage` says when it does


Bools = NDArray[np.bool_]
ASKED = 'a mapping such as {"speed": [(0.0, 2.0)]}'


@dataclass(frozen=True)
class ClipContexts:
    """Contexts in which the same clips may play."""

    assets: frozenset[str]
    mirrored: frozenset[str]
    """`assets`, `mirrored`: the assets that are valid, and those that are valid mirrored: by mirrored facts."""
    share: float = 1.0
    """0…1 of all contexts."""
    cells: Mapping[str, str] = field(default_factory=dict)
    """The smallest box of cells that holds these contexts; conditions that it does not restrict are left out."""
    asked: Mapping[str, Sequence[Span]] = field(default_factory=dict)
    """For "speed" (m/s), "turn" (degrees a second) and "direction" (degrees), as far as the table knows them, the spans requested.
    """
    is_symmetric: bool = True
    """Whether they are the same contexts in a mirror."""

    def __post_init__(self) -> None:
        for name in ("assets", "mirrored"):
            listed = require_many(getattr(self, name), name, "the names of clips")
            object.__setattr__(self, name, frozenset(require_text(each, f"one of {name}") for each in listed))
        require_real(self.share, "share", 0.0, 1.0)
        require_mapping(self.cells, "cells", "a mapping of conditions to cells")
        for axis, spans in require_mapping(self.asked, "asked", ASKED).items():
            for span in require_many(spans, f"asked[{axis!r}]", ASKED):
                require_point(span, "a span", ASKED)

    @property
    def id(self) -> str:
        """Of the same clips the same from run to run."""
        text = "\0".join([*sorted(self.assets), "\1", *sorted(self.mirrored)])
        return hashlib.blake2b(text.encode("utf-8", "surrogatepass"), digest_size=4).hexdigest()


def wanted_bins(of: Map, filled: Bools, each: ClipContexts) -> Bools:
    """Which bins of a map are wanted in some contexts, from those that are filled."""
    both = filled | filled[:, of.opposite] if each.is_symmetric else filled
    across = TURN if of.name == TURN else DIRECTION
    wanted = both | _between(both, axis=0) | (_beside(both) if of.is_round else _between(both, axis=1))
    rows, columns = _bins_within(of.rows, each.asked.get(SPEED)), _bins_within(of.columns, each.asked.get(across))
    needed: Bools = np.zeros(of.shape, np.bool_)
    if rows is not None:
        wanted &= rows[:, None]
    if columns is not None:
        wanted &= columns
    if columns is not None:
        needed[both.any(axis=1) if rows is None else rows] = columns
    elif rows is not None and across == TURN:
        needed[rows & ~both.any(axis=1), _straightest(of, both)] = True
    wanted |= needed
    if across == DIRECTION:
        wanted[:, of.centre] = False
    return np.asarray(wanted)


def _straightest(of: Map, filled: Bools) -> int:
    """The column nearest to straight ahead that is filled at any speed; straight ahead where none is."""
    columns = np.flatnonzero(filled.any(axis=0)).tolist() or [of.centre]
    return int(min(columns, key=lambda column: (abs(column - of.centre), column)))


def _between(flags: Bools, axis: int) -> Bools:
    """The bins with a filled one on both sides, or filled themselves."""
    after = np.logical_or.accumulate(flags, axis=axis)
    before = np.flip(np.logical_or.accumulate(np.flip(flags, axis=axis), axis=axis), axis=axis)
    return np.asarray(after & before)


def _beside(flags: Bools) -> Bools:
    """On a circle: the bins with a filled one right beside them on both sides."""
    return np.asarray(np.roll(flags, 1, axis=1) & np.roll(flags, -1, axis=1))


def _bins_within(bins: Sequence[Bin], spans: Sequence[Span] | None) -> Bools | None:
    """The bins whose middle is in a span that is requested; None where nothing is."""
    if spans is None:
        return None
    middles = [each.middle for each in bins]
    return np.array([any(low <= middle <= high for low, high in spans) for middle in middles], np.bool_)
