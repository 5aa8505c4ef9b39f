"""Random rules and derived facts over conditions of every type, drawn from a `random.Random`: what expressions can say."""

import random
from collections.abc import Callable, Mapping

from contextdb.cells.conditions import Condition
from contextdb.expressions import ExpressionError, read_expression
from contextdb.schema.settings import conditions_from_dict

NUMBERS = ("0", "1", "2.5", "-3", "180", "-180", "90", "0.1", "1e300", "1e-300", "7", "360", "1e9")
SIGNS = ("==", "!=", "<", "<=", ">", ">=")
NUMBER_CELLS = ("1..3", "not 2", "<2", "5..", "0 | 3..4", "Any")
ANGLE_CELLS = ("170, 20", "0..90", "not -180..0", "Any")
TAG_CELLS = ("+x -y", "not +x", "+Move", "not +Move -InAir", "+x.z", "Any")


class Drawing:
    """Draws texts of expressions. `numbers`, `truths`, ... are the names of conditions that may be named."""

    def __init__(self, rng: random.Random, conditions: Mapping[str, Condition]) -> None:
        self.rng = rng
        self.conditions = conditions
        kinds = {name: c.domain.type for name, c in conditions.items()}
        self.plain = [n for n, k in kinds.items() if k.is_numeric and not k.is_circular and not k.is_spelt]
        self.angles = [n for n, k in kinds.items() if k.is_circular]
        self.days = [n for n, k in kinds.items() if k.is_spelt]
        self.truths = [n for n, k in kinds.items() if k.is_truth]
        self.texts = [n for n, k in kinds.items() if k.is_named]
        self.tags = [n for n, k in kinds.items() if k.is_tags]

    def one(self, *ways: Callable[[], str]) -> str:
        """One of some ways to go on."""
        return self.rng.choice(ways)()

    def name(self, names: list[str]) -> str:
        """A condition."""
        return self.rng.choice(names)

    def number(self, depth: int) -> str:
        """A number."""
        rng, more = self.rng, depth - 1
        if depth <= 0 or rng.random() < 0.2:
            return self.one(lambda: self.name(self.plain), lambda: self.name(self.plain + self.angles), lambda: rng.choice(NUMBERS))
        part = lambda: self.number(more)  # noqa: E731
        return self.one(
            lambda: f"({part()} {rng.choice(['+', '-', '*', '/', '//', '%'])} {part()})",
            lambda: f"-{part()}",
            lambda: f"({part()}) ** {rng.choice([0, 1, 2, 3, 7])}",
            lambda: f"{rng.choice(['abs', 'sqrt', 'floor', 'ceil', 'round', 'wrap_angle'])}({part()})",
            lambda: f"{rng.choice(['min', 'max', 'hypot', 'atan2'])}({part()}, {part()})",
            lambda: f"{rng.choice(['min', 'max', 'clamp'])}({part()}, {part()}, {part()})",
            lambda: f"({part()} if {self.truth(more)} else {part()})",
            lambda: f"({self.name(self.days)} - {self.name(self.days)})",
        )

    def text(self, depth: int) -> str:
        """A text."""
        if depth <= 0 or self.rng.random() < 0.5:
            return self.one(lambda: self.name(self.texts), lambda: self.rng.choice(['"A"', '"B"', '"a"', '"Größe"']))
        return f"({self.text(depth - 1)} if {self.truth(depth - 1)} else {self.text(depth - 1)})"

    def tag_set(self, depth: int) -> str:
        """A set of tags."""
        if depth <= 0 or self.rng.random() < 0.6:
            return self.name(self.tags)
        return f"({self.tag_set(depth - 1)} if {self.truth(depth - 1)} else {self.tag_set(depth - 1)})"

    def truth(self, depth: int) -> str:
        """True or False."""
        rng, more = self.rng, depth - 1
        if depth <= 0:
            return self.name(self.truths)
        number = lambda: self.number(more)  # noqa: E731
        word = lambda: rng.choice(["and", "or"])  # noqa: E731
        return self.one(
            lambda: self.name(self.truths),
            lambda: f"({number()} {rng.choice(SIGNS)} {number()})",
            lambda: f"({number()} {rng.choice(SIGNS)} {number()} {rng.choice(SIGNS)} {number()} {rng.choice(SIGNS)} {number()})",
            lambda: f"({self.name(self.angles)} {rng.choice(SIGNS)} {number()})",
            lambda: f'({self.name(self.angles)} in "{rng.choice(ANGLE_CELLS)}")',
            lambda: f'({self.name(self.plain)} in "{rng.choice(NUMBER_CELLS)}")',
            lambda: f"({number()} in [1, 2, {rng.choice(NUMBERS)}])",
            lambda: f'({self.name(self.days)} {rng.choice(["<", ">=", "=="])} date("2026-01-01"))',
            lambda: f"({self.text(more)} {rng.choice(['==', '!='])} {self.text(more)})",
            lambda: f'({self.name(self.texts)} {rng.choice(["in", "not in"])} ["A", "B"])',
            lambda: f'("{rng.choice(["x", "y", "Move", "InAir", "x.z"])}" {rng.choice(["in", "not in"])} {self.tag_set(more)})',
            lambda: f'({self.name(self.tags)} in "{rng.choice(TAG_CELLS)}")',
            lambda: f"({self.truth(more)} {rng.choice(['==', '!='])} {self.truth(more)})",
            lambda: f"(not {self.truth(more)})",
            lambda: f"({self.truth(more)} {word()} {self.truth(more)} {word()} {self.truth(more)})",
            lambda: f"({self.truth(more)} if {self.truth(more)} else {self.truth(more)})",
        )

    def drawn(self, draw: Callable[[int], str], wants: Condition | None = None) -> str:
        """A text that can be read; what has no finite value, or divides by 0, is drawn again."""
        while True:
            text = draw(self.rng.choice([1, 2, 2, 3]))
            try:
                read_expression(text, self.conditions, wants)
            except ExpressionError:
                continue
            return text


def derived_conditions(rng: random.Random, schema: Mapping[str, dict[str, object]]) -> dict[str, dict[str, object]]:
    """The schema with derived facts of every type, some of them computed from others."""
    found = dict(schema)
    ways: dict[str, tuple[dict[str, object], Callable[[Drawing], Callable[[int], str]]]] = {
        "d_number": ({"type": "number"}, lambda d: d.number),
        "d_angle": ({"type": "angle"}, lambda d: d.number),
        "d_int": ({"type": "int"}, lambda d: lambda depth: f"round({d.number(depth)})"),
        "d_day": ({"type": "date"}, lambda d: lambda depth: f"day + round({d.number(depth)})"),
        "d_ok": ({"type": "bool"}, lambda d: d.truth),
        "d_state": (dict(schema["state"]), lambda d: d.text),
        "d_word": ({"type": "text"}, lambda d: d.text),
        "d_tags": ({"type": "tags"}, lambda d: d.tag_set),
        "d_declared": (dict(schema["Defender.Tags"]), lambda d: lambda depth: f"(Defender.Tags if {d.truth(depth)} else tags)"),
    }
    for name in rng.sample(list(ways), 5):
        settings, way = ways[name]
        conditions = conditions_from_dict(found)
        wants = conditions_from_dict({name: settings})[name]
        drawing = Drawing(rng, conditions)
        found[name] = settings | {"expr": drawing.drawn(way(drawing), wants)}
    return found
