"""Whether two texts of a column mean the same: `20.0, 9.99` and `20.0000, 9.9900` do."""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np
from numpy.typing import NDArray

from contextdb.cells.grammar import parse_cell
from contextdb.cells.outputs import Output
from contextdb.cells.words import says_any, truth_of
from contextdb.columns import TextColumn
from contextdb.errors import CellError
from contextdb.tables.condition_column import ConditionColumn
from contextdb.tables.data import TableData
from contextdb.tables.merging.conflicts import Conflict, Decided, Places, Shared
from contextdb.tables.merging.order import Flags, Origins

Meaning = Callable[[str], object]
"""What a text means; None where nothing is known but the text itself."""


def meaning_of(table: TableData, column: int) -> Meaning:
    """How texts of a column are read: as cells, truths or numbers; an asset, an output without a type and what cannot be read mean
    themselves."""
    name, settings = table.columns[column].name, table.settings
    condition = next((c for c in table.conditions if c.condition.name == name), None)
    if condition is not None:
        return _cell_reader(condition)
    if name == settings.enabled:
        return lambda text: truth_of(text) if text.strip() else True
    if name == settings.once:
        return lambda text: truth_of(text) if text.strip() else False
    if name in (settings.priority, settings.weight, settings.cooldown_s, settings.cooldown_turns):
        empty = 1.0 if name == settings.weight else 0.0
        return lambda text: _number(text, empty)
    if (output := settings.output(name)) is not None:
        return _output_reader(output)
    if name == settings.when:
        return lambda text: "" if says_any(text) else text.strip()
    return lambda text: None


def is_same(one: Meaning, text: str, other: Meaning, other_text: str) -> bool:
    """Whether two texts mean the same, each in its own column."""
    if text == other_text:
        return True
    meaning = one(text)
    return meaning is not None and meaning == other(other_text)


def _cell_reader(column: ConditionColumn) -> Meaning:
    known = {text: column.cells[i] for i, text in enumerate(column.texts.texts) if i not in column.faults}
    domain = column.condition.domain

    def read(text: str) -> object:
        try:
            return domain.kind, known[text] if text in known else parse_cell(text, domain)
        except CellError:
            return None

    return read


def _output_reader(output: Output) -> Meaning:
    def read(text: str) -> object:
        try:
            return output.kind, output.read(text, wants_mend=False)
        except CellError:
            return None

    return read


def _number(text: str, empty: float) -> float | None:
    try:
        return float(text) if text.strip() else empty
    except ValueError:
        return None


# ---- the cells of one merged column: whose text is in each, and where both sides changed it


Tables = tuple[TableData, TableData, TableData]
"""Base, ours, theirs."""

_EMPTY = TextColumn("", ("",), np.zeros(1, np.int32))


def merge_column(
    tables: Tables, rows: Origins, places: tuple[int, int, int], name: str, decided: Decided
) -> tuple[TextColumn, list[Conflict]]:
    """Merge a column that is at `places` of base, ours and theirs (-1: nowhere); the conflicts have no asset yet."""
    as_is = _untouched(tables, rows, places, name)
    if as_is is not None:
        return as_is, []
    sides = [table.columns[at] if at >= 0 else None for table, at in zip(tables, places, strict=True)]
    shared = Shared.of((*sides, _EMPTY))
    base, ours, theirs = (shared.at(i, rows_of) for i, rows_of in enumerate((rows.base, rows.ours, rows.theirs)))
    merged, clashes = _merged(base, ours, theirs)
    merged[merged < 0] = int(shared.codes[3][0])
    conflicts = []
    if len(clashes):
        readers = [meaning_of(table, at) if at >= 0 else None for table, at in zip(tables, places, strict=True)]
        conflicts = list(_judged(merged, clashes, (base, ours, theirs), shared.texts, readers, name, _keys(rows, places), decided))
    return TextColumn(name, shared.texts, merged.astype(np.int32)), conflicts


def _untouched(tables: Tables, rows: Origins, places: tuple[int, int, int], name: str) -> TextColumn | None:
    """The column of ours where it holds what theirs and base hold, and all rows stay: nothing is worked out then."""
    if min(places) < 0 or not all(
        np.array_equal(taken, np.arange(tables[1].n_rows)) for taken in (rows.base, rows.ours, rows.theirs)
    ):
        return None
    base, ours, theirs = (table.columns[at] for table, at in zip(tables, places, strict=True))
    same = all(one.codes is base.codes and one.texts is base.texts for one in (ours, theirs))
    return ours.renamed(name) if same and ours.name != name else ours if same else None


def _merged(base: Places, ours: Places, theirs: Places) -> tuple[Places, Places]:
    """The merged codes, and the rows where both sides have one, changed, and not to the same."""
    is_both = (ours >= 0) & (theirs >= 0)
    is_kept = is_both & (base >= 0) & (ours == base)
    merged = np.where(is_kept | (ours < 0), theirs, ours)
    is_clash = is_both & ~is_kept & (ours != theirs) & ~((base >= 0) & (theirs == base))
    return merged, np.flatnonzero(is_clash)


def _keys(rows: Origins, places: tuple[int, int, int]) -> NDArray[np.int64]:
    """What each cell is known by: its row on every side, and its column."""
    return np.stack([rows.base, rows.ours, rows.theirs, *(np.full(len(rows), at) for at in places)], axis=1)


def _judged(
    merged: Places,
    clashes: Places,
    codes: tuple[Places, Places, Places],
    texts: tuple[str, ...],
    readers: list[Meaning | None],
    name: str,
    keys: NDArray[np.int64],
    decided: Decided,
) -> Iterator[Conflict]:
    """Go through the cells that both sides changed: take the meaning where only the writing differs, else it is a conflict."""
    read = next(reader for reader in (readers[1], readers[2]) if reader is not None)
    known: dict[tuple[int, int], bool] = {}

    def same(one: int, other: int) -> bool:
        pair = (min(one, other), max(one, other))
        if pair not in known:
            known[pair] = pair[0] >= 0 and is_same(read, texts[one], read, texts[other])
        return known[pair]

    for row in clashes.tolist():
        base, ours, theirs = (int(side[row]) for side in codes)
        if same(ours, theirs) or same(base, theirs):
            continue
        key = ("cell", *keys[row].tolist())
        if same(base, ours) or decided.get(key) == "theirs":
            merged[row] = theirs
        elif key not in decided:
            yield Conflict("cell", "", name, row, texts[base] if base >= 0 else None, texts[ours], texts[theirs], key)


def changed_in(tables: tuple[TableData, TableData], columns: Places, rows: tuple[Places, Places]) -> Flags:
    """Whether any cell of some rows of a side differs from base's: bool [rows].

    `tables` are base and the side, `columns` says for each column of the side which one of base it was, and `rows` are places in
    both.
    """
    flags = np.zeros(len(rows[0]), np.bool_)
    for at in np.flatnonzero(columns >= 0).tolist() if len(flags) else ():
        shared = Shared.of((tables[0].columns[columns[at]], tables[1].columns[at]))
        flags |= shared.at(0, rows[0]) != shared.at(1, rows[1])
    return flags


def new_cells(side: TableData, columns: Places, rows: Places) -> Iterator[tuple[int, int]]:
    """The row and the column of each cell of some rows of a side that says something in a column that base has not."""
    new = [(at, Shared.of((side.columns[at],))) for at in np.flatnonzero(columns < 0).tolist()]
    for row in rows.tolist():
        yield from ((row, at) for at, shared in new if not shared.is_any[shared.codes[0][row]])
