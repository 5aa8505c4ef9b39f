"""What a controller decided at one update, and why: the words that a recorded session is written in.

A `Decision` is data. A recorder is handed each one; a controller without a recorder spends nothing on it but the object itself.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from enum import StrEnum
from typing import Protocol

from contextdb.cells.row_play import RowPlay
from contextdb.errors import in_quotes
from contextdb.motion.clips.ground_place import GroundPlace
from contextdb.motion.clips.quaternions import Floats
from contextdb.motion.records import Unfinished, quickly_made
from contextdb.motion.search.candidates import Candidates
from contextdb.motion.search.filters import Filter
from contextdb.motion.selection.choice import Choice
from contextdb.motion.selection.inputs import Inputs
from contextdb.motion.selection.root_motion import NO_MOTION, RootMotion


@quickly_made
@dataclass(frozen=True, slots=True)
class Playing:
    """What a character plays.

    Attributes
    ----------
    database, asset : str
    range, frame : int
        The frame nearest to `time_s`, counted over the whole database, and its range.
    time_s : float
        Seconds since the start of the range.
    mirrored : bool
    permutation_s : float or None
        How many seconds ahead the permuted channels of the range look; None for a database without permutations.
    """

    database: str
    asset: str
    range: int
    frame: int
    time_s: float
    mirrored: bool
    permutation_s: float | None = None


def plays(playing: Playing | None) -> str:
    """What plays, in the line by which things show themselves."""
    return "plays nothing" if playing is None else f"plays {in_quotes(playing.asset)}"


class Action(StrEnum):
    """What an update did to the playing animation."""

    START = "starts"
    """Something plays where nothing did."""
    CONTINUE = "plays on"
    JUMP = "jumps"
    """To another frame, of the same asset or another: here a game blends."""
    LOOP = "loops"
    """Plays on, and passed the end of a looping range on the way."""
    HOLD = "holds"
    """The last frame is held: the clip has ended and nothing else may play."""
    NOTHING = "plays nothing"


@dataclass(frozen=True, slots=True)
class Together:
    """A choice for several characters at once, as one of them records it.

    Attributes
    ----------
    role : str
        Of the character whose decision it is.
    asset : str
        Without the role.
    time_s : float
        Where it is entered: seconds since its start.
    cast : mapping of role to str
        Who plays it.
    costs : mapping of role to mapping of channel to float
    bias : float
    """

    role: str
    asset: str
    time_s: float
    cast: Mapping[str, str]
    costs: Mapping[str, Mapping[str, float]]
    bias: float = 0.0


@quickly_made
@dataclass(frozen=True, slots=True)
class Decision(Unfinished):
    """One update of a controller. What nobody reads, such as `why`, is not worked out.

    Attributes
    ----------
    tick : int
        Counts the updates from 0.
    time_s : float
        Seconds of play, this update's in it.
    action : Action
    why : str
        One sentence for people.
    searched : bool
    playing, before : Playing or None
        What plays after the update; and what would play without a search: what played before, moved on.
    cost : float or None
        Of the chosen frame, its biases in it; None without a search, or where the search had no result.
    continuing_cost : float or None
        Of the frame that would play on, the continuing bias in it; None without a search, or when nothing may play on.
    choice : Choice or None
        The selector's answer; None without a search.
    context : mapping of str to object, or None
        The facts of the moment, as they were given.
    query : float64 array, shape (F,), or None
        What was requested.
    candidates : sequence of (database name, Candidates)
        Of the databases that were searched, worked out when they are first requested; empty unless the recorder asks for them.
    search_us : float or None
        Microseconds that searching took; None without a search, or without a clock.
    root_motion : RootMotion
        How the playing animation moved the body since the last update.
    root_weight : float
        How much of its movement is to come from the animation, from 0 to 1; the rest is the game's.
    body : (x, z, heading) or None
        Where the game had the body, as it was given.
    held : str
        What let an asset that is no longer valid play on: "next natural", "until natural", "cost bar" or "hysteresis"; empty when
        nothing had to.
    play_rate : float
        Seconds of the clip that pass in a second, from here to the next update.
    filters : tuple of (database name, Filter)
        What could be chosen from in each database that was, or could have been, searched; empty without a search, and where no
        candidates are requested.
    inputs : Inputs or None
        What else the update was given; None where no candidates are requested.
    play : RowPlay or None
        How the row of what plays says that it does; None where it says nothing.
    together : Together or None
        Where a clip of several characters is entered: who plays it, and what each role costs.
    """

    tick: int
    time_s: float
    action: Action
    why: str
    searched: bool
    playing: Playing | None
    before: Playing | None
    cost: float | None = None
    continuing_cost: float | None = None
    choice: Choice | None = None
    context: Mapping[str, object] | None = None
    query: Floats | None = None
    candidates: Sequence[tuple[str, Candidates]] = ()
    search_us: float | None = None
    root_motion: RootMotion = NO_MOTION
    root_weight: float = 1.0
    body: GroundPlace | None = None
    held: str = ""
    play_rate: float = 1.0
    play: RowPlay | None = None
    filters: tuple[tuple[str, Filter], ...] = field(default=(), compare=False, repr=False)
    inputs: Inputs | None = field(default=None, compare=False, repr=False)
    together: Together | None = None

    @property
    def is_forced(self) -> bool:
        """Whether it is a jump that had to be: nothing could play on."""
        return self.action is Action.JUMP and self.continuing_cost is None


class Feed(Protocol):
    """Where a watcher puts decisions."""

    is_open: bool
    """Whether somebody listens."""


class Watcher(Protocol):
    """The link of a running game that watches a controller."""

    @property
    def feed(self) -> Feed: ...

    @property
    def n_candidates(self) -> int:
        """As for a recorder."""
        ...

    def decided(self, decision: Decision) -> None:
        """Take one decision, while the feed is open."""
        ...


class Recorder(Protocol):
    """Something that keeps decisions."""

    n_candidates: int
    """How many candidates of each searched database its decisions show; 0 for none, and for nothing that they could be worked
    out from."""

    def record(self, decision: Decision) -> None:
        """Take one decision."""
