"""Projects: a folder of tables under one contextdb.toml, and which schema a table alone belongs to."""

import os
from pathlib import Path

import polars as pl
import pytest

import contextdb as cdb
from contextdb.errors import ContextDBError, FileError, SchemaError, TableError
from contextdb.schema.settings import EMPTY
from contextdb.tables.project import Project, load_table, schema_for, table_files, twice_named

ROOT = Path(__file__).parent.parent
TOML = """
[conditions.speed]
type = "number"
[tables.jog]
asset = "Anim"
outputs = ["Slot"]
[tables.crouch]
file = "low/crouch.csv"
asset = "Anim"
outputs = ["Slot"]
"""
CSV = "Slot,Anim,speed\nL,a,1..2\n"


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """A project of two declared tables, one of them in a folder of its own."""
    folder = tmp_path / "game"
    (folder / "low").mkdir(parents=True)
    (folder / "contextdb.toml").write_text(TOML, encoding="utf-8")
    (folder / "jog.csv").write_text(CSV, encoding="utf-8")
    (folder / "low" / "crouch.csv").write_text(CSV.replace(",a,", ",c,"), encoding="utf-8")
    return folder


def refused(path: str | Path, kind: type[ContextDBError] = ContextDBError) -> list[str]:
    with pytest.raises(kind) as caught:
        Project.load(path)
    return [str(f) for f in caught.value.faults]


# ---- a folder


def test_a_project_has_every_table_that_is_declared(folder: Path):
    project = Project.load(folder)
    assert list(project.tables) == ["jog", "crouch"]
    assert project["jog"].assets == ["a"]
    assert project["crouch"].assets == ["c"]
    assert [c.condition.name for c in project["crouch"].conditions] == ["speed"]
    assert project.compile()["crouch"].query({"speed": 1.5}).assets == ["c"]


def test_the_sample_project_is_loaded_by_its_folder_or_its_file():
    project = cdb.Project.load(ROOT / "tables")
    assert list(project.tables) == ["hit_mid_air", "contested_catch", "locomotion"]
    assert project.schema.name == "gridiron"
    assert list(Project.load(str(ROOT / "tables" / "contextdb.toml")).tables) == list(project.tables)


def test_files_that_nobody_declared_are_tables_too(folder: Path):
    (folder / "b.csv").write_text(CSV, encoding="utf-8")
    pl.DataFrame({"Anim": ["p"], "speed": ["1"]}).write_parquet(folder / "a.parquet")
    project = Project.load(folder)
    assert list(project.tables) == ["jog", "crouch", "a", "b"]
    assert project["b"].assets == ["L"]  # the first column, for nothing else is said
    assert project["a"].condition("speed").condition.is_declared


def test_suffixes_are_known_in_any_case(folder: Path):
    (folder / "LOUD.CSV").write_text(CSV, encoding="utf-8")
    assert "LOUD" in Project.load(folder).tables


@pytest.mark.parametrize("name", ["jog.cases.csv", "._jog.csv", ".contextdb-0123.tmp", "notes.txt", "jog.csv.bak", "x.safetensors"])
def test_other_files_are_no_tables(folder: Path, name: str):
    (folder / name).write_bytes(b"\0not a table")
    assert list(Project.load(folder).tables) == ["jog", "crouch"]


def test_a_folder_named_like_a_table_is_none(folder: Path):
    (folder / "old.csv").mkdir()
    assert list(Project.load(folder).tables) == ["jog", "crouch"]


def test_a_declared_table_may_be_a_parquet_file(folder: Path):
    (folder / "jog.csv").unlink()
    pl.DataFrame({"Anim": ["p"], "Slot": ["L"], "speed": ["1"]}).write_parquet(folder / "jog.parquet")
    assert Project.load(folder)["jog"].assets == ["p"]


def test_a_folder_without_a_schema_or_without_tables_is_a_project(tmp_path: Path):
    assert Project.load(tmp_path).tables == {}
    (tmp_path / "t.csv").write_text("Asset,ok\na,True\n", encoding="utf-8")
    project = Project.load(tmp_path)
    assert project.schema is EMPTY
    assert project["t"].condition("ok").condition.domain.kind == "bool"


def test_a_table_that_is_not_there_is_refused_with_the_nearest(folder: Path):
    project = Project.load(folder)
    with pytest.raises(TableError) as caught:
        project["jogg"]
    assert str(caught.value) == 'there is no table "jogg". Accepted: "jog", "crouch". Did you mean "jog"?'
    with pytest.raises(TableError, match="none: the folder has no table"):
        Project(folder, EMPTY, {})["jog"]


# ---- faults


def test_all_faults_of_all_files_are_told_together(folder: Path):
    (folder / "jog.csv").write_text("Slot,Anim,speed\nL,a,fast\n", encoding="utf-8")
    (folder / "low" / "crouch.csv").unlink()
    (folder / "odd.csv").write_text("Asset\na,b\n", encoding="utf-8")
    told = refused(folder, TableError)
    assert told[0].startswith(f'{folder / "jog.csv"}, line 2, column "speed": cannot read "fast" as a number.')
    assert told[1] == f"{folder / 'low' / 'crouch.csv'}: there is no such file."
    assert told[2].startswith(f"{folder / 'odd.csv'}, line 2: found 2 fields, the header has 1.")
    assert len(told) == 3


def test_cells_that_cannot_be_read_are_kept_where_that_is_wanted(folder: Path):
    (folder / "jog.csv").write_text("Slot,Anim,speed\nL,a,fast\n", encoding="utf-8")
    project = Project.load(folder, strict=False)
    assert [f.place.row for f in project["jog"].faults] == [0]
    with pytest.raises(TableError):
        project.compile()


def test_a_declared_table_whose_file_is_missing_is_told_with_the_nearest_there_is(folder: Path):
    (folder / "jog.csv").rename(folder / "jogs.csv")
    assert refused(folder) == [f'{folder / "jog.csv"}: there is no such file. Did you mean "{folder / "jogs.csv"}"?']


def test_two_files_of_one_name_are_refused_and_neither_hides_the_other(folder: Path):
    pl.DataFrame({"Anim": ["p"], "Slot": ["L"], "speed": ["1"]}).write_parquet(folder / "jog.parquet")
    assert refused(folder, TableError) == [
        f'{folder / "jog.parquet"}: table "jog" is also defined in "{folder / "jog.csv"}". Accepted: one file for each table.'
    ]
    assert len(twice_named(list(table_files(folder, EMPTY)))) == 1


def test_a_file_whose_name_is_that_of_another_table_is_refused(folder: Path):
    (folder / "crouch.csv").write_text(CSV, encoding="utf-8")
    assert refused(folder, TableError) == [
        f'{folder / "crouch.csv"}: table "crouch" is also defined in "{folder / "low" / "crouch.csv"}". '
        "Accepted: one file for each table."
    ]


def test_a_schema_that_is_not_utf_8_is_refused_with_its_line(folder: Path):
    (folder / "contextdb.toml").write_bytes(b'[project]\nname = "caf\xe9"\n')
    file = folder / "contextdb.toml"
    assert refused(folder, SchemaError) == [
        f"{file}, line 2: the file is not UTF-8. Accepted: TOML is UTF-8. Try to save it as UTF-8."
    ]


def test_a_schema_with_a_byte_order_mark_is_read(folder: Path):
    (folder / "contextdb.toml").write_bytes(b"\xef\xbb\xbf" + TOML.encode())
    assert Project.load(folder)["jog"].assets == ["a"]


def test_a_path_that_is_no_folder_is_refused_with_the_nearest(folder: Path):
    wrong = folder.with_name("gane")
    assert refused(wrong, FileError) == [
        f'{wrong}: there is no such folder. Accepted: a folder of tables, or its contextdb.toml. Did you mean "{folder}"?'
    ]
    assert refused(folder / "jog.csv", FileError) == [
        f"{folder / 'jog.csv'}: not a folder. Accepted: a folder of tables, or its contextdb.toml."
    ]
    assert refused(folder / "no" / "such", FileError)[0].startswith(f"{folder / 'no' / 'such'}: there is no such folder.")


def test_a_missing_schema_file_is_told_as_such(folder: Path):
    (folder / "contextdb.toml").unlink()
    assert refused(folder / "contextdb.toml", FileError)[0].startswith(f"{folder / 'contextdb.toml'}: there is no such file.")


# ---- one table


@pytest.mark.parametrize("inside", [".", "low", ".."])
def test_a_table_is_read_as_the_schema_says_from_wherever_it_is_named(folder: Path, monkeypatch: pytest.MonkeyPatch, inside: str):
    here = (folder / inside).resolve()
    monkeypatch.chdir(here)
    for file in ("jog.csv", "low/crouch.csv"):
        relative = os.path.relpath(folder / file, here)
        table = load_table(Path(relative))
        assert (table.name, table.settings.outputs) == (Path(file).stem, ("Slot",))
        assert table.assets == ["a" if file == "jog.csv" else "c"]
        assert str(table.path) == relative


def test_a_schema_above_counts_only_where_it_declares_the_file(folder: Path):
    (folder / "low" / "stray.csv").write_text(CSV, encoding="utf-8")
    assert schema_for(folder / "low" / "stray.csv") == (folder / "low", EMPTY)
    assert load_table(folder / "low" / "stray.csv").settings.outputs == ()


def test_the_nearest_schema_above_is_the_one_that_counts(folder: Path):
    (folder / "low" / "deep").mkdir()
    (folder / "low" / "deep" / "crouch.csv").write_text(CSV, encoding="utf-8")
    (folder / "low" / "contextdb.toml").write_text('[tables.crouch]\nfile = "deep/crouch.csv"\nasset = "Anim"\n', encoding="utf-8")
    assert load_table(folder / "low" / "deep" / "crouch.csv").assets == ["a"]


def test_a_schema_beside_the_table_comes_before_one_above(folder: Path):
    (folder / "low" / "contextdb.toml").write_text("", encoding="utf-8")
    assert load_table(folder / "low" / "crouch.csv").settings.outputs == ()


@pytest.mark.skipif(os.name == "nt", reason="links need a privilege on Windows")
def test_a_table_that_is_a_link_is_read_as_the_schema_beside_the_link_says(folder: Path, tmp_path: Path):
    (folder / "jog.csv").rename(tmp_path / "store.csv")
    (folder / "jog.csv").symlink_to(tmp_path / "store.csv")
    assert load_table(folder / "jog.csv").settings.outputs == ("Slot",)
    (folder / "jog.csv").unlink()
    (tmp_path / "store.csv").rename(folder / "jog.csv")
    (folder / "low").rename(folder / "elsewhere")
    (folder / "low").symlink_to("elsewhere")
    assert Project.load(folder)["crouch"].settings.outputs == ("Slot",)


def test_a_table_without_any_schema_has_its_types_inferred(tmp_path: Path):
    (tmp_path / "t.csv").write_text("Asset,x\na,1..2\n", encoding="utf-8")
    table = cdb.load(str(tmp_path / "t.csv"))
    assert (table.name, table.condition("x").condition.is_declared) == ("t", False)


def test_the_likeliest_slips_of_loading_and_asking_are_refused_with_what_to_write(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    folder = tmp_path / "tables"
    folder.mkdir()
    (folder / "moves.csv").write_text("Asset,speed\nwalk,1..3\n", "utf-8")
    monkeypatch.chdir(tmp_path)
    with pytest.raises(cdb.FileError, match=r"this is a folder. .* Did you mean contextdb.Project.load\('tables'\)\?"):
        cdb.load("tables")
    for name in ("moves", "tables/moves"):
        with pytest.raises(cdb.FileError, match=r'there is no such file. .* Did you mean "tables.moves.csv"\?'):
            cdb.load(name)
    with pytest.raises(AttributeError, match=r"Table has no attribute 'query': .* Did you mean table.compile\(\).query\?"):
        cdb.load("tables/moves.csv").query({"speed": 2.0})  # type: ignore[attr-defined]
