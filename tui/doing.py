"""Do what a person asks of a sheet, and say what was done. What takes long is worked out beside the screen.

Its share is displayed meanwhile, Esc stops it before a cell is changed, and other keys wait.
"""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from threading import Event
from typing import TypeVar

from textual.widget import Widget

from contextdb.errors import ContextDBError, Fault, TableError

from .messages import Edited, Notice
from .model.long_work import PRESENT, StoppedError, Work
from .model.sheet import Done, Sheet
from .one_key import OneKeyAtATime

T = TypeVar("T")
LONG = 100_000
"""From so many cells on a verb is long."""
CELL = 7
"""A cell that is pasted has about so many characters."""
SLOW = 500
"""A text that is mended takes about as long as so many cells that are filled."""


def do(widget: Widget, sheet: Sheet, verb: Callable[[], Done], n_cells: int = 0, then: Callable[[], None] = lambda: None) -> None:
    """Do a verb that looks at so many cells, and `then` something else; what cannot be done is reported."""
    app = widget.app
    if n_cells >= LONG and isinstance(app, OneKeyAtATime):
        stop = Event()
        app.hold_keys(stop.set)
        widget.run_worker(_beside(app, widget, sheet, verb, stop, then))
        return
    try:
        widget.post_message(Edited(verb()))
    except ContextDBError as error:
        widget.post_message(Notice(str(error), "error"))
    then()


async def _beside(
    app: OneKeyAtATime, widget: Widget, sheet: Sheet, verb: Callable[[], Done], stop: Event, then: Callable[[], None]
) -> None:
    table = sheet.table

    def tell(share: float) -> None:
        if stop.is_set():
            raise StoppedError
        full = round(20 * share)
        app.call_from_thread(widget.post_message, Notice(f"{'█' * full}{'░' * (20 - full)} {share:.0%} · Esc stops it"))

    def in_turn(change: Callable[[], T]) -> T:
        def changed() -> T:
            if stop.is_set():
                raise StoppedError
            if sheet.table is not table:
                raise TableError(Fault("the table was changed meanwhile by another program.", "the same once more"))
            return change()

        return app.call_from_thread(changed)

    def work() -> Done:
        PRESENT.set(Work(tell, in_turn))
        return verb()

    try:
        widget.post_message(Edited(await asyncio.to_thread(work)))
    except StoppedError:
        widget.post_message(Notice("Stopped: no cell was changed."))
    except ContextDBError as error:
        widget.post_message(Notice(str(error), "error"))
    finally:
        stop.set()  # also where the app is left
        app.let_keys()
    then()
