"""The animation beside the table: the clip of the row, of what may be picked, of a gap's nearest row; or why there is none."""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np
import pytest
from motion_project import write_project
from terminal import press, screen_text, with_editor

from contextdb.motion.storage.config import MotionConfig
from contextdb.motion.storage.pose_files import open_or_build_poses, poses_path, save_poses
from contextdb.tables.project import Project, load_table
from tui.model.asset_poses import AssetPoses, PosesOfAssets
from tui.panes.clip import ClipPane, figure_at


@pytest.fixture(scope="module")
def game(tmp_path_factory: pytest.TempPathFactory) -> Path:
    game = tmp_path_factory.mktemp("clips") / "game"
    write_project(game)
    (game / "clips" / "swim.bvh").write_text("HIERARCHY\nnot a clip")
    return game


def of(path: Path, asset: str) -> AssetPoses | str:
    known = PosesOfAssets(load_table(path)).poses(asset)
    return known if isinstance(known, AssetPoses) else known.message


def test_a_clip_is_drawn_as_a_bank_of_all_clips_has_it_and_as_the_saved_bank(game: Path, tmp_path: Path):
    swim = (game / "clips" / "swim.bvh").rename(tmp_path / "swim.bvh")
    project = Project.load(game)
    config = MotionConfig.from_dict(project.schema.motion, file=project.schema.file)
    bank = open_or_build_poses(config, game, {"moves": project.tables["moves"].compile().leaves}, names=["all"])["all"]
    swim.rename(game / "clips" / "swim.bvh")
    read = of(game / "moves.csv", "walk")
    save_poses(bank, poses_path(game, "all"))
    saved = of(game / "moves.csv", "walk")
    os.utime(game / "clips" / "jog.bvh", (4e9, 4e9))
    newer = of(game / "moves.csv", "jog")
    poses_path(game, "all").unlink()
    assert isinstance(read, AssetPoses)
    assert isinstance(saved, AssetPoses)
    assert isinstance(newer, AssetPoses)
    assert (read.source, len(read.bank.assets), len(saved.bank.assets), len(newer.bank.assets)) == ("clips/walk.bvh", 1, 4, 1)
    number = bank.range_of("walk")
    for time_s in (0.0, 0.4, read.last_s):
        for one in (read, saved):
            assert np.allclose(one.bones_at(time_s), bank.joints_at(number, time_s), atol=1e-5)
            assert np.allclose(one.root_at(time_s), bank.moment_of(number, time_s).root, atol=1e-5)
        figure = figure_at(read, time_s)
        assert len(figure.chosen) > 10
        here = figure.got[min(round(time_s * read.bank.rate), len(figure.got) - 1)]
        assert np.allclose(here, 0.0, atol=0.05)


def test_without_a_clip_it_says_what_is_missing_and_how_to_get_it(game: Path, tmp_path: Path):
    assert of(game / "moves.csv", "walkk") == 'No clip is named "walkk". Accepted: one of 5 clips. Did you mean "walk"?'
    broken = of(game / "moves.csv", "swim")
    assert isinstance(broken, str)
    (tmp_path / "contextdb.toml").write_text("")
    (tmp_path / "t.csv").write_text("Asset\nwalk\n")
    missing = of(tmp_path / "t.csv", "walk")
    assert isinstance(missing, str)
    assert "[databases.NAME]" in missing
    assert "Shift+F4" in missing
    (tmp_path / "walk.bvh").write_bytes((game / "clips" / "walk.bvh").read_bytes())
    alone = of(tmp_path / "t.csv", "walk")
    assert isinstance(alone, AssetPoses)
    assert 0.9 < alone.bones_at(0.1)[:, 1].max() < 2.6


def test_the_pane_follows_the_cursor_the_test_row_and_gaps_and_reads_no_clip_that_is_passed(game: Path):
    async def script(app, pilot):
        async def at_rest() -> tuple[str, str]:
            await pilot.pause(0.2)
            await app.workers.wait_for_complete()
            await pilot.pause()
            shower = app.main.query(ClipPane).last() if app.main.tab == "coverage" else app.main.query(ClipPane).first()
            title, note = (str(shower.query_one(f"#clip-{part}").render()) for part in ("title", "note"))
            return title, note

        await press(pilot, "shift+f11")
        first = await at_rest()
        await press(pilot, *["down"] * 3)
        passed = set(app.main._clips.of()._seen)
        jog = await at_rest()
        drawn = screen_text(app)
        await press(pilot, "down")
        broken = await at_rest()
        app.main.assets.set_context({"gait": "Walk", "speed": "1.2", "style": "tired"}, "")
        await press(pilot, "f6")
        picked = await at_rest()
        await press(pilot, "alt+4", "r")
        app.main.coverage.join(20)
        await pilot.pause()
        gap = await at_rest()
        await press(pilot, "shift+f11")
        return first, passed, jog, drawn, broken, picked, gap, [one.is_open for one in app.main.query(ClipPane)]

    first, passed, jog, drawn, broken, picked, gap, are_open = with_editor(game / "moves.csv", script, (120, 36))
    assert first == ("idle", "clips/idle.bvh")
    assert passed == {"idle"}
    assert jog == ("jog", "clips/jog.bvh")
    assert sum("\u2801" <= sign <= "\u28ff" for sign in drawn) > 60
    assert broken[0] == "swim"
    assert "swim.bvh" in broken[1] or "Accepted" in broken[1]
    assert picked == ("walk (1 of 2 that may play)", "clips/walk.bvh")
    assert gap[1].startswith("clips/")
    assert are_open[-1] is False
