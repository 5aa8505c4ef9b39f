"""Ctrl+C in the middle of long work, as a shell sends it to a process: the command ends soon, and says no more than that."""

from __future__ import annotations

import os
import random
import signal
import subprocess
import sys
from pathlib import Path

import pytest
from running import ROOT

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="Windows has another signal for it")
N_ROWS, N_CONDITIONS = 3000, 24
LONGEST_S = 120
"""A command that does not heed the signal is killed then; the test fails."""


def large_table(path: Path) -> None:
    """A table that takes minutes to measure by the work that the test asks for."""
    rng = random.Random(1)
    rows = [[f"a{r}", *(rng.choice(("Any", "True", "False")) for _ in range(N_CONDITIONS))] for r in range(N_ROWS)]
    head = ["Asset", *(f"c{i}" for i in range(N_CONDITIONS))]
    path.write_text("".join(",".join(row) + "\n" for row in [head, *rows]), encoding="utf-8")


@pytest.mark.parametrize(
    "command",
    [("check",), ("coverage", "--work", "100000000000", "--format", "json", "--output", "report.json")],
    ids=["check", "coverage"],
)
def test_an_interrupt_after_the_first_line_of_progress_ends_the_command(command: tuple[str, ...], tmp_path: Path):
    large_table(tmp_path / "t.csv")
    before = (tmp_path / "t.csv").read_bytes()
    line = [sys.executable, "-u", "-m", "contextdb", command[0], "t.csv", *command[1:]]
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    with subprocess.Popen(
        line, cwd=tmp_path, env=environment, stdout=subprocess.PIPE, stderr=subprocess.PIPE, encoding="utf-8"
    ) as process:
        assert process.stderr is not None
        first = process.stderr.readline()
        process.send_signal(signal.SIGINT)
        try:
            out, err = process.communicate(timeout=LONGEST_S)
        finally:
            process.kill()
    assert first.startswith("contextdb: ")
    assert (process.returncode, out) == (130, "")
    assert err.splitlines()[-1] == "contextdb: interrupted"
    assert all(told.startswith("contextdb: ") for told in err.splitlines())
    assert {p.name for p in tmp_path.iterdir()} == {"t.csv"}
    assert (tmp_path / "t.csv").read_bytes() == before
