"""The sample tables: what the talk shows stands in them, and contextdb.toml declares what they use."""

import csv
from pathlib import Path

import pytest
from strategies import for_each

from contextdb.cells.grammar import parse_cell
from contextdb.cells.sets import Cell
from contextdb.commands.demo_command import make_sample
from contextdb.motion.made import recipes as made
from contextdb.motion.search.database import MotionDatabase
from contextdb.motion.selection.selector import Selector
from contextdb.motion.storage.building import build
from contextdb.motion.storage.config import MotionConfig
from contextdb.schema.settings import Schema, read_schema

FOLDER = Path(__file__).parent.parent / "tables"
SCHEMA = read_schema((FOLDER / "contextdb.toml").read_text(encoding="utf-8"), "tables/contextdb.toml")
TABLES = sorted(SCHEMA.tables)


def rows_of(table: str) -> list[dict[str, str]]:
    with (FOLDER / f"{table}.csv").open(encoding="utf-8", newline="") as file:
        return list(csv.DictReader(file, strict=True))


def plain_columns(schema: Schema, table: str) -> set[str]:
    settings = schema.tables[table]
    jobs = (settings.asset, settings.enabled, settings.priority, settings.weight, *settings.outputs)
    return {column for column in jobs if column}


def test_every_table_of_the_folder_is_declared():
    found = {path.name for path in FOLDER.glob("*.csv") if not path.name.endswith((".cases.csv", ".expected.csv"))}
    assert {f"{name}.csv" for name in TABLES} == found
    assert SCHEMA.name == "gridiron"


@pytest.mark.parametrize("path", sorted((*FOLDER.glob("*.csv"), *FOLDER.glob("*.toml"))), ids=lambda path: path.name)
def test_a_file_is_plain_utf_8_with_unix_line_ends(path: Path):
    raw = path.read_bytes()
    assert not raw.startswith(b"\xef\xbb\xbf")
    assert b"\r" not in raw
    assert raw.decode("utf-8").endswith("\n")


@pytest.mark.parametrize("table", TABLES)
def test_every_column_is_a_declared_condition_or_has_a_job(table: str):
    columns = set(rows_of(table)[0])
    assert columns == {c for c in columns if c in SCHEMA.conditions} | plain_columns(SCHEMA, table)


@pytest.mark.parametrize("table", TABLES)
def test_every_cell_reads_as_its_condition(table: str):
    for row in rows_of(table):
        for name in row.keys() & SCHEMA.conditions.keys():
            assert not parse_cell(row[name], SCHEMA.conditions[name].domain).is_empty


@pytest.mark.parametrize("table", TABLES)
def test_every_asset_stands_once(table: str):
    assets = [row[SCHEMA.tables[table].asset or ""] for row in rows_of(table)]
    assert len(set(assets)) == len(assets)


def test_every_condition_is_used_and_described():
    used = {column for table in TABLES for column in rows_of(table)[0]}
    assert used >= SCHEMA.conditions.keys()
    assert all(condition.description for condition in SCHEMA.conditions.values())


def test_hit_mid_air_holds_what_the_talk_shows():
    rows = rows_of("hit_mid_air")
    assert list(rows[0]) == [
        "Asset Name",
        "IsInMidAirAnim",
        "IsInCatchAnim",
        "dir_to_tackle_target_future_pos",
        "ActivateDiveAtMidAirHigh",
        "ActivateDiveAtMidAirLow",
        "ActivateHitMidAirNear",
        "ActivateDiveAtMidAirGround",
        "ActivateHitMidAirFar",
    ]
    assert len(rows) == 17
    lines = (FOLDER / "hit_mid_air.csv").read_text(encoding="utf-8").split("\n")
    assert lines[1] == 'MidAir_Tackle_Dive_High_Left_D1_v1,False,False,"20.0000, 9.9900",True,Any,Any,False,Any'
    assert lines[17] == 'MidAir_Tackle_Hit_High_FarRight_D1_v1,False,False,"-20.0000, 9.9900",Any,Any,True,False,Any'
    assert [row["dir_to_tackle_target_future_pos"] for row in rows[4:9]] == [
        "2.5000, 5.0000",
        "-2.5000, 5.0000",
        "7.5000, 5.0000",
        "-7.5000, 5.0000",
        "25.0000, 50.0000",
    ]
    assert [row["ActivateHitMidAirNear"] for row in rows] == ["Any"] * 8 + ["True", "Any", "False", "Any", "Any"] + ["True"] * 4
    assert SCHEMA.conditions["dir_to_tackle_target_future_pos"].domain.kind == "angle"


def test_contested_catch_holds_what_the_talk_shows():
    rows = rows_of("contested_catch")
    assert list(rows[0]) == [
        "Asset Name",
        "Mandatory_Slots",
        "Optional_Slots",
        "MidAir_Catch_Direction",
        "Defender.DepthChart",
        "Defender.MidAir_Contesting",
        "Defender.CatchingAnim",
        "Defender.Catching",
        "Defender.FacingBall",
    ]
    assert len(rows) == 18
    assert [row["MidAir_Catch_Direction"] for row in rows] == ["Going_Up Top", "Going_Down"] + ["Going_Up Top"] * 16
    assert {tuple(row.values())[4:] for row in rows} == {("CB FS SS", "True", "Any", "Any", "True")}
    assert {(row["Mandatory_Slots"], row["Optional_Slots"]) for row in rows} == {("Embed", "Embed")}
    assert rows[10]["Asset Name"] == "D6_Contested_MidAir_Catch_90_V5_ScenarioController"
    assert SCHEMA.conditions["Defender.DepthChart"].role == "Defender"


# ---- locomotion and the made clips


def cell_of(row: dict[str, str], name: str) -> Cell:
    return parse_cell(row[name], SCHEMA.conditions[name].domain)


def test_locomotion_has_one_row_for_each_made_clip():
    assert [row["Asset Name"] for row in rows_of("locomotion")] == list(made.RECIPES)


@for_each(rows_of("locomotion"))
def test_a_row_holds_what_its_clip_shows(row: dict[str, str]):
    clip = made.make_clip(row["Asset Name"])
    shown = made.describe(clip.clip, clip.recipe)
    assert cell_of(row, "gait").holds(shown.gait)
    assert cell_of(row, "style").holds(shown.style)
    assert all(cell_of(row, "speed").holds(speed) for speed in (shown.speed_mps, shown.start_mps, shown.end_mps))
    assert cell_of(row, "direction").holds(shown.turn_dps)


def test_a_fresh_character_plays_no_tired_clip_and_a_tired_one_plays_all():
    cells = {row["Asset Name"]: cell_of(row, "style") for row in rows_of("locomotion")}
    assert [asset for asset, cell in cells.items() if not cell.holds("normal")] == [a for a in cells if a.endswith("_tired")]
    assert all(cell.holds("tired") for cell in cells.values())


@pytest.fixture(scope="module")
def searched(tmp_path_factory: pytest.TempPathFactory) -> tuple[MotionDatabase, Selector]:
    """The database of all clips, and the selector, as contextdb.toml says."""
    folder = tmp_path_factory.mktemp("tables") / "sample"
    make_sample(FOLDER, folder)
    config = MotionConfig.from_dict(SCHEMA.motion, tables=SCHEMA.tables)
    databases = build(config, folder, cache=None)
    return databases["loco"], config.selector("locomotion", databases)


@pytest.mark.parametrize(
    ("asset", "database"),
    [("walk", "loco_tired"), ("walk_turn_left_45", "loco_tired"), ("walk_turn_left_90", "loco"), ("sprint", "loco")],
)
def test_tired_clips_win_where_they_fit_and_only_there(searched: tuple[MotionDatabase, Selector], asset: str, database: str):
    loco, selector = searched
    clip = loco.assets.index(asset)
    query = loco.raw(int(loco.starts[clip] + loco.stops[clip]) // 2)
    assert selector.search(query).database == database
