"""Hostile names and arguments at the command line: they are printed without harm, kept in the data, and never a traceback."""

import os
from pathlib import Path

import pytest
from hypothesis import HealthCheck, given
from hypothesis import strategies as st
from running import run
from strategies import examples


@pytest.fixture(autouse=True)
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A working folder with a schema."""
    (tmp_path / "contextdb.toml").write_text('[conditions.speed]\ntype = "number"\n', encoding="utf-8")
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("COLUMNS", "100")
    return tmp_path


HOSTILE_NAMES = [
    "\x1b[31mred\x1b[0m",
    "two\nlines",
    "\u202egnp.exe",
    "bell\x07",
    "long" * 2000,
    "走る ✈ é",
    "-rf",
    "=1+1",
    "'; DROP TABLE",
    "</script>",
    "%s %d {0}",
    "[bold]rich[/bold]",
    "\u200b",
    "  spaced  ",
]


@pytest.mark.parametrize("name", HOSTILE_NAMES, ids=range(len(HOSTILE_NAMES)))
def test_a_hostile_asset_name_is_printed_without_harm_and_kept_in_the_data(here: Path, name: str):
    quoted = '"' + name.replace('"', '""') + '"'
    (here / "t.csv").write_text(f"Asset,speed\n{quoted},1\n{quoted},5..3\n", encoding="utf-8")
    for arguments in (
        ["query", "t.csv", "speed=1"],
        ["query", "t.csv", "speed=2"],
        ["check", "t.csv"],
        ["evaluate", "t.csv", "t.csv", "--unknown=any"],
    ):
        result = run(*arguments)
        assert result.code in (0, 1, 2)
        assert all(line.isprintable() for line in (result.out + result.err).split("\n"))
    assert run("query", "t.csv", "speed=1", "--json").json["matches"][0]["asset"] == name
    assert run("compile", "t.csv").code == 0
    assert run("query", "t.safetensors", "speed=1", "--json").json["matches"][0]["asset"] == name


@pytest.mark.parametrize("name", HOSTILE_NAMES, ids=range(len(HOSTILE_NAMES)))
def test_a_hostile_condition_name_can_be_asked_for(here: Path, name: str):
    quoted = '"' + name.replace('"', '""') + '"'
    (here / "t.csv").write_text(f"Asset,{quoted}\na,1\n", encoding="utf-8")
    fact = f"{name}=1"
    asked = ["query", "t.csv", "--", fact] if name.startswith("-") else ["query", "t.csv", fact]
    assert run(*asked).code == 0
    result = run(*asked[:-1], f"{name}=x")
    assert result.code == 2
    assert result.err.rstrip("\n").isprintable()
    assert run("query", "t.csv", "--unknown=never").code == 1


@pytest.mark.skipif(os.name == "nt", reason="such names cannot be on Windows")
@pytest.mark.parametrize(
    "name", ["\x1b[31mred.csv", "two\nlines.csv", "-t.csv", "a b;c.csv", "\u202ecsv.csv", os.fsdecode(b"caf\xe9.csv")]
)
def test_a_hostile_file_name_is_printed_without_harm(here: Path, name: str):
    (here / name).write_text("Asset,speed\nrun,1\nrun,5..3\n", encoding="utf-8")
    path = f"./{name}"
    for arguments in (
        *(["query", path, "speed=1"], ["query", path, "speed=x"], ["check", path], ["check", "."], ["compile", path]),
        *(["check", path, "--format", "github"], ["evaluate", path, path, "--unknown=any"], ["query", path + "x"]),
    ):
        result = run(*arguments)
        assert result.code in (0, 1, 2)
        assert all(line.isprintable() for line in (result.out + result.err).split("\n"))
    for arguments in (["query", path, "speed=1", "--json"], ["check", "--json", "."]):
        result = run(*arguments)
        assert "\x1b" not in result.out
        assert result.json["format"] == 1
    assert run("query", f"./{name[:-4]}.safetensors", "speed=1").code == 0


@pytest.mark.parametrize(
    "argument", ["a\0b", "\0", "x" * 100_000, "../" * 2000, "\ud800", "caf\udce9", "\n", "\x1b[2J", "​", "~", "*", "C:\\"]
)
def test_a_hostile_argument_is_refused_by_every_command(here: Path, argument: str):
    (here / "t.csv").write_text("Asset,speed\nrun,1\n", encoding="utf-8")
    for arguments in (
        *([argument], ["query", argument, "speed=1"], ["query", "t.csv", argument], ["query", "t.csv", f"{argument}=1"]),
        *(
            ["check", argument],
            ["compile", argument],
            ["compile", "t.csv", "-o", argument + ".bin"],
            ["evaluate", "t.csv", argument],
        ),
        *(["evaluate", argument, "t.csv"], ["check", "t.csv", "--format", argument], ["demo", "--tables", argument]),
    ):
        result = run(*arguments)
        assert (result.code, result.out) == (2, "")
        assert result.err.startswith("contextdb")
        assert all(line.isprintable() for line in result.err.split("\n"))


@pytest.mark.parametrize("arguments", [[], ["query"], ["query", "t.csv"], ["check"], ["compile", "t.csv"], ["evaluate", "t.csv"]])
@examples(0.4, HealthCheck.function_scoped_fixture)
@given(
    more=st.lists(
        st.text(max_size=12) | st.sampled_from(["--json", "--unknown", "any", "speed=1", "-o", "--", "-", "@t.csv"]), max_size=3
    )
)
def test_any_arguments_end_with_an_exit_code(here: Path, arguments: list[str], more: list[str]):
    (here / "t.csv").write_text("Asset,speed\nrun,1\n", encoding="utf-8")
    if "demo" not in more:
        assert run(*arguments, *more).code in (0, 1, 2)
