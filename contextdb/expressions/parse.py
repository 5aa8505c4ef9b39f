"""Read an expression into a tree, by precedence climbing. Nothing of the text is ever run.

From loose to tight, as in Python:

    A if CONDITION else B
    or
    and
    not
    == != < <= > >=  in  not in  like  not like       a < b < c is a < b and b < c
    + -
    * / // %
    -x +x
    **                                from the right

Source: Pratt, "Top down operator precedence", POPL 1973.
"""

from __future__ import annotations

import math

from contextdb.errors import in_quotes
from contextdb.expressions.tokens import RESERVED, Refusal, Token, tokens_of
from contextdb.expressions.tree import (
    Arithmetic,
    Call,
    Comparison,
    Conditional,
    Likeness,
    Logic,
    Membership,
    Name,
    Node,
    Number,
    Text,
    Truth,
    Unary,
)

MOST_NESTED = 64
"""A deeper expression is refused."""

_CHOICE, _OR, _AND, _NOT, _COMPARE, _ADD, _MULTIPLY, _SIGNED, _POWER = range(1, 10)
_COMPARISONS = ("==", "!=", "<", "<=", ">", ">=")
_BINDING = {
    **dict.fromkeys(_COMPARISONS, _COMPARE),
    **dict.fromkeys(("+", "-"), _ADD),
    **dict.fromkeys(("*", "/", "//", "%"), _MULTIPLY),
    "**": _POWER,
}
_WORDS = {"if": _CHOICE, "or": _OR, "and": _AND, "in": _COMPARE, "like": _COMPARE, "not": _COMPARE}
_TRUTHS = {"True": True, "False": False}
_SLIPS = {word: word for word in ("and", "or", "not", "in", "like", "if", "else")} | {"is": "==", "xor": "!=", "mod": "%"}
_REFUSED = {
    "for": "there are no loops",
    "lambda": "functions cannot be defined",
    "as": "nothing is named",
    "await": "nothing waits",
}
_VALUE = "a fact, a number, a text in quotes, True or False"


def parse(text: str) -> Node:
    """The tree of an expression. Raises Refusal where the text is not in the grammar, too long, or nested too deeply."""
    parser = _Parser(tokens_of(text))
    if len(parser.tokens) == 1:
        raise Refusal(0, len(text), "the expression is empty", "an expression such as speed - target_speed")
    tree = parser.expression(_CHOICE, 1)
    if parser.token.kind != "end":
        raise parser.unexpected()
    return tree


class _Parser:
    def __init__(self, tokens: list[Token]) -> None:
        self.tokens, self.at = tokens, 0

    @property
    def token(self) -> Token:
        return self.tokens[self.at]

    def take(self) -> Token:
        self.at += 1
        return self.tokens[self.at - 1]

    def sees(self, *words: str) -> bool:
        """Whether the next tokens are these signs or words."""
        ahead = self.tokens[self.at : self.at + len(words)]
        return [t.text for t in ahead if t.kind in ("sign", "name")] == list(words)

    def expression(self, least: int, depth: int) -> Node:
        """What binds at least so tightly, from here on."""
        if depth > MOST_NESTED:
            raise self._too_deep(self.token.start, self.token.stop)
        left = self._value(depth)
        while (binding := self._binding()) >= least:
            left = self._continued(left, binding, depth)
            if left.depth > MOST_NESTED:
                raise self._too_deep(left.start, left.stop)
        return left

    def _too_deep(self, start: int, stop: int) -> Refusal:
        return Refusal(start, stop, "the expression is nested too deeply", f"{MOST_NESTED} levels at most")

    def _binding(self) -> int:
        """How tightly the next token joins what is before it; 0 when it does not."""
        token = self.token
        if token.kind == "sign":
            return _BINDING.get(token.text, 0)
        if token.text == "not":
            return _COMPARE if self.sees("not", "in") or self.sees("not", "like") else 0
        return _WORDS.get(token.text, 0) if token.is_bare else 0

    def _continued(self, left: Node, binding: int, depth: int) -> Node:
        if binding == _CHOICE:
            return self._conditional(left, depth)
        if binding in (_OR, _AND):
            return self._logic(left, binding, depth)
        if binding == _COMPARE:
            return self._comparison(left, depth) if self.token.kind == "sign" else self._chosen(left, depth)
        sign = self.take().text
        right = self.expression(_SIGNED if binding == _POWER else binding + 1, depth + 1)
        return Arithmetic(left.start, right.stop, sign, left, right)

    def _conditional(self, then: Node, depth: int) -> Node:
        self.take()
        condition = self.expression(_OR, depth + 1)
        if not self.sees("else"):
            raise self.unexpected('after the condition of "if" the word "else" is missing', "A if CONDITION else B")
        self.take()
        otherwise = self.expression(_CHOICE, depth + 1)
        return Conditional(then.start, otherwise.stop, then, condition, otherwise)

    def _logic(self, first: Node, binding: int, depth: int) -> Node:
        word, operands = self.token.text, [first]
        while self.sees(word):
            self.take()
            operands.append(self.expression(binding + 1, depth + 1))
        return Logic(first.start, operands[-1].stop, word, tuple(operands))

    def _comparison(self, first: Node, depth: int) -> Node:
        operands, signs = [first], []
        while self.token.kind == "sign" and self.token.text in _COMPARISONS:
            signs.append(self.take().text)
            operands.append(self.expression(_ADD, depth + 1))
        if self._binding() == _COMPARE:
            raise self._no_chain()
        return Comparison(first.start, operands[-1].stop, tuple(operands), tuple(signs))

    def _chosen(self, item: Node, depth: int) -> Node:
        """What `in` or `like` asks of an item."""
        is_negated = self.token.text == "not"
        if is_negated:
            self.take()
        if self.take().text == "in":
            return self._membership(item, is_negated, depth)
        pattern = self.expression(_ADD, depth + 1)
        if self._binding() == _COMPARE:
            raise self._no_chain()
        return Likeness(item.start, pattern.stop, item, pattern, is_negated)

    def _membership(self, item: Node, is_negated: bool, depth: int) -> Node:
        if self.sees("["):
            self.take()
            choices: Node | tuple[Node, ...] = self._list("]", depth)
            stop = self.tokens[self.at - 1].stop
        else:
            choices = self.expression(_ADD, depth + 1)
            stop = choices.stop
        if self._binding() == _COMPARE:
            raise self._no_chain()
        return Membership(item.start, stop, item, choices, is_negated)

    def _no_chain(self) -> Refusal:
        return Refusal(
            self.token.start,
            self.token.stop,
            '"in", "like" and other comparisons do not chain',
            "brackets, or two parts joined by and",
        )

    def _list(self, end: str, depth: int) -> tuple[Node, ...]:
        """Expressions with commas between, up to the closing bracket, which is taken."""
        items: list[Node] = []
        while not self.sees(end):
            items.append(self.expression(_CHOICE, depth + 1))
            if self.sees(","):
                self.take()
            elif not self.sees(end):
                raise self.unexpected(accepted=f'"," or "{end}"')
        self.take()
        return tuple(items)

    def _value(self, depth: int) -> Node:
        token = self.take()
        if token.kind == "number":
            return _number(token)
        if token.kind == "text":
            return Text(token.start, token.stop, token.value)
        if token.kind == "name" and not (token.is_bare and token.text in RESERVED - _TRUTHS.keys()):
            return self._named(token, depth)
        if token.text in ("-", "+", "not"):
            part = self.expression(_NOT if token.text == "not" else _SIGNED, depth + 1)
            return Unary(token.start, part.stop, token.text, part)
        if token.text == "(":
            return self._bracketed(depth)
        self.at -= 1
        raise self._no_value()

    def _named(self, token: Token, depth: int) -> Node:
        if token.is_bare and token.text in _TRUTHS:
            return Truth(token.start, token.stop, _TRUTHS[token.text])
        if token.is_bare and self.sees("("):
            self.take()
            arguments = self._list(")", depth)
            return Call(token.start, self.tokens[self.at - 1].stop, token.value, arguments)
        return Name(token.start, token.stop, token.value, token.is_bare)

    def _bracketed(self, depth: int) -> Node:
        inner = self.expression(_CHOICE, depth + 1)
        if not self.sees(")"):
            raise self.unexpected('a ")" is missing', meant=")" if self.token.kind == "end" else None)
        self.take()
        return inner

    def _no_value(self) -> Refusal:
        token = self.token
        if token.kind == "end":
            return Refusal(token.start, token.stop, "a value is missing at the end", _VALUE)
        if token.text == "[":
            return Refusal(token.start, token.stop, 'a list is allowed only after "in"', 'gait in ["Walk", "Run"]')
        return Refusal(token.start, token.stop, f"before {in_quotes(token.text)} a value is missing", _VALUE)

    def unexpected(self, why: str = "", accepted: str = "", meant: str | None = None) -> Refusal:
        """What is here has no place."""
        token = self.token
        slip = token.text.casefold() if token.is_bare else ""
        if slip in _REFUSED:
            return Refusal(token.start, token.stop, f"{in_quotes(token.text)}: {_REFUSED[slip]}")
        before = self.tokens[self.at - 1]
        if before.is_bare and before.text.casefold() == "not":
            return Refusal(before.start, before.stop, f"{in_quotes(before.text)} is written in small letters", meant="not")
        if slip in _SLIPS and token.text != _SLIPS[slip]:
            return self._slipped(token, slip)
        if token.kind == "end":
            return Refusal(token.start, token.stop, why or "the expression ends too early", accepted, meant)
        return Refusal(token.start, token.stop, why or self._side_by_side(before, token), accepted, meant)

    def _slipped(self, token: Token, slip: str) -> Refusal:
        ahead = self.tokens[min(self.at + 1, len(self.tokens) - 1)]
        if slip == "is" and ahead.text == "not":
            return Refusal(token.start, ahead.stop, '"is not" is not a comparison', meant="!=")
        what = "is written in small letters" if _SLIPS[slip] == slip else "is not an operator"
        return Refusal(token.start, token.stop, f"{in_quotes(token.text)} {what}", meant=_SLIPS[slip])

    def _side_by_side(self, before: Token, token: Token) -> str:
        if token.kind == "text" and before.is_bare and before.stop == token.start:
            return f"a text has no prefix such as {in_quotes(before.text)}"
        if token.kind in ("number", "text", "name") and token.text != "else":
            return f"between {in_quotes(before.text)} and {in_quotes(token.text)} an operator is missing"
        return f"{in_quotes(token.text)} has no place here"


def _number(token: Token) -> Node:
    value = float(token.value)
    if math.isinf(value):
        raise Refusal(token.start, token.stop, f"{in_quotes(token.text)} is too large for a number", "numbers up to 1.79e308")
    return Number(token.start, token.stop, value)
