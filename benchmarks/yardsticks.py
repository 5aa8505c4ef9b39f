"""The bitmask scheme in its simplest forms, kept as yardsticks: what contextdb is measured against, written without it.

`BitVectors` cuts each condition into classes and stacks a mask for each in one array. The designs differ in how they AND them:
numpy, Python integers looked up one by one ("h"), Python integers in one generated function with merged columns ("h4"), or
Roaring bitmaps.

M masks (classes of all columns), W words of 64 rows, C columns, N contexts.
"""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property, reduce
from itertools import product
from operator import and_, itemgetter
from typing import Any

import numpy as np
from numpy.typing import NDArray

from benchmarks.generator import Contexts, GameTable

Ask = Callable[[dict[str, Any]], Any]

MERGED_BOOLS, MERGED_ENUMS = 6, 2


@dataclass(frozen=True)
class BitVectors:
    """The masks of a table: bools first, then enums, then numbers.

    masks uint64 [M, W]; column j has masks starts[j] up to starts[j + 1]; class k of number column i holds the numbers from
    bounds[i][k - 1] up to, not including, bounds[i][k].
    """

    table: GameTable
    masks: NDArray[np.uint64]
    starts: NDArray[np.int64]
    bounds: tuple[NDArray[np.float64], ...]

    @classmethod
    def of(cls, table: GameTable) -> BitVectors:
        """Compile a table."""
        bounds = tuple(_bounds(low, high) for low, high in zip(table.lows, table.highs, strict=True))
        flags = [(column[None] >> np.arange(2)[:, None]) & 1 for column in table.bools]
        flags += [(column[None] >> np.arange(len(v))[:, None]) & 1 for column, v in zip(table.enums, table.values, strict=True)]
        parts = [_pack(f.astype(bool)) for f in flags]
        parts += [_number_masks(low, high, b) for low, high, b in zip(table.lows, table.highs, bounds, strict=True)]
        return cls(table, np.concatenate(parts), np.cumsum([0, *(len(p) for p in parts)]), bounds)

    @cached_property
    def ints(self) -> list[int]:
        """Each mask as a Python integer."""
        return [int.from_bytes(m.tobytes(), "little") for m in self.masks]

    @cached_property
    def value_maps(self) -> list[tuple[str, dict[Any, int]]]:
        """For each bool and enum column its name, and the number of the mask of each value."""
        table = self.table
        values: list[Sequence[Any]] = [(False, True)] * len(table.bools) + list(table.values)
        starts = self.starts.tolist()
        names = table.bool_names + table.enum_names
        return [(n, {v: s + j for j, v in enumerate(vs)}) for n, vs, s in zip(names, values, starts[: len(names)], strict=True)]

    @cached_property
    def number_maps(self) -> list[tuple[str, list[float], int, int]]:
        """For each number column its name, its bounds, and the numbers of its first and past its last mask."""
        starts = self.starts.tolist()[-len(self.bounds) - 1 :]
        return [
            (n, b.tolist(), *pair) for n, b, *pair in zip(self.table.number_names, self.bounds, starts, starts[1:], strict=False)
        ]

    def encode(self, contexts: Contexts) -> NDArray[np.int32]:
        """The masks of every context: int32 [N, C]."""
        numbers = [np.searchsorted(b, x, "right") for b, x in zip(self.bounds, contexts.numbers.T, strict=True)]
        local = np.column_stack([contexts.bools, contexts.enums, *numbers])
        return (local + self.starts[:-1]).astype(np.int32)


def _bounds(lows: NDArray[np.float64], highs: NDArray[np.float64]) -> NDArray[np.float64]:
    """Where a column's answers may change: at each low bound, and at the first number after each high bound."""
    bounds: NDArray[np.float64] = np.unique(np.concatenate([lows, np.nextafter(highs, np.inf)]))
    finite: NDArray[np.float64] = bounds[np.isfinite(bounds)]
    return finite


def _number_masks(lows: NDArray[np.float64], highs: NDArray[np.float64], bounds: NDArray[np.float64]) -> NDArray[np.uint64]:
    numbers = np.concatenate([[-np.inf], bounds])[:, None]
    masks = _pack((lows <= numbers) & (numbers <= highs))
    masks[0] = _pack((lows == -np.inf)[None])[0]
    return masks


def _pack(flags: NDArray[np.bool_]) -> NDArray[np.uint64]:
    """Bool [M, R] to uint64 [M, W]."""
    octets = np.zeros((len(flags), (flags.shape[1] + 63) // 64 * 8), np.uint8)
    packed = np.packbits(flags, axis=1, bitorder="little")
    octets[:, : packed.shape[1]] = packed
    return octets.view(np.uint64)


def rows_of(bits: int) -> list[int]:
    """The rows of a mask that is a Python integer."""
    rows = []
    while bits:
        low = bits & -bits
        rows.append(low.bit_length() - 1)
        bits ^= low
    return rows


def encoder(vectors: BitVectors) -> Callable[[dict[str, Any]], list[int]]:
    """From a context to the numbers of its masks, by dicts and bisection."""
    values, numbers = vectors.value_maps, vectors.number_maps

    def encode(context: dict[str, Any]) -> list[int]:
        found = [masks[context[name]] for name, masks in values]
        return found + [first + bisect_right(bounds, context[name]) for name, bounds, first, _ in numbers]

    return encode


def numpy_masks(vectors: BitVectors) -> Ask:
    """AND with numpy."""
    encode, masks, intersect = encoder(vectors), vectors.masks, np.bitwise_and.reduce

    def ask(context: dict[str, Any]) -> NDArray[np.int64]:
        found = intersect(masks[encode(context)], axis=0)
        return np.flatnonzero(np.unpackbits(found.view(np.uint8), bitorder="little"))

    return ask


def big_ints(vectors: BitVectors) -> Ask:
    """Python integers, found through a dict or a bisection for each condition ("h")."""
    ints = vectors.ints
    values = [(name, {v: ints[k] for v, k in masks.items()}) for name, masks in vectors.value_maps]
    numbers = [(name, bounds, ints[first:stop]) for name, bounds, first, stop in vectors.number_maps]

    def ask(context: dict[str, Any]) -> list[int]:
        found = -1
        for name, by_value in values:
            found &= by_value[context[name]]
        for name, bounds, by_class in numbers:
            found &= by_class[bisect_right(bounds, context[name])]
        return rows_of(found) if found else []

    return ask


def generated_code(vectors: BitVectors) -> Ask:
    """Python integers in one generated function, bools merged by six and enums by two ("h4")."""
    names: dict[str, Any] = {"bisect_right": bisect_right, "rows_of": rows_of}
    value_terms, number_terms = [], []
    for k, (key, by_values) in enumerate(_merged(vectors)):
        names[f"key{k}"], names[f"merged{k}"] = key, by_values
        value_terms.append(f"merged{k}[key{k}(context)]")
    for i, (name, bounds, first, stop) in enumerate(vectors.number_maps):
        names[f"bounds{i}"], names[f"by_class{i}"] = bounds, vectors.ints[first:stop]
        number_terms.append(f"by_class{i}[bisect_right(bounds{i}, context[{name!r}])]")
    lines = [
        "def ask(context):",
        f"    found = {' & '.join(value_terms)}",
        "    if not found: return []",
        f"    found &= {' & '.join(number_terms)}",
        "    return rows_of(found) if found else []",
    ]
    exec("\n".join(lines), names)
    ask: Ask = names["ask"]
    return ask


def _merged(vectors: BitVectors) -> list[tuple[Any, dict[Any, int]]]:
    """Groups of value columns: what takes their facts out of a context, and the mask of each combination."""
    n_bools, maps = len(vectors.table.bools), vectors.value_maps
    groups = [maps[i : min(i + MERGED_BOOLS, n_bools)] for i in range(0, n_bools, MERGED_BOOLS)]
    groups += [maps[i : i + MERGED_ENUMS] for i in range(n_bools, len(maps), MERGED_ENUMS)]
    return [(itemgetter(*(name for name, _ in group)), _combinations(vectors.ints, [m for _, m in group])) for group in groups]


def _combinations(ints: list[int], group: list[dict[Any, int]]) -> dict[Any, int]:
    found = {}
    for values in product(*group):
        masks = [ints[by_value[v]] for by_value, v in zip(group, values, strict=True)]
        found[values if len(values) > 1 else values[0]] = reduce(and_, masks)
    return found


def roaring(vectors: BitVectors) -> Ask:
    """Roaring bitmaps, the most selective columns first, stopping when none is left."""
    from pyroaring import BitMap

    flags = np.unpackbits(vectors.masks.view(np.uint8), axis=1, bitorder="little")
    bitmaps = [BitMap(np.flatnonzero(f).astype(np.uint32)) for f in flags]
    for bitmap in bitmaps:
        bitmap.run_optimize()
    sizes = flags.sum(axis=1)
    mean = [sizes[a:b].mean() for a, b in zip(vectors.starts, vectors.starts[1:], strict=False)]
    order = np.argsort(mean).tolist()
    encode = encoder(vectors)

    def ask(context: dict[str, Any]) -> list[int]:
        masks = encode(context)
        found = bitmaps[masks[order[0]]] & bitmaps[masks[order[1]]]
        for i in order[2:]:
            found &= bitmaps[masks[i]]
            if not found:
                return []
        return list(found)

    return ask
