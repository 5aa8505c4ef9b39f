"""Which contexts and speeds a character is driven over, where nobody says: chosen from what its tables ask and allow.

Conditions that the character answers itself, such as its speed, come of the drive. Every value of the others that changes what is
valid is taken once at least. A condition none of whose values serves all speeds, such as a gait, follows the speed that the stick
asks for, as in a game; a value serves a speed where clips go at it as long as with any other value. A condition whose values cannot
be listed has the value under which most is valid, or is left open.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import product

import numpy as np

from contextdb.cells.conditions import Condition
from contextdb.motion.characters import tables as asking
from contextdb.motion.characters.character import Character
from contextdb.motion.characters.facts import Ground
from contextdb.motion.characters.tables import Facts, Table

MOST_PRODUCTS = 12
"""So many contexts at most are all combinations; of more, each value is in one."""
MOST_COMBINATIONS = 512
STANDING_MPS = 0.5
MOST_SPEED_MPS = 8.0
N_SPEEDS = 81
NEAR_MPS = 0.3
"""A clip goes at a speed while it is that near."""
AS_GOOD = 0.9
"""A value serves a speed where a valid clip goes at it for so large a share of what any clip does."""
EVEN_S = 0.5
"""Speeds of clips are taken over so many seconds, a step."""
TRIED = (0.0, 1.0, 2.0, 5.0, 10.0, 20.0, 50.0, 90.0, 100.0, 1000.0, -1.0, -10.0, -90.0)
"""Values of a number without bounds that are tried."""

Speeds = np.ndarray[tuple[int], np.dtype[np.float64]]


@dataclass(frozen=True, eq=False)
class Scene:
    """A context to drive in: the facts that stay, and those that follow the speed, each with the speeds in m/s that they serve,
    ascending; `speeds_mps` are those to drive at."""

    facts: Facts
    following: tuple[tuple[Facts, tuple[float, ...]], ...]
    speeds_mps: tuple[float, ...]

    def at(self, stick: Ground) -> Facts:
        """What the game says while the stick asks for a velocity."""
        if not self.following:
            return self.facts
        return {**self.facts, **_nearest(self.following, math.hypot(*stick))}

    @property
    def name(self) -> str:
        """The facts that stay, in words; empty where there are none."""
        return " ".join(f"{name}={value}" for name, value in self.facts.items())


@dataclass(frozen=True, eq=False)
class Plan:
    """What a character is driven over, and what of its tables is left open."""

    scenes: tuple[Scene, ...]
    left_open: tuple[str, ...]
    n_contexts: int
    """How many combinations of values there are."""


@dataclass(frozen=True, eq=False)
class ClipSpeeds:
    """How fast each asset goes, m/s, moment by moment."""

    of_asset: Mapping[str, Speeds]

    @classmethod
    def of(cls, character: Character) -> ClipSpeeds:
        """Of all databases of a character."""
        speeds: dict[str, Speeds] = {}
        step = max(1, round(EVEN_S * character.schema.rate))
        for database in character.controller.selector.databases.values():
            for asset, start, stop in zip(database.assets, database.starts.tolist(), database.stops.tolist(), strict=True):
                if database.root is not None and stop - start > 1:
                    own = database.root[start:stop, :2].astype(np.float64)
                    n = min(step, len(own) - 1)
                    speeds[asset] = np.hypot(*(own[n:] - own[:-n]).T) * character.schema.rate / n
        return cls(speeds)

    def share(self, assets: Iterable[str], speed: float) -> float:
        """How much of that one of some assets goes at a speed of which most does."""
        own = (self.of_asset[asset] for asset in assets if asset in self.of_asset)
        return max((float(np.mean(np.abs(speeds - speed) <= NEAR_MPS)) for speeds in own), default=0.0)

    def usual(self) -> tuple[float, ...]:
        """A low and a high speed of all of them."""
        every = np.concatenate([np.zeros(0), *self.of_asset.values()])
        moving = every[(every >= STANDING_MPS) & (every <= MOST_SPEED_MPS)]
        return tuple(round(float(each), 2) for each in np.quantile(moving, (0.25, 0.75))) if len(moving) else (1.0,)


def plan_of(character: Character, speeds_mps: Sequence[float] = ()) -> Plan:
    """Choose contexts, and speeds where none are given."""
    tables = asking.each_of(character.tables)
    own = character.asked_facts
    conditions = {name: each for table in tables for name, each in table.asked.items() if name not in own}
    chosen, left_open = _single_values(tables, conditions)
    values = {name: each.domain.everything for name, each in conditions.items() if each.domain.everything}
    matter = {name: each for name, each in values.items() if each is not None and _matters(tables, name, each)}
    chosen |= {name: each[0] for name, each in values.items() if each and name not in matter}
    speeds = _grid(tables) if "speed" in own else None
    if speeds is None or math.prod(map(len, matter.values())) > MOST_COMBINATIONS:
        scenes = [Scene({**chosen, **facts}, (), ()) for facts in _contexts(matter)]
    else:
        ahead = {"direction": 0.0} if "direction" in own else {}
        scenes = list(_scenes(tables, {**chosen, **ahead}, matter, speeds, ClipSpeeds.of(character)))
    moving = tuple(speeds_mps) or ClipSpeeds.of(character).usual()
    scenes = [
        Scene({n: f for n, f in each.facts.items() if n not in own}, each.following, tuple(speeds_mps) or each.speeds_mps or moving)
        for each in scenes
    ]
    return Plan(tuple(scenes), tuple(left_open), max(1, math.prod(map(len, matter.values()))))


def _scenes(
    tables: Sequence[Table], chosen: Facts, matter: Mapping[str, Sequence[object]], speeds: Speeds, clips: ClipSpeeds
) -> Iterator[Scene]:
    """A scene for each context of what does not follow the speed."""
    shares = {
        values: [
            clips.share(_assets(tables, {**chosen, **dict(zip(matter, values, strict=True)), "speed": speed}), speed)
            for speed in speeds.tolist()
        ]
        for values in product(*matter.values())
    }
    best = [max(each) for each in zip(*shares.values(), strict=True)]
    allowed = {
        values: frozenset(
            speed for speed, own, most in zip(speeds.tolist(), each, best, strict=True) if own and own >= AS_GOOD * most
        )
        for values, each in shares.items()
    }
    follows = [i for i in range(len(matter)) if _follows(allowed, i)]
    names = list(matter)
    staying = {name: each for i, (name, each) in enumerate(matter.items()) if i not in follows}
    for facts in _contexts(staying):
        following = []
        for values in product(*(matter[names[i]] for i in follows)):
            every = {**facts, **dict(zip((names[i] for i in follows), values, strict=True))}
            combinations = sorted(allowed[tuple(every[name] for name in names)])
            if combinations:
                following.append(({names[i]: every[names[i]] for i in follows}, tuple(combinations)))
        if following:
            yield Scene({**chosen, **facts}, tuple(following) if follows else (), tuple(_speeds(following)))


def _follows(allowed: Mapping[tuple[object, ...], frozenset[float]], i: int) -> bool:
    """Whether no value of a condition allows all the speeds that its values allow together, somewhere."""
    together: dict[tuple[object, ...], list[frozenset[float]]] = {}
    for values, speeds in allowed.items():
        together.setdefault((*values[:i], *values[i + 1 :]), []).append(speeds)
    return any(frozenset().union(*each) not in each for each in together.values())


def _speeds(following: Sequence[tuple[Facts, Sequence[float]]]) -> Iterator[float]:
    """The middle of the speeds that each allows and at which a character moves; two of them where nothing follows the speed."""
    shares = (0.5,) if len(following) > 1 else (0.25, 0.75)
    rounded = set()
    for _, speeds in following:
        if moving := [speed for speed in speeds if speed >= STANDING_MPS]:
            rounded |= {round(moving[int(share * (len(moving) - 1))], 1) for share in shares}
    yield from sorted(rounded)


def _nearest(following: Sequence[tuple[Facts, Sequence[float]]], speed: float) -> Facts:
    """The facts that allow a speed, or come nearest to it; of several those in the middle of whose speeds it is most."""

    def badness(each: tuple[Facts, Sequence[float]]) -> tuple[float, float]:
        allowed = each[1]
        return round(min(abs(speed - one) for one in allowed), 1), abs(speed - (allowed[0] + allowed[-1]) / 2.0)

    return min(following, key=badness)[0]


def _contexts(values: Mapping[str, Sequence[object]]) -> list[dict[str, object]]:
    """All combinations; of more than a few, as many that each value is in one."""
    if math.prod(map(len, values.values())) <= MOST_PRODUCTS:
        return [dict(zip(values, each, strict=True)) for each in product(*values.values())]
    most = max(map(len, values.values()))
    return [{name: each[i % len(each)] for name, each in values.items()} for i in range(most)]


def _single_values(tables: Sequence[Table], conditions: Mapping[str, Condition]) -> tuple[dict[str, object], list[str]]:
    """For each condition whose values cannot be listed one under which most is valid; and the names of those left open."""
    chosen: dict[str, object] = {}
    left_open = []
    for name, condition in conditions.items():
        if condition.domain.everything:
            continue
        if condition.domain.type.fixed or not condition.domain.type.is_decimal:
            left_open.append(name)
            continue
        least, most = condition.domain.ends
        is_bounded = math.isfinite(least) and math.isfinite(most)
        tried = np.linspace(least, most, 13).tolist() if is_bounded else [each for each in TRIED if least <= each <= most]
        if condition.domain.type.is_whole:
            tried = [int(each) for each in tried]
        chosen[name] = max(tried, key=lambda value: len(_assets(tables, {name: value})), default=0)
    return chosen, left_open


def _matters(tables: Sequence[Table], name: str, values: Sequence[object]) -> bool:
    """Whether what is valid is another for some value."""
    return len({_assets(tables, {name: value}) for value in values}) > 1


def _assets(tables: Sequence[Table], facts: Facts) -> tuple[str, ...]:
    """The valid assets of all tables; the facts that are not given are open."""
    assets: list[str] = []
    for table in tables:
        if asking.can_answer(table):
            assets += table.query({name: fact for name, fact in facts.items() if name in table.asked}, unknown="any").assets
    return tuple(assets)


def _grid(tables: Sequence[Table]) -> Speeds:
    """The speeds that are tried."""
    ends = [table.asked["speed"].domain.ends for table in tables if "speed" in table.asked]
    most = max((end for _, end in ends if math.isfinite(end)), default=MOST_SPEED_MPS)
    return np.linspace(0.0, min(most, MOST_SPEED_MPS), N_SPEEDS)
