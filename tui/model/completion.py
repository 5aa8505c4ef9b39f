"""The words of a cell that names values: which one is being typed, what it may become, and which values are named.

A text is taken apart into words even where the grammar refuses it, for it is looked at while it is typed; what it means is for
`contextdb.cells.grammar` to say. A word may have a sign (tags) and be in quotes. Before the words `not` may stand, behind them
`~2.5`.
"""

from __future__ import annotations

import re
from collections.abc import Collection, Iterable, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Literal

from contextdb.cells.domains import Domain
from contextdb.cells.grammar import parse_cell, reads
from contextdb.cells.sets import TagSet, ValueSet
from contextdb.cells.words import quoted, says_any

Tick = Literal["on", "off", "+", "-"]
"""What a cell says of a value: accepted or not; for tags needed, banned, or "off": not named."""

_WORD = re.compile(r'(?P<sign>[+-]?)(?:"(?P<inside>(?:[^"]|"")*)"?|(?P<bare>[^\s"]*))')
_NOT = re.compile(r"not(?=\s)\s*", re.IGNORECASE)
_PART = re.compile(r"[\s_.:/\-]+")


@dataclass(frozen=True, slots=True)
class Word:
    """A word of a text, from `start` to `stop`: its sign, and its name without quotes."""

    start: int
    stop: int
    sign: str
    name: str


@dataclass(frozen=True)
class Words:
    """A text taken apart. One that says Any has no words."""

    text: str
    words: tuple[Word, ...]
    n_negations: int = 0
    tail: str = ""
    """The penalty with its ~, or nothing."""

    @property
    def is_negated(self) -> bool:
        """Whether the words say what is not accepted."""
        return self.n_negations % 2 == 1

    @cached_property
    def is_signed(self) -> bool:
        """Whether a word has a sign."""
        return any(w.sign for w in self.words)

    @cached_property
    def _by_name(self) -> dict[str, Word]:
        return {w.name: w for w in reversed(self.words)}

    def named(self, name: str) -> Word | None:
        """The first word of this name."""
        return self._by_name.get(name)

    def at(self, caret: int) -> Word | None:
        """The word that the caret is in or behind."""
        return next((w for w in self.words if w.start <= caret <= w.stop), None)


def take_apart(text: str, has_signs: bool, whole: Collection[str] = ()) -> Words:
    """The words of a text. A text that is one of `whole` is one word: a plain fact may have spaces without quotes."""
    if text.strip() in whole:
        start = len(text) - len(text.lstrip())
        return Words(text, (Word(start, len(text.rstrip()), "", text.strip()),))
    body, tilde, penalty = text.rpartition("~")
    if not tilde or penalty.count('"') % 2 or body.count('"') % 2:
        body, tail = text, ""
    else:
        tail = "~" + penalty.strip()
    at, n_negations = len(body) - len(body.lstrip()), 0
    while negation := _NOT.match(body, at):
        at, n_negations = negation.end(), n_negations + 1
    if says_any(body[at:]):
        return Words(text, (), n_negations, tail)
    return Words(text, tuple(_words(body, at, has_signs)), n_negations, tail)


def _words(body: str, at: int, has_signs: bool) -> Iterable[Word]:
    while at < len(body):
        if body[at].isspace():
            at += 1
            continue
        match = _WORD.match(body, at)
        assert match is not None
        stop = max(match.end(), at + 1)
        sign, inside, bare = match["sign"], match["inside"], match["bare"] or ""
        if inside is not None:
            yield Word(at, stop, sign, inside.replace('""', '"'))
        else:
            yield Word(at, stop, sign, bare) if has_signs else Word(at, stop, "", sign + bare)
        at = stop


# ---- changes


def toggled(words: Words, value: str, has_signs: bool) -> str:
    """The text with one value ticked or unticked: the others, `not` and the penalty stay as they are.

    A tag goes round from not named to + to - and back. When the last value is unticked the text is Any; the first tick on Any
    names that value alone.
    """
    word = words.named(value)
    if not has_signs:
        return _rewritten(words, value, None if word else quoted(value))
    sign = {"": "+", "+": "-", "-": ""}[word.sign] if word else "+"
    return _rewritten(words, value, sign + quoted(value) if sign else None)


def signed(words: Words, value: str, sign: str) -> str:
    """The text with a tag given this sign."""
    return _rewritten(words, value, sign + quoted(value))


def _rewritten(words: Words, value: str, written: str | None) -> str:
    sources = [_source(words, w) if w.name != value else written for w in words.words]
    remaining = [source for source in dict.fromkeys(sources) if source]
    if written and words.named(value) is None:
        remaining.append(written)
    negations = ["not"] * words.n_negations if remaining and words.words else []
    return " ".join((*negations, *(remaining or ["Any"]), *([words.tail] if words.tail else [])))


def _source(words: Words, word: Word) -> str:
    """A word as it is written, in quotes if it now needs them: a plain fact that has spaces is alone."""
    source = words.text[word.start : word.stop]
    return source if '"' in source or not any(c.isspace() for c in source) else quoted(word.name)


def alone(words: Words, value: str, sign: str = "") -> str:
    """The text with this value alone; the penalty stays."""
    return " ".join((sign + quoted(value), *([words.tail] if words.tail else [])))


def completed(words: Words, word: Word, value: str, default_sign: str = "") -> tuple[str, int]:
    """The text with a word replaced by a value, and where the caret is then: behind it."""
    written = (word.sign or default_sign) + quoted(value)
    return words.text[: word.start] + written + words.text[word.stop :], word.start + len(written)


def tick_of(words: Words, value: str) -> Tick:
    """What the text says of a value."""
    word = words.named(value)
    if word is not None and word.sign:
        return "+" if word.sign == "+" else "-"
    if words.is_signed:
        return "off"
    is_accepted = bool(words.words) and (word is not None) is not words.is_negated
    return "on" if is_accepted else "off"


# ---- what there is to choose from


@dataclass(frozen=True)
class Vocabulary:
    """The values of a column, in the order in which they are offered."""

    values: tuple[str, ...]
    is_declared: bool = False
    _folded: tuple[str, ...] = field(init=False, repr=False, compare=False)
    known: frozenset[str] = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "_folded", tuple(v.casefold() for v in self.values))
        object.__setattr__(self, "known", frozenset(self.values))

    def matching(self, stem: str, leave_out: Collection[str] = ()) -> list[str]:
        """The values that a few letters may mean: those that begin so, then those of which a part does, then the others."""
        sought = stem.casefold()
        ranked: tuple[list[str], list[str], list[str]] = ([], [], [])
        for value, folded in zip(self.values, self._folded, strict=True):
            if sought in folded and value not in leave_out:
                ranked[_rank(folded, sought)].append(value)
        return [*ranked[0], *ranked[1], *ranked[2]]


def _rank(folded: str, sought: str) -> int:
    if folded.startswith(sought):
        return 0
    return 1 if any(part.startswith(sought) for part in _PART.split(folded)) else 2


def vocabulary(domain: Domain, known_texts: Sequence[str] = ()) -> Vocabulary:
    """The declared values of a condition, or those that the cells of its column name; tags with those they are under."""
    values = domain.values if domain.values is not None else _named_in(known_texts, domain)
    if domain.type.is_tags:
        values = _with_parents(values)
    return Vocabulary(tuple(values), domain.values is not None)


def _named_in(texts: Sequence[str], domain: Domain) -> Sequence[str]:
    names: dict[str, None] = {}
    for text in texts:
        accepts = parse_cell(text, domain, wants_mend=False).accepts if reads(text, domain) else None
        if isinstance(accepts, ValueSet):
            names.update(dict.fromkeys(sorted(str(v) for v in accepts.values)))
        elif isinstance(accepts, TagSet):
            names.update(dict.fromkeys(sorted(accepts.needs | accepts.bans)))
    return tuple(names)


def _with_parents(tags: Iterable[str]) -> Sequence[str]:
    """Each tag behind those that it is under: Move, Move.Run."""
    seen: dict[str, int] = {}
    for tag in tags:
        for name in _path(tag):
            seen.setdefault(name, len(seen))
    return sorted(seen, key=lambda tag: [seen[name] for name in _path(tag)])


def _path(tag: str) -> list[str]:
    parts = tag.split(".")
    return [name for n in range(1, len(parts) + 1) if (name := ".".join(parts[:n])).strip(".")] or [tag]
