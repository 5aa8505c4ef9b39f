"""What is wrong with the records of a CSV: git's marks, wrong quotes, another number of fields than the header, cells too long.

Each fault is at its line, with the nearest mend. Of one kind the first few are listed, and how many more there are.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterator
from itertools import pairwise

import numpy as np

from contextdb.errors import Fault, Place, in_quotes, plural
from contextdb.files.csv_records import MOST_STRAYS, Positions, Records, Stray, as_field, field_bounds, fields_of, text_of
from contextdb.files.strangers import UTF8_BOM, line_of

MOST_CHARACTERS = 65_536
"""The longest cell that is read; a longer one is a mistake, such as a whole file pasted into a cell."""
MOST_FAULTS = 20
"""Faults of one kind that are listed."""

CONFLICT, CONFLICT_END = b"<<<<<<<", b">>>>>>>"
"""What git writes at the start of the lines round two versions of a file that disagree."""

PlacedFault = tuple[int | None, Fault]
"""A fault, and the byte that it is about."""

_PAIR = re.compile(rb"[+-]?[\d.]+, *[\d.]+")


def record_faults(raw: bytes, records: Records, strays: list[Stray], file: str) -> list[Fault]:
    """Every fault in the form of the records, in the order of lines."""
    faults = list(_conflict_faults(raw, records))
    if not faults:
        faults = [*_stray_faults(raw, strays), *_ragged_faults(raw, records), *_long_faults(raw, records)]
    placed = [fault.at(Place(file, None if at is None else line_of(raw, at))) for at, fault in faults]
    return sorted(placed, key=lambda fault: fault.place.line or math.inf)


def _conflict_faults(raw: bytes, records: Records) -> Iterator[PlacedFault]:
    """Unresolved git conflicts. Nothing else is reported with them: which rows there are is not decided yet."""
    firsts = np.frombuffer(raw, np.uint8)[records.starts]
    at = records.starts[(firsts == CONFLICT[0]) | (firsts == CONFLICT_END[0])]
    first = raw.find(b"\n" + CONFLICT)
    marks = [start for start in at.tolist() if raw.startswith((CONFLICT, CONFLICT_END + b" "), start)]
    for start in marks[:MOST_FAULTS]:
        if raw.startswith(CONFLICT, start):
            end = raw.find(b"\n>>>>>>>", start)
            extent = f" and ends on line {line_of(raw, end + 1)}" if end >= 0 else ""
            mend = 'to keep one side and delete the lines "<<<<<<<", "=======" and ">>>>>>>"'
            yield start, Fault(f"an unresolved git conflict starts here{extent}.", "one version of each row", mend)
        elif not raw.startswith(CONFLICT) and not 0 <= first < start:
            yield start, Fault("this line is a conflict mark of git.", "one version of each row", "to delete the line")


def _stray_faults(raw: bytes, strays: list[Stray]) -> Iterator[PlacedFault]:
    for stray in strays[:MOST_STRAYS]:
        yield stray.opening, _stray_fault(raw, stray)
    if len(strays) > MOST_STRAYS:
        yield None, Fault("there are more fields with wrong quotes; the lines after these were not looked at.")


def _stray_fault(raw: bytes, stray: Stray) -> Fault:
    accepted = "a field in double quotes from its start to its end, each quote in it doubled"
    if stray.is_inside:
        field = _line_at(raw, _field_start(raw, stray.opening)).split(",", 1)[0]
        return Fault(f"a quote is inside the field {in_quotes(field)}.", accepted, _doubled(field))
    line = in_quotes(_line_at(raw, stray.opening))
    if stray.closing is None:
        return Fault(f"the quoted field that opens here is never closed: {line}.", accepted, "to close it on this line")
    n_lines = line_of(raw, stray.closing) - line_of(raw, stray.opening)
    if n_lines:
        problem = f"the quoted field that opens here runs on for {plural(n_lines, 'line')} and past the next quote: {line}."
        return Fault(problem, accepted, "to close it on this line")
    field = raw[stray.opening : stray.closing].decode() + _line_at(raw, stray.closing).split(",", 1)[0]
    problem = f"the field {in_quotes(field)} continues after its closing quote."
    return Fault(problem, accepted, _doubled(field[1:].removesuffix('"')))


def _field_start(raw: bytes, position: int) -> int:
    first = len(UTF8_BOM) if raw.startswith(UTF8_BOM) else 0
    return max(first, *(1 + raw.rfind(mark, 0, position) for mark in (b",", b"\n", b"\r")))


def _line_at(raw: bytes, start: int) -> str:
    """The text from a position up to the end of its line, or as much of it as a message can need."""
    return re.split(rb"[\r\n]", raw[start : start + 1000], maxsplit=1)[0].decode(errors="replace")


def _doubled(text: str) -> str:
    return as_field(text, is_quoted=True).decode() if len(text) <= 60 else ""


def _ragged_faults(raw: bytes, records: Records) -> Iterator[PlacedFault]:
    """Rows with more or fewer fields than the header; those with stray quotes cannot be counted and have their fault already."""
    rows = 1 + np.flatnonzero(records.is_sound[1:])
    if not records.is_sound[0] or not len(rows):
        return
    counts, header = records.n_fields[rows], int(records.n_fields[0])
    usual = _usual(counts, header)
    if usual != header:
        agree = f"{np.count_nonzero(counts == usual):,} of {plural(len(counts), 'row')}"
        problem = f"the header has {plural(header, 'field')}, but {agree} have {usual:,}."
        yield int(records.starts[0]), Fault(problem, "one name for each field of a row")
    wrong = rows[counts != usual]
    usual_text = f"the header has {usual:,}" if usual == header else f"most rows have {usual:,}"
    for record in wrong[:MOST_FAULTS].tolist():
        yield int(records.starts[record]), _ragged_fault(raw, records, record, usual, usual_text)
    if len(wrong) > MOST_FAULTS:
        yield None, Fault(f"{plural(len(wrong) - MOST_FAULTS, 'more row')} of another length; {usual_text}.")


def _usual(counts: Positions, header: int) -> int:
    """How many fields a row should have: as many as the header, unless most rows agree on another number."""
    values, times = np.unique(counts, return_counts=True)
    return int(values[times.argmax()]) if len(counts) >= 3 and 2 * times.max() > len(counts) else header


def _ragged_fault(raw: bytes, records: Records, record: int, usual: int, usual_text: str) -> Fault:
    start, stop, n_fields = int(records.starts[record]), int(records.stops[record]), int(records.n_fields[record])
    problem = f"found {plural(n_fields, 'field')}, {usual_text}."
    if n_fields < usual:
        return Fault(problem, "a field for each column, empty ones for Any")
    fields = fields_of(raw[start:stop], n_fields) if stop - start <= MOST_CHARACTERS else []
    return Fault(problem, "a cell with a comma in it in double quotes", _pair_in_quotes(fields))


def _pair_in_quotes(fields: list[bytes]) -> str:
    """A centre and its tolerance that a comma has torn apart, as they should stand."""
    pairs = (b",".join(pair) for pair in pairwise(fields))
    return next((f'"{pair.decode()}", in quotes' for pair in pairs if _PAIR.fullmatch(pair)), "")


def _long_faults(raw: bytes, records: Records) -> Iterator[PlacedFault]:
    is_long = records.is_sound & (records.stops - records.starts > MOST_CHARACTERS)
    for record in np.flatnonzero(is_long)[:MOST_FAULTS].tolist():
        start, stop = int(records.starts[record]), int(records.stops[record])
        line = raw[start:stop]
        firsts, lasts = field_bounds(line, np.array([len(line)]), int(records.n_fields[record]))
        for at in np.flatnonzero(lasts[0] - firsts[0] > MOST_CHARACTERS).tolist():
            size = len(text_of(line[firsts[0, at] : lasts[0, at]]))
            if size > MOST_CHARACTERS:
                problem = f"field {at + 1:,} has {size:,} characters."
                yield start, Fault(problem, f"at most {MOST_CHARACTERS:,} characters in a cell")
