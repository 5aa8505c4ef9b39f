"""Typing faster than the screen: an app that takes one key at a time."""

from __future__ import annotations

import asyncio
from collections import deque
from collections.abc import Callable, Sequence
from typing import Any, cast

from textual import events
from textual.app import App
from textual.dom import DOMNode
from textual.filter import LineFilter
from textual.widget import Widget

from contextdb.console import ScreenCrash

from .drawn import SameWidths

SAME_WIDTHS = SameWidths()
WAIT_FOR_PART_S = 2.0
"""So long a key waits for a part of the screen that is still at work on the key before."""


class OneKeyAtATime(App[None]):
    """An app in which what is typed after a key that opens something is meant for that."""

    def __init__(self) -> None:
        super().__init__()
        self._ahead: deque[events.Event] = deque()
        """What was typed before the key before it has done all it does."""
        self._settling: asyncio.Task[None] | None = None
        self._stop: Callable[[], None] | None = None
        """Stops long work, while which keys wait."""

    def stay(self) -> int:
        """Show the app until it is left; gives its exit code. Raises ScreenCrash where an error escaped from a screen; the terminal
        is restored."""
        try:
            self.run()
        except (KeyboardInterrupt, SystemExit):
            raise
        except BaseException as error:  # a panic of polars is no Exception
            self._end_painting()
            raise ScreenCrash(error) from error
        if self._exception is not None:
            self._end_painting()
            raise ScreenCrash(self._exception)
        return self.return_code or 0

    def _end_painting(self) -> None:
        """Wait until the terminal got all that was painted: a thread paints, and Textual does not wait for it on every way out."""
        if self._driver is not None:
            self._driver.close()

    def on_load(self) -> None:
        """Watch every task: Textual ends the app for an Exception, but waits for ever for a part that ended by another error."""
        loop = asyncio.get_running_loop()
        make: Callable[..., Any] = loop.get_task_factory() or (
            lambda loop, work, **options: asyncio.Task(work, loop=loop, **options)
        )

        def watched(loop: asyncio.AbstractEventLoop, work: Any, **options: Any) -> asyncio.Task[Any]:
            task: asyncio.Task[Any] = make(loop, work, **options)
            task.add_done_callback(self._end_with)
            return task

        loop.set_task_factory(watched)

    def _end_with(self, task: asyncio.Task[Any]) -> None:
        error = None if task.cancelled() else task.exception()
        if error is not None and not isinstance(error, (Exception, KeyboardInterrupt, SystemExit)):  # a panic of polars
            self._handle_exception(cast(Exception, error))

    def _fatal_error(self) -> None:
        """End without Textual's traceback, which shows the values of variables, and so the table."""
        self._close_messages_no_wait()

    def hold_keys(self, stop: Callable[[], None]) -> None:
        """From now on keys wait, but for Esc, which stops something."""
        self._stop = stop

    def let_keys(self) -> None:
        """Take the keys that waited."""
        self._stop = None
        self.call_later(self._take_next)

    def get_line_filters(self) -> Sequence[LineFilter]:
        """Also one that keeps columns from drifting."""
        return [*super().get_line_filters(), SAME_WIDTHS]

    async def on_event(self, event: events.Event) -> None:
        """Take one key at a time. A key can open an editor or a dialog, and what is typed after it is meant for that."""
        if self._stop is not None and isinstance(event, events.Key) and event.key == "escape":
            self._stop()
            return
        is_waiting = self._stop is not None or self._settling is not None or bool(self._ahead)
        if is_waiting and isinstance(event, (events.InputEvent, events.Paste)) and not event.is_forwarded:
            self._ahead.append(event)
        else:
            await self._take(event)

    async def _take(self, event: events.Event) -> None:
        is_typed = isinstance(event, (events.Key, events.Paste)) and not event.is_forwarded
        await super().on_event(event)
        if is_typed and self._settling is None:
            self._settling = asyncio.create_task(self._settle())

    async def _settle(self) -> None:
        """Wait until the parts that a key may have gone to have done their work, and those that it made are there."""
        for _ in range(2):
            for part in self._parts_at_work():
                await _done(part)
        self._settling = None
        self.call_later(self._take_next)

    def _parts_at_work(self) -> list[DOMNode]:
        if not self.screen_stack:
            return []
        new = [part for part in self.screen.walk_children(Widget, with_self=True) if not part.is_mounted]
        return [*(self.focused or self.screen).ancestors_with_self, *new, self]

    async def _take_next(self) -> None:
        while self._ahead and self._settling is None and self._stop is None:
            await self._take(self._ahead.popleft())


async def _done(part: DOMNode) -> None:
    """Wait until a part of the screen has handled all that it received up to now; one that is being closed is not waited for."""
    done = asyncio.Event()
    if part.post_message(events.Callback(done.set)):  # `call_later` wraps it, and Textual then inspects it anew each time
        try:
            await asyncio.wait_for(done.wait(), WAIT_FOR_PART_S)
        except TimeoutError:
            return
