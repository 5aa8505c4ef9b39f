"""The whole session with other weights: how many of its searches choose otherwise, and what it measures when it is run again."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

from contextdb.motion.trace.reasked import Changes, Reasked
from contextdb.motion.trace.stats import measures_of
from contextdb.motion.trace.what_if import run_again

from .recording import Recording, Turned

Measured = Mapping[str, float | None]
Progress = Callable[[float], None]
"""Takes the share that is done; raises Cancelled to end it."""
LABELS = (
    ("jumps_per_s", "jumps a second", "{:.2f}"),
    ("forced_jumps", "forced jumps", "{:.0f}"),
    ("stay_s", "s in a clip", "{:.2f}"),
)


class Cancelled(Exception):
    """The work is no longer wanted."""


@dataclass(frozen=True)
class Outcome:
    """What weights make of a session.

    Attributes
    ----------
    searches, other_frames, other_assets : int
        How many recorded searches there are, and how many of them choose another frame, and another asset.
    before, after : mapping of str to float or None
        Measures of the session run again without and with them.
    """

    searches: int
    other_frames: int
    other_assets: int
    before: Measured
    after: Measured

    @property
    def text(self) -> str:
        text = f"{self.other_assets:,} of {self.searches:,} searches choose another asset"
        for name, label, form in LABELS:
            was, now = self.before.get(name), self.after.get(name)
            if was is not None and now is not None:
                text += f" · {label} {form.format(was)} → {form.format(now)}"
        return text


def outcome_of(recording: Recording, turned: Turned, progress: Progress) -> Outcome:
    """What weights make of a session. Raises MotionError where it cannot be run again."""
    n = len(recording)
    steps = _Steps(progress, 4 * n)
    recording.decisions(steps.step)
    steps.at(n)
    counts = repeated_searches(recording, turned, steps.step)
    return Outcome(*counts, *run_both(recording, turned, steps.step))


def repeated_searches(recording: Recording, turned: Turned, on_step: Callable[[], None]) -> tuple[int, int, int]:
    """How many searches there are, and how many choose another frame, and another asset."""
    n_searches = n_frames = n_assets = 0
    for decision in _reasked(recording, turned):
        on_step()
        if decision.choice is not None:
            n_searches += 1
            n_frames += decision.is_changed
            n_assets += decision.is_other_asset
    return n_searches, n_frames, n_assets


def run_both(recording: Recording, turned: Turned, on_step: Callable[[], None]) -> tuple[Measured, Measured]:
    """The measures of the session run again in closed loop, without the weights and with them."""
    about = recording.trace.about
    if recording.run_again is None:
        recording.run_again = measures_of(run_again(_reasked(recording, Turned()), on_step), about)
    return recording.run_again, measures_of(run_again(_reasked(recording, turned), on_step), about)


def _reasked(recording: Recording, turned: Turned) -> Reasked:
    decisions = recording.decisions(lambda: None)
    changes: Changes = {"weights": turned.weights, "thresholds": dict(turned.thresholds)}
    return Reasked(decisions, recording.trace.about, recording.stock, changes)


class _Steps:
    """Counts steps, and tells of each hundredth."""

    def __init__(self, progress: Progress, n: int) -> None:
        self._progress, self._n, self._done = progress, max(1, n), 0

    def step(self) -> None:
        self.at(self._done + 1)

    def at(self, done: int) -> None:
        self._done = done
        if self._done % 50 == 0:
            self._progress(min(1.0, self._done / self._n))
