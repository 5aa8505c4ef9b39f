"""Contexts from files: one row a moment, one column a fact. CSV texts are read as on the command line; Parquet keeps its types."""

from __future__ import annotations

import glob
from collections.abc import Sequence
from pathlib import Path

import polars as pl

from contextdb.cells import Cell
from contextdb.compiled import CompiledTable
from contextdb.conditions import Condition
from contextdb.domains import NUMERIC
from contextdb.errors import ContextError, Fault, FileError, Place, TableError, nearest
from contextdb.facts import read_fact_text
from contextdb.files import read_texts


def context_files(pattern: str) -> list[Path]:
    """The files that a path or a glob means, in the order of their names.

    Raises
    ------
    FileError
        None does.
    """
    if Path(pattern).is_file():
        return [Path(pattern)]
    found = sorted(Path(p) for p in glob.glob(pattern, recursive=True) if Path(p).is_file())
    if not found:
        folder = Path(pattern).parent
        near = nearest(Path(pattern).name, [p.name for p in folder.iterdir()]) if folder.is_dir() else None
        mend = f'"{folder / near}"' if near else ""
        raise FileError(
            Fault("no file of contexts is there.", "a .csv or .parquet file, or a glob", mend, Place(pattern), "no-such-path")
        )
    return found


def read_contexts(path: Path, compiled: CompiledTable) -> pl.DataFrame:
    """The facts of a file that the table asks for, typed as `query_many` takes them; null where a fact is missing.

    Raises
    ------
    TableError, ContextError
        The file cannot be read, or holds facts that the table cannot be asked with; file, line and fact are named.
    """
    if path.suffix == ".parquet":
        return _read_parquet(path, compiled)
    source, columns = read_texts(path)
    conditions = {c.name: c for c in compiled.conditions}
    series, faults = [], []
    for column in columns:
        if column.name in conditions:
            condition = conditions[column.name]
            values, wrong = _read_column(column.texts, condition)
            faults += [
                f.at(Place(str(path), source.line(int((column.codes == i).argmax())), column.name))
                for i, f in wrong
                if (column.codes == i).any()
            ]
            distinct = pl.Series(column.name, values, dtype=_dtype(condition), strict=False)
            series.append(distinct.gather(column.codes) if len(distinct) else distinct)
    if faults:
        raise ContextError(*faults)
    return pl.DataFrame(series)


def _read_column(texts: Sequence[str], condition: Condition) -> tuple[list[object], list[tuple[int, Fault]]]:
    values: list[object] = []
    faults: list[tuple[int, Fault]] = []
    for i, text in enumerate(texts):
        try:
            fact = read_fact_text(text, condition)
            if isinstance(fact, Cell):
                raise ContextError(Fault(f'"{text}" is a set of values.', "one value in each context", rule="wrong-fact"))
            values.append(sorted(fact) if isinstance(fact, frozenset) else fact)
        except ContextError as error:
            values.append(None)
            faults += [(i, f) for f in error.faults]
    return values, faults


def _dtype(condition: Condition) -> pl.DataType:
    kind = condition.domain.kind
    if kind in NUMERIC:
        return pl.Float64()
    return pl.Boolean() if kind == "bool" else pl.List(pl.String) if kind == "tags" else pl.String()


def _read_parquet(path: Path, compiled: CompiledTable) -> pl.DataFrame:
    names = [c.name for c in compiled.conditions]
    try:
        scan = pl.scan_parquet(path)
        present = scan.collect_schema().names()
        return scan.select([n for n in names if n in present]).collect()
    except (pl.exceptions.PolarsError, OSError) as error:
        why = str(error).splitlines()[0] if str(error) else type(error).__name__
        raise TableError(
            Fault(f"cannot read the file as Parquet ({why}).", "a whole Parquet file", place=Place(str(path)))
        ) from None
