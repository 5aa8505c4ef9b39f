"""The part of a table's face that is about its outputs: enums of their values, and functions that read them by row."""

from __future__ import annotations

from collections.abc import Iterator

from contextdb.compiled.c_header.naming import TableFace
from contextdb.compiled.c_header.spelling import comment, literal
from contextdb.compiled.data import CompiledData


def output_enums(table: CompiledData, face: TableFace) -> Iterator[str]:
    """An enum, and the texts of its values, for each output of that type."""
    for output, names in zip(table.outputs.declared, face.outputs, strict=True):
        if not names.enumerators:
            continue
        yield f"typedef enum {names.name}_value {{"
        lines = [f"    {names.none} = CDB_MISSING", *(f"    {name} = {n}" for n, name in enumerate(names.enumerators))]
        yield ",\n".join(lines)
        yield f"}} {names.name}_value;"
        yield ""
        yield f"static const char *const {names.name}_values[] = {{"
        yield ",\n".join(f"    {literal(value)}" for value in output.values)
        yield "};"
        yield ""


def outputs_wanted(table: CompiledData, face: TableFace) -> Iterator[str]:
    """The list of outputs that the header reads, for the schema."""
    yield "    static const cdb_output_wanted outputs[] = {"
    for number, (output, names) in enumerate(zip(table.outputs.declared, face.outputs, strict=True), 1):
        listed, n_values = (f"{names.name}_values", len(output.values)) if names.enumerators else ("NULL", 0)
        kind, ending = f"CDB_OUT_{output.kind.upper()}", "," if number < len(face.outputs) else ""
        yield f"        {{{literal(output.name)}, {kind}, {max(output.size, 1)}, {listed}, {n_values}}}{ending}"
    yield "    };"


def output_functions(table: CompiledData, face: TableFace) -> Iterator[str]:
    """A function for each output that reads its value in a row."""
    for number, (output, names) in enumerate(zip(table.outputs.declared, face.outputs, strict=True)):
        kind = output.type.c_type.format(name=names.name)
        size = f"{output.size} numbers" if output.type.has_size else output.kind
        told = "; ".join(part for part in (f"{size} {output.name} {output.unit or ''}".strip(), output.description) if part)
        yield comment(f"{told}; of a row, or of none: -1")
        yield f"static inline {kind}{names.name}(const {face.base} *opened, int64_t row)"
        yield "{"
        cast = f"({names.name}_value)" if names.enumerators else ""
        yield f"    return {cast}cdb_output_{output.kind}(&opened->table, {number}, row);"
        yield "}"
        yield ""
