"""The core is built with any C compiler, with none, and without Python.h; a build that fails says what is missing."""

import os
import subprocess
import sys
import sysconfig
import zipfile
from pathlib import Path

import pytest
from strategies import IS_FULL

ROOT = Path(__file__).parent.parent
ASK = """
import sys
import contextdb as cdb
assert cdb.__file__.startswith(sys.argv[1])
table = cdb.Table.from_columns({"Asset": ["a", "b"], "speed": ["1..3", "Any"]}, {"speed": {"type": "number"}}).compile()
print(table.query({"speed": 2.0}).assets, table.query({"speed": 5.0}).assets)
"""


def path_without_compilers(folder: Path) -> str:
    """A path on which there is nothing but what the interpreter needs."""
    folder.mkdir()
    return str(folder)


def built(path: str, *command: str, **more: str) -> subprocess.CompletedProcess[str]:
    environment = {name: value for name, value in os.environ.items() if name != "CC"} | {"PATH": path} | more
    return subprocess.run([sys.executable, *command], capture_output=True, text=True, env=environment, cwd=ROOT)


@pytest.mark.skipif(os.name == "nt", reason="a path without compilers is one without Python here")
def test_without_a_compiler_the_build_says_what_is_missing(tmp_path: Path):
    hide = "import importlib.util as u; u.find_spec = lambda name: None; "
    run = "import runpy, sys; sys.argv = ['build_core.py']; runpy.run_path('build_core.py', run_name='__main__')"
    done = built(path_without_compilers(tmp_path / "empty"), "-c", hide + run)
    assert done.returncode == 1
    assert done.stdout == ""
    assert done.stderr == (
        "contextdb's core needs a C compiler, and none of $CC, cc, gcc, clang, cl and PyPI's ziglang is there.\n"
    )


def test_a_compiler_that_is_named_and_is_not_there_is_said():
    done = built(os.environ["PATH"], "build_core.py", CC="no-such-compiler")
    assert done.returncode == 1
    assert done.stderr.startswith("contextdb's core could not be compiled by no-such-compiler: ")
    assert done.stderr.count("\n") == 1


@pytest.mark.skipif(not IS_FULL, reason="EXAMPLES=full: it downloads a compiler, 80 MB")
@pytest.mark.skipif(os.name == "nt", reason="a path without compilers is one without Python here")
@pytest.mark.skipif(bool(sysconfig.get_config_var("Py_GIL_DISABLED")), reason="this Python needs Python.h")
def test_a_wheel_is_built_without_a_compiler_and_without_the_headers_of_python(tmp_path: Path):
    path = path_without_compilers(tmp_path / "empty")
    command = ["-m", "pip", "wheel", "--quiet", "--no-deps", "--wheel-dir", str(tmp_path), "."]
    done = built(path, *command, C_INCLUDE_PATH="", CPATH="")
    if "No matching distribution" in done.stderr or "NewConnectionError" in done.stderr:
        pytest.skip("no compiler could be downloaded")
    assert done.returncode == 0, done.stderr
    [wheel] = tmp_path.glob("contextdb-*-cp311-abi3-*.whl")
    names = zipfile.ZipFile(wheel).namelist()
    assert {"contextdb/core/_core.abi3.so", "contextdb/core/core.h", "contextdb/core/_core.c"} <= set(names)
    folder = tmp_path / "installed"
    zipfile.ZipFile(wheel).extractall(folder)
    asked = subprocess.run(
        [sys.executable, "-P", "-c", ASK, str(folder)], capture_output=True, text=True, env=os.environ | {"PYTHONPATH": str(folder)}
    )
    assert asked.stdout == "['a', 'b'] ['b']\n", asked.stderr
