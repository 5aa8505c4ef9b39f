"""`contextdb compile`: an artefact for each table, where it was asked for, that answers as the table does."""

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


def test_a_parquet_table_is_compiled(here: Path):
    pl.DataFrame({"Asset": ["a"], "speed": [3]}).write_parquet(here / "game" / "p.parquet")
    assert run("compile", "game/p.parquet").lines == ["game/p.safetensors"]
    assert CompiledTable.open("game/p.safetensors").query({"speed": 3}).assets == ["a"]


@pytest.mark.parametrize("name", ["../evil", "a/b", "a\\\\b"])
def test_the_name_of_a_table_never_leads_out_of_the_folder(here: Path, name: str):
    (here / "game" / "contextdb.toml").write_text(f'[tables."{name}"]\nfile = "run.csv"\n', encoding="utf-8")
    assert run("compile", "game", "-o", "build").code == 0
    assert artefacts(here) == ["build/jog.safetensors", "build/run.safetensors"]


def test_a_folder_is_compiled_into_a_folder_even_where_it_has_one_table(here: Path):
    (here / "game" / "run.csv").unlink()
    (here / "game" / "contextdb.toml").write_text(TOML.split("[tables")[0], encoding="utf-8")
    assert run("compile", "game", "-o", "build").lines == ["build/jog.safetensors"]
    assert run("compile", "game", "-o", "one.safetensors").lines == ["one.safetensors"]
    assert 'Did you mean "build_2.safetensors"?' in refused("game/jog.csv", "-o", "build_2")


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


# ---- what is refused


def test_a_name_that_no_text_of_c_can_hold_is_told_before_anything_is_written(here: Path):
    long = "x" * 4001
    (here / "game" / "run.csv").write_text(f"Asset,{long}\nrun,True\n", encoding="utf-8")
    assert "has 4,001 bytes. Accepted: names of at most 4,000 bytes" in refused("game", "--c-header", "t.h")
    assert artefacts(here) == []


def test_what_the_disk_refuses_is_told(here: Path):
    with mock.patch("pathlib.Path.mkdir", side_effect=PermissionError(errno.EACCES, os.strerror(errno.EACCES))):
        assert refused("game", "-o", "build") == "build: the folder cannot be made: Permission denied. Accepted: a folder."
    with mock.patch("os.fsync", side_effect=OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))):
        assert refused("game/run.csv").startswith("game/run.safetensors: the disk is full.")
    assert artefacts(here) == []


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
