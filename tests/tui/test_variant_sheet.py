"""A variant in the editor: every row of its base is there, what is inherited is grey, and typing overrides."""

from pathlib import Path

import pytest
from hypothesis import given

from contextdb import coverage, load
from contextdb.edits.variant_rows import contracted, expanded
from contextdb.errors import TableError
from tests.test_variants import NAMES, changes_of, csv_of, project_of, rows_of
from tui.model.coverage_run import with_rows_of_file
from tui.model.problems import cell_findings
from tui.model.session import Session
from tui.model.window import Window

BASE = [("idle", "0..1", "False", "1"), ("walk", "1..3", "False", "2"), ("walk", "3..4", "", "1"), ("fall", "", "True", "1")]
OWN = [("fall", "", "", "", "True"), ("walk", "", "", "", ""), ("walk", "3..6", "", "", ""), ("smash", "9..", "", "", "")]


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    return project_of(tmp_path, BASE, OWN)


def seen(session: Session, column: str) -> list[tuple[str, str]]:
    at = [c.name for c in session.sheet.table.columns].index(column)
    window = Window(session.sheet, 0, 99)
    return [window.cell(row, at) for row in range(window.n_rows)]


def lines(folder: Path) -> list[str]:
    return (folder / "orc.csv").read_text().splitlines()


@given(rows_of, changes_of)
def test_an_expanded_table_means_the_same_and_contracts_to_its_bytes(tmp_path_factory, base, changes):
    folder = project_of(tmp_path_factory.mktemp("v"), base, changes)
    table = load(folder / "orc.csv", strict=False)
    wide = expanded(table)
    assert [list(row.values()) for row in wide.flat()] == [list(row.values()) for row in table.flat()]
    back, _ = contracted(wide)
    assert csv_of([c.name for c in back.columns], [row.values() for row in back]) == (folder / "orc.csv").read_text()


def test_every_row_of_the_base_is_there_and_what_is_inherited_is_grey(folder):
    session = Session(folder / "orc.csv")
    assert session.sheet.table.assets == ["idle", "walk", "walk", "fall", "smash"]
    assert seen(session, "speed") == [
        ("0..1", "inherited"),
        ("1..3", "inherited"),
        ("3..6", "text"),
        ("", "any"),
        ("9..", "text"),
    ]
    assert seen(session, "W")[1] == ("2", "inherited")
    assert session.sheet.enabled.tolist() == [True, True, True, False, True]
    session.close()


def test_saving_without_an_edit_leaves_the_bytes_and_typing_overrides_one_cell(folder):
    session, before = Session(folder / "orc.csv"), (folder / "orc.csv").read_bytes()
    session.save()
    assert (folder / "orc.csv").read_bytes() == before
    session.sheet.go(0, [c.name for c in session.sheet.table.columns].index("Air"))
    assert session.sheet.type_text("False") is None  # what it is: the cell follows the base further
    assert not session.sheet.is_modified
    assert session.sheet.type_text("True") is None
    session.save()
    assert lines(folder) == ["Asset,speed,Air,W,Gone", "idle,,True,,", *map(",".join, OWN)]
    assert load(folder / "orc.csv").flat()[0] == {"Asset": "idle", "speed": "0..1", "Air": "True", "W": "1"}
    session.sheet.clear()
    assert seen(session, "Air")[0] == ("False", "inherited")
    session.sheet.undo()
    assert seen(session, "Air")[0] == ("True", "text")
    session.close()


def test_the_second_of_an_asset_brings_the_first_with_it(tmp_path):
    folder = project_of(tmp_path, BASE, [])
    session = Session(folder / "orc.csv")
    session.sheet.go(2, 1)
    session.sheet.type_text("4..9")
    session.save()
    assert lines(folder)[1:] == ["walk,,,,", "walk,4..9,,,"]
    session.close()


def test_a_row_of_the_base_is_taken_out_and_a_new_one_deleted(folder):
    session = Session(folder / "orc.csv")
    session.sheet.go(0, 0)
    session.sheet.delete_rows()
    session.sheet.go(4, 0)
    session.sheet.delete_rows()
    session.save()
    assert load(folder / "orc.csv").flat().assets == ["walk", "walk"]
    assert "idle,,,,True" in lines(folder)
    session.close()


def test_rows_of_the_base_keep_their_asset_and_their_order(folder):
    session = Session(folder / "orc.csv")
    session.sheet.go(0, 0)
    fault = session.sheet.type_text("stand")
    assert fault is not None
    assert 'the row is that of "human"' in fault.message
    with pytest.raises(TableError, match='in the order of "human"'):
        session.sheet.move_rows(1)
    session.sheet.duplicate_rows()
    assert session.sheet.table.assets[-1] == "idle"
    session.sheet.go(5, 0)
    assert session.sheet.type_text("stand") is None
    session.save()
    assert load(folder / "orc.csv").flat().assets == ["idle", "walk", "walk", "smash", "stand"]
    session.close()


def test_the_test_row_asks_the_whole(folder):
    session = Session(folder / "orc.csv")
    query = session.sheet.query
    query.load({"speed": "0.5", "Air": "False"})
    assert query.bits == 0b00001
    query.load({"speed": "5", "Air": "True"})
    assert query.bits == 0b00100
    session.close()


def test_edits_survive_a_crash_and_are_not_made_on_other_rows(folder):
    session = Session(folder / "orc.csv")
    session.sheet.go(1, 1)
    session.sheet.type_text("2..3")
    session.close(keep_journal=True)
    again = Session(folder / "orc.csv")
    assert again.n_recovered == 1
    assert again.sheet.table.text(1, "speed") == "2..3"
    again.close(keep_journal=True)
    (folder / "human.csv").write_text(csv_of(NAMES, BASE[1:]))
    other = Session(folder / "orc.csv")
    assert other.n_recovered == 0
    assert other.problem is not None
    assert other.sheet.table.text(1, "speed") != "2..3"
    other.close()


def test_a_variant_without_a_base_is_edited_as_it_is(folder):
    (folder / "human.csv").unlink()
    session = Session(folder / "orc.csv")
    assert session.sheet.table.assets == [row[0] for row in OWN]
    session.sheet.go(0, 1)
    session.sheet.type_text("1..2")
    session.save()
    assert lines(folder)[1] == "fall,1..2,,,True"
    session.close()


def test_problems_are_at_the_rows_of_the_sheet(folder):
    (folder / "orc.csv").write_text((folder / "orc.csv").read_text().replace("9..", "fast").replace("3..6", "30..60"))
    session = Session(folder / "orc.csv")
    places = {(finding.rule, finding.row) for finding in cell_findings(session.sheet.table)}
    assert {("unreadable-cell", 4), ("outside-domain", 2)} <= places
    session.close()


def test_gaps_name_the_rows_of_the_sheet(folder):
    session = Session(folder / "orc.csv")
    table = session.sheet.table
    report = with_rows_of_file(coverage(table), table)
    assert {gap.nearest.row for gap in report.gaps} <= {0, 1, 2, 4}
    assert all(table.assets[gap.nearest.row] == gap.nearest.asset for gap in report.gaps)
    session.close()
