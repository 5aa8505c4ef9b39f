"""The outputs of a flat table: what the tables of each row's way give the game."""

from __future__ import annotations

from collections.abc import Mapping

from contextdb.cells.outputs import Output
from contextdb.columns import TextColumn
from contextdb.compiled.outputs import NO_OUTPUTS, Outputs, cells_of, outputs_of_cells
from contextdb.errors import Fault, Place, TableError, in_quotes
from contextdb.tables.data import output_columns_of
from contextdb.tables.nesting.expansion import Expansion
from contextdb.tables.output_columns import layered


def declared_of(expansion: Expansion) -> tuple[Output, ...]:
    """The outputs of all tables, as the first that has one declares it. Raises TableError where tables declare an output with
    different types, values or sizes."""
    found: dict[str, tuple[int, Output]] = {}
    faults: list[Fault] = []
    for number, table in enumerate(expansion.tables):
        for output in table.settings.declared_outputs:
            first, known = found.setdefault(output.name, (number, output))
            if (known.kind, known.values, known.size) != (output.kind, output.values, output.size):
                faults.append(_unlike(expansion, first, number, known, output))
    if faults:
        raise TableError(*faults)
    return tuple(output for _, output in found.values())


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
    found = (
        f"the output is of type {output.kind} here and of type {known.kind} in {where}."
        if is_kind
        else f"the output has other values or another size here than in {where}."
    )
    file = expansion.tables[number].path
    place = Place(str(file) if file else f"the table {in_quotes(expansion.names[number])}", None, output.name)
    return Fault(found, "one type in all tables that contain each other", "", place, "unlike-outputs")
