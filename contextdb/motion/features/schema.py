"""The feature schema: which numbers of a frame a search compares, how often they are sampled, and how much each channel weighs.

A schema is data, read from `[features.NAME]` of contextdb.toml; `contextdb.motion.features.channels` says what each type of
channel holds.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from contextdb.cells.arguments import require_mapping, require_text
from contextdb.cells.notebook import one_line
from contextdb.errors import Fault, SchemaError, in_quotes, mend_for, plural, shown, some
from contextdb.files.toml_shapes import Mapped, Section
from contextdb.files.toml_text import as_toml, what
from contextdb.motion.clips.foot_bones import FootBones, Pair
from contextdb.motion.clips.mirror import Pairs, pattern_fault
from contextdb.motion.clips.poses import Poses
from contextdb.motion.clips.prepared_root import prepared_path
from contextdb.motion.clips.quaternions import Floats
from contextdb.motion.clips.skeleton import Skeleton
from contextdb.motion.clips.trajectory import Trajectory, root_trajectory
from contextdb.motion.features.channels import Channel, What, check_together, is_pair, read_channel, read_pair
from contextdb.motion.features.permutations import ACCEPTED, Permutations, read_permutations

__all__ = ["Channel", "CustomFunction", "FeatureSchema"]

CustomFunction = Callable[[Poses, Trajectory], Floats]
"""Makes the features of a custom channel, [F, size], of a body's poses and its path, both F frames at the schema's rate."""

PathChannels = tuple[tuple[float, ...], tuple[float, ...], tuple[tuple[What | None, slice], ...]]

SCHEMA_KEYS = (
    "rate", "channels", "root", "facing", "facing_smooth_s", "root_smooth_s", "mirror", "feet", "heels", "toes", "permutations",
)  # fmt: skip
MOST_RATE = 1000.0
ABOUT_S = 0.5
"""How fast a path goes is the mean of about so many seconds."""
MOST_SMOOTH_S = 2.0
A_FACING = 'the left and the right bone, such as ["LeftUpLeg", "RightUpLeg"]'
A_FOOT = 'the left and the right bone, such as ["LeftFoot", "RightFoot"]'
A_MIRROR = 'pairs of a left and a right bone, such as [["Left*", "Right*"]]'


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
    facing_smooth_s : float
        Evens out the facing's sway with each step: the standard deviation in seconds of a Gaussian about each frame, which shifts
        nothing in time. Default: 0, the facing as it is.
    root_smooth_s : float
        Above 0, the body's path is made from capture whose hips sway: ahead from the hips, sideways from the feet, heading by hips
        and chest, and this is the standard deviation in seconds of what evens it out. Starts and stops stay when they are.
        Default: 0, the hips as they are.
    mirror : tuple of (left, right)
        Pairs of bones that change places when a clip is mirrored; a `*` on both sides matches the same rest of the name.
    feet, heels, toes : (left bone, right bone), optional
        What touches the ground. Default: feet by their names, the toes below them, and heels worked out from both.
    permutations : Permutations, optional
        How often each clip is searched, and how far ahead its permuted channels look each time. Default: once, and none does.
    functions : mapping of name to function
        What custom channels are computed by. Not compared, and not part of contextdb.toml: see `with_functions`.
    """

    name: str
    rate: float
    channels: tuple[Channel, ...]
    root: str | None = None
    facing: tuple[str, str] | None = None
    facing_smooth_s: float = 0.0
    root_smooth_s: float = 0.0
    mirror: Pairs = ()
    feet: Pair | None = None
    heels: Pair | None = None
    toes: Pair | None = None
    permutations: Permutations | None = None
    functions: Mapping[str, CustomFunction] = field(default_factory=dict, compare=False, repr=False)

    def __repr__(self) -> str:
        sizes = plural(self.n_features, "feature"), plural(len(self.channels), "channel"), f"{self.rate:g} frames a second"
        return one_line("FeatureSchema", self.name, ", ".join(sizes))

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

    @cached_property
    def path_points(self) -> tuple[PathChannels, ...]:
        """Where the trajectory channels look: seconds or metres, and what each channel that looks there says, with its slice."""
        found: dict[tuple[tuple[float, ...], tuple[float, ...]], list[tuple[What | None, slice]]] = {}
        for channel in self.channels:
            if channel.type == "trajectory":
                found.setdefault((channel.at, channel.along), []).append((channel.what, self.slices[channel.name]))
        return tuple((at, along, tuple(channels)) for (at, along), channels in found.items())

    @cached_property
    def speed_features(self) -> tuple[slice, float] | None:
        """Which features say how fast a path goes, and what their length is divided by for metres a second; None where none do."""
        for kind in ("position", "velocity", "speed"):
            size = 1 if kind == "speed" else 2
            points = [
                (seconds, self.slices[channel.name].start + i * size)
                for channel in self.channels
                if channel.type == "trajectory" and channel.what == kind
                for i, seconds in enumerate(channel.at)
                if seconds > 0.0 or kind != "position"
            ]
            if points:
                seconds, start = min(points, key=lambda point: abs(point[0] - ABOUT_S))
                return slice(start, start + size), seconds if kind == "position" else 1.0
        return None

    @cached_property
    def looks_back(self) -> bool:
        """Whether a trajectory channel looks at where the path was."""
        return any(reach < 0.0 for reaches in self.path_reaches for reach in reaches)

    @cached_property
    def path_reaches(self) -> tuple[tuple[float, ...], tuple[float, ...]]:
        """The seconds and the metres at which the trajectory channels look at the path."""
        channels = [channel for channel in self.channels if channel.type == "trajectory"]
        return (
            tuple(second for channel in channels for second in channel.at),
            tuple(metre for channel in channels for metre in channel.along),
        )

    @property
    def permutation_s(self) -> tuple[float, ...]:
        """How many seconds ahead the permuted channels look in each permutation of a clip."""
        return (0.0,) if self.permutations is None else self.permutations.seconds

    @property
    def weights(self) -> Floats:
        """Each channel's weight: float64 [channels]."""
        return np.array([channel.weight for channel in self.channels], np.float64)

    @property
    def bones(self) -> tuple[str, ...]:
        """Every bone that the channels, `root` and `facing` name, once."""
        named = [bone for channel in self.channels for bone in channel.bones] + [self.root]
        named += [bone for pair in (self.facing, self.feet, self.heels, self.toes) for bone in pair or ()]
        return tuple(dict.fromkeys(bone for bone in named if bone is not None))

    def path_of(self, poses: Poses) -> Trajectory:
        """The path of a body; raises MotionError where the skeleton lacks `root` or a bone of `facing`."""
        path = root_trajectory(poses, self.root, self.facing, self.facing_smooth_s)
        if self.root_smooth_s <= 0.0:
            return path
        return prepared_path(poses, path, self.root_smooth_s, self.foot_bones(), is_facing_given=self.facing is not None)

    def foot_bones(self, feet: Pair | None = None) -> FootBones:
        """The declared bones of the feet; with `feet` of these, which then are what touches the ground."""
        return FootBones(self.feet, self.heels, self.toes) if feet in (None, self.feet) else FootBones(feet)

    def bone_faults(self, skeleton: Skeleton) -> list[Fault]:
        """What is wrong with using the schema on a skeleton: a fault for each bone that it lacks, with the nearest one."""
        return [skeleton.missing_bone(bone) for bone in self.bones if bone not in skeleton]

    def with_functions(self, functions: Mapping[str, CustomFunction]) -> FeatureSchema:
        """The same schema with functions for its custom channels, by the names that the channels give.

        A function takes `(poses, path)`: the `Poses` of all frames and the `Trajectory` of the body, at the schema's rate. It gives
        a float array [F, size], for each frame what the frame itself and its neighbours tell; it must not change what it is given.
        It is called on the mirrored poses and path for a mirrored clip, and for a query on those of the query's clip. Raises
        SchemaError where no channel asks for a name; the nearest that one does ask for is reported.
        """
        asked = [channel.function for channel in self.channels if channel.function is not None]
        faults = [_unasked(name, asked, self.name) for name in functions if name not in asked]
        if faults:
            raise SchemaError(*faults)
        return replace(self, functions={**self.functions, **functions})

    @classmethod
    def from_dict(cls, name: str, mapping: Mapped, *, file: str | None = None) -> FeatureSchema:
        """Read what `[features.NAME]` of contextdb.toml holds; `file` is its name in messages. Raises SchemaError with every fault:
        an unknown key, type or word with the nearest known one, a value of the wrong kind, a channel named twice, or weights that
        are all zero."""
        faults: list[Fault] = []
        require_text(name, "name")
        require_mapping(mapping, "mapping", 'a mapping such as {"rate": 30, "channels": [...]}')
        schema = _read_schema(cls, name, mapping, faults, file)
        if faults:
            raise SchemaError(*faults)
        assert schema is not None, "a schema that cannot be read leaves a fault"
        return schema


def _unasked(name: str, asked: list[str], schema: str) -> Fault:
    accepted = some(asked) or 'the name in a channel { type = "custom", function = "…" }'
    return Fault(f"no channel of [features.{schema}] has function = {in_quotes(name)}.", accepted, mend_for(name, asked))


def _read_schema(
    cls: type[FeatureSchema], name: str, mapping: Mapped, faults: list[Fault], file: str | None
) -> FeatureSchema | None:
    section = Section(f"[features.{name}]", mapping, SCHEMA_KEYS, faults, file)
    accepted = f"frames a second, from 1 to {MOST_RATE:g}, such as 30.0"
    rate = section.number("rate", accepted, 1.0, MOST_RATE) if section.has("rate", accepted) else None
    channels = _read_channels(section)
    root = section.text("root", 'a bone, such as "Hips"') if "root" in mapping else None
    facing = read_pair(section, "facing", A_FACING) if "facing" in mapping else None
    facing_s, root_s = (_read_smooth(section, key) if key in mapping else 0.0 for key in ("facing_smooth_s", "root_smooth_s"))
    mirror = _read_mirror(section) if "mirror" in mapping else ()
    feet, heels, toes = (read_pair(section, key, A_FOOT) if key in mapping else None for key in ("feet", "heels", "toes"))
    permutations = read_permutations(section) if "permutations" in mapping else None
    if faults or rate is None or facing_s is None or root_s is None:
        return None
    _check_permuted(section, channels, permutations)
    return cls(name, rate, tuple(channels), root, facing, facing_s, root_s, mirror, feet, heels, toes, permutations)


def _check_permuted(section: Section, channels: list[Channel], permutations: Permutations | None) -> None:
    """Leave a fault where channels look ahead by permutations that there are not, or permutations are all alike."""
    varying = [channel.name for channel in channels if channel.varies]
    if varying and permutations is None:
        section.add(f"{section.where} has the channel {in_quotes(varying[0])}, but no permutations.", f"permutations = {ACCEPTED}")
    if permutations is not None and not varying:
        section.add(
            f"{section.where} has permutations, but no channel looks ahead by them.", "permuted = true in a channel of a bone"
        )


def _read_smooth(section: Section, key: str) -> float | None:
    return section.number(key, f"seconds, from 0 to {MOST_SMOOTH_S:g}, such as 0.2", 0.0, MOST_SMOOTH_S)


def _read_mirror(section: Section) -> Pairs:
    """The pairs of names or patterns; whether a skeleton has the bones is asked when a clip is mirrored."""
    value = section.part["mirror"]
    if not isinstance(value, (list, tuple)) or not value:
        why = "the list is empty" if isinstance(value, (list, tuple)) else f"this is {what(value)}, not a list"
        section.wrong("mirror", why, A_MIRROR)
        return ()
    for i, item in enumerate(value):
        why = pattern_fault(item[0], item[1]) if is_pair(item) else "this is not a pair of different names"
        if why:
            section.add(f"{section.where} mirror pair {i + 1} is {shown(as_toml(item))}: {why}.", A_MIRROR)
    return tuple((item[0], item[1]) for item in value if is_pair(item))


def _read_channels(section: Section) -> list[Channel]:
    accepted = 'a list of channels, such as [{ type = "position", bone = "LeftFoot", weight = 1.0 }]'
    if not section.has("channels", accepted):
        return []
    value = section.part["channels"]
    if not isinstance(value, (list, tuple)) or not value:
        why = "the list is empty" if isinstance(value, (list, tuple)) else f"this is {what(value)}, not a list"
        section.wrong("channels", why, accepted)
        return []
    read = [read_channel(section, i, item) for i, item in enumerate(value)]
    channels = [channel for channel in read if channel is not None]
    check_together(section, channels, is_whole=len(channels) == len(value))
    return channels
