"""Draw the pictures of docs/playground.md, without a screen and a graphics card: six moments, and the film of the README.

    python docs/playground_pictures.py [FOLDER]

The game is played from the same sticks each time, and drawn by Panda's software renderer.
"""

from __future__ import annotations

import math
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from playground_film import GAME_SIZE, PER_SECOND, film
from png_files import Picture, halved, write_png

sys.path.insert(0, str(Path(__file__).parent.parent))

from contextdb.motion import write_made_clips
from examples.playground.__main__ import RATE, TABLES, own_tables
from examples.playground.actor import Actor
from examples.playground.game import Game
from examples.playground.stick import REST, Stick
from examples.playground.window import SIZE, Window

FOLDER = Path(__file__).parent / "pictures"
Sticks = list[tuple[float, Stick]]
"""For so many seconds each."""


def pushed(degrees: float, run: bool = False, strafe: bool = False) -> Stick:
    """A stick that is pushed in one direction."""
    return Stick(math.sin(math.radians(degrees)), math.cos(math.radians(degrees)), run, strafe)


@dataclass(frozen=True)
class Moment:
    """Where the player begins, how the stick is moved, when the picture is taken, and from where."""

    place: tuple[float, float, float]
    sticks: Sticks
    turn: float = 0.0
    tilt: float = 14.0
    away: float = 5.0
    until: Callable[[Game], bool] | None = None
    stamina: float = 1.0


def is_over_the_wall(game: Game) -> bool:
    """The highest point of a vault."""
    return game.player.once is not None and game.player.playing.startswith("vault") and game.player.pose.positions[0][1] > 1.6


def is_caught(game: Game) -> bool:
    """The ball has been contested a moment ago."""
    return "misses" in game.ball.said and game.ball.since_s > 0.55 if game.ball is not None else False


MOMENTS = {
    "playground-turn": Moment((1.5, -3.0, 0.0), [(1.6, pushed(0)), (0.5, pushed(80))], turn=-25.0),
    "playground-vault": Moment((-3.0, -2.0, 0.0), [(5.0, pushed(0, run=True))], 70.0, until=is_over_the_wall),
    "playground-ramp": Moment((4.5, 0.6, 0.0), [(3.2, pushed(0))], -50.0, 15.0, 4.6),
    "playground-contest": Moment((-1.4, -1.5, 0.0), [(2.2, pushed(0)), (6.0, REST)], -35.0, 31.0, 8.0, until=is_caught),
    "playground-tired": Moment((0.0, -9.0, 0.0), [(3.0, pushed(0, run=True))], 50.0, 10.0, 4.4, stamina=0.06),
    "playground-gap": Moment((0.0, 0.0, 0.0), [(1.2, pushed(0)), (1.2, pushed(180, strafe=True))], 25.0),
}


def put(actor: Actor, place: tuple[float, float, float]) -> None:
    """Put somebody elsewhere, at rest."""
    actor.character.body = replace(actor.character.body, position=place[:2], velocity=(0.0, 0.0), heading=place[2])
    actor.update(1.0 / RATE, REST)


def _game() -> Game:
    """The game, with its clips made where they are not there yet."""
    return Game(own_tables())


def moment(name: str) -> Picture:
    """The picture of a moment, 960 pixels wide."""
    wanted = MOMENTS[name]
    with _game() as game, drawn(game) as window:
        put(game.player, wanted.place)
        game.player.stamina = wanted.stamina
        window.scene.turn, window.scene.tilt, window.scene.away = wanted.turn, wanted.tilt, wanted.away
        for seconds, stick in wanted.sticks:
            for _ in range(round(seconds * RATE)):
                game.update(1.0 / RATE, stick)
                if wanted.until is not None and wanted.until(game):
                    return halved(picture(window))
        return halved(picture(window))


def picture(window: Window) -> Picture:
    """What is drawn now: [height, width, 3]."""
    window.show()
    window.base.graphicsEngine.renderFrame()
    texture = window.base.win.getScreenshot()
    flat = np.frombuffer(bytes(texture.getRamImageAs("RGB")), np.uint8)
    return flat.reshape(texture.getYSize(), texture.getXSize(), 3)[::-1]


def filmed(game: Game) -> Iterator[Callable[[], Picture]]:
    """The window of a film's game, and what gives its picture."""
    with drawn(game, words=0.075, size=(2 * GAME_SIZE[0], 2 * GAME_SIZE[1])) as window:
        window.scene.tilt, window.scene.away, window.scene.turn = 11.0, 4.6, 14.0
        yield lambda: halved(picture(window))


@contextmanager
def drawn(game: Game, words: float = SIZE, size: tuple[int, int] = (1920, 1080)) -> Iterator[Window]:
    """A picture in memory of a game; Panda has one at a time."""
    window = Window(game, is_offscreen=True, size=size, words=words)
    try:
        yield window
    finally:
        window.base.destroy()


def main(folder: Path = FOLDER) -> None:
    """Draw all of them."""
    write_made_clips(TABLES / "clips", of_game=True)
    for name in MOMENTS:
        write_png(folder / f"{name}.png", moment(name))
    write_png(folder / "playground.png", *film(filmed), per_second=PER_SECOND)


if __name__ == "__main__":
    main(*map(Path, sys.argv[1:]))
