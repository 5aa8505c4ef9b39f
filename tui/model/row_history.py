"""What git knows of a row and of its cells: who changed what, when and why, and the row as it was then. No Textual here.

A row is followed by its asset: the same asset, as many rows of it before. Before an asset or the file had its name, nothing is
known. An edge: it runs git; reading many versions takes its time.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

from contextdb.disk.git import LFS_POINTER, FileVersion, versions_of
from contextdb.errors import ContextDBError, Fault, FileError, plural, safe_text
from contextdb.files.texts import texts_of
from contextdb.tables.table import Table

Cells = Mapping[str, str]
"""The texts of a row by column."""


@dataclass(frozen=True)
class RowVersion:
    """A row from a commit on."""

    when: str
    who: str
    message: str
    cells: Cells | None
    """None where the commit took the row away."""
    before: Cells | None
    """As it was before; None where there was none."""

    @property
    def changed(self) -> list[str]:
        """The columns in which it differs from before; all that say something where it is new or gone."""
        one, other = self.before or {}, self.cells or {}
        return [name for name in {**other, **one} if one.get(name, "").strip() != other.get(name, "").strip()]

    def text(self, column: str | None) -> str:
        """What a cell says since then; without a column what changed in the row."""
        if self.cells is None:
            return "the row was deleted"
        if column is not None:
            return self.cells.get(column, "") or "–"
        if self.before is None:
            return "the row is new"
        return ", ".join(f"{name}: {self.before.get(name, '') or '–'} → {self.cells.get(name, '') or '–'}" for name in self.changed)


@dataclass(frozen=True)
class RowHistory:
    """A row through the commits, the newest first; one that is not committed before all."""

    versions: tuple[RowVersion, ...]
    note: str = ""
    """What is not known."""

    def of_cell(self, column: str) -> RowHistory:
        """The versions in which one cell changed."""
        return replace(self, versions=tuple(version for version in self.versions if column in version.changed))


def row_history(table: Table, row: int) -> RowHistory:
    """The history of a row of the table that is edited. Raises FileError where git knows nothing of it."""
    if table.path is None:
        raise FileError(Fault("the table has no file yet, so that nothing is known of earlier versions."))
    found = versions_of(table.path)
    asset = table.text(row, table.asset_column)
    nth = sum(1 for other in range(row) if table.text(other, table.asset_column) == asset)
    now = {column.name: column[row] for column in table.columns}
    faults: list[str] = []
    states = [_row_of(version, table, asset, nth, faults) for version in found.versions]
    versions = []
    if states and states[0] != now:
        versions.append(RowVersion("now", "", "not committed yet", now, states[0]))
    for at, (version, cells) in enumerate(zip(found.versions, states, strict=True)):
        is_oldest = at == len(states) - 1
        before = None if is_oldest else states[at + 1]
        if cells != before and not (is_oldest and found.n_left_out):
            versions.append(RowVersion(version.date, safe_text(version.author), safe_text(version.message), cells, before))
    notes = [f"{plural(found.n_left_out, 'older commit')} or more were not looked at."] if found.n_left_out else []
    notes += [f"{plural(len(faults), 'version')} cannot be read: {faults[0]}"] if faults else []
    return RowHistory(tuple(version for version in versions if version.changed), " ".join(notes))


def _row_of(version: FileVersion, table: Table, asset: str, nth: int, faults: list[str]) -> Cells | None:
    """The row in a version of the file; None where there is none."""
    if not version.raw:
        return None
    if version.raw.startswith(LFS_POINTER):
        faults.append("its contents are in Git LFS")
        return None
    try:
        _, columns = texts_of(version.raw, str(table.path))
    except ContextDBError as error:
        faults.append(error.faults[0].found)
        return None
    names = [column.name for column in columns]
    if not columns:
        return None
    assets = columns[names.index(table.asset_column) if table.asset_column in names else 0]
    rows = [at for at in range(assets.n_rows) if assets[at] == asset]
    return {column.name: column[rows[nth]] for column in columns} if nth < len(rows) else None
