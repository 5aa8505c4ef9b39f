"""Check a tree against the conditions it is about, and turn it into a plan.

Every name is a condition's, every word that an enum or tags are compared with is one of theirs, and every operator gets what it
can work with. Parts without facts are computed here, once; one that would always be missing (`9 ** 9 ** 9`, `1 / 0`) is refused.
"""

from __future__ import annotations

from collections.abc import Mapping

from contextdb.cells.conditions import Condition
from contextdb.cells.domains import ANGLE, BOOL, INT, NUMBER, TEXT
from contextdb.cells.kinds import Kind
from contextdb.cells.words import format_number
from contextdb.errors import in_quotes, nearest, plural, some
from contextdb.expressions.functions import FUNCTIONS, MOST_POWER, NEGATIVE, OPERATORS, Function, power_of
from contextdb.expressions.membership import SPELT, holding, matching, require_value, spelt, spelt_alike
from contextdb.expressions.plan import Apply, Compare, Const, Given, Link, Logic, Negation, Part, Select, Type
from contextdb.expressions.scalar import constant
from contextdb.expressions.tokens import Refusal, UnknownName, written_name, written_text
from contextdb.expressions.tree import (
    Arithmetic,
    Call,
    Comparison,
    Conditional,
    Likeness,
    Membership,
    Name,
    Node,
    Number,
    Text,
    Truth,
    Unary,
)
from contextdb.expressions.tree import (
    Logic as LogicNode,
)

Checked = tuple[Part, Type]

_TRUTH = Type(BOOL.type)


class Checker:
    """Checks the parts of one expression."""

    def __init__(self, conditions: Mapping[str, Condition]) -> None:
        self.conditions = conditions
        self.names: list[str] = []
        """The conditions it is about, in the order of their first mention."""

    def check(self, node: Node) -> Checked:
        """The plan and the type of a node. Raises Refusal where the node does not fit the conditions."""
        match node:
            case Number(value=value):
                return Const(value), Type(INT.type if value.is_integer() else NUMBER.type)
            case Text(value=value):
                return Const(value), Type(TEXT.type, frozenset((value,)))
            case Truth(value=value):
                return Const(value), _TRUTH
            case Name():
                return self._name(node)
            case Unary():
                return self._unary(node)
            case Arithmetic():
                return self._power(node) if node.sign == "**" else self._arithmetic(node)
            case Call():
                return self._literal(node, SPELT[node.name]) if node.name in SPELT else self._call(node)
            case LogicNode():
                plans = [self._truth(operand, in_quotes(node.word)) for operand in node.operands]
                return self._folded(node, Logic(node.word, tuple(plans))), _TRUTH
            case Comparison():
                return self._comparison(node)
            case Membership():
                item = self.check(node.item)
                choices = node.choices if isinstance(node.choices, tuple) else (node.choices,)
                held = holding(node, item, [(choice, *self.check(choice)) for choice in choices], self.conditions)
                return self._folded(node, Negation(held) if node.is_negated else held), _TRUTH
            case Likeness():
                held = matching(node, self.check(node.item)[0], self.conditions)
                return self._folded(node, Negation(held) if node.is_negated else held), _TRUTH
            case Conditional():
                return self._conditional(node)
        raise AssertionError(node)

    def _truth(self, node: Node, word: str) -> Part:
        """The plan of a truth that a word takes."""
        plan, node_type = self.check(node)
        if node_type.kind.is_truth:
            return plan
        meant = {0.0: "False", 1.0: "True"}.get(node.value) if isinstance(node, Number) else None
        accepted = 'True or False: a bool, a comparison such as speed > 0, or such as "InAir" in Tags'
        raise Refusal(node.start, node.stop, f"{word} takes True or False, and this is {node_type.kind.value}", accepted, meant)

    def _name(self, node: Name) -> Checked:
        condition = self.conditions.get(node.name)
        if condition is None:
            raise self._no_condition(node)
        if node.name not in self.names:
            self.names.append(node.name)
        domain = condition.domain
        unit = condition.unit if condition.unit and domain.type.has_unit else None
        values = domain.known if domain.type.needs_values else None
        return Given(node.name, domain.type), Type(domain.type, values, unit)

    def _unary(self, node: Unary) -> Checked:
        if node.sign == "not":
            return self._folded(node, Negation(self._truth(node.part, '"not"'))), _TRUTH
        part, part_type = self.check(node.part)
        self._need_number(node.part, part_type, in_quotes(node.sign))
        kind = INT.type if part_type.kind.is_whole else NUMBER.type
        plan = part if node.sign == "+" else self._folded(node, Apply(NEGATIVE, (part,)))
        return plan, Type(kind, None, part_type.unit)

    def _arithmetic(self, node: Arithmetic) -> Checked:
        function = OPERATORS[node.sign]
        parts = [self.check(part) for part in node.parts]
        for part, (_, part_type) in zip(node.parts, parts, strict=True):
            self._need_number(part, part_type, in_quotes(node.sign))
        if node.sign in ("/", "//", "%") and parts[1][0] == Const(0.0):
            raise Refusal(node.right.start, node.right.stop, "nothing can be divided by 0", "a divisor that is not always 0")
        return self._applied(node, function, parts)

    def _call(self, node: Call) -> Checked:
        function = FUNCTIONS.get(node.name)
        if function is None:
            raise self._no_function(node)
        n_given = len(node.arguments)
        if n_given < function.least or (function.most is not None and n_given > function.most):
            given = plural(n_given, "argument")
            raise Refusal(node.start, node.stop, f"{in_quotes(node.name)} is given {given}", function.form)
        parts = [self.check(part) for part in node.arguments]
        for part, (_, part_type) in zip(node.arguments, parts, strict=True):
            self._need_number(part, part_type, in_quotes(node.name))
        return self._applied(node, function, parts)

    def _literal(self, node: Call, kind: Kind) -> Checked:
        """A number that is spelt as a text: date("2026-01-31")."""
        text = node.arguments[0] if len(node.arguments) == 1 else None
        if not isinstance(text, Text):
            raise Refusal(node.start, node.stop, f"{in_quotes(kind.name)} takes one text in quotes", kind.result)
        return spelt(text, kind)

    def _comparison(self, node: Comparison) -> Checked:
        parts = spelt_alike([(part, *self.check(part)) for part in node.operands])
        links = []
        for i, sign in enumerate(node.signs):
            links.append(self._link(sign, node.operands[i], parts[i], node.operands[i + 1], parts[i + 1]))
        return self._folded(node, Compare(tuple(plan for plan, _ in parts), tuple(links))), _TRUTH

    def _conditional(self, node: Conditional) -> Checked:
        condition = self._truth(node.condition, '"if"')
        (then, a), (otherwise, b) = self.check(node.then), self.check(node.otherwise)
        kind = _common_kind(a, b)
        if kind is None:
            why = f'before "if" is {a.kind.value}, after "else" {b.kind.value}'
            raise Refusal(node.start, node.stop, why, "two values of one type")
        values = a.values | b.values if a.values is not None and b.values is not None else None
        result = Type(kind, values, self._common_unit(node, [a, b]))
        return self._folded(node, Select(condition, then, otherwise)), result

    # ---- names

    def _no_condition(self, node: Name) -> Refusal:
        if node.is_bare and node.name.casefold() in ("true", "false"):
            meant = node.name.capitalize()
            return Refusal(node.start, node.stop, f"{in_quotes(node.name)} is not a name", "True or False", meant)
        why = f"there is no condition {in_quotes(node.name)}"
        if node.is_bare and node.name in FUNCTIONS:
            return Refusal(node.start, node.stop, f"{in_quotes(node.name)} is a function", FUNCTIONS[node.name].form)
        accepted = some(self.conditions) or "numbers only: no condition is declared"
        if any(node.name in c.domain.known for c in self.conditions.values()):
            return UnknownName(node.start, node.stop, why, accepted, written_text(node.name))
        near = nearest(node.name, self.conditions)
        return UnknownName(node.start, node.stop, why, accepted, written_name(near) if near else None)

    def _no_function(self, node: Call) -> Refusal:
        stop = node.start + len(node.name)
        near = nearest(node.name, FUNCTIONS)
        why = f"there is no function {in_quotes(node.name)}"
        if node.name in self.conditions:
            why = f"{in_quotes(node.name)} is a condition, not a function"
        return Refusal(node.start, stop, why, ", ".join(FUNCTIONS), near)

    # ---- types

    def _need_number(self, node: Node, node_type: Type, role: str) -> None:
        if node_type.is_number:
            return
        meant = None
        if node_type.kind.is_truth and isinstance(node, Name):
            meant = f"(1 if {written_name(node.name)} else 0)"
        elif isinstance(node, Text) and node.value in self.conditions:
            meant = written_name(node.value)
        raise Refusal(node.start, node.stop, f"{role} takes numbers, and this is {node_type.kind.value}", "a number", meant)

    def _common_unit(self, node: Node, types: list[Type]) -> str | None:
        units = list(dict.fromkeys(t.unit for t in types if t.unit))
        if len(units) > 1:
            why = f"{in_quotes(units[0])} and {in_quotes(units[1])} are two units"
            raise Refusal(node.start, node.stop, why, "one unit; a factor, as in * 3.6, takes a number out of its unit")
        return units[0] if units else None

    def _applied(self, node: Node, function: Function, parts: list[Checked]) -> Checked:
        types = [part_type for _, part_type in parts]
        unit = self._common_unit(node, types) if function.keeps_unit else None
        is_whole = all(t.kind.is_whole for t in types)
        kind = ANGLE.type if function.gives == "angle" else NUMBER.type
        if function.gives == "whole" or (function.gives == "whole if whole" and is_whole):
            kind = INT.type
        return self._folded(node, Apply(function, tuple(plan for plan, _ in parts))), Type(kind, None, unit)

    def _power(self, node: Arithmetic) -> Checked:
        parts = [self.check(part) for part in node.parts]
        for part, (_, part_type) in zip(node.parts, parts, strict=True):
            self._need_number(part, part_type, '"**"')
        exponent = parts[1][0]
        if not (isinstance(exponent, Const) and exponent.value in range(MOST_POWER + 1)):
            why = f'"**" accepts only a whole number from 0 to {MOST_POWER}, written out'
            raise Refusal(node.right.start, node.right.stop, why, "sqrt(x) for a root, 1 / x ** 2 for a negative power")
        return self._applied(node, power_of(int(exponent.value)), parts[:1])

    def _folded(self, node: Node, plan: Part) -> Part:
        """The plan, or its value where no fact has a say in it."""
        value = constant(plan)
        if value is None:
            return plan
        if value != value:
            raise Refusal(node.start, node.stop, "this has no finite value", "numbers up to 1.79e308")
        return Const(value)

    # ---- comparisons

    def _link(self, sign: str, left: Node, a: Checked, right: Node, b: Checked) -> Link:
        if a[1].is_number and b[1].is_number:
            return self._number_link(sign, left, a, right, b)
        for node, (_, part_type) in ((left, a), (right, b)):
            if part_type.kind.is_tags:
                accepted = '"InAir" in Tags, or Tags in "+InAir -Stunned"'
                raise Refusal(node.start, node.stop, f"a set of tags is not compared with {in_quotes(sign)}", accepted)
        if a[1].is_number or b[1].is_number or a[1].is_text is not b[1].is_text:
            raise self._two_kinds(left, a[1], right, b[1])
        if sign not in ("==", "!="):
            what = "names have no order" if a[1].is_text else "True and False have no order"
            accepted = '==, != or in ["Walk", "Run"]' if a[1].is_text else "== or !="
            raise Refusal(left.start, right.stop, f"{in_quotes(sign)} asks for an order, and {what}", accepted)
        for word, (_, other) in ((left, b), (right, a)):
            require_value(word, other)
        return Link(sign)

    def _two_kinds(self, left: Node, a: Type, right: Node, b: Type) -> Refusal:
        for node in (left, right):
            if isinstance(node, Text) and node.value in self.conditions:
                why = f"{a.kind.value} is compared with {b.kind.value}"
                return Refusal(node.start, node.stop, why, "two values of one type", written_name(node.value))
        return Refusal(left.start, right.stop, f"{a.kind.value} is compared with {b.kind.value}", "two values of one type")

    def _number_link(self, sign: str, left: Node, a: Checked, right: Node, b: Checked) -> Link:
        self._common_unit_of_link(left, right, a[1], b[1])
        n_angles = a[1].kind.is_circular + b[1].kind.is_circular
        if sign in ("==", "!="):
            return Link(sign, is_wrapped=n_angles > 0)
        if n_angles == 2:
            why = "two angles have no order, because they wrap around"
            raise Refusal(left.start, right.stop, why, "wrap_angle(a - b) > 0 where a is to the left of b")
        if n_angles == 0:
            return Link(sign)
        for node, (plan, _) in ((left, a), (right, b)):
            if isinstance(plan, Const) and not -180.0 <= float(plan.value) <= 180.0:
                number = format_number(float(plan.value))
                raise Refusal(
                    node.start, node.stop, f"an angle is from -180 to 180, and {number} is outside", 'heading in "170..190"'
                )
        is_upper = sign in (">", ">=")
        return Link(sign, left_is_high=is_upper and a[1].kind.is_circular, right_is_high=not is_upper and b[1].kind.is_circular)

    def _common_unit_of_link(self, left: Node, right: Node, a: Type, b: Type) -> None:
        self._common_unit(Node(left.start, right.stop), [a, b])


def _common_kind(a: Type, b: Type) -> Kind | None:
    if a.kind is b.kind:
        return a.kind
    if a.is_number and b.is_number:
        return INT.type if a.kind.is_whole and b.kind.is_whole else NUMBER.type
    return TEXT.type if a.is_text and b.is_text else None
