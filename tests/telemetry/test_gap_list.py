"""One list of gaps, by volume and by recorded moments: held to a loop over every moment and every context of a grid."""

import json
import random
from dataclasses import replace

import polars as pl
import pytest
from strategies import some

from contextdb.cells.grammar import parse_cell
from contextdb.covering import coverage
from contextdb.covering.assumed import opened
from contextdb.covering.gaps import gap_id
from contextdb.covering.report import Gap
from contextdb.report import formats, render
from contextdb.report.coverage_results import CoverageResults, Measured
from contextdb.schema.settings import TableSettings
from contextdb.tables.table import Table
from contextdb.telemetry import observe
from contextdb.telemetry.seen_gaps import ranked

SCHEMA = {
    "steps": {"type": "int", "min": 0, "max": 5},
    "mode": {"type": "enum", "values": ["CB", "FS", "SS"]},
    "air": {"type": "bool"},
    "tags": {"type": "tags", "values": ["A", "A.B", "C"]},
}
CELLS = {"steps": ["Any", "0..2", "3", "not 1..4", "5"], "mode": ["Any", "CB", "CB FS", "not SS"], "air": ["Any", "True", "False"]}
CELLS["tags"] = ["Any", "Any", "+A", "-A.B +C", "not +A.B"]
TAGS = [(), ("A",), ("A.B",), ("C",), ("A", "C"), ("A.B", "C")]
"""A set for each answer that cells can get: A.B is an A too."""
MODES = ("CB", "FS", "SS")
CONTEXTS = [{"steps": s, "mode": m, "air": a, "tags": t} for s in range(6) for m in MODES for a in (False, True) for t in TAGS]


def drawn(seed: int, assume: tuple[str, ...] = ()) -> Table:
    rng = random.Random(seed)
    columns = {"Asset": [f"a{i}" for i in range(3)]} | {
        name: [rng.choice(cells) for _ in range(3)] for name, cells in CELLS.items()
    }
    return Table.from_columns(columns, SCHEMA, TableSettings("t", assume=assume), name="t")


def holds(table: Table, cells: dict[str, str], context: dict[str, object]) -> bool:
    domains = {c.condition.name: c.condition.domain for c in table.conditions}
    return all(parse_cell(text, domains[name]).holds(context[name]) for name, text in cells.items())


def is_possible(context: dict[str, object], assume: tuple[str, ...]) -> bool:
    return not assume or not (context["air"] and context["mode"] == "SS")


@pytest.mark.parametrize("assume", [(), ('not (air and mode == "SS")',)])
@pytest.mark.parametrize("max_gaps", [1, 50])
@pytest.mark.parametrize("seed", some(range(25), 5))
def test_every_share_of_the_list_is_what_counting_finds(tmp_path, seed, max_gaps, assume):
    table = drawn(seed, assume)
    moments = random.Random(seed + 100).choices(CONTEXTS, k=30)
    pl.DataFrame(moments).write_parquet(tmp_path / "a.parquet")
    report = coverage(table, max_gaps=max_gaps)
    seen = observe(table, tmp_path / "a.parquet", known=report.gaps)
    found = ranked(report, opened(table), seen, 10**6, 10**4)
    possible = [context for context in CONTEXTS if is_possible(context, assume)]
    before: list[Gap] = []
    for gap in found.gaps:
        assert gap.telemetry == pytest.approx(sum(holds(table, gap.cells, m) for m in moments) / 30)
        inside = [c for c in possible if holds(table, gap.cells, c)]
        new = [c for c in inside if not any(holds(table, g.cells, c) for g in before)]
        if not any("tags" in other.cells for other in found.gaps):  # sets of tags do not all weigh the same
            assert gap.share == pytest.approx(len(inside) / len(possible))
            assert gap.new_share == pytest.approx(len(new) / len(possible), abs=1e-12)
        before.append(gap)
    keys = [(gap.telemetry, gap.share) for gap in found.gaps]
    assert keys == sorted(keys, reverse=True)
    assert {gap.id for gap in report.gaps} <= {gap.id for gap in found.gaps}
    is_open = [not len(table.compile().query(m)) for m in moments]
    assert is_open == [any(holds(table, gap.cells, m) for gap in found.gaps) for m in moments]


def test_gaps_that_hold_no_moment_come_last_with_none(tmp_path):
    table = Table.from_columns({"Asset": ["a"], "steps": ["0..1 | 4"]}, SCHEMA, name="t")
    pl.DataFrame({"steps": [1, 5, 5]}).write_parquet(tmp_path / "a.parquet")
    cells = [{"steps": "2..3"}, {"steps": "5"}]
    gaps = tuple(Gap(gap_id(c), share, share, c) for c, share in zip(cells, (1 / 3, 1 / 6), strict=True))
    report = replace(coverage(table), gaps=gaps)
    seen = observe(table, tmp_path / "a.parquet", known=report.gaps)
    found = ranked(report, opened(table), seen, 10**6, 10**4)
    assert [(gap.text, gap.telemetry) for gap in found.gaps] == [("steps: 5", pytest.approx(2 / 3)), ("steps: 2..3", 0.0)]


def test_a_table_with_rules_is_observed_as_it_is_queried(tmp_path):
    columns = {"Asset": ["a", "b"], "steps": ["0..2", "Any"], "mode": ["Any", "CB"], "when": ["air", "steps > 3"]}
    table = Table.from_columns(columns, SCHEMA, TableSettings("t", when="when"), name="t")
    pl.DataFrame(CONTEXTS).write_parquet(tmp_path / "a.parquet")
    report = coverage(table)
    seen = observe(table, tmp_path / "a.parquet", known=report.gaps)
    many = table.compile().query_many(pl.DataFrame(CONTEXTS))
    assert seen.hits == tuple(many.hits.tolist())
    assert seen.uncovered == int((many.counts == 0).sum())
    assert [gap.id for gap in ranked(report, opened(table), seen, 10**6, 10**4).gaps] == [gap.id for gap in report.gaps]


def test_every_format_tells_a_gap_with_its_share_of_the_moments(tmp_path):
    table = Table.from_columns({"Asset": ["a"], "steps": ["0..1"], "air": ["True"]}, SCHEMA, name="t")
    pl.DataFrame({"steps": [1] * 7 + [4], "air": [False] * 7 + [True]}).write_parquet(tmp_path / "a.parquet")
    report = coverage(table)
    seen = observe(table, tmp_path / "a.parquet", known=report.gaps)
    found = Measured(ranked(report, opened(table), seen, 10**6, 10**4), None, ("a",), (2,), telemetry=seen)
    told = {name: render(name, CoverageResults((found,))) for name in formats("coverage")}
    head = "      share    moments  contexts without a valid row, and what would play\n"
    assert f"{head}   1  50.00 %  87.50 %  air: False: nothing plays; a (line 2) would, with " in told["text"]
    assert "| 1 | 50.00 % | 87.50 % | air: False: nothing plays; a (line 2) would, with " in told["markdown"]
    assert '<td class="n" data-v="87.5">87.50 %</td>' in told["html"]
    assert "(50.00 % of the contexts, 87.50 % of the recorded moments; gap " in told["sarif"]
    assert "(50.00 %25 of the contexts, 87.50 %25 of the recorded moments; gap " in told["github"]
    assert "gap: air: False (87.50 % of the recorded moments)\n" in told["junit"]
    (entry,) = json.loads(told["json"])["tables"]
    assert [gap["telemetry"] for gap in entry["gaps"]["items"]] == [0.875, 0.125]
    assert seen.headline in told["text"]
