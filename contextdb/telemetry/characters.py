"""Whose recorded moments they are: for each character of a file how long it played, and how many of its moments changed.

A minute of a character is a minute between its first and its last moment in a file.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import polars as pl
from numpy.typing import NDArray

from contextdb.bitmask import Flags
from contextdb.errors import Place, TableError, no_such, plural
from contextdb.telemetry.chunks import Chunk
from contextdb.telemetry.facts_read import Counts

ALL = "all"
COUNTED = ("moments", "changed", "emptied", "filled")


@dataclass(frozen=True, slots=True)
class Play:
    """What one character did in one file."""

    first_s: float
    last_s: float
    counts: tuple[int, ...]
    """Moments, and those of them that change, are emptied and are filled."""

    def with_more(self, other: Play) -> Play:
        counts = tuple(a + b for a, b in zip(self.counts, other.counts, strict=True))
        return Play(min(self.first_s, other.first_s), max(self.last_s, other.last_s), counts)

    @property
    def minutes(self) -> float:
        return (self.last_s - self.first_s) / 60.0 if self.last_s > self.first_s else 0.0


Characters = dict[tuple[str, str], Play]
"""By file and character."""


def joined(one: Characters, other: Characters) -> Characters:
    """The sums of both."""
    both = dict(one)
    for key, play in other.items():
        both[key] = both[key].with_more(play) if key in both else play
    return both


def per_minute(characters: Characters) -> dict[str, float] | None:
    """How many moments change, are emptied and are filled per character and minute; None where no time went by."""
    minutes = sum(play.minutes for play in characters.values())
    if minutes <= 0.0:
        return None
    return {name: sum(play.counts[i] for play in characters.values()) / minutes for i, name in enumerate(COUNTED) if i}


def by_character(characters: Characters) -> list[tuple[str, float, Mapping[str, int]]]:
    """Each character with its minutes and counts in all files, those of most moments without a row first."""
    names: dict[str, list[Play]] = {}
    for (_, name), play in characters.items():
        names.setdefault(name, []).append(play)
    listed = []
    for name, plays in names.items():
        counts = {counted: sum(play.counts[i] for play in plays) for i, counted in enumerate(COUNTED)}
        listed.append((name, sum(play.minutes for play in plays), counts))
    return sorted(listed, key=lambda each: (-each[2]["emptied"], -each[2]["changed"], each[0]))


def characters_json(characters: Characters) -> dict[str, object]:
    items = [{"character": name, "minutes": minutes, **counts} for name, minutes, counts in by_character(characters)]
    return {"minutes": sum(play.minutes for play in characters.values()), "per_minute": per_minute(characters), "items": items}


@dataclass(frozen=True, eq=False)
class Played:
    """The characters and seconds of a chunk."""

    names: Sequence[str]
    codes: NDArray[np.int64]
    """The character of each row: int64 [N]."""
    times: NDArray[np.float64]
    """Seconds, NaN where there is none: float64 [N]."""

    @classmethod
    def of(cls, character: str | None, time: str | None, names: Sequence[str], chunk: Chunk, file: str) -> Played | None:
        """None where neither column is named. Raises TableError where there is no such column."""
        if character is None and time is None:
            return None
        for column in (character, time):
            if column is not None and column not in names:
                raise TableError(no_such("column", column, names, f"one of {plural(len(names), 'column')}", Place(file)))
        listed, codes = [ALL], np.zeros(chunk.n_rows, np.int64)
        if character is not None and chunk.n_rows:
            given = chunk.frame[character].cast(pl.String).fill_null("")
            listed = given.unique(maintain_order=True).to_list()
            codes = given.cast(pl.Enum(listed)).to_physical().cast(pl.Int64).to_numpy()
        times = np.full(chunk.n_rows, np.nan)
        if time is not None and chunk.n_rows:
            given = chunk.frame[time]
            seconds = (
                given.dt.epoch("ms").cast(pl.Float64) / 1000.0
                if given.dtype.is_temporal()
                else given.cast(pl.Float64, strict=False)
            )
            times = seconds.fill_null(np.nan).to_numpy()
        return cls(listed, codes, times)

    def sums(self, file: str, moments: Counts, of_pair: NDArray[np.int64], sums: Counts, flags: Sequence[Flags]) -> Characters:
        """The sums of each character; of M distinct pairs of answers, each of one character, `flags` say what became of them."""
        n = len(self.names)
        counts = [np.bincount(self.codes, moments, n), *(np.bincount(of_pair, np.where(flag, sums, 0), n) for flag in flags)]
        low, high = np.full(n, np.inf), np.full(n, -np.inf)
        known = np.isfinite(self.times)
        np.minimum.at(low, self.codes[known], self.times[known])
        np.maximum.at(high, self.codes[known], self.times[known])
        return {(file, name): Play(low[i], high[i], tuple(int(each[i]) for each in counts)) for i, name in enumerate(self.names)}
