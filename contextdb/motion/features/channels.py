"""Channels: the named blocks of features that a schema is made of, each weighed as one.

The body's own frame has its origin at the body's place on the ground and looks where the body faces: left, up, ahead.

    type              features    of
    position          3           a bone, m
    velocity          3           a bone, m/s over the ground, not less the body's own
    angular_velocity  3           a bone, rad/s: along the axis it turns about, by the right-hand rule
    direction         3           one axis of a bone, a unit vector
    orientation       6           a bone's rotation: where its own x and y axes point
    phase             4           both feet: sine and cosine of how far each is through its step; 0, 0 for a foot without steps
    custom            `size`      what a function of yours makes of the poses and the path
    permutation_time  1           how many seconds ahead the permuted channels look
    trajectory        2 a point   what = "position" (m: left, ahead), "velocity" (m/s),
                                  "direction" (of the facing, a unit vector),
                                  "direction_to_velocity" (of the facing against the way it moves, as if it moved ahead)
                      1 a point   what = "speed" (m/s)

With `relative_to`, another bone takes the body's place: a position or a velocity is then the difference of the two bones, in the
body's axes; a direction or an orientation is seen from that bone, in its own axes. `at` gives seconds after the frame, `along`
metres further on the path; negative ones before and behind. A pose channel `at` other moments is what it is at the nearest frame,
in the body's frame of that moment, and stays what it was beyond the clip's ends.

A bone's channel that is `permuted` looks ahead by the seconds of the permutation, see `contextdb.motion.features.channels`: it
holds the bone as it is then, seen from the body, or from the bone that it is relative to, as that is now. A velocity is the
difference of both bones then. Beyond the clip's end it stays what it was, too.

An orientation has six numbers because a rotation cannot be four or fewer without a jump: a quaternion and its negative are one
rotation, and angles leap from 180 to -180. Two axes are continuous, so frames that look alike are near each other.

Source: Zhou et al., "On the Continuity of Rotation Representations in Neural Networks", CVPR 2019 (orientation); Remedy, "Control",
GDC (sampling by distance, direction to velocity).

So a query can say what shall be when: a hand at the ball in 0.4 s. Permutation i looks from_s + i x step_s ahead.

Source: NumberOfPermutations, PermutationsSampleRate and PermutationsTimeOffset of Unreal's PoseSearch.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Literal, TypeGuard, get_args

from contextdb.errors import ContextError, MotionError, in_quotes, safe_text
from contextdb.files.settings import (
    Declared,
    Section,
    Settings,
    flag,
    number,
    setting,
    settings_of,
    settings_with,
    word,
)
from contextdb.files.toml_shapes import Shape, as_toml, between, filled, numbers_within, what

ChannelType = Literal[
    "position", "velocity", "trajectory", "direction", "orientation", "angular_velocity", "phase", "custom", "permutation_time"
]
What = Literal["position", "direction", "velocity", "speed", "direction_to_velocity"]
Axis = Literal["x", "y", "z", "-x", "-y", "-z"]

TYPES: tuple[ChannelType, ...] = get_args(ChannelType)
WHATS: tuple[What, ...] = get_args(What)
AXES: tuple[Axis, ...] = get_args(Axis)
OF_BONES: tuple[ChannelType, ...] = ("position", "velocity", "angular_velocity", "direction", "orientation")
TYPE_SYNONYMS = {
    "pos": "position",
    "vel": "velocity",
    "traj": "trajectory",
    "path": "trajectory",
    "rotation": "orientation",
    "heading": "direction",
    "facing": "direction",
    "spin": "angular_velocity",
    "footfalls": "phase",
}
WHAT_SYNONYMS = {
    "facing": "direction",
    "heading": "direction",
    "dir": "direction",
    "pos": "position",
    "vel": "velocity",
    "strafe": "direction_to_velocity",
}

MOST_WEIGHT = 1e6
MOST_SECONDS = 60.0
MOST_METRES = 1000.0
MOST_FEATURES = 1000
"""Of one custom channel."""
DEFAULT_AXIS: Axis = "z"
"""Where most BVH skeletons look at rest, so that a head's direction is that of its gaze."""
BODY_AXES = ("left", "up", "ahead")
GROUND_AXES = ("left", "ahead")
PHASE_AXES = ("left sine", "left cosine", "right sine", "right cosine")


def is_pair(value: object) -> TypeGuard[Sequence[str]]:
    """Whether a value is a list of two different names."""
    return (
        isinstance(value, (list, tuple))
        and len(value) == 2
        and all(isinstance(name, str) and name for name in value)
        and value[0] != value[1]
    )


def bone_pair(such_as: str) -> Shape:
    """A left and a right bone."""
    accepted = f"the left and the right bone, such as {such_as}"
    return Shape(accepted, lambda value: None if is_pair(value) else "this is not a pair of bones", read=tuple)


FEET = bone_pair('["LeftFoot", "RightFoot"]')
WEIGHT = between("a weight", 0.0, MOST_WEIGHT, 1.0)
ANOTHER = filled('another bone, such as "Hips"')


@dataclass(frozen=True)
class Channel(Declared, error=MotionError):
    """A block of features that are weighed together.

    Raises
    ------
    MotionError
        A value that is not accepted; all faults together.
    """

    type: ChannelType = word(TYPES, "What the channel holds.", noun="type", synonyms=TYPE_SYNONYMS)
    weight: float = setting(WEIGHT, "Multiplies the squared differences of its normalised features.", 1.0)
    bone: str | None = setting(
        filled('a bone of the clips, such as "LeftFoot"'),
        "The bone whose position, velocity, direction or orientation it is.",
        None,
        types=OF_BONES,
        is_needed=True,
    )
    what: What | None = word(
        WHATS, "What of the trajectory.", None, "feature of a trajectory", WHAT_SYNONYMS, types=("trajectory",), is_needed=True
    )
    at: tuple[float, ...] = setting(
        numbers_within("seconds", MOST_SECONDS, "[0.33, 0.67, 1.0]"),
        "When it looks, counted from the frame; below 0 is before it.",
        (),
        without="the frame itself",
        types=(*OF_BONES, "phase", "custom", "trajectory"),
    )
    along: tuple[float, ...] = setting(
        numbers_within("metres along the path", MOST_METRES, "[0.5, 1.0, 2.0]"),
        "Where on the path it looks, counted from the frame, instead of `at`; below 0 is behind it.",
        (),
        without="none",
        types=("trajectory",),
    )
    group: str | None = setting(
        filled('a name, such as "feet"'), "Channels of one group share a scale of normalisation.", None, without="each its own"
    )
    axis: Axis | None = word(AXES, "Which of the bone's own axes.", None, "axis", without=f'"{DEFAULT_AXIS}"', types=("direction",))
    relative_to: str | None = setting(
        ANOTHER, "The bone that takes the place of the body.", None, without="the body", types=OF_BONES
    )
    feet: tuple[str, str] | None = setting(
        FEET, "Whose footfalls.", None, without="the feet of the schema, else those that are detected", types=("phase",)
    )
    function: str | None = setting(
        filled('the name of a function given to with_functions, such as "reach"'),
        "The name of the function that computes it; see `FeatureSchema.with_functions`.",
        None,
        types=("custom",),
        is_needed=True,
    )
    size: int = number(
        "How many features the function gives.", 1, 1, MOST_FEATURES, "a whole number", 2, is_whole=True, types=("custom",)
    )
    permuted: bool = flag("Whether it looks ahead by the seconds of each permutation of a clip.", False, types=OF_BONES)

    @property
    def varies(self) -> bool:
        """Whether it differs between the permutations of a clip."""
        return self.permuted or self.type == "permutation_time"

    @property
    def name(self) -> str:
        """What the channel is called in costs and messages; unique in a schema."""
        points = " ".join(f"{point:g}" for point in self.at or self.along)
        return self._stem + (f" {'at' if self.at else 'along'} {points} {'s' if self.at else 'm'}" if points else "")

    @property
    def feature_names(self) -> tuple[str, ...]:
        """The names of its features, in order."""
        points = [f" at {seconds:g} s" for seconds in self.at] + [f" along {metres:g} m" for metres in self.along]
        return tuple(f"{self._stem}{point}{axis and ' '}{axis}" for point in points or [""] for axis in self._axes)

    @property
    def n_features(self) -> int:
        """How many features it has."""
        return len(self.feature_names)

    @property
    def bones(self) -> tuple[str, ...]:
        """The bones that it names."""
        return tuple(bone for bone in (self.bone, self.relative_to, *(self.feet or ())) if bone is not None)

    @property
    def _stem(self) -> str:
        """Its name without its points."""
        match self.type:
            case "trajectory":
                return f"trajectory {self.what}"
            case "custom":
                return f"custom {self.function}"
            case "phase":
                return "phase" if self.feet is None else f"phase {' '.join(self.feet)}"
            case "permutation_time":
                return "permutation time"
            case _:
                axis = f" {self.axis or DEFAULT_AXIS}" if self.type == "direction" else ""
                seen_from = f" relative to {self.relative_to}" if self.relative_to else ""
                return f"{self.bone} {self.type.replace('_', ' ')}{axis}{seen_from}{' permuted' if self.permuted else ''}"

    @property
    def _axes(self) -> tuple[str, ...]:
        """The names of its features at one point."""
        match self.type:
            case "trajectory":
                return ("",) if self.what == "speed" else GROUND_AXES
            case "custom":
                return ("",) if self.size == 1 else tuple(str(i + 1) for i in range(self.size))
            case "phase":
                return PHASE_AXES
            case "permutation_time":
                return ("",)
        seen = ("x", "y", "z") if self.relative_to and self.type in ("direction", "orientation") else BODY_AXES
        return tuple(f"{own} axis {axis}" for own in "xy" for axis in seen) if self.type == "orientation" else seen


# ---- reading

CHANNEL = settings_of(Channel)
KEYS: dict[str, Settings] = {kind: settings_with(CHANNEL, kind) for kind in TYPES}
"""The keys of a channel of each type."""


def read_channel(section: Section, i: int, item: object) -> Channel | None:
    """Channel `i` of a section; None when it leaves a fault behind."""
    where = f"{section.where} channel {i + 1}"
    if not isinstance(item, Mapping):
        section.add(
            f"{where} is {safe_text(as_toml(item))}: this is {what(item)}, not a table.", '{ type = "position", bone = "LeftFoot" }'
        )
        return None
    n_faults = len(section.faults)
    kind = item.get("type")
    keys = KEYS.get(kind) if isinstance(kind, str) else None
    part = Section(where, item, CHANNEL if keys is None else keys, section.faults, section.file)
    values = part.values(settings_with(CHANNEL, "") if keys is None else keys)
    _check_keys_together(part, kind)
    if len(section.faults) > n_faults:
        return None
    return Channel(**({"axis": DEFAULT_AXIS} if kind == "direction" else {}) | values)


def _check_keys_together(part: Section, kind: object) -> None:
    given = part.part
    if "bone" in given and given["bone"] == given.get("relative_to"):
        part.wrong("relative_to", "this is the bone itself", ANOTHER.accepted)
    if kind in OF_BONES and given.get("permuted") is True and "at" in given:
        part.add(
            f'{part.where} has both "at" and "permuted".', "one of them: a permuted channel looks ahead as its permutation does"
        )
    if kind == "trajectory" and ("at" in given) == ("along" in given):
        amount = 'has both "at" and "along"' if "at" in given else 'has neither "at" nor "along"'
        part.add(f"{part.where} {amount}.", "at = [seconds] or along = [metres], one of them")


def require_weight(weight: object, what: str) -> float:
    """A weight that Python gives; MotionError for what is none."""
    if fault := WEIGHT.fault("", what, weight):
        raise MotionError(fault)
    return float(weight)  # type: ignore[arg-type]


def check_together(section: Section, channels: Sequence[Channel], *, is_whole: bool) -> None:
    """Leave the faults that no channel has alone: a name twice, weights that are all zero."""
    names = [channel.name for channel in channels]
    for name in dict.fromkeys(names):
        if names.count(name) > 1:
            section.add(f"{section.where} has the channel {in_quotes(name)} {names.count(name)} times.", "each channel once")
    if is_whole and not any(channel.weight for channel in channels):
        section.add(f"{section.where}: the weight of every channel is 0.", "at least one above 0, else all frames are alike")


# ---- permutations: each clip is searched several times over, each time with its permuted channels so many seconds ahead of
# its frame


ACCEPTED = "{ count = 5, step_s = 0.1 }"
LEAST_STEP_S = 1e-3


@dataclass(frozen=True)
class Permutations(Declared, error=ContextError):
    """How often each clip is searched, and how far ahead the permuted channels look each time.

    Raises
    ------
    ContextError
        A number out of range.
    """

    count: int = number("How often each clip is searched.", least=1, most=100, unit="a whole number", such_as=5, is_whole=True)
    step_s: float = number(
        "Seconds between one permutation and the next.",
        0.0,
        0.0,
        MOST_SECONDS,
        "seconds",
        0.1,
        without="required where `count` is above 1",
    )
    from_s: float = number("Seconds that the first looks ahead.", 0.0, 0.0, MOST_SECONDS, "seconds", 0.2)

    @cached_property
    def seconds(self) -> tuple[float, ...]:
        """How far ahead each permutation looks."""
        return tuple(round(self.from_s + i * self.step_s, 9) for i in range(self.count))


PERMUTATIONS = settings_of(Permutations)


def read_permutations(parent: Section, value: Mapping[str, object]) -> Permutations | None:
    """Those of `[features.NAME]`; None when a fault is left behind."""
    n_faults = len(parent.faults)
    section = parent.inside("permutations", value, PERMUTATIONS)
    values = section.values(PERMUTATIONS)
    accepted = f"seconds from {LEAST_STEP_S:g} to {MOST_SECONDS:g}, such as 0.1"
    if values.get("count", 1) > 1 and "step_s" not in value:
        section.add(f'{section.where} has no "step_s".', accepted)
    if values.get("step_s", 1.0) < LEAST_STEP_S:
        section.wrong("step_s", "this is out of range", accepted)
    if len(parent.faults) > n_faults:
        return None
    permutations = Permutations(**values)
    if permutations.seconds[-1] > MOST_SECONDS:
        section.add(f"{section.where}: the last looks {permutations.seconds[-1]:g} s ahead.", f"at most {MOST_SECONDS:g} s")
    return permutations
