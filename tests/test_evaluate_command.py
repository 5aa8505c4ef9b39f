"""`contextdb evaluate`: every context of a file or a glob, with the sums that asking one context at a time gives."""

import os
import stat
import subprocess
from collections.abc import Collection, Iterator
from concurrent.futures import ThreadPoolExecutor
from itertools import product
from pathlib import Path

import polars as pl
import pytest
import strategies
from hypothesis import HealthCheck, given
from hypothesis import strategies as st
from running import ROOT, run
from warm_start import python

from contextdb.cells.domains import Domain
from contextdb.cells.facts import describe
from contextdb.commands.evaluate_command import share
from contextdb.compiled.table import data_of
from contextdb.tables.table import Table
from contextdb.telemetry import evaluate_file
from contextdb.telemetry.chunks import chunks_of
from contextdb.telemetry.contexts import read_contexts

TOML = """
[conditions.state]
type = "enum"
values = ["Ground", "In Air"]
[conditions.speed]
type = "number"
[conditions.heading]
type = "angle"
[conditions.ok]
type = "bool"
[conditions.tags]
type = "tags"
"""
TABLE = '''Asset,state,speed,heading,ok,tags
run,Ground,3..6,"0, 45",Any,+Move
jump,"""In Air""",0..4,Any,True,-Stunned
fall,Any,Any,"180, 90",False,Any
'''
CONTEXTS = """state,speed,heading,ok,tags,frame
Ground,4,10,True,Move.Run,1
In Air,4,-170,yes,Half Way,2
In Air,9.5,180,False,,3
Ground,1e9,0,0,Stunned,4
"""
WHOLE = CONTEXTS.replace("False,,3", "False,Stunned,3")


@pytest.fixture(autouse=True)
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A working folder with the table `moves` and a file of four contexts."""
    (tmp_path / "contextdb.toml").write_text(TOML, encoding="utf-8")
    (tmp_path / "moves.csv").write_text(TABLE, encoding="utf-8")
    (tmp_path / "data").mkdir()
    (tmp_path / "data" / "a.csv").write_text(WHOLE, encoding="utf-8")
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("COLUMNS", "100")
    return tmp_path


def refused(*arguments: str) -> list[str]:
    """The messages of a command that could not be done."""
    result = run("evaluate", *arguments)
    assert (result.code, result.out) == (2, "")
    return [line.removeprefix("contextdb: ") for line in result.err.splitlines()]


def hits(*arguments: str) -> list[int]:
    result = run("evaluate", "moves", *arguments, "--json")
    assert (result.code, result.err) == (0, "")
    return [row["hits"] for row in result.json["rows"]]


# ---- the answer


@pytest.mark.parametrize(
    ("part", "whole", "said"),
    [
        (0, 10, "0.0 %"),
        (10, 10, "100.0 %"),
        (1, 3, "33.3 %"),
        (1, 10_000, "<0.1 %"),
        (9999, 10_000, ">99.9 %"),
        (1, 1000, "0.1 %"),
        (0, 0, "0.0 %"),
    ],
)
def test_a_share_rounds_neither_to_nothing_nor_to_all(part: int, whole: int, said: str):
    assert share(part, whole) == said


@given(st.integers(0, 10**7), st.integers(1, 10**7))
def test_a_share_says_0_or_100_only_when_it_is_exactly_that(part: int, whole: int):
    part = min(part, whole)
    assert (share(part, whole) == "0.0 %") is (part == 0)
    assert (share(part, whole) == "100.0 %") is (part == whole)


# ---- files


@pytest.mark.parametrize("unknown", ["error", "any", "never"])
def test_a_file_without_contexts_has_sums_of_nothing(here: Path, unknown: str):
    (here / "none.csv").write_text(WHOLE.splitlines()[0] + "\n", encoding="utf-8")
    pl.read_csv(here / "none.csv", infer_schema_length=0).write_parquet(here / "none.parquet")
    for name in ("none.csv", "none.parquet"):
        result = run("evaluate", "moves", name, "--unknown", unknown, "--out", "answers.parquet")
        assert result.lines[:2] == ["0 contexts against 3 rows of moves", "0 contexts without a valid asset"]
        assert result.lines[-1] == "3 rows never valid"
        assert pl.read_parquet(here / "answers.parquet").height == 0


@pytest.mark.parametrize("name", ["c.csv", "c.parquet"])
def test_contexts_that_say_nothing_to_the_table_are_contexts_too(here: Path, name: str):
    frame = pl.DataFrame({"frame": [1, 2, 3]})
    frame.write_csv(here / name) if name == "c.csv" else frame.write_parquet(here / name)
    assert hits(name, "--unknown", "any") == [3, 3, 3]
    assert hits(name, "--unknown", "never") == [0, 0, 0]
    assert refused("moves", name)[0].startswith(f'{name}: the fact "state" is missing (5 facts missing:')


# ---- CSV and Parquet


def test_a_parquet_file_gives_what_its_csv_gives(here: Path):
    frame = pl.DataFrame(
        {
            "state": pl.Series(["Ground", "In Air", "In Air", "Ground"], dtype=pl.Categorical),
            "speed": pl.Series([4, 4, 9, 10**9], dtype=pl.Int64),
            "heading": pl.Series([10, 190, -180, 360], dtype=pl.Float32),
            "ok": [True, True, False, False],
            "tags": [["Move.Run"], ["Half", "Way"], ["Stunned"], ["Stunned"]],
        }
    )
    frame.write_parquet(here / "c.PARQUET")
    assert hits("c.PARQUET") == hits("data/a.csv") == [1, 1, 1]


def test_columns_whose_names_look_like_patterns_are_read(here: Path):
    (here / "t.csv").write_text('Asset,"^.*$"\na,1\n', encoding="utf-8")
    pl.DataFrame({"^.*$": [1, 2], "other": [3, 4]}).write_parquet(here / "c.parquet")
    result = run("evaluate", "t", "c.parquet", "--json")
    assert [row["hits"] for row in result.json["rows"]] == [1]


@pytest.mark.parametrize("is_parquet", [False, True], ids=["csv", "parquet"])
@strategies.examples(1, HealthCheck.function_scoped_fixture)
@given(strategies.tables(least_conditions=1), st.data(), st.sampled_from(["any", "never"]))
def test_each_context_of_a_file_is_answered_as_when_it_is_asked_alone(
    here: Path, is_parquet: bool, table: Table, data: st.DataObject, unknown: str
):
    compiled = table.compile()
    drawn = [data.draw(strategies.contexts(table, has_missing=True))[0] for _ in range(data.draw(st.integers(0, 4)))]
    facts = [data_of(compiled).read_context(context, unknown) for context in drawn]
    path = here / ("c.parquet" if is_parquet else "c.csv")
    if is_parquet:
        columns = {n: [sorted(f[n]) if isinstance(f[n], frozenset) else f[n] for f in facts] for n in data_of(compiled).places}
        pl.DataFrame(columns).with_columns(frame=pl.lit(1)).write_parquet(path)
    else:
        texts = {n: [_as_text(f[n], compiled.asked[n].domain) for f in facts] for n in data_of(compiled).places}
        pl.DataFrame(texts, schema=dict.fromkeys(texts, pl.String)).with_columns(frame=pl.lit("1")).write_csv(path)
        facts = [{n: None if f == frozenset() else f for n, f in fact.items()} for fact in facts]
    many = read_contexts(path, compiled).ask(compiled, unknown)
    alone = [compiled.query(fact, unknown=unknown).indices.tolist() for fact in facts]
    assert [rows.tolist() for rows in many.lists()] == alone
    assert many.counts.tolist() == [len(rows) for rows in alone]
    assert many.hits.tolist() == [sum(row in rows for rows in alone) for row in range(table.n_rows)]


def _as_text(fact: object, domain: Domain) -> str:
    """A fact as a file of contexts has it; no text says "no tags"."""
    if fact is None:
        return ""
    if isinstance(fact, frozenset):
        return " ".join('"' + tag + '"' for tag in sorted(fact))
    return '"' + fact.replace('"', '""') + '"' if isinstance(fact, str) else describe(fact, domain)  # type: ignore[arg-type]


# ---- missing facts


@pytest.mark.parametrize(
    ("name", "place"), [("c.csv", 'c.csv, line 3, column "speed"'), ("c.parquet", 'c.parquet, row 2, column "speed"')]
)
def test_a_missing_fact_is_named_with_its_place(here: Path, name: str, place: str):
    frame = pl.DataFrame(
        {"state": ["Ground"] * 3, "speed": [1.0, None, None], "heading": [0.0] * 3, "ok": [True] * 3, "tags": ["a"] * 3}
    )
    frame.write_csv(here / name) if name == "c.csv" else frame.write_parquet(here / name)
    assert refused("moves", name) == [
        f"{place}: the fact is missing in 2 contexts. Accepted: a value for each condition, or --unknown any, or --unknown never."
    ]


# ---- wrong facts


@pytest.mark.parametrize(
    ("name", "values", "message"),
    [
        ("speed", ["1", "fast"], 'row 2, column "speed": cannot read "fast" as a number.'),
        ("speed", ["1..2"], 'row 1, column "speed": a set of values is for one query at a time.'),
        ("speed", [[1.0]], 'row 1, column "speed": '),
        ("speed", [{"x": 1}], 'row 1, column "speed": '),
        ("state", ["Ground", "Gruond"], 'row 2, column "state": "Gruond" is not a declared value.'),
        ("state", [1], 'row 1, column "state": int "1" is not a fact of type enum.'),
        ("ok", ["True"], 'row 1, column "ok": str "True" is not a fact of type bool.'),
        ("ok", [2], 'row 1, column "ok": int "2" is not a fact of type bool.'),
        ("heading", [0.0, float("inf")], 'row 2, column "heading": '),
        ("tags", [[1]], 'row 1, column "tags": '),
        ("tags", [b"x"], 'row 1, column "tags": '),
    ],
)
def test_a_wrong_fact_of_a_parquet_file_is_named_with_its_row(here: Path, name: str, values: list[object], message: str):
    pl.DataFrame({name: values}, strict=False).write_parquet(here / "c.parquet")
    (line,) = refused("moves", "c.parquet", "--unknown", "any")
    assert line.startswith("c.parquet, ")
    assert message in line


@pytest.mark.parametrize("content", [b"", b"PAR1", b"PAR1" + bytes(100) + b"PAR1", b"state\nGround\n"])
def test_a_broken_parquet_file_is_refused(here: Path, content: bytes):
    (here / "c.parquet").write_bytes(content)
    (line,) = refused("moves", "c.parquet")
    assert line.startswith("c.parquet: ")


def test_a_cut_off_parquet_file_is_refused(here: Path):
    pl.DataFrame({"speed": [float(i) for i in range(1000)]}).write_parquet(here / "whole.parquet")
    whole = (here / "whole.parquet").read_bytes()
    for length in (len(whole) - 1, len(whole) // 2, 20):
        (here / "c.parquet").write_bytes(whole[:length])
        assert refused("moves", "c.parquet", "--unknown", "any")[0].startswith("c.parquet: ")


# ---- writing answers


@pytest.mark.parametrize("name", ["answers.csv", "answers.parquet"])
def test_the_answers_of_each_context_are_written(here: Path, name: str):
    assert run("evaluate", "moves", "data/a.csv", "--out", name).code == 0
    if name == "answers.parquet":
        rows = pl.read_parquet(here / name).rows()
        assert rows[0] == (0, "data/a.csv", 1, [0], ["run"])
        assert [row[2] for row in rows] == [1, 1, 1, 0]
        assert rows[3] == (3, "data/a.csv", 0, [], [])
    else:
        assert (here / name).read_text(encoding="utf-8").splitlines() == [
            "context,file,count,rows,assets",
            "0,data/a.csv,1,0,run",
            "1,data/a.csv,1,1,jump",
            "2,data/a.csv,1,2,fall",
            '3,data/a.csv,0,"",""',
        ]


def test_an_interrupted_run_leaves_the_old_answers_and_nothing_else(here: Path, monkeypatch: pytest.MonkeyPatch):
    (here / "data" / "b.csv").write_text(WHOLE, encoding="utf-8")
    (here / "answers.csv").write_text("of yesterday", encoding="utf-8")
    before = sorted(here.iterdir())

    def interrupted(path: Path, wanted: Collection[str], table: str) -> Iterator[object]:
        yield from chunks_of(path, wanted, table)
        if path.name == "b.csv":
            raise KeyboardInterrupt

    monkeypatch.setattr("contextdb.telemetry.contexts.chunks_of", interrupted)
    result = run("evaluate", "moves", "data/*.csv", "--out", "answers.csv")
    assert (result.code, result.out) == (130, "")
    assert (here / "answers.csv").read_text(encoding="utf-8") == "of yesterday"
    assert sorted(here.iterdir()) == before


@pytest.mark.parametrize("name", ["answers.csv", "answers.parquet"])
def test_answers_do_not_depend_on_how_much_is_read_at_once(here: Path, monkeypatch: pytest.MonkeyPatch, name: str):
    rows = WHOLE.splitlines()
    (here / "data" / "b.csv").write_text("\n".join(rows[:1] + rows[1:] * 30) + "\n", encoding="utf-8")
    frame = pl.DataFrame({"speed": [float(i % 9) for i in range(500)], "ok": [i % 3 == 0 for i in range(500)]})
    frame.write_parquet(here / "data" / "c.parquet", row_group_size=100)
    told = ("evaluate", "moves", "data/[abc].*", "--unknown", "any", "--json", "--out", name)
    whole = run(*told)
    at_once = (here / name).read_bytes() if name.endswith("csv") else pl.read_parquet(here / name)
    monkeypatch.setattr("contextdb.telemetry.chunks.ROWS", 7)
    monkeypatch.setattr("contextdb.telemetry.chunks.BYTES", 50)
    monkeypatch.setattr(evaluate_file, "MOST_ANSWERS", 3)
    assert run(*told) == whole
    assert whole.json["contexts"] == 624
    if name.endswith("csv"):
        assert (here / name).read_bytes() == at_once
    else:
        assert pl.read_parquet(here / name).equals(at_once)


@pytest.mark.parametrize(
    ("name", "place"), [("c.csv", 'c.csv, line 42, column "speed"'), ("c.parquet", 'c.parquet, row 41, column "speed"')]
)
def test_the_place_of_a_fault_counts_what_was_read_before(here: Path, monkeypatch: pytest.MonkeyPatch, name: str, place: str):
    frame = pl.DataFrame({"speed": ["1"] * 40 + ["fast"] + ["1"] * 9})
    frame.write_csv(here / name) if name == "c.csv" else frame.write_parquet(here / name)
    monkeypatch.setattr("contextdb.telemetry.chunks.ROWS", 6)
    monkeypatch.setattr("contextdb.telemetry.chunks.BYTES", 16)
    (line,) = refused("moves", name, "--unknown", "any")
    assert line.startswith(f'{place}: cannot read "fast" as a number.')


# ---- reading contexts


def test_texts_of_a_csv_are_read_as_on_the_command_line():
    compiled = Table.from_columns({"Asset": ["a"], "x": ["1"]}, {"x": {"type": "angle"}}).compile()
    Path("c.csv").write_text('x\n370\n"20, 0"\n=5\n\n -0.0 \nnan\n', encoding="utf-8")
    assert read_contexts(Path("c.csv"), compiled).facts["x"].to_list() == [10.0, 20.0, 5.0, 0.0, None]


# ---- where answers cannot go, and where they can


LIMITED = """
import resource, sys
from contextdb import cli
resource.setrlimit(resource.RLIMIT_FSIZE, (int(sys.argv[1]), int(sys.argv[1])))
sys.exit(cli.main(sys.argv[2:]))
"""


@pytest.mark.skipif(os.name == "nt", reason="limits as POSIX has them")
@pytest.mark.parametrize(("name", "n_bytes"), strategies.some(product(["answers.csv", "answers.parquet"], [100, 6_000, 30_000]), 5))
def test_a_full_disk_is_told_of_the_file_that_was_asked_for(here: Path, name: str, n_bytes: int):
    rows = "".join(f"{i % 97 / 10},{i % 3 == 0}\n" for i in range(30_000))
    (here / "c.csv").write_text("speed,ok\n" + rows, encoding="utf-8")
    (here / name).write_text("of yesterday", encoding="utf-8")
    told = python("-c", LIMITED, str(n_bytes), "evaluate", "moves", "c.csv", "--unknown", "any", "--out", name)
    done = subprocess.run(told, capture_output=True, text=True, cwd=here, env={**os.environ, "PYTHONPATH": str(ROOT)})
    assert (done.returncode, done.stdout) == (2, "")
    kept = " The old file is as it was." if "old file" in done.stderr else ""
    said = f"{name}: the file is larger than files may be here.{kept} Accepted: more room. Try to raise the limit"
    assert done.stderr == f'contextdb: {said} that "ulimit -f" shows.\n'
    assert (here / name).read_text(encoding="utf-8") == "of yesterday"
    assert list(here.glob(".contextdb-*")) == []


def test_answers_into_nowhere_are_no_error(here: Path):
    if not Path("/dev/null").exists():
        pytest.skip("there is no nowhere")
    told = run("evaluate", "moves", "data/a.csv", "--out", "/dev/null")
    assert (told.code, told.err) == (0, "")
    assert stat.S_ISCHR(os.stat("/dev/null").st_mode)


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="pipes with names")
def test_answers_into_a_pipe_are_csv(here: Path):
    os.mkfifo(here / "pipe")
    with ThreadPoolExecutor(1) as pool:
        read = pool.submit((here / "pipe").read_text, "utf-8")
        assert run("evaluate", "moves", "data/a.csv", "--out", "pipe").code == 0
        assert read.result().startswith("context,file,count,rows,assets\n0,data/a.csv,1,0,run\n")
    assert stat.S_ISFIFO(os.stat(here / "pipe").st_mode)
