"""Poses on the live link: the bones once, then poses, to who wants them; their joints are where Python has them."""

import http.client
import json
import shutil
import subprocess
import threading
from pathlib import Path

import numpy as np
import pytest
from c_compilers import C, built
from links import LIMIT_S, listening, meeting, until

import contextdb as cdb
from contextdb import motion
from contextdb.cli import main as run_contextdb
from contextdb.commands import motion_run_command
from contextdb.commands.compile_command import c_motion_header
from contextdb.compiled.c_header import c_header_of, c_link_of
from contextdb.core import place_joints
from contextdb.errors import ContextError
from contextdb.motion.trace import published
from contextdb.telemetry.link.hearing import Wanted, hear
from examples.web import live

__all__ = ["meeting"]
GODOT = Path(live.HERE).parent / "godot"
FACTS = {"gait": "Walk", "style": "normal"}
WALK = """extends SceneTree

const ContextCharacters = preload("res://context_characters.gdns")

var characters = ContextCharacters.new()

func _initialize():
	print(characters.open(ProjectSettings.globalize_path("res://game.motion"), "player", 2))
	print(characters.publish("a/b"))
	print(characters.publish("walk"))

func _idle(_delta):
	for i in range(2):
		print(characters.steer(i, 0.3, 1.3, null, {"gait": "Walk", "style": "normal"}))
	print(characters.update(1.0 / 30.0))
	OS.delay_msec(5)
"""
JOINTS = """
import { places } from LIVE
console.log(JSON.stringify(places(BONES, POSE)))
"""


@pytest.fixture
def link(meeting: Path):
    with cdb.link("poses") as opened:
        yield opened


@pytest.fixture(scope="module")
def tables(tmp_path_factory):
    """The project of the page in examples/web, with its clips."""
    folder = shutil.copytree(live.HERE / "tables", tmp_path_factory.mktemp("page") / "tables")
    (folder / "clips").mkdir()
    motion.write_made_clips(folder / "clips")
    return folder


def walked(link, tables):
    """A character that walks, and publishes the last of its poses; that pose."""
    one = motion.Character.of(cdb.Project.load(tables), "player")
    for _ in range(30):
        updated = one.update(1 / 30, (0.3, 1.3), FACTS)
    link.pose("player", updated.pose, one.stream.rig)
    return one, updated.pose


def listener(link, meeting):
    """One that wants poses, and whom the link knows to."""
    hearing = listening(link, meeting, poses=True)
    until(lambda: link._feed.wants_poses)
    return hearing


def lines_until(hearing, kind):
    """The lines up to the next batch with one of a kind."""
    lines = []
    for batch in hearing.batches():
        lines += [line for _, line in batch]
        if any(line["line"] == kind for line in lines):
            break
    return lines


def test_bones_come_once_and_poses_have_their_joints_where_python_has_them(link, meeting, tables):
    with listener(link, meeting) as hearing:
        one, pose = walked(link, tables)
        lines = lines_until(hearing, "pose")
        link.pose("player", pose, one.stream.rig)
        lines += lines_until(hearing, "pose")
    bones, line, second = (each for each in lines if each["line"] in ("bones", "pose"))
    assert second | {"t": 0} == line | {"t": 0}
    assert (line["who"], line["asset"]) == ("player", pose.playing.asset)
    translations = np.array(bones["offsets"])
    translations[bones["moving"]] = line["translations"]
    places, turns = np.empty(pose.positions.shape), np.empty(pose.rotations.shape)
    place_joints(np.array(bones["parents"]), translations, np.array(line["rotations"]), np.array(line["root"]), places, turns)
    np.testing.assert_allclose(places, pose.positions, atol=1e-3)
    node = shutil.which("node")
    if node is not None:
        script = JOINTS.replace("LIVE", json.dumps(str(live.HERE / "live.js")))
        script = script.replace("BONES", json.dumps(bones)).replace("POSE", json.dumps(line))
        done = subprocess.run([node, "--no-warnings", "--input-type=module", "-e", script], capture_output=True, text=True)
        np.testing.assert_allclose(json.loads(done.stdout), pose.positions, atol=1e-3, err_msg=done.stderr)


def test_who_wants_no_poses_gets_none_and_a_recording_has_none(meeting, tmp_path, tables):
    with cdb.link("poses", record=tmp_path / "game.jsonl") as link, listening(link, meeting) as hearing:
        one, _ = walked(link, tables)
        link.watch(one, "player")
        one.update(1 / 30, (0.0, 1.3), FACTS)
        link.close()
        kinds = [line["line"] for batch in hearing.batches() for _, line in batch]
    assert "decision" in kinds
    assert not {"bones", "pose"} & {*kinds, *(json.loads(line)["line"] for line in (tmp_path / "game.jsonl").open())}


def test_what_is_no_pose_of_a_rig_is_refused(link, tables):
    one, pose = walked(link, tables)
    for wrong in ((None, one.stream.rig), (pose, None), (pose, one.stream)):
        with pytest.raises(ContextError, match="a link cannot publish"):
            link.pose("player", *wrong)


def test_a_run_is_published_in_its_time(meeting, tmp_path, monkeypatch, tables):
    (tmp_path / "stick.csv").write_text("time_s,x_mps,z_mps,gait,style\n0,0,1.4,Walk,normal\n1,0,1.4,Walk,normal\n")
    links, slept, hearings = [], [], []

    def opened(name):
        links.append(cdb.link(name))
        return links[-1]

    def sleep(seconds):
        if not slept:
            hearings.append(hear(meeting / "walk.sock", Wanted(poses=True)))
            until(lambda: links[0]._feed.wants_poses)
        slept.append(seconds)

    monkeypatch.setattr(motion_run_command, "link", opened)
    monkeypatch.setattr(motion_run_command, "sleep", sleep)
    words = [
        "motion",
        "run",
        tables,
        "player",
        tmp_path / "stick.csv",
        "--out",
        tmp_path / "out.parquet",
        "--link",
        "walk",
    ]
    assert run_contextdb([str(word) for word in words]) == 0
    lines = [line for batch in hearings[0].batches() for _, line in batch]
    hearings[0].close()
    assert len(slept) == 31
    assert max(slept) <= 31 / 30
    assert {"bones", "pose", "decision", "end"} <= {line["line"] for line in lines}
    assert {line["who"] for line in lines if "who" in line} == {"walk"}


def test_godot_has_the_joints_where_python_has_them(link, meeting, tables, tmp_path):
    godot = shutil.which("godot3-server")
    if godot is None:
        pytest.skip("godot3-server is not installed: Debian's package of that name runs scripts without a screen")
    shutil.copytree(GODOT, tmp_path, dirs_exist_ok=True)
    one, poses = motion.Character.of(cdb.Project.load(tables), "player"), []
    with live.server("poses", 0) as page:
        threading.Thread(target=page.serve_forever, daemon=True).start()
        words = [godot, "--path", ".", "-s", "receive.gd", f"--port={page.server_port}"]
        playing = subprocess.Popen(words, cwd=tmp_path, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True)
        try:
            until(lambda: link._feed.wants_poses)
            with hear(meeting / "poses.sock", Wanted(poses=True)) as hearing:
                for tick in range(60):
                    poses.append(one.update(1 / 10, (1.3 if tick > 30 else 0.0, 1.3), FACTS).pose)
                    link.pose("player", poses[-1], one.stream.rig)
                    lines_until(hearing, "pose")
            link.close()
            _, stderr = playing.communicate(timeout=LIMIT_S)
        finally:
            playing.kill()
            page.shutdown()
    assert "SCRIPT ERROR" not in stderr, stderr
    lines = [json.loads(line) for line in (tmp_path / "received.jsonl").read_text(encoding="utf-8").splitlines()]
    assert [line["asset"] for line in lines] == [pose.playing.asset for pose in poses]
    assert len({line["asset"] for line in lines}) > 1
    np.testing.assert_allclose([line["places"] for line in lines], [pose.positions for pose in poses], atol=1e-4)


def test_a_game_in_godot_publishes_what_python_plays(meeting, tables, tmp_path):
    godot = shutil.which("godot3-server")
    if godot is None:
        pytest.skip("godot3-server is not installed: Debian's package of that name runs scripts without a screen")
    shutil.copytree(GODOT, tmp_path, dirs_exist_ok=True)
    headers = {
        "contextdb_motion.h": c_motion_header(c_header_of({}, "CDB_MOTION_READER_H")),
        "tables.h": c_header_of({}),
        "cdb_link.h": c_link_of({}, "tables.h"),
    }
    for name, text in {**headers, "game.gd": WALK}.items():
        (tmp_path / name).write_text(text, encoding="ascii")
    built(tmp_path / "contextdb_godot.c", tmp_path / "libcontextdb.so", C, "-fPIC", "-shared", "-ffp-contract=off")
    assert run_contextdb(["motion", "build", str(tables), "--bundle", str(tmp_path / "game.motion")]) == 0
    playing = subprocess.Popen([godot, "--path", ".", "-s", "game.gd"], cwd=tmp_path, stdout=subprocess.PIPE, text=True)
    lines = []
    try:
        until(lambda: (meeting / "walk.sock").exists())
        with hear(meeting / "walk.sock", Wanted(poses=True)) as hearing:
            while sum(line["line"] == "pose" for line in lines) < 60:
                lines += lines_until(hearing, "pose")
    finally:
        playing.kill()
        stdout, _ = playing.communicate()
    assert {*stdout.splitlines()[2:]} == {"", "walk"}, stdout
    one = motion.Character.of(cdb.Project.load(tables), "player")
    expected = [published.pose(one.update(1 / 30, (0.3, 1.3), FACTS).pose, one.stream.rig) for _ in range(3000)]
    numbers = np.array([numbers_of(pose) for pose in expected])
    for who in ("0", "1"):
        bones, *poses = (line for line in lines if line.get("who") == who)
        assert (bones["names"], bones["parents"]) == (list(one.stream.rig.skeleton.names), one.stream.rig.joints[0].tolist())
        own = np.array([numbers_of(pose) for pose in poses])
        first = np.abs(numbers - own[0]).max(axis=1).argmin()  # it was heard from some update on
        np.testing.assert_allclose(own, numbers[first : first + len(own)], atol=2e-5)
        assert [pose["asset"] for pose in poses] == [pose["asset"] for pose in expected[first : first + len(own)]]


def numbers_of(pose):
    return [*pose["root"], *np.ravel(pose["rotations"])]


def test_the_page_gets_the_lines_and_no_other_page_does(link, meeting, tables):
    with live.server("poses", 0) as page:
        threading.Thread(target=page.serve_forever, daemon=True).start()
        try:
            asked = http.client.HTTPConnection("127.0.0.1", page.server_port)
            asked.request("GET", "/lines")
            until(lambda: link._feed.wants_poses)
            walked(link, tables)
            answer = asked.getresponse()
            events = [json.loads(answer.readline()[6:]) if i % 2 == 0 else answer.readline() for i in range(3)]
            assert [events[0]["line"], events[1], events[2]["line"]] == ["bones", b"\n", "pose"]
            asked.close()
            for path, host, status in (
                ("/", None, 200),
                ("/live.js", None, 200),
                ("/../live.py", None, 404),
                ("/", "elsewhere:80", 403),
            ):
                asked = http.client.HTTPConnection("127.0.0.1", page.server_port)
                asked.request("GET", path, headers={} if host is None else {"Host": host})
                assert asked.getresponse().status == status
                asked.close()
        finally:
            page.shutdown()
