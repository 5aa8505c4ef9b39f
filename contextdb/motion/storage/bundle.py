"""One file with all that the characters of a game need of its motion: databases, poses, controllers, and tables.

A game written in C maps it into memory and reads it where it is; see `contextdb/core/bundle.h`, which says what a part holds. All
numbers are little-endian. R ranges, N frames, F features, K kinds of frames, J joints.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from contextdb.errors import Fault, MotionError, Place, in_quotes
from contextdb.motion.clips.quaternions import Floats
from contextdb.motion.clips.steering import Steered
from contextdb.motion.features.schema import FeatureSchema
from contextdb.motion.joint.boxes import boxes_of
from contextdb.motion.joint.database import JointDatabase
from contextdb.motion.joint.searcher import JointSearcher
from contextdb.motion.output.bank import PoseBank, moving_alike
from contextdb.motion.output.pipeline import Pipeline, numbers_of, rig_parts
from contextdb.motion.output.settings import PoseSettings
from contextdb.motion.search.database import MotionDatabase
from contextdb.motion.selection.chooser import Chooser
from contextdb.motion.selection.controller import Controller
from contextdb.motion.selection.controller_settings import ControllerSettings
from contextdb.motion.selection.events import events_of
from contextdb.motion.selection.selector import Entry, Selector
from contextdb.motion.selection.variation import asset_keys

MAGIC = b"CDBMOTN2"
DATABASE, BANK, CONTROLLER, TABLE, TAGS, MORE, JOINT, SET = 1, 44, 60, 90, 110, 120, 130, 160
"""The first kinds of the parts of each."""
OUTPUT = (
    "blend", "halflife_s", "root", "position_weight", "rotation_weight", "position_pull_s", "rotation_pull_s",
    "position_clamp_m", "rotation_clamp_deg", "path_alignment", "alignment_limit_deg", "alignment_halflife_s", "min_stride",
    "max_stride", "foot_lock", "foot_halflife_s", "foot_radius_m",
)  # fmt: skip
"""The settings of poses in the order of the core, see pose.h."""
MOST_ROLES = 8
"""So many roles a joint clip may have in the core: CDB_MOST_ROLES in types.h."""
TAG = "g="
Part = NDArray[Any] | bytes | None


@dataclass(frozen=True, eq=False)
class Played:
    """A controller to put into a bundle, with what its characters play."""

    controller: Controller
    schema: FeatureSchema
    banks: Mapping[str, PoseBank] | None
    """None for characters without poses. With those of the joint databases that they play."""
    output: PoseSettings
    ends: Mapping[str, Floats] = field(default_factory=dict)
    """`MatchNode.ends`, float64 [N, 3], of the databases whose animations can be entered as one-offs."""


@dataclass(frozen=True, eq=False)
class TableFile:
    """A table to put into a bundle."""

    octets: bytes
    """Its compiled file."""
    assets: Sequence[str]
    """Those of its rows."""
    own_facts: Mapping[str, str] = field(default_factory=dict)
    """The facts that a character adds: "s" its speed, "d" the direction of its stick, "t" its turn, the letters of `FACTS` of what
    plays (characters/played.py), and "g=TAG" for a tag of its frame."""
    mirror: Mapping[str, str] = field(default_factory=dict)
    """How facts change in a mirror: "n" negated, "p=NAME" that of another condition, "v=1 0" enum values by their numbers."""

    @property
    def tags(self) -> list[str]:
        """The tags that it asks for."""
        return [text[2:] for text in self.own_facts.values() if text.startswith(TAG)]

    def parts(self, tags: Sequence[str]) -> list[bytes]:
        """What a bundle with these tags says of facts."""
        numbers = {f"{TAG}{tag}": f"={number}" for number, tag in enumerate(tags)}
        own = [f"{text[0]}{name}{numbers.get(text, '')}" for name, text in self.own_facts.items()]
        mirrored = [f"{text[0]}{name}{text[1:]}" for name, text in self.mirror.items()]
        return [_texts(own), _texts(mirrored)]


@dataclass
class Bundle:
    """Parts as they are collected. `bytes()` of it is the file."""

    parts: list[tuple[int, int, bytes]] = field(default_factory=list)

    def add(self, first: int, number: int, parts: Sequence[Part]) -> None:
        """Add the parts of one thing, whose kinds follow one another."""
        for kind, part in enumerate(parts, first):
            if part is not None:
                octets = part if isinstance(part, bytes) else np.ascontiguousarray(part, part.dtype.newbyteorder("<")).tobytes()
                self.parts.append((kind, number, octets))

    def __bytes__(self) -> bytes:
        at = _rounded(64 + 24 * len(self.parts))
        entries, contents = [], bytearray()
        for kind, number, octets in self.parts:
            entries.append((kind | number << 32, at + len(contents), len(octets)))
            contents += octets + bytes(_rounded(len(octets)) - len(octets))
        directory = np.array(entries, "<u8").tobytes()
        body = directory + bytes(at - 64 - len(directory)) + contents
        head = np.array([len(self.parts), *[0] * 4], "<u8").tobytes() + body
        words = np.frombuffer(head, "<u8")
        mixed = (words ^ np.arange(24, 24 + len(head), 8, dtype=np.uint64)) * np.uint64(0x9E3779B97F4A7C15)
        digest = int((mixed ^ (mixed >> np.uint64(32))).sum(dtype=np.uint64))
        return MAGIC + np.array([24 + len(head), digest], "<u8").tobytes() + head


def bundle_of(
    players: Mapping[str, Played],
    table_of: Mapping[str, str],
    tables: Mapping[str, TableFile],
    searchers: Mapping[str, JointSearcher] | None = None,
) -> bytes:
    """The bytes of a bundle of controllers by their names, the table of each database that has one, the tables, and the joint
    searchers by their names.

    Raises MotionError for what a bundle cannot hold yet; all faults together.
    """
    searchers = searchers or {}
    _check(players, searchers)
    bundle, numbers, names = Bundle(), {name: i for i, name in enumerate(tables)}, list[str]()
    joint = {name: (each, searcher.selector) for searcher in searchers.values() for name, each in searcher.databases.items()}
    tags = list(dict.fromkeys(tag for table in tables.values() for tag in table.tags))
    banks = moving_alike({name: bank for player in players.values() for name, bank in (player.banks or {}).items()})
    for number, (name, table) in enumerate(tables.items()):
        bundle.add(TABLE, number, [table.octets, _texts([name]), *table.parts(tags)])
    for number, (name, player) in enumerate(players.items()):
        banks_of, chooser = player.banks or {}, player.controller.chooser
        more = [each for each in joint if each not in chooser.names and (player.banks is None or each in banks_of)]
        entries = []
        for database in (*chooser.names, *more):
            of = table_of.get(database, "")
            if database not in names:
                names.append(database)
                bank, number_of = banks.get(database), len(names) - 1
                if database in more:
                    _add_joint(bundle, number_of, *joint[database], database, bank, tables.get(of), tags)
                else:
                    _add_database(bundle, number_of, chooser, database, bank, tags, tables.get(of), player.ends.get(database))
            at = names.index(database)
            entries.append((at, at if database in banks_of else -1, numbers.get(of, -1)))
        own = [banks[each] for each in (*chooser.names, *more) if each in banks_of]
        bundle.add(CONTROLLER, number, _controller(name, player, entries[: len(chooser.names)], own))
        bundle.add(MORE, number, [np.array(entries[len(chooser.names) :], np.int64)])
    sets = {name: each for name, each in searchers.items() if all(database in names for database in each.databases)}
    for number, (name, searcher) in enumerate(sets.items()):
        limits = [math.nan if each.threshold is None else each.threshold for each in searcher.selector.entries]
        databases = [names.index(each) for each in searcher.databases]
        bundle.add(SET, number, [_texts([name]), np.array(databases, np.int64), np.array(limits, np.float64)])
    return bytes(bundle)


def _check(players: Mapping[str, Played], searchers: Mapping[str, JointSearcher]) -> None:
    faults = [
        Fault(f"the joint clips {in_quotes(name)} have {len(each.roles)} roles.", f"at most {MOST_ROLES} in a bundle")
        for name, each in searchers.items()
        if len(each.roles) > MOST_ROLES
    ]
    for name, player in players.items():
        chooser, place = player.controller.chooser, Place(f"[controllers.{name}]")
        faults += [
            Fault(f"the database {in_quotes(missing)} is not loaded.", "databases that are there", place=place)
            for missing, database in zip(chooser.names, chooser.databases, strict=True)
            if database is None
        ]
    if faults:
        raise MotionError(*faults)
    for player in players.values():
        if player.banks:
            Pipeline(moving_alike(player.banks), player.output)  # refuses banks of different rigs


def _add_joint(
    bundle: Bundle,
    number: int,
    joint: JointDatabase,
    selector: Selector,
    name: str,
    bank: PoseBank | None,
    table: TableFile | None,
    tags: Sequence[str],
) -> None:
    """A database, which of its ranges belong together, and what a joint search of it reads."""
    boxes, database = boxes_of(joint), selector.databases[name]
    chosen = database.filter(None)
    rows: Sequence[Part] = (None, None)
    if table is not None:
        own = [[row for row, asset in enumerate(table.assets) if asset == each] for each in joint.assets]
        rows = np.cumsum([0, *map(len, own)], dtype=np.int64), np.array([row for each in own for row in each], np.int64)
    searched = boxes.boxes, boxes.ranges, boxes.firsts, boxes.own_lows, boxes.own_highs, boxes.relative, boxes.lows, boxes.highs
    weights = np.array(joint.pairs, np.int64), joint.own_weights, np.array(joint.relative_weights)
    biases = chosen.range_biases, chosen.kinds.biases, chosen.kinds.allowed
    parts = [_texts(joint.roles), joint.ranges, *searched, *weights, *biases, database.marks.warps, joint.mirrored, *rows]
    bundle.add(JOINT, number, parts)
    _add_database(bundle, number, Chooser(Selector([Entry(name, database)]), ControllerSettings()), name, bank, tags)


def _add_database(
    bundle: Bundle,
    number: int,
    chooser: Chooser,
    name: str,
    bank: PoseBank | None,
    tags: Sequence[str],
    table: TableFile | None = None,
    ends: Floats | None = None,
) -> None:
    at = chooser.names.index(name)
    database = chooser.databases[at]
    assert database is not None, "it was checked"
    _, starts, stops, same, _, looping, root, marks, weights, rate, _, _, *rest = chooser.part(
        chooser.selector.entries[at], database, chooser.rates[at]
    )
    *arrays, kinds, n_frames, n_kinds, offset, scale, channels, channel_weights, roots = database.frame_parts
    own = np.array([n_frames, n_kinds, rate, *rest], np.float64)
    ranges = None if bank is None else np.array([bank.range_of(*each) for each in _clips(database)], np.int64)
    rows: Sequence[Part] = (None, None, None)
    if table is not None:
        row_starts, row_numbers, mirrored, _ = chooser.rows_of(name, table.assets)
        rows = mirrored, row_starts, row_numbers
    measures = kinds, offset, scale, channels, channel_weights, roots
    nodes = (None, None) if ends is None else (database.marks.warps, ends)
    played = starts, stops, same, looping, root, marks, weights, own
    texts = _texts(database.assets), *rows, _texts([name])
    levels, events = _levels(database), _events(database)
    more = asset_keys(database.assets), b"".join(database.marks.kinds_with(tag).tobytes() for tag in tags)
    bundle.add(DATABASE, number, [*arrays, *measures, *played, ranges, *texts, *levels, *events, *nodes, *more])
    bundle.add(TAGS, number, [_texts(database.marks.tags), database.marks.kind_tags])
    if bank is not None:
        *frames, bank_rate = bank.frame_parts(bank.steps)
        bundle.add(BANK, number, [*frames, np.array([bank_rate])])


def _controller(name: str, player: Played, entries: list[tuple[int, int, int]], banks: list[PoseBank]) -> list[Part]:
    chooser, body = player.controller.chooser, Steered()
    settings, shared, varies = chooser.settings, chooser.shared(None, None), chooser.settings.variation
    biases = chooser.ranges(None, 1)[1][0]
    thresholds = np.array([np.nan if each.threshold is None else each.threshold for each in chooser.selector.entries], np.float64)
    bars = np.array([settings.bar_of(each) for each in chooser.databases if each is not None], np.float64)
    numbers = np.array(
        [
            chooser.n_played, settings.search_every_s, settings.jump_threshold_s, settings.history_s, settings.min_play_rate,
            settings.max_play_rate, settings.grace_s, settings.until_natural, player.banks is not None, body.velocity_halflife_s,
            player.schema.rate, settings.settle_s, settings.asset_history_s, varies is not None, chooser.n_recent,
            0.0 if varies is None else varies.within,
        ],
        np.float64,
    )  # fmt: skip
    steps, features = player.schema.path_features
    ways = steps, features, player.schema.velocity_features
    choice = biases, shared.allowed, shared.playable, shared.kind_biases
    parts: list[Part] = [np.array(entries, np.int64), numbers, thresholds, bars, *choice, *ways]
    if player.banks is None:
        return [*parts, *[None] * 10, _texts([name])]
    *rig, most_accel, n_moving = rig_parts(banks)
    output = numbers_of(player.output)
    joints = np.array([n_moving, most_accel], np.float64)
    names = _texts(banks[0].skeleton.names)
    return [*parts, np.array([output[key] for key in OUTPUT]), *rig, joints, _texts([name]), names]


def _levels(database: MotionDatabase) -> list[NDArray[Any]]:
    """The bounds by which a database is searched: levels in one, then lows and highs of groups and of clusters of boxes."""
    n_groups = -(-len(database.layout.box_starts) // 16)
    n_clusters, n_each = -(-n_groups // 16), (database.n_features + 1) // 2 * 32
    sizes = [n * n_each for n in (n_groups, n_groups, n_clusters, n_clusters)]
    step, levels = np.empty(1), [np.empty(size, np.int16) for size in sizes]
    database.frames.levels(step, *levels)
    return [step, *levels]


def _events(database: MotionDatabase) -> list[Part]:
    """The names of events, where the frames of each begin, and at which frames they happen."""
    events = events_of(database)
    starts = np.cumsum([0, *map(len, events.values())], dtype=np.int64)
    return [_texts(list(events)), starts, np.concatenate(list(events.values()))]


def _clips(database: MotionDatabase) -> list[tuple[str, bool]]:
    return list(zip(database.assets, database.mirrored.tolist(), strict=True))


def _texts(texts: Sequence[str]) -> bytes:
    return b"".join(text.encode() + b"\0" for text in texts)


def _rounded(n: int) -> int:
    return (n + 63) // 64 * 64
