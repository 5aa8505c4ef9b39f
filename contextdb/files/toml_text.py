"""Values as TOML writes them, in contextdb.toml and in messages; a message shortens a long one with `safe_text`."""

from __future__ import annotations

import datetime
import json
import numbers
import re
from collections.abc import Mapping

from contextdb.cells.arguments import text_of

Path = tuple[str, ...]


def as_toml(value: object) -> str:
    """A value as TOML writes it, on one line."""
    if isinstance(value, Mapping):
        inner = ", ".join(f"{dotted((str(key),))} = {as_toml(item)}" for key, item in value.items())
        return f"{{ {inner} }}" if inner else "{}"
    if isinstance(value, (list, tuple)):
        inner = ", ".join(map(as_toml, value))
        return f"[ {inner} ]" if any(isinstance(item, Mapping) for item in value) else f"[{inner}]"
    if isinstance(value, (str, bool)):
        return json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007f")
    return value.isoformat() if isinstance(value, (datetime.date, datetime.time)) else text_of(value)


def plain_numbers(value: object) -> object:
    """A value with its whole numbers as people write them: 0, not 0.0."""
    if isinstance(value, Mapping):
        return {key: plain_numbers(item) for key, item in value.items()}
    if isinstance(value, (list, tuple)):
        return [plain_numbers(item) for item in value]
    return int(value) if isinstance(value, float) and value.is_integer() and abs(value) < 2.0**53 else value


def dotted(path: Path) -> str:
    """A path as a header writes it: conditions."Defender.Tags"."""
    return ".".join(key if re.fullmatch(r"[A-Za-z0-9_-]+", key) else as_toml(key) for key in path)


def what(value: object) -> str:
    """The type of a value, in a word for a message."""
    for types, word in ((str, "text"), (bool, "true or false"), (numbers.Real, "a number"), (Mapping, "a table")):
        if isinstance(value, types):
            return word
    return "a list" if isinstance(value, (list, tuple)) else "nothing" if value is None else f"a {type(value).__name__}"
