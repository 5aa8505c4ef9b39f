"""Change single keys of a TOML text; every other byte stays as it is: comments, order, spaces, line ends.

A text that reads is cut into its statements: section headers and `key = value`. A key is found under whichever form it is written
in: `[tables.a]` and `policy = …`, dotted (`tables.a.policy = …`), or in an inline table. Changing one replaces its value alone; a
new one is behind the last key of its section, a new section behind another one. `contextdb.schema.toml_edit` writes the
values. Nothing here reads a file; whether the text then says what it should is for the caller to check.

Nothing here knows where in a file a value stands.
"""

from __future__ import annotations

import re
import tomllib
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Any

from contextdb.files.toml_shapes import Path, as_toml, dotted


@dataclass(frozen=True, slots=True)
class Statement:
    """A section header or `key = value`: its whole path, that of the section it is in, and where it is in the text."""

    path: Path
    section: Path
    start: int
    """Where its first line starts."""
    stop: int
    """Where the line after its last one starts."""
    span: tuple[int, int]
    """Where it starts and stops without the space and the comment around it."""
    value: tuple[int, int] | None = None
    """Where the value starts and stops; None for a header."""


def statements(text: str) -> list[Statement]:
    """The statements of a text that reads, in order."""
    return list(_statements(text))


def set_key(text: str, path: Path, value: object, behind: Sequence[Path] = ()) -> str:
    """The text with a key set. A section that is missing yet is put behind the last of those of `behind`, else at the end."""
    present = statements(text)
    for one in present:
        if one.value and one.path == path[: len(one.path)]:
            return _replaced(text, one.value, merged(text[slice(*one.value)], path[len(one.path) :], value))
    part = path[:-1]
    below = [one for one in present if one.path[: len(path)] == path]
    if below:  # an array of tables, [[a.b]], or a table of its own, [a.b] or a.b.key = …: one value in its place
        return set_key(_without(text, below), path, value, behind)
    inside = [one for one in present if one.path[: len(part)] == part and len(one.section) <= len(part)]
    if inside:
        last = inside[-1]
        key = path[len(last.section) :] if last.value else path[len(last.path) :]
        return _inserted(text, last.stop, [_indent(text, last) + f"{dotted(key)} = {as_toml(value)}"])
    if not part:  # before the first header, above which no key is
        at = present[0].start if present else len(text)
        return _inserted(text, at, [f"{dotted(path)} = {as_toml(value)}", *([""] if present else [])])
    at = _end_of_section(text, present, behind)
    blank = [""] if text[:at].strip() else []
    return _inserted(text, at, [*blank, f"[{dotted(part)}]", f"{dotted(path[-1:])} = {as_toml(value)}"])


def set_in_list(text: str, path: Path, place: int, key: str, value: object) -> str:
    """The text with a key set in one of a list of tables, however the list is written: in one value, or as [[a.b]]."""
    present = statements(text)
    heads = [i for i, one in enumerate(present) if one.path == path and one.value is None]
    if not heads:
        items: Any = tomllib.loads(text)
        for name in path:
            items = items[name]
        return set_key(text, path, [{**item, key: value} if i == place else item for i, item in enumerate(items)])
    inside = [present[heads[place]]]
    for one in present[heads[place] + 1 :]:
        if one.value is None:
            break
        inside.append(one)
    for one in inside:
        if one.value and one.path == (*path, key):
            return _replaced(text, one.value, as_toml(value))
    return _inserted(text, inside[-1].stop, [_indent(text, inside[-1]) + f"{dotted((key,))} = {as_toml(value)}"])


def add_sections(text: str, sections: Mapping[Path, Mapping[str, object]], behind: Sequence[Path] = ()) -> str:
    """The text with sections that it does not have yet, one behind the other, where `set_key` would put the first of them."""
    at = _end_of_section(text, statements(text), behind)
    lines: list[str] = []
    for part, keys in sections.items():
        lines += [""] if lines or text[:at].strip() else []
        lines += [f"[{dotted(part)}]", *(f"{dotted((key,))} = {as_toml(value)}" for key, value in keys.items())]
    return _inserted(text, at, lines)


def absent(text: str, paths: Sequence[Path]) -> list[Path]:
    """Those of some sections of which nothing is in the text, in whichever form."""
    present = statements(text)
    prefixes = {one.path[:depth] for one in present for depth in range(1, len(one.path) + 1)}
    whole = {one.path for one in present if one.value}
    return [path for path in paths if path not in prefixes and not any(path[:depth] in whole for depth in range(1, len(path)))]


def drop_key(text: str, path: Path) -> str:
    """The text without a key, or without a whole section."""
    present = statements(text)
    for one in present:
        if one.value and len(one.path) < len(path) and one.path == path[: len(one.path)]:
            return _replaced(text, one.value, merged(text[slice(*one.value)], path[len(one.path) :], None))
    return _without(text, [one for one in present if one.path[: len(path)] == path])


def drop_empty_section(text: str, path: Path) -> str:
    """The text without a section in which nothing stands any more."""
    for one in statements(text):
        if one.value and one.path == path[: len(one.path)]:
            inner: Any = {one.path[-1]: tomllib.loads(f"x = {text[slice(*one.value)]}")["x"]}
            for key in path[len(one.path) - 1 :]:
                inner = inner.get(key, ...)
            return drop_key(text, path) if inner == {} else text
    inside = [one for one in statements(text) if one.path[: len(path)] == path]
    return _without(text, inside) if len(inside) == 1 and inside[0].value is None else text


def has_comment(text: str, path: Path) -> bool:
    """Whether a comment is behind a key, on its line."""
    return any(one.path == path and text[one.span[1] : one.stop].strip() for one in statements(text))


def rename_section(text: str, path: Path, new: Path) -> str | None:
    """The text with another path in the header of a section; None where the section is not written with one header."""
    inside = [one for one in statements(text) if one.path[: len(path)] == path]
    if not inside or inside[0].value is not None or any(one.section != path for one in inside):
        return None
    return _replaced(text, inside[0].span, f"[{dotted(new)}]")


# ---- statements


def _statements(text: str) -> Iterator[Statement]:
    depth, line, first = 0, 0, 0
    section: Path = ()
    tokens: list[tuple[str, int]] = []
    for match in TOKEN.finditer(text if text.endswith("\n") else text + "\n"):
        token = match[0]
        depth += (token in ("[", "{")) - (token in ("]", "}"))
        if token == "\n" and depth == 0:
            if tokens:
                one = _statement(tokens, section, first, min(match.end(), len(text)))
                section = one.section if one.value else one.path
                yield one
            tokens = []
        elif not token.isspace() and token[0] != "#":
            first = first if tokens else line
            tokens.append((token, match.start()))
        if token == "\n":
            line = match.end()


def _statement(tokens: Sequence[tuple[str, int]], section: Path, start: int, stop: int) -> Statement:
    words = [token for token, _ in tokens]
    end = tokens[-1][1] + len(words[-1])
    span = (tokens[0][1], end)
    if words[0] == "[":
        path = keys_of("".join(words).strip("[]"))
        return Statement(path, path, start, stop, span)
    equals = words.index("=")
    return Statement(section + keys_of("".join(words[:equals])), section, start, stop, span, (tokens[equals + 1][1], end))


def _end_of_section(text: str, present: Sequence[Statement], paths: Sequence[Path]) -> int:
    """Where the last of some sections ends: before the next header, or with the last statement. Without one of them, at the end."""
    wanted, depths = set(paths), {len(path) for path in paths}
    anchors = [i for i, one in enumerate(present) if any(one.path[:depth] in wanted for depth in depths)]
    last = anchors[-1] if anchors else len(present) - 1
    while last + 1 < len(present) and present[last + 1].value is not None:
        last += 1
    return present[last].stop if present else len(text)


# ---- lines


def _indent(text: str, one: Statement) -> str:
    line = text[one.start : one.stop]
    return line[: len(line) - len(line.lstrip(" \t"))]


def _inserted(text: str, at: int, lines: Sequence[str]) -> str:
    """The text with new lines; a text whose last line has no end keeps to that."""
    end = end_of_line(text)
    before, after = text[:at], text[at:]
    if before and not before.endswith("\n"):
        return before + "".join(end + line for line in lines) + after
    return before + "".join(line + end for line in lines) + after


def _without(text: str, gone: Sequence[Statement]) -> str:
    """The text without some statements; with a section goes what is between its lines, and one blank line before it."""
    for start, stop in reversed(list(_spans(text, gone))):
        before, after = text[:start], text[stop:]
        if not after and not text.endswith("\n"):
            before = before.removesuffix("\n").removesuffix("\r")
        text = before + after
    return text


def _spans(text: str, gone: Sequence[Statement]) -> Iterator[tuple[int, int]]:
    is_gone = {one.start for one in gone}
    runs: list[list[Statement]] = []
    for one in statements(text):
        if one.start not in is_gone:
            runs.append([])
        elif not runs or one.value is None:
            runs.append([one])
        else:
            runs[-1].append(one)
    for run in (run for run in runs if run):
        if run[0].value is not None:
            yield from ((one.start, one.stop) for one in run)
            continue
        start = run[0].start
        blank = re.search(r"(?:\A|(?<=\n))[ \t]*\r?\n\Z", text[:start])
        yield (blank.start() if blank else start), run[-1].stop


def _replaced(text: str, span: tuple[int, int], new: str) -> str:
    return text[: span[0]] + new + text[span[1] :]


# ---- values of a TOML text: written, and changed in place so that what stays in a list or an inline table keeps its text and
# comments


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
