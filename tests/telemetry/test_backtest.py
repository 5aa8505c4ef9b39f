"""What a change would have done to recorded moments: as asking both versions moment by moment says, however files are cut."""

import json
import random
import tempfile
from collections import Counter
from pathlib import Path

import polars as pl
import pytest
from hypothesis import given
from hypothesis import strategies as st
from random_projects import DOMAINS, RandomProject, changed_project, date_text, random_project
from running import run
from strategies import examples

import contextdb as cdb
from contextdb.compiled.choosing import Choosing
from contextdb.compiled.table import CompiledTable, data_of
from contextdb.errors import PolicyError

Moments = list[dict[str, object]]


def recorded(project: RandomProject, changed: RandomProject, rng: random.Random) -> Moments:
    """A few contexts that both versions can be asked with."""
    names = dict.fromkeys((*project.values, *changed.values))
    pools = {name: [v for v, _ in (*project.values.get(name, ()), *changed.values.get(name, ()))] for name in names}
    return [{name: written(name, rng.choice(pool)) for name, pool in pools.items()} for _ in range(40)]


def written(name: str, value: object) -> object:
    kind = DOMAINS[name].kind
    if kind == "date":
        return date_text(value)
    return sorted(value) if kind == "tags" else int(value) if kind == "int" else value


def answer(compiled: CompiledTable, context: dict[str, object]) -> tuple[list[tuple[str, int]], list[tuple[str, int]] | None]:
    """The valid rows, and those that the policy may pick; a row by its asset and how many rows before it have that."""
    matches = compiled.query(context, unknown="never")
    times: Counter[str] = Counter()
    keys = []
    for asset in compiled.assets:
        keys.append((asset, times[asset]))
        times[asset] += 1
    valid = [keys[row] for row in matches.indices.tolist()]
    if "cheapest" in data_of(compiled).policies:
        return sorted(valid), None
    try:
        candidates = data_of(compiled).once(Choosing.of).candidates(matches).tolist()
    except PolicyError:
        return sorted(valid), None
    return sorted(valid), sorted(keys[row] for row in candidates)


@examples(3)
@given(st.integers(0, 2**32))
def test_sums_are_those_of_asking_both_versions_moment_by_moment(seed: int):
    rng = random.Random(seed)
    project = random_project(rng)
    changed = changed_project(rng, project)
    moments = recorded(project, changed, rng)
    if not moments[0]:
        return
    with tempfile.TemporaryDirectory() as folder:
        root = Path(folder)
        before, after = (p.write(root / name) / "outer.csv" for name, p in (("a", project), ("b", changed)))
        pl.DataFrame(moments, infer_schema_length=None).write_parquet(root / "m.parquet")
        there = run("diff", before, after, "--telemetry", root / "m.parquet", "--json")
        back = run("diff", after, before, "--telemetry", root / "m.parquet", "--json")
        same = run("diff", before, before, "--telemetry", root / "m.parquet", "--json")
        old, new = (cdb.load(path).flat().compile() for path in (before, after))
        answers = [(answer(old, moment), answer(new, moment)) for moment in moments]
    sums = there.json["backtest"]
    assert sums["moments"] == len(moments)
    assert sums["emptied"] == sum(bool(a) and not b for (a, _), (b, _) in answers)
    assert sums["filled"] == sum(bool(b) and not a for (a, _), (b, _) in answers)
    certain = sum(a != b or (None not in (c, d) and c != d) for (a, c), (b, d) in answers)
    unsure = sum(a == b and None in (c, d) for (a, c), (b, d) in answers)
    assert certain <= sums["changed"] <= certain + unsure
    gains, loses = Counter[str](), Counter[str]()
    for (a, _), (b, _) in answers:
        was, now = {asset for asset, _ in a}, {asset for asset, _ in b}
        gains.update(now - was)
        loses.update(was - now)
    assert {e["asset"]: (e["gains"], e["loses"]) for e in sums["by_asset"]} == {a: (gains[a], loses[a]) for a in {*gains, *loses}}
    turned = back.json["backtest"]
    assert (turned["changed"], turned["emptied"], turned["filled"]) == (sums["changed"], sums["filled"], sums["emptied"])
    assert {e["asset"]: (e["loses"], e["gains"]) for e in turned["by_asset"]} == {
        e["asset"]: (e["gains"], e["loses"]) for e in sums["by_asset"]
    }
    assert same.json["backtest"] == {
        "moments": len(moments), "changed": 0, "emptied": 0, "filled": 0, "by_asset": [], "boxes": [], "examples": []
    }  # fmt: skip


@pytest.fixture
def versions(tmp_path: Path) -> Path:
    """Two versions of a table, and moments: of 8 one is left without a row, and two more have another one."""
    for name, rows in (("a", "walk,..5\nrun,5..\nidle,..1\n"), ("b", "walk,..5\nrun,6..\nidle,..2\n")):
        (tmp_path / name).mkdir()
        (tmp_path / name / "contextdb.toml").write_text('[conditions.speed]\ntype = "number"\nmin = 0\nmax = 10\n[tables.t]\n')
        (tmp_path / name / "t.csv").write_text(f"Asset,speed\n{rows}")
    (tmp_path / "m.csv").write_text("speed,times\n0.5,2\n1.5,1\n1.7,1\n3,1\n5.5,1\n8,2\n")
    return tmp_path


def diff(folder: Path, *more: str | Path):
    return run("diff", folder / "a" / "t.csv", folder / "b" / "t.csv", *more)


def test_a_recording_says_what_changes_where_and_which_moments_to_open(versions: Path):
    sums = diff(versions, "--telemetry", versions / "m.csv", "--count", "times", "--json").json["backtest"]
    assert [sums[key] for key in ("moments", "changed", "emptied", "filled")] == [8, 3, 1, 0]
    assert sums["by_asset"] == [{"asset": "idle", "gains": 2, "loses": 0}, {"asset": "run", "gains": 0, "loses": 1}]
    first, *others = sums["boxes"]
    assert (first["what"], first["cells"], first["moments"]) == ("emptied", {"speed": "(5..6)"}, 1)
    assert [(box["what"], box["asset"], box["moments"]) for box in others] == [("gains", "idle", 2), ("loses", "run", 1)]
    example = sums["examples"][0]
    assert (example["what"], example["line"], example["before"], example["after"]) == ("emptied", 6, ["run"], [])
    assert example["context"] == {"speed": "5.5"}


@pytest.mark.parametrize(
    ("bars", "code"),
    [
        ([], 1),
        (["--max-changed", "40"], 0),
        (["--max-changed", "37.5", "--max-emptied", "12.5"], 0),
        (["--max-changed", "37"], 1),
        (["--max-emptied", "12"], 1),
    ],
)
def test_with_a_bar_only_the_bars_decide(bars: list[str], code: int, versions: Path):
    assert diff(versions, "--telemetry", versions / "m.csv", "--count", "times", *bars).code == code


def test_bars_about_moments_need_moments(versions: Path):
    result = diff(versions, "--max-emptied", "1")
    assert (result.code, "--max-emptied is about recorded moments" in result.err) == (2, True)
    (versions / "none.csv").write_text("speed\n")
    assert diff(versions, "--telemetry", versions / "none.csv", "--max-emptied", "100").code == 1


def test_another_fallback_is_a_change_where_no_row_is_valid(versions: Path):
    for name, asset in (("a", "idle"), ("b", "wait")):
        (versions / name / "t.csv").write_text("Asset,speed\nwalk,..1\n")
        toml = versions / name / "contextdb.toml"
        toml.write_text(f"{toml.read_text()}fallback = '{asset}'\n")
    sums = diff(versions, "--telemetry", versions / "m.csv", "--json").json["backtest"]
    assert (sums["changed"], sums["emptied"], sums["by_asset"]) == (5, 0, [])


def test_dask_gives_the_same_sums(versions: Path):
    pytest.importorskip("distributed")
    (versions / "m2.csv").write_text("speed,times\n5.7,3\n")
    arguments = ("--telemetry", versions / "m*.csv", "--count", "times", "--json")
    assert json.loads(diff(versions, *arguments, "--engine", "dask").out) == json.loads(diff(versions, *arguments).out)


def test_the_sums_of_characters_are_those_of_their_moments_alone(versions: Path):
    rng = random.Random(0)
    rows = [(rng.choice(["ann", "bob", "Größe"]), round(rng.uniform(0, 10), 1), i / 2) for i in range(400)]
    for name in ("all", "ann", "bob", "Größe"):
        own = [row for row in rows if name in ("all", row[0])]
        pl.DataFrame(own, schema=["who", "speed", "at"], orient="row").write_csv(versions / f"{name}.csv")
    a, b = versions / "a" / "t.csv", versions / "b" / "t.csv"
    options = ("--character", "who", "--time", "at", "--json")
    whole = run("diff", a, b, "--telemetry", versions / "all.csv", *options).json["backtest"]
    assert len(whole["characters"]["items"]) == 3
    minutes = 0.0
    for item in whole["characters"]["items"]:
        alone = run("diff", a, b, "--telemetry", versions / f"{item['character']}.csv", "--json").json["backtest"]
        assert {key: item[key] for key in ("moments", "changed", "emptied", "filled")} == {
            key: alone[key] for key in ("moments", "changed", "emptied", "filled")
        }
        times = [at for who, _, at in rows if who == item["character"]]
        assert item["minutes"] == pytest.approx((max(times) - min(times)) / 60)
        minutes += item["minutes"]
    assert whole["characters"]["per_minute"]["emptied"] == pytest.approx(whole["emptied"] / minutes)
    text = run("diff", a, b, "--telemetry", versions / "all.csv", "--character", "who", "--time", "at")
    assert "per character and minute" in text.out


def test_a_column_that_there_is_not_is_refused_with_the_nearest(versions: Path):
    result = run("diff", versions / "a" / "t.csv", versions / "b" / "t.csv", "--telemetry", versions / "m.csv", "--time", "time")
    assert result.code == 2
    assert 'there is no column "time"' in result.err
    assert 'Did you mean "times"?' in result.err
