"""Notes on cells and colours of rows: for people, never for the game. An edge: it reads and writes `NAME.notes.csv` by a table.

    Asset,Column,Note,Colour
    jog,speed,ask Ana whether 3 is enough,
    jog,,,amber

A line is of one cell, or of one row where it names no column; lines are sorted, so that two people's notes merge. A row is meant by
its asset, so the same notes stand at all rows of one asset.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path

from contextdb.disk import write_atomic
from contextdb.edits.diffing.markers import FIELDS, Spot, written
from contextdb.errors import ContextDBError, Fault, FileError, Place
from contextdb.files.texts import read_texts
from contextdb.tables.other_files import notes_path

COLOURS = ("red", "amber", "green", "blue", "violet")


@dataclass(frozen=True)
class Notes:
    """What people wrote at the edge of a table."""

    texts: Mapping[Spot, str] = field(default_factory=dict)
    """Asset and column to note."""
    words: Mapping[Spot, str] = field(default_factory=dict)
    """Asset and column to the text of its colour: also of one that there is not, and of a cell, which has none here."""

    @cached_property
    def colours(self) -> Mapping[str, str]:
        """Asset to colour."""
        return {asset: word for (asset, column), word in self.words.items() if not column and word in COLOURS}

    @classmethod
    def beside(cls, table: Path) -> Notes:
        """Those of a table's file; none where there is no file of them, or none that can be read."""
        try:
            return cls.read(table, or_more=True)
        except ContextDBError:
            return cls()

    @classmethod
    def read(cls, table: Path, *, or_more: bool = False) -> Notes:
        """Those of a table's file, all that it holds.

        Raises ContextDBError where there is a file that cannot be read, or that holds more, unless `or_more`: to write the notes
        would lose it.
        """
        path = notes_path(table)
        if not path.is_file():
            return cls()
        columns = {c.name: c.to_list() for c in read_texts(path)[1]}
        if not set(FIELDS) <= set(columns) or (len(columns) > len(FIELDS) and not or_more):
            raise FileError(Fault("this is not a file of notes.", f"the columns {', '.join(FIELDS)}", place=Place(str(path))))
        lines = list(zip(*(columns[name] for name in FIELDS), strict=True))
        texts = {(asset, column): note for asset, column, note, _ in lines if note.strip()}
        return cls(texts, {(asset, column): colour for asset, column, _, colour in lines if colour.strip()})

    def with_note(self, asset: str, column: str, text: str) -> Notes:
        """With another note on a cell; an empty one takes it away."""
        texts = {place: note for place, note in self.texts.items() if place != (asset, column)}
        return replace(self, texts=texts | ({(asset, column): text.strip()} if text.strip() else {}))

    def with_colour(self, assets: list[str], colour: str) -> Notes:
        """With another colour of some rows; an empty one takes it away."""
        rows = [(asset, "") for asset in assets]
        others = {spot: word for spot, word in self.words.items() if spot not in rows}
        return replace(self, words=others | (dict.fromkeys(rows, colour) if colour else {}))

    def write(self, table: Path) -> None:
        """Write the file; raises FileError where the disk refuses."""
        spots = {**self.texts, **self.words}
        write_atomic(notes_path(table), written({spot: (self.texts.get(spot, ""), self.words.get(spot, "")) for spot in spots}))


NO_NOTES = Notes()
