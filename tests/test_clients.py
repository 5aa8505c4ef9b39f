"""Three small games, written from the pages: type checkers pass them at their strictest, and they run."""

import importlib.util
import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parent.parent
CLIENTS = sorted((ROOT / "tests" / "clients").glob("*.py"))


@pytest.fixture(scope="module")
def game(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A game's folder: the clients, sample tables, compiled files and the types of facts."""
    folder = tmp_path_factory.mktemp("game")
    shutil.copytree(ROOT / "tables", folder / "tables", ignore=shutil.ignore_patterns("clips"))
    for client in CLIENTS:
        shutil.copy(client, folder)
    command = [sys.executable, "-m", "contextdb", "compile", "tables", "-o", "build", "--stubs", "facts.py"]
    subprocess.run(command, cwd=folder, check=True, capture_output=True, env={**os.environ, "PYTHONPATH": str(ROOT)})
    return folder


def test_mypy_passes_the_clients(game: Path):
    pytest.importorskip("mypy", reason="mypy is not installed")
    cache = ["--cache-dir", str(ROOT / ".mypy_cache" / "clients")]  # what it knows of contextdb, kept
    command = [sys.executable, "-m", "mypy", "--strict", "--no-error-summary", *cache, *(client.name for client in CLIENTS)]
    done = subprocess.run(command, cwd=game, capture_output=True, text=True, env={**os.environ, "MYPYPATH": str(ROOT)})
    assert done.stdout == ""
    assert done.returncode == 0, done.stderr


def test_pyright_passes_the_clients(game: Path):
    if importlib.util.find_spec("pyright") is None:
        pytest.skip("pyright is not installed")
    settings = {"typeCheckingMode": "strict", "extraPaths": [str(ROOT)], "include": [client.name for client in CLIENTS]}
    (game / "pyrightconfig.json").write_text(json.dumps(settings), encoding="utf-8")
    command = [sys.executable, "-m", "pyright", "--pythonpath", sys.executable]
    done = subprocess.run(command, cwd=game, capture_output=True, text=True)
    assert done.returncode == 0, done.stdout


@pytest.mark.parametrize("client", [client.name for client in CLIENTS])
def test_a_client_runs(game: Path, client: str, tmp_path: Path):
    environment = {**os.environ, "PYTHONPATH": str(ROOT), "XDG_RUNTIME_DIR": str(tmp_path)}
    done = subprocess.run([sys.executable, client], cwd=game, capture_output=True, text=True, env=environment)
    assert done.returncode == 0, done.stderr
    assert done.stdout
