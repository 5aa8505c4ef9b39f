"""Made tables for the coverage benchmark: families of assets that share the conditions they ask for, in three shapes.

    few      the families pin few conditions, seldom the same ones
    tree     nearly every row pins an action, and its family's conditions under it
    many     12 to 17 cells in each row

A fifth of the conditions are numbers (tiles with tolerance), a quarter enums, the rest bools; conditions are chosen with Zipf skew.
"""

from __future__ import annotations

from typing import Any

import numpy as np

import contextdb as cdb

SHAPES = ("few", "tree", "many")
SIZES = ((17, 9), (100, 20), (1_000, 30), (5_000, 40), (20_000, 60))
GRID = 72
SKEW = 0.8


def made_table(shape: str, n_rows: int, n_conditions: int, seed: int = 1) -> cdb.Table:
    """A table of the given shape and size; the same for the same seed."""
    rng = np.random.default_rng(seed)
    schema = _schema(shape, n_rows, n_conditions, rng)
    names = list(schema)
    cells = {name: ["Any"] * n_rows for name in names}
    row = 0
    while row < n_rows:
        stop = min(n_rows, row + int(rng.integers(3, 16)))
        _add_family(cells, schema, shape, range(row, stop), rng)
        row = stop
    columns = {"Asset": [f"Anim_{r:05}" for r in range(n_rows)], **cells}
    return cdb.Table.from_columns(columns, schema, name=f"{shape} {n_rows}x{n_conditions}")


def _schema(shape: str, n_rows: int, n_conditions: int, rng: np.random.Generator) -> dict[str, dict[str, Any]]:
    n_numbers, n_enums = max(2, n_conditions // 5), max(2, n_conditions // 4)
    n_actions = max(4, min(40, n_rows // 12)) if shape == "tree" else 6
    sizes = [n_actions, *(int(rng.integers(3, 11)) for _ in range(n_enums - 1))]
    schema: dict[str, dict[str, Any]] = {
        f"enum_{i}": {"type": "enum", "values": [f"v{k}" for k in range(n)]} for i, n in enumerate(sizes)
    }
    schema |= {f"is_{i}": {"type": "bool"} for i in range(n_conditions - n_numbers - n_enums)}
    return schema | {f"number_{i}": {"type": "number", "min": 0.0, "max": float(GRID)} for i in range(n_numbers)}


def _add_family(
    cells: dict[str, list[str]], schema: dict[str, dict[str, Any]], shape: str, rows: range, rng: np.random.Generator
) -> None:
    action = f"v{int(rng.integers(len(schema['enum_0']['values'])))}"
    chance = {"tree": 0.97, "few": 0.3, "many": 0.5}[shape]
    templates = {name: _template(schema[name], rng) for name in _chosen(schema, shape, rng)}
    for row in rows:
        if rng.random() < chance:
            cells["enum_0"][row] = action
        for name, template in templates.items():
            if rng.random() < 0.85:
                cells[name][row] = _cell(schema[name], template, rng)


def _chosen(schema: dict[str, dict[str, Any]], shape: str, rng: np.random.Generator) -> list[str]:
    """The conditions that a family asks for."""
    most = (
        {"bool": (2, 6), "enum": (1, 4), "number": (1, 4)}
        if shape != "many"
        else {"bool": (6, 11), "enum": (3, 6), "number": (3, 6)}
    )
    found: list[str] = []
    for kind, (low, high) in most.items():
        names = [n for n, facts in schema.items() if facts["type"] == kind and n != "enum_0"]
        weights = 1.0 / np.arange(1, len(names) + 1) ** SKEW
        n = min(len(names), int(rng.integers(low, high)))
        found += rng.choice(names, n, replace=False, p=weights / weights.sum()).tolist()
    return found


def _template(facts: dict[str, Any], rng: np.random.Generator) -> Any:
    """What the cells of one family have in common: a truth, some values, or how many tiles."""
    if facts["type"] == "bool":
        return bool(rng.random() < 0.5)
    if facts["type"] == "enum":
        n = min(len(facts["values"]) - 1, int(rng.integers(1, 5)))
        return " ".join(rng.choice(facts["values"], n, replace=False).tolist())
    return int(rng.integers(2, 5))


def _cell(facts: dict[str, Any], template: Any, rng: np.random.Generator) -> str:
    if facts["type"] == "bool":
        return str(template if rng.random() < 0.8 else not template)
    if facts["type"] == "enum":
        return str(template)
    step, tile, tolerance = GRID / template, int(rng.integers(template)), int(rng.integers(4))
    low, high = max(0, round(tile * step) - tolerance), min(GRID, round((tile + 1) * step) + tolerance)
    return f"{low}..{high}" if high == GRID else f"[{low}..{high})"
