"""The feature schema: which numbers of a frame a search compares, how often they are sampled, and how much each channel weighs.

A schema is data, read from `[features.NAME]` of contextdb.toml. Each channel is a block of features in the body's own frame, whose
origin is the body's place on the ground and which looks where the body faces: metres to the left, up, ahead.

    type          features   of
    position      3          a bone, m
    velocity      3          a bone, m/s over the ground, not less the body's own
    trajectory    2 a point  what = "position" (m: left, ahead), "direction" (unit vector of the facing), "velocity" (m/s)
                  1 a point  what = "speed" (m/s)

Points of a trajectory stand `at` seconds after the frame or `along` metres further on the path; negative ones before and behind.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Literal, cast

import numpy as np

from contextdb.errors import Fault, SchemaError, in_quotes
from contextdb.motion.quaternions import Floats
from contextdb.motion.reading import Mapped, Section, as_toml, what_is
from contextdb.motion.skeleton import Skeleton

ChannelType = Literal["position", "velocity", "trajectory"]
What = Literal["position", "direction", "velocity", "speed"]

TYPES = ("position", "velocity", "trajectory")
WHATS = ("position", "direction", "velocity", "speed")
KEYS = {
    "position": ("type", "bone", "weight", "group"),
    "velocity": ("type", "bone", "weight", "group"),
    "trajectory": ("type", "what", "at", "along", "weight", "group"),
}
ANY_KEY = ("type", "bone", "what", "at", "along", "weight", "group")
SCHEMA_KEYS = ("rate", "channels", "root", "facing")
TYPE_SYNONYMS = {"pos": "position", "vel": "velocity", "traj": "trajectory", "path": "trajectory"}
WHAT_SYNONYMS = {"facing": "direction", "heading": "direction", "dir": "direction", "pos": "position", "vel": "velocity"}

MOST_WEIGHT = 1e6
MOST_RATE = 1000.0
MOST_SECONDS = 60.0
MOST_METRES = 1000.0
BODY_AXES = ("left", "up", "ahead")
GROUND_AXES = ("left", "ahead")


@dataclass(frozen=True)
class Channel:
    """A block of features that are weighed together.

    Attributes
    ----------
    type : "position", "velocity" or "trajectory"
    weight : float
        Multiplies the squared differences of this channel's normalised features.
    bone : str, optional
        Whose position or velocity.
    what : "position", "direction", "velocity" or "speed", optional
        What of a trajectory.
    at : tuple of float
        Seconds after the frame, for a trajectory sampled by time.
    along : tuple of float
        Metres along the path, for a trajectory sampled by distance.
    group : str, optional
        Channels of one group share a scale of normalisation. Default: each its own.
    """

    type: ChannelType
    weight: float = 1.0
    bone: str | None = None
    what: What | None = None
    at: tuple[float, ...] = ()
    along: tuple[float, ...] = ()
    group: str | None = None

    @property
    def name(self) -> str:
        """What the channel is called in costs and messages; unique in a schema."""
        if self.type != "trajectory":
            return f"{self.bone} {self.type}"
        points = " ".join(f"{point:g}" for point in self.at or self.along)
        return f"trajectory {self.what} {'at' if self.at else 'along'} {points} {'s' if self.at else 'm'}"

    @property
    def feature_names(self) -> tuple[str, ...]:
        """The names of its features, in order."""
        if self.type != "trajectory":
            return tuple(f"{self.name} {axis}" for axis in BODY_AXES)
        axes = ("",) if self.what == "speed" else tuple(f" {axis}" for axis in GROUND_AXES)
        points = [f"at {seconds:g} s" for seconds in self.at] + [f"along {metres:g} m" for metres in self.along]
        return tuple(f"trajectory {self.what} {point}{axis}" for point in points for axis in axes)

    @property
    def n_features(self) -> int:
        """How many features it has."""
        return len(self.feature_names)


@dataclass(frozen=True)
class FeatureSchema:
    """What a search compares.

    Attributes
    ----------
    name : str
    rate : float
        Frames a second: clips are resampled to it.
    channels : tuple of Channel
    root : str, optional
        The bone whose place on the ground is the body's. Default: the one above both thighs.
    facing : (left bone, right bone), optional
        The body faces across the line between them. Default: the sided pair of bones nearest the root, as a rule the thighs.
    """

    name: str
    rate: float
    channels: tuple[Channel, ...]
    root: str | None = None
    facing: tuple[str, str] | None = None

    @cached_property
    def feature_names(self) -> tuple[str, ...]:
        """The name of each feature, in order."""
        return tuple(name for channel in self.channels for name in channel.feature_names)

    @property
    def n_features(self) -> int:
        """How many features a frame has."""
        return len(self.feature_names)

    @cached_property
    def slices(self) -> dict[str, slice]:
        """Where each channel's features stand."""
        stops = np.cumsum([channel.n_features for channel in self.channels]).tolist()
        return {channel.name: slice(stop - channel.n_features, stop) for channel, stop in zip(self.channels, stops, strict=True)}

    @property
    def weights(self) -> Floats:
        """Each channel's weight: float64 [channels]."""
        return np.array([channel.weight for channel in self.channels], np.float64)

    @property
    def bones(self) -> tuple[str, ...]:
        """Every bone that the schema names, once."""
        named = [channel.bone for channel in self.channels] + [self.root, *(self.facing or ())]
        return tuple(dict.fromkeys(bone for bone in named if bone is not None))

    def bone_faults(self, skeleton: Skeleton) -> list[Fault]:
        """What is wrong with using the schema on a skeleton: a fault for each bone that it lacks, with the nearest one."""
        return [skeleton.missing_bone(bone) for bone in self.bones if bone not in skeleton]

    @classmethod
    def from_dict(cls, name: str, mapping: Mapped, *, file: str | None = None) -> FeatureSchema:
        """Read what `[features.NAME]` of contextdb.toml holds; `file` is its name in messages.

        Raises
        ------
        SchemaError
            With every fault: an unknown key, type or word with the nearest known one, a value of the wrong kind, a channel named
            twice, or weights that are all zero.
        """
        faults: list[Fault] = []
        schema = _read_schema(cls, name, mapping, faults, file)
        if faults:
            raise SchemaError(*faults)
        assert schema is not None, "a schema that cannot be read leaves a fault"
        return schema


def _read_schema(
    cls: type[FeatureSchema], name: str, mapping: Mapped, faults: list[Fault], file: str | None
) -> FeatureSchema | None:
    section = Section(f"[features.{name}]", mapping, SCHEMA_KEYS, faults, file)
    rate = _read_rate(section)
    channels = _read_channels(section)
    root = section.text("root", 'a bone, such as "Hips"') if "root" in mapping else None
    facing = _read_facing(section) if "facing" in mapping else None
    if faults or rate is None:
        return None
    return cls(name, rate, tuple(channels), root, facing)


def _read_rate(section: Section) -> float | None:
    accepted = f"frames a second, from 1 to {MOST_RATE:g}, such as 30.0"
    return section.number("rate", accepted, 1.0, MOST_RATE) if section.has("rate", accepted) else None


def _read_facing(section: Section) -> tuple[str, str] | None:
    value = section.part["facing"]
    if (
        isinstance(value, (list, tuple))
        and len(value) == 2
        and all(isinstance(bone, str) and bone for bone in value)
        and value[0] != value[1]
    ):
        return value[0], value[1]
    section.wrong("facing", "this is no pair of bones", 'the left and the right bone, such as ["LeftUpLeg", "RightUpLeg"]')
    return None


def _read_channels(section: Section) -> list[Channel]:
    accepted = 'a list of channels, such as [{ type = "position", bone = "LeftFoot", weight = 1.0 }]'
    if not section.has("channels", accepted):
        return []
    value = section.part["channels"]
    if not isinstance(value, (list, tuple)) or not value:
        why = "the list is empty" if isinstance(value, (list, tuple)) else f"this is {what_is(value)}, not a list"
        section.wrong("channels", why, accepted)
        return []
    read = [_read_channel(section, i, item) for i, item in enumerate(value)]
    channels = [channel for channel in read if channel is not None]
    _check_together(section, channels, is_whole=len(channels) == len(value))
    return channels


def _read_channel(section: Section, i: int, item: object) -> Channel | None:
    where = f"{section.where} channel {i + 1}"
    if not isinstance(item, Mapping):
        section.add(
            f"{where} is {as_toml(item)}: this is {what_is(item)}, not a table.", '{ type = "position", bone = "LeftFoot" }'
        )
        return None
    n_faults = len(section.faults)
    kind = item.get("type")
    part = Section(where, item, KEYS.get(kind, ANY_KEY) if isinstance(kind, str) else ANY_KEY, section.faults, section.file)
    known = (
        part.one_of("type", TYPES, "type", TYPE_SYNONYMS) if part.has("type", '"position", "velocity" or "trajectory"') else None
    )
    channel = _trajectory_channel(part) if known == "trajectory" else _bone_channel(part, known)
    return channel if len(section.faults) == n_faults else None


def _bone_channel(part: Section, kind: str | None) -> Channel | None:
    weight, group = _read_weight(part), _read_group(part)
    accepted = 'a bone of the clips, such as "LeftFoot"'
    bone = part.text("bone", accepted) if kind and part.has("bone", accepted) else None
    return None if bone is None or weight is None else Channel(cast(ChannelType, kind), weight, bone, group=group)


def _trajectory_channel(part: Section) -> Channel | None:
    weight, group = _read_weight(part), _read_group(part)
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
    at = _read_points(part, "at", f"seconds, at most {MOST_SECONDS:g} away, such as [0.33, 0.67, 1.0]", MOST_SECONDS)
    along = _read_points(
        part, "along", f"metres along the path, at most {MOST_METRES:g} away, such as [0.5, 1.0, 2.0]", MOST_METRES
    )
    if weight is None or what is None or at is None or along is None:
        return None
    return Channel("trajectory", weight, None, cast(What, what), at, along, group)


def _read_points(part: Section, key: str, accepted: str, most: float) -> tuple[float, ...] | None:
    return part.numbers(key, accepted, most) if key in part.part else ()


def _read_weight(part: Section) -> float | None:
    return part.number("weight", f"from 0 to {MOST_WEIGHT:g}, such as 1.0", 0.0, MOST_WEIGHT) if "weight" in part.part else 1.0


def _read_group(part: Section) -> str | None:
    return part.text("group", 'a name, such as "feet"') if "group" in part.part else None


def _check_together(section: Section, channels: Sequence[Channel], *, is_whole: bool) -> None:
    """Faults that no channel has alone."""
    names = [channel.name for channel in channels]
    for name in dict.fromkeys(names):
        if names.count(name) > 1:
            section.add(f"{section.where} has the channel {in_quotes(name)} {names.count(name)} times.", "each channel once")
    if is_whole and not any(channel.weight for channel in channels):
        section.add(f"{section.where}: the weight of every channel is 0.", "at least one above 0, else all frames are alike")
