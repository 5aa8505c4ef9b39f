"""`contextdb motion build --bundle` and `contextdb compile --c-motion`: what a game in C takes, and what is refused."""

from pathlib import Path

import numpy as np
import pytest
from motion_project import write_project
from running import run

import contextdb as cdb
from contextdb.errors import ContextError
from contextdb.motion import Character


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
