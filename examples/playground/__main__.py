"""Play: a character who obeys the tables beside this file. `contextdb play` opens it with the editor beside it.

python -m examples.playground --clips FOLDER                       with any folder of BVH clips
python -m examples.playground --headless 10 --stick stick.csv --poses out.npz --record out.parquet --picture out.png
"""

import argparse
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Iterable, Iterator
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path
from typing import Any

from contextdb import motion
from contextdb.errors import ContextDBError, Fault, FileError, Place

from .actor import LONGEST
from .game import Game
from .stick import Sticks, read_sticks, stick_at

RATE, TABLES = 60.0, Path(__file__).parent / "tables"


def main(words: list[str] | None = None) -> int:
    """Read the arguments, and play."""
    parser = argparse.ArgumentParser(prog="python -m examples.playground", description=__doc__.splitlines()[0])
    parser.add_argument(
        "--tables", type=Path, default=TABLES, metavar="FOLDER", help="its tables (default: those beside this file)"
    )
    parser.add_argument("--clips", type=Path, metavar="FOLDER", help="BVH clips to play with; their table is made")
    parser.add_argument("--crowd", type=int, default=0, metavar="N", help="this many others, coloured by the row that they play")
    parser.add_argument("--link", metavar="NAME", default="playground", help="what the editor knows the game by")
    parser.add_argument("--headless", type=float, metavar="SECONDS", help="play so long without a window")
    parser.add_argument("--stick", type=Path, metavar="FILE", help="with --headless: time_s, x, z, run, strafe, camera_deg")
    parser.add_argument("--poses", type=Path, metavar="FILE", help="with --headless: write the player's poses, .bvh or .npz")
    parser.add_argument("--record", type=Path, metavar="SESSION", help="with --headless: write the session, .parquet")
    parser.add_argument("--picture", type=Path, metavar="FILE", help="with --headless: write the last moment, .png")
    given = parser.parse_args(words)
    try:
        folder = own_tables(given.tables) if given.clips is None else project_of_clips(given.clips)
        with Game(folder, None if given.headless else given.link, n_crowd=given.crowd) as game:
            if given.headless is None:
                opened(game).begin().run()
            else:
                frames = played(game, given.headless, read_sticks(given.stick) if given.stick else [])
                run(game, frames, given.poses, given.record, given.picture)
    except ContextDBError as error:
        print(error, file=sys.stderr)
        return 2
    return 0


def played(game: Game, seconds: float, sticks: Sticks, rate: float = RATE) -> Iterator[Game]:
    """Play so long without a window, as fast as it can, and give the game after each frame."""
    for frame in range(1, round(seconds * rate) + 1):
        game.update(1.0 / rate, stick_at(sticks, frame / rate))
        yield game


def run(game: Game, frames: Iterable[Game], poses: Path | None, record: Path | None, picture: Path | None = None) -> None:
    """Play to the end, and write what is asked for: all poses of the player, the session, a picture of the last moment."""
    game.player.trace = game.player.character.record(5, most=LONGEST)
    shown = [each.player.pose for each in frames]
    if poses is not None:
        motion.write_poses(shown, next(iter(game.player.stock.banks.values())), poses, RATE)
    if record is not None:
        game.player.trace.save(record, timings=False)
    if picture is not None:
        opened(game, is_offscreen=True).write_picture(picture)


def opened(game: Game, is_offscreen: bool = False) -> Any:
    """The game's window; Panda3D is imported where it is needed."""
    if find_spec("direct") is None:
        raise FileError(Fault("Panda3D draws the playground and is not installed.", mend="pip install 'contextdb[playground]'"))
    return import_module(".window", __package__).Window(game, is_offscreen)


def own_tables(folder: Path = TABLES) -> Path:
    """The folder of the tables, with their clips, which are made where they are not there yet."""
    if not (folder / "clips" / "walk_about_left.bvh").exists():
        motion.write_made_clips(folder / "clips", of_game=True)
    return folder


def project_of_clips(clips: Path) -> Path:
    """Make a project of any folder of BVH clips, with the table that `contextdb motion describe` makes of them."""
    found = sorted(clips.glob("*.bvh"))
    if not found:
        below = next((str(path.parent) for path in clips.glob("*/*.bvh")), "")
        raise FileError(Fault("there is no BVH clip.", "a folder with files *.bvh", below, place=Place(str(clips))))
    folder = Path(tempfile.mkdtemp(prefix="playground-"))
    (folder / "clips").mkdir()
    for path in found:
        shutil.copy(path, folder / "clips")
    words = ["motion", "describe", str(folder / "clips"), "--out", str(folder / "moves.csv")]
    subprocess.run([sys.executable, "-m", "contextdb", *words], check=True)
    print(f"The table of these clips: contextdb edit {folder}")
    return folder


if __name__ == "__main__":
    sys.exit(main())
