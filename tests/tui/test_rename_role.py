"""Roles and assets get another name in a whole project or in one table, and Ctrl+Z takes it back."""

import json
import tomllib
from pathlib import Path

import pytest

from contextdb.checks.run import check
from contextdb.edits.renaming_assets import asset_renaming, asset_uses, role_renaming, role_uses
from contextdb.errors import ContextDBError
from contextdb.tables.project import load, load_table

FILES = {
    "contextdb.toml": """# two teams
[conditions."Defender.Depth"]   # who
type = "enum"
values = ["CB", "FS"]

[conditions."Defender.Near"]
type = "bool"

[conditions.covered]
type = "bool"
expr = "Defender.Near and speed > 1"

[conditions.speed]
type = "number"

[tables.a]
when = "rule"
outputs = ["Mandatory_Slots"]
assume = ["not (Defender.Near and speed > 9)"]
fallback = "run"

[blueprints.base]
conditions = ["Defender.Depth", "speed"]

[features.loco]
rate = 30.0
channels = [{ type = "position", bone = "LeftFoot" }]

[databases.loco]
clips = "clips/*.bvh"
features = "loco"
markup = "marks.csv"
""",
    "a.csv": "Asset,Defender.Depth,Mandatory_Slots,rule\nrun,CB,Defender Embed,Defender.Near\nwalk,Any,Embed,\n",
    "b.csv": "Asset,Defender.Near,speed\nrun,True,1\n",
    "a.cases.csv": "Case,Expected,Defender.Depth,Defender.Near\none,run walk,CB,True\ntwo,-run,FS,False\n",
    "a.actors.json": '{"Defender": [{"name": "Joe", "Depth": "CB", "Defender.Near": true}]}',
    "marks.csv": "asset,tag,from,to\nrun,looping,,\nru*,warp,0,1\n",
}


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    for name, text in FILES.items():
        (tmp_path / name).write_text(text)
    (tmp_path / "clips").mkdir()
    (tmp_path / "clips" / "run.bvh").write_text("HIERARCHY\n")
    return tmp_path


def texts(folder: Path) -> dict[str, str]:
    return {name: (folder / name).read_text() for name in FILES}


def test_a_role_goes_along_everywhere_and_the_project_says_the_same(folder):
    table = load_table(folder / "a.csv")
    assert role_uses(table, "Defender") == (
        "2 facts, 1 other table, 1 derived fact, 1 assumption, 1 rule, 2 saved contexts",
        ("b",),
    )
    before = [f.rule for name in ("a.csv", "b.csv") for f in check(load(folder / name))]
    role_renaming(table, "Defender", "Marker").write()
    now = texts(folder)
    assert tomllib.loads(now["contextdb.toml"]) == tomllib.loads(FILES["contextdb.toml"].replace("Defender", "Marker"))
    assert "# who" in now["contextdb.toml"]
    actors = json.loads(now.pop("a.actors.json"))
    assert actors == {"Marker": [{"name": "Joe", "Depth": "CB", "Marker.Near": True}]}
    expected = {name: text.replace("Defender", "Marker") for name, text in FILES.items()}
    assert {name: now[name] for name in now if name.endswith("csv")} == {n: t for n, t in expected.items() if n.endswith("csv")}
    assert [f.rule for name in ("a.csv", "b.csv") for f in check(load(folder / name))] == before


def test_only_here_the_new_role_is_declared_beside_the_old_one(folder):
    role_renaming(load_table(folder / "a.csv"), "Defender", "Marker", only_here=True).write()
    now, toml = texts(folder), tomllib.loads((folder / "contextdb.toml").read_text())
    assert now["b.csv"] == FILES["b.csv"]
    assert now["a.csv"] == FILES["a.csv"].replace("Defender", "Marker")
    assert {"Defender.Depth", "Marker.Depth"} <= set(toml["conditions"])
    assert toml["conditions"]["covered"]["expr"] == "Defender.Near and speed > 1"


@pytest.mark.parametrize(("new", "said"), [("De.f", "no dot"), ("Catcher", "already"), ("", "cannot be")])
def test_a_role_that_cannot_be_is_refused(folder, new, said):
    (folder / "c.csv").write_text("Asset,Catcher.Depth\nx,1\n")
    with pytest.raises(ContextDBError, match=said):
        role_renaming(load_table(folder / "a.csv"), "Defender", new)
    assert texts(folder) == FILES


def test_an_asset_goes_along_everywhere_and_its_clip_is_named(folder):
    table = load_table(folder / "a.csv")
    uses = asset_uses(table, "run")
    assert uses.text == "1 other table, 2 saved contexts, 1 fallback, 1 line of markup"
    assert (uses.tables, uses.clips) == (("b",), ("run.bvh",))
    asset_renaming(table, "run", "sprint").write()
    now = texts(folder)
    assert [now[name].count("sprint") for name in ("a.csv", "b.csv", "a.cases.csv", "marks.csv", "contextdb.toml")] == [
        1,
        1,
        2,
        1,
        1,
    ]
    assert "ru*" in now["marks.csv"]
    assert not any("run" in text for text in now.values())


def test_only_here_an_asset_keeps_its_name_for_others(folder):
    asset_renaming(load_table(folder / "a.csv"), "run", "sprint", only_here=True).write()
    now = texts(folder)
    assert (now["b.csv"], now["marks.csv"]) == (FILES["b.csv"], FILES["marks.csv"])
    assert now["contextdb.toml"] == FILES["contextdb.toml"].replace('"run"', '"sprint"')


def test_an_asset_that_there_is_already_is_refused(folder):
    with pytest.raises(ContextDBError, match="already"):
        asset_renaming(load_table(folder / "a.csv"), "run", "walk")
