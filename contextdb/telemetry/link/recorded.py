"""Recordings: the lines of a link in a file, *.jsonl. Each question of a table is a context; picks and decisions are none.

A recording may still be growing: a last line that is not whole is left out. Any other line that cannot be read is a fault.
"""

from __future__ import annotations

import os
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import polars as pl

from contextdb.disk import read_bytes
from contextdb.errors import Fault, FileError, Place, TableError, in_quotes, plural, some
from contextdb.telemetry.link.lines import ASK, FORMAT, HEADER, TABLES, Line, fact_text, read_line

BYTES = 1 << 24
MOST_FAULTS = 20
SUFFIX = ".jsonl"

Texts = Mapping[str, str | None]
"""Facts as they are written on the command line."""


def is_recording(path: Path) -> bool:
    return path.suffix.lower() == SUFFIX


@dataclass(frozen=True, eq=False)
class Piece:
    """Some lines of a recording, those of one table as facts."""

    raw: bytes
    starts: list[int]
    """Where in `raw` the line of each context begins."""
    facts: list[Texts]
    fact_names: Sequence[str]
    """The facts that the game's version of the table asks for."""
    share_done: float
    offset: int = 0
    """Where in the file `raw` begins."""
    lines_before: int = 0

    def frame(self, wanted: Collection[str]) -> tuple[Sequence[str], pl.DataFrame]:
        """The names of all facts, and the wanted ones as texts, null where one is missing."""
        names = list(dict.fromkeys((*self.fact_names, *(name for facts in self.facts for name in facts))))
        return names, facts_frame(self.facts, [name for name in names if name in wanted])


def facts_frame(facts: Sequence[Texts], names: Sequence[str]) -> pl.DataFrame:
    """Facts as a frame of texts, a row for each moment; null where one is missing."""
    return pl.DataFrame([pl.Series(name, [each.get(name) for each in facts], dtype=pl.String) for name in names])


def pieces_of(path: Path, table: str) -> Iterator[Piece]:
    """A recording, some lines at a time; one empty piece where it holds no line. Raises TableError or FileError where it cannot be
    read, lines of it are damaged (each with its number), or none is about the table."""
    reader = _Reader(path, table)
    n_bytes = n_lines = n_rows = 0
    try:
        with path.open("rb") as file:
            size = max(1, os.fstat(file.fileno()).st_size)
            while lines := file.readlines(BYTES):
                starts, facts = reader.read(lines)
                raw = b"".join(lines)
                if facts:
                    share_done = min(1.0, (n_bytes + len(raw)) / size)
                    yield Piece(raw, starts, facts, reader.tables.get(table, ()), share_done, n_bytes, n_lines)
                n_bytes, n_lines, n_rows = n_bytes + len(raw), n_lines + len(lines), n_rows + len(facts)
                if not raw.endswith(b"\n"):
                    break
    except OSError as error:
        raise FileError(Fault(f"the file cannot be read: {error.strerror}.", place=Place(str(path)))) from None
    reader.end()
    if not n_rows:
        yield Piece(b"", [], [], reader.tables.get(table, ()), 1.0, n_bytes, n_lines)


@dataclass(frozen=True, eq=False)
class Recorded:
    """Where the questions of a table are in a recording."""

    path: Path
    starts: list[int]
    stops: list[int]
    names: tuple[str, ...]
    """The facts that are given."""

    def facts(self, start: int, stop: int) -> list[Texts]:
        """The facts of some questions as a table of contexts has them: names without the quotes of the command line."""
        if start >= stop:
            return []
        try:
            with self.path.open("rb") as file:
                file.seek(self.starts[start])
                raw = file.read(self.stops[stop - 1] - self.starts[start])
        except OSError as error:
            raise FileError(Fault(f"the file cannot be read: {error.strerror}.", place=Place(str(self.path)))) from None
        first = self.starts[start]
        try:
            pairs = zip(self.starts[start:stop], self.stops[start:stop], strict=True)
            return [_plain_texts(_question(raw[i - first : j - first])) for i, j in pairs]
        except ValueError:
            problem = "the file has been changed since it was opened."
            raise TableError(Fault(problem, "a recording that only grows", place=Place(str(self.path)))) from None


def indexed(path: Path, table: str) -> Recorded:
    """Find the questions of a table in a recording; raises as `pieces_of`."""
    if not path.is_file():
        read_bytes(path)  # says why it cannot be read
    starts: list[int] = []
    stops: list[int] = []
    names: dict[str, None] = {}
    for piece in pieces_of(path, table):
        for at, facts in zip(piece.starts, piece.facts, strict=True):
            end = piece.raw.find(b"\n", at)
            starts.append(piece.offset + at)
            stops.append(piece.offset + (len(piece.raw) if end < 0 else end))
            names |= dict.fromkeys(facts)
    return Recorded(path, starts, stops, tuple(names))


class _Reader:
    """Reads lines and collects what is wrong with them."""

    def __init__(self, path: Path, table: str) -> None:
        self.path, self.table = path, table
        self.tables: dict[str, Sequence[str]] = {}
        """The facts that each table asks for."""
        self._faults: list[Fault] = []
        self._n_faults = 0
        self._n_lines = 0
        self._has_header = False

    def read(self, lines: Sequence[bytes]) -> tuple[list[int], list[Texts]]:
        """The questions of the table in some lines: where each begins, and its facts. The last of a file may be half a line."""
        starts: list[int] = []
        questions: list[Texts] = []
        at = 0
        for raw in lines:
            self._n_lines += 1
            try:
                line = self._line(raw)
                if line is not None and line["line"] == ASK and line["table"] == self.table:
                    questions.append(_texts(line))
                    starts.append(at)
            except ValueError as error:
                if self._has_header and raw.endswith(b"\n"):
                    self._fault(str(error))
            at += len(raw)
        return starts, questions

    def end(self) -> None:
        """Raise TableError where lines were damaged, or none is about the table."""
        if not self._has_header:
            problem = "this is not a recording of a link: its first line is not a header."
            accepted = "lines that `contextdb live --record` or link(record=...) wrote"
            raise TableError(Fault(problem, accepted, place=self._at(1)), *self._faults)
        if self._n_faults > len(self._faults):
            more = self._n_faults - len(self._faults)
            self._faults.append(Fault(f"{plural(more, 'more line')} cannot be read.", place=Place(str(self.path))))
        if not self._faults and self.table not in self.tables:
            known = some(self.tables) if self.tables else "it is of no table"
            problem = f"no line is about the table {in_quotes(self.table)}."
            self._faults.append(Fault(problem, f"a table of the recording: {known}", place=Place(str(self.path))))
        if self._faults:
            raise TableError(*self._faults)

    def _line(self, raw: bytes) -> Line | None:
        """A line; None for an empty one, and before the header."""
        if not raw.strip():
            return None
        line = read_line(raw)
        if line["line"] == HEADER:
            self._has_header = True
            if line["format"] != FORMAT:
                raise ValueError(f"it says format {line['format']}, and this contextdb reads format {FORMAT}.")
        elif not self._has_header:
            return None
        if line["line"] in (HEADER, TABLES):
            self.tables |= {name: tuple(table.get("conditions", ())) for name, table in line["tables"].items()}
        return line

    def _fault(self, problem: str) -> None:
        self._n_faults += 1
        if len(self._faults) < MOST_FAULTS:
            self._faults.append(Fault(f"the line cannot be read: {problem}", place=self._at(self._n_lines)))

    def _at(self, line: int) -> Place:
        return Place(str(self.path), line)


def _question(raw: bytes) -> Line:
    """A line that is a question; ValueError for any other."""
    line = read_line(raw)
    if line["line"] != ASK:
        raise ValueError("this is not a question.")
    return line


def _texts(line: Line) -> Texts:
    """The facts of a question; ValueError for what is no fact, or no text of UTF-8."""
    facts = {str(name): fact_text(value) for name, value in line["facts"].items()}
    for name, text in facts.items():
        if not name.isascii() or (text is not None and not text.isascii()):
            _require_text(name)
            _require_text(text or "")
    return facts


def _plain_texts(line: Line) -> Texts:
    return {name: line["facts"][name] if isinstance(line["facts"][name], str) else text for name, text in _texts(line).items()}


def _require_text(text: str) -> None:
    try:
        text.encode("utf-8")
    except UnicodeEncodeError:
        raise ValueError("half a surrogate pair in a text.") from None
