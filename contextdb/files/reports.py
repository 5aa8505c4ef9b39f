"""Reports of ours, read again as baselines: JSON that people may have edited, and git may have merged."""

from __future__ import annotations

import json
from typing import Any

MOST_DIGITS = 300
"""A whole number of more digits is none that a double holds."""


def document_of(text: str) -> Any:
    """The JSON document of a text. Raises ValueError where it is none: why, as the end of a sentence."""
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
