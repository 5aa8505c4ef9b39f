"""The lines of an editor's journal: a check sum, a space and JSON, so that a line that is cut or altered is found."""

from __future__ import annotations

import json
import zlib
from collections.abc import Mapping
from typing import Any

Record = Mapping[str, Any]

FORMAT = 1
"""What the first line of a journal says; a journal of another format is not read."""


def line_of(record: Record) -> bytes:
    """A record as a line: the CRC-32 of its JSON, then the JSON."""
    body = json.dumps(record, ensure_ascii=True, separators=(",", ":")).encode()
    return b"%08x %s\n" % (zlib.crc32(body), body)


def read_records(raw: bytes) -> tuple[list[Record], int]:
    """The records of a journal up to the first line that is cut, altered or no record, and how many bytes they take."""
    records: list[Record] = []
    at = 0
    for line in raw.splitlines(keepends=True):
        body = line[9:-1]
        try:
            if not line.endswith(b"\n") or line[:9] != b"%08x " % zlib.crc32(body):
                break
            record = json.loads(body)
        except (ValueError, RecursionError):
            break
        if not isinstance(record, dict):
            break
        records.append(record)
        at += len(line)
    return records, at


def n_lost(raw: bytes, n_bytes: int) -> int:
    """How many whole lines there are from the first damaged one on: 0 where only the last line was cut, as a kill leaves it."""
    return raw.count(b"\n", n_bytes)
