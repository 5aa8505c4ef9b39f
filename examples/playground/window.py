"""The window: keys, mouse and gamepad become a stick, and each frame updates the game and draws it."""

from __future__ import annotations

import math
import subprocess
import sys
import tempfile
import webbrowser
from pathlib import Path
from typing import Any

import numpy as np
from direct.showbase.ShowBase import ShowBase
from numpy.typing import NDArray
from panda3d.core import ClockObject, Filename, InputDevice, loadPrcFileData

from examples.playground.actor import LAST_MINUTE
from examples.playground.drawing import Scene
from examples.playground.game import Game
from examples.playground.headless import LONGEST
from examples.playground.screen import SIZE, Screen
from examples.playground.stick import Stick

LONGEST_FRAME_S = 0.05
SLOW = 0.2
TURN_PER_PIXEL, TURN_DPS = 0.2, 140.0
KEYS = {
    "ahead": ("w", "arrow_up"),
    "back": ("s", "arrow_down"),
    "left": ("a", "arrow_left"),
    "right": ("d", "arrow_right"),
    "run": ("shift", "lshift"),
    "strafe": ("mouse3", "q"),
}

OFFSCREEN = ("load-display p3tinydisplay", "audio-library-name null", "print-pipe-types false")
ONSCREEN = ("framebuffer-multisample 1", "multisamples 4")


def opened(is_offscreen: bool, size: tuple[int, int] = (1280, 720)) -> ShowBase:
    """A window, or a picture in memory that Panda's software renderer draws, without a screen and a graphics card."""
    settings = [f"win-size {size[0]} {size[1]}", "window-title contextdb playground", "text-pixels-per-unit 60"]
    settings += [f"notify-level-{each} fatal" for each in ("text", "linmath", *(("device", "x11display") if is_offscreen else ()))]
    settings += OFFSCREEN if is_offscreen else ONSCREEN
    loadPrcFileData("", "\n".join(settings))
    return ShowBase(windowType="offscreen" if is_offscreen else "onscreen")


class Window:
    """The game on a screen."""

    def __init__(self, game: Game, is_offscreen: bool = False, size: tuple[int, int] = (1280, 720), words: float = SIZE) -> None:
        self.game, self.base, self.is_offscreen = game, opened(is_offscreen, size), is_offscreen
        self.scene, self.screen = Scene(self.base, game), Screen(self.base, game, words)
        self.is_slow, self.held = False, set[str]()
        self.paging: tuple[subprocess.Popen[str], Path] | None = None

    def play(self) -> None:
        """Until the window is closed."""
        self.begin()
        self.base.run()

    def begin(self) -> None:
        """Listen to the keys, and update the game in each frame."""
        base = self.base
        base.disableMouse()
        for name, keys in KEYS.items():
            for key in keys:
                for each in (key, f"shift-{key}"):
                    base.accept(each, self.held.add, [name])
                base.accept(f"{key}-up", self.held.discard, [name])
        for key, does in (("f1", self._help), ("f2", self._slow), ("f3", self._page), ("f4", self._record), ("escape", sys.exit)):
            base.accept(key, does)
        for device in self._gamepads():
            base.attachInputDevice(device)
        base.taskMgr.add(self._frame, "game")

    def _frame(self, task: Any) -> Any:
        dt = min(ClockObject.getGlobalClock().getDt(), LONGEST_FRAME_S)
        self._look(dt)
        self._turn_page()
        self.game.update(dt * (SLOW if self.is_slow else 1.0), self._stick())
        self.show()
        return task.cont

    def _gamepads(self) -> list[Any]:
        return list(self.base.devices.getDevices(InputDevice.DeviceClass.gamepad))

    def show(self) -> None:
        """Bring what is drawn up to date."""
        self.scene.show()
        self.screen.show()

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

    # ---- the stick

    def _stick(self) -> Stick:
        """Keys and gamepad, turned to where the camera looks."""
        ahead = ("ahead" in self.held) - ("back" in self.held) + 0.0
        left = ("left" in self.held) - ("right" in self.held) + 0.0
        run, strafe = "run" in self.held, "strafe" in self.held
        for device in self._gamepads():
            ahead += device.findAxis(InputDevice.Axis.left_y).value
            left -= device.findAxis(InputDevice.Axis.left_x).value
            run = run or device.findAxis(InputDevice.Axis.right_trigger).value > 0.5
            strafe = strafe or device.findButton("lshoulder").pressed
        camera = math.radians(self.scene.turn)
        sin, cos = math.sin(camera), math.cos(camera)
        return Stick(left * cos + ahead * sin, ahead * cos - left * sin, run, strafe, camera)

    def _look(self, dt: float) -> None:
        """Turn the camera with the mouse, which stays in the middle of a window that is in front, or with the right stick."""
        scene, window = self.scene, self.base.win
        if not self.is_offscreen and window.getProperties().getForeground():
            pointer, x, y = window.getPointer(0), window.getXSize() // 2, window.getYSize() // 2
            if window.movePointer(0, x, y):
                scene.turn -= TURN_PER_PIXEL * (pointer.getX() - x)
                scene.tilt = min(60.0, max(4.0, scene.tilt + TURN_PER_PIXEL * (pointer.getY() - y)))
        for device in self._gamepads():
            scene.turn -= dt * TURN_DPS * device.findAxis(InputDevice.Axis.right_x).value

    # ---- the F keys

    def _help(self) -> None:
        self.screen.shows_help = not self.screen.shows_help

    def _slow(self) -> None:
        self.is_slow = not self.is_slow
        self.screen.notice = "slow motion" if self.is_slow else ""

    def _page(self) -> None:
        """Have the debugger's page of the last minute written, by another process."""
        session = Path(tempfile.mkdtemp(prefix="playground-")) / "last_minute.parquet"
        self.game.player.trace.save(session)
        page = session.with_suffix(".html")
        words = ["motion", "replay", str(session), "--project", str(self.game.folder), "--html", str(page)]
        done = subprocess.Popen(
            [sys.executable, "-m", "contextdb", *words], text=True, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE
        )
        self.paging, self.screen.notice = (done, page), "the page of the last minute is being written"

    def _turn_page(self) -> None:
        """Show the page when it is there, or say why there is none."""
        if self.paging is None or self.paging[0].poll() is None:
            return
        done, page = self.paging
        self.paging, said = None, done.communicate()[1].strip()
        self.screen.notice = f"written: {page}" if done.returncode == 0 else said
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
        self.screen.notice = f"written: {path}"
        player.keep(LAST_MINUTE)
