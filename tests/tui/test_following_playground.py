"""The whole loop: a game in which no row is valid, the editor that sees it live and makes the row, and the game that plays it.

The keys are those of section 9 of docs/tutorial.md.
"""

import shutil
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path

import pytest
from terminal import press, said, screen_text, with_editor
from test_following import until
from test_tutorial import BLOCK, keys_of, section

from examples.playground.__main__ import RATE
from examples.playground.stick import Stick

sys.path.insert(0, str(Path(__file__).parent.parent))

import play

BACKWARDS = Stick(0.0, -1.0, strafe=True)


@pytest.fixture
def tables(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """A copy of the tables, and a folder for running games of this test alone: with a short path, as sockets need one."""
    base = Path(tempfile.mkdtemp(prefix="cdb"))
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(base))
    yield play.copied(tmp_path / "tables")
    shutil.rmtree(base, ignore_errors=True)


def test_an_editor_that_expects_a_game_follows_its_player_once_it_is_there(tables: Path):
    async def script(app, pilot):
        app.main.expect_game("playground")
        with play.opened(tables, "playground") as game:
            following = app.main.following
            await until(pilot, lambda: game.update(1.0 / RATE, BACKWARDS) or following.followed is not None)
            return following.followed.name

    assert with_editor(tables / "moves.csv", script, (130, 45)) == "playground · player"


def test_the_editor_sees_the_gap_live_makes_its_row_and_the_game_plays_it(tables: Path):
    watch, look, fill = ([*keys_of(text)] for _, text in BLOCK.findall(section(9)))

    async def script(app, pilot):
        with play.opened(tables, "playground") as game:

            def step(stick: Stick = BACKWARDS) -> bool:
                game.update(1.0 / RATE, stick)
                return False

            for _ in range(30):
                step()
            seen = [(game.player.readout.valid.rows.tolist(), game.player.playing)]
            await press(pilot, *watch[0])
            dialog = app.screen
            await until(pilot, lambda: step() or dialog.show() or len(dialog._lines) == 2)
            await press(pilot, *watch[1])
            query, following = app.main.session.sheet.query, app.main.following
            await until(pilot, lambda: step() or following.tick() or query.texts.get("strafe") == "True")
            seen.append((screen_text(app), query.bits))
            await press(pilot, *(key for keys in look for key in keys))
            pane = app.main._pane("coverage")
            await until(pilot, lambda: not pane.played.reading)
            seen.append(screen_text(app))
            await press(pilot, *fill[0])  # a row for the gap
            seen.append(said(app))
            await press(pilot, *(key for keys in fill[1:] for key in keys))
            seen.append(said(app))
            await until(pilot, lambda: step() or game.player.playing == "walk_back")
            await until(pilot, lambda: step() or following.tick() or "the game plays walk_back" in screen_text(app))
            seen.append(game.watch.snapshot().number)
            return seen

    before, (screen, bits), gaps, asked, saved, number = with_editor(tables / "moves.csv", script, (130, 45))
    assert before == ([], "idle")
    assert "playground · player" in screen
    assert "0 of 34 rows valid" in screen
    assert bits == 0
    assert "direction: (100..-100), strafe: True" in gaps
    assert asked == "A new row fills the gap: enter its asset."
    assert saved == "Saved moves.csv."
    assets = [line.partition(",")[0] for line in (tables / "moves.csv").read_text(encoding="utf-8").splitlines()]
    assert assets[assets.index("walk_back") - 1] == "walk_strafe", "the new row is below the row nearest to it"
    assert number == 2
