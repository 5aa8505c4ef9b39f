"""What `[output.NAME]` of contextdb.toml says: how what a controller decides becomes poses.

    [output.player]
    root = "mixed"             # who moves the body: "animation", "code", both, or "path": code gives the way, the clip the speed
    position_weight = 1.0      # mixed: how much of the movement comes from the animation, 0 to 1, beside its own root weight
    rotation_weight = 1.0      # and of the turning
    position_pull_s = 0.1      # mixed: half of the way to the game's body is made up for in so many seconds; 0 is no pull
    rotation_pull_s = 0.1
    position_clamp_m = 0.1     # mixed: never farther from the game's body
    rotation_clamp_deg = 90.0
    blend = "spring"           # how a jump is hidden: "spring", "dead", or "none"
    halflife_s = 0.1           # of the spring, for joints and root
    fade_s = 0.5               # dead: how long what was left fades
    fade_halflife_s = 0.1      # dead: how fast it slows down
    path_alignment = true      # hips and legs turn to the way that the game goes, and the chest stays
    alignment_limit_deg = 70.0 # by so much at most
    alignment_halflife_s = 0.15
    min_stride = 0.8           # steps become so many times as long, as far as the play rate does not make up for the speed
    max_stride = 1.25
    foot_lock = true           # feet that are down in the clip stay where they came down
    foot_halflife_s = 0.1      # how fast a foot that was let go comes to the clip
    foot_radius_m = 0.45       # a foot is let go where the clip has it so far away

Reading touches no file.
Source of the defaults: orangeduck/Motion-Matching, `controller.cpp`, and its dead blending demo, whose poses go on for longer.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, fields
from typing import Any, Literal, get_args

from contextdb.cells.arguments import as_number, require_mapping
from contextdb.errors import Fault, MotionError, SchemaError, in_quotes, nearest, some
from contextdb.files.toml_shapes import Mapped, Section
from contextdb.files.toml_text import what

RootMode = Literal["animation", "code", "mixed", "path"]
Blend = Literal["spring", "dead", "none"]
WORDS: dict[str, tuple[str, ...]] = {"root": get_args(RootMode), "blend": get_args(Blend)}
LEAST_HALFLIFE_S = 0.001
NUMBERS = {
    "position_weight": ("a share from 0 to 1", 0.0, 1.0),
    "rotation_weight": ("a share from 0 to 1", 0.0, 1.0),
    "position_pull_s": ("seconds from 0 to 60, such as 0.1; 0 is no pull", 0.0, 60.0),
    "rotation_pull_s": ("seconds from 0 to 60, such as 0.1; 0 is no pull", 0.0, 60.0),
    "position_clamp_m": ("metres from 0 to 1000, such as 0.1", 0.0, 1000.0),
    "rotation_clamp_deg": ("degrees from 0 to 180, such as 90", 0.0, 180.0),
    "halflife_s": ("seconds from 0.001 to 60, such as 0.1", LEAST_HALFLIFE_S, 60.0),
    "fade_s": ("seconds from 0.001 to 60, such as 0.5", LEAST_HALFLIFE_S, 60.0),
    "fade_halflife_s": ("seconds from 0.001 to 60, such as 0.1", LEAST_HALFLIFE_S, 60.0),
    "alignment_limit_deg": ("degrees from 0 to 90, such as 70", 0.0, 90.0),
    "alignment_halflife_s": ("seconds from 0.001 to 60, such as 0.15", LEAST_HALFLIFE_S, 60.0),
    "min_stride": ("a share from 0.1 to 1, such as 0.8; 1 shortens no step", 0.1, 1.0),
    "max_stride": ("a number from 1 to 3, such as 1.25; 1 lengthens no step", 1.0, 3.0),
    "foot_halflife_s": ("seconds from 0.001 to 60, such as 0.1", LEAST_HALFLIFE_S, 60.0),
    "foot_radius_m": ("metres from 0 to 10, such as 0.45", 0.0, 10.0),
}
FLAGS, TRUTH = ("path_alignment", "foot_lock"), "true or false"
KEYS = (*WORDS, *NUMBERS, *FLAGS)


@dataclass(frozen=True, slots=True)
class PoseSettings:
    """How a pose stream goes about it. The clip as it is, and nothing done to it: `PoseSettings(root="animation", blend="none",
    path_alignment=False, min_stride=1, max_stride=1, foot_lock=False)`.

    Attributes
    ----------
    root : "animation", "code", "mixed" or "path"
        Who moves the body: the clip, the game's body, or both, by the weights, the pull and the clamp; or the game says where to,
        and the clip how fast.
    position_weight, rotation_weight : float
        Mixed: how much of the movement and of the turning comes from the animation, beside the root weight of its markup.
    position_pull_s, rotation_pull_s : float
        Mixed and path: the half-life of the distance to the game's body; 0 is no pull. A body that stands is not pulled.
    position_clamp_m, rotation_clamp_deg : float
        Mixed and path: how far from the game's body the character may be.
    blend : "spring", "dead" or "none"
        How a jump is hidden: by an offset that decays, by the pose that was left, which goes on and fades, or not at all.
    halflife_s : float
        Of the spring, for joints and root; dead blending takes it for the root.
    fade_s, fade_halflife_s : float
        Dead blending: how long what was left fades, and how fast it slows down.
    path_alignment : bool
        Whether hips and legs turn to the way that the game's body goes, while the chest stays.
    alignment_limit_deg, alignment_halflife_s : float
        By how much at most, and how fast; strides change as fast.
    min_stride, max_stride : float
        Between which limits steps become shorter or longer, where the clip is faster or slower than the game's body.
    foot_lock : bool
        Whether a foot that is down in the clip stays where it came down.
    foot_halflife_s, foot_radius_m : float
        How fast a foot that was let go comes to the clip's place, and how far from that it is let go.

    Raises
    ------
    MotionError
        A word or number that is not accepted; all faults together.
    """

    root: RootMode = "mixed"
    position_weight: float = 1.0
    rotation_weight: float = 1.0
    position_pull_s: float = 0.1
    rotation_pull_s: float = 0.1
    position_clamp_m: float = 0.1
    rotation_clamp_deg: float = 90.0
    blend: Blend = "spring"
    halflife_s: float = 0.1
    fade_s: float = 0.5
    fade_halflife_s: float = 0.1
    path_alignment: bool = True
    alignment_limit_deg: float = 70.0
    alignment_halflife_s: float = 0.15
    min_stride: float = 0.8
    max_stride: float = 1.25
    foot_lock: bool = True
    foot_halflife_s: float = 0.1
    foot_radius_m: float = 0.45

    def __post_init__(self) -> None:
        if faults := list(_faults({field.name: getattr(self, field.name) for field in fields(self)})):
            raise MotionError(*faults)

    @property
    def is_warping(self) -> bool:
        """Whether a body is bent to the way that the game goes."""
        return self.root != "animation" and (self.path_alignment or self.min_stride < 1.0 or self.max_stride > 1.0)

    @classmethod
    def from_dict(cls, mapping: Mapped, *, name: str = "player", file: str | None = None) -> PoseSettings:
        """Read the keys of one `[output.NAME]`; what is not there is as by default. Raises SchemaError with every fault; `file` is
        the name of the file in messages; ContextError where `mapping` is none."""
        faults: list[Fault] = []
        part: Mapping[str, object] = require_mapping(mapping, "mapping", "what [output.NAME] says")
        section = Section(f"[output.{name}]", part, KEYS, faults, file)
        said: dict[str, Any] = {key: section.one_of(key, WORDS[key], "word") for key in WORDS if key in part}
        said |= {key: section.number(key, *NUMBERS[key]) for key in NUMBERS if key in part}
        said |= {key: section.flag(key) for key in FLAGS if key in part}
        if faults:
            raise SchemaError(*faults)
        return cls(**said)


def _faults(said: Mapping[str, object]) -> Iterator[Fault]:
    """What is wrong with settings made in Python."""
    for key, words in WORDS.items():
        value = said[key]
        if value not in words:
            near = nearest(value, words) if isinstance(value, str) else ""
            found = f"{key} is {in_quotes(value) if isinstance(value, str) else what(value)}."
            yield Fault(found, some(words), in_quotes(near) if near else "")
    yield from (Fault(f"{key} is {said[key]!r}.", TRUTH) for key in FLAGS if not isinstance(said[key], bool))
    for key, (accepted, least, most) in NUMBERS.items():
        number = as_number(said[key])
        if number is None or not least <= number <= most:
            yield Fault(f"{key} is {said[key]!r}.", accepted)
