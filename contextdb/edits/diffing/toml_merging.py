"""A three-way merge of contextdb.toml, key by key: what theirs changed is written into the text of ours, whose comments stay.

What both sides changed otherwise is between git's marks. Nothing here touches the disk.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
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
    changed = [path for path in {**yours, **was} if _differs(path, was, yours) and _differs(path, mine, yours)]
    conflicts = [path for path in changed if _differs(path, mine, was)]
    gone = [path for path in changed if path not in yours and not _differs(path, mine, was)]
    new = {path: yours[path] for path in changed if path in yours}
    if _has_clash({path: mine[path] for path in mine.keys() - set(gone)} | new):
        return TomlMerge(ours, tuple(changed), _whole(base, ours, theirs))
    text, parts = ours, _parts(new)
    for path in (path for path in gone if path in parts):  # a value that is a section now
        text = drop_key(text, path)
    for path in (path for path in new if path not in conflicts):
        text = set_key(text, path, new[path], _sections_before(path, theirs))
    for path in (path for path in gone if path not in parts):
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


def _has_clash(values: Mapping[Path, object]) -> bool:
    """Whether a name has a value and is a section too."""
    return any(values[path] != {} for path in _parts(values) & values.keys())


def _parts(paths: Iterable[Path]) -> set[Path]:
    """The sections above some keys."""
    return {path[:depth] for path in paths for depth in range(1, len(path))}


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
        others = [_version(text, path, values) for values in (was, yours)]
        if ours is None or None in others:
            return None
        versions = [(version or "").encode() for version in (text[slice(*ours)], *others)]
        blocks.append((*ours, block(versions, end.encode()).decode()))
    for start, stop, marked in sorted(blocks, reverse=True):
        text = text[:start] + marked + text[stop:]
    return text


def _version(text: str, path: Path, values: Mapping[Path, object]) -> str | None:
    """The lines of a key as another version says it."""
    if path not in values:
        return ""
    other = set_key(text, path, values[path])
    span = _statement(other, path)
    return None if span is None else other[slice(*span)]


def _statement(text: str, path: Path) -> tuple[int, int] | None:
    """Where the lines of a key start and stop."""
    match = next((one for one in statements(text) if one.path == path and one.value is not None), None)
    return None if match is None else (match.start, match.stop)


def _whole(base: str, ours: str, theirs: str) -> str:
    end = "\r\n" if "\r\n" in ours else "\n"
    versions = [text if text.endswith("\n") or not text else text + end for text in (ours, base, theirs)]
    return block([text.encode() for text in versions], end.encode()).decode()
