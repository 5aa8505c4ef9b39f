"""TOML with the lines kept: which line a key is on, and which line cannot be read.

`tomllib` gives the values of a document but not where they are. So a document that reads is walked once more, statement by
statement (`contextdb.schema.toml_edit`), when a fault in it has to be placed. Keys of inline tables are not followed: they are on
the line of their statement.
"""

from __future__ import annotations

import re
import tomllib
from collections.abc import Mapping, Sequence

from contextdb.errors import Fault, Place, SchemaError, in_quotes, safe_text
from contextdb.files.toml_shapes import Path as Path

CONFLICT_MARKS = ("<<<<<<<", "|||||||", "=======", ">>>>>>>")
MOST_PARTS = 256
"""A key of more parts, a.b.c, is refused: reading it would cost the square of them."""
MOST_KEYS = 8
"""Deeper keys are placed on the line of their first ones; no section of ours goes as deep."""

_STRING_OR_COMMENT = re.compile(
    r'"""(?:\\.|[^\\])*?(?:"""+|\Z)|\'\'\'.*?(?:\'\'\'+|\Z)|"(?:\\.|[^"\\\n])*"?|\'[^\'\n]*\'?|#[^\n]*', re.DOTALL
)
"""Strings that are not closed count as strings up to where they could end, so that no character is looked at twice."""
_PLACE = re.compile(r"(.*) \(at (?:line (\d+), column (\d+)|end of document)\)", re.DOTALL)

_ACCEPTED = '[section.name], key = "text", key = 1.5, key = ["A", "B"]'
_TWICE = re.compile(r"Cannot (overwrite a value|declare .* twice|mutate immutable .*)", re.DOTALL)

# What people write, and what they mean. Tried in turn; the first that reads is offered.
_LINE_MENDS: tuple[tuple[str, str], ...] = (
    (r"^(\s*[\w.-]+\s*=\s*)True\b", r"\1true"),
    (r"^(\s*[\w.-]+\s*=\s*)False\b", r"\1false"),
    (r"^\s*([\w.-]+)\s*:=?\s*", r"\1 = "),
    (r"$", "]"),
    (r"^", "["),
    (r"$", '"'),
    (r"^\s*\[\s*([\w-]+)\.([^\"'\[\]]*[^\"'\[\]\s])\s*(?:\]\s*)?$", r'[\1."\2"]'),
    (r"^(\s*[\w.-]+\s*=\s*)([^\s\"'\[{][^\"'#]*?)\s*(#.*)?$", r'\1"\2"'),
    (r"([\[,]\s*)([^\s\"'\[\],][^\"'\[\],]*?)(?=\s*[,\]])", r'\1"\2"'),
)


def read_toml(text: str, file: str) -> dict[str, object]:
    """The values of a TOML document. Raises SchemaError with the line that cannot be read, the character in it and what would be
    read in its place."""
    _require_short_keys(text, file)
    try:
        return tomllib.loads(text)
    except RecursionError:
        raise SchemaError(Fault("lists are nested too deeply to be read.", "lists of names", place=Place(file))) from None
    except ValueError as error:  # TOMLDecodeError, and a whole number of too many digits
        raise SchemaError(_syntax_fault(str(error), text, file)) from None


def _require_short_keys(text: str, file: str) -> None:
    """Refuse a key of very many parts; what is in strings and comments does not count."""
    if text.count(".") <= MOST_PARTS:
        return
    line = 1
    for chunk in re.split(r"([=,\[\]{}\n])", _STRING_OR_COMMENT.sub(_bare, text)):
        if chunk.count(".") >= MOST_PARTS:
            problem = f"a key has {chunk.count('.') + 1:,} parts."
            raise SchemaError(Fault(problem, f"at most {MOST_PARTS}, as in [section.name]", place=Place(file, line)))
        line += chunk == "\n"


def _bare(match: re.Match[str]) -> str:
    """A string or a comment, replaced by what keeps its lines."""
    return "\n" * match[0].count("\n") or "q"


def key_lines(text: str) -> dict[Path, int]:
    """The line (from 1) on which each key, and each section, of a document that reads first stands."""
    from contextdb.schema.toml_edit import statements

    lines: dict[Path, int] = {}
    line, at = 1, 0
    for one in statements(text):
        line += text.count("\n", at, one.span[0])
        at = one.span[0]
        for depth in range(1, len(one.path[:MOST_KEYS]) + 1):
            lines.setdefault(one.path[:depth], line)
    return lines


def line_of(path: Path, lines: Mapping[Path, int]) -> int | None:
    """The line of a key, else of the nearest section that holds it."""
    return next((lines[path[:n]] for n in range(len(path), 0, -1) if path[:n] in lines), None)


def _syntax_fault(error: str, text: str, file: str) -> Fault:
    match = _PLACE.fullmatch(error)
    if not match:
        return Fault("a whole number has too many digits to be read.", "a number, such as -1.5", place=Place(file))
    number = int(match[2]) if match[2] else text.rstrip().count("\n") + 1
    lines, place = text.split("\n"), Place(file, number)
    line = lines[number - 1].strip()
    if line.startswith(CONFLICT_MARKS):
        return _conflict_fault(lines[number - 1 :], place)
    if _TWICE.fullmatch(match[1]):
        return Fault(f"{in_quotes(line)} appears twice.", "each section once, and each key once in it", place=place)
    character = f"at character {match[3]}" if match[2] else "the file ends here"
    why = f"{match[1][:1].lower()}{match[1][1:]}, {character}"
    return Fault(f"cannot read {in_quotes(line)} as TOML: {why}.", _ACCEPTED, _line_mend(line[:1000]), place)


def _conflict_fault(lines: Sequence[str], place: Place) -> Fault:
    """The fault of a file that git left between its marks; the lines from the first that is a mark on."""
    start, *_, end = CONFLICT_MARKS
    accepted = "one version of each key"
    if not lines[0].startswith(start):
        return Fault("this line is a conflict mark of git.", accepted, "to delete the line", place)
    last = next((f" and ends on line {n}" for n, line in enumerate(lines, place.line or 1) if line.startswith(end)), "")
    mend = 'to keep one side and delete the lines "<<<<<<<", "=======" and ">>>>>>>"'
    return Fault(f"an unresolved git conflict starts here{last}.", accepted, mend, place)


def _line_mend(line: str) -> str:
    if _reads(line):
        return ""
    mended = (re.sub(pattern, replacement, line) for pattern, replacement in _LINE_MENDS)
    return next((safe_text(m) for m in mended if m != line and _reads(m)), "")


def _reads(line: str) -> bool:
    try:
        tomllib.loads(line)
    except (ValueError, RecursionError):
        return False
    return True
