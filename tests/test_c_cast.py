"""The C header casts actors as Python does: the same rows, and the same actor in every role of every row."""

import random
from pathlib import Path
from typing import Any

import pytest
from asking_c import TIMES, artefact, ask_program, asked
from c_compilers import PROGRAMS, C, built, compiler_for, ran, sanitizers
from damaged_files import mutated

import contextdb as cdb
from contextdb.compiled.c_header import c_header_of

ROLES = {"Attacker": ("gait", "dist"), "Defender": ("gait", "dist", "tall"), "Ref": ("dist",)}
KINDS: dict[str, dict[str, object]] = {
    "gait": {"type": "enum", "values": ["Walk", "Run"]},
    "dist": {"type": "number"},
    "tall": {"type": "bool"},
}
CELLS = {"gait": ["Walk", "Run", "Any", "Any"], "dist": ["<2", "1..5", "Any", "Any"], "tall": ["True", "False", "Any"]}
FACTS: dict[str, list[Any]] = {"gait": ["Walk", "Run"], "dist": [0.5, 1.5, 4.0, 9.0], "tall": [True, False]}
SLOTS = ["", "Attacker", "Defender, Ref", "Guest", '"The Guest";Ref', '"a b""Ref', 'Ref "Attacker']
UNKNOWN: tuple[cdb.Unknown, ...] = ("error", "any", "never")


@pytest.fixture(scope="module")
def program(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("cast")
    (folder / "tables.h").write_text(c_header_of({}), encoding="ascii")
    return built(PROGRAMS / "cast.c", folder / "cast.exe", C, *sanitizers(compiler_for(C)))


def table(rng: random.Random, n: int) -> cdb.CompiledTable:
    names = ["speed", *(f"{role}.{fact}" for role, facts in ROLES.items() for fact in facts)]
    schema = {name: KINDS[name.rpartition(".")[2]] if "." in name else {"type": "number"} for name in names}
    columns = {"Asset": [f"a{row}" for row in range(n)], "speed": [rng.choice(["<3", "Any"]) for _ in range(n)]}
    columns |= {name: [rng.choice(CELLS[name.rpartition(".")[2]]) for _ in range(n)] for name in names[1:]}
    columns |= {slots: [rng.choice(SLOTS) for _ in range(n)] for slots in ("Mandatory_Slots", "Optional_Slots")}
    settings = {"outputs": ["Mandatory_Slots", "Optional_Slots"]}
    return cdb.Table.from_columns(columns, schema, settings, name="cast").compile()


def actors(rng: random.Random, roles: list[str]) -> dict[str, list[dict[str, Any]]]:
    everybody = [{"id": who, **{fact: rng.choice(of) for fact, of in FACTS.items()}} for who in range(6)]
    offered = {role: rng.sample(everybody, rng.randrange(5)) for role in roles}
    return {role: [*some, *some[:1]] if rng.random() < 0.2 else some for role, some in offered.items()}


def question(facts: dict[str, Any], offered: dict[str, list[dict[str, Any]]], prefer: bool, unknown: cdb.Unknown) -> str:
    lines = [f"f\t{name}\t{float(value) if name == 'speed' else value}" for name, value in facts.items()]
    for role, some in offered.items():
        for actor in some:
            cost = actor["dist"] if prefer and role in ROLES else "-"
            lines.append(f"a\t{role}\t{actor['id']}\t{cost}")
            told = {f"{role}.{fact}": actor[fact] for fact in ROLES.get(role, ()) if fact in actor}
            lines += [f"x\t{name}\t{int(value) if isinstance(value, bool) else value}" for name, value in told.items()]
    return "\n".join([*lines, f"go\t{UNKNOWN.index(unknown)}", ""])


def in_python(compiled: cdb.CompiledTable, facts: Any, offered: Any, prefer: bool, unknown: cdb.Unknown) -> object:
    """The valid rows, how many play in each, and who; of a refusal that it is one."""
    wanted = dict.fromkeys(ROLES, "dist") if prefer else None
    try:
        answer = compiled.query(facts, actors=offered, prefer=wanted, unknown=unknown)
    except cdb.ContextError:
        return "refused"
    numbers: dict[tuple[str, int], int] = {}
    for n, (role, actor) in enumerate((role, actor) for role, some in offered.items() for actor in some):
        numbers.setdefault((role, actor["id"]), n)
    parts = []
    for row in answer.rows.tolist():
        cast = answer.casting(row)  # type: ignore[attr-defined]
        parts.append((row, len(cast), sorted((role, numbers[role, actor["id"]]) for role, actor in cast.items())))
    return parts


def read(line: str) -> object:
    """The program's line in the same form."""
    status, *rest = line.split(" ")
    if status != "0":
        return "refused"
    parts = []
    for part in rest:
        head, *plays = part.split(",")
        row, n = head.split(":")
        parts.append((int(row), int(n), sorted((role, int(who)) for role, _, who in (play.rpartition("=") for play in plays))))
    return parts


def test_actors_are_cast_as_in_python(program: Path, tmp_path: Path):
    rng = random.Random(11)
    n_cast = 0
    for _ in range(12):
        compiled = table(rng, rng.choice([5, 70, 130]))
        compiled.save(tmp_path / "t.safetensors")
        asked = []
        for _ in range(30):
            given = rng.sample([*ROLES], rng.choice([0, 0, 1]))
            facts = {"speed": rng.choice([1.0, 5.0])}
            facts |= {f"{role}.{fact}": rng.choice(FACTS[fact]) for role in given for fact in ROLES[role]}
            roles = [role for role in ROLES if role not in given] + rng.choice([[], ["Guest"]])
            offered = actors(rng, roles)
            if rng.random() < 0.1 and any(offered.values()):
                rng.choice([some for some in offered.values() if some])[0].pop("dist", None)
            asked.append(
                (facts, offered, rng.random() < 0.5 and all("dist" in a for s in offered.values() for a in s), rng.choice(UNKNOWN))
            )
        known = [role for role in ("Guest",) if "Guest" in str(data_slots(compiled))]
        asked = [(f, {r: s for r, s in o.items() if r in ROLES or (s and r in known)}, p, u) for f, o, p, u in asked]
        texts = [question({k: int(v) if isinstance(v, bool) else v for k, v in f.items()}, o, p, u) for f, o, p, u in asked]
        (tmp_path / "q.txt").write_text("".join(texts), encoding="utf-8")
        lines = ran(program, tmp_path / "t.safetensors", tmp_path / "q.txt").splitlines()
        for one, line in zip(asked, lines, strict=True):
            assert read(line) == in_python(compiled, *one), one
            n_cast += line.count("=")
    assert n_cast > 1000


def data_slots(compiled: cdb.CompiledTable) -> list[list[str]]:
    from contextdb.compiled.table import data_of

    return [[column.texts[code] for code in column.codes.tolist()] for column in data_of(compiled).slots or ()]


def test_a_table_whose_rules_need_facts_of_a_role_is_not_cast(program: Path, tmp_path: Path):
    schema = {"Defender.dist": {"type": "number"}, "speed": {"type": "number"}}
    columns = {"Asset": ["a", "b"], "Defender.dist": ["<3", "Any"], "When": ["Defender.dist < speed", ""]}
    compiled = cdb.Table.from_columns(columns, schema, {"when": "When"}).compile()
    compiled.save(tmp_path / "t.safetensors")
    (tmp_path / "q.txt").write_text("f\tspeed\t1\na\tDefender\t1\t-\nx\tDefender.dist\t1\ngo\t0\n", encoding="utf-8")
    assert ran(program, tmp_path / "t.safetensors", tmp_path / "q.txt") == "4\n"


@pytest.mark.parametrize("roles", [["Nobody"], ["Nobody", "Defender"], ["Defender", "Nobody"]])
def test_an_actor_for_no_role_of_the_table_is_refused_wherever_it_is_offered(program: Path, tmp_path: Path, roles: list[str]):
    columns = {"Asset": ["a"], "Defender.dist": ["Any"]}
    cdb.Table.from_columns(columns, {"Defender.dist": {"type": "number"}}).compile().save(tmp_path / "t.safetensors")
    (tmp_path / "q.txt").write_text("".join(f"a\t{role}\t1\t-\n" for role in roles) + "go\t1\n", encoding="utf-8")
    assert ran(program, tmp_path / "t.safetensors", tmp_path / "q.txt") == "6\n"


def test_damaged_roles_are_refused_or_cast_and_never_crash_it(tmp_path: Path):
    rng = random.Random(12)
    compiled = table(rng, 70)
    whole = artefact(compiled, tmp_path)
    slots = whole.index(b"slots.000")
    damaged = [mutated(rng, whole) for _ in range(1000 * TIMES)]
    for _ in range(500 * TIMES):
        at = rng.choice(
            [rng.randrange(slots, slots + 300), whole.index(b"Mandatory"), rng.randrange(len(whole) - 4000, len(whole))]
        )
        damaged.append(whole[:at] + bytes(rng.randrange(256) for _ in range(rng.choice([1, 4]))) + whole[at + 1 :])
    found = asked(ask_program(tmp_path), tmp_path, compiled.conditions, [whole, *damaged], [("any", {"speed": 1.0})])
    statuses = [status for status, _ in found]
    assert statuses[0] == 0
    assert 100 < statuses.count(0) < len(statuses)
