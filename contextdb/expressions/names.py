"""The names of facts in the text of an expression, without reading what it says of them."""

from __future__ import annotations

from collections.abc import Container, Iterator, Mapping
from itertools import pairwise

from contextdb.expressions.tokens import RESERVED, Refusal, Token, tokens_of, written_name


def names_in(text: str) -> tuple[str, ...]:
    """The names of facts in a text, in the order of their first mention; none in one that cannot be taken apart."""
    return tuple(dict.fromkeys(token.value for token in _names(text)))


def unknown_in(text: str, known: Container[str]) -> tuple[str, int] | None:
    """The first name of a fact that is not known, and the character from 0 where it is."""
    return next(((token.value, token.start) for token in _names(text) if token.value not in known), None)


def with_names(text: str, new_names: Mapping[str, str]) -> str:
    """The text with facts under other names; every other character stays. One that cannot be taken apart stays as it is."""
    for token in reversed(list(_names(text))):
        if token.value in new_names:
            text = text[: token.start] + written_name(new_names[token.value]) + text[token.stop :]
    return text


def _names(text: str) -> Iterator[Token]:
    try:
        tokens = tokens_of(text)
    except Refusal:
        return
    for token, after in pairwise(tokens):
        if token.kind == "name" and not (token.is_bare and (token.text in RESERVED or after.text == "(")):
            yield token
