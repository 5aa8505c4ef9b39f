"""Coverage, check, diff and evaluate of random projects say what trying every context gives; asked as users ask them."""

import csv
import itertools
import random
import tempfile
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from hypothesis import given
from hypothesis import strategies as st
from random_projects import DOMAINS, Facts, RandomProject, Row, changed_project, date_text, is_inside, random_project
from running import run
from strategies import examples

import contextdb as cdb

SEEDS = st.integers(0, 2**32)
NEVER = ("dead-row", "shut-out-row", "empty-cell", "outside-domain", "never-true")
"""Rules that say of a row that it is valid in no context that can happen, or in none of the declared values and bounds."""


@contextmanager
def written(*projects: RandomProject) -> Iterator[list[Path]]:
    """Folders with the projects."""
    with tempfile.TemporaryDirectory() as folder:
        yield [project.write(Path(folder) / str(i)) for i, project in enumerate(projects)]


def drawn(seed: int) -> RandomProject:
    return random_project(random.Random(seed))


def facts_inside(project: RandomProject, cells: dict[str, str]) -> list[bool] | None:
    """Which contexts lie in a box; None where it has a rule for a cell."""
    return None if "When" in cells else [is_inside(facts, cells) for facts, _ in project.contexts]


@examples(3)
@given(SEEDS)
def test_the_covered_share_is_that_of_every_context_that_can_happen(seed: int):
    project = drawn(seed)
    with written(project) as (folder,):
        report = cdb.coverage(cdb.Project.load(folder)["outer"], samples=20_000)
    if not project.is_measurable or not sum(share for _, share in project.contexts):
        return
    covered = project.share([bool(rows) for rows in project.valid])
    assert report.certain[0] - 1e-9 <= covered <= report.certain[1] + 1e-9
    if report.method == "exact":
        assert abs(report.covered - covered) < 1e-9
    else:  # a 99 % interval, and as much again on each side
        width = report.upper - report.lower
        assert report.lower - width <= covered <= report.upper + width


@examples(3)
@given(SEEDS)
def test_gaps_hold_no_context_of_a_row_some_that_can_happen_and_together_all_that_have_none(seed: int):
    project = drawn(seed)
    with written(project) as (folder,):
        report = cdb.coverage(cdb.Project.load(folder)["outer"], samples=5_000)
    if not project.contexts:
        return  # that assumptions over other facts than those of rows contradict each other is not known where boxes cannot tell
    inside = [facts_inside(project, gap.cells) for gap in report.gaps]
    for gap, flags in zip(report.gaps, inside, strict=True):
        if flags is not None:
            assert not any(flag and rows for flag, rows in zip(flags, project.valid, strict=True)), gap.cells
            assert any(flags), gap.cells
    if report.gaps_complete and None not in inside:
        for at, rows in enumerate(project.valid):
            assert rows or any(flags[at] for flags in inside), project.contexts[at]


# ---- check


def valid_of(project: RandomProject, rows: Sequence[Row]) -> set[int]:
    """The contexts that can happen in which some of the rows is valid."""
    return {at for at, (facts, _) in enumerate(project.contexts) if any(project.is_valid(row, facts) for row in rows)}


@examples(3)
@given(SEEDS)
def test_what_check_finds_of_rows_is_true_of_every_context(seed: int):
    project = drawn(seed)
    with written(project) as (folder,):
        found = run("check", folder, "--format", "json").json["findings"]
    assert not [f for f in found if f["rule"] in ("unreadable", "unreadable-cell", "bad-assumption")], found
    ways = {row: [way for way in project.rows if way[0] == ("outer", row)] for row in range(project.outer.n_rows)}
    for finding in (f for f in found if f["table"] == "outer" and f["row"] is not None):
        rule, own = finding["rule"], ways[finding["row"]]
        valid, by = valid_of(project, own), [way for row in finding["by"] for way in ways.get(row, ())]
        if len(own) != 1 or own[0][0] != own[-1]:
            continue  # a row that names a table: its findings are about rows of that table
        if rule in NEVER:
            assert not valid, finding
        elif rule in ("subsumed-row", "redundant-row", "never-chosen"):
            assert valid <= valid_of(project, by), finding
        elif rule in ("equal-row", "identical-rows"):
            assert valid == valid_of(project, by[:1]), finding
        elif rule == "policy-overlap":
            assert all(valid & valid_of(project, [way]) for way in by), finding
    if project.derived or project.outer.rules or not project.contexts:
        return  # what is computed is known to draws alone
    never = {finding["row"] for finding in found if finding["table"] == "outer" and finding["rule"] in NEVER}
    for row, own in ways.items():
        if own == [(("outer", row),)] and is_enabled(project, row) and not valid_of(project, own):
            assert row in never, (row, found)


def is_enabled(project: RandomProject, row: int) -> bool:
    """Whether a row of the outer table is switched on."""
    return project.outer.columns.get("Enabled", ["True"] * (row + 1))[row] != "False"


# ---- evaluate


@examples(2)
@given(SEEDS)
def test_evaluate_gives_in_each_line_what_query_gives(seed: int):
    project, rng = drawn(seed), random.Random(seed)
    contexts = [facts for facts, _ in rng.sample(project.contexts, min(20, len(project.contexts)))]
    with written(project) as (folder,):
        table = cdb.Project.load(folder)["outer"].compile()
        names = list(table.asked)
        for facts in contexts:
            rows = [at for at, row in enumerate(project.rows) if project.is_valid(row, facts)]
            assert table.query({name: facts[name] for name in names}).indices.tolist() == rows
        if not contexts or not names:
            return
        with (folder / "contexts.csv").open("w", newline="", encoding="utf-8") as file:
            writer = csv.writer(file)
            writer.writerow(names)
            writer.writerows([as_text(name, facts[name]) for name in names] for facts in contexts)
        result = run("evaluate", folder / "outer.csv", folder / "contexts.csv", "--out", folder / "answers.csv")
        assert result.code == 0, result.err
        with (folder / "answers.csv").open(newline="", encoding="utf-8") as file:
            answers = list(csv.DictReader(file))
    for facts, answer in zip(contexts, answers, strict=True):
        rows = [str(at) for at, row in enumerate(project.rows) if project.is_valid(row, facts)]
        assert (answer["count"], answer["rows"]) == (str(len(rows)), " ".join(rows)), facts


@examples(2)
@given(SEEDS)
def test_query_says_the_valid_rows_and_of_every_other_what_fails(seed: int):
    project, rng = drawn(seed), random.Random(seed)
    with written(project) as (folder,):
        names = list(cdb.Project.load(folder)["outer"].compile().asked)
        for at in rng.sample(range(len(project.contexts)), min(5, len(project.contexts))):
            facts = [f"{name}={as_text(name, project.contexts[at][0][name])}" for name in names]
            result = run("query", folder / "outer.csv", *facts, "--explain", "--json", "--most", "1000")
            assert result.code in (0, 1), result.err
            assert {row["row"] for row in result.json["matches"]} == project.valid[at]
            others = {row["row"]: row["failures"] for row in result.json["explain"]}
            assert set(others) == set(range(len(project.rows))) - project.valid[at]
            assert run("query", folder / "outer.csv", *facts, "--explain").code == result.code


def as_text(name: str, fact: object) -> str:
    """A fact as a file of contexts has it."""
    if DOMAINS[name].kind == "date":
        return date_text(fact)
    if isinstance(fact, frozenset):
        return " ".join(sorted(fact)) or '""'
    return f'"{fact}"' if isinstance(fact, str) else str(fact)


# ---- diff


@examples(2)
@given(SEEDS)
def test_diff_says_which_contexts_an_asset_gains_and_loses_and_which_gaps_open_and_close(seed: int):
    before = drawn(seed)
    after = changed_project(random.Random(seed), before)
    with written(before, after) as folders:
        result = run("diff", *(folder / "outer.csv" for folder in folders), "--json")
    assert result.code in (0, 1), result.err
    found = result.json
    effects = found["effects"]
    if effects is None or "unknown" in effects or found["rows"]["renamed"]:
        return
    is_plain = not (before.derived or before.assume or before.outer.rules)
    is_exact = is_plain and all((effects["covered"][side] or {}).get("method") == "exact" for side in ("before", "after"))
    is_nested = len(before.used) + len(after.used) > 2  # then assets have the path of their tables before them
    contexts = joint_contexts(before, after)
    was, now = (
        (lambda facts, asset=None: is_played(before, facts, asset)),
        (lambda facts, asset=None: is_played(after, facts, asset)),
    )
    for reach in effects["assets"] if not is_nested else ():
        for boxes, has, has_not in ((reach["gained"], now, was), (reach["lost"], was, now)):
            changed = [facts for facts in contexts if has(facts, reach["asset"]) and not has_not(facts, reach["asset"])]
            require_boxes(boxes["boxes"], changed, contexts, is_exact)
    for boxes, has, has_not in ((effects["gaps"]["opened"], was, now), (effects["gaps"]["closed"], now, was)):
        changed = [facts for facts in contexts if has(facts) and not has_not(facts)]
        require_boxes(boxes, changed, contexts, is_exact and effects["gaps"]["complete"])
    touched = {reach["asset"] for reach in effects["assets"]}
    if effects["assets_left_out"] == 0 and is_exact and not is_nested:
        for asset in {before.asset(row) for row in before.rows} | {after.asset(row) for row in after.rows}:
            assert asset in touched or all(was(facts, asset) == now(facts, asset) for facts in contexts), asset


def joint_contexts(before: RandomProject, after: RandomProject) -> list[Facts]:
    """Contexts that can happen in both, of which each has a value that the cells of either tell apart."""
    values = {
        name: {value: None for project in (before, after) for value, _ in project.values.get(name, ())}
        for name in dict.fromkeys((*before.named, *after.named))
    }
    chosen = (dict(zip(values, one, strict=True)) for one in itertools.islice(itertools.product(*values.values()), 20_000))
    whole = (before.complete(facts) for facts in chosen)
    return [facts for facts in whole if before.can_happen(facts) and after.can_happen(facts)]


def is_played(project: RandomProject, facts: Facts, asset: str | None = None) -> bool:
    """Whether a row of an asset, or any row, is valid."""
    return any(project.is_valid(row, facts) for row in project.rows if asset is None or project.asset(row) == asset)


def require_boxes(boxes: list[dict[str, Any]], changed: list[Facts], contexts: list[Facts], is_whole: bool) -> None:
    """That boxes hold just the contexts that changed; only those that are in them, where boxes may be missing."""
    cells = [box["cells"] for box in boxes]
    if any(name not in DOMAINS for box in cells for name in box):
        return  # a rule
    for facts in contexts:
        held = [box for box in cells if is_inside(facts, box)]
        assert not held or facts in changed, (held, facts)
        assert held or not is_whole or facts not in changed, (cells, facts)
