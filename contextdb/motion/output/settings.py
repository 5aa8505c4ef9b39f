"""What `[output.NAME]` of contextdb.toml says: how what a controller decides becomes poses.

Reading touches no file.
Source of the defaults: orangeduck/Motion-Matching, `controller.cpp`.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Literal, get_args

from contextdb.cells.arguments import require_mapping
from contextdb.errors import Fault, MotionError, SchemaError
from contextdb.files.settings import Declared, Section, flag, number, settings_of, word
from contextdb.files.toml_shapes import Mapped

RootMode = Literal["animation", "code", "mixed", "path"]
Blend = Literal["spring", "none"]
LEAST_HALFLIFE_S = 0.001


def _halflife(about: str, default: float) -> Any:
    return number(about, default, LEAST_HALFLIFE_S, 60.0, "seconds")


def _pull(about: str, default: float) -> Any:
    return number(f"{about} A body that stands is not pulled.", default, 0.0, 60.0, "seconds", note="0 is no pull")


@dataclass(frozen=True, slots=True)
class PoseSettings(Declared, error=MotionError):
    """How a pose stream goes about it. The clip as it is, and nothing done to it: `PoseSettings(root="animation", blend="none",
    path_alignment=False, min_stride=1, max_stride=1, foot_lock=False)`.

    Raises
    ------
    MotionError
        A word or number that is not accepted; all faults together.
    """

    root: RootMode = word(
        get_args(RootMode),
        'What moves the body: the clip ("animation"), the game ("code"), both, by weights, pull and clamp ("mixed"), or '
        'the game says where to and the clip how fast ("path").',
        "mixed",
    )
    position_weight: float = number(
        "Mixed: the share of the movement that comes from the animation, times the root weight of its markup.",
        1.0,
        0.0,
        1.0,
        "a share",
    )
    rotation_weight: float = number("Mixed: the share of the turning that comes from the animation.", 1.0, 0.0, 1.0, "a share")
    position_pull_s: float = _pull("Mixed and path: the time in which half of the distance to the game's body is made up.", 0.1)
    rotation_pull_s: float = _pull("Mixed and path: the time in which half of the turn to the game's body is made up.", 0.08)
    position_clamp_m: float = number(
        "Mixed and path: how far from the game's body the character may be.", 0.1, 0.0, 1000.0, "metres"
    )
    rotation_clamp_deg: float = number(
        "Mixed and path: how far from the game's body the character may be turned.", 90.0, 0.0, 180.0, "degrees"
    )
    blend: Blend = word(
        get_args(Blend),
        'How a jump is hidden: by an offset that decays ("spring"), or not at all ("none").',
        "spring",
    )
    halflife_s: float = _halflife("The half-life of the spring, for joints and root.", 0.1)
    path_alignment: bool = flag("Whether hips and legs turn to the way that the game's body goes, while the chest stays.", True)
    alignment_limit_deg: float = number("By how much hips and legs turn at most.", 70.0, 0.0, 90.0, "degrees")
    alignment_halflife_s: float = _halflife("How fast hips and legs turn, and strides change.", 0.15)
    min_stride: float = number(
        "How much shorter steps may become where the clip is faster than the game's body.", 0.8, 0.1, 1.0, "a share",
        note="1 shortens no step",
    )  # fmt: skip
    max_stride: float = number(
        "How much longer steps may become where the clip is slower than the game's body.",
        1.25,
        1.0,
        3.0,
        note="1 lengthens no step",
    )
    foot_lock: bool = flag("Whether a foot that is down in the clip stays where it came down.", True)
    foot_halflife_s: float = _halflife("How fast a foot that was let go returns to the clip.", 0.1)
    foot_radius_m: float = number("How far from the clip's place a foot is let go.", 0.45, 0.0, 10.0, "metres")

    @classmethod
    def from_dict(cls, mapping: Mapped, *, name: str = "player", file: str | None = None) -> PoseSettings:
        """Read the keys of one `[output.NAME]`; what is not there is as by default. Raises SchemaError with every fault; `file` is
        the name of the file in messages; ContextError where `mapping` is none."""
        faults: list[Fault] = []
        part: Mapped = require_mapping(mapping, "mapping", "what [output.NAME] says")
        values = Section(f"[output.{name}]", part, settings_of(cls), faults, file).values(settings_of(cls))
        if faults:
            raise SchemaError(*faults)
        return cls(**values)
