"""`contextdb motion check` tells all that is wrong with clips, markup and settings, once; `contextdb motion bones` shows rigs."""

from collections import Counter
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from made_once import make_clip
from running import run

from contextdb.motion import Clip, write_bvh
from contextdb.motion.clips.clip_measures import measure

TOML = """
[tables.moves]
[features.loco]
rate = 30.0
channels = [{ type = "position", bone = "LeftFoot" }, { type = "position", bone = "RightFoot" }, { type = "phase" }]
[databases.jog]
table = "moves"
clips = "clips/*.bvh"
features = "loco"
[selectors.player]
order = [{ database = "jog" }]
[controllers.player]
selector = "player"
"""
NAMES = ("walk", "jog", "idle")


@pytest.fixture
def game(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    (tmp_path / "game" / "clips").mkdir(parents=True)
    for name in NAMES:
        put(tmp_path / "game", make_clip(name).clip)
    (tmp_path / "game" / "moves.csv").write_text("Asset\nwalk\njog\nidle\n", encoding="utf-8")
    (tmp_path / "game" / "contextdb.toml").write_text(TOML, encoding="utf-8")
    monkeypatch.chdir(tmp_path)
    return tmp_path / "game"


def put(game: Path, clip: Clip, name: str = "") -> None:
    write_bvh(clip, game / "clips" / f"{name or clip.name}.bvh", digits=4)


def test_a_folder_that_is_named_like_a_clip_is_none(game: Path):
    (game / "clips" / "roll.bvh").mkdir()
    (game / "clips" / "roll.bvh" / "inner.bvh").write_bytes((game / "clips" / "walk.bvh").read_bytes())
    assert "4 clips checked" in run("motion", "check", "game/clips").out
    assert "1 clip checked" in run("motion", "check", "game/clips/roll.bvh").out
    add_rows(game, "roll")
    assert "this is a folder. Accepted: one file." in {finding["message"] for finding in findings()}


def add_rows(game: Path, *names: str) -> None:
    with (game / "moves.csv").open("a", encoding="utf-8") as file:
        file.writelines(f"{name}\n" for name in names)


def changed(clip: Clip, **parts) -> Clip:
    return replace(clip, **parts)


def findings(*more: str, code: int = 1) -> list[dict]:
    result = run("motion", "check", "game", "--json", *more)
    assert result.code == code, result.out + result.err
    assert result.json["format"] == 1
    return result.json["findings"]


def test_every_wrong_clip_is_told_at_once_and_the_others_are_still_checked(game: Path):
    walk = make_clip("walk").clip
    jump = walk.values.copy()
    jump[20:, 2] += 5000.0
    wrong = {
        "metres": changed(walk, values=walk.values, metres_per_unit=0.01),
        "slow": changed(walk, frame_time_s=walk.frame_time_s * 10.0),
        "teleport": changed(walk, values=jump),
        "one": changed(walk, values=walk.values[:1]),
        "zeros": changed(walk, values=np.zeros_like(walk.values)),
        "none": changed(walk, values=walk.values[:0]),
    }
    for name, clip in wrong.items():
        put(game, clip, name)
    tall = (game / "clips" / "metres.bvh").read_text(encoding="utf-8")
    (game / "clips" / "metres.bvh").write_text(scaled(tall, 0.01), encoding="utf-8")
    (game / "clips" / "broken.bvh").write_text(tall[:300], encoding="utf-8")
    add_rows(game, *wrong, "broken")
    found = findings()
    told = {(Path(f["file"]).stem, f["rule"], f["level"]) for f in found if f["file"]}
    assert {
        ("metres", "odd-size", "warning"),
        ("slow", "odd-rate", "warning"),
        ("teleport", "jump", "warning"),
        ("one", "few-frames", "warning"),
        ("zeros", "zero-poses", "warning"),
    } <= told
    assert {(stem, level) for stem, _, level in told if stem in ("none", "broken")} == {("none", "error"), ("broken", "error")}
    assert not {stem for stem, _, _ in told} & set(NAMES)


def scaled(text: str, factor: float) -> str:
    """A BVH text in another unit: offsets and positions of the root alone."""
    lines = []
    in_motion = False
    for line in text.splitlines():
        words = line.split()
        if words[:1] == ["OFFSET"]:
            line = "OFFSET " + " ".join(f"{float(word) * factor:.6f}" for word in words[1:])
        elif in_motion and words and words[0] not in ("Frames:", "Frame"):
            line = " ".join([*(f"{float(word) * factor:.6f}" for word in words[:3]), *words[3:]])
        in_motion = in_motion or words[:1] == ["MOTION"]
        lines.append(line)
    return "\n".join(lines) + "\n"


def test_a_bone_that_all_clips_lack_is_told_once_with_that_of_the_rig(game: Path):
    for path in (game / "clips").glob("*.bvh"):
        text = path.read_text(encoding="utf-8").replace("LeftFoot", "Foot_L").replace("RightFoot", "Foot_R")
        path.write_text(text, encoding="utf-8")
    found = [f for f in findings() if f["rule"] == "unknown-bone"]
    assert len(found) == 2
    assert 'there is no bone "LeftFoot". (2 other clips lack it too.)' in found[0]["message"]
    assert 'Did you mean "Foot_L"?' in found[0]["message"]
    assert 'Did you mean "Foot_R"?' in found[1]["message"]


def test_a_clip_without_a_bone_of_the_features_is_still_looked_at(game: Path):
    toml = TOML.replace('bone = "LeftFoot"', 'bone = "Tail"').replace(
        'clips = "clips/*.bvh"', 'clips = "clips/*.bvh"\nmetres_per_unit = 1.0'
    )
    (game / "contextdb.toml").write_text(toml, encoding="utf-8")
    found = findings()
    assert Counter(f["rule"] for f in found) == {"unknown-bone": 1, "odd-size": 3}
    assert {Path(f["file"]).parent for f in found} == {Path("game/clips")}
    text = run("motion", "check", "game")
    assert text.out.count("odd-size") == 1
    assert "(2 other clips likewise.)" in " ".join(text.out.split())
    assert run("motion", "check", "game", "--all").out.count("odd-size") == 3


def test_feet_that_never_rest_are_doubted_unless_the_clip_is_short(game: Path):
    walk = make_clip("walk").clip
    values = walk.values.copy()
    at = np.arange(len(values))
    values[:, 2] += 300.0 * at / 30.0
    skates = changed(walk, values=values)
    assert measure(skates).never_down
    assert not measure(walk).never_down
    assert not measure(changed(skates, values=values[:50])).never_down
    put(game, skates, "skates")
    add_rows(game, "skates")
    assert [(f["rule"], f["asset"]) for f in findings()] == [("no-footfalls", "skates")]


def test_markup_settings_and_rows_that_do_nothing_are_warnings(game: Path):
    (game / "clips" / "marks.csv").write_text("asset,tag,from,to\nwalkk,Looping,,\njog,Move,90,91\n", encoding="utf-8")
    more = (
        'markup = "clips/marks.csv"\n[features.old]\nrate = 30.0\nchannels = [{ type = "phase" }]\n[output.playr]\nblend = "none"\n'
    )
    toml = TOML.replace('features = "loco"\n', f'features = "loco"\n{more}')
    (game / "contextdb.toml").write_text(toml, encoding="utf-8")
    add_rows(game, "swim")
    put(game, make_clip("run").clip)
    found = findings()
    assert Counter((f["rule"], f["level"]) for f in found)[("unused-section", "warning")] == 2
    text = "\n".join(f["message"] for f in found)
    for part in ('Did you mean "walk"?', "behind the end", "[features.old]", "Did you mean [output.player]?", "swim", "run"):
        assert part in text
    assert {f["level"] for f in found} == {"warning", "info"}
    assert findings("--fail-on", "error", code=0) == found


def test_a_stick_and_markup_beside_the_tables_are_no_tables_of_any_motion_command(game: Path):
    (game / "stick.csv").write_text("time_s,speed_mps\n0,1.1\n1,1.2\n", encoding="utf-8")
    (game / "marks.csv").write_text("asset,tag,from,to\nwalk,Move,,\n", encoding="utf-8")
    assert findings(code=0) == []
    assert run("motion", "build", "game").code == 0
    assert run("motion", "search", "game", "jog", "--query", "walk@0.5").code == 0
    assert run("motion", "run", "game", "player", "game/stick.csv", "--out", "session.parquet").code == 0
    assert [f["rule"] for f in run("check", "game", "--json").json["findings"]].count("not-a-table") == 2


# ---- bones


def test_the_json_document_of_bones_has_every_bone_with_its_parent_and_pairs(game: Path):
    clip = make_clip("walk").clip
    document = run("motion", "bones", game / "clips" / "walk.bvh", "--json").json
    [rig] = document["rigs"]
    assert document["format"] == 1
    assert tuple(bone["bone"] for bone in rig["bones"]) == clip.skeleton.names
    assert [rig[key] for key in ("hips", "head", "feet")] == ["Hips", "Head", ["LeftFoot", "RightFoot"]]
    assert ["LeftFoot", "RightFoot"] in rig["mirror"]
    assert rig["spine"][0].startswith("Spine")
    assert 1.2 < rig["height_m"] < 2.0
    foot = next(bone for bone in rig["bones"] if bone["bone"] == "LeftFoot")
    assert (foot["parent"], foot["mirrored_to"], foot["found_as"]) == ("LeftLeg", "RightFoot", ["foot"])


def test_bones_of_a_folder_are_those_of_the_files_in_it(game: Path):
    files = sorted((game / "clips").glob("*.bvh"))
    assert run("motion", "bones", game / "clips").out == run("motion", "bones", *files).out
    (game / "none").mkdir()
    assert 'there is no file of clips in this folder or below it. Accepted: "*.bvh", ' in run("motion", "bones", game / "none").err
