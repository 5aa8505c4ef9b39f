"""Outputs through edits: contextdb.toml says what the table says, in whichever form it is written, and types follow columns."""

from pathlib import Path
from typing import Any

import pytest
from edit_strategies import insert_column, write_schema
from hypothesis import HealthCheck, given
from hypothesis import strategies as st
from strategies import examples
from test_outputs import declarations, default_of

from contextdb.edits import edits
from contextdb.edits.diffing.toml_merging import merge_toml
from contextdb.errors import SchemaError
from contextdb.files.toml_shapes import as_toml, dotted
from contextdb.schema.sections import settings_to_dict, settings_with
from contextdb.schema.settings import TableSettings, read_schema
from contextdb.tables.changes import Edit
from contextdb.tables.merging.merging import merge
from contextdb.tables.project import load
from contextdb.tables.table import Table
from tui.model.sheet import Sheet
from tui.model.window import Window

NAMES = ("damage", "line", "a b", 'x"y')
INLINE = """[tables.t]
# what an ability does
outputs = { damage = { type = "int",  default = 0 },line = { type = "text" }, at = { type = "numbers", size = 2, default = [0, 0] }}
fallback = { asset = "idle", outputs = { damage = 3 } }   # when nothing fits
policy = "first"
"""
SECTIONS = """[tables.t]
policy = "first"   # the order counts
fallback = { asset = "idle", outputs = { damage = 3 } }

[tables.t.outputs.damage]
type = "int"
default = 0        # most do none

[tables.t.outputs]
line = { type = "text" }

[tables.t.outputs.at]   # metres
type = "numbers"
size = 2
default = [0, 0]
"""
CSV = "Asset,speed,damage,line,at\nwalk,Any,1,hm,1 2\nrun,Any,,,\n"


@pytest.fixture(params=[INLINE, SECTIONS], ids=["inline", "sections"])
def table(request: pytest.FixtureRequest, tmp_path: Path) -> Table:
    (tmp_path / "contextdb.toml").write_text(request.param)
    (tmp_path / "t.csv").write_text(CSV)
    (tmp_path / "other.csv").write_text("Asset,speed\njog,Any\n")
    return load(tmp_path / "t.csv")


def saved(table: Table, *steps: Edit) -> tuple[Table, str]:
    """The table after some edits, saved and loaded again, and the text of contextdb.toml."""
    after = table
    for step in steps:
        after = step.apply(after)
    write_schema(table, after)
    assert table.path is not None
    text = (table.path.parent / "contextdb.toml").read_text()
    assert settings_to_dict(read_schema(text, "contextdb.toml").tables["t"]) == settings_to_dict(after.settings)
    return after, text


def test_a_renamed_output_keeps_its_type_and_its_fallback(table: Table):
    after, text = saved(table, edits.rename_column(table, "damage", "hurt"))
    output = after.settings.output("hurt")
    assert output is not None
    assert (output.kind, output.default) == ("int", 0)
    assert after.settings.fallback_outputs == (("hurt", 3),)
    assert after.compile().outputs.column("hurt").tolist() == [1, 0]
    assert "#" in text


def test_a_deleted_output_goes_from_the_fallback_too(table: Table):
    after, _ = saved(table, edits.delete_columns(table, ["damage"]))
    assert after.settings.outputs == ("line", "at")
    assert (after.settings.fallback, after.settings.fallback_outputs) == ("idle", ())


def test_an_output_that_is_added_leaves_the_others_as_they_are_written(table: Table):
    _, text = saved(table, insert_column(table, 2, "new", "output"))
    assert ("# what an ability does" in text) or ("# most do none" in text and "# metres" in text)
    assert 'new = {type = "text"}' in text or 'new = { type = "text" }' in text


def test_a_default_that_changes_changes_alone(table: Table):
    said: Any = settings_to_dict(table.settings)["outputs"]
    before = (table.schema.file and Path(table.schema.file).read_text()) or ""
    _, text = saved(table, edits.set_settings(table, outputs=said | {"damage": said["damage"] | {"default": 7}}))
    assert text == before.replace("default = 0 ", "default = 7 ", 1)


def test_outputs_that_are_chosen_in_the_editor_keep_what_is_said_of_them(table: Table):
    after, _ = saved(table, edits.set_outputs(table, ["line", "at"]))
    assert [(output.name, output.kind) for output in after.settings.declared_outputs] == [("line", "text"), ("at", "numbers")]
    assert after.settings.fallback_outputs == ()
    assert "damage" in [column.condition.name for column in after.conditions]


def test_another_fallback_gives_the_same_outputs(table: Table):
    after, _ = saved(table, edits.set_fallback(table, "stand"))
    assert (after.settings.fallback, after.settings.fallback_outputs) == ("stand", (("damage", 3),))
    after, _ = saved(after, edits.set_fallback(after, None))
    assert (after.settings.fallback, after.settings.fallback_outputs) == (None, ())


def test_outputs_of_which_nothing_is_said_any_more_are_a_list(table: Table):
    _, text = saved(table, edits.set_outputs(table, ["line"]))
    assert 'outputs = ["line"]' in text


def test_a_fallback_for_an_output_that_is_none_is_refused(table: Table):
    with pytest.raises(SchemaError, match='fallback gives "hurt", which is not an output'):
        edits.set_settings(table, fallback={"asset": "idle", "outputs": {"hurt": 3}})


@st.composite
def sayings(draw: st.DrawFn) -> dict[str, Any]:
    """What `outputs` and `fallback` of a table may say."""
    declared = {name: draw(declarations()) for name in NAMES if draw(st.booleans())}
    said: dict[str, Any] = {"outputs": declared} if declared else {}
    if draw(st.booleans()):
        values = {n: default_of(part) for n, part in declared.items() if "default" in part and draw(st.booleans())}
        plain = {name: list(value) if isinstance(value, tuple) else value for name, value in values.items()}
        said["fallback"] = {"asset": "idle", "outputs": plain} if plain else "idle"
    return said


def written(said: dict[str, Any], form: str) -> str:
    """The keys as a file may write them."""
    lines = ["[tables.t]"]
    below: list[str] = []
    for key, value in said.items():
        if form == "inline" or not isinstance(value, dict):
            lines.append(f"{key} = {as_toml(value)}  # {key}")
        elif form == "dotted":
            lines += [f"{dotted((key, name))} = {as_toml(part)}" for name, part in value.items()]
        else:
            below += ["", f"[{dotted(('tables', 't', key))}]  # {key}"]
            below += [f"{dotted((name,))} = {as_toml(part)}" for name, part in value.items()]
    return "\n".join([*lines, 'policy = "first"', *below]) + "\n"


@given(sayings(), sayings(), st.sampled_from(["inline", "dotted", "sections"]))
@examples(0.7, HealthCheck.function_scoped_fixture)
def test_whatever_changes_is_written_and_read_back(tmp_path: Path, before, after, form: str):
    (tmp_path / "contextdb.toml").write_text(written(before, form))
    columns = ",".join(f'"{name.replace(chr(34), chr(34) * 2)}"' for name in NAMES)
    (tmp_path / "t.csv").write_text(f"Asset,{columns}\n")
    table = load(tmp_path / "t.csv")
    changed = edits.set_settings(table, **{"outputs": None, "fallback": None, **after}).apply(table)
    write_schema(table, changed)
    now = load(tmp_path / "t.csv")
    assert settings_to_dict(now.settings) == settings_to_dict(changed.settings)
    assert settings_to_dict(now.settings) == settings_to_dict(settings_with(TableSettings("t", policy="first"), after))


# ---- merges


def test_what_both_sides_say_of_outputs_stands_in_the_merge(table: Table):
    said: Any = settings_to_dict(table.settings)["outputs"]
    ours = edits.set_settings(table, outputs=said | {"damage": said["damage"] | {"max": 9}}).apply(table)
    theirs = insert_column(table, 2, "loud", "output").apply(table)
    typed = settings_to_dict(theirs.settings)["outputs"] | {"loud": {"type": "bool", "default": True}}
    theirs = edits.set_settings(theirs, outputs=typed).apply(theirs)
    merged = merge(table, ours, theirs).table
    assert merged.settings.output("loud") == theirs.settings.output("loud")
    assert merged.settings.output("damage") == ours.settings.output("damage")
    assert merged.compile().outputs.column("loud").tolist() == [True, True]


def test_an_output_that_one_side_renames_and_the_other_declares_anew_is_both(table: Table):
    said: Any = settings_to_dict(table.settings)["outputs"]
    ours = edits.rename_column(table, "damage", "hurt").apply(table)
    theirs = edits.set_settings(table, outputs=said | {"damage": said["damage"] | {"max": 9}}).apply(table)
    merged = merge(table, ours, theirs).table.settings
    output = merged.output("hurt")
    assert output is not None
    assert (output.maximum, merged.fallback_outputs) == (9.0, (("hurt", 3),))


def test_the_same_value_written_otherwise_is_no_conflict(table: Table):
    ours, theirs = table.with_cell(0, "damage", "2"), table.with_cell(0, "damage", " 2.0 ")
    assert merge(table, ours, theirs).conflicts == ()
    assert merge(table, ours, table.with_cell(0, "damage", "3")).conflicts != ()


def test_merging_a_table_with_itself_changes_nothing(table: Table):
    assert merge(table, table, table).table.settings == table.settings


def test_outputs_of_two_versions_of_contextdb_toml_are_merged_output_by_output():
    ours, theirs = INLINE.replace("default = 0 ", "default = 7 "), INLINE.replace("size = 2", 'size = 2, unit = "m"')
    found = merge_toml(INLINE, ours, theirs)
    assert found.conflicts == ()
    outputs = {output.name: output for output in read_schema(found.text, "contextdb.toml").tables["t"].declared_outputs}
    assert (outputs["damage"].default, outputs["at"].unit) == (7, "m")


# ---- the sheet


def test_the_sheet_marks_the_cells_that_check_reports(table: Table):
    said: Any = settings_to_dict(table.settings)["outputs"]
    table = edits.set_settings(table, outputs=said | {"damage": {"type": "int", "max": 5}}).apply(table)
    table = table.with_cells([(0, "damage", "6"), (0, "at", "1 x"), (0, "line", "any text")])
    table = table.with_rows(2, [{"Asset": "@other"}])
    sheet = Sheet(table)
    window = Window(sheet, 0, 3)
    shown = {(row, column) for row in range(3) for column in range(5) if window.cell(row, column)[1] == "fault"}
    names = [column.name for column in table.columns]
    assert shown == {(fault.place.row, names.index(str(fault.place.column))) for fault in table.faults} == {(0, 2), (0, 4), (1, 2)}
    assert [sheet.fault(*place) is not None for place in ((0, 2), (0, 4), (1, 2), (2, 2), (0, 3))] == [
        True,
        True,
        True,
        False,
        False,
    ]
    sheet.go(0, 2)
    assert sheet.type_text("7") is not None
    assert sheet.type_text("4") is None
