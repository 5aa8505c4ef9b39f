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

A bone's channel that is `permuted` looks ahead by the seconds of the permutation, see `contextdb.motion.features.permutations`: it
holds the bone as it is then, seen from the body, or from the bone that it is relative to, as that is now. A velocity is the
difference of both bones then. Beyond the clip's end it stays what it was, too.

An orientation has six numbers because a rotation cannot be four or fewer without a jump: a quaternion and its negative are one
rotation, and angles leap from 180 to -180. Two axes are continuous, so frames that look alike are near each other.

Source: Zhou et al., "On the Continuity of Rotation Representations in Neural Networks", CVPR 2019 (orientation); Remedy, "Control",
GDC (sampling by distance, direction to velocity).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Literal, TypeGuard, cast, get_args

from contextdb.cells.arguments import as_number
from contextdb.errors import Fault, MotionError, in_quotes, shown
from contextdb.files.toml_shapes import Section
from contextdb.files.toml_text import as_toml, what

ChannelType = Literal[
    "position", "velocity", "trajectory", "direction", "orientation", "angular_velocity", "phase", "custom", "permutation_time"
]
What = Literal["position", "direction", "velocity", "speed", "direction_to_velocity"]
Axis = Literal["x", "y", "z", "-x", "-y", "-z"]

TYPES: tuple[ChannelType, ...] = get_args(ChannelType)
WHATS: tuple[What, ...] = get_args(What)
AXES: tuple[Axis, ...] = get_args(Axis)
BONE_KEYS = ("type", "bone", "relative_to", "at", "permuted", "weight", "group")
KEYS: dict[str, tuple[str, ...]] = {
    "position": BONE_KEYS,
    "velocity": BONE_KEYS,
    "angular_velocity": BONE_KEYS,
    "direction": ("type", "bone", "axis", "relative_to", "at", "permuted", "weight", "group"),
    "orientation": BONE_KEYS,
    "phase": ("type", "feet", "at", "weight", "group"),
    "custom": ("type", "function", "size", "at", "weight", "group"),
    "trajectory": ("type", "what", "at", "along", "weight", "group"),
    "permutation_time": ("type", "weight", "group"),
}
ANY_KEY = tuple(dict.fromkeys(key for keys in KEYS.values() for key in keys))
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


@dataclass(frozen=True)
class Channel:
    """A block of features that are weighed together.

    Attributes
    ----------
    type : str
        "position", "velocity", "angular_velocity", "direction", "orientation", "phase", "custom", "trajectory" or
        "permutation_time".
    weight : float
        Multiplies the squared differences of this channel's normalised features.
    bone : str, optional
        Whose position, velocity, direction or orientation.
    what : "position", "direction", "velocity", "speed" or "direction_to_velocity", optional
        What of a trajectory.
    at : tuple of float
        Seconds after the frame. Of a pose, none is the frame itself.
    along : tuple of float
        Metres along the path, for a trajectory sampled by distance.
    group : str, optional
        Channels of one group share a scale of normalisation. Default: each its own.
    axis : "x", "y", "z", "-x", "-y" or "-z", optional
        Which of the bone's own axes a direction is. Default: "z".
    relative_to : str, optional
        The bone that stands instead of the body.
    feet : (left bone, right bone), optional
        Whose footfalls a phase is of. Default: those of the schema, else the ones that are found.
    function : str, optional
        The name of a custom channel's function; see `FeatureSchema.with_functions`.
    size : int
        How many features a custom channel has.
    permuted : bool
        Whether it looks ahead by the seconds of each permutation of a clip.
    """

    type: ChannelType
    weight: float = 1.0
    bone: str | None = None
    what: What | None = None
    at: tuple[float, ...] = ()
    along: tuple[float, ...] = ()
    group: str | None = None
    axis: Axis | None = None
    relative_to: str | None = None
    feet: tuple[str, str] | None = None
    function: str | None = None
    size: int = 1
    permuted: bool = False

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


def read_channel(section: Section, i: int, item: object) -> Channel | None:
    """Channel `i` of a section; None when it leaves a fault behind."""
    where = f"{section.where} channel {i + 1}"
    if not isinstance(item, Mapping):
        section.add(
            f"{where} is {shown(as_toml(item))}: this is {what(item)}, not a table.", '{ type = "position", bone = "LeftFoot" }'
        )
        return None
    n_faults = len(section.faults)
    kind = item.get("type")
    part = Section(where, item, KEYS.get(kind, ANY_KEY) if isinstance(kind, str) else ANY_KEY, section.faults, section.file)
    known = part.one_of("type", TYPES, "type", TYPE_SYNONYMS) if part.has("type", ", ".join(map(in_quotes, TYPES))) else None
    weight, group = _read_weight(part), _read_group(part)
    channel = READERS[known](part, cast(ChannelType, known), weight or 0.0, group) if known in READERS else None
    return channel if len(section.faults) == n_faults else None


def read_pair(section: Section, key: str, accepted: str) -> tuple[str, str] | None:
    """A left and a right bone."""
    value = section.part[key]
    if is_pair(value):
        return value[0], value[1]
    section.wrong(key, "this is not a pair of bones", accepted)
    return None


def is_pair(value: object) -> TypeGuard[Sequence[str]]:
    """Whether a value is a list of two different names."""
    return (
        isinstance(value, (list, tuple))
        and len(value) == 2
        and all(isinstance(name, str) and name for name in value)
        and value[0] != value[1]
    )


def _bone_channel(part: Section, kind: ChannelType, weight: float, group: str | None) -> Channel | None:
    accepted = 'a bone of the clips, such as "LeftFoot"'
    bone = part.text("bone", accepted) if part.has("bone", accepted) else None
    other = part.text("relative_to", 'another bone, such as "Hips"') if "relative_to" in part.part else None
    if bone is not None and bone == other:
        part.wrong("relative_to", "this is the bone itself", 'another bone, such as "Hips"')
    axis = part.one_of("axis", AXES, "axis") if "axis" in part.part else DEFAULT_AXIS
    at = _read_seconds(part)
    permuted = _read_permuted(part)
    if bone is None or at is None:
        return None
    own = cast(Axis, axis) if kind == "direction" else None
    return Channel(kind, weight, bone, None, at, (), group, own, relative_to=other, permuted=permuted)


def _read_permuted(part: Section) -> bool:
    permuted = "permuted" in part.part and part.flag("permuted") is True
    if permuted and "at" in part.part:
        part.add(
            f'{part.where} has both "at" and "permuted".', "one of them: a permuted channel looks ahead as its permutation does"
        )
    return permuted


def _permutation_time(part: Section, kind: ChannelType, weight: float, group: str | None) -> Channel | None:
    return Channel(kind, weight, group=group)


def _phase_channel(part: Section, kind: ChannelType, weight: float, group: str | None) -> Channel | None:
    accepted = 'the left and the right bone, such as ["LeftFoot", "RightFoot"]'
    feet = read_pair(part, "feet", accepted) if "feet" in part.part else None
    at = _read_seconds(part)
    return None if at is None else Channel(kind, weight, at=at, group=group, feet=feet)


def _custom_channel(part: Section, kind: ChannelType, weight: float, group: str | None) -> Channel | None:
    accepted = 'the name of a function given to with_functions, such as "reach"'
    function = part.text("function", accepted) if part.has("function", accepted) else None
    accepted = f"how many features the function gives, a whole number from 1 to {MOST_FEATURES}"
    size = part.whole("size", accepted, 1, MOST_FEATURES) if "size" in part.part else 1
    at = _read_seconds(part)
    if function is None or size is None or at is None:
        return None
    return Channel(kind, weight, at=at, group=group, function=function, size=size)


def _trajectory_channel(part: Section, kind: ChannelType, weight: float, group: str | None) -> Channel | None:
    what = (
        part.one_of("what", WHATS, "feature of a trajectory", WHAT_SYNONYMS)
        if part.has("what", ", ".join(map(in_quotes, WHATS)))
        else None
    )
    if ("at" in part.part) == ("along" in part.part):
        both = "at" in part.part
        found = f'{part.where} has both "at" and "along".' if both else f'{part.where} has neither "at" nor "along".'
        part.add(found, "at = [seconds] or along = [metres], one of them")
        return None
    at = _read_seconds(part)
    accepted = f"metres along the path, at most {MOST_METRES:g} away, such as [0.5, 1.0, 2.0]"
    along = part.numbers("along", accepted, MOST_METRES) if "along" in part.part else ()
    if what is None or at is None or along is None:
        return None
    return Channel(kind, weight, None, cast(What, what), at, along, group)


Reader = Callable[[Section, ChannelType, float, str | None], Channel | None]
READERS: dict[str | None, Reader] = {
    **dict.fromkeys(("position", "velocity", "angular_velocity", "direction", "orientation"), _bone_channel),
    "phase": _phase_channel,
    "custom": _custom_channel,
    "trajectory": _trajectory_channel,
    "permutation_time": _permutation_time,
}


def _read_seconds(part: Section) -> tuple[float, ...] | None:
    accepted = f"seconds, at most {MOST_SECONDS:g} away, such as [0.33, 0.67, 1.0]"
    return part.numbers("at", accepted, MOST_SECONDS) if "at" in part.part else ()


def _read_weight(part: Section) -> float | None:
    return part.number("weight", f"from 0 to {MOST_WEIGHT:g}, such as 1.0", 0.0, MOST_WEIGHT) if "weight" in part.part else 1.0


def _read_group(part: Section) -> str | None:
    return part.text("group", 'a name, such as "feet"') if "group" in part.part else None


def require_weight(weight: object, what: str) -> float:
    """A weight that Python gives; MotionError for what is none."""
    number = as_number(weight)
    if number is None or not 0.0 <= number <= MOST_WEIGHT:
        raise MotionError(Fault(f"{what} is {weight!r}.", f"a number from 0 to {MOST_WEIGHT:,.0f}"))
    return number


def check_together(section: Section, channels: Sequence[Channel], *, is_whole: bool) -> None:
    """Leave the faults that no channel has alone: a name twice, weights that are all zero."""
    names = [channel.name for channel in channels]
    for name in dict.fromkeys(names):
        if names.count(name) > 1:
            section.add(f"{section.where} has the channel {in_quotes(name)} {names.count(name)} times.", "each channel once")
    if is_whole and not any(channel.weight for channel in channels):
        section.add(f"{section.where}: the weight of every channel is 0.", "at least one above 0, else all frames are alike")
