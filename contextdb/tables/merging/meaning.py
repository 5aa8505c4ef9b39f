"""Whether two texts of a column mean the same: `20.0, 9.99` and `20.0000, 9.9900` do."""

from __future__ import annotations

from collections.abc import Callable

from contextdb.cells.grammar import parse_cell
from contextdb.cells.outputs import Output
from contextdb.cells.words import says_any, truth_of
from contextdb.errors import CellError
from contextdb.tables.condition_column import ConditionColumn
from contextdb.tables.data import TableData

Meaning = Callable[[str], object]
"""What a text means; None where nothing is known but the text itself."""


def meaning_of(table: TableData, column: int) -> Meaning:
    """How texts of a column are read: as cells, truths or numbers; an asset, an output without a type and what cannot be read mean
    themselves."""
    name, settings = table.columns[column].name, table.settings
    condition = next((c for c in table.conditions if c.condition.name == name), None)
    if condition is not None:
        return _cell_reader(condition)
    if name == settings.enabled:
        return lambda text: truth_of(text) if text.strip() else True
    if name == settings.once:
        return lambda text: truth_of(text) if text.strip() else False
    if name in (settings.priority, settings.weight, settings.cooldown_s, settings.cooldown_turns):
        empty = 1.0 if name == settings.weight else 0.0
        return lambda text: _number(text, empty)
    if (output := settings.output(name)) is not None:
        return _output_reader(output)
    if name == settings.when:
        return lambda text: "" if says_any(text) else text.strip()
    return lambda text: None


def is_same(one: Meaning, text: str, other: Meaning, other_text: str) -> bool:
    """Whether two texts mean the same, each in its own column."""
    if text == other_text:
        return True
    meaning = one(text)
    return meaning is not None and meaning == other(other_text)


def _cell_reader(column: ConditionColumn) -> Meaning:
    known = {text: column.cells[i] for i, text in enumerate(column.texts.texts) if i not in column.faults}
    domain = column.condition.domain

    def read(text: str) -> object:
        try:
            return domain.kind, known[text] if text in known else parse_cell(text, domain)
        except CellError:
            return None

    return read


def _output_reader(output: Output) -> Meaning:
    def read(text: str) -> object:
        try:
            return output.kind, output.read(text, wants_mend=False)
        except CellError:
            return None

    return read


def _number(text: str, empty: float) -> float | None:
    try:
        return float(text) if text.strip() else empty
    except ValueError:
        return None
