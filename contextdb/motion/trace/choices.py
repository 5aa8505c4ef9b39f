"""What a person would have chosen in a recorded session: assets that should have played at a search, and assets that should not.

They are a CSV file beside the session, `session.choices.csv`, with a row for each asset:

    tick,asset,choice
    30,start_jog,+
    30,idle,-

The debugger writes it; any editor or script may. An edge: this touches the disk.
"""

from __future__ import annotations

import os
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path

from contextdb.disk import read_bytes, write_atomic
from contextdb.disk.boundary import inside
from contextdb.errors import Fault, MotionError, Place, in_quotes
from contextdb.files.csv_records import as_field
from contextdb.motion.markup import file as rows_file

COLUMNS = ("tick", "asset", "choice")
PREFERRED, REJECTED = "+", "-"


@dataclass(frozen=True, slots=True)
class Preference:
    """An asset that should have been chosen by the search at a tick, or should not; `line` is that of its file."""

    tick: int
    asset: str
    is_preferred: bool
    line: int | None = None


def choices_path(session: str | Path) -> Path:
    """Where the choices of a session are. Raises FileError where a link leads out of its folder."""
    return inside(Path(session).with_suffix(".choices.csv"), Path(session).parent)


def read_choices(session: str | Path) -> list[Preference]:
    """The choices of a session; none where there is no such file. Raises MotionError with every fault of the file, FileError where
    it cannot be read."""
    path = choices_path(session)
    if not os.path.exists(path):
        return []
    text = rows_file.text_of(read_bytes(path), str(path), "CSV text in UTF-8 with the columns tick, asset and choice")
    rows = rows_file.rows_of(text, str(path), COLUMNS, COLUMNS)
    choices = {}
    faults = list(rows.faults)
    for row in rows.rows:
        wrong = list(_faults(row, str(path)))
        faults += wrong
        if not wrong:
            tick, asset, choice = (row.fields[name] for name in COLUMNS)
            choices[int(tick), asset] = Preference(int(tick), asset, choice == PREFERRED, row.line)
    if faults:
        raise MotionError(*faults)
    return list(choices.values())


def write_choices(session: str | Path, choices: Mapping[tuple[int, str], bool]) -> None:
    """Write the choices of a session, by tick and asset, whether it is preferred. Raises FileError where the disk refuses."""
    lines = [",".join(COLUMNS).encode()]
    for (tick, asset), is_preferred in sorted(choices.items()):
        lines.append(b"%d,%s,%s" % (tick, as_field(asset), (PREFERRED if is_preferred else REJECTED).encode()))
    write_atomic(choices_path(session), b"\n".join([*lines, b""]))


def _faults(row: rows_file.Row, file: str) -> Iterator[Fault]:
    tick, asset, choice = (row.fields[name] for name in COLUMNS)
    if not (tick.isascii() and tick.isdecimal() and len(tick) <= 18):
        yield Fault(f"{in_quotes(tick)} is not a tick.", "a whole number, 0 or more", place=Place(file, row.line, "tick"))
    if not asset:
        yield Fault("no asset is named.", "the name of an asset", place=Place(file, row.line, "asset"))
    if choice not in (PREFERRED, REJECTED):
        accepted = "+ for an asset that should have been chosen, - for one that should not"
        yield Fault(f"{in_quotes(choice)} is not a choice.", accepted, place=Place(file, row.line, "choice"))
