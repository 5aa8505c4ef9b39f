"""A match node: a one-off animation, chosen once when it is entered and played to completion, that brings the body to a target.

    cost of a frame = motion cost + position_weight x distance² + rotation_weight x angle²

The distance is that from the target to where the animation, played from this frame, would bring the body by itself: to the end of
its warp range (or of the clip, where it has none, or the frame lies behind it), unwarped. The angle is that between the headings.
So an animation is chosen that comes near by itself, and the warp has little left to do. The search is the database's own, with
these two costs as biases: exact, among the frames of match ranges alone.

The chosen animation plays from its frame up to the end of its range, a looping one too, or to the frame before an excluded one.

N frames. Source: "Match Node", "Candidate End Points" and "Distance To Target Cost" in EA's talk; the match node of Remedy's, whose
match range says where an animation can be started and whose warp range says in which frames it is warped.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TypedDict, Unpack

import numpy as np
from numpy.typing import ArrayLike

from contextdb.cells.arguments import as_number, require_kind, require_text
from contextdb.cells.row_play import RowPlay
from contextdb.core import aim
from contextdb.errors import Fault, MotionError, QueryError, in_quotes
from contextdb.motion.answers import is_answer
from contextdb.motion.arguments import Valid, ValidRanges
from contextdb.motion.clips.quaternions import Floats
from contextdb.motion.clips.skeleton import Ints
from contextdb.motion.clips.trajectory import to_own_frame
from contextdb.motion.features.channels import require_weight
from contextdb.motion.markup.span_faults import TOLERANCE_S
from contextdb.motion.nodes.stitching import shortest_part
from contextdb.motion.nodes.warping import Target, WarpedPath, WarpShare, Window, warped
from contextdb.motion.search.candidates import Candidates
from contextdb.motion.search.database import MotionDatabase
from contextdb.motion.search.filtering import Penalties, Tags
from contextdb.motion.search.hit import Hit
from contextdb.motion.selection.chooser import Chooser, Ranges
from contextdb.motion.selection.controller_settings import ControllerSettings
from contextdb.motion.selection.decision import Action, Decision
from contextdb.motion.selection.playhead import Playhead, playing_at
from contextdb.motion.selection.root_motion import RootMotion, between
from contextdb.motion.selection.selector import Entry, Selector


class MatchOptions(TypedDict, total=False):
    """What a match node's search may be given beside query, target and valid assets; see `MotionDatabase.search`."""

    tags: Tags | None
    penalties: Penalties | None


@dataclass(frozen=True)
class MatchCosts:
    """What the chosen frame costs, part by part.

    Attributes
    ----------
    motion : dict of str to float
        By channel.
    distance, rotation : float
        Of the target from where the animation ends by itself, and of its heading.
    biases : float
        What markup, tags, penalties and the database's own biases add.
    """

    motion: dict[str, float]
    distance: float
    rotation: float
    biases: float

    @property
    def total(self) -> float:
        """Their sum: the hit's cost, but for rounding."""
        return math.fsum((*self.motion.values(), self.distance, self.rotation, self.biases))


@dataclass(eq=False)
class MatchPlay:
    """An animation that a match node has entered, on its way to the target.

    Attributes
    ----------
    hit : Hit
        The frame at which it was entered, and its cost.
    target : Target
    costs : MatchCosts
    path : WarpedPath
        Where the body is at every moment; `path.position_s` and `path.rotation_s` say when the target is reached.
    playhead : Playhead
        The range that plays.
    time_s : float
        Seconds since the entry.
    since_s : float
        Those before the last `advance`.
    how : RowPlay or None
        How the row of what plays says that it does: `blend_s`, `start_s`, `mirror`, `play_rate` and `root` count. It plays once,
        to its end.
    play_rate : float
        Seconds of the clip that pass in a second.
    """

    hit: Hit
    target: Target
    costs: MatchCosts
    path: WarpedPath
    playhead: Playhead
    time_s: float = 0.0
    since_s: float = 0.0
    how: RowPlay | None = None
    play_rate: float = 1.0

    @property
    def entry_s(self) -> float:
        """Seconds from the asset's start to the frame at which it was entered."""
        return (self.hit.frame - self.playhead.start) / self.playhead.rate

    @property
    def duration_s(self) -> float:
        """Seconds from the entry to the end."""
        return float(self.path.times_s[-1])

    @property
    def is_done(self) -> bool:
        """Whether it has played to completion."""
        return self.time_s >= self.duration_s

    @property
    def frame(self) -> int:
        """The frame that shows now, counted over the whole database."""
        return self.playhead.frame_at(self.clip_s)

    @property
    def clip_s(self) -> float:
        """Which second of the clip shows now."""
        return self.entry_s + self.time_s * self.play_rate

    def advance(self, dt_s: float) -> RootMotion:
        """Play on for some seconds, and say where the body is then; at the end it stays."""
        dt_s = _seconds(dt_s, "the time step")
        self.since_s = self.time_s
        self.time_s += dt_s
        if self.time_s > self.duration_s - TOLERANCE_S:
            self.time_s = self.duration_s
        return self.at(self.time_s)

    def decision(self, database: str = "") -> Decision:
        """What plays now, for `PoseStream.update`; after each `advance`. `database` is its name, where a stream has several banks.

        Its root weight is 0, for the game has the body on the warped path; its root motion is that path's, for the root mode
        "animation". Raises ContextError where `database` is no text.
        """
        head, time_s = self.playhead, self.clip_s
        playing = playing_at(require_text(database, "database"), head, head.frame_at(time_s), time_s)
        motion = between(self.at(self.since_s), self.at(self.time_s))
        action = Action.JUMP if self.since_s == 0.0 else Action.CONTINUE
        way = self.costs.distance + self.costs.rotation
        why = (
            f"plays {playing.asset} on to its target; its cost was {self.hit.cost:.4g}{f', {way:.4g} of it the way' if way else ''}"
        )
        return Decision(
            0, self.time_s, action, why, False, playing, None,
            root_motion=motion, root_weight=0.0, play_rate=self.play_rate, play=self.how,
        )  # fmt: skip

    def at(self, time_s: float) -> RootMotion:
        """Where the body is some seconds after the entry, seen from where it was then; behind the end, as there."""
        return self.path.at(_seconds(time_s, "the time since the entry"))

    def warp_share(self, time_s: float) -> WarpShare:
        """How much of the warp has been blended in some seconds after the entry: 0 to 1, of position and rotation."""
        return self.path.share_at(_seconds(time_s, "the time since the entry"))


class MatchNode:
    """Chooses among the animations of a database the one that fits the pose and brings the body to a target.

    Parameters
    ----------
    database : MotionDatabase
        With root motion: built from clips, or with `root` given.
    position_weight : float
        Cost of a square metre between the target and where the animation ends, on the scale of the database's costs: with 1, of
        clips with a schema, a metre off is as dear as a pose that differs by the usual spread in every feature.
    rotation_weight : float
        Cost of a square radian between the headings.
    rate : float, optional
        Frames a second, for a database made from features. Default: the schema's.

    Raises
    ------
    MotionError
        A database without root motion or rate, root motion that is not finite, or a weight not from 0 to a million.
    """

    def __init__(
        self, database: MotionDatabase, *, position_weight: float = 1.0, rotation_weight: float = 1.0, rate: float | None = None
    ) -> None:
        require_kind(database, MotionDatabase, "database", "a MotionDatabase")
        self.database = database
        self.rate = _rate_of(database, rate)
        self.position_weight = require_weight(position_weight, "position_weight")
        self.rotation_weight = require_weight(rotation_weight, "rotation_weight")
        self._root = _checked_root(database)

    def enter(
        self, query: ArrayLike, target: Target, valid: Valid | None = None, **options: Unpack[MatchOptions]
    ) -> MatchPlay | None:
        """Choose an animation and the frame to start it at; None when nothing may play.

        Parameters
        ----------
        query : float array, shape (F,)
            The pose at entry.
        target : Target
            Where the body shall be when the warp range of the animation ends, or the animation itself where it has none.
        valid, tags, penalties
            As for `MotionDatabase.search`.

        Raises
        ------
        QueryError
            As from `MotionDatabase.search`, or a target that is none.
        """
        hit = self.search(query, target, valid, **options)
        return self.play(hit, query, target, valid, **options) if hit else None

    def search(self, query: ArrayLike, target: Target, valid: Valid | None = None, **options: Unpack[MatchOptions]) -> Hit:
        """The frame that `enter` would start at."""
        ranges = self._ranges(valid)
        bias = self._target_bias(target) + self._start_bias(ranges)
        return self.database.search(query, self._valid(valid, ranges), bias=bias, in_match_range=True, **options)

    def candidates(
        self, query: ArrayLike, target: Target, k: int = 10, valid: Valid | None = None, **options: Unpack[MatchOptions]
    ) -> Candidates:
        """The k best frames of that search, and why others were left out; what the target adds is their bias "given".

        Where they would bring the body by themselves is `ends[candidate.frame]`.
        """
        ranges = self._ranges(valid)
        bias = self._target_bias(target) + self._start_bias(ranges)
        return self.database.candidates(query, k, self._valid(valid, ranges), bias=bias, in_match_range=True, **options)

    def play(
        self, hit: Hit, query: ArrayLike, target: Target, valid: Valid | None = None, **options: Unpack[MatchOptions]
    ) -> MatchPlay:
        """Start at a frame that `search` has found with the same arguments."""
        ranges = self._ranges(valid)
        how = None if ranges is None or ranges.plays is None else ranges.plays.of_range(hit.range)
        rate = 1.0 if how is None else how.rate
        costs = self._costs(hit, query, target, self._valid(valid, ranges), **options)
        frames = np.arange(hit.frame, self._last[hit.frame] + 1)
        position, rotation = (Window(*each) for each in (self._windows(frames[:1])[0] / rate).tolist())
        path = warped((frames - hit.frame) / (self.rate * rate), self._root[frames], position, rotation, target)
        return MatchPlay(hit, target, costs, path, Playhead(self.database, hit.range, self.rate), how=how, play_rate=rate)

    def stitch(
        self, query: ArrayLike, after: ArrayLike, most_cost: float, valid: Valid | None = None, **options: Unpack[MatchOptions]
    ) -> MatchPlay | None:
        """Choose the shortest part of an animation that leads from one pose to another, and play it as it is; None where none does.

        Parameters
        ----------
        query, after : float array, shape (F,)
            The pose that it begins with, such as `Character.features()`, and the one that follows it, such as `raw(frame)` of the
            database of what plays next.
        most_cost : float
            What the first frame may cost for the one and the last for the other, together. Of parts that are equally short the one
            that costs least plays.
        valid, tags, penalties
            As for `enter`, of the frame that it begins with.

        Raises
        ------
        QueryError
            As from `MotionDatabase.search`, or a cost that is none.
        """
        ranges = self._ranges(valid)
        bias = self._start_bias(ranges) + np.zeros(self.database.n_frames)
        chosen = self.database.filter(self._valid(valid, ranges), bias=bias, in_match_range=True, **options)
        part = shortest_part(self.database, query, after, most_cost, chosen, self._last)
        if part is None:
            return None
        first, last, total = part
        at = self.database.range_of(first)
        hit = Hit(self.database.assets[at], at, first, total)
        how = None if ranges is None or ranges.plays is None else ranges.plays.of_range(at)
        rate, frames = 1.0 if how is None else how.rate, np.arange(first, last + 1)
        path, still = _path(self._root, frames), Window(0.0, 0.0)
        (left, ahead), turn = to_own_frame(path[-1:, :2] - path[0, :2], path[0, 2])[0].tolist(), path[-1, 2] - path[0, 2]
        target = Target(left, ahead, float(turn))
        ends = self.database.channel_costs(hit, query), self.database.channel_costs(replace(hit, frame=last), after)
        motion = {name: own + ends[1][name] for name, own in ends[0].items()}
        costs = MatchCosts(motion, 0.0, 0.0, total - math.fsum(motion.values()))
        there = warped((frames - first) / (self.rate * rate), path, still, still, target)
        return MatchPlay(hit, target, costs, there, Playhead(self.database, at, self.rate), how=how, play_rate=rate)

    # ---- how the rows of an answer play

    @cached_property
    def _chooser(self) -> Chooser:
        return Chooser(Selector([Entry("", self.database)]), ControllerSettings(rate=self.rate))

    def _ranges(self, valid: Valid | None) -> Ranges | None:
        """Which ranges an answer lets play, and how; None for what does not say how."""
        if not is_answer(valid) or valid.plays is None:
            return None
        return self._chooser.ranges(valid, 1)

    def _valid(self, valid: Valid | None, ranges: Ranges | None) -> Valid | None:
        return valid if ranges is None else ValidRanges(ranges.flags[0], ranges.biases[0])

    def _start_bias(self, ranges: Ranges | None) -> Floats | float:
        """What forbids all frames of ranges but that at which their row says that they are entered."""
        if ranges is None or ranges.plays is None:
            return 0.0
        bias = np.zeros(self.database.n_frames)
        for at in np.flatnonzero(ranges.flags[0]).tolist():
            how = ranges.plays.of_range(at)
            if how is not None and how.start_s is not None:
                own = slice(int(self.database.starts[at]), int(self.database.stops[at]))
                entry = Playhead(self.database, at, self.rate).frame_at(how.start_s)
                bias[own] = np.inf
                bias[entry] = 0.0
        return bias

    def target_costs(self, target: Target) -> tuple[Floats, Floats]:
        """What distance and rotation add to the cost of each frame: two float64 arrays [N], 0 between ranges."""
        if not isinstance(target, Target):
            raise QueryError(Fault(f"the target is {target!r}.", "a Target"))
        return self._target_costs(self.ends, target)

    @cached_property
    def ends(self) -> Floats:
        """Where each frame's animation brings the body by itself, seen from the frame: metres left and ahead, radians; [N, 3].

        The place is that at the end of the positional warp range, the turn that at the end of the rotational one; of a frame that
        has no time left there, that at the end of its animation.
        """
        frames = self.database.layout.frames
        path, places = _path(self._root, frames), np.zeros(self.database.n_frames, np.int64)
        places[frames] = np.arange(len(frames))
        windows = self._windows(frames)
        lasts = (self._last[frames] - frames) / self.rate
        is_open = windows[:, :, 1] - windows[:, :, 0] > TOLERANCE_S
        arrivals = np.where(is_open, windows[:, :, 1], lasts[:, None])
        rows, last_rows = np.arange(len(frames)), places[self._last[frames]]
        there, turned = (_path_at(path, rows + arrivals[:, i] * self.rate, last_rows) for i in (0, 1))
        ends = np.zeros((self.database.n_frames, 3))
        ends[frames, :2] = to_own_frame(there[:, :2] - path[:, :2], path[:, 2])
        ends[frames, 2] = turned[:, 2] - path[:, 2]
        ends.flags.writeable = False
        return ends

    def _windows(self, frames: Ints) -> Floats:
        """The warp windows of position and rotation left to each frame, from and to in seconds since the frame: [n, 2, 2].

        One that ends before it begins has no time left. A warp range of NaN is as long as the animation.
        """
        ranges = self.database.layout.frame_ranges[frames]
        own_s = (frames - self.database.starts[ranges]) / self.rate
        lasts_s = (self._last[frames] - frames) / self.rate
        since = self.database.marks.warps[ranges] - own_s[:, None, None]
        return np.stack((np.fmax(since[:, :, 0], 0.0), np.fmin(since[:, :, 1], lasts_s[:, None])), axis=-1)

    @cached_property
    def _last(self) -> Ints:
        """The last frame that playing on from each leads to: int64 [N]."""
        ranges, n_frames = self.database.layout.frame_ranges, self.database.n_frames
        playable = self.database.marks.playable()[self.database.marks.kinds] & (ranges >= 0)
        goes_on = np.zeros(n_frames, np.bool_)
        goes_on[:-1] = playable[1:] & (ranges[1:] == ranges[:-1])
        stops = np.where(goes_on, n_frames, np.arange(n_frames))
        return np.asarray(np.minimum.accumulate(stops[::-1])[::-1])

    def _target_costs(self, ends: Floats, target: Target) -> tuple[Floats, Floats]:
        distances, rotations = np.empty(len(ends)), np.empty(len(ends))
        aim(ends, target.numbers, np.array((self.position_weight, self.rotation_weight)), distances, rotations)
        return distances, rotations

    def _target_bias(self, target: Target) -> Floats:
        distance, rotation = self.target_costs(target)
        return distance + rotation

    def _costs(
        self, hit: Hit, query: ArrayLike, target: Target, valid: Valid | None, **options: Unpack[MatchOptions]
    ) -> MatchCosts:
        motion = self.database.channel_costs(hit, query)
        chosen = self.database.filter(valid, in_match_range=True, **options)
        distances, rotations = self._target_costs(self.ends[hit.frame : hit.frame + 1], target)
        return MatchCosts(
            motion,
            float(distances[0]),
            float(rotations[0]),
            float(chosen.range_biases[hit.range] + chosen.kinds.biases[self.database.marks.kinds[hit.frame]]),
        )


# ---- paths


def _path(root: Floats, frames: Ints) -> Floats:
    """The path of some frames, their headings unwrapped: float64 [n, 3]."""
    path = root[frames].astype(np.float64)
    path[:, 2] = np.unwrap(path[:, 2])
    return path


def _path_at(path: Floats, rows: Floats, last_rows: Ints) -> Floats:
    """A path [n, 3] at fractional rows, each at most its last row: [n, 3]."""
    low = np.minimum(rows.astype(np.int64), last_rows)
    high = np.minimum(low + 1, last_rows)
    shares = np.clip(rows - low, 0.0, 1.0)[:, None]
    return np.asarray(path[low] * (1.0 - shares) + path[high] * shares)


# ---- checks


def _checked_root(database: MotionDatabase) -> Floats:
    root = database.root
    accepted = f"x and z in metres and the heading in radians of each of {database.n_frames} frames"
    if root is None or np.shape(root) != (database.n_frames, 3):
        problem = "has no root motion" if root is None else f"has root motion of shape {np.shape(root)}"
        raise MotionError(Fault(f"a match node's database {problem}.", accepted))
    frames = database.layout.frames
    wrong = frames[~np.isfinite(root[frames]).all(axis=1)]
    if len(wrong):
        asset = database.assets[database.range_of(int(wrong[0]))]
        problem = f"the root motion of frame {wrong[0]} is {root[wrong[0]].tolist()} (asset {in_quotes(asset)})."
        raise MotionError(Fault(problem, "finite numbers"))
    return np.asarray(root)


def _rate_of(database: MotionDatabase, rate: float | None) -> float:
    known = None if database.schema is None else database.schema.rate
    number = known if rate is None else as_number(rate)
    if number is None or number <= 0.0 or (known is not None and number != known):
        problem = "a match node's database has no schema that gives its rate." if rate is None else f"the rate is {rate!r}."
        raise MotionError(Fault(problem, "frames a second, more than 0" if known is None else f"{known:g}, the schema's"))
    return number


def _seconds(value: object, what: str) -> float:
    number = as_number(value)
    if number is None or number < 0.0:
        raise QueryError(Fault(f"{what} is {value!r}.", "seconds, 0 or more"))
    return number
