"""Outputs and ways as tensors of a compiled file, and back; see `contextdb.compiled.artefact` for their names."""

from __future__ import annotations

import json
import math
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from contextdb.cells.output_types import OUTPUT_TYPES, OutputValue
from contextdb.cells.outputs import Output
from contextdb.columns import TextColumn
from contextdb.compiled.layers import Layers
from contextdb.compiled.outputs import NO_OUTPUTS, OutputCells, Outputs
from contextdb.compiled.pick_columns import PickColumns
from contextdb.compiled.ways import Ways, WayTable
from contextdb.files.tensors import Tensors, texts_from_array, texts_to_array
from contextdb.schema.policies import POLICIES, Policy

DECLARED, PLAYS = "outputs.declared", "outputs.plays"
"""What is declared of outputs; and how rows play, for the header of games: float64 [R + 1, 8]."""


def outputs_to_tensors(outputs: Outputs) -> Tensors:
    """The arrays of outputs, and what is declared of them; nothing for a table without."""
    if not len(outputs):
        return {}
    declared = json.dumps(list(map(_output_to_json, outputs.declared)), ensure_ascii=False)
    tensors: Tensors = {DECLARED: np.frombuffer(declared.encode("utf-8", "surrogatepass"), np.uint8)}
    for at, cells in enumerate(outputs.cells):
        if isinstance(cells, TextColumn):
            tensors[f"outputs.{at:03d}.codes"] = cells.codes
            tensors[f"outputs.{at:03d}.texts"] = texts_to_array(list(cells.texts))
        else:
            tensors[f"outputs.{at:03d}.values"] = cells.view(np.uint8) if cells.dtype == np.bool_ else cells
    return tensors if outputs.plays is None else {**tensors, PLAYS: np.array(outputs.plays)}


def outputs_from(tensors: Tensors, n_rows: int) -> Outputs:
    """The outputs of a compiled file with so many rows; ValueError for arrays of other shapes or types."""
    if DECLARED not in tensors:
        return NO_OUTPUTS
    declared = tuple(map(_output, json.loads(tensors[DECLARED].tobytes().decode("utf-8", "surrogatepass"))))
    cells = (_cells(output, f"outputs.{at:03d}", tensors, n_rows) for at, output in enumerate(declared))
    outputs = Outputs(declared, tuple(cells))
    _ = outputs.plays  # what cannot be read is refused here
    return outputs


def _output_to_json(output: Output) -> dict[str, object]:
    return {
        "name": output.name,
        "type": output.kind,
        "default": _to_json(output.default),
        "bounds": [bound if math.isfinite(bound) else None for bound in (output.minimum, output.maximum)],
        "values": output.values,
        "size": output.size,
        "unit": output.unit,
        "description": output.description,
    }


def _output(about: dict[str, Any]) -> Output:
    if about["type"] not in OUTPUT_TYPES:
        raise ValueError(about["type"])
    low, high = about["bounds"]
    bare = Output(
        about["name"],
        about["type"],
        None,
        -math.inf if low is None else low,
        math.inf if high is None else high,
        tuple(about["values"]),
        about["size"],
        about["unit"],
        about["description"],
    )
    return bare if about["default"] is None else replace(bare, default=_from_json(bare, about["default"]))


def _cells(output: Output, prefix: str, tensors: Tensors, n_rows: int) -> OutputCells:
    if output.type.is_text:
        texts, codes = texts_from_array(tensors[f"{prefix}.texts"]), tensors[f"{prefix}.codes"]
        if codes.shape != (n_rows + 1,) or codes.dtype != np.int32 or codes.min() < 0 or codes.max() >= len(texts):
            raise ValueError(prefix)
        return TextColumn(output.name, tuple(texts), codes)
    values, wanted = tensors[f"{prefix}.values"], output.array([])
    if wanted.dtype == np.bool_ and values.dtype == np.uint8 and values.max() <= 1:
        values = values.view(np.bool_)
    if values.shape != (n_rows + 1, *wanted.shape[1:]) or values.dtype != wanted.dtype:
        raise ValueError(prefix)
    return values


def _to_json(value: OutputValue | None) -> object:
    """A value as JSON has it, infinite numbers as texts."""
    if isinstance(value, tuple):
        return [_to_json(number) for number in value]
    return str(value) if isinstance(value, float) and math.isinf(value) else value


def _from_json(output: Output, value: Any) -> OutputValue:
    if not output.type.is_numeric:
        return output.taken(value)
    return output.taken([_number(part) for part in value] if isinstance(value, list) else _number(value))


def _number(value: Any) -> Any:
    return float(value) if isinstance(value, str) else value


# ---- ways


def ways_to_tensors(ways: Ways) -> Tensors:
    """The arrays of ways, as `contextdb.compiled.artefact` names them."""
    tensors: Tensors = {"ways.numbers": ways.numbers, "ways.rows": ways.rows, "ways.leaves": texts_to_array(list(ways.leaves))}
    for at, table in enumerate(ways.tables):
        lines = [-1 if (line := table.place(row).line) is None else line for row in range(len(table.priorities))]
        tensors[f"ways.{at:03d}.priorities"] = table.priorities
        tensors[f"ways.{at:03d}.ranks"] = table.ranks
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


def policy_to_json(policy: Policy) -> dict[str, object]:
    """A policy by name, and how it picks."""
    return {"policy": policy, "choose": POLICIES[policy].choose, "by_cost": POLICIES[policy].by_cost}


def known_policy(name: Any) -> Policy:
    """A policy that was written. Raises ValueError for one that this version does not know."""
    if name not in POLICIES:
        raise ValueError(name)
    return str(name)


def ways_to_json(ways: Ways) -> list[dict[str, object]]:
    """What of each table is no array. Of its path only the file's name is kept: the folder is that of one machine."""
    files = [None if t.file is None else t.file.replace("\\", "/").rpartition("/")[2] for t in ways.tables]
    described: list[dict[str, object]] = []
    for table, file in zip(ways.tables, files, strict=True):
        described.append({"name": table.name, "file": file, **policy_to_json(table.policy)})
        if table.when is not None:
            described[-1]["when"] = table.when
    return described


def ways_from(about: list[dict[str, Any]], tensors: Tensors, n_conditions: int) -> Ways:
    """The ways that were written; raises KeyError or ValueError where parts are missing or unknown."""
    tables = []
    for at, table in enumerate(about):
        priorities, weights, lines = (tensors[f"ways.{at:03d}.{part}"] for part in ("priorities", "row_weights", "lines"))
        when, picking = table.get("when"), PickColumns.of(partial(_of_table, tensors, at))
        policy = known_policy(table["policy"])
        tables.append(WayTable(table["name"], table["file"], policy, priorities, weights, lines, None, when, picking))
    layers = tuple(_layers(tensors, f"{at:03d}") for at in range(n_conditions))
    leaves = texts_from_array(tensors["ways.leaves"])
    return Ways(tuple(tables), tensors["ways.numbers"], tensors["ways.rows"], leaves, layers, _layers(tensors, "when"))


def _of_table(tensors: Tensors, at: int, name: str) -> NDArray[Any] | None:
    return tensors.get(f"ways.{at:03d}.{name}")


def _layers(tensors: Tensors, prefix: str) -> Layers | None:
    if f"{prefix}.layers" not in tensors:
        return None
    return Layers(tuple(texts_from_array(tensors[f"{prefix}.said"])), tensors[f"{prefix}.layers"])
