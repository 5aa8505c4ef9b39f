"""The C header: its answers are Python's, no artefact makes it crash, and no name breaks it."""

from __future__ import annotations

import datetime
import json
import math
import random
import struct
import subprocess
from collections.abc import Callable, Iterable, Mapping, Sequence
from functools import cache
from pathlib import Path
from unittest import mock

import numpy as np
import oracles
import pytest
from c_compilers import CXX, PROGRAMS, C, built, compiler_for, ran, sanitizers
from hypothesis import given
from hypothesis import strategies as st
from nested_tables import Nest, nests
from strategies import IS_FULL, contexts, examples, tables

from contextdb.cells.angles import wrap_angle
from contextdb.cells.conditions import Condition
from contextdb.cells.kinds import KINDS
from contextdb.compiled.c_header import c_header_of
from contextdb.compiled.c_header.face import choices_of, face_of, names_left
from contextdb.compiled.c_header.spelling import Names
from contextdb.compiled.table import CompiledTable
from contextdb.errors import ContextDBError
from contextdb.schema.settings import TableSettings
from contextdb.tables.project import Project
from contextdb.tables.table import Table

ROOT = Path(__file__).parent.parent
UNKNOWN = ("error", "any", "never")
OK, BAD_FILE, OTHER_TABLE, MISSING_FACT, WRONG_FACT = 0, 3, 4, 5, 6

SCHEMA: dict[str, dict[str, object]] = {
    "ok": {"type": "bool"},
    "n": {"type": "int"},
    "speed": {"type": "number"},
    "heading": {"type": "angle"},
    "day": {"type": "date"},
    "state": {"type": "enum", "values": ["A", "B", "C"]},
    "word": {"type": "text"},
    "Defender.Tags": {"type": "tags", "values": ["Move.Run", "InAir", *(f"T{i}" for i in range(70))]},
    "tags": {"type": "tags"},
}
CELLS = {
    "ok": ["True", "False", "Any", "not True"],
    "n": ["1..3", "not 2", "Any", "<2", "2 | 4"],
    "speed": ["20, 9.99", "5.. ~2", "1 | 3", "Any", "(1..3]", "not 3", "..10"],
    "heading": ["170, 20", "Any", "0..90", "not -180..0", "(90..180)"],
    "day": ["2026-01-01..2026-03-31", "Any", "not 1970-01-01", "<=2024-02-29 ~2", "0001-01-01 | 9999-12-31.."],
    "state": ["A", "B C", "not A", "Any"],
    "word": ["a b", "not a", "Any", "Größe", '"x y"', '"say ""no"""'],
    "Defender.Tags": ["+Move -InAir", "not +InAir", "Any", "not +Move -InAir", "+T69", "not not Any", "+Move.Run"],
    "tags": ["+x -y", "not +x", "Any", "+x.z", "not +x -y.z"],
}
FACTS: dict[str, list[object]] = {
    "ok": [True, False],
    "n": [-5, 0, 1, 2, 3, 4, 2**53, -(2**62)],
    "speed": [0.0, 1.0, 3.0, math.nextafter(3, 9), 5.0, 10.0, 10.01, 29.99, 30.0, math.inf, -math.inf, -0.0, 1e308, 5e-324],
    "heading": [
        0.0,
        -180.0,
        180.0,
        90.0,
        170.0,
        190.0,
        -170.0,
        149.99,
        150.0,
        540.0,
        -540.0,
        725.5,
        1e300,
        -1e18,
        359.99999999999994,
    ],
    "day": [-719162.0, -1.0, 0.0, 19782.0, 19783.0, 20453.0, 20454.0, 20543.0, 20544.0, 2932896.0],
    "state": ["A", "B", "C"],
    "word": ["a", "b", "", "Größe", "x y", 'say "no"', "ab"],
    "Defender.Tags": [frozenset(), {"Move"}, {"Move.Run", "InAir"}, {"InAir"}, {"T69", "T0"}, {"Move", "T69"}],
    "tags": [frozenset(), {"x"}, {"x.z"}, {"y"}, {"xy"}, {"x", "y.z"}, {"x.z.w", "y"}],
}
Facts = Mapping[str, object]


# ---- the general program: it is given schema, artefacts and contexts in a file


@pytest.fixture(scope="session")
def ask(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The program that asks any artefact."""
    folder = tmp_path_factory.mktemp("ask")
    (folder / "tables.h").write_text(c_header_of({})[0], encoding="ascii")
    return built(PROGRAMS / "ask.c", folder / "ask.exe", C, *sanitizers(compiler_for(C)), "-O1")


def packed(*numbers: int) -> bytes:
    return struct.pack(f"<{len(numbers)}q", *numbers)


def text(value: str | bytes | None) -> bytes:
    octets = value.encode("utf-8") if isinstance(value, str) else value
    return packed(-1) if octets is None else packed(len(octets)) + octets + b"\0"


@cache
def values_in_c(condition: Condition) -> tuple[str, ...]:
    """The names of an enum's values by number, and of declared tags, from number 1 on."""
    if not condition.domain.values:
        return ()
    declared = choices_of(condition, Names()).values
    return ("", *declared) if condition.domain.kind == "tags" else declared


def schema_bytes(conditions: Sequence[Condition]) -> bytes:
    parts = [packed(len(conditions))]
    for condition in conditions:
        values = values_in_c(condition)
        parts += [text(condition.name), packed(list(KINDS).index(condition.domain.kind)), text(condition.expr), packed(len(values))]
        parts += map(text, values)
    return b"".join(parts)


def fact_bytes(condition: Condition, fact: object) -> bytes:
    """A fact in canonical form as the program reads it."""
    kind, values = condition.domain.kind, values_in_c(condition)
    if kind in ("number", "angle"):
        return struct.pack("<d", math.nan if fact is None else fact)
    if kind in ("int", "date"):
        return packed(-(2**63) if fact is None else int(fact))  # type: ignore[call-overload]
    if kind == "bool":
        return packed(-1 if fact is None else bool(fact))
    if kind == "enum":
        return packed(-1 if fact is None else values.index(str(fact)))
    if kind == "text":
        return text(fact)  # type: ignore[arg-type]
    if not values:
        return packed(-1) if fact is None else packed(len(fact)) + b"".join(map(text, fact))  # type: ignore[arg-type]
    bits = 0 if fact is None else 1 | sum(1 << values.index(tag) for tag in fact)  # type: ignore[attr-defined]
    return bits.to_bytes((len(values) + 63) // 64 * 8, "little")


def asked(
    ask: Path, folder: Path, conditions: Sequence[Condition], artefacts: Sequence[bytes], moments: Iterable[tuple[str, Facts]]
) -> list[tuple[int, list[tuple[int, int]]]]:
    """For each artefact the status of opening it, and for each context status and rows, as one integer."""
    listed = list(moments)
    contexts = b"".join(
        packed(UNKNOWN.index(unknown)) + b"".join(fact_bytes(c, facts.get(c.name)) for c in conditions) for unknown, facts in listed
    )
    given = [schema_bytes(conditions), packed(len(artefacts)), *map(text, artefacts), packed(len(listed)), contexts]
    (folder / "in").write_bytes(b"".join(given))
    ran(ask, folder / "in", folder / "out")
    words = np.fromfile(folder / "out", "<i8")
    found, at = [], 0
    for _ in artefacts:
        status, at = int(words[at]), at + 1
        answers = []
        for _ in listed if status == OK else ():
            n_words = int(words[at + 1])
            answers.append((int(words[at]), int.from_bytes(words[at + 2 : at + 2 + n_words].tobytes(), "little")))
            at += 2 + n_words
        found.append((status, answers))
    assert at == len(words)
    return found


def artefact(compiled: CompiledTable, folder: Path) -> bytes:
    compiled.save(folder / "table.safetensors")
    return (folder / "table.safetensors").read_bytes()


def python_says(compiled: CompiledTable, unknown: str, facts: Facts) -> tuple[int, int]:
    """Status and rows, as one integer."""
    if unknown == "error" and any(facts.get(c.name) is None for c in compiled.conditions):
        return MISSING_FACT, 0
    return OK, compiled.query(facts, unknown=unknown).bits  # type: ignore[arg-type]


def random_cells(rng: random.Random, n_rows: int, columns: Sequence[str], assets: Sequence[str]) -> Table:
    cells = {name: [rng.choice(CELLS[name]) for _ in range(n_rows)] for name in columns}
    return Table.from_columns(
        {"Asset": [rng.choice(assets) for _ in range(n_rows)]} | cells, {name: SCHEMA[name] for name in columns}
    )


def random_table(rng: random.Random, n_rows: int, columns: Sequence[str] = tuple(SCHEMA)) -> CompiledTable:
    return random_cells(rng, n_rows, columns, ["a", 'b"c', "Größe", "\\", "x\ty"]).compile()


def random_nest(rng: random.Random, n_rows: int) -> CompiledTable:
    """A table in which another one stands, so that cells of tags meet."""
    inner = random_cells(rng, 5, tuple(SCHEMA), ["a", "b"])
    return random_cells(rng, n_rows // 3, tuple(SCHEMA), ["a", "@inner"]).compile({"inner": inner})


def random_moment(rng: random.Random, columns: Iterable[str], missing: float = 0.03) -> tuple[str, Facts]:
    facts = {name: rng.choice(FACTS[name]) for name in columns if rng.random() >= missing}
    return rng.choice(UNKNOWN), facts


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
    (tmp_path / "tables.h").write_text(c_header_of({})[0], encoding="ascii")
    fast = built(PROGRAMS / "ask.c", tmp_path / "fast.exe", C, "-O2", "-ffast-math")
    rng = random.Random(8)
    for flat_bytes in (0, 2 << 20):
        with mock.patch("contextdb.compiled.classes.FLAT_BYTES", flat_bytes):
            compiled = random_table(rng, 130)
        moments = [random_moment(rng, SCHEMA, 0.1) for _ in range(500)]
        expected = [python_says(compiled, *moment) for moment in moments]
        assert asked(fast, tmp_path, compiled.conditions, [artefact(compiled, tmp_path)], moments) == [(OK, expected)]


# ---- files that are none


EDGES = [0, 1, 2, 3, 7, 8, 63, 64, 65, 255, 2**31 - 1, 2**31, 2**32, 2**53, 2**63 - 1, 2**63, 2**64 - 1, 2**64, 10**30]


def with_header(whole: bytes, header: bytes) -> bytes:
    """The file with another header, which is made as long as its alignment asks."""
    header += b" " * (-len(header) % 8)
    return len(header).to_bytes(8, "little") + header + whole[8 + header_bytes(whole) :]


def header_bytes(whole: bytes) -> int:
    return int.from_bytes(whole[:8], "little")


def with_another_number(rng: random.Random, header: bytes) -> bytes:
    digits = [i for i in range(1, len(header)) if header[i : i + 1].isdigit() and not header[i - 1 : i].isalnum()]
    start = stop = rng.choice(digits)
    while header[stop : stop + 1].isdigit():
        stop += 1
    old = int(header[start:stop])
    new = rng.choice([*EDGES, old + 1, max(old - 1, 0), old + 8, max(old - 8, 0), old * 2, rng.randrange(4000)])
    return header[:start] + str(new).encode() + header[stop:]


def mutated(rng: random.Random, whole: bytes) -> bytes:
    """The file, damaged in one of the ways in which files are damaged or made to harm."""
    size = header_bytes(whole)
    header, way = whole[8 : 8 + size], rng.randrange(8)
    at = rng.randrange(size)
    if way == 0:
        return whole[: rng.randrange(len(whole))]
    if way == 1:
        return rng.choice([*EDGES, size + 8, size - 8]).to_bytes(16, "little")[:8] + whole[8:]
    if way in (2, 3):
        return with_header(whole, with_another_number(rng, header))
    if way == 4:
        return with_header(whole, header[:at] + header[at + rng.randrange(1, 60) :])
    if way == 5:
        piece = rng.choice(
            [b"[" * 2000, b'{"a":' * 2000, b'"', b"\\u0000", b"\\", b"\xff", header[at : at + 200], b"9" * 400, b"\\ud800"]
        )
        return with_header(whole, header[:at] + piece + header[at:])
    octets = bytearray(whole)
    start, stop = (8, 8 + size) if way == 6 else (8 + size, len(whole))
    for _ in range(rng.choice([1, 1, 2, 8])):
        octets[rng.randrange(start, stop)] = rng.choice([0, 1, 0x7F, 0x80, 0xFF, rng.randrange(256)])
    return bytes(octets)


@pytest.mark.parametrize(
    ("flat_bytes", "make"), [(2 << 20, random_table), (0, random_table), (0, random_nest)], ids=["flat", "wide", "nested"]
)
def test_thousands_of_damaged_files_are_refused_or_answered_and_never_crash_it(
    ask: Path, tmp_path: Path, flat_bytes: int, make: Callable[[random.Random, int], CompiledTable]
):
    rng = random.Random(flat_bytes)
    with mock.patch("contextdb.compiled.classes.FLAT_BYTES", flat_bytes):
        compiled = make(rng, 70)
    whole = artefact(compiled, tmp_path)
    damaged = [mutated(rng, whole) for _ in range(3_000)]
    moments = [random_moment(rng, SCHEMA) for _ in range(6)]
    found = asked(ask, tmp_path, compiled.conditions, [whole, *damaged], moments)
    assert found[0] == (OK, [python_says(compiled, *moment) for moment in moments])
    statuses = [status for status, _ in found]
    assert set(statuses) == {OK, BAD_FILE, OTHER_TABLE}
    assert statuses.count(BAD_FILE) > 1_000 < len(statuses) - statuses.count(OK)
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
    names = names_left()
    found: dict[str, str] = {}
    for condition in compiled.conditions:
        if condition.domain.values:
            choices = choices_of(condition, names)
            found[condition.name] = choices.type
            found |= {f"{condition.name}={v}": e for v, e in zip(choices.values, choices.enumerators, strict=True)}
    face = face_of(compiled.name, compiled, names)
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
    (tmp_path / "tables.h").write_text(c_header_of({"table": compiled})[0], encoding="ascii")
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


@pytest.mark.parametrize("options", [C, CXX, ["-xc", "-std=c11"], ["-xc++", "-std=c++20"]], ids=["C99", "C++11", "C11", "C++20"])
def test_no_name_breaks_the_header(tmp_path: Path, options: list[str]):
    values = {"type": "enum", "values": HOSTILE}
    schema: dict[str, dict[str, object]] = {name: {"type": "bool", "description": name, "unit": name} for name in HOSTILE}
    schema |= {"state": values, "State": values, "state!": values, "tags": {"type": "tags", "values": HOSTILE}}
    tables = {
        name: Table.from_columns({"Asset": ["a"], **{c: ["Any"] for c in schema}}, schema, name=name).compile() for name in HOSTILE
    }
    tables["empty"] = Table.from_columns({"Asset": []}, {}, name="empty").compile()
    header = c_header_of(tables)[0]
    assert header.isascii()
    (tmp_path / "tables.h").write_text(header, encoding="ascii")
    (tmp_path / "main.c").write_text('#include "tables.h"\n#include "tables.h"\nint main(void) { return 0; }\n', encoding="ascii")
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
NOW: Facts = {"ok": True, "state": "A", "twice": 2.0, "speed": 1.0}


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
        (changed(twice={"type": "number", "expr": "speed * 2"}), OTHER_TABLE),
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
    ("key", "status"), [("when", OTHER_TABLE), ("anything new", OTHER_TABLE), ("slots", OK), ("computed_from", OK), ("ways", OK)]
)
def test_what_a_later_version_writes_is_refused_and_not_passed_over(ask: Path, tmp_path: Path, key: str, status: int):
    compiled = random_table(random.Random(5), 3, ["ok"])
    whole = artefact(compiled, tmp_path)
    header = json.loads(whole[8 : 8 + header_bytes(whole)])
    header["__metadata__"]["about"] = json.dumps(json.loads(header["__metadata__"]["about"]) | {key: []})
    other = json.loads(json.dumps(header))
    other["__metadata__"]["contextdb"] = "4"
    files = [with_header(whole, json.dumps(h).encode()) for h in (header, other)]
    assert [found for found, _ in asked(ask, tmp_path, compiled.conditions, files, [])] == [status, BAD_FILE]


def test_a_table_whose_rows_have_rules_is_left_out_with_the_reason():
    table = random_table(random.Random(5), 3, ["ok"])
    rules = {"Asset": ["a", "b"], "ok": ["True", "Any"], "When": ["", "ok"]}
    ruled = Table.from_columns(rules, {"ok": SCHEMA["ok"]}, TableSettings("ruled", when="When")).compile()
    text, held_back = c_header_of({"plain": table, "ruled": ruled})
    assert [(h.table, h.why) for h in held_back] == [("ruled", "its rows have rules of their own (when)")]
    assert "cdb_plain_open" in text
    assert "cdb_ruled_open" not in text


@pytest.mark.parametrize(("name", "why"), [("a\0b", "NUL"), ("x" * 5000, "5,000 bytes")])
def test_a_name_that_no_text_of_c_holds_is_refused(name: str, why: str):
    values = {"state": {"type": "enum", "values": [name]}}
    with pytest.raises(ContextDBError, match=why):
        c_header_of({"t": header_for({"state": ["Any", "Any"]}, values)})


def test_the_same_tables_give_the_same_header_and_a_shared_condition_one_enum():
    tables = Project.load(ROOT / "tables").compile()
    one, other = c_header_of(tables)[0], c_header_of({**tables, "again": tables["locomotion"]})[0]
    assert one == c_header_of(Project.load(ROOT / "tables").compile())[0]
    assert one.count("} cdb_gait;") == other.count("} cdb_gait;") == 1


@pytest.mark.parametrize("options", [C, CXX], ids=["C99", "C++11"])
def test_the_program_of_the_documents_prints_what_python_answers(tmp_path: Path, options: list[str]):
    project = Project.load(ROOT / "tables")
    (tmp_path / "tables.h").write_text(c_header_of(project.compile())[0], encoding="ascii")
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
    assert ran(program, cwd=tmp_path).splitlines() == ["Defender.FacingBall: the fact is missing", *table.query(context).assets]
    (tmp_path / "contested_catch.safetensors").write_bytes(b"")
    assert (
        subprocess.run([program], cwd=tmp_path, capture_output=True, text=True).stdout == ": the file is too short for its header\n"
    )


def test_the_header_refuses_a_machine_that_is_big_endian(tmp_path: Path):
    (tmp_path / "tables.h").write_text(c_header_of({})[0], encoding="ascii")
    order = ["-U__BYTE_ORDER__", "-D__BYTE_ORDER__=__ORDER_BIG_ENDIAN__"]
    command = [compiler_for(C), "-xc", "-std=c99", "-fsyntax-only", *order, str(tmp_path / "tables.h")]
    done = subprocess.run(command, capture_output=True, text=True)
    assert done.returncode != 0
    assert "little-endian" in done.stderr


def test_the_program_in_the_documents_is_the_one_that_is_compiled_here():
    shown = (ROOT / "docs" / "programmers.md").read_text(encoding="utf-8")
    assert f"```c\n{(PROGRAMS / 'game.c').read_text(encoding='utf-8')}```" in shown
