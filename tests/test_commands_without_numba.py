"""Without numba every command that asks compiled loops prints the same, and writes the same bytes."""

from __future__ import annotations

import hashlib
import json
import os
import subprocess
import sys
from pathlib import Path

import pytest
from motion_project import work_in_copy, write_project
from running import ROOT, run

MOMENTS = "gait,speed,style\n" + "".join(
    f"{('Idle', 'Walk', 'Run')[i % 3]},{i % 7},{('normal', 'tired')[i % 2]}\n" for i in range(60)
)
STICK = "time_s,speed_mps,gait,speed,style\n0,1.3,Walk,1.2,normal\n1,1.3,Walk,1.2,tired\n3,0,Idle,0,tired\n"
FACTS = ("gait=Walk", "speed=1.2", "style=tired")
ASKED = ("--query", "walk@0.5", "--speed", "1.3", "--turn", "30")
COMMANDS = (
    ("query", "game/moves.csv", *FACTS, "--explain"),
    ("check", "game", "--format", "json"),
    ("coverage", "game", "--format", "json"),
    ("coverage", "game/moves.csv", "--telemetry", "moments.csv", "--format", "json"),
    ("evaluate", "game/moves.csv", "moments.csv"),
    ("compile", "game", "-o", "built"),
    ("motion", "describe", "game/clips"),
    ("motion", "prepare", "game"),
    ("motion", "check", "game"),
    ("motion", "build", "game", "--out", "built", "--poses"),
    ("motion", "coverage", "game"),
    ("motion", "search", "game", "all", *FACTS, *ASKED),
    ("motion", "select", "game", "moves", *FACTS, *ASKED),
    ("motion", "run", "game", "player", "stick.csv", "--out", "session.parquet", "--poses", "poses.npz"),
    ("motion", "replay", "session.parquet", "--at", "2.5s"),
    ("motion", "measure", "session.parquet", "--project", "game"),
    ("motion", "probe", "game", "player", "--drive", "circle", "--speed", "1.3"),
)


def answers() -> list[list[object]]:
    """What the commands print in this folder, and what they leave there."""
    told: list[list[object]] = []
    for command in COMMANDS:
        result = run(*command)
        told.append([" ".join(command), result.code, result.out])
    files = (file for file in sorted(Path().rglob("*")) if file.is_file())
    return told + [[file.as_posix(), hashlib.sha256(file.read_bytes()).hexdigest()] for file in files]


def test_commands_answer_the_same_without_numba(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    pytest.importorskip("numba")
    write_project(tmp_path / "made" / "game")
    (tmp_path / "made" / "stick.csv").write_text(STICK)
    (tmp_path / "made" / "built").mkdir()
    (tmp_path / "made" / "moments.csv").write_text(MOMENTS)
    work_in_copy(tmp_path / "made", tmp_path, monkeypatch)
    script = (
        "import json, sys; sys.modules['numba'] = None; import test_commands_without_numba as own; print(json.dumps(own.answers()))"
    )
    paths = os.pathsep.join([str(ROOT), str(ROOT / "tests")])
    done = subprocess.run(
        [sys.executable, "-c", script],
        capture_output=True,
        text=True,
        cwd=tmp_path / "made",
        env={**os.environ, "PYTHONPATH": paths},
    )
    assert done.returncode == 0, done.stderr
    here = answers()
    assert {line[1] for line in here[: len(COMMANDS)]} <= {0, 1}
    assert json.loads(done.stdout) == here
