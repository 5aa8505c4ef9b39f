"""How far a long computation is, reported to the caller, and a way to stop it. Neither changes what comes out."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from contextdb.errors import ContextDBError

Tell = Callable[[str, float], None]
"""Receives what is being worked out, and which share (0…1) of the whole is done."""
Stops = Callable[[], bool]


class Cancelled(ContextDBError):
    """The computation was stopped by whoever requested it."""


@dataclass(frozen=True)
class Progress:
    """Whom to tell, and whom to ask whether to stop; one part of the work goes from `start` to `stop` of the whole."""

    tell: Tell | None = None
    should_stop: Stops | None = None
    part: str = ""
    start: float = 0.0
    stop: float = 1.0

    def within(self, part: str, start: float, stop: float) -> Progress:
        """The same for a part of the work, which begins now."""
        progress = Progress(self.tell, self.should_stop, part, start, stop)
        progress.at(0.0)
        return progress

    def check(self) -> None:
        """Raise Cancelled when it is time to stop."""
        if self.should_stop is not None and self.should_stop():
            raise Cancelled("the computation was stopped.")

    def at(self, share: float) -> None:
        """Say which share of the part is done, and stop if it is time to."""
        self.check()
        if self.tell is not None:
            self.tell(self.part, self.start + min(1.0, max(0.0, share)) * (self.stop - self.start))


SILENT = Progress()
