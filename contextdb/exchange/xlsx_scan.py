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
from posixpath import join, normpath

from contextdb.errors import Fault, Place, TableError
from contextdb.exchange.grid import column_number

MOST_BYTES = 4 << 30
MOST_CELLS = 30_000_000
MOST_SEARCHED = 50_000_000
MOST_RATIO = 1_000
"""No sheet packs better than this; a bomb does."""

_BROKEN = (zipfile.BadZipFile, zlib.error, struct.error, ValueError, KeyError, OSError, EOFError, NotImplementedError, RuntimeError)
"""What zipfile raises, depending on where an archive is damaged."""

_OLE = b"\xd0\xcf\x11\xe0\xa1\xb1\x1a\xe1"
_ENCRYPTED = "EncryptedPackage".encode("utf-16-le")
_FORMULA = re.compile(rb'<c\b[^>]*?\br="([A-Z]{1,3}\d+)"[^>]*>\s*<f\b[^>]*?(?:/>|>([^<]*)</f>)(\s*<v>[^<]*</v>|\s*<v/>)?')
_HAS_FORMULA = re.compile(rb"<f[\s/>]")
_SHEET = re.compile(r"<(?:\w+:)?sheet\b([^>]*)/?>")
_RELATION = re.compile(r"<(?:\w+:)?Relationship\b([^>]*)/?>")
_ATTRIBUTE = re.compile(r'([\w:]+)="([^"]*)"')
_REFERENCE = re.compile(rb'<(?:\w+:)?c\b[^>]*?\br=["\']([A-Z]{1,3})(\d{1,9})')
_ENTITY = re.compile(rb"<!(?:DOCTYPE|ENTITY)", re.IGNORECASE)


def require_workbook(raw: bytes, file: str) -> None:
    """Refuse what is no workbook that can be read.

    Raises
    ------
    TableError
        Empty, locked with a password, no archive, broken, a bomb, or with a document type in its XML.
    """
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
        return Fault("this is no workbook.", accepted)
    try:
        with zipfile.ZipFile(io.BytesIO(raw)) as archive:
            return _other_kind(archive) or _bomb(archive) or _unreadable_part(archive)
    except _BROKEN:
        return Fault("the workbook is broken: its archive cannot be read.", accepted, "to open it in Excel and save it again")


def _bomb(archive: zipfile.ZipFile) -> Fault | None:
    infos = archive.infolist()
    total = sum(info.file_size for info in infos)
    steep = [info for info in infos if info.file_size > MOST_RATIO * max(info.compress_size, 1_000)]
    if total > MOST_BYTES:
        return Fault(f"the workbook would unpack to {total:,} bytes.", f"at most {MOST_BYTES:,}")
    if not steep:
        return None
    found = f"{steep[0].filename} would unpack from {steep[0].compress_size:,} bytes to {steep[0].file_size:,}, as a bomb does."
    return Fault(found, f"parts that unpack to at most {MOST_RATIO:,} times their size")


def _other_kind(archive: zipfile.ZipFile) -> Fault | None:
    """An archive that is a workbook of another program, or none at all."""
    names = set(archive.namelist())
    if "xl/workbook.xml" in names:
        return None
    others = {"content.xml": "an OpenDocument file", "xl/workbook.bin": "a binary workbook (.xlsb)"}
    kind = next((kind for name, kind in others.items() if name in names), "an archive")
    return Fault(f"this is {kind}, no .xlsx.", "a workbook as Excel saves it (.xlsx)", 'to save it as "Excel workbook"')


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
    if n_cells <= MOST_CELLS:
        return None
    found = f"the sheet reaches to cell {column}{row}, {n_cells:,} cells in all."
    return Fault(found, f"at most {MOST_CELLS:,}", "to delete the rows and columns beyond the table, and save it again")


def _last_of_rows(xml: bytes) -> list[tuple[bytes, bytes]]:
    """The last cell of each row, which is the one farthest to the right; all cells of a large sheet take seconds to look at."""
    rows = xml.split(b"</row>")
    found = (_REFERENCE.match(row, end) for row in rows if (end := row.rfind(b"<c ")) >= 0)
    return [(ref[1], ref[2]) for ref in found if ref]


def formulas_of(raw: bytes, sheet: str) -> list[tuple[str, str, bool]]:
    """The formulas of a sheet of an XLSX: the cell, the formula, and whether a value was saved with it."""
    if not raw.startswith(b"PK"):
        return []
    try:
        with zipfile.ZipFile(io.BytesIO(raw)) as archive:
            path = _path_of(archive, sheet)
            xml = archive.read(path) if path else b""
    except _BROKEN:
        return []
    if not _HAS_FORMULA.search(xml):
        return []
    found = _FORMULA.finditer(xml)
    return [(m[1].decode(), (m[2] or b"").decode(errors="replace"), bool(m[3] and b"<v/>" not in m[3])) for m in found]


def _path_of(archive: zipfile.ZipFile, sheet: str) -> str | None:
    """The part that holds a sheet, as the workbook's list of sheets and its relations say."""
    from html import unescape

    listed = archive.read("xl/workbook.xml").decode("utf-8", "replace")
    relations = archive.read("xl/_rels/workbook.xml.rels").decode("utf-8", "replace")
    targets = {said.get("Id"): said.get("Target", "") for said in map(_attributes, _RELATION.findall(relations))}
    for said in map(_attributes, _SHEET.findall(listed)):
        if unescape(said.get("name", "")) == sheet:
            target = next((targets[value] for key, value in said.items() if key.endswith(":id") and value in targets), None)
            return None if target is None else target.lstrip("/") if target.startswith("/") else normpath(join("xl", target))
    return None


def _attributes(text: str) -> dict[str, str]:
    return dict(_ATTRIBUTE.findall(text))
