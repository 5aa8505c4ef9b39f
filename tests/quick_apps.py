"""Textual apps in tests, that wait for what is to be done and not for time to pass.

After each key Textual sleeps until the process has used little of the processor for a while: 40 to 80 ms, most of a test's time.
Here a key has done its work once the event loop has nothing left to run, which is sooner, and holds on a busy machine too.

Apps share the rules that Textual reads in their style sheets, which no app changes, and leave nothing behind in Textual's caches.
"""

from __future__ import annotations

import asyncio
import contextlib
import threading
import time
from collections.abc import Iterator
from typing import Any
from unittest.mock import patch

from textual._context import active_app
from textual._styles_cache import StylesCache
from textual._wait import wait_for_idle
from textual.app import App
from textual.css.model import RuleSet
from textual.css.stylesheet import Stylesheet

N_UPDATES = 2
"""What is laid out anew may have to be painted anew."""
LONGEST_WAIT_S = 10.0
_read_rules = Stylesheet._parse_rules
_rules: dict[tuple[Any, ...], dict[tuple[Any, ...], list[RuleSet]]] = {}
"""By the variables of a style sheet, and by its source: the rules that stand in it."""


@contextlib.contextmanager
def quick() -> Iterator[None]:
    """Apps that are run here wait so."""
    n_threads = threading.active_count()

    async def rested(min_sleep: float = 0.0, max_sleep: float = 1.0) -> None:
        await _rested(active_app.get())
        # A thread that is at work may send the app something later: as long as there is one, Textual's way is the only one.
        if threading.active_count() > n_threads:
            await wait_for_idle(0)

    with (
        patch("textual.app.wait_for_idle", rested),
        patch("textual.pilot.wait_for_idle", rested),
        patch.object(Stylesheet, "_parse_rules", _shared_rules),
        patch.object(RuleSet, "__hash__", object.__hash__),  # by identity as before, without a call of Python for each
    ):
        try:
            yield
        finally:
            # It keeps the last 1024 widgets, and each keeps all lines that it drew: some hundred megabytes.
            StylesCache.get_inner_outer.cache_clear()


def _shared_rules(
    sheet: Any, css: str, read_from: Any, is_default_rules: bool = False, tie_breaker: int = 0, scope: str = ""
) -> Any:
    """What Textual's method of this name gives, worked out once for all apps."""
    variables, rules = vars(sheet).get("shared", (None, {}))
    if variables is not sheet._variables:
        rules = _rules.setdefault(tuple(sheet._variables.items()), {})
        sheet.shared = sheet._variables, rules
    source = css, read_from, is_default_rules, tie_breaker, scope
    if source not in rules:
        rules[source] = _read_rules(sheet, *source)
    return rules[source]


async def _rested(app: App[Any]) -> None:
    """Wait until no part of the app has anything to do, and the screen shows it."""
    end = time.monotonic() + LONGEST_WAIT_S
    await _nothing_ready(end)
    while app._running and getattr(app, "_resize_timer", None) is not None and time.monotonic() < end:
        await asyncio.sleep(0.002)  # a new size counts once it has lasted for some milliseconds
    for _ in range(N_UPDATES):
        await _nothing_ready(end)
        if app._exception is None and app._running and app.screen_stack:
            app.screen._on_timer_update()
    await _nothing_ready(end)


async def _nothing_ready(end: float) -> None:
    """Give way until the event loop has nothing else to run."""
    loop: Any = asyncio.get_running_loop()
    await asyncio.sleep(0)
    while loop._ready and time.monotonic() < end:
        await asyncio.sleep(0)
