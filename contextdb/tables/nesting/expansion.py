"""The rows of a table with the rows of its inner tables in place of those that refer to them.

D = depth, n = rows of the flat table. A flat row is a way through the tables: a row of the outer one, and where that refers to a
table, a row of that one, and so on. The order is that of the files: inner rows stand where the outer row is.

The words of slots of all rows of a way add up. A role that one of them constrains stays needed when only another has it among its
optional slots: what a row asks for is not loosened by the table around it, nor by the one inside it.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from contextdb.cells.conditions import Condition
from contextdb.cells.grammar import format_cell
from contextdb.cells.outputs import Output
from contextdb.cells.sets import ANY, Cell, TagMeet, meet
from contextdb.cells.words import quoted, says_any, slot_words
from contextdb.columns import TextColumn
from contextdb.compiled.layers import Layers, SoftMasks
from contextdb.compiled.outputs import NO_OUTPUTS, Outputs, cells_of, outputs_of_cells
from contextdb.errors import Fault, Place, TableError, in_quotes
from contextdb.schema.settings import derivation_of
from contextdb.tables.condition_column import ConditionColumn
from contextdb.tables.data import TableData, output_columns_of
from contextdb.tables.nesting.links import inner_rows
from contextdb.tables.nesting.names import asset_name
from contextdb.tables.plain_columns import layered

if TYPE_CHECKING:
    from contextdb.expressions import Expression
    from contextdb.expressions.rules import WhenColumn

Numbers = NDArray[np.int32]
MOST_ROWS = 1_000_000
"""A table may have so many rows with its inner tables' rows counted; one that is in two places counts twice."""


@dataclass(frozen=True, eq=False)
class Expansion:
    """The ways of all flat rows."""

    names: tuple[str, ...]
    tables: tuple[TableData, ...]
    """Every table once, the outer one first."""
    numbers: Numbers
    """Which of `tables` a way passes at each depth: int32 [D, n]; -1 below its end."""
    rows: Numbers
    """The row that it takes there: int32 [D, n]; -1 below its end."""

    @property
    def n_rows(self) -> int:
        return int(self.rows.shape[1])

    def layers(self, columns: Iterable[tuple[int, TextColumn]]) -> Layers:
        """The texts of some tables' columns, given with the numbers of the tables."""
        texts, codes = [""], np.zeros(self.rows.shape, np.int32)
        for number, column in columns:
            here = self.numbers == number
            codes[here] = column.codes[self.rows[here]] + len(texts)
            texts += column.texts
        return Layers(tuple(texts), codes)


NO_ROWS = Expansion((), (), np.empty((1, 0), np.int32), np.empty((1, 0), np.int32))


def expand(tables: Mapping[str, TableData]) -> Expansion:
    """The flat rows of the first of some sound tables; the others are those that are in it. Raises TableError where there are more
    than `MOST_ROWS`."""
    name, outer = next(iter(tables.items()))
    if (n_rows := _count(name, tables, {})) > MOST_ROWS:
        file = str(outer.path) if outer.path else None
        problem = f"with the rows of its inner tables the table {in_quotes(name)} has {n_rows:,} rows."
        raise TableError(Fault(problem, f"at most {MOST_ROWS:,}", place=Place(file), rule="too-many-rows"))
    numbers, rows = _ways(name, tables, {inner: number for number, inner in enumerate(tables)}, {})
    return Expansion(tuple(tables), tuple(tables.values()), numbers, rows)


def _count(name: str, tables: Mapping[str, TableData], known: dict[str, int]) -> int:
    if name not in known:
        inner = inner_rows(tables[name])
        plain = tables[name].n_rows - sum(map(len, inner.values()))
        known[name] = plain + sum(len(rows) * _count(other, tables, known) for other, rows in inner.items())
    return known[name]


def _ways(
    name: str, tables: Mapping[str, TableData], order: Mapping[str, int], known: dict[str, tuple[Numbers, Numbers]]
) -> tuple[Numbers, Numbers]:
    if name not in known:
        below = {row: _ways(other, tables, order, known) for other, rows in inner_rows(tables[name]).items() for row in rows}
        counts = np.ones(tables[name].n_rows, np.int64)
        counts[list(below)] = [ways[0].shape[1] for ways in below.values()]
        depth, stops = 1 + max((len(ways[0]) for ways in below.values()), default=0), np.cumsum(counts)
        numbers, rows = (np.full((depth, int(counts.sum())), -1, np.int32) for _ in range(2))
        numbers[0], rows[0] = order[name], np.repeat(np.arange(len(counts)), counts)
        for row, (inner_numbers, taken) in below.items():
            here = slice(int(stops[row] - counts[row]), int(stops[row]))
            numbers[1 : 1 + len(taken), here], rows[1 : 1 + len(taken), here] = inner_numbers, taken
        known[name] = numbers, rows
    return known[name]


# ---- the columns of a flat table that are not conditions: assets with their paths, outputs, and the rows' own rules


PATH_MARK = "/"


def paths_and_leaves(expansion: Expansion, name: str) -> tuple[TextColumn, tuple[str, ...]]:
    """The asset of each row with its path, as a column, and alone."""
    own = [[asset_name(text) for text in table.assets] for table in expansion.tables]
    depths = (expansion.rows >= 0).sum(axis=0).tolist()
    paths, leaves = list[str](), list[str]()
    for depth, numbers, rows in zip(depths, expansion.numbers.T.tolist(), expansion.rows.T.tolist(), strict=True):
        leaf = own[numbers[depth - 1]][rows[depth - 1]]
        leaves.append(leaf)
        paths.append(leaf if depth == 1 else PATH_MARK.join([*(expansion.names[n] for n in numbers[:depth]), leaf]))
    return TextColumn.of(name, paths), tuple(leaves)


def outputs_of(expansion: Expansion, taken: set[str]) -> list[TextColumn]:
    """The columns of outputs: of slots all words of the way, else the innermost text."""
    names = dict.fromkeys(name for table in expansion.tables for name in table.settings.outputs)
    flat = []
    for name in (name for name in names if name not in taken):
        columns = [(n, t.text_column(name)) for n, t in enumerate(expansion.tables) if name in t.settings.outputs]
        join = all_words if name == MANDATORY else _innermost
        flat.append(optional_slots(expansion, columns) if name == OPTIONAL else expansion.layers(columns).joined(name, join))
        taken.add(name)
    return flat


def _innermost(texts: list[str]) -> str:
    return texts[-1] if texts else ""


def rules_of(expansion: Expansion, taken: set[str]) -> TextColumn | None:
    """The rows' own rules: those of a way must all hold."""
    columns = [(n, t.text_column(t.settings.when)) for n, t in enumerate(expansion.tables) if t.settings.when is not None]
    if not columns:
        return None
    return expansion.layers(columns).joined(free_name(columns[0][1].name, taken), _all_rules)


def _all_rules(texts: list[str]) -> str:
    rules = [text for text in texts if not says_any(text)]
    return " and ".join(f"({rule})" for rule in rules) if len(rules) > 1 else "".join(rules)


def free_name(name: str, taken: set[str]) -> str:
    """A name for a column that no condition has."""
    while name in taken:
        name += "_"
    taken.add(name)
    return name


# ---- outputs


def declared_of(expansion: Expansion) -> tuple[Output, ...]:
    """The outputs of all tables, as the first that has one declares it. Raises TableError where tables declare an output with
    different types, values or sizes."""
    outputs: dict[str, tuple[int, Output]] = {}
    faults: list[Fault] = []
    for number, table in enumerate(expansion.tables):
        for output in table.settings.declared_outputs:
            first, known = outputs.setdefault(output.name, (number, output))
            if (known.kind, known.values, known.size) != (output.kind, output.values, output.size):
                faults.append(_unlike(expansion, first, number, known, output))
    if faults:
        raise TableError(*faults)
    return tuple(output for _, output in outputs.values())


def flat_outputs(expansion: Expansion, slots: Mapping[str, TextColumn]) -> Outputs:
    """The outputs of flat rows; `slots` are the columns of slots, whose words of a way add up."""
    declared = declared_of(expansion)
    if not declared:
        return NO_OUTPUTS
    cells = []
    for output in declared:
        if output.name in slots:
            cells.append(cells_of(output, list(slots[output.name].texts), slots[output.name].codes))
            continue
        named = [(n, c) for n, t in enumerate(expansion.tables) for c in output_columns_of(t) if c.output.name == output.name]
        cells.append(cells_of(output, *layered(named, expansion.numbers, expansion.rows, output.nothing)))
    return outputs_of_cells(declared, cells, dict(expansion.tables[0].settings.fallback_outputs))


def _unlike(expansion: Expansion, first: int, number: int, known: Output, output: Output) -> Fault:
    outer = expansion.tables[first]
    where = str(outer.path) if outer.path else f"the table {in_quotes(expansion.names[first])}"
    is_kind = known.kind != output.kind
    problem = (
        f"the output is of type {output.kind} here and of type {known.kind} in {where}."
        if is_kind
        else f"the output has other values or another size here than in {where}."
    )
    file = expansion.tables[number].path
    place = Place(str(file) if file else f"the table {in_quotes(expansion.names[number])}", None, output.name)
    return Fault(problem, "one type in all tables that contain each other", "", place, "unlike-outputs")


# ---- slots


if TYPE_CHECKING:
    from contextdb.expressions import Expression
    from contextdb.expressions.rules import WhenColumn

MANDATORY, OPTIONAL = "Mandatory_Slots", "Optional_Slots"
Flags = NDArray[np.bool_]


def all_words(texts: list[str]) -> str:
    """The words of several cells of slots, in one."""
    return " ".join(dict.fromkeys(text.strip() for text in texts))


def optional_slots(expansion: Expansion, columns: Sequence[tuple[int, TextColumn]]) -> TextColumn:
    """The optional slots of flat rows, without the roles that a row of the way needs and has not among its own."""
    layers = expansion.layers(columns)
    joined = layers.joined(OPTIONAL, all_words)
    roles = {role for table in expansion.tables for role in _roles(table)}
    texts: list[str] | None = None
    for role in sorted(roles & {word for text in joined.texts for word in slot_words(text)}):
        names = np.array([role in slot_words(text) for text in layers.texts], np.bool_)
        needed = (_constrained(expansion, role) & ~names[layers.codes]).any(axis=0) & names[layers.codes].any(axis=0)
        for row in np.flatnonzero(needed).tolist():
            texts = texts or joined.to_list()
            texts[row] = " ".join(quoted(word) for word in slot_words(texts[row]) if word != role)
    return joined if texts is None else TextColumn.of(OPTIONAL, texts)


def _constrained(expansion: Expansion, role: str) -> Flags:
    """Whether the row at each depth has a cell on the role that excludes somebody, or a rule that names it: bool [D, n]."""
    flags = np.zeros(expansion.rows.shape, np.bool_)
    for number, table in enumerate(expansion.tables):
        here = expansion.numbers == number
        for column in (c for c in table.conditions if c.condition.role == role):
            flags[here] |= _says(column)[expansion.rows[here]]
        if table.when is not None:
            flags[here] |= _rules(table, table.when, role)[expansion.rows[here]]
    return flags


def _roles(table: TableData) -> set[str]:
    """The roles that a table's columns and rules speak of."""
    rules = table.when.rules if table.when is not None else ()
    return {c.condition.role for c in table.conditions if c.condition.role}.union(*(_ruled(table, rule) for rule in rules))


def _rules(table: TableData, when: WhenColumn, role: str) -> Flags:
    says = np.array([role in _ruled(table, rule) for rule in when.rules], np.bool_)
    return says[when.texts.codes]


def _ruled(table: TableData, rule: Expression | None) -> set[str]:
    """The roles of the facts that a rule names, and of those that they are computed from."""
    if rule is None:
        return set()
    derivation = derivation_of(table.schema, rule.names)
    conditions = (*rule.conditions, *(derivation.conditions if derivation is not None else ()))
    return {c.role for c in conditions if c.role}


def _says(column: ConditionColumn) -> Flags:
    says = np.array([not (cell.is_any or cell.is_soft) for cell in column.cells], np.bool_)
    return says[column.texts.codes]


# ---- the conditions of a flat table: each row accepts what all cells of its way accept. D = depth, n = flat rows


BOTH = " & "
"""Between the cells of two tables where no single cell says the same."""


@dataclass(frozen=True, eq=False)
class FlatColumn(ConditionColumn):
    """A condition of a flat table: each row accepts what all cells of its way accept."""

    sources: tuple[tuple[int, ConditionColumn], ...]
    """The columns that it was made of, with the numbers of their tables."""
    layers: Layers

    @classmethod
    def made(cls, expansion: Expansion, condition: Condition, sources: Sequence[tuple[int, ConditionColumn]]) -> FlatColumn:
        """Bring the columns of some tables together."""
        layers = expansion.layers([(number, column.texts) for number, column in sources])
        combined, which = layers.combined
        ways = combined.T.tolist()
        cells = _Cells(sources)
        met = [_met([layers.texts[c] for c in codes if c], [cells[c] for c in codes if c], condition) for codes in ways]
        texts = TextColumn(condition.name, tuple(text for text, _ in met), which)
        return cls(condition, texts, tuple(cell for _, cell in met), {}, tuple(sources), layers)

    @cached_property
    def soft(self) -> SoftMasks | None:
        """What soft cells cost, one row for each row of each depth: D n rows."""
        cells, used = _Cells(self.sources), np.unique(self.layers.codes)
        soft = [cells[c] if cells[c].is_soft else ANY for c in used.tolist()]
        if all(cell.is_any for cell in soft):
            return None
        codes = np.searchsorted(used, self.layers.codes).astype(np.int32).reshape(-1)
        return SoftMasks.of(soft, codes, self.condition.domain)


class _Cells:
    """The cells of some columns under the codes of `Layers`."""

    def __init__(self, sources: Sequence[tuple[int, ConditionColumn]]) -> None:
        self._columns = [column for _, column in sources]
        self._starts = np.cumsum([1, *(len(column.texts.texts) for column in self._columns)])

    def __getitem__(self, code: int) -> Cell:
        if code == 0:
            return ANY
        at = int(np.searchsorted(self._starts, code, "right")) - 1
        return self._columns[at].cells[code - int(self._starts[at])]


def _met(texts: list[str], cells: list[Cell], condition: Condition) -> tuple[str, Cell]:
    """A cell and its text: the text of one table where that says it all."""
    met = meet(cells)
    specified = [(text, cell) for text, cell in zip(texts, cells, strict=True) if not cell.is_any]
    if not specified:
        return (texts[-1] if texts else ""), met
    n_soft = sum(cell.is_soft for _, cell in specified)
    if not n_soft or len(specified) == 1:
        same = next((text for text, cell in specified if cell == met), None)
        if same is not None:
            return same, met
    if n_soft or isinstance(met.accepts, TagMeet):
        return BOTH.join(text.strip() for text, _ in specified), met
    return format_cell(met, condition.domain), met
