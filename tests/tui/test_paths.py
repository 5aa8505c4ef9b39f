"""Names of files as one types them."""

from pathlib import Path

import pytest

from tui.model.paths import common_start, completions, resolved

ENDS = (".csv", ".parquet")


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    for name in ("walk.csv", "Walk2.PARQUET", "notes.txt", ".hidden.csv", "deep/run.csv", "deep/er/x.csv"):
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).write_text("")
    return tmp_path


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("", ["deep/", "walk.csv", "Walk2.PARQUET"]),
        ("wa", ["walk.csv", "Walk2.PARQUET"]),
        ("WALK2", ["Walk2.PARQUET"]),
        ("deep/", ["deep/er/", "deep/run.csv"]),
        ("./deep/r", ["./deep/run.csv"]),
        (".", [".hidden.csv"]),
        ("none/", []),
        ("walk.csv/", []),
        ("a\0b/", []),
    ],
)
def test_folders_and_files_that_a_path_may_go_on_to_be(folder: Path, text: str, expected: list[str]):
    assert completions(text, folder, ENDS) == expected


def test_an_absolute_path_is_completed_as_it_is_written(folder: Path):
    assert completions(f"{folder}/deep/r", Path("elsewhere"), ENDS) == [f"{folder}/deep/run.csv"]
    assert resolved(f" {folder}/walk.csv ", Path("elsewhere")) == folder / "walk.csv"


def test_only_what_is_certain_is_completed():
    assert common_start(["walk.csv", "walk2.csv"], "w") == "walk"
    assert common_start(["Walk.csv"], "wa") == "Walk.csv"
    assert common_start(["a", "b"], "") == ""
    assert common_start([], "x") == "x"
