"""What the commands on clips share: the folder, the unit and the axis as arguments, and progress clip by clip."""

from __future__ import annotations

import argparse
from collections.abc import Iterator
from contextlib import contextmanager

from contextdb.commands.numbers import unit_of
from contextdb.commands.progress import MANY_CLIPS, bar
from contextdb.console import printable
from contextdb.motion.clips.clip import UPS
from contextdb.tables.clip_folder import Tell
from contextdb.tables.project import SCHEMA_FILE


def add_clip_arguments(parser: argparse.ArgumentParser) -> None:
    """The folder, and what its files leave open."""
    parser.add_argument("path", metavar="FOLDER", help=f"a folder of BVH clips, or of tables with {SCHEMA_FILE}")
    parser.add_argument(
        "--metres-per-unit", metavar="M", type=unit_of, help="the unit of the files (default: as the project says, else by size)"
    )
    parser.add_argument(
        "--up", choices=UPS, help="the axis that points up (default: as the project says, else in which bodies stand)"
    )


@contextmanager
def progress_of(label: str) -> Iterator[Tell]:
    with bar(label, is_long=True) as shown:

        def tell(done: int, total: int, clip: str) -> None:
            if shown is not None and total >= MANY_CLIPS:
                shown(done, total, f"{done}/{total} {printable(clip)}")

        yield tell
