"""Build the page: python -m examples.web FOLDER    (needs PyPI's ziglang)

Writes motion.wasm, game.motion, index.html and page.js into a folder (build/web), which any web server serves as it is; and all of
them in one file, one_file.html, which needs no server:

    python -m http.server --directory build/web
"""

from __future__ import annotations

import argparse
import base64
import shutil
import subprocess
import sys
from pathlib import Path

from contextdb import motion
from contextdb.cli import main as contextdb

HERE = Path(__file__).parent
PAGE = ("index.html", "page.js")
OPTIONS = ("-target", "wasm32-wasi", "-mexec-model=reactor", "-std=c99", "-O2", "-ffp-contract=off", "-Wl,--strip-all")


def main() -> int:
    parser = argparse.ArgumentParser(prog="python -m examples.web", description=__doc__.splitlines()[0])
    parser.add_argument("folder", nargs="?", type=Path, default=Path("build", "web"))
    given = parser.parse_args()
    build(given.folder)
    print(given.folder / "index.html")
    return 0


def build(folder: Path) -> None:
    """Write the whole page into a folder. Raises RuntimeError with what the compiler or contextdb says."""
    folder.mkdir(parents=True, exist_ok=True)
    project = folder / "project"
    shutil.copytree(HERE / "tables", project, dirs_exist_ok=True)
    (project / "clips").mkdir(exist_ok=True)
    motion.write_made_clips(project / "clips")
    for words in (
        ["compile", project, "--c-motion", folder / "contextdb_motion.h"],
        ["motion", "build", project, "--bundle", folder / "game.motion"],
    ):
        if contextdb([str(word) for word in words]) != 0:
            raise RuntimeError(f"contextdb {words[0]} did not end well")
    compile_player(folder, folder / "motion.wasm")
    for name in PAGE:
        shutil.copyfile(HERE / name, folder / name)
    (folder / "one_file.html").write_text(in_one_file(folder), encoding="utf-8")
    shutil.rmtree(project)


def in_one_file(folder: Path) -> str:
    """The page with its script, the module and the bundle in it."""
    page, script = ((folder / name).read_text(encoding="utf-8") for name in PAGE)
    files = [(name, base64.b64encode((folder / name).read_bytes()).decode()) for name in ("motion.wasm", "game.motion")]
    inside = "".join(f'<script type="text/plain" id="{name}">{data}</script>\n' for name, data in files)
    return page.replace('<script type="module" src="page.js"></script>\n', f'{inside}<script type="module">\n{script}</script>\n')


def compile_player(headers: Path, target: Path) -> None:
    """Compile player.c, with contextdb_motion.h of a folder, to one WebAssembly module."""
    line = [sys.executable, "-m", "ziglang", "cc", *OPTIONS, f"-I{headers}", str(HERE / "player.c"), "-o", str(target)]
    done = subprocess.run(line, capture_output=True, text=True)
    if done.returncode:
        raise RuntimeError(f"the module could not be compiled:\n{done.stderr}")


if __name__ == "__main__":
    sys.exit(main())
