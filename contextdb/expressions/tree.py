"""An expression as a tree, before anything is known of the conditions it is about.

Every node knows the characters it was read from, text[start:stop], and its depth: 1 for a leaf.
"""

from __future__ import annotations

from dataclasses import dataclass, field


@dataclass(frozen=True)
class Node:
    """A part of an expression."""

    start: int
    stop: int
    depth: int = field(init=False, default=1, repr=False, compare=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "depth", 1 + max((part.depth for part in self.parts), default=0))

    @property
    def parts(self) -> tuple[Node, ...]:
        return ()


@dataclass(frozen=True)
class Number(Node):
    """A number as it is written."""

    value: float


@dataclass(frozen=True)
class Text(Node):
    """A text in quotes: a value of an enum, a tag, or a cell after `in`."""

    value: str


@dataclass(frozen=True)
class Truth(Node):
    """True or False."""

    value: bool


@dataclass(frozen=True)
class Name(Node):
    """The name of a condition."""

    name: str
    is_bare: bool


@dataclass(frozen=True)
class Unary(Node):
    """`-x`, `+x` or `not x`."""

    sign: str
    part: Node

    @property
    def parts(self) -> tuple[Node, ...]:
        return (self.part,)


@dataclass(frozen=True)
class Arithmetic(Node):
    """`left sign right`."""

    sign: str
    left: Node
    right: Node

    @property
    def parts(self) -> tuple[Node, ...]:
        return (self.left, self.right)


@dataclass(frozen=True)
class Logic(Node):
    """Two or more parts joined by the word `and`, or by `or`."""

    word: str
    operands: tuple[Node, ...]

    @property
    def parts(self) -> tuple[Node, ...]:
        return self.operands


@dataclass(frozen=True)
class Comparison(Node):
    """`a < b <= c`: one sign less than operands; each is computed once."""

    operands: tuple[Node, ...]
    signs: tuple[str, ...]

    @property
    def parts(self) -> tuple[Node, ...]:
        return self.operands


@dataclass(frozen=True)
class Membership(Node):
    """`item in choices`, or `not in`. `choices` is a list of nodes or one node."""

    item: Node
    choices: Node | tuple[Node, ...]
    is_negated: bool

    @property
    def parts(self) -> tuple[Node, ...]:
        return (self.item, *(self.choices if isinstance(self.choices, tuple) else (self.choices,)))


@dataclass(frozen=True)
class Likeness(Node):
    """`item like pattern`, or `not like`."""

    item: Node
    pattern: Node
    is_negated: bool

    @property
    def parts(self) -> tuple[Node, ...]:
        return (self.item, self.pattern)


@dataclass(frozen=True)
class Conditional(Node):
    """`then if condition else otherwise`."""

    then: Node
    condition: Node
    otherwise: Node

    @property
    def parts(self) -> tuple[Node, ...]:
        return (self.then, self.condition, self.otherwise)


@dataclass(frozen=True)
class Call(Node):
    """`name(arguments)`."""

    name: str
    arguments: tuple[Node, ...]

    @property
    def parts(self) -> tuple[Node, ...]:
        return self.arguments
