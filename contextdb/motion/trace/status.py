"""How it stands at an update: speeds and angles as wanted, of the clip and of the body, and what makes up for the differences.

Wanted and clip are read from the same features: those of the query, and those of the frame that plays, about half a second ahead.
What was got is of the last update. A move is an angle against where the body faces, a facing one against where it faces now; both
are in degrees, positive to the left. The screen, the page and `contextdb motion replay --at --json` show one `Status`.

Source: the window "PTM Status" of the diagnostics in EA's talk: desired and clip speed, the differences of the angles, time scale,
foot warp.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass

from contextdb.motion.clips.quaternions import Floats
from contextdb.motion.features.schema import ABOUT_S, FeatureSchema
from contextdb.motion.markup.left_out import LeftOut
from contextdb.motion.search.database import MotionDatabase
from contextdb.motion.selection.decision import Decision
from contextdb.motion.selection.root_motion import RootMotion
from contextdb.motion.selection.worked_out import of_searched

SLOW_MPS = 0.2
"""What is slower moves in no direction."""


@dataclass(frozen=True, slots=True)
class Compared:
    """One number three times; None where it is not known. The differences are against what was wanted."""

    wanted: float | None
    clip: float | None
    got: float | None
    is_angle: bool = False

    @property
    def clip_off(self) -> float | None:
        """By how much the clip is off."""
        return self._off(self.clip)

    @property
    def got_off(self) -> float | None:
        """And the body."""
        return self._off(self.got)

    def to_json(self) -> dict[str, float | None]:
        document = {"wanted": self.wanted, "clip": self.clip, "got": self.got, "clip_off": self.clip_off, "got_off": self.got_off}
        return {name: None if value is None else round(value, 4) for name, value in document.items()}

    @property
    def parts(self) -> list[str]:
        """ "wanted 3.00", "clip 2.50 (-0.50)", "got 3.00 (+0.00)"; of a part that is not known ""."""
        form, sign, digits = ("{:.0f}°", "{:+.0f}", 0) if self.is_angle else ("{:.2f}", "{:+.2f}", 2)
        parts = []
        for name, value, off in (
            ("wanted", self.wanted, None),
            ("clip", self.clip, self.clip_off),
            ("got", self.got, self.got_off),
        ):
            number = "" if value is None else f"{name} {form.format(_rounded(value, digits))}"
            parts.append(number if value is None or off is None else f"{number} ({sign.format(_rounded(off, digits))})")
        return parts

    @property
    def text(self) -> str:
        """In a line; "" where nothing is known."""
        return ", ".join(filter(None, self.parts))

    def _off(self, value: float | None) -> float | None:
        if value is None or self.wanted is None:
            return None
        return math.remainder(value - self.wanted, 360.0) if self.is_angle else value - self.wanted


@dataclass(frozen=True, slots=True)
class Status:
    """How it stands at an update: speeds in m/s, angles in degrees, seconds of the clip that pass in a second (`time_scale`).

    `frames_evaluated` could be chosen in the databases that were searched; None without a search. The steps became `stride` times
    as long, and hips and legs were turned by `warp_deg`; None without the poses that were displayed.
    """

    speed: Compared
    move: Compared
    facing: Compared
    frames_evaluated: int | None
    time_scale: float
    stride: float | None = None
    warp_deg: float | None = None

    def to_json(self) -> dict[str, object]:
        return {
            "speed_mps": self.speed.to_json(),
            "move_deg": self.move.to_json(),
            "facing_deg": self.facing.to_json(),
            "frames_evaluated": self.frames_evaluated,
            "time_scale": round(self.time_scale, 4),
            "stride": None if self.stride is None else round(self.stride, 4),
            "warp_deg": None if self.warp_deg is None else round(self.warp_deg, 4),
        }

    def lines(self) -> Iterator[tuple[str, str]]:
        """What is known, each with its name."""
        for name, compared in self.compared:
            if compared.text:
                yield name, compared.text
        yield from self.numbers()

    @property
    def compared(self) -> list[tuple[str, Compared]]:
        """What is wanted, shown by the clip and got, each with its name."""
        return [("m/s", self.speed), ("moves", self.move), ("faces", self.facing)]

    def numbers(self) -> Iterator[tuple[str, str]]:
        """What else is known, each with its name."""
        if self.frames_evaluated is not None:
            yield "frames evaluated", f"{self.frames_evaluated:,}"
        yield "play rate", f"{self.time_scale:.2f}"
        if self.stride is not None and self.warp_deg is not None:
            yield "stride", f"{self.stride:.2f}"
            yield "warp", f"{_rounded(self.warp_deg):.0f}°"


def status_of(
    decision: Decision,
    last: Decision | None,
    databases: Mapping[str, MotionDatabase],
    warp: tuple[float, float] | None = None,
) -> Status:
    """The status of an update after the `last` decision, None for the first. `databases` are those that it was made with, by name;
    what is not among them is not known. `warp` is (stride, radians) of the pose that was displayed."""
    playing = decision.playing
    database = None if playing is None else databases.get(playing.database)
    schema = None if database is None else database.schema
    wanted, clip = _NOTHING, _NOTHING
    if database is not None and schema is not None and playing is not None:
        wanted = _NOTHING if decision.query is None else _ahead(schema, decision.query)
        clip = _ahead(schema, database.raw(playing.frame))
    each = zip(wanted, clip, _got(decision, last, schema), strict=True)
    speed, move, facing = (Compared(*three, is_angle=i > 0) for i, three in enumerate(each))
    stride, turn = (None, None) if warp is None else warp
    turned = None if turn is None else math.degrees(turn)
    return Status(speed, move, facing, _n_evaluated(decision, databases), decision.play_rate, stride, turned)


def _rounded(value: float, digits: int = 0) -> float:
    """A number rounded, without the sign of a zero."""
    return round(value, digits) + 0.0


Path = tuple[float | None, float | None, float | None]
"""Speed in m/s, move and facing in degrees."""
_NOTHING: Path = None, None, None


def _ahead(schema: FeatureSchema, values: Floats) -> Path:
    """What features [F] in the schema's units say of the path, about half a second ahead."""
    speed, move = None, None
    if schema.speed_features is not None:
        columns, seconds = schema.speed_features
        numbers = values[columns].tolist()
        speed = math.hypot(*numbers) / seconds
        move = math.degrees(math.atan2(*numbers)) if len(numbers) == 2 and speed >= SLOW_MPS else None
    return speed, move, _facing(schema, values)


def _facing_point(schema: FeatureSchema) -> tuple[float, int] | None:
    """How far ahead the facing is compared, in seconds, and which feature is the first of it; None where it is not."""
    points = [
        (seconds, schema.slices[channel.name].start + 2 * i)
        for channel in schema.channels
        if channel.type == "trajectory" and channel.what == "direction"
        for i, seconds in enumerate(channel.at)
        if seconds > 0.0
    ]
    return min(points, key=lambda point: abs(point[0] - ABOUT_S), default=None)


def _facing(schema: FeatureSchema, values: Floats) -> float | None:
    point = _facing_point(schema)
    if point is None:
        return None
    left, ahead = values[point[1] : point[1] + 2].tolist()
    return math.degrees(math.atan2(left, ahead)) if left or ahead else None


def _got(decision: Decision, last: Decision | None, schema: FeatureSchema | None) -> Path:
    """What the body did since the last update, its turn as far as it leads in the time that is looked ahead."""
    seconds = 0.0 if last is None else decision.time_s - last.time_s
    if last is None or seconds <= 0.0:
        return _NOTHING
    move = decision.root_motion
    if decision.body is not None and last.body is not None:
        (x, z, heading), (to_x, to_z, to_heading) = last.body, decision.body
        sin, cos = math.sin(heading), math.cos(heading)
        left, ahead = cos * (to_x - x) - sin * (to_z - z), sin * (to_x - x) + cos * (to_z - z)
        move = RootMotion(left, ahead, math.remainder(to_heading - heading, math.tau))
    speed = math.hypot(move.left_m, move.ahead_m) / seconds
    way = math.degrees(math.atan2(move.left_m, move.ahead_m)) if speed >= SLOW_MPS else None
    point = None if schema is None else _facing_point(schema)
    return speed, way, None if point is None else math.degrees(move.turn_rad) * point[0] / seconds


def _n_evaluated(decision: Decision, databases: Mapping[str, MotionDatabase]) -> int | None:
    if decision.choice is None or not decision.filters:
        return None
    searched = of_searched(decision.filters, decision.choice)
    if not all(name in databases for name, _ in searched):
        return None
    n = 0
    for name, chosen in searched:
        database = databases[name]
        why = chosen.why(database.layout.frame_ranges, database.marks.kinds)
        n += int((why == LeftOut.NO).sum())
    return n
