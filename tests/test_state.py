"""State that is kept: answers and their versions, copies, pickles, mappings. It answers the same, or says why it cannot."""

import copy
import multiprocessing
import pickle
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

import numpy as np
import oracles
import pytest
import strategies
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, initialize, rule
from strategies import for_each

import contextdb as cdb
from contextdb import motion
from contextdb.compiled.casting.roles import roles_of_table
from contextdb.compiled.live import LiveContext
from contextdb.compiled.table import CompiledTable, data_of
from contextdb.schema.settings import TableSettings
from contextdb.tables.table import Table

SPEED = {"speed": {"type": "number"}, "is_hurt": {"type": "bool"}}
TABLE = Table.from_columns(
    {"Asset": ["walk", "run", "limp"], "speed": ["0..2", "2..9", "0..3"], "is_hurt": ["Any", "False", "True"]}, SPEED, name="moves"
)
MOVES = TABLE.compile()
FACTS = {"speed": 1.0, "is_hurt": True}

RULES = Table.from_columns(
    {
        "Asset": ["near", "far", "any"],
        "gap": ["<=2", ">2", "Any ~1"],
        "gait": ["Walk", "Any", "Walk ~2.5"],
        "Defender.position": ["CB", "Any", "FS"],
        "When": ["speed > 1", "", "Defender.distance < 5"],
    },
    {
        "gap": {"type": "number", "expr": "speed - 1"},
        "speed": {"type": "number"},
        "gait": {"type": "enum", "values": ["Walk", "Run"]},
        "Defender.position": {"type": "enum", "values": ["CB", "FS"]},
        "Defender.distance": {"type": "number"},
    },
    TableSettings("rules", when="When"),
)
"""Derived facts, rules, soft cells, roles: everything that a compiled table can work out."""
RULED_FACTS = {"speed": 2.0, "gait": "Run", "Defender.position": "CB", "Defender.distance": 3.0}
ACTORS = {"Defender": [{"id": 1, "position": "CB", "distance": 4.0}, {"id": 2, "position": "FS", "distance": 2.0}]}
PLAIN = {"speed": 2.0, "gait": "Walk"}


# ---- answers of another table, of another version


def test_an_answer_of_another_version_is_refused_by_pick_with_both_versions():
    newer = TABLE.with_rows(0, [{"Asset": "die", "speed": "<0"}]).compile()
    with pytest.raises(cdb.ContextError) as caught:
        newer.pick(MOVES.query(FACTS))
    assert str(caught.value) == (
        f'the answer is of another version of "moves" (3 rows, version {MOVES.version[:8]}), this is version {newer.version[:8]} '
        "(4 rows). Accepted: an answer of this compiled table. Try to query this table again: query(facts)."
    )


def test_an_answer_of_another_table_is_refused_by_pick_with_both_names():
    other = Table.from_columns({"Asset": ["tackle"], "speed": ["Any"]}, SPEED, name="tackles").compile()
    with pytest.raises(cdb.ContextError, match=r'the answer is of the table "moves" \(3 rows\), not of "tackles" \(1 row\)'):
        other.pick(MOVES.query(FACTS))


@pytest.mark.parametrize(
    "changed",
    [
        TABLE.with_cell(0, "speed", "0..2.5"),
        TABLE.with_cell(0, "Asset", "stroll"),
        TABLE.with_rows_taken([1, 0, 2]),
        TABLE.with_rows_taken([0, 1]),
    ],
    ids=["cell", "asset", "order", "rows"],
)
def test_any_change_of_a_table_is_another_version(changed: Table):
    with pytest.raises(cdb.ContextError, match="another version"):
        changed.compile().pick(MOVES.live(FACTS).matches())


@pytest.mark.parametrize("settings", [TableSettings("t", weight="W"), TableSettings("t", policy="first"), TableSettings("t")])
def test_what_a_pick_hangs_on_is_part_of_the_version(settings: TableSettings):
    columns = {"Asset": ["a", "b"], "W": ["1", "2"]}
    plain = Table.from_columns(columns, {}, TableSettings("t", outputs=("W",)), "t").compile()
    with pytest.raises(cdb.ContextError, match="another version"):
        Table.from_columns(columns, {}, settings, "t").compile().pick(plain.query({}))


def test_the_weights_of_a_table_inside_are_part_of_the_version(tmp_path: Path):
    (tmp_path / "outer.csv").write_text("Asset\n@inner\n", encoding="utf-8")
    inner = tmp_path / "inner.csv"
    (tmp_path / "contextdb.toml").write_text('[tables.inner]\nweight = "W"\n', encoding="utf-8")
    inner.write_text("Asset,W\na,1\nb,1\n", encoding="utf-8")
    answer = cdb.load(tmp_path / "outer.csv").compile().query({})
    assert cdb.load(tmp_path / "outer.csv").compile().pick(answer) in ("outer/inner/a", "outer/inner/b")
    inner.write_text("Asset,W\na,1\nb,0\n", encoding="utf-8")
    with pytest.raises(cdb.ContextError, match="another version"):
        cdb.load(tmp_path / "outer.csv").compile().pick(answer)
    with pytest.raises(cdb.ContextError, match='the table "outer"'):
        cdb.load(inner).compile().pick(answer)


def test_the_same_table_compiled_twice_opened_or_out_of_a_pickle_takes_the_answers_of_the_first(tmp_path: Path):
    RULES.compile().save(tmp_path / "rules.safetensors")
    for same in (RULES.compile(), cdb.CompiledTable.open(tmp_path / "rules.safetensors"), again(RULES.compile())):
        assert same.pick(RULES.compile().query(RULED_FACTS), rng=1) == RULES.compile().pick(RULED_FACTS, rng=1)
        assert same.pick(again(RULES.compile().query(RULED_FACTS)), rng=1) == RULES.compile().pick(RULED_FACTS, rng=1)


@given(strategies.tables(), st.data())
def test_tables_are_of_one_version_when_they_say_the_same(table: Table, data: st.DataObject):
    again_built = Table.from_columns({c.name: c.to_list() for c in table.columns}, table.schema, table.settings)
    assert again_built.compile().version == table.compile().version
    if table.n_rows:
        row = data.draw(st.integers(0, table.n_rows - 1))
        assert table.with_cell(row, "Asset", "new").compile().version != table.compile().version


def test_a_watch_takes_answers_of_the_version_before_where_the_table_did_not_change(tmp_path: Path):
    (tmp_path / "jog.csv").write_text("Asset,speed\njog,0..2\nrun,1..9\n", encoding="utf-8")
    (tmp_path / "die.csv").write_text("Asset,speed\ndie,<0\n", encoding="utf-8")
    now = [0.0]
    with cdb.watch(tmp_path, poll_s=None, clock=lambda: now[0]) as watch:
        before = watch.snapshot()
        rng = np.random.default_rng(1)
        jog, die = before["jog"].query({"speed": 1.0}), before["die"].query({"speed": -1.0})
        last = before["jog"].pick(jog, rng)
        (tmp_path / "jog.csv").write_text("Asset,speed\ndie,<0\njog,0..2\nrun,1..9\n", encoding="utf-8")
        while watch.snapshot() is before:
            now[0] += 1.0
            watch.poll()
        assert watch["die"].pick(die) == "die"
        with pytest.raises(cdb.ContextError, match="another version"):
            watch["jog"].pick(jog)
        assert watch["jog"].pick({"speed": 1.0}, rng) != last  # what was picked is remembered over the swap
        assert (list(watch), "jog" in watch, len(watch), bool(watch)) == (["die", "jog"], True, 2, True)
        assert dict(watch.snapshot()) == dict(watch.snapshot().tables)


def test_an_answer_of_an_older_version_means_to_a_motion_search_the_assets_that_it_meant():
    features = np.arange(3, dtype=np.float32)[:, None]
    database = motion.MotionDatabase.from_features(features, [0, 1, 2], [1, 2, 3], ["walk", "run", "limp"])
    older = MOVES.query({"speed": 5.0, "is_hurt": False})
    assert older.assets == ["run"]
    newer = TABLE.with_rows(0, [{"Asset": "die"}]).compile()  # row 1 is "walk" now
    assert newer.assets[1] == "walk"
    for valid in (older, again(older), copy.copy(older), [older], older.flags):
        hits = database.search_many(np.zeros((1, 1)), valid) if isinstance(valid, list) else [database.search([0.0], valid)]
        assert [hit.asset for hit in hits] == ["run"]


# ---- slips in a live context


@pytest.mark.parametrize("name", ["sped", "Speed", "speeed"])
def test_a_misspelt_name_in_an_update_is_refused_and_nothing_is_set(name: str):
    live = MOVES.live(FACTS)
    for _ in range(2):
        with pytest.raises(cdb.ContextError) as caught:
            live.update({"is_hurt": False, name: 5.0})
        assert f'there is no condition "{name}", and "speed" is not given.' in str(caught.value)
        assert 'Did you mean "speed"?' in str(caught.value)
    assert live.facts == FACTS


def test_names_that_are_no_slips_may_stand_in_an_update():
    live = MOVES.live(FACTS)
    live.update({"speeds": 5.0, "speed": 3.0, "weather": "rain"})
    live.update([("weather", "sun"), ("speed", 2.5)])
    live.update([("wind", 3)])
    assert live.facts == {"speed": 2.5, "is_hurt": True}
    with pytest.raises(cdb.ContextError, match='"speed" is not given'):
        live.update({"speeds": 5.0})  # it was no slip beside the right name, and is one alone


def test_a_name_that_the_project_declares_is_of_another_table():
    schema = {**SPEED, "speeed": {"type": "number"}}
    live = Table.from_columns({"Asset": ["a"], "speed": ["Any"]}, schema).compile().live({"speed": 1.0, "speeed": 2.0})
    live.update({"speeed": 3.0})
    assert live.facts == {"speed": 1.0}


def test_slips_of_facts_that_only_rules_and_derived_facts_need_are_refused_too():
    live = RULES.compile().live(RULED_FACTS)
    for slip in ({"Defender.distanc": 1.0}, {"sped": 2.0}):
        with pytest.raises(cdb.ContextError, match="is not given"):
            live.update(slip)
    with pytest.raises(cdb.ContextError, match="derived"):
        live.update({"gap": 1.0})


# ---- nothing that an answer hands out can be written to


@pytest.mark.parametrize("count", [0, 1, 2, 47, 48, 49, 130])
def test_the_arrays_of_an_answer_cannot_be_written_to(count: int):
    table = Table.from_columns({"Asset": ["a"] * 130, "x": ["Any ~1"] * count + ["False"] * (130 - count)}, {"x": {"type": "bool"}})
    matches = table.compile().query({"x": True})
    assert len(matches) == count
    for array in (matches.indices, matches.mask, matches.always, matches.flags, matches.penalties):
        assert not array.flags.writeable


@pytest.mark.parametrize("actors", [None, ACTORS])
def test_the_arrays_of_many_answers_and_of_explanations_cannot_be_written_to(actors):
    compiled, given_facts = RULES.compile(), RULED_FACTS if actors is None else PLAIN
    columns = {name: [value] * 3 for name, value in given_facts.items()}
    many = compiled.query_many(columns) if actors is None else compiled.query_many(columns, actors=actors)
    explanation = compiled.explain(given_facts, actors=actors)
    for array in (many.counts, many.hits, many.mask, *many.lists(), *(m.indices for m in many), explanation._n_failures,
                  explanation._order, explanation.breaks_rule, MOVES.priorities, MOVES.row_weights):  # fmt: skip
        assert not array.flags.writeable


def test_codes_cannot_be_written_to():
    many = MOVES.query_many({name: [value] for name, value in FACTS.items()})
    assert not many.codes.flags.writeable


# ---- copies of live contexts


class Forks(RuleBasedStateMachine):
    """Live contexts and their copies, each beside the facts that it was given."""

    compiled: CompiledTable
    choices: Mapping[str, Sequence[object]]

    def __init__(self) -> None:
        super().__init__()
        self.lives: list[tuple[LiveContext, dict[str, object]]] = []

    @initialize()
    def begin(self) -> None:
        self.lives.append((self.compiled.live(), {}))

    @rule(at=st.integers(0, 5), data=st.data())
    def set_some(self, at: int, data: st.DataObject) -> None:
        live, facts = self.lives[at % len(self.lives)]
        names = data.draw(st.lists(st.sampled_from(sorted(self.choices)), max_size=4, unique=True))
        new = {name: data.draw(st.sampled_from(self.choices[name])) for name in names}
        facts |= new
        live.update(new)

    @rule(at=st.integers(0, 5), way=st.sampled_from([LiveContext.copy, copy.copy, copy.deepcopy, lambda live: again(live)]))
    def fork(self, at: int, way: Callable[[LiveContext], LiveContext]) -> None:
        live, facts = self.lives[at % len(self.lives)]
        if len(self.lives) < 5:
            self.lives.append((way(live), dict(facts)))

    @rule(at=st.integers(0, 5))
    def ask(self, at: int) -> None:
        live, facts = self.lives[at % len(self.lives)]
        assert told(live.matches) == told(lambda: self.compiled.query(facts))

    def teardown(self) -> None:
        for live, facts in self.lives:
            assert told(live.matches) == told(lambda facts=facts: self.compiled.query(facts))
            given_facts = {name: value for name, value in facts.items() if value is not None}
            assert dict(live) == {name: live[name] for name in live} == given_facts


def told(ask: Callable[[], cdb.Matches]) -> object:
    try:
        matches = ask()
    except cdb.ContextError as error:
        return str(error)
    return matches.indices.tolist(), matches.always.tolist(), matches.penalties.tolist()


def again(thing):
    return pickle.loads(pickle.dumps(thing))


class PlainForks(Forks):
    compiled = Table.from_columns(
        {"Asset": list("abc"), **{f"c{i}": ["True", "Any", "False"] for i in range(10)}, "speed": ["<2", "1..3", "Any"]},
        {**{f"c{i}": {"type": "bool"} for i in range(10)}, "speed": {"type": "number"}},
    ).compile()
    choices = {**{f"c{i}": [True, False, None] for i in range(10)}, "speed": [0.0, 1.5, 5.0, None, cdb.cell("1..2")]}  # noqa: RUF012


class RuledForks(Forks):
    compiled = RULES.compile()
    choices = {  # noqa: RUF012
        "speed": [0.5, 2.0, 5.0, None],
        "gait": ["Walk", "Run", None],
        "Defender.position": ["CB", "FS", None],
        "Defender.distance": [2.0, 9.0, None],
    }


TestForksOfAPlainTable = PlainForks.TestCase
TestForksOfATableWithRules = RuledForks.TestCase
for machine in (TestForksOfAPlainTable, TestForksOfATableWithRules):
    machine.settings = settings(strategies.examples(0.4), stateful_step_count=25)


def test_a_fork_does_not_see_what_the_original_is_told():
    names = [f"c{i}" for i in range(10)]
    table = Table.from_columns({"Asset": ["yes"], **{n: ["True"] for n in names}}, {n: {"type": "bool"} for n in names}).compile()
    live = table.live(dict.fromkeys(names, True))
    fork = copy.copy(live)
    for name in names:
        fork[name] = False
    assert (live.matches().assets, fork.matches().assets) == (["yes"], [])


@pytest.mark.parametrize("way", [copy.copy, copy.deepcopy, LiveContext.copy])
def test_a_copy_shares_the_compiled_table(way):
    live = MOVES.live(FACTS)
    assert MOVES.pick(way(live).matches(), rng=1) in ("walk", "limp")
    assert way(live).matches().table_assets is live.matches().table_assets


def test_a_copy_keeps_the_actors_and_a_deep_copy_has_its_own():
    actors = copy.deepcopy(ACTORS)
    live = RULES.compile().live(PLAIN)
    live.actors(actors)
    assert live.matches().assets == ["near", "any"]
    fork, deep = live.copy(), copy.deepcopy(live)
    fork.actors(None)
    assert live.matches().casting(0)["Defender"] is actors["Defender"][0]
    del actors["Defender"][0]
    assert live.matches().assets == ["any"]
    assert deep.matches().assets == ["near", "any"]
    assert copy.copy(live).matches().assets == again(live).matches().assets == ["any"]


# ---- pickles and copies of everything else


def asked(compiled: CompiledTable, facts: Mapping[str, object]) -> CompiledTable:
    """A table that has worked out all that it ever does."""
    compiled.query(facts)
    compiled.pick(facts)
    compiled.query_many({name: [value] for name, value in facts.items()}).hits  # noqa: B018
    compiled.explain(facts).nearest()
    compiled.live(facts).matches()
    _ = roles_of_table(data_of(compiled)), compiled.version, compiled.penalties(facts)
    return compiled


@given(strategies.tables(), st.data())
@strategies.examples(0.6)
def test_a_table_out_of_a_pickle_answers_the_same_before_and_after_it_was_asked(table: Table, data: st.DataObject):
    given_facts, plain = data.draw(strategies.contexts(table, has_missing=True, has_sets=True))
    compiled = table.compile()
    before = pickle.dumps(compiled)
    rows = oracles.rows(table, plain, "never")
    assert compiled.query(given_facts, unknown="never").indices.tolist() == rows
    for one in (pickle.loads(before), again(compiled), again(table).compile()):
        assert one.query(given_facts, unknown="never").indices.tolist() == rows
        assert told(lambda one=one: one.live(given_facts, unknown="never").matches()) == told(
            lambda: compiled.query(given_facts, unknown="never")
        )


@pytest.mark.parametrize(("table", "facts"), [(TABLE, FACTS), (RULES, RULED_FACTS)], ids=["plain", "ruled"])
def test_a_pickle_is_the_same_before_and_after_a_table_was_asked(table: Table, facts: Mapping[str, object]):
    compiled = table.compile()
    before = len(pickle.dumps(compiled))
    assert len(pickle.dumps(asked(compiled, facts))) <= 1.2 * before
    assert again(compiled).explain(facts)._n_failures.tolist() == compiled.explain(facts)._n_failures.tolist()


THINGS: dict[str, Callable[[], object]] = {
    "Table": lambda: RULES,
    "CompiledTable": lambda: asked(RULES.compile(), RULED_FACTS),
    "Matches": lambda: RULES.compile().query(RULED_FACTS),
    "Matches of sets": lambda: MOVES.query({"speed": cdb.cell("1..4"), "is_hurt": False}),
    "Matches with actors": lambda: RULES.compile().query(PLAIN, actors=ACTORS),
    "ManyMatches": lambda: RULES.compile().query_many({name: [value] for name, value in RULED_FACTS.items()}),
    "ManyMatches with actors": lambda: RULES.compile().query_many({n: [v] for n, v in PLAIN.items()}, actors=ACTORS),
    "Explanation": lambda: RULES.compile().explain(RULED_FACTS),
    "Explanation with actors": lambda: RULES.compile().explain(PLAIN, actors=ACTORS),
    "RowExplanation": lambda: RULES.compile().explain(RULED_FACTS)[0],
    "LiveContext": lambda: RULES.compile().live(RULED_FACTS),
    "Project": lambda: cdb.Project.load(samples()),
    "Snapshot": lambda: snapshot(),
    "CoverageReport": lambda: cdb.coverage(TABLE),
    "cell": lambda: cdb.cell("0..5"),
    "ContextDBError": lambda: cdb.ContextDBError("x", cdb.Fault("y")),
}


def samples() -> Path:
    return Path(__file__).parent.parent / "tables"


def snapshot() -> object:
    with cdb.watch(samples(), poll_s=None) as watch:
        return watch.snapshot()


def shown(thing: object) -> object:
    """What a thing says, in plain data."""
    if isinstance(thing, cdb.Matches):
        castings = [thing.castings(row) for row in thing.rows] if hasattr(thing, "cast") else None
        return thing.assets, thing.mask.tolist(), thing.always.tolist(), thing.penalties.tolist(), castings
    if isinstance(thing, cdb.Table):
        return thing.assets, thing.name, [c.to_list() for c in thing.columns], shown(thing.compile())
    if isinstance(thing, cdb.CompiledTable):
        return thing.version, str(thing.explain({}, unknown="any"))
    if isinstance(thing, cdb.LiveContext):
        return thing.facts, shown(thing.matches())
    if isinstance(thing, Mapping):
        return [(name, shown(value)) for name, value in thing.items()]
    if isinstance(thing, cdb.CoverageReport):
        return thing.to_json()
    return [shown(one) for one in thing] if hasattr(thing, "__getitem__") else str(thing)


@for_each(THINGS.values(), [again, copy.copy, copy.deepcopy])
def test_everything_that_is_data_is_pickled_and_copied_before_and_after_it_was_asked(make, way):
    thing = make()
    before = way(thing)
    assert shown(before) == shown(thing) == shown(way(thing)) == shown(again(way(before)))


@pytest.mark.parametrize("name", ["Table", "CompiledTable", "Project", "Snapshot", "ManyMatches"])
def test_a_copy_of_what_never_changes_is_the_thing_itself(name: str):
    thing = THINGS[name]()
    assert copy.copy(thing) is copy.deepcopy(thing) is thing


def ask_in_a_process(compiled: CompiledTable) -> tuple[cdb.Matches, str | None]:
    """Run in a process of its own."""
    return compiled.query(RULED_FACTS), compiled.pick(RULED_FACTS, rng=3)


def test_a_table_that_was_asked_goes_to_processes_that_are_spawned_and_takes_their_answers():
    compiled = asked(RULES.compile(), RULED_FACTS)
    with multiprocessing.get_context("spawn").Pool(1) as pool:
        matches, picked = pool.apply(ask_in_a_process, (compiled,))
    assert matches == compiled.query(RULED_FACTS)
    assert compiled.pick(matches, rng=3) == picked


# ---- mappings and sequences


def test_a_project_is_a_mapping_of_its_tables():
    project = cdb.Project.load(samples())
    assert isinstance(project, Mapping)
    assert list(project) == list(project.tables)
    assert ("locomotion" in project, "locmotion" in project, 0 in project, len(project)) == (True, False, False, 3)
    assert dict(project) == project.tables
    assert project.get("nothing") is None


@pytest.mark.parametrize("error", [KeyError, cdb.TableError, LookupError])
def test_a_table_that_is_not_there_is_a_key_error_that_prints_well(error):
    with pytest.raises(error) as caught:
        cdb.Project.load(samples())["locmotion"]
    assert str(caught.value).startswith('there is no table "locmotion". Accepted: "hit_mid_air",')
    assert str(again(caught.value)) == str(caught.value)


def test_a_live_context_is_a_mapping_of_the_facts_that_are_set():
    live = RULES.compile().live({**RULED_FACTS, "gait": None})
    plain = {name: value for name, value in RULED_FACTS.items() if name != "gait"}
    assert isinstance(live, Mapping)
    assert dict(live) == {**live} == plain
    assert (set(live), len(live), "gait" in live, "speed" in live, "nothing" in live) == (set(plain), 3, False, True, False)
    assert (live.get("gait", "none"), live.get("nothing")) == ("none", None)
    live["gait"] = "Run"
    assert RULES.compile().query(dict(live)) == RULES.compile().query(RULED_FACTS) == live.matches()
    assert MOVES.query(MOVES.live(FACTS)) == MOVES.query(FACTS)
    assert live.pop("gait") == "Run"
    live.clear()
    assert (len(live), bool(live)) == (0, True)
    assert live in {live}
    assert live != live.copy()


@pytest.mark.parametrize("name", ["gait", "nothing", "gap"])
def test_a_fact_that_is_not_set_is_a_key_error_that_prints_well(name: str):
    live = RULES.compile().live({"Defender.distance": 3.0})
    with pytest.raises(KeyError) as caught:
        live[name]
    assert isinstance(caught.value, cdb.ContextError)
    assert f'"{name}"' in str(caught.value)


def test_an_answer_holds_rows_and_assets():
    matches = MOVES.query(FACTS)
    assert matches.assets == ["walk", "limp"]
    assert [what for what in ("walk", "run", "nothing", 0, 1.5, None, b"walk", np.int64(2), np.ones(2), []) if what in matches] == [
        "walk"
    ]


def test_an_asset_of_a_table_inside_is_held_with_its_path_and_without(tmp_path: Path):
    (tmp_path / "outer.csv").write_text("Asset\n@inner\n", encoding="utf-8")
    (tmp_path / "inner.csv").write_text("Asset\na\n", encoding="utf-8")
    matches = cdb.load(tmp_path / "outer.csv").compile().query({})
    assert ("outer/inner/a" in matches, "a" in matches, "inner" in matches) == (True, True, False)


# ---- the answers of many contexts


@pytest.mark.parametrize("actors", [None, ACTORS])
def test_the_answers_of_many_contexts_are_a_sequence_with_actors_and_without(actors):
    compiled, moments = (
        RULES.compile(),
        [{**RULED_FACTS, "speed": float(speed), "gait": g} for speed in range(5) for g in ("Walk", "Run")],
    )
    if actors is not None:
        moments = [{name: m[name] for name in PLAIN} for m in moments]
    columns = {name: [m[name] for m in moments] for name in moments[0]}
    many = compiled.query_many(columns) if actors is None else compiled.query_many(columns, actors=actors)
    each = [compiled.query(moment, actors=actors) for moment in moments]
    assert isinstance(many, Sequence)
    assert [shown(m) for m in many] == [shown(m) for m in each] == [shown(many[i]) for i in range(len(many))]
    assert [shown(m) for m in many[2:-1]] == [shown(m) for m in each[2:-1]]
    assert shown(many[-1]) == shown(each[-1]) == shown(many[np.int64(9)])
    assert [compiled.pick(m, rng=1) for m in many] == [compiled.pick(m, rng=1) for m in each]
    assert many.counts.tolist() == [len(m) for m in each]
    assert (list(MOVES.query_many({name: [] for name in FACTS})), len(many)) == ([], 10)
    with pytest.raises(IndexError, match=r"there is no context 10 among 10 contexts\. Accepted: 0 to 9"):
        many[10]


@given(strategies.tables(least_conditions=1), st.data())
@strategies.examples(0.3)
def test_each_of_many_answers_is_that_of_a_query(table: Table, data: st.DataObject):
    compiled = table.compile()
    drawn = [data.draw(strategies.contexts(table, has_missing=True)) for _ in range(3)]
    contexts = [{name: given_facts.get(name) for name in plain} for given_facts, plain in drawn]
    many = compiled.query_many({name: [c[name] for c in contexts] for name in contexts[0]}, unknown="never")
    mask = many.mask if data.draw(st.booleans()) else None
    for context, matches in zip(contexts, many, strict=True):
        assert told(lambda matches=matches: matches) == told(lambda context=context: compiled.query(context, unknown="never"))
    assert mask is None or [m.mask.tolist() for m in many] == mask.tolist()


def test_what_soft_cells_cost_is_that_of_the_moment_of_the_question():
    table = Table.from_columns({"Asset": ["a"], "speed": ["0..2 ~3"]}, {"speed": {"type": "number"}}).compile()
    speeds = np.array([1.0, 5.0])
    many = table.query_many({"speed": speeds})
    speeds[:] = 1.0
    assert [m.penalties.tolist() for m in many] == [[0.0], [3.0]]


@pytest.mark.parametrize("fact", [cdb.cell("0..5"), "0 ± 90"])
def test_a_set_of_values_among_many_contexts_gives_the_answer_of_a_query(fact):
    many = MOVES.query_many({"speed": [1.0, fact], "is_hurt": [True, True]})
    alone = MOVES.query({"speed": fact, "is_hurt": True})
    assert (many[1], many.always[1].tolist()) == (alone, alone.always.tolist())
    assert (many.counts.tolist(), many.hits.tolist()) == ([2, len(alone)], [2, 0, 2])
