"""What the page of a session plays, as one JSON document: columns packed small, and the moments at which something was searched.

Lengths are whole millimetres, times whole milliseconds, angles tenths of a milliradian. Columns are deflated, in base64; one with
`delta` keeps of each row what it differs from the row before, which deflates better.
"""

from __future__ import annotations

import base64
import zlib
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from contextdb.motion.clips.quaternions import Floats
from contextdb.motion.clips.skeleton import Ints
from contextdb.motion.trace.views import nothing_fits

SHOWN_HZ = 30.0
"""The most poses a second in the page."""
SEARCHED, JUMPED, FORCED, MIRRORED = 1, 2, 4, 8
MAY_NOT, MAY = 1, 128
"""A bar of the landscape: 0 without a frame, from 1 one that may not play, from 128 one that may; the higher, the cheaper."""
BAR_STEPS = 127
WORST = (("skate", "a planted foot slides {:.0f} cm/s", 3.0), ("accel", "a joint accelerates most, {:.0f} m/s²", 0.0))
"""Strips of which the worst moment is looked at first, and above what."""


@dataclass(frozen=True, slots=True)
class Detail:
    """How much a page holds: how many `ghosts`, poses that could have played, at each jump and for how long, of how many assets the
    frames are drawn as bars (`rows`) and in how many (`bins`, 0 for none), how many candidates, and whether searches that changed
    nothing are included."""

    ghosts: int
    ghost_s: float
    bins: int
    rows: int
    candidates: int
    searches: bool

    @staticmethod
    def most_first() -> Iterator[Detail]:
        """From everything to what a page cannot do without."""
        yield Detail(3, 0.7, 64, 64, 12, True)
        yield Detail(3, 0.7, 64, 40, 12, False)
        yield Detail(2, 0.5, 32, 24, 8, False)
        yield Detail(1, 0.5, 16, 12, 5, False)
        yield Detail(0, 0.0, 0, 0, 3, False)


@dataclass(frozen=True, eq=False, slots=True)
class Ghost:
    """A pose that could have played, moving: joints [F, J, 3] in metres, relative to the root on the ground, at `rate` a second."""

    asset: str
    positions: Floats
    rate: float
    plays_on: bool


@dataclass(frozen=True, slots=True)
class Candidate:
    """A frame that was compared; `parts` are its cost by channel."""

    asset: str
    at_s: float
    mirrored: bool
    cost: float
    parts: tuple[float, ...]
    left_out: str
    chosen: bool


@dataclass(frozen=True, eq=False, slots=True)
class AssetCosts:
    """The costs of all frames of an asset: float64 [F], with which may play; and why the best of them may not, if so."""

    asset: str
    costs: Floats
    may_play: NDArray[np.bool_]
    left_out: str

    @property
    def best(self) -> float:
        """The least cost of a frame that may play; of any frame where none may."""
        among = self.costs[self.may_play] if self.may_play.any() else self.costs
        return float(among.min())


@dataclass(frozen=True, eq=False, slots=True)
class Moment:
    """A search: when, why, and what there was to choose from."""

    tick: int
    why: str
    is_change: bool
    forced: bool
    context: tuple[tuple[str, str], ...]
    status: tuple[tuple[str, str], ...]
    """Speeds and angles, each with its name; empty where nothing changed."""
    channels: tuple[str, ...]
    candidates: Sequence[Candidate]
    ghosts: Sequence[Ghost] = ()
    assets: Sequence[AssetCosts] = ()


@dataclass(frozen=True, slots=True)
class ChangeLine:
    """A line of the table of what changed: what, asset, cost and why."""

    time_s: float
    texts: tuple[str, str, str, str]


@dataclass(frozen=True, eq=False)
class SessionView:
    """A session as the page shows it. T updates, J joints, K feet."""

    name: str
    rate: float
    """Updates a second."""
    bones: Sequence[str]
    parents: Ints
    feet: Sequence[int]
    """`bones`, `parents`, `feet`: the rig: names [J], parents [J], the joints of the feet [K]."""
    sides: Sequence[str]
    """"left", "right" or "": which side of the body a joint is of."""
    positions: Floats
    """Joints in the world, in metres: float [T, J, 3]."""
    roots: Floats
    """x and z in metres, heading in radians: float [T, 3]."""
    bodies: Floats | None
    """Where the game had the body, likewise: float [T, 3], or None."""
    contacts: NDArray[np.bool_]
    """Bool [T, K]."""
    playing: Sequence[tuple[str | None, float]]
    flags: NDArray[np.uint8]
    """SEARCHED, JUMPED, FORCED and MIRRORED, added up: uint8 [T]."""
    strips: Mapping[str, Floats]
    """What is drawn below the timeline: "cost", "skate", "accel", "error", "valid", as far as known. Float [T]."""
    moments: Sequence[Moment]
    """In order of time."""
    changes: Sequence[ChangeLine]
    measures: Mapping[str, tuple[str, str]] = field(default_factory=dict)
    """By name: of the session, and of the raw clips."""

    @property
    def seconds(self) -> float:
        return max(0, len(self.positions) - 1) / self.rate

    @property
    def first_look(self) -> tuple[float, str]:
        """The moment to look at first, in seconds, and why: the most expensive forced jump, the most sliding, or acceleration."""
        forced = np.flatnonzero((self.flags & FORCED).astype(np.bool_) & (np.arange(len(self.flags)) > 0))
        costs = self.strips.get("cost")
        if len(forced) and costs is not None and not np.isnan(costs[forced]).all():
            at = int(forced[np.nanargmax(costs[forced])])
            return at / self.rate, nothing_fits(self.playing[at][0], float(costs[at]))
        for strip, sentence, least in WORST:
            values = self.strips.get(strip)
            if values is not None and not np.isnan(values).all() and np.nanmax(values) > least:
                at = int(np.nanargmax(values))
                return at / self.rate, sentence.format(values[at])
        return 0.0, ""


def document_of(sessions: Sequence[SessionView], detail: Detail) -> dict[str, object]:
    """What the page's script reads."""
    first_s = sessions[0].first_look[0] if len(sessions) == 1 else 0.0
    parts = [_session(session, detail) for session in sessions]
    return {"format": 1, "plays": len(sessions) > 0, "first_s": round(first_s, 2), "sessions": parts}


def _session(session: SessionView, detail: Detail) -> dict[str, object]:
    step = max(1, round(session.rate / SHOWN_HZ))
    sampled = np.arange(0, len(session.positions), step)
    names = _Names()
    asset = np.array([names.of(playing[0]) for playing in session.playing], np.int16)
    local = session.positions[sampled] - _on_ground(session.roots[sampled])[:, None]
    columns = {
        "positions": _packed(_whole(local, 1000.0, np.int16).reshape(len(sampled), -1), is_delta=True),
        "root": _packed(_root(session.roots[sampled]), is_delta=True),
        "asset": _packed(asset[sampled]),
        "at": _packed(np.array([round(1000 * session.playing[i][1]) for i in sampled.tolist()], np.int32)),
        "flags": _packed(_gathered(session.flags, step)),
        "contacts": _packed((session.contacts[sampled] << np.arange(session.contacts.shape[1])).sum(axis=1).astype(np.uint8)),
    }
    if session.bodies is not None:
        columns["body"] = _packed(_root(session.bodies[sampled]), is_delta=True)
    for name, values in session.strips.items():
        columns[name] = _packed(_peaks(values, step).astype(np.float32))
    moments = [_moment(each, names, step, session.rate, detail) for each in session.moments if each.is_change or detail.searches]
    return {
        "name": session.name,
        "rate": session.rate / step,
        "n": len(sampled),
        "bones": list(session.bones),
        "parents": session.parents.tolist(),
        "sides": list(session.sides),
        "feet": list(session.feet),
        "columns": columns,
        "moments": moments,
        "assets": names.known,
    }


class _Names:
    """Assets by number."""

    def __init__(self) -> None:
        self.known: list[str] = []
        self._numbers: dict[str, int] = {}

    def of(self, name: str | None) -> int:
        """The number of a name; -1 of none."""
        if name is None:
            return -1
        if name not in self._numbers:
            self._numbers[name] = len(self.known)
            self.known.append(name)
        return self._numbers[name]


def _moment(moment: Moment, names: _Names, step: int, rate: float, detail: Detail) -> dict[str, object]:
    rows = sorted(moment.assets, key=lambda each: (not each.may_play.any(), each.best))[: detail.rows if detail.bins else 0]
    return {
        "i": -(-moment.tick // step),
        "why": moment.why,
        "forced": moment.forced,
        "context": [list(pair) for pair in moment.context],
        "status": [list(pair) for pair in moment.status],
        "channels": list(moment.channels),
        "candidates": [_candidate(each, names) for each in moment.candidates[: detail.candidates]],
        "ghosts": [_ghost(each, rate / step, detail) for each in moment.ghosts[: detail.ghosts]],
        "landscape": _landscape(rows, names, detail.bins) if rows else None,
    }


def _candidate(each: Candidate, names: _Names) -> dict[str, object]:
    return {
        "asset": names.of(each.asset),
        "at": round(each.at_s, 3),
        "mirrored": each.mirrored,
        "cost": _short(each.cost),
        "parts": [_short(part) for part in each.parts],
        "left_out": each.left_out,
        "chosen": each.chosen,
    }


def _ghost(ghost: Ghost, shown_hz: float, detail: Detail) -> dict[str, object]:
    moments = np.arange(max(1, round(detail.ghost_s * shown_hz))) / shown_hz
    sampled = ghost.positions[np.minimum(np.round(moments * ghost.rate).astype(np.int64), len(ghost.positions) - 1)]
    packed = _packed(_whole(sampled, 1000.0, np.int16).reshape(len(sampled), -1), is_delta=True)
    return {**packed, "asset": ghost.asset, "plays_on": ghost.plays_on, "frames": len(sampled)}


def _landscape(rows: Sequence[AssetCosts], names: _Names, bins: int) -> dict[str, object]:
    """Bars: the cheapest frame of each part of an asset, the tallest the cheapest of all."""
    least = min(each.best for each in rows)
    most = max(float(np.median(each.costs)) for each in rows)
    return {
        "assets": [names.of(each.asset) for each in rows],
        "best": [_short(each.best) for each in rows],
        "reasons": [each.left_out for each in rows],
        "bins": bins,
        "bars": _packed(np.concatenate([_bars(each, bins, least, most) for each in rows])),
    }


def _bars(each: AssetCosts, bins: int, least: float, most: float) -> NDArray[np.uint8]:
    binned = np.zeros(bins, np.uint8)
    parts = np.minimum(np.arange(len(each.costs)) * bins // max(1, len(each.costs)), bins - 1)
    for kind, among in ((MAY_NOT, ~each.may_play), (MAY, each.may_play)):
        lowest = np.full(bins, np.inf)
        np.minimum.at(lowest, parts[among], each.costs[among])
        share = 1.0 - np.clip((lowest - least) / max(most - least, 1e-12), 0.0, 1.0)
        has = np.isfinite(lowest)
        binned[has] = kind + np.round(share[has] * (BAR_STEPS - 1)).astype(np.uint8)
    return binned


def _on_ground(roots: Floats) -> Floats:
    """The roots as points on the ground: float64 [T, 3]."""
    return np.stack((roots[:, 0], np.zeros(len(roots)), roots[:, 1]), axis=1)


def _root(roots: Floats) -> NDArray[np.int32]:
    places = np.stack((roots[:, 0] * 1e3, roots[:, 1] * 1e3, np.unwrap(roots[:, 2]) * 1e4), axis=1)
    return _whole(places, 1.0, np.int32)


def _whole(values: Floats, scale: float, kind: type[np.signedinteger]) -> NDArray[np.signedinteger]:
    """Values as whole numbers of some type; those beyond it at its ends."""
    limits = np.iinfo(kind)
    return np.clip(np.round(np.asarray(values, np.float64) * scale), limits.min, limits.max).astype(kind)


def _gathered(flags: NDArray[np.uint8], step: int) -> NDArray[np.uint8]:
    """The flags of each sampled update and of those left out before it."""
    sampled = flags[::step].copy()
    for before in range(1, step):
        sampled[1:] |= flags[step - before :: step][: len(sampled) - 1]
    return sampled


def _peaks(values: Floats, step: int) -> Floats:
    """The largest of each sampled update and of those left out before it; an unknown value is 0."""
    known = np.nan_to_num(np.asarray(values, np.float64), nan=0.0, posinf=0.0, neginf=0.0)
    peaks = known[::step].copy()
    for before in range(1, step):
        peaks[1:] = np.maximum(peaks[1:], known[step - before :: step][: len(peaks) - 1])
    return peaks


def _packed(values: NDArray[np.generic], *, is_delta: bool = False) -> dict[str, object]:
    """An array as the script reads it, little-endian."""
    packed = values
    width = values.shape[1] if values.ndim == 2 else 1
    if is_delta and len(values) > 1:
        packed = np.concatenate((values[:1], np.diff(values, axis=0)))  # wraps around as the script's own numbers do
    raw = np.ascontiguousarray(packed.astype(packed.dtype.newbyteorder("<"))).tobytes()
    data = base64.b64encode(zlib.compress(raw, 9)).decode()
    return {"type": f"{packed.dtype.kind}{packed.dtype.itemsize}", "delta": width if is_delta else 0, "data": data}


def _short(value: float) -> float | None:
    """A number in six digits; None for one that JSON has not."""
    return float(f"{value:.6g}") if np.isfinite(value) else None
