"""A recorded stick: what a player wanted, moment by moment, read from a CSV or Parquet file.

Columns: `time_s`, ascending; then either `speed_mps` and, if wanted, `turn_dps` and `strafe_deg`, seen from the body as in
`contextdb motion search`; or `x_mps` and `z_mps`, a velocity over the ground, and, if wanted, `facing_deg`. All other columns are
facts. A moment lasts until the next one.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from contextdb.cells.facts import Unknown
from contextdb.columns import TextColumn
from contextdb.commands import missing_facts_by_option
from contextdb.commands.numbers import number_of
from contextdb.compiled.table import CompiledTable
from contextdb.disk import path_in_quotes
from contextdb.errors import ContextDBError, Fault, Place, TableError, in_quotes, mend_for, some
from contextdb.files.texts import AnySource, read_texts
from contextdb.motion.clips.quaternions import Floats
from contextdb.telemetry.contexts import Contexts, read_contexts

BY_SPEED = ("speed_mps", "turn_dps", "strafe_deg")
BY_VELOCITY = ("x_mps", "z_mps", "facing_deg")
STICK = ("time_s", *BY_SPEED, *BY_VELOCITY)
LIMITS = {
    "time_s": (-1e9, 1e9),
    "speed_mps": (0.0, 100.0),
    "turn_dps": (-3600.0, 3600.0),
    "strafe_deg": (-3600.0, 3600.0),
    "x_mps": (-100.0, 100.0),
    "z_mps": (-100.0, 100.0),
    "facing_deg": (-3600.0, 3600.0),
}
LONGEST_S = 24 * 3600.0


@dataclass(frozen=True, eq=False)
class Stick:
    """What was wanted at some moments, `times_s` float64 [T], ascending from 0: `wanted` float64 [T] by the column's name, NaN
    where it says nothing."""

    path: Path
    times_s: Floats
    wanted: Mapping[str, Floats]

    @property
    def is_velocity(self) -> bool:
        """Whether it asks for velocities over the ground, not for speeds."""
        return "x_mps" in self.wanted

    @property
    def duration_s(self) -> float:
        """Seconds from the first moment to the last."""
        return float(self.times_s[-1])

    def at(self, time_s: float) -> int:
        return max(0, int(np.searchsorted(self.times_s, time_s + 1e-9, side="right")) - 1)

    def value(self, name: str, moment: int, otherwise: float = 0.0) -> float:
        """What a column says at a moment, or something else where it says nothing."""
        value = float(self.wanted[name][moment]) if name in self.wanted else float("nan")
        return otherwise if np.isnan(value) else value

    @classmethod
    def read(cls, path: Path, conditions: Sequence[str]) -> Stick:
        """Read a file; `conditions` are the columns that are facts. Raises TableError or FileError where the file cannot be read;
        with every column that is neither the stick's nor a fact, and every value that is not a number."""
        source, columns = read_texts(path)
        faults = [_unknown(path, column.name, conditions) for column in columns if column.name not in (*STICK, *conditions)]
        by_name = {column.name: column for column in columns if column.name in STICK}
        faults += _missing(path, by_name)
        wanted = {name: _numbers(path, source, column, faults) for name, column in by_name.items()}
        if not faults:
            _check_times(path, source, wanted["time_s"], faults)
        if faults:
            raise TableError(*faults)
        times_s = wanted.pop("time_s")
        return cls(path, times_s - times_s[0], wanted)


def read_moments(
    path: Path, tables: Mapping[str, CompiledTable], unknown: Unknown, own: Collection[str] = ()
) -> list[dict[str, object]] | None:
    """Read the facts of each moment of a stick; those named `own` the character computes where the file does not give them.

    None when the file has no facts, and the tables ask for others than the character's own: nothing is filtered. Raises
    ContextDBError for facts that a query cannot use; with file, line and fact.
    """
    read = {name: read_contexts(path, table) for name, table in tables.items()}
    known = {name: [c for c in each.facts.columns if c in tables[name].asked] for name, each in read.items()}
    is_own = bool(tables) and all(set(own).issuperset(table.asked) for table in tables.values())
    if not any(known.values()) and not is_own:
        return None
    for name, each in read.items():
        with missing_facts_by_option():
            _with_own(each, tables[name], own).ask(tables[name], unknown)  # tells all that is wrong, with its line
    facts = [each.facts.select(known[name]).to_dicts() for name, each in read.items() if known[name]]
    n_moments = max((len(each.facts) for each in read.values()), default=0)
    return [_given([each[i] for each in facts]) for i in range(n_moments)]


def _with_own(contexts: Contexts, table: CompiledTable, own: Collection[str]) -> Contexts:
    """Contexts in which no fact that is computed later is missing."""
    import polars as pl

    columns = contexts.facts.columns
    filled = [pl.col(name).fill_null(0) if name in columns else pl.lit(0.0).alias(name) for name in own if name in table.asked]
    return replace(contexts, facts=contexts.facts.with_columns(filled))


def _given(rows: Sequence[Mapping[str, object]]) -> dict[str, object]:
    """The facts of some rows that are not missing."""
    return {key: value for row in rows for key, value in row.items() if value is not None}


def conditions_of(tables: Mapping[str, CompiledTable]) -> list[str]:
    """The facts that some tables ask for; a column of the stick's is none."""
    names = [name for table in tables.values() for name in table.asked]
    taken = [name for name in names if name in STICK]
    if taken:
        fault = f"the condition {in_quotes(taken[0])} has the name of a column of the stick's."
        raise ContextDBError(Fault(fault, f"other names for conditions than {some(STICK, len(STICK))}"))
    return list(dict.fromkeys(names))


# ---- what is wrong with a file


def _unknown(path: Path, name: str, conditions: Sequence[str]) -> Fault:
    known = [*STICK, *conditions]
    fault = f"the column {in_quotes(name)} is neither the stick's nor a fact of the tables."
    return Fault(fault, some(known, len(known)), mend_for(name, known), Place(str(path)))


def _missing(path: Path, columns: Mapping[str, TextColumn]) -> list[Fault]:
    place, faults = Place(str(path)), []
    if "time_s" not in columns:
        faults.append(Fault(f"the file has no column {in_quotes('time_s')}.", "seconds, ascending", place=place))
    by_speed = [name for name in BY_SPEED if name in columns]
    by_velocity = [name for name in BY_VELOCITY if name in columns]
    if by_speed and by_velocity:
        faults.append(
            Fault(f"the file has {some([*by_speed, *by_velocity])}.", f"{some(BY_SPEED)}; or {some(BY_VELOCITY)}", place=place)
        )
    elif "speed_mps" not in columns and not {"x_mps", "z_mps"} <= columns.keys():
        message = f"no column says where to go: there is no {in_quotes('speed_mps')}."
        faults.append(
            Fault(message, "speed_mps, metres a second; or both x_mps and z_mps, a velocity over the ground", place=place)
        )
    if columns and not next(iter(columns.values())).n_rows:
        faults.append(Fault("the file has no rows.", "a row for each moment", place=place))
    return faults


def _numbers(path: Path, source: AnySource, column: TextColumn, faults: list[Fault]) -> Floats:
    """The numbers of a column, NaN where it is empty; what is none leaves a fault."""
    least, most = LIMITS[column.name]
    values = np.full(len(column.texts), np.nan)
    for code, text in enumerate(column.texts):
        number = number_of(text)
        if number is not None and least <= number <= most:
            values[code] = number
        elif text.strip() or column.name == "time_s":
            row = int((column.codes == code).argmax())
            place = Place(str(path), source.line(row), column.name, row)
            faults.append(Fault(f"{in_quotes(text)} is not a valid number.", f"{least:g} to {most:g}", place=place))
    return np.asarray(values[column.codes])


def _check_times(path: Path, source: AnySource, times_s: Floats, faults: list[Fault]) -> None:
    late = np.flatnonzero(np.diff(times_s) <= 0.0)
    if len(late):
        row = int(late[0]) + 1
        place = Place(str(path), source.line(row), "time_s", row)
        faults.append(Fault(f"{times_s[row]:g} s comes after {times_s[row - 1]:g} s.", "times that ascend", place=place))
    elif times_s[-1] - times_s[0] > LONGEST_S:
        fault = f"the file {path_in_quotes(path)} lasts {times_s[-1] - times_s[0]:g} s."
        faults.append(Fault(fault, f"at most {LONGEST_S:g} s", place=Place(str(path))))
