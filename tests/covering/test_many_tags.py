"""Columns of very many tags, and tables of very many conditions: nothing recurses without a bound, and answers stay exact."""

import sys
from collections.abc import Iterator

import pytest
from hypothesis import given
from hypothesis import strategies as st
from strategies import TAGS, examples

import contextdb as cdb
from contextdb.cells.domains import Domain
from contextdb.cells.sets import TagSet, covered_by, covers
from contextdb.checks.run import check_rows
from contextdb.compiled.table import data_of
from contextdb.covering import coverage
from contextdb.covering.count import Bounds, uncovered_share
from contextdb.covering.factors import TagFactor, tag_factors
from contextdb.covering.space import Space
from contextdb.covering.witness import BoxSet, Steps

tag_sets = st.builds(
    TagSet, st.frozensets(st.sampled_from(TAGS), max_size=3), st.frozensets(st.sampled_from(TAGS), max_size=3), st.booleans()
)


def table_of(cells: list[str], name: str = "tags", kind: str = "tags") -> cdb.Table:
    return cdb.Table.from_columns({"Asset": [f"A{r}" for r in range(len(cells))], name: cells}, {name: {"type": kind}})


@pytest.fixture
def n_calls() -> Iterator[int]:
    """More calls than may nest; few may, so that it need not be very many."""
    few = table_of(["+Move.T0", "+Move.T1", "+Move.T0 +Move.T1"])
    coverage(few, samples=0)  # what is loaded on the way loads before
    assert check_rows(few)
    before = sys.getrecursionlimit()
    depth, frame = 0, sys._getframe()
    while frame := frame.f_back:
        depth += 1
    sys.setrecursionlimit(depth + 300)
    yield depth + 400
    sys.setrecursionlimit(before)


def test_a_row_for_each_of_more_tags_than_calls_may_nest(n_calls: int):
    n = n_calls
    report = coverage(table_of([f"+Move.T{i}" for i in range(n)]), samples=0, work=8_000_000, max_gaps=2)
    assert report.covered == pytest.approx(1.0)
    assert report.gaps[0].cells["tags"].count("-Move.T") == n


def test_a_check_of_many_tags_finds_the_row_inside_another(n_calls: int):
    cells = [f"+Move.T{i}" for i in range(n_calls)] + ["+Move.T7 +Move.T8"]
    assert [(f.rule, f.row, f.by) for f in check_rows(table_of(cells)) if f.row is not None] == [("variety", 7, (n_calls,))]


def test_one_cell_of_very_many_tags_is_read_and_measured():
    table = table_of([" ".join(f"+T{i}" for i in range(2000))])
    assert table.compile().query({"tags": [f"T{i}" for i in range(2000)]}).indices.tolist() == [0]
    assert not table.compile().query({"tags": [f"T{i}" for i in range(1999)]})


def test_boxes_that_share_no_factor_are_counted_apart():
    n = 130
    columns = {f"c{i}": ["True" if r == i // 2 else "Any" for r in range(n // 2)] for i in range(n)}
    table = cdb.Table.from_columns(
        {"Asset": [f"A{r}" for r in range(n // 2)], **columns}, {f"c{i}": {"type": "bool"} for i in range(n)}
    )
    space = Space.of(data_of(table.compile()))
    assert uncovered_share(space, space.boxes, 1000).lower == pytest.approx(0.75 ** (n // 2))


def test_a_loop_that_nests_too_deep_gives_bounds(monkeypatch: pytest.MonkeyPatch):
    n = 60
    columns = {f"c{i}": ["True" if i in (r, r + 1) else "Any" for r in range(n - 1)] for i in range(n)}
    table = cdb.Table.from_columns(
        {"Asset": [f"A{r}" for r in range(n - 1)], **columns}, {f"c{i}": {"type": "bool"} for i in range(n)}
    )
    space = Space.of(data_of(table.compile()))
    whole = uncovered_share(space, space.boxes, 10_000_000)
    monkeypatch.setattr("contextdb.covering.count.MOST_DEPTH", 12)
    cut = uncovered_share(space, space.boxes, 10_000_000)
    assert isinstance(cut, Bounds)
    assert whole.is_exact
    assert cut.lower <= whole.lower <= cut.upper


def test_a_search_over_many_factors_answers(n_calls: int):
    n = n_calls
    full = (3,) * n
    boxes = BoxSet.of(full, [tuple(2 if f == i else 3 for f in range(n)) for i in range(n)])
    assert boxes.outside(boxes.all, full, Steps(10**6)) == (0,) * n
    assert next(boxes.points(full, Steps(10**6))) == (0,) * n


@examples(1)
@given(tag_sets, st.frozensets(st.sampled_from(TAGS)))
def test_a_set_of_tags_holds_what_trying_each_tag_says(accepts: TagSet, tags: frozenset[str]):
    has = all(covers(need, tags) for need in accepts.needs) and not any(covers(ban, tags) for ban in accepts.bans)
    assert accepts.holds(tags) is (has is not accepts.is_complement)
    assert accepts.is_contradiction is any(covers(ban, accepts.needs) for ban in accepts.bans)
    assert all((tag in covered_by(tags)) is covers(tag, tags) for tag in TAGS)


@examples(1)
@given(st.lists(tag_sets, max_size=4), st.none() | st.just(tuple(TAGS)))
def test_tags_hang_together_where_some_are_above_others_or_stand_in_one_cell_with_not(
    sets: list[TagSet], values: tuple[str, ...] | None
):
    factors = tag_factors(sets, Domain("tags", values=values))
    named = sorted({t for s in sets if not s.is_empty for t in s.needs | s.bans})
    assert sorted(t for f in factors for t in f.tags) == named
    place = {t: i for i, f in enumerate(factors) for t in f.tags}
    for above in named:
        assert all(place[above] == place[t] for t in named if t.startswith(above + "."))
    for factor in factors:
        whole = TagFactor.of(factor.tags, values if values is not None else named)
        assert (factor.answers, factor.weights.tolist()) == (whole.answers, whole.weights.tolist())
