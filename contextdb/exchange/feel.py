"""Cells as unary tests of FEEL, the language of DMN, and back, as far as both can say the same.

    cell                    unary test
    Any  -                  -
    True                    true
    5  <5  >=5  10..30      5  < 5  >= 5  [10..30]
    (10..30)  0..5 | 7      (10..30)  [0..5],7
    CB "Half Back"          "CB","Half Back"
    not CB                  not("CB")

An angle is told by its numbers from -180 to 180. What has no counterpart (tags and soft cells here; functions, variables and dates
there) is told by the callers with its place.

Source: OMG, Decision Model and Notation 1.5, chapters 9 (S-FEEL) and 10.
"""

from __future__ import annotations

import re
from collections.abc import Iterator

from contextdb.cells.domains import NUMBER
from contextdb.cells.grammar import Cell, NumberSet, ValueSet, format_cell
from contextdb.cells.words import NUMBER_TEXT, quoted

_PART = re.compile(r'"(?:[^"\\]|\\.)*"?|[^,"]+|,', re.DOTALL)
"""A string, also one that is not closed, so that no part of a text is looked at twice; a comma; or what is between."""
STRING = re.compile(r'"(?:[^"\\]|\\.)*"', re.DOTALL)
"""A string of FEEL."""
STRINGS = re.compile(rf"\s*{STRING.pattern}\s*(?:,\s*{STRING.pattern}\s*)*", re.DOTALL)
"""Strings with commas between."""
_ESCAPE = re.compile(r"\\(u[0-9A-Fa-f]{4}|U(?:0[0-9A-Fa-f]|10)[0-9A-Fa-f]{4}|.)", re.DOTALL)
_ESCAPED = {"n": "\n", "r": "\r", "t": "\t"}
_NOT = re.compile(r"not\s*\((.*)\)", re.DOTALL)
_RANGE = re.compile(rf"([\[\](])\s*({NUMBER_TEXT})\s*\.\.\s*({NUMBER_TEXT})\s*([\[\])])")
_COMPARED = re.compile(rf"(?:\?\s*(?=[<>=]))?(<=|>=|<|>|=)?\s*({NUMBER_TEXT})")
_OURS = re.compile(rf"([\[(]?)({NUMBER_TEXT})?\.\.({NUMBER_TEXT})?([\])]?)")


MOST_NOTS = 8
"""How deep not(…) may be in itself; FEEL's own grammar has one level."""


# ---- from FEEL


def strings_of(text: str) -> list[str]:
    """The texts of the strings in a text, in order."""
    return [string_of(part) for part in _PART.findall(text) if len(part) > 1 and STRING.fullmatch(part)]


def cell_of(test: str) -> str | None:
    """The cell that unary tests mean; None for what no cell can say."""
    text, n_nots = test.strip(), 0
    while n_nots <= MOST_NOTS and (found := _NOT.fullmatch(text)):
        text, n_nots = found[1].strip(), n_nots + 1
    cell = None if n_nots > MOST_NOTS else _plain_cell(text)
    return None if cell is None or (n_nots and cell == "-") else "not " * n_nots + cell


def _plain_cell(text: str) -> str | None:
    if text in ("", "-"):
        return "-"
    parts = list(_split(text))
    if all(STRING.fullmatch(part) for part in parts):
        return " ".join(quoted(string_of(part)) for part in parts)
    if all(part in ("true", "false") for part in parts):
        return parts[0].capitalize() if len(set(parts)) == 1 else "-"
    numbers = [_number_part(part) for part in parts]
    return None if None in numbers else " | ".join(part for part in numbers if part is not None)


def _split(text: str) -> Iterator[str]:
    """The tests between commas that are outside quotes."""
    part = ""
    for token in _PART.findall(text):
        if token == ",":
            yield part.strip()
            part = ""
        else:
            part += token
    yield part.strip()


def _number_part(part: str) -> str | None:
    if "inf" in part.casefold():  # a name like any other to FEEL
        return None
    if found := _COMPARED.fullmatch(part):
        return f"{found[1] or ''}{found[2]}"
    found = _RANGE.fullmatch(part)
    if not found or float(found[2]) > float(found[3]):
        return None
    left, right = "[" if found[1] == "[" else "(", "]" if found[4] == "]" else ")"
    body = f"{found[2]}..{found[3]}"
    return body if (left, right) == ("[", "]") else f"{left}{body}{right}"


def string_of(literal: str) -> str:
    """The text that a string of FEEL means."""
    text = _ESCAPE.sub(lambda found: _unescaped(found[1]), literal[1:-1])
    return text.encode("utf-16", "surrogatepass").decode("utf-16", "replace")  # two halves of a pair are one character


def _unescaped(escape: str) -> str:
    return chr(int(escape[1:], 16)) if len(escape) > 1 else _ESCAPED.get(escape, escape)


def value_of(expression: str) -> str | None:
    """The text of a literal: of an output; None for an expression that must be worked out."""
    text = expression.strip()
    if text in ("", "null"):
        return ""
    if STRING.fullmatch(text):
        return string_of(text)
    if text in ("true", "false"):
        return text.capitalize()
    return text if re.fullmatch(NUMBER_TEXT, text) and "inf" not in text.casefold() else None


# ---- to FEEL


def unary_tests(cell: Cell) -> str | None:
    """The unary tests that mean the same as a cell; None for what they cannot say: tags, penalties, cells that nothing matches."""
    if cell.is_any:
        return "-"
    if cell.is_soft or cell.is_empty:
        return None
    if isinstance(cell.accepts, NumberSet):
        parts = [_number_test(part) for part in format_cell(Cell(NumberSet(cell.accepts.spans)), NUMBER).split(" | ")]
        return None if None in parts else ",".join(part for part in parts if part is not None)
    return _values_test(cell.accepts) if isinstance(cell.accepts, ValueSet) else None


def _number_test(part: str) -> str | None:
    found = _OURS.fullmatch(part)
    if not found:
        return part if re.fullmatch(NUMBER_TEXT, part) and "inf" not in part else None
    left, low, high, right = found.groups()
    if "inf" in part:
        return None
    if low is None or high is None:
        sign = (">" if left == "(" else ">=") if high is None else ("<" if right == ")" else "<=")
        return f"{sign} {low if high is None else high}"
    return f"{left or '['}{low}..{high}{right or ']'}"


def _values_test(accepts: ValueSet) -> str | None:
    words = [str(v).lower() if isinstance(v, bool) else literal(v) for v in sorted(accepts.values, key=str)]
    if not words:
        return "-"  # all but none
    return f"not({','.join(words)})" if accepts.is_complement else ",".join(words)


def literal(text: str) -> str:
    """A text as a string of FEEL."""
    plain = text.replace("\\", "\\\\").replace('"', '\\"').replace("\n", "\\n").replace("\r", "\\r").replace("\t", "\\t")
    return f'"{plain}"'
