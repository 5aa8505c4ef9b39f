"""What a column becomes: a declared condition by its name, a new one by its cells, or a job; and what contextdb.toml then says."""

from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st
from strategies import examples, for_each, some

from contextdb.cells.grammar import reads
from contextdb.columns import TextColumn
from contextdb.errors import ContextDBError
from contextdb.exchange import mapping
from contextdb.exchange.importing import plan_import
from contextdb.exchange.mapping import Mapped, as_condition, as_job, as_type, propose
from contextdb.exchange.proposals import propose_type
from contextdb.exchange.reading import Reading
from contextdb.schema.settings import TableSettings, conditions_from_dict, read_schema
from contextdb.tables.project import Project

TOML = """# our game
[conditions.speed]        # how fast
type = "number"
unit = "m/s"

[conditions."Defender.Depth_Chart"]
type = "enum"
values = ["CB", "FS"]
"""
SCHEMA = read_schema(TOML, "contextdb.toml")


def reading(**columns: list[str]) -> Reading:
    return Reading(tuple(TextColumn.of(name.replace("__", " "), texts) for name, texts in columns.items()), "csv")


def mapped(read: Reading, settings: TableSettings | None = None, **renames: str) -> dict[str, Mapped]:
    return {column.source: column for column in propose(read, SCHEMA, settings or TableSettings("t"), renames)}


@for_each(
    [
        ("on", ["True", "no", "Any"], {"type": "bool"}),
        ("n", ["0", "1", "1"], {"type": "int"}),
        ("n", ["5", "=7", "1 | 3"], {"type": "int"}),
        ("n", ["5", "0..4"], {"type": "number"}),
        ("n", ["5", "20, 9"], {"type": "number"}),
        ("n", ["5", ">=3"], {"type": "number"}),
        ("Speed (m/s)", ["5", "6"], {"type": "number"}),
        ("target_dist", ["5", "6"], {"type": "number"}),
        ("timeToImpact", ["0", "1"], {"type": "number"}),
        ("n_speedsters", ["5", "6"], {"type": "int"}),
        ("n", ["5", "1.5..3"], {"type": "number"}),
        ("n", ["1e-3"], {"type": "number"}),
        ("dir_to_target", ["20, 9.99", "-20, 9"], {"type": "angle"}),
        ("Direction", ["400..500"], {"type": "number"}),
        ("x", ["170..-170", "5"], {"type": "angle"}),
        ("Facing", ["-180 ± 30", "90 ± 20"], {"type": "angle"}),
        ("Roll (°)", ["5", "30"], {"type": "angle"}),
        ("Heat (°C)", ["20 - 60", "60-95", "Any"], {"type": "number"}),
        ("x", ["20 - 60", "60 to 95"], {"type": "number"}),
        ("x", ["30°", "-20°..20°"], {"type": "angle"}),
        ("level", ["1-1", "1-2", "1-1"], {"type": "enum", "values": ["1-1", "1-2"]}),
        ("Score", ["3 - 1", "1 - 1", "1 - 1"], None),
        ("heading", ["170..-170", "2026-01-02", "-30..30"], {"type": "angle"}),
        ("pos", ['"5"', "CB", "FS", "CB"], {"type": "enum", "values": ["5", "CB", "FS"]}),
        ("t", ["+InAir -Stunned", "-Move.Run"], {"type": "tags", "values": ["InAir", "Move.Run", "Stunned"]}),
        ("pos", ["CB FS", "CB", "not SS", '"Half Back"'], {"type": "enum", "values": ["CB", "FS", "SS", "Half Back"]}),
        ("pos", [f"N{i % 50}" for i in range(200)], {"type": "text"}),
        ("x", ["", "-", "Any"], {"type": "text"}),
        ("note", ["walk, then run!", "stop; sit!"], None),
        ("id", [f"A{i}" for i in range(200)], None),
    ]
)
def test_a_type_is_proposed_from_the_cells_and_the_name(name: str, cells: list[str], declared: dict[str, object] | None):
    proposal = propose_type(TextColumn.of(name, cells))
    assert proposal.declared == declared or (proposal.declared and declared and _same(proposal.declared, declared))
    assert proposal.why


def _same(found: object, wanted: dict[str, object]) -> bool:
    assert isinstance(found, dict)
    return found["type"] == wanted["type"] and sorted(found.get("values", ())) == sorted(wanted.get("values", ()))  # type: ignore[call-overload]


@pytest.mark.parametrize("name", ["Heat (°C)", "speed"])
def test_a_range_as_people_write_it_becomes_the_interval_that_it_means(name: str):
    found = mapped(reading(a=["x", "y"], **{name: ["20 - 60", "1.5"]}))[name]
    assert found.cells is not None
    assert found.cells.to_list() == ["20..60", "1.5"]
    assert (found.n_unreadable, '"20 - 60" is read as 20..60' in found.why) == (0, True)


def test_names_that_contextdb_toml_could_not_hold_make_a_text():
    assert propose_type(TextColumn.of("x", ['""', '" a "', "b", "b"])).declared == {"type": "text"}
    assert propose_type(TextColumn.of("x", ['+" a"', '+" a" -b', "-b"])).declared == {"type": "tags"}


def test_a_few_cells_that_cannot_be_read_do_not_change_the_type_and_are_counted():
    proposal = propose_type(TextColumn.of("n", [*(str(i) for i in range(19)), "5;3"]))
    assert (proposal.declared, proposal.n_unreadable) == ({"type": "int"}, 1)
    assert "1 cell cannot be read so" in proposal.why


SAYS = {
    "bool": ["True", "no"],
    "int": [str(i) for i in range(2, 60)],
    "number": [f"{i}.5..{i + 1}" for i in range(60)],
    "angle": ["170..-170"],
    "tags": [f"+T{i}" for i in range(60)],
    "text": [f"N{i}" for i in range(60)],
    "note": ["walk, then run!", "a; b"],
}


def mixture(parts: list[tuple[str, int, bool]]) -> list[str]:
    """Rows of several kinds, each kind a number of times, of texts that repeat or all differ."""
    rows = []
    for kind, n, is_distinct in parts:
        texts = SAYS[kind]
        rows += [texts[i % len(texts)] + (" " * (1 + i // len(texts)) if is_distinct else "") for i in range(n)]
    return rows


@examples(0.3)
@given(
    parts=st.lists(st.tuples(st.sampled_from(sorted(SAYS)), st.sampled_from([1, 3, 20, 63, 65, 250]), st.booleans()), max_size=4)
)
def test_a_proposed_type_reads_the_cells_that_decided_it_and_counts_all_others(parts: list[tuple[str, int, bool]]):
    column = TextColumn.of("x", mixture(parts))
    proposal = propose_type(column)
    if proposal.declared is None:
        return
    domain = conditions_from_dict({"x": proposal.declared})["x"].domain
    n_unread = sum(not reads(text, domain) for text in column.to_list())
    assert proposal.n_unreadable == n_unread
    assert 2 * n_unread <= column.n_rows


@pytest.mark.parametrize("n_rows", some([2_001, 1_999, 20_000, 10_001, 9_999, 10_002], 3))
def test_columns_of_very_many_different_cells_get_the_type_that_few_of_them_would(n_rows: int):
    kinds = {"{}.5": "number", "{}": "int", "2026-{}": "output", "+T{}": "tags", "id{}": "output"}
    for form, kind in kinds.items():
        proposal = propose_type(TextColumn.of("x", [form.format(i) for i in range(n_rows)]))
        found = proposal.declared["type"] if proposal.declared else "output"
        assert (found, proposal.n_unreadable) == (kind, 0), form


def test_a_slip_among_very_many_cells_is_counted_wherever_it_stands():
    proposal = propose_type(TextColumn.of("x", [*(f"{i}.5" for i in range(12_000)), "5;3"]))
    assert (proposal.declared, proposal.n_unreadable) == ({"type": "number"}, 1)


def test_columns_are_matched_by_name_whatever_their_case_and_spaces():
    found = mapped(reading(Name=["x"], SPEED=["5"], **{"defender_depth_chart": ["CB"]}))
    assert (found["Name"].job, found["SPEED"].name, found["defender_depth_chart"].name) == (
        "asset",
        "speed",
        "Defender.Depth_Chart",
    )
    assert not any(column.is_new for column in found.values())


def test_a_near_name_is_proposed_and_not_taken():
    found = mapped(reading(Name=["x"], sped=["5"]))["sped"]
    assert (found.name, found.is_new, found.near) == ("sped", True, "speed")


def test_cells_that_the_declared_type_cannot_read_are_counted_and_shown():
    found = mapped(reading(Name=["x", "y"], speed=["5", "5;3"]))["speed"]
    assert found.n_unreadable == 1
    assert '1 cell cannot be read as number, such as "5;3"' in found.why


def test_columns_of_a_job_are_known_by_their_names_when_their_cells_fit():
    found = mapped(reading(Name=["x"], enabled=["True"], Priority=["5"], Weight=["heavy"]))
    assert [found[name].job for name in ("enabled", "Priority", "Weight")] == ["enabled", "priority", "condition"]


def test_a_column_of_a_job_may_have_spaces_around_its_name_in_the_file():
    found = mapped(reading(**{" Name ": ["a", "b"], " Priority ": ["1", "2"]}))
    assert [(column.name, column.job) for column in found.values()] == [("Name", "asset"), ("Priority", "priority")]


def test_the_asset_is_the_column_that_is_named_so_else_the_first():
    assert mapped(reading(id=["1"], Asset__Name=["x"]))["Asset Name"].job == "asset"
    assert mapped(reading(id=["1"], other=["x"]))["id"].job == "asset"
    assert mapped(reading(id=["1"], who=["x"]), TableSettings("t", asset="Who"))["who"].name == "Who"


def test_a_person_may_rename_a_column_and_leave_one_out():
    found = mapped(reading(Name=["x"], sped=["5"], junk=["?"]), sped="speed", junk="")
    assert (found["sped"].name, found["sped"].is_new, found["junk"].job) == ("speed", False, "left out")
    with pytest.raises(ContextDBError, match='the file has no column "spd"'):
        mapped(reading(Name=["x"], sped=["5"]), spd="speed")
    with pytest.raises(ContextDBError, match='"sped" and "speed" would both be "speed"'):
        mapped(reading(Name=["x"], sped=["5"], speed=["6"]), sped="speed")


def test_a_decision_can_be_changed_to_a_type_a_condition_or_a_job():
    read = reading(Name=["x", "y"], pos=["A", "B"])
    column, found = read.columns[1], mapped(read)["pos"]
    assert as_type(found, column, "text").declared == {"type": "text"}
    assert as_type(found, column, "number").n_unreadable == 2
    assert as_type(found, column, "enum").declared == {"type": "enum", "values": ["A", "B"]}
    with pytest.raises(ContextDBError, match="no cell holds a name"):
        as_type(found, TextColumn.of("n", ["5", "6"]), "enum")
    assert as_condition(found, column, "speed", SCHEMA).n_unreadable == 2
    assert as_condition(found, column, "new", SCHEMA).declared == {"type": "enum", "values": ["A", "B"]}
    assert as_job(found, "output").kind == "output"


def test_contextdb_toml_gets_the_new_conditions_and_the_table_and_keeps_its_comments(tmp_path: Path):
    (tmp_path / "contextdb.toml").write_text(TOML, encoding="utf-8")
    read = reading(Name=["x", "y"], speed=["5", "6"], pos=["A", "A B"], note=["a, b!", "c; d!"])
    plan = plan_import(read, tmp_path / "jog.csv")
    assert plan.new_conditions == ["pos"]
    assert not (tmp_path / "jog.csv").exists()
    plan.write()
    text = (tmp_path / "contextdb.toml").read_text(encoding="utf-8")
    assert text.startswith("# our game\n[conditions.speed]        # how fast\n")
    project = Project.load(tmp_path)
    assert project["jog"].settings == TableSettings("jog", "jog.csv", "Name", outputs=("note",))
    assert project["jog"].condition("pos").condition.domain.values == ("A", "B")


def test_a_table_that_is_imported_again_changes_what_contextdb_toml_says_of_it(tmp_path: Path):
    path = tmp_path / "jog.csv"
    plan_import(reading(Name=["x", "y"], note=["a, b!", "c; d!"]), path).write()
    plan_import(reading(Name=["x"], speed=["5"], enabled=["True"], note=["q, r!"]), path).write()
    settings = Project.load(tmp_path).schema.tables["jog"]
    assert (settings.outputs, settings.enabled) == (("note",), "enabled")


def test_a_folder_without_contextdb_toml_gets_one(tmp_path: Path):
    plan_import(reading(Name=["x"], speed=["2.5"]), tmp_path / "jog.csv").write()
    assert Project.load(tmp_path).schema.conditions["speed"].domain.kind == "number"


def test_a_table_needs_one_column_that_names_the_assets(tmp_path: Path):
    read = reading(Name=["x"], speed=["5"])
    columns = [as_job(column, "output") for column in propose(read, SCHEMA, TableSettings("t"))]
    with pytest.raises(ContextDBError, match="no column names the assets"):
        plan_import(read, tmp_path / "jog.csv", mapped=columns)


def test_names_are_not_compared_with_very_many_declared_ones_and_that_is_said(monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr(mapping, "MOST_COMPARED", 3)
    found = mapped(reading(Name=["x"], sped=["5"]))["sped"]
    assert found.near is None
    assert "not compared with the 2 declared names, which are too many" in found.why
    assert mapped(reading(Name=["x"], SPEED=["5"]))["SPEED"].name == "speed"
