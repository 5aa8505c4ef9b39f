"""Many contexts at once: a frame of facts in, counts and hits out.

Counts are the valid rows of each context, int64 [N]; hits the contexts in which each row is valid, int64 [R]. Encoding is part of
the work everywhere but in DuckDB's join, which gets its contexts as bit sets, ready made.
"""

from __future__ import annotations

import os
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
import polars as pl
from numpy.typing import NDArray

from benchmarks.generator import Contexts, GameTable
from benchmarks.peers import table_frame
from benchmarks.yardsticks import BitVectors

Answer = tuple[NDArray[np.int64], NDArray[np.int64]]
BLOCK = 4096


@dataclass(frozen=True)
class Batch:
    """An engine for batches: `ask()` answers the first `n` contexts."""

    name: str
    n: int
    ask: Callable[[], Answer]


def reference(contexts: Contexts) -> Answer:
    """The answer by comparing every cell of every row with every context; slow."""
    answers = contexts.answers()
    rows = np.array([r for rows in answers for r in rows], np.int64)
    return np.array([len(a) for a in answers], np.int64), np.bincount(rows, minlength=contexts.table.shape.n_rows)


def encode_frame(vectors: BitVectors, frame: pl.DataFrame) -> NDArray[np.int32]:
    """Codes of a frame whose enums are polars Enums or texts, a column at a time: int32 [N, C]."""
    table = vectors.table
    codes = np.empty((frame.height, table.shape.n_columns), np.int32)
    names = zip(table.enum_names, table.values, strict=True)
    columns = [frame[n].cast(pl.Int32).to_numpy() for n in table.bool_names]
    columns += [frame[n].cast(pl.Enum(values)).to_physical().to_numpy() for n, values in names]
    columns += [np.searchsorted(b, frame[n].to_numpy(), "right") for n, b in zip(table.number_names, vectors.bounds, strict=True)]
    for j, column in enumerate(columns):
        codes[:, j] = column
    codes += vectors.starts[:-1].astype(np.int32)
    return codes


def numpy_masks(vectors: BitVectors, frame: pl.DataFrame) -> Callable[[], Answer]:
    """Encode, then take and AND masks with numpy, in blocks that stay in the cache."""

    def ask() -> Answer:
        codes, masks = encode_frame(vectors, frame), vectors.masks
        counts = np.empty(len(codes), np.int64)
        hits = np.zeros(masks.shape[1] * 64, np.int64)
        for start in range(0, len(codes), BLOCK):
            part = codes[start : start + BLOCK]
            found = masks[part[:, 0]]
            for j in range(1, part.shape[1]):
                found &= masks[part[:, j]]
            counts[start : start + len(part)] = np.bitwise_count(found).sum(axis=1, dtype=np.int64)
            context, word = np.nonzero(found)
            bits = np.unpackbits(found[context, word].view(np.uint8).reshape(-1, 8), axis=1, bitorder="little")
            at, bit = np.nonzero(bits)
            np.add.at(hits, word[at] * 64 + bit, 1)
        return counts, hits[: vectors.table.shape.n_rows]

    return ask


def unfused_kernel(vectors: BitVectors, frame: pl.DataFrame) -> Callable[[], Answer]:
    """Encode, then AND with the same loop order as contextdb's kernel, on every core."""
    from benchmarks.kernels import counts_and_hits

    def ask() -> Answer:
        codes = encode_frame(vectors, frame)
        counts = np.empty(len(codes), np.int64)
        hits = np.zeros((os.cpu_count() or 1, vectors.masks.shape[1] * 64), np.int64)
        counts_and_hits(vectors.masks, codes, counts, hits)
        return counts, hits.sum(axis=0)[: vectors.table.shape.n_rows]

    return ask


def duckdb_join(table: GameTable, contexts: Contexts) -> Callable[[], Answer]:
    """A join of contexts and rows on every core; both sides stand in its memory beforehand."""
    import duckdb

    connection = duckdb.connect()
    connection.register("rules_frame", _as_bit_sets(table).to_arrow())
    connection.execute("CREATE TABLE rules AS SELECT * FROM rules_frame")
    connection.register("contexts_frame", _contexts_as_bits(contexts).to_arrow())
    connection.execute("CREATE TABLE contexts AS SELECT * FROM contexts_frame")
    tests = [f"(r.{n} & c.{n}) <> 0" for n in table.bool_names + table.enum_names]
    tests += [f"r.{n}_low <= c.{n} AND r.{n}_high >= c.{n}" for n in table.number_names]
    join = f"SELECT c.id, r.row FROM contexts c JOIN rules r ON {' AND '.join(tests)}"

    def ask() -> Answer:
        found = connection.execute(join).fetchnumpy()
        return np.bincount(found["id"], minlength=len(contexts)), np.bincount(found["row"], minlength=table.shape.n_rows)

    return ask


def _as_bit_sets(table: GameTable) -> pl.DataFrame:
    sets = zip(table.bool_names, table.bools, strict=True)
    return table_frame(table).with_columns(pl.Series(n, column.astype(np.int32)) for n, column in sets)


def _contexts_as_bits(contexts: Contexts) -> pl.DataFrame:
    table = contexts.table
    columns: dict[str, Any] = {"id": np.arange(len(contexts))}
    sets = np.concatenate([contexts.bools, contexts.enums], axis=1).T
    columns |= {n: (1 << j).astype(np.int32) for n, j in zip(table.bool_names + table.enum_names, sets, strict=True)}
    return pl.DataFrame(columns | dict(zip(table.number_names, contexts.numbers.T, strict=True)))
