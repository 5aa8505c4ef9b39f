"""The facts of a crowd: after any changes the answers are those of `query_many` for the columns as they are."""

import random
from functools import partial
from typing import Any

import numpy as np
import polars as pl
import pytest
from asking_c import FACTS, random_table
from strategies import IS_FULL
from test_c_rules import ruled_table

import contextdb as cdb
from contextdb.compiled.table import CompiledTable

FEW = cdb.Table.from_columns(
    {"Asset": ["walk", "run"], "speed": ["<3", ">=2"], "gait": ["Walk", "Any"]},
    {"speed": {"type": "number"}, "gait": {"type": "enum", "values": ["Walk", "Run"]}},
    name="few",
).compile()
COLUMNS: dict[str, Any] = {"speed": [1.0, 2.5, 5.0], "gait": ["Walk", "Walk", "Run"]}


def fact(rng: random.Random, name: str, missing: float) -> object:
    return None if rng.random() < missing else rng.choice(FACTS[name])


def same(many: Any) -> Any:
    return many


def answer(ask: Any) -> object:
    """The rows, or what is refused."""
    try:
        many = ask()
        return many.mask.tolist(), many.counts.tolist(), [m.assets for m in many], many.penalties.tolist()
    except cdb.ContextError as error:
        return str(error)


@pytest.mark.parametrize("unknown", ["error", "any", "never"])
def test_a_crowd_is_answered_as_its_columns_are_after_any_changes(unknown: cdb.Unknown):
    rng = random.Random(5)
    for turn in range(24 if IS_FULL else 8):
        compiled: CompiledTable = ruled_table(rng, 20) if turn % 2 else random_table(rng, rng.choice([3, 70]))
        names, n, missing = list(compiled.asked), rng.choice([1, 7, 40]), rng.choice([0.0, 0.02])
        columns = {name: [fact(rng, name, missing) for _ in range(n)] for name in names}
        crowd = compiled.live_many(columns, unknown=unknown)
        before: list[tuple[Any, object]] = []
        for _ in range(6):
            name = rng.choice(names)
            if rng.random() < 0.5:
                columns[name] = [fact(rng, name, missing) for _ in range(n)]
                crowd[name] = columns[name]
            else:
                who = [rng.randrange(n) for _ in range(rng.choice([0, 1, 5]))]
                values = [fact(rng, name, missing) for _ in who]
                crowd.set(name, who, values)
                columns[name] = [*columns[name]]
                for one, value in zip(who, values, strict=True):
                    columns[name][one] = value
            expected = answer(partial(compiled.query_many, columns, unknown=unknown))
            assert answer(crowd.query) == expected
            if not isinstance(expected, str):
                before.append((crowd.query(), expected))
        assert [answer(partial(same, many)) for many, _ in before] == [expected for _, expected in before]


def test_columns_may_be_arrays_series_and_frames_and_the_caller_may_change_them_later():
    speeds = np.array([1.0, 2.5, 5.0])
    crowd = FEW.live_many(pl.DataFrame(COLUMNS))
    crowd["speed"] = speeds
    speeds[:] = 9.0
    assert [m.assets for m in crowd.query()] == [["walk"], ["walk", "run"], ["run"]]
    crowd["gait"] = pl.Series(["Run", "Run", "Walk"])
    crowd.set("gait", np.array([0]), ["Walk"])
    crowd.set("speed", 2, 2)
    assert [m.assets for m in crowd.query()] == [["walk"], ["run"], ["walk", "run"]]
    assert FEW.picker().pick_many(crowd.query()).tolist()[:2] == [0, 1]
    assert crowd["gait"] == ["Walk", "Run", "Walk"]
    assert repr(crowd) == '<LiveMany "few": 3 characters, 2 of 2 facts set>'


def test_a_text_longer_than_those_of_an_array_is_kept_whole():
    table = cdb.Table.from_columns({"Asset": ["a"], "word": ["longer"]}, {"word": {"type": "text"}}).compile()
    crowd = table.live_many({"word": np.array(["a", "b"])})
    crowd.set("word", [1], np.array(["longer"]))
    assert crowd.query().counts.tolist() == [0, 1]


@pytest.mark.parametrize(
    ("change", "why"),
    [
        (lambda crowd: crowd.set("speed", [3], [1.0]), "there is no character 3"),
        (lambda crowd: crowd.set("speed", np.array([-4]), [1.0]), "there is no character -4"),
        (lambda crowd: crowd.set("speed", "all", [1.0]), "characters are given as str"),
        (lambda crowd: crowd.set("speed", [0, 1], [1.0]), "there is 1 fact of \"speed\", for 2 characters|there are 1 fact"),
        (lambda crowd: crowd.set("speed", [0], ["fast"]), "fast"),
        (lambda crowd: crowd.set("gait", [0], [cdb.cell("Walk Run")]), "one query at a time"),
        (lambda crowd: crowd.set("sped", [0], [1.0]), 'Did you mean "speed"'),
        (lambda crowd: crowd.__setitem__("sped", [1.0] * 3), 'Did you mean "speed"'),
        (lambda crowd: crowd.__setitem__("speed", [1.0]), "for 3 characters"),
        (lambda crowd: crowd.__setitem__("gait", ["Walk", "Walk", "Swim"]), "Swim"),
        (lambda crowd: crowd.update(5), "is not columns of facts"),
    ],
)  # fmt: skip
def test_what_cannot_be_set_is_refused_and_changes_nothing(change: Any, why: str):
    crowd = FEW.live_many(COLUMNS)
    with pytest.raises(cdb.ContextError, match=why):
        change(crowd)
    assert [m.assets for m in crowd.query()] == [["walk"], ["walk", "run"], ["run"]]
    assert crowd.facts == COLUMNS


def test_a_column_that_is_not_set_is_missing_and_a_slip_is_named():
    crowd = FEW.live_many({"speed": [1.0]})
    with pytest.raises(cdb.ContextError, match='"gait"'):
        crowd.query()
    with pytest.raises(cdb.ContextError, match='Did you mean "gait"'):
        crowd.update({"gaitt": ["Walk"]})
    with pytest.raises(KeyError):
        crowd["gait"]
    crowd.update({"gait": ["Walk"], "weather": ["rain"]})
    assert crowd.query().assets == ["walk"]
