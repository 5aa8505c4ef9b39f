"""What long commands say on standard error where that is no terminal, as in a log of continuous integration."""

import json
from importlib import import_module
from pathlib import Path

import pytest
from running import run

from contextdb.commands.progress import log_of
from contextdb.tables.project import load_table


def test_a_log_gets_one_line_for_each_tenth(capsys: pytest.CaptureFixture[str]):
    log = log_of("measuring t", True)
    assert log is not None
    for done in range(1001):
        log(done, 1000, "Counting contexts")
    lines = capsys.readouterr().err.splitlines()
    assert lines == [f"contextdb: measuring t: {10 * tenth} % Counting contexts" for tenth in range(11)]


def test_a_log_is_not_told_of_a_small_table(capsys: pytest.CaptureFixture[str]):
    log = log_of("measuring t", False)
    assert log is not None
    log(10, 1000, "Counting contexts")
    assert capsys.readouterr().err == ""


def test_work_that_gets_long_is_told_of_however_small_the_table(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
):
    seconds = iter([100.0, 105.0, 110.0, 110.5, 111.0])
    monkeypatch.setattr("contextdb.commands.progress.process_time", lambda: next(seconds))
    log = log_of("measuring t", False)
    assert log is not None
    for tenth in range(1, 5):
        log(100 * tenth, 1000, "Counting contexts")
    assert capsys.readouterr().err.splitlines() == [f"contextdb: measuring t: {n} % Counting contexts" for n in (30, 40)]


@pytest.mark.parametrize("command", ["query", "check", "compile", "coverage"])
def test_a_command_says_that_it_reads_a_large_file_and_the_library_is_silent(
    command: str, monkeypatch: pytest.MonkeyPatch, tmp_path: Path, capsys: pytest.CaptureFixture[str]
):
    (tmp_path / "t.csv").write_text("Asset,up\na,True\n", encoding="utf-8")
    assert "reading" not in run(command, tmp_path / "t.csv").err
    monkeypatch.setattr("contextdb.console.MANY_BYTES", 10)
    assert f"contextdb: reading {tmp_path / 't.csv'}, 0.0 MB\n" in run(command, tmp_path / "t.csv").err
    load_table(tmp_path / "t.csv")
    assert capsys.readouterr().err == ""


@pytest.mark.parametrize("command", ["check", "coverage"])
def test_a_large_table_is_told_of(command: str, monkeypatch: pytest.MonkeyPatch, tmp_path: Path):
    monkeypatch.setattr("contextdb.commands.progress.MANY_CELLS", 4)
    (tmp_path / "t.csv").write_text("Asset,up,down\na,True,Any\nb,Any,True\n", encoding="utf-8")
    result = run(command, str(tmp_path / "t.csv"))
    lines = [line for line in result.err.splitlines() if " % " in line]
    assert lines
    assert all(line.startswith("contextdb: ") for line in lines)
    assert " % " not in run(command, str(tmp_path / "t.csv"), "--format", "json").out.split("{")[0]


def test_a_log_is_told_of_the_pairs_too(monkeypatch: pytest.MonkeyPatch, tmp_path: Path):
    monkeypatch.setattr("contextdb.commands.progress.MANY_CELLS", 4)
    (tmp_path / "t.csv").write_text("Asset,up,down\na,True,Any\nb,Any,True\n", encoding="utf-8")
    told = run("coverage", str(tmp_path / "t.csv")).err
    assert "contextdb: comparing conditions of t: 0 % Comparing conditions\n" in told


@pytest.mark.parametrize("form", ["text", "markdown", "html"])
def test_pairs_of_too_many_conditions_are_left_out_and_that_is_said(form: str, monkeypatch: pytest.MonkeyPatch, tmp_path: Path):
    (tmp_path / "t.csv").write_text("Asset,up,down\na,True,Any\nb,Any,True\n", encoding="utf-8")
    said = "Pairs of conditions are not compared: the table has 2 conditions, and at most 1 are."
    assert said not in run("coverage", str(tmp_path / "t.csv"), "--format", form).out
    monkeypatch.setattr(import_module("contextdb.covering.pairs"), "MOST_CONDITIONS", 1)
    assert said in " ".join(run("coverage", str(tmp_path / "t.csv"), "--format", form).out.split())


def test_the_json_tells_pairs_that_are_left_out_from_pairs_that_are_all_covered(monkeypatch: pytest.MonkeyPatch, tmp_path: Path):
    (tmp_path / "t.csv").write_text("Asset,up,down\na,Any,Any\n", encoding="utf-8")

    def pairs_of() -> tuple[object, object]:
        entry = json.loads(run("coverage", str(tmp_path / "t.csv"), "--format", "json").out)["tables"][0]
        return entry["pairs"], entry["pairs_left_out"]

    assert pairs_of() == ([], False)
    monkeypatch.setattr(import_module("contextdb.covering.pairs"), "MOST_CONDITIONS", 1)
    assert pairs_of() == ([], True)


@pytest.mark.parametrize("command", [("coverage", "t.csv", "--telemetry", "seen*.csv"), ("evaluate", "t.csv", "seen*.csv")])
def test_a_log_is_told_of_long_recordings(command: tuple[str, ...], monkeypatch: pytest.MonkeyPatch, tmp_path: Path):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "t.csv").write_text("Asset,up,down\na,True,Any\nb,Any,True\n", encoding="utf-8")
    for name in ("seen1.csv", "seen2.csv"):
        (tmp_path / name).write_text("up,down\nTrue,False\n", encoding="utf-8")
    label = "reading telemetry for t" if command[0] == "coverage" else "evaluating"
    size = sum((tmp_path / name).stat().st_size for name in ("seen1.csv", "seen2.csv"))
    for least, is_told in ((size, True), (size + 1, False)):
        monkeypatch.setattr("contextdb.commands.progress.MANY_BYTES", least)
        lines = [line for line in run(*command).err.splitlines() if line.startswith(f"contextdb: {label}: ")]
        assert (lines[-1:] == [f"contextdb: {label}: 100 %"]) is is_told
        assert (f"contextdb: {label}: 50 %" in lines) is is_told
        assert len(lines) == len(set(lines))
