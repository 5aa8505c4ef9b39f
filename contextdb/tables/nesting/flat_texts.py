"""The columns of a flat table that are not conditions: assets with their paths, outputs, and the rows' own rules."""

from __future__ import annotations

from collections.abc import Mapping

from contextdb.cells.outputs import Output
from contextdb.cells.words import says_any
from contextdb.columns import TextColumn
from contextdb.compiled.outputs import NO_OUTPUTS, Outputs, cells_of, outputs_of_cells
from contextdb.errors import Fault, Place, TableError, in_quotes
from contextdb.tables.data import output_columns_of
from contextdb.tables.nesting.expansion import Expansion
from contextdb.tables.nesting.names import asset_name
from contextdb.tables.nesting.slots import MANDATORY, OPTIONAL, all_words, optional_slots
from contextdb.tables.output_columns import layered

PATH_MARK = "/"


def paths_and_leaves(expansion: Expansion, name: str) -> tuple[TextColumn, tuple[str, ...]]:
    """The asset of each row with its path, as a column, and alone."""
    own = [[asset_name(text) for text in table.assets] for table in expansion.tables]
    depths = (expansion.rows >= 0).sum(axis=0).tolist()
    paths, leaves = list[str](), list[str]()
    for depth, numbers, rows in zip(depths, expansion.numbers.T.tolist(), expansion.rows.T.tolist(), strict=True):
        leaf = own[numbers[depth - 1]][rows[depth - 1]]
        leaves.append(leaf)
        paths.append(leaf if depth == 1 else PATH_MARK.join([*(expansion.names[n] for n in numbers[:depth]), leaf]))
    return TextColumn.of(name, paths), tuple(leaves)


def outputs_of(expansion: Expansion, taken: set[str]) -> list[TextColumn]:
    """The columns of outputs: of slots all words of the way, else the innermost text."""
    names = dict.fromkeys(name for table in expansion.tables for name in table.settings.outputs)
    flat = []
    for name in (name for name in names if name not in taken):
        columns = [(n, t.text_column(name)) for n, t in enumerate(expansion.tables) if name in t.settings.outputs]
        join = all_words if name == MANDATORY else _innermost
        flat.append(optional_slots(expansion, columns) if name == OPTIONAL else expansion.layers(columns).joined(name, join))
        taken.add(name)
    return flat


def _innermost(texts: list[str]) -> str:
    return texts[-1] if texts else ""


def rules_of(expansion: Expansion, taken: set[str]) -> TextColumn | None:
    """The rows' own rules: those of a way must all hold."""
    columns = [(n, t.text_column(t.settings.when)) for n, t in enumerate(expansion.tables) if t.settings.when is not None]
    if not columns:
        return None
    return expansion.layers(columns).joined(free_name(columns[0][1].name, taken), _all_rules)


def _all_rules(texts: list[str]) -> str:
    rules = [text for text in texts if not says_any(text)]
    return " and ".join(f"({rule})" for rule in rules) if len(rules) > 1 else "".join(rules)


def free_name(name: str, taken: set[str]) -> str:
    """A name for a column that no condition has."""
    while name in taken:
        name += "_"
    taken.add(name)
    return name


# ---- outputs


def declared_of(expansion: Expansion) -> tuple[Output, ...]:
    """The outputs of all tables, as the first that has one declares it. Raises TableError where tables declare an output with
    different types, values or sizes."""
    outputs: dict[str, tuple[int, Output]] = {}
    faults: list[Fault] = []
    for number, table in enumerate(expansion.tables):
        for output in table.settings.declared_outputs:
            first, known = outputs.setdefault(output.name, (number, output))
            if (known.kind, known.values, known.size) != (output.kind, output.values, output.size):
                faults.append(_unlike(expansion, first, number, known, output))
    if faults:
        raise TableError(*faults)
    return tuple(output for _, output in outputs.values())


def flat_outputs(expansion: Expansion, slots: Mapping[str, TextColumn]) -> Outputs:
    """The outputs of flat rows; `slots` are the columns of slots, whose words of a way add up."""
    declared = declared_of(expansion)
    if not declared:
        return NO_OUTPUTS
    cells = []
    for output in declared:
        if output.name in slots:
            cells.append(cells_of(output, list(slots[output.name].texts), slots[output.name].codes))
            continue
        named = [(n, c) for n, t in enumerate(expansion.tables) for c in output_columns_of(t) if c.output.name == output.name]
        cells.append(cells_of(output, *layered(named, expansion.numbers, expansion.rows, output.nothing)))
    return outputs_of_cells(declared, cells, dict(expansion.tables[0].settings.fallback_outputs))


def _unlike(expansion: Expansion, first: int, number: int, known: Output, output: Output) -> Fault:
    outer = expansion.tables[first]
    where = str(outer.path) if outer.path else f"the table {in_quotes(expansion.names[first])}"
    is_kind = known.kind != output.kind
    problem = (
        f"the output is of type {output.kind} here and of type {known.kind} in {where}."
        if is_kind
        else f"the output has other values or another size here than in {where}."
    )
    file = expansion.tables[number].path
    place = Place(str(file) if file else f"the table {in_quotes(expansion.names[number])}", None, output.name)
    return Fault(problem, "one type in all tables that contain each other", "", place, "unlike-outputs")
