"""What the values of a workbook do not tell: formulas, merged cells, and a file that is locked or no workbook at all.

A sheet's XML is searched for marks, not parsed: no entity in it is ever resolved. A file whose parts would unpack to more than
`MOST_BYTES` is refused before anything of it is unpacked.
"""

from __future__ import annotations

import io
import re
import struct
import zipfile
import zlib
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from posixpath import join, normpath

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
