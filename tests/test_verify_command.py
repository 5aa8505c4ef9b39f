"""`contextdb verify`: a flipped bit in any file of ours is found, and files that hold no digest are said to hold none."""

import json
import os
import shutil
from collections.abc import Callable
from pathlib import Path

import pytest
from made_once import make_clip
from running import ROOT, run

import contextdb as cdb
from contextdb import motion
from contextdb.commands.verify_command import UNUSABLE, verified
from contextdb.disk import write_atomic
from contextdb.files.journal_lines import line_of
from contextdb.files.reports import document_of, sealed, with_marks
from contextdb.motion.storage.pose_files import save_poses
from contextdb.motion.storage.stored import save_database
from contextdb.report import render
from contextdb.report.measure_results import MeasureResults
from contextdb.report.motion_coverage_results import MotionCoverageResults
from contextdb.report.render_json import as_json

EXAMPLES = os.environ.get("EXAMPLES")
TABLE = {"Asset": ["walk", "run"], "speed": ["0..4", "Any"]}
SCHEMA = {"speed": {"type": "number", "min": 0, "max": 10}}


def compiled(path: Path) -> None:
    cdb.Table.from_columns(TABLE, SCHEMA).compile().save(path)


def table(path: Path) -> None:
    cdb.Table.from_columns(TABLE, SCHEMA).save(path)


def database(path: Path) -> None:
    features = motion.MotionDatabase.from_features([[0.0, 1.0], [1.0, 0.0], [0.5, 0.5]], [0, 2], [2, 3], ["walk", "run"])
    save_database(features, path)


def poses(path: Path) -> None:
    clips = [make_clip("idle").clip]
    channels = [{"type": "position", "bone": "LeftFoot"}]
    schema = motion.FeatureSchema.from_dict("loco", {"rate": 2.0, "channels": channels})
    save_poses(motion.PoseBank.build(clips, schema), path)


def session(path: Path) -> None:
    motion.Trace().save(path)


def report(path: Path) -> None:
    folder = path.parent / "tables"
    folder.mkdir(exist_ok=True)
    (folder / "t.csv").write_text("Asset,speed,Höhe\nwalk,0..4,1e-5..0.1\n", encoding="utf-8")
    assert run("coverage", str(folder), "--format", "json", "-o", str(path)).code == 0


def motion_report(path: Path) -> None:
    path.write_text(render("json", MotionCoverageResults(())), encoding="utf-8")


def measures(path: Path) -> None:
    path.write_text(render("json", MeasureResults(())), encoding="utf-8")


def journal(path: Path) -> None:
    write_atomic(path, line_of({"format": 1, "file": "t.csv"}) + line_of({"do": {"name": "x"}}) + line_of({"go": 0}))


MAKERS: dict[str, Callable[[Path], None]] = {
    "t.safetensors": compiled,
    "t.parquet": table,
    "jog.motion.safetensors": database,
    "jog.poses.safetensors": poses,
    "session.parquet": session,
    "coverage.json": report,
    "motion.json": motion_report,
    "measures.json": measures,
    "t.csv.journal": journal,
}


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("made")
    for name, make in MAKERS.items():
        make(folder / name)
    return folder


@pytest.mark.parametrize("name", MAKERS)
def test_a_file_as_it_was_written_is_whole(name: str, made: Path):
    result = run("verify", str(made / name), "--json")
    assert (result.code, result.json["format"], [f["state"] for f in result.json["files"]]) == (0, 1, ["whole"])


@pytest.mark.parametrize("name", MAKERS)
def test_no_flipped_bit_of_a_file_with_a_digest_passes(name: str, made: Path, tmp_path: Path):
    """Every bit with EXAMPLES=full; every day some of them, and all of the marks and the digests at both ends."""
    raw = (made / name).read_bytes()
    ends = 8 * 40
    steps = 1 if EXAMPLES == "full" else max(1, 8 * len(raw) // 600) | 1
    bits = {*range(0, 8 * len(raw), steps), *range(ends), *range(8 * len(raw) - ends, 8 * len(raw))}
    altered = tmp_path / name
    passed = []
    for bit in sorted(bits):
        flipped = bytearray(raw)
        flipped[bit // 8] ^= 1 << bit % 8
        altered.write_bytes(flipped)
        if verified(altered).state not in UNUSABLE:
            passed.append((bit // 8, bit % 8))
    assert passed == []


@pytest.mark.parametrize("name", ["coverage.json", "motion.json", "measures.json", "t.parquet", "session.parquet"])
def test_no_flipped_bit_of_a_mark_turns_a_file_into_that_of_another_program(name: str, made: Path, tmp_path: Path):
    raw = (made / name).read_bytes()
    marks = [b'"format"', b'"writer"', b'"contextdb"', b'"digest"', b"contextdb.file", b"sealed", b"contextdb.seal", b"Polars"]
    for mark in [mark for mark in marks if mark in raw]:
        at = raw.rindex(mark) - 3
        for bit in range(8 * at, 8 * (at + len(mark) + 3)):
            flipped = bytearray(raw)
            flipped[bit // 8] ^= 1 << bit % 8
            (tmp_path / name).write_bytes(flipped)
            assert run("verify", str(tmp_path / name)).code == 1, (mark, bit)


def test_a_folder_is_looked_through_and_a_damaged_file_in_it_exits_with_1(made: Path, tmp_path: Path):
    shutil.copytree(made, tmp_path / "all")
    assert run("verify", str(tmp_path / "all")).code == 0
    raw = (tmp_path / "all/t.parquet").read_bytes()
    (tmp_path / "all/t.parquet").write_bytes(raw[:40] + bytes([raw[40] ^ 4]) + raw[41:])
    result = run("verify", str(tmp_path / "all"))
    assert result.code == 1
    assert [line.split()[1:2] for line in result.lines if line.startswith("DAMAGED")] == [[str(tmp_path / "all/t.parquet")]]


def test_tables_in_csv_are_readable_and_hold_no_digest():
    result = run("verify", str(ROOT / "tables/locomotion.csv"))
    assert result.code == 0
    assert result.out.startswith("readable  ")
    assert "hold no digest" in result.out


@pytest.mark.parametrize(
    ("name", "said"),
    [
        ("README.md", "not a file of contextdb"),
        ("nowhere.json", "no such file"),
        ("nowhere", "no such file"),
        (".ci", "holds no file of contextdb"),
    ],
)
def test_what_is_no_file_of_ours_exits_with_2(name: str, said: str):
    result = run("verify", str(ROOT / name))
    assert (result.code, said in result.err) == (2, True)


@pytest.mark.parametrize("name", ["coverage.json", "motion.json", "measures.json"])
def test_an_altered_report_is_not_taken_for_that_of_another_command(name: str, made: Path, tmp_path: Path):
    text = (made / name).read_text(encoding="utf-8")
    (tmp_path / name).write_text(text.replace('"format": 1', '"format": 1, "more": 2', 1), encoding="utf-8")
    said = run("verify", str(tmp_path / name)).out
    assert "its contents do not match its digest. Accepted: a document as it was written." in said


def test_a_document_of_another_program_is_neither_whole_nor_damaged(tmp_path: Path):
    (tmp_path / "package.json").write_text('{"name": "x"}', encoding="utf-8")
    result = run("verify", str(tmp_path / "package.json"), "--json")
    assert (result.code, result.json["files"][0]["state"]) == (0, "no-digest")


@pytest.mark.parametrize("name", ["coverage.json", "motion.json", "measures.json"])
def test_a_report_of_ours_without_its_digest_is_damaged(name: str, made: Path, tmp_path: Path):
    document = json.loads((made / name).read_text(encoding="utf-8"))
    del document["digest"]
    (tmp_path / name).write_text(json.dumps(document), encoding="utf-8")
    result = run("verify", str(tmp_path / name))
    assert (result.code, "it has no digest" in result.out) == (1, True)


@pytest.mark.parametrize(("old", "new"), [(b"\n", b"\r\n"), (b"{", b"\xef\xbb\xbf{")])
def test_a_report_keeps_its_digest_under_other_line_ends_and_with_a_byte_order_mark(
    old: bytes, new: bytes, made: Path, tmp_path: Path
):
    raw = (made / "coverage.json").read_bytes().replace(old, new, 1 if old == b"{" else -1)
    (tmp_path / "coverage.json").write_bytes(raw)
    assert run("verify", str(tmp_path / "coverage.json"), "--json").json["files"][0]["state"] == "whole"


def test_a_number_that_is_only_written_otherwise_is_found(made: Path, tmp_path: Path):
    text = (made / "coverage.json").read_text(encoding="utf-8")
    assert '"seed": 0,' in text
    (tmp_path / "coverage.json").write_text(text.replace('"seed": 0,', '"seed": -0,'), encoding="utf-8")
    assert run("verify", str(tmp_path / "coverage.json")).code == 1


def test_a_report_about_names_that_are_no_text_matches_its_digest():
    text = sealed(as_json(with_marks({"format": 1, "sessions": [{"file": "z\udcfcge.parquet", "seconds": 1}]})))
    assert document_of(text)["sessions"][0]["seconds"] == 1


def test_a_file_of_an_older_layout_is_called_older_with_what_renews_it():
    result = run("verify", str(ROOT / "tests/written_before/walk.database.safetensors"))
    assert (result.code, result.out.split()[0]) == (1, "OLDER")
    assert "layout 1, of an older version; this one reads 4. Try to build it again with `contextdb motion build`." in result.out


@pytest.mark.parametrize("name", ["t.safetensors", "jog.motion.safetensors", "jog.poses.safetensors", "session.parquet"])
def test_a_file_of_a_layout_that_this_version_does_not_read_is_no_damaged_one(
    name: str, made: Path, monkeypatch: pytest.MonkeyPatch
):
    known = {"contextdb", "contextdb.motion", "contextdb.poses", "contextdb.trace"}
    monkeypatch.setattr("contextdb.files.tensors.metadata_of", lambda *_: dict.fromkeys(known & {layout_key(name)}, "9"))
    monkeypatch.setattr("contextdb.motion.trace.session_file.FORMAT", 8)
    result = run("verify", str(made / name), "--json")
    state = "older" if name.endswith(".parquet") else "newer"
    assert (result.code, [each["state"] for each in result.json["files"]]) == (1, [state])


def layout_key(name: str) -> str:
    return {"t": "contextdb", "jog.motion": "contextdb.motion", "jog.poses": "contextdb.poses"}.get(name.rpartition(".")[0], "")


@pytest.mark.parametrize("about", ["tables", "sessions"])
def test_a_report_of_a_newer_version_is_called_newer(about: str, tmp_path: Path):
    (tmp_path / "r.json").write_text(sealed(as_json(with_marks({"format": 2, about: []}))), encoding="utf-8")
    (verdict,) = run("verify", str(tmp_path / "r.json"), "--json").json["files"]
    assert (verdict["state"], "to install that version" in verdict["message"]) == ("newer", True)


def test_a_journal_of_a_newer_version_is_called_newer(tmp_path: Path):
    write_atomic(tmp_path / "t.csv.journal", line_of({"format": 2, "file": "t.csv"}))
    (verdict,) = run("verify", str(tmp_path / "t.csv.journal"), "--json").json["files"]
    assert verdict["state"] == "newer"


def test_a_journal_with_an_altered_line_says_how_many_edits_are_lost(tmp_path: Path):
    journal(tmp_path / "t.csv.journal")
    raw = (tmp_path / "t.csv.journal").read_bytes().replace(b'"x"', b'"y"')
    (tmp_path / "t.csv.journal").write_bytes(raw)
    result = run("verify", str(tmp_path / "t.csv.journal"))
    assert (result.code, "line 2 is altered, and 2 lines cannot be used" in result.out) == (1, True)
