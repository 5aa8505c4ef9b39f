"""A three-way merge of contextdb.toml, key by key: what theirs changed is written into the text of ours, whose comments stay.

What both sides changed otherwise is between git's marks. Nothing here touches the disk.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

from contextdb.edits.diffing.markers import block
from contextdb.schema.toml_edit import drop_empty_section, drop_key, set_key, statements
from contextdb.schema.toml_lines import read_toml

Path = tuple[str, ...]


@dataclass(frozen=True)
class TomlMerge:
    """The merged text, and the keys on which the sides disagree: there ours holds."""

    text: str
    conflicts: tuple[Path, ...]
    with_markers: str
    """The text with each of them between marks; the same text where there is none."""


def merge_toml(base: str, ours: str, theirs: str, files: tuple[str, str, str] = ("base", "ours", "theirs")) -> TomlMerge:
    """Merge three texts of a contextdb.toml; `files` are their names in messages. Raises SchemaError for a text that is no TOML."""
    was, mine, yours = (dict(_leaves(read_toml(text, file), ())) for text, file in zip((base, ours, theirs), files, strict=True))
    text, conflicts = ours, []
    changed = [path for path in {**yours, **was} if _differs(path, was, yours) and _differs(path, mine, yours)]
    for path in changed:
        if _differs(path, mine, was):
            conflicts.append(path)
        elif path in yours:
            text = set_key(text, path, yours[path], _sections_before(path, theirs))
        else:
            text = drop_empty_section(drop_key(text, path), path[:-1])
    if not conflicts:
        return TomlMerge(text, (), text)
    return TomlMerge(text, tuple(conflicts), _with_markers(text, conflicts, was, yours) or _whole(base, ours, theirs))


def _leaves(part: Mapping[str, object], path: Path) -> Iterator[tuple[Path, object]]:
    """Each key and its value; a section without keys is an empty mapping."""
    for key, value in part.items():
        if isinstance(value, Mapping) and value:
            yield from _leaves(value, (*path, key))
        else:
            yield (*path, key), value


def _differs(path: Path, one: Mapping[Path, object], other: Mapping[Path, object]) -> bool:
    """Whether two documents say otherwise of a key; 1, 1.0 and true are three values."""
    return repr(one.get(path)) != repr(other.get(path))


def _sections_before(path: Path, text: str) -> list[Path]:
    """The sections that are before a key's own in a text, the nearest first."""
    headers = [one.path for one in statements(text) if one.value is None]
    own = headers.index(path[:-1]) if path[:-1] in headers else 0
    return headers[:own][::-1]


def _with_markers(text: str, conflicts: list[Path], was: Mapping[Path, object], yours: Mapping[Path, object]) -> str | None:
    """Each key in question between marks, on lines of its own; None where one has no line of its own in ours."""
    end = "\r\n" if "\r\n" in text else "\n"
    blocks: list[tuple[int, int, str]] = []
    for path in conflicts:
        ours = _statement(text, path)
        others = [_version(text, path, said) for said in (was, yours)]
        if ours is None or None in others:
            return None
        versions = [(version or "").encode() for version in (text[slice(*ours)], *others)]
        blocks.append((*ours, block(versions, end.encode()).decode()))
    for start, stop, marked in sorted(blocks, reverse=True):
        text = text[:start] + marked + text[stop:]
    return text


def _version(text: str, path: Path, said: Mapping[Path, object]) -> str | None:
    """The lines of a key as another version says it."""
    if path not in said:
        return ""
    other = set_key(text, path, said[path])
    found = _statement(other, path)
    return None if found is None else other[slice(*found)]


def _statement(text: str, path: Path) -> tuple[int, int] | None:
    """Where the lines of a key start and stop."""
    found = next((one for one in statements(text) if one.path == path and one.value is not None), None)
    return None if found is None else (found.start, found.stop)


def _whole(base: str, ours: str, theirs: str) -> str:
    end = "\r\n" if "\r\n" in ours else "\n"
    versions = [text if text.endswith("\n") or not text else text + end for text in (ours, base, theirs)]
    return block([text.encode() for text in versions], end.encode()).decode()
