"""`contextdb compile`: an artefact for each table, where it was asked for, that answers as the table does."""

from __future__ import annotations

import errno
import os
from pathlib import Path
from unittest import mock

import polars as pl
import pytest
from running import ROOT, Result, run

from contextdb.compiled.table import CompiledTable

TOML = '[conditions.speed]\ntype = "number"\n[tables.running]\nfile = "run.csv"\n[tables.jog]\n'


@pytest.fixture(autouse=True)
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A working folder with the tables `running` and `jog` in game/."""
    (tmp_path / "game").mkdir()
    (tmp_path / "game" / "contextdb.toml").write_text(TOML, encoding="utf-8")
    (tmp_path / "game" / "run.csv").write_text("Asset,speed\nrun,4..9\nsprint,8..12\n", encoding="utf-8")
    (tmp_path / "game" / "jog.csv").write_text("Asset,speed\njog,2..4\n", encoding="utf-8")
    monkeypatch.chdir(tmp_path)
    return tmp_path


def refused(*arguments: str) -> str:
    result = run("compile", *arguments)
    assert (result.code, result.out) == (2, "")
    return result.err.removeprefix("contextdb: ").rstrip("\n")


def artefacts(folder: Path) -> list[str]:
    return sorted(p.relative_to(folder).as_posix() for p in folder.rglob("*.safetensors"))


# ---- where artefacts go


def test_a_folder_is_compiled_beside_its_tables_and_each_path_is_printed(here: Path):
    result = run("compile", "game")
    assert (result.code, result.lines) == (0, ["game/run.safetensors", "game/jog.safetensors"])
    assert result.err.splitlines()[1].startswith("jog: 1 row, 1 condition, ")
    assert artefacts(here) == ["game/jog.safetensors", "game/run.safetensors"]
    assert CompiledTable.open("game/run.safetensors").query({"speed": 8.5}).assets == ["run", "sprint"]


@pytest.mark.parametrize("out", ["build", "build/", "build/deep/er/"])
def test_a_folder_is_compiled_into_another_by_the_names_of_its_tables(here: Path, out: str):
    assert run("compile", "game/contextdb.toml", "-o", out).code == 0
    assert artefacts(here / out) == ["jog.safetensors", "running.safetensors"]


def test_one_table_is_compiled_beside_itself_or_into_the_given_file_or_folder(here: Path):
    assert run("compile", "game/run.csv").lines == ["game/run.safetensors"]
    assert run("compile", "game/run.csv", "-o", "r.safetensors").lines == ["r.safetensors"]
    assert run("compile", "game/run.csv", "--out", "new/r.safetensors").lines == ["new/r.safetensors"]
    assert run("compile", "game/run.csv", "-o", "new").lines == ["new/running.safetensors"]
    assert run("compile", "game/run.csv", "-o", "newer/").lines == ["newer/running.safetensors"]
    assert len(artefacts(here)) == 5


def test_a_table_is_compiled_by_its_name(here: Path, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.chdir(here / "game")
    assert run("compile", "running").lines == ["run.safetensors"]


def test_a_parquet_table_is_compiled(here: Path):
    pl.DataFrame({"Asset": ["a"], "speed": [3]}).write_parquet(here / "game" / "p.parquet")
    assert run("compile", "game/p.parquet").lines == ["game/p.safetensors"]
    assert CompiledTable.open("game/p.safetensors").query({"speed": 3}).assets == ["a"]


@pytest.mark.parametrize("name", ["../evil", "a/b", "a\\\\b"])
def test_the_name_of_a_table_never_leads_out_of_the_folder(here: Path, name: str):
    (here / "game" / "contextdb.toml").write_text(f'[tables."{name}"]\nfile = "run.csv"\n', encoding="utf-8")
    assert run("compile", "game", "-o", "build").code == 0
    assert artefacts(here) == ["build/jog.safetensors", "build/run.safetensors"]


def test_an_artefact_is_replaced_by_the_new_one(here: Path):
    run("compile", "game/run.csv")
    (here / "game" / "run.csv").write_text("Asset,speed\nother,1\n", encoding="utf-8")
    assert run("compile", "game/run.csv").code == 0
    assert list(CompiledTable.open("game/run.safetensors").assets) == ["other"]


def test_the_same_tables_give_the_same_bytes(here: Path):
    run("compile", "game", "-o", "one")
    run("compile", "game", "-o", "two")
    for name in artefacts(here / "one"):
        assert (here / "one" / name).read_bytes() == (here / "two" / name).read_bytes()


def test_the_artefact_of_a_sample_table_is_asked_as_the_table(here: Path, monkeypatch: pytest.MonkeyPatch):
    artefact = here / "h.safetensors"
    monkeypatch.chdir(ROOT)
    assert run("compile", "hit_mid_air", "-o", str(artefact)).code == 0
    arguments = ["--unknown", "any", "IsInCatchAnim=False", "dir_to_tackle_target_future_pos=10", "--json", "--explain"]
    assert run("query", artefact, *arguments) == run("query", "tables/hit_mid_air.csv", *arguments)


@pytest.mark.parametrize("name", ["facts.py", "new/facts.pyi"])
def test_the_facts_of_all_tables_are_written_as_python_types_where_that_is_asked_for(here: Path, name: str):
    result = run("compile", "game", "--stubs", name)
    assert (result.code, result.lines) == (0, ["game/run.safetensors", "game/jog.safetensors", name])
    text = (here / name).read_text(encoding="utf-8")
    assert "RunningFacts = TypedDict(" in text
    assert "JogFacts = TypedDict(" in text


@pytest.mark.parametrize("name", ["tables.h", "new/tables.hpp"])
def test_one_header_for_all_tables_is_written_where_that_is_asked_for(here: Path, name: str):
    result = run("compile", "game", "--c-header", name)
    assert (result.code, result.lines) == (0, ["game/run.safetensors", "game/jog.safetensors", name])
    text = (here / name).read_text(encoding="ascii")
    assert "cdb_running_query(const cdb_running *opened, const cdb_running_facts *facts" in text
    assert "double speed;" in text
    assert "} cdb_jog;" in text
    assert "#ifndef CDB_TABLES_H" in text


def test_a_header_gives_the_facts_that_only_rules_name(here: Path):
    schema = '[conditions.hurt]\ntype = "bool"\n\n'
    (here / "game" / "contextdb.toml").write_text(schema + TOML + 'when = "When"\n', encoding="utf-8")
    (here / "game" / "jog.csv").write_text("Asset,speed,When\njog,2..4,speed > 3 and not hurt\n", encoding="utf-8")
    result = run("compile", "game", "--c-header", "t.h")
    assert (result.code, len(result.lines)) == (0, 3)
    assert "    int hurt;" in (here / "t.h").read_text(encoding="ascii")


# ---- what is refused


@pytest.mark.parametrize(
    ("name", "mend"),
    [("tables", ' Did you mean "tables.h"?'), ("t.c", ' Did you mean "t.h"?'), ("game", ""), ("new/", "")],
)
def test_a_header_has_the_suffix_of_one(here: Path, name: str, mend: str):
    assert refused("game", "--c-header", name) == (
        f"{name}: this is not a valid name for a C header. Accepted: a name that ends in .h, .hpp, .hh or .hxx.{mend}"
    )
    assert artefacts(here) == []


def test_a_name_that_no_text_of_c_can_hold_is_told_before_anything_is_written(here: Path):
    long = "x" * 4001
    (here / "game" / "run.csv").write_text(f"Asset,{long}\nrun,True\n", encoding="utf-8")
    assert "has 4,001 bytes. Accepted: names of at most 4,000 bytes" in refused("game", "--c-header", "t.h")
    assert artefacts(here) == []


@pytest.mark.parametrize(
    ("name", "mend"),
    [("facts", ' Did you mean "facts.py"?'), ("facts.txt", ' Did you mean "facts.py"?'), ("game", ""), ("new/", "")],
)
def test_types_go_into_a_python_file(here: Path, name: str, mend: str):
    assert refused("game", "--stubs", name) == (
        f"{name}: this is not a valid name for a Python file. Accepted: a name that ends in .py or .pyi.{mend}"
    )
    assert artefacts(here) == []


@pytest.mark.parametrize("out", ["run.bin", "run", "run.safetensor"])
def test_an_artefact_has_its_suffix(out: str):
    near = out.partition(".")[0] + ".safetensors"
    assert refused("game/run.csv", "-o", out) == (
        f"{out}: this is not a valid name for a compiled file. Accepted: a name that ends in .safetensors, or a folder. "
        f'Did you mean "{near}"?'
    )


def test_several_tables_do_not_go_into_one_artefact(here: Path):
    assert refused("game", "-o", "all.safetensors") == (
        "all.safetensors: 2 tables do not go into one artefact. Accepted: a folder."
    )
    assert artefacts(here) == []


def test_two_tables_never_go_to_one_file(here: Path):
    toml = '[tables.a]\nfile = "x.csv"\n[tables.b]\nfile = "x.parquet"\n'
    (here / "game" / "contextdb.toml").write_text(toml, encoding="utf-8")
    (here / "game" / "x.csv").write_text("Asset\na\n", encoding="utf-8")
    pl.DataFrame({"Asset": ["b"]}).write_parquet(here / "game" / "x.parquet")
    assert refused("game") == "game/x.safetensors: two tables would be written to one file. Accepted: one file for each table."
    assert artefacts(here) == []
    assert run("compile", "game", "-o", "build").code == 0
    assert artefacts(here / "build") == ["a.safetensors", "b.safetensors", "jog.safetensors", "run.safetensors"]


def test_a_table_with_faults_is_not_compiled_and_no_artefact_is_written(here: Path):
    (here / "game" / "jog.csv").write_text("Asset,speed\njog,fast\nwalk,slow\n", encoding="utf-8")
    told = refused("game").splitlines()
    assert [line.partition(": cannot")[0] for line in told] == [
        'game/jog.csv, line 2, column "speed"',
        'contextdb: game/jog.csv, line 3, column "speed"',
    ]
    assert artefacts(here) == []


def test_a_folder_without_tables_is_refused(here: Path):
    (here / "none").mkdir()
    assert refused("none") == "none: the folder holds no table. Accepted: a folder with .csv or .parquet files."


def test_a_folder_that_is_a_file_is_refused(here: Path):
    (here / "file").write_text("", encoding="utf-8")
    assert refused("game", "-o", "file") == "file: the folder cannot be made: it is a file. Accepted: a folder."
    assert refused("game", "-o", "file/deep") == "file/deep: the folder cannot be made: it is a file. Accepted: a folder."


def test_what_the_disk_refuses_is_told(here: Path):
    with mock.patch("pathlib.Path.mkdir", side_effect=PermissionError(errno.EACCES, os.strerror(errno.EACCES))):
        assert refused("game", "-o", "build") == "build: the folder cannot be made: Permission denied. Accepted: a folder."
    with mock.patch("os.fsync", side_effect=OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))):
        assert refused("game/run.csv").startswith("game/run.safetensors: the disk is full.")
    assert artefacts(here) == []


def test_an_artefact_is_no_table_to_compile(here: Path):
    run("compile", "game/run.csv")
    assert refused("game/run.safetensors").startswith('game/run.safetensors: a table file does not end in ".safetensors".')


def test_an_altered_artefact_is_refused_by_a_query(here: Path):
    run("compile", "game/run.csv", "-o", "r.safetensors")
    whole = (here / "r.safetensors").read_bytes()
    (here / "r.safetensors").write_bytes(whole[:-1] + bytes([whole[-1] ^ 1]))
    assert run("query", "r.safetensors", "speed=5") == Result(
        2,
        "",
        "contextdb: r.safetensors: the file was altered: its contents do not match its digest. "
        "Accepted: a file that this version of contextdb compiled. Try to compile the table again.\n",
    )
