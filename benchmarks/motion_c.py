"""What characters take in C: opening a bundle, an update of one and of each of a thousand, and their memory.

    python benchmarks/motion_c.py                     the clips of updates.py, and copies of them up to 300,000 frames

The character is that of updates.py: five databases, one table, ground, a search every 0.1 s, poses; here at 60 updates a second.
Times are of the processor. motion_c.c is compiled with $CC, else cc, and -O3.
"""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
from pathlib import Path

if __package__ in (None, ""):
    sys.path[0] = str(Path(__file__).parent.parent)  # not this folder: its coverage.py is no package of that name

from benchmarks import timing, updates
from contextdb.commands.compile_command import c_motion_header
from contextdb.commands.motion_build_command import file_of
from contextdb.compiled.c_header import c_header_of
from contextdb.motion import PoseSettings
from contextdb.motion.output.bank import moving_alike
from contextdb.motion.storage.bundle import Played, bundle_of

N_FRAMES, CROWD, N_TICKS = 300_000, 1000, 20_000
SOURCE = Path(__file__).with_suffix(".c")


def main() -> None:
    """Measure both bundles."""
    print(timing.machine())
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        (folder / "contextdb_motion.h").write_text(c_motion_header(c_header_of({}, "CDB_MOTION_READER_H")), encoding="ascii")
        program = folder / "motion_c.exe"
        options = ["-std=c99", "-O3", "-ffp-contract=off", f"-I{folder}"]
        subprocess.run([os.environ.get("CC", "cc"), *options, str(SOURCE), "-lm", "-o", str(program)], check=True)
        n_frames = write_bundle(folder / "game.motion", 1)
        subprocess.run([str(program), str(folder / "game.motion"), str(CROWD), str(N_TICKS)], check=True)
        write_bundle(folder / "large.motion", -(-N_FRAMES // n_frames))
        subprocess.run([str(program), str(folder / "large.motion"), str(CROWD), str(N_TICKS)], check=True)


def write_bundle(path: Path, n_copies: int) -> int:
    """Write a bundle of the clips and copies of them; how many frames its databases have."""
    controller, schema, table, banks = updates.parts_of(n_copies)
    played = Played(controller, schema, moving_alike(banks), PoseSettings())
    databases = controller.selector.databases
    path.write_bytes(bundle_of({"player": played}, dict.fromkeys(databases, "moves"), {"moves": file_of("moves", table)}))
    return sum(len(database.features) for database in databases.values())


if __name__ == "__main__":
    main()
