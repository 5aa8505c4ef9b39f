"""The window: keys, mouse and gamepad become a stick, and each frame updates the game and draws it."""

from __future__ import annotations

import math
import subprocess
import sys
import tempfile
import webbrowser
from pathlib import Path

import numpy as np
from direct.showbase.ShowBase import ShowBase
from panda3d.core import Filename, InputDevice, loadPrcFileData

from contextdb import motion
from examples.playground.drawing import Scene
from examples.playground.game import Game
from examples.playground.screen import Screen
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


def opened(is_offscreen: bool, size: tuple[int, int] = (1280, 720)) -> ShowBase:
    """A window, or a picture in memory that Panda's software renderer draws, without a screen and a graphics card."""
    settings = [f"win-size {size[0]} {size[1]}", "window-title contextdb playground", "framebuffer-multisample 1", "multisamples 4"]
    if is_offscreen:
        settings += ["load-display p3tinydisplay", "audio-library-name null", "notify-level-device fatal"]
        settings += ["notify-level-x11display fatal", "notify-level-display error"]
    quiet = [f"notify-level-{each} error" for each in ("text", "linmath")]
    loadPrcFileData("", "\n".join([*settings, *quiet, "text-pixels-per-unit 60"]))
    return ShowBase(windowType="offscreen" if is_offscreen else "onscreen")


class Window:
    """The game on a screen."""

    def __init__(self, game: Game, is_offscreen: bool = False, size: tuple[int, int] = (1280, 720)) -> None:
        self.game, self.base = game, opened(is_offscreen, size)
        self.scene, self.screen = Scene(self.base, game), Screen(self.base, game)
        self.is_slow, self.held = False, set[str]()
        self.mouse: tuple[float, float] | None = None

    def play(self) -> None:
        """Until the window is closed."""
        base = self.base
        base.disableMouse()
        for name, keys in KEYS.items():
            for key in keys:
                for each in (key, f"shift-{key}"):
                    base.accept(each, self.held.add, [name])
                base.accept(f"{key}-up", self.held.discard, [name])
        for key, does in (("f1", self._help), ("f2", self._slow), ("f3", self._page), ("f4", self._record), ("escape", sys.exit)):
            base.accept(key, does)
        for device in base.devices.getDevices(InputDevice.DeviceClass.gamepad):
            base.attachInputDevice(device)
        base.taskMgr.add(self._frame, "game")
        base.run()

    def _frame(self, task: object) -> int:
        dt = min(self.base.clock.getDt() if hasattr(self.base, "clock") else LONGEST_FRAME_S / 3.0, LONGEST_FRAME_S)
        self._look(dt)
        self.game.update(dt * (SLOW if self.is_slow else 1.0), self._stick())
        self.show()
        return 1  # again in the next frame

    def show(self) -> None:
        """Bring what is drawn up to date."""
        self.scene.show()
        self.screen.show()

    def picture(self) -> np.ndarray:
        """What is drawn now: uint8 [height, width, 3]."""
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
        for device in self.base.devices.getDevices(InputDevice.DeviceClass.gamepad):
            ahead += device.findAxis(InputDevice.Axis.left_y).value
            left -= device.findAxis(InputDevice.Axis.left_x).value
            run = run or device.findAxis(InputDevice.Axis.right_trigger).value > 0.5
            strafe = strafe or device.findButton("lshoulder").pressed
        camera = math.radians(self.scene.turn)
        sin, cos = math.sin(camera), math.cos(camera)
        return Stick(left * cos + ahead * sin, ahead * cos - left * sin, run, strafe, camera)

    def _look(self, dt: float) -> None:
        """Turn the camera with the mouse, or with the right stick."""
        watcher = self.base.mouseWatcherNode
        if watcher.hasMouse():
            place = watcher.getMouseX() * 640.0, watcher.getMouseY() * 360.0
            if self.mouse is not None:
                self.scene.turn -= TURN_PER_PIXEL * (place[0] - self.mouse[0])
                self.scene.tilt = min(60.0, max(4.0, self.scene.tilt - TURN_PER_PIXEL * (place[1] - self.mouse[1])))
            self.mouse = place
        for device in self.base.devices.getDevices(InputDevice.DeviceClass.gamepad):
            self.scene.turn -= dt * TURN_DPS * device.findAxis(InputDevice.Axis.right_x).value

    # ---- the F keys

    def _help(self) -> None:
        self.screen.shows_help = not self.screen.shows_help

    def _slow(self) -> None:
        self.is_slow = not self.is_slow
        self.screen.notice = "slow motion" if self.is_slow else ""

    def _page(self) -> None:
        """The debugger's page of the last minute, in the browser."""
        session = Path(tempfile.mkdtemp(prefix="playground-")) / "last_minute.parquet"
        self.game.player.recorders.minute.save(session)
        page = session.with_suffix(".html")
        words = ["motion", "replay", str(session), "--project", str(self.game.folder), "--html", str(page)]
        done = subprocess.run([sys.executable, "-m", "contextdb", *words], capture_output=True, text=True)
        self.screen.notice = f"written: {page}" if done.returncode == 0 else done.stderr.strip()
        if done.returncode == 0:
            webbrowser.open(page.as_uri())

    def _record(self) -> None:
        """Record a session, or write the one that is recorded."""
        recorders = self.game.player.recorders
        if recorders.recording is None:
            recorders.recording = motion.Trace(databases=self.game.player.character.controller.selector.databases)
            return
        path = Path(f"playground-{round(self.game.time_s)}s.parquet")
        recorders.recording.save(path)
        recorders.recording, self.screen.notice = None, f"written: {path}"
