"""Play: a character who obeys the tables beside this file. Edit them meanwhile: `contextdb edit examples/playground/tables`.

python -m examples.playground
python -m examples.playground --clips FOLDER                       with any folder of BVH clips
python -m examples.playground --headless 10 --stick stick.csv --poses out.npz --record out.parquet --picture out.png
"""

from __future__ import annotations

import argparse
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Iterable, Iterator
from pathlib import Path

from contextdb import motion
from contextdb.errors import ContextDBError, Fault, FileError, Place
from examples.playground.actor import LONGEST
from examples.playground.game import Game
from examples.playground.stick import REST, StickFile

RATE = 60.0
TABLES = Path(__file__).parent / "tables"
NO_PANDA = "The playground is drawn by Panda3D, which is not installed. Try: python -m pip install 'contextdb[playground]'"


def main(words: list[str] | None = None) -> int:
    """Read the arguments, and play."""
    parser = argparse.ArgumentParser(prog="python -m examples.playground", description=__doc__.splitlines()[0])
    link = "what the editor knows the game by (default: playground)"
    parser.add_argument("--clips", type=Path, metavar="FOLDER", help="BVH clips to play with; their table is made")
    parser.add_argument("--link", metavar="NAME", default="playground", help=link)
    parser.add_argument("--headless", type=float, metavar="SECONDS", help="play so long without a window")
    parser.add_argument("--stick", type=Path, metavar="FILE", help="with --headless: time_s, x, z, run, strafe, camera_deg")
    parser.add_argument("--poses", type=Path, metavar="FILE", help="with --headless: write the player's poses, .bvh or .npz")
    parser.add_argument("--record", type=Path, metavar="SESSION", help="with --headless: write the session, .parquet")
    parser.add_argument("--picture", type=Path, metavar="FILE", help="with --headless: write the last moment, .png")
    given = parser.parse_args(words)
    try:
        folder = TABLES if given.clips is None else project_of_clips(given.clips, Path(tempfile.mkdtemp(prefix="playground-")))
        if given.clips is None and not (TABLES / "clips" / "walk_about_left.bvh").exists():
            motion.write_game_clips(TABLES / "clips")
        with Game(folder, None if given.headless else given.link) as game:
            if given.headless is not None:
                stick = None if given.stick is None else StickFile.read(given.stick)
                run(played(game, given.headless, stick), given.poses, given.record, given.picture)
                return 0
            from examples.playground.window import Window

            window = Window(game)
            window.begin()
            window.base.run()
    except (ModuleNotFoundError, ContextDBError) as error:
        if isinstance(error, ModuleNotFoundError) and error.name not in ("panda3d", "direct"):
            raise
        print(NO_PANDA if isinstance(error, ModuleNotFoundError) else error, file=sys.stderr)
        return 2
    return 0


def played(game: Game, seconds: float, stick: StickFile | None = None, rate: float = RATE) -> Iterator[Game]:
    """Play so long without a window, as fast as it can, and give the game after each frame."""
    for frame in range(1, round(seconds * rate) + 1):
        game.update(1.0 / rate, REST if stick is None else stick.at(frame / rate))
        yield game


def run(games: Iterable[Game], poses: Path | None = None, record: Path | None = None, picture: Path | None = None) -> None:
    """Play to the end, and write what is asked for: all poses of the player, the session, a picture of the last moment."""
    shown: list[motion.Pose] = []
    for game in games:
        if not shown:
            game.player.keep(LONGEST)
        shown.append(game.player.pose)
    if poses is not None:
        motion.write_poses(shown, next(iter(game.player.stock.banks.values())), poses, RATE)
    if record is not None:
        game.player.trace.save(record, timings=False)
    if picture is not None:
        from examples.playground.window import Window

        Window(game, is_offscreen=True).write_picture(picture)


def project_of_clips(clips: Path, folder: Path) -> Path:
    """Make a project of any folder of BVH clips, with the table that `contextdb motion describe` makes of them."""
    found = sorted(clips.glob("*.bvh"))
    if not found:
        raise FileError(Fault("there is no BVH clip.", "a folder with files *.bvh", place=Place(str(clips))))
    (folder / "clips").mkdir(parents=True, exist_ok=True)
    for path in found:
        shutil.copy(path, folder / "clips")
    words = ["motion", "describe", str(folder / "clips"), "--out", str(folder / "moves.csv")]
    subprocess.run([sys.executable, "-m", "contextdb", *words], check=True)
    print(f"The table of these clips: contextdb edit {folder}")
    return folder


if __name__ == "__main__":
    sys.exit(main())
