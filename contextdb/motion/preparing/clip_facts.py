"""What a clip shows: how fast it goes, in which direction, how it turns, its gait, and how it begins and ends.

    clip ─► path of the hips, moment by moment over one step of both feet ─► Spread of speed, direction, turn ─► ClipFacts

A moment is as long as the body takes for a step with each foot, so that its sway cancels out. Angles are in degrees, positive to
the left; lengths in metres, y up.
"""

from __future__ import annotations

import math
import re
import unicodedata
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from contextdb.errors import Fault, MotionError, in_quotes
from contextdb.motion.clips.clip import Clip
from contextdb.motion.clips.feet import Footfalls, footfalls_of
from contextdb.motion.clips.on_the_spot import ground_motion
from contextdb.motion.clips.poses import Poses, poses_of
from contextdb.motion.clips.quaternions import Floats
from contextdb.motion.clips.trajectory import Trajectory, root_trajectory, to_own_frame

GAITS = ("Idle", "Walk", "Run")
NORMAL = "normal"
"""The style of a clip whose name says of none."""
USUAL_STEP_S = 1.0
"""Of a step with each foot, where none is seen."""
LEAST_STEP_S, MOST_STEP_S = 0.4, 2.0
FARTHEST_M = 1e9
STANDING_MPS = 0.25
"""A body that goes slower stands."""
SLOW_SHARE = 0.3
"""Of its middle speed: a slow walk that pauses in each step stands only below this."""
ENDS_S = 0.2
"""How much of a clip's beginning and end its first and last state are taken from."""
RUNNING_MPS = 2.2
"""Faster than this is a run, where no feet are detected."""
LEAST_RUNNING_MPS = 1.0
"""Slower than this is no run, whether feet are down or not: jumps and hops."""
FLIGHT_SHARE = 0.1
"""Of the time: a body that is in the air for longer runs."""
LOW, HIGH = 0.1, 0.9
"""The shares of a clip's moments that are below its low and its high value."""

_GAIT_WORDS = {
    **dict.fromkeys(("walk", "walking", "walks", "stroll", "strolling"), "Walk"),
    **dict.fromkeys(("run", "running", "runs", "jog", "jogging", "sprint", "sprinting", "dash", "dashing"), "Run"),
}
_OTHER = """idle idling stand standing start starting stop stopping turn turning turns left right forward forwards fwd ahead
straight back backward backwards bwd strafe strafing side sideways loop looping cycle circle slow slowly medium fast to from and the
with l r f b dataset clip anim animation take motion mocap locomotion move moving around inplace root rm in out
bvh cw ccw deg degrees"""
_OTHER_WORDS = frozenset(_OTHER.split())
"""Words of a name that say what the columns say, or nothing of how the body is carried."""
_NORMAL_WORDS = frozenset(("normal", "neutral", "default", "basic", "plain", "regular"))
_WORD = re.compile("U+(?!l)|U?l+|o+")
"""A word by its letters: U for a large one, l for a small one, o for one of a script without the two."""


@dataclass(frozen=True, slots=True)
class Spread:
    """A number over the moments of a clip: what a tenth of them is below, the middle, and what a tenth is above."""

    low: float
    middle: float
    high: float

    @property
    def width(self) -> float:
        return self.high - self.low


@dataclass(frozen=True, slots=True)
class ClipFacts:
    """What a clip shows."""

    asset: str
    gaits: tuple[str, ...]
    """Of "Idle", "Walk" and "Run" those in which it is of use: one, and "Idle" too of a clip that comes to a stand."""
    style: str
    """From the clip's name; "normal" where it says none."""
    speed_mps: Spread
    direction_deg: Spread | None
    """Of movement, against the facing; None where the body does not move. Unwrapped: `high` may be above 180."""
    turn_dps: Spread
    duration_s: float
    start: str
    end: str
    """`start`, `end`: "Idle", or the gait and which foot is down: "Walk.Left", "Walk.Right", "Walk.Both", "Run.None"."""
    step_s: float
    """How long a step with each foot takes."""
    on_the_spot_mps: float = 0.0
    """How fast the body of a clip that runs on the spot would go, by its standing feet, though its hips show "Idle"; else 0."""

    @property
    def gait(self) -> str:
        return self.gaits[-1]

    def to_json(self) -> dict[str, Any]:
        return asdict(self) | {"gaits": list(self.gaits)}

    @classmethod
    def of_json(cls, document: Mapping[str, Any]) -> ClipFacts:
        """What `to_json` made plain data of."""
        spreads = {name: document[name] and Spread(**document[name]) for name in ("speed_mps", "direction_deg", "turn_dps")}
        return cls(**{**document, **spreads, "gaits": tuple(document["gaits"])})


@dataclass(frozen=True, eq=False)
class Moments:
    """A clip moment by moment: speeds in m/s, velocities to the left and ahead of the body, turn in degrees a second; [M] each.

    Moment i begins at frame i and is `n` frames long.
    """

    velocities: Floats
    turns: Floats
    n: int

    @property
    def speeds(self) -> Floats:
        return np.asarray(np.linalg.norm(self.velocities, axis=-1))

    @classmethod
    def of(cls, path: Trajectory, seconds: float) -> Moments:
        """The moments of a path, of so many seconds or of the whole path, whichever is shorter."""
        n_frames = len(path.headings)
        n = max(1, min(round(seconds * path.rate), n_frames - 1))
        if n_frames < 2:
            return cls(np.zeros((1, 2)), np.zeros(1), 1)
        turned = path.headings[n:] - path.headings[:-n]
        moved = (path.positions[n:] - path.positions[:-n]) * (path.rate / n)
        # On a circle the way straight across is shorter than the way round; np.sinc(x) is sin(πx)/(πx).
        around = np.sinc(np.clip(turned, -math.pi, math.pi) / math.tau)
        sums = np.concatenate(([0.0], np.cumsum(path.headings)))
        facing = (sums[n + 1 :] - sums[: -(n + 1)]) / (n + 1)
        velocities = to_own_frame(moved, facing) / around[:, None]
        return cls(velocities, np.degrees(turned) * (path.rate / n), n)


def facts_of(clip: Clip, common: Iterable[str] = ()) -> ClipFacts:
    """What a clip of one frame or more shows; `common` are words of its name that say nothing of its style."""
    poses = poses_of(clip)
    path = root_trajectory(poses)
    require_finite(clip, poses)
    falls = falls_of(poses)
    step_s = step_of(falls)
    moments = Moments.of(path, step_s)
    speed, turn = _spread(moments.speeds), _spread(moments.turns)
    moves = moments.speeds >= STANDING_MPS
    gait = gait_of(clip.name, speed, falls) if is_moving(clip.name, speed, float(np.mean(moves))) else "Idle"
    stands = min(STANDING_MPS, SLOW_SHARE * speed.middle)
    ground = ground_motion(clip)
    ends = [_end_state(path, falls, gait, stands, is_end=is_end) for is_end in (False, True)]
    stops = gait != "Idle" and ends[1] == "Idle" and ends[0] != "Idle"
    return ClipFacts(
        clip.name,
        ("Idle", gait) if stops else (gait,),
        style_of(clip.name, common),
        speed,
        _direction(moments.velocities[moves]) if gait != "Idle" else None,
        turn,
        round(clip.duration_s, 3),
        ends[0],
        ends[1],
        step_s,
        0.0 if ground is None else round(ground.speed_mps, 3),
    )


def require_finite(clip: Clip, poses: Poses) -> None:
    """Raise MotionError when the joints of a clip are too far away to be measured."""
    if not np.isfinite(poses.positions).all() or np.abs(poses.positions).max(initial=0.0) > FARTHEST_M:
        problem = f"the clip {in_quotes(clip.name)} has joints too far away to be measured."
        raise MotionError(Fault(problem, f"places within {FARTHEST_M:g} m"))


def falls_of(poses: Poses) -> Footfalls | None:
    """When the feet are down; None for a rig without feet."""
    try:
        return footfalls_of(poses)
    except MotionError:
        return None


def step_of(falls: Footfalls | None) -> float:
    """How long a step with each foot takes: the middle time from one coming down of a foot to its next."""
    if falls is None:
        return USUAL_STEP_S
    lands = [np.array([begin for begin, _ in falls.down[foot].tolist() if begin > 0.0]) for foot in falls.feet]
    steps = np.concatenate([np.diff(each) for each in lands])
    steps = steps[(steps >= LEAST_STEP_S) & (steps <= MOST_STEP_S)]
    return float(np.median(steps)) if len(steps) else USUAL_STEP_S


# ---- words of a name


def words_of(name: str) -> list[str]:
    """The words of a clip's name, in lower case, without numbers."""
    name = unicodedata.normalize("NFC", name)  # an accented letter is two characters in the names that macOS gives to files
    sizes = "".join("U" if c.isupper() else "l" if c.islower() else "o" if c.isalpha() else " " for c in name)
    return [name[match.start() : match.end()].lower() for match in _WORD.finditer(sizes)]


def style_of(name: str, common: Iterable[str] = ()) -> str:
    """What a clip's name says beside gait, speed, direction and turn; "normal" where it says nothing."""
    known = {*_OTHER_WORDS, *_GAIT_WORDS, *_NORMAL_WORDS, *common}
    return "_".join(dict.fromkeys(word for word in words_of(name) if word not in known and len(word) > 1)) or NORMAL


def common_words(names: Sequence[str]) -> set[str]:
    """The words that all names hold: of the project, not of a clip."""
    return set.intersection(*(set(words_of(name)) for name in names)) if len(names) > 1 else set()


def is_moving(name: str, speed: Spread, share: float) -> bool:
    """Whether a clip moves that does so for a share of its moments; where the name says a gait, its fastest tenth is enough."""
    return share > HIGH / 2.0 or speed.high > (STANDING_MPS if _gait_word(name) is not None else 2.0 * STANDING_MPS)


def _gait_word(name: str) -> str | None:
    return next((_GAIT_WORDS[word] for word in words_of(name) if word in _GAIT_WORDS), None)


def gait_of(name: str, speed: Spread, falls: Footfalls | None) -> str:
    """The gait of a clip that moves: as its name says, else by whether the body leaves the ground; who hops slowly does not run."""
    named = _gait_word(name)
    if named is not None:
        return named
    if falls is None or not any(len(falls.down[foot]) for foot in falls.feet):
        return "Run" if speed.middle > RUNNING_MPS else "Walk"
    return "Run" if _flight_share(falls) > FLIGHT_SHARE and speed.middle > LEAST_RUNNING_MPS else "Walk"


def _flight_share(falls: Footfalls) -> float:
    """The share of a clip in which no foot is down."""
    times = np.linspace(0.0, falls.duration_s, 200)
    down = np.zeros(len(times), np.bool_)
    for foot in falls.feet:
        for begin, end in falls.down[foot].tolist():
            down |= (times >= begin) & (times <= end)
    return float(1.0 - down.mean())


# ---- numbers


def _spread(values: Floats) -> Spread:
    low, middle, high = np.quantile(values, (LOW, 0.5, HIGH)).tolist()
    return Spread(round(low, 3) + 0.0, round(middle, 3) + 0.0, round(high, 3) + 0.0)


def _direction(velocities: Floats) -> Spread | None:
    """The direction of velocities [M, 2] to the left and ahead: about their mean."""
    if not len(velocities):
        return None
    left, ahead = velocities.sum(axis=0)
    mean = math.degrees(math.atan2(left, ahead))
    each = np.degrees(np.arctan2(velocities[:, 0], velocities[:, 1]))
    about = (each - mean + 180.0) % 360.0 - 180.0
    low, high = np.quantile(about, (LOW, HIGH)).tolist()
    middle = round(mean, 1) + 0.0
    return Spread(round(middle + min(low, 0.0), 1) + 0.0, middle, round(middle + max(high, 0.0), 1) + 0.0)


def _end_state(path: Trajectory, falls: Footfalls | None, gait: str, stands_mps: float, *, is_end: bool) -> str:
    n = max(1, min(round(ENDS_S * path.rate), len(path.headings) - 1))
    part = path.positions[-n - 1 :] if is_end else path.positions[: n + 1]
    speed = float(np.linalg.norm(part[-1] - part[0])) * path.rate / n
    if gait == "Idle" or speed < stands_mps:
        return "Idle"
    if falls is None:
        return gait
    at = falls.duration_s if is_end else 0.0
    down = [any(begin <= at <= end for begin, end in falls.down[foot].tolist()) for foot in falls.feet]
    return f"{gait}.{_FEET[down[0], down[1]]}"


_FEET = {(True, True): "Both", (True, False): "Left", (False, True): "Right", (False, False): "None"}
