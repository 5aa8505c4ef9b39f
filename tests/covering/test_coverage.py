"""The coverage of small random tables is what going through every context gives."""

import random

import pytest
from brute import Brute, nearest_row, random_boxes, random_table
from hypothesis import given
from hypothesis import strategies as st
from strategies import examples

import contextdb as cdb
from contextdb.cells.grammar import parse_cell
from contextdb.compiled.table import data_of
from contextdb.covering import coverage
from contextdb.covering.space import Space
from contextdb.tables.variety import NEEDLESS, identical_rows

SEEDS = st.integers(0, 2**32)


def made(seed: int, policy: str = "collect") -> tuple[Brute, cdb.CoverageReport]:
    rng = random.Random(seed)
    table = random_table(rng, policy)
    brute = Brute(table, random_boxes(rng, table))
    return brute, coverage(table, impossible=brute.impossible, samples=0)


@examples(4)
@given(SEEDS)
def test_the_covered_share_is_that_of_every_context(seed):
    brute, report = made(seed)
    assert report.method == "exact"
    assert report.lower == report.covered == report.upper
    if brute.share([True] * len(brute.contexts)):
        assert report.covered == pytest.approx(brute.covered, abs=1e-9)
        assert (report.covered == 1.0) == (brute.covered == 1.0)


@examples(4)
@given(SEEDS)
def test_gaps_hold_no_context_of_a_row_and_together_all_others(seed):
    brute, report = made(seed)
    assert report.gaps_complete
    inside = [brute.inside(gap.cells) for gap in report.gaps]
    for at, rows in enumerate(brute.valid):
        assert any(flags[at] for flags in inside) == (not rows)


@examples(2)
@given(SEEDS)
def test_the_share_of_a_gap_and_what_no_earlier_one_holds_are_exact_and_largest_first(seed):
    brute, report = made(seed)
    seen = [False] * len(brute.contexts)
    for gap in report.gaps:
        assert gap.is_exact
        inside = brute.inside(gap.cells)
        assert gap.share == pytest.approx(brute.share(inside), abs=1e-9)
        assert gap.new_share == pytest.approx(brute.share([a and not b for a, b in zip(inside, seen, strict=True)]), abs=1e-9)
        seen = [a or b for a, b in zip(inside, seen, strict=True)]
    assert [g.share for g in report.gaps] == sorted((g.share for g in report.gaps), reverse=True)
    assert len({g.id for g in report.gaps}) == len(report.gaps)


@examples(2)
@given(SEEDS)
def test_a_gap_cannot_leave_out_a_condition(seed):
    rng = random.Random(seed)
    brute = Brute(random_table(rng))
    for gap in coverage(brute.table, samples=0).gaps:
        for name in gap.cells:
            wider = brute.inside({other: cell for other, cell in gap.cells.items() if other != name})
            assert any(rows for rows, flag in zip(brute.valid, wider, strict=True) if flag)


@examples(4)
@given(SEEDS, st.integers(0, 60))
def test_bounds_hold_wherever_the_count_is_cut(seed, work):
    rng = random.Random(seed)
    table = random_table(rng, most_rows=20)
    brute = Brute(table, random_boxes(rng, table))
    report = coverage(table, impossible=brute.impossible, samples=0, work=work)
    if brute.share([True] * len(brute.contexts)):
        assert report.lower - 1e-9 <= brute.covered <= report.upper + 1e-9
        assert report.lower <= report.covered <= report.upper
        assert (report.lower == report.upper) == (report.method == "exact")


@examples(2)
@given(SEEDS)
def test_overlap_and_hits_are_those_of_every_context(seed):
    brute, report = made(seed)
    if not brute.share([True] * len(brute.contexts)):
        return
    counts = [len(rows) for rows in brute.valid]
    assert report.overlap.method == "exact"
    histogram = [brute.share([c == n for c in counts]) for n in range(len(report.overlap.histogram))]
    assert list(report.overlap.histogram) == pytest.approx(histogram, abs=1e-9)
    assert sum(report.overlap.histogram) == pytest.approx(1.0)
    assert report.overlap.mean == pytest.approx(sum(n * share for n, share in enumerate(histogram)), abs=1e-9)
    for row, hit in enumerate(report.hits):
        assert hit == pytest.approx(brute.share([row in rows for rows in brute.valid]), abs=1e-9)


def specificities(table: cdb.Table, policy: str) -> list[int]:
    """How many cells of each row exclude something, under the policy that asks for it."""
    said = [[c.texts[row] not in ("Any", "") and "~" not in c.texts[row] for c in table.conditions] for row in range(table.n_rows)]
    return [sum(row) if policy == "specific" else 0 for row in said]


def expected_findings(brute: Brute, policy: str) -> set[tuple[str, int | None]]:
    """The findings that going through every context gives, by rule and row."""
    if brute.impossible and not brute.contexts:
        return {("no-context", None)}
    table = brute.table
    everywhere = Brute(table)
    whole = {row: frozenset(i for i, rows in enumerate(everywhere.valid) if row in rows) for row in range(table.n_rows)}
    of = {row: frozenset(i for i, rows in enumerate(brute.valid) if row in rows) for row in range(table.n_rows)}
    alive = [row for row in range(table.n_rows) if whole[row]]
    identical = {f.row for f in identical_rows(table)}
    found = {("identical-rows", row) for row in identical}
    for row in alive:
        if not of[row]:
            found.add(("dead-row", row))
            continue
        equal = [r for r in alive if whole[r] == whole[row]]
        if equal[0] != row:
            found |= {("equal-row", row)} if row not in identical else set()
        elif any(whole[row] < whole[r] for r in alive):
            found.add(("subsumed-row", row))
        elif of[row] <= frozenset().union(*(of[r] for r in alive if r not in equal)):
            found.add(("redundant-row", row))
    priorities, specific = table.priorities.tolist(), specificities(table, policy)
    for row in alive:
        before = [r for r in alive if r < row]
        if policy != "first":
            before = [r for r in alive if (priorities[r], specific[r]) > (priorities[row], specific[row])]
        if (
            policy in ("first", "priority", "specific", "cheapest")
            and of[row]
            and of[row] <= frozenset().union(*(of[r] for r in before))
        ):
            found.add(("never-chosen", row))
        if policy == "unique" and any(of[row] & of[r] for r in alive if r < row):
            found.add(("policy-overlap", row))
    return found


@examples(6)
@given(SEEDS, st.sampled_from(["collect", "first", "priority", "unique", "cheapest"]))
def test_every_finding_is_right_and_none_is_missing(seed, policy):
    brute, report = made(seed, policy)
    assert report.findings_complete
    told = [f for f in (*report.findings, *report.needless) if f.rule != "variety"]
    assert {(f.rule, f.row) for f in told} == expected_findings(brute, policy)
    for finding in told:
        if finding.rule in ("subsumed-row", "redundant-row", "never-chosen"):
            assert all(set(finding.by) & rows for rows in brute.valid if finding.row in rows)
            assert finding.row not in finding.by


@pytest.mark.parametrize("job", [{"once": "Rest"}, {"cooldown_s": "Rest"}, {"cooldown_turns": "Rest"}])
def test_a_row_has_its_turn_while_the_one_that_comes_before_it_rests(job):
    rests = {"Rest": ["True" if "once" in job else "8", ""]}
    table = cdb.Table.from_columns(
        {"Asset": ["look_round", "idle"], "Priority": ["1", ""], **rests, "speed": ["<1", "<1"]},
        schema={"speed": {"type": "number", "min": 0, "max": 9}},
        settings={"policy": "priority", "priority": "Priority", **job},
    )
    compiled = table.compile()
    matches, picker = compiled.query({"speed": 0.0}), compiled.picker()
    assert [picker.pick(matches, time_s=0.0).asset for _ in range(2)] == ["look_round", "idle"]
    outer = cdb.Table.from_columns({"Asset": ["@inner"], "hurt": ["Any"]}, schema={"hurt": {"type": "bool"}})
    for one in (table, outer.flat({"inner": table})):
        assert "never-chosen" not in {finding.rule for finding in cdb.coverage(one).findings}
    always = table.with_cells([(0, "Rest", "")])
    assert "never-chosen" in {finding.rule for finding in cdb.coverage(always).findings}


@examples(6)
@given(SEEDS)
def test_under_specific_a_row_is_not_redundant_for_rows_that_it_outranks(seed):
    brute, report = made(seed, "specific")
    expected, table = expected_findings(brute, "specific"), brute.table
    ranks = list(zip(table.priorities.tolist(), specificities(table, "specific"), strict=True))
    of = [frozenset(i for i, rows in enumerate(brute.valid) if row in rows) for row in range(table.n_rows)]
    told = {(f.rule, f.row): f for f in (*report.findings, *report.needless) if f.rule != "variety"}
    assert told.keys() <= expected
    for rule, row in expected - told.keys():
        assert rule in NEEDLESS
        assert of[row] <= frozenset().union(*(of[r] for r in range(table.n_rows) if ranks[r] < ranks[row]))
    for finding in told.values():
        if finding.rule in NEEDLESS:
            assert not all(ranks[r] < ranks[finding.row] for r in finding.by)
            assert finding.level == "info"
        elif finding.rule == "never-chosen":
            assert all(ranks[r] > ranks[finding.row] for r in finding.by)
            assert ("more specific" in finding.message) == (len({specificity for _, specificity in ranks}) > 1)


@examples(6)
@given(SEEDS, st.sampled_from(["collect", "first", "priority", "unique", "specific", "cheapest"]), st.integers(1, 4))
def test_variety_is_said_once_of_rows_that_share_their_contexts_and_only_where_several_may_play(seed, policy, n_assets):
    table = random_table(random.Random(seed), policy)
    for row in range(table.n_rows):
        table = table.with_cell(row, "Asset", f"A{row % n_assets}" if n_assets < 4 else f"A{row}")
    brute = Brute(table, random_boxes(random.Random(seed), table))
    report = coverage(table, impossible=brute.impossible, samples=0)
    groups = [f for f in report.findings if f.rule == "variety"]
    rules = {f.rule for f in report.findings if f.level == "warning"}
    assert not (groups and policy in ("first", "unique"))
    assert rules.isdisjoint(NEEDLESS) or policy in ("first", "unique") or n_assets < 4, "only one asset twice is a warning"
    valid = {row: frozenset(i for i, rows in enumerate(brute.valid) if row in rows) for row in range(table.n_rows)}
    for group in groups:
        assert group.level == "info"
        if "same contexts" in group.message:
            assert all(valid[row] == valid[group.row] for row in group.by)
        elif "only where this row" in group.message:
            assert all(valid[row] <= valid[group.row] for row in group.by)
    named = [row for group in groups for row in (group.row, *group.by)]
    assert {f.row for f in report.needless} <= set(named)


@examples(2)
@given(SEEDS)
def test_changing_the_cells_of_the_nearest_row_closes_the_gap(seed):
    brute, report = made(seed)
    for gap in report.gaps:
        if gap.nearest and gap.nearest.n_changes == 1:
            closed = Brute(brute.table.with_cell(gap.nearest.row, gap.nearest.condition, gap.nearest.cell), brute.impossible)
            assert all(rows for rows, flag in zip(closed.valid, closed.inside(gap.cells), strict=True) if flag)


@examples(2)
@given(SEEDS)
def test_no_row_needs_fewer_or_smaller_changes_than_the_nearest_and_no_earlier_one_as_small(seed):
    table = random_table(random.Random(seed), most_rows=12)
    space = Space.of(data_of(table.compile()))
    for gap in coverage(table, samples=0).gaps:
        if not space.boxes:
            assert gap.nearest is None
            continue
        box = space.box({c.name: parse_cell(gap.cells[c.name], c.domain) for c in space.conditions if c.name in gap.cells})
        i, failing = nearest_row(space, box)
        assert (gap.nearest.row, gap.nearest.n_changes) == (space.rows[i], len(failing))


@examples(1)
@given(SEEDS)
def test_samples_lie_in_the_space_and_give_the_same_report_twice(seed):
    table = random_table(random.Random(seed), most_rows=20)
    one, two = (coverage(table, seed=seed, samples=500, work=3) for _ in range(2))
    assert one == two
    assert one.to_json() == two.to_json()


def test_a_space_has_the_enabled_rows_that_accept_something():
    table = random_table(random.Random(7))
    space = Space.of(data_of(table.compile()))
    assert set(space.rows) <= set(range(table.n_rows))
