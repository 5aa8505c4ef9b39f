"""The frame of a Parquet file, checked before polars decodes it, and the digest that seals the files that contextdb writes.

The frame is the footer, the column chunks and the page headers. A damaged count in it makes the decoder ask the system for more
memory than there is, and that ends the whole process: no Python handler sees it. So nothing is decoded whose counts and sizes
contradict each other. Only the frame is read, a few dozen bytes a page.

The metadata of a sealed file hold the BLAKE2b-128 digest of all its bytes, those of the digest itself taken as zeros. Two entries
mark a file as ours, so that one damaged bit cannot make it a file of another program. A program that edits the file and keeps its
metadata leaves its own name as the writer, and the seal no longer counts.

Source: apache/parquet-format, README and parquet.thrift; the Thrift compact protocol, apache/thrift doc/specs.
"""

from __future__ import annotations

import hashlib
import mmap
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from os import PathLike
from typing import Any

MAGIC = b"PAR1"
SEAL = "contextdb.seal"
UNSEALED = {"contextdb.file": "sealed", SEAL: "0" * 32}
"""The metadata with which a file is written that is then sealed."""
_SEAL_HEAD = b"\x18%c%s\x18\x20" % (len(SEAL), SEAL.encode())
_MARK = b"\x18%c%s\x18\x06sealed" % (len("contextdb.file"), b"contextdb.file")
"""The entries of `UNSEALED` as the file has them: in Thrift each text follows the head of its field and its length."""
_WRITER = b"Polars"
_N_DIGITS = 32
MOST_VALUES = 1 << 31
"""So many values, nulls included, may a file hold that is read as a whole; polars numbers rows with 32 bits."""
_MOST_DEPTH = 32
_MOST_HEADER_BYTES = 1 << 20
_DATA_PAGE, _INDEX_PAGE, _DICTIONARY_PAGE, _DATA_PAGE_V2 = range(4)
_REPEATED = 2
_END = 8
"""The length of the footer, 4 bytes, and the magic bytes."""

Struct = Mapping[int, Any]
"""A Thrift struct: its fields by number."""


class DamagedFrame(ValueError):
    """The file contradicts itself; the message says how."""


@dataclass(frozen=True)
class Frame:
    """What the end of a Parquet file says of it."""

    metadata: Mapping[str, str]
    writer: str
    """The program that wrote the file, with its version."""
    start: int
    """Where the end begins."""
    is_sealed: bool
    """Whether the file is one of ours, which holds the digest of its bytes."""
    n_rows: int
    n_columns: int


def require_whole(raw: bytes | memoryview, most_values: int | None = MOST_VALUES) -> Frame:
    """Check the frame of a whole Parquet file, and its digest where it is sealed. `most_values` is how many values the file may
    hold; None where it is read a batch at a time. Raises DamagedFrame where counts and sizes do not agree with each other or with
    the file's length, or the digest is another."""
    frame = _checked(raw, most_values)
    if frame.is_sealed and _digest(raw, at := _seal_at(raw, frame)) != bytes(raw[at : at + _N_DIGITS]):
        raise DamagedFrame("it was altered after it was saved: its contents do not match its digest")
    return frame


def require_whole_file(path: str | PathLike[str]) -> Frame:
    """The same for a file that is then read a batch at a time; only its frame is read, and all of a sealed one. Raises
    DamagedFrame, or OSError where the file cannot be read."""
    with open(path, "rb") as file:
        if not file.read(1):
            raise DamagedFrame("it is empty")
        with mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ) as mapped, memoryview(mapped) as raw:
            return require_whole(raw, None)


def sealed(raw: bytes) -> bytes:
    """A file that was written with the metadata `UNSEALED`, with its digest."""
    at = _seal_at(raw, _checked(raw, None))
    return raw[:at] + _digest(raw, at) + raw[at + _N_DIGITS :]


def _seal_at(raw: bytes | memoryview, frame: Frame) -> int:
    """Where the digest is in the file."""
    at = bytes(raw[frame.start :]).rfind(_SEAL_HEAD)
    if at < 0:
        raise DamagedFrame("it was altered after it was saved: its digest is missing")
    return frame.start + at + len(_SEAL_HEAD)


def _digest(raw: bytes | memoryview, at: int) -> bytes:
    """The digest of a file whose own digest begins at `at`."""
    digest = hashlib.blake2b(raw[:at], digest_size=16)
    digest.update(b"0" * _N_DIGITS)
    digest.update(raw[at + _N_DIGITS :])
    return digest.hexdigest().encode()


def _is_sealed(end: bytes, writer: bytes) -> bool:
    """Whether one of the two marks is in the end of a file, and the writer is that of our files or one damaged bit from it."""
    n_other_bits = sum((one ^ other).bit_count() for one, other in zip(writer, _WRITER, strict=False))
    is_writer = len(writer) >= len(_WRITER) and n_other_bits < 2
    return (_SEAL_HEAD in end or _MARK in end) and (is_writer or _WRITER in end)


def _checked(raw: bytes | memoryview, most_values: int | None) -> Frame:
    body = len(raw) - _END - int.from_bytes(raw[-_END:-4], "little")
    if len(raw) < 12 or bytes(raw[:4]) != MAGIC or bytes(raw[-4:]) != MAGIC or body < 4:
        raise DamagedFrame("its end, where Parquet lists its columns, is missing")
    footer = _Reader(raw, body, len(raw) - _END).struct()
    leaves = _leaves(_structs(footer, 2))
    groups = _structs(footer, 4)
    n_rows = _count(footer, 3)
    if sum(_count(group, 3) for group in groups) != n_rows:
        raise DamagedFrame("its parts do not have the number of rows that its end names")
    if most_values is not None and n_rows * max(1, len(leaves)) > most_values:
        raise DamagedFrame(f"its end names {n_rows:,} rows, more than can be read")
    for group in groups:
        chunks = _structs(group, 1)
        if len(chunks) != len(leaves):
            raise DamagedFrame("its parts do not have the columns that its end names")
        for chunk, is_flat in zip(chunks, leaves, strict=True):
            _check_chunk(raw, body, _field(chunk, 3, dict), _count(group, 3) if is_flat else None)
    pairs = _structs(footer, 5) if 5 in footer else []
    metadata = {_text(pair, 1): _text(pair, 2) for pair in pairs if 2 in pair}
    writer: bytes = _field(footer, 6, bytes) if 6 in footer else b""
    is_sealed = _is_sealed(bytes(raw[body:]), writer)
    return Frame(metadata, writer.decode("utf-8", "replace"), body, is_sealed, n_rows, len(leaves))


def _leaves(schema: Sequence[Struct]) -> list[bool]:
    """For each column of values whether each row has exactly one value or null: nothing repeated lies above it."""
    leaves: list[bool] = []
    above: list[tuple[int, bool]] = []
    """For each group that is open how many elements it still has, and whether it is flat."""
    for element in schema:
        n_left, is_flat = above.pop() if above else (1, True)
        if n_left > 1:
            above.append((n_left - 1, is_flat))
        is_flat = is_flat and element.get(3) != _REPEATED
        n_children = _count(element, 5) if 5 in element else 0
        if n_children:
            above.append((n_children, is_flat))
        elif element is not schema[0]:
            leaves.append(is_flat)
    return leaves


def _check_chunk(raw: bytes | memoryview, body: int, about: Struct, n_rows: int | None) -> None:
    """The pages of one column in one part of the file hold the values that its description names."""
    n_values, size = _count(about, 5), _count(about, 7)
    if n_rows is not None and n_values != n_rows:
        raise DamagedFrame("a column has another number of values than rows")
    at = min(_count(about, field) for field in (9, 11) if field in about or field == 9)
    if not 4 <= at <= at + size <= body:
        raise DamagedFrame("a column is outside of the file")
    n_left = n_values
    while n_left > 0:
        reader = _Reader(raw, at, min(body, at + _MOST_HEADER_BYTES))
        page = reader.struct()
        at = reader.at + _count(page, 3)
        n_left -= _values_of(page)
        if at > body or n_left < 0:
            raise DamagedFrame("a page of values is larger than its column")


def _values_of(page: Struct) -> int:
    """How many values of the column a page holds; a dictionary holds none."""
    kind = _count(page, 1)
    n_bytes = _count(page, 2)
    if kind == _DATA_PAGE:
        return _count(_field(page, 5, dict), 1)
    if kind == _DATA_PAGE_V2:
        about = _field(page, 8, dict)
        n_values = _count(about, 1)
        if max(_count(about, 2), _count(about, 3)) > n_values or _count(about, 5) + _count(about, 6) > n_bytes:
            raise DamagedFrame("a page of values contradicts itself")
        return n_values
    if kind == _DICTIONARY_PAGE and _count(_field(page, 7, dict), 1) > n_bytes:
        raise DamagedFrame("a list of distinct values is larger than its page")
    return 0


# ---- fields of a struct


def _field(struct: Struct, number: int, kind: type) -> Any:
    value = struct.get(number)
    if not isinstance(value, kind) or isinstance(value, bool):
        raise DamagedFrame("a part of its description is missing")
    return value


def _count(struct: Struct, number: int) -> int:
    count: int = _field(struct, number, int)
    if count < 0:
        raise DamagedFrame("a count in it is negative")
    return count


def _text(struct: Struct, number: int) -> str:
    text: bytes = _field(struct, number, bytes)
    return text.decode("utf-8", "replace")


def _structs(struct: Struct, number: int) -> list[Struct]:
    listed: list[Struct] = _field(struct, number, list)
    if not all(isinstance(each, dict) for each in listed):
        raise DamagedFrame("a part of its description is missing")
    return listed


# ---- the Thrift compact protocol


class _Reader:
    """Reads one struct from `at` on, never past `stop`."""

    def __init__(self, raw: bytes | memoryview, at: int, stop: int) -> None:
        self.raw, self.at, self.stop = raw, at, stop

    def struct(self, depth: int = 0) -> dict[int, Any]:
        """The fields by number."""
        fields: dict[int, Any] = {}
        number = 0
        while head := self._byte():
            step, kind = head >> 4, head & 15
            number = number + step if step else self._signed()
            fields[number] = kind == 1 if kind in (1, 2) else self._value(kind, depth)
        return fields

    def _value(self, kind: int, depth: int) -> Any:
        if depth > _MOST_DEPTH:
            raise DamagedFrame("its description is nested too deep")
        match kind:
            case 1 | 2:  # in a list a bool takes a byte of its own
                return self._byte() == 1
            case 3:
                return self._byte()
            case 4 | 5 | 6:
                return self._signed()
            case 7:
                return self._bytes(8)
            case 8:
                return self._bytes(self._varint())
            case 9 | 10:
                return list(self._items(depth + 1))
            case 11:
                return self._pairs(depth + 1)
            case 12:
                return self.struct(depth + 1)
            case _:
                raise DamagedFrame("its description cannot be read")

    def _items(self, depth: int) -> Iterator[Any]:
        head = self._byte()
        size = head >> 4 if head >> 4 < 15 else self._varint()
        if size > self.stop - self.at:
            raise DamagedFrame("a list in its description is longer than the file")
        for _ in range(size):
            yield self._value(head & 15, depth)

    def _pairs(self, depth: int) -> None:
        size = self._varint()
        kinds = self._byte() if size else 0
        if size > self.stop - self.at:
            raise DamagedFrame("a list in its description is longer than the file")
        for _ in range(size):
            self._value(kinds >> 4, depth)
            self._value(kinds & 15, depth)

    def _byte(self) -> int:
        if self.at >= self.stop:
            raise DamagedFrame("its description is cut off")
        self.at += 1
        return self.raw[self.at - 1]

    def _varint(self) -> int:
        value = self._byte()
        if value < 128:
            return value
        value &= 127
        for shift in range(7, 70, 7):
            byte = self._byte()
            value |= (byte & 127) << shift
            if byte < 128:
                return value
        raise DamagedFrame("a number in its description cannot be read")

    def _signed(self) -> int:
        value = self._varint()
        return (value >> 1) ^ -(value & 1)

    def _bytes(self, size: int) -> bytes:
        if size > self.stop - self.at:
            raise DamagedFrame("its description is cut off")
        self.at += size
        return bytes(self.raw[self.at - size : self.at])
