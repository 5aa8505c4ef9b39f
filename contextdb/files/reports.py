"""Reports of ours that are read again as baselines: JSON that people may have edited, and git may have merged.

Such a document has a `digest` of all else in it, so that no altered digit lowers a bar unnoticed. An older version wrote none.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from typing import Any

DIGEST = "digest"
MOST_DIGITS = 300
"""A whole number of more digits is none that a double holds."""


def document_of(text: str) -> Any:
    """The JSON document of a text. Raises ValueError where it is none, or its digest does not match: why, as the end of a
    sentence."""
    document = _parsed(text)
    if isinstance(document, dict) and document.get(DIGEST, expected := digest_of(document)) != expected:
        raise ValueError("it was altered after it was written: its contents do not match its digest")
    return document


def sealed(document: Mapping[str, object]) -> dict[str, object]:
    return {**document, DIGEST: digest_of(document)}


def has_digest(text: str) -> bool:
    """Whether a text that `document_of` reads has a digest."""
    return DIGEST in _parsed(text)


def digest_of(document: Mapping[str, Any]) -> str:
    """BLAKE2b-128 of all that a report says but its digest, whatever the order of its keys and the form of its numbers."""
    about = {name: value for name, value in document.items() if name != DIGEST}
    try:
        text = json.dumps(_plain(about), sort_keys=True, separators=(",", ":"))
    except RecursionError:
        raise ValueError("lists are nested too deeply") from None
    return hashlib.blake2b(text.encode(), digest_size=16).hexdigest()


def _plain(value: Any) -> Any:
    """A value as JSON has it: 1 and 1.0 are the same, and half of a surrogate pair is its escape as text."""
    if isinstance(value, dict):
        return {_plain(name): _plain(each) for name, each in value.items()}
    if isinstance(value, (list, tuple)):
        return [_plain(each) for each in value]
    if isinstance(value, str):
        return value.encode("utf-8", "backslashreplace").decode()
    return float(value) if isinstance(value, int) and not isinstance(value, bool) and abs(value) <= 1 << 53 else value


def _parsed(text: str) -> Any:
    try:
        return json.loads(text, parse_int=_whole)
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
