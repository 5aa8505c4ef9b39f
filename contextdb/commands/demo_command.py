"""A tour of the sample tables: a context, its valid assets, why the others are not valid, a player from two teams cast for a role,
a search of the valid clips' frames, and a character that is steered, its poses written as BVH. With --html he is steered over
stairs, a slope and bumps for a minute too, and a page shows it.

Formulas make the clips, not motion capture. They are written as BVH files and read back like any others.
"""

from __future__ import annotations

import argparse
import math
import os
import shutil
import sys
import tempfile
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path

import contextdb
from contextdb import motion
from contextdb.cells.facts import Context
from contextdb.commands import add_page_arguments, take_page_arguments
from contextdb.commands.motion_page import page_file
from contextdb.compiled.casting.explaining import CastExplanation
from contextdb.compiled.matches import Matches
from contextdb.compiled.table import CompiledTable
from contextdb.console import ExitCode, aligned, output, styled, wants_colour
from contextdb.disk import make_folder, real_path, refused_writing, write_atomic
from contextdb.disk.boundary import inside
from contextdb.disk.folder_lock import growing_folder, temporary_folder
from contextdb.errors import Fault, FileError, Place, plural
from contextdb.motion import Character, measure
from contextdb.motion.features.extraction import Features
from contextdb.motion.storage.building import build
from contextdb.report import session_html
from contextdb.report.measure_results import SessionMeasures
from contextdb.report.session_view import view_of
from contextdb.tables.project import SCHEMA_FILE, Project

TACKLE = {
    "IsInMidAirAnim": False,
    "IsInCatchAnim": False,
    "dir_to_tackle_target_future_pos": 12.0,
    "ActivateDiveAtMidAirHigh": True,
    "ActivateDiveAtMidAirLow": False,
    "ActivateHitMidAirNear": False,
    "ActivateDiveAtMidAirGround": False,
    "ActivateHitMidAirFar": False,
}
REST = {"gait": "Walk", "speed": 1.3, "direction": 0.0, "style": "normal"}
TIRED = {"gait": "Walk", "speed": 1.3, "direction": 0.0, "style": "tired"}
TURN = {"gait": "Walk", "speed": 1.3, "direction": 65.0, "style": "tired"}
SPEED_MPS, TURN_DPS = 1.3, 60.0
STEERED = (  # seconds, what the stick asks for in m/s, and what the game says
    (1.0, (0.0, 0.0), "Idle"),
    (3.0, (0.0, 1.3), "Walk"),
    (2.5, (1.3, 0.0), "Walk"),
    (2.5, (3.0, 0.0), "Run"),
    (2.0, (0.0, 0.0), "Idle"),
)
RATE = 30
POSES = "player.bvh"
N_NEAREST = 2


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--tables", metavar="FOLDER", help="the sample tables (default: those that came with contextdb)")
    parser.add_argument(
        "--keep", metavar="FOLDER", help="a new folder for the tables, the synthetic clips and the poses, to experiment with"
    )
    parser.add_argument("--html", metavar="FILE", help="write the page of a minute over stairs and slopes")
    add_page_arguments(parser, ("text", "html"))


def run(arguments: argparse.Namespace) -> ExitCode:
    """Print each step of the way."""
    take_page_arguments(arguments)
    page = page_file(arguments.html) if arguments.html else None
    source = Path(arguments.tables) if arguments.tables else sample_folder()
    with tempfile.TemporaryDirectory() as temporary:
        folder = Path(arguments.keep) if arguments.keep else Path(temporary) / source.name
        make_sample(source, folder)
        colour = wants_colour(sys.stdout)
        with output():
            for line in _steps(folder, page):
                print(styled(line, "bold", colour) if line[:1].isdigit() else line)
            print(_next(arguments.keep))
    return ExitCode.OK


def _next(kept: str | None) -> str:
    """What to do next, with the command as a terminal here finds it."""
    beside = shutil.which("contextdb", path=os.path.dirname(sys.executable))
    command = "contextdb" if shutil.which("contextdb") else beside or f"{sys.executable} -m contextdb"
    command = command.removeprefix(os.getcwd() + os.sep)
    if kept is not None:
        return f'Next: "{command} edit {kept}" opens the tables.'
    return f'Next: "{command} demo --keep FOLDER" writes these tables and clips, "{command} edit FOLDER" opens them.'


def make_sample(source: Path, folder: Path) -> None:
    """Copy the sample tables into a new folder and make their clips. Raises FileError where the folder is there already, or cannot
    be made."""
    Project.load(source)  # says what is wrong with it
    if folder.exists():
        fault = Fault("this already exists.", "the name of a folder that does not exist yet", place=Place(str(folder)))
        raise FileError(fault)
    make_folder(folder.parent)
    with (
        refused_writing(folder, ()),
        temporary_folder(real_path(folder.parent)) as temporary,
        growing_folder(temporary / "growing", folder) as growing,
    ):
        _copy(source, growing)
        make_folder(growing / "clips")
        motion.write_made_clips(growing / "clips")


def _copy(source: Path, to: Path) -> None:
    """Copy a folder without what is hidden or made."""
    for at, folders, names in os.walk(source):
        folders[:] = [name for name in folders if not name.startswith(".")]
        here = to / Path(at).relative_to(source)
        make_folder(here)
        for name in names:
            if not name.startswith(".") and not name.endswith((".bvh", ".safetensors")):
                shutil.copyfile(inside(Path(at, name), source), here / name)


def sample_folder() -> Path:
    """Where the sample tables are: inside an installed package, or in the checkout next to it. Raises FileError where they are in
    neither."""
    package = Path(contextdb.__file__).parent
    for folder in (package / "_tables", package.parent / "tables"):
        if (folder / SCHEMA_FILE).is_file():
            return folder
    raise FileError(Fault("the sample tables are missing.", "tables/ of the checkout: --tables FOLDER", place=Place(str(package))))


def _steps(folder: Path, page: Path | None) -> Iterator[str]:
    project = Project.load(folder)
    yield "1. The tables: one row an asset, one column a condition"
    yield ""
    sizes = [(n, plural(t.n_rows, "row"), plural(len(t.conditions), "condition")) for n, t in project.tables.items()]
    yield from aligned(sizes, right=(1, 2), indent="   ")
    yield ""
    yield "2. A moment of the game: a tackler, and somebody in the air. Which animations are valid?"
    yield ""
    yield from _answer(project["hit_mid_air"].compile(), TACKLE)
    yield "3. A ball in the air and two teams. Which contested catches are valid, and who plays the Defender?"
    yield ""
    yield from cast_lines(project["contested_catch"].compile())
    yield from _motion(project, folder, page)


def _answer(compiled: CompiledTable, context: Context) -> Iterator[str]:
    """The context, the valid rows, and why the nearest others are not valid."""
    explanation = compiled.explain(context)
    yield from _context(context)
    yield ""
    yield f"   {len(explanation.matches)} of {plural(compiled.n_rows, 'row')} valid:"
    yield from (f"     {asset}" for asset in explanation.matches.assets)
    yield "   Why not the next ones:"
    yield from (f"     {row}" for row in explanation.nearest(N_NEAREST))
    yield ""


def _motion(project: Project, folder: Path, page: Path | None) -> Iterator[str]:
    stage = Stage.of(project, folder)
    loco = stage.databases["loco"]
    yield "4. Clips for the locomotion table: made by formulas, not captured; written as BVH and read back"
    yield ""
    size = f"{plural(stage.n_clips, 'clip')}, {plural(loco.n_frames, 'frame')}, {loco.n_features} numbers a frame"
    yield f"   {size}: feet, hips and the way ahead"
    yield ""
    yield "5. Someone walks as if tired and has just recovered. The table says which clips are valid; only their frames are ranked"
    yield ""
    query = stage.query("walk_tired", 60)
    valid = stage.table.query(REST)
    yield from _context(REST)
    yield ""
    yield f"   {len(valid)} of {plural(stage.table.n_rows, 'row')} valid: {', '.join(valid.assets)}"
    yield from aligned(
        [_hit("best frame of all clips", loco, query), _hit("best frame of the valid ones", loco, query, valid)], indent="   "
    )
    yield ""
    yield "6. Someone walks and is tired by now. Tired clips have a database of their own, and it comes first: while its best"
    yield "   cost is under its threshold it wins outright, even where another clip would cost less"
    yield ""
    yield from _choice(stage, TIRED, stage.query("walk", 60))
    yield "7. The same, turning sharply: no tired clip fits well, so all valid clips are searched and the lowest cost wins"
    yield ""
    yield from _choice(stage, TURN, stage.query("walk", 40, TURN_DPS))
    yield "8. The player stands, walks, turns to the left, runs and stops: the table says what may play, and poses come out"
    yield ""
    other = stage.player.copy()
    yield from _steered(stage, folder)
    if page is not None:
        yield "9. Another minute of his, over stairs, a slope and bumps: legs follow the ground, and the page shows each moment"
        yield ""
        html, sentence = world(other)
        write_atomic(page, html.encode())
        yield f"   {sentence}"
        yield f"   {page}"
        yield ""


@dataclass(frozen=True)
class Stage:
    """What the motion part of the demo plays with: the compiled table, its clips' databases and the selector over them."""

    table: CompiledTable
    databases: Mapping[str, motion.MotionDatabase]
    selector: motion.Selector
    features: motion.FeatureSchema
    folder: Path
    n_clips: int
    player: motion.Character

    @classmethod
    def of(cls, project: Project, folder: Path) -> Stage:
        """Read the clips of a folder, and build what contextdb.toml says."""
        config = motion.MotionConfig.from_dict(project.schema.motion, tables=project.tables, file=project.schema.file)
        clips = folder / "clips"
        table = project["locomotion"].compile()
        databases = build(config, folder, {"locomotion": table.assets}, cache=None)
        return cls(
            table,
            databases,
            config.selector("locomotion", databases),
            config.features["loco"],
            clips,
            len(list(clips.glob("*.bvh"))),
            cls._player(config, folder, table, databases),
        )

    @staticmethod
    def _player(
        config: motion.MotionConfig, folder: Path, table: CompiledTable, databases: Mapping[str, motion.MotionDatabase]
    ) -> motion.Character:
        """The character of the sample, as `Character.of` makes it of a project."""
        stream = motion.PoseStream(
            motion.open_or_build_poses(config, folder, {"locomotion": table.assets}), config.output_of("player")
        )
        return motion.Character(config.controller("player", databases), config.features["loco"], table, stream)

    def query(self, clip: str, frame: int, turn_dps: float = 0.0) -> Features:
        """The pose of a clip's frame, and the wish to go on at walking speed."""
        return motion.query_from(
            self.features, motion.load_bvh(self.folder / f"{clip}.bvh"), frame, motion.steady_path(SPEED_MPS, turn_dps)
        )


def _steered(stage: Stage, folder: Path) -> Iterator[str]:
    """Steer the character, write its poses, and say how well it moved."""
    player = stage.player
    assert player.stream is not None, "it was made with one"
    trace, moments = player.record(0), [(stick, gait) for seconds, stick, gait in STEERED for _ in range(round(seconds * RATE))]
    updated = [player.update(1.0 / RATE, stick, {"gait": gait, "style": "normal"}) for stick, gait in moments]
    poses = [each.pose for each in updated if each.pose is not None]
    motion.write_poses(poses, player.stream.rig, folder / POSES, RATE)
    played = dict.fromkeys(pose.playing.asset for pose in poses if pose.playing is not None)
    measures = motion.measure(trace, player.stream.banks, poses=poses, wanted=[stick for stick, _ in moments])
    yield f"   {len(poses) / RATE:g} s, {plural(len(poses), 'pose')} of {player.stream.rig.n_joints} joints: {POSES}"
    yield f"   plays {', '.join(played)}"
    yield (
        f"   {measures.jumps_per_s:.1f} jumps a second; feet that are down slide {measures.skate_cm_s:.1f} cm/s,"
        f" in the clips {measures.skate_raw_cm_s:.1f}; {measures.path_rms_m:.2f} m from the body that the stick moves"
    )
    yield ""


def _context(context: Context) -> Iterator[str]:
    yield from aligned([(name, "=", str(value)) for name, value in context.items()], indent="   ")


def _hit(what: str, database: motion.MotionDatabase, query: Features, valid: Matches | None = None) -> tuple[str, str]:
    hit = database.search(query, valid)
    return f"{what}:", f"{hit.asset} at {database.time_s(hit):.2f} s, cost {hit.cost:.2f}"


def _choice(stage: Stage, context: Context, query: Features) -> Iterator[str]:
    valid = stage.table.query(context)
    choice = stage.selector.search(query, valid)
    yield from _context(context)
    yield ""
    yield f"   {len(valid)} of {plural(stage.table.n_rows, 'row')} valid: {', '.join(valid.assets)}"
    yield from aligned([_hit("best frame of the valid ones", stage.databases["loco"], query, valid)], indent="   ")
    yield ""
    yield from (f"   {search}" for search in choice.searches)
    yield f"   {choice.database} wins ({choice.reason}): {choice.hit.asset}"
    yield ""


# ---- the world of the demo: stairs up, a landing, a slope down and bumps, and a minute in which a player is steered over
# them. made clips ─► character ─► poses on this ground ─► page of the session, and its measures

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
