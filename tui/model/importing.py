"""An import into the open table: what each column of a file becomes, which rows come, and the edit that does it.

Knows no Textual. A file is read by `contextdb.exchange`; what it proposes can be changed column by column before the edit is made.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Literal

import numpy as np

from contextdb.cells.kinds import KINDS
from contextdb.cells.words import quoted
from contextdb.columns import TextColumn
from contextdb.edits.edits import edit_between
from contextdb.edits.notes import Notes
from contextdb.errors import ContextDBError, Fault, TableError, nearest, plural, safe_text
from contextdb.exchange.formats import FORMATS, ReadOptions, read
from contextdb.exchange.importing import (
    NAMES,
    NOTHING_CHOSEN,
    Choices,
    chosen_columns,
    decimal_commas_reported,
    has_whole_names,
    notes_of,
    whole_names_sentence,
)
from contextdb.exchange.mapping import COLUMN_JOBS, Mapped, as_condition, as_job, as_type, propose
from contextdb.exchange.proposals import names_of
from contextdb.exchange.reading import PAIR, Reading, as_pair, listed, with_intervals
from contextdb.schema.settings import Schema, TableSettings, conditions_from_dict
from contextdb.tables.changes import CameFrom, Edit
from contextdb.tables.table import Table

from .asset_rows import rows_of_assets

Mode = Literal["merge", "append", "replace"]
MODES: dict[Mode, str] = {
    "merge": "merged by asset: changed or added",
    "append": "all added at the end",
    "replace": "in place of those of the table",
}
DECIMAL_COMMA = "0,5 is 0.5"
"""The choice of a decimal comma."""
NUMERIC = frozenset(name for name, kind in KINDS.items() if kind.is_numeric)
N_SHOWN = 3
"""Cells of a column that are displayed before it is imported."""


@dataclass(frozen=True)
class Import:
    """What the dialog gives back: the edit, to be made with `Sheet.apply`, and what a person should know of it."""

    edit: Edit
    notes: tuple[str, ...] = ()
    with_marks: Callable[[Notes], Notes] | None = None
    """Adds the notes and colours of the file to those of the table, where it has some."""


@dataclass(frozen=True)
class Choice:
    """One thing that a column may become."""

    label: str
    about: str
    mapped: Mapped


class Draft:
    """A file that was read, and what is decided of it so far."""

    def __init__(self, table: Table, reading: Reading, name: str, chosen: Choices = NOTHING_CHOSEN) -> None:
        """`name` is what the file is called in the step's name; `chosen` is what a person said of it before."""
        self.table = table
        self.name = name
        self.chosen = chosen
        apart = {*table.schema.conditions, *(column.name for column in table.columns), *chosen.columns}
        paired = with_intervals(reading, apart)
        self.has_pairs = paired is not reading
        """Whether columns of least and greatest values are, or could be, one interval."""
        self.reading = reading if chosen.pairs == "apart" else paired
        self.mode: Mode = next((mode for mode in MODES if mode == chosen.mode), "merge")
        self.columns = chosen.applied(propose(self.reading, self._schema, self._settings), self.reading, self._schema)

    @classmethod
    def read(cls, table: Table, raw: bytes, name: str, options: ReadOptions, chosen: Choices = NOTHING_CHOSEN) -> Draft:
        """Read a file for a table, as a person chose. Raises ContextDBError where it cannot be read, with every fault."""
        whole = has_whole_names(chosen.names or None, Path(name))
        is_comma = chosen.decimal == "comma" if chosen.decimal else options.is_decimal_comma
        sheet = chosen.sheet or options.sheet
        reading = read(raw, name, replace(options, sheet=sheet, is_decimal_comma=is_comma, has_whole_names=whole))
        return cls(table, reading, Path(name).name, chosen)

    @property
    def choices(self) -> Choices:
        """What a person chose so far, for the next file of this name."""
        mode = "" if self.mode == "merge" else self.mode
        columns = {name: one for name, one in self.chosen.columns.items() if name not in self.reading.names}
        return replace(self.chosen, mode=mode, columns={**columns, **chosen_columns(self.columns)})

    @property
    def comma_doubts(self) -> list[str]:
        """What nobody said yet of numbers with a comma, which may be decimals: a sentence for each column."""
        if self.chosen.decimal:
            return []
        return decimal_commas_reported(self.columns, self.reading, self._schema, f'the choice "{DECIMAL_COMMA}"')

    @property
    def _schema(self) -> Schema:
        """What is declared, and of the table's own columns what their cells say."""
        own = {c.condition.name: c.condition for c in self.table.conditions}
        return replace(self.table.schema, conditions={**own, **self.table.schema.conditions})

    @property
    def _settings(self) -> TableSettings:
        return replace(self.table.settings, asset=self.table.asset_column)

    # ---- what a column becomes

    def preview(self, at: int) -> str:
        """The first cells of a column, as one text."""
        column, mapped = self.reading.columns[at], self.columns[at]
        return " · ".join(self._cell(column[row].strip(), mapped, row) or "(empty)" for row in range(min(N_SHOWN, column.n_rows)))

    def _cell(self, text: str, mapped: Mapped, row: int) -> str:
        """A text of the file, and where that is another the cell that it becomes."""
        cell = mapped.cells[row] if mapped.cells is not None else text
        if PAIR.fullmatch(cell) and self._kind(mapped) in NUMERIC:
            return f"{text} → {as_pair(cell)}"
        return text if cell in (text, quoted(text)) else f"{text} → {cell}"

    def _kind(self, mapped: Mapped) -> str:
        """The type of the condition that a column becomes; empty for another job."""
        declared = self._schema.conditions.get(mapped.name)
        return "" if mapped.job != "condition" else mapped.kind if mapped.is_new else declared.domain.kind if declared else ""

    def becomes(self, at: int) -> str:
        """What a column becomes, in few words."""
        mapped = self.columns[at]
        if mapped.job == "left out":
            return "(left out)"
        mark = "! " if mapped.n_unreadable else ""
        if self._is_here(mapped):
            return f"{mark}{mapped.name}" if mapped.job == "condition" else f"{self._name(mapped)} ({mapped.job})"
        declared = self._schema.conditions.get(mapped.name)
        kind = f"new {mapped.kind}" if mapped.is_new else declared.domain.kind if declared else mapped.job
        return f"{mark}+ {kind}" if mapped.name == mapped.source else f"{mark}+ {mapped.name} ({kind})"

    def why(self, at: int) -> str:
        """Why a column becomes what it does, as a sentence."""
        mapped = self.columns[at]
        new = "" if mapped.job == "left out" or self._is_here(mapped) else "the table gets this column; "
        meant = f'; is "{mapped.near}" meant?' if mapped.near else "."
        return f"{mapped.source}: {new}{mapped.why}{meant}"

    def label(self, at: int) -> str:
        """Which of the choices of a column is taken."""
        mapped = self.columns[at]
        same = (mapped.job, mapped.name, mapped.declared and mapped.declared["type"])
        choices = self.choices_for(at)
        return next(
            (c.label for c in choices if (c.mapped.job, c.mapped.name, c.mapped.declared and c.mapped.declared["type"]) == same), ""
        )

    def is_doubtful(self, at: int) -> bool:
        """Whether a person should look at a column: it is new, or some of its cells cannot be read."""
        mapped = self.columns[at]
        return mapped.job != "left out" and (mapped.n_unreadable > 0 or not self._is_here(mapped))

    def choices_for(self, at: int) -> list[Choice]:
        """All that a column may become, the likeliest first."""
        return list(self._choices(at))

    def choose(self, at: int, mapped: Mapped) -> None:
        """Decide what a column becomes; another that became the same is left out then."""
        for other, column in enumerate(self.columns):
            is_same = column.name == mapped.name or column.job == mapped.job == "asset"
            if other != at and column.job != "left out" and mapped.job != "left out" and is_same:
                self.columns[other] = as_job(column, "left out")
        self.columns[at] = mapped

    def _choices(self, at: int) -> Iterator[Choice]:
        mapped, column = self.columns[at], self.reading.columns[at]
        plain = replace(mapped, name=column.name)
        yield Choice("(left out)", "the column is not imported", as_job(plain, "left out"))
        yield Choice(
            f"{self.table.asset_column} (asset)", "names the assets", as_job(replace(plain, name=self.table.asset_column), "asset")
        )
        near = nearest(column.name, self._schema.conditions)
        every = [as_condition(mapped, column, name, self._schema) for name in self._schema.conditions]
        for condition in sorted(every, key=lambda c: (c.name != near, c.n_unreadable > 0, c.name not in self._names, c.name)):
            name = condition.name
            where = "in the table" if name in self._names else "declared"
            wrong = f"; {condition.n_unreadable:,} unreadable" if condition.n_unreadable else ""
            yield Choice(name, f"{self._schema.conditions[name].domain.kind}, {where}{wrong}", condition)
        yield from self._other_columns(plain)
        if column.name not in self._names and column.name not in self._schema.conditions:
            for kind in (kind for kind in KINDS if not KINDS[kind].needs_values or names_of(mapped.names or column)):
                condition = as_type(plain, column, kind)
                wrong = (
                    f"{plural(condition.n_unreadable, 'cell')} cannot be read"
                    if condition.n_unreadable
                    else "every cell can be read"
                )
                yield Choice(f"new condition, {kind}", wrong, condition)
            yield Choice("new column of data", "for the game; no condition", as_job(plain, "output"))

    def _other_columns(self, plain: Mapped) -> Iterator[Choice]:
        settings = self.table.settings
        for job in COLUMN_JOBS:
            name = getattr(settings, job)
            if name is not None:
                yield Choice(f"{name} ({job})", "in the table", as_job(replace(plain, name=name), job))
        for name in settings.outputs:
            yield Choice(name, "data, in the table", as_job(replace(plain, name=name), "output"))

    @property
    def _names(self) -> list[str]:
        return [column.name for column in self.table.columns]

    def _is_here(self, mapped: Mapped) -> bool:
        return mapped.job == "asset" or mapped.name in self._names

    # ---- what is done

    def edit(self) -> Edit:
        """The edit that imports the file as it is decided. Raises ContextDBError where no column names the assets; or
        contextdb.toml could not say what is decided."""
        taken = self._taken()
        came_from, target = self._rows()
        texts = {self._name(column): (column.cells or self.reading.columns[at], target) for at, column in taken}
        names = [*self._names, *(name for name in texts if name not in self._names)]
        columns = [self._column(name, came_from, texts.get(name)) for name in names]
        schema, settings = self._declared([column for _, column in taken])
        after = Table.build(self.table.name, columns, schema, settings, self.table.path)
        return edit_between(self.table, after, came_from, f"Import {safe_text(self.name)}")

    def summary(self) -> str:
        """What becomes of the rows, or why the file cannot be imported, in one line; cheap, whatever the size of the file."""
        try:
            taken = self._taken()
            self._declared([column for _, column in taken])
        except ContextDBError as error:
            return error.faults[0].message
        came_from, target = self._rows()
        n_new, n_kept = int((came_from < 0).sum()), int((came_from >= 0).sum())
        counts = {"added": n_new, "here already": len(target) - n_new, "taken away": self.table.n_rows - n_kept}
        parts = ", ".join(f"{n:,} {what}" for what, n in counts.items() if n)
        return f"{plural(len(target), 'row')} in the file{f': {parts}' if parts else ''}."

    def _taken(self) -> list[tuple[int, Mapped]]:
        """The columns that are imported, with their places in the file."""
        taken = [(at, column) for at, column in enumerate(self.columns) if column.job != "left out"]
        if sum(column.job == "asset" for _, column in taken) != 1:
            raise TableError(Fault("no column of the file names the assets.", "one column of names"))
        return taken

    @property
    def notes(self) -> tuple[str, ...]:
        """What a person should know: how the file was read, and columns of the table that it does not have."""
        have = {self._name(column) for column in self.columns if column.job != "left out"}
        missing = [name for name in self._names if name not in have]
        missing_note = [f"Not in the file: {listed(missing, 3)}. New rows are empty there, others stay."] if missing else []
        words = f'Names, "{NAMES["words"]}",'
        names_note = "" if self.chosen.names else whole_names_sentence(self.columns, self.reading, words)
        return (*self.comma_doubts, *map(str, self.reading.remarks), *([names_note] if names_note else []), *missing_note)

    def answer(self) -> Import:
        """What the dialog gives back."""
        notes = tuple(note[:1].upper() + note[1:] for note in self.notes)
        return Import(self.edit(), notes, self._with_marks if self.reading.spots else None)

    def _with_marks(self, notes: Notes) -> Notes:
        assets = next(self.reading.columns[at].to_list() for at, column in enumerate(self.columns) if column.job == "asset")
        return notes_of(self.reading.spots, self.columns, assets, self.table.asset_column, notes)

    def _name(self, column: Mapped) -> str:
        return self.table.asset_column if column.job == "asset" else column.name

    def _rows(self) -> tuple[CameFrom, CameFrom]:
        """For each row after the import the one it was, -1 for a new one; and for each row of the file its row then."""
        n_before, n_file = self.table.n_rows, self.reading.n_rows
        if self.mode == "append":
            return np.append(np.arange(n_before), np.full(n_file, -1)), np.arange(n_before, n_before + n_file)
        origins = self._matched_rows()
        if self.mode == "replace":
            return origins, np.arange(n_file)
        is_new = origins < 0
        target = origins.copy()
        target[is_new] = np.arange(n_before, n_before + int(is_new.sum()))
        return np.append(np.arange(n_before), np.full(int(is_new.sum()), -1)), target

    def _matched_rows(self) -> CameFrom:
        """For each row of the file the row of the table with its asset, -1 without one; equal assets pair up in their order."""
        at = next((at for at, column in enumerate(self.columns) if column.job == "asset"), None)
        if at is None:
            return np.full(self.reading.n_rows, -1)
        return rows_of_assets(self.reading.columns[at].to_list(), self.table.assets)

    def _column(self, name: str, came_from: CameFrom, given: tuple[TextColumn, CameFrom] | None) -> TextColumn:
        """A column after the import: the texts that were, empty for new rows, and those of the file over them."""
        old = self.table.text_column(name) if name in self._names else TextColumn(name, (), np.empty(0, np.int32))
        code_of = {text: code for code, text in enumerate(old.texts)}
        is_old = (came_from >= 0) & (len(old.codes) > 0)
        codes = np.full(len(came_from), code_of.setdefault("", len(code_of)), np.int32)
        codes[is_old] = old.codes[came_from[is_old]]
        if given is not None:
            column, target = given
            new = np.array([code_of.setdefault(text, len(code_of)) for text in column.texts], np.int32)
            codes[target] = new[column.codes] if len(new) else codes[target]
        return TextColumn(name, tuple(code_of), codes)

    def _declared(self, taken: Sequence[Mapped]) -> tuple[Schema, TableSettings]:
        """What contextdb.toml says after the import."""
        added = [column for column in taken if not self._is_here(column)]
        declared = {c.name: c.declared for c in added if c.is_new and c.declared is not None}
        schema = self.table.schema
        if declared:
            schema = replace(schema, conditions={**schema.conditions, **conditions_from_dict(declared)})
        settings = self.table.settings
        jobs: dict[str, Any] = {column.job: column.name for column in added if column.job in COLUMN_JOBS}
        outputs = (*settings.outputs, *(column.name for column in added if column.job == "output"))
        return schema, replace(settings, outputs=outputs, **jobs)


def suffixes_read() -> list[str]:
    """The endings of files that can be imported."""
    return [suffix for one in FORMATS.values() if one.is_read for suffix in one.suffixes]


def suffixes_written() -> list[str]:
    """The endings of files that can be exported to."""
    return [one.suffixes[0] for one in FORMATS.values() if one.is_written and one.suffixes]


def why_not(error: ContextDBError) -> str:
    """Why a file cannot be read, for one line of a dialog."""
    first = error.faults[0]
    more = f" (and {plural(len(error.faults) - 1, 'more fault')})" if len(error.faults) > 1 else ""
    line = f"Line {first.place.line}: " if first.place.line else ""
    fault = replace(first, mend="") if "--" in first.mend else first  # options of the command line are no help here
    return f"{line}{fault.message}{more}"
