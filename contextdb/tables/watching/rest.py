"""When the files of a folder may be read: after they have rested. Knows stamps and times, and touches neither disk nor clock.

A file that was written a moment ago may be half-written, or about to be written again. So all files must have rested for
`settle_s`. Saves that never rest would put that off for ever; after `patience_s` of unrest the files may be read all the same,
unless one of those that have not rested was written in place: a file that was put there whole, by a rename, is whole.
"""

from __future__ import annotations

from pathlib import Path

from contextdb.tables.watching.stamps import Stamps

PATIENCE_S = 1.0


class Rest:
    """What is known of a folder's files: their stamps, and when each was last seen to change."""

    def __init__(self, seen: Stamps, now: float, settle_s: float, patience_s: float = PATIENCE_S) -> None:
        self._seen = dict(seen)
        self._moved: dict[Path, tuple[float, bool]] = {}
        """Of each file that changed: when that was seen, and whether it was replaced whole."""
        self._restless_since = now
        self._settle_s, self._patience_s = settle_s, patience_s
        self.moved_s = now
        """When the last change was seen."""

    def is_due(self, seen: Stamps, now: float) -> bool:
        """Whether the files, whose stamps were taken now, may be read."""
        was_restless = bool(self._restless(now))
        for path in sorted(seen.keys() | self._seen.keys()):
            before, after = self._seen.get(path), seen.get(path)
            if before != after or (path in seen) != (path in self._seen):
                self._moved[path] = now, before is not None and after is not None and before[0] != after[0]
                self.moved_s = now
        self._seen = dict(seen)
        if not was_restless:
            self._restless_since = now
        restless = self._restless(now)
        if not restless:
            return True
        return now - self._restless_since >= self._patience_s and all(was_replaced for _, was_replaced in restless)

    def disturb(self, now: float) -> None:
        """Wait for another rest: the files are not what their stamps promised."""
        self._moved = dict.fromkeys(self._seen, (now, False))
        self.moved_s = now

    def taken(self, now: float) -> None:
        """The files were read: patience begins again."""
        self._restless_since = now

    def wait_s(self, now: float) -> float | None:
        """Seconds until the files have rested if nothing moves; None when they have."""
        restless = self._restless(now)
        return max(moved for moved, _ in restless) + self._settle_s - now if restless else None

    def _restless(self, now: float) -> list[tuple[float, bool]]:
        self._moved = {path: move for path, move in self._moved.items() if now - move[0] < self._settle_s}
        return list(self._moved.values())
