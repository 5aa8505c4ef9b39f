"""Drive a Textual app in tests without a terminal, and read its screen as text."""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable, Callable
from typing import Any, TypeVar

from textual.app import App
from textual.pilot import Pilot

T = TypeVar("T")


def screen_text(app: App[Any]) -> str:
    """What stands on the screen, line by line, without spaces at the ends of lines."""
    strips = app.screen._compositor.render_strips()
    return "\n".join("".join(segment.text for segment in strip).rstrip() for strip in strips)


def drive(app: App[Any], script: Callable[[Pilot[Any]], Awaitable[T]], size: tuple[int, int] = (80, 24)) -> T:
    """Run an app on a screen of (columns, rows) while `script` presses keys; gives what the script gives."""

    async def run() -> T:
        app.animation_level = "none"
        async with app.run_test(size=size) as pilot:
            await pilot.pause()
            return await script(pilot)

    return asyncio.run(run())


async def settled(pilot: Pilot[Any], n_rounds: int = 4) -> None:
    """Wait until what was pressed has gone its way: a message goes on from part to part, and each may tell another."""
    for _ in range(n_rounds):
        await pilot.pause()
