"""What plays, for many characters at once, as poses: each a row, see the core's pose.h."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from contextdb.cells.arguments import require_kind, require_mapping
from contextdb.cells.row_play import ROOTS, RowPlay
from contextdb.core import Poses, fill_plays, pose_columns
from contextdb.errors import Fault, MotionError, in_quotes, no_such
from contextdb.files.settings import settings_of
from contextdb.motion.clips.quaternions import Floats
from contextdb.motion.clips.skeleton import Ints, Skeleton
from contextdb.motion.output.bank import RIG_MEND, PoseBank
from contextdb.motion.output.clip_parts import tops_of
from contextdb.motion.output.ground import Grounds, below_all
from contextdb.motion.output.legs import hinges_of, legs_of
from contextdb.motion.output.pose import CrowdPoses
from contextdb.motion.output.samples import Flags
from contextdb.motion.output.settings import PoseSettings
from contextdb.motion.records import quickly_made
from contextdb.motion.selection.chooser import Chooser, Updates
from contextdb.motion.selection.decision import Action, Decision, Playing

ADDED_SHARE = 0.75
"""What is added to the clips may accelerate joints by this share of what the clips do; the rest is left for the clips."""
NUMBERS = {action: float(number) for number, action in enumerate(Action)}
"""What an update did, as the core has it."""
COLUMNS = pose_columns()
"""Where each single number of a row is."""
PLAY_RATE, CLIP_RATE = COLUMNS["play_rate"], COLUMNS["clip_rate"]
N_GIVEN, N_PLAY, ROOT = 16, 18, 17
"""So many numbers the core is given of a character, see `cdbo_given` in pose.h; and so many that this comes from, with the place of
what moves the root, see `cdbo_play` in receive.h."""
BY_ANIMATION, MOST_CHOOSERS = float(ROOTS.index("animation")), 16
Moment = tuple[int, int, float]
NO_MOMENT: Moment = (-1, 0, 0.0)
"""A moment of a bank: its number, a range and a second; nothing."""


Displayed = Decision | Playing | None


@quickly_made
@dataclass(frozen=True, eq=False, slots=True)
class Rows:
    """Where N characters are: a row of numbers each [N, W]; what each displayed last, as the core has it [N, 3]; and the same as
    objects, or the decisions that say it. Never changed, so it may be stored."""

    numbers: Floats
    displayed: Floats
    last: list[Displayed]

    def __len__(self) -> int:
        return len(self.last)

    def row(self, i: int) -> Rows:
        each = slice(i, i + 1)
        return self if len(self) == 1 else Rows(self.numbers[each], self.displayed[each], self.last[each])

    def playing(self, i: int) -> Playing | None:
        """What one displayed last."""
        last = self.last[i]
        return last.playing if isinstance(last, Decision) else last


class Pipeline:
    """Pose banks of one rig and settings, ready for the loops: what all streams of a crowd share."""

    def __init__(self, banks: PoseBank | Mapping[str, PoseBank], settings: PoseSettings) -> None:
        self.settings = settings
        self.only = banks if isinstance(banks, PoseBank) else None
        self.banks: dict[str, PoseBank] = {} if isinstance(banks, PoseBank) else _checked(banks)
        self.all: list[PoseBank] = [self.only] if self.only is not None else list(self.banks.values())
        self.rig = self.all[0]
        self._numbers = {name: i for i, name in enumerate(self.banks)}
        self._places: dict[Chooser, tuple[Ints, Ints, Ints]] = {}

    def is_like(self, other: Pipeline) -> bool:
        """Whether another one is of the same banks and settings."""
        if self is other:
            return True
        is_same = self.only is other.only and self.banks.keys() == other.banks.keys()
        return is_same and self.settings == other.settings and all(other.banks[name] is bank for name, bank in self.banks.items())

    def __reduce__(self) -> tuple[type[Pipeline], tuple[object, PoseSettings]]:
        return Pipeline, (self.only or self.banks, self.settings)

    @cached_property
    def _flat(self) -> Poses:
        """The stages in the core, for those who feel no ground."""
        return _poses(self.all, self.settings, feels_ground=False)

    @cached_property
    def _grounded(self) -> Poses:
        return _poses(self.all, self.settings, feels_ground=True)

    @property
    def width(self) -> int:
        """How many numbers a row has."""
        return self._flat.width

    def begun(self) -> Rows:
        """One character that has not displayed anything yet: the rig at rest."""
        row = np.empty(self.width)
        self._flat.begin(row)
        return self.rows_at(row, None)

    def rows_at(self, row: Floats, playing: Playing | None) -> Rows:
        """One character, with a row, that displayed something last. Raises MotionError where no bank has that."""
        return Rows(row[None], np.array([self.moment_of(playing)], np.float64), [playing])

    def update(
        self, rows: Rows, decisions: list[Decision], plays: Floats, dt: float, places: Floats | None, grounds: Grounds | None
    ) -> tuple[Rows, CrowdPoses]:
        """The rows and the poses of all after a decision for each, and what `plays` by it; `places` [N, 3] are those of the bodies,
        NaN for none."""
        given, seams, displayed = self.given(rows, plays, dt)
        n, n_joints, n_feet = len(rows), self.rig.n_joints, len(self.rig.feet)
        after, roots, contacts = np.empty((n, self.width)), np.empty((n, 3)), np.empty((n, n_feet), np.bool_)
        rotations, translations, positions = np.empty((n, n_joints, 4)), np.empty((n, n_joints, 3)), np.empty((n, n_joints, 3))
        bodies = None if places is None else np.ascontiguousarray(places)
        arrays = rows.numbers, given, bodies, seams, dt, after, roots, rotations, translations, positions, contacts
        if grounds is None:
            self._flat.update(*arrays, None, None)
        else:
            points = np.empty((n, max(n_feet, 1), 2))
            self._grounded.update(*arrays, points, None)
            self._grounded.update(*arrays, None, below_all(grounds, points))
        each = zip(plays[:, 0].tolist(), decisions, rows.last, strict=True)
        last = [was if bank < 0.0 else decision for bank, decision, was in each]
        poses = CrowdPoses(decisions, given, roots, rotations, translations, positions, contacts, after[:, PLAY_RATE])
        return Rows(after, displayed, last), poses

    def given(self, rows: Rows, plays: Floats, dt: float) -> tuple[Floats, Floats | None, Floats]:
        """What happens in this update, a row each; the moments at seams, two for each, or None; and what is displayed then."""
        n = len(rows)
        given, moments, displayed = np.empty((n, N_GIVEN)), np.empty((2 * n, 4)), np.empty((n, 3))
        n_seams = self._flat.receive(rows.numbers, plays, dt, given, moments, displayed)
        return given, moments[:n_seams] if n_seams else None, displayed

    def moves_body(self, plays: Floats) -> Flags:
        """Whether the clip alone moves the body of each, as the row of what plays or the settings say: bool [N]."""
        by_settings = self.settings.root == "animation"
        return np.array([by_settings if root != root else root == BY_ANIMATION for root in plays[:, ROOT].tolist()], np.bool_)

    def find(self, playing: Playing) -> tuple[int, int]:
        """The number of the bank of what plays, and its range there."""
        number = 0 if self.only is not None else self._numbers.get(playing.database, -1)
        if number < 0:
            raise MotionError(no_such("pose bank of the database", playing.database, self.banks))
        return number, self.all[number].range_of(playing.asset, playing.mirrored)

    def playing_at(self, moment: Sequence[float]) -> Playing | None:
        """What plays at a moment as the core has it, with frames counted in its bank; None where there is none such."""
        number, at, time_s = moment
        if number not in range(len(self.all)) or not math.isfinite(time_s):
            return None
        bank, names = self.all[int(number)], list(self.banks)
        if at not in range(len(bank.assets)):
            return None
        name = names[int(number)] if names else ""
        frame = int(bank.starts[int(at)]) + round(time_s * bank.rate)
        return Playing(name, bank.assets[int(at)], int(at), frame, time_s, bool(bank.mirrored[int(at)]))

    def plays_of(self, rows: Rows, decisions: Sequence[Decision], grounds: Grounds | None) -> Floats:
        """What poses are made of, by decisions from anywhere: float64 [N, 18]. Raises MotionError where no bank has what plays."""
        plays: list[float] = []
        each = zip(decisions, rows.displayed.tolist(), _gives(grounds, len(rows)).tolist(), strict=True)
        for decision, displayed, ground in each:
            motion, playing, before = decision.root_motion, decision.playing, decision.before
            plays += (
                *self.moment_of(playing), *self.moment_of(before), *displayed,
                NUMBERS[decision.action], decision.play_rate,
                motion.left_m, motion.ahead_m, motion.turn_rad, decision.root_weight, ground,
                *_numbers_of(decision.play),
            )  # fmt: skip
        return np.array(plays, np.float64).reshape(len(rows), N_PLAY)

    def plays_in(self, rows: Rows, updates: Updates, decisions: Sequence[Decision], grounds: Grounds | None) -> Floats:
        """The same of the decisions of some updates, which the core has already."""
        places = self._places.get(updates.chooser)
        if places is None:
            if len(self._places) >= MOST_CHOOSERS:
                self._places.clear()
            places = self._places[updates.chooser] = self._places_of(updates.chooser)
        plays = np.empty((len(rows), N_PLAY))
        is_whole = fill_plays(updates.decisions, *places, rows.displayed, _gives(grounds, len(rows)), plays)
        return plays if is_whole else self.plays_of(rows, decisions, grounds)

    def _places_of(self, chooser: Chooser) -> tuple[Ints, Ints, Ints]:
        """Where the ranges of each database begin, the bank of each, and the range there of each of their ranges; -1 for none."""
        starts, banks, ranges = [0], list[int](), list[int]()
        for name, database in zip(chooser.names, chooser.databases, strict=True):
            number = 0 if self.only is not None else self._numbers.get(name, -1)
            banks.append(number)
            if database is not None:
                bank, each = self.all[number], zip(database.assets, database.mirrored.tolist(), strict=True)
                ranges += [bank.number_of(asset, mirrored) for asset, mirrored in each]
            starts.append(len(ranges))
        return np.array(starts, np.int64), np.array(banks, np.int64), np.array(ranges, np.int64)

    def moment_of(self, playing: Playing | None) -> Moment:
        """What plays as the core has it: its bank, range and second."""
        return NO_MOMENT if playing is None else (*self.find(playing), playing.time_s)


def _numbers_of(play: RowPlay | None) -> tuple[float, float]:
    """How long the row of what plays is blended, and what moves the root, as the core has it; NaN where it does not say."""
    if play is None:
        return math.nan, math.nan
    return math.nan if play.blend_s is None else play.blend_s, math.nan if play.root is None else float(ROOTS.index(play.root))


def _gives(grounds: Grounds | None, n: int) -> Flags:
    """Who stands on a ground."""
    if isinstance(grounds, Sequence):
        return np.array([each is not None for each in grounds], np.bool_)
    return np.full(n, grounds is not None)


def _poses(banks: Sequence[PoseBank], settings: PoseSettings, *, feels_ground: bool) -> Poses:
    """The stages in the core: a rig, its banks and settings."""
    frames = tuple(each.frames_on_ground if feels_ground else each.frames for each in banks)
    return Poses(*rig_parts(banks), numbers_of(settings), frames)


Rig = tuple[Ints, Floats, Ints, Ints, Floats, Ints, Ints, Floats, float, int]


def rig_parts(banks: Sequence[PoseBank]) -> Rig:
    """The rig of banks as the core takes it: parents, offsets, places, legs, hinges, tops, the spine and what is left of its turn,
    what joints may be accelerated by, and how many have positions of their own."""
    bank, spine = banks[0], spine_of(banks[0])
    rig = bank.skeleton
    joints, left = (np.zeros(0, np.int64), np.zeros(0)) if spine is None else (spine.joints, spine.left)
    legs = legs_of(rig, bank.feet)
    most = ADDED_SHARE * max(each.most_accel for each in banks)
    hinges, tops = hinges_of(rig, legs, bank.rotations), np.array(tops_of(rig), np.int64)
    return *bank.joints, legs, hinges, tops, joints, left, most, len(bank.moving)


def numbers_of(settings: PoseSettings) -> dict[str, float]:
    """Settings as numbers: of a word its place among those that are accepted."""
    values: dict[str, Any] = {key: getattr(settings, key) for key in settings_of(PoseSettings)}
    words = {key: each.shape.words for key, each in settings_of(PoseSettings).items()}
    return {key: float(words[key].index(value) if words[key] else value) for key, value in values.items()}


def _checked(banks: object) -> dict[str, PoseBank]:
    """Banks by name, all of one rig."""
    named: dict[str, PoseBank] = dict(require_mapping(banks, "bank", "a PoseBank, or a mapping of databases to them"))
    for each in named.values():
        require_kind(each, PoseBank, "one of bank", "a PoseBank")
    if not named:
        raise MotionError(Fault("there is no pose bank.", "at least one"))
    (first, rig), *others = named.items()
    for name, other in others:
        if apart := _apart(rig, other):
            both = " and ".join(f"{in_quotes(at)} (with {in_quotes(bank.assets[0])})" for at, bank in ((first, rig), (name, other)))
            raise MotionError(Fault(f"the banks {both} are of different rigs: {apart}.", "banks of one rig", RIG_MEND))
    return named


def _apart(rig: PoseBank, other: PoseBank) -> str:
    """How the rigs of two banks differ, as the end of a sentence; empty where they do not."""
    if alone := [name for name in rig.skeleton.names if name not in other.skeleton.names]:
        return f"the second has no joint {in_quotes(alone[0])}"
    if more := [name for name in other.skeleton.names if name not in rig.skeleton.names]:
        return f"the first has no joint {in_quotes(more[0])}"
    if rig.skeleton.names != other.skeleton.names or not np.array_equal(rig.skeleton.parents, other.skeleton.parents):
        return "their joints have another order or other parents"
    apart = np.setxor1d(rig.moving, other.moving).tolist()
    return f"the joint {in_quotes(rig.skeleton.names[apart[0]])} has positions of its own in one of them alone" if apart else ""


# ---- the spine: the joints that turn back what the core's alignment turns the hips by


@dataclass(frozen=True, eq=False, slots=True)
class Spine:
    """The joints that hang on the root, where they are in positions [M, 3], and the joints from the hips to the chest, which turn
    back: after each so much of the turn is left."""

    tops: Ints
    places: Ints
    joints: Ints
    left: Floats


def spine_of(bank: PoseBank) -> Spine | None:
    """The spine of a rig: from where the legs part up to where the arms do; None where there are no feet or nothing above them."""
    rig = bank.skeleton
    if not bank.feet:
        return None
    legs = [{rig.index(foot), *rig.ancestors(rig.index(foot))} for foot in bank.feet]
    shared = set.intersection(*legs)
    hips = max(shared, key=lambda joint: int(rig.depths[joint]), default=0)
    above = [joint for joint in _below(rig, hips) if not any(joint in leg for leg in legs)]
    joints: list[int] = []
    while above:
        joints.append(max(above, key=lambda joint: _size(rig, joint)))
        above = [joint for joint in _below(rig, joints[-1]) if _below(rig, joint)]
        if len(above) > 1:
            break
    if not joints:
        return None
    tops = np.array(tops_of(rig), np.int64)
    left = 1.0 - np.arange(1, len(joints) + 1) / len(joints)
    return Spine(tops, np.searchsorted(bank.moving, tops), np.array(joints, np.int64), left)


def _below(rig: Skeleton, joint: int) -> list[int]:
    return [other for other in range(rig.n_joints) if rig.parents[other] == joint]


def _size(rig: Skeleton, joint: int) -> int:
    """How many joints hang on a joint, itself among them."""
    return 1 + sum(_size(rig, other) for other in _below(rig, joint))
