"""A folder of tables: which there are, what they are called, and which are open."""

import os
from pathlib import Path

import pytest

from contextdb.errors import ContextDBError, SchemaError
from tui.model.beginning import Beginning
from tui.model.visible_columns import VisibleColumns
from tui.model.workspace import Workspace

RAW = "Asset,hit\nwalk,True\n"


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    for name in ("b.csv", "a.csv"):
        (tmp_path / name).write_text(RAW)
    return tmp_path


def test_a_folder_holds_its_tables_by_name(folder):
    space = Workspace(folder)
    assert sorted(space.files) == ["a", "b"]
    assert space.first in space.files


def test_cases_files_are_no_tables(folder):
    (folder / "a.cases.csv").write_text("Case,Expected,hit\none,walk,True\n")
    assert sorted(Workspace(folder).files) == ["a", "b"]


def test_a_file_opens_its_folder_with_that_table_first(folder):
    space = Workspace(folder / "b.csv")
    assert space.first == "b"
    assert sorted(space.files) == ["a", "b"]


def test_the_names_of_contextdb_toml_come_first_and_name_the_files(folder):
    (folder / "contextdb.toml").write_text('[tables.moves]\nfile = "b.csv"\n')
    space = Workspace(folder / "b.csv")
    assert space.first == "moves"
    assert list(space.files) == ["moves", "a"]


def test_a_table_is_found_by_its_name_in_the_project(folder, monkeypatch):
    (folder / "contextdb.toml").write_text('[tables.moves]\nfile = "b.csv"\n')
    monkeypatch.chdir(folder)
    assert Workspace("moves").first == "moves"


def test_without_a_path_the_tables_of_the_folder_tables_are_taken(folder, monkeypatch):
    (folder / "tables").mkdir()
    (folder / "tables" / "c.csv").write_text(RAW)
    monkeypatch.chdir(folder)
    assert list(Workspace().files) == ["c"]


def test_without_a_path_and_without_a_folder_tables_those_that_are_here_are_taken(folder, monkeypatch):
    monkeypatch.chdir(folder)
    assert sorted(Workspace().files) == ["a", "b"]


def test_two_tables_of_one_name_are_one_and_the_csv_is_the_one(folder):
    from contextdb.tables.project import load

    load(folder / "a.csv").save(folder / "a.parquet")
    space = Workspace(folder)
    assert sorted(space.files) == ["a", "b"]
    assert space.files["a"].suffix == ".csv"


def test_a_file_whose_name_another_has_is_still_the_one_that_opens(folder):
    from contextdb.tables.project import load

    load(folder / "a.csv").save(folder / "a.parquet")
    space = Workspace(folder / "a.parquet")
    assert space.files[space.first].suffix == ".parquet"


@pytest.mark.skipif(os.name == "nt", reason="links need rights there")
def test_a_link_opens_the_table_that_it_leads_to(folder):
    (folder / "link.csv").symlink_to(folder / "b.csv")
    space = Workspace(folder / "link.csv")
    assert space.files[space.first].resolve() == (folder / "b.csv").resolve()


def test_an_empty_folder_is_one_to_begin_in(tmp_path):
    space = Workspace(tmp_path)
    assert (space.first, space.beginning) == ("", Beginning(tmp_path))


@pytest.mark.parametrize("name", ["nowhere", "nowhere.csv"])
def test_a_name_that_does_not_exist_is_one_to_begin_with(tmp_path, monkeypatch, name):
    monkeypatch.chdir(tmp_path)
    assert Workspace(name).beginning == Beginning(Path(), "nowhere")


@pytest.mark.parametrize("name", ["no/such/table.csv", "nowhere.xlsx", "nowhere.txt"])
def test_what_is_not_there_is_named(tmp_path, monkeypatch, name):
    monkeypatch.chdir(tmp_path)
    with pytest.raises(ContextDBError):
        Workspace(name)


@pytest.mark.parametrize("text", ["[tables", "[tables.a]\nfile = 3\n", "[conditions.hit]\ntype = 'nonsense'\n"])
def test_a_broken_contextdb_toml_is_refused_with_its_place(folder, text):
    (folder / "contextdb.toml").write_text(text)
    with pytest.raises(SchemaError, match=r"contextdb\.toml"):
        Workspace(folder / "a.csv")


def test_a_table_stays_open_with_its_edits(folder):
    space = Workspace(folder)
    space.session("a").sheet.type_text("run")
    assert space.session("a").sheet.text(0, 0) == "run"
    assert space.unsaved == ["a"]
    space.close()


def test_a_table_opened_anew_is_as_the_file_says(folder):
    space = Workspace(folder)
    space.session("a").sheet.type_text("run")
    assert space.reopen("a").sheet.text(0, 0) == "walk"
    assert space.unsaved == []
    space.close()


def test_looking_again_takes_in_new_tables_and_keeps_the_open_ones(folder):
    space = Workspace(folder)
    space.session("a").sheet.type_text("run")
    (folder / "c.csv").write_text(RAW)
    (folder / "b.csv").unlink()
    space.look_again()
    assert sorted(space.files) == ["a", "c"]
    assert space.unsaved == ["a"]
    space.close()


def test_looking_again_keeps_a_table_that_is_open_and_gone_from_the_disk(folder):
    space = Workspace(folder)
    space.session("b")
    (folder / "b.csv").unlink()
    space.look_again()
    assert "b" in space.files
    space.close()


def test_a_contextdb_toml_that_breaks_while_tables_are_open_is_told_and_loses_nothing(folder):
    space = Workspace(folder)
    space.session("a").sheet.type_text("run")
    (folder / "contextdb.toml").write_text("[tables")
    with pytest.raises(SchemaError):
        space.look_again()
    assert sorted(space.files) == ["a", "b"]
    assert space.unsaved == ["a"]
    space.close()


def test_a_table_that_is_held_elsewhere_keeps_its_columns_when_it_is_taken_over(folder):
    holder, space = Workspace(folder), Workspace(folder)
    holder.session("a")
    hidden = VisibleColumns(frozenset(["hit"]))
    space.session("a").sheet.show_columns(hidden)
    assert space.session("a").is_read_only
    assert space.reopen("a", takes_over=True).sheet.visible_columns == hidden
