"""Evaluate every context of a CSV or Parquet file, or of all files of a glob: how often each asset is valid, how often none.

  contextdb evaluate tables/hit_mid_air.csv moments.csv
  contextdb evaluate hit_mid_air "telemetry/*.parquet" --unknown any --out answers.parquet
  contextdb evaluate hit_mid_air "telemetry/*.parquet" --engine dask --scheduler tcp://10.0.0.5:8786

Files are streamed. A run that fails or is interrupted leaves FILE as it was. With --engine dask the workers read the files, and
write next to FILE, under the same paths as here.
"""

from __future__ import annotations

import argparse
import os
import sys
import tempfile
from collections.abc import Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np
import polars as pl

from contextdb.bitmask import Rows
from contextdb.cells.facts import UNKNOWN_MODES
from contextdb.commands import answer, missing_facts_by_option
from contextdb.commands.coverage_command import ENGINES
from contextdb.commands.progress import bar, has_many_bytes
from contextdb.compiled.table import CompiledTable
from contextdb.console import ExitCode, aligned, printable, styled, wants_colour
from contextdb.disk import TABLE_SUFFIXES, is_stream, path_in_quotes, real_path, refused_writing, write_atomic
from contextdb.disk.folder_lock import temporary_folder
from contextdb.errors import ContextDBError, ContextError, Fault, FileError, Place, plural
from contextdb.files.texts import is_parquet
from contextdb.tables.places import open_compiled
from contextdb.telemetry.contexts import context_files
from contextdb.telemetry.evaluate_file import Answered

N_SHOWN = 15
PIECE_BYTES = 1 << 22


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("table", metavar="TABLE", help="a .csv, .parquet or .safetensors file, or the name of a table")
    parser.add_argument(
        "contexts", metavar="CONTEXTS", help="a CSV or Parquet file with a column for each fact, a recording (.jsonl), or a glob"
    )
    parser.add_argument("--out", metavar="FILE", help="write each context's valid rows: .csv, .parquet, or a pipe that reads CSV")
    parser.add_argument("--engine", choices=ENGINES, default="local", help="read files here, or on Dask workers (default: local)")
    parser.add_argument("--scheduler", metavar="ADDRESS", help="the Dask scheduler; without it, workers on this machine")
    parser.add_argument("--unknown", choices=UNKNOWN_MODES, default="error", help="how to treat a missing fact (default: error)")
    parser.add_argument("--json", action="store_true", help="a JSON document instead of text")


def run(arguments: argparse.Namespace) -> ExitCode:
    """Evaluate the files; only sums stay in memory, and with --out the answers, in a folder next to it until they are complete."""
    if arguments.scheduler is not None and arguments.engine != "dask":
        raise ContextError(Fault("--scheduler is the address of Dask's.", "--engine dask with it"))
    compiled = open_compiled(arguments.table)
    files = context_files(arguments.contexts)
    out = None if arguments.out is None else _out_file(Path(arguments.out), files)
    with _folder_parent(out) as folder:
        answered = _answered(arguments, compiled, files, folder)
        if out is not None and folder is not None:
            _write(answered, folder, out)
    sums = list(answered.values())
    n_contexts, n_without = sum(a.contexts for a in sums), sum(a.without for a in sums)
    hits = np.sum([a.hits for a in sums], axis=0)
    about = (compiled, n_contexts, n_without, hits)
    answer(arguments, lambda: _document(*about), lambda: _lines(*about))
    return ExitCode.OK


def _answered(
    arguments: argparse.Namespace, compiled: CompiledTable, files: Sequence[Path], folder: Path | None
) -> dict[Path, Answered]:
    """The answers to the contexts of each file, in the order of the files. Raises ContextDBError where a file cannot be read, holds
    facts that the table cannot use, or was not finished; then nothing is reported."""
    from contextdb.disk.engines import with_dask
    from contextdb.telemetry.evaluate_file import Question, evaluate_file

    question = Question(compiled, arguments.unknown, folder)
    answers: dict[Path, Answered] = {}
    with bar("evaluating", has_many_bytes(files)) as tell:

        def tell_share(share: float) -> None:
            if tell is not None:
                tell(len(answers) + share, len(files))

        here = ((path, evaluate_file(question, path, tell_share)) for path in files)
        there = ((files[i], each) for i, each in with_dask(evaluate_file, question, files, arguments.scheduler))
        for path, answered in there if arguments.engine == "dask" else here:
            if answered.faults and arguments.engine == "local":
                raise _by_option(answered.faults)
            answers[path] = answered
            tell_share(0.0)
    if faults := [fault for path in files for fault in answers[path].faults]:
        raise _by_option(faults)
    return {path: answers[path] for path in files}


def _by_option(faults: Sequence[Fault]) -> ContextError:
    try:
        with missing_facts_by_option():
            raise ContextError(*faults)
    except ContextError as error:
        return error


@contextmanager
def _folder_parent(out: Path | None) -> Iterator[Path | None]:
    """A folder for what is not finished, next to the file that it becomes; it goes, whatever happens."""
    if out is None:
        yield None
        return
    parent = Path(tempfile.gettempdir()) if is_stream(out) else real_path(out.parent)
    with ExitStack() as stack:
        with refused_writing(out, ()):
            folder = stack.enter_context(temporary_folder(parent))
        try:
            yield folder
        except ContextDBError as error:  # what is not finished has names that mean nothing to the user
            raise type(error)(*(_of_out(fault, folder, out) for fault in error.faults)) from None


def _of_out(fault: Fault, folder: Path, out: Path) -> Fault:
    is_inside = fault.place.file is not None and Path(fault.place.file).is_relative_to(folder)
    return replace(fault, place=Place(str(out))) if is_inside else fault


def _out_file(out: Path, files: Sequence[Path]) -> Path:
    """The file to write to, refused before the work where it could only be refused after."""
    place = Place(str(out))
    if is_stream(out):
        return out
    if out.suffix not in TABLE_SUFFIXES:
        raise FileError(
            Fault("answers cannot be written to such a file.", f"a name that ends in {' or '.join(TABLE_SUFFIXES)}", place=place)
        )
    if not os.path.isdir(out.parent):
        raise FileError(
            Fault(f"there is no folder {path_in_quotes(out.parent)}.", "an existing folder", place=place, rule="no-such-path")
        )
    if os.path.realpath(out) in map(os.path.realpath, files):
        raise FileError(Fault("the answers would be written over the contexts.", "another file", place=place))
    return out


def _write(answered: Mapping[Path, Answered], folder: Path, out: Path) -> None:
    """Join the answers of the files, numbering contexts through, into one file; streamed."""
    from contextdb.telemetry.evaluate_file import answers_of, answers_written

    frames, first = [], 0
    for path, own in answered.items():
        scan = pl.scan_parquet(answers_of(folder, path), glob=False)
        frames.append(scan.with_columns(pl.col("context") + first))
        first += own.contexts
    joined, whole = pl.concat(frames), folder / f"answers{out.suffix or TABLE_SUFFIXES[0]}"
    with answers_written(out):
        if is_parquet(whole):
            joined.sink_parquet(whole)
        else:
            texts = (pl.col("rows").cast(pl.List(pl.String)).list.join(" "), pl.col("assets").list.join(" | "))
            joined.with_columns(*texts).sink_csv(whole)
    with whole.open("rb") as file:
        write_atomic(out, iter(partial(file.read, PIECE_BYTES), b""))


def _document(compiled: CompiledTable, n_contexts: int, n_without: int, hits: Rows) -> dict[str, object]:
    rows = [{"row": r, "asset": a, "hits": int(h)} for r, (a, h) in enumerate(zip(compiled.assets, hits, strict=True))]
    return {"table": compiled.name, "contexts": n_contexts, "without_asset": n_without, "rows": rows}


def _lines(compiled: CompiledTable, n_contexts: int, n_without: int, hits: Rows) -> Iterator[str]:
    colour = wants_colour(sys.stdout)
    yield f"{plural(n_contexts, 'context')} against {plural(compiled.n_rows, 'row')} of {printable(compiled.name)}"
    summary = f"{plural(n_without, 'context')} without a valid asset" + (f" ({share(n_without, n_contexts)})" if n_contexts else "")
    yield styled(summary, "yellow" if n_without else "green", colour)
    order = np.argsort(-hits, kind="stable")
    used = [r for r in order.tolist() if hits[r]]
    if used:
        lines = [(f"{int(hits[r]):,}", share(int(hits[r]), n_contexts), str(r + 1), compiled.assets[r]) for r in used[:N_SHOWN]]
        yield ""
        yield from aligned([("contexts", "share", "row", "asset"), *lines], right=(0, 1, 2))
        if len(used) > N_SHOWN:
            yield f"… and {plural(len(used) - N_SHOWN, 'more row')}"
    if never := len(hits) - len(used):
        yield ""
        yield f"{plural(never, 'row')} never valid"


def share(part: int, whole: int) -> str:
    """A percentage that says 0 or 100 only when it is exactly that."""
    percent = 100.0 * part / whole if whole else 0.0
    if part > 0 and percent < 0.1:
        return "<0.1 %"
    return ">99.9 %" if part < whole and percent > 99.9 else f"{percent:.1f} %"
