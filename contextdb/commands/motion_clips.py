"""What the commands on clips share: the folder, the unit and the axis as arguments, and progress clip by clip."""

from __future__ import annotations

import argparse
from functools import partial

from contextdb.commands.engine_options import add_engine_arguments
from contextdb.commands.numbers import unit_of
from contextdb.commands.progress import building_bar
from contextdb.motion.clips.clip import UPS
from contextdb.motion.storage.database_settings import ROOTS
from contextdb.tables.project import SCHEMA_FILE


def add_clip_arguments(parser: argparse.ArgumentParser) -> None:
    """The folder, and what its files leave open."""
    parser.add_argument("path", metavar="FOLDER", help=f"a folder of clips, or of tables with {SCHEMA_FILE}")
    parser.add_argument(
        "--metres-per-unit", metavar="M", type=unit_of, help="the unit of the files (default: as the project says, else by size)"
    )
    parser.add_argument(
        "--up", choices=UPS, help="the axis that points up (default: as the project says, else in which bodies stand)"
    )
    parser.add_argument(
        "--root-from",
        choices=ROOTS,
        help="where clips that run on the spot get their motion: from themselves, or from their standing feet; in a project its "
        "databases say it",
    )
    add_engine_arguments(parser)


progress_of = partial(building_bar, tells_few=False)
"""The progress of work on clips, one by one."""
