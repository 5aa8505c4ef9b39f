"""Why rows are not valid, cell by cell, against explain."""

from hypothesis import given
from hypothesis import strategies as st
from strategies import examples, sets, tables

from contextdb.schema.settings import TableSettings
from contextdb.tables.table import Table
from tui.model.query_row import QueryRow
from tui.model.why import nearest_rows, why_row

KINDS = ("bool", "int", "number", "angle", "enum", "tags")
SCHEMA = {"speed": {"type": "number", "unit": "m/s"}, "hit": {"type": "bool"}}


@given(tables(KINDS), st.data())
@examples(2)
def test_a_row_is_explained_as_explain_does_and_its_mends_make_it_valid(table: Table, data):
    query, context = QueryRow(table), {}
    for column in table.conditions:
        text = data.draw(st.just("") | sets(column.condition.domain))
        if query.set(column.condition.name, text) is None and text:
            context[column.condition.name] = query.facts[column.condition.name]
    explanation = table.compile().explain(context, unknown="any")
    for row in range(table.n_rows):
        why, expected = why_row(query, table, row), explanation.row(row)
        wrong = {c.column: (c.fact, c.cell, c.mend) for c in why.cells if c.state == "fails"}
        assert wrong == {f.condition: (f.fact, f.cell, f.mend) for f in expected.failures}
        assert why.is_valid == expected.is_valid
        if wrong:
            mended = table.with_cells([(row, column, mend) for column, (_, _, mend) in wrong.items()])
            query.show(mended)
            assert not any(c.state == "fails" for c in why_row(query, mended, row).cells)
            query.show(table)


def test_a_fact_of_many_digits_is_said_in_few_as_explain_does():
    table = small("A;1..2;")
    query = QueryRow(table)
    query.set("speed", "4.4478483428758864")
    cell = why_row(query, table, 0).cells[0]
    assert (cell.state, cell.fact) == ("fails", "4.448 m/s")


def small(*rows: str, enabled: str | None = None, is_strict: bool = True) -> Table:
    names = ["Asset", "speed", "hit", *([enabled] if enabled else [])]
    columns = dict(zip(names, zip(*(row.split(";") for row in rows), strict=True), strict=True))
    settings = TableSettings("t", enabled=enabled)
    table = Table.from_columns({name: ["" for _ in texts] for name, texts in columns.items()}, SCHEMA, settings)
    texts = [column.with_text(0, columns[column.name][0]) for column in table.columns]
    for row in range(1, len(rows)):
        texts = [column.with_text(row, columns[column.name][row]) for column in texts]
    return Table.build("t", texts, table.schema, settings)


def test_the_cells_that_fail_stand_first_and_each_says_its_state():
    table = small("walk;0..2;Any", "run;2..6;True")
    query = QueryRow(table)
    query.load({"hit": "False"})
    assert [(c.column, c.state, c.fact, c.mend) for c in why_row(query, table, 1).cells] == [
        ("hit", "fails", "False", "Any"),
        ("speed", "not given", "", None),
    ]
    query.load({"speed": "3"})
    assert [(c.column, c.state, c.fact) for c in why_row(query, table, 1).cells] == [
        ("speed", "holds", "3 m/s"),
        ("hit", "not given", ""),
    ]


def test_a_cell_that_cannot_be_read_keeps_its_row_from_being_valid_and_has_no_mend():
    table = small("walk;quick;Any", "run;2..6;True")
    query = QueryRow(table)
    why = why_row(query, table, 0)
    assert (why.is_valid, why.n_wrong, why.cells[0].state, why.cells[0].mend) == (False, 1, "unreadable", None)


def test_a_disabled_row_is_mended_by_its_switch():
    table = small("walk;0..2;Any;False", "run;2..6;True;True", enabled="On")
    query = QueryRow(table)
    first = why_row(query, table, 0).cells[0]
    assert (first.column, first.state, first.cell, first.mend) == ("On", "disabled", "False", "True")
    assert why_row(query, table, 1).is_valid


def test_the_nearest_rows_say_only_what_is_wrong():
    table = small("walk;0..2;False", "run;2..6;True")
    query = QueryRow(table)
    query.load({"speed": "7", "hit": "True"})
    assert [(why.asset, [c.column for c in why.cells]) for why in nearest_rows(query, table)] == [
        ("run", ["speed"]),
        ("walk", ["speed", "hit"]),
    ]
    assert [why.asset for why in nearest_rows(query, table, 1)] == ["run"]
