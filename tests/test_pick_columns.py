"""Columns and policies that say how rows are picked: how they are declared, checked, merged, exported and told."""

import json
from pathlib import Path

import pytest
from running import run

import contextdb as cdb
from contextdb.checks.run import check, check_rows
from contextdb.compiled.artefact import COMPILED
from contextdb.compiled.table import data_of
from contextdb.edits.edits import check_cell
from contextdb.errors import ArtefactError
from contextdb.exchange.dmn_write import write_dmn
from contextdb.files.tensors import digest_of, read_tensors, write_tensors
from contextdb.schema.policies import POLICIES, ranks_of
from contextdb.schema.settings import TableSettings, read_schema
from contextdb.tables.merging.meaning import meaning_of
from contextdb.tables.table import Table

TOML = """
[conditions.speed]
type = "number"
min = 0
max = 9
[conditions.hurt]
type = "bool"
weight = 2
[tables.t]
policy = "POLICY"
priority = "P"
once = "Once"
cooldown_s = "Rest"
cooldown_turns = "Turns"
"""
SETTINGS = TableSettings("t", once="Once", cooldown_s="Rest", cooldown_turns="Turns")


def made(folder: Path, csv: str, policy: str = "specific") -> Table:
    (folder / "contextdb.toml").write_text(TOML.replace("POLICY", policy), encoding="utf-8")
    (folder / "t.csv").write_text(csv, encoding="utf-8")
    return cdb.load(folder / "t.csv", strict=False)


def rules(table: Table) -> list[tuple[str, str, int | None]]:
    return [(f.rule, f.level, f.row) for f in (*check(table), *check_rows(table)) if f.level != "info" or f.rule == "variety"]


HEAD = "Asset,speed,hurt,P,Once,Rest,Turns\n"


# ---- what the file says


def test_cells_of_rests_that_cannot_be_read_are_errors_at_their_place(tmp_path: Path):
    table = made(tmp_path, HEAD + 'a,1,,,maybe,soon,1.5\nb,2,,,True,-1,-1\nc,3,,,,,\nd,4,,,no,inf,2\ne,5,,,1,"0,5",3 turns\n')
    found = {(f.row, f.column): f.message for f in check(table) if f.rule == "unreadable-cell"}
    assert found == {
        (0, "Once"): 'cannot read "maybe". Accepted: "True" or "False".',
        (0, "Rest"): 'cannot read "soon". Accepted: a number of seconds from 0 up.',
        (0, "Turns"): 'cannot read "1.5". Accepted: a whole number of picks from 0 up.',
        (1, "Rest"): 'cannot read "-1". Accepted: a number of seconds from 0 up.',
        (1, "Turns"): 'cannot read "-1". Accepted: a whole number of picks from 0 up.',
        (3, "Rest"): 'cannot read "inf". Accepted: a number of seconds from 0 up.',
        (4, "Rest"): 'cannot read "0,5". Accepted: a number of seconds from 0 up. Did you mean "0.5"?',
        (4, "Turns"): 'cannot read "3 turns". Accepted: a whole number of picks from 0 up. Did you mean "3"?',
    }


def test_an_editor_says_of_a_cell_what_check_says(tmp_path: Path):
    table = made(tmp_path, HEAD + "a,1,,,,,\n")
    for column, wrong, right in (("Once", "maybe", "yes"), ("Rest", "soon", "2.5"), ("Turns", "0.5", "3")):
        fault = check_cell(table, column, wrong)
        assert fault is not None
        assert "cannot read" in fault.found
        assert check_cell(table, column, right) is None


def test_a_column_has_one_job_and_must_be_there(tmp_path: Path):
    with pytest.raises(cdb.SchemaError, match='cooldown_s and once both name the column "Once"'):
        read_schema("[tables.t]\nonce = 'Once'\ncooldown_s = 'Once'\n", "contextdb.toml")
    with pytest.raises(cdb.TableError, match=r"there is no column \"Once\", which .tables.t. names as once"):
        Table.from_columns({"Asset": ["a"]}, {}, TableSettings("t", once="Once"))


@pytest.mark.parametrize(
    ("said", "message"),
    [
        ("weight = -1", "weight = -1: this is below 0 or infinite. Accepted: a number from 0 up, such as 2.0."),
        ("weight = inf", "weight = inf: this is below 0 or infinite"),
        ("weight = 'much'", 'weight = "much": this is text, not a number'),
        ("weight = true", "weight = true: this is true or false, not a number"),
    ],
)
def test_what_a_condition_counts_is_a_number_from_0_up(said: str, message: str):
    with pytest.raises(cdb.SchemaError) as caught:
        read_schema(f"[conditions.x]\ntype = 'bool'\n{said}\n", "contextdb.toml")
    assert message in str(caught.value)


@pytest.mark.parametrize(
    ("said", "meant"), [("best", "specific"), ("specifc", "specific"), ("cost", "cheapest"), ("cheap", "cheapest")]
)
def test_a_policy_that_is_nearly_named_is_offered(said: str, meant: str):
    with pytest.raises(cdb.SchemaError, match=f'Did you mean policy = "{meant}"'):
        read_schema(f"[tables.t]\npolicy = '{said}'\n", "contextdb.toml")


def test_a_condition_that_counts_more_is_kept_by_the_schema():
    schema = read_schema("[conditions.x]\ntype = 'bool'\nweight = 2\n[conditions.y]\ntype = 'bool'\n", "contextdb.toml")
    assert [condition.weight for condition in schema.conditions.values()] == [2.0, 1.0]


def test_texts_that_mean_the_same_rest_do_not_conflict_in_a_merge():
    columns = {"Asset": ["a"], "Once": ["yes"], "Rest": ["2"], "Turns": [""]}
    table = Table.from_columns(columns, {}, SETTINGS)
    for column, one, other in ((1, "yes", "True"), (1, "", "False"), (2, "2", "2.0"), (3, "", "0")):
        meaning = meaning_of(table, column)
        assert meaning(one) == meaning(other) is not None


# ---- versions, and files for the game


def test_what_rests_is_part_of_the_version_and_of_the_compiled_file(tmp_path: Path):
    table = made(tmp_path, HEAD + "a,1,,,,,\nb,2,True,,True,2.5,3\n")
    compiled = table.compile()
    assert (
        len(
            {
                compiled.version,
                table.with_cell(0, "Turns", "1").compile().version,
                table.with_cell(1, "Rest", "3").compile().version,
            }
        )
        == 3
    )
    compiled.save(tmp_path / "t.safetensors")
    opened = cdb.CompiledTable.open(tmp_path / "t.safetensors")
    assert opened.version == compiled.version
    told = {name: array.tolist() for name, array in data_of(opened).picking.arrays.items()}
    assert told == {"specificities": [1.0, 3.0], "once": [False, True], "cooldown_s": [0.0, 2.5], "cooldown_turns": [0, 3]}
    assert data_of(opened).picking.limited.tolist() == [1]


@pytest.mark.parametrize("policy", POLICIES)
def test_a_compiled_file_says_how_it_is_picked_from(tmp_path: Path, policy: str):
    made(tmp_path, HEAD + "a,1,,,,,\n", policy).compile().save(tmp_path / "t.safetensors")
    tensors, metadata = read_tensors(tmp_path / "t.safetensors", COMPILED)
    about, kind = json.loads(metadata["about"]), POLICIES[policy]
    assert (about["policy"], about["choose"], about["by_cost"]) == (policy, kind.choose, kind.by_cost)
    assert tensors["ranks"].tolist() == ranks_of(policy, tensors["priorities"], tensors.get("specificities")).tolist()


def test_a_compiled_file_of_a_policy_that_is_not_known_is_refused(tmp_path: Path):
    path = tmp_path / "t.safetensors"
    made(tmp_path, HEAD + "a,1,,,,,\n").compile().save(path)
    tensors, metadata = read_tensors(path, COMPILED)
    about = json.dumps(json.loads(metadata["about"]) | {"policy": "newest"})
    write_tensors(path, COMPILED, dict(tensors), {"about": about, "digest": digest_of(tensors, about, str(COMPILED.layout))})
    with pytest.raises(ArtefactError):
        cdb.CompiledTable.open(path)


def test_a_table_inside_that_picks_by_its_cells_is_stored_with_its_policy(tmp_path: Path):
    inner = Table.from_columns({"asset": ["x"]}, {}, TableSettings("inner", policy="specific"))
    outer = Table.from_columns({"asset": ["@inner", "y"]}, {}, TableSettings("outer"), "outer").compile({"inner": inner})
    outer.save(tmp_path / "t.safetensors")
    assert data_of(cdb.CompiledTable.open(tmp_path / "t.safetensors")).policies == {"collect", "specific"}


def test_what_dmn_cannot_say_of_picks_is_told(tmp_path: Path):
    for policy in ("specific", "cheapest"):
        text, remarks = write_dmn(made(tmp_path, HEAD + "a,1,,,True,2,1\n", policy))
        assert b'hitPolicy="COLLECT"' in text
        told = [str(remark) for remark in remarks if remark.is_loss]
        assert any(f'the policy "{policy}" becomes COLLECT' in one for one in told)
        assert sum("a decision does not remember what was picked" in one for one in told) == 3


# ---- what is wrong with rows


def test_under_specific_a_row_inside_a_wider_one_is_the_point_and_has_no_finding(tmp_path: Path):
    csv = HEAD + "any,,,,,,\nfast,>5,,,,,\nfast and hurt,>5,True,,,,\n"
    assert rules(made(tmp_path, csv)) == []
    assert ("subsumed-row", "warning", 1) in rules(made(tmp_path, csv, "first"))


def test_under_specific_rows_that_are_equally_specific_are_variety(tmp_path: Path):
    assert rules(made(tmp_path, HEAD + "a,>5,,,,,\nb,>4,,,,,\n")) == [("variety", "info", 1)]


def test_a_row_that_more_specific_ones_always_outrank_is_never_chosen(tmp_path: Path):
    csv = HEAD + "any,,,,,,\nhurt,,True,,,,\nfine,,False,,,,\n"
    table = made(tmp_path, csv)
    [finding] = [f for f in check_rows(table) if f.rule == "never-chosen"]
    assert (finding.row, finding.by) == (0, (1, 2))
    assert finding.message == "the row is never chosen: wherever it is valid, a valid row is more specific."
    by_priority = [f for f in check_rows(table.with_cell(0, "P", "-1")) if f.rule == "never-chosen"]
    assert by_priority[0].message.endswith("a valid row has a higher priority or is more specific.")


def test_under_cheapest_only_a_higher_priority_keeps_a_row_from_ever_being_chosen(tmp_path: Path):
    csv = HEAD + "a,0..3 ~2,,0,,,\nb,3..9 ~1,,0,,,\nc,,,-1,,,\n"
    assert [f.row for f in check_rows(made(tmp_path, csv, "cheapest")) if f.rule == "never-chosen"] == [2]


def test_tables_inside_have_their_own_policy_in_findings(tmp_path: Path):
    (tmp_path / "contextdb.toml").write_text('[conditions.speed]\ntype = "number"\n[tables.inner]\npolicy = "specific"\n')
    (tmp_path / "inner.csv").write_text("Asset,speed\nwide,\nfast,>5\n")
    (tmp_path / "outer.csv").write_text("Asset,speed\n@inner,\nother,<0\n")
    project = cdb.Project.load(tmp_path)
    assert [f.rule for f in check_rows(project["inner"]) if f.row is not None] == []
    assert [f for f in check_rows(project["outer"].flat()) if f.asset == "outer/inner/fast"] == []


# ---- what the command says


def test_query_says_which_row_is_picked_by_its_cells_or_by_its_costs(tmp_path: Path):
    made(tmp_path, HEAD + "any,,,,,,\nfast,>5,,,,,\n")
    result = run("query", str(tmp_path / "t.csv"), "speed=7", "hurt=False")
    assert "outranked by fast (specificity 1)" in result.out
    made(tmp_path, HEAD + "slow,<3 ~2,,,,,\nfast,>5 ~2,,,,,\n", "cheapest")
    result = run("query", str(tmp_path / "t.csv"), "speed=7", "hurt=False")
    assert "outranked by fast (penalty 0)" in result.out
