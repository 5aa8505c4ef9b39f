"""Compiles the core, contextdb/core/_core.c: the build hook of pyproject.toml, and by hand `python build_core.py`.

Any C compiler does: $CC, or the first of cc, gcc, clang and cl that can link a library. Where there is none, PyPI's `ziglang` is
required for the build. Python.h is needed for free-threaded Python only; all others share one build, by the stable ABI.

CONTEXTDB_WHEEL=win_amd64, or another platform of `TARGETS`, builds for that one on any machine, with `ziglang`.
"""

from __future__ import annotations

import os
import re
import shlex
import shutil
import subprocess
import sys
import sysconfig
import tempfile
from functools import cache
from importlib.util import find_spec
from pathlib import Path
from typing import Any

try:
    from hatchling.builders.hooks.plugin.interface import BuildHookInterface
except ImportError:  # by hand; the hook is not needed
    BuildHookInterface = object

ROOT = Path(__file__).parent
CORE = Path("contextdb", "core")
ZIG = "ziglang>=0.13"
OPTIONS = ("-std=c99", "-O3", "-ffp-contract=off", "-fno-fast-math", "-fno-math-errno", "-fvisibility=hidden", "-shared")
TARGETS = {
    "manylinux_2_17_x86_64": "x86_64-linux-gnu.2.17",
    "manylinux_2_17_aarch64": "aarch64-linux-gnu.2.17",
    "musllinux_1_2_x86_64": "x86_64-linux-musl",
    "musllinux_1_2_aarch64": "aarch64-linux-musl",
    "macosx_10_13_x86_64": "x86_64-macos.10.13",
    "macosx_11_0_arm64": "aarch64-macos.11.0",
    "win_amd64": "x86_64-windows-gnu",
    "win_arm64": "aarch64-windows-gnu",
}
"""The platforms of wheels that are published, and what ziglang calls each."""
WHEEL = os.environ.get("CONTEXTDB_WHEEL", "")
HAS_STABLE_ABI = bool(WHEEL) or (sys.implementation.name == "cpython" and not sysconfig.get_config_var("Py_GIL_DISABLED"))


class CannotBuild(Exception):
    """Why the core cannot be compiled, in one sentence."""


class CoreHook(BuildHookInterface):
    """Brings the extension into a wheel; into the folder itself for an editable installation."""

    PLUGIN_NAME = "custom"

    def dependencies(self) -> list[str]:
        return [ZIG] if WHEEL or compiler() is None else []

    def initialize(self, version: str, build_data: dict[str, Any]) -> None:
        build_data["pure_python"] = False
        if HAS_STABLE_ABI:
            build_data["tag"] = f"cp311-abi3-{WHEEL or re.sub('[-.]', '_', sysconfig.get_platform())}"
        else:
            build_data["infer_tag"] = True
        try:
            if version == "editable":
                build(ROOT / CORE / extension_name())
                return
            self.folder = tempfile.TemporaryDirectory()
            built = build(Path(self.folder.name, extension_name()))
        except CannotBuild as error:
            raise SystemExit(str(error)) from None
        build_data["force_include"][str(built)] = (CORE / built.name).as_posix()

    def finalize(self, version: str, build_data: dict[str, Any], artifact_path: str) -> None:
        if version != "editable":
            self.folder.cleanup()


def extension_name() -> str:
    """The name of the file that Python imports."""
    if HAS_STABLE_ABI:
        return "_core.pyd" if system() == "win" else "_core.abi3.so"
    return f"_core{sysconfig.get_config_var('EXT_SUFFIX')}"


def system() -> str:
    """What the library is for: "win", "macosx", or another."""
    return WHEEL.partition("_")[0] or {"nt": "win"}.get(os.name) or {"darwin": "macosx"}.get(sys.platform, "")


@cache
def compiler() -> tuple[str, ...] | None:
    """The command of a compiler on the path that can link a library; None where there is none."""
    if named := os.environ.get("CC"):
        return tuple(shlex.split(named, posix=os.name != "nt"))
    with tempfile.TemporaryDirectory() as folder:
        source = Path(folder, "empty.c")
        source.write_text("#include <stdlib.h>\n#include <string.h>\nint empty(void) { return 0; }\n", encoding="ascii")
        for name in ("cc", "gcc", "clang", "cl"):
            if (found := shutil.which(name)) and _runs(command((found,), source, Path(folder, "empty.so"), is_python=False)):
                return (found,)
    return None


def command(cc: tuple[str, ...], source: Path, target: Path, is_python: bool = True) -> list[str]:
    """The command that compiles one source to a library."""
    paths = sysconfig.get_paths()
    headers = [] if HAS_STABLE_ABI or not is_python else [f"-I{paths['include']}", "-DCDBP_HEADERS"]
    libraries = []
    if os.name == "nt" and is_python and not WHEEL:
        stable, own = "python3.lib", f"python{sys.version_info.major}{sys.version_info.minor}t.lib"
        libraries = [str(Path(sys.base_prefix, "libs", stable if HAS_STABLE_ABI else own))]
    if Path(cc[0]).stem.casefold() == "cl":
        return [*cc, "/nologo", "/O2", "/std:c11", "/fp:strict", "/LD", *headers, str(source), *libraries, f"/Fe:{target}"]
    more = {"macosx": ["-undefined", "dynamic_lookup"], "win": []}.get(system(), ["-fPIC"])
    if WHEEL:
        more += ["-target", TARGETS[WHEEL], "-s"]
        libraries = [str(import_library(target.parent))] if system() == "win" else []
    return [*cc, *OPTIONS, *more, *headers, str(source), *libraries, "-o", str(target)]


def import_library(folder: Path) -> Path:
    """What Windows links instead of python3.dll: made of the names that abi.h declares."""
    text = (ROOT / CORE / "abi.h").read_text(encoding="ascii")
    data = {name for line in re.findall(r"^CDBP_DATA (.*);", text, re.M) for name in re.findall(r"\b_?Py\w+(?=[,;]|$)", line)}
    functions = set(re.findall(r"\b(Py\w+)\(", text[text.index("/* References") :]))
    lines = ["LIBRARY python3.dll", "EXPORTS", *sorted(functions), *(f"{name} DATA" for name in sorted(data))]
    definition, library = folder / "python3.def", folder / "python3.lib"
    definition.write_text("\n".join(lines) + "\n", encoding="ascii")
    machine = "arm64" if WHEEL == "win_arm64" else "i386:x86-64"
    line = [sys.executable, "-m", "ziglang", "dlltool", "-m", machine, "-d", str(definition), "-l", str(library)]
    done = subprocess.run(line, capture_output=True, text=True, errors="replace")
    if done.returncode:
        raise CannotBuild(f"the import library of python3.dll could not be made: {done.stderr}")
    return library


def build(target: Path) -> Path:
    """Compile the core to a file, which is exchanged as a whole. Raises CannotBuild with what is missing."""
    if not HAS_STABLE_ABI and not Path(sysconfig.get_paths()["include"], "Python.h").is_file():
        raise CannotBuild("contextdb's core needs Python.h for this Python, which has no stable ABI: install its headers.")
    if WHEEL and WHEEL not in TARGETS:
        raise CannotBuild(f"CONTEXTDB_WHEEL={WHEEL} is no platform that contextdb is built for. Accepted: {', '.join(TARGETS)}.")
    cc = (None if WHEEL else compiler()) or ((sys.executable, "-m", "ziglang", "cc") if find_spec("ziglang") else None)
    if cc is None:
        raise CannotBuild("contextdb's core needs a C compiler, and none of $CC, cc, gcc, clang, cl and PyPI's ziglang is there.")
    beside = target.with_name(f"{os.getpid()}{target.name}")
    try:
        done = subprocess.run(
            command(cc, ROOT / CORE / "_core.c", beside), capture_output=True, text=True, errors="replace", cwd=target.parent
        )
        if done.returncode:
            raise CannotBuild(f"contextdb's core could not be compiled by {shlex.join(cc)}:\n{done.stdout}{done.stderr}")
        os.replace(beside, target)
    except OSError as error:
        raise CannotBuild(f"contextdb's core could not be compiled by {shlex.join(cc)}: {error}") from None
    finally:
        beside.unlink(missing_ok=True)
    return target


def _runs(line: list[str]) -> bool:
    try:
        return subprocess.run(line, capture_output=True, cwd=Path(line[-1]).parent if os.name != "nt" else None).returncode == 0
    except OSError:
        return False


if __name__ == "__main__":
    try:
        print(build(ROOT / CORE / extension_name()).relative_to(ROOT).as_posix())
    except CannotBuild as error:
        sys.exit(str(error))
