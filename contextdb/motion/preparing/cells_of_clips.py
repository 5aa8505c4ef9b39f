"""The cells of clips: for each column the values for which a clip is the right one beside the others of its kind.

Clips of one rig, gait and style are told apart by direction, then by turn, then by speed. Each of these columns cuts all its values
among the clips that are left, at the middle between two neighbours and a little beyond it: so for each context there is a clip, and
between two clips there are both. A clip that passes through many values, such as a start, keeps its own; where it turns for a
while, and no clip turns to that side all the time, it is the one for such turns, and ends the cells of those that go straight.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Callable, Hashable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import TypeVar

from contextdb.motion.preparing.clip_facts import NORMAL, ClipFacts, Spread

Key = TypeVar("Key", bound=Hashable)

ANY = "Any"
CONDITIONS = ("gait", "speed", "direction", "turn", "style")
OUTPUTS = ("duration_s", "start", "end")
SOFT = {"direction": "~0.5/30", "turn": "~0.5/30"}
"""What facts beyond a cell cost where a column is to exclude nothing: 0.5 for each 30 degrees, or 30 degrees a second."""
BEYOND = 0.15
"""How far a cell reaches beyond the middle between two clips, of the way between them."""


@dataclass(frozen=True, slots=True)
class Scale:
    """How numbers are distinguished: clips nearer than `bin_width` are of one kind; a cell reaches beyond the middle by so
    much at least and at most."""

    bin_width: float
    least_beyond: float
    most_beyond: float
    digits: int
    is_circular: bool = False
    is_signed: bool = True

    @property
    def is_turn(self) -> bool:
        """Whether it has two sides, and ends."""
        return self.is_signed and not self.is_circular


SPEED = Scale(0.25, 0.05, 0.3, 2, is_signed=False)
DIRECTION = Scale(45.0, 3.0, 10.0, 0, is_circular=True)
TURN = Scale(25.0, 3.0, 10.0, 0)
Interval = tuple[float | None, float | None]
"""From and to; None is open."""


def cells_of(facts: Sequence[ClipFacts], rigs: Sequence[Hashable], mirrored: bool = False) -> list[dict[str, str]]:
    """For each clip the cells of its row, conditions and outputs. `rigs` says of each clip what its rig is called: clips of
    different rigs are not told apart. `mirrored`: every clip plays mirrored too, so that a turn to the left serves one to the
    right."""
    cells = [{**dict.fromkeys(CONDITIONS, ANY), "gait": " ".join(each.gaits), **_outputs(each)} for each in facts]
    groups = _grouped(range(len(facts)), lambda i: (rigs[i], facts[i].gait, facts[i].style))
    for members in groups.values():
        moving = [i for i in members if facts[i].direction_deg is not None]
        kinds = _cut(cells, "direction", moving, {i: facts[i].direction_deg for i in moving}, DIRECTION, mirrored)
        kinds += [[i for i in members if facts[i].direction_deg is None]]
        for kind in kinds:
            for alike in _cut(cells, "turn", kind, {i: facts[i].turn_dps for i in kind}, TURN, mirrored):
                _cut(cells, "speed", alike, {i: facts[i].speed_mps for i in alike}, SPEED, mirrored)
    for i, style in _styles(facts, rigs).items():
        cells[i]["style"] = style
    return cells


def softened(cell: str, column: str) -> str:
    """A cell of a column of `SOFT` that excludes nothing; one that is Any already does not."""
    return cell if cell == ANY else f"{cell} {SOFT[column]}"


def _outputs(facts: ClipFacts) -> dict[str, str]:
    return {"duration_s": f"{facts.duration_s:g}", "start": facts.start, "end": facts.end}


def _grouped(members: Iterable[int], key: Callable[[int], Key]) -> dict[Key, list[int]]:
    groups = defaultdict[Key, list[int]](list)
    for i in members:
        groups[key(i)].append(i)
    return dict(groups)


# ---- why


def reason(facts: ClipFacts, column: str, cell: str) -> str:
    """Why a clip has its cell in a column, with what was measured; empty for a column that clips say nothing of."""
    if column == "gait":
        speed, spot = facts.speed_mps, facts.on_the_spot_mps
        measured = f"its feet go at {spot:.3g} m/s on the spot" if spot else f"it goes at {_measured(speed, ' m/s', SPEED)}"
        return f"{measured}, and comes to a stand" if len(facts.gaits) > 1 else measured
    if column == "style":
        own = "no style" if facts.style == NORMAL else facts.style
        lent = " and no clip like it has another style" if cell == ANY else "; also for styles that have no clip of its gait"
        return f"its name says {own}{'' if cell == facts.style else lent}"
    if column in _SEEN:
        return _SEEN[column]
    if column not in _MEASURED:
        return ""
    verb, unit, scale = _MEASURED[column]
    spread = {"speed": facts.speed_mps, "direction": facts.direction_deg, "turn": facts.turn_dps}[column]
    if spread is None:
        return "it stands, and goes to no side"
    measured = f"it {verb} {_measured(spread, unit, scale)}"
    low, high = _own(spread, scale)
    if cell != ANY and cell in {_text(each, scale) for each in ((low, high), (None, high), (low, None))}:
        return f"{measured}; the cell is what it passes through, and a little more"
    alike = "of its " + {"speed": "gait, style and turn", "direction": "gait and style", "turn": "gait and style"}[column]
    if cell == ANY:
        return f"{measured}; no other clip {alike} differs in {column}"
    return f"{measured}; the cell ends a little past the middle to the next clip {alike}"


_SEEN = {"duration_s": "so long is the clip", "start": "how the clip begins", "end": "how the clip ends"}
_MEASURED = {"speed": ("goes at", " m/s", SPEED), "direction": ("goes to", "°", DIRECTION), "turn": ("turns by", "°/s", TURN)}


def _measured(spread: Spread, unit: str, scale: Scale) -> str:
    """The middle, and from where to where where that is more than one number."""
    low, middle, high = (
        _number(_wrapped(each) if scale.is_circular else each, scale) for each in (spread.low, spread.middle, spread.high)
    )
    return f"{middle}{unit}" if low == high else f"{middle}{unit} ({low} to {high})"


# ---- style


def _styles(facts: Sequence[ClipFacts], rigs: Sequence[Hashable]) -> dict[int, str]:
    """The styles of each clip: its own; of a normal clip also those of its rig that have no clip of its gait. Where no normal clip
    stands, those that do stand for all styles without one."""
    styles = sorted({each.style for each in facts})
    if len(styles) == 1:
        return {}
    of_rig = defaultdict[Hashable, set[str]](set)
    has = set[tuple[Hashable, str, str]]()
    for rig, each in zip(rigs, facts, strict=True):
        of_rig[rig].add(each.style)
        has |= {(rig, gait, each.style) for gait in each.gaits}
    style_of = {}
    for i, each in enumerate(facts):
        lends = each.style == NORMAL or (each.gait == "Idle" and (rigs[i], "Idle", NORMAL) not in has)
        also = {style for style in of_rig[rigs[i]] if lends and (rigs[i], each.gait, style) not in has}
        own = [style for style in styles if style in {each.style, *also}]
        others = [style for style in styles if style not in own]
        style_of[i] = " ".join(own) if len(own) <= len(others) + 1 else " ".join(("not", *others)) if others else ANY
    return style_of


# ---- numbers


def _cut(
    cells: Sequence[dict[str, str]],
    column: str,
    members: Sequence[int],
    spreads: Mapping[int, Spread | None],
    scale: Scale,
    mirrored: bool,
) -> list[list[int]]:
    """Give some clips their cells in a column; the clips that the column does not tell apart, together."""
    known = {i: spread for i in members if (spread := spreads[i]) is not None}
    steady = {i: spread for i, spread in known.items() if _is_steady(spread, scale)} or known
    passing = [i for i in known if i not in steady]
    bins = _grouped(steady, lambda i: _bin(steady[i].middle, scale))
    spread_of = {at: _common_spread([steady[i] for i in each]) for at, each in bins.items()}
    if mirrored and scale.is_signed:
        for spread in list(spread_of.values()):
            spread_of.setdefault(_bin(-spread.middle, scale), Spread(-spread.high, -spread.middle, -spread.low))
    ends = _ends([known[i] for i in passing], spread_of, scale, mirrored)
    spread_of |= {_bin(end, scale): Spread(end, end, end) for end in ends if end is not None}
    intervals = _intervals(spread_of, scale)
    for at, each in bins.items():
        for i in each:
            cells[i][column] = _text(intervals[at], scale)
    for i in passing:
        cells[i][column] = _text(_passing(known[i], ends, scale), scale)
    return [*(each for each in bins.values()), *([passing] if passing else [])]


def _ends(passing: Sequence[Spread], steady: Mapping[int, Spread], scale: Scale, mirrored: bool) -> Interval:
    """How far to each side clips turn that do so only for a while; None where a steady clip turns to that side."""
    if not passing or not scale.is_turn:
        return None, None
    low, high = min(each.low for each in passing), max(each.high for each in passing)
    if mirrored:
        low, high = min(low, -high), max(high, -low)
    is_low, is_high = _bin(low, scale) < 0 <= min(steady), max(steady) <= 0 < _bin(high, scale)
    return low if is_low else None, high if is_high else None


def _passing(spread: Spread, ends: Interval, scale: Scale) -> Interval:
    """What a clip passes through; it is open to a side to whose end it is nearer than to none."""
    low, high = _own(spread, scale)
    return (
        None if ends[0] is not None and spread.low < ends[0] / 2.0 else low,
        None if ends[1] is not None and spread.high > ends[1] / 2.0 else high,
    )


def _is_steady(spread: Spread, scale: Scale) -> bool:
    """Whether a clip has one value, more or less; one that turns for less than half of its time has not."""
    reach = max(spread.high - spread.middle, spread.middle - spread.low) if scale.is_turn else 0.0
    return spread.width <= 2.0 * scale.bin_width and reach <= scale.bin_width


def _bin(value: float, scale: Scale) -> int:
    """The kind of a value; the same distance to both sides of 0."""
    at = int(abs(value) / scale.bin_width + 0.5) * (1 if value >= 0.0 else -1)
    n_bins = round(360.0 / scale.bin_width)
    return abs(at) if scale.is_circular and 2 * abs(at) == n_bins else at


def _common_spread(spreads: Sequence[Spread]) -> Spread:
    """The middles of some clips of one kind: the least, their mean, and the largest."""
    middles = [spread.middle for spread in spreads]
    if max(middles) - min(middles) > 180.0:  # both sides of straight back
        middles = [middle % 360.0 for middle in middles]
    return Spread(min(middles), sum(middles) / len(middles), max(middles))


def _intervals(spreads: Mapping[int, Spread], scale: Scale) -> dict[int, Interval]:
    """From where to where each kind is right: together all values, and a little twice."""
    kinds = sorted(spreads, key=lambda at: spreads[at].middle)
    if len(kinds) < 2:
        return dict.fromkeys(kinds, (None, None))
    lower: dict[int, float | None] = {kinds[0]: None}
    upper: dict[int, float | None] = {kinds[-1]: None}
    for a, b in pairwise(kinds):
        upper[a], lower[b] = _between(spreads[a], spreads[b], 0.0, scale)
    if scale.is_circular:
        upper[kinds[-1]], beyond = _between(spreads[kinds[-1]], spreads[kinds[0]], 360.0, scale)
        lower[kinds[0]] = beyond - 360.0
    return {at: (lower[at], upper[at]) for at in kinds}


def _between(a: Spread, b: Spread, round_: float, scale: Scale) -> tuple[float, float]:
    """Where the lower of two neighbours ends and the higher, so many degrees round, begins: behind and before the middle between
    them, and never before the last clip of a kind."""
    least, middle = scale.least_beyond, (a.middle + b.middle + round_) / 2.0
    beyond = min(max(least, BEYOND * (b.middle + round_ - a.middle)), scale.most_beyond)
    return max(middle + beyond, a.high + least), min(middle - beyond, b.low + round_ - least)


def _own(spread: Spread, scale: Scale) -> Interval:
    """What a clip passes through, and a little more."""
    beyond = min(max(scale.least_beyond, BEYOND * spread.width), scale.most_beyond)
    low, high = spread.low - beyond, spread.high + beyond
    if scale.is_circular:
        return (None, None) if high - low >= 360.0 else (low, high)
    if not scale.is_signed:
        return (None if low <= beyond else low), high
    return low, high


def _text(interval: Interval, scale: Scale) -> str:
    low, high = interval
    if low is None and high is None:
        return ANY
    if scale.is_circular and low is not None and high is not None:
        return f"{_number(_wrapped(low), scale)}..{_number(_wrapped(high), scale)}"
    if low is None:
        return f"<={_number(high or 0.0, scale)}"
    return f">={_number(low, scale)}" if high is None else f"{_number(low, scale)}..{_number(high, scale)}"


def _wrapped(degrees: float) -> float:
    return (degrees + 180.0) % 360.0 - 180.0


def _number(value: float, scale: Scale) -> str:
    return f"{round(value, scale.digits) + 0.0:g}"
