"""What the values of a workbook do not tell: formulas, merged cells, and a file that is locked or no workbook at all.

A sheet's XML is searched for marks, not parsed: no entity in it is ever resolved. A file whose parts would unpack to more than
`MOST_BYTES` is refused before anything of it is unpacked.
"""

from __future__ import annotations

import colorsys
import io
import re
import struct
import zipfile
import zlib
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from html import unescape
from posixpath import dirname, join, normpath

from contextdb.errors import Fault, Place, TableError
from contextdb.exchange.grid import column_number

MOST_BYTES = 4 << 30
MOST_CELLS = 30_000_000
FEW_CELLS, MOST_EMPTY = 1_000_000, 16
"""A sheet of more cells than FEW_CELLS may have so many for each filled one: a small file must not cost what a large one does."""
MOST_SEARCHED = 50_000_000
MOST_RATIO = 1_000
"""No sheet packs better than this; a bomb does."""

BROKEN = (zipfile.BadZipFile, zlib.error, struct.error, ValueError, KeyError, OSError, EOFError, NotImplementedError, RuntimeError)
"""What zipfile raises, depending on where an archive is damaged."""

_OLE = b"\xd0\xcf\x11\xe0\xa1\xb1\x1a\xe1"
_ENCRYPTED = "EncryptedPackage".encode("utf-16-le")
# A tag ends before the next "<", so that none of these looks at a byte once for each tag before it.
_FORMULA = re.compile(rb"<c\b([^<>]*)>\s*<f\b[^<>]*>(?:([^<]*)</f>)?(\s*<v>[^<]*</v>|\s*<v/>)?")
_ERROR = re.compile(rb"<(?:\w+:)?c\b([^<>]*)>(?:\s*<(?:\w+:)?f\b[^<>]*>(?:[^<]*</(?:\w+:)?f>)?)?\s*<(?:\w+:)?v>([^<]*)</")
_IS_ERROR = re.compile(rb"\bt=[\"']e[\"']")
_IS_HIDDEN = re.compile(rb"\bhidden=[\"'](?:1|true)[\"']")
_ROW = re.compile(rb"<(?:\w+:)?row\b([^<>]*)>")
_COLUMN = re.compile(rb"<(?:\w+:)?col\b([^<>]*)>")
_NUMBER = re.compile(rb"\b(r|min|max)=[\"'](\d{1,7})[\"']")
_CELL = re.compile(rb"\br=[\"']([A-Z]{1,3})(\d{1,9})[\"']")
_HAS_FORMULA = re.compile(rb"<f[\s/>]")
_SHEET = re.compile(r"<(?:\w+:)?sheet\b([^<>]*)>")
_RELATION = re.compile(r"<(?:\w+:)?Relationship\b([^<>]*)>")
_ATTRIBUTE = re.compile(r'(?<![\w:])([\w:]+)="([^"]*)"')
_REFERENCE = re.compile(rb'<(?:\w+:)?c\b[^<>]*?\br=["\']([A-Z]{1,3})(\d{1,9})')
_ENTITY = re.compile(rb"<!(?:DOCTYPE|ENTITY)", re.IGNORECASE)


def require_workbook(raw: bytes, file: str) -> None:
    """Refuse what is not a workbook that can be read: raises TableError where it is empty, locked with a password, no archive,
    broken, a bomb, or has a document type in its XML."""
    fault = _fault(raw)
    if fault:
        raise TableError(fault.at(Place(file)))


def _fault(raw: bytes) -> Fault | None:
    accepted = "a workbook as Excel saves it (.xlsx)"
    if not raw:
        return Fault("the file is empty.", accepted)
    if raw.startswith(_OLE):
        if _ENCRYPTED in raw:
            return Fault(
                "the workbook is locked with a password.", "one without", 'to save it without: "Encrypt with Password", then empty'
            )
        return None  # .xls, which calamine reads too
    if not raw.startswith(b"PK"):
        return Fault("this is not a workbook.", accepted)
    try:
        with zipfile.ZipFile(io.BytesIO(raw)) as archive:
            return _other_kind(archive) or _bomb(archive) or _unreadable_part(archive)
    except BROKEN:
        return Fault("the workbook is broken: its archive cannot be read.", accepted, "to open it in Excel and save it again")


def _bomb(archive: zipfile.ZipFile) -> Fault | None:
    infos = archive.infolist()
    total = sum(info.file_size for info in infos)
    steep = [info for info in infos if info.file_size > MOST_RATIO * max(info.compress_size, 1_000)]
    if total > MOST_BYTES:
        return Fault(f"the workbook would unpack to {total:,} bytes.", f"at most {MOST_BYTES:,}")
    if not steep:
        return None
    problem = f"{steep[0].filename} would unpack from {steep[0].compress_size:,} bytes to {steep[0].file_size:,}, as a bomb does."
    return Fault(problem, f"parts that unpack to at most {MOST_RATIO:,} times their size")


def _other_kind(archive: zipfile.ZipFile) -> Fault | None:
    """An archive that is a workbook of another program, or none at all."""
    names = set(archive.namelist())
    if "xl/workbook.xml" in names:
        return None
    others = {"content.xml": "an OpenDocument file", "xl/workbook.bin": "a binary workbook (.xlsb)"}
    kind = next((kind for name, kind in others.items() if name in names), "an archive")
    return Fault(f"this is {kind}, no .xlsx.", "a workbook as Excel saves it (.xlsx)", 'to save it as "Excel workbook" (.xlsx)')


def _unreadable_part(archive: zipfile.ZipFile) -> Fault | None:
    """What is wrong with the XML in the archive: a document type, with which a bomb would begin, or a cell far off."""
    for info in archive.infolist():
        if info.filename.endswith((".xml", ".rels")):
            with archive.open(info) as part:
                xml = part.read()
            if fault := _document_type(info.filename, xml) or _far_cell(xml):
                return fault
    return None


def _document_type(name: str, xml: bytes) -> Fault | None:
    if not _ENTITY.search(xml, 0, 4096):
        return None
    return Fault(f"{name} declares a document type, which no workbook does.", "a workbook as Excel saves it")


def _far_cell(xml: bytes) -> Fault | None:
    """A cell so far from the others that all the cells between would not fit into memory: the reader makes room for each."""
    refs = _REFERENCE.findall(xml) if len(xml) < MOST_SEARCHED else _last_of_rows(xml)
    if not refs:
        return None
    column = max({letters for letters, _ in refs}, key=lambda word: (len(word), word)).decode()
    row = max(int(number) for _, number in refs)
    n_cells = row * column_number(column)
    most = min(MOST_CELLS, FEW_CELLS + MOST_EMPTY * (xml.count(b"<c ") + xml.count(b":c ")))
    if n_cells <= most:
        return None
    problem = f"the sheet reaches to cell {column}{row}, {n_cells:,} cells in all."
    return Fault(
        problem,
        f"at most {most:,}, as so few are filled" if most < MOST_CELLS else f"at most {most:,}",
        "to delete the rows and columns beyond the table, and save it again",
    )


def _last_of_rows(xml: bytes) -> list[tuple[bytes, bytes]]:
    """The last cell of each row, which is the one farthest to the right; all cells of a large sheet take seconds to look at."""
    rows = xml.split(b"</row>")
    matches = (_REFERENCE.match(row, end) for row in rows if (end := row.rfind(b"<c ")) >= 0)
    return [(ref[1], ref[2]) for ref in matches if ref]


@dataclass(frozen=True, slots=True)
class Marks:
    """What a sheet of an XLSX says next to its values. Rows and columns count from 0."""

    formulas: Sequence[tuple[str, str, bool]] = ()
    """The cell, the formula, and whether a value was saved with it."""
    errors: Sequence[tuple[int, int, str]] = ()
    """Row, column, and the error that is there as a value."""
    hidden_rows: Sequence[int] = ()
    hidden_columns: Sequence[range] = ()


def is_old(raw: bytes) -> bool:
    """Whether a workbook is an .xls, of which nothing but the values is known."""
    return raw.startswith(_OLE)


def marks_of(raw: bytes, sheet: str) -> Marks:
    """What a sheet says next to its values; nothing of an .xls."""
    if not raw.startswith(b"PK"):
        return Marks()
    try:
        with zipfile.ZipFile(io.BytesIO(raw)) as archive:
            path = path_of(archive, sheet)
            xml = archive.read(path) if path else b""
    except BROKEN:
        return Marks()
    formulas = list(_formulas(xml)) if _HAS_FORMULA.search(xml) else []
    errors = list(_errors(xml)) if _IS_ERROR.search(xml) else []
    if not _IS_HIDDEN.search(xml):
        return Marks(formulas, errors)
    rows = [mark[b"r"] - 1 for mark in _hidden(_ROW, xml) if b"r" in mark]
    columns = [range(mark[b"min"] - 1, mark[b"max"]) for mark in _hidden(_COLUMN, xml) if b"min" in mark and b"max" in mark]
    return Marks(formulas, errors, rows, columns)


def _formulas(xml: bytes) -> Iterator[tuple[str, str, bool]]:
    for match in _FORMULA.finditer(xml):
        if cell := _CELL.search(match[1]):
            has_value = bool(match[3] and b"<v/>" not in match[3])
            yield (cell[1] + cell[2]).decode(), (match[2] or b"").decode(errors="replace"), has_value


def _errors(xml: bytes) -> Iterator[tuple[int, int, str]]:
    for match in _ERROR.finditer(xml):
        cell = _CELL.search(match[1])
        if cell and _IS_ERROR.search(match[1]):
            yield int(cell[2]) - 1, column_number(cell[1].decode()) - 1, match[2].decode(errors="replace").strip()


def _hidden(tag: re.Pattern[bytes], xml: bytes) -> Iterator[dict[bytes, int]]:
    """The numbers that the hidden ones of some tags say."""
    for match in tag.finditer(xml):
        if _IS_HIDDEN.search(match[1]):
            yield {name: int(number) for name, number in _NUMBER.findall(match[1])}


def path_of(archive: zipfile.ZipFile, sheet: str) -> str | None:
    """The part that holds a sheet, as the workbook's list of sheets and its relations say."""
    from html import unescape

    listed = archive.read("xl/workbook.xml").decode("utf-8", "replace")
    relations = archive.read("xl/_rels/workbook.xml.rels").decode("utf-8", "replace")
    targets = {each.get("Id"): each.get("Target", "") for each in map(attributes, _RELATION.findall(relations))}
    for each in map(attributes, _SHEET.findall(listed)):
        if unescape(each.get("name", "")) == sheet:
            target = next((targets[value] for key, value in each.items() if key.endswith(":id") and value in targets), None)
            return None if target is None else target.lstrip("/") if target.startswith("/") else normpath(join("xl", target))
    return None


def attributes(text: str) -> dict[str, str]:
    """What a tag says."""
    return dict(_ATTRIBUTE.findall(text))


# ---- comments and fills of a workbook's sheet, which become notes and colours of rows, and colours of rows as fills. XML is
# searched for marks, as in `contextdb.exchange.xlsx_scan`; the workbook was accepted there

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
_STYLED_CELL = re.compile(rb'<(?:\w+:)?c\b(?=[^<>]*\bs="(\d+)")[^<>]*?\br="([A-Z]{1,3})(\d{1,7})"')
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
    cells = _STYLED_CELL.findall(archive.read(path))
    return {
        (int(row) - 1, column_number(letters.decode()) - 1): word_of[style] for style, letters, row in cells if style in word_of
    }


def _word(rgb: str) -> str:
    """The colour of ours that is nearest to another; empty for a grey."""
    hue, saturation, _ = colorsys.rgb_to_hsv(*(int(rgb[at : at + 2], 16) / 255 for at in (0, 2, 4)))
    if saturation < _PALEST:
        return ""
    return min(_HUES, key=lambda word: abs(_HUES[word] - hue)).removesuffix(" again")
