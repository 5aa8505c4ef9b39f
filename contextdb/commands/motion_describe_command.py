"""Make a table of clips: for each one a row with its gait, speed, direction, turn, style, duration, and how it begins and ends.

Cells are ranges from the clips' own movement; neighbours overlap a little, so that some clip is valid in each context.

Exits with 1 if a cell disagrees with its clip, a clip could not be read, or the clips are not in the folder of contextdb.toml or
below it.

  contextdb motion describe game/clips
  contextdb motion describe game/clips --out game/moves.csv
  contextdb motion describe game --into game/moves.csv --update
  contextdb motion describe game --into game/moves.csv --update --soft direction --soft turn
"""

from __future__ import annotations

import argparse
import csv
import io
from collections.abc import Sequence
from pathlib import Path

from contextdb.authoring.described_table import (
    ASSET,
    ClipRows,
    DescribedTable,
    Filling,
    described_table,
    empty_table,
    filling,
    rows_for,
)
from contextdb.commands.engine_options import engines_of
from contextdb.commands.motion_build_command import add_clip_arguments, progress_of
from contextdb.console import ExitCode, note, output, printable
from contextdb.errors import ContextDBError, Fault, plural, some
from contextdb.files.toml_shapes import as_toml
from contextdb.motion.preparing.cells_of_clips import SOFT
from contextdb.motion.preparing.describing import COLUMNS, Described
from contextdb.report.render_json import as_json
from contextdb.tables.nesting.names import asset_text
from contextdb.tables.project import load_table


def add_arguments(parser: argparse.ArgumentParser) -> None:
    add_clip_arguments(parser)
    parser.add_argument("--out", metavar="TABLE", help="write the table to this new file, with a contextdb.toml in its folder")
    parser.add_argument(
        "--into", metavar="TABLE", help="fill what is missing in this table, and report where it differs from the clips"
    )
    parser.add_argument("--update", action="store_true", help="with --into: replace the cells that differ, too")
    parser.add_argument(
        "--soft",
        metavar="COLUMN",
        action="append",
        choices=SOFT,
        default=[],
        help=f"{' or '.join(SOFT)}: its cells cost in place of excluding; with --into, --update changes those that are there",
    )
    parser.add_argument("--json", action="store_true", help="print a JSON document, with what was measured")


def run(arguments: argparse.Namespace) -> ExitCode:
    if arguments.out and arguments.into:
        raise ContextDBError(Fault("--out makes a table, --into fills one.", "one of the two"))
    if arguments.update and not arguments.into:
        raise ContextDBError(Fault("--update replaces cells of a table.", "--into TABLE --update"))
    into = Path(arguments.into) if arguments.into else None
    clips = rows_for(
        arguments.path, into, progress_of, arguments.metres_per_unit, arguments.up, engines_of(arguments), arguments.root_from
    )
    clips.soften(arguments.soft)
    folder_clips, rows = clips.source, clips.rows
    made, fills, is_playable = None, None, True
    if arguments.out or into is not None:
        fills = filling(empty_table(Path(arguments.out)) if into is None else load_table(into, strict=False), rows)
        motion = clips.motion(into or Path(arguments.out))
        is_playable = motion is not None
        made = described_table(fills, motion or {}, updates=arguments.update)
        made.write()
    _tell(clips, made, fills, is_playable, arguments)
    with output():
        if arguments.json:
            print(as_json(_document(clips, made, fills)), end="")
        elif made is None or fills is None:
            print(_text(rows), end="")
        else:
            print("\n".join(printable(line) for line in _lines(made, fills, arguments)))
    differs = fills is not None and fills.differences and not arguments.update
    return ExitCode.FOUND if folder_clips.left_out or differs or not is_playable else ExitCode.OK


NOTHING_STANDS = ["no clip stands: whoever stops marches on the spot. Expected: a clip with the gait Idle."]


def _tell(
    clips: ClipRows, made: DescribedTable | None, fills: Filling | None, is_playable: bool, arguments: argparse.Namespace
) -> None:
    """Say on standard error what was taken for granted or left out."""
    lines = [*clips.source.notes, *(f"left out: {message}" for message in clips.source.left_out)]
    lines += [] if fills is None else fills.notes
    lines += NOTHING_STANDS if clips.rows and all(row.facts.gait != "Idle" for row in clips.rows) else []
    if fills is not None and fills.without_clip:
        lines.append(f"no clip for {plural(len(fills.without_clip), 'row')}: {some(fills.without_clip)}")
    if not is_playable:
        lines.append(
            f"no database is declared: the clips are not in {made.folder if made else ''} or below it. "
            "Expected: a table in the folder of the clips, or above it."
        )
    if arguments.out and made is not None and not made.is_used:
        lines.append(
            f"no database of {made.toml_path} holds the rows of this table: table = {as_toml(made.table.name)} makes one do so."
        )
    note(*lines)


def _lines(made: DescribedTable, fills: Filling, arguments: argparse.Namespace) -> Sequence[str]:
    """What was written, and where cells say other than their clips."""
    if arguments.out:
        return [f"{plural(made.table.n_rows, 'row')} written to {made.path}, and what they mean to {made.toml_path}."]
    done = [
        f"{made.path}: {plural(len(fills.empty), 'cell')} filled, {plural(len(fills.added), 'row')} added.",
        *(str(difference) for difference in fills.differences),
    ]
    if fills.differences:
        n = plural(len(fills.differences), "cell")
        done.append(f"{n} replaced." if arguments.update else f"{n} {'say' if len(fills.differences) > 1 else 'says'} otherwise.")
    return done


def _text(rows: Sequence[Described]) -> str:
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow((ASSET, *COLUMNS))
    writer.writerows([asset_text(row.asset), *row.cells.values()] for row in rows)
    return text.getvalue()


def _document(clips: ClipRows, made: DescribedTable | None, fills: Filling | None) -> dict[str, object]:
    rows = [{"file": str(path), **row.to_json()} for path, row in zip(clips.files, clips.rows, strict=True)]
    differences = [] if fills is None else [difference.to_json() for difference in fills.differences]
    return {
        "format": 1,
        "table": None if made is None else str(made.path),
        "clips": rows,
        "differences": differences,
        "added": [] if fills is None else [row.asset for row in fills.added],
        "without_clip": [] if fills is None else fills.without_clip,
        "left_out": clips.source.left_out,
        "notes": clips.source.notes,
    }
