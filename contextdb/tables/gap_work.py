"""Who works on which gap of a table, and how far it is: `NAME.gaps.csv` beside the table, for people and in builds.

    State,Owner,gait,speed
    animating,Ana,Run,6..7
    open,,Walk,

A line is a gap: a cell for each condition that it restricts, as coverage names it. Lines and columns are sorted, so that changes of
two people merge line by line. An edge: this reads and writes that file.
"""

from __future__ import annotations

import csv
import io
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

from contextdb.cells.conditions import Condition
from contextdb.cells.grammar import parse_cell
from contextdb.cells.sets import Cell, meet
from contextdb.disk import GAPS_SUFFIX, read_bytes, write_atomic
from contextdb.errors import CellError, Fault, FileError, Place, in_quotes

STATES = ("open", "animating", "done")
FIELDS = ("State", "Owner")
"""The first two columns; all others are conditions."""
MOST_LINES = 10_000
MOST_OWNER = 80
Key = tuple[tuple[str, str], ...]
"""The cells of a gap, sorted by their conditions."""


@dataclass(frozen=True, slots=True)
class Work:
    """How far a gap is, and who has it; nobody where the owner is empty."""

    state: str
    owner: str = ""

    @property
    def text(self) -> str:
        return " ".join(filter(None, (self.state, self.owner)))


@dataclass(frozen=True)
class GapWork:
    """The lines of a file."""

    lines: Mapping[Key, Work]

    @classmethod
    def beside(cls, table: Path) -> GapWork:
        """That of a table's file; none where there is no such file. Raises FileError for one that cannot be read."""
        path = gaps_path(table)
        return cls.of(read_bytes(path), str(path)) if path.is_file() else cls({})

    @classmethod
    def of(cls, raw: bytes, file: str) -> GapWork:
        """What the bytes of a file say. Raises FileError with every line that cannot be read."""
        return cls(_read(raw, file))

    def with_work(self, cells: Mapping[str, str], work: Work | None, without: Sequence[Key] = ()) -> GapWork:
        """With another state or owner of a gap; None takes its line away. The lines `without` go, too."""
        key, gone = key_of(cells), set(without)
        lines = {other: own for other, own in self.lines.items() if other != key and other not in gone}
        return GapWork(lines if work is None else lines | {key: work})

    def to_bytes(self) -> bytes:
        """The file."""
        names = sorted({name for key in self.lines for name, _ in key})
        out = io.StringIO()
        writer = csv.writer(out, lineterminator="\n")
        writer.writerow([*FIELDS, *names])
        lines = [([dict(key).get(name, "") for name in names], work) for key, work in self.lines.items()]
        writer.writerows([work.state, work.owner, *cells] for cells, work in sorted(lines, key=lambda line: line[0]))
        return out.getvalue().encode()

    # ---- the gaps of today

    def sources(self, gaps: Iterable[Mapping[str, str]], conditions: Sequence[Condition]) -> list[Key | None]:
        """The line of each of some gaps. A gap that has become smaller, since rows were added, still has that of the larger one."""
        space = _Space(conditions)
        keys = [key_of(cells) for cells in gaps]
        return [
            key if key in self.lines else next((line for line in self._by_size if space.is_inside(key, line)), None) for key in keys
        ]

    def of_gaps(self, gaps: Iterable[Mapping[str, str]], conditions: Sequence[Condition]) -> tuple[list[Work | None], list[Key]]:
        """The work on each of some gaps, and the lines that no gap is left of."""
        sources = self.sources(gaps, conditions)
        return [None if key is None else self.lines[key] for key in sources], sorted(self.lines.keys() - sources)

    def closed(self, gaps: Iterable[Mapping[str, str]], conditions: Sequence[Condition]) -> list[Key]:
        """The lines of which no context is in a gap any more, where these are all the gaps."""
        space, keys = _Space(conditions), [key_of(cells) for cells in gaps]
        return [line for line in self.lines if all(space.are_apart(line, key) for key in keys)]

    @cached_property
    def _by_size(self) -> list[Key]:
        """The lines that restrict most first: the smallest gaps."""
        return sorted(self.lines, key=lambda key: (-len(key), key))


def gaps_path(table: Path) -> Path:
    """The file of the work on a table's gaps."""
    return table.with_name(table.stem + GAPS_SUFFIX)


def key_of(cells: Mapping[str, str]) -> Key:
    """The cells of a gap as a key."""
    return tuple(sorted(cells.items()))


def write_work(table: Path, cells: Mapping[str, str], work: Work | None, without: Sequence[Key] = ()) -> GapWork:
    """Change one line of a table's file as `GapWork.with_work`, whatever others have written into it meanwhile. Raises FileError
    where the file cannot be read, or the disk refuses."""
    path = gaps_path(table)
    while True:
        raw = read_bytes(path) if path.is_file() else None
        new = (GapWork({}) if raw is None else GapWork.of(raw, str(path))).with_work(cells, work, without)
        if write_atomic(path, new.to_bytes(), was=raw):
            return new


def merge_gap_work(raws: Sequence[bytes], files: Sequence[str], takes: str | None = None) -> bytes:
    """Merge base, ours and theirs; `files` are their names in messages, `takes` the side that holds where both changed a gap.
    Raises FileError for a file that is none of gaps, or a gap that both sides changed."""
    base, ours, theirs = (_read(raw, file) if raw.strip() else {} for raw, file in zip(raws, files, strict=True))
    merged: dict[Key, Work] = {}
    for key in {**base, **ours, **theirs}:
        was, mine, yours = (lines.get(key) for lines in (base, ours, theirs))
        if mine != yours and was not in (mine, yours) and takes is None:
            text = ", ".join(f"{name}: {cell}" for name, cell in key) or "every context"
            raise FileError(Fault(f"the gap {in_quotes(text)} changed on both sides.", place=Place(files[1])))
        work = yours if mine == was or (takes == "theirs" and yours != was) else mine
        if work is not None:
            merged[key] = work
    return GapWork(merged).to_bytes()


def _read(raw: bytes, file: str) -> dict[Key, Work]:
    try:
        rows = list(csv.reader(io.StringIO(raw.decode("utf-8-sig"), newline=""), strict=True))
    except (UnicodeDecodeError, csv.Error) as error:
        raise FileError(Fault(f"this is not a file of gaps: {error}.", _ACCEPTED, place=Place(file))) from None
    header = rows[0] if rows else []
    names = header[len(FIELDS) :]
    if tuple(header[: len(FIELDS)]) != FIELDS or len(set(names)) != len(names) or "" in names or len(rows) > MOST_LINES:
        raise FileError(Fault("this is not a file of gaps.", _ACCEPTED, place=Place(file)))
    lines: dict[Key, Work] = {}
    faults: list[Fault] = []
    for number, row in enumerate(rows[1:], 2):
        if not any(row):
            continue
        key = key_of({name: cell.strip() for name, cell in zip(names, row[len(FIELDS) :], strict=False) if cell.strip()})
        if problem := _problem(row, header, key in lines):
            faults.append(Fault(problem[0], problem[1], place=Place(file, number)))
            continue
        lines[key] = Work(row[0].strip(), row[1].strip())
    if faults:
        raise FileError(*faults)
    return lines


_ACCEPTED = f"the columns {', '.join(FIELDS)}, then conditions, each once; at most {MOST_LINES:,} lines"


def _problem(row: Sequence[str], header: Sequence[str], is_twice: bool) -> tuple[str, str] | None:
    """What is wrong with a line, and what is accepted."""
    if len(row) != len(header):
        return f"the line has {len(row)} cells.", f"{len(header)}, as the header has"
    if row[0].strip() not in STATES:
        return f"{in_quotes(row[0].strip())} is no state of a gap.", ", ".join(STATES)
    if len(row[1]) > MOST_OWNER or not row[1].isprintable():
        return "the owner is no name.", f"at most {MOST_OWNER} printable characters"
    return ("the gap is there twice.", "each gap once") if is_twice else None


class _Space:
    """Compares gaps by what their cells accept; a cell that cannot be read now is in nothing."""

    def __init__(self, conditions: Sequence[Condition]) -> None:
        self._conditions = {condition.name: condition for condition in conditions}

    def is_inside(self, gap: Key, line: Key) -> bool:
        """Whether the contexts of a gap are all among those of a line."""
        cells = dict(gap)
        return bool(line) and all(name in cells and self._accepts_less(name, cells[name], cell) for name, cell in line)

    def are_apart(self, line: Key, gap: Key) -> bool:
        """Whether no context is in both, as the cells of one condition say."""
        cells = dict(gap)
        both = (self._parsed(name, [cell, cells[name]]) for name, cell in line if name in cells)
        return any(parsed is not None and meet(parsed).is_empty for parsed in both)

    def _accepts_less(self, name: str, less: str, more: str) -> bool:
        if less == more:
            return True
        parsed = self._parsed(name, [less, more])
        return parsed is not None and meet(parsed).accepts == parsed[0].accepts

    def _parsed(self, name: str, cells: Sequence[str]) -> list[Cell] | None:
        """The cells of a condition; None where it is gone, or one cannot be read."""
        if name not in self._conditions:
            return None
        try:
            return [parse_cell(text, self._conditions[name].domain, wants_mend=False) for text in cells]
        except CellError:
            return None
