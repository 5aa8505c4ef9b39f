"""Hostile input at the command line: each gives a message that says where and what, an exit code, and never a traceback."""

import errno
import os
import random
from pathlib import Path

import polars as pl
import pytest
from hypothesis import HealthCheck, given
from hypothesis import strategies as st
from running import Result, run
from strategies import examples

from contextdb.errors import ContextError
from contextdb.tables.table import Table

TOML = """
[conditions.speed]
type = "number"
[conditions.n]
type = "int"
[conditions.heading]
type = "angle"
[conditions.ok]
type = "bool"
[conditions.state]
type = "enum"
values = ["Ground", "In Air"]
[conditions.tags]
type = "tags"
values = ["Move.Run", "Stunned"]
"""


@pytest.fixture(autouse=True)
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A working folder with a schema."""
    (tmp_path / "contextdb.toml").write_text(TOML, encoding="utf-8")
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("COLUMNS", "100")
    return tmp_path


def refusals(path: str = "t.csv") -> list[str]:
    """What a query says of a table that cannot be read; a check must say the same as findings, a compile as errors."""
    result = run("query", path, "speed=1")
    assert (result.code, result.out) == (2, "")
    lines = [line.removeprefix("contextdb: ") for line in result.err.splitlines()]
    told = [line for line in lines if not line.startswith("reading ")]  # as is said of large files
    checked = run("check", path, "--json")
    assert (checked.code, len(checked.err.splitlines())) == (1, len(lines) - len(told))
    findings = [f for f in checked.json["findings"] if f["level"] == "error"]
    assert sorted(f["message"] for f in findings) == sorted(_unplaced(line, f) for line, f in zip(told, findings, strict=True))
    compiled = run("compile", path, "-o", "build/")
    assert (compiled.code, compiled.out, compiled.err) == (2, "", result.err)
    return told


def _unplaced(line: str, finding: dict[str, object]) -> str:
    """A line without the place that stands before its message."""
    place = [str(finding["file"])]
    place += [f"line {finding['line']}"] if finding["line"] else [f"row {finding['row'] + 1}"] if finding["row"] is not None else []
    place += [f'column "{finding["column"]}"'] if finding["column"] else []
    return line.removeprefix(", ".join(place) + ": ")


# ---- files that are no tables


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (b"", "t.csv: the file is empty."),
        (b"\n\n", "t.csv: "),
        (b"PK\x03\x04" + bytes(50), "t.csv: "),
        (b"\x89PNG\r\n\x1a\n" + bytes(50), "t.csv: "),
        (bytes(1000), "t.csv"),
        ("Asset,speed\nrun,1\n".encode("utf-16"), "t.csv: "),
        (b"Asset,speed\nl\xe4uft,1\n", "t.csv, line 2"),
        (b'<!DOCTYPE html>\n<html lang="en">\n<p>Sorry, not found</p>\n', "t.csv: "),
        (b'{"Asset": ["run"]}\n', "t.csv: "),
        (b"Asset;speed\nrun;1\n", "t.csv, line 1: "),
        (b"<<<<<<< ours\nAsset,speed\n=======\nAsset,sped\n>>>>>>> theirs\n", "t.csv, line 1: "),
        (b"version https://git-lfs.github.com/spec/v1\noid sha256:00\nsize 1\n", "t.csv: "),
    ],
)
def test_a_file_that_is_no_csv_is_refused(here: Path, content: bytes, message: str):
    (here / "t.csv").write_bytes(content)
    (line, *_) = refusals()
    assert line.startswith(message)


def test_every_ragged_row_is_named_with_its_line_and_how_many_fields_it_has(here: Path):
    (here / "t.csv").write_text("Asset,speed,ok\nrun,20, 9.99,True\njump,1,True\nfall\n", encoding="utf-8")
    first, second = refusals()
    assert first.startswith("t.csv, line 2: found 4 fields, the header has 3.")
    assert second.startswith("t.csv, line 4: found 1 field, the header has 3.")


def test_a_column_that_stands_twice_is_refused(here: Path):
    (here / "t.csv").write_text("Asset,speed,ok,speed\nrun,1,True,2\n", encoding="utf-8")
    (line,) = refusals()
    assert line.startswith("t.csv, line 1")
    assert '"speed"' in line


def test_a_header_alone_is_a_table_without_rows(here: Path):
    (here / "t.csv").write_text("Asset,speed\n", encoding="utf-8")
    assert run("query", "t.csv", "speed=1") == Result(1, "0 of 0 rows valid in t\n", "")
    assert [f["rule"] for f in run("check", "t.csv", "--json").json["findings"]] == ["no-rows"]
    assert run("compile", "t.csv").code == 0
    assert run("query", "t.safetensors", "speed=1", "--explain").code == 1


def test_a_cell_of_ten_megabytes_is_refused_and_not_printed(here: Path):
    (here / "t.csv").write_bytes(b"Asset,speed\nrun," + b"9" * 10_000_000 + b"\n")
    (line,) = refusals()
    assert line.startswith("t.csv, line 2")
    assert len(line) < 500


def test_a_quote_that_never_closes_is_named_where_it_opens(here: Path):
    (here / "t.csv").write_text('Asset,speed\nrun,1\n"jump,2\nfall,3\n', encoding="utf-8")
    (line,) = refusals()
    assert line.startswith("t.csv, line 3")
    assert "quote" in line


def test_mixed_line_ends_are_read_and_told(here: Path):
    (here / "t.csv").write_bytes(b"Asset,speed\r\nrun,1\njump,2..3\r\n")
    assert run("query", "t.csv", "speed=1").code == 0
    assert [f["rule"] for f in run("check", "t.csv", "--json").json["findings"]] == ["mixed-line-ends"]


def test_every_cell_that_cannot_be_read_is_told_with_what_is_accepted(here: Path):
    (here / "t.csv").write_text(
        'Asset,speed,state,ok,tags\na,"20; 9.99",Gruond,perhaps,Run\nb,5..,"In Air",True,+Stuned\n', encoding="utf-8"
    )
    told = refusals()
    assert [line.partition(": ")[0] for line in told] == [
        't.csv, line 2, column "speed"',
        't.csv, line 2, column "state"',
        't.csv, line 2, column "ok"',
        't.csv, line 2, column "tags"',
        't.csv, line 3, column "state"',
        't.csv, line 3, column "tags"',
    ]
    assert told[0].endswith('Did you mean "20, 9.99"?')
    assert told[1].endswith('"Gruond" is not a declared value. Accepted: "Ground", "In Air". Did you mean "Ground"?')
    assert told[4].endswith("""Did you mean '"In Air"'?""")
    assert 'Did you mean "+Stunned"?' in told[5]


def test_a_parquet_file_with_columns_that_no_cell_has_is_refused(here: Path):
    pl.DataFrame({"Asset": ["a"], "speed": [{"x": 1}], "when": [b"\0"]}).write_parquet(here / "t.parquet")
    told = refusals("t.parquet")
    assert [line.partition(": ")[0] for line in told] == ['t.parquet, column "speed"', 't.parquet, column "when"']


def test_a_parquet_file_whose_values_are_of_another_type_is_refused(here: Path):
    pl.DataFrame({"Asset": ["a", "b"], "ok": [0.5, 2.0], "state": [1, 2]}).write_parquet(here / "t.parquet")
    told = refusals("t.parquet")
    assert [line.partition(": ")[0] for line in told] == [
        't.parquet, row 1, column "ok"',
        't.parquet, row 1, column "state"',
        't.parquet, row 2, column "ok"',
        't.parquet, row 2, column "state"',
    ]


@pytest.mark.parametrize("suffix", [".csv", ".parquet", ".safetensors"])
@examples(0.6, HealthCheck.function_scoped_fixture)
@given(raw=st.binary(max_size=200))
def test_any_bytes_are_a_table_or_refused_by_every_command(here: Path, suffix: str, raw: bytes):
    (here / f"x{suffix}").write_bytes(raw)
    (here / "c.csv").write_text("speed\n1\n", encoding="utf-8")
    for command in (
        ["query", f"x{suffix}"],
        ["check", f"x{suffix}"],
        ["compile", f"x{suffix}", "-o", "b/"],
        ["evaluate", f"x{suffix}", "c.csv"],
    ):
        result = run(*command)
        assert result.code in (0, 1, 2)
        assert result.code != 2 or result.err.startswith("contextdb: ")
        assert "Traceback" not in result.err


@examples(1, HealthCheck.function_scoped_fixture)
@given(toml=st.binary(max_size=120) | st.text(max_size=120).map(lambda t: t.encode("utf-8", "surrogatepass")))
def test_any_bytes_are_a_schema_or_refused(here: Path, toml: bytes):
    (here / "contextdb.toml").write_bytes(toml)
    (here / "t.csv").write_text("Asset,speed\nrun,1\n", encoding="utf-8")
    query, check = run("query", "t.csv", "speed=1"), run("check", ".")
    assert query.code in (0, 2)
    assert check.code == (1 if query.code == 2 else 0)
    assert query.code == 0 or query.err.startswith("contextdb: contextdb.toml")


# ---- schemas


@pytest.mark.parametrize(
    ("toml", "message"),
    [
        (
            '[conditions.speed]\ntype = "nubmer"\n',
            'contextdb.toml, line 2: [conditions.speed] type = "nubmer": there is no such type.',
        ),
        ("[conditions.speed]\ntype = 3\n", "contextdb.toml, line 2: [conditions.speed] type = 3: this is a number, not text."),
        ('[conditions.speed]\ntype = "number"\nmni = 0\n', 'contextdb.toml, line 3: [conditions.speed] has no key "mni".'),
        ('[condition.speed]\ntype = "number"\n', 'contextdb.toml, line 1: "condition" is not a section.'),
        (
            '[conditions.speed]\ntype = "number"\nmin = 5\nmax = 1\n',
            "contextdb.toml, line 3: [conditions.speed] min = 5 is above max = 1.",
        ),
        ('[tables.t]\nfile = "../../secret.csv"\n', "contextdb.toml, line 2: "),
        ('[tables.t]\npolicy = "uniqe"\n', 'contextdb.toml, line 2: [tables.t] policy = "uniqe": there is no such policy.'),
    ],
)
def test_a_schema_that_cannot_be_meant_is_refused_with_line_and_mend(here: Path, toml: str, message: str):
    (here / "contextdb.toml").write_text(toml, encoding="utf-8")
    (here / "t.csv").write_text("Asset,speed\nrun,1\n", encoding="utf-8")
    (line,) = refusals()
    assert line.startswith(message)
    assert "Accepted: " in line


def test_a_column_that_the_schema_names_and_the_table_lacks_is_refused(here: Path):
    (here / "contextdb.toml").write_text(TOML + '[tables.t]\nasset = "Asset Name"\npriority = "Prio"\n', encoding="utf-8")
    (here / "t.csv").write_text("AssetName,speed,Priority\nrun,1,2\n", encoding="utf-8")
    told = refusals()
    assert told == [
        't.csv: there is no column "Asset Name", which [tables.t] names as asset. '
        'Accepted: "AssetName", "speed", "Priority". Did you mean "AssetName"?',
        't.csv: there is no column "Prio", which [tables.t] names as priority. '
        'Accepted: "AssetName", "speed", "Priority". Did you mean "Priority"?',
    ]


def test_a_declared_table_that_is_missing_is_an_error_of_check_and_compile(here: Path):
    (here / "contextdb.toml").write_text(TOML + '[tables.jog]\nfile = "jog.csv"\n', encoding="utf-8")
    (here / "jgo.csv").write_text("Asset,speed\nrun,1\n", encoding="utf-8")
    message = 'there is no such file. Did you mean "jgo.csv"?'
    (finding,) = run("check", ".", "--json").json["findings"]
    assert (finding["rule"], finding["file"], finding["message"]) == ("no-such-path", "jog.csv", message)
    assert run("compile", ".") == Result(2, "", f"contextdb: jog.csv: {message}\n")
    assert run("query", "jog", "speed=1") == Result(2, "", f"contextdb: jog.csv: {message}\n")


# ---- facts


@pytest.fixture
def table(here: Path) -> Path:
    (here / "t.csv").write_text("Asset,speed,n,heading,ok,state,tags\na,Any,1..3,Any,True,Ground,+Move\n", encoding="utf-8")
    return here / "t.csv"


GOOD = {"speed": 1.0, "n": 2, "heading": 0.0, "ok": True, "state": "Ground", "tags": ["Move.Run"]}


@pytest.mark.parametrize(
    ("fact", "message"),
    [
        ("n=1.5", 'column "n": '),
        ("n=1e400", 'column "n": '),
        ("n=0x10", 'column "n": '),
        ("speed=1_000", 'column "speed": '),
        ("heading=inf", 'column "heading": '),
        ("ok=2", 'column "ok": '),
        ("state=ground", 'column "state": "ground" is not a declared value. Accepted: "Ground", "In Air". Did you mean "Ground"?'),
        ("state=In Ai", 'column "state": '),
        ("tags=Move.Walk", 'column "tags": "Move.Walk" is not a declared value.'),
        ("tags=+Move -Move", 'column "tags": '),
        ("speed=" + "9" * 100_000, 'column "speed": '),
        ("speed=1\x1b[2J", 'column "speed": '),
    ],
)
def test_a_fact_of_the_wrong_type_is_refused(table: Path, fact: str, message: str):
    result = run("query", "t.csv", "--unknown", "any", fact)
    assert (result.code, result.out) == (2, "")
    (line,) = result.err.splitlines()
    assert line.startswith(f"contextdb: {message}")
    assert len(line) < 600
    assert "\x1b" not in line


def test_a_nan_fact_is_a_missing_fact(table: Path):
    facts = [f"{name}={' '.join(value) if isinstance(value, list) else value}" for name, value in GOOD.items()]
    assert run("query", "t.csv", *facts).code == 0
    nan = ["speed=NaN", *facts[1:]]
    assert run("query", "t.csv", *nan).err.startswith('contextdb: the fact "speed" is missing.')
    assert run("query", "t.csv", *nan, "--unknown", "any").code == 0
    assert run("query", "t.csv", *nan, "--unknown", "never").code == 0
    assert run("query", "t.csv", *facts[:1], "n=nan", *facts[2:], "--unknown", "never").code == 1


@examples(1, HealthCheck.function_scoped_fixture)
@given(st.sampled_from(list(GOOD)), st.text(max_size=30))
def test_any_text_as_a_fact_is_answered_or_refused(table: Path, name: str, text: str):
    result = run("query", "t.csv", "--unknown", "any", f"{name}={text}")
    assert result.code in (0, 1, 2)
    assert result.code != 2 or result.err.startswith("contextdb: ")
    assert result.err.isprintable() or result.err.rstrip("\n").isprintable()


ODD = st.one_of(
    st.none(),
    st.booleans(),
    st.integers(),
    st.floats(),
    st.complex_numbers(),
    st.text(max_size=5),
    st.binary(max_size=5),
    st.lists(st.none() | st.integers() | st.text(max_size=3), max_size=3),
    st.dictionaries(st.text(max_size=2), st.integers(), max_size=2),
    st.builds(object),
)


@given(st.sampled_from(list(GOOD)), ODD)
def test_any_python_value_as_a_fact_is_answered_or_refused(name: str, value: object):
    columns = {
        "Asset": ["a"],
        "speed": ["Any"],
        "n": ["1..3"],
        "heading": ["Any"],
        "ok": ["True"],
        "state": ["Ground"],
        "tags": ["+Move"],
    }
    schema = {
        **{"speed": {"type": "number"}, "n": {"type": "int"}, "heading": {"type": "angle"}, "ok": {"type": "bool"}},
        **{"state": {"type": "enum", "values": ["Ground", "In Air"]}, "tags": {"type": "tags", "values": ["Move.Run", "Stunned"]}},
    }
    compiled = Table.from_columns(columns, schema).compile()
    context = GOOD | {name: value}
    for ask in (compiled.query, compiled.explain, compiled.pick, compiled.penalties):
        try:
            ask(context, unknown="any")  # type: ignore[operator]
        except ContextError as error:
            assert str(error)  # noqa: PT017
    try:
        compiled.query_many({k: [v] for k, v in context.items()}, unknown="any")
    except ContextError as error:
        assert str(error)  # noqa: PT017


# ---- the disk


@pytest.mark.parametrize(
    ("code", "said"),
    [
        (errno.ENOSPC, "the disk is full."),
        (errno.EROFS, "is on a disk that cannot be written."),
        (errno.EACCES, "may not be written in."),
        (errno.EIO, "the file cannot be written: "),
    ],
)
@pytest.mark.parametrize("command", [["compile", "t.csv"], ["evaluate", "t.csv", "t.csv", "--unknown=any", "--out", "a.parquet"]])
def test_a_disk_that_cannot_be_written_is_told_and_leaves_no_file(
    table: Path, monkeypatch: pytest.MonkeyPatch, command: list[str], code: int, said: str
):
    table.write_text("Asset,speed\nrun,1\n", encoding="utf-8")

    def refuse(*_: object) -> int:
        raise OSError(code, os.strerror(code))

    monkeypatch.setattr(os, "write", refuse)
    result = run(*command)
    monkeypatch.undo()
    assert (result.code, result.out) == (2, "")
    assert said in result.err
    assert sorted(p.name for p in table.parent.iterdir()) == ["contextdb.toml", "t.csv"]


@pytest.mark.skipif(os.name == "nt" or os.geteuid() == 0, reason="permissions as POSIX has them, and not for root")
def test_a_folder_that_may_not_be_read_or_written_is_told(table: Path):
    folder = table.parent / "locked"
    folder.mkdir()
    folder.chmod(0o500)
    assert "may not be written" in run("compile", "t.csv", "-o", "locked/t.safetensors").err
    folder.chmod(0)
    for arguments in (["check", "locked"], ["query", "locked/t.csv"], ["compile", "locked"]):
        assert run(*arguments).code == 2
    folder.chmod(0o700)


@pytest.mark.parametrize("call", ["os.listdir", "pathlib.Path.iterdir"])
def test_a_folder_that_may_not_be_read_is_told(table: Path, monkeypatch: pytest.MonkeyPatch, call: str):
    def refuse(*_: object) -> object:
        raise PermissionError(errno.EACCES, os.strerror(errno.EACCES), "locked")

    monkeypatch.setattr(call, refuse)
    for arguments in (["check", "."], ["query", "tt.csv", "speed=1"], ["compile", "."], ["evaluate", "t.csv", "none.csv"]):
        result = run(*arguments)
        assert result.code in (0, 1, 2)
        assert "Traceback" not in result.err


def test_a_table_that_changes_while_it_is_read_never_gives_a_traceback(table: Path):
    whole = table.read_bytes()
    rng = random.Random(1)
    for _ in range(200):
        altered = bytearray(whole)
        for _ in range(rng.randrange(1, 4)):
            altered[rng.randrange(len(altered))] = rng.randrange(256)
        table.write_bytes(bytes(altered[: rng.randrange(1, len(altered))]))
        assert run("check", "t.csv").code in (0, 1)
