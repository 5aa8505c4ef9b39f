"""The rules of a row that do not hold: the row's own, or where tables are in tables those of the rows of its way."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

from contextdb.cells.facts import Fact, Unknown
from contextdb.cells.words import says_any
from contextdb.columns import TextColumn
from contextdb.compiled.data import CompiledData
from contextdb.compiled.ways import Step
from contextdb.expressions import Expression
from contextdb.expressions.rules import WhenColumn
from contextdb.expressions.rules.rules import Rule, values_of


@dataclass(frozen=True, slots=True)
class RulePart:
    """A row's own rule; where tables are in tables, that of one row of the way."""

    column: str
    text: str
    rule: Expression
    step: Step | None = None


def rules_that_fail(
    compiled: CompiledData, row: int, facts: Mapping[str, Fact], unknown: Unknown
) -> Iterator[tuple[bool, RulePart]]:
    """The rules of a row that do not hold with some facts, and whether each is open; all of them where only together they do
    not."""
    parts = _rule_parts(compiled, row)
    truths = [Rule(p.rule, 0).truths(values_of(facts, p.rule.conditions), facts)[0] for p in parts]
    failing = [truth is False or (truth is None and unknown == "never") for truth in truths]
    for truth, part, fails in zip(truths, parts, failing, strict=True):
        if fails or not any(failing):
            yield truth is None, part


def _rule_parts(compiled: CompiledData, row: int) -> list[RulePart]:
    when, ways = compiled.when, compiled.ways
    assert when is not None
    whole = when.rules[int(when.of_row[row])].expression
    if ways is None or ways.rules is None:
        return [RulePart(when.name, when.texts[row], whole)]
    steps = ways.steps(row)
    pairs = [(steps[depth], text) for depth, text in ways.rules.said(row) if not says_any(text)]
    read = WhenColumn.read(TextColumn.of("", [text for _, text in pairs]), {c.name: c for c in whole.conditions})
    rules = (read.rule(at) for at in range(len(pairs)))
    return [RulePart(s.when or when.name, t, rule, s) for (s, t), rule in zip(pairs, rules, strict=True) if rule is not None]
