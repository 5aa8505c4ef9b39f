"""The programs of a compiled table: those of its derived facts and rules, for the core and for its artefact."""

from __future__ import annotations

from contextdb.cells.conditions import Condition
from contextdb.expressions.derived import Derivation
from contextdb.expressions.programs import Programs
from contextdb.expressions.rules import WhenRules
from contextdb.files.tensors import Tensors, texts_to_array


def programs_of(derivation: Derivation | None, when: WhenRules | None) -> Programs | None:
    """The programs of derived facts, each behind those that it needs, then those of rules; None where there are none."""
    steps = derivation.steps if derivation else ()
    rules = when.rules if when else ()
    if not steps and not rules:
        return None
    programs = Programs({c.name: c for c in named_conditions(derivation, when)})
    for expression in (*(step.expression for step in steps), *(rule.expression for rule in rules)):
        programs.add(expression.plan)
    names = list(programs.facts)
    programs.derived = [names.index(step.condition.name) for step in steps]
    programs.of_row = when.of_row if when else programs.of_row
    return programs


def programs_to_tensors(programs: Programs | None) -> Tensors:
    """Programs as arrays, see `contextdb.compiled.artefact` for their names; none for a table without rules and derived facts."""
    if programs is None:
        return {}
    starts, derived, of_row = programs.places
    return {
        "programs.code": programs.code_array,
        "programs.numbers": programs.numbers_array,
        "programs.texts": texts_to_array(programs.texts),
        "programs.starts": starts,
        "programs.facts": texts_to_array(list(programs.facts)),
        "programs.types": texts_to_array([c.domain.kind for c in programs.facts.values()]),
        "programs.derived": derived,
        "programs.of_row": of_row,
    }


def named_conditions(derivation: Derivation | None, when: WhenRules | None) -> tuple[Condition, ...]:
    """Every condition that programs name or compute: those of derived facts and rules."""
    derived = derivation.conditions if derivation else ()
    ruled = when.conditions if when else ()
    return tuple({c.name: c for c in (*derived, *ruled)}.values())
