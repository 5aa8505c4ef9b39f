"""What polars and DuckDB make of the same question: which rows of a table are valid in each recorded context, as a join.

Both are helped as a person would: rows are spread over the values of the condition that most rows name, contexts are joined with
them on it, and the other conditions filter what was joined. Each gives the sum of valid rows over all contexts, and how many
contexts have none.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import polars as pl

from contextdb.cells.conditions import Condition
from contextdb.cells.sets import NumberSet, ValueSet
from contextdb.compiled.table import data_of
from contextdb.tables.table import Table


def table_frame(table: Table) -> tuple[pl.DataFrame, str]:
    """The table with a list of values, or two ends, for each condition, null for Any; and the condition to join on."""
    compiled = data_of(table.compile())
    columns: list[pl.Series] = [pl.Series("row", range(table.n_rows))]
    n_named: dict[str, int] = {}
    for at, condition in enumerate(compiled.conditions):
        cells = compiled.cells(at)
        accepted = [cells[code].accepts for code in compiled.texts[at].codes.tolist()]
        columns += _columns(condition, accepted)
        if condition.domain.kind == "enum":
            n_named[condition.name] = sum(found is not None for found in accepted)
    key = max(n_named, key=n_named.__getitem__)
    values = list(next(c.domain.values or () for c in compiled.conditions if c.name == key))
    frame = pl.DataFrame(columns).with_columns(pl.col(f"{key}_in").fill_null(pl.lit(values, dtype=pl.List(pl.String))))
    return frame.explode(f"{key}_in").rename({f"{key}_in": key}), key


def _columns(condition: Condition, accepted: Sequence[Any]) -> list[pl.Series]:
    name, kind = condition.name, condition.domain.kind
    if kind == "bool":
        truths = [None if a is None or len(a.values) != 1 else True in a.values for a in accepted]
        return [pl.Series(f"{name}_is", truths, dtype=pl.Boolean)]
    if kind == "enum":
        lists = [sorted(a.values) if isinstance(a, ValueSet) else None for a in accepted]
        return [pl.Series(f"{name}_in", lists, dtype=pl.List(pl.String))]
    spans = [a.spans if isinstance(a, NumberSet) else ((None, None),) for a in accepted]
    if any(len(own) != 1 for own in spans):
        raise ValueError(f"{name}: a cell of several intervals; this comparison takes one.")
    ends = zip(*(own[0] for own in spans), strict=True)
    return [pl.Series(f"{name}_{end}", list(own), dtype=pl.Float64) for end, own in zip(("low", "high"), ends, strict=True)]


def with_polars(table: Table, files: str) -> tuple[int, int]:
    """Valid rows summed over the contexts, and contexts without one."""
    rows, key = table_frame(table)
    holds = [_holds_in_polars(c.condition) for c in table.conditions if c.condition.name != key]
    contexts = pl.scan_parquet(files).with_row_index("context")
    joined = contexts.join(rows.lazy(), on=key).filter(*holds)
    sums = joined.select(pl.len(), pl.col("context").n_unique().alias("with")).collect(engine="streaming").row(0)
    n_contexts = int(pl.scan_parquet(files).select(pl.len()).collect().item())
    return int(sums[0]), n_contexts - int(sums[1])


def _holds_in_polars(condition: Condition) -> pl.Expr:
    name, kind = condition.name, condition.domain.kind
    fact = pl.col(name)
    if kind == "bool":
        return (fact == pl.col(f"{name}_is")).fill_null(True)
    if kind == "enum":
        return pl.col(f"{name}_in").list.contains(fact).fill_null(True)
    return ((fact >= pl.col(f"{name}_low")) & (fact <= pl.col(f"{name}_high"))).fill_null(True)


def with_duckdb(table: Table, files: str, scratch: str) -> tuple[int, int]:
    """As `with_polars`; the table goes through a file in the folder `scratch`.

    Raises
    ------
    ImportError
        DuckDB is not installed.
    """
    import duckdb  # type: ignore[import-not-found,unused-ignore]

    rows, key = table_frame(table)
    rows.write_parquet(f"{scratch}/table.parquet")
    holds = " AND ".join(["TRUE", *(_holds_in_sql(c.condition) for c in table.conditions if c.condition.name != key)])
    found = (
        duckdb.connect()
        .execute(
            f"WITH c AS (SELECT row_number() OVER () AS context, * FROM read_parquet('{files}')), "
            f"j AS (SELECT c.context FROM c JOIN read_parquet('{scratch}/table.parquet') t ON c.{key} = t.{key} WHERE {holds}) "
            "SELECT (SELECT count(*) FROM j), (SELECT count(*) FROM c) - (SELECT count(DISTINCT context) FROM j)"
        )
        .fetchone()
    )
    assert found is not None
    return int(found[0]), int(found[1])


def _holds_in_sql(condition: Condition) -> str:
    name, kind = condition.name, condition.domain.kind
    if kind == "bool":
        return f"(t.{name}_is IS NULL OR c.{name} = t.{name}_is)"
    if kind == "enum":
        return f"(t.{name}_in IS NULL OR list_contains(t.{name}_in, c.{name}))"
    return f"(t.{name}_low IS NULL OR (c.{name} >= t.{name}_low AND c.{name} <= t.{name}_high))"
