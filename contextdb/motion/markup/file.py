"""The text of a markup file as rows of fields, each with its line, and every fault in its form.

Plain CSV in UTF-8 with a header. A record is one line: no asset and no tag holds a line break, so a quote that is not closed spoils
its own line and no other. Nothing here touches the disk.
"""

from __future__ import annotations

import csv
import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field

from contextdb.errors import Fault, MotionError, Place, in_quotes, nearest, plural, some
from contextdb.files.strangers import line_of, looks_utf16

REQUIRED = ("asset", "tag", "from", "to")
COLUMNS = (*REQUIRED, "value")

_ACCEPTED = "CSV text in UTF-8 with the columns asset, tag, from, to and, where needed, value"
_LINE_END = re.compile(r"\r\n|\r|\n")
_CONFLICT = re.compile(r"<{7}( |$)|={7}$|>{7}( |$)|\|{7}( |$)")
_OTHER_DELIMITERS = ((";", "semicolon"), ("\t", "tab"), ("|", "vertical bar"))


@dataclass(frozen=True, slots=True)
class Row:
    """The fields of one line by column, without the spaces round them; `line` counts from 1."""

    line: int
    fields: dict[str, str]


@dataclass
class Rows:
    """The rows of a text that could be read, and the faults of the others."""

    rows: list[Row] = field(default_factory=list)
    faults: list[Fault] = field(default_factory=list)


def text_of(raw: bytes, file: str, accepted: str = _ACCEPTED) -> str:
    """The text of a file's bytes. Raises MotionError for UTF-16, another encoding, or no text at all."""
    nul = raw.find(b"\0")
    if raw.startswith((b"\xff\xfe", b"\xfe\xff")) or looks_utf16(raw):
        raise MotionError(Fault("the file is UTF-16 text.", accepted, "to save it as UTF-8", Place(file)))
    if nul >= 0:
        raise MotionError(Fault("not a text file: it contains a NUL byte.", accepted, place=Place(file, line_of(raw, nul))))
    try:
        return raw.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        problem = f"byte 0x{raw[error.start]:02X} on this line is not UTF-8."
        raise MotionError(Fault(problem, accepted, "to save it as UTF-8", Place(file, line_of(raw, error.start)))) from None


def rows_of(text: str, file: str | None, required: Sequence[str] = REQUIRED, columns: Sequence[str] = COLUMNS) -> Rows:
    """The rows of a text, blank lines left out, and what is wrong with its header and its lines."""
    lines = [(number, line) for number, line in enumerate(_LINE_END.split(text.removeprefix("\ufeff")), 1) if line.strip()]
    rows = Rows()
    if not lines:
        what = "the file holds blank lines only." if text.strip("\ufeff") else "the file is empty."
        rows.faults.append(Fault(what, f"a header line: {','.join(columns)}", place=Place(file)))
        return rows
    conflicts = [number for number, line in lines if _CONFLICT.match(line)]
    if conflicts:
        mend = 'to keep one side and delete the lines "<<<<<<<", "=======" and ">>>>>>>"'
        rows.faults.append(Fault("an unresolved git conflict starts here.", "plain CSV", mend, Place(file, conflicts[0])))
        return rows
    names = _header(lines[0][1], Place(file, lines[0][0]), rows.faults, required, columns)
    if names is not None:
        _read_rows(lines[1:], names, file, rows)
    return rows


# ---- the header


def _header(line: str, place: Place, faults: list[Fault], required: Sequence[str], columns: Sequence[str]) -> list[str] | None:
    """The columns in order, or None when the rows below cannot be read by them."""
    other = _other_delimiter(line)
    if other:
        faults.append(Fault(f"the header has no comma but {other}.", "commas between fields", "to save it with commas", place))
        return None
    try:
        given = _fields(line)
    except csv.Error as error:
        faults.append(_form_fault(line, error, place))
        return None
    names = [name.casefold() for name in given]
    missing = [column for column in required if column not in names]
    faults.extend(_name_faults(given, missing, columns, place))
    faults.extend(_missing_faults(missing, columns, place))
    return None if missing or len(set(names)) < len(names) else names


def _other_delimiter(line: str) -> str:
    if "," in line:
        return ""
    return next((plural(line.count(mark), name) for mark, name in _OTHER_DELIMITERS if mark in line), "")


def _name_faults(given: Sequence[str], missing: Sequence[str], columns: Sequence[str], place: Place) -> Iterator[Fault]:
    """Columns that are unknown, or appear twice."""
    seen = set[str]()
    for name in given:
        folded = name.casefold()
        at = Place(place.file, place.line, name or None)
        if folded in seen:
            yield Fault(f"the column {in_quotes(name)} appears twice.", "each column once", place=at)
        elif folded not in columns:
            near = nearest(name, missing) or nearest(name, columns)
            what = f"there is no column {in_quotes(name)}." if name else "a column has no name."
            yield Fault(what, some(columns), in_quotes(near) if near else "", at)
        seen.add(folded)


def _missing_faults(missing: Sequence[str], columns: Sequence[str], place: Place) -> Iterator[Fault]:
    if missing:
        noun = "column" if len(missing) == 1 else "columns"
        yield Fault(f"the {noun} {some(missing)} {'is' if len(missing) == 1 else 'are'} missing.", some(columns), place=place)


# ---- the rows


def _read_rows(lines: Sequence[tuple[int, str]], names: Sequence[str], file: str | None, rows: Rows) -> None:
    for number, line in lines:
        place = Place(file, number)
        try:
            fields = _fields(line)
        except csv.Error as error:
            rows.faults.append(_form_fault(line, error, place))
            continue
        if not any(fields):  # spreadsheets write empty rows as commas
            continue
        if len(fields) == len(names):
            rows.rows.append(Row(number, dict(zip(names, fields, strict=True))))
        else:
            rows.faults.append(_ragged_fault(line, len(fields), names, place))


def _fields(line: str) -> list[str]:
    return [text.strip() for text in next(csv.reader([line], strict=True))]


def _form_fault(line: str, error: csv.Error, place: Place) -> Fault:
    if "field larger" in str(error):
        return Fault("a field of this line is too long.", f"at most {csv.field_size_limit():,} characters", place=place)
    if "unexpected end" in str(error):
        return Fault(f"a quote that opens on this line is never closed: {in_quotes(line)}.", mend="to close it", place=place)
    accepted = "a field in double quotes from its start to its end, each quote in it doubled"
    return Fault(f"a field continues after its closing quote: {in_quotes(line)}.", accepted, place=place)


def _ragged_fault(line: str, n_fields: int, names: Sequence[str], place: Place) -> Fault:
    problem = f"found {plural(n_fields, 'field')}, the header has {len(names)}."
    accepted = f"one field for each of {', '.join(names)}"
    if line.lstrip().startswith("#"):
        return Fault(problem, accepted, "to delete the line: the file has no comments", place)
    if n_fields < len(names):
        return Fault(problem, accepted, in_quotes(line + "," * (len(names) - n_fields)), place)
    return Fault(problem, accepted, "to write numbers with a decimal point, and to quote names with a comma in them", place)
