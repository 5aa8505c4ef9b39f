"""A recorded session comes back as it was, the same session gives the same bytes, and no broken file is read."""

import io
import json
import math
from dataclasses import fields, replace
from pathlib import Path

import numpy as np
import polars as pl
import pytest
from hypothesis import given
from hypothesis import strategies as st
from lines import DT, RATE, line
from strategies import IS_FULL, examples

from contextdb.errors import ArtefactError, FileError, MotionError
from contextdb.files.parquet_frame import UNSEALED, sealed
from contextdb.motion import Entry, Selector, TagFilter
from contextdb.motion.markup.left_out import LeftOut
from contextdb.motion.search.candidates import Candidate, Candidates
from contextdb.motion.search.hit import NOTHING, Hit
from contextdb.motion.selection.choice import Choice, Reason, Search, Status
from contextdb.motion.selection.controller import Controller
from contextdb.motion.selection.controller_settings import ControllerSettings
from contextdb.motion.selection.decision import Action, Decision, Playing
from contextdb.motion.selection.root_motion import RootMotion
from contextdb.motion.trace.filter_rows import filter_row
from contextdb.motion.trace.rows import TIMINGS, context_json
from contextdb.motion.trace.session import CHUNK, Trace

# ---- decisions to draw

NAMES = st.text(st.characters(exclude_categories=["Cs"]), max_size=8)
NUMBERS = st.floats(allow_nan=False)
WHOLE = st.integers(0, 2**40)
MAYBE = st.none() | NUMBERS
FACTS = st.dictionaries(NAMES, st.booleans() | st.none() | st.floats(-1e9, 1e9) | NAMES | st.lists(NAMES, max_size=2), max_size=3)
HITS = st.builds(Hit, NAMES, WHOLE, WHOLE, NUMBERS) | st.just(NOTHING)
SEARCHES = st.builds(Search, NAMES, MAYBE, st.none() | HITS, st.sampled_from(Status))
CHOICES = st.builds(Choice, HITS, st.none() | NAMES, st.sampled_from(Reason), st.lists(SEARCHES, max_size=3).map(tuple))
PLAYING = st.builds(Playing, NAMES, NAMES, WHOLE, WHOLE, NUMBERS, st.booleans())


@st.composite
def candidates(draw):
    """Some candidates: all have the same channels, as those of one database do."""
    channels = draw(st.lists(NAMES, max_size=3, unique=True))
    costs = st.lists(NUMBERS, min_size=len(channels), max_size=len(channels))
    row = st.builds(
        Candidate,
        asset=NAMES,
        range=WHOLE,
        frame=WHOLE,
        time_s=MAYBE,
        mirrored=st.booleans(),
        cost=NUMBERS,
        channels=costs.map(lambda found: dict(zip(channels, found, strict=True))),
        biases=st.dictionaries(NAMES, NUMBERS, max_size=2),
        left_out=st.sampled_from(LeftOut),
    )
    counts = draw(st.dictionaries(st.sampled_from(LeftOut), WHOLE, max_size=2))
    return Candidates(tuple(draw(st.lists(row, max_size=3))), counts, np.empty(0, np.uint8))


DECISIONS = st.builds(
    Decision,
    tick=WHOLE,
    time_s=NUMBERS,
    action=st.sampled_from(Action),
    why=NAMES,
    searched=st.booleans(),
    playing=st.none() | PLAYING,
    before=st.none() | PLAYING,
    cost=MAYBE,
    continuing_cost=MAYBE,
    choice=st.none() | CHOICES,
    context=st.none() | FACTS,
    query=st.none() | st.lists(NUMBERS, max_size=4).map(np.array),
    candidates=st.lists(st.tuples(NAMES, candidates()), max_size=2).map(tuple),
    search_us=MAYBE,
    root_motion=st.builds(RootMotion, NUMBERS, NUMBERS, NUMBERS),
    root_weight=NUMBERS,
    body=st.none() | st.tuples(NUMBERS, NUMBERS, NUMBERS),
)


def as_told(decision):
    """A decision as something to compare: arrays as lists, and of candidates all but the reason of every frame."""
    told = {field.name: getattr(decision, field.name) for field in fields(decision)}
    told["query"] = None if decision.query is None else decision.query.tolist()
    told["filters"] = [filter_row(name, chosen) for name, chosen in decision.filters]
    told["candidates"] = [(name, found.rows, found.counts) for name, found in decision.candidates]
    return told


def trace_of(decisions, **options):
    trace = Trace(**options)
    for decision in decisions:
        trace.record(decision)
    return trace


# ---- what comes back


@examples(0.6)
@given(st.lists(DECISIONS, max_size=4))
def test_a_saved_session_comes_back_as_it_was(decisions):
    trace = trace_of(decisions)
    loaded = Trace.from_bytes(trace.to_bytes())
    expected = list(map(as_told, decisions))
    assert list(map(as_told, trace)) == expected
    assert list(map(as_told, loaded)) == expected
    assert loaded.to_bytes() == trace.to_bytes()


@given(DECISIONS)
def test_without_timings_all_but_the_timings_comes_back(decision):
    loaded = Trace.from_bytes(trace_of([decision]).to_bytes(timings=False))
    assert as_told(loaded[0]) == as_told(replace(decision, search_us=None))
    assert loaded.to_bytes(timings=False) == trace_of([decision]).to_bytes(timings=False)


@given(DECISIONS)
def test_the_brief_decisions_lack_queries_and_candidates_alone(decision):
    trace = trace_of([decision])
    assert [as_told(each) for each in trace.brief()] == [as_told(replace(decision, query=None, candidates=()))]
    loaded = Trace.from_bytes(trace.to_bytes())
    assert list(map(as_told, loaded.brief())) == list(map(as_told, trace.brief()))


def still(tick):
    return Decision(tick, tick / 30.0, Action.NOTHING, "Nothing played, and nothing may play.", True, None, None)


@pytest.mark.parametrize("n", [0, 1, CHUNK - 1, CHUNK, CHUNK + 1, 3 * CHUNK + 5])
def test_decisions_are_a_sequence_wherever_the_chunks_end(n, tmp_path):
    trace = trace_of(map(still, range(n)))
    trace.save(tmp_path / "session.parquet")
    for each in (trace, Trace.load(tmp_path / "session.parquet")):
        assert [decision.tick for decision in each] == list(range(n))
        assert len(each) == n
        assert [decision.tick for decision in each[2:-1]] == list(range(n))[2:-1]
        assert [decision.tick for decision in each.brief()] == list(range(n))
        with pytest.raises(IndexError, match=f"there is no decision {n} among {n:,}"):
            each[n]


def test_an_index_below_0_counts_from_the_end():
    trace = trace_of(map(still, range(CHUNK + 3)))
    assert (trace[-1].tick, trace[-4].tick, trace[-len(trace)].tick) == (CHUNK + 2, CHUNK - 1, 0)


def test_of_a_long_session_the_last_decisions_stay_and_the_others_are_counted():
    trace = trace_of(map(still, range(107)), most=40)
    assert len(trace) == 40
    assert trace[0].tick == trace.n_forgotten == 67
    assert trace[-1].tick == 106


@pytest.mark.parametrize(("what", "number"), [("n_candidates", -1), ("n_candidates", 2.5), ("n_candidates", True), ("most", 0)])
def test_a_trace_of_no_such_size_is_refused(what, number):
    with pytest.raises(MotionError, match=f"{what} is {number!r}"):
        Trace(**{what: number})


def test_a_session_that_was_read_can_be_recorded_further():
    trace = Trace.from_bytes(trace_of(map(still, range(5))).to_bytes())
    trace.record(still(5))
    assert [decision.tick for decision in trace] == [trace[i].tick for i in range(6)] == list(range(6))
    assert trace.to_bytes() == trace_of(map(still, range(6))).to_bytes()


def test_numbers_of_numpy_are_recorded_as_numbers():
    playing = Playing("db", "walk", np.int64(1), np.int32(2), np.float32(0.5), np.bool_(True))
    decision = replace(still(np.int64(3)), cost=np.float64(0.25), playing=playing)
    (kept,) = trace_of([decision])
    assert as_told(kept) == as_told(decision)
    assert (type(kept.tick), type(kept.cost), type(kept.playing.mirrored)) == (int, float, bool)


# ---- contexts


def test_a_context_becomes_json():
    context = {"b": np.True_, "a": np.float32(0.5), "tags": frozenset({"Stun", "Air"}), "gone": math.nan, "far": math.inf}
    text = '{"a": 0.5, "b": true, "far": "inf", "gone": null, "tags": ["Air", "Stun"]}'
    assert context_json(context) == text
    assert json.loads(context_json({"of": {"x": (1, np.array([2]))}, "odd": range(2)})) == {
        "odd": "range(0, 2)",
        "of": {"x": [1, [2]]},
    }


def test_the_order_in_which_facts_are_given_changes_nothing():
    assert context_json({"a": 1, "b": 2}) == context_json({"b": 2, "a": 1})


def test_half_a_surrogate_pair_in_a_name_becomes_its_escape():
    playing = Playing("db\ud800", "walk\udc80", 0, 0, 0.0, False)
    trace = trace_of([replace(still(0), playing=playing, context={"\ud800": "\udfff"})])
    loaded = Trace.from_bytes(trace.to_bytes())[0]
    assert (loaded.playing.database, loaded.playing.asset) == ("db\\ud800", "walk\\udc80")
    assert loaded.context == {"\ud800": "\udfff"}


# ---- recording a controller

MARKUP = "walk,Move.Walk,,,\nrun,DoNotChoose,0,0.5,\nrun,CostModifier,,,0.5\n"


def recorded(clock=None, **options):
    """A session of two databases: it starts, plays on, jumps, and has something left out."""
    walks, runs = line(MARKUP, walk=range(20), idle=[0] * 20), line(MARKUP, run=range(100, 120))
    selector = Selector([Entry("walks", walks, 2.0), Entry("runs", runs)])
    trace = Trace(**{"n_candidates": 4, "databases": selector.databases, **options})
    settings = ControllerSettings(search_every_s=0.0, jump_threshold_s=0.0, history_s=0.0, rate=RATE)
    one = Controller(selector, settings, recorder=trace, clock=clock)
    decisions = [
        one.update(DT, [place], tags=TagFilter(avoid={"Move": 0.25}), context={"speed": place, "tags": {"a"}})
        for place in (0.0, 1.0, 2.0, 107.0, 108.0, 109.0, 3.0)
    ]
    return trace, decisions


def test_a_controller_s_decisions_are_recorded_as_they_were_with_the_markup_of_their_frames():
    trace, decisions = recorded()
    assert len(trace) == len(decisions)
    for kept, decision in zip(trace, decisions, strict=True):
        assert as_told(kept) == as_told(replace(decision, context={**decision.context, "tags": ["a"]}))
    jump = next(i for i, decision in enumerate(decisions) if decision.playing.asset == "run")
    events = trace.events(jump)
    assert events["runs", decisions[jump].playing.frame] == ("CostModifier 0.5",)
    assert all(tags == ("Move.Walk",) for (name, frame), tags in events.items() if name == "walks" and frame < 20)
    loaded = Trace.from_bytes(trace.to_bytes())
    assert loaded.use(trace.databases) == ""
    assert events == loaded.events(jump)


def test_without_databases_and_candidates_the_rest_is_recorded():
    trace, decisions = recorded(databases=None, n_candidates=0)
    assert all(decision.candidates == () and decision.choice is not None for decision in trace)
    assert [as_told(each)["playing"] for each in trace] == [decision.playing for decision in decisions]
    assert not any(trace.events(i) for i in range(len(trace)))
    assert trace.about == {}


def test_the_same_session_gives_the_same_bytes_whatever_the_clock_says():
    def clock(step):
        times = iter(np.arange(0.0, 1000.0, step).tolist())
        return lambda: next(times)

    (one, _), (other, _) = recorded(clock(0.25)), recorded(clock(0.5))
    assert one[0].search_us == 250_000.0
    assert one.to_bytes(timings=False) == other.to_bytes(timings=False)
    assert one.to_bytes() != other.to_bytes()


def test_the_file_tells_any_reader_of_parquet_what_it_holds(tmp_path: Path):
    trace, decisions = recorded()
    trace.save(tmp_path / "session.parquet")
    frame = pl.read_parquet(tmp_path / "session.parquet")
    assert frame["tick"].to_list() == list(range(len(decisions)))
    assert frame["filters"].list.first().struct.field("ranges")[0].to_list() == [True, True]
    assert json.loads(frame["inputs"][1])["dt_s"] == DT
    metadata = pl.read_parquet_metadata(tmp_path / "session.parquet")
    assert (metadata["contextdb.trace"], metadata["candidates"]) == ("2", "4")
    about = json.loads(metadata["about"])["runs"]
    told = {"rate": None, "features": ["feature 0"], "channels": ["features"], "assets": ["run"], "starts": [0], "stops": [20]}
    assert told.items() <= about.items()
    assert about == trace.about["runs"]
    assert Trace.load(tmp_path / "session.parquet").about == trace.about


# ---- files that are refused


def refused(raw, tmp_path):
    path = tmp_path / "session.parquet"
    path.write_bytes(raw)
    with pytest.raises(ArtefactError) as caught:
        list(Trace.load(path))
    (fault,) = caught.value.faults
    assert fault.place.file == str(path)
    assert fault.mend == "to record the session again"
    return fault.found


def test_files_that_are_no_session_are_refused_with_the_reason(tmp_path: Path):
    raw = recorded()[0].to_bytes()
    foreign = io.BytesIO()
    pl.DataFrame({"tick": [0]}).write_parquet(foreign)
    assert refused(b"", tmp_path) == "the file is empty."
    assert refused(b"tick,time_s\n0,0\n", tmp_path) == "this is not a Parquet file."
    assert refused(b"PAR1", tmp_path).startswith("the file is cut off")
    assert refused(raw[:-1], tmp_path).startswith("the file is cut off")
    assert refused(raw[: len(raw) // 2], tmp_path).startswith("the file is cut off")
    assert refused(foreign.getvalue(), tmp_path) == "this Parquet file is not a recorded session."


def altered(change, **metadata):
    raw = recorded()[0].to_bytes()
    saved = pl.read_parquet_metadata(io.BytesIO(raw))
    known = {key: value for key, value in saved.items() if key != "ARROW:schema"}
    out = io.BytesIO()
    change(pl.read_parquet(io.BytesIO(raw))).write_parquet(out, metadata={**known, **metadata, **UNSEALED})
    return sealed(out.getvalue())


def test_sessions_of_another_version_or_with_other_columns_are_refused(tmp_path: Path):
    assert refused(altered(lambda frame: frame, **{"contextdb.trace": "3"}), tmp_path) == (
        'the session has format "3"; this version reads format 2.'
    )
    assert refused(altered(lambda frame: frame, about="[1]"), tmp_path).startswith("the file is damaged")
    assert refused(altered(lambda frame: frame.drop("choice", "why")), tmp_path) == (
        '2 columns of the session missing, or of another type: "why", "choice".'
    )
    assert '"tick"' in refused(altered(lambda frame: frame.cast({"tick": pl.String})), tmp_path)
    assert f'"{TIMINGS}"' in refused(altered(lambda frame: frame.cast({TIMINGS: pl.String})), tmp_path)


@pytest.mark.parametrize(
    ("column", "value"),
    [
        ("action", "flies"),
        ("action", None),
        ("tick", None),
        ("searched", None),
        ("context", "{"),
        ("candidates", None),
        ("why", None),
    ],
)
def test_a_row_that_holds_no_decision_is_refused_with_its_number(column: str, value: object, tmp_path: Path):
    def change(frame):
        return frame.with_columns(
            pl.when(pl.col("tick") == 3).then(pl.lit(value, frame.schema[column])).otherwise(column).alias(column)
        )

    raw = altered(lambda frame: change(frame) if column != "tick" else frame.with_columns(pl.lit(None, pl.Int64).alias("tick")))
    assert refused(raw, tmp_path).startswith("row 0 " if column == "tick" else "row 3 ")


def test_no_damage_to_the_bytes_gives_anything_but_an_error_or_the_same_decisions():
    trace = recorded()[0]
    whole, raw, rng = list(map(as_told, trace)), bytearray(trace.to_bytes()), np.random.default_rng(5)
    for at in rng.integers(4, len(raw) - 12, 60 if IS_FULL else 20).tolist():
        broken = bytes(raw[:at]) + bytes([raw[at] ^ 0x15]) + bytes(raw[at + 1 :])
        try:
            found = list(Trace.from_bytes(broken, "x"))
        except ArtefactError:
            continue
        assert list(map(as_told, found)) == whole


def test_a_file_that_is_not_there_is_told_with_the_nearest(tmp_path: Path):
    (tmp_path / "session.parquet").write_bytes(b"")
    with pytest.raises(FileError, match=r"session\.parquet"):
        Trace.load(tmp_path / "sesion.parquet")
