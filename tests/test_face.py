"""The names of `contextdb` itself: the same for the interpreter, for type checkers and in `dir`."""

import ast
import importlib

import pytest
from running import ROOT
from test_imports import modules_after

import contextdb as cdb
from contextdb import motion


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


def test_the_public_modules_have_the_names_that_they_list():
    for name in ("contextdb", "contextdb.motion", "contextdb.telemetry"):
        module = importlib.import_module(name)
        assert len(set(module.__all__)) == len(module.__all__)
        assert all(getattr(module, public) is not None for public in module.__all__)
