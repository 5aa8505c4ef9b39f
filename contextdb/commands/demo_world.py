"""The world of the demo: stairs up, a landing, a slope down and bumps, and a minute in which a player is steered over them.

made clips ─► character ─► poses on this ground ─► page of the session, and its measures
"""

from __future__ import annotations

import math
from collections.abc import Mapping

from contextdb.motion import Character, measure
from contextdb.report import session_html
from contextdb.report.measure_results import SessionMeasures
from contextdb.report.session_view import view_of

RATE = 30
NAME = "world"
RUNS_FROM_MPS = 2.2
STAIRS_M, STEP_M, RISE_M, N_STEPS = 4.0, 0.4, 0.12, 8
"""Where the stairs begin, ahead of the start; how deep and high a step is."""
SLOPE_M, DOWN_M = 11.0, 19.0
"""Where the slope down from the landing begins, and where it ends."""
BUMP_M, BUMPS_M = 0.08, 3.0
"""How high bumps to the left and right are, and how long."""
MINUTE = (  # seconds, and what the stick asks for in m/s
    (2.0, (0.0, 0.0)),
    (11.0, (0.0, 1.3)),
    (7.0, (0.0, 1.3)),
    (4.0, (0.9, 0.9)),
    (5.0, (1.3, 0.0)),
    (2.0, (0.0, 0.0)),
    (8.0, (-1.3, 0.0)),
    (6.0, (0.0, -3.0)),
    (5.0, (-0.9, -0.9)),
    (5.0, (0.0, -1.3)),
    (3.0, (0.0, 3.0)),
    (2.0, (0.0, 0.0)),
)

Place3 = tuple[float, float, float]


def ground(x: float, z: float) -> tuple[float, Place3]:
    """The height of the world at a place, and its normal."""
    landing = N_STEPS * RISE_M
    steps = min(max(math.floor((z - STAIRS_M) / STEP_M) + 1, 0), N_STEPS)
    height, rise = steps * RISE_M, 0.0
    if z >= SLOPE_M:
        rise = -landing / (DOWN_M - SLOPE_M) if z < DOWN_M else 0.0
        height = landing * max(0.0, (DOWN_M - z) / (DOWN_M - SLOPE_M))
    wave = math.tau / BUMPS_M
    height += BUMP_M * (1.0 - math.cos(wave * x)) / 2.0
    aside = BUMP_M * wave * math.sin(wave * x) / 2.0
    length = math.sqrt(1.0 + aside**2 + rise**2)
    return height, (-aside / length, 1.0 / length, -rise / length)


def world(player: Character) -> tuple[str, str]:
    """The page of a minute in the world, and the line that says how well it went."""
    assert player.stream is not None, "the demo's player has poses"
    banks = player.stream.banks
    assert isinstance(banks, Mapping), "of databases by name"
    player.ground, trace = ground, player.record(0)
    sticks = [stick for seconds, stick in MINUTE for _ in range(round(seconds * RATE))]
    updated = [player.update(1.0 / RATE, stick, {"gait": _gait(stick), "style": "normal"}) for stick in sticks]
    poses = [each.pose for each in updated if each.pose is not None]
    measures = measure(trace, banks, poses=poses, wanted=sticks)
    rows = {label: (value, raw) for label, value, raw, _ in SessionMeasures(NAME, measures, {}, ()).rows()}
    view = view_of(NAME, trace, banks, player.stream.settings, trace.reasked(player.controller.selector.databases), rows, poses)
    heights = [ground(*pose.root[:2])[0] for pose in poses]
    sentence = (
        f"{len(poses) / RATE:g} s over {N_STEPS} steps, a slope and bumps, up to {max(heights):.2f} m high:"
        f" {measures.jumps_per_s:.1f} jumps a second, feet slide {measures.skate_cm_s:.1f} cm/s"
        f" (clips {measures.skate_raw_cm_s:.1f}), {measures.path_rms_m:.2f} m from the path"
    )
    return session_html.render([view]), sentence


def _gait(stick: tuple[float, float]) -> str:
    """What the game says for a stick."""
    speed = math.hypot(*stick)
    return "Idle" if speed == 0.0 else "Run" if speed >= RUNS_FROM_MPS else "Walk"
