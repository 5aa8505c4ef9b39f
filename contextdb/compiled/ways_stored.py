"""Ways as tensors of a compiled file, and back; see `contextdb.compiled.artefact` for their names."""

from __future__ import annotations

from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from contextdb.compiled.layers import Layers
from contextdb.compiled.pick_columns import PickColumns
from contextdb.compiled.ways import Ways, WayTable
from contextdb.files.tensors import Tensors, texts_from_array, texts_to_array


def ways_to_tensors(ways: Ways) -> Tensors:
    """The arrays of ways."""
    tensors: Tensors = {"ways.numbers": ways.numbers, "ways.rows": ways.rows, "ways.leaves": texts_to_array(list(ways.leaves))}
    for at, table in enumerate(ways.tables):
        lines = [-1 if (line := table.place(row).line) is None else line for row in range(len(table.priorities))]
        tensors[f"ways.{at:03d}.priorities"] = table.priorities
        tensors[f"ways.{at:03d}.row_weights"] = table.row_weights
        tensors[f"ways.{at:03d}.lines"] = np.array(lines, np.int64)
        tensors |= {f"ways.{at:03d}.{name}": array for name, array in table.picking.arrays.items()}
    for at, layers in enumerate(ways.layers):
        if layers is None:
            continue
        tensors[f"{at:03d}.layers"] = layers.codes
        tensors[f"{at:03d}.said"] = texts_to_array(list(layers.texts))
    if ways.rules is not None:
        tensors |= {"when.layers": ways.rules.codes, "when.said": texts_to_array(list(ways.rules.texts))}
    return tensors


def ways_to_json(ways: Ways) -> list[dict[str, object]]:
    """What of each table is no array. Of its path only the file's name is kept: the folder is that of one machine."""
    files = [None if t.file is None else t.file.replace("\\", "/").rpartition("/")[2] for t in ways.tables]
    told: list[dict[str, object]] = []
    for table, file in zip(ways.tables, files, strict=True):
        told.append({"name": table.name, "file": file, "policy": table.policy})
        if table.when is not None:
            told[-1]["when"] = table.when
    return told


def ways_from(about: list[dict[str, Any]], tensors: Tensors, n_conditions: int) -> Ways:
    """The ways of a compiled file with so many conditions."""
    tables = []
    for at, table in enumerate(about):
        priorities, weights, lines = (tensors[f"ways.{at:03d}.{part}"] for part in ("priorities", "row_weights", "lines"))
        when, picking = table.get("when"), PickColumns.of(partial(_of_table, tensors, at))
        tables.append(WayTable(table["name"], table["file"], table["policy"], priorities, weights, lines, None, when, picking))
    layers = tuple(_layers(tensors, f"{at:03d}") for at in range(n_conditions))
    leaves = texts_from_array(tensors["ways.leaves"])
    return Ways(tuple(tables), tensors["ways.numbers"], tensors["ways.rows"], leaves, layers, _layers(tensors, "when"))


def _of_table(tensors: Tensors, at: int, name: str) -> NDArray[Any] | None:
    return tensors.get(f"ways.{at:03d}.{name}")


def _layers(tensors: Tensors, prefix: str) -> Layers | None:
    if f"{prefix}.layers" not in tensors:
        return None
    return Layers(tuple(texts_from_array(tensors[f"{prefix}.said"])), tensors[f"{prefix}.layers"])
