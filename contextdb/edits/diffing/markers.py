"""Conflicts of a merge in a CSV, between the marks that git uses, and the three versions that such a file holds.

Only rows that the sides disagree about are between marks, each with what it was, so that a person and the editor can decide:

    <<<<<<< ours
    run,1..2,True
    ||||||| base
    run,0..5,True
    =======
    run,3..4,True
    >>>>>>> theirs

Where a column itself is in question the whole file is between them. Nothing here touches the disk.

Nothing here touches the disk.
"""

from __future__ import annotations

import csv
import io
import subprocess
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from contextdb.errors import Fault, FileError, Place, in_quotes
from contextdb.files.csv_rewrite import rewritten
from contextdb.files.csv_source import Source
from contextdb.tables.merging.conflicts import Conflict
from contextdb.tables.merging.merging import Merge
from contextdb.tables.table import Table

OURS, BASE, MIDDLE, THEIRS = b"<<<<<<<", b"|||||||", b"=======", b">>>>>>>"

Known = tuple[int, int, int]
"""A row by its places in base, ours and theirs."""
Versions = tuple[bytes, bytes, bytes]
"""Base, ours, theirs."""


def with_markers(merge: Merge[Table]) -> bytes:
    """The merged CSV, with what is not decided between marks."""
    source = merge.ours.source
    end = source.line_end.encode() if isinstance(source, Source) else b"\n"
    if any(one.kind in ("column", "name") for one in merge.conflicts):
        versions = (table.source for table in (merge.ours, merge.base, merge.theirs))
        return block([_ended(one.raw, end) if one is not None else b"" for one in versions], end)
    theirs = merge.resolved(dict.fromkeys(range(len(merge.conflicts)), "theirs"))
    mine, yours = _Lines(merge), _Lines(theirs)
    was = _base_lines(merge, mine, yours)
    head = mine.source.raw[: mine.source.starts[1]]
    return b"".join([_ended(head, end), *_woven(mine, yours, was, end)])


def versions_of(raw: bytes) -> Versions | None:
    """The versions that a file with git's marks holds; None where there are no marks, or they do not go together.

    Where git wrote no version of before, base has nothing in its place.
    """
    versions: list[list[bytes]] = [[], [], []]
    sides: tuple[int, ...] = (0, 1, 2)
    n_blocks = 0
    steps = {OURS: (sides, (1,)), BASE: ((1,), (0,)), MIDDLE: ((0,), (2,)), THEIRS: ((2,), sides)}
    for line in raw.splitlines(keepends=True):
        mark = line[:7] if line[:7] in steps and line[7:8] in (b"", b" ", b"\r", b"\n") else b""
        if mark == MIDDLE and sides == (1,):
            sides = (2,)
        elif mark and sides == steps[mark][0]:
            sides = steps[mark][1]
            n_blocks += mark == OURS
        elif mark and mark != MIDDLE:
            return None
        else:
            for side in sides:
                versions[side].append(line)
    if not n_blocks or len(sides) != 3:
        return None
    base, ours, theirs = (b"".join(lines) for lines in versions)
    return (base or ours.splitlines(keepends=True)[0] if ours else base), ours, theirs


def names_of(raw: bytes) -> tuple[str, str]:
    """What the first marks of a file call ours and theirs, such as HEAD and the name of a branch; empty where they say nothing."""
    names = {OURS: "", THEIRS: ""}
    for line in raw.splitlines():
        if line[:7] in names and not names[line[:7]]:
            names[line[:7]] = line[7:].decode("utf-8", "replace").strip()
    return names[OURS], names[THEIRS]


# ---- parts


class _Lines:
    """The lines of a merge, by row."""

    def __init__(self, merge: Merge[Table], table: Table | None = None) -> None:
        table = table or merge.table
        source = merge.ours.source if isinstance(merge.ours.source, Source) else None
        origin = table.origin if source is not None else np.full(table.n_rows, -1)
        fields = merge.fields.ours.tolist() if source is not None else [-1] * len(table.columns)
        self.source = rewritten(table.columns, source, origin, fields)
        self.table = table
        self.rows: list[Known] = list(
            zip(*(side.tolist() for side in (merge.rows.base, merge.rows.ours, merge.rows.theirs)), strict=True)
        )

    def line(self, row: int) -> bytes:
        """One row, without its line end."""
        return self.source.raw[self.source.starts[row + 1] : self.source.stops[row + 1]]

    def with_end(self, row: int) -> bytes:
        """One row, with its line end and blank lines after it."""
        return self.source.raw[self.source.starts[row + 1] : self.source.starts[row + 2]]


def _woven(mine: _Lines, yours: _Lines, was: dict[Known, bytes], end: bytes) -> Iterator[bytes]:
    """Go through both sides' rows, which are the same but for those in question."""
    known = set(mine.rows), set(yours.rows)
    at, other = 0, 0
    while at < len(mine.rows) or other < len(yours.rows):
        row = mine.rows[at] if at < len(mine.rows) else None
        if row is None or (other < len(yours.rows) and yours.rows[other] not in known[0]):
            key = yours.rows[other]
            yield block([b"", was.get(key, b""), yours.line(other) + end], end)
            other += 1
        elif row not in known[1]:
            yield block([mine.line(at) + end, was.get(row, b""), b""], end)
            at += 1
        else:
            lines = mine.line(at), yours.line(other)
            is_same = lines[0] == lines[1]
            yield _ended(mine.with_end(at), end) if is_same else block([lines[0] + end, was.get(row, b""), lines[1] + end], end)
            at, other = at + 1, other + 1


def _base_lines(merge: Merge[Table], mine: _Lines, yours: _Lines) -> dict[Known, bytes]:
    """What stood in base of each row in question, in the merged columns."""
    conflicts: dict[int, list[Conflict]] = {}
    for one in merge.conflicts:
        base = one.key[1]
        if isinstance(base, int) and base >= 0:
            conflicts.setdefault(base, []).append(one)
    lines_by_key: dict[Known, bytes] = {}
    for lines in (yours, mine):
        rows = {row[0]: at for at, row in enumerate(lines.rows) if row[0] in conflicts}
        cells = [cell for base, at in rows.items() for cell in _base_cells(merge, base, at, conflicts[base])]
        again = _Lines(merge, lines.table.with_cells(cells)) if cells else lines
        end = again.source.line_end.encode()
        lines_by_key |= {lines.rows[at]: again.line(at) + end for at in rows.values()}
    return lines_by_key


def _base_cells(merge: Merge[Table], base: int, row: int, conflicts: Sequence[Conflict]) -> Iterator[tuple[int, str, str]]:
    """The cells of base that a row in question had: all where the row itself is, else those in question."""
    is_whole = any(one.kind == "row" for one in conflicts)
    wanted = {one.column for one in conflicts}
    for column, field in zip(merge.columns, merge.fields.base.tolist(), strict=True):
        if is_whole or column.name in wanted:
            yield row, column.name, merge.base.columns[field][base] if field >= 0 else ""


def block(versions: Sequence[bytes], end: bytes) -> bytes:
    """Ours, base and theirs, each whole lines, between marks."""
    ours, base, theirs = versions
    return b"".join([OURS, b" ours", end, ours, BASE, b" base", end, base, MIDDLE, end, theirs, THEIRS, b" theirs", end])


def _ended(text: bytes, end: bytes) -> bytes:
    return text if not text or text.endswith((b"\n", b"\r")) else text + end


# ---- a three-way merge of lines, as git does it: for files whose meaning cannot be merged. An edge: this runs git


NAMES = ("ours", "base", "theirs")
MOST_CONFLICTS = 127
"""What `git merge-file` exits with where there are at least so many conflicts; more is an error of its own."""


def merged_lines(base: bytes, ours: bytes, theirs: bytes) -> tuple[bytes, int]:
    """The merged bytes, and how many places are between marks in them. Where git cannot tell, the whole files are there."""
    versions = (ours, base, theirs)
    try:
        with TemporaryDirectory(prefix="contextdb-") as folder:
            for name, raw in zip(NAMES, versions, strict=True):
                (Path(folder) / name).write_bytes(raw)
            labels = [word for name in NAMES for word in ("-L", name)]
            done = subprocess.run(
                ["git", "merge-file", "-p", "--diff3", *labels, *NAMES], cwd=folder, capture_output=True, check=False
            )
    except OSError:  # there is no git, or no room for what it is to read
        return _whole(versions), 1
    if 0 <= done.returncode <= MOST_CONFLICTS:
        return done.stdout, done.returncode
    return _whole(versions), 1


def _whole(versions: tuple[bytes, bytes, bytes]) -> bytes:
    end = b"\r\n" if b"\r\n" in versions[0] else b"\n"
    return block([raw if not raw or raw.endswith(b"\n") else raw + end for raw in versions], end)


# ---- a three-way merge of the notes by a table, `NAME.notes.csv`: each line is of one place, an asset and a column


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
