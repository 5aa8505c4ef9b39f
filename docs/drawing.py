"""Terminal pictures as SVG: lines of styled text that load nothing, and look alike in any monospaced font.

Every word stands at its own column. Lines, blocks and dots are drawn as shapes, so that frames are whole and bars are straight
whatever the font. The same lines always give the same bytes.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from html import escape

COLUMN_PX, LINE_PX, FONT_PX, BASELINE_PX = 8.4, 20, 14, 14
FONTS = "ui-monospace,'Cascadia Mono','SF Mono',Menlo,Consolas,'DejaVu Sans Mono',monospace"

_WORDS = re.compile(r"\S+(?: \S+)*")


@dataclass(frozen=True)
class Look:
    """How a stretch of text looks; an empty colour is that of the picture."""

    colour: str = ""
    ground: str = ""
    is_bold: bool = False
    is_underlined: bool = False

    def css(self) -> str:
        """The look as declarations, without its ground."""
        said = [f"fill:{self.colour}"] if self.colour else []
        said += ["font-weight:bold"] if self.is_bold else []
        said += ["text-decoration:underline"] if self.is_underlined else []
        return ";".join(said)


@dataclass(frozen=True)
class Run:
    """A stretch of a line that looks the same from its first to its last character."""

    column: int
    text: str
    look: Look = Look()


@dataclass(frozen=True)
class Sheet:
    """What a picture is drawn on."""

    n_columns: int
    margin_px: int
    ground: str
    colour: str


def svg(title: str, lines: Sequence[Iterable[Run]], sheet: Sheet) -> str:
    """The lines as SVG."""
    runs = [list(line) for line in lines]
    margin = sheet.margin_px
    width, height = round(sheet.n_columns * COLUMN_PX) + 2 * margin, len(runs) * LINE_PX + 2 * margin
    looks = {css: f"s{i}" for i, css in enumerate(dict.fromkeys(filter(None, (run.look.css() for line in runs for run in line))))}
    style = "".join(f".{name}{{{css}}}" for css, name in looks.items())
    parts = [
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width} {height}" width="{width}" height="{height}" role="img">',
        f"<title>{escape(title)}</title>",
        f"<style>g{{font:{FONT_PX}px {FONTS};fill:{sheet.colour}}}{style}</style>",
        f'<rect width="{width}" height="{height}" rx="8" fill="{sheet.ground}"/>',
        f'<g transform="translate({margin} {margin})">',
        *_grounds(runs, sheet.ground),
        *(text for y, line in enumerate(runs) if (text := _text(line, y * LINE_PX + BASELINE_PX, looks))),
        *_shapes(runs, looks),
        "</g>",
        "</svg>",
    ]
    return "\n".join([*parts, ""])


def words(run: Run) -> Iterator[tuple[int, str]]:
    """The words of a run with their columns; words with one space between them stay together."""
    text = "".join(" " if _is_shape(c) else c for c in run.text)
    yield from ((run.column + found.start(), found[0]) for found in _WORDS.finditer(text))


def _text(line: Sequence[Run], y: int, looks: dict[str, str]) -> str:
    spans = [
        f'<tspan x="{column * COLUMN_PX:g}"{_class(run.look, looks)}>{escape(text, quote=False)}</tspan>'
        for run in line
        for column, text in words(run)
    ]
    return f'<text y="{y}">{"".join(spans)}</text>' if spans else ""


def _class(look: Look, looks: dict[str, str]) -> str:
    return f' class="{looks[look.css()]}"' if look.css() else ""


def _grounds(lines: Sequence[Sequence[Run]], ground: str) -> Iterator[str]:
    """A shape for each colour behind the text; what stands under the same on the line above grows with it."""
    paths: dict[str, list[str]] = {}
    open_ones: dict[tuple[float, float, str], tuple[int, int]] = {}
    for y in range(len(lines) + 1):
        here = set(_stretches(lines[y])) if y < len(lines) else set()
        for stretch in [s for s in open_ones if s not in here]:
            top, n_lines = open_ones.pop(stretch)
            left, width, colour = stretch
            paths.setdefault(colour, []).append(f"M{left:g} {top * LINE_PX}h{width:g}v{n_lines * LINE_PX}h{-width:g}z")
        for stretch in sorted(here):
            top, n_lines = open_ones.get(stretch, (y, 0))
            open_ones[stretch] = top, n_lines + 1
    for colour in sorted(paths):
        if colour != ground:
            yield f'<path fill="{colour}" d="{"".join(sorted(paths[colour]))}"/>'


def _stretches(line: Sequence[Run]) -> Iterator[tuple[float, float, str]]:
    """Left, width and colour of what is filled behind a line."""
    start, stop, colour = 0, 0, ""
    for run in line:
        if run.look.ground != colour or run.column != stop:
            if colour:
                yield start * COLUMN_PX, (stop - start) * COLUMN_PX, colour
            start, colour = run.column, run.look.ground
        stop = run.column + len(run.text)
    if colour:
        yield start * COLUMN_PX, (stop - start) * COLUMN_PX, colour


# ---- lines, blocks and dots

_MID_X, _MID_Y = COLUMN_PX / 2, LINE_PX / 2
_ARMS = {  # left, right, up, down
    "─": "lr", "━": "LR", "│": "ud", "┃": "UD", "┌": "rd", "┐": "ld", "└": "ru", "┘": "lu", "├": "rud", "┤": "lud",
    "┬": "lrd", "┴": "lru", "┼": "lrud", "╭": "rd", "╮": "ld", "╰": "ru", "╯": "lu", "╸": "L", "╺": "R", "╶": "r", "╴": "l",
}  # fmt: skip
_BLOCKS = {
    **{chr(0x2581 + i): (0, 1 - (i + 1) / 8, 1, (i + 1) / 8) for i in range(8)},
    **{chr(0x2589 + i): (0, 0, 1 - (i + 1) / 8, 1) for i in range(7)},
    "▀": (0, 0, 1, 0.5),
    "▐": (0.5, 0, 0.5, 1),
    "▔": (0, 0, 1, 0.125),
    "▕": (0.875, 0, 0.125, 1),
}
"""Left, top, width and height of block characters, as shares of a cell."""
_SHADES = {"░": 0.25, "▒": 0.5, "▓": 0.75}


def _is_shape(character: str) -> bool:
    return character in _ARMS or character in _BLOCKS or character in _SHADES or 0x2800 <= ord(character) <= 0x28FF


def _shapes(lines: Sequence[Sequence[Run]], looks: dict[str, str]) -> Iterator[str]:
    """A path for each look, in the order of their first use."""
    paths: dict[str, list[str]] = {}
    for y, line in enumerate(lines):
        for run in line:
            for character, first, n in _repeats(run):
                x, top = (run.column + first) * COLUMN_PX, y * LINE_PX
                kind = f' fill-opacity="{_SHADES[character]}"' if character in _SHADES else ""
                paths.setdefault(_class(run.look, looks) + kind, []).extend(_shape(character, x, top, n))
    yield from (f'<path{attributes} d="{"".join(path)}"/>' for attributes, path in paths.items())


def _repeats(run: Run) -> Iterator[tuple[str, int, int]]:
    """Characters that are shapes, where each begins in the run, and how many of them stand side by side."""
    at = 0
    while at < len(run.text):
        character, n = run.text[at], 1
        while character in "─━█▔▁░▒▓▀▄" and run.text[at + n : at + n + 1] == character:
            n += 1
        if _is_shape(character):
            yield character, at, n
        at += n


def _shape(character: str, x: float, y: float, n: int) -> Iterator[str]:
    if character in _SHADES or character in _BLOCKS:
        left, top, width, height = _BLOCKS.get(character, (0, 0, 1, 1))
        yield _box(x + left * COLUMN_PX, y + top * LINE_PX, COLUMN_PX * (n - 1 + width), height * LINE_PX)
    elif character in "─━":
        thick = 1.2 if character == "─" else 3
        yield _box(x, y + _MID_Y - thick / 2, n * COLUMN_PX, thick)
    elif character in _ARMS:
        yield from (_arm(arm, x, y) for arm in _ARMS[character])
    else:
        yield from _dots(ord(character) - 0x2800, x, y)


def _arm(arm: str, x: float, y: float) -> str:
    half = 0.6 if arm.islower() else 1.5
    if arm in "lrLR":
        left = x if arm in "lL" else x + _MID_X - half
        return _box(left, y + _MID_Y - half, _MID_X + half, 2 * half)
    top = y if arm in "uU" else y + _MID_Y - half
    return _box(x + _MID_X - half, top, 2 * half, _MID_Y + half)


def _dots(bits: int, x: float, y: float) -> Iterator[str]:
    """The dots of a braille character: bits 0 to 2 and 6 run down its left side, 3 to 5 and 7 its right."""
    for bit, (column, row) in enumerate([(0, 0), (0, 1), (0, 2), (1, 0), (1, 1), (1, 2), (0, 3), (1, 3)]):
        if bits >> bit & 1:
            yield _box(x + (column + 0.5) * COLUMN_PX / 2 - 1.3, y + (row + 0.5) * LINE_PX / 4 - 1.3, 2.6, 2.6)


def _box(left: float, top: float, width: float, height: float) -> str:
    return f"M{left:.4g} {top:.4g}h{width:.4g}v{height:.4g}h{-width:.4g}z"
