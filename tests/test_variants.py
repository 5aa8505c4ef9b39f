"""Variants: a table whose file holds what differs from its base is that base, edited."""

import itertools

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from contextdb import Project, Table, load
from contextdb.errors import ContextDBError
from contextdb.tables.merging.merging import merge
from tests.running import run

NAMES = ("Asset", "speed", "Air", "W")
TEXTS = {"speed": ("", "Any", "0..1", "2..5", "<3"), "Air": ("", "Any", "True", "False"), "W": ("", "1", "2")}
SCHEMA = """\
[conditions.speed]
type = "number"
min = 0
max = 10

[conditions.Air]
type = "bool"

[tables.human]
asset = "Asset"
weight = "W"
policy = "first"

[tables.orc]
base = "human"
remove = "Gone"
"""
rows_of = st.lists(st.tuples(st.sampled_from("abc"), *(st.sampled_from(texts) for texts in TEXTS.values())), max_size=8)
changes_of = st.lists(
    st.tuples(
        st.sampled_from("abcd"), *(st.sampled_from(texts) for texts in TEXTS.values()), st.sampled_from(["", "True", "False"])
    ),
    max_size=8,
)


def edited_by_a_script(base, changes):
    """The oracle: the rows of the base, edited one after another; None is a row that is gone."""
    rows = [list(row) for row in base]
    places = {(asset, n): at for at, (asset, n) in enumerate(numbered(row[0] for row in base))}
    for (asset, *cells, gone), key in zip(changes, numbered(change[0] for change in changes), strict=True):
        if key in places:
            at = places[key]
            rows[at] = None if gone == "True" else [asset, *(new or old for new, old in zip(cells, rows[at][1:], strict=True))]
        elif gone != "True":
            rows.append([asset, *cells])
    return [row for row in rows if row is not None]


def numbered(assets):
    seen = []
    for asset in assets:
        yield asset, seen.count(asset)
        seen.append(asset)


def csv_of(names, rows):
    return "".join(",".join(row) + "\n" for row in (names, *rows))


def project_of(folder, base, changes, columns=(*NAMES, "Gone"), schema=SCHEMA):
    (folder / "contextdb.toml").write_text(schema)
    (folder / "human.csv").write_text(csv_of(NAMES, base))
    (folder / "orc.csv").write_text(csv_of(columns, changes))
    return folder


def table_of(rows):
    columns = {name: [row[at] for row in rows] for at, name in enumerate(NAMES)}
    schema = {"speed": {"type": "number", "min": 0, "max": 10}, "Air": {"type": "bool"}}
    return Table.from_columns(columns, schema, {"weight": "W", "policy": "first"})


def texts_of(table):
    return [list(row.values()) for row in table]


@given(rows_of, changes_of, st.permutations(range(1, 5)))
def test_a_variant_is_its_base_edited_by_a_script(tmp_path_factory, base, changes, order):
    columns = (0, *order)  # the file's columns stand in any order
    cells = [[change[at] for at in columns] for change in changes]
    folder = project_of(tmp_path_factory.mktemp("v"), base, cells, [(*NAMES, "Gone")[at] for at in columns])
    expected = edited_by_a_script(base, changes)
    flat = load(folder / "orc.csv").flat()
    assert [[row[name] for name in NAMES] for row in flat] == expected
    compiled, edited = load(folder / "orc.csv").compile(), table_of(expected).compile()
    for speed, air in itertools.product((0.5, 2.5, 4.0, 9.0), (True, False)):
        context = {"speed": speed, "Air": air}
        assert compiled.query(context).indices.tolist() == edited.query(context).indices.tolist()
        assert np.array_equal(compiled.query(context).mask, edited.query(context).mask)


@given(rows_of, changes_of, changes_of)
def test_a_variant_of_a_variant_is_edited_twice(tmp_path_factory, base, changes, more):
    folder = project_of(
        tmp_path_factory.mktemp("v"), base, changes, schema=SCHEMA + '[tables.boss]\nbase = "orc"\nremove = "Gone"\n'
    )
    (folder / "boss.csv").write_text(csv_of((*NAMES, "Gone"), more))
    expected = edited_by_a_script(edited_by_a_script(base, changes), more)
    assert [[row[name] for name in NAMES] for row in Project.load(folder)["boss"].flat()] == expected


@given(st.data())
def test_changes_of_base_and_variant_commute_where_they_touch_other_rows(tmp_path_factory, data):
    """One branch changes rows of the base, another rows of the variant: the merge of the two wholes is the whole of the merge."""
    cells = st.tuples(*(st.sampled_from(texts) for texts in TEXTS.values()))
    base = [(asset, *data.draw(cells)) for asset in "abcdef"]
    changed = [(asset, *data.draw(cells)) if asset in "ace" else row for row in base for asset in row[0]]
    changes = [(asset, *data.draw(cells), data.draw(st.sampled_from(["", "True"]))) for asset in data.draw(st.permutations("bdfg"))]
    folder = tmp_path_factory.mktemp("v")
    before, ours, theirs, both = (
        load(project_of(folder, *files) / "orc.csv").flat()
        for files in ((base, []), (changed, []), (base, changes), (changed, changes))
    )
    for merged in (merge(before, ours, theirs), merge(before, theirs, ours)):
        assert not merged.conflicts
        assert texts_of(merged.table) == texts_of(both)


def test_what_a_variant_leaves_out_is_that_of_its_base(tmp_path):
    base = [("walk", "0..2", "False", "2"), ("fall", "", "True", "1")]
    folder = project_of(tmp_path, base, [("walk", "0..3")], ("Asset", "speed"), SCHEMA.replace('remove = "Gone"\n', ""))
    table = load(folder / "orc.csv")
    assert texts_of(table.flat()) == [["walk", "0..3", "False", "2"], ["fall", "", "True", "1"]]
    assert table.flat().row_weights.tolist() == [2.0, 1.0]
    assert table.flat().settings.policy == "first"
    assert str(table.flat().place(0, "speed")) == f'{folder / "orc.csv"}, line 2, column "speed"'
    assert str(table.flat().place(0, "Air")) == f'{folder / "human.csv"}, line 2, column "Air"'
    assert table.save().source.raw == (folder / "orc.csv").read_bytes() == b"Asset,speed\nwalk,0..3\n"


def test_rows_of_inner_tables_are_inherited_too(tmp_path):
    folder = project_of(tmp_path, [("@dive", "0..2", "", ""), ("fall", "", "True", "")], [("fall", "", "", "", "True")])
    (folder / "dive.csv").write_text("Asset,Air\nd1,True\nd2,False\n")
    (folder / "all.csv").write_text("Asset,Air\n@orc,\n")
    assert load(folder / "orc.csv").flat().assets == ["orc/dive/d1", "orc/dive/d2"]
    assert load(folder / "all.csv").flat().assets == ["all/orc/dive/d1", "all/orc/dive/d2"]
    assert load(folder / "all.csv").compile().query({"speed": 1, "Air": True}).assets == ["all/orc/dive/d1"]


@pytest.mark.parametrize(
    ("schema", "words"),
    [
        (SCHEMA.replace('base = "human"', 'base = "humn"'), ('base = "humn": there is no such table.', 'Did you mean "human"?')),
        (SCHEMA.replace("[tables.human]", '[tables.human]\nbase = "orc"'), ("is a variant of itself: ", "human > orc > human")),
        (SCHEMA.replace('base = "human"', 'base = "orc"'), ("orc > orc",)),
        (SCHEMA.replace('base = "human"', "base = 5"), ("[tables.orc] base = 5: this is a number, not text",)),
        (SCHEMA.replace('"Gone"', '"Gon"'), ('there is no column "Gon"', "names as remove")),
    ],
)
def test_a_base_that_cannot_be_used_is_an_error(tmp_path, schema, words):
    folder = project_of(tmp_path, [("walk", "0..2", "", "")], [("walk", "", "", "", "")], schema=schema)
    with pytest.raises(ContextDBError) as error:
        Project.load(folder)
    assert all(word in str(error.value) for word in words), str(error.value)


def test_cells_of_the_base_that_cannot_be_read_are_reported_at_their_place(tmp_path):
    folder = project_of(tmp_path, [("walk", "quick", "", "")], [("walk", "", "True", "", "")])
    with pytest.raises(ContextDBError, match=r'human\.csv, line 2, column "speed"'):
        load(folder / "orc.csv").compile()
    (folder / "orc.csv").write_text(csv_of((*NAMES, "Gone"), [("walk", "1..2", "", "", "")]))
    assert load(folder / "orc.csv").compile().query({"speed": 1, "Air": True}).assets == ["walk"]


def test_check_reports_what_a_base_has_once(tmp_path):
    base = [("walk", "0..2", "", ""), ("walk", "0..1", "", ""), ("fly", "20..30", "", "")]
    own = [("walk", "", "True", "", ""), ("walk", "0..3", "", "", ""), ("land", "40..50", "", "", "")]
    folder = project_of(tmp_path, base, own)
    out = run("check", folder, "--format", "json").out
    assert out.count('"outside-domain"') == 2
    assert out.count('"duplicate-asset"') == 1
    assert run("check", folder).code == 0


def test_merging_the_file_of_a_variant_needs_no_base(tmp_path):
    folder = project_of(tmp_path, [("walk", "0..2", "", "1"), ("run", "2..5", "", "1")], [("walk", "0..1", "", "", "")])
    base = load(folder / "orc.csv")
    ours, theirs = base.with_cell(0, "Air", "True"), base.with_rows(1, [{"Asset": "run", "speed": "3..5"}])
    one, other = merge(base, ours, theirs).table, merge(base, theirs, ours).table
    assert texts_of(one.flat()) == texts_of(other.flat()) == [["walk", "0..1", "True", "1"], ["run", "3..5", "", "1"]]


def test_saved_contexts_are_counted_against_all_rows(tmp_path):
    folder = project_of(tmp_path, [("walk", "0..2", "", ""), ("fall", "", "True", "")], [("fall", "", "", "", "True")])
    (folder / "orc.cases.csv").write_text("Case,Expected,speed,Air\nslow,walk,1,False\n")
    done = run("cases", folder / "orc.csv", "--json").json
    assert (done["rows"], done["rows_reached"], done["rows_without_case"]) == (1, 1, [])


def test_an_index_lists_all_rows_with_their_files_and_moments(tmp_path):
    import polars as pl

    folder = project_of(
        tmp_path, [("walk", "0..2", "", ""), ("fall", "", "True", "")], [("fall", "", "", "", "True"), ("fly", "", "True", "", "")]
    )
    (tmp_path / "seen").mkdir()
    (tmp_path / "seen" / "a.csv").write_text("speed,Air\n1,True\n1,False\n9,True\n")
    assert run("index", folder, "--out", tmp_path / "seen" / "rows.parquet", "--telemetry", tmp_path / "seen" / "a.csv").code == 0
    rows = pl.read_parquet(tmp_path / "seen" / "rows.parquet").filter(pl.col("table") == "orc")
    assert rows.select("asset", "file", "line", "moments").rows() == [("walk", "human.csv", 2, 2), ("fly", "orc.csv", 3, 2)]


def test_who_answers_is_named_in_the_report(tmp_path):
    folder = project_of(
        tmp_path, [("walk", "0..2", "", "")], [], schema=SCHEMA.replace("[tables.human]", '[tables.human]\nowner = "combat"')
    )
    assert run("coverage", folder / "human.csv").lines[0].endswith("; owned by combat")
    assert "owned" not in run("coverage", folder / "orc.csv").lines[0]
