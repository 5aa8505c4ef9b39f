"""Comments and fills of a workbook's sheet, which become notes and colours of rows, and colours of rows as fills.

XML is searched for marks, as in `contextdb.exchange.xlsx_scan`; the workbook was accepted there.
"""

from __future__ import annotations

import colorsys
import io
import re
import zipfile
from collections.abc import Mapping
from html import unescape
from posixpath import dirname, join, normpath

from contextdb.exchange.grid import column_number
from contextdb.exchange.xlsx_scan import BROKEN, attributes, path_of

FILLS = {"red": "#F4B6B6", "amber": "#FFD98A", "green": "#B9E0B0", "blue": "#B5D3F2", "violet": "#D9C2EC"}
"""How the colour of a row is written; another is read as the nearest of these."""
_HUES = {"red": 0.0, "amber": 0.11, "green": 0.33, "blue": 0.58, "violet": 0.78, "red again": 1.0}
_PALEST = 0.12
"""The least saturation of a colour; less is a grey, as of a band of rows."""
_COMMENT = re.compile(r"<(?:\w+:)?comment\b([^<>]*)>(.*?)</(?:\w+:)?comment>", re.DOTALL)
_TEXT = re.compile(r"<(?:\w+:)?t\b[^<>]*>([^<]*)</")
_RELATION = re.compile(r"<(?:\w+:)?Relationship\b([^<>]*)>")
_FILLS = re.compile(r"<(?:\w+:)?fill>(.*?)</(?:\w+:)?fill>", re.DOTALL)
_COLOUR = re.compile(r'<(?:\w+:)?fgColor\b[^<>]*\brgb="[0-9A-Fa-f]{2}([0-9A-Fa-f]{6})"')
_STYLES = re.compile(r"<(?:\w+:)?cellXfs\b.*?</(?:\w+:)?cellXfs>", re.DOTALL)
_STYLE = re.compile(r"<(?:\w+:)?xf\b([^<>]*)>")
_CELL = re.compile(rb'<(?:\w+:)?c\b(?=[^<>]*\bs="(\d+)")[^<>]*?\br="([A-Z]{1,3})(\d{1,7})"')
_PLACE = re.compile(r"([A-Z]{1,3})(\d{1,7})")
Spot = tuple[int, int]


def comments_and_fills(raw: bytes, sheet: str) -> tuple[Mapping[Spot, str], Mapping[Spot, str]]:
    """The comments of a sheet, and the colours of its cells, by row and column from 0; none of an .xls or a broken file."""
    if not raw.startswith(b"PK"):
        return {}, {}
    try:
        with zipfile.ZipFile(io.BytesIO(raw)) as archive:
            path = path_of(archive, sheet)
            return ({}, {}) if path is None else (_comments(archive, path), _fills(archive, path))
    except BROKEN:
        return {}, {}


def _comments(archive: zipfile.ZipFile, path: str) -> dict[Spot, str]:
    relations = join(dirname(path), "_rels", path.rpartition("/")[2] + ".rels")
    if relations not in archive.namelist():
        return {}
    comments = dict[Spot, str]()
    for each in map(attributes, _RELATION.findall(archive.read(relations).decode("utf-8", "replace"))):
        target = each.get("Target", "")
        part = target.lstrip("/") if target.startswith("/") else normpath(join(dirname(path), target))
        if each.get("Type", "").endswith("/comments") and part in archive.namelist():
            for head, body in _COMMENT.findall(archive.read(part).decode("utf-8", "replace")):
                place, text = _PLACE.fullmatch(attributes(head).get("ref", "")), unescape("".join(_TEXT.findall(body))).strip()
                if place and text:
                    comments[int(place[2]) - 1, column_number(place[1]) - 1] = " ".join(text.split())
    return comments


def _fills(archive: zipfile.ZipFile, path: str) -> dict[Spot, str]:
    styles = archive.read("xl/styles.xml").decode("utf-8", "replace") if "xl/styles.xml" in archive.namelist() else ""
    colours = [_word(match[1]) if (match := _COLOUR.search(fill)) else "" for fill in _FILLS.findall(styles)]
    formats = _STYLE.findall(match[0]) if (match := _STYLES.search(styles)) else []
    numbers = [int(attributes(each).get("fillId", 0)) for each in formats]
    word_of = {str(at).encode(): colours[n] for at, n in enumerate(numbers) if n < len(colours) and colours[n]}
    if not word_of:
        return {}
    cells = _CELL.findall(archive.read(path))
    return {
        (int(row) - 1, column_number(letters.decode()) - 1): word_of[style] for style, letters, row in cells if style in word_of
    }


def _word(rgb: str) -> str:
    """The colour of ours that is nearest to another; empty for a grey."""
    hue, saturation, _ = colorsys.rgb_to_hsv(*(int(rgb[at : at + 2], 16) / 255 for at in (0, 2, 4)))
    if saturation < _PALEST:
        return ""
    return min(_HUES, key=lambda word: abs(_HUES[word] - hue)).removesuffix(" again")
