"""Values of a TOML text: written, and changed in place so that what stays in a list or an inline table keeps its text and comments.

Nothing here knows where in a file a value stands.
"""

from __future__ import annotations

import re
import tomllib
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Any

from contextdb.files.toml_text import Path, as_toml, dotted

TOKEN = re.compile(
    r'"""(?:\\.|[^\\])*?"""+|\'\'\'.*?\'\'\'+'  # strings over several lines
    r'|"(?:\\.|[^"\\\n])*"|\'[^\'\n]*\''
    r"|#[^\n]*|[\[\]{},=\n]|[^\s\[\]{},=#\"']+|[^\S\n]+",
    re.DOTALL,
)
BARE = re.compile(r"[A-Za-z0-9_-]+(?:\.[A-Za-z0-9_-]+)*")
"""A dotted key without quotes."""


@lru_cache(4096)
def keys_of(dotted: str) -> Path:
    """The path that a dotted key says: `conditions."Defender.Tags"`."""
    if BARE.fullmatch(dotted):
        return tuple(dotted.split("."))
    value: object = tomllib.loads(f"{dotted} = 0")
    path: list[str] = []
    while isinstance(value, dict):
        key, value = next(iter(value.items()))
        path.append(key)
    return tuple(path)


def end_of_line(text: str) -> str:
    """The line end that a text uses first."""
    first = text.partition("\n")
    return "\r\n" if first[1] and first[0].endswith("\r") else "\n"


def merged(old: str, keys: Path, value: object) -> str:
    """The text of a new value, or of an inline table with a key of it set, or with None removed."""
    if keys:
        return _inline(old, keys, value)
    if isinstance(value, (list, tuple)) and old.startswith("["):
        return _list(old, value)
    return as_toml(value)


@dataclass(frozen=True, slots=True)
class _Entry:
    """`key = value` in an inline table: its path, and where it and its value start and where both stop."""

    path: Path
    start: int
    value: int
    stop: int


def _inline(old: str, keys: Path, value: object) -> str:
    """The text of an inline table with a key set, or with None removed; all other text stays."""
    entries = list(_entries(old))
    for one in entries:
        if one.path == keys[: len(one.path)] and (len(one.path) < len(keys) or value is not None):
            inner = merged(old[one.value : one.stop], keys[len(one.path) :], value)
            return old[: one.value] + inner + old[one.stop :]
    rest = [one for one in entries if one.path[: len(keys)] != keys]
    if len(rest) < len(entries):
        texts = [old[one.start : one.stop] for one in rest]
        old = f"{{ {', '.join(texts)} }}" if texts else "{}"
    if value is None:
        return old
    end = list(_entries(old))[-1].stop if rest else 0
    new = f"{dotted(keys)} = {as_toml(value)}"
    return f"{old[:end]}, {new}{old[end:]}" if rest else f"{{ {new} }}"


def _entries(text: str) -> Iterator[_Entry]:
    """The entries of an inline table, in order."""
    depth, start, value, stop = 0, 0, 0, 0
    for match in TOKEN.finditer(text, 1, len(text) - 1):
        token = match[0]
        if depth == 0 and token == ",":
            yield _entry(text, start, value, stop)
            start = value = stop = 0
        elif not token.isspace():
            start = start or match.start()
            value = value or (match.end() if depth == 0 and token == "=" else 0)
            stop = match.end()
        depth += (token in ("[", "{")) - (token in ("]", "}"))
    if stop:
        yield _entry(text, start, value, stop)


def _entry(text: str, start: int, equals: int, stop: int) -> _Entry:
    value = equals + len(text[equals:stop]) - len(text[equals:stop].lstrip())
    return _Entry(keys_of(text[start : equals - 1]), start, value, stop)


@dataclass(frozen=True, slots=True)
class _Item:
    """An item of a list, and its comments: on lines of their own above it, and behind it."""

    text: str
    above: tuple[str, ...] = ()
    behind: str = ""

    @property
    def parsed(self) -> Any:
        return tomllib.loads(f"x = {self.text}")["x"]


def _list(old: str, values: Sequence[object]) -> str:
    """The text of a new list; items that stay keep their text and their comments."""
    items, below = _items(old)
    if not items:
        return as_toml(values)
    taken = [_taken(items, value) for value in values]
    if "\n" not in old:
        first, last = re.match(r"\[[ \t]*", old), re.search(r"[ \t]*\]\Z", old)
        assert first
        assert last
        return f"{first[0]}{', '.join(item.text for item in taken)}{last[0]}" if taken else "[]"
    end, indent, closing = end_of_line(old), re.search(r"\n([ \t]*)[^\s\]]", old), re.search(r"\n([ \t]*)\]\Z", old)
    margin = indent[1] if indent else "  "
    lines = [line for item in taken for line in (*item.above, f"{item.text},{item.behind}")] + below
    return f"[{end}{''.join(margin + line + end for line in lines)}{closing[1] if closing else ''}]"


def _taken(items: list[_Item], value: Any) -> _Item:
    """The item that says this, or of tables the one whose first key says it, with the rest changed; else a new one."""
    item = next((item for item in items if type(item.parsed) is type(value) and item.parsed == value), None)
    if item is None and isinstance(value, Mapping):
        item = next((item for item in items if _is_like(item.parsed, value)), None)
    if item is None:
        return _Item(as_toml(value))
    items.remove(item)
    entry, text = item.parsed, item.text
    if entry == value:
        return item
    if not entry.keys() <= value.keys():
        return replace(item, text=as_toml(value))
    for key in (key for key in value if key not in entry or entry[key] != value[key]):
        text = _inline(text, (key,), value[key])
    return replace(item, text=text)


def _is_like(item: object, value: Mapping[str, object]) -> bool:
    first = next(iter(value), None)
    return first is not None and isinstance(item, Mapping) and item.get(first) == value[first]


def _items(old: str) -> tuple[list[_Item], list[str]]:
    """The items of a list, and the comments below the last one."""
    items: list[_Item] = []
    above: list[str] = []
    depth, start, stop, is_new_line, space = 0, 0, 0, False, ""

    def close() -> None:
        nonlocal start, stop
        if stop > start:
            items.append(_Item(old[start:stop], tuple(above)))
            above.clear()
        start = stop

    for match in TOKEN.finditer(old, 1, len(old) - 1):
        token = match[0]
        if depth == 0 and token[0] == "#":
            close()
            if is_new_line or not items:
                above.append(token.rstrip())
            else:
                items[-1] = replace(items[-1], behind=space + token.rstrip())
        elif depth == 0 and token == ",":
            close()
        elif not token.isspace():
            start = start if stop > start else match.start()
            stop, is_new_line = match.end(), False
        is_new_line, space = is_new_line or token == "\n", token if token.isspace() else ""
        depth += (token in ("[", "{")) - (token in ("]", "}"))
    close()
    return items, above
