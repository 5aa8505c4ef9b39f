"""The window: keys, mouse and gamepad become a stick; each frame updates the game, draws it, and writes over it what plays."""

import cmath
import math
import subprocess
import sys
import tempfile
import threading
import webbrowser
from pathlib import Path
from typing import Any

from direct.gui.OnscreenText import OnscreenText
from direct.showbase.ShowBase import ShowBase
from panda3d import core

from contextdb.errors import Fault, FileError

from .actor import LAST_MINUTE, LONGEST
from .drawing import CLIP, Scene
from .game import Game
from .guide import Guide
from .stick import DEAD, Stick

STEP_S, LONGEST_FRAME_S, SLOW, TURN_PER_PIXEL, TURN_DPS, SIZE, MOST_ROWS = 0.05, 0.25, 0.2, 0.2, 140.0, 0.048, 6
KEYS = {"w": "ahead", "s": "back", "a": "left", "d": "right", "q": "strafe", "mouse3": "strafe", "shift": "run", "lshift": "run"}
KEYS |= {"arrow_up": "ahead", "arrow_down": "back", "arrow_left": "left", "arrow_right": "right"}
SHADES = {"big": CLIP, "plays": CLIP, "dim": core.LColor(0.68, 0.72, 0.8, 1.0), "alarm": core.LColor(1.0, 0.5, 0.45, 1.0)}
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
F5\twhy this clip, and what the table was asked
Esc\tquit

Any key begins. The tables, beside it: """
SETTINGS = """\
window-title contextdb playground
text-pixels-per-unit 60
print-pipe-types false
audio-library-name null
"""
SETTINGS += "".join(f"notify-level-{each} fatal\n" for each in ("text", "linmath", "device", "x11display", "egldisplay", "display"))
OFFSCREEN = "load-display p3tinydisplay\n"
ONSCREEN = "aux-display p3tinydisplay\nframebuffer-multisample 1\nmultisamples 4\n"
"""Panda's software renderer draws without a screen and a graphics card, and in a window where there is no OpenGL."""


def opened(is_offscreen: bool, size: tuple[int, int]) -> ShowBase:
    """A window, or a picture in memory; raises FileError where there is no screen."""
    core.loadPrcFileData("", f"{SETTINGS}{OFFSCREEN if is_offscreen else ONSCREEN}win-size {size[0]} {size[1]}")
    try:
        return ShowBase(windowType="offscreen" if is_offscreen else "onscreen")
    except Exception as error:  # Panda has no class of its own for it
        raise FileError(Fault(f"no window can be opened: {error}", "a screen, or --headless SECONDS")) from None


class Window:
    """The game on a screen."""

    def __init__(self, game: Game, is_offscreen: bool = False, size: tuple[int, int] = (1280, 720), words: float = SIZE) -> None:
        self.game, self.base, self.is_offscreen = game, opened(is_offscreen, size), is_offscreen
        self.scene = Scene(self.base, game)
        self.guide = Guide(game)
        self.notice, self.held = "", set[str]()
        self.is_slow = self.is_centred = self.has_details = False
        self.gamepads: Any = lambda: self.base.devices.getDevices(core.InputDevice.DeviceClass.gamepad)
        for name, shade in SHADES.items():
            properties = core.TextProperties()
            properties.setTextColor(shade)
            properties.setGlyphScale(1.4 if name == "big" else 1.0)
            core.TextPropertiesManager.getGlobalPtr().setProperties(name, properties)
        core.TextNode.getDefaultFont().setLineHeight(1.15)
        left, top = 0.09 - self.base.getAspectRatio(), 0.92 - words
        self.top, self.state, self.middle = (self._text(x, y, words) for x, y in ((left, top), (left, -0.68), (-0.1, top)))
        self.lesson = self._text(0.45, -0.8, 1.1 * words, is_centred=True)

    def begin(self) -> ShowBase:
        """Listen to the keys, and update the game in each frame that is run."""
        base = self.base
        base.disableMouse()
        for key, name in KEYS.items():
            base.accept(key, self._hold, [name])
            base.accept(f"shift-{key}", self._hold, [name])
            base.accept(f"{key}-up", self.held.discard, [name])
        acts = {"f1": self._help, "f2": self._slow, "f3": self._page, "f4": self._record, "f5": self._details, "escape": sys.exit}
        for key, act in acts.items():
            base.accept(key, act)
        base.taskMgr.add(self._frame, "game")
        self._help()
        return base

    def _hold(self, name: str) -> None:
        """A key is held; the help has been read."""
        self.held.add(name)
        self.middle.setText("")

    def _frame(self, task: Any) -> Any:
        dt = min(core.ClockObject.getGlobalClock().getDt(), LONGEST_FRAME_S)
        self._look(dt)
        steps = math.ceil(dt / STEP_S) or 1  # few pictures a second do not make the play slow
        for _ in range(steps):
            self.game.update(dt / steps * (SLOW if self.is_slow else 1.0), self._stick())
        self.scene.swing(dt)
        self.guide.update(dt)
        self.lesson.setText("" if self.middle.getText() else self.guide.text)
        self.show()
        return task.cont

    def show(self) -> None:
        """Bring what is drawn and written up to date."""
        self.scene.show()
        said = self.game.player.readout
        rows = [_in("plays", text) if plays else text for text, plays in said.rows[:MOST_ROWS]]
        rows += [f"and {len(said.rows) - MOST_ROWS} more"] * (len(said.rows) > MOST_ROWS)
        rows = [_in("dim", "Valid rows of moves"), *rows] if rows else [_in("alarm", "No row is valid for these facts."), said.gap]
        details = ["", said.why, _in("dim", said.facts)] if self.has_details else []
        self.top.setText("\n".join([_in("big", self.game.player.playing), *rows, *details]))
        self.state.setText("\n".join([*self.game.state, *([_in("plays", self.notice)] if self.notice else [])]))

    def write_picture(self, path: Path) -> None:
        """Write what is drawn now as a PNG file."""
        self.show()
        self.base.graphicsEngine.renderFrame()
        self.base.win.saveScreenshot(core.Filename.fromOsSpecific(str(path)))

    def _text(self, x: float, y: float, size: float, is_centred: bool = False) -> core.TextNode:
        """Words on a dark card."""
        colours: dict[str, Any] = {"fg": (1.0, 1.0, 1.0, 1.0), "bg": (0.08, 0.09, 0.12, 0.72)}
        node = OnscreenText(
            pos=(x, y),
            scale=size,
            wordwrap=(2.2 if is_centred else 1.4) / size,
            align=core.TextNode.ACenter if is_centred else core.TextNode.ALeft,
            mayChange=True,
            **colours,
        ).textNode
        node.setTabWidth(15.0)
        node.setCardAsMargin(0.7, 0.7, 0.5, 0.4)
        return node

    def _stick(self) -> Stick:
        """Keys and gamepads, turned to where the camera looks."""
        held, axis = self.held, core.InputDevice.Axis
        ahead, left = ("ahead" in held) - ("back" in held) + 0.0, ("left" in held) - ("right" in held) + 0.0
        run, strafe = "run" in held, "strafe" in held
        for pad in self.gamepads():
            pad.poll()
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
            is_centred = window.movePointer(0, x, y)
            if is_centred and self.is_centred:  # where the pointer comes from is no look
                left, down = TURN_PER_PIXEL * (x - pointer.getX()), TURN_PER_PIXEL * (pointer.getY() - y)
                if left or down:
                    scene.look(left, down)
            self.is_centred = is_centred
        else:
            self.is_centred = False
        for pad in self.gamepads():
            if abs(pushed := pad.findAxis(core.InputDevice.Axis.right_x).value) > DEAD:
                scene.look(-dt * TURN_DPS * pushed)

    def _help(self) -> None:
        self.middle.setText("" if self.middle.getText() else HELP + edit_command(self.game.watch.folder))

    def _details(self) -> None:
        self.has_details = not self.has_details

    def _slow(self) -> None:
        self.is_slow, self.notice = not self.is_slow, "" if self.is_slow else "slow motion"

    def _page(self) -> None:
        """Have the debugger's page of the last minute written by another process, and show it."""
        session = Path(tempfile.mkdtemp(prefix="playground-")) / "last_minute.parquet"
        self.game.player.trace.save(session)
        page = session.with_suffix(".html")
        self.notice = f"The page of the last minute is being written: {page}"
        self.paging = threading.Thread(target=self._write_page, args=(session, page), daemon=True)
        self.paging.start()

    def _write_page(self, session: Path, page: Path) -> None:
        words = ["motion", "replay", str(session), "--project", str(self.game.watch.folder), "--html", str(page)]
        done = subprocess.run([sys.executable, "-m", "contextdb", *words], capture_output=True, text=True)
        self.notice = f"Written: {page}" if done.returncode == 0 else done.stderr.strip()
        if done.returncode == 0:
            webbrowser.open(page.as_uri())

    def _record(self) -> None:
        """Record a session, or write the one that is recorded."""
        player, is_over = self.game.player, self.game.player.trace.most > LAST_MINUTE
        if is_over:
            path = Path(f"playground-{round(self.game.time_s)}s.parquet")
            player.trace.save(path)
            self.notice = f"Written: {path}"
        player.trace = player.character.record(5, most=LAST_MINUTE if is_over else LONGEST)


def edit_command(tables: Path) -> str:
    """What opens the editor on the tables, as this environment names it, from the folder where the game was started."""
    name, here = Path(sys.executable).with_name("contextdb"), Path.cwd()
    command, folder = (path.relative_to(here) if path.is_relative_to(here) else path for path in (name, tables))
    return f"{command if command.exists() else 'contextdb'} edit {folder}"


def _in(style: str, text: str) -> str:
    return f"\1{style}\1{text}\2"
