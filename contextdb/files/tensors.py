"""Arrays in a .safetensors file: written with metadata in one order, read by memory map, never pickle.

The format is eight bytes with the length of a JSON header, the header, and the arrays one after another, little-endian. A
`FileKind` says which sort of file is meant: the key that its metadata must hold, with the version of the layout, and what to do
about a file that cannot be used. An edge: this touches the disk.

Source: the format's description in github.com/huggingface/safetensors, README.
"""

from __future__ import annotations

import hashlib
import json
import math
import mmap
import os
from collections.abc import Collection, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from contextdb.disk import TENSORS_SUFFIX, needing, read_bytes, write_atomic
from contextdb.errors import ArtefactError, ContextDBError, Fault, Place
from contextdb.files.scratch import LARGE_BYTES

SUFFIX = TENSORS_SUFFIX

Tensors = dict[str, NDArray[Any]]

_DTYPES = {"U64": "<u8", "I64": "<i8", "F64": "<f8", "I32": "<i4", "F32": "<f4", "U16": "<u2", "U8": "u1", "BOOL": "?"}
_NAMES = {np.dtype(dtype): name for name, dtype in _DTYPES.items()}
_METADATA = "__metadata__"
_BROKEN = (ValueError, KeyError, TypeError, IndexError, UnicodeDecodeError, AttributeError, OverflowError, RecursionError)


@dataclass(frozen=True)
class FileKind:
    """A sort of file. The metadata hold the version of its layout under `key`. Messages about a file that cannot be used name what
    it is not (`noun`, such as "one that contextdb compiled"), what is `accepted`, and the mend."""

    key: str
    layout: int
    noun: str
    accepted: str
    mend: str

    def metadata(self, others: Mapping[str, str]) -> dict[str, str]:
        """The metadata of a file of this kind, and others."""
        return {**others, self.key: str(self.layout)}

    def refused(self, path: Path, why: str) -> ArtefactError:
        """The error of a file that cannot be used."""
        return ArtefactError(Fault(why, self.accepted, self.mend, Place(str(path)), "bad-artefact"))

    @contextmanager
    def reading(self, path: Path) -> Iterator[None]:
        """Turn what goes wrong while a file's contents are put together into the error of a file that cannot be used."""
        try:
            yield
        except ContextDBError:  # a ValueError too, which says itself what is wrong
            raise
        except _BROKEN as error:
            raise self.refused(path, f"the file does not hold what its header says ({type(error).__name__}).") from error


def write_tensors(path: Path, kind: FileKind, tensors: Mapping[str, NDArray[Any]], metadata: Mapping[str, str]) -> None:
    """Write arrays and metadata; the same ones give the same bytes. The old file is whole until the new one is. Raises FileError
    where the disk refuses."""
    pieces = _pieces(tensors, kind.metadata(metadata))
    size = sum(map(len, pieces))
    if size < LARGE_BYTES:
        write_atomic(path, b"".join(pieces))
        return
    with needing(size):
        write_atomic(path, pieces)


def to_bytes(tensors: Mapping[str, NDArray[Any]], metadata: Mapping[str, str]) -> bytes:
    """The bytes of a file."""
    return b"".join(_pieces(tensors, metadata))


def _pieces(tensors: Mapping[str, NDArray[Any]], metadata: Mapping[str, str]) -> list[bytes | memoryview]:
    """The bytes of a file. Arrays of larger numbers stand first, so that each is aligned; then they go by name."""
    arrays = {name: _little(array) for name, array in tensors.items()}
    header: dict[str, object] = {_METADATA: dict(metadata)}
    ordered = sorted(arrays, key=lambda name: (-arrays[name].itemsize, name))
    stop = 0
    for name in ordered:
        array = arrays[name]
        start, stop = stop, stop + array.nbytes
        header[name] = {"dtype": _NAMES[array.dtype], "shape": list(array.shape), "data_offsets": [start, stop]}
    text = json.dumps(header, separators=(",", ":")).encode()
    text += b" " * (-len(text) % 8)
    return [len(text).to_bytes(8, "little"), text, *(_octets(arrays[name]) for name in ordered)]


def read_tensors(path: Path, kind: FileKind, *, writeable: bool = False) -> tuple[Tensors, dict[str, str]]:
    """Every array as a view of the mapped file, and the metadata. The file's frame and its layout are checked, and no array is
    read: a large file opens as fast as a small one.

    `writeable` says whether the arrays may be written; the file stays as it is, and a page that is written takes memory of its own.
    Raises ArtefactError where the file is truncated, of another kind or of another layout; FileError where it cannot be read.
    """
    if kind.key not in metadata_of(path, kind):
        raise kind.refused(path, f"a .safetensors file, but not {kind.noun}.")
    with path.open("rb") as file:
        mapped = mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_COPY if writeable else mmap.ACCESS_READ)
    with kind.reading(path):
        start = 8 + int.from_bytes(mapped[:8], "little")
        header = json.loads(mapped[8:start])
        metadata = header.pop(_METADATA)
        if metadata[kind.key] != str(kind.layout):
            raise kind.refused(path, f"layout {metadata[kind.key]}; this version reads layout {kind.layout}.")
        return {name: _view(mapped, start, entry) for name, entry in header.items()}, metadata


def divided(tensors: Tensors, names: Collection[str]) -> tuple[Tensors, Tensors]:
    """All but the arrays of these names, and those of them that are there."""
    large = {name: tensors[name] for name in names if name in tensors}
    return {name: array for name, array in tensors.items() if name not in large}, large


def digest_of(tensors: Mapping[str, NDArray[Any]], *texts: str) -> str:
    """BLAKE2b-128 of some texts and of all arrays, in the order of their names."""
    digest = hashlib.blake2b("\0".join(texts).encode("utf-8", "surrogatepass"), digest_size=16)
    for name in sorted(tensors):
        array = _little(tensors[name])
        digest.update(f"{name} {array.dtype.str} {array.shape}".encode())
        digest.update(_octets(array))
    return digest.hexdigest()


def texts_to_array(texts: list[str]) -> NDArray[np.uint8]:
    """A list of texts as an array: its JSON in UTF-8."""
    return np.frombuffer(json.dumps(texts, ensure_ascii=False).encode("utf-8", "surrogatepass"), np.uint8)


def texts_from_array(octets: NDArray[np.uint8]) -> list[str]:
    """The texts that `texts_to_array` made an array of."""
    texts: list[str] = json.loads(octets.tobytes().decode("utf-8", "surrogatepass"))
    return texts


def metadata_of(path: Path, kind: FileKind) -> dict[str, str]:
    """The metadata of a .safetensors file, whichever kind it is of; `kind` is for the message. Raises ArtefactError where the file
    is truncated, or no .safetensors file; FileError where the file cannot be read."""
    if not os.path.isfile(path) or path.stat().st_size < 8:  # Path raises, where this says no, to a name that no file can have
        raise kind.refused(path, f"the file has {len(read_bytes(path))} bytes, too few for any artefact.")
    from safetensors import SafetensorError, safe_open

    try:
        with safe_open(path, framework="numpy") as frame:
            return dict(frame.metadata() or {})
    except (SafetensorError, OSError) as error:
        read_bytes(path)  # raises FileError where it is the disk that refuses
        raise kind.refused(path, f"not a whole .safetensors file ({error}).") from None


def other_layout(path: Path, kind: FileKind) -> str | None:
    """The layout of a file of this kind that this version cannot read; None for all other files, and where there is none."""
    try:
        layout = metadata_of(path, kind).get(kind.key)
    except ContextDBError:
        return None
    return None if layout == str(kind.layout) else layout


def _view(mapped: mmap.mmap, start: int, entry: Mapping[str, Any]) -> NDArray[Any]:
    first, last = entry["data_offsets"]
    dtype = np.dtype(_DTYPES[entry["dtype"]])
    count = math.prod(entry["shape"])
    view = np.frombuffer(mapped, dtype, count, start + first) if last > first else np.empty(0, dtype)
    return view.reshape(entry["shape"])


def _little(array: NDArray[Any]) -> NDArray[Any]:
    """The array as a file holds it: one piece, little-endian."""
    return np.ascontiguousarray(array, array.dtype.newbyteorder("<")).reshape(array.shape)


def _octets(array: NDArray[Any]) -> memoryview:
    return array.reshape(-1).view(np.uint8).data
