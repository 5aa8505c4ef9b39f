"""The world of the demo: stairs up, a landing, a slope down and bumps, and a minute in which a player is steered over them.

made clips ─► character ─► poses on this ground ─► page of the session, and its measures
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping

from contextdb.compiled.casting.explaining import CastExplanation
from contextdb.compiled.table import CompiledTable
from contextdb.console import aligned
from contextdb.errors import plural
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


# ---- two teams and one ball, for the demo: 22 players are offered as the Defender of a contested catch, and the table casts
# one


CATCH = {"MidAir_Catch_Direction": "Going_Down"}
NEAR_M = 3.0

Player = dict[str, object]


def _defender(name: str, position: str, distance: float, jumps: bool = False, sees: bool = True) -> Player:
    facts = {"MidAir_Contesting": jumps, "CatchingAnim": False, "Catching": False, "FacingBall": sees}
    return {"id": name, "name": name, "team": "away", "DepthChart": position, "distance": distance, **facts}


def players() -> list[Player]:
    """Both teams: eleven who defend, and eleven of the catcher's own, who have no defender's position; distances in metres."""
    away = [
        _defender("Reyes", "SS", 0.8, jumps=True, sees=False),
        _defender("Marsh", "CB", 1.1, jumps=True),
        _defender("Lund", "LB", 1.9, jumps=True),
        _defender("Okoro", "FS", 2.4, jumps=True),
        _defender("Price", "CB", 2.8),
    ]
    away += [_defender(f"Away {i}", "LB", 9.0 + i) for i in range(6)]
    home = [{"id": "Hale", "name": "Hale", "team": "home", "distance": 0.0, "MidAir_Contesting": True, "FacingBall": True}]
    return away + home + [{"id": f"Home {i}", "name": f"Home {i}", "team": "home", "distance": 7.0 + i} for i in range(10)]


def cast_lines(compiled: CompiledTable) -> Iterator[str]:
    """Who is near, which rows are valid with whom, and why another who is near cannot play the part."""
    everybody = players()
    near = sorted((p for p in everybody if _distance(p) < NEAR_M), key=_distance)
    matches = compiled.query(CATCH, unknown="never", actors={"Defender": everybody}, prefer="distance")
    yield f"   MidAir_Catch_Direction  =  {CATCH['MidAir_Catch_Direction']}"
    yield f"   {len(everybody)} players, all offered as Defender; these are within {NEAR_M:g} m:"
    yield from aligned([_player_cells(player) for player in near], indent="     ")
    yield ""
    yield f"   {len(matches)} of {plural(compiled.n_rows, 'row')} valid, the nearest who fits cast first:"
    for row in matches.rows.tolist():
        cast, *others = (casting["Defender"] for casting in matches.castings(row))
        yield f"     {compiled.assets[row]}: Defender is {cast['name']}"
        yield from (f"       {other['name']} could play it too" for other in others)
    yield "   Why nobody else who is near:"
    for row in matches.rows.tolist():
        can_play = {casting["Defender"]["id"] for casting in matches.castings(row)}
        yield from (f"     {_why_not(compiled, player, row)}" for player in near if player["id"] not in can_play)
    yield ""


def _distance(player: Player) -> float:
    return float(str(player["distance"]))


def _player_cells(player: Player) -> tuple[str, ...]:
    jumps = "jumps" if player["MidAir_Contesting"] else "stays down"
    sees = "sees the ball" if player["FacingBall"] else "has his back to the ball"
    return (
        str(player["name"]),
        str(player["team"]),
        str(player.get("DepthChart", "catches")),
        f"{_distance(player):.1f} m",
        f"{jumps}, {sees}",
    )


def _why_not(compiled: CompiledTable, player: Player, row: int) -> str:
    """The facts of one player that are in his way."""
    explanation = compiled.explain(CATCH, unknown="never", actors={"Defender": [player]})
    assert isinstance(explanation, CastExplanation)
    return "; ".join(str(failure) for failure in explanation.row(row).failures)
