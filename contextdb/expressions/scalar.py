"""Compute a plan for one context: the core does, for facts in canonical form, a missing number as NaN, any other missing fact as
None. What C cannot hold, as a text with a NUL character, is computed as one of many contexts."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

from contextdb.cells.conditions import Condition
from contextdb.core import Program
from contextdb.expressions.columns import as_array, read_column, run_frame
from contextdb.expressions.plan import Apply, Compare, Const, Given, Held, Logic, Negation, Part, Select
from contextdb.expressions.programs import Programs, letter_of

Value = float | bool | str | frozenset[str] | None
Facts = Mapping[str, Value]
Run = Callable[[Facts], Value]


def constant(plan: Part) -> float | str | bool | None:
    """The value of a plan whose parts are constants; None for another."""
    if isinstance(plan, Const):
        return plan.value
    if isinstance(plan, Given) or not all(isinstance(part, Const) for part in _parts(plan)):
        return None
    value = runner(plan, ())({})
    assert not isinstance(value, frozenset)
    return value


def _parts(plan: Part) -> tuple[Part, ...]:
    if isinstance(plan, Select):
        return plan.condition, plan.then, plan.otherwise
    if isinstance(plan, (Held, Negation)):
        return (plan.part,)
    return plan.parts if isinstance(plan, (Apply, Compare, Logic)) else ()


def runner(plan: Part, conditions: Sequence[Condition]) -> Run:
    """The function of the facts of some conditions that computes a plan."""
    names = [condition.name for condition in conditions]
    programs = Programs({condition.name: condition for condition in conditions})
    programs.add(plan)
    types = "".join(letter_of(Given(c.name, c.domain.type)) for c in conditions) + ":" + letter_of(plan)

    def as_many(facts: Facts) -> Value:
        columns = {c.name: read_column([facts[c.name]], c, 1) for c in conditions}
        value: Value = as_array(run_frame(plan, columns, 1)).tolist()[0]
        return value

    try:
        run_program = Program(programs.code_array, programs.numbers_array, tuple(programs.texts), types).run
    except ValueError:
        return as_many

    def run(facts: Facts) -> Value:
        try:
            return run_program(tuple([facts[name] for name in names]))
        except (ValueError, OverflowError):
            return as_many(facts)

    return run


def is_missing(value: Value) -> bool:
    """Whether a value is missing: None or NaN."""
    return value is None or value != value
