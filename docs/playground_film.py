"""The film of the README, the game beside the editor: no row is valid, the row is made, and the figure walks back.

The editor is drawn as its pictures are, as SVG, and Chromium makes pixels of it.
"""

from __future__ import annotations

import asyncio
import os
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np
from drawing import Sheet, svg
from panda3d import core
from png_files import Picture
from textual.app import App

from screens import MARGIN_PX, PAPERS, screen_lines  # isort: skip - it says where tui is

sys.path.insert(0, str(Path(__file__).parent.parent))

from examples.playground import scenery
from examples.playground.__main__ import RATE, own_tables
from examples.playground.game import Game
from examples.playground.stick import REST, Stick
from tui.app import EditorApp
from tui.editor_settings import EditorSettings
from tui.model.workspace import Workspace
from tui.themes import DARK

PER_SECOND, GAME_SIZE, EDITOR_SIZE = 8, (560, 440), (78, 20)
SETTLES_S = 0.12
"""How long the editor has for what the game said, in each picture."""
AHEAD, BACK = Stick(0.0, 1.0), Stick(0.0, -1.0, strafe=True)
STORY: tuple[tuple[float, Stick, tuple[str, ...]], ...] = (
    (1.6, AHEAD, ()),
    (1.5, BACK, ()),
    (0.2, BACK, ("alt+4", "l")),
    (1.0, BACK, ()),
    (0.4, BACK, ("enter",)),
    (0.8, BACK, tuple("walk_back")),
    (0.4, BACK, ("enter",)),
    (0.2, REST, ("ctrl+s",)),
    (2.4, BACK, ()),
)
"""For so many seconds, with which stick, and the keys of the editor, spread over them."""


Drawn = Callable[[Game], Iterator[Callable[[], Picture]]]
"""Opens the window of a game, and gives what draws it."""


def film(drawn: Drawn) -> list[Picture]:
    """The pictures of the film; `drawn` opens the game's window and gives what draws it."""
    with tempfile.TemporaryDirectory(prefix="film") as folder:
        tables = Path(shutil.copytree(own_tables(), Path(folder) / "tables"))
        with _surroundings(Path(folder)):
            app = EditorApp(Workspace(str(tables / "moves.csv")), EditorSettings(), DARK, follow="film")
            pairs = asyncio.run(_played(app, tables, drawn))
        sheets = {text: number for number, text in enumerate(dict.fromkeys(text for _, text in pairs))}
        editors = [_pixels(Path(folder) / f"{number}.svg", text) for text, number in sheets.items()]
    return [np.concatenate((game, editors[sheets[text]]), axis=1) for game, text in pairs]


async def _played(app: EditorApp, tables: Path, drawn: Drawn) -> list[tuple[Picture, str]]:
    """What each picture of the game shows, and the editor as SVG."""
    app.animation_level = "none"
    scenery.ROUGH = 0.0  # speckles make a film large
    pairs: list[tuple[Picture, str]] = []
    with Game(tables, "film", settle_s=0.0) as game:
        game.ball, game.actors = None, [game.player]
        async with app.run_test(size=EDITOR_SIZE) as pilot:
            while app.main.following.followed is None:
                game.update(1.0 / RATE, REST)
                await asyncio.sleep(0.02)
            for draw in drawn(game):
                for seconds, stick, keys in STORY:
                    n = round(seconds * PER_SECOND)
                    for i in range(n):
                        for _ in range(round(RATE / PER_SECOND)):
                            game.update(1.0 / RATE, stick)
                        await pilot.press(*keys[i * len(keys) // n : (i + 1) * len(keys) // n])
                        await asyncio.sleep(SETTLES_S)
                        app.main.following.tick()
                        await pilot.pause()
                        pairs.append((draw(), _svg(app)))
    return pairs


def _svg(app: App[int]) -> str:
    ground, colour = PAPERS[DARK]
    return svg("The editor", screen_lines(app), Sheet(EDITOR_SIZE[0], MARGIN_PX, ground, colour))


def _pixels(path: Path, text: str) -> Picture:
    """A picture of an SVG, as high as the game's."""
    path.write_text(text.replace('rx="8" ', ""), encoding="utf-8")
    browser = next((found for name in ("chromium", "chromium-browser", "google-chrome") if (found := shutil.which(name))), None)
    if browser is None:
        raise SystemExit("Chromium draws the editor in the film, and is not installed.")
    width, height = (int(part.split('"')[0]) for part in (text.split('width="')[1], text.split('height="')[1]))
    made = path.with_suffix(".png")
    options = ["--headless", "--no-sandbox", "--disable-gpu", "--hide-scrollbars", f"--screenshot={made}"]
    subprocess.run([browser, *options, f"--window-size={width},{height}", path.as_uri()], check=True, capture_output=True)
    core.loadPrcFileData("", "textures-power-2 none")
    raster = core.Texture()
    raster.read(core.Filename.fromOsSpecific(str(made)))
    flat = np.frombuffer(bytes(raster.getRamImageAs("RGB")), np.uint8)
    picture = flat.reshape(raster.getYSize(), raster.getXSize(), 3)[::-1]
    blank = np.zeros((GAME_SIZE[1], picture.shape[1], 3), np.uint8)
    blank[:] = picture[2, 2]
    blank[: min(height, GAME_SIZE[1])] = picture[: GAME_SIZE[1]]
    return blank


@contextmanager
def _surroundings(folder: Path) -> Iterator[None]:
    """A folder of its own for the link and the editor's state."""
    before = dict(os.environ)
    os.environ.pop("NO_COLOR", None)
    os.environ |= dict.fromkeys(("XDG_RUNTIME_DIR", "XDG_STATE_HOME", "XDG_CONFIG_HOME"), str(folder))
    try:
        yield
    finally:
        os.environ.clear()
        os.environ.update(before)
