"""Write one Parquet file of the rows of all projects below a folder, for polars, DuckDB or pandas.

Its columns are project, table, owner, file, row (from 0), line, asset, cells (those that are not Any), outputs, last_change (of
the row's line in git, else of the file) and moments (the recorded ones in which the row is valid; null without --telemetry, and
where rows refer to tables). A project that cannot be read is named and left out; the command then exits with 1.

  contextdb index games/ --out rows.parquet
  contextdb index games/ --out rows.parquet --telemetry "play/*.parquet"
"""

from __future__ import annotations

import argparse
import io
import os
from collections.abc import Iterator, Mapping, Sequence
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from contextdb.columns import polars as pl
from contextdb.commands.projects_below import extend_up_to, project_folders
from contextdb.console import ExitCode, note, output, printable, progress
from contextdb.disk import write_atomic
from contextdb.disk.boundary import real_path
from contextdb.disk.git import is_in_a_repository, run_git
from contextdb.errors import ContextDBError, Fault, FileError, Place, plural
from contextdb.tables.project import Project
from contextdb.tables.table import Table
from contextdb.tables.variants import known_whole


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("folder", metavar="ROOT", help="a folder with projects below it")
    parser.add_argument("--out", metavar="FILE", required=True, help="the .parquet file to write; one that is there is replaced")
    parser.add_argument("--telemetry", action="append", metavar="GLOB", help="files of recorded contexts; may be repeated")


def run(arguments: argparse.Namespace) -> ExitCode:
    out = Path(arguments.out)
    if out.suffix.lower() != ".parquet":
        raise FileError(Fault("the file does not end in .parquet.", "FILE.parquet", place=Place(arguments.out)))
    folders = project_folders(arguments.folder)
    if real_path(out.parent) in map(real_path, folders):
        problem = "the project in this folder would take the file for one of its tables."
        raise FileError(Fault(problem, "a file outside of folders of tables", place=Place(arguments.out)))
    extend_up_to(arguments.folder)
    rows: list[dict[str, object]] = []
    n_tables = n_left_out = 0
    for folder in progress(folders, "reading"):
        try:
            project = Project.load(folder)
        except ContextDBError as error:
            n_left_out += 1
            note(*error.faults)
            continue
        n_tables += len(project)
        for table in project.tables.values():
            rows += _rows(table, Path(os.path.relpath(folder, arguments.folder)).as_posix(), arguments.telemetry or ())
    buffer = io.BytesIO()
    pl.DataFrame(rows, schema=_columns()).write_parquet(buffer)
    write_atomic(out, buffer.getvalue())
    with output():
        sizes = f"{plural(len(rows), 'row')} of {plural(n_tables, 'table')} in {plural(len(folders) - n_left_out, 'project')}"
        print(printable(f"{out}: {sizes}"))
    return ExitCode.FOUND if n_left_out else ExitCode.OK


def _columns() -> dict[str, Any]:
    pairs = pl.List(pl.Struct({"name": pl.String, "text": pl.String}))
    texts = dict.fromkeys(("project", "table", "owner", "file"), pl.String)
    whole = {"row": pl.Int64, "line": pl.Int64}
    return (
        texts
        | whole
        | {"asset": pl.String, "cells": pairs, "outputs": pairs, "last_change": pl.Datetime("ms", "UTC"), "moments": pl.Int64}
    )


def _rows(own: Table, project: str, telemetry: Sequence[str]) -> Iterator[dict[str, object]]:
    table = known_whole(own) or own
    data = [column for column in table.columns if column.name in table.settings.outputs]
    hits = _hits(own, table.n_rows, telemetry)
    changed: dict[str, Mapping[int | None, datetime]] = {}
    for row, asset in enumerate(table.assets):
        cells = [(c.condition.name, c.texts[row]) for c in table.conditions if not c.cells[int(c.texts.codes[row])].is_any]
        place = table.place(row)
        file = place.file or str(own.path)
        changed[file] = changed[file] if file in changed else _last_changes(Path(file))
        yield {
            "project": project,
            "table": table.name,
            "owner": own.settings.owner or None,
            "file": Path(file).name,
            "row": row,
            "line": place.line,
            "asset": asset,
            "cells": [{"name": name, "text": text} for name, text in cells],
            "outputs": [{"name": column.name, "text": column[row]} for column in data],
            "last_change": changed[file].get(place.line, changed[file][None]),
            "moments": None if hits is None else hits[row],
        }


def _hits(table: Table, n_rows: int, telemetry: Sequence[str]) -> Sequence[int] | None:
    """For each row the recorded moments in which it is valid; None where nothing is recorded, or rows refer to tables."""
    if not telemetry or table.flat().n_rows != n_rows:
        return None
    from contextdb.telemetry.observe import observe

    try:
        return observe(table, list(telemetry)).hits
    except ContextDBError as error:
        note(f"{table.name}: {error.faults[0].message}")
        return None


def _last_changes(path: Path) -> Mapping[int | None, datetime]:
    """When each line of a file was changed last, by its number from 1; under None when the file was."""
    written = datetime.fromtimestamp(os.path.getmtime(path), UTC)
    if not is_in_a_repository(path.parent):
        return {None: written}
    code, blamed = run_git(path.parent, "blame", "--porcelain", "--", path.name)
    if code or path.suffix.lower() == ".parquet":
        code, committed = run_git(path.parent, "log", "-1", "--format=%ct", "--", path.name)
        return {None: datetime.fromtimestamp(int(committed), UTC) if not code and committed.strip() else written}
    return {None: written} | dict(_blamed(blamed, written))


def _blamed(text: bytes, written: datetime) -> Iterator[tuple[int, datetime]]:
    """The lines of `git blame --porcelain`: each with its time; a line that is not committed yet has that of the file."""
    times: dict[bytes, datetime] = {}
    commit, line = b"", 0
    for part in text.split(b"\n"):
        words = part.split(b" ")
        if part.startswith(b"\t"):
            yield line, times.get(commit, written)
        elif len(words) >= 3 and len(words[0]) in (40, 64) and words[1].isdigit():
            commit, line = words[0], int(words[2])
        elif words[0] == b"committer-time" and commit.strip(b"0"):
            times[commit] = datetime.fromtimestamp(int(words[1]), UTC)
