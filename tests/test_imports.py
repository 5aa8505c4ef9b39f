"""What `import contextdb` loads: a game's tools start it often, so it stays light."""

from __future__ import annotations

import ast
import re
import subprocess
import sys
from functools import cache
from graphlib import TopologicalSorter
from pathlib import Path

from running import ROOT

HEAVY = {"numba", "textual", "tui", "rich", "scipy", "dask", "safetensors", "python_calamine", "xlsxwriter"}


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


def module_of(path: Path) -> str:
    """The dotted name of a module's file."""
    parts = path.relative_to(ROOT).with_suffix("").parts
    return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)


@cache
def tree_of(path: Path) -> ast.Module:
    """What a module says."""
    return ast.parse(path.read_text(encoding="utf-8"))


def imports_of(path: Path, modules: set[str]) -> set[str]:
    """The modules that a file imports, wherever in the file, for types too."""
    found = set()
    for node in ast.walk(tree_of(path)):
        if isinstance(node, ast.Import):
            found |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom) and node.module is not None:
            names = {f"{node.module}.{alias.name}" for alias in node.names}
            found |= (names & modules) | ({node.module} if names - modules else set())
    return (found & modules) - {module_of(path)}


def test_no_module_imports_itself_by_way_of_others():
    files = {module_of(path): path for package in ("contextdb", "tui") for path in (ROOT / package).rglob("*.py")}
    assert len(files) > 400
    TopologicalSorter({name: imports_of(path, set(files)) for name, path in files.items()}).prepare()  # raises CycleError


def test_what_is_imported_for_types_alone_is_of_others_and_heavy():
    ours = set()
    for package in ("contextdb", "tui"):
        for path in (ROOT / package).rglob("*.py"):
            for block in ast.walk(tree_of(path)):
                if isinstance(block, ast.If) and ast.unparse(block.test) == "TYPE_CHECKING":
                    ours |= {
                        (module_of(path), ast.unparse(node))
                        for node in block.body
                        if re.search(r"(contextdb|tui)\.", ast.unparse(node))
                    }
    assert {module for module, _ in ours} == {"contextdb"}  # whose public names are loaded when they are first used


def test_the_house_has_twenty_rooms_beside_its_doors():
    entries = {path.stem for path in (ROOT / "contextdb").iterdir() if path.suffix == ".py" or (path / "__init__.py").exists()}
    assert len(entries - {"__init__", "__main__", "cli"}) <= 20
