"""What `[databases.NAME]` of contextdb.toml says: which clips a database holds, by which features, and what its frames cost.

Reading touches no file.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping
from dataclasses import dataclass

from contextdb.errors import Fault, MotionError
from contextdb.files.settings import Declared, Section, Setting, flag, number, setting, settings_of, word
from contextdb.files.toml_shapes import Mapped, Shape, any_table, between, file_below, filled, one_of
from contextdb.motion.clips.clip import BY_SIZE, CENTIMETRE, UPS, Unit, Up
from contextdb.motion.clips.source import ENDINGS
from contextdb.motion.features.channels import MOST_WEIGHT
from contextdb.motion.features.schema import FeatureSchema
from contextdb.motion.joint.database import divided, role_fault

JOINT_KEYS = ("roles", "place_weight", "facing_weight")
"""What says how a database is searched for several characters at once; the database itself is the same without."""
RIG_KEYS = ("rig", "rig_bones", "rig_metres_per_unit", "rig_pose")
"""What says on which body clips are put."""
LOOPING_BIAS, CONTINUING_BIAS = -0.01, -0.1
"""Measured on captured and on made clips: the smallest with which a character who walks straight on stays in his clip, and turns,
starts and stops as soon as without."""
END_S = 0.6
"""Seconds before the end of a range in which entering it is pointless, unless the settings say otherwise: of 0.3, 0.6 and 0.8 the
least with which circles and eights jump at most once a second on random halves of captured clips."""

ROOTS = ("clip", "feet")
RIG = file_below("a file of clips", "file of clips", ENDINGS, '"clips/idle.bvh"')
WEIGHT = between("a weight", 0.0, MOST_WEIGHT, 2.0)
METRES = between("metres", 1e-9, 1e9, 0.01)
UNIT = Shape(
    f'{METRES.accepted}; "size" for that in which a body is of a usual size',
    lambda value: None if isinstance(value, str) and value == BY_SIZE else METRES.wrong(value),
    METRES.meant,
    lambda value: value if isinstance(value, str) else float(value),
    METRES.bounds,
)
WEIGHTS = '{ "NAME OF A CHANNEL" = 2.0 }'


def _wrong_roles(value: object) -> str | None:
    listed = value if isinstance(value, (list, tuple)) else ()
    is_good = all(isinstance(role, str) for role in listed) and not role_fault(listed)
    return None if is_good else "these are not roles of clips that play together"


def _wrong_bones(value: object) -> str | None:
    is_good = isinstance(value, Mapping) and all(isinstance(bone, str) for pair in value.items() for bone in pair)
    return None if is_good else "these are not names of bones"


@dataclass(frozen=True)
class DatabaseSettings(Declared, error=MotionError):
    """What `[databases.NAME]` says.

    Raises
    ------
    MotionError
        A setting that is not accepted; all faults together.
    """

    name: str
    clips: str = setting(
        file_below("a pattern of files", "file of clips", ENDINGS, '"clips/*.bvh"'),
        "A pattern of files of clips below the folder of contextdb.toml.",
        more='In several formats: `"clips/**/*.{bvh,fbx,glb}"`; see [formats of clips](choosing.md#formats-of-clips).',
    )
    features: str = setting(filled("the name of a [features.NAME]"), "The name of a feature schema.")
    table: str | None = setting(
        filled("the name of a table"),
        "Clips that are not assets of this table are left out.",
        None,
        without="all clips of the pattern",
    )
    metres_per_unit: Unit = setting(
        UNIT,
        "The unit of BVH clips, whose format does not define it.",
        CENTIMETRE,
        more='`"size"` takes for each clip the unit in which its body is of a usual size.',
    )
    up: Up = word(UPS, "The axis of BVH clips that points up, which their format does not define.", "y", "axis")
    mirror: bool = flag(
        "Whether each clip is added a second time, left and right exchanged by the pairs of its features.",
        False,
        more="Its validity then depends on [mirrored facts](choosing.md#facts-in-a-mirror).",
    )
    markup: str | None = setting(
        file_below("a file", "CSV file", (".csv",), '"clips/marks.csv"'),
        "A CSV file of marks on frames, below the folder of contextdb.toml.",
        None,
        more="See [markup](choosing.md#markup-which-frames-may-be-used-and-how).",
        without="none",
    )
    base_bias: float = number("Added to the cost of every frame.", 0.0, unit="a cost", such_as=0.5)
    looping_bias: float = number("Added to the cost of frames of looping clips.", LOOPING_BIAS, unit="a cost")
    continuing_bias: float = number("Added to the cost of the frame that would play next.", CONTINUING_BIAS, unit="a cost")
    end_s: float = number("So near its end a clip that does not loop cannot be entered.", END_S, 0.0, 60.0, "seconds")
    weights: Mapping[str, float] = setting(
        any_table(WEIGHTS), "Weights of channels in this database, by the name of the channel.", {}, without="those of the channels"
    )
    roles: tuple[str, ...] = setting(
        Shape('two names or more, each once and without a dot, such as ["Tackler", "Carrier"]', _wrong_roles, read=tuple),
        "Clips are named `ASSET.ROLE.bvh`, and those of one asset play together.",
        (),
        more='See [joint clips](motion.md#several-characters-at-once): `["Tackler", "Carrier"]`.',
        without="none",
    )
    place_weight: float = number("The weight of where roles see each other.", 1.0, 0.0, MOST_WEIGHT, "a weight")
    facing_weight: float = number("The weight of which way roles see each other face.", 1.0, 0.0, MOST_WEIGHT, "a weight")
    rig: str | None = setting(
        RIG,
        "Clips of other bodies are put on the bones and lengths of this file when they are built.",
        None,
        more="See [another rig](preparing.md#another-rig).",
        without="none",
    )
    rig_bones: Mapping[str, str] = setting(
        Shape('{ "BONE OF THE RIG" = "BONE OF THE CLIPS" }', _wrong_bones, read=dict),
        "For bones of the rig, their other names in clips.",
        {},
        more='For example `{ Hips = "Pelvis" }`.',
        without="none",
    )
    rig_metres_per_unit: float | None = setting(METRES, "The unit of the rig's file.", None, without="`metres_per_unit`")
    rig_pose: str | None = setting(
        file_below("a pattern of files", "file of clips", ENDINGS, '"poses/*.bvh"'),
        "Files whose first frames show one pose, of the rig and of other bodies that do not rest as it does.",
        None,
        more="A T of each, where one rests as a T and another as an A.",
        without="all bodies rest alike",
    )
    root: str = word(
        ROOTS,
        "Where a clip that runs on the spot has its motion from: from itself, so that it stays, or from its standing feet.",
        "clip",
        "source of motion",
    )

    def asset_of(self, clip: str) -> str:
        """The asset of a clip of this name: that of its role, or the name itself."""
        return divided(clip, self.roles)[0] if self.roles else clip


DATABASE = settings_of(DatabaseSettings)
"""The keys of `[databases.NAME]`."""


def read_databases(
    parts: Mapping[str, Mapped],
    features: Collection[str],
    schemas: Mapping[str, FeatureSchema],
    tables: Collection[str] | None,
    faults: list[Fault],
    file: str | None,
) -> Iterator[DatabaseSettings]:
    """The settings of each part without a fault; the faults of the others are collected.

    `features` are the names of all feature schemas, `schemas` those that could be read.
    """
    names = {"features": one_of(list(features), "feature schema")}
    if tables is not None:
        names["table"] = one_of(list(tables), "table")
    for name, part in parts.items():
        section = Section(f"[databases.{name}]", part, DATABASE, faults, file)
        n_faults = len(faults)
        values = section.values(DATABASE, **names)
        for key in RIG_KEYS[1:] if "rig" not in part else ():
            if key in part:
                section.wrong(key, "there is no rig that it could be about", f"rig = {RIG.accepted}")
        if "weights" in values:
            values["weights"] = _read_weights(section, values["weights"], schemas.get(str(values.get("features"))))
        if len(faults) == n_faults:
            yield DatabaseSettings(name, **values)


def _read_weights(section: Section, value: Mapped, schema: FeatureSchema | None) -> dict[str, float]:
    """Weights by the names of channels; without a schema the names are not looked at, as its own faults are reported already."""
    names = list(value) if schema is None else [channel.name for channel in schema.channels]
    keys = {name: Setting(WEIGHT, "", None) for name in names}
    weights: dict[str, float] = section.inside("weights", value, keys).values(keys)
    if schema is not None and not any(weights.get(channel.name, channel.weight) for channel in schema.channels):
        section.add(
            f"{section.where} weights: the weight of every channel is 0.", "at least one above 0, else all frames are alike"
        )
    return weights
