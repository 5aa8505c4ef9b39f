"""Make a table of clips: for each one a row with its gait, speed, direction, turn, style, duration, and how it begins and ends.

Cells are ranges from the clips' own movement; neighbours overlap a little, so that for each context some clip is valid. With --out
the table is written with the contextdb.toml that it needs: conditions, outputs, features, databases, a selector and a controller.
With --into columns, empty cells and rows that are missing are filled; a cell that does not accept what its clip shows is told.

Exits with 1 if a cell says other than its clip, or a clip could not be read.

  contextdb motion describe game/clips
  contextdb motion describe game/clips --out game/moves.csv
  contextdb motion describe game --into game/moves.csv
  contextdb motion describe game --into game/moves.csv --update
"""

from __future__ import annotations

import argparse
import csv
import io
import sys
from collections.abc import Sequence
from pathlib import Path

from contextdb.commands.motion_clips import MARKUP, Databases, FolderClips, add_clip_arguments, below, clips_of, progress_of
from contextdb.commands.motion_describe_table import ASSET, DescribedTable, filled_table, new_table
from contextdb.console import ExitCode, output, printable
from contextdb.errors import ContextDBError, Fault, plural, some
from contextdb.files.toml_text import as_toml
from contextdb.motion.preparing.describing import COLUMNS, Described, Sections, by_rig, describe, mirror_of, motion_sections
from contextdb.report.render_json import as_json
from contextdb.tables.nesting.names import asset_text
from contextdb.tables.project import schema_for, settings_of


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """The arguments of the command."""
    add_clip_arguments(parser)
    parser.add_argument("--out", metavar="TABLE", help="write the table to this new file, with its contextdb.toml beside it")
    parser.add_argument(
        "--into", metavar="TABLE", help="fill what is missing in this table, and tell where it differs from the clips"
    )
    parser.add_argument("--update", action="store_true", help="with --into: replace the cells that differ, too")
    parser.add_argument("--json", action="store_true", help="print a JSON document, with what was measured")


def run(arguments: argparse.Namespace) -> ExitCode:
    """Describe the clips of a folder."""
    if arguments.out and arguments.into:
        raise ContextDBError(Fault("--out makes a table, --into fills one.", "one of the two"))
    if arguments.update and not arguments.into:
        raise ContextDBError(Fault("--update replaces cells of a table.", "--into TABLE --update"))
    left_out: list[str] = []
    found = clips_of(
        arguments.path, arguments.metres_per_unit, arguments.up, lambda all_of: _playing_alone(all_of, arguments.into, left_out)
    )
    found.notes += left_out
    if not found.clips:
        raise ContextDBError(*(Fault(message) for message in found.left_out))
    with progress_of("describing") as tell:
        rows = describe(found.clips, mirrored=_is_mirrored(found), progress=tell)
    target = arguments.out or arguments.into
    made, is_playable = None, True
    if target is not None:
        path = Path(target)
        motion = _motion(found, path)
        is_playable = motion is not None
        made = (
            filled_table(path, rows, motion or {}, updates=arguments.update)
            if arguments.into
            else new_table(path, rows, motion or {})
        )
        made.write()
    _tell(found, made, is_playable, arguments)
    with output():
        if arguments.json:
            print(as_json(_document(found, rows, made)), end="")
        elif made is None:
            print(_text(rows), end="")
        else:
            print("\n".join(printable(line) for line in _lines(found, made, arguments)))
    differs = made is not None and made.differences and not arguments.update
    return ExitCode.FOUND if found.left_out or differs or not is_playable else ExitCode.OK


def _playing_alone(databases: Databases, table: str | None, notes: list[str]) -> Databases:
    """The databases whose clips are described: those of the table that is filled, where it has any; none of joint clips.

    The clips of several actors are one row, which asks each of them for facts; what one of them does says little of it.
    """
    path = None if table is None else Path(table)
    name = None if path is None else settings_of(path, *schema_for(path)).name
    if any(settings.table == name for settings in databases.values() if name is not None):
        databases = {each: settings for each, settings in databases.items() if settings.table == name}
    found = {each: settings for each, settings in databases.items() if not settings.roles}
    joint = some([each for each in databases if each not in found])
    if not found:
        said = f"{joint} holds joint clips, each of several actors; a row of its table asks the actor of each role for facts."
        raise ContextDBError(Fault(said, "clips that one character plays alone"))
    if len(found) < len(databases):
        notes.append(f"left out: the joint clips of {joint}: what the actors of each role do is no cell of a row.")
    return found


def _is_mirrored(found: FolderClips) -> bool:
    """Whether the clips play mirrored too: as the databases of a project say, else wherever the rig has two sides."""
    databases = found.config.databases.values()
    if databases:
        return all(settings.mirror for settings in databases)
    return all(mirror_of(rig.clips[0]) for rig in by_rig(found.clips, [str(path) for path in found.paths]))


def _motion(found: FolderClips, table: Path) -> Sections | None:
    """What contextdb.toml is to say of the motion of a new table: nothing where a project says it already; None where it cannot."""
    folder, schema = schema_for(table)
    if schema.databases:
        return {}
    paths = below(found.paths, folder)
    if paths is None:
        return None
    markup = below([found.folder / MARKUP], folder) if (found.folder / MARKUP).is_file() else None
    return motion_sections(by_rig(found.clips, paths), table.stem, markup[0] if markup else None)


def _tell(found: FolderClips, made: DescribedTable | None, is_playable: bool, arguments: argparse.Namespace) -> None:
    """Say on standard error what was taken for granted or left out."""
    lines = [*found.notes, *(f"left out: {message}" for message in found.left_out)]
    if made is not None and made.without_clip:
        lines.append(f"no clip for {plural(len(made.without_clip), 'row')}: {some(made.without_clip)}")
    if not is_playable:
        lines.append(
            f"no database is declared: the clips are not in {made.folder if made else ''} or below it. "
            "Expected: a table in the folder of the clips, or above it."
        )
    if arguments.out and made is not None and not made.is_used:
        lines.append(
            f"no database of {made.toml_path} holds the rows of this table: table = {as_toml(made.table.name)} makes one do so."
        )
    for line in lines:
        print(printable(f"contextdb: {line}"), file=sys.stderr)


def _lines(found: FolderClips, made: DescribedTable, arguments: argparse.Namespace) -> Sequence[str]:
    """What was written, and where cells say other than their clips."""
    if arguments.out:
        return [f"{plural(made.table.n_rows, 'row')} written to {made.path}, and what they mean to {made.toml_path}."]
    done = [
        f"{made.path}: {plural(made.filled, 'cell')} filled, {plural(len(made.added), 'row')} added.",
        *(str(difference) for difference in made.differences),
    ]
    if made.differences:
        n = plural(len(made.differences), "cell")
        done.append(f"{n} replaced." if arguments.update else f"{n} {'say' if len(made.differences) > 1 else 'says'} otherwise.")
    return done


def _text(rows: Sequence[Described]) -> str:
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow((ASSET, *COLUMNS))
    writer.writerows([asset_text(row.asset), *row.cells.values()] for row in rows)
    return text.getvalue()


def _document(found: FolderClips, rows: Sequence[Described], made: DescribedTable | None) -> dict[str, object]:
    clips = [{"file": str(path), **row.to_json()} for path, row in zip(found.paths, rows, strict=True)]
    differences = [] if made is None else [difference.to_json() for difference in made.differences]
    return {
        "format": 1,
        "table": None if made is None else str(made.path),
        "clips": clips,
        "differences": differences,
        "added": [] if made is None else made.added,
        "without_clip": [] if made is None else made.without_clip,
        "left_out": found.left_out,
        "notes": found.notes,
    }
