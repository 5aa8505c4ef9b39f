"""Unary tests of FEEL that no cell can say, as rules of a row: expressions over facts.

    input    unary tests         rule
    speed    > limit + 1         speed > limit + 1
    speed    [low..high), top    speed >= low and speed < high or speed == top
    speed    not(limit)          not (speed == limit)
    speed    ? > 3 and ? < max   speed > 3 and speed < max

Names of facts may have blanks in them, as in FEEL: those that are known are found, the longest first. Functions, dates, lists and
`null` have no counterpart.

Source: OMG, Decision Model and Notation 1.5, 10.3 (grammar of FEEL).
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from contextdb.exchange.feel import string_of
from contextdb.expressions.tokens import MOST_CHARACTERS, written_name, written_text

MOST_TOKENS = 400
"""A longer test is not a rule; so no test is looked at for long."""

_TOKEN = re.compile(
    r'\s*(?:(?P<text>"(?:[^"\\]|\\.)*")|(?P<number>\d+(?:\.(?!\.)\d+)?|\.\d+)|(?P<sign>\.\.|<=|>=|!=|\*\*|[-+*/<>=()\[\],?])'
    r"|(?P<word>[^\W\d]\w*(?:\.[^\W\d]\w*)*))",
    re.DOTALL,
)
_COMPARED = ("<", "<=", ">", ">=", "=", "!=")
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
    parts = list(_split(tokens))
    rules = [_test(part, fact) for part in parts]
    return rules[0] if len(rules) == 1 else " or ".join(rules)


def _split(tokens: Sequence[_Token]) -> Iterator[Sequence[_Token]]:
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
        return f"({_written(tokens, fact)})"
    if signs[0] in _COMPARED:
        return f"{fact} {tokens[0].written} {_written(tokens[1:])}"
    if ".." in signs:
        return _interval(tokens, signs, fact)
    return f"{fact} == {_written(tokens)}"


def _interval(tokens: Sequence[_Token], signs: Sequence[str], fact: str) -> str:
    if signs.count("..") != 1 or signs[0] not in _LEFT or signs[-1] not in _RIGHT:
        raise _NoRuleError
    at = signs.index("..")
    low, high = _written(tokens[1:at]), _written(tokens[at + 1 : -1])
    return f"{fact} {_LEFT[signs[0]]} {low} and {fact} {_RIGHT[signs[-1]]} {high}"


def _closes(signs: Sequence[str], at: int) -> int:
    """Where the bracket that opens at a place is closed."""
    depth = 0
    for place in range(at, len(signs)):
        depth += (signs[place] == "(") - (signs[place] == ")")
        if depth == 0:
            return place
    return -1


def _written(tokens: Sequence[_Token], fact: str | None = None) -> str:
    """An expression of FEEL as one of ours, with the fact for each `?`; whether it reads is for the caller to check."""
    if not tokens or any(token.is_sign and token.source in (",", "[", "]", "..") for token in tokens):
        raise _NoRuleError
    if fact is None and any(token.is_sign and token.source in (*_COMPARED, "?", "and", "or", "not") for token in tokens):
        raise _NoRuleError
    return " ".join((fact or "") if token.is_sign and token.source == "?" else token.written for token in tokens)
