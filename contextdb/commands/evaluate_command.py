"""Every context of a CSV or Parquet file, or of all files of a glob: in how many each asset is valid, and how many have none.

A file of contexts has a column for each fact and a row for each moment.

  contextdb evaluate tables/hit_mid_air.csv moments.csv
  contextdb evaluate hit_mid_air "telemetry/*.parquet" --unknown any --out answers.parquet
"""

from __future__ import annotations

import argparse
import io
import os
import sys
from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np
import polars as pl

from contextdb.batch import ManyMatches
from contextdb.bitmask import Rows
from contextdb.commands import missing_facts_by_option
from contextdb.compiled import CompiledTable
from contextdb.console import aligned, output, printable, progress, styled, wants_colour
from contextdb.contexts import context_files, read_contexts
from contextdb.disk import path_in_quotes, write_atomic
from contextdb.errors import Fault, FileError, Place, plural
from contextdb.exit_codes import ExitCode
from contextdb.facts import UNKNOWN_MODES
from contextdb.places import open_compiled
from contextdb.report.render_json import as_json

N_SHOWN = 15
OUT_SUFFIXES = (".csv", ".parquet")


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """The arguments of the command."""
    parser.add_argument("table", metavar="TABLE", help="a .csv, .parquet or .safetensors file, or the name of a table")
    parser.add_argument("contexts", metavar="CONTEXTS", help="a CSV or Parquet file with a column for each fact, or a glob")
    parser.add_argument("--out", metavar="FILE", help="write each context's valid rows: .csv or .parquet")
    parser.add_argument("--engine", choices=("local",), default="local", help="where to work it out (default: local, all cores)")
    parser.add_argument("--unknown", choices=UNKNOWN_MODES, default="error", help="what a missing fact does (default: error)")
    parser.add_argument("--json", action="store_true", help="a JSON document instead of text")


def run(arguments: argparse.Namespace) -> ExitCode:
    """Evaluate the files one after the other; only sums are kept, and with --out the answers."""
    compiled = open_compiled(arguments.table)
    files = context_files(arguments.contexts)
    out = None if arguments.out is None else _out_file(Path(arguments.out), files)
    n_contexts = n_without = 0
    hits = np.zeros(compiled.n_rows, np.int64)
    answers = []
    for path in progress(files, "evaluating"):
        with missing_facts_by_option():
            many = read_contexts(path, compiled).ask(compiled, arguments.unknown)
        n_without += int((many.counts == 0).sum())
        hits += many.hits
        if out is not None:
            answers.append(_answers(compiled, many, path, n_contexts))
        n_contexts += len(many)
    if out is not None:
        _write(pl.concat(answers), out)
    with output():
        if arguments.json:
            print(as_json(_document(compiled, n_contexts, n_without, hits)), end="")
        else:
            print(*_lines(compiled, n_contexts, n_without, hits), sep="\n")
    return ExitCode.OK


def _out_file(out: Path, files: Sequence[Path]) -> Path:
    """The file to write to, refused before the work where it could only be refused after."""
    place = Place(str(out))
    if out.suffix not in OUT_SUFFIXES:
        raise FileError(
            Fault("answers cannot be written to such a file.", f"a name that ends in {' or '.join(OUT_SUFFIXES)}", place=place)
        )
    if not os.path.isdir(out.parent):
        raise FileError(
            Fault(f"there is no folder {path_in_quotes(out.parent)}.", "a folder that is there", place=place, rule="no-such-path")
        )
    if out.resolve() in [path.resolve() for path in files]:
        raise FileError(Fault("the answers would be written over the contexts.", "another file", place=place))
    return out


def _answers(compiled: CompiledTable, many: ManyMatches, path: Path, first: int) -> pl.DataFrame:
    assets = np.array(compiled.assets, object)
    rows = many.lists()
    return pl.DataFrame(
        {
            "context": np.arange(first, first + len(many)),
            "file": [printable(str(path))] * len(many),
            "count": many.counts,
            "rows": pl.Series([r.tolist() for r in rows], dtype=pl.List(pl.Int64)),
            "assets": pl.Series([assets[r].tolist() for r in rows], dtype=pl.List(pl.String)),
        }
    )


def _write(answers: pl.DataFrame, path: Path) -> None:
    buffer = io.BytesIO()
    if path.suffix == ".parquet":
        answers.write_parquet(buffer)
    else:
        joined = (pl.col("rows").cast(pl.List(pl.String)).list.join(" "), pl.col("assets").list.join(" | "))
        answers.with_columns(*joined).write_csv(buffer)
    write_atomic(path, buffer.getvalue())


def _document(compiled: CompiledTable, n_contexts: int, n_without: int, hits: Rows) -> dict[str, object]:
    rows = [{"row": r, "asset": a, "hits": int(h)} for r, (a, h) in enumerate(zip(compiled.assets, hits, strict=True))]
    return {"format": 1, "table": compiled.name, "contexts": n_contexts, "without_asset": n_without, "rows": rows}


def _lines(compiled: CompiledTable, n_contexts: int, n_without: int, hits: Rows) -> Iterator[str]:
    colour = wants_colour(sys.stdout)
    yield f"{plural(n_contexts, 'context')} against {plural(compiled.n_rows, 'row')} of {printable(compiled.name)}"
    said = f"{plural(n_without, 'context')} without a valid asset" + (f" ({share(n_without, n_contexts)})" if n_contexts else "")
    yield styled(said, "yellow" if n_without else "green", colour)
    order = np.argsort(-hits, kind="stable")
    used = [r for r in order.tolist() if hits[r]]
    if used:
        lines = [(f"{int(hits[r]):,}", share(int(hits[r]), n_contexts), str(r), compiled.assets[r]) for r in used[:N_SHOWN]]
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
