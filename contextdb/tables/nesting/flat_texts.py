"""The columns of a flat table that are not conditions: assets with their paths, outputs, and the rows' own rules."""

from __future__ import annotations

from contextdb.columns import TextColumn
from contextdb.expressions.rules import has_no_rule
from contextdb.tables.nesting.expansion import Expansion
from contextdb.tables.nesting.names import asset_name
from contextdb.tables.nesting.slots import MANDATORY, OPTIONAL, all_words, optional_slots

PATH_MARK = "/"


def paths_and_leaves(expansion: Expansion, name: str) -> tuple[TextColumn, tuple[str, ...]]:
    """The asset of each row with its path, as a column, and alone."""
    own = [[asset_name(text) for text in table.assets] for table in expansion.tables]
    depths = (expansion.rows >= 0).sum(axis=0).tolist()
    paths, leaves = list[str](), list[str]()
    for depth, numbers, rows in zip(depths, expansion.numbers.T.tolist(), expansion.rows.T.tolist(), strict=True):
        leaf = own[numbers[depth - 1]][rows[depth - 1]]
        leaves.append(leaf)
        paths.append(leaf if depth == 1 else PATH_MARK.join([*(expansion.names[n] for n in numbers[:depth]), leaf]))
    return TextColumn.of(name, paths), tuple(leaves)


def outputs_of(expansion: Expansion, taken: set[str]) -> list[TextColumn]:
    """The columns of outputs: of slots all words of the way, else the innermost text."""
    names = dict.fromkeys(name for table in expansion.tables for name in table.settings.outputs)
    found = []
    for name in (name for name in names if name not in taken):
        columns = [(n, t.text_column(name)) for n, t in enumerate(expansion.tables) if name in t.settings.outputs]
        join = all_words if name == MANDATORY else _innermost
        found.append(optional_slots(expansion, columns) if name == OPTIONAL else expansion.layers(columns).joined(name, join))
        taken.add(name)
    return found


def _innermost(texts: list[str]) -> str:
    return texts[-1] if texts else ""


def rules_of(expansion: Expansion, taken: set[str]) -> TextColumn | None:
    """The rows' own rules: those of a way must all hold."""
    columns = [(n, t.text_column(t.settings.when)) for n, t in enumerate(expansion.tables) if t.settings.when is not None]
    if not columns:
        return None
    return expansion.layers(columns).joined(free_name(columns[0][1].name, taken), _all_rules)


def _all_rules(texts: list[str]) -> str:
    rules = [text for text in texts if not has_no_rule(text)]
    return " and ".join(f"({rule})" for rule in rules) if len(rules) > 1 else "".join(rules)


def free_name(name: str, taken: set[str]) -> str:
    """A name for a column that no condition has."""
    while name in taken:
        name += "_"
    taken.add(name)
    return name
