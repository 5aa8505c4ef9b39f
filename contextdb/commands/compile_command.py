"""Write the compiled file for the game: a .safetensors file, which the game maps into memory.

Prints the path of each written file.

  contextdb compile tables/                  one compiled file next to each table
  contextdb compile tables/ -o build/        all of them into a folder
  contextdb compile tables/ -o build/ --stubs game/facts.py
  contextdb compile tables/ -o build/ --c-header game/tables.h --c-link game/cdb_link.h
"""

from __future__ import annotations

import argparse
import os
import sys
from collections.abc import Callable, Mapping
from pathlib import Path, PurePath

from contextdb.compiled.c_header import c_header_of, c_link_of
from contextdb.compiled.engine_facts import csharp_of, godot_of, unreal_of
from contextdb.compiled.stubs import stubs_of
from contextdb.compiled.table import CompiledTable
from contextdb.console import ExitCode, output, printable, progress
from contextdb.core import motion_text
from contextdb.disk import make_folder, path_in_quotes, write_atomic
from contextdb.disk.boundary import inside
from contextdb.errors import ContextDBError, Fault, FileError, Place, plural
from contextdb.files.tensors import SUFFIX
from contextdb.tables.places import table_path
from contextdb.tables.project import SCHEMA_FILE, Project, load_table
from contextdb.tables.table import Table

SEPARATORS = ("/", "\\")
STUBS = (".py", ".pyi")
HEADERS = (".h", ".hpp", ".hh", ".hxx")
Generator = Callable[[Mapping[str, CompiledTable], str], str]
ENGINES: Mapping[str, tuple[tuple[str, ...], str, Generator]] = {
    "csharp": ((".cs",), "C#", lambda tables, _: csharp_of(tables)),
    "godot": ((".gd",), "GDScript", lambda tables, _: godot_of(tables)),
    "unreal": (HEADERS, "Unreal", unreal_of),
}
"""The flags that write facts as types of a language: the endings of its files, its name, and what writes a file of that name."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("path", metavar="PATH", help="a folder of tables, or one table or its name")
    parser.add_argument(
        "-o", "--out", metavar="FILE", help="the compiled file, or a folder for several (default: next to each table)"
    )
    parser.add_argument(
        "--stubs", metavar="FILE", help="also write the tables' facts, outputs and roles as Python types: a .py or .pyi file"
    )
    parser.add_argument(
        "--c-header", metavar="FILE", help="also write one C99 header that opens and queries the compiled files: a .h file"
    )
    parser.add_argument(
        "--c-motion", metavar="FILE", help="also write a C99 header that plays characters of a motion bundle: a .h file"
    )
    for flag, (suffixes, what, _) in ENGINES.items():
        text = f"also write the facts of the tables as types of {what}: a {suffixes[0]} file"
        parser.add_argument(f"--{flag}", metavar="FILE", help=text)
    parser.add_argument(
        "--c-link", metavar="FILE", help="with --c-header: also write a header that publishes what the game asks: a .h file"
    )


def run(arguments: argparse.Namespace) -> ExitCode:
    """Compile one table or a folder of them; prints the path of each file."""
    stubs = None if arguments.stubs is None else _written_as(arguments.stubs, STUBS, "a Python file")
    header = None if arguments.c_header is None else _written_as(arguments.c_header, HEADERS, "a C header")
    motion = None if arguments.c_motion is None else _written_as(arguments.c_motion, HEADERS, "a C header")
    link = _link_path(arguments)
    engines = {flag: path for flag in ENGINES if (path := _engine_path(arguments, flag)) is not None}
    tables = _tables(arguments.path)
    targets = [_target(table, arguments.out, len(tables), _is_folder(arguments.path)) for table in tables]
    _require_different(targets)
    header_text = None if header is None else c_header_of({t.name: t.compile() for t in tables}, f"CDB_{header.stem}_H")
    for table, target in progress(list(zip(tables, targets, strict=True)), "compiling"):
        compiled = table.compile()
        make_folder(target.parent)
        compiled.save(target)
        _print_path(target)
        n_rows, n_conditions = plural(compiled.n_rows, "row"), plural(len(compiled.conditions), "condition")
        size = f"{n_rows}, {n_conditions}, {compiled.nbytes:,} bytes of masks"
        print(printable(f"{table.name}: {size}"), file=sys.stderr)
    if stubs is not None:
        _write(stubs, stubs_of({table.name: table.compile() for table in tables}))
    for flag, path in engines.items():
        _write(path, ENGINES[flag][2]({table.name: table.compile() for table in tables}, path.stem))
    if header is not None and header_text is not None:
        _write(header, header_text)
        if link is not None:
            _write(link, _link_text(tables, header, link))
    if motion is not None:
        _write(motion, c_motion_header(c_header_of({}, "CDB_MOTION_READER_H")))
    return ExitCode.OK


def _engine_path(arguments: argparse.Namespace, flag: str) -> Path | None:
    text = getattr(arguments, flag)
    return None if text is None else _written_as(text, ENGINES[flag][0], f"a file of {ENGINES[flag][1]}")


def _link_path(arguments: argparse.Namespace) -> Path | None:
    if arguments.c_link is None:
        return None
    if arguments.c_header is None:
        raise ContextDBError(Fault("--c-link goes with the header.", "--c-header FILE with it"))
    return _written_as(arguments.c_link, HEADERS, "a C header")


def _link_text(tables: list[Table], header: Path, path: Path) -> str:
    try:
        included = PurePath(os.path.relpath(header, path.parent)).as_posix()
    except ValueError:  # another drive
        included = header.absolute().as_posix()
    return c_link_of({table.name: table.compile() for table in tables}, included, f"CDB_{path.stem}_LINK_H")


def _write(path: Path, text: str) -> None:
    make_folder(path.parent)
    write_atomic(path, text.encode("utf-8"))
    _print_path(path)


def _print_path(path: Path) -> None:
    with output():
        print(printable(str(path)))


def _written_as(text: str, suffixes: tuple[str, ...], what: str) -> Path:
    path = Path(text)
    if path.suffix in suffixes and not text.endswith(SEPARATORS) and not os.path.isdir(text):
        return path
    mend = "" if os.path.isdir(text) or text.endswith(SEPARATORS) else path_in_quotes(path.with_suffix(suffixes[0]))
    accepted = f"a name that ends in {' or '.join(filter(None, [', '.join(suffixes[:-1]), suffixes[-1]]))}"
    raise FileError(Fault(f"this is not a valid name for {what}.", accepted, mend, Place(text)))


def _tables(text: str) -> list[Table]:
    if _is_folder(text):
        tables = list(Project.load(text).tables.values())
        if not tables:
            raise ContextDBError(Fault("the folder holds no table.", "a folder with .csv or .parquet files", place=Place(text)))
        return tables
    return [load_table(table_path(text))]


def _is_folder(text: str) -> bool:
    return os.path.isdir(text) or Path(text).name == SCHEMA_FILE


def _target(table: Table, out: str | None, n_tables: int, is_folder: bool) -> Path:
    """Where a table is written: what is compiled out of a folder goes into a folder, however many tables there are."""
    assert table.path is not None
    if out is None:
        return inside(table.path.with_suffix(SUFFIX), _home(table))
    is_artefact = Path(out).suffix == SUFFIX and not out.endswith(SEPARATORS) and not os.path.isdir(out)
    if is_artefact and n_tables > 1:
        raise FileError(Fault(f"{n_tables} tables do not go into one artefact.", "a folder", place=Place(out)))
    if is_artefact:
        return Path(out)
    if is_folder or out.endswith(SEPARATORS) or os.path.isdir(out):
        is_file_name = PurePath(table.name).name == table.name and not any(c in table.name for c in SEPARATORS)
        return inside(Path(out) / f"{table.name if is_file_name else table.path.stem}{SUFFIX}", Path(out))
    mend = path_in_quotes(Path(out).with_suffix(SUFFIX))
    raise FileError(
        Fault("this is not a valid name for a compiled file.", f"a name that ends in {SUFFIX}, or a folder", mend, Place(out))
    )


def _home(table: Table) -> Path:
    """The folder that what is written next to a table must not leave."""
    assert table.path is not None
    return table.path.parent if table.schema.file is None else Path(table.schema.file).parent


def _require_different(targets: list[Path]) -> None:
    twice = sorted({str(t) for t in targets if targets.count(t) > 1})
    if twice:
        raise ContextDBError(
            *(Fault("two tables would be written to one file.", "one file for each table", place=Place(t)) for t in twice)
        )


# ---- the header by which a game in C or C++ plays the characters of a bundle: the core's parts for motion, as they are


_TEXT = """
/* Motion. Written by `contextdb compile --c-motion`: do not edit.
 *
 * Characters in C99 or C++17: open a bundle of `contextdb motion build --bundle`, then see "Characters of a bundle" below. Compile
 * with -ffp-contract=off (MSVC: /fp:precise), so that all machines have the same bits. */

#ifndef CDB_MOTION_H
#define CDB_MOTION_H

#ifdef __cplusplus
extern "C" {{
#endif
#if defined(__clang__)
#pragma clang diagnostic push
#endif
{motion}
#if defined(__clang__)
#pragma clang diagnostic pop
#endif
#ifdef __cplusplus
}}
#endif

#endif /* CDB_MOTION_H */
"""


def c_motion_header(reader: str) -> str:
    """The text of the header, ASCII with line feeds; `reader` is that of the tables' parts, which it begins with."""
    return reader + _TEXT.format(motion=motion_text())
