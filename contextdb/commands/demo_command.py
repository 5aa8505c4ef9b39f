"""The whole way on the sample tables: a context, the valid assets, why the others are not, and a search of the valid clips' frames.

The clips are made by formulas, not captured; they are written as BVH files and read back like any others.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path

import contextdb
from contextdb.compiled import CompiledTable
from contextdb.console import aligned, progress, styled, wants_colour
from contextdb.errors import Fault, FileError, Place, plural
from contextdb.exit_codes import ExitCode
from contextdb.facts import Context
from contextdb.matches import Matches
from contextdb.motion import Choice, Hit, MotionConfig, MotionDatabase, load_bvh, query_from, steady_path, write_made_clips
from contextdb.project import SCHEMA_FILE, Project

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
TIRED_WALK = {"gait": "Walk", "speed": 1.2, "direction": 0.0, "style": "tired"}
TIRED_TURN = {"gait": "Walk", "speed": 1.2, "direction": 80.0, "style": "tired"}
POSE_CLIP, POSE_FRAME = "walk_tired", 40
N_NEAREST = 2


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """The arguments of the command."""
    parser.add_argument("--tables", metavar="FOLDER", help="the sample tables (default: those that came with contextdb)")


def run(arguments: argparse.Namespace) -> ExitCode:
    """Print each step of the way."""
    folder = Path(arguments.tables) if arguments.tables else sample_folder()
    colour = wants_colour(sys.stdout)
    for line in _steps(folder):
        print(styled(line, "bold", colour) if line[:1].isdigit() else line)
    return ExitCode.OK


def sample_folder() -> Path:
    """Where the sample tables are: inside an installed package, or in the checkout beside it.

    Raises
    ------
    FileError
        They are in neither.
    """
    package = Path(contextdb.__file__).parent
    for folder in (package / "_tables", package.parent / "tables"):
        if (folder / SCHEMA_FILE).is_file():
            return folder
    raise FileError(Fault("the sample tables are not there.", "tables/ of the checkout: --tables FOLDER", place=Place(str(package))))


def _steps(folder: Path) -> Iterator[str]:
    project = Project.load(folder)
    yield "1. The tables: one row an asset, one column a condition"
    yield ""
    sizes = [(n, plural(t.n_rows, "row"), plural(len(t.conditions), "condition")) for n, t in project.tables.items()]
    yield from aligned(sizes, right=(1, 2), indent="   ")
    yield ""
    yield "2. A moment of the game: a tackler, and somebody in the air. Which animations are valid?"
    yield ""
    yield from _answer(project["hit_mid_air"].compile(), TACKLE)
    with tempfile.TemporaryDirectory() as made:
        yield from _motion(project, Path(made))


def _answer(compiled: CompiledTable, context: Context) -> Iterator[str]:
    """The context, the valid rows, and why the nearest others are not valid."""
    explanation = compiled.explain(context)
    yield from aligned([(name, "=", str(value)) for name, value in context.items()], indent="   ")
    yield ""
    yield f"   {len(explanation.matches)} of {plural(compiled.n_rows, 'row')} valid:"
    yield from (f"     {asset}" for asset in explanation.matches.assets)
    yield "   Why not the next ones:"
    yield from (f"     {row}" for row in explanation.nearest(N_NEAREST))
    yield ""


def _motion(project: Project, folder: Path) -> Iterator[str]:
    schema = project.schema
    sections = {"features": schema.features, "databases": schema.databases, "selectors": schema.selectors}
    config = MotionConfig.from_dict(sections, tables=project.tables, file=schema.file)
    (folder / "clips").mkdir()
    paths = list(progress(write_made_clips(folder / "clips"), "reading clips"))
    table = project["locomotion"].compile()
    databases = config.build(folder, {"locomotion": table.assets})
    loco = databases["loco"]
    yield "3. Clips of the locomotion table: made by formulas, not captured, written as BVH and read back"
    yield ""
    yield f"   {plural(len(paths), 'clip')}, {plural(loco.n_frames, 'frame')}, {loco.n_features} features a frame: feet, hips and the path ahead"
    yield ""
    yield "4. A tired character walks on. The table says which clips are valid; the search ranks only their frames"
    yield ""
    pose = load_bvh(folder / "clips" / f"{POSE_CLIP}.bvh")
    straight = query_from(config.features["loco"], pose, POSE_FRAME, steady_path(TIRED_WALK["speed"]))  # type: ignore[arg-type]
    valid = table.query(TIRED_WALK)
    yield from aligned([(name, "=", str(value)) for name, value in TIRED_WALK.items()], indent="   ")
    yield f"   {len(valid)} of {plural(table.n_rows, 'row')} valid: {', '.join(valid.assets)}"
    yield f"   best frame of all clips:    {_hit(loco, loco.search(straight))}"
    yield f"   best frame of the valid:    {_hit(loco, loco.search(straight, valid))}"
    yield ""
    yield "5. Tired clips come first: their database wins outright while its best cost is under its threshold"
    yield ""
    selector = config.selector("locomotion", databases)
    yield from _choice("walking straight on", selector.search(straight, valid), valid)
    turn = query_from(config.features["loco"], pose, POSE_FRAME, steady_path(TIRED_TURN["speed"], 90.0))  # type: ignore[arg-type]
    turning = table.query(TIRED_TURN)
    yield from _choice("turning sharply to the left", selector.search(turn, turning), turning)
    yield 'Next: "contextdb query --help", and docs/tutorial.md.'


def _hit(database: MotionDatabase, hit: Hit) -> str:

    return f"{hit.asset} at {database.time_s(hit):.2f} s, cost {hit.cost:.3f}"


def _choice(what: str, choice: Choice, valid: Matches) -> Iterator[str]:
    yield f"   {what}: {plural(len(valid), 'clip')} valid"
    yield from (f"     {search}" for search in choice.searches)
    yield f"     {choice.database} wins ({choice.reason}): {choice.hit.asset}"
    yield ""
