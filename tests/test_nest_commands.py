"""Tables inside tables: what commands print of them, and edits, hot reload and motion searches."""

from pathlib import Path

import numpy as np
from nested_files import AIR, DIVE, TACKLE, write
from running import run

import contextdb as cdb
from contextdb import motion
from contextdb.compiled.table import data_of
from contextdb.tables.nesting.flat import FlatTable

# ---- commands


def test_a_diff_of_a_row_that_stands_for_another_table_tells_what_that_does(tmp_path: Path):
    for name in ("a", "b"):
        (tmp_path / name).mkdir()
    write(tmp_path / "a", low="Asset,speed\nLow,..1\n")
    write(tmp_path / "b", tackle=TACKLE.replace("@dive", "@low"), low="Asset,speed\nLow,..1\n")
    found = run("diff", tmp_path / "a" / "tackle.csv", tmp_path / "b" / "tackle.csv", "--json").json
    assert [(row["before"], row["after"]) for row in found["rows"]["renamed"]] == [("@dive", "@low")]
    changed = {reach["asset"]: (reach["before"] > 0, reach["after"] > 0) for reach in found["effects"]["assets"]}
    assert changed["tackle/dive/Left"] == (True, False)


def test_a_folder_measures_an_inner_table_once_where_it_stands(tmp_path: Path):
    write(tmp_path)
    document = run("coverage", tmp_path, "--json").json
    assert [(t["table"], t["rows"]) for t in document["tables"]] == [("tackle", 5)]
    assert [t["table"] for t in run("coverage", tmp_path / "dive.csv", "--json").json["tables"]] == ["dive"]


def test_commands_answer_with_paths_and_files_inside_a_compiled_file_too(tmp_path: Path):
    write(tmp_path)
    facts = ("in_air=true", "speed=5")
    expected = [
        {"row": 1, "asset": "tackle/dive/Left", "always": True, "chance": 0.25},
        {"row": 2, "asset": "tackle/dive/Right", "always": True, "chance": 0.75},
    ]
    asked = run("query", tmp_path / "tackle.csv", *facts, "--json").json
    outranked = {"chance": 0.0, "not_picked": "outranked by @dive (an earlier row)"}
    assert asked["matches"] == [*expected, {"row": 4, "asset": "Fall", "always": True, **outranked}]
    assert run("compile", tmp_path, "-o", tmp_path / "out").code == 0
    assert run("query", tmp_path / "out" / "tackle.safetensors", *facts, "--json").json == asked
    told = run("query", tmp_path / "out" / "tackle.safetensors", "in_air=true", "speed=2.5", "--explain", "--json").json["explain"]
    assert {f["in"] for row in told for f in row["failures"]} == {
        "tackle.csv, line 2",
        "tackle.csv, line 3",
        "dive.csv, line 3",
        "dive.csv, line 4",
    }
    (tmp_path / "facts.csv").write_text("in_air,speed\ntrue,5\n")
    lines = run("evaluate", tmp_path / "tackle.csv", tmp_path / "facts.csv").out
    assert "tackle/dive/Right" in lines


def test_a_diff_names_the_row_by_what_its_cell_says_and_measures_what_it_holds(tmp_path: Path):
    for name in ("a", "b"):
        (tmp_path / name).mkdir()
        write(tmp_path / name)
    write(tmp_path / "b", tackle=TACKLE.replace("3..", "5.."))
    found = run("diff", tmp_path / "a" / "tackle.csv", tmp_path / "b" / "tackle.csv", "--json").json
    assert [c["asset"] for c in found["cells"]] == ["@dive"]
    assert {a["asset"] for a in found["effects"]["assets"]} == {"tackle/dive/Left", "tackle/dive/Right"}


def test_coverage_says_in_which_file_a_row_of_an_inner_table_stands(tmp_path: Path):
    dive = "Asset,Weight,speed\nLeft,1,..8\nTwin,1,..8\nSlow,1,4..6\n"
    write(tmp_path, tackle="Asset,in_air,speed\nHit,False,..2\n@dive,True,3..\n", dive=dive)
    said = " ".join(run("coverage", tmp_path / "tackle.csv").out.split())
    assert "line 3 tackle/dive/Twin in dive.csv" in said
    assert "nothing plays; Hit (line 2) would, with speed" in said
    assert "nothing plays; tackle/dive/Left (line 2 of dive.csv) would, with speed" in said
    assert "Hit in" not in said
    told = run("coverage", tmp_path / "tackle.csv", "--explain", "tackle/dive/Twin").out
    assert told.startswith("line 3 tackle/dive/Twin in dive.csv of tackle (row 3)\n")
    findings = run("coverage", tmp_path / "tackle.csv", "--json").json["tables"][0]["findings"]
    assert f"line 2 of {tmp_path / 'dive.csv'} (" in next(f["message"] for f in findings if f["rule"] == "identical-rows")


def test_rows_inside_a_row_whose_rule_never_holds_cover_nothing(tmp_path: Path):
    tackle = "Asset,in_air,speed,When\nHit,False,Any,\n@dive,True,Any,in_air and speed > 10\n"
    write(tmp_path, tackle=tackle)
    toml = tmp_path / "contextdb.toml"
    toml.write_text(toml.read_text().replace("[tables.tackle]", '[tables.tackle]\nwhen = "When"'))
    table = run("coverage", tmp_path, "--json").json["tables"][0]
    assert (table["covered"]["value"], table["hits"]) == (0.5, [0.5, 0.0, 0.0, 0.0])
    assert [gap["cells"] for gap in table["gaps"]["items"]] == [{"in_air": "True"}]


# ---- edits, watch, motion


def test_an_edit_of_the_outer_table_compiles_only_what_it_changed(tmp_path: Path):
    before = cdb.load(write(tmp_path) / "tackle.csv")
    first, second = before.compile(), before.with_cell(0, "speed", "1").compile()
    at = data_of(first).places["in_air"]
    assert data_of(second).masks[at] is data_of(first).masks[at]
    assert data_of(second).masks[data_of(first).places["speed"]] is not data_of(first).masks[data_of(first).places["speed"]]
    third = before.with_cell(0, "Asset", "@dive").compile()
    assert third.n_rows == first.n_rows + 2


def test_a_project_with_another_version_of_an_inner_table_answers_with_it(tmp_path: Path):
    project = cdb.Project.load(write(tmp_path))
    edited = project.with_table(project["dive"].with_cell(0, "speed", "9.."))
    assert project["tackle"].compile().query(AIR).leaves == ["Left", "Right", "Fall"]
    assert edited["tackle"].compile().query(AIR).leaves == ["Right", "Fall"]
    assert edited.inner == {"dive"}


def test_a_change_of_an_inner_table_reloads_the_outer_ones_alone(tmp_path: Path):
    write(tmp_path, other="Asset,speed\nx,1\n")
    now, changes, errors = [0.0], [], []
    watch = cdb.watch(tmp_path, changes.append, errors.append, poll_s=None, clock=lambda: now[0])
    before = watch.snapshot()

    def look(text: str) -> None:
        (tmp_path / "dive.csv").write_text(text, newline="")
        for _ in range(6):
            now[0] += 0.06
            watch.poll()

    look(DIVE.replace("..8", "..1"))
    assert [set(s.changed) for s in changes] == [{"tackle", "dive"}]
    assert watch["tackle"].query(AIR).leaves == ["Right", "Fall"]
    assert before["tackle"].query(AIR).leaves == ["Left", "Right", "Fall"]
    assert watch["other"] is before["other"]
    assert data_of(watch["tackle"]).masks[0] is data_of(before["tackle"]).masks[0]
    look("Asset,Weight,speed\n@tackle,1,Any\n")
    assert watch["tackle"].query(AIR).leaves == ["Right", "Fall"]
    assert [f.rule for e in errors for f in e.faults] == ["cyclic-tables", "cyclic-tables"]


def test_a_motion_search_finds_the_clips_of_rows_inside(tmp_path: Path):
    table = cdb.load(write(tmp_path) / "tackle.csv")
    features = np.arange(8, dtype=np.float32).reshape(4, 2)
    database = motion.MotionDatabase.from_features(features, [0, 1, 2, 3], [1, 2, 3, 4], ["Hit", "Left", "Right", "Fall"])
    hit = database.search(features[0], valid=table.compile().query({"in_air": True, "speed": 9.0}))
    assert hit.asset == "Right"


def test_a_flat_table_cannot_be_saved_over_the_table_that_it_comes_from(tmp_path: Path):
    flat = cdb.load(write(tmp_path) / "tackle.csv").flat()
    assert isinstance(flat, FlatTable)
    assert not hasattr(flat, "save")


def test_a_merge_looks_at_the_meaning_with_the_rows_inside(tmp_path: Path):
    write(tmp_path, dive="Asset,Weight,speed\nLeft,1,..8\nRight,3,4..\n")
    base = "Asset,in_air,speed\nHit,False,Any\n@dive,True,Any\nFall,True,Any\n"
    versions = {
        "base": base,
        "ours": base.replace("Fall,True,Any\n", ""),
        "theirs": base.replace("@dive,True,Any", "@dive,True,3.."),
    }
    for name, text in versions.items():
        (tmp_path / name).write_text(text, newline="")
    done = run("merge", tmp_path / "base", tmp_path / "ours", tmp_path / "theirs", "--path", tmp_path / "tackle.csv")
    assert done.code == 0
    assert "a gap that neither side had: in_air: True, speed: [0..3)" in done.err


def test_saved_contexts_expect_rows_inside_by_their_paths_and_know_conditions_of_inner_tables(tmp_path: Path):
    write(tmp_path, dive="Asset,Weight,style\nLeft,1,5\nRight,1,6\n")
    cases = (
        "Case,Expected,in_air,speed,style\nleft,+tackle/dive/Left -tackle/dive/Right,True,5,5\nright,tackle/dive/Right,True,5,6\n"
    )
    (tmp_path / "tackle.cases.csv").write_text(cases, newline="")
    found = run("check", tmp_path, "--json").json["findings"]
    told = [(f["rule"], f["line"]) for f in found if "case" in f["rule"]]
    assert told == [("case-failed", 3)], "Fall is valid too"


def test_names_of_inner_tables_may_be_odd(tmp_path: Path):
    write(tmp_path, **{"dive left": "Asset,speed\nA,..8\n"}, tackle="Asset,speed\n@ dive left ,Any\n @dive left,3..\n")
    assert cdb.load(tmp_path / "tackle.csv").compile().query({"speed": 1.0}).assets == ["tackle/dive left/A"]


def test_a_file_without_a_project_finds_the_tables_beside_it(tmp_path: Path):
    (tmp_path / "a.csv").write_text("Asset,speed\n@b,1..5\nx,9\n", newline="")
    (tmp_path / "b.csv").write_text("Asset,speed\ny,..2\n", newline="")
    compiled = cdb.load(tmp_path / "a.csv").compile()
    assert compiled.query({"speed": 1.5}).assets == ["a/b/y"]
