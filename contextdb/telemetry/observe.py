"""Hold recorded contexts against a table: the share of real moments with a valid row, and where the others are.

A folder holds one file for each telemetry file that was observed to its end: numpy arrays and a line of JSON, no pickle. It is
written in one step. A part counts only for the same table, settings and version, and for a file of the same size and time;
otherwise its file is read again.
"""

from __future__ import annotations

import hashlib
import io
import json
import os
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from contextdb.cells.arguments import require_many, require_path, require_text
from contextdb.compiled.classes import TagMasks
from contextdb.compiled.data import CompiledData
from contextdb.compiled.table import CompiledTable
from contextdb.covering.assumed import opened
from contextdb.covering.factors import TagFactor
from contextdb.covering.report import Gap
from contextdb.covering.ruled import RuledTable
from contextdb.covering.space import Space, require_counts
from contextdb.disk import make_folder, read_bytes, write_atomic
from contextdb.disk.boundary import inside
from contextdb.disk.engines import ENGINES, Engine, with_dask
from contextdb.errors import ContextDBError, ContextError, Fault, FileError, no_such
from contextdb.tables.table import EitherTable
from contextdb.telemetry.contexts import distinct_files
from contextdb.telemetry.facts_read import estimated
from contextdb.telemetry.observe_file import observe_file
from contextdb.telemetry.observed import BadFile, FactNote, Observed, SeenGap
from contextdb.telemetry.parts import MOST_HASHES, MOST_OPEN, Part, Plan, added, nothing
from contextdb.telemetry.seen_gaps import box_of, seen_gaps

MOST_GAPS = 20
MOST_THREADS = 4
"""Beside those that read: more would wait for them, and each holds a chunk in memory."""
Tell = Callable[[float, int], None]
"""Called with how many files are done, and how many there are; a file that is half done counts half."""


def observe(
    table: EitherTable | CompiledTable,
    files: str | Path | Sequence[str | Path],
    *,
    count: str | None = None,
    engine: Engine = "local",
    scheduler: str | None = None,
    progress: Tell | None = None,
    resume: str | Path | None = None,
    max_gaps: int = MOST_GAPS,
    known: Sequence[Gap] = (),
) -> Observed:
    """Evaluate recorded contexts against a table. Files are streamed, and only sums are retained.

    Parameters
    ----------
    files : path or glob, or several
        CSV or Parquet files with a column for each fact and a row for each moment, or recordings of a link (.jsonl).
    count : str, optional
        A column that says how often each row's moment was seen, a whole number from 0 up.
    engine : {"local", "dask"}
        This process, or Dask (`pip install "contextdb[dask]"`): the workers of `scheduler`, or a cluster of this machine's own.
    progress : callable of (float, int), optional
        Called with how many files are done, of how many; first with 0. A file that is half done counts half, where it is read here.
    resume : path of a folder, optional
        Where the sums of finished files are kept. A run that was interrupted goes on there; a changed file or table is read anew.
    max_gaps : int
        At most so many gaps are named, besides those that are known.
    known : sequence of Gap, optional
        Gaps of the table, as `coverage` gives them: moments are counted into these first.

    Returns
    -------
    Observed
        The same for any engine, and for files in any order. Files that cannot be read are in `unread`; nothing of such a file is
        counted.

    Raises
    ------
    TableError, ExpressionError
        The table has cells, or an assumption, that cannot be read.
    FileError, ContextError
        There is no such file, or none of them can be read; an engine that there is not; a compiled table with rules.
    EngineError
        Dask is missing or does not answer, or files were not finished on its workers: they are named.
    """
    require_counts(max_gaps=max_gaps)
    if not isinstance(engine, str) or engine not in ENGINES:
        raise ContextError(no_such("engine", engine, ENGINES))
    if count is not None:
        require_text(count, "count")
    if resume is not None:
        require_path(resume, "resume")
    ready = opened(table)
    compiled, space = ready.compiled, ready.space
    plan = Plan(compiled, count, _tag_factors(space, compiled))
    paths = _paths(files)
    total, unread = nothing(plan), []
    for path, part in _parts(plan, paths, engine, scheduler, resume, progress):
        total = added(total, part)
        unread += [BadFile(str(path), part.faults)] if part.faults else []
    if len(unread) == len(paths):
        raise FileError(*(fault for file in unread for fault in file.faults))
    boxes = [box for gap in known if (box := box_of(space, gap.cells)) is not None]
    gaps = seen_gaps(space, compiled, total, max_gaps, boxes)
    named = tuple(gap if ready.ruled is None else _with_rules(gap, ready.ruled) for gap in gaps.gaps)
    return _observed(compiled, total, sorted(unread, key=lambda f: f.file), named, gaps.elsewhere)


def _with_rules(gap: SeenGap, ruled: RuledTable) -> SeenGap:
    """A gap in which cells of columns that the table does not have are a rule."""
    if ruled.column is None:
        return gap
    near = gap.nearest
    is_rule = near is not None and near.condition in ruled.rules
    named = replace(near, condition=ruled.column, cell="Any") if near is not None and is_rule else near
    return replace(gap, cells=ruled.cells(gap.cells), nearest=named)


def _paths(files: str | Path | Sequence[str | Path]) -> list[Path]:
    several = [files] if isinstance(files, (str, Path)) else require_many(files, "files", "a path or a glob, or several")
    patterns = [require_path(each, "one of files") for each in several]
    if not patterns:
        raise FileError(Fault("no file of contexts is given.", "a .csv, .parquet or .jsonl file, or a glob", rule="no-such-path"))
    return distinct_files(map(str, patterns))


def _parts(
    plan: Plan, paths: Sequence[Path], engine: Engine, scheduler: str | None, resume: str | Path | None, progress: Tell | None
) -> Iterator[tuple[Path, Part]]:
    """The part of every file, those that are retained from an earlier run first."""
    saved = None if resume is None else SavedParts(Path(resume), plan)
    parts = {path: part for path in paths if saved is not None and (part := saved.get(path)) is not None}
    keys = {} if saved is None else {path: saved.key(path) for path in paths}
    n_done = len(parts)
    _tell(progress, n_done, len(paths))
    yield from parts.items()
    left = [path for path in paths if path not in parts]
    if not left:
        return

    def tell_share(share: float) -> None:
        if share < 1.0:
            _tell(progress, n_done + share, len(paths))

    n_threads = min(os.cpu_count() or 1, MOST_THREADS)
    here = ((path, observe_file(plan, path, n_threads, tell_share)) for path in left)
    mend = "to run again; with a resume folder, finished files are not read again"
    there = ((left[i], part) for i, part in with_dask(observe_file, plan, left, scheduler, mend))
    for path, part in there if engine == "dask" else here:
        if saved is not None:
            saved.put(path, part, keys[path])
        n_done += 1
        _tell(progress, n_done, len(paths))
        yield path, part


def _tell(progress: Tell | None, n_done: float, n_files: int) -> None:
    if progress is not None:
        progress(n_done, n_files)


def _tag_factors(space: Space, compiled: CompiledData) -> dict[str, tuple[TagFactor, ...]]:
    factors = {}
    for at, condition in enumerate(compiled.conditions):
        if isinstance(compiled.masks[at], TagMasks):
            factors[condition.name] = tuple(f for n in space.of_condition[at] if isinstance(f := space.factors[n], TagFactor))
    return factors


def _observed(
    compiled: CompiledData, total: Part, unread: Sequence[BadFile], gaps: tuple[SeenGap, ...], elsewhere: float
) -> Observed:
    outside = [FactNote(n, total.outside[n], total.examples[n]) for n in compiled.asked if total.outside[n]]
    return Observed(
        table=compiled.name,
        files=total.files,
        rows=total.rows,
        moments=total.moments,
        distinct=min(estimated(total.hashes, total.is_full), total.rows),
        distinct_is_exact=not total.is_full,
        uncovered=total.uncovered,
        hits=tuple(total.hits.tolist()),
        gaps=gaps,
        elsewhere=elsewhere,
        missing=tuple(FactNote(n, total.missing[n]) for n in compiled.asked if total.missing[n]),
        outside=tuple(outside),
        unknown_columns=tuple(sorted(total.columns)),
        unread=tuple(unread),
    )


# ---- parts of an observation kept on disk, so that an interrupted run continues where it stopped


VERSION = 2
_ARRAYS = ("hits", "hashes", "open_hashes", "open_keys", "open_moments")
_PLAIN = ("rows", "moments", "uncovered", "is_full", "has_all_open", "files")


class SavedParts:
    """The parts in a folder, for one plan."""

    def __init__(self, folder: Path, plan: Plan) -> None:
        self.folder, self.digest = folder, plan_digest(plan)
        make_folder(folder)

    def get(self, path: Path) -> Part | None:
        """The part of a file that has not changed since; None where there is none, or none that can be used."""
        try:
            raw = read_bytes(self._file(path))
            with np.load(io.BytesIO(raw), allow_pickle=False) as arrays:
                about = json.loads(str(arrays["about"]))
                if about["for"] != self.key(path):
                    return None
                saved = {name: arrays[name] for name in _ARRAYS}
        except (ContextDBError, OSError, ValueError, KeyError, EOFError, TypeError, IndexError):
            return None
        except Exception as error:  # a file cut short: zipfile has errors of its own
            if type(error).__module__ not in ("zipfile", "zlib"):
                raise
            return None
        given: dict[str, Any] = {**saved, **{name: about[name] for name in _PLAIN}}
        given |= {name: Counter(about[name]) for name in ("missing", "outside")}
        examples = {name: tuple(texts) for name, texts in about["examples"].items()}
        return Part(**given, examples=examples, columns=frozenset(about["columns"]))

    def put(self, path: Path, part: Part, key: str) -> None:
        """Keep the part of a file, unless it could not be read."""
        if part.faults:
            return
        about = {name: getattr(part, name) for name in (*_PLAIN, "missing", "outside", "examples")}
        text = json.dumps({"for": key, "columns": sorted(part.columns), **about})
        buffer = io.BytesIO()
        arrays = {name: getattr(part, name) for name in _ARRAYS}
        np.savez_compressed(buffer, about=np.array(text), **arrays)
        write_atomic(self._file(path), buffer.getvalue())

    def _file(self, path: Path) -> Path:
        name = hashlib.sha256(os.path.realpath(path).encode("utf-8", "surrogateescape")).hexdigest()[:24]
        return inside(self.folder / f"{name}.npz", self.folder)

    def key(self, path: Path) -> str:
        """What a part is for: taken before its file is read, so that one written to meanwhile does not count."""
        seen = os.stat(path)
        return f"{self.digest} {seen.st_size} {seen.st_mtime_ns}"


def plan_digest(plan: Plan) -> str:
    """A name for all that a part depends on besides its file."""
    compiled = plan.compiled
    digest = hashlib.sha256(f"{VERSION} {MOST_OPEN} {MOST_HASHES} {plan.count!r}".encode())
    for condition, texts in zip(compiled.conditions, compiled.texts, strict=True):
        digest.update(repr((condition.name, condition.domain, condition.expr, texts.texts)).encode("utf-8", "surrogatepass"))
        digest.update(texts.codes.tobytes())
    inputs = () if compiled.derivation is None else compiled.derivation.conditions
    digest.update(repr([(c.name, c.domain, c.expr) for c in inputs]).encode("utf-8", "surrogatepass"))
    digest.update(compiled.enabled.tobytes() + str(compiled.n_rows).encode())
    return digest.hexdigest()
