"""Screens of the debugger for the documents: a session of the made clips is recorded, keys are pressed, and the screen is drawn."""

from __future__ import annotations

import asyncio
import contextlib
import io
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from drawing import Run, Sheet, svg
from screens import LARGE, MARGIN_PX, PAPERS, SMALL, _environment, _runs, _settle

from contextdb.cli import main as contextdb
from contextdb.commands.motion_replay_command import databases_of
from contextdb.motion import write_made_clips
from contextdb.motion.trace.session import Trace
from tui.debug.app import DebugApp
from tui.debug.recording import Recording
from tui.themes import DARK

STICK = """time_s,speed_mps,turn_dps,gait,style
0,0,0,Idle,normal
1,1.3,0,Walk,normal
3,1.3,45,Walk,tired
5,3,0,Run,normal
7,1.2,-45,Walk,tired
9,0,0,Idle,normal
10,0,0,Idle,normal
"""
MIDDLE = (120, 40)


@dataclass(frozen=True)
class DebugScene:
    """A screen of the debugger: what it shows in a sentence, and the keys that lead there."""

    title: str
    keys: tuple[str, ...] = ()
    size: tuple[int, int] = LARGE


_SCENE = DebugScene(
    "The debugger: a timeline with measures, poses with the wanted path, weights, the cost of every frame of every asset, and why "
    "the asset under the cursor was not chosen.",
    ("right_square_bracket", "right_square_bracket", *("down",) * 3),
)
DEBUG_SCENES: Mapping[str, DebugScene] = {
    "debug.svg": replace(_SCENE, size=SMALL),
    "debug-middle.svg": replace(_SCENE, size=MIDDLE),
    "debug-large.svg": _SCENE,
}
"""Every scene by the name of its picture."""


def draw_debug_scene(scene: DebugScene, folder: Path) -> str:
    """The scene as SVG; tables/ is in the folder."""
    write_made_clips(folder / "tables" / "clips")
    (folder / "stick.csv").write_text(STICK, encoding="utf-8")
    with contextlib.chdir(folder), _environment(True), contextlib.redirect_stdout(io.StringIO()):
        for words in ("build tables --poses", "run tables player stick.csv --out session.parquet"):
            assert contextdb(["motion", *words.split()]) == 0, words
        lines = asyncio.run(_lines(scene))
    return svg(scene.title, lines, Sheet(scene.size[0], MARGIN_PX, *PAPERS[DARK]))


async def _lines(scene: DebugScene) -> list[list[Run]]:
    """What is on the screen after the keys."""
    trace = Trace.load("session.parquet")
    databases, _ = databases_of(trace, "tables", "session.parquet")
    app: Any = DebugApp(Recording("session.parquet", trace, "tables", databases, trace.use(databases)))
    app.animation_level = "none"
    async with app.run_test(size=scene.size) as pilot:
        await _settle(pilot)
        for key in scene.keys:
            await pilot.press(key)
        await _settle(pilot)
        return [list(_runs(strip)) for strip in app.screen._compositor.render_strips()]
