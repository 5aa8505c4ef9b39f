"""The compiled file for the game: .safetensors, opened by memory map, never pickle.

Tensors, R rows, W = ceil(R / 64) words, C conditions; every integer and double little-endian, every mask as in `contextdb.bitmask`:

    enabled                uint64 [W]            rows that may match
    priorities             int64 [R]
    row_weights            float64 [R]
    assets                 uint8                 JSON list of R texts
    CCC.FIELD              as in contextdb.classes, for condition number CCC: `masks` (and `bounds`), or `low`, `high`, `any_mask`
    CCC.codes              int32 [R]             which of the distinct texts each row holds
    CCC.texts              uint8                 JSON list of the distinct texts
    slots.CCC.codes        as CCC.codes and CCC.texts, for the columns of slots, named in `about`
    slots.CCC.texts
    CCC.soft.FIELD         the same for soft cells, and CCC.soft.penalties float64 [R]

The metadata hold `contextdb` (the version of this layout), `about` (JSON: name, policy, fallback, conditions and the kind of each
column; where facts are derived also the conditions that they are computed from) and `digest`, BLAKE2b-128 of `about` and of all
tensors in the order of their names. Opening checks all of it.
"""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import TYPE_CHECKING, Any

from contextdb.cells import TagSet
from contextdb.classes import ColumnMasks, NumberMasks, TagMasks, ValueMasks, WideMasks
from contextdb.columns import TextColumn
from contextdb.compiled import CompiledTable, SoftMasks
from contextdb.conditions import Condition
from contextdb.domains import Domain
from contextdb.schema import Schema
from contextdb.tensors import SUFFIX, FileKind, Tensors, digest_of, read_tensors, texts_from_array, texts_to_array, write_tensors

if TYPE_CHECKING:
    from contextdb.expressions import Derivation

__all__ = ["SUFFIX", "open_artefact", "save"]

COMPILED = FileKind(
    "contextdb", 1, "one that contextdb compiled", "a file that this version of contextdb compiled", "to compile the table again"
)


def save(compiled: CompiledTable, path: Path) -> None:
    """Write a compiled table; the old file is whole until the new one is."""
    tensors: Tensors = {
        "enabled": compiled.enabled,
        "priorities": compiled.priorities,
        "row_weights": compiled.row_weights,
        "assets": texts_to_array(list(compiled.assets)),
    }
    kinds = []
    for at, (masks, soft, texts) in enumerate(zip(compiled.masks, compiled.soft, compiled.texts, strict=True)):
        kinds.append(
            {"masks": _add(tensors, f"{at:03d}", masks), "soft": None if soft is None else _add(tensors, f"{at:03d}.soft", soft[0])}
        )
        tensors[f"{at:03d}.codes"] = texts.codes
        tensors[f"{at:03d}.texts"] = texts_to_array(list(texts.texts))
        if soft is not None:
            tensors[f"{at:03d}.soft.penalties"] = soft[1]
    for at, column in enumerate(compiled.slots or ()):
        tensors[f"slots.{at:03d}.codes"] = column.codes
        tensors[f"slots.{at:03d}.texts"] = texts_to_array(list(column.texts))
    about = json.dumps(
        {
            "name": compiled.name,
            "rows": compiled.n_rows,
            "policy": compiled.policy,
            "fallback": compiled.fallback,
            "conditions": [_condition_to_json(c) for c in compiled.conditions],
            "columns": kinds,
        }
        | ({"slots": [c.name for c in compiled.slots]} if compiled.slots is not None else {})
        | ({"computed_from": [_condition_to_json(c) for c in _computed_from(compiled)]} if compiled.derivation else {})
    )
    write_tensors(path, COMPILED, tensors, {"about": about, "digest": digest_of(tensors, about)})


def open_artefact(path: Path) -> CompiledTable:
    """Open a compiled table by memory map, checked.

    Raises
    ------
    ArtefactError
        The file is truncated, altered, of another layout, or no artefact at all; with the reason and the mend.
    FileError
        The file cannot be read.
    """
    tensors, metadata = read_tensors(path, COMPILED)
    with COMPILED.reading(path):
        about = metadata["about"]
        if digest_of(tensors, about) != metadata.get("digest"):
            raise COMPILED.refused(path, "the file was altered: its contents do not give its digest.")
        return _table(json.loads(about), tensors)


def _table(about: dict[str, Any], tensors: Tensors) -> CompiledTable:
    conditions = tuple(_condition_from_json(c) for c in about["conditions"])
    n_rows = about["rows"]
    numbered = [(f"{at:03d}", kinds) for at, kinds in enumerate(about["columns"])]
    return CompiledTable(
        name=about["name"],
        assets=texts_from_array(tensors["assets"]),
        conditions=conditions,
        masks=tuple(_column(tensors, prefix, kinds["masks"], n_rows) for prefix, kinds in numbered),
        enabled=tensors["enabled"],
        soft=tuple(_soft(tensors, f"{prefix}.soft", kinds["soft"], n_rows) for prefix, kinds in numbered),
        priorities=tensors["priorities"],
        row_weights=tensors["row_weights"],
        texts=tuple(
            TextColumn(c.name, tuple(texts_from_array(tensors[f"{prefix}.texts"])), tensors[f"{prefix}.codes"])
            for c, (prefix, _) in zip(conditions, numbered, strict=True)
        ),
        policy=about["policy"],
        fallback=about["fallback"],
        derivation=_derivation(about, conditions),
        slots=_slots(about, tensors),
    )


def _slots(about: dict[str, Any], tensors: Tensors) -> tuple[TextColumn, ...] | None:
    if "slots" not in about:
        return None
    return tuple(
        TextColumn(name, tuple(texts_from_array(tensors[f"slots.{at:03d}.texts"])), tensors[f"slots.{at:03d}.codes"])
        for at, name in enumerate(about["slots"])
    )


def _derivation(about: dict[str, Any], conditions: tuple[Condition, ...]) -> Derivation | None:
    if "computed_from" not in about:
        return None
    others = [_condition_from_json(c) for c in about["computed_from"]]
    known = Schema(conditions={c.name: c for c in (*conditions, *others)})
    return known.derivation_of(c.name for c in conditions)


def _computed_from(compiled: CompiledTable) -> list[Condition]:
    """The conditions that derived facts are computed from and that are no columns of the table."""
    computed = compiled.derivation.conditions if compiled.derivation else ()
    return [condition for condition in computed if condition.name not in compiled.places]


def _add(tensors: Tensors, prefix: str, masks: ColumnMasks) -> dict[str, object]:
    """Put a column's arrays among the tensors; gives what else it needs."""
    if isinstance(masks, WideMasks):
        tensors |= {
            f"{prefix}.bounds": masks.bounds,
            f"{prefix}.low": masks.low,
            f"{prefix}.high": masks.high,
            f"{prefix}.any_mask": masks.any_mask,
        }
        return {"kind": "wide", "shift": masks.shift}
    tensors[f"{prefix}.masks"] = masks.masks
    if isinstance(masks, NumberMasks):
        tensors[f"{prefix}.bounds"] = masks.bounds
        return {"kind": "number"}
    if isinstance(masks, ValueMasks):
        return {"kind": "value", "values": list(masks.values), "has_others": masks.has_others}
    negated = [[sorted(t.needs), sorted(t.bans)] for t in masks.negated]
    return {"kind": "tags", "tags": list(masks.tags), "negated": negated}


def _column(tensors: Tensors, prefix: str, about: dict[str, Any], n_rows: int) -> ColumnMasks:
    kind = about["kind"]
    if kind == "wide":
        parts = (tensors[f"{prefix}.{part}"] for part in ("low", "high", "any_mask"))
        return WideMasks(n_rows, tensors[f"{prefix}.bounds"], about["shift"], *parts)
    masks = tensors[f"{prefix}.masks"]
    if kind == "number":
        return NumberMasks(n_rows, tensors[f"{prefix}.bounds"], masks)
    if kind == "value":
        return ValueMasks(n_rows, tuple(about["values"]), about["has_others"], masks)
    negated = tuple(TagSet(frozenset(needs), frozenset(bans), True) for needs, bans in about["negated"])
    return TagMasks(n_rows, tuple(about["tags"]), negated, masks)


def _soft(tensors: Tensors, prefix: str, about: dict[str, Any] | None, n_rows: int) -> SoftMasks | None:
    return None if about is None else (_column(tensors, prefix, about, n_rows), tensors[f"{prefix}.penalties"])


def _condition_to_json(condition: Condition) -> dict[str, object]:
    domain = condition.domain
    bounds = [b if math.isfinite(b) else None for b in (domain.minimum, domain.maximum)]
    return {
        "name": condition.name,
        "type": domain.kind,
        "values": domain.values,
        "bounds": bounds,
        "unit": condition.unit,
        "description": condition.description,
        "expr": condition.expr,
        "is_declared": condition.is_declared,
    }


def _condition_from_json(about: dict[str, Any]) -> Condition:
    low, high = about["bounds"]
    values = None if about["values"] is None else tuple(about["values"])
    domain = Domain(about["type"], values, -math.inf if low is None else low, math.inf if high is None else high)
    return Condition(about["name"], domain, about["unit"], about["description"], about["expr"], about["is_declared"])
