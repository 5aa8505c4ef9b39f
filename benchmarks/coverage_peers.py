"""What the coverage benchmark compares with: decision diagrams of the `dd` package, and tables of published sizes.

The published sizes are those of Calvanese, Dumas, Laurson, Maggi, Montali and Teinemaa, "Semantics, analysis and simplification of
DMN decision tables" (Information Systems 78, 2018): 3, 5 and 7 numeric columns, 500, 1,000 and 1,500 rows, a tenth of them noise.
"""

from __future__ import annotations

import importlib
import time
from typing import Any

import numpy as np

import contextdb as cdb
from contextdb.compiled.table import data_of
from contextdb.covering.count import uncovered_share
from contextdb.covering.gaps import find_gaps
from contextdb.covering.space import Box, Space
from contextdb.covering.witness import BoxSet

MOST_S = 20.0
PUBLISHED = tuple((n_columns, n_rows) for n_columns in (3, 5, 7) for n_rows in (500, 1000, 1500))
NOISE = 0.1
MANY = 10**9
GAP_STEPS = 4_000_000


def diagrams() -> tuple[str, Any] | None:
    """The quickest decision diagrams that are installed, and their name."""
    for name in ("dd.cudd", "dd.autoref"):
        try:
            return name, importlib.import_module(name)
        except ImportError:
            continue
    return None


def diagram_of(space: Space, module: Any) -> str:
    """How long the diagram of all rows takes, and its size; how far it came when it takes too long."""
    manager, start = module.BDD(), time.perf_counter()
    bits = [max(1, (len(f.weights) - 1).bit_length()) for f in space.factors]
    manager.declare(*(f"x{f}_{b}" for f, n in enumerate(bits) for b in range(n)))
    known: dict[tuple[int, int], Any] = {}
    union = manager.false
    for i, box in enumerate(space.boxes):
        union |= _row(manager, space, box, bits, known)
        if time.perf_counter() - start > MOST_S:
            return f"{i + 1} of {len(space.boxes)} rows after {MOST_S:.0f} s"
    return f"{time.perf_counter() - start:.3f} s, {union.dag_size if hasattr(union, 'dag_size') else len(manager):,} nodes"


def _row(manager: Any, space: Space, box: Box, bits: list[int], known: dict[tuple[int, int], Any]) -> Any:
    row = manager.true
    for f, side in enumerate(box):
        if side == space.full[f]:
            continue
        if (f, side) not in known:
            cell = manager.false
            for k in range(len(space.factors[f].weights)):
                if side >> k & 1:
                    cell |= manager.cube({f"x{f}_{b}": bool(k >> b & 1) for b in range(bits[f])})
            known[f, side] = cell
        row &= known[f, side]
    return row


def published_table(n_columns: int, n_rows: int, seed: int = 1) -> cdb.Table:
    """Rows that part the space between them, a tenth of which have one cell moved."""
    rng = np.random.default_rng(seed)
    boxes = [[(0, 10_000)] * n_columns]
    while len(boxes) < n_rows:
        largest = max(range(len(boxes)), key=lambda i: _size(boxes[i]))
        box = boxes.pop(largest)
        at = int(rng.choice([c for c in range(n_columns) if box[c][1] - box[c][0] > 1]))
        cut = int(rng.integers(box[at][0] + 1, box[at][1]))
        boxes += [[*box[:at], (box[at][0], cut), *box[at + 1 :]], [*box[:at], (cut, box[at][1]), *box[at + 1 :]]]
    for i in rng.choice(n_rows, int(NOISE * n_rows), replace=False).tolist():
        at = int(rng.integers(n_columns))
        low, high = sorted(rng.choice(10_001, 2, replace=False).tolist())
        boxes[i][at] = (low, high)
    cells = {f"c{c}": [f"[{b[c][0]}..{b[c][1]}{']' if b[c][1] == 10_000 else ')'}" for b in boxes] for c in range(n_columns)}
    schema = {name: {"type": "number", "min": 0.0, "max": 10_000.0} for name in cells}
    name = f"{n_columns} columns {n_rows:,} rows"
    return cdb.Table.from_columns({"Asset": [f"r{i}" for i in range(n_rows)], **cells}, schema, name=name)


def _size(box: list[tuple[int, int]]) -> float:
    return float(np.prod([float(high - low) for low, high in box]))


def published_figures(n_columns: int, n_rows: int) -> dict[str, Any]:
    """Every overlap and gap of a table of a published size, and how long they take."""
    table = published_table(n_columns, n_rows)
    compiled = data_of(table.compile())
    start = time.perf_counter()
    space = Space.of(compiled)
    rows = BoxSet.of(space.full, space.boxes)
    n_overlaps = sum(_n_overlapping(rows, i, box) for i, box in enumerate(space.boxes))
    overlaps_s, start = time.perf_counter() - start, time.perf_counter()
    left = uncovered_share(space, space.boxes, MANY)
    count_s, start = time.perf_counter() - start, time.perf_counter()
    found = find_gaps(space, (), 20_000, GAP_STEPS)
    return {
        "table": table.name,
        "overlaps": n_overlaps,
        "overlaps_s": overlaps_s,
        "covered": 1.0 - left.upper,
        "is_exact": left.is_exact,
        "count_s": count_s,
        "gaps": len(found.boxes),
        "gaps_complete": found.is_complete,
        "gaps_s": time.perf_counter() - start,
    }


def _n_overlapping(rows: BoxSet, i: int, box: Box) -> int:
    """How many rows before row i share a context with it."""
    others = (1 << i) - 1
    for f, side in enumerate(box):
        others &= rows.meeting(f, side)
    return others.bit_count()
