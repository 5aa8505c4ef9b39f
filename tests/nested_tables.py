"""Tables inside tables for property tests, and what they answer, worked out row by row."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
import oracles
import strategies
from hypothesis import strategies as st

from contextdb.cells.conditions import Condition
from contextdb.cells.kinds import KINDS
from contextdb.schema.settings import EMPTY, TableSettings
from contextdb.tables.nesting.flat import FlatTable
from contextdb.tables.table import Table

NAMES = ("outer", "dive", "low")
Way = Sequence[tuple[Table, int]]


@dataclass(frozen=True)
class Nest:
    """An outer table, and the tables that may stand in it."""

    outer: Table
    tables: Mapping[str, Table]

    def ways(self) -> list[Way]:
        """The ways of all flat rows, in order."""
        return list(ways_of(self.outer, self.tables))

    def all_cells(self) -> Table:
        """A table whose columns hold every text that a condition has in any of the tables."""
        texts: dict[str, list[str]] = {}
        for table in (self.outer, *self.tables.values()):
            for column in table.conditions:
                texts.setdefault(column.condition.name, []).extend(column.texts.texts)
        most = max(map(len, texts.values()), default=0)
        columns = {"Asset": ["A"] * most, **{name: [*found, *["Any"] * (most - len(found))] for name, found in texts.items()}}
        return Table.from_columns(columns, self.outer.schema)


def ways_of(table: Table, tables: Mapping[str, Table]) -> Iterator[Way]:
    for row, text in enumerate(table.assets):
        if text.startswith("@"):
            yield from ([(table, row), *way] for way in ways_of(tables[text[1:]], tables))
        else:
            yield [(table, row)]


def texts_of(way: Way) -> dict[str, list[str]]:
    """For each condition the cells that a way says of it."""
    found: dict[str, list[str]] = {}
    for table, row in way:
        for column in table.conditions:
            found.setdefault(column.condition.name, []).append(column.texts[row])
    return found


def is_valid(nest: Nest, way: Way, context: Mapping[str, object], unknown: str, some_or_all=any) -> bool:
    """Whether every row of a way is enabled and some value, or every one, of each fact passes all its cells."""
    domains = {c.condition.name: c.condition.domain for table, _ in way for c in table.conditions}
    facts = {name: oracles.values(context.get(name)) for name in domains}
    return all(oracles.is_enabled(table, row) for table, row in way) and all(
        some_or_all(all(oracles.passes(text, domains[name], value, unknown) for text in texts) for value in facts[name])
        for name, texts in texts_of(way).items()
    )


def cost_of(way: Way, context: Mapping[str, object], unknown: str) -> float:
    """What the soft cells of a way cost."""
    domains = {c.condition.name: c.condition.domain for table, _ in way for c in table.conditions}
    return sum(
        min(oracles.cost(text, domains[name], value, unknown) for value in oracles.values(context.get(name)))
        for name, texts in texts_of(way).items()
        for text in texts
    )


@st.composite
def nests(draw: st.DrawFn, kinds: tuple[str, ...] = tuple(KINDS), most_rows: int = 6, least_conditions: int = 1) -> Nest:
    """Up to three tables inside each other, with conditions that all or some of them have."""
    conditions = {
        name: Condition(name, draw(strategies.domains(kinds)))
        for name in ("speed", "it's", "Defender.Tags")[: draw(st.integers(least_conditions, 3))]
    }
    schema = replace(EMPTY, conditions=conditions)
    inner = [_table(draw, NAMES[2], schema, (), most_rows)]
    inner.append(_table(draw, NAMES[1], schema, (NAMES[2],), most_rows))
    outer = _table(draw, NAMES[0], schema, NAMES[1:], most_rows)
    return Nest(outer, {table.name: table for table in inner})


def _table(draw: st.DrawFn, name: str, schema: object, inner: Sequence[str], most_rows: int) -> Table:
    n_rows = draw(st.integers(0, most_rows))
    assets = draw(st.lists(st.sampled_from(["A", "B", "C", *(f"@{i}" for i in inner)]), min_size=n_rows, max_size=n_rows))
    columns: dict[str, list[str]] = {"Asset": assets}
    for condition in schema.conditions.values():
        if draw(st.booleans()):
            texts = draw(strategies.cell_lists(condition.domain))
            columns[condition.name] = [texts[i % len(texts)] for i in draw(strategies.bytes_of(n_rows))]
    settings = TableSettings(name, policy=draw(st.sampled_from(["collect", "priority", "first"])))
    for key, texts in (("enabled", ["True", "no", ""]), ("priority", ["1", "0", "-1"]), ("weight", ["1", "2.5", "0"])):
        if draw(st.booleans()):
            settings = replace(settings, **{key: key.title()})
            columns[key.title()] = [texts[i % len(texts)] for i in draw(strategies.bytes_of(n_rows))]
    return Table.from_columns(columns, schema, settings, name)


def pickable(nest: Nest, valid: Sequence[int]) -> set[int]:
    """The flat rows that `pick` may answer with, going through the tables one by one."""
    flat = {number: way for number, way in enumerate(nest.ways()) if number in set(valid)}
    return set(_offered(list(flat.items()), 0))


def _offered(flat: list[tuple[int, Way]], depth: int) -> list[int]:
    if not flat or len(flat[0][1]) <= depth:
        return [number for number, _ in flat]
    table = flat[0][1][depth][0]
    groups = [[item for item in flat if item[1][depth][1] == row] for row in range(table.n_rows)]
    offers = [(row, _offered(group, depth + 1)) for row, group in enumerate(groups)]
    offers = [(row, found) for row, found in offers if found]
    if table.settings.policy == "first":
        return offers[0][1] if offers else []
    offers = [(row, found) for row, found in offers if float(_plain(table, "weight", row, "1")) > 0]
    top = max((int(_plain(table, "priority", row, "0")) for row, _ in offers), default=0)
    return [number for row, found in offers if int(_plain(table, "priority", row, "0")) == top for number in found]


def _plain(table: Table, job: str, row: int, default: str) -> str:
    name = getattr(table.settings, job)
    return (table.text(row, name).strip() if name else "") or default


def flat_rows(table: Table, flat: Table | FlatTable) -> list[np.ndarray[tuple[int], np.dtype[np.int64]]]:
    """For each row of a table its rows in the flat table."""
    if not isinstance(flat, FlatTable):
        return list(np.arange(table.n_rows).reshape(-1, 1))
    own = flat.expansion.rows[0]
    return np.split(np.arange(len(own)), np.searchsorted(own, np.arange(1, table.n_rows))) if table.n_rows else []
