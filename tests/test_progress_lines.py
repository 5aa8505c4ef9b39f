"""What long commands say on standard error where that is no terminal, as in a log of continuous integration."""

from __future__ import annotations

from pathlib import Path

import pytest
from running import run

from contextdb.commands.coverage_telemetry import MANY_CELLS, log_of
from contextdb.covering import count, coverage
from contextdb.covering.progress import PREPARING
from contextdb.tables.table import Table


def test_a_log_gets_one_line_for_each_tenth(capsys: pytest.CaptureFixture[str]):
    log = log_of("measuring t", MANY_CELLS)
    assert log is not None
    for done in range(1001):
        log(done, 1000, "Counting contexts")
    lines = capsys.readouterr().err.splitlines()
    assert lines == [f"contextdb: measuring t: {10 * tenth} % Counting contexts" for tenth in range(11)]


def test_a_small_table_is_not_told_of():
    assert log_of("measuring t", MANY_CELLS - 1) is None


@pytest.mark.parametrize("command", ["check", "coverage"])
def test_a_large_table_is_told_of(command: str, monkeypatch: pytest.MonkeyPatch, tmp_path: Path):
    monkeypatch.setattr("contextdb.commands.coverage_telemetry.MANY_CELLS", 4)
    (tmp_path / "t.csv").write_text("Asset,up,down\na,True,Any\nb,Any,True\n", encoding="utf-8")
    result = run(command, str(tmp_path / "t.csv"))
    lines = [line for line in result.err.splitlines() if " % " in line]
    assert lines
    assert all(line.startswith("contextdb: ") for line in lines)
    assert " % " not in run(command, str(tmp_path / "t.csv"), "--format", "json").out.split("{")[0]


def test_the_first_count_on_a_machine_says_that_it_is_prepared(monkeypatch: pytest.MonkeyPatch):
    prepared: list[object] = []
    monkeypatch.setattr("contextdb.covering.engine.is_prepared", lambda: False)
    monkeypatch.setattr("contextdb.covering.engine.prepare", prepared.append)
    told: list[str] = []
    coverage(
        Table.from_columns({"Asset": ["a"], "up": ["True"]}, {"up": {"type": "bool"}}), progress=lambda part, _: told.append(part)
    )
    assert PREPARING in told
    assert told.index(PREPARING) < told.index("Counting contexts")
    assert len(prepared) == 1


def test_a_loop_that_was_compiled_is_prepared():
    count.prepare(count.SILENT)
    assert count.is_prepared()
