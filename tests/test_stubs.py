"""Facts as Python types: what a type checker says of a context is what a query would say."""

import importlib.util
import json
import os
import re
import subprocess
import sys
from pathlib import Path
from typing import get_args, get_type_hints

import numpy as np
import pytest

import contextdb as cdb
from contextdb.compiled.stubs import stubs_of
from contextdb.compiled.table import CompiledTable
from contextdb.errors import ContextError
from contextdb.tables.project import Project
from contextdb.tables.table import Table

pytest.importorskip("mypy", reason="mypy is not installed")

ROOT = Path(__file__).parent.parent
SCHEMA: dict[str, dict[str, object]] = {
    "ok": {"type": "bool", "description": "two\nlines # and more"},
    "n": {"type": "int", "min": -3},
    "speed": {"type": "number", "min": 0, "max": 9.5, "unit": "m/s"},
    "heading": {"type": "angle"},
    "state": {"type": "enum", "values": ["Ground", "Half Air"]},
    "word": {"type": "text"},
    "Defender.Tags": {"type": "tags", "values": ["Move.Run", "InAir"]},
    "any tags": {"type": "tags"},
}
CONTEXT = (
    '{"ok": True, "n": 3, "speed": 2.5, "heading": 90, "state": "Half Air", "word": "x", '
    '"Defender.Tags": {"Move", "InAir"}, "any tags": ["a"]}'
)


def compiled(schema: dict[str, dict[str, object]], name: str = "jog") -> CompiledTable:
    columns = {"Asset": ["a"], **{condition: ["Any"] for condition in schema}}
    return Table.from_columns(columns, schema, name=name).compile()


def names_in(text: str) -> dict[str, object]:
    """What the module holds when it is run."""
    module: dict[str, object] = {}
    exec(compile(text, "<stubs>", "exec"), module)
    return module


def with_outputs() -> CompiledTable:
    """A table with roles and two outputs."""
    columns = {
        "Asset": ["a"],
        "speed": ["Any"],
        "Defender.height": ["1..2"],
        "Receiver.tags": ["+InAir"],
        "damage": ["3"],
        "word": ["Hey"],
    }
    schema: dict[str, dict[str, object]] = {
        "speed": {"type": "number"},
        "Defender.height": {"type": "number"},
        "Receiver.tags": {"type": "tags", "values": ["InAir"]},
    }
    outputs = {"damage": {"type": "int"}, "word": {"type": "enum", "values": ["Hey", "Ho"]}}
    return Table.from_columns(columns, schema, {"outputs": outputs}, "jog").compile()


WRONG = [
    ('"ok": True, ', "", 'Missing key "ok"'),
    ('"ok"', '"okay"', 'Extra key "okay"'),
    ('"n": 3', '"n": 3.5', 'item "n" has type "int | '),
    ('"speed": 2.5', '"speed": "fast"', 'item "speed" has type "float | '),
    ('"Half Air"', '"Water"', "Literal['Ground', 'Half Air']"),
    ('{"Move", ', '{"Swim", ', "Literal['Move', 'Move.Run', 'InAir']"),
]
VALUES: dict[str, object] = {"type": "enum", "values": ["a'b\"", "x\ny", "Größe", "\\"]}
ODD_NAMES = ("class", "Class", "a.b", "a b", "3", "…", "None", "Literal", "ﬁ", "fi", "np", "cdb", "AnyNumber", "Defender.class")
ODD_TABLES = ("jog", "Jog", "jog facts", "jog live", "jog some facts", "jog table", "-", "2 tables", "表")
ODD = {name: compiled({c: VALUES | {"description": c} for c in ODD_NAMES}, name) for name in ODD_TABLES}
SAMPLES = Project.load(ROOT / "tables").compile()
PLAIN = {"jog": compiled(SCHEMA)}
LIVE = "\ndef f(table: facts.JogTable, live: facts.JogLive) -> None:\n    "
NUMPY = (
    CONTEXT.replace("True", "np.True_")
    .replace('"n": 3', '"n": np.int64(3)')
    .replace("2.5", "np.float32(2.5)")
    .replace("90", "np.int8(90)")
)
SETS = (
    CONTEXT.replace('"n": 3', '"n": cdb.cell("1..4")')
    .replace("2.5", 'cdb.cell("2 ± 1")')
    .replace('"Half Air"', 'cdb.cell("not Ground")')
)
CAST = '"Defender": [{"height": 1.8, "id": 21, "name": "Ann"}], "Receiver": [{"tags": ["InAir"]}]'
PLAY = {"jog": with_outputs()}
ANSWERS = f"""from typing import assert_type

import contextdb as cdb
import numpy as np
from numpy.typing import NDArray


def f(plain: cdb.CompiledTable) -> None:
    opened: cdb.CompiledTable = facts.JogTable.open("jog.safetensors")
    jog = facts.JogTable.of(plain)
    m = jog.query({{"speed": 1.0}}, actors={{{CAST}}})
    assert_type(m.outputs("damage"), NDArray[np.int64])
    assert_type(m.outputs("word"), NDArray[np.object_])
    assert_type(m.casting(0)["Defender"], facts.JogDefenderActor)
    for role, actor in m.castings(0)[0].items():
        print(opened, m.casting(0)[role], actor)
    pick = jog.picker(seed=1).pick(m)
    assert_type(pick.outputs["damage"], int)
    assert_type(pick.outputs["word"], facts.JogWord)
    assert_type(pick.casting["Receiver"], facts.JogReceiverActor)
    assert_type(jog.live({{"speed": 1.0}}).query(), facts.JogMatches)
    assert_type(next(iter(jog.query_many({{"speed": [1.0]}}))), facts.JogMatches)
    jog.explain({{}}, unknown="any").nearest(1)
"""
SLIPS = [
    "m.outputs('damag')",
    "pick.outputs['damag']",
    "m.casting(0)['Refree']",
    "pick.casting['Defender']['heigth']",
    "jog.query({'sped': 1.0}, unknown='any')",
    "jog.query({}, actors={})",
]
MODULES: dict[str, tuple[dict[str, CompiledTable], str]] = {
    "context": (PLAIN, f"context: facts.JogFacts = {CONTEXT}\n"),
    **{
        f"wrong {i}": (PLAIN, f"context: facts.JogFacts = {CONTEXT.replace(right, no)}\n") for i, (right, no, _) in enumerate(WRONG)
    },
    "numpy": (PLAIN, f"import numpy as np\ncontext: facts.JogFacts = {NUMPY}\n"),
    "sets": (PLAIN, f"import contextdb as cdb\ncontext: facts.JogFacts = {SETS}\n"),
    "some": (
        PLAIN,
        LIVE
        + 'some: facts.JogSomeFacts = {"speed": 1.0, "state": None}\n    table.query(some, unknown="any")\n    live.update(some)\n',
    ),
    "slip in some": (PLAIN, 'some: facts.JogSomeFacts = {"sped": 1.0}\n'),
    "live": (
        PLAIN,
        LIVE
        + 'live = table.live()\n    live["speed"] = 1\n    live["state"] = None\n    del live["n"]\n'
        + "    live.copy().query().assets\n",
    ),
    "reading live": (
        PLAIN,
        "import contextdb as cdb\n"
        + LIVE
        + 'live = table.live()\n    live["speed"] = 2.5\n    state: str | cdb.FactSet = live["state"]\n'
        + '    told: dict[facts.JogFact, object] = dict(live)\n    print(len(live), "speed" in live, list(live), state, told)\n'
        + "    print(live.explain().nearest(1)[0].asset, live.pick(rng=1, last=None))\n",
    ),
    "read as another type": (PLAIN, LIVE + 'ok: str = live["ok"]\n'),
    "slip in reading": (PLAIN, LIVE + 'live["speeed"]\n'),
    "slip in live": (PLAIN, LIVE + 'live["speeed"] = 1.0\n'),
    "value in live": (PLAIN, LIVE + 'live["state"] = "Water"\n'),
    "slip in update": (PLAIN, LIVE + 'live.update({"sped": 1.0})\n'),
    "slip in del": (PLAIN, LIVE + 'del live["sped"]\n'),
    "one fact": ({"jog": compiled({"n": SCHEMA["n"]})}, LIVE + 'live = table.live()\n    live["n"] = 1\n'),
    "no facts": ({"jog": compiled({})}, LIVE + "live = table.live()\n    context: facts.JogFacts = {}\n"),
    "answers": (PLAY, ANSWERS),
    **{f"slip in an answer {i}": (PLAY, f"{ANSWERS}    {slip}\n") for i, slip in enumerate(SLIPS)},
    "actors": (
        PLAY,
        LIVE
        + 'context: facts.JogFactsWithActors = {"speed": 1.0}\n    live = table.live(context)\n'
        + f"    actors: facts.JogActors = {{{CAST}}}\n    table.query(context, actors=actors)\n    live.actors(actors)\n",
    ),
    "own data of actors": (
        PLAY,
        "class Ours(facts.JogDefenderActor):\n    mass: float\n\n"
        + LIVE
        + 'ann: Ours = {"height": 1.8, "mass": 80.0}\n    given: facts.JogActors = {"Defender": [ann]}\n'
        + "    live.actors(given)\n",
    ),
    "slip in actor": (PLAY, 'actor: facts.JogDefenderActor = {"heigth": 1.8}\n'),
    "no plain fact": (PLAY, 'context: facts.JogFactsWithActors = {"Defender.height": 1.8}\n'),
    "odd names": (ODD, ""),
    "samples": (SAMPLES, ""),
    "names": (
        {},
        "import contextdb as cdb\nfrom contextdb import motion\n"
        "def f(a: cdb.Snapshot, b: cdb.Watch, c: cdb.Context, d: cdb.Unknown, e: cdb.Actors, f: cdb.Prefer, g: cdb.Rng,\n"
        "      h: cdb.TableSettings, i: cdb.Schema, j: cdb.FactSet, k: motion.QueryError, l: cdb.motion.ClipError) -> str:\n"
        '    j = cdb.cell("1..2")\n    return cdb.__version__\n',
    ),
    "misspelt": ({}, "import contextdb as cdb\ncdb.Projectt\n"),
}
"""What mypy reads in one run: for each name some tables, whose types are the module `facts`, and Python that uses them."""


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The files of MODULES."""
    folder = tmp_path_factory.mktemp("typed")
    for i, (tables, use) in enumerate(MODULES.values()):
        (folder / f"facts_{i}.py").write_text(stubs_of(tables), encoding="utf-8")
        (folder / f"use_{i}.py").write_text(f"import facts_{i} as facts\n{use}", encoding="utf-8")
    return folder


@pytest.fixture(scope="module")
def said(folder: Path) -> dict[str, list[str]]:
    """What mypy says of each of MODULES, in strict mode."""
    cache = ROOT / ".mypy_cache" / f"stubs-{os.environ.get('PYTEST_XDIST_WORKER', 'alone')}"  # what it knows of contextdb, kept
    options = ["--strict", "--no-error-summary", "--hide-error-context", "--cache-dir", str(cache)]
    command = [sys.executable, "-m", "mypy", *options, *map(str, sorted(folder.glob("*.py")))]  # what it read is gone with it
    done = subprocess.run(command, capture_output=True, encoding="utf-8")
    assert done.stderr == ""
    found: dict[str, list[str]] = {name: [] for name in MODULES}
    for line in done.stdout.splitlines():
        file, _, told = line.partition(": error: ")
        if told:
            found[module_of(file)].append(told)
    return found


def module_of(file: str) -> str:
    """Which of MODULES a file is of."""
    return list(MODULES)[int(re.findall(r"_(\d+)\.py", file)[-1])]


RIGHT = [
    "answers",
    "context",
    "numpy",
    "sets",
    "some",
    "live",
    "reading live",
    "actors",
    "samples",
    "names",
    "one fact",
    "no facts",
    "odd names",
    "own data of actors",
]


@pytest.mark.parametrize("name", RIGHT)
def test_mypy_accepts_what_a_query_accepts(said: dict[str, list[str]], name: str):
    assert said[name] == []


@pytest.mark.parametrize("context", [CONTEXT, NUMPY, SETS])
def test_a_query_answers_the_contexts_that_mypy_accepts(context: str):
    assert compiled(SCHEMA).query(eval(context, {"np": np, "cdb": cdb})).assets == ["a"]


def test_pyright_refuses_and_accepts_what_mypy_does(said: dict[str, list[str]], folder: Path):
    if importlib.util.find_spec("pyright") is None:
        pytest.skip("pyright is not installed")
    settings = {"typeCheckingMode": "strict", "extraPaths": [str(ROOT)], "reportUnusedImport": False, "reportUnusedVariable": False}
    (folder / "pyrightconfig.json").write_text(json.dumps(settings), encoding="utf-8")
    command = [sys.executable, "-m", "pyright", "--outputjson", "--pythonpath", sys.executable]
    done = subprocess.run(command, cwd=folder, capture_output=True, encoding="utf-8")
    faults = [(module_of(fault["file"]), fault["message"]) for fault in json.loads(done.stdout)["generalDiagnostics"]]
    mypys = {name for name, lines in said.items() if lines}
    assert {name for name, _ in faults} == mypys, faults


def test_answers_and_picks_are_what_their_types_say():
    names = names_in(stubs_of(PLAY))
    jog = names["JogTable"].of(PLAY["jog"])  # type: ignore[attr-defined]
    matches = jog.query({"speed": 1.0}, actors=eval(f"{{{CAST}}}"))
    pick = jog.picker().pick(matches)
    assert (matches.assets, dict(pick.outputs)) == (["a"], {"damage": 3, "word": "Hey"})
    assert [matches.outputs(name).dtype for name in ("damage", "word")] == [np.int64, np.object_]
    assert list(matches.casting(0)) == ["Defender", "Receiver"] == list(get_args(names["JogRole"]))


def test_a_compiled_file_is_opened_with_the_types_of_its_table(tmp_path: Path):
    PLAY["jog"].save(tmp_path / "jog.safetensors")
    opened = names_in(stubs_of(PLAY))["JogTable"].open(tmp_path / "jog.safetensors")  # type: ignore[attr-defined]
    assert isinstance(opened, CompiledTable)
    assert opened.query({}, unknown="any").assets == ["a"]


@pytest.mark.parametrize("slip", range(len(SLIPS)))
def test_mypy_refuses_slips_with_answers(said: dict[str, list[str]], slip: int):
    assert len(said[f"slip in an answer {slip}"]) == 1, said[f"slip in an answer {slip}"]


@pytest.mark.parametrize(("number", "right", "wrong", "told"), [(i, *row) for i, row in enumerate(WRONG)])
def test_mypy_refuses_a_context_that_a_query_refuses(said: dict[str, list[str]], number: int, right: str, wrong: str, told: str):
    assert right in CONTEXT
    with pytest.raises(ContextError):
        compiled(SCHEMA).query(eval(CONTEXT.replace(right, wrong)))
    assert any(told in line for line in said[f"wrong {number}"]), said[f"wrong {number}"]


@pytest.mark.parametrize(
    ("name", "told"),
    [
        ("slip in some", 'Extra key "sped"'),
        ("slip in live", "No overload variant"),
        ("slip in reading", "No overload variant"),
        ("read as another type", "Incompatible types in assignment"),
        ("value in live", "No overload variant"),
        ("slip in update", 'Extra key "sped"'),
        ("slip in del", "incompatible type \"Literal['sped']\""),
        ("slip in actor", 'Missing key "height"'),
        ("no plain fact", 'Missing key "speed"'),
        ("misspelt", 'no attribute "Projectt"; maybe "Project"'),
    ],
)
def test_mypy_refuses_slips(said: dict[str, list[str]], name: str, told: str):
    assert any(told in line for line in said[name]), said[name]


def test_a_table_without_roles_has_no_types_of_actors():
    names = {name for name in names_in(stubs_of({"jog": compiled({"n": SCHEMA["n"]})})) if name.startswith("Jog")}
    assert names == {"JogFacts", "JogSomeFacts", "JogFact", "JogLive", "JogTable"}


def test_bounds_units_and_descriptions_stand_behind_the_facts_on_one_line():
    lines = stubs_of({"jog": compiled(SCHEMA)}).splitlines()
    assert "        'speed': AnyNumber,  # 0..9.5 m/s" in lines
    assert "        'n': AnyWhole,  # -3.." in lines
    assert "        'heading': AnyNumber,  # degrees" in lines
    assert "        'ok': bool | np.bool,  # two\\nlines # and more" in lines


def test_a_table_needs_the_facts_that_a_derived_one_is_computed_from():
    schema = {
        "speed": {"type": "number"},
        "target_speed": {"type": "number"},
        "closing": {"type": "number", "min": -9, "max": 9, "expr": "speed - target_speed"},
    }
    table = Table.from_columns({"Asset": ["a"], "closing": ["0..2"]}, schema, name="jog").compile()
    facts = names_in(stubs_of({"jog": table}))["JogFacts"]
    assert set(get_type_hints(facts)) == {"speed", "target_speed"} == set(table.asked)


def test_a_condition_of_several_tables_has_one_type():
    state = {"state": SCHEMA["state"]}
    text = stubs_of({"jog": compiled(state), "run": compiled(state, "run")})
    assert text.count("TypeAlias = Literal[\n") == 1
    assert get_args(names_in(text)["State"]) == ("Ground", "Half Air")


def test_names_that_are_none_in_python_or_stand_twice_are_made_so():
    hints = get_type_hints(names_in(stubs_of(ODD))["JogFacts"])
    assert list(hints) == list(ODD_NAMES)


def test_the_types_of_the_sample_tables_are_the_same_every_time():
    assert stubs_of(SAMPLES) == stubs_of(Project.load(ROOT / "tables").compile())
