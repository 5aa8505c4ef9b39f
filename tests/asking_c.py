"""Asks artefacts through the C header and in Python: random tables and facts of every type, and the program `ask.c`."""

import math
import os
import random
import struct
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import numpy as np
from c_compilers import PROGRAMS, C, built, compiler_for, ran, sanitizers

from contextdb.cells.conditions import Condition
from contextdb.cells.kinds import KINDS
from contextdb.cells.outputs import Output
from contextdb.compiled.c_header import c_header_of
from contextdb.compiled.core_table import values_of
from contextdb.compiled.table import CompiledTable, data_of
from contextdb.errors import ContextError
from contextdb.tables.table import Table

TIMES = {"full": 8, "thorough": 12}.get(os.environ.get("EXAMPLES", ""), 1)
"""So many times the tables and files of every day are drawn."""
N_MOMENTS = {"thorough": 250}.get(os.environ.get("EXAMPLES", ""), 50)
"""So many contexts each table is asked for: thoroughly 120,000 with rules, 120,000 with picks and outputs, 18,000 with both."""
SEED = int(os.environ["EXAMPLES_SEED"]) if TIMES > 1 else 0
OUTPUT_TYPES = ("bool", "int", "number", "enum", "text", "numbers")
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


def ask_program(folder: Path) -> Path:
    """The program that asks any artefact, built in a folder."""
    (folder / "tables.h").write_text(c_header_of({}), encoding="ascii")
    return built(PROGRAMS / "ask.c", folder / "ask.exe", C, *sanitizers(compiler_for(C)))


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
    declared = values_of(condition)
    return ("", *declared) if condition.domain.kind == "tags" else declared


def schema_bytes(conditions: Sequence[Condition]) -> bytes:
    parts = [packed(len(conditions))]
    for condition in conditions:
        values = values_in_c(condition)
        parts += [text(condition.name), packed(list(KINDS).index(condition.domain.kind)), text(condition.expr), packed(len(values))]
        parts += map(text, values)
    return b"".join(parts)


def output_bytes(outputs: Sequence[Output]) -> bytes:
    kinds = [(text(o.name), packed(OUTPUT_TYPES.index(o.kind), o.size if o.kind == "numbers" else 1)) for o in outputs]
    return packed(len(outputs)) + b"".join(part for pair in kinds for part in pair)


def output_words(values: Mapping[str, object]) -> list[int]:
    """Outputs as the program writes them."""
    found: list[int] = []
    for value in values.values():
        if isinstance(value, str):
            found.append(fnv1a(value.encode("utf-8")))
        elif isinstance(value, int):
            found.append(int(value))
        else:
            numbers = value if isinstance(value, tuple) else (value,)
            found += np.array(numbers, "<f8").view("<i8").tolist()
    return found


def fnv1a(octets: bytes) -> int:
    """The hash by which the header knows texts, as a signed number."""
    found = 0xCBF29CE484222325
    for octet in (*octets, 0xFF):
        found = (found ^ octet) * 0x100000001B3 % 2**64
    return found - 2**64 * (found >> 63)


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


@dataclass(frozen=True)
class Told:
    """What C says of one context beside the answer."""

    penalties: tuple[int, list[float]]
    """Status and costs."""
    widened: tuple[int, int]
    """Status and rows for what plays already, as one integer."""
    widened_penalties: tuple[int, list[float]]
    pick: tuple[int, int]
    """Status and row, -1 for none."""
    digest: int
    """The picker's, without sign."""
    outputs: list[int]
    """The outputs of that row: whole numbers, doubles by their bits, texts by their hash."""
    why_not: list[int]
    """For each row the numbers of failing conditions as bits, 62 for its rule, 61 where it is disabled; -1 for a fault."""


@dataclass
class Answers:
    """What C answers for one artefact."""

    status: int
    rows: list[tuple[int, int]]
    """For each context status and rows, as one integer."""
    told: list[Told]


def asked(
    ask: Path,
    folder: Path,
    conditions: Sequence[Condition],
    artefacts: Sequence[bytes],
    moments: Iterable[tuple[str, Facts]],
    strange: int = 0,
) -> list[tuple[int, list[tuple[int, int]]]]:
    """For each artefact the status of opening it, and for each context status and rows, as one integer."""
    return [(a.status, a.rows) for a in all_asked(ask, folder, conditions, artefacts, moments, strange)]


def all_asked(
    ask: Path,
    folder: Path,
    conditions: Sequence[Condition],
    artefacts: Sequence[bytes],
    moments: Iterable[tuple[str, Facts]],
    strange: int = 0,
    memory: int = -1,
    outputs: Sequence[Output] = (),
) -> list[Answers]:
    """The same, and what else is said of each context where a character picks with a `memory`."""
    listed = list(moments)
    plain = [c for c in conditions if not c.expr]
    contexts = b"".join(
        packed(UNKNOWN.index(unknown)) + b"".join(fact_bytes(c, facts.get(c.name)) for c in plain) for unknown, facts in listed
    )
    counted = [packed(strange, memory, len(artefacts)), *map(text, artefacts), packed(len(listed))]
    (folder / "in").write_bytes(b"".join([schema_bytes(conditions), output_bytes(outputs), *counted, contexts]))
    ran(ask, folder / "in", folder / "out")
    words = np.fromfile(folder / "out", "<i8")
    found, at = [], 0
    n_values = sum(output.size if output.kind == "numbers" else 1 for output in outputs)
    for _ in artefacts:
        answers, at = Answers(int(words[at]), [], []), at + 1
        for _ in listed if answers.status == OK else ():
            n_words = int(words[at + 1])
            answers.rows.append((int(words[at]), int.from_bytes(words[at + 2 : at + 2 + n_words].tobytes(), "little")))
            at += 2 + n_words
            if memory >= 0:
                n, status, rest = int(words[at]), int(words[at + 1]), words[at + 2 :]
                costs, rest = rest[:n].view("<f8").tolist(), rest[n:]
                widened = int(rest[0]), int.from_bytes(rest[1 : 1 + n_words].tobytes(), "little")
                wide_status, rest = int(rest[1 + n_words]), rest[2 + n_words :]
                wide_costs, rest = rest[:n].view("<f8").tolist(), rest[n:]
                pick, why = (int(rest[0]), int(rest[1])), 3 + n_values
                digest, outputs, why_not = int(rest[2]) % 2**64, rest[3:why].tolist(), rest[why : why + n].tolist()
                wide = widened, (wide_status, wide_costs)
                answers.told.append(Told((status, costs), *wide, pick, digest, outputs, why_not))
                at += 7 + n_words + 3 * n + n_values
        found.append(answers)
    assert at == len(words)
    return found


def artefact(compiled: CompiledTable, folder: Path) -> bytes:
    compiled.save(folder / "table.safetensors")
    return (folder / "table.safetensors").read_bytes()


def python_says(compiled: CompiledTable, unknown: str, facts: Facts) -> tuple[int, int]:
    """Status and rows, as one integer; by the careful way, which has no part in C."""
    try:
        return OK, data_of(compiled).query_with_care(facts, unknown).bits  # type: ignore[arg-type]
    except ContextError as error:
        return (WRONG_FACT if any(f.rule == "wrong-fact" for f in error.faults) else MISSING_FACT), 0


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
