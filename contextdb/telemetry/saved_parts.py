"""Parts of an observation kept on disk, so that an interrupted run continues where it stopped.

A folder holds one file for each telemetry file that was observed to its end: numpy arrays and a line of JSON, no pickle. It is
written in one step. A part counts only for the same table, settings and version, and for a file of the same size and time;
otherwise its file is read again.
"""

from __future__ import annotations

import hashlib
import io
import json
import os
from collections import Counter
from pathlib import Path
from typing import Any

import numpy as np

from contextdb.disk import make_folder, read_bytes, write_atomic
from contextdb.disk.boundary import inside
from contextdb.errors import ContextDBError
from contextdb.telemetry.parts import MOST_HASHES, MOST_OPEN, Part, Plan

VERSION = 2
_ARRAYS = ("hits", "hashes", "open_hashes", "open_keys", "open_moments")
_PLAIN = ("rows", "moments", "uncovered", "is_full", "has_all_open", "files")


class SavedParts:
    """The parts in a folder, for one plan."""

    def __init__(self, folder: Path, plan: Plan) -> None:
        self.folder, self.digest = folder, plan_digest(plan)
        make_folder(folder)

    def get(self, path: Path) -> Part | None:
        """The part of a file that has not changed since; None where there is none, or none that can be used."""
        try:
            raw = read_bytes(self._file(path))
            with np.load(io.BytesIO(raw), allow_pickle=False) as arrays:
                about = json.loads(str(arrays["about"]))
                if about["for"] != self._key(path):
                    return None
                saved = {name: arrays[name] for name in _ARRAYS}
        except (ContextDBError, OSError, ValueError, KeyError, EOFError, TypeError, IndexError):
            return None
        except Exception as error:  # a file cut short: zipfile has errors of its own
            if type(error).__module__ not in ("zipfile", "zlib"):
                raise
            return None
        given: dict[str, Any] = {**saved, **{name: about[name] for name in _PLAIN}}
        given |= {name: Counter(about[name]) for name in ("missing", "outside")}
        examples = {name: tuple(texts) for name, texts in about["examples"].items()}
        return Part(**given, examples=examples, columns=frozenset(about["columns"]))

    def key(self, path: Path) -> str:
        """What a part is for: taken before its file is read, so that one written to meanwhile does not count."""
        return self._key(path)

    def put(self, path: Path, part: Part, key: str) -> None:
        """Keep the part of a file, unless it could not be read."""
        if part.faults:
            return
        about = {name: getattr(part, name) for name in (*_PLAIN, "missing", "outside", "examples")}
        text = json.dumps({"for": key, "columns": sorted(part.columns), **about})
        buffer = io.BytesIO()
        arrays = {name: getattr(part, name) for name in _ARRAYS}
        np.savez_compressed(buffer, about=np.array(text), **arrays)
        write_atomic(self._file(path), buffer.getvalue())

    def _file(self, path: Path) -> Path:
        name = hashlib.sha256(os.path.realpath(path).encode("utf-8", "surrogateescape")).hexdigest()[:24]
        return inside(self.folder / f"{name}.npz", self.folder)

    def _key(self, path: Path) -> str:
        seen = os.stat(path)
        return f"{self.digest} {seen.st_size} {seen.st_mtime_ns}"


def plan_digest(plan: Plan) -> str:
    """A name for all that a part depends on besides its file."""
    compiled = plan.compiled
    digest = hashlib.sha256(f"{VERSION} {MOST_OPEN} {MOST_HASHES} {plan.count!r}".encode())
    for condition, texts in zip(compiled.conditions, compiled.texts, strict=True):
        digest.update(repr((condition.name, condition.domain, condition.expr, texts.texts)).encode("utf-8", "surrogatepass"))
        digest.update(texts.codes.tobytes())
    inputs = () if compiled.derivation is None else compiled.derivation.conditions
    digest.update(repr([(c.name, c.domain, c.expr) for c in inputs]).encode("utf-8", "surrogatepass"))
    digest.update(compiled.enabled.tobytes() + str(compiled.n_rows).encode())
    return digest.hexdigest()
