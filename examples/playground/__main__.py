"""Play: a character who obeys the tables beside this file. Edit them meanwhile: `contextdb edit examples/playground/tables`.

python -m examples.playground
python -m examples.playground --clips FOLDER                       with any folder of BVH clips
python -m examples.playground --headless 10 --stick stick.csv --poses out.npz --record out.parquet --picture out.png
"""

from __future__ import annotations

import argparse
import sys
import tempfile
from pathlib import Path

from contextdb.errors import ContextDBError
from examples.playground.clips import project_of_clips, write_clips
from examples.playground.game import Game
from examples.playground.headless import played, run
from examples.playground.stick import StickFile

TABLES = Path(__file__).parent / "tables"
NO_PANDA = "The playground is drawn by Panda3D, which is not installed. Try: python -m pip install 'contextdb[playground]'"


def main(words: list[str] | None = None) -> int:
    """Read the arguments, and play."""
    parser = argparse.ArgumentParser(prog="python -m examples.playground", description=__doc__.splitlines()[0])
    parser.add_argument("--clips", type=Path, metavar="FOLDER", help="BVH clips to play with; their table is made")
    parser.add_argument(
        "--link", metavar="NAME", default="playground", help="what the editor knows the game by (default: playground)"
    )
    parser.add_argument("--headless", type=float, metavar="SECONDS", help="play so long without a window")
    parser.add_argument("--stick", type=Path, metavar="FILE", help="with --headless: time_s, x, z, run, strafe, camera_deg")
    parser.add_argument("--poses", type=Path, metavar="FILE", help="with --headless: write the player's poses, .bvh or .npz")
    parser.add_argument("--record", type=Path, metavar="SESSION", help="with --headless: write the session, .parquet")
    parser.add_argument("--picture", type=Path, metavar="FILE", help="with --headless: write the last moment, .png")
    given = parser.parse_args(words)
    try:
        with Game(_folder(given.clips), None if given.headless else given.link) as game:
            if given.headless is not None:
                stick = None if given.stick is None else StickFile.read(given.stick)
                run(played(game, given.headless, stick), given.poses, given.record, given.picture)
                return 0
            from examples.playground.window import Window

            Window(game).play()
    except ModuleNotFoundError as error:
        if error.name not in ("panda3d", "direct"):
            raise
        print(NO_PANDA, file=sys.stderr)
        return 2
    except ContextDBError as error:
        print(error, file=sys.stderr)
        return 2
    return 0


def _folder(clips: Path | None) -> Path:
    """The tables to play with, and their clips."""
    if clips is None:
        write_clips(TABLES / "clips")
        return TABLES
    folder = Path(tempfile.mkdtemp(prefix="playground-"))
    project_of_clips(clips, folder)
    print(f"The table of these clips: contextdb edit {folder}")
    return folder


if __name__ == "__main__":
    sys.exit(main())
