"""Ctrl+C in the middle of long work, as a shell sends it to a process: the command ends soon, and says no more than that."""

import os
import random
import signal
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest
from running import ROOT
from strategies import some
from warm_start import python

from contextdb.commands.demo_command import make_sample, sample_folder

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="Windows has another signal for it")
N_ROWS, N_CONDITIONS = 3000, 24
LONGEST_S = 120
"""A command that does not heed the signal is killed then; the test fails."""


def large_table(path: Path) -> None:
    """A table that takes minutes to measure by the work that the test asks for."""
    write_rows(path, N_ROWS, ("Any", "True", "False"))


def write_rows(path: Path, n_rows: int, cells: tuple[str, ...], separator: str = ",") -> None:
    rng = random.Random(1)
    rows = [[f"a{r}", *rng.choices(cells, k=N_CONDITIONS)] for r in range(n_rows)]
    head = ["Asset", *(f"c{i}" for i in range(N_CONDITIONS))]
    path.write_text("".join(separator.join(row) + "\n" for row in [head, *rows]), encoding="utf-8")


def many_contexts(folder: Path) -> None:
    large_table(folder / "t.csv")
    write_rows(folder / "contexts.csv", 200_000, ("True", "False"))


def many_clips(folder: Path) -> None:
    """A project of the sample's clips, each a hundred times under another name."""
    make_sample(sample_folder(), folder / "game")
    table, clips = folder / "game" / "locomotion.csv", folder / "game" / "clips"
    head, *rows = table.read_text(encoding="utf-8").splitlines()
    copies = []
    for row in rows[:8]:
        name, comma, cells = row.partition(",")
        text = (clips / f"{name}.bvh").read_bytes()
        for i in range(100):
            (clips / f"{name}_{i}.bvh").write_bytes(text)
            copies.append(f"{name}_{i}{comma}{cells}")
    table.write_text("\n".join([head, *rows, *copies, ""]), encoding="utf-8")


CASES = {
    "check": (lambda folder: large_table(folder / "t.csv"), ("check", "t.csv")),
    "coverage": (
        lambda folder: large_table(folder / "t.csv"),
        ("coverage", "t.csv", "--work", "100000000000", "--format", "json", "--output", "report.json"),
    ),
    "evaluate": (many_contexts, ("evaluate", "t.csv", "contexts.csv", "--out", "out.csv")),
    "import": (lambda folder: write_rows(folder / "big.csv", 100_000, ("1", "2", "700"), ";"), ("import", "big.csv", "d.csv")),
    "motion build": (many_clips, ("motion", "build", "game", "--no-cache")),
}


@pytest.mark.parametrize(("make", "command"), some(CASES.values()), ids=some(CASES))
def test_an_interrupt_after_the_first_line_of_progress_ends_the_command(
    make: Callable[[Path], None], command: tuple[str, ...], tmp_path: Path
):
    make(tmp_path)
    before = files_in(tmp_path)
    line = python("-u", "-m", "contextdb", *command)
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
    assert first.startswith(("contextdb: ", "big.csv: "))
    assert (process.returncode, out) == (130, "")
    assert err.splitlines()[-1] == "contextdb: interrupted"
    assert "Traceback" not in err
    assert files_in(tmp_path) == before


def files_in(folder: Path) -> dict[str, bytes]:
    return {str(p.relative_to(folder)): p.read_bytes() for p in folder.rglob("*") if p.is_file()}
