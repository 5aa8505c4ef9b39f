"""The contexts that a designer expects of a table: a CSV or Parquet file, `[tables.NAME] expected = "FILE"`.

A row is a situation: a cell for each condition, as in any table, and in a column `weight` how often it comes against the others; 1
where nothing says. A first column that is no condition names the situations. An edge: this reads a file.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from contextdb.cells.conditions import Condition
from contextdb.cells.grammar import parse_cell
from contextdb.cells.sets import Cell
from contextdb.columns import TextColumn
from contextdb.disk.boundary import inside
from contextdb.errors import CellError, Fault, Place, TableError, in_quotes, mend_for, some
from contextdb.files.texts import AnySource, read_texts
from contextdb.tables.data import TableData

WEIGHT = "weight"


@dataclass(frozen=True)
class Situation:
    """A box of contexts that is expected so often."""

    name: str
    weight: float
    cells: Mapping[str, str]
    """The cells that restrict something."""
    parsed: Mapping[str, Cell]
    place: Place

    @property
    def line(self) -> int | None:
        return self.place.line

    @property
    def text(self) -> str:
        """What it is called, else its cells."""
        return self.name or ", ".join(f"{name}: {text}" for name, text in self.cells.items()) or "every context"


def expected_path(table: TableData) -> Path | None:
    """The file of a table's expected contexts; None where none is declared, or the table is in no folder. Raises FileError where a
    link leads it out of the folder."""
    if table.settings.expected is None or table.schema.file is None:
        return None
    folder = Path(table.schema.file).parent
    return inside(folder / table.settings.expected, folder)


def read_situations(path: Path, conditions: Sequence[Condition]) -> list[Situation]:
    """The situations of a file; `conditions` are those of the table. Raises TableError with every cell that cannot be read and each
    column that is neither a condition nor `weight`, FileError where there is no such file."""
    source, columns = read_texts(path)
    known = {condition.name: condition for condition in conditions}
    of_cells = [column for column in columns if column.name in known]
    plain = [column for column in columns if column.name not in known]
    weights = next((column for column in plain if column.name.casefold() == WEIGHT), None)
    names = plain[0] if plain and plain[0] is columns[0] and plain[0] is not weights else None
    faults = [_no_condition(column, known, path) for column in plain if column not in (weights, names)]
    situations = []
    for row in range(columns[0].n_rows if columns else 0):
        place = Place(str(path), _line(source, row), row=row)
        weight = _weight(weights, row, place, faults)
        texts = {column.name: column[row] for column in of_cells}
        parsed = {name: cell for name, text in texts.items() if (cell := _cell(text, known[name], place, faults)) is not None}
        if weight > 0.0:
            name = names[row].strip() if names is not None else ""
            situations.append(Situation(name, weight, {n: texts[n].strip() for n in parsed}, parsed, place))
    if faults:
        raise TableError(*faults)
    return situations


def _line(source: AnySource, row: int) -> int | None:
    return source.line(row)


def _cell(text: str, condition: Condition, place: Place, faults: list[Fault]) -> Cell | None:
    """A cell that restricts something; None for others."""
    at = Place(place.file, place.line, condition.name, place.row)
    try:
        cell = parse_cell(text, condition.domain)
    except CellError as error:
        faults += [fault.at(at) for fault in error.faults]
        return None
    if cell.is_soft:
        faults.append(Fault(f"{in_quotes(text)} is soft, and nobody expects a cost.", "a cell without ~", place=at))
    elif cell.is_empty:
        faults.append(Fault(f"{in_quotes(text)} accepts no value at all.", "a cell that some fact is in", place=at))
    return None if cell.is_any or cell.is_soft or cell.is_empty else cell


def _weight(column: TextColumn | None, row: int, place: Place, faults: list[Fault]) -> float:
    text = column[row].strip() if column is not None else ""
    try:
        weight = float(text or "1")
    except ValueError:
        weight = math.nan
    if 0.0 <= weight < math.inf:
        return weight
    at = Place(place.file, place.line, column.name if column is not None else None, place.row)
    faults.append(Fault(f"cannot read {in_quotes(text)} as a weight.", "a number from 0 up", place=at, rule="unreadable-cell"))
    return 0.0


def _no_condition(column: TextColumn, known: Mapping[str, Condition], path: Path) -> Fault:
    problem = f"the table has no condition {in_quotes(column.name)}."
    accepted = f"{WEIGHT}, {some(known)}" if known else WEIGHT
    return Fault(problem, accepted, mend_for(column.name, known), Place(str(path), 1, column.name))
