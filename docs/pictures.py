"""Draw the pictures of the documents: real terminal sessions as SVG, which load nothing from the network.

    python docs/pictures.py

A picture is a session beside a copy of tables/. Its commands run, and what they print is drawn with its colours. The same output
always gives the same bytes. Every word stands at its own column, so that columns are straight in any monospaced font.
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
from html import escape
from itertools import accumulate
from pathlib import Path

ROOT = Path(__file__).parent.parent
FOLDER = Path(__file__).parent / "pictures"

N_COLUMNS = 100
COLUMN_PX, LINE_PX, FONT_PX, MARGIN_PX = 8.4, 20, 14, 24
BACKGROUND, TEXT = "#1b1e25", "#cfd3dc"
FONTS = "ui-monospace, 'Cascadia Mono', 'SF Mono', Menlo, Consolas, 'DejaVu Sans Mono', monospace"
STYLES = {
    "1": 'fill="#ffffff" font-weight="bold"',
    "2": 'fill="#868d9b"',
    "31": 'fill="#f0938a"',
    "32": 'fill="#93cf96"',
    "33": 'fill="#e3c37f"',
    "36": 'fill="#80c7d4"',
}
"""What `contextdb.console` writes for bold, dim, red, green, yellow and cyan."""

_CODE = re.compile(r"\x1b\[([\d;]*)m")
_WORDS = re.compile(r"\S+(?: \S+)*")


@dataclass(frozen=True)
class Slip:
    """A mistake made in a file between two commands: `old`, which stands there, becomes `new`."""

    file: str
    old: str
    new: str


@dataclass(frozen=True)
class Picture:
    """A session: what it shows, in a sentence for those who cannot see it, and its commands and slips in order."""

    title: str
    steps: tuple[str | Slip, ...]


PICTURES = {
    "session.svg": Picture(
        "A terminal: contextdb query lists the valid assets for a context and why the nearest others are not valid; "
        "contextdb check finds a misspelt cell and names its line and what was meant.",
        (
            "contextdb query locomotion gait=Walk speed=1.3 direction=65 style=tired --explain --most 3",
            Slip("tables/locomotion.csv", "walk_fast,Walk,", "walk_fast,Wallk,"),
            "contextdb check tables/locomotion.csv",
        ),
    )
}


def draw(picture: Picture) -> str:
    """The picture as SVG."""
    lines = session(picture.steps)
    width, height = round(N_COLUMNS * COLUMN_PX) + 2 * MARGIN_PX, len(lines) * LINE_PX + 2 * MARGIN_PX
    drawn = [text for number, line in enumerate(lines) for text in texts(line, MARGIN_PX + number * LINE_PX + FONT_PX)]
    head = f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width} {height}" width="{width}" height="{height}" role="img">'
    body = [
        f"<title>{escape(picture.title)}</title>",
        f'<rect width="{width}" height="{height}" rx="8" fill="{BACKGROUND}"/>',
        f'<g font-family="{FONTS}" font-size="{FONT_PX}" fill="{TEXT}">',
        *drawn,
        "</g>",
        "</svg>",
    ]
    return "\n".join([head, *body, ""])


def session(steps: Sequence[str | Slip]) -> list[str]:
    """The lines of a terminal in which the commands ran, with their colours."""
    lines: list[str] = []
    with tempfile.TemporaryDirectory() as folder:
        shutil.copytree(ROOT / "tables", Path(folder) / "tables")
        for step in steps:
            if isinstance(step, Slip):
                make(step, Path(folder))
                continue
            lines += [*([""] if lines else []), f"\x1b[2m$\x1b[0m \x1b[1m{step}\x1b[0m", *_run(step, folder).splitlines()]
    return lines


def make(slip: Slip, folder: Path) -> None:
    path = folder / slip.file
    text = path.read_bytes().decode()
    if text.count(slip.old) != 1:
        raise ValueError(f"{slip.old!r} stands {text.count(slip.old)} times in {slip.file}, not once")
    path.write_bytes(text.replace(slip.old, slip.new).encode())


def _run(command: str, folder: str) -> str:
    _, *words = shlex.split(command)
    terminal = {"FORCE_COLOR": "1", "COLUMNS": str(N_COLUMNS), "PYTHONUTF8": "1", "PYTHONPATH": str(ROOT)}
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


def texts(line: str, y: int) -> Iterator[str]:
    """The words of a line as SVG texts; words with one space between them stay together."""
    for column, style, text in _runs(line):
        for words in _WORDS.finditer(text):
            x = MARGIN_PX + (column + words.start()) * COLUMN_PX
            attributes = f" {STYLES[style]}" if style else ""
            yield f'<text x="{x:g}" y="{y}"{attributes}>{escape(words[0], quote=False)}</text>'


def _runs(line: str) -> Iterator[tuple[int, str, str]]:
    """Column, style and text of each stretch of a line that has one style."""
    parts = _CODE.split(line)
    styles = ["", *(code.strip("0") for code in parts[1::2])]
    texts = parts[::2]
    columns = accumulate((len(text) for text in texts), initial=0)
    yield from ((c, s, t) for c, s, t in zip(columns, styles, texts, strict=False) if t)


if __name__ == "__main__":
    FOLDER.mkdir(exist_ok=True)
    for name, picture in PICTURES.items():
        (FOLDER / name).write_bytes(draw(picture).encode())
