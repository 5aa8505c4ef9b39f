"""What `[databases.NAME]` of contextdb.toml says: which clips a database holds, by which features, and what its frames cost.

    [databases.jog]
    table = "locomotion"                 # the rows whose assets it holds; default: all clips
    clips = "clips/jog/*.bvh"
    features = "loco"
    metres_per_unit = 0.01               # what the files leave open
    up = "y"
    rig = "clips/idle.bvh"               # clips of other bodies are put on the bones and lengths of this one
    rig_bones = { Pelvis = "Hips" }      # for bones of the rig those of clips that name them otherwise
    rig_metres_per_unit = 0.01           # of the rig, where its unit is not that of the clips
    mirror = true                        # each clip a second time, left and right exchanged
    markup = "clips/marks.csv"
    base_bias = 0.0                      # added to the cost of every frame
    looping_bias = -0.01                 # of frames of looping ranges
    continuing_bias = -0.1               # of the frame that would play on
    end_s = 0.3                          # so near its end a range that does not loop cannot be entered
    weights = { "Hips velocity" = 2.0 }  # instead of the channel's own
    roles = ["Tackler", "Carrier"]       # clips are named ASSET.ROLE, and those of one asset play together
    place_weight = 1.0                   # of where roles see each other
    facing_weight = 1.0                  # of which way they see each other face

Reading touches no file.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import PureWindowsPath
from typing import Any

from contextdb.errors import Fault, some
from contextdb.files.toml_shapes import Mapped, Section
from contextdb.files.toml_text import as_toml, what
from contextdb.motion.clips.clip import CENTIMETRE, UPS, Up
from contextdb.motion.features.channels import MOST_WEIGHT
from contextdb.motion.features.schema import FeatureSchema
from contextdb.motion.joint.database import divided, role_fault

JOINT_KEYS = ("roles", "place_weight", "facing_weight")
"""What says how a database is searched for several characters at once; the database itself is the same without."""
RIG_KEYS = ("rig", "rig_bones", "rig_metres_per_unit")
"""What says on which body clips are put."""
KEYS = (
    "table",
    "clips",
    "features",
    "metres_per_unit",
    "up",
    "mirror",
    "markup",
    "base_bias",
    "looping_bias",
    "continuing_bias",
    "end_s",
    "weights",
    *RIG_KEYS,
    *JOINT_KEYS,
)
LOOPING_BIAS, CONTINUING_BIAS = -0.01, -0.1
"""Measured on captured and on made clips: the smallest with which a character who walks straight on stays in his clip, and turns,
starts and stops as soon as without."""
END_S = 0.3
"""Seconds before the end of a range in which entering it is pointless, unless the settings say otherwise."""

CLIPS = 'a pattern of files in the folder of contextdb.toml or below it, such as "clips/*.bvh"'
RIG = 'a BVH file in the folder of contextdb.toml or below it, such as "clips/idle.bvh"'
RIG_BONES = '{ "BONE OF THE RIG" = "BONE OF THE CLIPS" }'
METRES = "metres, such as 0.01", 1e-9, 1e9
MARKUP = 'a file in the folder of contextdb.toml or below it, such as "clips/marks.csv"'
ROLES = 'two names or more, each once and without a dot, such as ["Tackler", "Carrier"]'
WEIGHT = f"a weight from 0 to {MOST_WEIGHT:g}, such as 1.0"
MOST_BIAS = 1e30
NUMBERS = {
    "metres_per_unit": METRES,
    "rig_metres_per_unit": METRES,
    "base_bias": ("a cost, such as 0.5", -MOST_BIAS, MOST_BIAS),
    "looping_bias": ("a cost, such as -0.01", -MOST_BIAS, MOST_BIAS),
    "continuing_bias": ("a cost, such as -0.1", -MOST_BIAS, MOST_BIAS),
    "end_s": ("seconds from 0 to 60, such as 0.3", 0.0, 60.0),
    "place_weight": (WEIGHT, 0.0, MOST_WEIGHT),
    "facing_weight": (WEIGHT, 0.0, MOST_WEIGHT),
}


@dataclass(frozen=True)
class DatabaseSettings:
    """What `[databases.NAME]` says.

    Attributes
    ----------
    name : str
    clips : str
        A pattern of files below the folder of contextdb.toml, such as "clips/jog/*.bvh".
    features : str
        The name of a feature schema.
    table : str, optional
        The table whose assets it holds: other clips are left out. Default: all clips of the pattern.
    metres_per_unit, up
        What the clips' files leave open; see `load_bvh`.
    mirror : bool
        Whether each clip has a second range, mirrored.
    markup : str, optional
        A CSV file below the folder of contextdb.toml; see `Markup`.
    base_bias, looping_bias, continuing_bias : float
        See `Biases`.
    end_s : float
        Frames in the last seconds of a range that does not loop cannot be entered.
    weights : mapping of str to float
        By the name of a channel: its weight in this database.
    roles : tuple of str
        Of clips that were recorded together, which are named ASSET.ROLE; empty for others. See `JointDatabase`.
    place_weight, facing_weight : float
        Of what these roles see of each other.
    rig : str, optional
        A BVH file below the folder of contextdb.toml: clips of other bodies are put on its bones and lengths; see `retargeted`.
    rig_bones : mapping of str to str
        For bones of the rig those of clips that name them otherwise.
    rig_metres_per_unit : float, optional
        Of the rig. Default: `metres_per_unit`.
    """

    name: str
    clips: str
    features: str
    table: str | None = None
    metres_per_unit: float = CENTIMETRE
    up: Up = "y"
    mirror: bool = False
    markup: str | None = None
    base_bias: float = 0.0
    looping_bias: float = LOOPING_BIAS
    continuing_bias: float = CONTINUING_BIAS
    end_s: float = END_S
    weights: Mapping[str, float] = field(default_factory=dict)
    roles: tuple[str, ...] = ()
    place_weight: float = 1.0
    facing_weight: float = 1.0
    rig: str | None = None
    rig_bones: Mapping[str, str] = field(default_factory=dict)
    rig_metres_per_unit: float | None = None

    def asset_of(self, clip: str) -> str:
        """The asset of a clip of this name: that of its role, or the name itself."""
        return divided(clip, self.roles)[0] if self.roles else clip


def read_databases(
    parts: Mapping[str, Mapped],
    features: Collection[str],
    schemas: Mapping[str, FeatureSchema],
    tables: Collection[str] | None,
    faults: list[Fault],
    file: str | None,
) -> Iterator[DatabaseSettings]:
    """The settings of each part without a fault; the faults of the others are kept.

    `features` are the names of all feature schemas, `schemas` those that could be read.
    """
    for name, part in parts.items():
        section = Section(f"[databases.{name}]", part, KEYS, faults, file)
        n_faults = len(faults)
        values = dict(_values(section, list(features), tables))
        if "weights" in part:
            values["weights"] = _read_weights(section, schemas.get(str(values.get("features"))))
        if len(faults) == n_faults:
            yield DatabaseSettings(name, **values)


def _values(section: Section, features: list[str], tables: Collection[str] | None) -> Iterator[tuple[str, Any]]:
    """Every key but the weights, with its value or None."""
    part = section.part
    if section.has("clips", CLIPS):
        yield "clips", _read_path(section, "clips", ".bvh", "these are not BVH files", CLIPS)
    if section.has("features", some(features) or "the name of a [features.NAME]"):
        yield "features", section.one_of("features", features, "feature schema")
    if "table" in part:
        is_known = tables is not None
        yield "table", section.one_of("table", list(tables or ()), "table") if is_known else section.text("table", "a table's name")
    if "up" in part:
        yield "up", section.one_of("up", UPS, "axis")
    if "mirror" in part:
        yield "mirror", section.flag("mirror")
    if "roles" in part:
        yield "roles", _read_roles(section)
    if "rig" in part:
        yield "rig", _read_path(section, "rig", ".bvh", "this is not a BVH file", RIG)
    for key in RIG_KEYS[1:] if "rig" not in part else ():
        if key in part:
            section.wrong(key, "there is no rig that it could be about", f"rig = {RIG}")
    if "rig_bones" in part:
        yield "rig_bones", _read_bones(section)
    if "markup" in part:
        yield "markup", _read_path(section, "markup", ".csv", "this is not a CSV file", MARKUP)
    for key, (accepted, least, most) in NUMBERS.items():
        if key in part:
            yield key, section.number(key, accepted, least, most)


def _read_path(section: Section, key: str, suffix: str, why: str, accepted: str) -> str | None:
    """A path, or a pattern of paths, below the folder of contextdb.toml."""
    text = section.text(key, accepted)
    if text is None:
        return None
    windows = PureWindowsPath(text)
    inside = "/".join(part for part in windows.parts if part not in ("..", windows.anchor))
    mend = f"{key} = {as_toml(inside)}" if inside.casefold().endswith(suffix) and inside != text else ""
    if windows.drive or windows.root or ".." in windows.parts or "\\" in text:
        section.wrong(key, "this leaves the folder, or is a place on one machine", accepted, mend)
    elif windows.suffix.casefold() != suffix:
        section.wrong(key, why, accepted)
    else:
        return text
    return None


def _read_roles(section: Section) -> tuple[str, ...] | None:
    value = section.part["roles"]
    listed = value if isinstance(value, (list, tuple)) else ()
    if all(isinstance(role, str) for role in listed) and not role_fault(listed):
        return tuple(listed)
    section.wrong("roles", "these are not roles of clips that play together", ROLES)
    return None


def _read_bones(section: Section) -> dict[str, str] | None:
    value = section.part["rig_bones"]
    if isinstance(value, Mapping) and all(isinstance(bone, str) for pair in value.items() for bone in pair):
        return dict(value)
    section.wrong("rig_bones", "these are not names of bones", RIG_BONES)
    return None


def _read_weights(section: Section, schema: FeatureSchema | None) -> dict[str, float] | None:
    """Weights by the names of channels; without a schema the names are not looked at, as its own faults are reported already."""
    value = section.part["weights"]
    if not isinstance(value, Mapping):
        section.wrong("weights", f"this is {what(value)}, not a table", '{ "NAME OF A CHANNEL" = 2.0 }')
        return None
    names = list(value) if schema is None else [channel.name for channel in schema.channels]
    inner = section.inside("weights", value, names)
    accepted = f"from 0 to {MOST_WEIGHT:g}, such as 2.0"
    read = {name: inner.number(name, accepted, 0.0, MOST_WEIGHT) for name in value if name in names}
    weights = {name: weight for name, weight in read.items() if weight is not None}
    if schema is not None and not any(weights.get(channel.name, channel.weight) for channel in schema.channels):
        section.add(
            f"{section.where} weights: the weight of every channel is 0.", "at least one above 0, else all frames are alike"
        )
    return weights
