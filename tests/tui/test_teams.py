"""Actors for the test row: how they are written and kept; rows are valid when their roles can be filled, as by brute force."""

import json
from itertools import permutations
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

import contextdb as cdb
from contextdb.errors import FileError
from contextdb.schema.settings import TableSettings
from tui.model.query_row import QueryRow
from tui.model.sheet import Sheet
from tui.model.teams import Teams, TeamSheet, roles_of, teams_path
from tui.model.why import why_row

SCHEMA = {
    "air": {"type": "bool"},
    "Defender.chart": {"type": "enum", "values": ["CB", "FS", "Half Back"]},
    "Defender.distance": {"type": "number"},
    "Receiver.tags": {"type": "tags", "values": ["InAir", "Stunned"]},
}
CELLS = {
    "air": ("Any", "True", "False"),
    "Defender.chart": ("Any", "CB", "CB FS", "FS"),
    "Defender.distance": ("Any", "0..2", "1..9"),
    "Receiver.tags": ("Any", "+InAir", "-Stunned"),
}


def made(rows: list[tuple[str, ...]], name: str = "catch") -> cdb.Table:
    columns = {"Asset": [f"a{row}" for row in range(len(rows))]}
    columns |= {name: [row[at] for row in rows] for at, name in enumerate(SCHEMA)}
    return cdb.Table.from_columns(columns, SCHEMA, TableSettings(name, asset="Asset"), name)


TABLE = made([("Any", "CB FS", "0..2", "Any"), ("True", "FS", "Any", "+InAir"), ("False", "Any", "Any", "Any")])
IVY = {"Actor": "Ivy", "chart": "CB", "distance": "1.5"}
BO = {"Actor": "Bo", "chart": '"Half Back"', "distance": "0 ± 3"}


def offered(table: cdb.Table, **teams: list[dict[str, str]]) -> QueryRow:
    query = QueryRow(table)
    query.offer(Teams(table, teams).offered)
    return query


def test_the_roles_are_the_beginnings_of_names_with_a_dot():
    assert {role: [c.name for c in found] for role, found in roles_of(TABLE).items()} == {
        "Defender": ["Defender.chart", "Defender.distance"],
        "Receiver": ["Receiver.tags"],
    }


def test_a_row_is_valid_when_somebody_fits_and_it_says_who():
    query = offered(TABLE, Defender=[BO, IVY])
    assert query.valid.tolist() == [True, False, True]
    assert query.casting(0) == {"Defender": "Ivy"}
    assert query.casting(1) == {}


def test_without_actors_the_facts_of_the_test_row_count_again():
    query = offered(TABLE, Defender=[IVY])
    query.set("Defender.chart", "FS")
    query.set("air", "False")
    assert query.valid.tolist() == [True, False, True]
    query.offer({})
    assert query.valid.tolist() == [True, False, True]
    query.set("Defender.chart", "Half Back")
    assert query.valid.tolist() == [False, False, True]


def test_one_name_in_two_teams_is_one_actor_who_plays_one_role():
    both = {"Actor": "Ivy", "chart": "FS"}
    query = offered(TABLE, Defender=[both], Receiver=[{"Actor": "Ivy", "tags": "InAir"}])
    query.set("air", "True")
    assert query.valid.tolist()[1] is False
    why = why_row(query, TABLE, 1)
    assert [cell.column for cell in why.cells if cell.is_wrong] == ["Receiver"]
    query = offered(TABLE, Defender=[both], Receiver=[{"Actor": "Kim", "tags": "InAir"}])
    query.set("air", "True")
    assert query.casting(1) == {"Defender": "Ivy", "Receiver": "Kim"}


def test_the_cells_that_keep_the_nearest_actor_from_a_role_are_marked_with_their_mend():
    query = offered(TABLE, Defender=[{"Actor": "Ivy", "chart": "CB", "distance": "5"}])
    names = [c.condition.name for c in TABLE.conditions]
    assert [names[at] for at, fails in enumerate(query.failing([0])[0]) if fails] == ["Defender.distance"]
    wrong = [cell for cell in why_row(query, TABLE, 0).cells if cell.is_wrong]
    assert [(cell.column, cell.fact) for cell in wrong] == [("Defender.distance", "5 of Ivy")]
    mended = TABLE.with_cell(0, "Defender.distance", wrong[0].mend)
    query.show(mended)
    assert query.valid[0]


def test_an_empty_fact_of_an_actor_is_not_asked_about():
    assert offered(TABLE, Defender=[{"Actor": "Ivy"}], Receiver=[{"Actor": "Kim"}]).valid.tolist() == [True, True, True]


def test_a_fact_that_cannot_be_read_is_refused_when_typed_and_told_when_pasted():
    sheet = Teams(TABLE, {}).sheets["Defender"]
    sheet.go(0, 1)
    assert "Half Back" in str(sheet.type_text("Half"))
    sheet.paste("CC\t1 to 2")
    assert [fault.split(":")[0] for fault in sheet.faults] == ["actor 1, chart", "actor 1, distance"]
    assert list(sheet.actors()[0]) == ["id", "name"]


def test_two_actors_of_one_name_are_told_and_the_first_counts():
    sheet = TeamSheet("Defender", roles_of(TABLE)["Defender"], [IVY, {**IVY, "chart": "FS"}])
    assert sheet.faults == ["Ivy appears twice among the actors for Defender."]
    assert [actor["Defender.chart"] for actor in sheet.actors()] == ["CB"]


def test_there_is_always_one_empty_row_to_write_in():
    sheet = Teams(TABLE, {"Defender": [IVY]}).sheets["Defender"]
    assert sheet.table.n_rows == 2
    sheet.go(1, 0)
    assert sheet.type_text("Bo") is None
    sheet.with_room()
    sheet.with_room()
    assert (sheet.table.n_rows, sheet.cursor) == (3, (1, 0))
    sheet.undo()
    assert [row["Actor"] for row in sheet.texts] == ["Ivy"]


def test_teams_come_back_from_their_file_as_they_were_and_a_program_can_offer_them(tmp_path: Path):
    (tmp_path / "catch.csv").write_text("Asset,Defender.chart,Defender.distance\na,CB FS,0..2\n")
    table = cdb.load(tmp_path / "catch.csv")
    path = teams_path(table)
    assert path == tmp_path / "catch.actors.json"
    teams = Teams(table, {"Defender": [{"Actor": "Ivy", "chart": "CB", "distance": "1.5"}, {"Actor": "Bo", "distance": "0 ± 3"}]})
    teams.save(path)
    assert Teams.beside(table).sheets["Defender"].texts == teams.sheets["Defender"].texts
    cast = table.compile().query({}, unknown="any", actors=json.loads(path.read_text())).casting(0)
    assert cast["Defender"]["name"] == "Ivy"
    assert cdb.Project.load(tmp_path).tables.keys() == {"catch"}


@pytest.mark.parametrize("text", ["[]", "{", '{"Defender": {}}', '{"Defender": [3]}', "\xff"])
def test_a_file_of_actors_that_is_none_is_told(tmp_path, text):
    (tmp_path / "catch.csv").write_text("Asset,Defender.chart\na,CB\n")
    (tmp_path / "catch.actors.json").write_bytes(text.encode("latin-1"))
    with pytest.raises(FileError, match=r"catch\.actors\.json"):
        Teams.beside(cdb.load(tmp_path / "catch.csv"))


def test_teams_follow_the_columns_of_the_table():
    teams = Teams(TABLE, {"Defender": [IVY]})
    assert teams.of(TABLE) is teams
    fewer = Sheet(TABLE)
    fewer.go(0, [c.name for c in TABLE.columns].index("Defender.distance"))
    fewer.delete_columns()
    assert teams.of(fewer.table).offered == {"Defender": [{"id": "Ivy", "name": "Ivy", "Defender.chart": "CB"}]}


ROWS = st.lists(st.tuples(*(st.sampled_from(cells) for cells in CELLS.values())), min_size=1, max_size=4)
DEFENDERS = st.lists(st.tuples(st.sampled_from("xyz"), st.sampled_from(("CB", "FS", "Half Back")), st.integers(0, 4)), max_size=3)
RECEIVERS = st.lists(st.tuples(st.sampled_from("xyz"), st.sampled_from(("InAir", "Stunned", "InAir Stunned"))), max_size=3)


@given(ROWS, DEFENDERS, RECEIVERS, st.sampled_from(("", "True", "False")))
def test_a_row_is_valid_exactly_when_some_casting_of_distinct_actors_fits(rows, defenders, receivers, air):
    table = made(rows)
    teams = {
        "Defender": [{"Actor": name, "chart": f'"{chart}"', "distance": str(far)} for name, chart, far in _first(defenders)],
        "Receiver": [{"Actor": name, "tags": tags} for name, tags in _first(receivers)],
    }
    query = offered(table, **teams)
    query.set("air", air)
    assert query.valid.tolist() == [_can_be_cast(table, row, teams, air) for row in range(table.n_rows)]


def _first(actors: list[tuple]) -> list[tuple]:
    return list({actor[0]: actor for actor in reversed(actors)}.values())


def _can_be_cast(table: cdb.Table, row: int, teams: dict[str, list[dict[str, str]]], air: str) -> bool:
    """Try every way to give the roles that the row constrains an actor."""
    if not any(teams.values()):
        return not air or table.text(row, "air") in ("Any", air)
    if air and table.text(row, "air") not in ("Any", air):
        return False
    needed = [role for role in teams if any(table.text(row, c.name) != "Any" for c in roles_of(table)[role])]
    everybody = [(role, actor) for role in needed for actor in teams[role]]
    for chosen in permutations(everybody, len(needed)):
        is_one_each = [role for role, _ in chosen] == needed and len({actor["Actor"] for _, actor in chosen}) == len(needed)
        if is_one_each and all(_fits(table, row, role, actor) for role, actor in chosen):
            return True
    return False


def _fits(table: cdb.Table, row: int, role: str, actor: dict[str, str]) -> bool:
    alone = QueryRow(table)
    names = [c.name for c in roles_of(table)[role]]
    alone.load({name: actor[name.partition(".")[2]] for name in names})
    return not alone.failing([row])[0].any()
