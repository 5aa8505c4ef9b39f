"""Compile the kernels into numba's cache: `make` does it once, before the workers of the tests would each do it for themselves.

What is there already goes first: numba looks only at a function's own file, not at those of the functions that it calls.
"""

from __future__ import annotations

from pathlib import Path
from tempfile import TemporaryDirectory

from running import ROOT, run

import contextdb as cdb

if __name__ == "__main__":
    for kept in (ROOT / "contextdb").rglob("*.nb[ic]"):
        kept.unlink()
    table = ROOT / "tables" / "locomotion.csv"
    cdb.load(table).compile().prepare(casting=True, batches=True)
    with TemporaryDirectory() as folder:
        moments = Path(folder) / "moments.csv"
        moments.write_text("gait,speed,direction,style\nWalk,1.3,0,normal\n", encoding="utf-8")
        run("evaluate", table, moments)
        run("coverage", table, "--telemetry", moments)
    for arguments in (("coverage", table), ("demo",)):
        run(*arguments)
