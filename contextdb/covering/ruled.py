"""A table with rules as one without: what coverage, checks and effects measure.

A rule whose truth is one box of cells is put into the cells of its rows. Any other becomes a derived bool condition of its own,
True in its rows, so that what boxes tell of it is exact and the rest is drawn, as with other derived facts. Conditions that only
rules name become columns that say Any.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field, replace

from contextdb import bitmask
from contextdb.cells.conditions import Condition
from contextdb.cells.domains import BOOL
from contextdb.cells.grammar import format_cell
from contextdb.cells.sets import Accepted, Cell, TagSet, meet_plainly
from contextdb.columns import TextColumn
from contextdb.covering.report import CoverageReport, Gap, Nearest
from contextdb.errors import safe_text
from contextdb.expressions import constant_truth
from contextdb.expressions.boxes import Box
from contextdb.expressions.rules import Rule, WhenRules
from contextdb.expressions.tokens import written_name, written_text
from contextdb.findings import Finding
from contextdb.tables.condition_column import ConditionColumn
from contextdb.tables.nesting.flat import FlatTable
from contextdb.tables.table import EitherTable, Table

_DEAD = "the row is valid in no context: its rule, its cells and what is assumed never hold together."
MOST_NAMED = 200
"""So many characters of a rule name its condition."""


@dataclass(frozen=True, eq=False)
class RuledTable:
    """A table without rules that is valid where one with rules is."""

    table: EitherTable
    column: str | None = None
    """The column of rules; None where there is none, and `table` is the table itself."""
    rules: Mapping[str, str] = field(default_factory=dict)
    """The rules that are conditions now, by the name of the condition."""
    others: Mapping[str, Condition] = field(default_factory=dict)
    """The conditions that have become columns."""
    rows: int = 0
    """The rows that had a rule, as bits."""

    def with_rules(self, report: CoverageReport) -> CoverageReport:
        """A report in which cells of columns that the table does not have are a rule."""
        if self.column is None:
            return report
        gaps = tuple(map(self.gap, report.gaps))
        crowded = tuple(replace(crowd, cells=self.cells(crowd.cells)) for crowd in report.crowded)
        n_conditions = report.n_conditions - len(self.rules) - len(self.others)
        findings = tuple(self.findings(report.findings))
        return replace(report, gaps=gaps, crowded=crowded, findings=findings, n_conditions=n_conditions)

    def gap(self, gap: Gap) -> Gap:
        """A gap by the columns of the table with rules."""
        return gap if self.column is None else replace(gap, cells=self.cells(gap.cells), nearest=self._nearest(gap.nearest))

    def findings(self, findings: Iterable[Finding]) -> Iterator[Finding]:
        """Findings of rows; a row that is dead and has a rule may be so by its rule."""
        for finding in findings:
            has_rule = finding.row is not None and self.rows >> finding.row & 1
            yield replace(finding, message=_DEAD) if has_rule and finding.rule == "dead-row" else finding

    def cells(self, cells: Mapping[str, str]) -> dict[str, str]:
        """Cells by the columns of the table with rules."""
        assert self.column is not None
        own = {name: text for name, text in cells.items() if name not in self.rules and name not in self.others}
        parts = [self._part(name, text) for name, text in cells.items() if name not in own]
        return own | ({self.column: " and ".join(parts)} if parts else {})

    def _nearest(self, nearest: Nearest | None) -> Nearest | None:
        """The same change; of a rule the cell that has none."""
        assert self.column is not None
        is_rule = nearest is not None and nearest.condition in self.rules
        return replace(nearest, condition=self.column, cell="Any") if nearest is not None and is_rule else nearest

    def _part(self, name: str, text: str) -> str:
        if name in self.rules:
            return f"({self.rules[name]})" if text == "True" else f"not ({self.rules[name]})"
        if self.others[name].domain.type.is_truth:
            return written_name(name) if text == "True" else f"not {written_name(name)}"
        return f"{written_name(name)} in {written_text(text)}"


def without_rules(table: EitherTable) -> RuledTable:
    """The table with its rules as cells and conditions; the table itself where it has none."""
    when = WhenRules.of(table.when)
    if when is None:
        return RuledTable(table)
    reader = _Folder(table, when)
    for rule in when.rules:
        reader.add(rule)
    return reader.done()


class _Folder:
    """Puts one rule after the other into columns."""

    def __init__(self, table: EitherTable, when: WhenRules) -> None:
        self.table, self.when = table, when
        self.columns = {column.condition.name: column for column in table.conditions}
        self.rules: dict[str, str] = {}
        self.others: dict[str, Condition] = {}
        self.new: dict[str, Condition] = {}
        """What becomes declared."""
        self.never = 0
        """The rows whose rule is false in every context: they are switched off."""

    def add(self, rule: Rule) -> None:
        boxes, expression = rule.true_boxes, rule.expression
        if constant_truth(expression) is False:
            self.never |= rule.rows
            return
        if boxes is not None:
            for condition in expression.conditions:
                if condition.name not in self.columns:
                    self.others[condition.name] = condition
                    self.columns[condition.name] = self._column(condition, ["Any"] * self.table.n_rows)
        rows = bitmask.rows(bitmask.from_int(rule.rows, self.table.n_rows)).tolist()
        if type(self.table) is Table and boxes is not None and len(boxes) == 1 and self._fold(boxes[0], rows):
            return
        condition = Condition(self._name(expression.text), BOOL, expr=expression.text)
        self.rules[condition.name] = expression.text
        self.new[condition.name] = condition
        held = set(rows)
        self.columns[condition.name] = self._column(condition, ["True" if r in held else "Any" for r in range(self.table.n_rows)])

    def _fold(self, box: Box, rows: list[int]) -> bool:
        """Narrow the cells of some rows to a box; False, and nothing is done, where one would hold nothing or cannot say it."""
        changed: dict[str, ConditionColumn] = {}
        for name, cell in box.items():
            column = self.columns[name]
            texts = column.texts.to_list()
            for code in {int(column.texts.codes[row]) for row in rows}:
                old = column.cells[code]
                if isinstance(old.accepts, TagSet) and old.accepts.is_complement:
                    return False
                accepts = _common(None if old.is_soft else old.accepts, cell.accepts)
                if accepts is None or accepts.is_empty:
                    return False
                text = format_cell(Cell(accepts), column.condition.domain)
                for row in rows:
                    if column.texts.codes[row] == code:
                        texts[row] = text
            changed[name] = self._column(column.condition, texts)
        self.columns |= changed
        return True

    def _column(self, condition: Condition, texts: list[str]) -> ConditionColumn:
        return ConditionColumn.read(TextColumn.of(condition.name, texts), condition)

    def _name(self, text: str) -> str:
        name = f"{self.when.name}: {safe_text(text, MOST_NAMED)}"
        while name in self.columns or name in self.table.schema.conditions:
            name += "_"
        return name

    def done(self) -> RuledTable:
        """The table with these columns and without rules."""
        table = self.table
        conditions = tuple(self.columns.values())
        plain = [c for c in table.columns if c.name not in self.columns]
        known = {**table.schema.conditions, **{c.condition.name: c.condition for c in table.conditions}, **self.new}
        enabled = table.settings.enabled
        if isinstance(table, FlatTable):
            table = replace(table, switched_off=self.never)
        elif self.never:
            on = table.enabled & ~bitmask.unpack(bitmask.from_int(self.never, table.n_rows), table.n_rows)
            enabled = self._name("enabled")
            plain.append(TextColumn.of(enabled, map(str, on.tolist())))
        now = replace(
            table,
            settings=replace(table.settings, when=None, asset=table.asset_column, enabled=enabled),
            schema=replace(table.schema, conditions=known),
            columns=(*plain, *(c.texts for c in conditions)),
            conditions=conditions,
        )
        return RuledTable(now, self.when.name, self.rules, self.others, self.when.rows)


def _common(a: Accepted | None, b: Accepted | None) -> Accepted | None:
    return b if a is None else a if b is None else meet_plainly(a, b)
