"""What tells one version of a compiled table from another: a digest of all that an answer hangs on."""

from __future__ import annotations

import hashlib
from collections.abc import Sequence
from typing import Any

import numpy as np

from contextdb.columns import TextColumn


def version_of(parts: Sequence[object]) -> str:
    """A digest of arrays, columns of texts and plain values, in hexadecimal; equal for parts that say the same."""
    digest = hashlib.blake2b(digest_size=16)
    for part in parts:
        raw = _bytes_of(part)
        digest.update(len(raw).to_bytes(8, "little"))
        digest.update(raw)
    return digest.hexdigest()


def said_by(compiled: Any) -> tuple[object, ...]:
    """All of a `CompiledData` that an answer, and what is picked from it, hangs on."""
    own = [*compiled.conditions, *compiled.ruled]
    conditions = [(c.name, c.domain, c.expr, c.mirror, *((c.hysteresis,) if c.hysteresis else ())) for c in own]
    derived = [(step.condition.name, step.expression.text) for step in compiled.derivation.steps] if compiled.derivation else []
    assets = compiled.assets if type(compiled.assets) is list else list(compiled.assets)
    ways = [] if compiled.ways is None else [compiled.ways.numbers, compiled.ways.rows]
    inner = () if compiled.ways is None else compiled.ways.tables
    return (
        (compiled.name, compiled.policy, compiled.fallback, assets, conditions, derived),
        *(compiled.enabled, compiled.priorities, compiled.row_weights, *compiled.texts, *(compiled.slots or ())),
        *((compiled.when.texts,) if compiled.when is not None else ()),
        *compiled.outputs.parts,
        *(*ways, *(part for t in inner for part in ((t.name, t.policy), t.priorities, t.row_weights))),
        *(raw for picking in (compiled.picking, *(t.picking for t in inner)) for part in picking.arrays.items() for raw in part),
    )


def _bytes_of(part: object) -> bytes:
    if isinstance(part, np.ndarray):
        return part.tobytes()
    if isinstance(part, TextColumn):
        return _bytes_of((part.name, part.to_list()))
    return repr(part).encode("utf-8", "surrogatepass")
