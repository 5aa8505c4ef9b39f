"""Tables learned from recorded pairs: hidden rows come out again, wrong pairs are exceptions, and random assets are nothing."""

from __future__ import annotations

import random
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import polars as pl
import pytest
from hypothesis import given
from hypothesis import strategies as st
from running import run
from strategies import examples, some

from contextdb.columns import TextColumn
from contextdb.exchange.learned import Learned, learned
from contextdb.exchange.mapping import propose
from contextdb.exchange.reading import Reading
from contextdb.schema.settings import EMPTY, TableSettings, conditions_from_dict
from contextdb.tables.table import Table

RANGES = {"speed": (0.0, 8.0), "height": (0.0, 3.0), "dir": (-180.0, 180.0)}
VALUES = {"gait": ["Walk", "Run", "Half Way"], "hit": [False, True]}
SCHEMA = {
    "speed": {"type": "number", "min": 0, "max": 8},
    "height": {"type": "number", "min": 0, "max": 3},
    "dir": {"type": "angle"},
    "gait": {"type": "enum", "values": VALUES["gait"]},
    "hit": {"type": "bool"},
    "time": {"type": "number"},
}


@dataclass
class Hidden:
    """Rows that share no context and leave none out."""

    boxes: list[dict[str, object]]

    @classmethod
    def of(cls, rng: random.Random, n_rows: int) -> Hidden:
        boxes: list[dict[str, object]] = [{}]
        while len(boxes) < n_rows:
            box = boxes.pop(rng.randrange(len(boxes)))
            name = rng.choice([*RANGES, "speed", *VALUES])
            if name in VALUES:
                values = box.get(name, VALUES[name])
                parts = [values[:1], values[1:]] if len(values) > 1 else []  # type: ignore[arg-type, index]
            else:
                low, high = box.get(name, RANGES[name])  # type: ignore[misc]
                cut = round(low + (high - low) * rng.uniform(0.3, 0.7), 1)
                is_wide = high - low > (RANGES[name][1] - RANGES[name][0]) / 6
                parts = [(low, cut), (cut, high)] if is_wide else []
            boxes += [box | {name: part} for part in parts] or [box]
        return cls(boxes)

    def labels(self, facts: Mapping[str, np.ndarray]) -> np.ndarray:
        labels = np.full(len(facts["speed"]), -1)
        for number, box in enumerate(self.boxes):
            inside = np.ones(len(labels), np.bool_)
            for name, side in box.items():
                inside &= np.isin(facts[name], side) if name in VALUES else (facts[name] >= side[0]) & (facts[name] < side[1])
            labels[inside] = number
        return labels


def recorded(seed: int, n_pairs: int) -> dict[str, np.ndarray]:
    rng = np.random.default_rng(seed)
    facts = {name: rng.uniform(low, high, n_pairs).round(4) for name, (low, high) in RANGES.items()}
    facts |= {name: np.array(values, object)[rng.integers(0, len(values), n_pairs)] for name, values in VALUES.items()}
    return facts | {"time": np.arange(n_pairs) / 30.0}


def learned_from(facts: Mapping[str, np.ndarray], labels: np.ndarray) -> Learned:
    columns = [TextColumn.of(name, map(str, values.tolist())) for name, values in facts.items()]
    columns.append(TextColumn.of("played", [f"clip_{label}" if label >= 0 else "" for label in labels]))
    reading = Reading(tuple(columns), "csv")
    schema = replace(EMPTY, conditions=conditions_from_dict(SCHEMA))
    mapped = propose(reading, schema, TableSettings("t", asset="played"))
    return learned(reading, mapped, schema)


def table_of(result: Learned) -> Table:
    return Table.from_columns({c.name: c.to_list() for c in result.reading.columns}, SCHEMA, {"asset": "played"})


def share_right(result: Learned, facts: Mapping[str, np.ndarray], labels: np.ndarray) -> float:
    """The share of moments in which the table has the asset, and no other."""
    compiled = table_of(result).compile()
    named = {condition.name for condition in compiled.conditions}
    many = compiled.query_many({name: values.tolist() for name, values in facts.items() if name in named})
    assets = [set(many[i].assets) for i in range(len(labels))]
    return float(np.mean([own == {f"clip_{label}"} for own, label in zip(assets, labels, strict=True)]))


@pytest.mark.parametrize(("noise", "least"), some([(0.01, 0.99), (0.0, 0.998)]))
def test_thirty_hidden_rows_come_out_of_20000_pairs(noise, least):
    hidden, facts = Hidden.of(random.Random(1), 30), recorded(1, 20_000)
    labels, rng = hidden.labels(facts), np.random.default_rng(2)
    is_wrong = rng.random(len(labels)) < noise
    result = learned_from(facts, np.where(is_wrong, rng.integers(0, 30, len(labels)), labels))
    assert result.is_worth_it
    assert result.reading.n_rows == 30
    assert result.idle == ("time",)
    assert (result.n_exceptions == 0) is (noise == 0.0)
    assert result.held_out >= least - noise
    new = recorded(3, 2_000)
    assert share_right(result, new, hidden.labels(new)) >= least
    assert share_right(result, facts, labels) == 1.0 or noise


@examples(0.4)
@given(st.integers(0, 2**32))
def test_without_noise_the_table_says_what_was_recorded_but_for_its_exceptions(seed):
    rng = random.Random(seed)
    n_rows = rng.randint(2, 6)
    hidden, facts = Hidden.of(rng, n_rows), recorded(seed % 1000, 1_500)
    labels = hidden.labels(facts) % rng.randint(2, n_rows)  # an asset may have several rows
    result = learned_from(facts, labels)
    assert result.n_pairs == len(labels)
    right = round(share_right(result, facts, labels) * len(labels))
    assert right == len(labels) - result.n_exceptions
    assert result.n_exceptions <= 3
    assert result.reading.n_rows <= 2 * n_rows


@examples(0.3)
@given(st.integers(0, 2**32))
def test_random_assets_are_nothing_to_learn(seed):
    facts = recorded(seed % 1000, 1_500)
    assert not learned_from(facts, np.random.default_rng(seed).integers(0, 8, 1_500)).is_worth_it


def test_a_moment_without_an_asset_or_a_fact_is_left_out():
    facts = recorded(1, 500)
    labels = (facts["speed"] > 4).astype(int)
    facts["hit"] = np.where(np.arange(500) < 5, "", facts["hit"].astype(str))
    result = learned_from(facts, np.where(np.arange(500) >= 490, -1, labels))
    assert (result.n_pairs, result.n_missing) == (485, 15)
    assert [column.to_list() for column in result.reading.columns[1:]] in ([["..4)", "4.."]], [["4..", "..4)"]])


def recording(folder: Path) -> Path:
    facts = recorded(1, 2_000)
    tags = [" ".join(word for word, is_in in (("Hot", t % 2 < 1), ("Wet", t % 3 < 1)) if is_in) or '""' for t in facts["time"]]
    played = np.where(np.char.find(tags, "Hot") >= 0, "burn", np.where(facts["dir"].astype(float) > 90, "left", "ahead"))
    pl.DataFrame({"dir": facts["dir"], "state": tags, "played": played}).write_csv(folder / "log.csv")
    (folder / "contextdb.toml").write_text(
        '[conditions.dir]\ntype = "angle"\n[conditions.state]\ntype = "tags"\nvalues = ["Hot", "Wet"]\n'
    )
    return folder / "log.csv"


def test_the_command_writes_a_table_that_answers_as_the_recording(tmp_path):
    log = recording(tmp_path)
    result = run("import", log, tmp_path / "moves.csv", "--learn", "--asset", "played")
    assert (result.code, result.err.splitlines()[0]) == (0, f"{log}: 2,000 pairs of facts and an asset.")
    rows = sorted((tmp_path / "moves.csv").read_text().splitlines()[1:])
    assert [row.rpartition(",")[2] for row in rows] == ["-Hot", "+Hot", "-Hot"]
    assert run("query", tmp_path / "moves.csv", "dir=100", "state=Wet", "--json").json["matches"][0]["asset"] == "left"


def test_without_a_file_the_table_is_printed(tmp_path, monkeypatch):
    log = recording(tmp_path)
    monkeypatch.chdir(tmp_path)
    result = run("import", log, "--learn", "--asset", "played")
    assert result.code == 0
    assert result.lines[0] == "played,dir,state"
    assert len(result.lines) == 4
    assert not (tmp_path / "learned.csv").exists()


def test_nothing_to_learn_is_exit_code_1_and_writes_nothing(tmp_path):
    rng = np.random.default_rng(0)
    pl.DataFrame({"x": rng.random(500), "played": rng.choice(["a", "b"], 500)}).write_csv(tmp_path / "log.csv")
    result = run("import", tmp_path / "log.csv", tmp_path / "t.csv", "--learn", "--asset", "played")
    assert result.code == 1
    assert "Nothing to learn" in result.err
    assert not (tmp_path / "t.csv").exists()


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (["--learn"], "--learn needs --asset COLUMN"),
        (["--asset", "played"], "--asset needs --learn"),
        ([], "DST is missing"),
        (["--learn", "--asset", "playd"], 'Did you mean "played"?'),
    ],
)
def test_what_is_missing_is_said(tmp_path, options, words):
    log = recording(tmp_path)
    result = run("import", log, *options)
    assert result.code == 2
    assert words in result.err
