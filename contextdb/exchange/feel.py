"""Cells as unary tests of FEEL, the language of DMN, and back, as far as both can say the same.

    cell                    unary test
    Any  -                  -
    True                    true
    5  <5  >=5  10..30      5  < 5  >= 5  [10..30]
    (10..30)  0..5 | 7      (10..30)  [0..5],7
    CB "Half Back"          "CB","Half Back"
    not CB                  not("CB")
    2026-01-01..            >= date("2026-01-01")

An angle is written as numbers from -180 to 180. What has no counterpart (tags and soft cells here; functions, variables and times
there) is reported by the callers with its place.

Source: OMG, Decision Model and Notation 1.5, chapters 9 (S-FEEL) and 10.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from contextdb.cells.domains import NUMBER, Domain
from contextdb.cells.grammar import format_cell
from contextdb.cells.intervals import CIRCLE, Spans
from contextdb.cells.kinds import KINDS, Kind
from contextdb.cells.sets import Cell, NumberSet, ValueSet
from contextdb.cells.words import NUMBER_TEXT, quoted
from contextdb.expressions.tokens import MOST_CHARACTERS, written_name, written_text

_PART = re.compile(r'"(?:[^"\\]|\\.)*"?|[^,"]+|,', re.DOTALL)
"""A string, also one that is not closed, so that no part of a text is looked at twice; a comma; or what is between."""
STRING = re.compile(r'"(?:[^"\\]|\\.)*"', re.DOTALL)
STRINGS = re.compile(rf"\s*{STRING.pattern}\s*(?:,\s*{STRING.pattern}\s*)*", re.DOTALL)
"""Strings with commas between."""
_ESCAPE = re.compile(r"\\(u[0-9A-Fa-f]{4}|U(?:0[0-9A-Fa-f]|10)[0-9A-Fa-f]{4}|.)", re.DOTALL)
_ESCAPED = {"n": "\n", "r": "\r", "t": "\t"}
_NOT = re.compile(r"not\s*\((.*)\)", re.DOTALL)
_SPELT = [rf'(?:{k.name}\(\s*"{k.spelling.number}"\s*\)|@"{k.spelling.number}")' for k in KINDS.values() if k.is_spelt]
_LITERAL = "|".join([*_SPELT, NUMBER_TEXT])
"""A number of FEEL, or what it writes as date("2026-01-31") or @"2026-01-31"."""
_RANGE = re.compile(rf"([\[\](])\s*({_LITERAL})\s*\.\.\s*({_LITERAL})\s*([\[\])])")
_COMPARED = re.compile(rf"(?:\?\s*(?=[<>=]))?(<=|>=|<|>|=)?\s*({_LITERAL})")


MOST_NOTS = 8
"""How deep not(…) may be in itself; FEEL's own grammar has one level."""


# ---- from FEEL


def strings_of(text: str) -> list[str]:
    """The values of the string literals of a text, in order."""
    return [string_of(part) for part in _PART.findall(text) if len(part) > 1 and STRING.fullmatch(part)]


def cell_of(test: str) -> str | None:
    """The cell that unary tests mean; None for what no cell can say."""
    text, n_nots = test.strip(), 0
    while n_nots <= MOST_NOTS and (match := _NOT.fullmatch(text)):
        text, n_nots = match[1].strip(), n_nots + 1
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
    if match := _COMPARED.fullmatch(part):
        return f"{match[1] or ''}{number_in(match[2])}"
    match = _RANGE.fullmatch(part)
    if not match:
        return None
    low, high = number_in(match[2]), number_in(match[3])
    if any(_is_descending(low, high, kind) for kind in KINDS.values() if kind.is_numeric):
        return None
    left, right = "[" if match[1] == "[" else "(", "]" if match[4] == "]" else ")"
    body = f"{low}..{high}"
    return body if (left, right) == ("[", "]") else f"{left}{body}{right}"


def number_in(literal: str) -> str:
    """A number of FEEL as a cell writes it: without what stands round a date."""
    return next(iter(re.findall(r'"(.*?)"', literal)), literal)


def _is_descending(low: str, high: str, kind: Kind) -> bool:
    """Whether two numbers are such of a type, and the first is above the second."""
    spelling = kind.spelling
    if not (re.fullmatch(spelling.number, low) and re.fullmatch(spelling.number, high)):
        return False
    try:
        return spelling.read(low) > spelling.read(high)
    except ValueError:
        return False


def string_of(literal: str) -> str:
    """The text that a string of FEEL means."""
    text = _ESCAPE.sub(lambda match: _unescaped(match[1]), literal[1:-1])
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


def feel_type(kind: Kind) -> str:
    """The type of FEEL for facts of a kind."""
    return kind.name if kind.is_spelt else "number" if kind.is_numeric else "boolean" if kind.is_truth else "string"


def unary_tests(cell: Cell, domain: Domain) -> str | None:
    """The unary tests that mean the same as a cell; None for what they cannot say: tags, penalties, cells that nothing matches."""
    if cell.is_any:
        return "-"
    if cell.is_soft or cell.is_empty:
        return None
    if isinstance(cell.accepts, NumberSet):
        line = NUMBER if domain.type.is_circular else domain
        spans = _with_half_turn(cell.accepts.spans) if domain.type.is_circular else cell.accepts.spans
        written = format_cell(Cell(NumberSet(spans)), line).split(" | ")
        parts = [_number_test(part, line.type) for part in written]
        return None if None in parts else ",".join(part for part in parts if part is not None)
    return _values_test(cell.accepts) if isinstance(cell.accepts, ValueSet) else None


def _with_half_turn(spans: Spans) -> Spans:
    """The spans of a set of angles for who does not wrap them: 180 is in them where -180 is."""
    *others, (low, high) = spans
    if spans[0][0] > CIRCLE[0]:
        return spans
    return (*others, (low, 180.0)) if high == CIRCLE[1] else (*spans, (180.0, 180.0))


def feel_number(number: float, kind: Kind) -> str:
    return _written(kind.spelling.write(number), kind)


def _written(text: str, kind: Kind) -> str:
    return f"{kind.name}({literal(text)})" if kind.is_spelt else text


def _number_test(part: str, kind: Kind) -> str | None:
    number = kind.spelling.number
    match = re.fullmatch(rf"([\[(]?)({number})?\.\.({number})?([\])]?)", part)
    if not match:
        return _written(part, kind) if re.fullmatch(number, part) and "inf" not in part else None
    left, low, high, right = match[1], *(text and _written(text, kind) for text in (match[2], match[3])), match[4]
    if "inf" in part:
        return None
    if low is None or high is None:
        sign = (">" if left == "(" else ">=") if high is None else ("<" if right == ")" else "<=")
        return f"{sign} {low if high is None else high}"
    return f"{left or '['}{low}..{high}{right or ']'}"


def _values_test(accepts: ValueSet) -> str | None:
    words = [str(v).lower() if isinstance(v, bool) else literal(v) for v in sorted(accepts.values, key=str)]
    return f"not({','.join(words)})" if accepts.is_complement else ",".join(words)


def literal(text: str) -> str:
    """A text as a string literal of FEEL."""
    plain = text.replace("\\", "\\\\").replace('"', '\\"').replace("\n", "\\n").replace("\r", "\\r").replace("\t", "\\t")
    return f'"{plain}"'


# ---- unary tests of FEEL that no cell can say, as rules of a row: expressions over facts. input unary tests rule speed >
# limit + 1 speed > limit + 1 speed [low..high), top speed >= low and speed < high or speed == top speed not(limit) not (speed
# == limit) speed ? > 3 and ? < max speed > 3 and speed < max Names of facts may have blanks in them, as in FEEL: those that
# are known are found, the longest first. Functions, dates, lists and `null` have no counterpart. Source: OMG, Decision Model
# and Notation 1.5, 10.3 (grammar of FEEL)

MOST_TOKENS = 400
"""A longer test is not a rule; so no test is looked at for long."""

_TOKEN = re.compile(
    r'\s*(?:(?P<text>"(?:[^"\\]|\\.)*")|(?P<number>\d+(?:\.(?!\.)\d+)?|\.\d+)|(?P<sign>\.\.|<=|>=|!=|\*\*|[-+*/<>=()\[\],?])'
    r"|(?P<word>[^\W\d]\w*(?:\.[^\W\d]\w*)*))",
    re.DOTALL,
)
_RULE_COMPARED = ("<", "<=", ">", ">=", "=", "!=")
_WORDS = {"true": "True", "false": "False", "and": "and", "or": "or", "not": "not"}
_LEFT, _RIGHT = {"[": ">=", "(": ">", "]": ">"}, {"]": "<=", ")": "<", "[": "<"}


@dataclass(frozen=True, slots=True)
class _Token:
    """A word of FEEL: as it is written, and as an expression has it."""

    source: str
    written: str
    is_sign: bool = False


class _NoRuleError(Exception):
    """The test has no counterpart."""


def rule_of(test: str, fact: str, known: Sequence[str]) -> tuple[str, list[str]] | None:
    """The rule that unary tests of a fact mean, and the facts that it names beside; None for what no expression says. The test may
    use the facts whose names are `known`."""
    if len(test) > MOST_CHARACTERS:
        return None
    named = list[str]()
    try:
        tokens = list(_tokens(test, sorted(known, key=len, reverse=True), named))
        return _tests(tokens, written_name(fact)), named
    except _NoRuleError:
        return None


def _tokens(text: str, known: Sequence[str], named: list[str]) -> Iterator[_Token]:
    at, n = 0, 0
    end = len(text.rstrip())
    while at < end:
        at += len(text[at:]) - len(text[at:].lstrip())
        n += 1
        match = _TOKEN.match(text, at)
        name = next((one for one in known if _stands_at(text, at, one)), None)
        if n > MOST_TOKENS or (match is None and name is None):
            raise _NoRuleError
        if name is not None:
            named.append(name)
            at += len(name)
            yield _Token(name, written_name(name))
            continue
        assert match is not None
        at = match.end()
        yield _token(match)


def _token(match: re.Match[str]) -> _Token:
    if (text := match["text"]) is not None:
        return _Token(text, written_text(string_of(text)))
    if (number := match["number"]) is not None:
        return _Token(number, number)
    if (sign := match["sign"]) is not None:
        return _Token(sign, "==" if sign == "=" else sign, True)
    if match["word"] not in _WORDS:  # a name that nobody gives, or a function
        raise _NoRuleError
    return _Token(match["word"], _WORDS[match["word"]], True)


def _stands_at(text: str, at: int, name: str) -> bool:
    """Whether a name is at a place, and ends there."""
    after = text[at + len(name) : at + len(name) + 1]
    return bool(name) and text.startswith(name, at) and not (after.isalnum() or after in ("_", "("))


def _tests(tokens: Sequence[_Token], fact: str) -> str:
    """Tests between commas: one of them must hold."""
    parts = list(_split_rules(tokens))
    rules = [_test(part, fact) for part in parts]
    return rules[0] if len(rules) == 1 else " or ".join(rules)


def _split_rules(tokens: Sequence[_Token]) -> Iterator[Sequence[_Token]]:
    depth, start = 0, 0
    for at, token in enumerate(tokens):
        depth += (token.source == "(" and token.is_sign) - (token.source == ")" and token.is_sign)
        if token.source == "," and token.is_sign and depth <= 0:
            yield tokens[start:at]
            start = at + 1
    yield tokens[start:]


def _test(tokens: Sequence[_Token], fact: str) -> str:
    signs = [token.source if token.is_sign else "" for token in tokens]
    if not tokens:
        raise _NoRuleError
    if signs[:2] == ["not", "("] and signs[-1] == ")" and _closes(signs, 1) == len(signs) - 1:
        return f"not ({_tests(tokens[2:-1], fact)})"
    if "?" in signs:
        return f"({_rule_written(tokens, fact)})"
    if signs[0] in _RULE_COMPARED:
        return f"{fact} {tokens[0].written} {_rule_written(tokens[1:])}"
    if ".." in signs:
        return _interval(tokens, signs, fact)
    return f"{fact} == {_rule_written(tokens)}"


def _interval(tokens: Sequence[_Token], signs: Sequence[str], fact: str) -> str:
    if signs.count("..") != 1 or signs[0] not in _LEFT or signs[-1] not in _RIGHT:
        raise _NoRuleError
    at = signs.index("..")
    low, high = _rule_written(tokens[1:at]), _rule_written(tokens[at + 1 : -1])
    return f"{fact} {_LEFT[signs[0]]} {low} and {fact} {_RIGHT[signs[-1]]} {high}"


def _closes(signs: Sequence[str], at: int) -> int:
    """Where the bracket that opens at a place is closed."""
    depth = 0
    for place in range(at, len(signs)):
        depth += (signs[place] == "(") - (signs[place] == ")")
        if depth == 0:
            return place
    return -1


def _rule_written(tokens: Sequence[_Token], fact: str | None = None) -> str:
    """An expression of FEEL as one of ours, with the fact for each `?`; whether it reads is for the caller to check."""
    if not tokens or any(token.is_sign and token.source in (",", "[", "]", "..") for token in tokens):
        raise _NoRuleError
    if fact is None and any(token.is_sign and token.source in (*_RULE_COMPARED, "?", "and", "or", "not") for token in tokens):
        raise _NoRuleError
    return " ".join((fact or "") if token.is_sign and token.source == "?" else token.written for token in tokens)
