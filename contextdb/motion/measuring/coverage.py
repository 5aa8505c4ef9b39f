"""Motion coverage: where in speed, turn and direction the clips have nothing, for each set of clips that a table lets play.

    databases ─► frames of each clip in bins ─┐
    contexts: which assets are valid, share ──┴─► per context: filled, wanted, holes ─► shares of bins ─► what to capture next

A bin is filled in a context when clips that are valid there, mirrored ones by mirrored facts, have LEAST_FRAMES in it. Frames that
the markup never lets play do not count.

A bin is wanted in a context
  - when it lies between filled bins of its row or column. Where the context is the same in a mirror, each filled bin is taken with
    that of the same movement to the other side, as what turns left there may have to turn right;
  - where the context asks for speeds, turns or directions, only if it is requested. Turns and directions that are requested are all
    wanted at the speeds that are; a speed that is requested and that no valid clip has is wanted once, as straight as they go.

What goes ahead is judged in the map of turns alone.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from contextdb.cells.arguments import require_kind, require_many, require_mapping, require_real, require_text
from contextdb.errors import Fault, MotionError, in_quotes
from contextdb.motion.clips.quaternions import Floats
from contextdb.motion.measuring.moves import LEAST_FRAMES, MAPS, TURN, WINDOW_S, Bools, ClipContexts, Counts, Moves, wanted_bins
from contextdb.motion.measuring.usage import NEAR_COST, PATTERN, Near, Tell, TransitionCoverage, near_clips, transitions_of, usable
from contextdb.motion.search.database import MotionDatabase

MOST_ELSEWHERE = 3
"""So many clips are named that move as a hole asks, but are not valid there."""
NO_FRAMES = {name: np.zeros(of.shape, np.int64) for name, of in MAPS.items()}


@dataclass(frozen=True, eq=False)
class ClipFrames:
    """A clip: its frames in the bins of each map, plain and mirrored, and how many of its frames can never play."""

    asset: str
    database: str
    n_frames: int
    n_dead: int
    plain: Mapping[str, Counts]
    mirrored: Mapping[str, Counts] | None


@dataclass(frozen=True, eq=False)
class ContextCoverage:
    """What some contexts have: for each map the frames of the clips valid there, which bins are filled, and which are wanted."""

    contexts: ClipContexts
    frames: Mapping[str, Counts]
    wanted: Mapping[str, Bools]

    @property
    def filled(self) -> dict[str, Bools]:
        return {name: frames >= LEAST_FRAMES for name, frames in self.frames.items()}

    @property
    def holes(self) -> dict[str, Bools]:
        """The wanted bins that are not filled."""
        return {name: self.wanted[name] & ~filled for name, filled in self.filled.items()}

    @property
    def n_wanted(self) -> int:
        """How many bins are wanted, in both maps."""
        return sum(int(wanted.sum()) for wanted in self.wanted.values())

    @property
    def n_holes(self) -> int:
        """How many of them are not filled."""
        return sum(int(holes.sum()) for holes in self.holes.values())

    @property
    def covered(self) -> float:
        """The share of the wanted bins that is filled; 1 where none is wanted."""
        return 1.0 - self.n_holes / self.n_wanted if self.n_wanted else 1.0


@dataclass(frozen=True)
class ToCapture:
    """A bin that a clip should be captured for."""

    map: str
    row: int
    column: int
    fills: float
    """The share of all wanted bins, each weighed by its contexts, that a clip with it would fill; with the opposite bin where the
    clip would be played mirrored too."""
    contexts: float
    """The share of the contexts in which it is missing."""
    elsewhere: tuple[str, ...]
    """Clips that move so, and are not valid where it is missing: a cell of the table may be all that is wrong."""
    is_both_sides: bool

    @property
    def words(self) -> str:
        """What to capture."""
        return MAPS[self.map].words(self.row, self.column)

    def to_json(self) -> dict[str, object]:
        return {
            "map": self.map,
            "row": self.row,
            "column": self.column,
            "what": self.words,
            "fills": self.fills,
            "contexts": self.contexts,
            "both_sides": self.is_both_sides,
            "elsewhere": list(self.elsewhere),
        }


@dataclass(frozen=True, eq=False)
class MotionCoverage:
    """What the clips of one table, or of databases without one, have of motion. Shares are of all contexts."""

    table: str | None
    databases: tuple[str, ...]
    clips: tuple[ClipFrames, ...]
    contexts: tuple[ContextCoverage, ...]
    """The largest share first."""
    transitions: TransitionCoverage
    near: tuple[Near, ...]
    never_valid: tuple[str, ...]
    """Clips that no context lets play."""

    @property
    def n_frames(self) -> int:
        """The frames of all clips, without mirrored ones."""
        return sum(clip.n_frames for clip in self.clips)

    @cached_property
    def dead(self) -> tuple[ClipFrames, ...]:
        """The clips with frames that the markup never lets play, those with most of them first."""
        return tuple(
            sorted((clip for clip in self.clips if clip.n_dead), key=lambda clip: (-clip.n_dead / clip.n_frames, clip.asset))
        )

    @cached_property
    def frames(self) -> dict[str, Counts]:
        """The frames of all clips in the bins of each map, mirrored ones too, whatever the context."""
        return _summed(counts for clip in self.clips for counts in (clip.plain, clip.mirrored) if counts is not None)

    @cached_property
    def filled_shares(self) -> dict[str, Floats]:
        """For each bin of each map the share of the contexts in which it is filled."""
        return self._weighed(lambda each, name: each.filled[name])

    @cached_property
    def wanted_shares(self) -> dict[str, Floats]:
        """For each bin of each map the share of the contexts in which it is wanted."""
        return self._weighed(lambda each, name: each.wanted[name])

    @cached_property
    def hole_shares(self) -> dict[str, Floats]:
        """For each bin of each map the share of the contexts in which it is wanted and not filled."""
        return self._weighed(lambda each, name: each.holes[name])

    @property
    def covered(self) -> float:
        """The share of the wanted bins that is filled, each weighed by the share of its contexts.

        1 where none is wanted, 0 where no context has a valid clip.
        """
        if not self.contexts:
            return 0.0
        wanted = sum(float(shares.sum()) for shares in self.wanted_shares.values())
        holes = sum(float(shares.sum()) for shares in self.hole_shares.values())
        return 1.0 - holes / wanted if wanted > 0.0 and holes > 0.0 else 1.0

    def _weighed(self, flags_of: Callable[[ContextCoverage, str], Bools]) -> dict[str, Floats]:
        maps = {name: np.zeros(of.shape) for name, of in MAPS.items()}
        for each in self.contexts:
            for name, total in maps.items():
                total += each.contexts.share * flags_of(each, name)
        return {name: np.minimum(total, 1.0) for name, total in maps.items()}

    @cached_property
    def to_capture(self) -> tuple[ToCapture, ...]:
        """The holes, those first that a clip would fill most of."""
        wanted = sum(float(shares.sum()) for shares in self.wanted_shares.values())
        clips = []
        for name, shares in self.hole_shares.items():
            for row, column in np.argwhere(shares > 0.0).tolist():
                other = MAPS[name].opposite[column]
                is_both = self.is_mirrored and other != column
                if is_both and (shares[row, other], -other) > (shares[row, column], -column):
                    continue  # that of the other side is listed
                fills = float(shares[row, column] + (shares[row, other] if is_both else 0.0)) / wanted
                elsewhere = self._elsewhere(name, row, column)
                clips.append(ToCapture(name, row, column, fills, float(shares[row, column]), elsewhere, is_both))
        return tuple(sorted(clips, key=lambda each: (-each.fills, each.map != TURN, each.row, each.column)))

    @property
    def is_mirrored(self) -> bool:
        """Whether clips are played mirrored too."""
        return any(clip.mirrored is not None for clip in self.clips)

    def _elsewhere(self, name: str, row: int, column: int) -> tuple[str, ...]:
        frames = {
            clip.asset: int(clip.plain[name][row, column]) + (int(clip.mirrored[name][row, column]) if clip.mirrored else 0)
            for clip in self.clips
        }
        fitting = [asset for asset, n in sorted(frames.items(), key=lambda item: (-item[1], item[0])) if n >= LEAST_FRAMES]
        return tuple(fitting[:MOST_ELSEWHERE])


def coverage(
    databases: Mapping[str, MotionDatabase],
    contexts: Sequence[ClipContexts] | None = None,
    *,
    table: str | None = None,
    never_valid: Iterable[str] = (),
    pattern: str = PATTERN,
    near_cost: float = NEAR_COST,
    progress: Tell | None = None,
) -> MotionCoverage:
    """Measure where in speed, turn and direction the clips of some databases have nothing.

    Parameters
    ----------
    databases : mapping of str to MotionDatabase
        By name; built from clips, so that their root motion is known. A clip that is in several counts once.
    contexts : sequence of ClipContexts, optional
        Which clips are valid when; `contextdb.authoring.clip_contexts` gives those of a table. Default: all clips, always.
    table : str, optional
        The name of the table that they are of.
    never_valid : iterable of str
        Clips that no context lets play.
    pattern : str
        How clips of transitions are named, with `{from}` and `{to}`.
    near_cost : float
        Clips that lie within this cost of another are listed; see `near_clips`.
    progress : function of (done, total, clip name), optional

    Raises
    ------
    MotionError
        No database, one without root motion, or a pattern that is none.
    ContextError
        An argument of another type.
    """
    require_text(pattern, "pattern")
    require_real(near_cost, "near_cost", 0.0)
    if table is not None:
        require_text(table, "table")
    never = tuple(
        require_text(each, "one of never_valid") for each in require_many(never_valid, "never_valid", "the names of clips")
    )
    given = _measurable(databases)
    clips = tuple(_clips(given))
    listed = [_all_of(clips)] if contexts is None else list(require_many(contexts, "contexts", "a list of ClipContexts"))
    for each in listed:
        require_kind(each, ClipContexts, "one of contexts", "a ClipContexts")
    measured = _measured(clips, listed)
    near = (pair for database in given.values() for pair in near_clips(database, near_cost, progress))
    once = {each.asset: each for each in sorted(near, key=lambda each: -each.cost)}
    transitions = transitions_of([clip.asset for clip in clips], pattern)
    return MotionCoverage(
        table,
        tuple(given),
        clips,
        tuple(measured),
        transitions,
        tuple(sorted(once.values(), key=lambda each: (each.cost, each.asset))),
        never,
    )


def _measurable(databases: Mapping[str, MotionDatabase]) -> dict[str, MotionDatabase]:
    """The databases, of which it is known how their clips move; at least one."""
    given = dict(require_mapping(databases, "databases", "a mapping of names to MotionDatabase"))
    for name, database in given.items():
        require_kind(database, MotionDatabase, "one of databases", "a MotionDatabase")
        if database.root is None or database.schema is None:
            problem = f"the database {in_quotes(str(name))} was made from features, so that nobody knows how its clips move."
            raise MotionError(Fault(problem, "a database built from clips"))
    if not given:
        raise MotionError(Fault("there is no database to measure.", "at least one"))
    return given


def _all_of(clips: Sequence[ClipFrames]) -> ClipContexts:
    assets = frozenset(clip.asset for clip in clips)
    return ClipContexts(assets, frozenset(clip.asset for clip in clips if clip.mirrored is not None))


def _clips(databases: Mapping[str, MotionDatabase]) -> Iterator[ClipFrames]:
    """Each clip once, of the first database that has it; mirrored if any plays it mirrored."""
    clips: dict[str, ClipFrames] = {}
    for name, database in databases.items():
        assert database.root is not None
        assert database.schema is not None
        plays = usable(database)
        for number, asset in enumerate(database.assets):
            start, stop = int(database.starts[number]), int(database.stops[number])
            if stop == start or number % database.n_permutations:
                continue
            counts = Moves.of(database.root[start:stop].astype(np.float64), database.schema.rate).counts(plays[start:stop])
            is_mirrored = bool(database.mirrored[number])
            n_dead = int((~plays[start:stop]).sum())
            new = ClipFrames(asset, name, stop - start, n_dead, NO_FRAMES if is_mirrored else counts, None)
            known = clips.setdefault(asset, new)
            if is_mirrored and known.mirrored is None:
                clips[asset] = replace(known, mirrored=counts)
    yield from clips.values()


def _measured(clips: Sequence[ClipFrames], contexts: Sequence[ClipContexts]) -> Iterator[ContextCoverage]:
    """What each of some contexts have, the largest share first; those without a clip are left out."""
    numbers = {clip.asset: i for i, clip in enumerate(clips)}
    seen = {clip.asset for clip in clips if clip.mirrored is not None}
    played = [each for each in contexts if each.assets & numbers.keys() or each.mirrored & seen]
    plain, mirrored = _tables([clip.plain for clip in clips]), _tables([clip.mirrored or NO_FRAMES for clip in clips])
    for each in sorted(played, key=lambda each: -each.share):
        own = [numbers[asset] for asset in each.assets if asset in numbers]
        opposite = [numbers[asset] for asset in each.mirrored if asset in seen]
        frames = {name: plain[name][own].sum(axis=0) + mirrored[name][opposite].sum(axis=0) for name in MAPS}
        wanted = {name: wanted_bins(MAPS[name], counts >= LEAST_FRAMES, each) for name, counts in frames.items()}
        yield ContextCoverage(each, frames, wanted)


def _tables(counts: Sequence[Mapping[str, Counts]]) -> dict[str, Counts]:
    """For each map the bins of all clips: [clips, rows, columns]."""
    return {name: np.array([each[name] for each in counts], np.int64) for name in MAPS}


def _summed(counts: Iterable[Mapping[str, Counts]]) -> dict[str, Counts]:
    sums = {name: np.zeros(of.shape, np.int64) for name, of in MAPS.items()}
    for each in counts:
        for name, total in sums.items():
            total += each[name]
    return sums


# ---- what is wanted


def about_bins() -> dict[str, object]:
    """What the maps are, for a reader of the JSON."""
    maps = {
        name: {"rows": [each.to_json() for each in of.rows], "columns": [each.to_json() for each in of.columns]}
        for name, of in MAPS.items()
    }
    return {"window_s": WINDOW_S, "least_frames": LEAST_FRAMES, **maps}
