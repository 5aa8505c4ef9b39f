"""Which stages some settings ask for, in order."""

from __future__ import annotations

from contextdb.motion.output.alignment import Alignment
from contextdb.motion.output.bank import PoseBank
from contextdb.motion.output.dead_blending import DeadBlending
from contextdb.motion.output.feet import Feet
from contextdb.motion.output.root import Root
from contextdb.motion.output.settings import PoseSettings
from contextdb.motion.output.spring import Spring
from contextdb.motion.output.stages import Stage


def stages_of(settings: PoseSettings, bank: PoseBank) -> tuple[Stage, ...]:
    """The stages of a stream: joints first, then the root, then the way it goes, then the feet."""
    joints: dict[str, tuple[Stage, ...]] = {
        "none": (),
        "spring": (Spring(settings.halflife_s),),
        "dead": (DeadBlending(settings.fade_s, settings.fade_halflife_s),),
    }
    ways = (Alignment.of(settings, bank),) if settings.is_warping else ()
    return (*joints[settings.blend], Root(settings), *ways, Feet.of(settings, bank))
