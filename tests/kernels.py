"""Compile the kernels into numba's cache: `make` does it once, before the workers of the tests would each do it for themselves."""

from __future__ import annotations

from running import ROOT, run

import contextdb as cdb

if __name__ == "__main__":
    table = ROOT / "tables" / "locomotion.csv"
    cdb.load(table).compile().prepare(casting=True, batches=True)
    for arguments in (("coverage", table), ("demo",)):
        run(*arguments)
