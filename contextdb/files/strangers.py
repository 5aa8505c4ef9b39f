"""What is in the way before a CSV can be read at all: other kinds of file, other encodings, other delimiters.

Each is recognised by its bytes and named, so that nobody has to guess from a hundred strange rows what the file is.
"""

from __future__ import annotations

import re

from contextdb.errors import Fault, Place, TableError, in_quotes, plural
from contextdb.files.parquet_frame import MAGIC

UTF8_BOM = b"\xef\xbb\xbf"

_SIGNATURES = (
    (MAGIC, "a Parquet file"),
    (b"\x89PNG", "a PNG image"),
    (b"\xff\xd8\xff", "a JPEG image"),
    (b"%PDF", "a PDF document"),
    (b"\x1f\x8b", "a gzip archive"),
    (b"\x28\xb5\x2f\xfd", "a Zstandard archive"),
    (b"7z\xbc\xaf", "a 7-Zip archive"),
    (b"\xd0\xcf\x11\xe0", "an old Excel workbook (.xls)"),
    (b"SQLite format 3", "an SQLite database"),
)
_UTF32 = b"\xff\xfe\0\0"
_UTF16 = (b"\xff\xfe", b"\xfe\xff")
_PAGE = re.compile(rb"(?:\xef\xbb\xbf)?\s*<(?:!doctype\b|html\b|\?xml\b)", re.IGNORECASE)
_JSON = re.compile(rb"\s*[{\[]\s*[\"{\[\]}]")
_LINE = re.compile(rb"[^\r\n]+")
_LFS = b"version https://git-lfs.github.com/spec/"
_DELIMITERS = ((b";", "semicolon"), (b"\t", "tab"), (b"|", "vertical bar"))
_QUOTED = re.compile(rb'"[^"]*(?:"|\Z)')
_SAVE_AS_UTF8 = 'to save it as UTF-8 (Excel calls it "CSV UTF-8")'


def line_of(raw: bytes, position: int) -> int:
    """The line, from 1, on which a byte stands; "\\n", "\\r\\n" and a lone "\\r" end a line."""
    lone = raw.count(b"\r", 0, position) - raw.count(b"\r\n", 0, position + 1)
    return 1 + raw.count(b"\n", 0, position) + max(lone, 0)


def seems_to_be(raw: bytes) -> str | None:
    """What kind of file the first bytes tell of, for a message; None when it could be plain text."""
    if raw.startswith(b"PK\x03\x04"):
        return "an Excel workbook (.xlsx)" if b"xl/" in raw else "a ZIP archive"
    return next((name for mark, name in _SIGNATURES if raw.startswith(mark)), None)


def seems_json(raw: bytes) -> bool:
    """Whether the first characters are those of JSON; a CSV may begin so too, so ask only when the rest is at fault."""
    return _JSON.match(raw[:200]) is not None


def other_kind(raw: bytes) -> Fault | None:
    """Why bytes that are not UTF-8 text are no text in another encoding either; None when they could be."""
    kind = seems_to_be(raw)
    return Fault(f"not a text file: looks like {kind}.", "CSV text in UTF-8", _way_out(kind)) if kind else None


def pointer(raw: bytes) -> Fault | None:
    """Why a file is not itself here, but the few lines that Git LFS keeps in its place."""
    if not raw.startswith(_LFS):
        return None
    return Fault("this is a Git LFS pointer, not the table itself.", "the table", 'to run "git lfs pull"')


def page(raw: bytes) -> Fault | None:
    """Why a text is no table but HTML or XML, such as the page that a server sent instead of a file."""
    return Fault("not a CSV file: looks like HTML or XML.", "CSV text in UTF-8") if _PAGE.match(raw[:200]) else None


def require_text(raw: bytes, file: str) -> None:
    """Refuse bytes that are not the text of a CSV in UTF-8: raises TableError for what is empty, binary, in another encoding, a Git
    LFS pointer, HTML or XML, or has another delimiter."""
    fault = _empty(raw) or _binary(raw) or _not_utf8(raw) or pointer(raw) or page(raw) or _delimited_otherwise(raw)
    if fault:
        raise TableError(fault.at(Place(file, fault.place.line)))


def other_delimiter(line: bytes) -> tuple[int, str] | None:
    """How many of which other delimiter a line without any comma has, outside quotes."""
    bare = _QUOTED.sub(b"", line)
    if b"," in bare:
        return None
    return next(((bare.count(mark), name) for mark, name in _DELIMITERS if mark in bare), None)


def _empty(raw: bytes) -> Fault | None:
    if _LINE.search(raw, len(UTF8_BOM) if raw.startswith(UTF8_BOM) else 0):
        return None
    problem = "the file is empty." if not raw else "the file holds blank lines only."
    return Fault(problem, "a header line with the names of the columns, then one line for each asset")


def _binary(raw: bytes) -> Fault | None:
    nul = raw.find(b"\0")
    is_utf16 = raw.startswith(_UTF16) or (nul >= 0 and looks_utf16(raw))
    if is_utf16:
        named = "UTF-32" if raw.startswith(_UTF32) else "UTF-16"
        return Fault(f"the file is {named} text.", "UTF-8, with or without BOM", _SAVE_AS_UTF8)
    if nul < 0:
        return None
    if fault := other_kind(raw):
        return fault
    problem = f"not a text file: it contains {plural(raw.count(0), 'NUL byte')}, the first on this line."
    return Fault(problem, "CSV text in UTF-8", place=Place(line=line_of(raw, nul)))


def looks_utf16(raw: bytes) -> bool:
    """Whether every other of the first bytes is NUL, as in Latin text in UTF-16 without a BOM."""
    head = raw[: min(len(raw), 200) // 2 * 2]
    return len(head) >= 4 and any(not any(head[i::2]) and all(head[1 - i :: 2]) for i in (0, 1))


def _way_out(kind: str) -> str:
    if "Excel" in kind:
        return 'to save it as "CSV UTF-8"'
    return "the suffix .parquet" if "Parquet" in kind else ""


def _not_utf8(raw: bytes) -> Fault | None:
    if raw.isascii():
        return None
    try:
        raw.decode()
    except UnicodeDecodeError as error:
        if fault := other_kind(raw):
            return fault
        byte = raw[error.start : error.start + 1]
        read = byte.decode("cp1252", "ignore")
        hint = f" (in Windows-1252 it would be {in_quotes(read)})" if read else ""
        problem = f"byte 0x{byte[0]:02X} on this line is not UTF-8{hint}."
        return Fault(problem, "UTF-8, with or without BOM", _SAVE_AS_UTF8, Place(line=line_of(raw, error.start)))
    return None


def _delimited_otherwise(raw: bytes) -> Fault | None:
    header = _LINE.search(raw, len(UTF8_BOM) if raw.startswith(UTF8_BOM) else 0)
    delimiter = header and other_delimiter(header[0])
    if not header or not delimiter:
        return None
    line = line_of(raw, header.start())
    problem = f"the header has no comma but {plural(*delimiter)}."
    return Fault(problem, "commas between fields", "to save it with commas", Place(line=line))
