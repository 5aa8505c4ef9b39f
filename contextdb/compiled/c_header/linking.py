"""The file beside the header by which a game in C publishes what it asks: `link.h`, and a function for each table that knows
the names of its facts. It goes with the header that `face` makes of the same tables.
"""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping, Sequence
from importlib.resources import files
from pathlib import PurePosixPath

from contextdb.cells.conditions import Condition
from contextdb.compiled.c_header.face import given_conditions, plain_of, reader_names
from contextdb.compiled.c_header.naming import Choices, Names, TableFace, Wanted, comment, distinct, literal
from contextdb.compiled.data import CompiledData
from contextdb.compiled.table import CompiledTable, data_of

_HEAD = """/* Written by `contextdb compile --c-link`: do not edit. It goes with {header}, which was written with it. */

#ifndef {guard}
#define {guard}

#if !defined(_WIN32) && !defined(_GNU_SOURCE)
#define _GNU_SOURCE
#endif

#include {include}

#ifdef __cplusplus
extern "C" {{
#endif

{reader}
"""
_FOOT = """
#ifdef __cplusplus
}}
#endif

#endif /* {guard} */
"""


def c_link_of(tables: Mapping[str, CompiledTable], header: str, guard: str = "CDB_LINK_H") -> str:
    """The text of the file, ASCII with line feeds. `header` is how it includes the header of the same tables."""
    inside = {name: data_of(table) for name, table in tables.items()}
    names = Names.of(inside, f"CDB_{PurePosixPath(header).stem}_H", reader_names())  # as in the header
    faces = [(table, names.tables[name]) for name, table in inside.items()]
    [guard] = distinct([Wanted(guard.removeprefix("CDB_"), "CDB_", is_upper=True)])
    reader = files("contextdb.compiled.c_header").joinpath("link.h").read_text(encoding="ascii")
    head = _HEAD.format(header=comment(header)[3:-3], guard=guard, include=literal(header), reader=reader)
    parts = [_joined(_tables(faces)), *(_joined(_tell(table, face, names.choices)) for table, face in faces)]
    return "".join([head, *parts, _FOOT.format(guard=guard)])


def _joined(lines: Iterator[str]) -> str:
    return "\n" + "".join(f"{line}\n" for line in lines)


def _tables(faces: Sequence[tuple[CompiledData, TableFace]]) -> Iterator[str]:
    """The function that says what tables there are; their versions are not known in C."""
    yield "#ifndef _WIN32"
    yield "static inline void cdbl_tables(cdbl_link *link)"
    yield "{"
    yield '    cdbl_say(link, "{");'
    for number, (table, face) in enumerate(faces):
        comma = "," if number else ""
        opening = f'{comma}{json.dumps(face.table)}:{{"version":null,"rows":{table.n_rows},"conditions":{{'
        yield f"    cdbl_say(link, {literal(opening)});"
        for at, (condition, _) in enumerate(given_conditions(table, face)):
            named = f"{',' if at else ''}{json.dumps(condition.name)}:{json.dumps(condition.domain.kind)}"
            yield f"    cdbl_say(link, {literal(named)});"
        yield '    cdbl_say(link, "}}");'
    yield '    cdbl_say(link, "}");'
    yield "}"
    yield "#endif"


def _tell(table: CompiledData, face: TableFace, choices: Mapping[Condition, Choices]) -> Iterator[str]:
    base = face.base
    yield comment(f"---- table {face.table}")
    yield ""
    yield "/* Tell a question: who asks, the facts, the valid rows that the query gave, and the row that was picked, or -1. */"
    yield f"static inline void {base.replace('cdb_', 'cdbl_', 1)}_tell(cdbl_link *link, const char *who, const {base} *opened,"
    yield f"    const {base}_facts *facts, const uint64_t *rows, int64_t picked)"
    yield "{"
    yield "#ifndef _WIN32"
    yield f"    cdbl_begin(link, who, {literal(face.table)});"
    given = given_conditions(table, face)
    yield from (f"    {_fact(condition, name, choices.get(condition))}" for condition, name in given)
    yield from () if given else ("    (void)facts;",)
    yield "    cdbl_end(link, &opened->table, rows, picked);"
    yield "#else"
    yield "    (void)link, (void)who, (void)opened, (void)facts, (void)rows, (void)picked;"
    yield "#endif"
    yield "}"


def _fact(condition: Condition, name: str, declared: Choices | None) -> str:
    kind, field, quoted = condition.domain.type, f"facts->{name}", literal(condition.name)
    if kind.is_tags and declared:
        return f"cdbl_set(link, {quoted}, {field}.words, {declared.type}_values, {len(declared.values) + 1});"
    if kind.is_tags:
        return f"cdbl_texts(link, {quoted}, &{field});"
    if declared:
        return f"cdbl_choice(link, {quoted}, (int64_t){field}, {declared.type}_values, {len(declared.values)});"
    if kind.is_numeric and not kind.is_decimal:
        return f"cdbl_date(link, {quoted}, {field});"
    how = {"whole": "truth" if kind.is_truth else "whole", "number": "number", "text": "text"}[plain_of(kind).member]
    return f"cdbl_{how}(link, {quoted}, {field});"
