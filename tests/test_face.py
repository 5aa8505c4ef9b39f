"""The names of `contextdb` itself: the same for the interpreter, for type checkers and in `dir`; what goes away says so."""

from __future__ import annotations

import ast
import importlib
import re

import pytest
from running import ROOT
from test_imports import modules_after

import contextdb as cdb
from contextdb import errors, motion

OLD = {"ClipError": motion.ClipError, "MotionError": motion.MotionError, "QueryError": motion.QueryError}


def for_checkers() -> dict[str, str]:
    """The module of each name that `contextdb/__init__.py` imports for type checkers alone."""
    body = ast.parse((ROOT / "contextdb" / "__init__.py").read_text(encoding="utf-8")).body
    block = next(node for node in body if isinstance(node, ast.If) and ast.unparse(node.test) == "TYPE_CHECKING")
    assert all(isinstance(node, ast.ImportFrom) for node in block.body)
    return {alias.name: node.module for node in block.body for alias in node.names}  # type: ignore[attr-defined]


def test_the_interpreter_type_checkers_and_a_star_import_see_the_same_names():
    homes = for_checkers()
    assert homes.pop("motion") == "contextdb"
    assert {name: f"contextdb.{module}" for name, module in cdb._HOME_OF.items()} == homes
    assert sorted([*cdb.__all__, "__version__"]) == sorted(homes)


def test_dir_lists_what_there_is():
    assert dir(cdb) == sorted([*cdb.__all__, "__version__", "motion"])
    assert all(getattr(cdb, name) is not None for name in dir(cdb))


def test_motion_is_there_without_an_import_of_its_own_and_loaded_when_it_is_used():
    assert cdb.motion is motion
    assert "numba" not in modules_after("import contextdb; contextdb.motion.MotionDatabase")
    script = "import contextdb; contextdb.motion; contextdb.__version__"
    assert "contextdb" in modules_after(script)


def test_a_name_that_there_is_not_is_an_attribute_error():
    with pytest.raises(AttributeError, match="module 'contextdb' has no attribute 'Projectt'"):
        cdb.Projectt  # type: ignore[attr-defined]  # noqa: B018


@pytest.mark.parametrize("name", OLD)
def test_the_errors_of_motion_are_in_motion_and_their_old_names_warn(name: str):
    with pytest.warns(DeprecationWarning, match="goes away") as caught:
        assert getattr(cdb, name) is OLD[name]
    said = f"contextdb.{name} goes away in contextdb {errors.GONE_IN}. Use contextdb.motion.{name}."
    assert [(str(w.message), w.filename) for w in caught] == [(said, __file__)]
    assert name not in cdb.__all__
    assert name not in dir(cdb)


def test_an_old_name_warns_whoever_imports_it():
    with pytest.warns(DeprecationWarning, match=r"Use contextdb\.motion\.QueryError"):
        exec("from contextdb import QueryError")


def test_our_own_warnings_of_old_names_are_errors_in_the_tests():
    with pytest.raises(DeprecationWarning, match="goes away in contextdb"):
        cdb.ClipError  # type: ignore[attr-defined]  # noqa: B018
    with pytest.raises(DeprecationWarning, match="goes away in contextdb"):
        errors.warn_of_old("the old", "the new")


def test_what_goes_away_stays_one_minor_version():
    """Fails when the version is raised: remove what GONE_IN names, then raise GONE_IN."""
    major, minor = map(int, cdb.__version__.split(".")[:2])
    assert f"{major}.{minor + 1}" == errors.GONE_IN


def test_the_public_modules_have_the_names_that_they_list():
    for name in ("contextdb", "contextdb.motion", "contextdb.telemetry"):
        module = importlib.import_module(name)
        assert len(set(module.__all__)) == len(module.__all__)
        assert all(getattr(module, public) is not None for public in module.__all__)


def test_no_code_or_page_of_ours_uses_an_old_name():
    old = re.compile(rf"\b(?:cdb|contextdb)\.(?:{'|'.join(OLD)})\b(?! goes)|from contextdb import [^#\n]*\b(?:{'|'.join(OLD)})\b")
    folders = [ROOT / name for name in ("contextdb", "tui", "tests", "benchmarks", "docs")]
    files = [path for folder in folders for path in folder.rglob("*.*") if path.suffix in (".py", ".md")]
    assert len(files) > 500
    tests = {ROOT / "tests" / name for name in ("test_face.py", "test_stubs.py")}
    assert [path.name for path in files if path not in tests and old.search(path.read_text(encoding="utf-8"))] == []
