"""Which packages of others each command loads: what only the editor or only workbooks need is loaded for them alone."""

import os
import subprocess
import sys
from pathlib import Path

import pytest
from strategies import some

from benchmarks.start import COMMANDS, EDITOR, prepare
from contextdb import cli

ROOT = Path(__file__).parent.parent
PACKAGES = {"numpy", "polars", "safetensors", "python_calamine", "xlsxwriter", "rich", "textual", "pyperclip"}
REFUSED = ("dask", "pyarrow", "scipy", "pandas", "matplotlib", "IPython")
"""What others import where they find it: no command may need it, and an import by contextdb fails."""
BEFORE = f"import sys\nsys.modules.update(dict.fromkeys({REFUSED!r}))\n"
LOADS = {
    "--version": "",
    "query": "numpy",
    "evaluate": "numpy polars",
    "check": "numpy",
    "cases": "numpy",
    "tidy": "numpy",
    "index": "numpy polars",
    "coverage": "numpy polars",
    "ci": "numpy polars",
    "diff": "numpy",
    "merge": "numpy",
    "git status": "",
    "import, of CSV": "numpy",
    "import, of Excel": "numpy python_calamine",
    "export, to CSV": "numpy",
    "export, to Excel": "numpy xlsxwriter",
    "compile": "numpy",
    "verify": "numpy safetensors",
    "motion search": "numpy safetensors",
    "demo": "numpy",
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
    assert {name.split()[0].strip(",") for name in LOADS} - {"--version"} == cli.COMMANDS.keys() - {"live", "play", "desktop"}


@pytest.mark.parametrize("name", some(LOADS, 5))
def test_a_command_loads_what_it_needs_and_no_more(name: str, folder: Path):
    script = EDITOR if name.startswith("edit") else f"from contextdb.cli import main\nmain({list(COMMANDS[name])!r})"
    environment = {**os.environ, "PYTHONPATH": str(ROOT), "TERM": "xterm-256color"}
    done = subprocess.run(
        [sys.executable, "-c", BEFORE + script + AFTER], capture_output=True, encoding="utf-8", cwd=folder, env=environment
    )
    assert done.returncode == 0, done.stderr
    loaded = {module.partition(".")[0] for module in done.stdout.splitlines()[-1].split()}
    assert REFUSED[0] in loaded  # as nothing that could be used
    assert " ".join(sorted(loaded & PACKAGES)) == LOADS[name]
