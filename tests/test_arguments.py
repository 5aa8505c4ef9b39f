"""Wrong arguments: no public call ends in an error that does not say what was wrong."""

import contextlib
import inspect
import operator
import random
import re
from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import contextdb as cdb
from contextdb import telemetry
from contextdb.cells.output_types import OUTPUT_TYPES
from contextdb.schema.settings import TableSettings
from contextdb.tables.table import Table

CONDITIONS = {
    "speed": {"type": "number"},
    "gait": {"type": "enum", "values": ["Walk", "Run"]},
    "heading": {"type": "angle"},
    "count": {"type": "int"},
    "is_hurt": {"type": "bool"},
    "Defender.tags": {"type": "tags", "values": ["InAir"]},
}
TABLE = Table.from_columns(
    {
        "Asset": ["walk", "run"],
        "speed": ["0..2", "Any ~2"],
        "gait": ["Walk", "Any"],
        "heading": ["Any", "0..90"],
        "count": ["Any", "1..3"],
        "is_hurt": ["False", "Any"],
        "Defender.tags": ["+InAir", "Any"],
    },
    CONDITIONS,
)
COMPILED = TABLE.compile()
FACTS = {"speed": 1.0, "gait": "Walk", "heading": 10.0, "count": 2, "is_hurt": False, "Defender.tags": {"InAir"}}
PLAIN = {name: fact for name, fact in FACTS.items() if name != "Defender.tags"}
ACTORS = {"Defender": [{"id": 1, "tags": {"InAir"}}]}
MANY = {name: [fact] for name, fact in FACTS.items()}
CAST = COMPILED.query(PLAIN, actors=ACTORS)
EXPLAINED, EXPLAINED_CAST = COMPILED.explain(FACTS), COMPILED.explain(PLAIN, actors=ACTORS)
ANSWERS, CAST_ANSWERS = COMPILED.query_many(MANY), COMPILED.query_many({n: [f] for n, f in PLAIN.items()}, actors=ACTORS)
SAMPLES = Path(__file__).parent.parent / "tables"
PROJECT = cdb.Project.load(SAMPLES)
WATCH = cdb.watch(SAMPLES, poll_s=None)
RECORDED = str(SAMPLES / "*.nothing")


GIVING = Table.from_columns({"A": ["a"], "n": ["1"]}, {}, {"outputs": {"n": {"type": "int"}}}).compile()


class Odd:
    """Something that no function expects."""


def linked(use: Callable[[cdb.Link], object]) -> None:
    with cdb.link("arguments") as link:
        use(link)


WRONG: list[object] = [
    None, True, 0, -1, 1, 99, 2**70, 1.5, float("nan"), "", "x", "walk", "a\0b", "\ud800", b"x", [], [5], ["x"], [[]], [None], [{}],
    {}, {5: 5}, {"x": 5}, {"x": [5]}, {"speed": Odd()}, {"Defender": 5}, {"Defender": [5]}, {"Defender": [{5: 5}]},
    {"speed": [Odd()]}, {"speed": "abc"}, {"speed": [[1]], "gait": [1, 2]}, {"speed": np.zeros((2, 2))}, (1, 2, 3), {1},
    np.zeros((2, 2)), np.arange(3), Odd(), Odd, len, Path("nowhere"), COMPILED.query(FACTS), ANSWERS,
]  # fmt: skip
FUNCTIONS = ("prefer)", "on_change)", "on_error)", "progress)", "should_stop)")
"""Arguments that are functions: what goes wrong in one that the caller gave is not ours to tell."""
Call = Callable[[object], object]
CALLS: dict[str, Call] = {
    "link(record)": lambda x: cdb.link("arguments", record=[x]).close(),  # type: ignore[arg-type]
    "link.watch(what)": lambda x: linked(lambda link: link.watch(x)),
    "link.watch(who)": lambda x: linked(lambda link: link.watch(COMPILED, x)),
    "link.picked(table)": lambda x: linked(lambda link: link.picked(x, "a", 0)),
    "link.picked(who)": lambda x: linked(lambda link: link.picked(COMPILED, x, 0)),
    "link.picked(row)": lambda x: linked(lambda link: link.picked(COMPILED, "a", x)),
    "link.pose(pose)": lambda x: linked(lambda link: link.pose("a", x, x)),
    "link.tell(decision)": lambda x: linked(lambda link: link.tell("a", x)),
    "project[name]": lambda x: PROJECT[x],  # type: ignore[index]
    "watch[name]": lambda x: WATCH[x],  # type: ignore[index]
    "snapshot[name]": lambda x: WATCH.snapshot()[x],  # type: ignore[index]
    "from_columns(columns)": lambda x: Table.from_columns(x),  # type: ignore[arg-type]
    "from_columns(schema)": lambda x: Table.from_columns({"A": ["a"], "speed": ["1"]}, x),  # type: ignore[arg-type]
    "from_columns(settings)": lambda x: Table.from_columns({"A": ["a"]}, {}, x),  # type: ignore[arg-type]
    "from_columns(columns), rows": lambda x: Table.from_columns([x]),  # type: ignore[list-item]
    "from_columns(columns), a cell of a row": lambda x: Table.from_columns([{"A": "a", "speed": x}]),
    "from_columns(settings), mapping": lambda x: Table.from_columns({"A": ["a"]}, {}, {"priority": x}),
    "from_columns(settings), outputs": lambda x: Table.from_columns({"A": ["a"]}, {}, {"outputs": x}),
    "from_columns(settings), an output": lambda x: Table.from_columns({"A": ["a"]}, {}, {"outputs": {"n": x}}),
    **{
        f"from_columns(settings), {key} of {kind}": lambda x, key=key, kind=kind: output_with(key, kind, x)
        for kind in OUTPUT_TYPES
        for key in ("type", "default", "min", "max", "values", "size", "unit")
    },
    "from_columns(settings), fallback": lambda x: Table.from_columns({"A": ["a"]}, {}, {"fallback": x}),
    "from_columns(settings), outputs of the fallback": lambda x: fallback_with(x),
    "from_columns(settings), an output of the fallback": lambda x: fallback_with({"n": x}),
    "from_columns(name)": lambda x: Table.from_columns({"A": ["a"]}, name=x),  # type: ignore[arg-type]
    "with_cells(edits), one": lambda x: TABLE.with_cells([x]),  # type: ignore[list-item]
    "with_rows(rows), one": lambda x: TABLE.with_rows(0, [x]),  # type: ignore[list-item]
    "with_rows(rows), a cell": lambda x: TABLE.with_rows(0, [{"Asset": x}]),  # type: ignore[dict-item]
    "with_rows_taken(rows), one": lambda x: TABLE.with_rows_taken([x]),  # type: ignore[list-item]
    "compile(tables)": lambda x: Table.from_columns({"A": ["@inner"]}).compile(x),  # type: ignore[arg-type]
    "compile(tables), one": lambda x: Table.from_columns({"A": ["@inner"]}).compile({"inner": x}),  # type: ignore[dict-item]
    "flat(tables)": lambda x: Table.from_columns({"A": ["@inner"]}).flat(x),  # type: ignore[arg-type]
    "flat(tables), one": lambda x: Table.from_columns({"A": ["@inner"]}).flat({"inner": x}),  # type: ignore[dict-item]
    "save(path)": lambda x: isinstance(x, (str, Path)) or TABLE.save(x),  # type: ignore[arg-type]
    "save(path), compiled": lambda x: isinstance(x, (str, Path)) or COMPILED.save(x),  # type: ignore[arg-type]
    "query_many(actors), one": lambda x: COMPILED.query_many({n: [f] for n, f in PLAIN.items()}, actors=[x]),  # type: ignore[list-item]
    "live[name]": lambda x: COMPILED.live(FACTS)[x],  # type: ignore[index]
    "live[name] =": lambda x: COMPILED.live(FACTS).__setitem__(x, 1.0),  # type: ignore[arg-type]
    "live.actors(actors)": lambda x: live_with(x).matches(),
    "live.actors(prefer)": lambda x: live_with(ACTORS, x).matches(),
    "cell(text)": lambda x: COMPILED.query({**FACTS, "speed": cdb.cell(x)}),  # type: ignore[arg-type]
    "matches.casting(row) without actors": lambda x: COMPILED.query(FACTS).casting(x),  # type: ignore[arg-type]
    "matches[place]": lambda x: CAST[x],  # type: ignore[call-overload]
    **{
        f"{kind} {sign} rows": lambda x, one=one, join=join: list(join(one, x))
        for kind, one in {"matches": CAST, "many": ANSWERS, "many with actors": CAST_ANSWERS}.items()
        for sign, join in {"&": operator.and_, "|": operator.or_, "-": operator.sub, "^": operator.xor}.items()
    },
    "in matches(row)": lambda x: x in CAST,
    "many[context]": lambda x: ANSWERS[x],  # type: ignore[call-overload]
    "many[context] with actors": lambda x: CAST_ANSWERS[x],  # type: ignore[call-overload]
    "explanation[place]": lambda x: EXPLAINED[x],  # type: ignore[index]
    "explanation.row(row) with actors": lambda x: EXPLAINED_CAST.row(x),  # type: ignore[arg-type]
    "explanation.roles(row) with actors": lambda x: EXPLAINED_CAST.roles(x),  # type: ignore[arg-type]
    "observe(files), one": lambda x: telemetry.observe(TABLE, [x]),  # type: ignore[list-item]
    **{f"a fact of {name}": lambda x, name=name: COMPILED.query({**FACTS, name: x}) for name in FACTS},  # type: ignore[misc]
    **{f"a live fact of {name}": lambda x, name=name: COMPILED.live({**FACTS, name: x}).matches() for name in FACTS},  # type: ignore[misc]
    **{f"many facts of {name}": lambda x, name=name: list(COMPILED.query_many({**MANY, name: [x]})) for name in FACTS},  # type: ignore[misc]
}


def output_with(key: str, kind: str, value: object) -> Table:
    said: dict[str, object] = {"type": kind} | {"enum": {"values": ["A"]}, "numbers": {"size": 1}}.get(kind, {})
    return Table.from_columns({"A": ["a"], "n": [""]}, {}, {"outputs": {"n": {**said, key: value}}})


def fallback_with(outputs: object) -> Table:
    settings = {"outputs": {"n": {"type": "int"}}, "fallback": {"asset": "a", "outputs": outputs}}
    return Table.from_columns({"A": ["a"], "n": ["1"]}, {}, settings)


def live_with(actors: object, prefer: object = None) -> cdb.LiveContext:
    live = COMPILED.live(PLAIN)
    live.actors(actors, prefer=prefer)  # type: ignore[arg-type]
    return live


ALONE = [
    cdb.load, cdb.Project.load, cdb.CompiledTable.open, PROJECT.with_table, PROJECT.schema.settings_for, TABLE.settings.output,
    TABLE.text_column, TABLE.condition, TABLE.place, TABLE.with_cells, TABLE.with_rows_taken, COMPILED.way, COMPILED.picker,
    COMPILED.picker().forget, COMPILED.live_many(MANY).update, COMPILED.live(FACTS).update, COMPILED.live(FACTS).pick,
    CAST.casting, CAST.castings, CAST.only, ANSWERS.only, GIVING.query({}).outputs, GIVING.outputs.column,
    GIVING.outputs.of_row, EXPLAINED.row, EXPLAINED.asset, EXPLAINED.nearest,
    COMPILED.query, COMPILED.query_many, COMPILED.live, COMPILED.explain, COMPILED.pick,
]  # fmt: skip
VALID = [
    *map(partial, ALONE),
    partial(cdb.watch, SAMPLES, poll_s=None),
    partial(cdb.link, "arguments"),
    partial(Table.from_columns, {"A": ["a"], "speed": ["1"]}),
    partial(TABLE.text, 0, "speed"),
    partial(TABLE.with_cell, 0, "speed", "1"),
    partial(TABLE.with_rows, 0, [{"Asset": "new"}]),
    partial(COMPILED.query, PLAIN, actors=ACTORS),
    partial(COMPILED.query_many, {n: [f] for n, f in PLAIN.items()}, actors=ACTORS),
    partial(COMPILED.live, FACTS),
    partial(COMPILED.live_many, MANY),
    partial(COMPILED.explain, PLAIN, actors=ACTORS),
    partial(COMPILED.pick, PLAIN, actors=ACTORS),
    partial(COMPILED.picker().pick, COMPILED.query(FACTS)),
    partial(COMPILED.picker().pick_many, ANSWERS),
    partial(COMPILED.penalties, {}),
    partial(COMPILED.live_many(MANY).set, "speed", [0], 1.0),
    partial(GIVING.outputs.of, [0], "n"),
    partial(cdb.coverage, TABLE, work=9, samples=9),
    partial(telemetry.observe, TABLE, RECORDED),
]
"""Calls of which each argument is asked for with what is wrong."""


def replaced(valid: partial[Any], name: str, value: object) -> None:
    bound = inspect.signature(valid.func).bind_partial(*valid.args, **valid.keywords)
    bound.arguments[name] = value
    given = valid.func(*bound.args, **bound.kwargs)
    if isinstance(given, cdb.LiveContext):
        given.matches()
    elif hasattr(given, "close"):
        given.close()
    elif isinstance(given, Sequence):
        list(given)


def asked(valid: partial[Any]) -> list[str]:
    """The arguments of a call whose others are given."""
    signature = inspect.signature(valid.func)
    plain = [each for each in signature.parameters.values() if each.kind is not each.VAR_KEYWORD]
    given = signature.bind_partial(*valid.args, **valid.keywords).arguments
    missing = {each.name for each in plain if each.default is each.empty} - given.keys()
    return [each.name for each in plain if missing <= {each.name}]


CALLS |= {
    f"{len(valid.args)}: {valid.func.__qualname__}({name})": partial(replaced, valid, name)
    for valid in VALID
    for name in asked(valid)
    if name not in ("strict", "slips", "clock", "assume") and (name != "column" or valid.func != TABLE.place)
}
"""Without switches and what only our own modules give."""


@pytest.mark.parametrize("name", CALLS)
def test_a_wrong_argument_ends_in_an_error_that_says_what_was_wrong(name: str):
    told = {}
    for value in WRONG:
        if (callable(value) and name.split("(")[-1] in FUNCTIONS) or (isinstance(value, np.ndarray) and "(unknown)" in name):
            continue
        with contextlib.suppress(cdb.ContextDBError):
            try:
                CALLS[name](value)
            except Exception as error:
                is_as_in_a_dict = "[name]" in name and "unhashable" in str(error)
                if not isinstance(error, cdb.ContextDBError) and not is_as_in_a_dict:
                    told[repr(value)] = f"{type(error).__name__}: {error}"
    assert told == {}


def test_every_public_method_is_asked_with_wrong_arguments():
    api = (SAMPLES.parent / "docs" / "api.md").read_text(encoding="utf-8")
    methods = re.findall(r"`(?!motion|help|len)(?:\w+\.)*(\w+)\(\w", api)
    assert len(methods) > 30
    # of switches alone, for tools, of motion
    assert [n for n in methods if not any(f"{n}(" in call for call in CALLS)] == [
        "prepare",
        "failing",
        "decided",
        "why_not",
    ]


def test_a_seed_or_generator_that_is_none_is_refused_by_name():
    with pytest.raises(cdb.ContextError, match=r"rng is of type str\. Accepted: a random.Random, a numpy.random.Generator"):
        COMPILED.pick(FACTS, rng="x")  # type: ignore[arg-type]
    with pytest.raises(cdb.ContextError, match="rng is of type type"):
        COMPILED.pick(FACTS, rng=random.Random)  # type: ignore[arg-type]


def test_facts_that_are_given_by_name_are_refused_with_what_to_write():
    for ask in (COMPILED.query, COMPILED.live, TABLE.compile().query):
        with pytest.raises(TypeError, match=r'Accepted: the facts as one mapping. Did you mean \w+\({"gait": ...}\)'):
            ask(gait="Run")  # type: ignore[arg-type]


def test_an_asset_that_is_misspelt_is_refused_with_the_nearest():
    with pytest.raises(cdb.ContextError) as caught:
        EXPLAINED.asset("wlak")
    assert str(caught.value) == 'the table "table" has no asset "wlak". Accepted: "walk", "run". Did you mean "walk"?'


@pytest.mark.parametrize("row", [2, -1, 999])
@pytest.mark.parametrize("explained", [EXPLAINED, EXPLAINED_CAST])
def test_a_row_that_the_table_does_not_have_is_no_row_counted_from_the_end(explained: cdb.Explanation, row: int):
    with pytest.raises(IndexError) as caught:
        explained.row(row)
    assert str(caught.value) == f"there is no row {row}. Accepted: rows 0 to 1."


def test_a_folder_is_told_from_a_table_and_only_tables_are_suggested(tmp_path: Path):
    for name in ("contested_catch.csv", "contested_catch.cases.csv", ".hidden.csv"):
        (tmp_path / name).write_text("Asset\na\n", encoding="utf-8")
    with pytest.raises(cdb.FileError) as caught:
        cdb.load(tmp_path)
    assert "cases" not in str(caught.value)
    assert f"Project.load({str(tmp_path)!r})" in str(caught.value)


def test_settings_name_the_table():
    assert Table.from_columns({"A": ["a"]}, settings=TableSettings("passes")).name == "passes"
    assert Table.from_columns({"A": ["a"]}, settings=TableSettings("passes"), name="other").name == "other"
    assert Table.from_columns({"A": ["a"]}).name == "table"
