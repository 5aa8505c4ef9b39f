"""The compiled file for the game: .safetensors, opened by memory map, never pickle.

Tensors, R rows, W = ceil(R / 64) words, C conditions; every integer and double little-endian, every mask as in `contextdb.bitmask`:

    enabled                uint64 [W]            rows that may match
    priorities             int64 [R]
    row_weights            float64 [R]
    assets                 uint8                 JSON list of R texts
    CCC.FIELD              as in contextdb.classes, for condition number CCC: `masks` (and `bounds`), or `low`, `high`, `any_mask`
    CCC.codes              int32 [R]             which of the distinct texts each row holds
    CCC.texts              uint8                 JSON list of the distinct texts
    CCC.soft.FIELD         the same for soft cells, and CCC.soft.penalties float64 [R]

The metadata hold `contextdb` (the version of this layout), `about` (JSON: name, policy, fallback, conditions and the kind of each
column) and `digest`, BLAKE2b-128 of `about` and of all tensors in the order of their names. Opening checks all of it.
"""

from __future__ import annotations

import hashlib
import json
import math
import mmap
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from contextdb.cells import TagSet
from contextdb.classes import ColumnMasks, NumberMasks, TagMasks, ValueMasks, WideMasks
from contextdb.columns import TextColumn
from contextdb.compiled import CompiledTable, SoftMasks
from contextdb.conditions import Condition
from contextdb.disk import read_bytes, write_atomic
from contextdb.domains import Domain
from contextdb.errors import ArtefactError, Fault, Place

LAYOUT = 1
SUFFIX = ".safetensors"

Tensors = dict[str, NDArray[Any]]
_DTYPES = {"U64": "<u8", "I64": "<i8", "F64": "<f8", "I32": "<i4", "U8": "u1"}


def save(compiled: CompiledTable, path: Path) -> None:
    """Write a compiled table; the old file is whole until the new one is."""
    from safetensors.numpy import save as to_bytes

    tensors: Tensors = {
        "enabled": compiled.enabled,
        "priorities": compiled.priorities,
        "row_weights": compiled.row_weights,
        "assets": _as_json(list(compiled.assets)),
    }
    kinds = []
    for at, (masks, soft, texts) in enumerate(zip(compiled.masks, compiled.soft, compiled.texts, strict=True)):
        kinds.append(
            {"masks": _add(tensors, f"{at:03d}", masks), "soft": None if soft is None else _add(tensors, f"{at:03d}.soft", soft[0])}
        )
        tensors[f"{at:03d}.codes"] = texts.codes
        tensors[f"{at:03d}.texts"] = _as_json(list(texts.texts))
        if soft is not None:
            tensors[f"{at:03d}.soft.penalties"] = soft[1]
    about = json.dumps(
        {
            "name": compiled.name,
            "rows": compiled.n_rows,
            "policy": compiled.policy,
            "fallback": compiled.fallback,
            "conditions": [_condition_to_json(c) for c in compiled.conditions],
            "columns": kinds,
        }
    )
    tensors = {name: np.ascontiguousarray(array) for name, array in tensors.items()}
    metadata = {"contextdb": str(LAYOUT), "about": about, "digest": _digest(about, tensors)}
    write_atomic(path, _with_metadata(to_bytes(tensors), metadata))


def _with_metadata(raw: bytes, metadata: dict[str, str]) -> bytes:
    """A .safetensors file with metadata; the library itself would put them in another order each time."""
    start = 8 + int.from_bytes(raw[:8], "little")
    header = json.dumps({"__metadata__": metadata, **json.loads(raw[8:start])}, separators=(",", ":")).encode()
    header += b" " * (-len(header) % 8)
    return len(header).to_bytes(8, "little") + header + raw[start:]


def open_artefact(path: Path) -> CompiledTable:
    """Open a compiled table by memory map, checked.

    Raises
    ------
    ArtefactError
        The file is truncated, altered, of another layout, or no artefact at all; with the reason and the mend.
    FileError
        The file cannot be read.
    """
    try:
        return _open(path)
    except (ValueError, KeyError, TypeError, IndexError, UnicodeDecodeError, AttributeError) as error:
        raise _refused(path, f"the file does not hold what its header says ({type(error).__name__}).") from error


def _open(path: Path) -> CompiledTable:
    tensors, metadata = _read_tensors(path)
    if metadata["contextdb"] != str(LAYOUT):
        raise _refused(path, f"layout {metadata['contextdb']}; this version reads layout {LAYOUT}.")
    if _digest(metadata["about"], tensors) != metadata.get("digest"):
        raise _refused(path, "the file was altered: its contents do not give its digest.")
    about = json.loads(metadata["about"])
    conditions = tuple(_condition_from_json(c) for c in about["conditions"])
    n_rows = about["rows"]
    numbered = [(f"{at:03d}", kinds) for at, kinds in enumerate(about["columns"])]
    return CompiledTable(
        name=about["name"],
        assets=_from_json(tensors["assets"]),
        conditions=conditions,
        masks=tuple(_column(tensors, prefix, kinds["masks"], n_rows) for prefix, kinds in numbered),
        enabled=tensors["enabled"],
        soft=tuple(_soft(tensors, f"{prefix}.soft", kinds["soft"], n_rows) for prefix, kinds in numbered),
        priorities=tensors["priorities"],
        row_weights=tensors["row_weights"],
        texts=tuple(
            TextColumn(c.name, tuple(_from_json(tensors[f"{prefix}.texts"])), tensors[f"{prefix}.codes"])
            for c, (prefix, _) in zip(conditions, numbered, strict=True)
        ),
        policy=about["policy"],
        fallback=about["fallback"],
    )


def _read_tensors(path: Path) -> tuple[Tensors, dict[str, str]]:
    """Every tensor as a view of the mapped file, and the metadata; the file's frame is checked first."""
    from safetensors import SafetensorError, safe_open

    if not path.is_file() or path.stat().st_size < 8:
        size = len(read_bytes(path))
        raise _refused(path, f"the file has {size} bytes, too few for any artefact.")
    try:
        with safe_open(path, framework="numpy") as frame:
            metadata = dict(frame.metadata() or {})
    except (SafetensorError, OSError) as error:
        read_bytes(path)  # raises FileError where it is the disk that refuses
        raise _refused(path, f"not a whole .safetensors file ({error}).") from None
    if "contextdb" not in metadata:
        raise _refused(path, "a .safetensors file, but not one that contextdb compiled.")
    with path.open("rb") as file:
        mapped = mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ)
    start = 8 + int.from_bytes(mapped[:8], "little")
    header = json.loads(mapped[8:start])
    tensors: Tensors = {}
    for name, entry in header.items():
        if name != "__metadata__":
            first, last = entry["data_offsets"]
            dtype = np.dtype(_DTYPES[entry["dtype"]])
            count = math.prod(entry["shape"])
            view = np.frombuffer(mapped, dtype, count, start + first) if last > first else np.empty(0, dtype)
            tensors[name] = view.reshape(entry["shape"])
    return tensors, metadata


def _digest(about: str, tensors: Tensors) -> str:
    digest = hashlib.blake2b(about.encode(), digest_size=16)
    for name in sorted(tensors):
        array = tensors[name]
        digest.update(f"{name} {array.dtype.str} {array.shape}".encode())
        digest.update(array.tobytes() if not array.flags.c_contiguous else array.data)
    return digest.hexdigest()


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


def _as_json(texts: list[str]) -> NDArray[np.uint8]:
    return np.frombuffer(json.dumps(texts, ensure_ascii=False).encode("utf-8", "surrogatepass"), np.uint8)


def _from_json(octets: NDArray[np.uint8]) -> list[str]:
    texts: list[str] = json.loads(octets.tobytes().decode("utf-8", "surrogatepass"))
    return texts


def _refused(path: Path, why: str) -> ArtefactError:
    return ArtefactError(
        Fault(why, "a file that this version of contextdb compiled", "to compile the table again", Place(str(path)), "bad-artefact")
    )
