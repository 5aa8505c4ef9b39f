"""Clips that take long to read: that is said, and can be interrupted; files that did not change are not read again."""

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest
from clip_files import BODY, Moving, fbx, gltf
from made_once import make_clip
from running import run
from strategies import IS_FULL

from contextdb import motion
from contextdb.motion.clips import source
from contextdb.motion.storage.building import build_all


def long_body(n_frames: int) -> Moving:
    """A made walk again and again, at 60 frames a second."""
    body = Moving.of(make_clip("walk").clip)
    frames = np.arange(n_frames) % len(body.root)
    return Moving(body.names, body.parents, body.offsets, body.rotations[frames], body.root[frames], 60.0)


def test_a_file_that_is_read_for_long_is_reported(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    motion.write_bvh(make_clip("walk").clip, tmp_path / "walk.bvh")
    assert "reading" not in run("motion", "bones", tmp_path / "walk.bvh").err
    monkeypatch.setattr("contextdb.console.VERY_MANY_BYTES", 1000)
    monkeypatch.setattr("contextdb.console.MANY_BYTES", 1000)
    monkeypatch.setattr("contextdb.console.TELL_S", 0.05)
    real = source.parse_bvh

    def slow(*words: object, **others: object) -> motion.Clip:
        time.sleep(0.3)
        return real(*words, **others)

    monkeypatch.setattr(source, "parse_bvh", slow)
    err = run("motion", "bones", tmp_path / "walk.bvh").err
    assert f"contextdb: reading {tmp_path / 'walk.bvh'}, 0.1 MB\n" in err
    assert f"contextdb: still reading {tmp_path / 'walk.bvh'}, for 0 s\n" in err


def test_takes_are_asked_of_a_file_once_and_again_when_it_changes(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    path = tmp_path / "all.glb"
    path.write_bytes(gltf(BODY, takes=("Walk", "Run")))
    assert source.takes_of(path) == ("Walk", "Run")
    with monkeypatch.context() as patch:
        patch.setattr(source.ClipSource, "of", lambda path: pytest.fail("it is read again"))
        assert source.takes_of(path) == ("Walk", "Run")
    path.write_bytes(gltf(BODY, takes=("Walk", "Run", "Jump")))
    assert source.takes_of(path) == ("Walk", "Run", "Jump")


def test_files_that_did_not_change_are_not_parsed_again(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    pytest.importorskip("ufbx", reason="needs the extra fbx")
    (tmp_path / "clips").mkdir()
    body = Moving.of(make_clip("walk").clip)
    (tmp_path / "clips/a.fbx").write_bytes(fbx(body))
    (tmp_path / "clips/b.glb").write_bytes(gltf(body))
    features = {"jog": {"rate": 30.0, "channels": [{"type": "position", "bone": "LeftFoot"}]}}
    databases = {"jog": {"clips": "clips/*.{fbx,glb}", "features": "jog"}}
    config = motion.MotionConfig.from_dict({"features": features, "databases": databases})
    assert build_all(config, tmp_path)["jog"].computed == ("a", "b")
    monkeypatch.setattr(source.ClipSource, "clip", lambda *_, **__: pytest.fail("it is read again"))
    assert build_all(config, tmp_path)["jog"].computed == ()
    os.utime(tmp_path / "clips/a.fbx")  # by its bytes, and not by its time
    assert build_all(config, tmp_path)["jog"].computed == ()


@pytest.mark.skipif(not IS_FULL, reason="with EXAMPLES=full: a file of 500 MB is written")
@pytest.mark.skipif(not Path("/proc/self/stat").exists(), reason="the time that a process works is not to be had here")
def test_a_file_of_500_mb_stops_soon_after_an_interruption(tmp_path: Path):
    line = b"; " + b"x" * 200 + b"\n"
    with (tmp_path / "large.fbx").open("wb") as file:
        file.write(fbx(long_body(600)))
        file.write(line * (500_000_000 // len(line)))
    command = [sys.executable, "-m", "contextdb", "motion", "bones", str(tmp_path / "large.fbx")]
    process = subprocess.Popen(command, stderr=subprocess.PIPE)
    assert process.stderr is not None
    assert b"reading" in process.stderr.readline()
    before = last = worked_s(process.pid)
    process.send_signal(signal.SIGINT)
    while process.poll() is None:
        last = worked_s(process.pid) or last
        time.sleep(0.01)
    assert process.returncode == 130
    assert last - before < 1.0


def worked_s(pid: int) -> float:
    """How long a process has worked, in seconds of CPU; 0 where it has ended."""
    try:
        fields = Path(f"/proc/{pid}/stat").read_text("ascii").rpartition(")")[2].split()
    except OSError:
        return 0.0
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")
