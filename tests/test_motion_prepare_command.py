"""`contextdb motion prepare` shows a diff that applies and is taken back, writes only when asked, and keeps what is there."""

import os
import re
import shutil
import subprocess
import tomllib
from pathlib import Path

import numpy as np
import pytest
from made_once import make_clip
from running import Result, run
from strategies import some

from contextdb.commands import motion_build_command
from contextdb.commands.motion_prepare_command import line_of, with_marks
from contextdb.motion import Markup, MotionConfig, write_bvh
from contextdb.motion.features.extraction import clip_features
from contextdb.motion.preparing.look import Look
from contextdb.motion.preparing.proposal import Proposal

NAMES = ("idle", "walk", "start_walk", "stop_walk")
HAND = "tag,asset,to,from\r\nMove.Walk,walk*,,\r\nLooping,idle,,"
MOCAP = Path(os.environ.get("CONTEXTDB_MOCAP", Path(__file__).parents[2] / "shared" / "data" / "mocap"))
TOML = """
[features.loco]
rate = 30.0
channels = [{ type = "position", bone = "LeftFoot" }]
[databases.loco] # all of them
clips = "clips/*.bvh"
features = "loco"
"""


@pytest.fixture
def game(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    (tmp_path / "game" / "clips").mkdir(parents=True)
    for name in NAMES:
        write_bvh(make_clip(name).clip, tmp_path / "game" / "clips" / f"{name}.bvh", digits=4)
    monkeypatch.chdir(tmp_path)
    return tmp_path / "game"


def prepare(*arguments: str, code: int = 0) -> Result:
    result = run("motion", "prepare", *arguments)
    assert result.code == code, result.out + result.err
    return result


def as_bytes(folder: Path) -> dict[str, bytes]:
    return {
        str(path.relative_to(folder)): path.read_bytes()
        for path in sorted(folder.rglob("*"))
        if path.is_file() and ".contextdb-cache" not in path.parts
    }


def test_without_write_nothing_changes_and_the_reasons_come_first(game: Path):
    before = as_bytes(game)
    result = prepare("game/clips", code=1)
    assert as_bytes(game) == before
    assert "# walk: Looping all of it: its ends are 0.0 cm" in result.out
    assert "# walk: Contact.Left: 5 stances" in result.out
    assert "+start_walk,NextNaturalOnly,0.733,1.167,0.2" in result.lines
    assert result.out == prepare("game/clips", code=1).out


def test_what_is_written_is_stable_when_run_again(game: Path):
    prepare("game/clips", "--write")
    before = as_bytes(game)
    again = prepare("game/clips", "--write")
    assert "nothing to write" in again.err
    assert as_bytes(game) == before
    assert prepare("game/clips").code == 0


def test_where_only_cuts_are_left_there_is_nothing_to_write(game: Path):
    cuts = prepare("game/clips", "--only", "cuts")
    assert ": cut from " in cuts.out
    assert cuts.err == "contextdb: nothing to write: only you can cut the files of clips.\n"
    assert prepare("game/clips", "--only", "duplicates").err == "contextdb: nothing to propose.\n"


def test_lines_by_hand_stay_and_their_columns_and_line_ends_are_kept(game: Path):
    file = game / "clips" / "marks.csv"
    file.write_bytes(HAND.encode())
    prepare("game/clips", "--write")
    text = file.read_bytes().decode()
    assert text.startswith(HAND + "\r\n")
    assert "\n" not in text.replace("\r\n", "")
    assert "Looping,walk,,\r\n" in text
    assert text.count("Looping,idle") == 1
    assert Markup.load(file).is_looping("walk")


def test_a_project_names_the_markup_that_it_gets(game: Path):
    (game / "contextdb.toml").write_text(TOML, encoding="utf-8")
    prepare("game", "--write", "--only", "loops")
    toml = (game / "contextdb.toml").read_text(encoding="utf-8")
    assert 'markup = "clips/marks.csv"' in toml
    assert "[databases.loco] # all of them" in toml
    assert (game / "clips" / "marks.csv").read_text(encoding="utf-8") == (
        "asset,tag,from,to,value\nidle,Looping,,,\nwalk,Looping,,,\n"
    )
    assert prepare("game", "--only", "loops").out == ""
    assert run("motion", "build", "game").code == 0


@pytest.mark.skipif(shutil.which("patch") is None, reason="no patch on this machine")
@pytest.mark.parametrize(
    "hand", [None, HAND, HAND + "\r\n", "asset,tag,from,to,value\nidle,Looping,,,\n", "asset,tag,from,to\na,B,,"]
)
def test_the_diff_applies_and_is_taken_back(game: Path, hand: str | None):
    (game / "contextdb.toml").write_text(TOML, encoding="utf-8")
    file = game / "clips" / "marks.csv"
    if hand is not None:
        file.write_bytes(hand.encode())
    before = as_bytes(game)
    diff = run("motion", "prepare", "game", "--json").json["files"]
    text = "".join(each["diff"] for each in diff)
    patched(game, text)
    applied = as_bytes(game)
    patched(game, text, "-R")
    assert as_bytes(game) == before
    prepare("game", "--write")
    assert as_bytes(game) == applied


def patched(folder: Path, diff: str, *more: str) -> None:
    command = ["patch", "-p1", "--binary", "--no-backup-if-mismatch", *more]
    done = subprocess.run(command, input=diff.encode(), cwd=folder, capture_output=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr


def test_a_document_has_each_proposal_with_reason_and_measure(game: Path):
    document = run("motion", "prepare", "game/clips", "--json").json
    assert document["format"] == 1
    assert document["written"] is False
    (loop,) = [each for each in document["proposals"] if (each["asset"], each["kind"]) == ("walk", "loops")]
    assert loop["tag"] == "Looping"
    assert loop["measure"] < 0.001


def test_hips_that_sway_get_a_root_of_their_own_which_the_build_uses(game: Path):
    (game / "contextdb.toml").write_text(TOML, encoding="utf-8")
    before = as_bytes(game)
    told = prepare("game", "--only", "roots", code=1)
    assert told.lines[0].startswith("# 3 clips: root_smooth_s: hips sway about the body's path, most ")
    assert "+root_smooth_s = 0.2" in told.lines
    assert as_bytes(game) == before
    prepare("game", "--only", "roots", "--write")
    assert {name for name, data in as_bytes(game).items() if before[name] != data} == {"contextdb.toml"}
    assert prepare("game", "--only", "roots").out == ""
    config = MotionConfig.from_dict(tomllib.loads((game / "contextdb.toml").read_text(encoding="utf-8")))
    (clip,) = config.load_clips("loco", game, ["walk"])
    way = clip_features(clip, config.features["loco"]).root
    assert np.abs(way[:, 0]).max() < 0.005  # straight on: the hips sway by 2 cm
    assert np.ptp(way[:, 2]) < 0.02


def test_features_that_say_that_the_hips_are_the_root_are_left_alone(game: Path):
    toml = TOML.replace("rate = 30.0", "rate = 30.0\nroot_smooth_s = 0.0")
    (game / "contextdb.toml").write_text(toml, encoding="utf-8")
    assert prepare("game", "--only", "roots").out == ""


def test_clips_that_play_together_are_not_taken_for_duplicates_of_each_other(game: Path):
    for role in ("Host", "Guest"):
        shutil.copy(game / "clips" / "stop_walk.bvh", game / "clips" / f"shake.{role}.bvh")
    toml = TOML.replace("clips/*.bvh", "clips/shake.*.bvh") + 'roles = ["Host", "Guest"]\n'
    (game / "contextdb.toml").write_text(toml, encoding="utf-8")
    found = prepare("game", "--json", code=1).json["proposals"]
    assert {each["kind"] for each in found} <= {"roots", "contacts", "noise"}
    assert {each["asset"] for each in found if each["kind"] == "contacts"} == {"shake.Host", "shake.Guest"}


def slower(game: Path, name: str = "start_walk") -> None:
    """Save a clip as another program would: half as fast."""
    file = game / "clips" / f"{name}.bvh"
    file.write_text(file.read_text(encoding="utf-8").replace("Frame Time: 0.03", "Frame Time: 0.06"), encoding="utf-8")


def looked_at(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """The names of the clips that are looked at from here on."""
    names: list[str] = []
    at = Look.at
    monkeypatch.setattr(Look, "at", lambda clip: names.append(clip.name) or at(clip))
    return names


def test_only_clips_that_changed_are_looked_at_again(game: Path, monkeypatch: pytest.MonkeyPatch):
    prepare("game/clips", "--write")
    looks = looked_at(monkeypatch)
    prepare("game/clips", "--write")
    assert looks == []
    slower(game)
    prepare("game/clips", "--write")
    assert looks == ["start_walk"]


def test_marks_of_a_clip_as_it_was_are_replaced_and_all_others_stay(game: Path):
    prepare("game/clips", "--write")
    file = game / "clips" / "marks.csv"
    before = file.read_text(encoding="utf-8").splitlines()
    slower(game)
    told = prepare("game/clips", "--write")
    after = file.read_text(encoding="utf-8").splitlines()
    assert [line for line in before if "start_walk" not in line] == [line for line in after if "start_walk" not in line]
    assert "start_walk,NextNaturalOnly,0.733,1.167,0.2" in before
    assert "start_walk,NextNaturalOnly,1.583,2.217,0.2" in after
    assert "start_walk changed since it was prepared" in told.err
    assert not {line for line in before if line.startswith("start_walk,Contact")} & set(after)
    assert "nothing to write: only you can cut" in prepare("game/clips", "--write").err


def test_a_mark_that_was_edited_stays_when_its_clip_changes(game: Path):
    prepare("game/clips", "--write")
    file = game / "clips" / "marks.csv"
    edited = "start_walk,NextNaturalOnly,0.5,2,0.2"
    file.write_text(
        file.read_text(encoding="utf-8").replace("start_walk,NextNaturalOnly,0.733,1.167,0.2", edited), encoding="utf-8"
    )
    slower(game)
    prepare("game/clips", "--write")
    text = file.read_text(encoding="utf-8")
    assert edited in text
    assert text.count("start_walk,NextNaturalOnly") == 1


@pytest.mark.parametrize("spoilt", ["", "{", '{"format": 1, "clips": {"walk": {}}}', '{"format": 9}', "[]"])
def test_what_is_kept_and_cannot_be_read_is_as_if_it_were_not_there(game: Path, spoilt: str, monkeypatch: pytest.MonkeyPatch):
    prepare("game/clips", "--write", "--only", "loops")
    (game / "clips" / ".contextdb-cache" / "prepared.json").write_text(spoilt, encoding="utf-8")
    looks = looked_at(monkeypatch)
    prepare("game/clips", "--only", "loops")
    assert len(looks) == len(NAMES)


def test_watching_does_it_again_for_each_saved_clip_and_tells_what_is_wrong(game: Path, monkeypatch: pytest.MonkeyPatch):
    (game / "contextdb.toml").write_text(TOML, encoding="utf-8")
    marks, toml = game / "clips" / "marks.csv", game / "contextdb.toml"
    saves = [
        lambda: slower(game),
        lambda: toml.write_text("[features", encoding="utf-8"),
        lambda: toml.write_text(TOML, encoding="utf-8"),
    ]
    time_s = [0.0]

    def sleep(seconds: float) -> None:
        time_s[0] += seconds
        if time_s[0] > 4.0 * (4 - len(saves)):  # the files rested long ago
            if not saves:
                raise KeyboardInterrupt
            saves.pop(0)()

    monkeypatch.setattr(motion_build_command, "sleep", sleep)
    monkeypatch.setattr(motion_build_command, "clock", lambda: time_s[0])
    told = prepare("game", "--only", "starts", "--write", "--watch")
    assert "+start_walk,NextNaturalOnly,0.733,1.167,0.2" in told.lines
    assert "+start_walk,NextNaturalOnly,1.583,2.217,0.2" in told.lines
    assert "contextdb.toml, line 1" in told.err
    assert "NextNaturalOnly,1.583" in marks.read_text(encoding="utf-8")


def test_markup_that_cannot_be_read_stops_it(game: Path):
    (game / "clips" / "marks.csv").write_text("asset,tag,from,to\nwalk,DoNotChose,,\n", encoding="utf-8")
    assert "DoNotChoose" in prepare("game/clips", "--write", code=2).err


def test_a_fault_of_the_markup_has_its_line_when_lines_above_are_taken_back(game: Path):
    prepare("game/clips", "--write", "--only", "starts", "--only", "tails")
    file = game / "clips" / "marks.csv"
    lines = [*file.read_text(encoding="utf-8").splitlines(), "walk,NextNaturalOnly,0.5,0.6,0.2"]
    file.write_text("\n".join(lines) + "\n", encoding="utf-8")
    slower(game)
    told = prepare("game/clips", "--write", "--only", "starts", "--only", "tails", code=2)
    assert f'marks.csv, line {len(lines)}, column "value"' in told.err


@pytest.mark.parametrize("arguments", [("nowhere",), ("game", "--only", "lops"), ("empty",)])
def test_wrong_uses_are_refused(game: Path, arguments: tuple[str, ...]):
    (game.parent / "empty").mkdir()
    assert prepare(*arguments, code=2).out == ""


def test_marks_are_quoted_where_they_must_be():
    mark = Proposal('a,"b"', "loops", "Looping", None, None, None, "", 0.0)
    text = with_marks("", [line_of(mark)])
    assert Markup.parse(text).is_looping('a,"b"')


@pytest.mark.skipif(not (MOCAP / "assets.csv").is_file(), reason="no captured clips: set CONTEXTDB_MOCAP to their folder")
def test_proposals_for_captured_clips_are_stable(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "clips").mkdir()
    clips = some(sorted(MOCAP.rglob("*.bvh")), 12)
    for clip in clips:
        shutil.copy(clip, tmp_path / "clips" / clip.name)
    told = prepare("clips", "--write")
    assert "NextNaturalOnly" in told.out
    assert len(Markup.load(tmp_path / "clips" / "marks.csv").spans) > 7 * len(clips)
    assert re.search("nothing to (write|propose)", prepare("clips").err)
