"""Ask a table with every context of a file: the one function that every engine runs for `contextdb evaluate`.

A chunk at a time is read, as strictly as a single query reads its facts, and only sums are retained. The answers, where they are
wanted, go into Parquet files of a folder, a chunk each; the folder takes its name when the last is written, so that it is there
whole or not at all, and a file that is asked twice, since a worker died, is there once.
"""

from __future__ import annotations

import hashlib
import os
import re
import secrets
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import polars as pl

from contextdb.bitmask import Rows
from contextdb.cells.facts import Unknown
from contextdb.compiled.batch import query_encoded
from contextdb.compiled.many import rows_of
from contextdb.compiled.table import CompiledTable, data_of
from contextdb.console import printable
from contextdb.disk import why_unwritten
from contextdb.disk.folder_lock import growing_folder
from contextdb.errors import ContextDBError, Fault, FileError, Place
from contextdb.telemetry.contexts import contexts_in

MOST_ANSWERS = 1 << 21
"""Valid rows, summed over contexts, that are written at once."""
MOST_CONTEXTS = 1 << 14
EMPTY: dict[str, pl.DataType] = {
    "context": pl.Int64(),
    "file": pl.String(),
    "count": pl.Int64(),
    "rows": pl.List(pl.Int64),
    "assets": pl.List(pl.String),
}
"""The columns of answers."""


@dataclass(frozen=True, eq=False)
class Question:
    """What is evaluated for each context."""

    compiled: CompiledTable
    unknown: Unknown
    folder: Path | None = None
    """Where answers go: those of a file into a folder in it."""


@dataclass(frozen=True, eq=False)
class Answered:
    """Sums over the contexts of a file."""

    contexts: int
    without: int
    """Contexts without a valid row."""
    hits: Rows
    faults: tuple[Fault, ...] = ()
    """Why the file could not be answered; the sums are of nothing then."""


def evaluate_file(question: Question, path: Path, tell: Callable[[float], None] | None = None) -> Answered:
    """Ask the table with every context of a file; one that cannot be read, or asked with, gives its faults."""
    compiled = question.compiled
    n_contexts = n_without = 0
    hits = np.zeros(compiled.n_rows, np.int64)
    try:
        with _answers_folder(question.folder, path) as folder:
            for i, contexts in enumerate(contexts_in(path, compiled)):
                many = contexts.ask(compiled, question.unknown)
                n_without += int((many.counts == 0).sum())
                hits += many.hits
                if folder is not None:
                    _write(question, contexts.facts, many.counts, n_contexts, printable(str(path)), folder / f"{i:08}")
                n_contexts += len(contexts.facts)
                if tell is not None:
                    tell(contexts.chunks[-1].share_done)
    except ContextDBError as error:
        return Answered(0, 0, np.zeros(compiled.n_rows, np.int64), error.faults)
    return Answered(n_contexts, n_without, hits)


def answers_of(folder: Path, path: Path) -> list[Path]:
    """The Parquet files with the answers of a file, in their order."""
    return sorted((folder / _name(path)).glob("*.parquet"))


def _name(path: Path) -> str:
    return hashlib.sha256(os.fsencode(path)).hexdigest()[:24]


@contextmanager
def _answers_folder(folder: Path | None, path: Path) -> Iterator[Path | None]:
    """A folder for the answers of a file that takes its name at the end."""
    if folder is None:
        yield None
        return
    whole, growing = folder / _name(path), folder / f"{_name(path)}.{secrets.token_hex(4)}"
    with answers_written(folder), growing_folder(growing, whole):
        yield growing  # where an earlier worker finished it, and died before it could say so, that one's stays


@contextmanager
def answers_written(place: Path) -> Iterator[None]:
    """Turn what the system or polars refuses into a `FileError` at that place."""
    try:
        yield
    except ContextDBError:  # an OSError too where it is a FileError
        raise
    except (OSError, pl.exceptions.PolarsError) as error:
        refused = _of_system(error)
        new = place.with_suffix(".new") if place.is_dir() else place  # the folder of what is not finished is no old file
        raise FileError(replace(why_unwritten(refused, new), place=Place(str(place))), errno=refused.errno) from None


def _of_system(error: Exception) -> OSError:
    """What the system refused: polars says its number in a text alone. A text without one loses the names that nobody requested."""
    if isinstance(error, OSError) and error.errno is not None:
        return error
    text = str(error).strip()
    if match := re.search(r"\(os error (\d+)\)", text):
        number = int(match[1])  # of Windows there; Python then knows which number it has elsewhere
        return OSError(number, os.strerror(number), None, number)
    return OSError(re.sub(r"\s*:?\s*\S*\.contextdb-\S*", "", text.splitlines()[0] if text else "no reason given").rstrip(".:"))


def _write(question: Question, facts: pl.DataFrame, counts: Rows, first: int, file: str, stem: Path) -> None:
    """Write the answers of a chunk, as many contexts at once as have not too many valid rows."""
    if not len(counts):
        pl.DataFrame(schema=EMPTY).write_parquet(f"{stem}-0.parquet")
    start = i = 0
    while start < len(counts):
        within = np.cumsum(counts[start : start + MOST_CONTEXTS])
        stop = start + max(1, int(np.searchsorted(within, MOST_ANSWERS, "right")))
        answers = _answers(question, facts[start:stop], first + start, file)
        answers.write_parquet(f"{stem}-{i:08}.parquet", compression="lz4")
        start, i = stop, i + 1


def _answers(question: Question, facts: pl.DataFrame, first: int, file: str) -> pl.DataFrame:
    many = query_encoded(data_of(question.compiled), facts, question.unknown)
    contexts = np.arange(first, first + len(many))
    rows = pl.Series("rows", rows_of(many.mask))
    assets = pl.Series("assets", list(question.compiled.assets), dtype=pl.String).gather(rows)
    flat = pl.DataFrame([pl.Series("context", np.repeat(contexts, many.counts)), rows, assets])
    listed = flat.group_by("context", maintain_order=True).agg("rows", "assets")
    every = pl.DataFrame({"context": contexts, "file": [file] * len(many), "count": many.counts})
    joined = every.join(listed, on="context", how="left", maintain_order="left")
    return joined.with_columns(pl.col("rows").fill_null([]), pl.col("assets").fill_null([]))
