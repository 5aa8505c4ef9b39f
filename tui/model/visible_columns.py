"""Which columns are seen: hidden ones, folded groups of one prefix, and those that never scroll. The table is not touched.

A person's choice is stored in `.contextdb-journal` next to the table, which git passes over: it is no part of the table.
"""

from __future__ import annotations

import json
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from pathlib import Path

from contextdb.disk.own_files import has_own, make_own_folder, read_own, remove_own, write_own
from contextdb.errors import ContextDBError

from .lock import FOLDER


@dataclass(frozen=True, slots=True)
class VisibleColumns:
    """What a person chose for columns, by their names."""

    hidden: frozenset[str] = frozenset()
    folded: frozenset[str] = frozenset()
    """Prefixes, such as "Defender.": of their columns only the first one is seen."""
    frozen: str | None = None
    """The last column that never scrolls; None: the asset column."""

    @property
    def is_plain(self) -> bool:
        """Whether every column is seen."""
        return not (self.hidden or self.folded)

    def are_hidden(self, names: Sequence[str], asset: str) -> tuple[bool, ...]:
        """Whether each column is not seen; the column of the assets always is."""
        seen: set[str] = set()
        flags: list[bool] = []
        for name in names:
            prefix = prefix_of(name)
            is_behind = prefix in self.folded and prefix in seen
            flags.append(name != asset and (name in self.hidden or is_behind))
            if prefix is not None and not flags[-1]:
                seen.add(prefix)
        return tuple(flags)

    def turned(self, name: str) -> VisibleColumns:
        """With a column hidden that is seen, or seen again; a folded group opens for that."""
        if name in self.hidden:
            return replace(self, hidden=self.hidden - {name})
        return replace(self, hidden=self.hidden | {name})

    def revealed(self, name: str) -> VisibleColumns:
        """With a column seen."""
        return replace(self, hidden=self.hidden - {name}, folded=self.folded - {prefix_of(name) or ""})

    def folded_at(self, name: str) -> VisibleColumns:
        """With the group of a column folded, or opened again; as it is for a column without a prefix."""
        prefix = prefix_of(name)
        return self if prefix is None else replace(self, folded=self.folded ^ {prefix})

    def n_frozen(self, names: Sequence[str], asset: str) -> int:
        """How many columns from the left never scroll: up to the frozen one, else up to the assets where those are near."""
        if self.frozen in names:
            return names.index(self.frozen) + 1
        n_frozen = names.index(asset) + 1
        return n_frozen if n_frozen <= 3 else 0


def prefix_of(name: str) -> str | None:
    """What groups a column with others: "Defender." of "Defender.DepthChart"."""
    head, dot, _ = name.partition(".")
    return head + dot if dot else None


def columns_path(table: Path) -> Path:
    """The file that keeps it for a table's file."""
    return table.parent / FOLDER / f"{table.name}.columns.json"


def read_columns(table: Path) -> VisibleColumns:
    """What was stored; every column is seen where nothing was, or where it cannot be read."""
    path = columns_path(table)
    with suppress(ContextDBError, OSError, ValueError, TypeError, AttributeError, RecursionError):
        document = json.loads(read_own(path)) if has_own(path) else {}
        frozen = document.get("frozen")
        return VisibleColumns(
            frozenset(map(str, document.get("hidden", ()))),
            frozenset(map(str, document.get("folded", ()))),
            frozen if isinstance(frozen, str) else None,
        )
    return VisibleColumns()


def write_columns(table: Path, columns: VisibleColumns) -> None:
    """Keep it; a disk that refuses does not hinder who leaves the table."""
    path = columns_path(table)
    with suppress(ContextDBError, OSError):
        if columns == VisibleColumns():
            remove_own(path)
            return
        make_own_folder(path.parent)
        document = {"hidden": sorted(columns.hidden), "folded": sorted(columns.folded), "frozen": columns.frozen}
        write_own(path, (json.dumps(document, ensure_ascii=False, indent=2) + "\n").encode())
