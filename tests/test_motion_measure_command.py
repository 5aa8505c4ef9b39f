"""`contextdb motion measure` on a recorded session: its JSON, its bars, a baseline, and what it cannot measure."""

import json
import math
import shutil
from functools import cache
from pathlib import Path
from xml.etree import ElementTree as ET

import numpy as np
import pytest
from motion_project import session_folder, work_in_copy
from running import Result, run
from strategies import some

from contextdb.errors import ContextError
from contextdb.files.reports import sealed, with_marks
from contextdb.motion import Trace, measure
from contextdb.report.measure_results import read_baseline
from contextdb.report.render_json import as_json

OUTPUT = "[output.player]\nfoot_lock = false\n"
"""So that feet slide."""
KEYS = [
    "file",
    "seconds",
    "jumps_per_s",
    "forced_jumps",
    "jump_cm",
    "skate_cm_s",
    "skate_raw_cm_s",
    "accel_p99",
    "accel_raw_p99",
    "path_rms_m",
    "heading_rms_deg",
    "reach_s",
    "stay_s",
    "frames_used_share",
    "assets_never_used",
    "skate_toe_cm_s",
    "skate_toe_raw_cm_s",
    "hip_dip_cm",
    "penetration_cm",
]
"""The names that scripts rely on, and `hips_off_feet_cm`, which needs a stop."""


@cache
def _made() -> Path:
    folder = session_folder(OUTPUT, "--poses", "poses.npz")
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(folder)
        (folder / "before.json").write_text(run("motion", "measure", "session.parquet", "--json").out, encoding="utf-8")
    return folder


@pytest.fixture(scope="session")
def made() -> Path:
    """A project in game/, a session of it, its poses, and its measures."""
    return _made()


@pytest.fixture(autouse=True)
def here(made: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A working folder with a copy of it all."""
    return work_in_copy(made, tmp_path, monkeypatch)


def resealed(document: object) -> str:
    """The text of a report with the digest that belongs to it."""
    return sealed(as_json(with_marks(document)))


def measured(*arguments: str, code: int = 0) -> Result:
    result = run("motion", "measure", *arguments)
    assert result.code == code, result.err
    return result


def refused(*arguments: str) -> str:
    result = measured(*arguments, code=2)
    assert result.out == ""
    assert len(result.err.splitlines()) == 1
    return result.err


def session_of(*arguments: str, code: int = 0) -> dict[str, object]:
    document = measured(*arguments, "--json", code=code).json
    assert document["format"] == 1
    (session,) = document["sessions"]
    return session


def test_the_json_document_has_every_measure_with_the_raw_clips_beside():
    session = session_of("session.parquet")
    assert [key for key in (*KEYS, "hips_off_feet_cm") if key not in session] == []
    assert session["file"] == "session.parquet"
    assert session["seconds"] == pytest.approx(5.0)
    assert 0.0 < session["jumps_per_s"] < 5.0
    assert session["assets_never_used"] == []
    assert [key for key in KEYS if session[key] is None] == []


def test_poses_that_were_written_measure_as_those_made_again():
    again, written = session_of("session.parquet"), session_of("session.parquet", "--poses", "poses.npz")
    for key, value in again.items():
        if isinstance(value, float):
            assert written[key] == pytest.approx(value, rel=1e-3, abs=1e-3), key  # a file has positions of 32 bits


def test_a_file_of_poses_is_measured_against_the_clips_of_a_project():
    session, alone = session_of("poses.npz", "--project", "game"), session_of("session.parquet")
    for key in ("seconds", "jumps_per_s", "forced_jumps", "skate_raw_cm_s", "accel_raw_p99", "stay_s"):
        assert session[key] == pytest.approx(alone[key]), key
    assert session["skate_cm_s"] == pytest.approx(alone["skate_cm_s"], rel=1e-3, abs=1e-3)
    assert session["path_rms_m"] is None
    assert session["missing"]["path_rms_m"] == "the session does not say where the game had the body"


def test_the_command_and_the_function_say_the_same(here: Path):
    found = measure(Trace.load("session.parquet"))
    assert session_of("session.parquet")["jumps_per_s"] == found.jumps_per_s
    assert found.missing["skate_cm_s"].startswith("there are no poses")


def test_the_text_has_the_raw_clips_beside_and_says_what_is_never_played():
    lines = measured("session.parquet").lines
    assert lines[0].startswith("session.parquet: 5.00 s, 151 updates, ")
    skate = next(line for line in lines if line.startswith("skate, cm/s"))
    assert len(skate.split()) == 4
    assert not any("not measured" in line for line in lines)
    assert any(line.startswith("not measured, as the session does not say where") for line in measured("poses.npz").lines)


@pytest.mark.parametrize(
    "name", some(["skate", "toe-skate", "dip", "jumps", "accel", "path", "heading", "reach", "forced", "forced-cost"], 3)
)
def test_a_missed_threshold_fails_and_is_reported(name: str):
    session = session_of("session.parquet", f"--max-{name}", "0.0001", code=1)
    (gate,) = session["bars"]
    assert (gate["name"], gate["passed"], gate["limit"]) == (f"max-{name}", False, 0.0001)
    assert session_of("session.parquet", f"--max-{name}", "99999")["bars"][0]["passed"] is True
    text = measured("session.parquet", f"--max-{name}", "0.0001", code=1)
    assert text.lines[-1].startswith(f"FAILED  max-{name}  ")
    case = ET.fromstring(measured("session.parquet", f"--max-{name}", "0", "--format", "junit", code=1).out).find(".//failure")
    assert case is not None
    assert case.get("type") == f"max-{name}"
    markdown = measured("session.parquet", f"--max-{name}", "0", "--format", "markdown", code=1).out
    assert f"- ✗ max-{name}: " in markdown


def test_a_session_without_bars_is_one_passed_case():
    suites = ET.fromstring(measured("session.parquet", "poses.npz", "--format", "junit").out)
    assert (suites.get("tests"), suites.get("failures")) == ("2", "0")


def test_a_report_opens_with_what_to_do_in_every_case(tmp_path: Path):
    lines = {
        "To do first: let a build hold what is reached: --max-skate ": ("poses.npz", "--project", "game"),
        "Nothing to do: every measure is within its bar.": ("poses.npz", "--project", "game", "--max-skate", "99"),
        "To do first: ": ("session.parquet", "--max-skate", "0.0001"),
    }
    for opening, arguments in lines.items():
        code = int("0.0001" in arguments)
        assert measured(*arguments, code=code).lines[1].startswith(opening)
        assert session_of(*arguments, code=code)["to_do"].startswith(opening)
        for form in ("markdown", "html"):
            file = tmp_path / f"report.{form}"
            measured(*arguments, "--format", form, "-o", str(file), code=code)
            assert opening[:-1].strip() in file.read_text(encoding="utf-8").replace("&#x27;", "'")


def test_the_same_session_is_no_worse_than_its_baseline():
    session = session_of("session.parquet", "--baseline", "before.json")
    assert session["bars"]
    assert all(gate["passed"] for gate in session["bars"])
    assert measured("session.parquet", "--baseline", "before.json").lines[-1] == "passed  baseline  nothing is worse"


@pytest.mark.parametrize("value", ["x", True, [1], {}, math.nan, math.inf, "gone"])
def test_a_measure_of_the_baseline_that_is_no_number_is_refused_and_never_passed_over(here: Path, value: object):
    document = json.loads((here / "before.json").read_text(encoding="utf-8"))
    session = document["sessions"][0]
    if value == "gone":
        del session["jumps_per_s"]
    else:
        session["jumps_per_s"] = value
    with pytest.raises(ContextError, match=r'b\.json: in the baseline "session\.parquet" has no number as "jumps_per_s"'):
        read_baseline(resealed(document), "b.json")


def test_a_baseline_that_was_merged_badly_is_refused_in_words(here: Path):
    text = (here / "before.json").read_text(encoding="utf-8")
    document = json.loads(text)
    merged = text.replace("\n", "\n<<<<<<< HEAD\n", 1)
    for wrong, said in (
        (merged, "line 2 begins a conflict of git"),
        ("[" * 100_000, "lists are nested too deeply"),
        (text.replace('"updates": ', '"updates": ' + "1" * 400), "a number has 40"),
        (resealed({"format": 1, "sessions": document["sessions"] * 2}), '"session.parquet" is there twice'),
    ):
        with pytest.raises(ContextError, match=said):
            read_baseline(wrong, "b.json")


def test_an_altered_digit_of_a_baseline_is_refused_and_one_without_a_digest_too(here: Path):
    document = json.loads((here / "before.json").read_text(encoding="utf-8"))
    document["sessions"][0]["jumps_per_s"] += 9.0
    (here / "before.json").write_text(json.dumps(document), encoding="utf-8")
    assert "its contents do not match its digest" in refused("session.parquet", "--baseline", "before.json")
    del document["digest"]
    (here / "before.json").write_text(json.dumps(document), encoding="utf-8")
    assert "it has no digest" in refused("session.parquet", "--baseline", "before.json")


def test_a_baseline_of_other_sessions_is_refused_with_the_names(here: Path):
    shutil.copy("session.parquet", "other.parquet")
    (here / "both.json").write_text(run("motion", "measure", "session.parquet", "other.parquet", "--json").out, encoding="utf-8")
    assert 'the session "other.parquet" of the baseline is not measured' in refused("session.parquet", "--baseline", "both.json")
    shutil.copy("session.parquet", "third.parquet")
    names = ("session.parquet", "other.parquet", "third.parquet")
    assert 'the baseline has no session "third.parquet"' in refused(*names, "--baseline", "both.json")


def test_a_measure_that_the_baseline_has_and_that_is_missing_now_fails(here: Path):
    shutil.move(here / "game", here / "moved")
    result = measured("session.parquet", "--baseline", "before.json", code=1)
    assert any(line.startswith("FAILED  baseline skate_cm_s") and "not measured, before" in line for line in result.lines)


def test_a_session_of_a_baseline_is_known_however_its_path_is_written(here: Path):
    shutil.copy("session.parquet", "other.parquet")
    both = run("motion", "measure", "session.parquet", "other.parquet", "--json").out
    (here / "both.json").write_text(both, encoding="utf-8")
    sessions = measured("./other.parquet", "session.parquet", "--baseline", "both.json", "--json").json["sessions"]
    assert all(session["bars"] for session in sessions)
    assert [each["file"] for each in json.loads(both)["sessions"]] == ["session.parquet", "other.parquet"]
    assert measured("./session.parquet", "--json").json["sessions"][0]["file"] == "session.parquet"


def test_what_got_worse_than_the_baseline_fails_and_is_told(here: Path):
    document = json.loads((here / "before.json").read_text(encoding="utf-8"))
    now = document["sessions"][0]["jumps_per_s"]
    document["sessions"][0]["jumps_per_s"] = 0.9 * now
    document["sessions"][0]["skate_raw_cm_s"] *= 0.5  # what the clips do is no fault of the session
    (here / "before.json").write_text(resealed(document), encoding="utf-8")
    result = measured("session.parquet", "--baseline", "before.json", code=1)
    (line,) = [line for line in result.lines if line.startswith("FAILED")]
    assert line == f"FAILED  baseline jumps_per_s  jumps a second: {now:.2f}, worse than {0.9 * now:.2f} before."


def test_a_session_whose_project_is_gone_tells_its_jumps_and_why_no_more(here: Path):
    shutil.move(here / "game", here / "moved")
    result = measured("session.parquet")
    assert "its project is no longer at" in result.err
    assert any(line.startswith("not measured, as there are no poses") for line in result.lines)
    assert session_of("session.parquet", "--project", "moved") == session_of("session.parquet", "--project", "moved")
    assert "--max-skate cannot be judged: there are no poses" in measured("session.parquet", "--max-skate", "3", code=2).err


def test_another_database_than_the_recorded_one_is_told(here: Path):
    toml = here / "game" / "contextdb.toml"
    toml.write_text(toml.read_text(encoding="utf-8").replace("at = [0.33, 1.0]", "at = [0.33, 0.9]"), encoding="utf-8")
    assert 'the database "all" is another than the one that the session was recorded with' in measured("session.parquet").err


def test_the_output_of_the_controller_says_how_poses_are_made(here: Path):
    toml = here / "game" / "contextdb.toml"
    toml.write_text(f'{toml.read_text(encoding="utf-8")}root = "code"\n', encoding="utf-8")
    assert session_of("session.parquet")["path_rms_m"] == 0.0


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["none.parquet"], "none.parquet: "),
        (["stick.csv"], "stick.csv: this is not a Parquet file."),
        (["broken.npz"], "broken.npz: the file is damaged, or no .npz file"),
        (["empty.parquet"], "empty.parquet: there is nothing to measure: no moment."),
        (["session.parquet", "--poses", "short.npz"], "session.parquet: there are 9 poses for 151 decisions."),
        (["session.parquet", "--poses", "poses.npz", "--poses", "poses.npz"], "2 files of poses for 1 session."),
        (["poses.npz", "--poses", "poses.npz"], "poses.npz: --poses goes with a session, and these are poses."),
        (["session.parquet", "--controller", "nobody"], "there is no [controllers.nobody]"),
        (["session.parquet", "--project", "nowhere"], "nowhere"),
        (
            ["session.parquet", "--baseline", "stick.csv"],
            "stick.csv: the baseline is not a report of measures: line 1 is no JSON: Expecting value at character 1.",
        ),
        (["session.parquet", "--baseline", "other.json"], 'other.json: the baseline has no session "session.parquet".'),
        (
            ["session.parquet", "--baseline", "newer.json"],
            'newer.json: the baseline is not a report of measures: it has no "format": 1.',
        ),
        (["poses.npz", "--max-path", "1"], "--max-path cannot be judged: the session does not say where the game had the body."),
    ],
)
def test_what_cannot_be_measured_is_refused_in_one_sentence(arguments: list[str], message: str, here: Path):
    (here / "broken.npz").write_bytes(b"PK nothing")
    Trace().save(here / "empty.parquet")
    with np.load("poses.npz") as poses:
        every = ("positions", "root", "asset", "time_s", "mirrored", "jumped", "forced")
        np.savez("short.npz", **{name: poses[name][:9] if name in every else poses[name] for name in poses.files})
    for name, number in (("other", 1), ("newer", 2)):
        (here / f"{name}.json").write_text(resealed({"format": number, "sessions": []}), encoding="utf-8")
    assert message in refused(*arguments)


def test_a_report_goes_to_the_file_of_o_with_the_exit_code_of_what_is_printed(here: Path):
    assert measured("session.parquet", "--format", "html", "-o", "measures.html", "--max-jumps=0", code=1).out == ""
    assert (here / "measures.html").read_text(encoding="utf-8").startswith("<!DOCTYPE html>")


@pytest.mark.parametrize("text", ["-1", "many", "nan", "inf"])
def test_a_bar_is_a_number_from_0_up(text: str):
    assert "is not a bar. Accepted: a number from 0 up." in measured("session.parquet", f"--max-skate={text}", code=2).err
