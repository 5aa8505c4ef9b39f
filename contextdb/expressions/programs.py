"""Expressions as programs of a small stack machine: the core computes them, in Python, in games and in browsers.

A program is the plan of an expression in the order in which a stack computes it, without jumps: every part is computed, which
changes no answer, since no part has an effect. An instruction is four whole numbers, an `Op` and its operands a, b and c. Values
are numbers (NaN where missing), truths, texts and sets of tags. The same answers, bit by bit, as `contextdb.expressions.columns`
gives for many contexts.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import IntEnum

import numpy as np
from numpy.typing import NDArray

from contextdb.cells.conditions import Condition
from contextdb.cells.intervals import EVERYTHING
from contextdb.cells.sets import Cell, NumberSet, TagMeet, TagSet, ValueSet
from contextdb.expressions.functions import FUNCTIONS, NEGATIVE, OPERATORS, Function
from contextdb.expressions.plan import Apply, Compare, Const, Given, Held, Link, Logic, Negation, Part, Select


class Op(IntEnum):
    """What an instruction does: it takes its operands off the stack, the last one from the top, and leaves one value."""

    NUMBER = 0
    """Leaves `numbers[a]`."""
    TEXT = 1
    """Leaves `texts[a]`."""
    TRUTH = 2
    """Leaves False for a = 0, True for a = 1."""
    FACT = 3
    """Leaves the fact number a."""
    ADD = 4
    SUBTRACT = 5
    MULTIPLY = 6
    DIVIDE = 7
    FLOOR_DIVIDE = 8
    REMAINDER = 9
    NEGATE = 10
    ABSOLUTE = 11
    LENGTH = 12
    ROOT = 13
    FLOOR = 14
    CEILING = 15
    ROUND = 16
    HEADING = 17
    WRAP = 18
    POWER = 19
    """To the power of a."""
    LOWEST = 20
    """The lesser of two, not settled: infinite where it is, so that more can follow."""
    HIGHEST = 21
    SETTLE = 22
    """NaN for what is not finite."""
    COMPARE_NUMBERS = 23
    """The sign a of `SIGNS`; b: 1 wraps both, 2 and 4 take -180 on the left or right for 180. In a chain c & 1 leaves the right
    side on top of the truth, for the next sign, and c & 2 joins the truth with the one below it."""
    COMPARE_TEXTS = 24
    COMPARE_TRUTHS = 25
    IN_SPANS = 26
    """Whether a number is in one of b spans, `numbers[a]` to `numbers[a + 1]` and so on."""
    IN_TEXTS = 27
    """Whether a text is one of b texts from a on; c = 1: none of them."""
    IN_TRUTHS = 28
    """Whether a truth is accepted: bit 0 of a for False, bit 1 for True."""
    HAS_TAGS = 29
    """Whether tags have the b texts from a on and none of the c // 2 behind them; c % 2 = 1: or not so."""
    AND = 30
    OR = 31
    NOT = 32
    IF = 33
    """Of a truth and two values the first where it holds, the second where it does not. a says what they are, one of `Values`."""


SIGNS = ("==", "!=", "<", "<=", ">", ">=")


class Values(IntEnum):
    """What values of the stack are."""

    NUMBERS = 0
    TRUTHS = 1
    TEXTS = 2
    TAGS = 3


_COMPARE = {Values.NUMBERS: Op.COMPARE_NUMBERS, Values.TRUTHS: Op.COMPARE_TRUTHS, Values.TEXTS: Op.COMPARE_TEXTS}

_OPS: dict[Function, Op] = {
    OPERATORS["+"]: Op.ADD,
    OPERATORS["-"]: Op.SUBTRACT,
    OPERATORS["*"]: Op.MULTIPLY,
    OPERATORS["/"]: Op.DIVIDE,
    OPERATORS["//"]: Op.FLOOR_DIVIDE,
    OPERATORS["%"]: Op.REMAINDER,
    NEGATIVE: Op.NEGATE,
    FUNCTIONS["abs"]: Op.ABSOLUTE,
    FUNCTIONS["hypot"]: Op.LENGTH,
    FUNCTIONS["sqrt"]: Op.ROOT,
    FUNCTIONS["floor"]: Op.FLOOR,
    FUNCTIONS["ceil"]: Op.CEILING,
    FUNCTIONS["round"]: Op.ROUND,
    FUNCTIONS["atan2"]: Op.HEADING,
    FUNCTIONS["wrap_angle"]: Op.WRAP,
    FUNCTIONS["min"]: Op.LOWEST,
    FUNCTIONS["max"]: Op.HIGHEST,
}


@dataclass
class Programs:
    """Programs, one after another, and what they name."""

    facts: Mapping[str, Condition]
    """Every condition that a program may name, by number."""
    code: list[tuple[int, int, int, int]] = field(default_factory=list)
    numbers: list[float] = field(default_factory=list)
    texts: list[str] = field(default_factory=list)
    starts: list[int] = field(default_factory=lambda: [0])
    derived: list[int] = field(default_factory=list)
    """Which of `facts` each of the first programs computes."""
    of_row: NDArray[np.int32] = field(default_factory=lambda: np.zeros(0, np.int32))
    """The number of each row's rule, counted behind the derived facts, or -1; empty without rules."""

    def __post_init__(self) -> None:
        self._number_of = {name: number for number, name in enumerate(self.facts)}

    @property
    def code_array(self) -> NDArray[np.int32]:
        """The instructions: int32 [n, 4]."""
        return np.array(self.code, np.int32).reshape(-1, 4)

    @property
    def numbers_array(self) -> NDArray[np.float64]:
        """The numbers that they name."""
        return np.array(self.numbers, np.float64)

    @property
    def places(self) -> tuple[NDArray[np.int64], NDArray[np.int64], NDArray[np.int32]]:
        """Where each program begins, what the first of them compute, and the rule of each row."""
        return np.array(self.starts, np.int64), np.array(self.derived, np.int64), self.of_row

    def add(self, plan: Part) -> None:
        self.put(plan)
        self.starts.append(len(self.code))

    def emit(self, op: Op, a: int = 0, b: int = 0, c: int = 0) -> None:
        self.code.append((op, a, b, c))

    def put(self, plan: Part) -> None:
        """Add the instructions that leave the value of a plan on the stack."""
        match plan:
            case Const(bool(value)):
                self.emit(Op.TRUTH, value)
            case Const(str(value)):
                self.emit(Op.TEXT, self._listed([value]))
            case Const(value):
                self.emit(Op.NUMBER, self._numbered([float(value)]))
            case Given(name):
                self.emit(Op.FACT, self._number_of[name])
            case Apply(function, parts):
                self._apply(function, *parts)
            case Compare(parts, links):
                self.put(parts[0])
                for at, (link, part) in enumerate(zip(links, parts[1:], strict=True), 1):
                    self.put(part)
                    chain = (at < len(links)) + 2 * (at > 1)
                    self.emit(_COMPARE[_type_of(part)], SIGNS.index(link.sign), _flags(link), chain)
            case Held(part, cell):
                for at, accepts in enumerate(cell.accepts.parts if isinstance(cell.accepts, TagMeet) else (cell.accepts,)):
                    self.put(part)
                    self._hold(part, Cell(accepts))
                    if at:
                        self.emit(Op.AND)
            case Logic(word, parts):
                for at, part in enumerate(parts):
                    self.put(part)
                    if at:
                        self.emit(Op.OR if word == "or" else Op.AND)
            case Negation(part):
                self.put(part)
                self.emit(Op.NOT)
            case Select():
                for part in (plan.condition, plan.then, plan.otherwise):
                    self.put(part)
                self.emit(Op.IF, _type_of(plan))

    def _apply(self, function: Function, first: Part, *others: Part) -> None:
        self.put(first)
        if function.exponent is not None:
            self.emit(Op.POWER, function.exponent)
            return
        ops = [Op.HIGHEST, Op.LOWEST] if function is FUNCTIONS["clamp"] else [_OPS[function]] * max(len(others), 1)
        for part in others[:1]:
            self.put(part)
        self.emit(ops[0])
        for op, part in zip(ops[1:], others[1:], strict=True):
            self.put(part)
            self.emit(op)
        if ops[0] in (Op.LOWEST, Op.HIGHEST):
            self.emit(Op.SETTLE)

    def _hold(self, part: Part, cell: Cell) -> None:
        accepts = cell.accepts
        match _type_of(part):
            case Values.NUMBERS:
                spans = accepts.spans if isinstance(accepts, NumberSet) else EVERYTHING
                self.emit(Op.IN_SPANS, self._numbered([end for span in spans for end in span]), len(spans))
            case Values.TRUTHS:
                self.emit(Op.IN_TRUTHS, cell.holds(False) + 2 * cell.holds(True))
            case Values.TAGS:
                tags = accepts if isinstance(accepts, TagSet) else TagSet(frozenset())
                first = self._listed([*sorted(tags.needs), *sorted(tags.bans)])
                self.emit(Op.HAS_TAGS, first, len(tags.needs), 2 * len(tags.bans) + tags.is_complement)
            case _:
                values = accepts if isinstance(accepts, ValueSet) else ValueSet(frozenset(), True)
                self.emit(Op.IN_TEXTS, self._listed(sorted(map(str, values.values))), len(values.values), values.is_complement)

    def _numbered(self, numbers: list[float]) -> int:
        self.numbers += numbers
        return len(self.numbers) - len(numbers)

    def _listed(self, texts: list[str]) -> int:
        self.texts += texts
        return len(self.texts) - len(texts)


def letter_of(part: Part) -> str:
    """The type of a part's value as the core names it."""
    return "ntws"[_type_of(part)]


def _flags(link: Link) -> int:
    """Only one of the three is in force, as when the plan is computed."""
    return 1 if link.is_wrapped else 2 if link.left_is_high else 4 if link.right_is_high else 0


def _type_of(part: Part) -> Values:
    if isinstance(part, Select):
        return _type_of(part.then)
    if isinstance(part, Const):
        is_text = isinstance(part.value, str)
        return Values.TRUTHS if isinstance(part.value, bool) else Values.TEXTS if is_text else Values.NUMBERS
    if isinstance(part, Given):
        kind = part.kind
        plain = Values.NUMBERS if kind.is_numeric else Values.TRUTHS if kind.is_truth else Values.TEXTS
        return Values.TAGS if kind.is_tags else plain
    return Values.NUMBERS if isinstance(part, Apply) else Values.TRUTHS
