"""`contextdb motion build --bundle` and `contextdb compile --c-motion`: what a game in C takes, and what is refused."""

from pathlib import Path

import numpy as np
import pytest
from c_compilers import PROGRAMS, all_compilers, compiled, ran, sanitizers
from motion_project import TOML, write_project
from running import run

import contextdb as cdb
from contextdb.commands.compile_command import c_motion_header
from contextdb.compiled.c_header import c_header_of
from contextdb.errors import ContextError
from contextdb.motion import Character, JointNode, MotionConfig, OneOff, Steered, open_or_build
from contextdb.motion.made.game import write_joint_clips


@pytest.fixture
def game(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    write_project(tmp_path / "game")
    monkeypatch.chdir(tmp_path)
    return tmp_path / "game"


def test_a_bundle_holds_tables_databases_poses_and_controllers(game: Path):
    assert run("motion", "build", "game", "--bundle", "out/game.motion").code == 0
    octets = (game.parent / "out" / "game.motion").read_bytes()
    size, _, n_parts = np.frombuffer(octets[8:32], "<u8").tolist()
    assert (octets[:8], size) == (b"CDBMOTN2", len(octets))
    entries = np.frombuffer(octets[64 : 64 + 24 * n_parts], "<u8").reshape(-1, 3)
    assert (entries[:, 1] % 64 == 0).all()
    assert (entries[:, 1] + entries[:, 2] <= len(octets)).all()
    assert {37, 38} <= {kind & 0xFFFFFFFF for kind in entries[:, 0].tolist()}  # what match nodes need: warps, and where clips end
    assert {"moves", "player"} <= {
        octets[at : at + n - 1].decode() for kind, at, n in entries.tolist() if kind & 0xFFFFFFFF in (81, 91)
    }


JOINT = """
[conditions."Host.mood"]
type = "enum"
values = ["glad", "cross"]
[conditions."Guest.hand"]
type = "enum"
values = ["free", "full"]
[databases.greetings]
table = "greetings"
clips = "greetings/*.bvh"
features = "loco"
roles = ["Host", "Guest"]
[tables.greetings]
"""
GREETINGS = "Asset Name,Host.mood,Guest.hand\ngreet_walk,glad,free\ngreet_run,glad,free\n"


@pytest.fixture
def meeting(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The same game, whose player may be cast for joint clips."""
    game = tmp_path / "game"
    write_project(game, toml=TOML.replace('selector = "moves"', 'selector = "moves"\njoint = ["greetings"]') + JOINT)
    (game / "greetings").mkdir()
    write_joint_clips(game / "greetings")
    (game / "greetings.csv").write_text(GREETINGS)
    monkeypatch.chdir(tmp_path)
    return game


def test_characters_of_a_crowd_in_c_play_a_joint_clip_as_those_of_python(meeting: Path):
    assert run("motion", "build", "game", "--bundle", "game.motion").code == 0
    Path("contextdb_motion.h").write_text(c_motion_header(c_header_of({}, "CDB_MOTION_READER_H")), encoding="ascii")
    if not all_compilers():
        pytest.skip("no gcc or clang was found")
    command = [*all_compilers()[0], "-std=c99", "-ffp-contract=off", *sanitizers(*all_compilers()[0])]
    cost, *lines = ran(
        compiled(command, PROGRAMS / "meet.c", meeting.parent / "meet", meeting.parent, "-lm"), Path("game.motion")
    ).splitlines()

    project = cdb.Project.load(meeting)
    config = MotionConfig.from_dict(project.schema.motion)
    both = [
        Character.of(project, "player", body=Steered(position=at, heading=way))
        for at, way in (((0.0, 0.0), 0.0), ((0.3, 4.5), 3.0))
    ]
    facts, sticks = {"gait": "Walk", "style": "normal"}, ((0.0, 1.3), (0.0, -1.3))
    for _ in range(30):
        for one, stick in zip(both, sticks, strict=True):
            one.update(1 / 30, stick, facts)
    people = [{"id": i, "mood": mood, "hand": "free"} for i, mood in enumerate(("cross", "glad"))]
    valid = project.tables["greetings"].compile().query({}, actors={"Host": people, "Guest": people})
    roots = {i: one.root for i, one in enumerate(both)}
    places = {i: (root.left_m, root.ahead_m, root.turn_rad) for i, root in roots.items()}
    searcher = config.joint_searcher("greetings", open_or_build(config, meeting, {"greetings": ["greet_walk", "greet_run"]}))
    play = JointNode(searcher).enter({i: one.features() for i, one in enumerate(both)}, places, valid=valid)
    assert play is not None
    assert (float(cost), play.hit.cast) == (play.hit.cost, {"Host": 1, "Guest": 0})
    once = [OneOff(both[i], play.plays[role], "greetings") for i, role in ((0, "Guest"), (1, "Host"))]
    for line in lines:
        poses = [one.update(1 / 30, stick, facts).pose for one, stick in zip(once, sticks, strict=True)]
        words = line.split()
        assert words[::4] == [f"{play.hit.asset}.Guest", f"{play.hit.asset}.Host"]
        assert [list(map(float, words[at : at + 3])) for at in (1, 5)] == [list(pose.root) for pose in poses]
    assert all(one.is_done for one in once)


@pytest.mark.parametrize(
    ("names", "message"),
    [
        ('["greeting"]', 'there is no selector and no database "greeting". Accepted: "greetings".'),
        ('["tired"]', "[databases.tired] has no roles."),
        ('"greetings"', "these are not names, each once."),
    ],
)
def test_joint_clips_of_a_controller_that_are_none_are_refused(meeting: Path, names: str, message: str):
    toml = (meeting / "contextdb.toml").read_text().replace('joint = ["greetings"]', f"joint = {names}")
    (meeting / "contextdb.toml").write_text(toml)
    result = run("motion", "build", "game")
    assert result.code == 2
    assert "[controllers.player] joint" in result.err
    assert message in result.err


def test_the_same_project_gives_the_same_bundle(game: Path):
    for name in ("one", "two"):
        assert run("motion", "build", "game", "--bundle", f"{name}.motion").code == 0
    assert Path("one.motion").read_bytes() == Path("two.motion").read_bytes()


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["--bundle", "game.bin"], "game.bin: this is not a valid name for a bundle. Accepted: a name that ends in .motion"),
        (["--bundle", "game.motion", "--keep-going"], "--bundle takes all databases."),
        (["--bundle", "game.motion", "--database", "all"], "--bundle takes all databases."),
    ],
)
def test_a_wrong_bundle_is_refused_before_anything_is_built(game: Path, words, message):
    result = run("motion", "build", "game", *words)
    assert result.code == 2
    assert message in result.err
    assert not list(game.glob("*.motion.safetensors"))


def test_the_header_of_motion_is_written_beside_the_tables(game: Path):
    assert run("compile", "game", "-o", "build", "--c-motion", "build/contextdb_motion.h").code == 0
    text = Path("build/contextdb_motion.h").read_text(encoding="ascii")
    assert "cdbm_update_all(" in text
    assert "cdb_open_any(" in text
    assert run("compile", "game", "--c-motion", "build/motion.txt").code == 2


def test_a_state_is_one_flat_block_that_a_character_goes_on_from(game: Path):
    one = Character.of(cdb.Project.load(game), "player")
    for _ in range(40):
        one.update(1 / 30, (0.0, 1.2), {"gait": "Walk", "style": "normal"})
    block = one.state
    other = Character.of(cdb.Project.load(game), "player")
    other.restore(block)
    assert other.state == block
    for tick in range(60):
        stick, facts = ((0.0, 2.6), "Run") if tick % 40 < 20 else ((1.0, 0.0), "Walk")
        poses = [each.update(1 / 30, stick, {"gait": facts, "style": "normal"}).pose for each in (one, other)]
        np.testing.assert_array_equal(poses[0].rotations, poses[1].rotations)
        assert one.state == other.state


@pytest.mark.parametrize("block", [b"", b"\0" * 8, "longer", "elsewhere", "not a number"])
def test_a_block_that_is_none_of_this_character_is_refused(game: Path, block):
    one = Character.of(cdb.Project.load(game), "player")
    own = np.frombuffer(one.state).copy()
    if block == "longer":
        block = bytes(8) + own.tobytes()
    elif block == "elsewhere":
        own[one.schema.ways.width + 5] = 77.0  # the database that plays
        block = own.tobytes()
    elif block == "not a number":
        own[13] = np.nan
        block = own.tobytes()
    before = one.state
    with pytest.raises(ContextError):
        one.restore(block)
    assert one.state == before
