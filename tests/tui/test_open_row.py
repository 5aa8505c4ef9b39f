"""Going into the table that a row stands for, and back to the row."""

from pathlib import Path

import pytest

from tui.model.session import Session


@pytest.fixture
def path(tmp_path: Path) -> Path:
    (tmp_path / "dive.csv").write_text("Asset,speed\nlow,0..3\nhigh,4..9\n")
    file = tmp_path / "moves.csv"
    file.write_text("Asset,speed\nrun,0..9\n@dive,0..9\n@gone,Any\nwalk,0..2\n")
    return file


def place(app) -> tuple[str, tuple[int, int]]:
    return app.main.table_name, app.main.session.sheet.cursor


def test_a_table_brought_back_after_a_crash_still_knows_the_tables_inside(path, monkeypatch):
    monkeypatch.setenv("XDG_STATE_HOME", str(path.parent))
    session = Session(path)
    session.sheet.go(0, 1)
    assert session.sheet.type_text("1..2") is None
    session.close(keep_journal=True)
    other = path.with_name("written.csv")  # as others write: a new file in the place of the old one
    other.write_text(path.read_text().replace("walk,0..2", "walk,0..3"))
    other.replace(path)

    again = Session(path)
    assert again.n_recovered == 1
    assert again.sheet.query.inside(1).text == "2 rows"
    again.close()
