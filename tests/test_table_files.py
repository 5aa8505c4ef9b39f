"""A table is renamed, copied or deleted with the files beside it, and with what refers to it."""

from pathlib import Path

import pytest

import contextdb as cdb
from contextdb.edits.table_files import copy_table, delete_table, rename_table
from contextdb.errors import FileError, TableError
from contextdb.tables.project import read_folder_schema

TOML = """# of the house
[tables.dive]
policy = "first"   # the first

[tables.moves]
fallback = "idle"

[contracts.some]
table = "dive"
when = "speed > 1"
some = "asset like 'd*'"
"""


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    (tmp_path / "contextdb.toml").write_text(TOML)
    (tmp_path / "dive.csv").write_text("Asset,speed\nd1,Any\n")
    (tmp_path / "dive.cases.csv").write_text("Case,speed,Expected\nslow,1,d1\n")
    (tmp_path / "dive.notes.csv").write_text("Asset,Column,Note,Colour\nd1,,,red\n")
    (tmp_path / "moves.csv").write_bytes(b'Asset,speed\r\nwalk,2\r\n"@dive",3\r\n')
    return tmp_path


def names(folder: Path) -> set[str]:
    return {path.name for path in folder.iterdir() if path.is_file()}


def test_a_rename_takes_along_files_beside_it_its_section_contracts_and_rows_that_refer_to_it(folder: Path) -> None:
    assert rename_table(folder, "dive", "plunge") == folder / "plunge.csv"
    assert names(folder) == {"contextdb.toml", "plunge.csv", "plunge.cases.csv", "plunge.notes.csv", "moves.csv"}
    assert (folder / "contextdb.toml").read_text() == TOML.replace("dive", "plunge")
    assert (folder / "moves.csv").read_bytes() == b'Asset,speed\r\nwalk,2\r\n"@plunge",3\r\n'
    assert cdb.load(folder / "moves.csv").compile().query({"speed": 3}).assets == ["moves/plunge/d1"]


def test_a_copy_has_the_settings_and_saved_contexts_and_the_old_table_stays(folder: Path) -> None:
    before = {path.name: path.read_bytes() for path in folder.iterdir() if path.is_file() and path.name != "contextdb.toml"}
    copy_table(folder, "dive", "other")
    assert {name: (folder / name).read_bytes() for name in before} == before
    assert (folder / "other.csv").read_bytes() == before["dive.csv"]
    assert (folder / "other.cases.csv").read_bytes() == before["dive.cases.csv"]
    tables = read_folder_schema(folder).tables
    assert tables["other"].policy == tables["dive"].policy == "first"


def test_a_name_that_is_taken_changes_nothing(folder: Path) -> None:
    before = {path.name: path.read_bytes() for path in folder.iterdir() if path.is_file()}
    with pytest.raises((TableError, FileError)):
        rename_table(folder, "dive", "moves")
    assert {path.name: path.read_bytes() for path in folder.iterdir() if path.is_file()} == before


def test_a_table_that_rows_refer_to_is_not_deleted(folder: Path) -> None:
    with pytest.raises(TableError, match="moves"):
        delete_table(folder, "dive")
    assert (folder / "dive.csv").exists()


def test_delete_removes_the_files_beside_it_and_its_section(folder: Path) -> None:
    delete_table(folder, "moves")
    assert names(folder) == {"contextdb.toml", "dive.csv", "dive.cases.csv", "dive.notes.csv"}
    assert "moves" not in (folder / "contextdb.toml").read_text()
