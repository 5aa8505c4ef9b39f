"""Drive a Textual app in tests without a terminal, and read its screen as text."""

import asyncio
import contextlib
from collections.abc import Awaitable, Callable, Iterator
from pathlib import Path
from typing import Any, TypeVar
from unittest.mock import patch

from quick_apps import painted, quick
from strategies import IS_FULL
from textual.app import App
from textual.pilot import Pilot

from tui.app import EditorApp
from tui.editor_settings import EditorSettings
from tui.model.workspace import Workspace

T = TypeVar("T")


def screen_text(app: App[Any]) -> str:
    """What stands on the screen, line by line, without spaces at the ends of lines."""
    strips = app.screen._compositor.render_strips()
    return "\n".join("".join(segment.text for segment in strip).rstrip() for strip in strips)


def drive(
    app: App[Any], script: Callable[[Pilot[Any]], Awaitable[T]], size: tuple[int, int] = (80, 24), paints: bool = IS_FULL
) -> T:
    """Run an app on a screen of (columns, rows) while `script` presses keys; gives what the script gives.

    `paints`: paint after each key what it has changed, as a terminal is painted; else once when a screen has opened and at the end.
    """

    async def run() -> T:
        app.animation_level = "none"
        async with app.run_test(size=size) as pilot:
            await pilot.pause()
            found = await script(pilot)
            await painted(app)
            return found

    with quick(paints):
        return asyncio.run(run())


async def settled(pilot: Pilot[Any]) -> None:
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
    paints: bool = IS_FULL,
) -> T:
    """Open a table in the whole editor, as `contextdb edit` does, while `script` presses keys; gives what the script gives.
    `paints` as in `drive`."""
    with alone(path.parent):
        app = EditorApp(Workspace(path), settings)
        try:
            return drive(app, lambda pilot: script(app, pilot), size, paints)
        finally:
            app.workspace.close()


async def press(pilot: Pilot[Any], *keys: str) -> None:
    """Press keys, and wait until all is done that they set off."""
    await pilot.press(*keys)
    await settled(pilot)


def said(app: EditorApp) -> str:
    """What the line over the footer says."""
    return app.main._notice[0]
