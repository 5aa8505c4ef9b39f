"""A rule while it is typed: the names that may come next, and what each of its parts is for the facts of the test row. No Textual
here.

A part is what "and", "or" and "not" join. What cannot be read yet, such as the end of a line that is being typed, is left out.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

from contextdb.cells.conditions import Condition
from contextdb.cells.facts import Fact
from contextdb.compiled.explain import describe_fact
from contextdb.errors import ContextDBError, safe_text
from contextdb.expressions.expression import read_expression
from contextdb.expressions.functions import FUNCTIONS
from contextdb.expressions.parse import parse
from contextdb.expressions.tokens import RESERVED, ExpressionError, Refusal, Token, tokens_of, written_name, written_text
from contextdb.expressions.tree import Logic, Node, Unary

from .chooser import Chooser, Offer, Row
from .completion import Vocabulary, Word

BEFORE_VALUES = ("==", "!=", "in", "[", ",")
MOST_PARTS = 8
NOW = {True: "true now", False: "false now", None: "not known"}
SIGNS = {True: "✓", False: "✗", None: "?"}
_AT_CARET = re.compile(r"[^\W\d][\w.]*$|`[^`]*$|\"[^\"]*$|'[^']*$")


@dataclass(frozen=True)
class RulePart:
    """A part of a rule, and its truth for the facts; None where a fact that it needs is not given."""

    text: str
    truth: bool | None
    facts: str
    """The facts that it is about: "speed is 4.5"."""


@dataclass(frozen=True)
class RuleBuilder:
    """What a rule may name, and the facts of the test row."""

    conditions: Mapping[str, Condition]
    facts: Mapping[str, Fact]
    """Facts that are not given are None, or are missing."""

    def parts(self, text: str) -> list[RulePart]:
        """The parts of a rule that can be read; as far as that where the rest cannot."""
        return [part for start, stop in _spans(text) if (part := self._part(text[start:stop])) is not None]

    def truth(self, text: str) -> bool | None:
        """Whether a rule holds for the facts; None where that is not known, or it cannot be read."""
        return None if (part := self._part(text)) is None else part.truth

    def words(self, text: str) -> str:
        """A line for each part, and one for the whole."""
        parts = self.parts(text)
        lines = [_line(part) for part in parts[:MOST_PARTS]]
        if len(parts) > 1 and self._part(text) is not None:
            lines.append(f"The rule is {NOW[self.truth(text)]}.")
        return "\n".join(lines)

    def _part(self, text: str) -> RulePart | None:
        try:
            expression = read_expression(text, self.conditions)
            value = (
                expression.evaluate({name: self.facts.get(name) for name in expression.names})
                if expression.type.kind.is_truth
                else 0
            )
        except ContextDBError:
            return None
        if value is not None and not isinstance(value, bool):
            return None
        own = [(c, self.facts.get(c.name)) for c in expression.conditions]
        given = [f"{c.name} is {describe_fact(fact, c)}" if fact is not None else f"{c.name} is not given" for c, fact in own]
        return RulePart(text.strip(), value, ", ".join(given))


class RuleChooser(Chooser):
    """What the word at the caret may become: facts, functions and words of the language, or values of the fact before it."""

    has_list = True
    has_ticks = False

    def __init__(self, builder: RuleBuilder) -> None:
        super().__init__(None, "rule", (), False)
        self._builder = builder

    @cached_property
    def names(self) -> Vocabulary:
        """All that a rule may name: facts first."""
        facts = (written_name(name) for name in self._builder.conditions)
        functions = (f"{function.form.partition('(')[0]}(" for function in FUNCTIONS.values())
        return Vocabulary(tuple(dict.fromkeys([*facts, *sorted(RESERVED), *functions])))

    def offer(self, text: str, caret: int, is_open: bool) -> Offer:
        """What fits to the letters before the caret; of no letters what may come there, where it is values or the list is open."""
        begun = _AT_CARET.search(text[:caret])
        start = caret if begun is None else begun.start()
        values = self._values(text[:start])
        stem = text[start:caret].strip("\"'`")
        if begun is None and not values.values and not is_open:
            return Offer()
        rows = [*values.matching(stem), *([] if begun is not None and text[start] in "\"'" else self.names.matching(stem))]
        is_whole = text[start:caret] in (*self.names.known, *values.known)
        stop = caret + (1 if begun is not None and text[start] in "\"'`" and text[caret : caret + 1] == text[start] else 0)
        return Offer([] if is_whole and not is_open else rows, Word(start, stop, "", stem))

    def pick(self, text: str, row: Row, word: Word | None) -> tuple[str, int]:
        """The text with a name or a value in the place of the word."""
        start, stop = (len(text), len(text)) if word is None else (word.start, word.stop)
        return f"{text[:start]}{row or ''}{text[stop:]}", start + len(row or "")

    def _values(self, before: str) -> Vocabulary:
        """The values that may stand behind a text: those of the fact that it compares last."""
        try:
            tokens = [token for token in tokens_of(before) if token.kind != "end"]
        except Refusal:
            return Vocabulary(())
        if not tokens or tokens[-1].text not in BEFORE_VALUES:
            return Vocabulary(())
        named = [self._builder.conditions.get(token.value) for token in tokens if _is_fact(token)]
        condition = named[-1] if named else None
        return Vocabulary(tuple(map(written_text, condition.domain.values or ())) if condition is not None else ())


def _is_fact(token: Token) -> bool:
    return token.kind == "name" and not (token.is_bare and token.text in RESERVED)


def _spans(text: str) -> Iterator[tuple[int, int]]:
    """Where the parts of a rule are; of one that cannot be read, those of its longest beginning that can."""
    for stop in _stops(text):
        try:
            tree = parse(text[:stop])
        except (Refusal, ExpressionError):
            continue
        yield from ((node.start, node.stop) for node in _leaves(tree))
        return


def _stops(text: str) -> Sequence[int]:
    """Where the text may be cut: at its end, then before each joining word, the last first."""
    return [len(text), *reversed([match.start() for match in re.finditer(r"\b(?:and|or)\b", text)])]


def _leaves(node: Node) -> Iterator[Node]:
    if isinstance(node, Logic) or (isinstance(node, Unary) and node.sign == "not"):
        for part in node.parts:
            yield from _leaves(part)
    else:
        yield node


def _line(part: RulePart) -> str:
    return f"{SIGNS[part.truth]} {safe_text(part.text)}: {NOW[part.truth]} ({safe_text(part.facts)})" if part.facts else part.text
