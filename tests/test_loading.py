"""Which packages of others each command loads: what only the editor or only workbooks need is loaded for them alone."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest
from strategies import some

from benchmarks.start import COMMANDS, EDITOR, prepare
from contextdb import cli

ROOT = Path(__file__).parent.parent
PACKAGES = {
    "numpy", "polars", "numba", "safetensors", "python_calamine", "xlsxwriter", "rich", "textual", "pyperclip",
    "dask", "pyarrow", "scipy",
}  # fmt: skip
LOADS = {
    "--version": "",
    "query": "numpy polars",
    "evaluate": "numpy polars",
    "check": "numpy polars",
    "coverage": "numba numpy polars",
    "diff": "numpy polars",
    "merge": "numpy polars",
    "git status": "",
    "import, of CSV": "numpy polars",
    "import, of Excel": "numpy polars python_calamine",
    "export, to CSV": "numpy polars",
    "export, to Excel": "numpy polars xlsxwriter",
    "compile": "numpy polars",
    "verify": "numpy polars safetensors",
    "motion search": "numpy polars safetensors",
    "demo": "numba numpy polars",
    "edit, first paint": "numpy polars rich textual",
}
AFTER = "\nimport sys\nprint(*sys.modules)"


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder in which every command runs."""
    made = tmp_path_factory.mktemp("loading")
    prepare(made)
    return made


def test_every_command_is_here_that_works_without_a_running_game():
    assert LOADS.keys() == COMMANDS.keys()
    assert {name.split()[0].strip(",") for name in LOADS} - {"--version"} == cli.COMMANDS.keys() - {"live"}


@pytest.mark.parametrize("name", some(LOADS))
def test_a_command_loads_what_it_needs_and_no_more(name: str, folder: Path):
    script = EDITOR if name.startswith("edit") else f"from contextdb.cli import main\nmain({list(COMMANDS[name])!r})"
    environment = {**os.environ, "PYTHONPATH": str(ROOT), "TERM": "xterm-256color"}
    done = subprocess.run(
        [sys.executable, "-c", script + AFTER], capture_output=True, encoding="utf-8", cwd=folder, env=environment
    )
    assert done.returncode == 0, done.stderr
    loaded = {module.partition(".")[0] for module in done.stdout.splitlines()[-1].split()}
    assert " ".join(sorted(loaded & PACKAGES)) == LOADS[name]
