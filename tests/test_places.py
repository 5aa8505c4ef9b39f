"""What TABLE means on the command line: a path, a name, a folder of one table, an artefact."""

from pathlib import Path

import pytest

from contextdb.errors import ContextDBError, FileError, TableError
from contextdb.tables.places import open_compiled, table_path

TOML = '[conditions.speed]\ntype = "number"\n[tables.walking]\nfile = "walk.csv"\n'
CSV = "Asset,speed\na,1..2\n"


@pytest.fixture
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A working folder with a project in tables/: `walking`, whose file is walk.csv, and `jog`."""
    (tmp_path / "tables").mkdir()
    (tmp_path / "tables" / "contextdb.toml").write_text(TOML, encoding="utf-8")
    (tmp_path / "tables" / "walk.csv").write_text(CSV, encoding="utf-8")
    (tmp_path / "tables" / "jog.csv").write_text(CSV, encoding="utf-8")
    monkeypatch.chdir(tmp_path)
    return tmp_path


def refused(text: str, kind: type[ContextDBError] = FileError) -> str:
    with pytest.raises(kind) as caught:
        table_path(text)
    return str(caught.value)


def test_a_path_is_the_file(here: Path):
    assert table_path("tables/walk.csv") == Path("tables/walk.csv")
    assert table_path(str(here / "tables" / "walk.csv")) == here / "tables" / "walk.csv"


@pytest.mark.parametrize("name", ["walking", "jog"])
def test_a_name_is_that_of_a_table_of_the_project_in_tables(here: Path, name: str):
    assert open_compiled(name).name == name


def test_a_name_is_that_of_a_table_of_the_project_here(here: Path, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.chdir(here / "tables")
    assert table_path("walking") == Path("walk.csv")


def test_the_project_here_comes_before_the_one_in_tables(here: Path):
    (here / "contextdb.toml").write_text("", encoding="utf-8")
    (here / "jog.csv").write_text(CSV, encoding="utf-8")
    assert table_path("jog") == Path("jog.csv")
    assert table_path("walking") == Path("tables/walk.csv")


def test_a_file_comes_before_a_table_of_its_name(here: Path):
    (here / "walking").write_text(CSV, encoding="utf-8")
    assert table_path("walking") == Path("walking")


def test_tables_of_a_folder_without_a_schema_have_no_names_here(here: Path):
    (here / "run.csv").write_text(CSV, encoding="utf-8")
    assert 'Did you mean "run.csv"?' in refused("run")


def test_a_folder_of_one_table_is_that_table(here: Path):
    (here / "one").mkdir()
    (here / "one" / "crouch.csv").write_text(CSV, encoding="utf-8")
    assert table_path("one") == Path("one/crouch.csv")


def test_a_folder_of_several_tables_is_refused_with_their_paths(here: Path):
    assert refused("tables", TableError) == (
        'tables: the folder holds 2 tables; one is wanted. Accepted: "tables/walk.csv", "tables/jog.csv".'
    )


def test_a_folder_without_a_table_is_refused(here: Path):
    (here / "none").mkdir()
    assert refused("none", TableError) == (
        "none: the folder holds 0 tables; one is wanted. Accepted: a folder that holds a .csv or .parquet file."
    )


def test_an_artefact_is_opened_and_a_table_compiled(here: Path):
    open_compiled("walking").save("walk.safetensors")
    opened = open_compiled("walk.safetensors")
    assert (opened.name, opened.query({"speed": 1.5}).assets) == ("walking", ["a"])


@pytest.mark.parametrize(
    ("wrong", "near"),
    [
        ("walkng", "walking"),
        ("WALKING", "walking"),
        ("tables/wakl.csv", "tables/walk.csv"),
        ("tabels/walk.csv", "tables/walk.csv"),
        ("tables/walk", "tables/walk.csv"),
        ("build/walk.safetensor", "build/walk.safetensors"),
    ],
)
def test_a_misspelt_table_is_named_with_the_nearest_there_is(here: Path, wrong: str, near: str):
    (here / "build").mkdir()
    (here / "build" / "walk.safetensors").touch()
    assert refused(wrong) == (
        f"{wrong}: there is no such table. Accepted: a file, a folder of one table, or the name of a table of the project. "
        f'Did you mean "{near}"?'
    )


def test_a_table_that_is_like_no_other_is_refused_without_a_guess(here: Path):
    assert (
        refused("zzz")
        == "zzz: there is no such table. Accepted: a file, a folder of one table, or the name of a table of the project."
    )


def test_a_sample_table_that_is_not_here_is_offered_where_no_checkout_is(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.chdir(tmp_path)
    assert refused("locomotion").endswith("Try to make the sample tables with contextdb demo --keep FOLDER.")


def test_a_name_that_two_files_have_is_refused(here: Path):
    (here / "tables" / "walking.csv").write_text(CSV, encoding="utf-8")
    assert refused("walking", TableError) == (
        'tables/walking.csv: table "walking" is also defined in "tables/walk.csv". Accepted: one file for each table.'
    )
    assert table_path("jog") == Path("tables/jog.csv")


def test_a_schema_that_cannot_be_read_is_told_when_a_name_is_looked_up(here: Path):
    (here / "tables" / "contextdb.toml").write_text("[conditions.speed]\n", encoding="utf-8")
    with pytest.raises(ContextDBError, match=r"\[conditions.speed\] has no type"):
        table_path("walking")


@pytest.mark.parametrize("text", ["a\0b", "x" * 5000, "x" * 300 + "/" + "y" * 300, "\n", "~nobody/t.csv", "../" * 50 + "t"])
def test_odd_texts_are_no_tables(here: Path, text: str):
    assert "there is no such table" in refused(text)


def test_a_misspelt_folder_of_tables_is_offered(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    (tmp_path / "tables").mkdir()
    (tmp_path / "tables" / "contextdb.toml").write_text("", "utf-8")
    monkeypatch.chdir(tmp_path)
    with pytest.raises(FileError, match=r'Did you mean "tables"\?'):
        table_path("tabels")
