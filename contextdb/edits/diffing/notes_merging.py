"""A three-way merge of the notes by a table, `NAME.notes.csv`: each line is of one place, an asset and a column.

Nothing here touches the disk.
"""

from __future__ import annotations

import csv
import io
from collections.abc import Mapping, Sequence

from contextdb.errors import Fault, FileError, Place, in_quotes

FIELDS = ("Asset", "Column", "Note", "Colour")
Spot = tuple[str, str]
"""An asset, and a column; none for the note of the row."""
Lines = Mapping[Spot, Sequence[str]]
"""Of each spot its note and its colour."""


def merge_notes(raws: Sequence[bytes], files: Sequence[str], takes: str | None = None) -> bytes:
    """Merge base, ours and theirs; `files` are their names in messages, `takes` the side that holds where both changed a spot.
    Raises FileError for a file that is none of notes, or a spot that both sides changed."""
    base, ours, theirs = (_read(raw, file) for raw, file in zip(raws, files, strict=True))
    merged = {spot: [_merged(spot, i, base, ours, theirs, files[1], takes) for i in (0, 1)] for spot in {**base, **ours, **theirs}}
    return written({spot: note for spot, note in merged.items() if any(note)})


def written(lines: Lines) -> bytes:
    """The file, sorted, so that two versions differ in few places."""
    out = io.StringIO()
    csv.writer(out, lineterminator="\n").writerows([FIELDS, *([*spot, *note] for spot, note in sorted(lines.items()))])
    return out.getvalue().encode()


def _merged(spot: Spot, at: int, base: Lines, ours: Lines, theirs: Lines, file: str, takes: str | None) -> str:
    was, mine, yours = (lines.get(spot, ("", ""))[at] for lines in (base, ours, theirs))
    if mine in (was, yours) or (yours != was and takes == "theirs"):
        return yours
    if yours == was or takes == "ours":
        return mine
    problem = f"the {FIELDS[2 + at].lower()} of {in_quotes(' '.join(spot).strip())} changed on both sides."
    raise FileError(Fault(problem, place=Place(file)))


def _read(raw: bytes, file: str) -> Lines:
    """The lines of a file; an empty one has none."""
    try:
        header, *rows = list(csv.reader(io.StringIO(raw.decode("utf-8-sig"), newline=""), strict=True)) or [list(FIELDS)]
    except (UnicodeDecodeError, csv.Error):
        header, rows = [], []
    lines = {(row[0], row[1]): row[2:] for row in rows if len(row) == len(FIELDS)}
    if tuple(header) != FIELDS or len(lines) != len(rows):
        raise FileError(Fault("this is not a file of notes.", f"the columns {', '.join(FIELDS)}, a place once", place=Place(file)))
    return lines
