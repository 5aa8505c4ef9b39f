"""Contexts from files: one row a moment, one column a fact. CSV texts are read as on the command line; Parquet keeps its types; of
the lines of a link the questions of the table are read."""

from __future__ import annotations

import glob
import os
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import polars as pl

from contextdb.cells.conditions import Condition
from contextdb.cells.fact_columns import column_type
from contextdb.cells.facts import Unknown, read_fact_text
from contextdb.cells.sets import Cell
from contextdb.compiled.batch import query_encoded
from contextdb.compiled.many import ManyMatches
from contextdb.compiled.table import CompiledTable, data_of
from contextdb.disk import path_in_quotes
from contextdb.errors import ContextError, Fault, FileError, Place, in_quotes, nearest
from contextdb.files.csv_source import text_columns
from contextdb.telemetry.chunks import Chunk, chunks_of

ONE = "one value of its type in each context"


@dataclass(frozen=True, eq=False)
class Contexts:
    """Contexts of one file, one row each."""

    path: Path
    facts: pl.DataFrame
    """The facts that the table asks for, typed as `query_many` takes them, null where one is missing. Other columns are all null:
    their names may tell of a misspelling, and a row that says nothing to the table is a context too."""
    chunks: Sequence[Chunk]
    """Where the rows come from, one after the other."""

    def ask(self, compiled: CompiledTable, unknown: Unknown) -> ManyMatches:
        """The valid rows in every context; a ContextError names file, line and fact."""
        try:
            return query_encoded(data_of(compiled), self.facts, unknown)
        except ContextError as error:
            raise ContextError(*(replace(fault, place=self._place(fault.place)) for fault in error.faults)) from None

    def _place(self, place: Place) -> Place:
        if place.row is None:
            return Place(str(self.path), None, place.column)
        row = self.chunks[0].first_row + place.row
        chunk = next(one for one in reversed(self.chunks) if one.first_row <= row)
        return Place(str(self.path), chunk.line(row - chunk.first_row), place.column, row)


def context_files(pattern: str) -> list[Path]:
    """The files that a path or a glob means, in the order of their names. Raises FileError where there is none."""
    if os.path.isfile(pattern):
        return [Path(pattern)]
    files = sorted(Path(p) for p in glob.glob(pattern, recursive=True) if os.path.isfile(p))
    if not files:
        accepted = "a .csv, .parquet or .jsonl file, or a glob"
        raise FileError(Fault("no file of contexts is there.", accepted, _near(Path(pattern)), Place(pattern), "no-such-path"))
    return files


def distinct_files(patterns: Iterable[str]) -> list[Path]:
    """The files that some paths or globs mean, each once, in the order of their names. Raises FileError as `context_files`."""
    by_path = {os.path.realpath(path): path for pattern in patterns for path in context_files(pattern)}
    return sorted(by_path.values())


def _near(path: Path) -> str:
    """What may have been meant by a name that is not a file's: the files of a folder, or a file of nearly that name."""
    if os.path.isdir(path):
        suffixes = {file.suffix for file in path.iterdir()}
        return next((path_in_quotes(path / f"*{suffix}") for suffix in (".parquet", ".csv", ".jsonl") if suffix in suffixes), "")
    near = nearest(path.name, sorted(os.listdir(path.parent))) if os.path.isdir(path.parent) else None
    return path_in_quotes(path.parent / near) if near else ""


def read_contexts(path: Path, compiled: CompiledTable) -> Contexts:
    """Read the contexts of a file for a table. Raises TableError, ContextError or FileError where the file cannot be read, or holds
    facts that the table cannot use; file, line and fact are named."""
    read = list(contexts_in(path, compiled))
    facts = pl.concat([one.facts for one in read], how="diagonal_relaxed")  # of lines, each piece has the facts that are in it
    return Contexts(path, facts, [chunk for one in read for chunk in one.chunks])


def contexts_in(path: Path, compiled: CompiledTable) -> Iterator[Contexts]:
    """The same, a chunk of the file at a time."""
    known = known_conditions(compiled)
    for names, chunk in chunks_of(path, known, compiled.name):
        yield Contexts(path, _facts(path, names, chunk, known), (chunk,))


def _facts(path: Path, names: Sequence[str], chunk: Chunk, known: Mapping[str, Condition]) -> pl.DataFrame:
    series, faults = [], []
    for name in names:
        condition = known.get(name)
        if condition is None or not chunk.n_rows:
            series.append(pl.repeat(None, chunk.n_rows, dtype=pl.Null, eager=True).alias(name))
        elif not chunk.is_text:
            series.append(chunk.frame[name])
        else:
            [column] = text_columns(chunk.frame[name].to_frame(), [name])
            values, wrong = read_texts_as(column.texts, condition)
            faults += [f.at(Place(str(path), chunk.line(int((column.codes == i).argmax())), name)) for i, f in wrong]
            series.append(pl.Series(name, values, dtype=fact_type(condition), strict=False).gather(column.codes))
    if faults:
        raise ContextError(*sorted(faults, key=lambda fault: fault.place.line or 0))
    return pl.DataFrame(series)


def known_conditions(compiled: CompiledTable) -> dict[str, Condition]:
    """The conditions that columns may be about; derived ones too, which the table then refuses."""
    return compiled.asked | {c.name: c for c in compiled.conditions}


def read_texts_as(texts: Sequence[str], condition: Condition) -> tuple[list[object], list[tuple[int, Fault]]]:
    """Texts as facts, and what is wrong with which of them."""
    values: list[object] = []
    faults: list[tuple[int, Fault]] = []
    for i, text in enumerate(texts):
        try:
            fact = read_fact_text(text, condition)
            if isinstance(fact, Cell):
                raise ContextError(Fault(f"{in_quotes(text)} is a set of values.", ONE, rule="wrong-fact"))
            values.append(as_given(fact, condition))
        except ContextError as error:
            values.append(None)
            faults += [(i, replace(f, accepted=ONE) if f.rule == "unreadable-cell" else f) for f in error.faults]
    return values, faults


def as_given(fact: object, condition: Condition) -> object:
    """A fact in canonical form as Python code has it."""
    if isinstance(fact, frozenset):
        return sorted(fact)
    return condition.domain.type.given(fact) if isinstance(fact, float) else fact


def fact_type(condition: Condition) -> pl.DataType:
    dtype: pl.DataType = column_type(condition.domain.type)
    return dtype
