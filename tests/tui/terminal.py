"""Drive a Textual app in tests without a terminal, and read its screen as text."""

from __future__ import annotations

import asyncio
import contextlib
import threading
import time
from collections.abc import Awaitable, Callable, Iterator
from pathlib import Path
from typing import Any, TypeVar
from unittest.mock import patch

from textual._wait import wait_for_idle
from textual.app import App
from textual.pilot import Pilot

from tui.app import EditorApp
from tui.editor_settings import EditorSettings
from tui.model.workspace import Workspace

T = TypeVar("T")
N_UPDATES = 2
"""What is laid out anew may have to be painted anew."""
LONGEST_WAIT_S = 10.0


def screen_text(app: App[Any]) -> str:
    """What stands on the screen, line by line, without spaces at the ends of lines."""
    strips = app.screen._compositor.render_strips()
    return "\n".join("".join(segment.text for segment in strip).rstrip() for strip in strips)


def drive(app: App[Any], script: Callable[[Pilot[Any]], Awaitable[T]], size: tuple[int, int] = (80, 24)) -> T:
    """Run an app on a screen of (columns, rows) while `script` presses keys; gives what the script gives."""

    async def rested(min_sleep: float = 0.0, max_sleep: float = 1.0) -> None:
        await _rested(app, n_threads)

    async def run() -> T:
        app.animation_level = "none"
        async with app.run_test(size=size) as pilot:
            await pilot.pause()
            return await script(pilot)

    n_threads = threading.active_count()
    with patch("textual.app.wait_for_idle", rested), patch("textual.pilot.wait_for_idle", rested):
        return asyncio.run(run())


async def _rested(app: App[Any], n_threads: int) -> None:
    """Wait until no part of the app has anything to do; Textual itself sleeps, until the process has used little of the processor.

    A thread that is at work may send the app something later: as long as there is one, Textual's way is the only one.
    """
    for _ in range(N_UPDATES):
        await _nothing_ready()
        if app._exception is None and app._running and app.screen_stack:
            app.screen._on_timer_update()
    await _nothing_ready()
    if threading.active_count() > n_threads:
        await wait_for_idle(0)


async def _nothing_ready() -> None:
    """Give way until the event loop has nothing else to run."""
    loop: Any = asyncio.get_running_loop()
    end = time.monotonic() + LONGEST_WAIT_S
    await asyncio.sleep(0)
    while loop._ready and time.monotonic() < end:
        await asyncio.sleep(0)


async def settled(pilot: Pilot[Any], n_rounds: int = 4) -> None:
    """Wait until what was pressed has gone its way: a message goes on from part to part, and each may tell another."""
    await pilot.pause()


@contextlib.contextmanager
def alone(folder: Path) -> Iterator[None]:
    """No clipboard of the system, no settings of whoever runs this, no looks at the disk but those that are asked for."""
    environment = {"XDG_STATE_HOME": str(folder), "XDG_CONFIG_HOME": str(folder), "TEXTUAL_ANIMATIONS": "none"}
    with (
        patch.dict("os.environ", environment),
        patch("tui.clipboard._to_system", lambda text: False),
        patch("tui.clipboard._from_system", lambda: None),
        patch("tui.clipboard._to_tmux", lambda raw: False),
        patch("tui.screens.main.LOOK_EVERY_S", 1e6),
    ):
        yield


def with_editor(
    path: Path,
    script: Callable[[EditorApp, Pilot[Any]], Awaitable[T]],
    size: tuple[int, int] = (80, 24),
    settings: EditorSettings | None = None,
) -> T:
    """Open a table in the whole editor, as `contextdb edit` does, while `script` presses keys; gives what the script gives."""
    with alone(path.parent):
        app = EditorApp(Workspace(path), settings)
        try:
            return drive(app, lambda pilot: script(app, pilot), size)
        finally:
            app.workspace.close()


async def press(pilot: Pilot[Any], *keys: str) -> None:
    """Press keys, and wait until all is done that they set off."""
    await pilot.press(*keys)
    await settled(pilot)


def said(app: EditorApp) -> str:
    """What the line over the footer says."""
    return app.main._said[0]
