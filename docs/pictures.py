"""Draw the pictures of the documents: terminal sessions, screens of the editor and strips of poses, as SVG that loads nothing from
the network.

    python docs/pictures.py [NAME...]

A session is drawn with what its commands print beside a copy of tables/; a screen with what the editor shows there after some keys.
The same program always gives the same bytes.
"""

from __future__ import annotations

import os
import re
import shlex
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import accumulate
from pathlib import Path

from drawing import Look, Run, Sheet, svg

from screens import SCENES, Scene, draw_scene  # isort: skip - it says where tui is
from debug_screens import DEBUG_SCENES, DebugScene, draw_debug_scene
from slips import Slip, make
from strips import STRIPS, Strip, draw_strip

ROOT = Path(__file__).parent.parent
FOLDER = Path(__file__).parent / "pictures"

PAPER = Sheet(n_columns=100, margin_px=24, ground="#1b1e25", colour="#cfd3dc")
LOOKS = {
    "": Look(),
    "1": Look("#ffffff", is_bold=True),
    "2": Look("#868d9b"),
    "31": Look("#f0938a"),
    "32": Look("#93cf96"),
    "33": Look("#e3c37f"),
    "36": Look("#80c7d4"),
}
"""What `contextdb.console` writes for bold, dim, red, green, yellow and cyan."""

_CODE = re.compile(r"\x1b\[([\d;]*)m")


@dataclass(frozen=True)
class Picture:
    """A session: what it shows, in a sentence for those who cannot see it, and its commands and slips in order."""

    title: str
    steps: tuple[str | Slip, ...]


PICTURES: dict[str, Picture | Scene | DebugScene | Strip] = {
    "session.svg": Picture(
        "A terminal: contextdb query lists the valid assets for a context and why the nearest others are not valid; "
        "contextdb check finds a misspelt cell and names its line and what was meant.",
        (
            "contextdb query locomotion gait=Walk speed=1.3 direction=65 style=tired --explain --most 3",
            Slip("tables/locomotion.csv", "walk_fast,Walk,", "walk_fast,Wallk,"),
            "contextdb check tables/locomotion.csv",
        ),
    ),
    **SCENES,
    **DEBUG_SCENES,
    **STRIPS,
}


def draw(picture: Picture | Scene | DebugScene | Strip) -> str:
    """The picture as SVG."""
    if isinstance(picture, Strip):
        return draw_strip(picture, PAPER)
    with tempfile.TemporaryDirectory() as folder:
        shutil.copytree(ROOT / "tables", Path(folder) / "tables")
        if isinstance(picture, DebugScene):
            return draw_debug_scene(picture, Path(folder))
        if isinstance(picture, Scene):
            return draw_scene(picture, Path(folder))
        return svg(picture.title, [runs(line) for line in session(picture.steps, Path(folder))], PAPER)


def session(steps: Sequence[str | Slip], folder: Path) -> list[str]:
    """The lines of a terminal in which the commands ran, with their colours."""
    lines: list[str] = []
    for step in steps:
        if isinstance(step, Slip):
            make(step, folder)
            continue
        lines += [*([""] if lines else []), f"\x1b[2m$\x1b[0m \x1b[1m{step}\x1b[0m", *_run(step, folder).splitlines()]
    return lines


def _run(command: str, folder: Path) -> str:
    _, *words = shlex.split(command)
    terminal = {"FORCE_COLOR": "1", "COLUMNS": str(PAPER.n_columns), "PYTHONUTF8": "1", "PYTHONPATH": str(ROOT)}
    done = subprocess.run(
        [sys.executable, "-m", "contextdb", *words],
        cwd=folder,
        env={k: v for k, v in os.environ.items() if k != "NO_COLOR"} | terminal,
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        encoding="utf-8",
    )
    return done.stdout


def runs(line: str) -> Iterator[Run]:
    """The stretches of a line that have one style each."""
    parts = _CODE.split(line)
    codes = ["", *(code.strip("0") for code in parts[1::2])]
    texts = parts[::2]
    columns = accumulate((len(text) for text in texts), initial=0)
    yield from (Run(column, text, LOOKS[code]) for column, code, text in zip(columns, codes, texts, strict=False) if text)


def main(names: Sequence[str]) -> None:
    """Draw the pictures of these names, or all of them; pictures that nothing draws any more go."""
    FOLDER.mkdir(exist_ok=True)
    for name in names or PICTURES:
        (FOLDER / name).write_bytes(draw(PICTURES[name]).encode())
    for path in FOLDER.glob("*.svg"):
        if path.name not in PICTURES:
            path.unlink()


if __name__ == "__main__":
    main(sys.argv[1:])
