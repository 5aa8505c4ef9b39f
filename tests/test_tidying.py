"""Tidying: fewer cells, and in every context that can happen the same assets as often, and the same that may be picked."""

import random
from itertools import product
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from running import run
from strategies import examples

from contextdb.commands.tidy_command import n_cells, tidied
from contextdb.compiled.choosing import Choosing
from contextdb.compiled.table import data_of
from contextdb.tables.table import Table

SCHEMA = {
    "p": {"type": "bool"},
    "q": {"type": "bool"},
    "x": {"type": "number", "min": 0, "max": 4},
    "e": {"type": "enum", "values": ["A", "B", "C"]},
    "t": {"type": "tags", "values": ["Hot", "Wet"]},
}
CELLS = {
    "p": ["True", "False", "Any"],
    "q": ["True", "False", "Any"],
    "x": ["0..1", "(1..2]", "1..3", "2..", "..2)", "Any", "0..1 ~2"],
    "e": ["A", "B", "A B", "not A", "Any"],
    "t": ["+Hot", "-Hot", "Any"],
}
FACTS = {
    "p": [False, True],
    "q": [False, True],
    "x": [0.0, 0.5, 1.0, 1.5, 2.0, 2.5, 3.0, 4.0],
    "e": ["A", "B", "C"],
    "t": [[], ["Hot"], ["Wet"], ["Hot", "Wet"]],
}
ASSUMED = {
    "not (p and q)": lambda f: not (f["p"] and f["q"]),
    "not (p and x > 2)": lambda f: not (f["p"] and f["x"] > 2),
    "e != 'C' or q": lambda f: f["e"] != "C" or f["q"],
}


def random_table(rng: random.Random) -> Table:
    n_rows = rng.randint(1, 7)
    columns = {"Asset": [rng.choice(["walk", "run", "sit"]) for _ in range(n_rows)]}
    columns |= {name: [rng.choice(cells) for _ in range(n_rows)] for name, cells in CELLS.items()}
    columns["dmg"] = [rng.choice("112") for _ in range(n_rows)]
    columns["Rest"] = [rng.choice(["", "", "", "2"]) for _ in range(n_rows)]
    columns["On"] = [rng.choice(["True", "True", "False"]) for _ in range(n_rows)]
    for name in rng.sample(list(CELLS), 3):  # so that rows are alike
        columns[name] = [rng.choice(columns[name])] * n_rows
    settings = {"policy": rng.choice(["collect", "first", "specific", "priority"]), "outputs": ["dmg"], "enabled": "On"}
    assume = rng.sample(list(ASSUMED), rng.randrange(3))
    return Table.from_columns(columns, SCHEMA, settings | {"cooldown_turns": "Rest", "assume": assume}, "t")


def answers(table: Table, contexts: list[dict[str, object]]) -> list[tuple[list[tuple[str, str]], list[tuple[str, str]]]]:
    """In each context the assets and data of the valid rows, and of those that may be picked."""
    compiled = data_of(table.compile())
    choosing, outputs = compiled.once(Choosing.of), table.columns[[c.name for c in table.columns].index("dmg")].to_list()
    listed = []
    for context in contexts:
        rows = compiled.query(context).indices
        valid = np.zeros((1, table.n_rows), np.bool_)
        valid[0, rows] = True
        pickable = np.flatnonzero(choosing.pickable_of(valid)[0])
        listed.append(tuple(sorted((table.assets[row], outputs[row]) for row in some) for some in (rows, pickable)))
    return listed


@examples(2)
@given(st.integers(0, 2**32))
def test_the_answers_stay_the_same_and_nothing_more_can_go(seed):
    table = random_table(random.Random(seed))
    tidy = tidied(table)
    contexts = [dict(zip(FACTS, point, strict=True)) for point in product(*FACTS.values())]
    contexts = [context for context in contexts if all(ASSUMED[text](context) for text in table.settings.assume)]
    before, after = answers(table, contexts), answers(tidy, contexts)
    if table.settings.policy == "first":  # a row that never plays may go
        before, after = ([(sorted(set(valid)), picked) for valid, picked in side] for side in (before, after))
    assert after == before
    assert n_cells(tidy) <= n_cells(table)
    assert tidied(tidy) is tidy
    assert (tidy is table) == (n_cells(tidy) == n_cells(table) and tidy.n_rows == table.n_rows)


def tidy_texts(columns: dict[str, list[str]], **settings: object) -> dict[str, list[str]]:
    table = tidied(Table.from_columns(columns, SCHEMA, settings, "t"))
    return {column.name: column.to_list() for column in table.columns}


def test_ranges_and_values_of_one_asset_join():
    columns = {"Asset": ["walk", "walk", "run", "run"], "x": ["0..1", "(1..2]", "Any", "Any"], "e": ["A", "A", "B", "A C"]}
    assert tidy_texts(columns) == {"Asset": ["walk", "run"], "x": ["0..2", "Any"], "e": ["A", "Any"]}


@pytest.mark.parametrize(("policy", "n_rows"), [("collect", 2), ("priority", 2), ("first", 1), ("specific", 2)])
def test_two_chances_stay_two_where_chance_decides(policy, n_rows):
    assert len(tidy_texts({"Asset": ["walk", "walk"], "x": ["0..2", "1..3"]}, policy=policy)["Asset"]) == n_rows


def test_where_the_first_row_plays_none_is_overtaken():
    columns = {"Asset": ["walk", "run", "walk"], "x": ["0..1", "0..3", "(1..2]"]}
    assert tidy_texts(columns, policy="first") == columns
    assert tidy_texts(columns)["Asset"] == ["walk", "run"]


def test_what_is_assumed_needs_no_cell():
    columns = {"Asset": ["walk", "run"], "p": ["True", "False"], "q": ["False", "False"]}
    assert tidy_texts(columns, assume=["not (p and q)"])["q"] == ["Any", "False"]


@pytest.fixture
def game(tmp_path: Path) -> Path:
    (tmp_path / "contextdb.toml").write_text('[conditions.x]\ntype = "number"\nmin = 0\nmax = 4\n[tables.moves]\n')
    (tmp_path / "moves.csv").write_text("Asset,x\nwalk,0..1\nwalk,(1..2]\nrun,2..\n")
    return tmp_path / "moves.csv"


def test_the_command_shows_what_it_would_write_and_writes_only_that(game):
    before = game.read_text()
    shown = run("tidy", game)
    assert (shown.code, game.read_text()) == (1, before)
    assert "3 cells that say something become 2, with the same answers." in shown.lines
    written = run("tidy", game, "--write", "--json")
    assert (written.code, written.json["written"]) == (0, True)
    assert written.json["cells_saying_something"] == {"before": 3, "after": 2}
    assert game.read_text() == "Asset,x\nwalk,0..2\nrun,2..\n"
    assert run("tidy", game).code == 0


def test_rows_that_refer_to_tables_are_tidied_where_they_are(game):
    game.write_text("Asset,x\n@dive,0..1\n@dive,(1..2]\n")
    (game.parent / "dive.csv").write_text("Asset,x\nleft,Any\n")
    result = run("tidy", game)
    assert result.code == 2
    assert "rows refer to tables" in result.err
