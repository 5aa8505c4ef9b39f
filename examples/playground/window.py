"""The window: keys, mouse and gamepad become a stick; each frame updates the game, draws it, and writes over it what plays."""

from __future__ import annotations

import cmath
import math
import subprocess
import sys
import tempfile
import threading
import webbrowser
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from direct.showbase.ShowBase import ShowBase
from numpy.typing import NDArray
from panda3d.core import (
    ClockObject,
    Filename,
    InputDevice,
    LColor,
    TextNode,
    TextProperties,
    TextPropertiesManager,
    loadPrcFileData,
)

from contextdb.errors import Fault, FileError
from examples.playground.actor import LAST_MINUTE, LONGEST
from examples.playground.drawing import CLIP, Scene
from examples.playground.game import Game
from examples.playground.stick import Stick

LONGEST_FRAME_S, SLOW = 0.05, 0.2
TURN_PER_PIXEL, TURN_DPS = 0.2, 140.0
KEYS = {"w": "ahead", "s": "back", "a": "left", "d": "right", "q": "strafe", "mouse3": "strafe", "shift": "run", "lshift": "run"}
KEYS |= {"arrow_up": "ahead", "arrow_down": "back", "arrow_left": "left", "arrow_right": "right"}
SIZE, MOST_ROWS = 0.048, 6
SHADES = {"big": CLIP, "plays": CLIP, "dim": LColor(0.68, 0.72, 0.8, 1.0), "alarm": LColor(1.0, 0.5, 0.45, 1.0)}
HELP = """\
W A S D, arrows, left stick\twalk
Shift, right trigger\trun, until you are tired
right mouse, Q, left shoulder\tstrafe: keep facing ahead
mouse, right stick\tlook round
run or walk at the wall\tvault it
F1\tthis help
F2\tslow motion
F3\tthe page of the last minute
F4\trecord, and write what was recorded
Esc\tquit

beside it: contextdb edit examples/playground/tables"""
OFFSCREEN = ("load-display p3tinydisplay",)
ONSCREEN = ("aux-display p3tinydisplay", "framebuffer-multisample 1", "multisamples 4")
"""Panda's software renderer draws without a screen and a graphics card, and in a window where there is no OpenGL."""


def opened(is_offscreen: bool, size: tuple[int, int]) -> ShowBase:
    """A window, or a picture in memory; raises FileError where there is no screen."""
    settings = [f"win-size {size[0]} {size[1]}", "window-title contextdb playground", "text-pixels-per-unit 60"]
    settings += [f"notify-level-{each} fatal" for each in ("text", "linmath", "device", "x11display", "egldisplay", "display")]
    loadPrcFileData(
        "", "\n".join([*settings, "print-pipe-types false", "audio-library-name null", *(OFFSCREEN if is_offscreen else ONSCREEN)])
    )
    try:
        return ShowBase(windowType="offscreen" if is_offscreen else "onscreen")
    except Exception as error:  # Panda has no class of its own for it
        raise FileError(Fault(f"no window can be opened: {error}", "a screen, or --headless SECONDS")) from None


class Window:
    """The game on a screen."""

    def __init__(self, game: Game, is_offscreen: bool = False, size: tuple[int, int] = (1280, 720), words: float = SIZE) -> None:
        self.game, self.base, self.is_offscreen = game, opened(is_offscreen, size), is_offscreen
        self.scene = Scene(self.base, game)
        self.notice, self.is_slow, self.shows_help, self.held = "", False, False, set[str]()
        self.gamepads = partial(self.base.devices.getDevices, InputDevice.DeviceClass.gamepad)
        self.paging: threading.Thread | None = None
        for name, shade in SHADES.items():
            properties = TextProperties()
            properties.setTextColor(shade)
            properties.setGlyphScale(1.4 if name == "big" else 1.0)
            TextPropertiesManager.getGlobalPtr().setProperties(name, properties)
        TextNode.getDefaultFont().setLineHeight(1.15)
        left, top = 0.09 - self.base.getAspectRatio(), 0.92 - words
        self.top, self.state, self.middle = (self._text(x, y, words) for x, y in ((left, top), (left, -0.68), (-0.1, top)))

    def begin(self) -> None:
        """Listen to the keys, and update the game in each frame."""
        base = self.base
        base.disableMouse()
        for key, name in KEYS.items():
            base.accept(key, self.held.add, [name])
            base.accept(f"shift-{key}", self.held.add, [name])
            base.accept(f"{key}-up", self.held.discard, [name])
        does = {"f1": self._help, "f2": self._slow, "f3": self._page, "f4": self._record, "escape": sys.exit}
        for key, act in does.items():
            base.accept(key, act)
        for pad in self.gamepads():
            base.attachInputDevice(pad)
        base.taskMgr.add(self._frame, "game")

    def _frame(self, task: Any) -> Any:
        dt = min(ClockObject.getGlobalClock().getDt(), LONGEST_FRAME_S)
        self._look(dt)
        self.game.update(dt * (SLOW if self.is_slow else 1.0), self._stick())
        self.show()
        return task.cont

    def show(self) -> None:
        """Bring what is drawn and written up to date."""
        self.scene.show()
        said, player = self.game.player.readout, self.game.player
        rows = [_in("plays", text) if plays else text for text, plays in said.rows[:MOST_ROWS]]
        rows += [f"and {len(said.rows) - MOST_ROWS} more"] * (len(said.rows) > MOST_ROWS)
        rows = rows or [_in("alarm", "no row is valid: here"), said.gap]
        heads = [_in("big", said.title), player.why, "", _in("dim", "valid rows of moves")]
        self.top.setText("\n".join([*heads, *rows, "", _in("dim", said.facts)]))
        self.state.setText("\n".join([*self.game.state, _in("plays", self.notice)] if self.notice else self.game.state))
        self.middle.setText(HELP if self.shows_help else "")

    def picture(self) -> NDArray[np.uint8]:
        """What is drawn now: [height, width, 3]."""
        self.show()
        self.base.graphicsEngine.renderFrame()
        texture = self.base.win.getScreenshot()
        flat = np.frombuffer(bytes(texture.getRamImageAs("RGB")), np.uint8)
        return flat.reshape(texture.getYSize(), texture.getXSize(), 3)[::-1]

    def write_picture(self, path: Path) -> None:
        """Write what is drawn now as a PNG file."""
        self.picture()
        self.base.win.saveScreenshot(Filename.fromOsSpecific(str(path)))

    def _text(self, x: float, y: float, size: float) -> TextNode:
        """Words on a dark card."""
        node = TextNode("")
        node.setWordwrap(1.4 / size)
        node.setTabWidth(15.0)
        node.setCardColor(0.08, 0.09, 0.12, 0.72)
        node.setCardAsMargin(0.7, 0.7, 0.5, 0.4)
        node.setCardDecal(True)
        path = self.base.aspect2d.attachNewNode(node)
        path.setScale(size)
        path.setPos(x, 0.0, y)
        return node

    def _stick(self) -> Stick:
        """Keys and gamepad, turned to where the camera looks."""
        held, axis = self.held, InputDevice.Axis
        ahead = ("ahead" in held) - ("back" in held) + 0.0
        left = ("left" in held) - ("right" in held) + 0.0
        run, strafe = "run" in held, "strafe" in held
        for pad in self.gamepads():
            ahead += pad.findAxis(axis.left_y).value
            left -= pad.findAxis(axis.left_x).value
            run |= pad.findAxis(axis.right_trigger).value > 0.5
            strafe |= pad.findButton("lshoulder").pressed
        way = complex(ahead, left) * cmath.rect(1.0, camera := math.radians(self.scene.turn))
        return Stick(way.imag, way.real, run, strafe, camera)

    def _look(self, dt: float) -> None:
        """Turn the camera with the mouse, which stays in the middle of a window that is in front, or with the right stick."""
        scene, window = self.scene, self.base.win
        if not self.is_offscreen and window.getProperties().getForeground():
            pointer, x, y = window.getPointer(0), window.getXSize() // 2, window.getYSize() // 2
            if window.movePointer(0, x, y):
                scene.turn -= TURN_PER_PIXEL * (pointer.getX() - x)
                scene.tilt = min(60.0, max(4.0, scene.tilt + TURN_PER_PIXEL * (pointer.getY() - y)))
        for pad in self.gamepads():
            scene.turn -= dt * TURN_DPS * pad.findAxis(InputDevice.Axis.right_x).value

    def _help(self) -> None:
        self.shows_help = not self.shows_help

    def _slow(self) -> None:
        self.is_slow, self.notice = not self.is_slow, "" if self.is_slow else "slow motion"

    def _page(self) -> None:
        """Have the debugger's page of the last minute written by another process, and show it."""
        session = Path(tempfile.mkdtemp(prefix="playground-")) / "last_minute.parquet"
        self.game.player.trace.save(session)
        self.notice = "the page of the last minute is being written"
        self.paging = threading.Thread(target=self._write_page, args=(session, session.with_suffix(".html")), daemon=True)
        self.paging.start()

    def _write_page(self, session: Path, page: Path) -> None:
        words = ["motion", "replay", str(session), "--project", str(self.game.folder), "--html", str(page)]
        done = subprocess.run([sys.executable, "-m", "contextdb", *words], capture_output=True, text=True)
        self.notice = f"written: {page}" if done.returncode == 0 else done.stderr.strip()
        if done.returncode == 0:
            webbrowser.open(page.as_uri())

    def _record(self) -> None:
        """Record a session, or write the one that is recorded."""
        player = self.game.player
        if player.trace.most == LAST_MINUTE:
            player.keep(LONGEST)
            return
        path = Path(f"playground-{round(self.game.time_s)}s.parquet")
        player.trace.save(path)
        self.notice = f"written: {path}"
        player.keep(LAST_MINUTE)


def _in(style: str, text: str) -> str:
    return f"\1{style}\1{text}\2"
