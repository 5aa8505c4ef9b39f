"""What `import contextdb` loads: a game's tools start it often, so it stays light."""

from __future__ import annotations

import subprocess
import sys

HEAVY = {"numba", "textual", "tui", "rich", "scipy", "dask", "safetensors", "tomlkit", "python_calamine", "xlsxwriter"}


def modules_after(statement: str) -> set[str]:
    """Top-level packages that a fresh interpreter has loaded after a statement."""
    script = f"{statement}; import sys; print(*sys.modules)"
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True)
    return {name.partition(".")[0] for name in done.stdout.split()}


def test_import_contextdb_leaves_heavy_packages_unloaded():
    loaded = modules_after("import contextdb")
    assert "contextdb" in loaded
    assert not loaded & HEAVY


def test_every_public_name_resolves_without_the_terminal_editor():
    loaded = modules_after("import contextdb; [getattr(contextdb, name) for name in contextdb.__all__]")
    assert not loaded & {"textual", "tui", "dask"}
