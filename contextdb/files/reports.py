"""Reports of ours that are read again as baselines: JSON that git may have merged, and that people may have edited.

Such a document names its `writer` and has a `digest` of its own text, so that no altered digit lowers a threshold unnoticed. The
digest is BLAKE2b-128 of the text as it was written, with its own 32 digits taken as zeros; "\r\n" counts as "\n", and a byte order
mark as nothing, since git and editors change these. Either mark says that a document is ours, so that one damaged mark does not
turn it into a document of another program.
"""

from __future__ import annotations

import hashlib
import json
import re
from collections.abc import Mapping
from typing import Any

DIGEST, WRITER, OURS = "digest", "writer", "contextdb"
UNSEALED = "0" * 32
MOST_DIGITS = 300
"""A whole number of more digits is none that a double holds."""


def document_of(text: str) -> Any:
    """The JSON document of a text. Raises ValueError where it is none, or where it is ours and is not as it was written: why, as
    the end of a sentence."""
    document = _parsed(text)
    if is_ours(document) and not _matches(text, document.get(DIGEST)):
        why = "its contents do not match its digest" if DIGEST in document else "it has no digest"
        raise ValueError(f"it was altered after it was written: {why}")
    return document


def baseline_of(text: str) -> Any:
    """The same for a document that a gate compares with: it must be ours, and of format 1."""
    document = document_of(text)
    if not is_ours(document):
        raise ValueError("it has neither the writer nor the digest of a report of contextdb")
    if document.get("format") != 1:
        raise ValueError('it has no "format": 1')
    return document


def is_ours(document: object) -> bool:
    """Whether a document has a mark of contextdb: its writer, or a digest beside a format."""
    if not isinstance(document, dict):
        return False
    has_digest = "format" in document and re.fullmatch("[0-9a-f]{32}", str(document.get(DIGEST)))
    return bool(has_digest) or document.get(WRITER) == OURS


def with_marks(document: Mapping[str, object]) -> dict[str, object]:
    """A report with its writer, and the place of its digest; the text of it is then `sealed`."""
    return {**document, WRITER: OURS, DIGEST: UNSEALED}


def sealed(text: str) -> str:
    """The text of a document `with_marks`, with its digest."""
    head, _, tail = text.rpartition(UNSEALED)
    return head + _digest(text) + tail


def _matches(text: str, digest: object) -> bool:
    plain = text.removeprefix("\ufeff").replace("\r\n", "\n")
    head, digits, tail = plain.rpartition(str(digest))
    return bool(digits) and _digest(head + UNSEALED + tail) == digest


def _digest(text: str) -> str:
    return hashlib.blake2b(text.encode("utf-8", "backslashreplace"), digest_size=16).hexdigest()


def _parsed(text: str) -> Any:
    try:
        return json.loads(text.removeprefix("\ufeff"), parse_int=_whole)
    except json.JSONDecodeError as error:
        marks = [at for at, line in enumerate(text.split("\n"), 1) if line.startswith("<<<<<<< ")]
        why = f"line {error.lineno} is no JSON: {error.msg} at character {error.colno}"
        raise ValueError(f"line {marks[0]} begins a conflict of git" if marks else why) from None
    except RecursionError:
        raise ValueError("lists are nested too deeply") from None


def _whole(digits: str) -> int:
    if len(digits) > MOST_DIGITS:
        raise ValueError(f"a number has {len(digits):,} digits")
    return int(digits)
