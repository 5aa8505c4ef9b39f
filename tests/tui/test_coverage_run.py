"""A run in the background: what it tells, how an edit stops it, and what is known afterwards."""

from threading import Event

import pytest

import contextdb as cdb
from contextdb.cells.facts import read_fact_text
from contextdb.covering import Cancelled
from contextdb.covering.gaps import facts_inside
from contextdb.schema.settings import TableSettings
from tui.model.coverage_lines import about_text
from tui.model.coverage_run import CoverageRun, Result, is_quick, measured

WAIT_S = 30.0


def table(cells: tuple[str, ...] = ("True",)) -> cdb.Table:
    return cdb.Table.from_columns({"Asset": ["A"] * len(cells), "up": list(cells)}, {"up": {"type": "bool"}})


def done(run: CoverageRun) -> CoverageRun:
    run.join(WAIT_S)
    return run


class Held:
    """A measure that waits until it is let go, and says when it began."""

    def __init__(self) -> None:
        self.begun, self.free, self.was_stopped = Event(), Event(), Event()

    def __call__(self, table, tell, should_stop) -> Result:
        tell("Counting contexts", 0.5)
        self.begun.set()
        assert self.free.wait(WAIT_S)
        if should_stop():
            self.was_stopped.set()
            raise Cancelled("stopped")
        return measured(table, lambda part, share: None, should_stop)


def test_nothing_is_known_before_the_first_run():
    run = CoverageRun()
    run.follow(table())
    assert (run.state, run.result, run.progress) == ("none", None, ("", 0.0))


def test_a_run_gives_the_report_and_the_pairs_of_its_table():
    run = CoverageRun()
    shown = table()
    run.start(shown)
    assert done(run).state == "done"
    assert run.result.report.covered == 0.5
    assert run.result.pairs.conditions == ("up",)
    assert run.table is shown


def test_progress_is_told_while_a_run_is_at_work():
    held = Held()
    run = CoverageRun(held)
    run.start(table())
    assert held.begun.wait(WAIT_S)
    assert (run.state, run.progress) == ("running", ("Counting contexts", 0.5))
    held.free.set()
    assert done(run).state == "done"


def test_an_edit_stops_the_run_and_what_it_would_have_given_is_not_shown():
    held = Held()
    run = CoverageRun(held)
    run.start(table())
    assert held.begun.wait(WAIT_S)
    run.follow(table(("False",)))
    assert run.state == "none"
    held.free.set()
    assert held.was_stopped.wait(WAIT_S)
    assert (run.state, run.result) == ("none", None)


def test_a_result_of_before_an_edit_is_stale_and_of_the_same_table_again_is_not():
    run, first = CoverageRun(), table()
    run.start(first)
    done(run).follow(first.with_cell(0, "up", "Any"))
    assert (run.state, run.result.report.covered) == ("stale", 0.5)
    run.follow(first)
    assert run.state == "done"


def test_saving_a_table_does_not_make_its_report_stale(tmp_path):
    run, shown = CoverageRun(), table()
    run.start(shown)
    done(run).follow(shown.save(tmp_path / "a.csv"))
    assert run.state == "done"


def test_cancelling_keeps_what_was_known():
    run, first = CoverageRun(), table()
    run.start(first)
    done(run)
    held = Held()
    run._measure = held
    second = first.with_cell(0, "up", "Any")
    run.start(second)
    assert held.begun.wait(WAIT_S)
    run.cancel()
    assert (run.state, run.result.report.covered) == ("stale", 0.5)
    held.free.set()


def test_a_second_start_replaces_the_first():
    held, run = Held(), CoverageRun()
    run._measure = held
    run.start(table())
    assert held.begun.wait(WAIT_S)
    run._measure = measured
    run.start(table(("Any",)))
    assert done(run).result.report.covered == 1.0
    held.free.set()
    assert held.was_stopped.wait(WAIT_S)
    assert run.result.report.covered == 1.0


def test_a_table_with_cells_that_cannot_be_read_fails_with_the_first_of_them(tmp_path):
    file = tmp_path / "a.csv"
    file.write_text('Asset,speed\nA,1 to 2\nB,"5, 1"\nC,2 to 3\nD,1..2\n')
    (tmp_path / "contextdb.toml").write_text('[conditions.speed]\ntype = "number"\n')
    run, shown = CoverageRun(), cdb.load(file, strict=False)
    run.start(shown)
    assert done(run).state == "failed"
    assert "1 to 2" in run.problem
    assert "1 fault more" in run.problem
    run.follow(shown.with_cells([(0, "speed", "1"), (2, "speed", "2")]))
    assert run.state == "none"


def test_what_is_expected_comes_before_the_share_of_all_contexts(tmp_path):
    (tmp_path / "contextdb.toml").write_text("[conditions.up]\ntype = 'bool'\n[tables.moves]\nexpected = 'asked.csv'\n")
    (tmp_path / "moves.csv").write_text("Asset,up\na,True\n")
    (tmp_path / "asked.csv").write_text("Situation,up,Weight\njump,True,3\nfall,False,1\n")
    moves = cdb.load(tmp_path / "moves.csv")
    of_all = "50.00 % of the contexts have a valid row (exact)."
    expected = "75.00 % of what 2 expected situations ask for has a valid row."
    assert measured(moves, lambda part, share: None, lambda: False).headline == f"{expected} Of all contexts alike: {of_all}"
    (tmp_path / "asked.csv").unlink()  # a problem of its own
    assert measured(moves, lambda part, share: None, lambda: False).headline == of_all


def test_contexts_that_the_assumptions_rule_out_belong_to_no_share():
    schema = {"up": {"type": "bool"}, "down": {"type": "bool"}, "a": {"type": "number"}, "b": {"type": "number"}}
    settings = TableSettings("table", assume=("not (up and down)", "a < b"))
    columns = {"Asset": ["A"], "up": ["True"], "down": ["Any"], "a": ["Any"], "b": ["Any"]}
    run = CoverageRun()
    run.start(cdb.Table.from_columns(columns, schema, settings))
    result = done(run).result
    assert result.report.assumptions == ("not (up and down)", "a < b")
    assert result.report.covered == pytest.approx(1 / 3)
    assert result.pairs.slice(0, 1, 1, 1).covered is None
    assert "Assumed of every context: a < b" in about_text(result)


def test_an_assumption_that_cannot_be_read_is_told():
    settings = TableSettings("table", assume=("not (up and",))
    run = CoverageRun()
    run.start(cdb.Table.from_columns({"Asset": ["A"], "up": ["True"]}, {"up": {"type": "bool"}}, settings))
    assert done(run).state == "failed"
    assert run.problem


def test_who_listens_no_more_hears_nothing():
    heard: list[str] = []
    run = CoverageRun()
    run.listen(lambda: heard.append("first"))

    def second() -> None:
        heard.append("second")

    run.listen(second)
    run.unlisten(second)
    run.follow(table())
    assert heard == ["first"]


def test_listeners_hear_of_every_change():
    heard: list[str] = []
    run = CoverageRun()
    run.listen(lambda: heard.append(run.state))
    run.start(table())
    done(run).follow(table(("Any",)))
    assert heard[0] in ("running", "done")
    assert "done" in heard
    assert heard[-1] == "stale"


def test_small_tables_are_quick_and_large_ones_are_not():
    assert is_quick(table())
    names = [f"b{i}" for i in range(30)]
    assert not is_quick(cdb.Table.from_columns({"Asset": ["A"] * 100} | {n: ["True"] * 100 for n in names}))


SCHEMA = {
    "speed": {"type": "number", "min": 0, "max": 10},
    "free": {"type": "number"},
    "count": {"type": "int", "min": 0, "max": 9},
    "heading": {"type": "angle"},
    "gait": {"type": "enum", "values": ["Walk", "Half Way"]},
    "word": {"type": "text"},
    "tags": {"type": "tags", "values": ["Move", "Move.Run", "In Air"]},
    "up": {"type": "bool"},
}


@pytest.mark.parametrize(
    ("cells", "facts"),
    [
        ({"speed": "(2.5..5)"}, {"speed": "4"}),
        ({"speed": "5"}, {"speed": "5"}),
        ({"speed": "3..3.1 | 4..8"}, {"speed": "6"}),
        ({"free": "(7.."}, {"free": "8"}),
        ({"free": "..7)"}, {"free": "6"}),
        ({"count": "3..4"}, {"count": "4"}),
        ({"heading": "-180..-90"}, {"heading": "-135"}),
        ({"gait": '"Half Way"'}, {"gait": '"Half Way"'}),
        ({"word": "not other"}, {"word": "other_"}),
        ({"tags": "+Move -Move.Run"}, {"tags": "Move"}),
        ({"tags": "-Move"}, {"tags": '""'}),
        ({"tags": 'not -"In Air"'}, {"tags": '"In Air"'}),
        ({"up": "False"}, {"up": "False"}),
        ({"speed": "Any", "up": "True"}, {"up": "True"}),
    ],
)
def test_a_context_inside_a_box_is_one_that_its_cells_hold(cells, facts):
    columns = {"Asset": ["A"]} | {name: [cells.get(name, "Any")] for name in SCHEMA}
    shown = cdb.Table.from_columns(columns, SCHEMA)
    found = facts_inside(cells, [c.condition for c in shown.conditions])
    assert found == facts
    given = {c.condition.name: read_fact_text(found.get(c.condition.name, ""), c.condition) for c in shown.conditions}
    assert shown.compile().query(given, unknown="any").indices.tolist() == [0]
