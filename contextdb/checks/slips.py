"""What saved contexts must reach so that a slip in a table makes one of them fail.

A slip is a row left out, an end of a range moved, a bool flipped, or a value or a tag left out (`contextdb.checks.slips`). One
more table holds the rows of the table, and behind them the rows after each slip: its answer says what every slip does in a context.
A slip is noticed where an asset becomes valid, or no longer is; another row of the same asset hides it.

n rows, M slips of cells, N contexts. The targets of contexts are the rows to be valid, the rows to be picked, the rows left out,
then the slips of cells: T = 3 n + M of them. Flags of rows are those of the table, then those after each slip: bool [N, n + M].

An end moves inwards and outwards by one in the last digit that it is written with: `0.2..3` becomes `(0.2..3]`, which loses the
end itself, and `0.1..3`. Soft cells exclude nothing, and Any has no end: they stay as they are.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from contextdb.bitmask import Flags
from contextdb.cells import intervals
from contextdb.cells.domains import Domain
from contextdb.cells.grammar import format_cell
from contextdb.cells.intervals import Span, Spans
from contextdb.cells.sets import Cell, NumberSet, TagSet, ValueSet
from contextdb.cells.words import quoted
from contextdb.columns import TextColumn
from contextdb.compiled.choosing import Choosing
from contextdb.compiled.data import CompiledData
from contextdb.compiled.table import data_of
from contextdb.covering.assumed import opened
from contextdb.errors import Fault, Place, TableError, in_quotes
from contextdb.schema.table_settings import TableSettings
from contextdb.tables.nesting.flat import FlatTable
from contextdb.tables.nesting.plain import as_plain
from contextdb.tables.table import Table

VALID, PICKED, LEFT_OUT = "valid", "picked", "left out"


@dataclass(frozen=True, slots=True)
class Slip:
    """A cell of a row after a slip."""

    row: int
    condition: str
    what: str
    """What slipped: "from 0.2", "True"."""
    cell: str
    is_end: bool

    @property
    def text(self) -> str:
        return f"{self.condition} {self.what}"


@dataclass(frozen=True, eq=False)
class Slips:
    """A table, and the slips of its cells."""

    table: Table
    """Flat."""
    choosing: Choosing
    """How the table as it is written decides between these rows."""
    slips: tuple[Slip, ...]

    @classmethod
    def of(cls, table: Table) -> Slips:
        """Raises TableError where cells cannot be read, or tags are required in a way that no cell can say."""
        choosing = data_of(table.compile()).once(Choosing.of)
        plain = _plain(table)
        return cls(plain, choosing, tuple(_slips(plain)))

    @property
    def n_rows(self) -> int:
        return self.table.n_rows

    @property
    def n_targets(self) -> int:
        return 3 * self.n_rows + len(self.slips)

    @cached_property
    def slipped(self) -> Table:
        """The rows of the table, then those after each slip."""
        n = self.n_rows
        longer = self.table.with_rows_taken([*range(n), *(slip.row for slip in self.slips)])
        return longer.with_cells((n + k, slip.condition, slip.cell) for k, slip in enumerate(self.slips))

    @cached_property
    def compiled(self) -> CompiledData:
        """The rows after each slip, compiled with those of the table."""
        return data_of(self.slipped.compile())

    def hits(self, valid: Flags) -> Flags:
        """Which targets each of some contexts reaches, by its valid rows: bool [N, T]."""
        n = self.n_rows
        own = valid[:, :n]
        is_hidden = self._is_hidden(own)
        is_noticed = (valid[:, n:] != own[:, self._rows]) & ~is_hidden[:, self._rows]
        return np.concatenate([own, self.choosing.pickable_of(own), own & ~is_hidden, is_noticed], axis=1)

    def _is_hidden(self, own: Flags) -> Flags:
        """Whether another row of its asset is valid: bool [N, n]."""
        contexts, rows = np.nonzero(own)
        n_assets = int(self._asset_numbers.max(initial=0)) + 1
        counts = np.bincount(contexts * n_assets + self._asset_numbers[rows], minlength=len(own) * n_assets)
        return np.asarray(counts.reshape(len(own), n_assets)[:, self._asset_numbers] > own)

    @cached_property
    def _rows(self) -> NDArray[np.int64]:
        return np.array([slip.row for slip in self.slips], np.int64)

    @cached_property
    def _asset_numbers(self) -> NDArray[np.int64]:
        numbers: dict[str, int] = {}
        return np.array([numbers.setdefault(asset, len(numbers)) for asset in self.table.assets], np.int64)

    def rows_of_asset(self, row: int) -> list[int]:
        """The other rows of a row's asset."""
        rows = np.flatnonzero(self._asset_numbers == self._asset_numbers[row]).tolist()
        return [other for other in rows if other != row]

    def asset_of(self, target: int) -> str:
        return self.table.assets[self.row_of(target)]

    def row_of(self, target: int) -> int:
        return target % self.n_rows if target < 3 * self.n_rows else self.slips[target - 3 * self.n_rows].row

    def kind_of(self, target: int) -> str | Slip:
        """What a target is: a row to be valid, picked or left out, or a slip."""
        kinds = (VALID, PICKED, LEFT_OUT)
        return kinds[target // self.n_rows] if target < 3 * self.n_rows else self.slips[target - 3 * self.n_rows]


def _slips(table: Table) -> Iterator[Slip]:
    is_drawn = opened(table).drawer is not None  # draws meet no single number
    for column in table.conditions:
        condition = column.condition
        of_code = {
            code: [(m.what, format_cell(m.cell, condition.domain), m.is_end) for m in mutated(cell, condition.domain, is_drawn)]
            for code, cell in enumerate(column.cells)
        }
        for row in np.flatnonzero(table.enabled).tolist():
            for what, cell, is_end in of_code[int(column.texts.codes[row])]:
                yield Slip(row, condition.name, what, cell, is_end)


def _plain(table: Table) -> Table:
    """A table whose rows are all its own: those of a base are among them, and what refers to other tables becomes their rows."""
    flat = table.flat()
    if isinstance(flat, Table):
        return flat
    if not isinstance(flat, FlatTable):
        own = replace(flat.settings, base=None, remove=None)
        return Table.build(flat.name, flat.columns, flat.schema, own, table.path)
    plain = as_plain(flat)
    if plain is None:
        problem = f"tags of {in_quotes(table.name)} and of a table inside it have requirements that no single cell can describe."
        raise TableError(Fault(problem, place=Place(str(table.path) if table.path else None)))
    enabled = TextColumn.of("\0enabled", map(str, plain.enabled.tolist()))
    when = plain.settings.when
    rules = [column for column in plain.columns if column.name == when]
    columns = [TextColumn.of(plain.asset_column, plain.assets), enabled, *rules, *(column.texts for column in plain.conditions)]
    settings = TableSettings(plain.name, asset=plain.asset_column, enabled=enabled.name, when=when, assume=plain.settings.assume)
    return Table.build(plain.name, columns, plain.schema, settings, table.path)


def flags_of(bits: Sequence[int], n_rows: int) -> Flags:
    """Sets of rows, as bits, as flags: bool [N, n_rows]."""
    raw = b"".join(one.to_bytes((n_rows + 7) // 8, "little") for one in bits)
    packed = np.frombuffer(raw, np.uint8).reshape(len(bits), -1)
    return np.unpackbits(packed, axis=1, bitorder="little", count=n_rows).astype(np.bool_)


# ---- cells as they would be after a slip: an end of a range moved, a bool flipped, a value or a tag left out


MOST_DIGITS = 9
"""So many digits behind the point an end moves by at least."""


@dataclass(frozen=True, slots=True)
class Mutated:
    """A cell after a slip."""

    what: str
    """What slipped, in a few words: "from 0.2", "up to 3", "+InAir", "True"."""
    cell: Cell
    is_end: bool = False
    """Whether it is an end of a range that moved."""


def mutated(cell: Cell, domain: Domain, is_wide: bool = False) -> Iterator[Mutated]:
    """What may become of a cell. With `is_wide` ends move so far that random facts fall between: a tenth of the range."""
    accepts = cell.accepts
    if cell.is_soft or accepts is None or accepts.is_empty:
        return
    if isinstance(accepts, NumberSet):
        yield from _moved_ends(accepts, domain, is_wide)
    elif isinstance(accepts, ValueSet):
        yield from _other_values(accepts, domain)
    elif isinstance(accepts, TagSet):
        yield from _fewer_tags(accepts)


def _other_values(accepts: ValueSet, domain: Domain) -> Iterator[Mutated]:
    names = [quoted(value) if isinstance(value, str) else str(value) for value in sorted(accepts.values)]
    if len(names) == 1 and not accepts.is_complement and len(domain.everything or ()) == 2:
        yield Mutated(names[0], Cell(ValueSet(frozenset(domain.everything or ()) - accepts.values)))
    elif len(names) > 1:
        for name, value in zip(names, sorted(accepts.values), strict=True):
            yield Mutated(name, Cell(ValueSet(accepts.values - {value}, accepts.is_complement)))
    yield Mutated(" ".join(["not", *names] if accepts.is_complement else names), Cell())


def _fewer_tags(accepts: TagSet) -> Iterator[Mutated]:
    words = [(f"+{quoted(tag)}", TagSet(accepts.needs - {tag}, accepts.bans)) for tag in sorted(accepts.needs)]
    words += [(f"-{quoted(tag)}", TagSet(accepts.needs, accepts.bans - {tag})) for tag in sorted(accepts.bans)]
    if accepts.is_complement:
        yield Mutated(f"not {' '.join(word for word, _ in words)}", Cell())
        return
    for word, tags in words:
        yield Mutated(word, Cell(tags if tags.needs or tags.bans else None))


def _moved_ends(accepts: NumberSet, domain: Domain, is_wide: bool) -> Iterator[Mutated]:
    lowest, highest = domain.ends
    for at, (low, high) in enumerate(accepts.spans):
        width = (high - low) / 10.0 if is_wide and math.isfinite(high - low) else 0.0
        for end, inward, words in ((low, 1.0, "from"), (high, -1.0, "up to")):
            if not math.isfinite(end) or (domain.type.is_circular and end in domain.ends):
                continue  # -180 and 180 are one angle, where a range goes on
            written, is_open = _written(end, inward)
            name = f"{words} {domain.type.spelling.write(written)}"
            for moved in _moves(end, written, inward, is_open, domain, width):
                if lowest <= moved <= highest and moved != end:
                    yield from _with_span(accepts, at, (moved, high) if inward > 0 else (low, moved), name, domain)


def _with_span(accepts: NumberSet, at: int, span: Span, name: str, domain: Domain) -> Iterator[Mutated]:
    spans: Spans = (*accepts.spans[:at], span, *accepts.spans[at + 1 :])
    moved = NumberSet(domain.type.fitted(intervals.union(spans)), accepts.is_circular)
    if moved.spans and moved != accepts:
        yield Mutated(name, Cell(moved), is_end=True)


def _written(end: float, inward: float) -> tuple[float, bool]:
    """The end as a person writes it, and whether it is open: 4.999999999999999 is below an open 5."""
    beyond = math.nextafter(end, -inward * math.inf)
    if len(repr(beyond)) + 4 <= len(repr(end)):
        return beyond, True
    short = round(end, MOST_DIGITS)
    return (short if math.isclose(short, end, rel_tol=1e-12) else end), False


def _moves(end: float, written: float, inward: float, is_open: bool, domain: Domain, width: float) -> list[float]:
    """Where an end goes: one step inwards, and one outwards."""
    if domain.type.is_whole:
        return [end + inward, end - inward]
    digits = _digits(written)
    step = max(10.0**-digits, width)
    inside, outside = (round(written + sign * step, digits + 3) for sign in (inward, -inward))
    further = math.nextafter(inside, inward * math.inf)
    if width:
        return [further, outside]
    return [further, written] if is_open else [math.nextafter(end, inward * math.inf), outside]


def _digits(number: float) -> int:
    """How many digits behind the point a number is written with."""
    text = repr(round(number, MOST_DIGITS))
    return 0 if "e" in text else len(text.partition(".")[2].rstrip("0"))
