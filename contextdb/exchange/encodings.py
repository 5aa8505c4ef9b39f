"""Bytes of a text file as text, and how they were understood: UTF-8, UTF-16, or Windows-1252 as old Excel writes it."""

from __future__ import annotations

import codecs

from contextdb.errors import Fault, Place, TableError, in_quotes, no_such
from contextdb.exchange.reading import Remark
from contextdb.files.strangers import line_of, other_kind

BOMS = (
    (codecs.BOM_UTF8, "utf-8", "UTF-8 with a byte order mark"),
    (codecs.BOM_UTF32_LE, "utf-32-le", "UTF-32"),
    (codecs.BOM_UTF16_LE, "utf-16-le", "UTF-16"),
    (codecs.BOM_UTF16_BE, "utf-16-be", "UTF-16 (big end first)"),
)
COMMON = ("utf-8", "utf-16", "cp1252", "cp1250", "cp1251", "latin-1", "mac-roman", "shift-jis", "gb18030", "big5", "euc-kr")
_WITHOUT_BOM = (("utf-16-le", 1), ("utf-16-be", 0))


def decoded(raw: bytes, file: str, encoding: str | None = None) -> tuple[str, list[Remark]]:
    """The text of a file in an encoding, else in the one that its bytes tell, without its byte order mark, and remarks on how it
    was understood. Raises TableError where the bytes are not text of that encoding, with the line, or no text at all."""
    if encoding is not None:
        return _decoded_as(raw, file, _known(encoding, file)), []
    for mark, name, remark in BOMS:
        if raw.startswith(mark):
            return _decoded_as(raw[len(mark) :], file, name), [Remark(f"the text is {remark}.")] if name != "utf-8" else []
    if detected := _utf16(raw):
        return _decoded_as(raw, file, detected), [Remark("the text is UTF-16 without a byte order mark.")]
    if b"\0" in raw:
        fault = Fault("not a text file: it contains NUL bytes.", "a text file", place=Place(line=line_of(raw, raw.find(0))))
        raise _refusal(other_kind(raw) or fault, file)
    try:
        return raw.decode(), []
    except UnicodeDecodeError as error:
        if other := other_kind(raw):
            raise _refusal(other, file) from None
        return _old_windows(raw, file, error)


def _refusal(fault: Fault, file: str) -> TableError:
    return TableError(fault.at(Place(file, fault.place.line)))


def _old_windows(raw: bytes, file: str, error: UnicodeDecodeError) -> tuple[str, list[Remark]]:
    """Text that is not UTF-8 is most likely that of an old Windows program in the west; the message shows a word to judge by."""
    text = _decoded_as(raw, file, "cp1252")
    word = raw[max(error.start - 12, 0) : error.start + 12].decode("cp1252", "replace")
    message = f"byte 0x{raw[error.start]:02X} is not UTF-8; the file is read as Windows-1252: {in_quotes(word.strip())}."
    message += " If that is wrong, name another encoding."
    return text, [Remark(message, f"line {line_of(raw, error.start)}", is_loss=True)]


def _decoded_as(raw: bytes, file: str, encoding: str) -> str:
    try:
        return raw.decode(encoding).removeprefix("\ufeff")
    except UnicodeError as error:
        start = error.start if isinstance(error, UnicodeDecodeError) else 0
        problem = f"byte 0x{raw[start]:02X} on this line is not text in {encoding}." if raw else f"the text is not {encoding}."
        mend = "to name its encoding with --encoding"
        raise TableError(Fault(problem, "UTF-8 or UTF-16, or the encoding named", mend, Place(file, line_of(raw, start)))) from None


def _known(encoding: str, file: str) -> str:
    try:
        codecs.lookup(encoding)
        "".encode(encoding)
    except (LookupError, UnicodeError):
        raise TableError(no_such("encoding", encoding, COMMON, ", ".join(COMMON), Place(file))) from None
    return encoding


def _utf16(raw: bytes) -> str | None:
    """UTF-16 without a mark, where most characters are of the west: every other byte of the beginning is then NUL."""
    head = raw[: min(len(raw), 400) // 2 * 2]
    for name, at in _WITHOUT_BOM:
        if len(head) >= 4 and not any(head[at::2]) and all(head[1 - at :: 2]):
            return name
    return None
