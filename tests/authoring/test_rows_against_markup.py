"""`contextdb check` refuses rows that say otherwise than the markup of their clips."""

from pathlib import Path

import pytest

from contextdb.commands.check_command import check_path

TOML = """
[conditions.x]
type = "number"
[tables.moves]
outputs = ["loop", "until", "root", "start_s", "mirror"]
[features.loco]
rate = 30
channels = [{{ type = "position", bone = "LeftFoot" }}]
{mirror}
[databases.loco]
table = "moves"
clips = "clips/*.bvh"
features = "loco"
markup = "markup.csv"
"""
MARKUP = """asset,tag,from,to,value
walk,Looping,,,
wave,NextNaturalOnly,0.5,2,
wave,RootMotionWeight,,,0.5
wave,Excluded,0,0.2,
nod,DoNotChoose,1,2,
"""


def messages(folder: Path, row: str, mirror: str = "", markup: str = MARKUP) -> list[str]:
    (folder / "contextdb.toml").write_text(TOML.format(mirror=mirror), encoding="utf-8")
    (folder / "moves.csv").write_text(f"Asset,x,loop,until,root,start_s,mirror\n{row}\n", encoding="utf-8")
    (folder / "markup.csv").write_text(markup, encoding="utf-8")
    findings = [each for each in check_path(str(folder)).findings if each.rule == "row-against-markup"]
    assert all(each.level == "error" and each.row == 0 for each in findings)
    return [each.message for each in findings]


@pytest.mark.parametrize(("row", "message"), [
    ("walk,1,False,,,,", "loop is False, but the markup marks the clip as Looping."),
    ("wave,1,True,,,,", "loop is True, but the markup does not mark the clip as Looping."),
    ("wave,1,,any,,,", "until is any, but the markup has NextNaturalOnly"),
    ("wave,1,,,code,,", "root is code, but the markup gives RootMotionWeight 0.5."),
    ("wave,1,,,animation,,", "root is animation, but the markup gives RootMotionWeight 0.5."),
    ("wave,1,,,,0.1,", 'start_s is 0.1, where nothing can be entered: "Excluded" from 0 to 0.2 s.'),
    ("nod,1,,,,1.5,", 'start_s is 1.5, where nothing can be entered: "DoNotChoose" from 1 to 2 s.'),
    ("nod,1,,,,,always", "mirror is always, but the features of [databases.loco] have no `mirror`: the row never plays."),
])  # fmt: skip
def test_a_contradiction_is_named(tmp_path: Path, row: str, message: str):
    found = messages(tmp_path, row)
    assert len(found) == 1
    assert message in found[0]


@pytest.mark.parametrize(
    "row", ["walk,1,True,any,code,0.5,never", "wave,1,False,natural,mixed,0.3,", "nod,1,,,animation,0.5,as asked"]
)
def test_what_agrees_is_no_finding(tmp_path: Path, row: str):
    assert messages(tmp_path, row) == []
    assert messages(tmp_path, "nod,1,,,,,always", 'mirror = [["Left*", "Right*"]]') == []


def test_markup_that_cannot_be_read_is_left_to_motion_check(tmp_path: Path):
    assert messages(tmp_path, "walk,1,False,,,,", markup="no markup\n") == []
