"""Find and replace in the texts of a table.

Each distinct text of a column is looked at once. Patterns go through polars, whose regular expressions take time in proportion to
the text whatever the pattern is: none can hang the editor. What they cannot do is looking ahead or back and references to groups;
in the replacement `$1` is the first group.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import polars as pl

from contextdb.bitmask import Flags, Rows
from contextdb.columns import TextColumn
from contextdb.errors import ContextDBError, Fault, in_quotes, plural, safe_text
from contextdb.tables.changes import Cells, Edit
from contextdb.tables.table import Table

from .long_work import with_progress


class PatternError(ContextDBError):
    """A regular expression that cannot be read."""


@dataclass(frozen=True, slots=True)
class Search:
    """What is looked for."""

    text: str
    is_whole: bool = False
    """The whole cell must match."""
    is_cased: bool = False
    """Upper and lower case are distinguished."""
    is_pattern: bool = False
    """The text is a regular expression."""

    @property
    def pattern(self) -> str:
        """The same as a regular expression."""
        body = self.text if self.is_pattern else "".join(map(_literal, self.text))
        body = rf"\A(?:{body})\z" if self.is_whole else f"(?:{body})"
        return body if self.is_cased else f"(?i){body}"

    def check(self) -> Fault | None:
        """What is wrong with a pattern; None when it can be looked for."""
        try:
            pl.Series([""]).str.contains(self.pattern)
        except pl.exceptions.PolarsError as error:
            why = str(error).strip().splitlines()[-1].removeprefix("error: ")
            return Fault(f"cannot read the pattern {in_quotes(self.text)}: {safe_text(why, 120)}.", "a regular expression")
        return None


def _literal(character: str) -> str:
    return character if character.isalnum() or character in " _" else f"\\x{{{ord(character):x}}}"


def find(table: Table, search: Search, rows: Rows, columns: Sequence[str]) -> Flags:
    """Which cells match: bool [rows, columns]. Raises PatternError where the pattern cannot be read."""
    if not search.text:
        return np.zeros((len(rows), len(columns)), np.bool_)
    return np.stack([_matching_cells(table.text_column(c), search)[rows] for c in columns], axis=1)


def next_hit(hits: Flags, at: tuple[int, int], is_backwards: bool = False) -> tuple[int, int] | None:
    """The matching cell after (before) a cell, row by row and going round at the end; None when nothing matches."""
    places = np.flatnonzero(hits)
    if not len(places):
        return None
    here = at[0] * hits.shape[1] + at[1]
    after = int(np.searchsorted(places, here, "left" if is_backwards else "right"))
    place = int(places[after - 1] if is_backwards else places[after % len(places)])
    return place // hits.shape[1], place % hits.shape[1]


def replace_all(table: Table, search: Search, replacement: str, rows: Rows, columns: Sequence[str]) -> Edit:
    """One edit that replaces the matches in some rows and columns; without changes when nothing matches. Raises PatternError where
    the pattern cannot be read."""
    changed: dict[str, dict[int, str]] = {}
    for name in with_progress(columns, len(columns), every=1) if search.text else ():
        column = table.text_column(name)
        now = _replaced(column, search, replacement)
        differs = np.array([a != b for a, b in zip(column.texts, now, strict=True)], np.bool_)
        hits = rows[differs[column.codes[rows]]] if len(differs) else rows[:0]
        if len(hits):
            changed[name] = {row: now[column.codes[row]] for row in hits.tolist()}
    name = f"Replace {safe_text(search.text)} in {plural(sum(map(len, changed.values())), 'cell')}"
    return Edit(name, (Cells(changed),) if changed else ())


def _matching_cells(column: TextColumn, search: Search) -> Flags:
    if not column.texts:
        return np.zeros(column.n_rows, np.bool_)
    _require_pattern(search)
    contains = pl.Series(column.texts, dtype=pl.String).str.contains(search.pattern)
    return np.asarray(contains.to_numpy(), np.bool_)[column.codes]


def _replaced(column: TextColumn, search: Search, replacement: str) -> list[str]:
    _require_pattern(search)
    if search.is_pattern:  # "$1_a" is the group 1 and "_a", not a group of the name "1_a"
        words = re.sub(r"\$\$|\$(\d+)", lambda m: f"${{{m[1]}}}" if m[1] else m[0], replacement)
    else:
        words = replacement.replace("$", "$$")
    texts: list[str] = pl.Series(column.texts, dtype=pl.String).str.replace_all(search.pattern, words).to_list()
    return texts


def _require_pattern(search: Search) -> None:
    if search.is_pattern and (fault := search.check()):
        raise PatternError(fault)
