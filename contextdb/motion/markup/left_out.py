"""Why a frame may not be chosen. The search, its candidates and a recorded session all speak in these words."""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum

from contextdb.motion.records import quickly_made


class LeftOut(IntEnum):
    """Why a frame is left out of a search; 0 for one that is not. Where several reasons hold, the lowest number is reported."""

    NO = 0
    NOT_VALID = 1
    EXCLUDED = 2
    DO_NOT_CHOOSE = 3
    NEXT_NATURAL = 4
    CLIP_END = 5
    TAGS = 6
    MATCH_RANGE = 7
    JUMP = 8
    HISTORY = 9
    PHASE = 10
    FORBIDDEN = 11
    START = 12
    ASSET = 13
    EVENT = 14

    @property
    def text(self) -> str:
        """The reason in words."""
        return _TEXTS[self]


_TEXTS = {
    LeftOut.NO: "",
    LeftOut.NOT_VALID: "asset not valid",
    LeftOut.EXCLUDED: "excluded",
    LeftOut.DO_NOT_CHOOSE: "DoNotChoose",
    LeftOut.NEXT_NATURAL: "NextNaturalOnly",
    LeftOut.CLIP_END: "clip end",
    LeftOut.TAGS: "tags",
    LeftOut.MATCH_RANGE: "outside match range",
    LeftOut.JUMP: "jump threshold",
    LeftOut.HISTORY: "played just now",
    LeftOut.PHASE: "phase",
    LeftOut.FORBIDDEN: "forbidden by bias",
    LeftOut.START: "not the start_s of its row",
    LeftOut.ASSET: "asset played lately",
    LeftOut.EVENT: "does not lead to the event in time",
}


@quickly_made
@dataclass(frozen=True, slots=True)
class Skip:
    """Frames [start, stop) of a database that one search leaves out, and why."""

    start: int
    stop: int
    why: LeftOut = LeftOut.FORBIDDEN
