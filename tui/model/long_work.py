"""Long work on a table that says which share of it is done, and can be stopped. Nothing is changed before all of it is worked out.

A verb of a sheet takes its steps `with_progress`, and changes the sheet `in_turn`. Where nobody works off the screen's thread
both do nothing; see `tui.doing`.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable, Iterator
from contextvars import ContextVar
from dataclasses import dataclass
from typing import Any, TypeVar

T = TypeVar("T")
EVERY = 512
"""After so many steps it is looked whether there is something to say."""
OFTEN_S = 0.1


class StoppedError(Exception):
    """The work is no longer wanted."""


@dataclass(frozen=True)
class Work:
    """What long work off the screen's thread reports to."""

    tell: Callable[[float], None]
    """Takes the share that is done; raises `StoppedError` once the work is no longer wanted."""
    in_turn: Callable[[Callable[[], Any]], Any]
    """Does something where the screen is not at work on the sheet."""


PRESENT: ContextVar[Work | None] = ContextVar("PRESENT", default=None)


def with_progress(steps: Iterable[T], n_steps: int, every: int = EVERY) -> Iterable[T]:
    """The steps, of which there are about so many; `every` is 1 for those that take long."""
    work = PRESENT.get()
    return steps if work is None else _reporting(work, steps, n_steps, every)


def _reporting(work: Work, steps: Iterable[T], n_steps: int, every: int) -> Iterator[T]:
    last_s = 0.0
    for at, step in enumerate(steps):
        if at % every == 0 and (now := time.monotonic()) - last_s >= OFTEN_S:
            last_s = now
            work.tell(min(at / max(n_steps, 1), 1.0))
        yield step


def in_turn(change: Callable[[], T]) -> T:
    """Make a change on the editor's thread, from the work that runs beside it."""
    work = PRESENT.get()
    if work is None:
        return change()
    done: T = work.in_turn(change)
    return done
