"""The picker: picks of one character and of many, remembered, held to an oracle turn by turn."""

import copy
import pickle
import random
import tempfile
from collections import Counter
from itertools import pairwise
from pathlib import Path

import numpy as np
import pick_oracle as oracle
import pytest
from hypothesis import given
from hypothesis import strategies as st

import contextdb as cdb
from contextdb.compiled import picker as picker_module
from contextdb.compiled.choosing import Choosing, nothing_picked
from contextdb.compiled.pick import Outcome, pick_row
from contextdb.compiled.table import CompiledTable, data_of
from contextdb.errors import ContextError, PolicyError
from contextdb.schema.settings import TableSettings
from contextdb.tables.table import Table


def way_of(compiled: CompiledTable, row: int | None) -> oracle.Path | None:
    return None if row is None or row < 0 else tuple((step.table, step.row) for step in compiled.way(row))


def columns_of(facts: list[oracle.Facts]) -> dict[str, list[object]]:
    return {name: [one[name] for one in facts] for name in oracle.CELLS}


def again(picker, how: str):
    if how == "pickled":
        return pickle.loads(pickle.dumps(picker))
    return {"as it is": lambda p: p, "copied": copy.copy, "deep": copy.deepcopy}[how](picker)


# ---- held to the oracle


@given(st.data(), oracle.tables(), st.integers(-3, 2**70), st.integers(0, 4))
def test_characters_pick_what_the_oracle_picks_turn_by_turn(data, tables: oracle.Tables, seed: int, memory: int):
    compiled = tables.compile()
    picker = compiled.picker(seed, memory)
    ids = [0, 1, 2, -7, 10**12]
    characters = {who: oracle.Character(seed % 2**64, who, memory) for who in ids}
    time = 0.0
    for _ in range(8):
        how = data.draw(st.sampled_from(["many", "many", "alone", "reload", "pickled", "copied", "deep", "forget"]))
        time += data.draw(st.sampled_from([0.0, 0.5, 1.0, 1.5]))
        time_s = time if tables.needs_time else data.draw(st.sampled_from([None, time]))
        if how == "reload":
            tables = oracle.edited(data.draw, tables)
            compiled = tables.compile()
        elif how == "forget":
            who = data.draw(st.sampled_from(ids))
            picker.forget(who)
            characters[who].recent, characters[who].picked = [], {}
        elif how not in ("many", "alone"):
            kept, picker = picker, again(picker, how)
            kept.forget()
        else:
            who = data.draw(st.just([0, 1, 2]) | st.lists(st.sampled_from(ids), min_size=1, unique=True))
            facts = [data.draw(oracle.FACTS) for _ in who]
            expected = [picked_by(characters[one], tables, own, time) for one, own in zip(who, facts, strict=True)]
            if how == "many":
                assert_many(compiled, picker, who, facts, expected, time_s)
            else:
                assert_alone(compiled, picker, who, facts, expected, time_s)
            refused = how == "many" and any(new is None for new, _ in expected)
            for one, (new, _) in zip(who, expected, strict=True):
                characters[one] = characters[one] if refused or new is None else new


def picked_by(
    character: oracle.Character, tables: oracle.Tables, facts: oracle.Facts, time: float
) -> tuple[oracle.Character | None, oracle.Path | None]:
    """The character after a turn, and what it picks; None where the policy refuses."""
    new = copy.deepcopy(character)
    try:
        return new, new.pick(tables, facts, time)
    except oracle.NotUnique:
        return None, None


def assert_many(compiled: CompiledTable, picker, who, facts, expected, time_s) -> None:
    many = compiled.query_many(columns_of(facts))
    if any(new is None for new, _ in expected):
        with pytest.raises(PolicyError, match="at once"):
            picker.pick_many(many, who=who, time_s=time_s)
        return
    rows = picker.pick_many(many, who=who, time_s=time_s)
    assert [way_of(compiled, row) for row in rows.tolist()] == [way for _, way in expected]


def assert_alone(compiled: CompiledTable, picker, who, facts, expected, time_s) -> None:
    for one, own, (new, way) in zip(who, facts, expected, strict=True):
        matches = compiled.query(own)
        if new is None:
            with pytest.raises(PolicyError, match="at once"):
                picker.pick(matches, who=one, time_s=time_s)
            continue
        pick = picker.pick(matches, who=one, time_s=time_s)
        assert way_of(compiled, pick.row) == way
        assert pick.asset == (compiled.fallback if way is None else compiled.assets[pick.row])
        assert pick.why
        assert bool(pick) == (pick.asset is not None)


@given(oracle.tables(), oracle.FACTS)
def test_the_outcome_and_the_stateless_pick_know_what_the_policies_may_pick(tables: oracle.Tables, facts: oracle.Facts):
    compiled = tables.compile()
    matches = compiled.query(facts)
    outcome = Outcome(data_of(compiled), matches)
    try:
        expected = oracle.possible(tables, facts)
    except oracle.NotUnique:
        assert outcome.refusal is not None
        return
    assert [way_of(compiled, row) for row in outcome.candidates.tolist()] == expected
    rng = random.Random(3)
    rows = {row for _ in range(40) if (row := pick_row(data_of(compiled), matches, rng, "")) is not None}
    assert rows <= set(outcome.candidates.tolist())
    assert bool(rows) == bool(expected)
    assert all(outcome.said_of([row]) for row in matches.rows.tolist())
    for row in matches.rows.tolist():
        assert outcome.said_of([row]).startswith("picked") == (row in outcome.candidates)
    assert sum(outcome.chances.values()) == pytest.approx(1.0 if expected else 0.0)


@given(oracle.tables(), oracle.FACTS, st.integers(0, 3))
def test_a_compiled_file_picks_as_its_table(tables: oracle.Tables, facts: oracle.Facts, seed: int):
    compiled = tables.compile()
    with tempfile.TemporaryDirectory() as folder:
        compiled.save(Path(folder) / "picks.safetensors")
        opened = CompiledTable.open(Path(folder) / "picks.safetensors")
        _ = opened.version
    one, other = compiled.picker(seed, 2), opened.picker(seed, 2)
    for turn in range(4):
        found = [outcome(picker, table, facts, 0.7 * turn) for picker, table in ((one, compiled), (other, opened))]
        assert found[0] == found[1]


def outcome(picker, table: CompiledTable, facts: oracle.Facts, time_s: float) -> object:
    try:
        pick = picker.pick(table.query(facts), time_s=time_s)
    except PolicyError as error:
        return str(error)
    return pick.row, pick.asset, pick.why


# ---- chance


def test_chance_is_the_same_everywhere_and_for_one_and_many():
    known = [oracle.uniform(0, 0, 0, 0), oracle.uniform(7, 3, 2, 1), oracle.uniform(2**64 - 1, -5, 10**12, 0)]
    assert known == [0.13870941014555427, 0.3263417356334446, 0.07240612029416893]  # a replay of last year must stay what it was
    n_rows, who = 4096, [0, 1, -5, 2**62]
    table = table_of(x=["Any"] * n_rows, asset=[f"a{row}" for row in range(n_rows)])
    many = table.query_many({"x": [True] * len(who)})
    for seed in (0, 1, 2**64 - 1):
        picker = table.picker(seed, memory=0)
        for turn in range(3):
            expected = [int(oracle.uniform(seed, one, turn, 0) * n_rows) for one in who]
            assert picker.pick_many(many, who=who).tolist() == expected


def table_of(policy: str = "collect", fallback: str | None = None, **columns: list[str]) -> CompiledTable:
    """Rows that are all valid where `x` is True; further columns by the names of their jobs, and conditions."""
    n_rows = len(next(iter(columns.values())))
    assets = columns.pop("asset", [chr(ord("a") + row) for row in range(n_rows)])
    jobs = {name: name for name in columns if name in ("priority", "weight", "once", "cooldown_s", "cooldown_turns")}
    conditions = {name: {"type": "bool"} for name in ("x", "y", "z")}
    texts = {"asset": assets, "x": ["Any"] * n_rows, **columns}
    settings = TableSettings("t", policy=policy, fallback=fallback, **jobs)  # type: ignore[arg-type]
    return Table.from_columns(texts, conditions, settings, "t").compile()


WEIGHTS = {"a": 1.0, "b": 2.0, "c": 4.0, "d": 0.5}
NO_MEMORY = table_of(weight=[str(weight) for weight in WEIGHTS.values()])


def chi_square(seen: Counter, expected: dict) -> float:
    n = sum(seen.values())
    return sum((seen[key] - n * share) ** 2 / (n * share) for key, share in expected.items())


@pytest.mark.parametrize("how", ["one character", "many characters", "many turns"])
def test_picks_follow_the_weights(how: str):
    picker = NO_MEMORY.picker(5, memory=0)
    if how == "one character":
        matches = NO_MEMORY.query({"x": True})
        rows = [picker.pick(matches).row for _ in range(6000)]
    elif how == "many characters":
        rows = picker.pick_many(NO_MEMORY.query_many({"x": [True] * 6000})).tolist()
    else:
        many = NO_MEMORY.query_many({"x": [True] * 60})
        rows = [row for _ in range(100) for row in picker.pick_many(many).tolist()]
    shares = {i: weight / sum(WEIGHTS.values()) for i, weight in enumerate(WEIGHTS.values())}
    assert (
        chi_square(Counter(rows), shares) < 16.3
    )  # 3 degrees of freedom: exceeded once in a thousand seeds, and this seed is fixed


def test_what_a_character_picks_next_does_not_hang_on_its_last_pick_or_on_its_neighbour():
    table = table_of(x=["Any"] * 4)
    many, picker = table.query_many({"x": [True] * 2000}), table.picker(1, memory=0)
    turns = [picker.pick_many(many) for _ in range(4)]
    pairs = [Counter(zip(one.tolist(), two.tolist(), strict=True)) for one, two in pairwise(turns)]
    pairs.append(Counter(zip(turns[0][::2].tolist(), turns[0][1::2].tolist(), strict=True)))
    shares = {(one, two): 1 / 16 for one in range(4) for two in range(4)}
    assert all(chi_square(seen, shares) < 37.7 for seen in pairs)  # 15 degrees of freedom, once in a thousand seeds


def test_seeds_and_characters_pick_differently_and_each_the_same_again():
    table = table_of(x=["Any"] * 5)
    matches = table.query({"x": True})

    def picks(seed: int, who: int) -> list[int]:
        picker = table.picker(seed)
        return [picker.pick(matches, who=who).row for _ in range(12)]

    assert picks(1, 0) == picks(1, 0)
    assert len({tuple(picks(seed, who)) for seed in range(4) for who in range(4)}) == 16


def test_a_character_picks_the_same_whoever_is_asked_with_it_and_in_whatever_order():
    table = table_of(x=["Any"] * 5)
    few, more = table.picker(3), table.picker(3)
    for _ in range(5):
        alone = few.pick_many(table.query_many({"x": [True] * 2}), who=[9, 4]).tolist()
        among = more.pick_many(table.query_many({"x": [True] * 4}), who=[1, 4, 7, 9]).tolist()
        assert alone == [among[3], among[1]]


def test_runs_of_very_different_length_are_drawn_a_part_at_a_time(monkeypatch):
    weights = [str(1 + row % 7) for row in range(70)]
    table = table_of(x=["True"] * 69 + ["Any"], y=["True"] * 40 + ["Any"] * 30, weight=weights)
    rng = random.Random(1)
    many = table.query_many({name: [rng.random() < 0.5 for _ in range(60)] for name in "xy"})
    alone = table.picker(5, 0)
    expected = [-1 if (row := alone.pick(one, who=i).row) is None else row for i, one in enumerate(many)]
    assert table.picker(5, 0).pick_many(many).tolist() == expected
    monkeypatch.setattr(picker_module, "MOST_PAIRS", 200)
    assert table.picker(5, 0).pick_many(many).tolist() == expected


# ---- memory


def test_a_reload_does_not_make_a_character_repeat_itself():
    older, newer = table_of(asset=["a", "b"], x=["Any"] * 2), table_of(asset=["new", "b", "a"], x=["Any"] * 3)
    for seed in range(20):
        picker = older.picker(seed, 2)
        before = {picker.pick(older.query({"x": True})).asset for _ in range(2)}
        assert before == {"a", "b"}
        assert picker.pick(newer.query({"x": True})).asset == "new"


# ---- rows that rest


def test_resting_rows_are_not_valid_for_the_policy():
    table = table_of("unique", once=["True", "False"], y=["Any", "Any"])
    with pytest.raises(PolicyError, match='2 rows of "t" are valid at once'):
        table.picker().pick(table.query({"x": True, "y": True}))
    table = table_of("priority", priority=["5", "1"], once=["True", ""])
    picker = table.picker()
    assert [picker.pick(table.query({"x": True})).asset for _ in range(3)] == ["a", "b", "b"]


def test_two_rows_of_one_asset_rest_apart_and_stay_apart_after_a_reload():
    older = table_of("first", asset=["a", "a"], once=["True", "True"], x=["Any", "Any"])
    newer = table_of("first", asset=["new", "a", "a"], once=["True"] * 3, x=["Any"] * 3)
    picker = older.picker()
    assert picker.pick(older.query({"x": True})).row == 0
    assert [picker.pick(newer.query({"x": True})).row for _ in range(3)] == [0, 2, None]


def test_a_table_inside_rests_as_a_row_and_its_rows_rest_wherever_they_are_picked():
    conditions = {"x": {"type": "bool"}}
    inner = Table.from_columns(
        {"asset": ["one", "two"], "x": ["Any"] * 2, "Once": ["True", ""]},
        conditions,
        TableSettings("inner", once="Once", policy="first"),
    )
    outer = Table.from_columns(
        {"asset": ["@inner", "@inner"], "x": ["Any", "Any"], "Rest": ["1", ""]},
        conditions,
        TableSettings("outer", cooldown_turns="Rest", policy="first"),
        "outer",
    )
    compiled = outer.compile({"inner": inner})
    picker = compiled.picker()
    rows = [picker.pick(compiled.query({"x": True})).row for _ in range(4)]
    assert [way_of(compiled, row) for row in rows] == [
        (("outer", 0), ("inner", 0)),
        (("outer", 1), ("inner", 1)),
        (("outer", 0), ("inner", 1)),
        (("outer", 1), ("inner", 1)),
    ]


# ---- policies


def test_conditions_count_by_their_weight_and_equal_sums_are_equal():
    conditions = {"x": {"type": "bool", "weight": 0.1}, "y": {"type": "bool", "weight": 0.2}, "z": {"type": "bool", "weight": 0.3}}
    columns = {"asset": ["xy", "z", "x"], "x": ["True", "", "True"], "y": ["True", "", ""], "z": ["", "True", ""]}
    table = Table.from_columns(columns, conditions, TableSettings("t", policy="specific")).compile()
    facts = {"x": True, "y": True, "z": True}
    assert Outcome(data_of(table), table.query(facts)).candidates.tolist() == [0, 1]
    assert data_of(table).picking.specificities is not None
    assert data_of(table).picking.specificities.tolist() == [0.3, 0.3, 0.1]


def test_outcomes_say_what_the_policies_went_by():
    facts = {"x": True, "y": True}

    def said(table: CompiledTable) -> list[str]:
        outcome = Outcome(data_of(table), table.query(facts))
        return [outcome.said_of([row]) for row in table.query(facts).rows.tolist()]

    assert said(table_of("specific", x=["True", "Any"], y=["True", "True"])) == ["picked", "outranked by a (specificity 2)"]
    assert said(table_of("cheapest", y=["False ~2", "Any"])) == ["outranked by b (penalty 0)", "picked"]
    assert said(table_of("cheapest", y=["False ~2", "Any"], priority=["1", "0"])) == ["picked", "outranked by a (priority 1)"]


# ---- why


def test_a_pick_says_why():
    facts = {"x": True, "y": True}

    def told(table: CompiledTable, n: int = 1, memory: int = 1, **more: object) -> str:
        picker = table.picker(1, memory)
        return [picker.pick(table.query(facts | more)).why for _ in range(n)][-1]

    three = table_of(y=["Any"] * 3, weight=["1", "1", "3"])
    assert told(three, memory=0) in ("chance 20 % of 3", "chance 60 % of 3")
    assert told(three, 2) in ("chance 50 % of 2", "chance 75 % of 2", "chance 25 % of 2")
    assert told(table_of(y=["Any"] * 2), 2) == "picked least lately"
    assert told(table_of("priority", y=["Any"] * 2, priority=["1", "5"])) == "highest priority 5"
    assert told(table_of("collect", y=["Any"] * 3, priority=["1", "5", "5"])) == "highest priority 5, chance 50 % of 2"
    assert told(table_of("first", y=["Any"] * 2)) == "first valid row"
    assert told(table_of("unique", y=["True", "False"])) == "only valid row"
    assert told(table_of("specific", y=["Any", "True"])) == "most specific: 1"
    assert told(table_of("cheapest", y=["False ~2", "False ~0.5"])) == "least penalty 0.5"
    assert told(table_of(y=["False"], fallback="idle")) == "fallback: no row is valid"
    assert told(table_of(y=["False"])) == "no row is valid"
    assert told(table_of(y=["Any"], weight=["0"], fallback="idle")) == "fallback: every valid row has weight 0"
    assert told(table_of(y=["Any"], once=["True"], fallback="idle"), 2) == "fallback: every valid row rests"
    assert told(table_of(y=["Any", "Any"], once=["True", ""], weight=["1", "0"]), 2) == "every valid row rests or has weight 0"
    assert told(table_of(y=["Any", "Any"], weight=["1", "0"])) == "only valid row that can be picked"


def test_a_pick_in_a_table_inside_says_where_its_policy_chose():
    conditions = {"x": {"type": "bool"}}
    inner = Table.from_columns({"asset": ["one", "two"], "x": ["Any"] * 2}, conditions, TableSettings("inner", policy="first"))
    columns = {"asset": ["walk", "@inner"], "x": ["Any", "Any"], "P": ["0", "3"]}
    outer = Table.from_columns(columns, conditions, TableSettings("outer", priority="P"), "outer").compile({"inner": inner})
    pick = outer.picker().pick(outer.query({"x": True}))
    assert (pick.asset, pick.why) == ("outer/inner/one", "highest priority 3, first valid row of inner")


# ---- what is given


def test_the_time_is_asked_for_where_rows_rest_for_seconds():
    table = table_of(x=["Any"], cooldown_s=["1"])
    picker = table.picker()
    with pytest.raises(
        ContextError, match='rows of the table "t" rest for seconds after they were picked, and time_s is not given'
    ):
        picker.pick(table.query({"x": True}))
    with pytest.raises(ContextError, match="time_s is not given"):
        picker.pick_many(table.query_many({"x": [True]}))
    for time in (float("nan"), float("inf"), "now", 1j, 10**5000):
        with pytest.raises(ContextError, match=r"time_s is .* Accepted: a number from -1e\+15"):
            picker.pick(table.query({"x": True}), time_s=time)
    none = table_of(x=["Any"], cooldown_s=[""])
    assert none.picker().pick(none.query({"x": True}))


def test_a_time_that_goes_back_is_refused_where_rows_rest_for_seconds():
    table = table_of(x=["Any"], cooldown_s=["1"])
    picker, matches, many = table.picker(), table.query({"x": True}), table.query_many({"x": [True]})
    assert picker.pick(matches, time_s=5.0)
    then = pickle.loads(pickle.dumps(picker))
    assert picker.pick(matches, time_s=12.5)
    with pytest.raises(ContextError, match=r"time_s is 12\.0, and this picker last picked at 12\.5: .* or forget\(\)"):
        picker.pick(matches, time_s=12.0)
    with pytest.raises(ContextError, match="time_s is 12"):
        picker.copy().pick_many(many, time_s=12.0)
    assert then.pick(matches, time_s=12.0), "the copy from then goes on from then"
    picker.forget()
    assert picker.pick(matches, time_s=0.0)


def test_a_refused_pick_counts_for_nobody():
    table = table_of("unique", y=["True", "Any"])
    picker, other = table.picker(3), table.picker(3)
    with pytest.raises(PolicyError, match="valid at once"):
        picker.pick_many(table.query_many({"x": [True] * 2, "y": [False, True]}))
    assert picker.pick_many(table.query_many({"x": [True], "y": [False]})).tolist() == [1]
    assert other.pick_many(table.query_many({"x": [True], "y": [False]})).tolist() == [1]
    assert picker._picked.turns.tolist()[:1] == other._picked.turns.tolist()[:1]


def test_no_contexts_and_no_rows_give_nothing():
    table = table_of(x=["Any"])
    assert table.picker().pick_many(table.query_many({"x": []})).tolist() == []
    empty = table_of(fallback="idle", x=[])
    assert empty.picker().pick(empty.query({"x": True})).asset == "idle"
    assert empty.picker().pick_many(empty.query_many({"x": [True] * 2})).tolist() == [-1, -1]


# ---- actors, outputs, what a pick is


ROLES = Table.from_columns(
    {"Asset": ["tackle", "dive"], "Defender.near": ["True", "Any ~2"], "Mandatory_Slots": ["Defender", "Defender"]},
    {"Defender.near": {"type": "bool"}},
    TableSettings("roles", outputs=("Mandatory_Slots",), policy="cheapest"),
).compile()


def test_actors_are_cast_for_the_pick():
    actors = {"Defender": [{"id": 1, "near": False}, {"id": 2, "near": True}]}
    pick = ROLES.picker().pick(ROLES.query({}, actors=actors))
    assert pick.asset in ("tackle", "dive")
    assert pick.casting["Defender"]["id"] in (1, 2)
    far = {"Defender": [{"id": 1, "near": False}]}
    assert ROLES.pick({}, actors=far, rng=1) == "dive"
    assert ROLES.picker().pick(ROLES.query({}, actors=far)).casting == {"Defender": far["Defender"][0]}
    many = ROLES.query_many({}, actors=[actors, far])
    alone = ROLES.picker(2)
    assert ROLES.picker(2).pick_many(many).tolist() == [alone.pick(many[i], who=i).row for i in range(2)]


def test_a_pick_is_a_value_that_can_be_kept():
    table = table_of(asset=["walk"], x=["Any"])
    pick = table.picker().pick(table.query({"x": True}))
    kept = pickle.loads(pickle.dumps(pick))
    assert (kept, kept.why, kept.casting, kept.outputs, bool(kept)) == (pick, "only valid row", {}, {}, True)
    assert repr(pick) == repr(kept) == "<Pick: row 0, walk; only valid row>"
    assert {pick: 1}[kept] == 1
    with pytest.raises(AttributeError):
        pick.row = 3
    nothing = table.picker().pick(table_of(x=["False"]).query({"x": True}))
    assert (bool(nothing), nothing.row, nothing.asset, repr(nothing)) == (False, None, None, "<Pick: None; no row is valid>")


def test_a_picker_is_told_in_a_line():
    picker = table_of(x=["Any"]).picker(4, 2)
    assert repr(picker) == '<Picker of "t": seed 4, memory 2, 0 characters>'
    assert (picker.table, picker.seed, picker.memory) == ("t", 4, 2)


def test_a_picker_is_small_in_a_pickle():
    table = table_of(x=["Any"] * 200)
    picker = table.picker()
    picker.pick_many(table.query_many({"x": [True] * 100}))
    assert len(pickle.dumps(picker)) < 20_000


def test_a_picker_forgets_rests_that_are_over_and_stays_small():
    table = table_of(x=["Any"] * 300, cooldown_turns=["5"] * 300)
    many, picker = table.query_many({"x": [True] * 1000}), table.picker()
    for _ in range(30):
        picker.pick_many(many)
    assert (picker._picked.rests >= 0).sum(axis=1).max() <= 6
    assert picker._picked.rests.shape[1] <= 12
    assert len(pickle.dumps(picker)) < 60_000
    unpickled = pickle.loads(pickle.dumps(picker))
    for _ in range(3):
        assert unpickled.pick_many(many).tolist() == picker.pick_many(many).tolist()


def test_arrays_that_are_not_those_of_one_table_and_its_characters_are_refused():
    data = data_of(table_of(x=["Any"] * 70, once=["True"] * 70))
    choosing = data.once(Choosing.of)
    assets, columns = np.arange(70), np.arange(70)
    choices = choosing.choices(assets, columns, 70)
    masks, one, none = np.full((1, 2), 2**6 - 1, np.uint64), np.zeros(1, np.int64), nothing_picked()
    assert choices.pick(masks, one, one, 0, 0.0, none, None, one.copy(), None) is None
    for wrong in ((masks, one + 1, one + 1), (masks[:, :1], one, one), (masks, np.zeros(2, np.int64), one)):
        with pytest.raises(ValueError, match=r"together|contiguous"):
            choices.pick(*wrong, 0, 0.0, none, None, one.copy(), None)
    with pytest.raises(ValueError, match="costs"):
        choices.pick(masks, one, one, 0, 0.0, none, np.zeros((1, 3)), one.copy(), None)
    for rows in (np.array([70]), np.array([-2])):
        with pytest.raises(ValueError, match="together"):
            choices.remember(one, rows, 0.0, none)
    for wrong_columns in (columns - 1, columns + 1):
        with pytest.raises((ValueError, IndexError)):
            choosing.choices(assets, wrong_columns, 70)
    with pytest.raises(ValueError, match="together"):
        choosing.choices(assets[:-1], columns, 70)


def test_live_contexts_are_picked_from():
    table = table_of("cheapest", y=["True ~2", "False ~1"])
    live, picker = table.live({"x": True, "y": True}), table.picker()
    assert picker.pick(live.matches()).asset == "a"
    live["y"] = False
    assert picker.pick(live.matches()).asset == "b"


def test_the_stateless_pick_leaves_rests_aside():
    table = table_of(asset=["hello"], once=["True"])
    assert [table.pick({"x": True}) for _ in range(3)] == ["hello"] * 3


def test_pickers_are_public_types():
    assert cdb.Picker.__name__ == "Picker"
    assert cdb.Pick.__name__ == "Pick"
