"""What tells one version of a compiled table from another: a digest of all that an answer hangs on."""

from __future__ import annotations

import hashlib
from collections.abc import Sequence

import numpy as np

from contextdb.columns import TextColumn


def version_of(parts: Sequence[object]) -> str:
    """A digest of arrays, columns of texts and plain values, in hexadecimal; equal for parts that say the same."""
    digest = hashlib.blake2b(digest_size=16)
    for part in parts:
        said = _said(part)
        digest.update(len(said).to_bytes(8, "little"))
        digest.update(said)
    return digest.hexdigest()


def _said(part: object) -> bytes:
    if isinstance(part, np.ndarray):
        return part.tobytes()
    if isinstance(part, TextColumn):
        return _said((part.name, part.to_list()))
    return repr(part).encode("utf-8", "surrogatepass")
