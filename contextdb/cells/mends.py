"""What people type into cells, and what they mean: candidates for "did you mean".

Each mend is tried by itself, then all of them in a row.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from difflib import SequenceMatcher
from functools import lru_cache

from contextdb.cells.domains import Domain
from contextdb.cells.kinds import Spelling
from contextdb.cells.words import quoted
from contextdb.errors import nearest

CLOSE = 0.85
"""From this likeness on a cell of several words is taken for one value that lacks its quotes."""

MOST_WORDS = 24
"""The words of a longer cell are not compared with the declared values."""

_Mends = tuple[tuple[str, str | Callable[[re.Match[str]], str]], ...]


def _as_interval(match: re.Match[str]) -> str:
    """ ">= 1 and < 5" as "[1..5)"."""
    low, first, high, last = match.groups()
    is_closed = len(low) == len(high) == 2
    return f"{first}..{last}" if is_closed else f"{'[' if len(low) == 2 else '('}{first}..{last}{']' if len(high) == 2 else ')'}"


@lru_cache
def _number_mends(spelling: Spelling) -> _Mends:
    """What people write for cells of numbers."""
    number = spelling.number
    return (
        *spelling.mends,
        (r"[−–—]", "-"),
        (r"\s*;\s*", ", "),
        (r"≤|=<", "<="),
        (r"≥|=>", ">="),
        (r"\+\s*/\s*-|±\s*-", "±"),
        (r"\.{3,}|…", ".."),
        (rf"(>=?)\s*({number})\s*(?:,|&&?|and)?\s*(<=?)\s*({number})", _as_interval),
        (r"\b(?:or|OR)\b|/|\|\|", "|"),
        (r"!=\s*|<>\s*|≠\s*", "not "),
        (r"°|\b(?:deg|degrees|m/s|m|s|cm|km/h)\b", ""),
        (rf"(?<!\d)({number})\s*(?:-|to|:)\s*({number})", r"\1..\2"),
        (r"(?<=\d),(?=\d)", "."),
        (r"^\s*±\s*", "0 ± "),
        (r"^\*$|^(?i:all|every|none|null|n/a)$", "Any"),
        (r"[\[\](){}\"']", ""),
    )


_WORD_MENDS: _Mends = (
    (r"\s*[,;|/]\s*", " "),
    (r"\b(?:or|OR|and|AND)\b\s*", ""),
    (r"!=?\s*|<>\s*", "not "),
    (r"^\*$|^(?i:all|every|null|n/a)$", "Any"),
    (r"'", '"'),
)
_TRUTH_MENDS: _Mends = (
    (r"^(?i:tru|ture|treu|y|ja|on|x|wahr|vrai)$", "True"),
    (r"^(?i:fals|flase|fasle|n|nein|off|falsch|faux)$", "False"),
    (r"^[\"'=\s]+|[\"'\s]+$", ""),
    (r"^!\s*", "not "),
    (r"^\*$|^(?i:all|either|both|null|n/a)$", "Any"),
)


def candidates(text: str, domain: Domain) -> Iterator[str]:
    """Texts near to one that cannot be read, the likeliest first; whether one reads is for the caller to try."""
    rules = _number_mends(domain.type.spelling) if domain.type.is_numeric else _TRUTH_MENDS if domain.type.is_truth else _WORD_MENDS
    for pattern, replacement in rules:
        yield re.sub(pattern, replacement, text).strip()
    changed = text
    for pattern, replacement in rules:
        changed = re.sub(pattern, replacement, changed).strip()
        yield changed
    if (domain.type.is_named or domain.type.is_tags) and "~" not in text:
        yield from _word_mends(text, domain)


def _word_mends(text: str, domain: Domain) -> Iterator[str]:
    """The words of an enum, text or tags cell, each spelt as the nearest declared value, quoted and signed as it must be."""
    known = domain.values or ()
    body = text.strip()
    negation = "not " if body[:4].casefold() == "not " else ""
    body = body[len(negation) :]
    whole = nearest(body.strip("\"' +"), known)
    is_close = whole is not None and SequenceMatcher(None, whole.casefold(), body.strip("\"' +").casefold()).ratio() > CLOSE
    signed = [_signed(w, domain) for w in re.split(r"[\s,;|\"']+", body) if w.strip("+-!")]
    if whole is not None and is_close and len(signed) > 1:
        yield negation + _sign(body, domain) + quoted(whole)
    yield negation + " ".join(sign + quoted(word) for sign, word in signed)
    if len(signed) <= MOST_WORDS:
        yield negation + " ".join(sign + quoted(nearest(word, known) or word) for sign, word in signed)
    if whole is not None:
        yield negation + _sign(body, domain) + quoted(whole)
    if body.strip('"'):
        yield negation + quoted(body.strip('"'))


def _signed(word: str, domain: Domain) -> tuple[str, str]:
    return (_sign(word, domain), word.strip("+-!")) if domain.type.is_tags else ("", word.strip("+!"))


def _sign(word: str, domain: Domain) -> str:
    return "" if not domain.type.is_tags else "-" if word[:1] in ("-", "!") else "+"
