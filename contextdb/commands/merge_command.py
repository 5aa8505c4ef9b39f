"""Merge two versions of a table, cell by cell, with rows and columns that were added, removed and moved. A git merge driver.

A contextdb.toml is merged key by key, notes (NAME.notes.csv) place by place, work on gaps (NAME.gaps.csv) gap by gap. The result is
written to OURS, or to FILE. Conflicts are written between git's marks, row by row, for a person or the editor to decide; a Parquet
file then stays as it was. If one of the three files is not a table, its lines are merged as git does. A row that one side deleted
is gone; cells that the other side filled in it are named.

Exits with 1 if something is left to decide or lines were merged, with 2 if a file is missing or cannot be written. Gaps, overlaps
under the policy "unique" and rows that can no longer be chosen, if neither side had them, are reported; with --strict they exit
with 1. `git install` sets it up as a merge driver.

  contextdb merge base.csv ours.csv theirs.csv --out merged.csv
  contextdb merge base.csv ours.csv theirs.csv --take theirs
"""

from __future__ import annotations

import argparse
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path

from contextdb.console import ExitCode, note
from contextdb.disk import GAPS_SUFFIX, NOTES_SUFFIX, names_a_table, read_bytes, write_atomic
from contextdb.edits.diffing import diff
from contextdb.edits.diffing.markers import merge_notes, merged_lines, with_markers
from contextdb.edits.diffing.toml_merging import merge_toml
from contextdb.errors import ContextDBError, Fault, Place, SchemaError, TableError, in_quotes, plural, safe_text
from contextdb.files.parquet import ParquetSource
from contextdb.files.texts import is_parquet
from contextdb.schema.settings import EMPTY, Schema, TableSettings
from contextdb.tables.gap_work import merge_gap_work
from contextdb.tables.merging.conflicts import Side
from contextdb.tables.merging.merging import Merge, merge, merged_bytes, table_of
from contextdb.tables.project import neighbours, schema_for, settings_of
from contextdb.tables.table import Table

MOST_TOLD = 20

Raws = Sequence[bytes]
"""Base, ours, theirs."""
Merged = tuple[bytes | None, Callable[[], ExitCode]]
"""The bytes to write, if any, and what then tells what came of it."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("base", metavar="BASE", help="the table before both sides changed it")
    parser.add_argument("ours", metavar="OURS", help="our version; the result is written over it")
    parser.add_argument("theirs", metavar="THEIRS", help="the other version")
    parser.add_argument("-o", "--out", metavar="FILE", help="write the result here, and leave OURS as it is")
    parser.add_argument(
        "--path", metavar="PATH", help="the table's file, which decides the contextdb.toml to use (git: %%P; default: OURS)"
    )
    parser.add_argument("--take", choices=("ours", "theirs"), help="resolve all conflicts in favour of one side")
    parser.add_argument("--strict", action="store_true", help="exit with 1 when the merge creates a gap that neither side had")


def run(arguments: argparse.Namespace) -> ExitCode:
    path = Path(arguments.path or arguments.ours)
    raws = [read_bytes(file) for file in (arguments.base, arguments.ours, arguments.theirs)]
    merged = _merged_toml if path.suffix.lower() == ".toml" else _merged_tables
    merged = next((own for suffix, own in _COMPANIONS if path.name.lower().endswith(suffix)), merged)
    try:
        raw, tell = merged(path, raws, arguments)
    except Exception as error:  # whatever it is: git would go on with ours alone
        if arguments.take:
            raise
        code = _merge_lines(path, raws, arguments, error)
        if not isinstance(error, ContextDBError):
            raise
        return code
    if raw is not None:
        write_atomic(Path(arguments.out or arguments.ours), raw)
    return tell()


def _merged_tables(path: Path, raws: Raws, arguments: argparse.Namespace) -> Merged:
    base, ours, theirs = _tables(path, raws, arguments)
    merged = merge(base, ours, theirs)
    if arguments.take:
        merged = _decided(merged, arguments.take)
    is_text = not isinstance(merged.ours.source, ParquetSource)
    raw = merged_bytes(merged) if not merged.conflicts else with_markers(merged) if is_text else None
    return raw, lambda: _reported(merged, path, is_text, arguments)


def _reported(merged: Merge[Table], path: Path, is_text: bool, arguments: argparse.Namespace) -> ExitCode:
    _report_conflicts(merged, path, is_text)
    if merged.conflicts:
        return ExitCode.FOUND
    return ExitCode.FOUND if _report_effects(merged, path) and arguments.strict else ExitCode.OK


def _report_effects(merged: Merge[Table], path: Path) -> bool:
    """Tell what the merge brings that neither side had, and whether that is anything."""
    if not names_a_table(path.name) or not (diff(merged.base, merged.ours) and diff(merged.base, merged.theirs)):
        return False
    from contextdb.checks.effects import merge_effects
    from contextdb.covering import format_percent

    try:
        around = neighbours(path)
        sides = (merged.ours, merged.theirs, merged.table)
        effects = merge_effects(*(replace(table, around=around, path=path) for table in sides))
    except ContextDBError as error:
        note(f"the meaning of the merge was not looked at: {error.faults[0]}")
        return False
    lines = [
        f"a gap that neither side had: {safe_text(b.text, 400)} ({format_percent(b.share)} of the contexts)."
        for b in effects.opened
    ]
    lines += [f"{safe_text(f.asset or '')}, as on neither side: {f.message}" for f in effects.findings]
    _note_some([f"{Place(str(path))}: {text}" for text in lines])
    return bool(lines)


def _merged_toml(path: Path, raws: Raws, arguments: argparse.Namespace) -> Merged:
    """Merge three versions of contextdb.toml, key by key."""
    base, ours, theirs = _names(path, arguments)
    texts = [_toml_text(raw, name) for raw, name in zip(raws, (base, ours, theirs), strict=True)]
    merged = merge_toml(texts[0], texts[1], texts[2], (base, ours, theirs))
    if merged.conflicts and arguments.take:
        raise ContextDBError(Fault("--take decides conflicts of tables.", "a .csv or .parquet file", place=Place(str(path))))

    def tell() -> ExitCode:
        for key in merged.conflicts:
            message = f"{in_quotes('.'.join(key))} changed on both sides."
            note(Fault(message, mend="to keep one of the versions between the marks", place=Place(str(path))))
        return ExitCode.FOUND if merged.conflicts else ExitCode.OK

    return merged.with_markers.encode(), tell


def _merged_notes(path: Path, raws: Raws, arguments: argparse.Namespace) -> Merged:
    return merge_notes(raws, _names(path, arguments), arguments.take), lambda: ExitCode.OK


def _merged_gaps(path: Path, raws: Raws, arguments: argparse.Namespace) -> Merged:
    return merge_gap_work(raws, _names(path, arguments), arguments.take), lambda: ExitCode.OK


_COMPANIONS = ((NOTES_SUFFIX, _merged_notes), (GAPS_SUFFIX, _merged_gaps))


def _merge_lines(path: Path, raws: Raws, arguments: argparse.Namespace, error: Exception) -> ExitCode:
    """Merge lines, as git does it, where the meaning cannot be merged: nothing of either side is left out without a mark."""
    place = Place(str(path))
    _note_some(error.faults if isinstance(error, ContextDBError) else ())
    if any(map(is_parquet, raws)):
        message, mend = "the file stays as ours has it.", "to take one side with git checkout --ours or --theirs"
    else:
        raw, n_conflicts = merged_lines(*raws)
        write_atomic(Path(arguments.out or arguments.ours), raw)
        message = f"lines were merged instead of cells, with {plural(n_conflicts, 'place')} between marks."
        mend = "to look at the file, and to correct what cannot be read"
    note(Fault(message, mend=mend, place=place))
    return ExitCode.FOUND


def _names(path: Path, arguments: argparse.Namespace) -> tuple[str, str, str]:
    """The three versions in messages. The files that git hands over have names that say nothing."""
    if not arguments.path:
        return arguments.base, arguments.ours, arguments.theirs
    return f"{path} (base)", f"{path} (ours)", f"{path} (theirs)"


def _toml_text(raw: bytes, name: str) -> str:
    try:
        return raw.decode("utf-8-sig")
    except UnicodeDecodeError:
        raise SchemaError(Fault("the file is not UTF-8.", "TOML is UTF-8", "to save it as UTF-8", Place(name))) from None


def _tables(path: Path, raws: Raws, arguments: argparse.Namespace) -> list[Table]:
    schema, settings = _schema(path)
    tables: list[Table] = []
    faults: list[Fault] = []
    for raw, name in zip(raws, _names(path, arguments), strict=True):
        try:
            tables.append(table_of(Table, raw, name, schema, settings))
        except TableError as error:
            faults += error.faults
    if faults:
        raise TableError(*faults)
    return tables


def _schema(path: Path) -> tuple[Schema, TableSettings]:
    """What is declared of the table; nothing where contextdb.toml cannot be read, as in the middle of a merge."""
    try:
        folder, schema = schema_for(path)
        return schema, settings_of(path, folder, schema)
    except ContextDBError as error:
        note(f"{error.faults[0]} Merging without it.")
        return EMPTY, TableSettings(path.stem)


def _decided(merged: Merge[Table], side: Side) -> Merge[Table]:
    while merged.conflicts:  # a row that comes back can bring new ones
        merged = merged.resolved(dict.fromkeys(range(len(merged.conflicts)), side))
    return merged


def _report_conflicts(merged: Merge[Table], path: Path, is_text: bool) -> None:
    place = Place(str(path))
    sides = [(one.place, {"ours": one.ours, "theirs": one.theirs, "before": one.base}) for one in merged.conflicts]
    _note_some([f"{place}: {cell}" for cell in merged.lost])
    _note_some([f"{place}: {at}: {', '.join(f'{name} {_quoted(text)}' for name, text in texts.items())}." for at, texts in sides])
    if merged.conflicts:
        by_hand, by_option = (
            "to open the file with contextdb edit, or to keep one of each",
            "to decide with --take ours or --take theirs",
        )
        message = f"{plural(len(merged.conflicts), 'place')} changed on both sides."
        note(Fault(message, mend=by_hand if is_text else by_option, place=place))


def _note_some(lines: Sequence[object]) -> None:
    note(*lines[:MOST_TOLD])
    if len(lines) > MOST_TOLD:
        note(f"… and {len(lines) - MOST_TOLD:,} more.")


def _quoted(text: str | None) -> str:
    return "nothing" if text is None else f'"{safe_text(text)}"'
