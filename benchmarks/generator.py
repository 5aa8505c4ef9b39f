"""Tables and contexts like those of a game, made from a seed.

R rows, N contexts. A table has bool, enum and number columns; 65 % of its cells are Any. An enum has 8 to 12 values and a cell
names 1 to 4 of them; a number cell is a closed interval between 0 and 100 whose bounds lie on a grid of 0.5. Half of the contexts
are drawn so that they satisfy some row, as in a game, where an answer usually exists; the others are uniformly random.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
import polars as pl
from numpy.typing import NDArray

ANY_SHARE = 0.65
GRID = 0.5


@dataclass(frozen=True)
class Shape:
    """How large a table is."""

    name: str
    n_rows: int
    n_bools: int
    n_enums: int
    n_numbers: int

    @property
    def n_columns(self) -> int:
        """Conditions of every type."""
        return self.n_bools + self.n_enums + self.n_numbers


SHAPES = (Shape("1,000 x 30", 1_000, 18, 6, 6), Shape("10,000 x 40", 10_000, 24, 8, 8))


@dataclass(frozen=True)
class GameTable:
    """A table as arrays, one row of each array for each column, so that every engine can be filled from it.

    bools uint16 [n_bools, R]: bit 0 accepts False, bit 1 accepts True. enums uint16 [n_enums, R]: bit j accepts value j.
    lows, highs float64 [n_numbers, R]: closed intervals, infinite at both ends where the cell is Any.
    """

    shape: Shape
    bools: NDArray[np.uint16]
    enums: NDArray[np.uint16]
    lows: NDArray[np.float64]
    highs: NDArray[np.float64]
    values: tuple[tuple[str, ...], ...]
    """The names of each enum's values."""

    @cached_property
    def bool_names(self) -> list[str]:
        """Names of the bool conditions."""
        return [f"is_state_{i}" for i in range(self.shape.n_bools)]

    @cached_property
    def enum_names(self) -> list[str]:
        """Names of the enum conditions."""
        return [f"enum_{i}" for i in range(self.shape.n_enums)]

    @cached_property
    def number_names(self) -> list[str]:
        """Names of the number conditions."""
        return [f"number_{i}" for i in range(self.shape.n_numbers)]

    @cached_property
    def value_numbers(self) -> list[dict[str, int]]:
        """For each enum, the number of each of its values."""
        return [{name: j for j, name in enumerate(names)} for names in self.values]

    def cells(self) -> dict[str, list[str]]:
        """The texts of the table's cells, an asset column first."""
        columns = {"Asset Name": [f"asset_{r}" for r in range(self.shape.n_rows)]}
        for name, column in zip(self.bool_names, self.bools, strict=True):
            columns[name] = [("False", "True", "Any")[bits - 1] for bits in column.tolist()]
        for name, column, names in zip(self.enum_names, self.enums, self.values, strict=True):
            columns[name] = [enum_cell(bits, names) for bits in column.tolist()]
        for name, low, high in zip(self.number_names, self.lows.tolist(), self.highs.tolist(), strict=True):
            columns[name] = ["Any" if a == -np.inf else f"{a}..{b}" for a, b in zip(low, high, strict=True)]
        return columns

    def schema(self) -> dict[str, dict[str, object]]:
        """The types of the conditions, as contextdb.toml would declare them."""
        types: dict[str, dict[str, object]] = {name: {"type": "bool"} for name in self.bool_names}
        types |= {n: {"type": "enum", "values": list(v)} for n, v in zip(self.enum_names, self.values, strict=True)}
        return types | {name: {"type": "number"} for name in self.number_names}


@dataclass(frozen=True)
class Contexts:
    """N contexts as arrays: bools int64 [N, n_bools], enums (value numbers) int64 [N, n_enums], numbers float64 [N, n_numbers]."""

    table: GameTable
    bools: NDArray[np.int64]
    enums: NDArray[np.int64]
    numbers: NDArray[np.float64]

    def __len__(self) -> int:
        return len(self.numbers)

    def first(self, n: int) -> Contexts:
        """The first n of them."""
        return Contexts(self.table, self.bools[:n], self.enums[:n], self.numbers[:n])

    def dicts(self) -> list[dict[str, Any]]:
        """Each context as a game would hand it over."""
        columns = self.columns()
        facts = zip(*columns.values(), strict=True)
        return [dict(zip(columns, row, strict=True)) for row in facts]

    def columns(self) -> dict[str, list[Any]]:
        """The facts of each condition: lists of bool, str and float."""
        table = self.table
        found: dict[str, list[Any]] = dict(zip(table.bool_names, self.bools.astype(bool).T.tolist(), strict=True))
        for name, numbers, names in zip(table.enum_names, self.enums.T.tolist(), table.values, strict=True):
            found[name] = [names[j] for j in numbers]
        return found | dict(zip(table.number_names, self.numbers.T.tolist(), strict=True))

    def frame(self, enums_as_text: bool = True) -> pl.DataFrame:
        """The facts as telemetry holds them; enums as texts, or as polars' own Enum, which numbers its values."""
        frame = pl.DataFrame(self.columns())
        if enums_as_text:
            return frame
        types = zip(self.table.enum_names, self.table.values, strict=True)
        return frame.with_columns(pl.col(name).cast(pl.Enum(names)) for name, names in types)

    def answers(self) -> list[list[int]]:
        """The valid rows of each context, found by comparing every cell: what every engine is checked against."""
        return [np.flatnonzero(self._valid(k)).tolist() for k in range(len(self))]

    def _valid(self, k: int) -> NDArray[np.bool_]:
        table = self.table
        is_valid = ((table.bools >> self.bools[k, :, None].astype(np.uint16)) & 1).all(axis=0)
        is_valid &= ((table.enums >> self.enums[k, :, None].astype(np.uint16)) & 1).all(axis=0)
        numbers = self.numbers[k, :, None]
        is_valid &= ((table.lows <= numbers) & (numbers <= table.highs)).all(axis=0)
        return np.asarray(is_valid, np.bool_)


def enum_cell(bits: int, names: tuple[str, ...]) -> str:
    """The text of an enum cell that accepts the values whose bits are set."""
    if bits == (1 << len(names)) - 1:
        return "Any"
    return " ".join(name for j, name in enumerate(names) if bits >> j & 1)


def make_table(shape: Shape, seed: int = 7) -> GameTable:
    """A table of the given shape."""
    rng = np.random.default_rng(seed)
    values = tuple(tuple(f"value_{i}_{j}" for j in range(rng.integers(8, 13))) for i in range(shape.n_enums))
    size = shape.n_rows
    bools = np.where(rng.random((shape.n_bools, size)) < ANY_SHARE, 3, rng.integers(1, 3, (shape.n_bools, size)))
    enums = np.array([_enum_column(rng, size, len(names)) for names in values])
    middle = rng.random((shape.n_numbers, size)) * 100
    reach = 2 + rng.random((shape.n_numbers, size)) * 23
    is_any = rng.random((shape.n_numbers, size)) < ANY_SHARE
    lows = np.where(is_any, -np.inf, np.round((middle - reach) / GRID) * GRID)
    highs = np.where(is_any, np.inf, np.round((middle + reach) / GRID) * GRID)
    return GameTable(shape, bools.astype(np.uint16), enums.astype(np.uint16), lows, highs, values)


def _enum_column(rng: np.random.Generator, n_rows: int, n_values: int) -> NDArray[np.int64]:
    rank = rng.random((n_rows, n_values)).argsort(axis=1).argsort(axis=1)
    named = ((rank < rng.integers(1, 5, n_rows)[:, None]) << np.arange(n_values)).sum(axis=1)
    return np.where(rng.random(n_rows) < ANY_SHARE, (1 << n_values) - 1, named)


def make_contexts(table: GameTable, n: int, seed: int = 3) -> Contexts:
    """Contexts for a table."""
    rng = np.random.default_rng(seed)
    shape = table.shape
    bools = rng.integers(0, 2, (n, shape.n_bools))
    enums = np.stack([rng.integers(0, len(names), n) for names in table.values], axis=1)
    numbers = np.round(rng.random((n, shape.n_numbers)) * 100, 3)
    planted = np.flatnonzero(rng.random(n) < 0.5)
    rows = rng.integers(0, shape.n_rows, len(planted))
    wanted = table.bools[:, rows].T
    bools[planted] = np.where(wanted == 3, bools[planted], wanted - 1)
    for i, names in enumerate(table.values):
        accepted = (table.enums[i, rows][:, None] >> np.arange(len(names))) & 1
        enums[planted, i] = (rng.random(accepted.shape) * accepted).argmax(axis=1)
    lows, highs = table.lows[:, rows].T, table.highs[:, rows].T
    is_any = np.isinf(lows)
    within = rng.uniform(np.where(is_any, 0, lows), np.where(is_any, 1, highs))
    numbers[planted] = np.where(is_any, numbers[planted], within)
    return Contexts(table, bools, enums, numbers)
