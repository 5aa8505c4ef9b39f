"""What `import contextdb` loads: a game's tools start it often, so it stays light."""

import subprocess
import sys
from graphlib import TopologicalSorter

import pytest
from running import ROOT

grimp = pytest.importorskip("grimp")  # of import-linter

HEAVY = {"numba", "textual", "tui", "rich", "scipy", "dask", "safetensors", "python_calamine", "xlsxwriter"}

IN_COMPILED = ("batch", "casting", "explain", "failing_rules", "live", "many", "picker", "programs", "stack")
IN_CONTEXTDB = (
    "commands.diff_backtest",
    "commands.diff_backtest",
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


@pytest.mark.parametrize(("package", "for_types"), [("contextdb", True), ("tui", False)])
def test_no_module_imports_itself_by_way_of_others(package: str, for_types: bool):
    graph = grimp.build_graph(package, cache_dir=None, exclude_type_checking_imports=not for_types)
    assert len(graph.modules) > 100
    TopologicalSorter(
        {name: graph.find_modules_directly_imported_by(name) for name in graph.modules}
    ).prepare()  # raises CycleError


def test_of_our_own_what_is_imported_for_types_alone_is_loaded_late():
    every, loaded = (
        grimp.build_graph("contextdb", "tui", cache_dir=None, exclude_type_checking_imports=is_less) for is_less in (False, True)
    )
    for name in every.modules - {"contextdb"}:  # whose public names are loaded when they are first used
        for_types = every.find_modules_directly_imported_by(name) - loaded.find_modules_directly_imported_by(name)
        assert [other for other in for_types if other.startswith("contextdb.") and not other.startswith(LATE)] == [], name


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
