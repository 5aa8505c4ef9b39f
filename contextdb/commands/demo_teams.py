"""Two teams and one ball, for the demo: 22 players are offered as the Defender of a contested catch, and the table casts one."""

from __future__ import annotations

from collections.abc import Iterator

from contextdb.compiled.casting.explaining import CastExplanation
from contextdb.compiled.table import CompiledTable
from contextdb.console import aligned
from contextdb.errors import plural

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
