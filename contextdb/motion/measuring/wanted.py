"""Which bins of the maps a context wants; `contextdb.motion.measuring.coverage` says when it does."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from contextdb.cells.arguments import require_many, require_mapping, require_point, require_real, require_text
from contextdb.motion.measuring.moves import DIRECTION, SPEED, TURN, Bin, Map, Span

Bools = NDArray[np.bool_]
ASKED = 'a mapping such as {"speed": [(0.0, 2.0)]}'


@dataclass(frozen=True)
class ClipContexts:
    """Contexts in which the same clips may play."""

    assets: frozenset[str]
    mirrored: frozenset[str]
    """`assets`, `mirrored`: the assets that are valid, and those that are valid mirrored: by mirrored facts."""
    share: float = 1.0
    """0…1 of all contexts."""
    cells: Mapping[str, str] = field(default_factory=dict)
    """The smallest box of cells that holds these contexts; conditions that it does not restrict are left out."""
    asked: Mapping[str, Sequence[Span]] = field(default_factory=dict)
    """For "speed" (m/s), "turn" (degrees a second) and "direction" (degrees), as far as the table knows them, the spans requested.
    """
    is_symmetric: bool = True
    """Whether they are the same contexts in a mirror."""

    def __post_init__(self) -> None:
        for name in ("assets", "mirrored"):
            listed = require_many(getattr(self, name), name, "the names of clips")
            object.__setattr__(self, name, frozenset(require_text(each, f"one of {name}") for each in listed))
        require_real(self.share, "share", 0.0, 1.0)
        require_mapping(self.cells, "cells", "a mapping of conditions to cells")
        for axis, spans in require_mapping(self.asked, "asked", ASKED).items():
            for span in require_many(spans, f"asked[{axis!r}]", ASKED):
                require_point(span, "a span", ASKED)

    @property
    def id(self) -> str:
        """Of the same clips the same from run to run."""
        text = "\0".join([*sorted(self.assets), "\1", *sorted(self.mirrored)])
        return hashlib.blake2b(text.encode("utf-8", "surrogatepass"), digest_size=4).hexdigest()


def wanted_bins(of: Map, filled: Bools, each: ClipContexts) -> Bools:
    """Which bins of a map are wanted in some contexts, from those that are filled."""
    both = filled | filled[:, of.opposite] if each.is_symmetric else filled
    across = TURN if of.name == TURN else DIRECTION
    wanted = both | _between(both, axis=0) | (_beside(both) if of.is_round else _between(both, axis=1))
    rows, columns = _bins_within(of.rows, each.asked.get(SPEED)), _bins_within(of.columns, each.asked.get(across))
    needed: Bools = np.zeros(of.shape, np.bool_)
    if rows is not None:
        wanted &= rows[:, None]
    if columns is not None:
        wanted &= columns
    if columns is not None:
        needed[both.any(axis=1) if rows is None else rows] = columns
    elif rows is not None and across == TURN:
        needed[rows & ~both.any(axis=1), _straightest(of, both)] = True
    wanted |= needed
    if across == DIRECTION:
        wanted[:, of.centre] = False
    return np.asarray(wanted)


def _straightest(of: Map, filled: Bools) -> int:
    """The column nearest to straight ahead that is filled at any speed; straight ahead where none is."""
    columns = np.flatnonzero(filled.any(axis=0)).tolist() or [of.centre]
    return int(min(columns, key=lambda column: (abs(column - of.centre), column)))


def _between(flags: Bools, axis: int) -> Bools:
    """The bins with a filled one on both sides, or filled themselves."""
    after = np.logical_or.accumulate(flags, axis=axis)
    before = np.flip(np.logical_or.accumulate(np.flip(flags, axis=axis), axis=axis), axis=axis)
    return np.asarray(after & before)


def _beside(flags: Bools) -> Bools:
    """On a circle: the bins with a filled one right beside them on both sides."""
    return np.asarray(np.roll(flags, 1, axis=1) & np.roll(flags, -1, axis=1))


def _bins_within(bins: Sequence[Bin], spans: Sequence[Span] | None) -> Bools | None:
    """The bins whose middle is in a span that is requested; None where nothing is."""
    if spans is None:
        return None
    middles = [each.middle for each in bins]
    return np.array([any(low <= middle <= high for low, high in spans) for middle in middles], np.bool_)
