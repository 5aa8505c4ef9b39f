"""The same question, put to other engines: a context as a dict in, the numbers of all valid rows out.

Each function here fills an engine from a table and gives the function that asks it. What can be prepared beforehand is.
"""

from __future__ import annotations

import json
import sqlite3
from collections.abc import Callable
from typing import Any

import numpy as np
import polars as pl
from numpy.typing import NDArray

from benchmarks.generator import GameTable

Context = dict[str, Any]
Ask = Callable[[Context], Any]
Test = tuple[str, frozenset[Any] | None, float, float]
"""A condition's name, the values that a cell accepts (None for a number), and its interval."""


def python_loop(table: GameTable, with_any: bool = True) -> Ask:
    """Read every cell of every row until one fails; without `with_any`, cells that are Any were dropped beforehand."""
    rows = [_tests(table, r, with_any) for r in range(table.shape.n_rows)]

    def ask(context: Context) -> list[int]:
        found = []
        for r, tests in enumerate(rows):
            for name, accepted, low, high in tests:
                if accepted is None:
                    if not low <= context[name] <= high:
                        break
                elif context[name] not in accepted:
                    break
            else:
                found.append(r)
        return found

    return ask


def _tests(table: GameTable, row: int, with_any: bool) -> list[Test]:
    """The cells of a row."""
    tests: list[Test] = []
    columns: list[tuple[str, Any, tuple[Any, ...]]] = [
        (n, c, (False, True)) for n, c in zip(table.bool_names, table.bools, strict=True)
    ]
    columns += [(n, c, v) for n, c, v in zip(table.enum_names, table.enums, table.values, strict=True)]
    for name, column, values in columns:
        accepted = frozenset(v for j, v in enumerate(values) if int(column[row]) >> j & 1)
        if with_any or len(accepted) < len(values):
            tests.append((name, accepted, 0.0, 0.0))
    for name, lows, highs in zip(table.number_names, table.lows, table.highs, strict=True):
        if with_any or np.isfinite(lows[row]):
            tests.append((name, None, float(lows[row]), float(highs[row])))
    return tests


def numpy_rows(table: GameTable) -> Ask:
    """Compare every cell at once: value columns as bit sets, numbers as bounds."""
    sets = np.concatenate([table.bools, table.enums])
    lows, highs = table.lows, table.highs
    enums = list(zip(table.enum_names, table.value_numbers, strict=True))
    bool_names, number_names = table.bool_names, table.number_names

    def ask(context: Context) -> NDArray[np.int64]:
        held = [1 << context[n] for n in bool_names] + [1 << numbers[context[n]] for n, numbers in enums]
        values = np.array([context[n] for n in number_names])[:, None]
        valid = (sets & np.array(held, np.uint16)[:, None]).all(axis=0)
        return np.flatnonzero(valid & (lows <= values).all(axis=0) & (values <= highs).all(axis=0))

    return ask


def table_frame(table: GameTable) -> pl.DataFrame:
    """A table for the relational engines: bools with null for Any, enums as bit sets, numbers as two columns of bounds."""
    columns: dict[str, Any] = {"row": np.arange(table.shape.n_rows)}
    for name, column in zip(table.bool_names, table.bools, strict=True):
        columns[name] = [(False, True, None)[bits - 1] for bits in column.tolist()]
    for name, column in zip(table.enum_names, table.enums, strict=True):
        columns[name] = column.astype(np.int32)
    for name, low, high in zip(table.number_names, table.lows, table.highs, strict=True):
        columns[f"{name}_low"], columns[f"{name}_high"] = low, high
    return pl.DataFrame(columns)


def polars_filter(table: GameTable) -> Ask:
    """A lazy filter on the whole frame."""
    frame, col = table_frame(table).lazy(), pl.col
    enums = list(zip(table.enum_names, table.value_numbers, strict=True))
    bool_names, number_names = table.bool_names, table.number_names

    def ask(context: Context) -> NDArray[Any]:
        tests = [col(n).is_null() | (col(n) == context[n]) for n in bool_names]
        tests += [(col(n) & (1 << numbers[context[n]])) != 0 for n, numbers in enums]
        for n in number_names:
            tests += [col(f"{n}_low") <= context[n], col(f"{n}_high") >= context[n]]
        return frame.filter(*tests).select("row").collect()["row"].to_numpy()

    return ask


def where_clause(table: GameTable, parameter: Callable[[str], str]) -> str:
    """The condition that holds for the valid rows, in SQL."""
    tests = [f"({n} IS NULL OR {n} = {parameter(n)})" for n in table.bool_names]
    tests += [f"({n} & {parameter(n)}) <> 0" for n in table.enum_names]
    tests += [f"{n}_low <= {parameter(n)} AND {n}_high >= {parameter(n)}" for n in table.number_names]
    return " AND ".join(tests)


def duckdb_prepared(table: GameTable) -> Ask:
    """A prepared statement, on one thread: a second one only costs a query this small."""
    import duckdb

    types = dict.fromkeys(table.bool_names, "BOOLEAN") | dict.fromkeys(table.enum_names, "INTEGER")
    names = table.bool_names + table.enum_names + table.number_names
    place = {n: i + 1 for i, n in enumerate(names)}
    connection = duckdb.connect()
    connection.execute("SET threads = 1")
    connection.register("frame", table_frame(table).to_arrow())
    connection.execute("CREATE TABLE rules AS SELECT * FROM frame")
    where = where_clause(table, lambda n: f"CAST(${place[n]} AS {types.get(n, 'DOUBLE')})")
    connection.execute(f"PREPARE ask AS SELECT row FROM rules WHERE {where}")
    enums = list(zip(table.enum_names, table.value_numbers, strict=True))
    bool_names, number_names = table.bool_names, table.number_names

    def ask(context: Context) -> list[int]:
        facts = [str(context[n]) for n in bool_names]
        facts += [str(1 << numbers[context[n]]) for n, numbers in enums]
        facts += [repr(context[n]) for n in number_names]
        return [r for (r,) in connection.execute(f"EXECUTE ask({','.join(facts)})").fetchall()]

    return ask


def sqlite_prepared(table: GameTable) -> Ask:
    """sqlite3 keeps the statement prepared; there is no index that would help."""
    frame = table_frame(table)
    connection = sqlite3.connect(":memory:")
    connection.execute(f"CREATE TABLE rules ({', '.join(frame.columns)})")
    connection.executemany(f"INSERT INTO rules VALUES ({', '.join('?' * frame.width)})", frame.rows())
    statement = f"SELECT row FROM rules WHERE {where_clause(table, lambda n: f':{n}')}"
    enums = list(zip(table.enum_names, table.value_numbers, strict=True))

    def ask(context: Context) -> list[int]:
        facts = dict(context)
        for n, numbers in enums:
            facts[n] = 1 << numbers[context[n]]
        return [r for (r,) in connection.execute(statement, facts)]

    return ask


def zen_table(table: GameTable) -> Ask:
    """A decision table of zen-engine with the hit policy "collect"."""
    import zen

    engine = zen.ZenEngine()
    decision = engine.create_decision(zen.ZenDecisionContent(json.dumps(zen_graph(table))))

    def ask(context: Context) -> list[int]:
        return [int(hit["row"]) for hit in decision.evaluate(context)["result"]]

    return ask


def zen_graph(table: GameTable) -> dict[str, Any]:
    """The table as a graph of zen-engine: input, decision table, output."""
    cells: list[tuple[str, list[str]]] = []
    for name, column in zip(table.bool_names, table.bools, strict=True):
        cells.append((name, [("false", "true", "")[bits - 1] for bits in column.tolist()]))
    for name, column, values in zip(table.enum_names, table.enums, table.values, strict=True):
        cells.append((name, [_zen_values(bits, values) for bits in column.tolist()]))
    for name, lows, highs in zip(table.number_names, table.lows.tolist(), table.highs.tolist(), strict=True):
        cells.append((name, ["" if low == -np.inf else f"[{low}..{high}]" for low, high in zip(lows, highs, strict=True)]))
    rules = [{"_id": f"rule{r}", "row": str(r)} | {name: column[r] for name, column in cells} for r in range(table.shape.n_rows)]
    content = {
        "hitPolicy": "collect",
        "inputs": [{"id": name, "name": name, "type": "expression", "field": name} for name, _ in cells],
        "outputs": [{"id": "row", "name": "row", "field": "row"}],
        "rules": rules,
    }
    return {
        "nodes": [
            {"id": "in", "type": "inputNode", "name": "in"},
            {"id": "table", "type": "decisionTableNode", "name": "table", "content": content},
            {"id": "out", "type": "outputNode", "name": "out"},
        ],
        "edges": [
            {"id": "first", "type": "edge", "sourceId": "in", "targetId": "table"},
            {"id": "second", "type": "edge", "sourceId": "table", "targetId": "out"},
        ],
    }


def _zen_values(bits: int, values: tuple[str, ...]) -> str:
    if bits == (1 << len(values)) - 1:
        return ""
    return ", ".join(f'"{v}"' for j, v in enumerate(values) if bits >> j & 1)
