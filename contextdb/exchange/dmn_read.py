"""A decision table of a DMN file as columns: inputs are conditions, outputs and annotations are data, the first output the asset.

A rule is a row. The hit policy becomes the table's policy. What a cell cannot say becomes the row's own rule where an expression
can; else it is kept as `= TEXT`, which no type reads, and is reported with its rule and column. A document type, and with it bombs
and external entities, is refused before anything is parsed.

Source: OMG, Decision Model and Notation 1.3 to 1.5; `bpmn-io/dmn-js` for what editors write.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from itertools import count
from typing import Any
from xml.etree import ElementTree

from contextdb.cells.conditions import Condition
from contextdb.cells.domains import TEXT, Domain
from contextdb.cells.output_types import OUTPUT_TYPES, OutputValue
from contextdb.cells.outputs import Output
from contextdb.columns import TextColumn
from contextdb.errors import Fault, Place, TableError, in_quotes, no_such, plural, safe_text, some
from contextdb.exchange.delimited import decoded
from contextdb.exchange.dmn_types import InputType, Types, children_of, domain_of, tag_of, text_of
from contextdb.exchange.feel import cell_of, rule_of, strings_of, value_of
from contextdb.exchange.proposals import propose_type
from contextdb.exchange.reading import Reading, Remark, capped, listed, require_no_conflicts
from contextdb.expressions.rules import check_rule
from contextdb.files.csv_source import name_faults
from contextdb.schema.outputs import outputs_faults, outputs_to_toml
from contextdb.schema.policies import POLICIES
from contextdb.schema.settings import Schema, TableSettings, conditions_from_dict

OF_LETTERS = {letters: policy for policy, kind in POLICIES.items() for letters in kind.dmn}
PRIORITY = "Priority"
"""The column that holds what DMN tells by the order of the output's values."""
WHEN = "When"
"""The column that holds the tests that no cell can say, as rules."""
_LETTERS = {"U": "UNIQUE", "F": "FIRST", "P": "PRIORITY", "A": "ANY", "C": "COLLECT", "R": "RULE ORDER", "O": "OUTPUT ORDER"}
_VERSIONS = {"20151101": "1.1", "20180521": "1.2", "20191111": "1.3", "20211108": "1.4", "20230324": "1.5"}
_TYPE = re.compile(r"<!(?:DOCTYPE|ENTITY)", re.IGNORECASE)
_NAME = re.compile(r"[^\W\d][\w ]*(?:\.[^\W\d][\w ]*)*")
_ACCEPTED = "a DMN file with a decision table"
_HOLDERS = ("decision", "businessKnowledgeModel")
_NAMES = ("name", "id")

_NOTE = InputType("annotation")

Element = ElementTree.Element
Given = tuple[tuple[str, OutputValue], ...]
"""Names and values of outputs."""


@dataclass(frozen=True)
class _Column:
    """A column of the decision table: name, type, the texts of its entries; of an output also its values and its default."""

    name: str
    kind: InputType
    entries: Sequence[str]
    values: tuple[str, ...] = ()
    default: str = ""

    @cached_property
    def cells(self) -> list[str | None]:
        """Of an input, the cell of each entry; None for what no cell can say."""
        return [cell_of(entry.lower() if self.kind.kind == "boolean" else entry) for entry in self.entries]  # some write True


def read_dmn(raw: bytes, file: str, decision: str | None = None) -> Reading:
    """Read a decision table: the one whose name or id is `decision`, else the only one there is. Raises TableError where the file
    is no DMN, is broken, declares a document type, or has several tables of which none is named."""
    root = _parsed(raw, file)
    element, name = _chosen(root, decision, file)
    rules = children_of(element, "rule")
    types = Types.of(root)
    tests, values, texts = (_entries(rules, tag) for tag in ("inputEntry", "outputEntry", "annotationEntry"))
    inputs = [_input(one, at, _at(tests, at), types) for at, one in enumerate(children_of(element, "input"))]
    outputs = [_output(one, at, _at(values, at), name, types) for at, one in enumerate(children_of(element, "output"))]
    notes = [_annotation(one, at, _at(texts, at)) for at, one in enumerate(children_of(element, "annotation"))]
    notes += _descriptions(rules)
    if not outputs:
        raise TableError(Fault("the decision table has no output.", "an output, which names the asset", place=Place(file)))
    policy, policy_remarks = _policy(element)
    if policy == "priority" and any(one.values for one in outputs[1:]):
        policy_remarks.append(
            Remark("the order of the first output's values gives the priorities; that of others is not kept.", is_loss=True)
        )
    declared, lost_types = _declared(inputs)
    judged = {one.name: _judged(one) for one in inputs if one.name not in declared}
    rules_of_rows = Rules.of(inputs, types, {**judged, **declared})
    conditions, lost = _conditions(inputs, rules_of_rows)
    data, lost_values = _data([*outputs, *notes])
    taken = [column.name for column in (*conditions, *data)]
    when = rules_of_rows.column(taken)
    columns = [data[0], *conditions, *when, *data[1:], *_priority(policy, outputs[0], data[0])]
    faults = [fault.at(Place(file)) for fault in name_faults([column.name for column in columns])]
    if faults:
        raise TableError(*faults)
    plain = tuple(column.name for column in data[1:])
    typed, lost_outputs = _typed(outputs[1:])
    fallback, given, lost_defaults = _fallback(outputs, typed)
    settings = TableSettings(
        name,
        asset=data[0].name,
        outputs=plain,
        policy=policy,
        priority=PRIORITY if policy == "priority" and columns[-1].name == PRIORITY else None,
        fallback=fallback,
        when=when[0].name if when else None,
        typed=typed,
        fallback_outputs=given,
    )
    schema = Schema(conditions={**declared, **rules_of_rows.facts}, tables={name: settings})
    all_remarks = [*_version(root), *policy_remarks, *_expressions(element), *_results(root, inputs)]
    all_remarks += [*lost_types, *lost_outputs, *lost_defaults, *rules_of_rows.remarks()]
    remarks = (*all_remarks, *capped([*lost, *lost_values, *_notes_on_entries(rules)], "such entries"))
    return Reading(tuple(columns), "dmn", remarks, schema, outputs=plain)


# ---- the document


def _parsed(raw: bytes, file: str) -> Element:
    text, _ = decoded(raw, file)
    require_no_conflicts(text, file)
    if _TYPE.search(text):
        raise TableError(
            Fault("the file declares a document type or entities, which no DMN file does.", _ACCEPTED, place=Place(file))
        )
    try:
        root = ElementTree.fromstring(re.sub(r"^\s*<\?xml[^>]*\?>", "", text))
    except (ElementTree.ParseError, ValueError, RecursionError) as error:
        line = error.position[0] if isinstance(error, ElementTree.ParseError) else None
        raise TableError(Fault(f"this is not readable XML: {safe_text(str(error))}.", _ACCEPTED, place=Place(file, line))) from None
    if tag_of(root) != "definitions":
        raise TableError(Fault(f"this is not DMN: its root is <{safe_text(tag_of(root))}>.", _ACCEPTED, place=Place(file)))
    return root


def _chosen(root: Element, wanted: str | None, file: str) -> tuple[Element, str]:
    """The decision table that is requested, and its decision's name."""
    tables = list(_tables(root))
    names = [one.get("name") or one.get("id") or "decision" for one, _ in tables]
    if wanted is not None:
        for (one, table), name in zip(tables, names, strict=True):
            if wanted in (name, one.get("id")):
                return table, name
        raise TableError(no_such("decision table", wanted, names, some(names) or "none", Place(file)))
    if not tables:
        raise TableError(Fault("the file has no decision table.", _ACCEPTED, place=Place(file)))
    if len(tables) > 1:
        problem = f"the file has {len(tables)} decision tables: {listed(names)}."
        raise TableError(Fault(problem, "one of them", f"to name it: --sheet {in_quotes(names[0])}", Place(file)))
    return tables[0][1], names[0]


def _tables(root: Element) -> Iterator[tuple[Element, Element]]:
    """The decision tables of a file in its order, each with the decision that it is in; each element is looked at once."""
    open_ones: list[tuple[Element, Element | None]] = [(root, None)]
    while open_ones:
        one, holder = open_ones.pop()
        if tag_of(one) == "decisionTable" and holder is not None:
            yield holder, one
        holder = one if tag_of(one) in _HOLDERS else holder
        open_ones += [(child, holder) for child in reversed(one)]


def _version(root: Element) -> tuple[Remark, ...]:
    space = root.tag.partition("}")[0].lstrip("{")
    version = next((name for date, name in _VERSIONS.items() if date in space), None)
    return () if version else (Remark(f"the version of DMN is not known, {in_quotes(space)}; it is read as 1.3 to 1.5."),)


def _entries(rules: Sequence[Element], tag: str) -> list[list[str]]:
    """The texts of each rule's entries of one kind."""
    return [[text_of(entry) for entry in children_of(rule, tag)] for rule in rules]


def _at(entries: Sequence[Sequence[str]], at: int) -> list[str]:
    """The entries of one column, empty where a rule has too few."""
    return [texts[at] if at < len(texts) else "" for texts in entries]


# ---- columns


def _input(element: Element, at: int, entries: Sequence[str], types: Types) -> _Column:
    expression = next(iter(children_of(element, "inputExpression")), None)
    expression_text, label = text_of(expression), (element.get("label") or "").strip()
    name = expression_text if _NAME.fullmatch(expression_text) else label or expression_text or f"input {at + 1}"
    kind = types.of_input(expression, expression_text)
    allowed = text_of(next(iter(children_of(element, "inputValues")), None)) or kind.allowed
    return _Column(name, InputType(kind.kind, allowed), entries)


def _output(element: Element, at: int, entries: Sequence[str], decision: str, types: Types) -> _Column:
    name = element.get("name") or element.get("label") or (decision if at == 0 else f"output {at + 1}")
    values = text_of(next(iter(children_of(element, "outputValues")), None))
    strings = tuple(strings_of(values))
    default = text_of(next(iter(children_of(element, "defaultOutputEntry")), None))
    kind = types.named(element.get("typeRef") or "")
    return _Column(name, InputType(kind.kind, values or kind.allowed), entries, strings, default)


def _annotation(element: Element, at: int, entries: Sequence[str]) -> _Column:
    return _Column(element.get("name") or f"annotation {at + 1}", _NOTE, entries)


def _descriptions(rules: Sequence[Element]) -> list[_Column]:
    """The descriptions of the rules, which some editors write in place of annotations, where there are any."""
    texts = [next(((one.text or "").strip() for one in children_of(rule, "description")), "") for rule in rules]
    return [_Column("description", _NOTE, texts)] if any(texts) else []


def _conditions(inputs: Sequence[_Column], rules: Rules) -> tuple[list[TextColumn], list[Remark]]:
    """The columns of the inputs: a test that no cell can say is a rule of its row, or kept as a cell that no type reads."""
    columns, lost = [], []
    for one in inputs:
        texts = []
        for rule, (entry, cell) in enumerate(zip(one.entries, one.cells, strict=True), 1):
            is_rule = cell is None and rules.add(rule - 1, one.name, entry)
            if cell is None and not is_rule:
                problem = f"{in_quotes(entry)} is not a test that a cell or a rule can express; it is kept as unreadable text."
                lost.append(Remark(problem, _place(rule, one.name), True))
            texts.append("-" if is_rule else f"= {entry}" if cell is None else cell)
        columns.append(TextColumn.of(one.name, texts))
    return columns, lost


@dataclass
class Rules:
    """The rules of rows that tests become, and the facts that they name next to the inputs."""

    conditions: Mapping[str, Condition]
    types: Types
    known: tuple[str, ...]
    rules: list[list[str]]
    facts: dict[str, Condition] = field(default_factory=dict)
    n_tests: int = 0

    @classmethod
    def of(cls, inputs: Sequence[_Column], types: Types, declared: Mapping[str, Condition]) -> Rules:
        """No rules yet, over the inputs and all other facts of the file."""
        n_rows = len(inputs[0].entries) if inputs else 0
        known = dict.fromkeys((*(one.name for one in inputs), *types.paths()))
        return cls({one.name: declared[one.name] for one in inputs}, types, tuple(known), [[] for _ in range(n_rows)])

    def add(self, row: int, name: str, test: str) -> bool:
        """Make a test of an input a rule of its row; gives whether an expression can say it."""
        read = rule_of(test, name, self.known)
        if read is None:
            return False
        rule, named = read
        new = {other: self._condition(other, self.conditions[name]) for other in named if other not in self.conditions}
        together = [*self.rules[row], rule]
        text = together[0] if len(together) == 1 else " and ".join(f"({one})" for one in together)
        if check_rule(text, {**self.conditions, **self.facts, **new}) is not None:
            return False
        self.facts |= new
        self.rules[row].append(rule)
        self.n_tests += 1
        return True

    def _condition(self, name: str, like: Condition) -> Condition:
        """A fact that is no input: of the type that the file says, else of that of the input it is compared with."""
        kind = self.types.of_input(None, name)
        domain, _ = domain_of(replace(kind, allowed=""), [], "")
        if domain is None:
            domain = TEXT if kind.kind == "string" or like.domain.type.is_named else Domain(like.domain.kind)
        return Condition(name, domain)

    def column(self, taken: Sequence[str]) -> list[TextColumn]:
        """The column of rules, under a name that no other has; none where there is no rule."""
        if not self.n_tests:
            return []
        name = next(name for i in count(1) if (name := WHEN if i == 1 else f"{WHEN} {i}") not in taken)
        texts = (" and ".join(f"({rule})" for rule in rules) if len(rules) > 1 else "".join(rules) for rules in self.rules)
        return [TextColumn.of(name, texts)]

    def remarks(self) -> Iterator[Remark]:
        if self.n_tests:
            named = f"; the game supplies the other facts that they name: {listed(list(self.facts))}" if self.facts else ""
            yield Remark(f"{plural(self.n_tests, 'test')} that no cell can say became rules of their rows{named}.")


def _data(outputs: Sequence[_Column]) -> tuple[list[TextColumn], list[Remark]]:
    columns, lost = [], []
    for one in outputs:
        texts = []
        for rule, entry in enumerate(one.entries, 1):
            value = entry if one.kind == _NOTE else value_of(entry)
            if value is None:
                lost.append(Remark(f"{in_quotes(entry)} is an expression; it is kept as text.", _place(rule, one.name), True))
            texts.append(entry if value is None else value)
        columns.append(TextColumn.of(one.name, texts))
    return columns, lost


def _place(rule: int, column: str) -> str:
    return f"rule {rule}, column {in_quotes(column)}"


def _expressions(element: Element) -> list[Remark]:
    """Inputs that are worked out of others: the game must give such a fact itself."""
    remarks = []
    for one in children_of(element, "input"):
        expression_text, label = text_of(next(iter(children_of(one, "inputExpression")), None)), one.get("label")
        if expression_text and not _NAME.fullmatch(expression_text) and expression_text != label:
            message = f"{in_quotes(expression_text)} is an expression; as a column it is a fact that the game supplies."
            remarks.append(Remark(message, f"input {in_quotes(label or expression_text)}", True))
    return remarks


def _declared(inputs: Sequence[_Column]) -> tuple[dict[str, Condition], list[Remark]]:
    """The conditions whose type the file tells for certain, others are judged by their cells; and what of the types is lost."""
    declared, lost = dict[str, Condition](), list[Remark]()
    for one in inputs:
        entries = [entry for entry, cell in zip(one.entries, one.cells, strict=True) if cell is not None]
        domain, remarks = domain_of(one.kind, entries, f"input {in_quotes(one.name)}")
        lost += remarks
        if domain is not None:
            declared[one.name] = Condition(one.name, domain)
        elif len(entries) < len(one.entries) or _proposed_type(one) is None:  # by its cells the column would be data
            declared[one.name] = _judged(one)
    return declared, lost


def _proposed_type(one: _Column) -> Mapping[str, object] | None:
    """The type that the cells of an input tell of; None where they would be data."""
    return propose_type(TextColumn.of(one.name, (cell for cell in one.cells if cell is not None))).declared


def _judged(one: _Column) -> Condition:
    """An input of no type that a column has, such as a date: what its cells say, and never data."""
    return conditions_from_dict({one.name: _proposed_type(one) or {"type": "text"}})[one.name]


def _typed(outputs: Sequence[_Column]) -> tuple[tuple[Output, ...], list[Remark]]:
    """The outputs whose type the file tells, where all their entries are values of it; the others are texts."""
    typed, remarks = list[Output](), list[Remark]()
    for one in outputs:
        domain, lost = domain_of(one.kind, [], place := f"output {in_quotes(one.name)}")
        remarks += lost
        if domain is None or domain.kind not in OUTPUT_TYPES:
            continue
        output = Output(one.name, domain.kind, None, domain.minimum, domain.maximum, domain.values or ())
        wrong = next((entry for entry in one.entries if not output.reads(value_of(entry) or "")), None)
        declared = outputs_to_toml([one.name], [output])
        if wrong is not None:
            problem = f"{in_quotes(wrong)} is not a value of its type" if wrong else "an entry is empty"
            remarks.append(Remark(f"{problem}, so it is read as text.", place))
        elif not any(outputs_faults({"outputs": declared})):
            typed.append(output)
    return tuple(typed), remarks


def _fallback(outputs: Sequence[_Column], typed: Sequence[Output]) -> tuple[str | None, Given, list[Remark]]:
    """What the outputs are when no rule holds: the table's fallback, if the first, the asset, has a default."""
    asset, known = value_of(outputs[0].default) or None, {output.name: output for output in typed}
    given, lost = list[tuple[str, OutputValue]](), list[Remark]()
    for one in outputs:
        if not one.default or (one is outputs[0] and asset is not None):
            continue
        output, value = known.get(one.name, Output(one.name)), value_of(one.default)
        if asset is not None and value is not None and output.reads(value):
            given.append((one.name, output.read(value)))
        else:
            lost.append(Remark(f"the default {in_quotes(one.default)} is not kept.", f"output {in_quotes(one.name)}", is_loss=True))
    return asset, tuple(given), lost


def _results(root: Element, inputs: Sequence[_Column]) -> Iterator[Remark]:
    """Inputs that other decisions of the file give: the game must give such a fact itself."""
    decisions = children_of(root, "decision")
    results = {one.get(key) for decision in decisions for one in (decision, *children_of(decision, "variable")) for key in _NAMES}
    for one in inputs:
        if one.name in results:
            message = "another decision of the file computes it; as a column it is a fact that the game supplies."
            yield Remark(message, f"input {in_quotes(one.name)}", True)


def _notes_on_entries(rules: Sequence[Element]) -> Iterator[Remark]:
    """Descriptions of single entries, for which a table has no place."""
    for rule, element in enumerate(rules, 1):
        for entry in element:
            note = next(((one.text or "").strip() for one in children_of(entry, "description")), "")
            if note:
                yield Remark(f"the note {in_quotes(note)} on an entry is not kept.", f"rule {rule}", True)


# ---- the hit policy


def _policy(element: Element) -> tuple[Any, list[Remark]]:
    letters = (element.get("hitPolicy") or "UNIQUE").upper().strip()
    letters = _LETTERS.get(letters, letters)
    policy = OF_LETTERS.get(letters, "collect")
    remarks = [Remark(f"the hit policy {letters} becomes the policy {in_quotes(policy)}.")]
    if letters not in OF_LETTERS:
        order = {
            "RULE ORDER": "all valid rows come, in the order of the table",
            "OUTPUT ORDER": "the order of the outputs is not kept",
        }
        remarks = [
            Remark(f"the hit policy {letters} becomes {in_quotes(policy)}: {order.get(letters, 'it is not known')}.", is_loss=True)
        ]
    if aggregation := element.get("aggregation"):
        remarks.append(Remark(f"the aggregation {in_quotes(aggregation)} is not kept: assets are not added up.", is_loss=True))
    return policy, remarks


def _priority(policy: str, output: _Column, asset: TextColumn) -> list[TextColumn]:
    """The order of the output's values as a column of priorities, the first value the highest."""
    if policy != "priority" or not output.values:
        return []
    rank = {value: len(output.values) - at for at, value in enumerate(output.values)}
    return [TextColumn.of(PRIORITY, (str(rank.get(text, 0)) for text in asset.to_list()))]
