"""Conditions: what a column is taken for when nobody declared it, and the role that a name belongs to."""

import pytest

from contextdb.cells.conditions import Condition
from contextdb.cells.domains import BOOL, NUMBER, TEXT
from contextdb.columns import TextColumn
from contextdb.schema.settings import EMPTY
from contextdb.tables.condition_column import infer_condition
from contextdb.tables.table import Table


def inferred(*texts: str) -> str:
    return infer_condition(TextColumn.of("x", texts)).domain.kind


@pytest.mark.parametrize(
    ("texts", "kind"),
    [
        (["True", "False", "Any"], "bool"),
        (["yes", "no"], "bool"),
        (["True", "not True", "-"], "bool"),
        (["TRUE", "f", "1"], "bool"),
        (["0", "1", "Any"], "number"),
        (["0", "1", "2"], "number"),
        (["0..5", "20, 9.99", "Any", "", "-"], "number"),
        (["not 5", "<=5", "0..5 | 10..15"], "number"),
        (["5 ~2", "3"], "number"),
        (["+InAir", "-Stunned", "+InAir -Stunned"], "tags"),
        (["CB", "FS SS", "not CB"], "text"),
        (["Half_Back", '"Half Back"'], "text"),
        (["Any", "-", "", " any "], "text"),
        (["Any ~2"], "bool"),
        ([], "text"),
    ],
)
def test_a_column_that_nobody_declared_is_what_its_cells_read_as(texts, kind):
    assert inferred(*texts) == kind


def test_a_type_is_taken_when_four_of_five_rows_read_as_it():
    assert inferred("0..5", "1", "2", "3", "oops") == "number"
    assert inferred("0..5", "1", "2", "oops", "oops") == "text"


def test_rows_that_are_any_say_nothing_of_the_type():
    assert inferred(*["Any"] * 100, "CB") == "text"
    assert inferred(*["Any"] * 100, "0..5") == "number"


def test_a_row_that_does_not_read_as_what_the_others_are_is_a_fault_and_no_any():
    table = Table.build("t", [TextColumn.of("a", "abcde"), TextColumn.of("x", ["0..5", "1", "2", "3", "1;2"])])
    (fault,) = table.faults
    assert (fault.place.row, fault.place.column, fault.mend) == (4, "x", '"1, 2"')


def test_an_inferred_condition_says_that_nobody_declared_it():
    assert not infer_condition(TextColumn.of("x", ["1"])).is_declared
    assert Condition("x", NUMBER).is_declared


def test_a_declared_condition_is_not_inferred():
    schema = type(EMPTY)(conditions={"x": Condition("x", TEXT)})
    table = Table.build("t", [TextColumn.of("a", "ab"), TextColumn.of("x", ["True", "False"])], schema)
    assert table.condition("x").condition.domain == TEXT


@pytest.mark.parametrize(
    ("name", "role"), [("Defender.DepthChart", "Defender"), ("Defender.Tags.More", "Defender"), ("speed", None), ("a b", None)]
)
def test_a_condition_belongs_to_the_role_before_its_first_dot(name, role):
    assert Condition(name, BOOL).role == role
