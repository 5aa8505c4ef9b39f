"""Which columns are seen: hidden ones, folded groups of one prefix, and those that never scroll. The file is not touched."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace


@dataclass(frozen=True, slots=True)
class ColumnsShown:
    """What a person said of columns, by their names."""

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
        found: list[bool] = []
        for name in names:
            prefix = prefix_of(name)
            is_behind = prefix in self.folded and prefix in seen
            found.append(name != asset and (name in self.hidden or is_behind))
            if prefix is not None and not found[-1]:
                seen.add(prefix)
        return tuple(found)

    def turned(self, name: str) -> ColumnsShown:
        """With a column hidden that is seen, or seen again; a folded group opens for that."""
        if name in self.hidden:
            return replace(self, hidden=self.hidden - {name})
        return replace(self, hidden=self.hidden | {name})

    def revealed(self, name: str) -> ColumnsShown:
        """With a column seen."""
        return replace(self, hidden=self.hidden - {name}, folded=self.folded - {prefix_of(name) or ""})

    def folded_at(self, name: str) -> ColumnsShown:
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
