"""What `import contextdb` loads: a game's tools start it often, so it stays light."""

from __future__ import annotations

import ast
import subprocess
import sys
from functools import cache
from graphlib import TopologicalSorter
from pathlib import Path

from running import ROOT

HEAVY = {"numba", "textual", "tui", "rich", "scipy", "dask", "safetensors", "python_calamine", "xlsxwriter"}

IN_COMPILED = ("batch", "casting", "explain", "failing_rules", "live", "many", "picker", "programs", "stack")
IN_CONTEXTDB = (
    "commands.diff_backtest",
    "commands.diff_sessions",
    "expressions",
    "tables.merging",
    "report",
    "motion",
    *(f"compiled.{name}" for name in IN_COMPILED),
)
LATE = tuple(f"contextdb.{name}" for name in IN_CONTEXTDB)
"""What only some tables or some questions need: it is loaded when it is first used."""


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


def test_of_our_own_what_is_imported_for_types_alone_is_loaded_late():
    ours: dict[str, set[str]] = {}
    for package in ("contextdb", "tui"):
        for path in (ROOT / package).rglob("*.py"):
            for block in ast.walk(tree_of(path)):
                if isinstance(block, ast.If) and ast.unparse(block.test) == "TYPE_CHECKING":
                    named = [node.module or "" for node in block.body if isinstance(node, ast.ImportFrom)]
                    ours.setdefault(module_of(path), set()).update(n for n in named if n.startswith(("contextdb.", "tui")))
    del ours["contextdb"]  # whose public names are loaded when they are first used
    assert {name for names in ours.values() for name in names if not name.startswith(LATE)} == set()


def test_a_query_of_a_plain_table_loads_nothing_that_only_other_questions_need(tmp_path):
    (tmp_path / "jumps.csv").write_text("Asset Name,speed\njump,0..5\n", encoding="utf-8")
    script = "from contextdb.cli import main; import sys; main(sys.argv[1:]); print(*sys.modules)"
    command = [sys.executable, "-c", script, "query", str(tmp_path / "jumps.csv"), "speed=3"]
    loaded = set(subprocess.run(command, capture_output=True, text=True, check=True).stdout.split())
    loaded.remove("contextdb.compiled.explain")  # what the command asks
    assert {name for name in loaded if name.startswith((*LATE, "numpy.ma.", "polars"))} == set()


def test_the_house_has_twenty_two_rooms_beside_its_doors():
    entries = {path.stem for path in (ROOT / "contextdb").iterdir() if path.suffix == ".py" or (path / "__init__.py").exists()}
    assert len(entries - {"__init__", "__main__", "cli"}) <= 22
