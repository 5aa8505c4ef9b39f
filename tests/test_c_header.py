"""The C header: its answers are Python's, no artefact makes it crash, and no name breaks it."""

import datetime
import json
import math
import os
import random
import re
import subprocess
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from unittest import mock

import oracles
import pytest
from asking_c import (
    BAD_FILE,
    CELLS,
    FACTS,
    MISSING_FACT,
    OK,
    OTHER_TABLE,
    SCHEMA,
    UNKNOWN,
    WRONG_FACT,
    Facts,
    artefact,
    ask_program,
    asked,
    python_says,
    random_moment,
    random_nest,
    random_table,
)
from c_compilers import CXX, PROGRAMS, C, built, compiler_for, ran, sanitizers
from damaged_files import header_bytes, mutated, with_header
from hypothesis import given
from hypothesis import strategies as st
from nested_tables import Nest, nests
from strategies import IS_FULL, contexts, examples, tables

from contextdb.cells.conditions import Condition
from contextdb.cells.intervals import wrap_angle
from contextdb.cells.outputs import Output
from contextdb.compiled.c_header import c_header_of
from contextdb.compiled.c_header.face import reader_names
from contextdb.compiled.c_header.naming import Names, Wanted, distinct
from contextdb.compiled.table import CompiledTable, data_of
from contextdb.errors import ContextDBError
from contextdb.schema.settings import TableSettings
from contextdb.tables.project import Project
from contextdb.tables.table import Table

ROOT = Path(__file__).parent.parent
N_DAMAGED = int(os.environ.get("DAMAGED", 9_000 if IS_FULL else 2_700)) // 3  # files of each of three kinds of tables


@pytest.fixture(scope="session")
def ask(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The program that asks any artefact."""
    return ask_program(tmp_path_factory.mktemp("ask"))


# ---- the same answers


def test_a_hundred_thousand_random_contexts_are_answered_as_python_answers_them(ask: Path, tmp_path: Path):
    rng = random.Random(6)
    n_answered = n_valid = 0
    n_moments = 17_000 if IS_FULL else 1_700
    for flat_bytes, n_rows in ((2 << 20, 1), (0, 70), (2 << 20, 70), (0, 600), (2 << 20, 1100), (2 << 20, 64)):
        with mock.patch("contextdb.compiled.classes.FLAT_BYTES", flat_bytes):
            names = rng.sample(list(SCHEMA), 8 if n_rows == 70 else 4)
            compiled = random_table(rng, n_rows, names)
        moments = [random_moment(rng, names) for _ in range(n_moments)]
        [(status, answers)] = asked(ask, tmp_path, compiled.conditions, [artefact(compiled, tmp_path)], moments)
        assert status == OK
        expected = [python_says(compiled, *moment) for moment in moments]
        assert answers == expected
        n_answered += len(answers)
        n_valid += sum(rows > 0 for _, rows in answers)
    assert n_answered == 6 * n_moments
    assert n_valid > n_moments


@examples(0.4)
@given(tables(), st.booleans(), st.data())
def test_a_table_of_any_kind_is_answered_as_python_answers_it(
    ask: Path, tmp_path_factory: pytest.TempPathFactory, table: Table, is_wide: bool, data: st.DataObject
):
    folder = tmp_path_factory.mktemp("any")
    with mock.patch("contextdb.compiled.classes.FLAT_BYTES", 0 if is_wide else 2 << 20):
        compiled = table.compile()
    moments, answers = assert_as_in_python(ask, folder, compiled, table, data)
    for (unknown, facts), (said, rows) in zip(moments, answers, strict=True):
        if said == OK:
            assert [r for r in range(table.n_rows) if rows >> r & 1] == oracles.rows(table, facts, unknown)  # type: ignore[arg-type]


@examples(0.3)
@given(nests(), st.data())
def test_tables_inside_tables_are_answered_row_by_row(
    ask: Path, tmp_path_factory: pytest.TempPathFactory, nest: Nest, data: st.DataObject
):
    folder = tmp_path_factory.mktemp("nest")
    assert_as_in_python(ask, folder, nest.outer.compile(nest.tables), nest.all_cells(), data)


def assert_as_in_python(
    ask: Path, folder: Path, compiled: CompiledTable, cells: Table, data: st.DataObject
) -> tuple[list[tuple[str, Facts]], list[tuple[int, int]]]:
    """Ask for some contexts near the cells of a table, in C and in Python; gives them and the answers."""
    kinds = {c.name: c.domain.kind for c in compiled.conditions}
    moments: list[tuple[str, Facts]] = []
    for _ in range(8):
        facts = dict(data.draw(contexts(cells, has_missing=True))[1])
        for name, fact in facts.items():
            if kinds.get(name) == "angle" and fact is not None and math.isfinite(fact):  # type: ignore[arg-type]
                facts[name] = wrap_angle(fact)  # type: ignore[arg-type]
            if kinds.get(name) == "int" and fact is not None and abs(fact) > 2**62:  # type: ignore[arg-type]
                facts[name] = None  # no int64
        moments.append((data.draw(st.sampled_from(UNKNOWN)), facts))
    [(status, answers)] = asked(ask, folder, compiled.conditions, [artefact(compiled, folder)], moments)
    assert (status, answers) == (OK, [python_says(compiled, *moment) for moment in moments])
    return moments, answers


def test_more_conditions_than_masks_are_kept_at_once_are_all_asked(ask: Path, tmp_path: Path):
    rng = random.Random(7)
    kinds = [rng.choice(["ok", "speed", "state", "n"]) for _ in range(150)]
    schema = {f"c{i}": SCHEMA[kind] for i, kind in enumerate(kinds)}
    cells = {f"c{i}": [rng.choice(["Any"] * 60 + CELLS[kind]) for _ in range(200)] for i, kind in enumerate(kinds)}
    compiled = Table.from_columns({"Asset": ["a"] * 200, **cells}, schema).compile()
    moments = [("error", {f"c{i}": rng.choice(FACTS[kind]) for i, kind in enumerate(kinds)}) for _ in range(300)]
    [(_, answers)] = asked(ask, tmp_path, compiled.conditions, [artefact(compiled, tmp_path)], moments)
    assert answers == [python_says(compiled, *moment) for moment in moments]
    assert sum(rows > 0 for _, rows in answers) > 100


def test_options_that_take_nan_and_infinity_for_granted_change_no_answer(tmp_path: Path):
    (tmp_path / "tables.h").write_text(c_header_of({}), encoding="ascii")
    fast = built(PROGRAMS / "ask.c", tmp_path / "fast.exe", C, "-O2", "-ffast-math")
    rng = random.Random(8)
    for flat_bytes in (0, 2 << 20):
        with mock.patch("contextdb.compiled.classes.FLAT_BYTES", flat_bytes):
            compiled = random_table(rng, 130)
        moments = [random_moment(rng, SCHEMA, 0.1) for _ in range(500)]
        expected = [python_says(compiled, *moment) for moment in moments]
        assert asked(fast, tmp_path, compiled.conditions, [artefact(compiled, tmp_path)], moments) == [(OK, expected)]


# ---- files that are none


@pytest.mark.parametrize(
    ("flat_bytes", "make"), [(2 << 20, random_table), (0, random_table), (0, random_nest)], ids=["flat", "wide", "nested"]
)
def test_very_many_damaged_files_are_refused_or_answered_and_never_crash_it(
    ask: Path, tmp_path: Path, flat_bytes: int, make: Callable[[random.Random, int], CompiledTable]
):
    rng = random.Random(flat_bytes)
    with mock.patch("contextdb.compiled.classes.FLAT_BYTES", flat_bytes):
        compiled = make(rng, 70)
    whole = artefact(compiled, tmp_path)
    damaged = [mutated(rng, whole) for _ in range(N_DAMAGED)]
    moments = [random_moment(rng, SCHEMA) for _ in range(6)]
    found = asked(ask, tmp_path, compiled.conditions, [whole, *damaged], moments)
    assert found[0] == (OK, [python_says(compiled, *moment) for moment in moments])
    statuses = [status for status, _ in found]
    assert set(statuses) == {OK, BAD_FILE, OTHER_TABLE}
    assert statuses.count(BAD_FILE) > N_DAMAGED // 3 < len(statuses) - statuses.count(OK)
    assert all(answer in (OK, MISSING_FACT) for _, answers in found for answer, _ in answers)


def test_a_file_cut_off_anywhere_is_refused(ask: Path, tmp_path: Path):
    compiled = random_table(random.Random(1), 3, ["ok", "speed", "word", "tags"])
    whole = artefact(compiled, tmp_path)
    found = asked(ask, tmp_path, compiled.conditions, [whole[:length] for length in range(len(whole))], [])
    assert {status for status, _ in found} == {BAD_FILE}


def test_a_file_whose_text_escapes_every_character_is_read_as_before(ask: Path, tmp_path: Path):
    compiled = random_table(random.Random(2), 70)
    whole = artefact(compiled, tmp_path)
    header = json.loads(whole[8 : 8 + header_bytes(whole)])
    header["__metadata__"]["about"] = "".join(f"\\u{ord(c):04x}" for c in header["__metadata__"]["about"])
    escaped = with_header(whole, json.dumps(header, indent=3).replace("\\\\u", "\\u").encode())
    moments = [random_moment(random.Random(3), SCHEMA) for _ in range(20)]
    one, other = asked(ask, tmp_path, compiled.conditions, [whole, escaped], moments)
    assert one == other == (OK, [python_says(compiled, *moment) for moment in moments])


# ---- the face of a table: names, types, and what does not go together


HOSTILE = [
    "class", "Class", "a.b", "a b", "a_b", "3", "…", "NULL", "unix", "min", "*/ int x; /*", "??/", "??)", "a\\", "\\", '"',
    "'", "x\ny", "Größe", "%s%n", "cdb_open", "__x", "_X", "表", "\U0001f600", "a" * 300, "//", "/*", "#error", "\u202e", "ﬁ",
    "facts", "given",
]  # fmt: skip


def set_fact(compiled: CompiledTable, condition: Condition, field: str, fact: object, names: Mapping[str, str]) -> str:
    """The line of C that sets one fact of a table's struct."""
    kind = condition.domain.kind
    if kind in ("number", "angle"):
        number = repr(float(fact))  # type: ignore[arg-type]
        return f'facts.{field} = strtod("{number}", NULL);'
    if kind in ("bool", "int"):
        return f"facts.{field} = {int(fact)};"  # type: ignore[call-overload]
    if kind == "date":
        day = datetime.date(1970, 1, 1) + datetime.timedelta(days=fact)  # type: ignore[arg-type]
        return f"facts.{field} = cdb_date({day.year}, {day.month}, {day.day});"
    if kind == "enum":
        return f"facts.{field} = {names[f'{condition.name}={fact}']};"
    if kind == "text":
        octets = "".join(f"\\{b:03o}" for b in str(fact).encode())
        return f'facts.{field} = "{octets}";'
    tags = sorted(fact)  # type: ignore[call-overload]
    if not condition.domain.values:
        listed = ", ".join(f'"{t}"' for t in tags) or "NULL"
        array = f"static const char *const listed[] = {{{listed}}};"
        return f"{{ {array} facts.{field}.texts = listed; facts.{field}.count = {len(tags)}; }}"
    base = names[condition.name]
    adds = "".join(f" {base}_add(&facts.{field}, {names[f'{condition.name}={t}']});" for t in tags)
    return f"facts.{field} = {base}_none();{adds}"


def named(compiled: CompiledTable) -> tuple[dict[str, str], str, tuple[str, ...]]:
    """What conditions with values and their values are called in the header of this one table, its own name, and its fields."""
    names = Names.of({compiled.name: data_of(compiled)}, "guard", reader_names())
    found: dict[str, str] = {}
    for condition, choices in names.choices.items():
        found[condition.name] = choices.type
        found |= {f"{condition.name}={v}": e for v, e in zip(choices.values, choices.enumerators, strict=True)}
    face = names.tables[compiled.name]
    return found, face.base, face.fields


def typed_program(compiled: CompiledTable, moments: Sequence[tuple[str, Facts]]) -> str:
    """A program that asks a table by its own types and prints the rows of each context as words in hexadecimal."""
    names, base, fields = named(compiled)
    lines = [
        "#define CDB_FILES",
        '#include "tables.h"',
        "int main(int argc, char **argv) {",
        "cdb_fault fault; size_t size; uint64_t rows[8];",
    ]
    lines += [f"void *bytes = cdb_read_file(argv[argc - 1], &size, &fault); {base} table; {base}_facts facts;"]
    lines += [f'if (!bytes || {base}_open(&table, bytes, size, &fault)) {{ printf("%s", fault.reason); return 1; }}']
    for unknown, facts in moments:
        lines.append(f"facts = {base}_missing();")
        given = [(c, f) for c, f in zip(compiled.conditions, fields, strict=True) if c.name in facts]
        lines += [set_fact(compiled, c, f, facts[c.name], names) for c, f in given]
        lines.append(f"{base}_query(&table, &facts, CDB_UNKNOWN_{unknown.upper()}, rows, 8, &fault);")
        words = [f"(unsigned)(rows[{w}] >> {shift} & 0xffffffffu)" for w in (1, 0) for shift in (32, 0)]
        lines.append(f'printf("%d %08x%08x%08x%08x %d %s\\n", (int)fault.status, {", ".join(words)}, fault.condition, fault.name);')
    return "\n".join([*lines, f"{base}_close(&table); CDB_FREE(bytes); return 0; }}", ""])


@pytest.mark.parametrize("options", [C, CXX], ids=["C99", "C++11"])
def test_the_struct_of_a_table_is_asked_as_python_asks_it(tmp_path: Path, options: list[str]):
    rng = random.Random(9)
    compiled = random_table(rng, 70)
    moments = [random_moment(rng, SCHEMA) for _ in range(60)] + [random_moment(rng, SCHEMA, 0.7) for _ in range(20)]
    (tmp_path / "tables.h").write_text(c_header_of({"table": compiled}), encoding="ascii")
    (tmp_path / "typed.c").write_text(typed_program(compiled, moments), encoding="utf-8")
    artefact(compiled, tmp_path)
    program = built(tmp_path / "typed.c", tmp_path / "typed.exe", options, *sanitizers(compiler_for(options)))
    told = ran(program, tmp_path / "table.safetensors").splitlines()
    names = list(SCHEMA)
    for line, (unknown, facts) in zip(told, moments, strict=True):
        status, rows = python_says(compiled, unknown, facts)
        missing = [name for name in names if name not in facts]
        at, name = (names.index(missing[0]), missing[0]) if status else (-1, "")
        assert line == f"{status} {rows:032x} {at} {name}"


@pytest.mark.parametrize(
    ("text", "name"),
    [
        ("IsInMidAirAnim", "IS_IN_MID_AIR_ANIM"),
        ("MidAir_Catch_Direction", "MID_AIR_CATCH_DIRECTION"),
        ("HTTPServer2Go", "HTTP_SERVER2_GO"),
        ("CB", "CB"),
        ("dir_to", "DIR_TO"),
    ],
)
def test_enumerators_keep_the_joints_of_words(text: str, name: str):
    assert distinct([Wanted(text, "CDB_", is_upper=True)]) == [f"CDB_{name}"]


def test_names_that_would_be_alike_are_told_apart_by_their_texts_and_not_by_their_order():
    texts = ["a.b", "a_b", "a b", "aB", "other", "open", "Open"]
    wanted = [Wanted(text, "cdb_", ("", "_close"), is_upper=False) for text in texts]
    names = dict(zip(texts, distinct(wanted, {"cdb_open"}), strict=True))
    assert dict(zip(texts[::-1], distinct(wanted[::-1], {"cdb_open"}), strict=True)) == names
    assert (names["aB"], names["other"], names["Open"]) == ("cdb_aB", "cdb_other", "cdb_Open")
    assert len(set(names.values())) == len(texts)
    assert all(re.fullmatch(r"cdb_a_b_[0-9a-f]{4}", names[text]) for text in texts[:3])


def test_the_order_of_columns_values_and_tables_changes_no_name():
    values = ["Going_Up", "GoingUp", "Top", "going up"]
    schema: dict[str, dict[str, object]] = {
        "state": {"type": "enum", "values": values},
        "a b": {"type": "bool"},
        "a_b": {"type": "bool"},
    }
    one, other = (header_for({n: ["Any", "Any"] for n in order}, schema) for order in (list(schema), list(schema)[::-1]))
    turned = {"one": other, "two": one}
    assert enumerators(c_header_of({"two": one, "one": other})) == enumerators(c_header_of(turned))


def enumerators(header: str) -> set[str]:
    return set(re.findall(r"CDB_(?:STATE|ONE|TWO)_\w+", header))


@pytest.mark.parametrize("options", [C, CXX, ["-xc", "-std=c11"], ["-xc++", "-std=c++20"]], ids=["C99", "C++11", "C11", "C++20"])
def test_no_name_breaks_the_header(tmp_path: Path, options: list[str]):
    values = {"type": "enum", "values": HOSTILE}
    schema: dict[str, dict[str, object]] = {name: {"type": "bool", "description": name, "unit": name} for name in HOSTILE}
    schema |= {"state": values, "State": values, "state!": values, "tags": {"type": "tags", "values": HOSTILE}}
    tables = {
        name: Table.from_columns({"Asset": ["a"], **{c: ["Any"] for c in schema}}, schema, name=name).compile() for name in HOSTILE
    }
    outputs = (*(Output(name, "int", 0) for name in HOSTILE), Output("mood", "enum", HOSTILE[0], values=tuple(HOSTILE)))
    settings = TableSettings("outputs", outputs=tuple(o.name for o in outputs), typed=outputs)
    tables["outputs"] = Table.from_columns({"Asset": ["a"], **{o.name: [""] for o in outputs}}, {}, settings).compile()
    tables["empty"] = Table.from_columns({"Asset": []}, {}, name="empty").compile()
    header = c_header_of(tables)
    assert header.isascii()
    (tmp_path / "tables.h").write_text(header, encoding="ascii")
    with_files = "#define CDB_FILES\n#define CDB_WATCH\n"
    (tmp_path / "main.c").write_text(
        with_files + '#include "tables.h"\n#include "tables.h"\nint main(void) { return 0; }\n', encoding="ascii"
    )
    ran(built(tmp_path / "main.c", tmp_path / "main.exe", [*options, "-Wall", "-Wextra", "-Wpedantic", "-Werror"]))


def header_for(columns: dict[str, list[str]], schema: dict[str, dict[str, object]]) -> CompiledTable:
    return Table.from_columns({"Asset": ["a", "b"], **columns}, schema).compile()


BASE: dict[str, dict[str, object]] = {
    "ok": {"type": "bool"},
    "state": {"type": "enum", "values": ["A", "B"]},
    "twice": {"type": "number", "expr": "2 * speed"},
    "speed": {"type": "number"},
}
BASE_CELLS = {"ok": ["True", "Any"], "state": ["A", "B"], "twice": ["2", "4"], "speed": ["1", "2"]}
NOW: Facts = {"ok": True, "state": "A", "speed": 1.0}


def changed(drop: str = "", first: str = "", **others: dict[str, object]) -> CompiledTable:
    """The table of BASE after a designer's change."""
    schema = {**BASE, **others}
    order = sorted((n for n in schema if n != drop), key=lambda n: n != first)
    return header_for({n: BASE_CELLS.get(n, ["Any", "Any"]) for n in order}, schema)


@pytest.mark.parametrize(
    ("table", "status"),
    [
        (changed(), OK),
        (changed(first="speed"), OK),
        (changed(drop="ok"), OK),
        (changed(state={"type": "enum", "values": ["A", "B", "C"]}), OK),
        (changed(new={"type": "bool"}), OTHER_TABLE),
        (changed(ok={"type": "text"}), OTHER_TABLE),
        (changed(state={"type": "enum", "values": ["B", "A"]}), OTHER_TABLE),
        (changed(state={"type": "text"}), OTHER_TABLE),
        (changed(twice={"type": "number", "expr": "speed * 2"}), OK),
        (changed(twice={"type": "number"}), OTHER_TABLE),
        (changed(speed={"type": "int"}), OTHER_TABLE),
    ],
    ids=["same", "moved", "a column less", "a value more", "a column more", "type", "order", "kind", "expression", "given", "int"],
)
def test_a_table_that_asks_for_other_facts_than_the_header_gives_is_refused(
    ask: Path, tmp_path: Path, table: CompiledTable, status: int
):
    [(found, answers)] = asked(ask, tmp_path, changed().conditions, [artefact(table, tmp_path)], [("error", NOW)])
    assert (found, answers) == (status, [(OK, 0b01)] if status == OK else [])


def test_a_fact_that_a_condition_cannot_have_is_refused(ask: Path, tmp_path: Path):
    compiled = random_table(random.Random(4), 9, ["heading", "ok"])
    whole = artefact(compiled, tmp_path)
    moments: list[tuple[str, Facts]] = [("any", {"heading": math.inf}), ("never", {"heading": -math.inf, "ok": True})]
    [(_, answers)] = asked(ask, tmp_path, compiled.conditions, [whole], moments)
    assert answers == [(WRONG_FACT, 0), (WRONG_FACT, 0)]


@pytest.mark.parametrize(
    ("key", "status"),
    [("when", OTHER_TABLE), ("anything new", OTHER_TABLE), ("slots", OK), ("computed_from", OTHER_TABLE), ("ways", OK)],
)
def test_what_a_later_version_writes_is_refused_and_not_passed_over(ask: Path, tmp_path: Path, key: str, status: int):
    compiled = random_table(random.Random(5), 3, ["ok"])
    whole = artefact(compiled, tmp_path)
    header = json.loads(whole[8 : 8 + header_bytes(whole)])
    header["__metadata__"]["about"] = json.dumps(json.loads(header["__metadata__"]["about"]) | {key: []})
    other = json.loads(json.dumps(header))
    other["__metadata__"]["contextdb"] = "5"
    files = [with_header(whole, json.dumps(h).encode()) for h in (header, other)]
    assert [found for found, _ in asked(ask, tmp_path, compiled.conditions, files, [])] == [status, BAD_FILE]


@pytest.mark.parametrize(("name", "why"), [("a\0b", "NUL"), ("x" * 5000, "5,000 bytes")])
def test_a_name_that_no_text_of_c_holds_is_refused(name: str, why: str):
    values = {"state": {"type": "enum", "values": [name]}}
    with pytest.raises(ContextDBError, match=why):
        c_header_of({"t": header_for({"state": ["Any", "Any"]}, values)})


def test_the_same_tables_give_the_same_header_and_a_shared_condition_one_enum():
    tables = Project.load(ROOT / "tables").compile()
    one, other = c_header_of(tables), c_header_of({**tables, "again": tables["locomotion"]})
    assert one == c_header_of(Project.load(ROOT / "tables").compile())
    assert one.count("} cdb_gait;") == other.count("} cdb_gait;") == 1


@pytest.mark.parametrize("options", [C, CXX], ids=["C99", "C++11"])
def test_the_program_of_the_documents_prints_what_python_answers(tmp_path: Path, options: list[str]):
    project = Project.load(ROOT / "tables")
    (tmp_path / "tables.h").write_text(c_header_of(project.compile()), encoding="ascii")
    table = project["contested_catch"].compile()
    table.save(tmp_path / "contested_catch.safetensors")
    program = built(PROGRAMS / "game.c", tmp_path / "game.exe", options, *sanitizers(compiler_for(options)))
    context = {
        "MidAir_Catch_Direction": "Going_Down",
        "Defender.DepthChart": "FS",
        "Defender.MidAir_Contesting": True,
        "Defender.CatchingAnim": False,
        "Defender.Catching": False,
        "Defender.FacingBall": True,
    }
    valid = table.query(context)
    picked = f"picked: {table.picker(1).pick(valid).asset}"
    assert ran(program, cwd=tmp_path).splitlines() == ["Defender.FacingBall: the fact is missing", *valid.assets, picked]
    (tmp_path / "contested_catch.safetensors").write_bytes(b"")
    assert (
        subprocess.run([program], cwd=tmp_path, capture_output=True, text=True).stdout == ": the file is too short for its header\n"
    )


def test_the_header_refuses_a_machine_that_is_big_endian(tmp_path: Path):
    (tmp_path / "tables.h").write_text(c_header_of({}), encoding="ascii")
    order = ["-U__BYTE_ORDER__", "-D__BYTE_ORDER__=__ORDER_BIG_ENDIAN__"]
    command = [compiler_for(C), "-xc", "-std=c99", "-fsyntax-only", *order, str(tmp_path / "tables.h")]
    done = subprocess.run(command, capture_output=True, text=True)
    assert done.returncode != 0
    assert "little-endian" in done.stderr


def test_the_program_in_the_documents_is_the_one_that_is_compiled_here():
    shown = (ROOT / "docs" / "programmers.md").read_text(encoding="utf-8")
    assert f"```c\n{(PROGRAMS / 'game.c').read_text(encoding='utf-8')}```" in shown


EXPORTING = '#define CDB_API __attribute__((visibility("default")))\n#define CDB_IMPLEMENTATION\n#include "tables.h"\n'
CALLING = """#define CDB_API extern
#define CDB_FILES
#include <stdio.h>
#include "tables.h"

int main(int argc, char **argv)
{
    size_t size;
    cdb_fault fault;
    void *bytes = cdb_read_file(argv[argc - 1], &size, &fault);
    cdb_any *any = bytes ? cdb_open_any(bytes, size, &fault) : NULL;
    puts(any ? cdb_asset(&any->table, 1) : fault.reason);
    cdb_close_any(any);
    CDB_FREE(bytes);
    return 0;
}
"""


def test_one_file_has_the_functions_and_others_call_them(tmp_path: Path):
    compiled = Table.from_columns({"Asset": ["walk", "run"], "speed": ["<2", "2.."]}, {"speed": {"type": "number"}}).compile()
    compiled.save(tmp_path / "t.safetensors")
    (tmp_path / "tables.h").write_text(c_header_of({"moves": compiled}), encoding="ascii")
    (tmp_path / "all.c").write_text(
        EXPORTING.replace("#include", "#define CDB_FILES\n#include <stdio.h>\n#include"), encoding="ascii"
    )
    (tmp_path / "game.c").write_text(CALLING, encoding="ascii")
    for options in (C, CXX):
        all_functions = built(tmp_path / "all.c", tmp_path / "all.o", options, "-c")
        program = built(tmp_path / "game.c", tmp_path / "game.exe", options, "-c")
        compiler = compiler_for(options)
        subprocess.run([compiler, str(program), str(all_functions), "-o", str(tmp_path / "whole.exe")], check=True)
        assert ran(tmp_path / "whole.exe", tmp_path / "t.safetensors") == "run\n"


def test_what_the_page_of_engines_shows_is_compiled_and_picks_a_row(tmp_path: Path):
    page = (ROOT / "docs" / "engines.md").read_text(encoding="utf-8")
    [shown] = re.findall(r"```c\n(cdb_fault fault;\n.*?)```", page, re.S)
    head = '#define CDB_FILES\n#include <stdio.h>\n#include "tables.h"\nint main(int argc, char **argv)\n{\n'
    head += "    size_t size, n_words = 1;\n    void *bytes = cdb_read_file(argv[argc - 1], &size, NULL);\n"
    head += "    double time_s = 0.0;\n    int64_t row;\n    uint64_t rows[1];\n    cdb_picker picker = cdb_new_picker(1, 0, 1);\n"
    tail = '    cdb_set_number(live, 2, 0.0);\n    cdb_set_text(live, 3, "normal");\n'
    last = shown.index("cdb_live_query")
    body = (
        shown[:last] + tail + shown[last:] + "    puts(cdb_asset_of(&any->table, row));\n    free(live);\n    cdb_close_any(any);\n"
    )
    compiled = Project.load(ROOT / "tables").tables["locomotion"].compile()
    compiled.save(tmp_path / "t.safetensors")
    (tmp_path / "tables.h").write_text(c_header_of({"locomotion": compiled}), encoding="ascii")
    (tmp_path / "frame.c").write_text(f"{head}{body}    CDB_FREE(bytes);\n    return 0;\n}}\n", encoding="ascii")
    program = built(tmp_path / "frame.c", tmp_path / "frame.exe", C, *sanitizers(compiler_for(C)))
    facts = {"gait": "Run", "speed": 3.0, "direction": 0.0, "style": "normal"}
    assert ran(program, tmp_path / "t.safetensors").strip() == compiled.picker(seed=1).pick(compiled.query(facts)).asset
