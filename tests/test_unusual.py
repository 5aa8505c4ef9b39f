"""The careful way of a query and of a live context is for unusual facts alone: a fault of ours comes out as itself."""

from __future__ import annotations

import re
from collections.abc import Callable
from datetime import date
from decimal import Decimal
from fractions import Fraction
from unittest import mock

import numpy as np
import polars as pl
import pytest

from contextdb.cells.facts import cell
from contextdb.compiled.classes import FLAT_BYTES
from contextdb.compiled.table import CompiledTable, data_of
from contextdb.errors import ContextError
from contextdb.tables.table import Table

CONDITIONS: dict[str, dict[str, object]] = {
    "speed": {"type": "number"},
    "n": {"type": "int"},
    "heading": {"type": "angle", "mirror": "none"},
    "ok": {"type": "bool"},
    "state": {"type": "enum", "values": ["Ground", "Air"]},
    "note": {"type": "text"},
    "tags": {"type": "tags"},
}
COLUMNS = {
    "Asset": ["a", "b"],
    "speed": ["1..3", "Any"],
    "n": ["Any", "2"],
    "heading": ["0 ± 90", "Any"],
    "ok": ["True", "Any"],
    "state": ["Ground", "Any"],
    "note": ["left", "Any"],
    "tags": ["+Move", "Any"],
}
FACTS = {"speed": 2.0, "n": 2, "heading": 5.0, "ok": True, "state": "Ground", "note": "left", "tags": frozenset({"Move"})}


class Tensor:
    """Two numbers, which raise what tensors do that are no single number."""

    def __float__(self) -> float:
        raise RuntimeError("a Tensor with 2 elements cannot be converted to Scalar")

    __index__ = __bool__ = __float__

    def __eq__(self, other: object) -> Tensor:  # type: ignore[override]
        return self

    __hash__ = object.__hash__


class Number:
    """What can be made a float of, and is no number."""

    def __float__(self) -> float:
        return 2.0


ODD: list[object] = [
    None, True, "", "x", "Grond", b"x", float("nan"), float("inf"), -1e300, 2**60, 10**400, 1j, object(), Tensor(), [], [1],
    ["Move"], ["Ground"], {1}, {}, (1,), Decimal("NaN"), Decimal("sNaN"), Decimal("1e999"), Fraction(10**400), Fraction(1, 3),
    np.float32(2), np.float64("nan"), np.int64(2), np.bool_(True), np.str_("Ground"), np.array([1.0, 2.0]), np.array("abc"),
    np.array(2.0), np.array(2), np.array("2.0"), np.array(np.nan), np.array(True), np.array("Ground"), Number(),
    np.void(b"abc"), np.datetime64("2020-01-01"), np.timedelta64(1, "D"), np.longdouble("1e4000"), date(2020, 1, 1),
    pl.Series([1.0]), pl.DataFrame({"a": [1]}), pl.col("a"), range(3), print, int, re.compile("x"), cell("Any"), cell("1..2"),
]  # fmt: skip
WIDTHS = pytest.mark.parametrize("flat_bytes", [FLAT_BYTES, 0], ids=["flat", "wide"])


def compiled(flat_bytes: int = FLAT_BYTES, **more: dict[str, object]) -> CompiledTable:
    with mock.patch("contextdb.compiled.classes.FLAT_BYTES", flat_bytes):
        return Table.from_columns(COLUMNS, CONDITIONS | more).compile()


def answer(ask: Callable[[], object]) -> object:
    try:
        return ask()
    except ContextError as error:
        return str(error)


@WIDTHS
@pytest.mark.parametrize("name", CONDITIONS)
def test_an_odd_fact_is_answered_or_refused_as_the_careful_way_does(flat_bytes: int, name: str):
    table = compiled(flat_bytes)
    for value in ODD:
        context = FACTS | {name: value}
        expected = answer(lambda context=context: data_of(table).query_with_care(context).indices.tolist())
        for ask in (table.query, lambda context: table.live(context).matches()):
            assert answer(lambda ask=ask, context=context: ask(context).indices.tolist()) == expected, value


@WIDTHS
@pytest.mark.parametrize("name", CONDITIONS)
def test_an_array_of_no_dimension_is_answered_or_refused_alike_at_every_entrance(flat_bytes: int, name: str):
    table = compiled(flat_bytes)
    for value in (np.array(2.0), np.array(2), np.array(np.nan), np.array(True), np.array("Ground"), np.array([2.0])):
        context = FACTS | {name: value}
        expected = answer(lambda context=context: data_of(table).query_with_care(context).indices.tolist())
        many = {key: [fact] for key, fact in context.items()}
        asks = {
            "query": lambda context=context: table.query(context).indices.tolist(),
            "live": lambda context=context: table.live(context).matches().indices.tolist(),
            "explain": lambda context=context: [row for row in range(2) if table.explain(context).row(row).is_valid],
            "query_many": lambda many=many: table.query_many(many)[0].indices.tolist(),
        }
        for entrance, ask in asks.items():
            found = answer(ask)
            assert isinstance(found, str) == isinstance(expected, str), (entrance, value)
            assert isinstance(found, str) or found == expected, (entrance, value)


def test_the_core_answers_a_fact_as_the_careful_way_does_or_leaves_it_to_that():
    n_left = 0
    for table in (compiled(), compiled(0)):
        data = data_of(table)
        for context in (FACTS | {name: value} for name in CONDITIONS for value in ODD):
            found = data.core.query(context)
            n_left += found is None
            assert found is None or found == data.query_with_care(context), context
    assert n_left > 2 * len(ODD)


@WIDTHS
@pytest.mark.parametrize("fault", [AttributeError, AssertionError, IndexError, ZeroDivisionError, NameError])
@pytest.mark.parametrize("unknown", ["error", "any"])
def test_a_fault_of_ours_in_a_query_comes_out_as_itself(flat_bytes: int, fault: type[Exception], unknown: str):
    with mock.patch("contextdb.compiled.core_table._tags", side_effect=fault("ours")):
        table = compiled(flat_bytes)
        with pytest.raises(fault, match="ours"):
            table.query(FACTS | {"tags": "Move"}, unknown=unknown)  # type: ignore[arg-type]


@pytest.mark.parametrize("fault", [AttributeError, AssertionError, IndexError, ZeroDivisionError, NameError])
def test_a_fault_of_ours_in_a_live_context_comes_out_as_itself(fault: type[Exception]):
    with mock.patch("contextdb.compiled.core_table._tags", side_effect=fault("ours")):
        live = compiled().live(FACTS)
        with pytest.raises(fault, match="ours"):
            live["tags"] = "Move"
    assert live.matches() == compiled().query(FACTS)


@pytest.mark.parametrize(
    "more",
    [{}, {"heading": {"type": "angle"}}, {"ok": {"type": "bool", "expr": "speed > 1"}}],
    ids=["plain", "mirrored", "derived"],
)
@pytest.mark.parametrize("unknown", ["error", "never"])
def test_a_context_that_is_no_mapping_is_refused(more: dict[str, dict[str, object]], unknown: str):
    table = compiled(**more)
    for context in (
        None,
        5,
        "speed",
        [],
        list,
        np.zeros(3),
        np.zeros(1, "f8, f8")[0],
        pl.DataFrame({"a": [1]}),
        re.match("x", "x"),
    ):
        with pytest.raises(ContextError, match="a context is a mapping of facts"):
            table.query(context, unknown=unknown)  # type: ignore[arg-type]


def test_an_actor_that_becomes_odd_is_refused_by_name():
    table = Table.from_columns({"Asset": ["a"], "Defender.speed": ["1..3"]}, {"Defender.speed": {"type": "number"}}).compile()
    actor: dict[str, object] = {"id": 1, "speed": 2.0}
    live = table.live()
    live.actors({"Defender": [actor]})
    assert live.matches().assets == ["a"]
    actor["speed"] = Tensor()
    with pytest.raises(ContextError, match=r"Defender\[0\]"):
        live.matches()
