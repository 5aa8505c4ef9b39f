"""The feature schema: which numbers of a frame a search compares, how often they are sampled, and how much each channel weighs.

A schema is data, read from `[features.NAME]` of contextdb.toml; `contextdb.motion.features.channels` says what each type of
channel holds.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, field, fields, replace
from functools import cached_property
from typing import Any

import numpy as np

from contextdb.cells.arguments import require_mapping, require_text
from contextdb.cells.notebook import one_line
from contextdb.core import Ways
from contextdb.errors import Fault, MotionError, SchemaError, in_quotes, mend_for, plural, some
from contextdb.files.settings import Declared, Section, number, setting, settings_of
from contextdb.files.toml_shapes import Mapped, Shape, filled, listed, nothing, what
from contextdb.motion.clips.foot_bones import FootBones, Pair
from contextdb.motion.clips.mirror import Pairs, pattern_fault
from contextdb.motion.clips.poses import Poses
from contextdb.motion.clips.prepared_root import prepared_path
from contextdb.motion.clips.quaternions import Floats
from contextdb.motion.clips.skeleton import Ints, Skeleton
from contextdb.motion.clips.trajectory import Trajectory, root_trajectory
from contextdb.motion.features.channels import (
    ACCEPTED,
    FEET,
    KEYS,
    WHATS,
    Channel,
    Permutations,
    bone_pair,
    check_together,
    is_pair,
    read_channel,
    read_permutations,
)

__all__ = ["Channel", "CustomFunction", "FeatureSchema"]

CustomFunction = Callable[[Poses, Trajectory], Floats]
"""Makes the features of a custom channel, [F, size], of a body's poses and its path, both F frames at the schema's rate."""

MOST_RATE = 1000.0
ABOUT_S = 0.5
"""How fast a path goes is the mean of about so many seconds."""
SEE_FEET = "See [feet](choosing.md#feet-on-the-ground)."
CHANNELS = listed('a list of channels, such as [{ type = "position", bone = "LeftFoot", weight = 1.0 }]', nothing)


def _wrong_pair(value: object) -> str | None:
    """What is wrong with a pair of names or patterns; whether a skeleton has the bones is asked when a clip is mirrored."""
    return pattern_fault(value[0], value[1]) if is_pair(value) else "this is not a pair of different names"


def _wrong_permutations(value: object) -> str | None:
    return None if isinstance(value, (Mapping, Permutations)) else f"this is {what(value)}, not a table"


def _smooth(about: str, **more: Any) -> Any:
    return number(about, 0.0, 0.0, 2.0, "seconds", 0.2, **more)


@dataclass(frozen=True)
class FeatureSchema(Declared, error=MotionError):
    """What a search compares. `functions` compute its custom channels, by name: they are not part of contextdb.toml, see
    `with_functions`.

    Raises
    ------
    MotionError
        A value that is not accepted; all faults together.
    """

    name: str
    rate: float = number(
        "To how many frames a second clips are resampled.", least=1.0, most=MOST_RATE, unit="frames a second", such_as=30.0
    )
    channels: tuple[Channel, ...] = setting(
        CHANNELS, "The channels, each a table.", more="See [features](choosing.md#features-what-is-compared) for their keys."
    )
    root: str | None = setting(
        filled('a bone, such as "Hips"'),
        "The bone whose place on the ground is the body's.",
        None,
        without="the bone above both thighs",
    )
    facing: tuple[str, str] | None = setting(
        bone_pair('["LeftUpLeg", "RightUpLeg"]'),
        "The left and the right bone across whose line the body faces.",
        None,
        without="the pair of bones nearest the root, as a rule the thighs",
    )
    facing_smooth_s: float = _smooth(
        "Evens out the facing's sway with each step: the standard deviation of a Gaussian, which shifts nothing in time."
    )
    root_smooth_s: float = _smooth(
        "Above 0 the body's path is made from hips that sway, and this is the standard deviation of what evens it out.",
        more="See [root motion](preparing.md#root-motion).",
    )
    mirror: Pairs = setting(
        replace(
            listed('pairs of a left and a right bone, such as [["Left*", "Right*"]]', _wrong_pair),
            read=lambda pairs: tuple(map(tuple, pairs)),
        ),
        "Pairs of bones that change places when a clip is mirrored; a `*` on both sides matches the same rest of the name.",
        (),
        more='For example `[["Left*", "Right*"]]`.',
        without="none",
    )
    feet: Pair | None = setting(
        FEET, "The left and the right bone that touch the ground.", None, without="by their names", more=SEE_FEET
    )
    heels: Pair | None = setting(FEET, "The left and the right heel.", None, without="worked out from feet and toes", more=SEE_FEET)
    toes: Pair | None = setting(FEET, "The left and the right toe.", None, without="the bones below the feet", more=SEE_FEET)
    permutations: Permutations | None = setting(
        Shape(ACCEPTED, _wrong_permutations),
        "Each clip is searched `count` times, with its permuted channels `from_s`, `from_s + step_s`, … seconds ahead.",
        None,
        more="See [permutations](choosing.md#a-moment-ahead-permutations).",
        without="once",
    )
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
    def path_features(self) -> tuple[Floats, Ints]:
        """How far the points of the trajectory channels are from a body, seconds or metres [P]; and of each whether it is metres,
        what of it is a feature, and in which column: int64 [P, 3], as the core takes them."""
        steps: list[float] = []
        features: list[tuple[int, int, int]] = []
        for channel in self.channels:
            if channel.type == "trajectory" and channel.what is not None:
                points = [(0, step) for step in channel.at] + [(1, step) for step in channel.along]
                part = self.slices[channel.name]
                size = (part.stop - part.start) // len(points)
                steps += [step for _, step in points]
                features += [(is_along, WHATS.index(channel.what), part.start + i * size) for i, (is_along, _) in enumerate(points)]
        return np.array(steps, np.float64), np.array(features, np.int64).reshape(-1, 3)

    @property
    def velocity_features(self) -> Ints:
        """The features at which the velocities of joints begin that move as the body does: int64."""
        columns = [
            self.slices[channel.name].start + 3 * i
            for channel in self.channels
            if channel.type == "velocity" and channel.relative_to is None
            for i in range(channel.n_features // 3)
        ]
        return np.array(columns, np.int64)

    @cached_property
    def ways(self) -> Ways:
        """How far the paths of characters are looked at, for the core."""
        return Ways(*self.path_features, self.velocity_features, self.n_features, float(self.rate))

    def __getstate__(self) -> dict[str, object]:
        """The fields alone: what is prepared for the core is prepared again where the schema is unpickled or copied."""
        return {each.name: getattr(self, each.name) for each in fields(self)}

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
        names = [channel.function for channel in self.channels if channel.function is not None]
        faults = [_unasked(name, names, self.name) for name in functions if name not in names]
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
        section = Section(f"[features.{name}]", mapping, SCHEMA, faults, file)
        values = section.values(SCHEMA)
        given = values.get("channels", ())
        read = [read_channel(section, i, item) for i, item in enumerate(given)]
        channels = tuple(channel for channel in read if channel is not None)
        check_together(section, channels, is_whole=0 < len(channels) == len(given))
        if "permutations" in values:
            values["permutations"] = read_permutations(section, values["permutations"])
        if not faults:
            _check_permuted(section, channels, values.get("permutations"))
        if faults:
            raise SchemaError(*faults)
        return cls(name, **values | {"channels": channels})


SCHEMA = settings_of(FeatureSchema)
"""The keys of `[features.NAME]`."""


def _unasked(name: str, names: list[str], schema: str) -> Fault:
    accepted = some(names) or 'the name in a channel { type = "custom", function = "…" }'
    return Fault(f"no channel of [features.{schema}] has function = {in_quotes(name)}.", accepted, mend_for(name, names))


def _check_permuted(section: Section, channels: Sequence[Channel], permutations: Permutations | None) -> None:
    """Leave a fault where channels look ahead by permutations that there are not, or permutations are all alike."""
    varying = [channel.name for channel in channels if channel.varies]
    if varying and permutations is None:
        section.add(f"{section.where} has the channel {in_quotes(varying[0])}, but no permutations.", f"permutations = {ACCEPTED}")
    if permutations is not None and not varying:
        section.add(
            f"{section.where} has permutations, but no channel looks ahead by them.", "permuted = true in a channel of a bone"
        )


# ---- a feature schema as plain data, as `[features.NAME]` of contextdb.toml holds it: what `FeatureSchema.from_dict` reads
# back


WEIGHING = ("weight", "group")
"""The keys of a channel that change no feature, only what a difference costs."""


def schema_to_dict(schema: FeatureSchema) -> dict[str, object]:
    """The keys of a schema, and their values as JSON and TOML have them; its name and its functions are not among them."""
    given = {key: _plain(value) for key, value in _given(schema) if key in SCHEMA}
    return {**given, "channels": [_channel_to_dict(channel) for channel in schema.channels]}


def unweighted(schema: FeatureSchema) -> dict[str, object]:
    """The part of a schema that features in raw units depend on."""
    channels = [_channel_to_dict(channel) for channel in schema.channels]
    bare = [{key: value for key, value in channel.items() if key not in WEIGHING} for channel in channels]
    return {**schema_to_dict(schema), "channels": bare}


def _channel_to_dict(channel: Channel) -> dict[str, object]:
    return {key: _plain(value) for key, value in _given(channel) if key in KEYS[channel.type]}


def _given(part: FeatureSchema | Channel) -> Iterator[tuple[str, object]]:
    """The fields that are not left at their default."""
    for each in fields(part):
        value = getattr(part, each.name)
        if value != each.default:
            yield each.name, value


def _plain(value: object) -> object:
    if isinstance(value, Permutations):
        return asdict(value)
    return [_plain(item) for item in value] if isinstance(value, (list, tuple)) else value
