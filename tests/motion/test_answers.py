"""What motion needs of an answer is what tables answer; motion itself imports no table."""

from collections.abc import Sequence

import numpy as np
import pytest

import contextdb as cdb
from contextdb.motion.answers import Answer, Answers, NamedAssets, are_answers, is_answer

TABLE = cdb.Table.from_columns(
    {"Asset": ["a", "b", "a"], "speed": ["0..2", "3.. ~0.5", "1"]}, {"speed": {"type": "number"}}
).compile()
ONE: Answer = TABLE.query({"speed": 1.0})
MANY: Answers = TABLE.query_many({"speed": [1.0, 5.0]})


def names_of(protocol: type) -> list[str]:
    return sorted(name for name in vars(protocol) if not name.startswith("_"))


@pytest.mark.parametrize(("given", "protocol"), [(ONE, Answer), (NamedAssets(["a"]), Answer), (MANY, Answers)])
def test_an_answer_of_a_table_has_all_that_motion_needs(given: object, protocol: type):
    assert [name for name in names_of(protocol) if not hasattr(given, name)] == []


@pytest.mark.parametrize("given", [None, ["a"], np.ones(3, np.bool_), "a", 3])
def test_what_is_no_answer_is_not_taken_for_one(given: object):
    assert not is_answer(given)
    assert not are_answers(given)


def test_one_answer_and_many_are_told_apart():
    assert is_answer(ONE)
    assert not is_answer(MANY)
    assert are_answers(MANY)
    assert not are_answers(ONE)
    assert is_answer(MANY[0])


@pytest.mark.parametrize("assets", [["a", "b"], []])
def test_named_assets_answer_as_a_table_of_these_rows_without_conditions(assets: Sequence[str]):
    named = NamedAssets(assets)
    assert named.flags.tolist() == [True] * len(assets)
    assert named.penalties.tolist() == [0.0] * len(assets)
    assert named.mirrored is named
    assert named.widened is named
