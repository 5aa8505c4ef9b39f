"""Where a controller is: all that its next decision depends on beside what it is then asked. Small, frozen, to be stored and put
back, as rollback over a network does."""

from __future__ import annotations

from dataclasses import dataclass

from contextdb.cells.row_play import RowPlay
from contextdb.motion.records import quickly_made
from contextdb.motion.selection.decision import Playing


@quickly_made
@dataclass(frozen=True, slots=True)
class Played:
    """Frames [start, stop) of a database, and the moment at which they were played; of permutations those of the first."""

    database: str
    start: int
    stop: int
    time_s: float


@quickly_made
@dataclass(frozen=True, slots=True)
class ControllerState:
    """A controller's state. The one that nothing is given to is that of a new controller.

    Attributes
    ----------
    tick : int
        How many updates there were.
    time_s : float
        Seconds of play.
    playing : Playing or None
    since_search_s : float
        Seconds since the last search.
    history : tuple of Played
        What was played within the last seconds.
    recent : tuple of str
        The assets of the last changes, as far as variation remembers them.
    play_rate : float
        Seconds of the clip that pass in a second.
    waiting_since_s : float, optional
        Since when a forced jump over the cost bar waits, in seconds of play; None when none does.
    play : RowPlay or None
        How the row of what plays says that it does; None where it says nothing.
    entered_s : float
        When what plays was entered, in seconds of play.
    rng : object
        Where the random generator is; None without one.
    """

    tick: int = 0
    time_s: float = 0.0
    playing: Playing | None = None
    since_search_s: float = 0.0
    history: tuple[Played, ...] = ()
    recent: tuple[str, ...] = ()
    play_rate: float = 1.0
    waiting_since_s: float | None = None
    play: RowPlay | None = None
    entered_s: float = 0.0
    rng: object = None
