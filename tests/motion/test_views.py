"""What people read of a session and of one decision: whole texts of small ones, and what holds for all of them."""

import math
import textwrap
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from strategies import examples
from test_trace import DECISIONS, recorded

from contextdb.console import width_of
from contextdb.motion.markup.left_out import LeftOut
from contextdb.motion.search.candidates import Candidate, Candidates
from contextdb.motion.search.hit import Hit
from contextdb.motion.selection.choice import Choice, Reason, Search, Status
from contextdb.motion.selection.decision import Action, Decision, Playing
from contextdb.motion.selection.root_motion import RootMotion
from contextdb.motion.selection.trigger import Trigger
from contextdb.motion.trace.cost_views import Ranked, View, candidate_lines, cost_text
from contextdb.motion.trace.text_table import Column, shortened, table_lines
from contextdb.motion.trace.views import decision_lines, fact_text, session_lines, summary_line

CHANNELS = ("LeftFoot position", "Hips velocity", "trajectory position at 0.33 0.67 1 s")


def candidate(asset, frame, costs, left_out=LeftOut.NO, mirrored=False, **biases):
    cost = math.fsum(costs) + math.fsum(biases.values())
    return Candidate(asset, 0, frame, frame / 30.0, mirrored, cost, dict(zip(CHANNELS, costs, strict=True)), biases, left_out)


def found(*rows, **counts):
    return Candidates(rows, {LeftOut[name]: count for name, count in counts.items()}, np.empty(0, np.uint8))


def playing(database, asset, frame, mirrored=False):
    return Playing(database, asset, 0, frame, frame / 30.0, mirrored)


JUMP = Decision(
    tick=63,
    time_s=2.1,
    action=Action.JUMP,
    why="A search was due: jog at 1.50 s costs 0.75, playing on 1.99.",
    searched=True,
    playing=playing("loco", "jog", 45),
    before=playing("loco", "walk", 30),
    cost=0.75,
    continuing_cost=1.99,
    choice=Choice(
        Hit("jog", 0, 45, 0.75),
        "loco",
        Reason.LOWEST,
        (
            Search("tired", 2.75, Hit("walk_tired", 0, 1204, 3.5), Status.BEATEN),
            Search("starts", 1.0, None, Status.NOT_AMONG),
            Search("loco", None, Hit("jog", 0, 45, 0.75), Status.WINNER),
        ),
    ),
    context={"gait": "Run", "speed": 2.5019378, "Stunned": False, "tags": ["InAir", "Ball"], "height": None},
    candidates=(
        ("tired", found(candidate("walk_tired", 1204, (1.0, 1.5, 1.0), mirrored=True), NOT_VALID=1200, CLIP_END=9)),
        (
            "loco",
            found(
                candidate("jog", 45, (0.25, 0.25, 0.25)),
                candidate("jog", 46, (0.5, 0.3, 0.0001), looping=-0.005),
                candidate("walk", 30, (1.0, 0.75, 0.25), continuing=-0.01),
                candidate("sprint", 12, (1.0, 1.0, 0.5), LeftOut.NOT_VALID),
                NOT_VALID=31,
            ),
        ),
    ),
    search_us=84.2,
    root_motion=RootMotion(0.0, 0.0405, math.radians(-1.5)),
    root_weight=0.5,
)
EVENTS = {("loco", 45): ("Move.Run",), ("loco", 30): ("Move.Walk", "CostModifier 0.5")}


def text(lines):
    return "\n".join(lines)


def golden(expected):
    return textwrap.dedent(expected).strip("\n")


# ---- one decision


def test_a_decision_in_full():
    assert text(decision_lines(JUMP, events=EVENTS)) == golden("""
        tick 63 at 2.10 s: jumps
        A search was due: jog at 1.50 s costs 0.75, playing on 1.99.

        plays       jog at 1.50 s, frame 45 of loco
        before      walk at 1.00 s, frame 30 of loco, if it played on
        cost        0.7500: pose 0.5000, trajectory 0.2500
        playing on  1.990: pose 1.750, trajectory 0.2500, bias -0.01000
        events      Move.Run
        moved       0.041 m ahead, 0.000 m left, turned -1.5°; weight 0.5
        search      84 µs
        context     gait = Run, speed = 2.5, Stunned = False, tags = +Ball +InAir, height = missing

        searches

        order  database  asset                  time s  frame    cost  threshold  result
            0  loco      walk                     1.00     30   1.990             plays on
            1  tired     walk_tired (mirrored)   40.13  1,204   3.500       2.75  beaten
            2  starts                                                          1  not among
            3  loco      jog                      1.50     45  0.7500             winner, lowest cost

        top candidates (summary)

        rank  asset                 database  time s  frame  mirrored  left out           cost    pose
           1  jog         chosen    loco        1.50     45                             0.7500  0.5000
           2  jog                   loco        1.53     46                             0.7951  0.8000
           3  walk        plays on  loco        1.00     30                              1.990   1.750
           4  sprint                loco        0.40     12            asset not valid   2.500   2.000
           5  walk_tired            tired      40.13  1,204  yes                         3.500   2.500

        rank  asset       trajectory       bias
           1  jog             0.2500          0
           2  jog           0.000100  -0.005000
           3  walk            0.2500   -0.01000
           4  sprint          0.5000          0
           5  walk_tired       1.000          0

        left out of tired: 1,200 asset not valid, 9 clip end
        left out of loco: 31 asset not valid
    """)


def tables(view, **options):
    """The tables of top candidates alone."""
    lines = list(decision_lines(JUMP, view, events=EVENTS, width=140, **options))
    first = lines.index(f"top candidates ({view})") + 2
    return text(lines[first : lines.index("left out of tired: 1,200 asset not valid, 9 clip end") - 1])


def test_the_view_of_the_pose_has_a_column_for_each_channel_of_it():
    assert tables(View.POSE) == golden("""
                                                                                                LeftFoot      Hips
        rank  asset                 database  time s  frame  mirrored  left out           cost  position  velocity
           1  jog         chosen    loco        1.50     45                             0.7500    0.2500    0.2500
           2  jog                   loco        1.53     46                             0.7951    0.5000    0.3000
           3  walk        plays on  loco        1.00     30                              1.990     1.000    0.7500
           4  sprint                loco        0.40     12            asset not valid   2.500     1.000     1.000
           5  walk_tired            tired      40.13  1,204  yes                         3.500     1.000     1.500
    """)


def test_the_view_of_biases_has_only_what_some_frame_has():
    header, *rows = tables(View.BIAS).splitlines()
    assert header.split()[-3:] == ["cost", "looping", "continuing"]
    assert [row.split()[-1] for row in rows] == ["0.7500", "-0.005000", "-0.01000", "2.500", "3.500"]


def test_the_view_of_the_trajectory_and_that_of_all_share_its_columns():
    assert "LeftFoot" not in tables(View.TRAJECTORY)
    assert "LeftFoot" in tables(View.ALL)
    for view in (View.TRAJECTORY, View.ALL):
        assert tables(view).splitlines()[0].strip() == "trajectory"


def test_the_view_of_events_tells_the_markup_of_each_frame():
    rows = tables(View.EVENTS).splitlines()
    assert rows[0].split()[-1] == "events"
    assert rows[1].endswith("0.7500  Move.Run")
    assert rows[3].endswith("1.990  Move.Walk, CostModifier 0.5")


def test_a_name_leaves_candidates_with_their_ranks_and_says_when_there_are_none():
    rows = tables(View.SUMMARY, name="WALK").splitlines()
    assert [row.split()[:2] for row in rows] == [["rank", "asset"], ["3", "walk"], ["5", "walk_tired"]]
    assert 'none whose name contains "swim"' in list(decision_lines(JUMP, name="swim"))


def test_of_a_decision_without_a_search_only_the_status_is_told():
    decision = replace(JUMP, searched=False, action=Action.CONTINUE, choice=None, candidates=(), cost=None, continuing_cost=None)
    decision = replace(decision, before=decision.playing, why="The next search is due in 0.1 s.", context=None, search_us=None)
    assert text(decision_lines(replace(decision, root_motion=RootMotion(), root_weight=1.0))) == golden("""
        tick 63 at 2.10 s: plays on
        The next search is due in 0.1 s.

        plays       jog at 1.50 s, frame 45 of loco
    """)


def test_nothing_that_plays_is_told_as_nothing():
    nothing = Decision(0, 0.0, Action.NOTHING, "Nothing was playing, and nothing may play.", True, None, None)
    assert list(decision_lines(nothing))[-1] == "plays       nothing"


# ---- a session


def decision(tick, action, why, asset=None, frame=0, cost=None, on=None, before=None, searched=True, database="loco"):
    here = None if asset is None else playing(database, asset, frame)
    return Decision(tick, tick / 10.0, action, why, searched, here, before or here, cost, on)


WALK = playing("loco", "walk", 39)
SESSION = [
    decision(0, Action.NOTHING, "Nothing was playing, and nothing may play."),
    decision(1, Action.NOTHING, "Nothing was playing, and nothing may play."),
    decision(2, Action.START, "Nothing was playing: walk at 0.40 s costs 0.04.", "walk", 12, 0.04),
    decision(3, Action.CONTINUE, "The next search is due in 0.1 s.", "walk", 15, searched=False),
    decision(4, Action.CONTINUE, "A search was due: playing on is cheapest, at cost 0.03.", "walk", 18, 0.03, 0.03),
    decision(5, Action.LOOP, "The next search is due in 0.1 s.", "walk", 1, searched=False),
    decision(6, Action.JUMP, "A search was due: jog at 1.00 s costs 0.2, playing on 3.", "jog", 30, 0.2, 3.0, WALK),
    decision(7, Action.CONTINUE, "The next search is due in 0.1 s.", "jog", 33, searched=False),
    decision(8, Action.HOLD, "jog has ended and nothing else may play: its last frame is held.", "jog", 33),
    decision(9, Action.HOLD, "jog has ended and nothing else may play: its last frame is held.", "jog", 33),
]


def test_a_session_has_a_row_for_each_change_and_says_how_long_it_went_on():
    assert text(session_lines(SESSION)) == golden("""
                                                                           playing
        tick  time s  search                         asset  at s     cost       on  for s
           0    0.00  nothing played  plays nothing                                  0.20
           2    0.20  nothing played  starts         walk   0.40  0.04000            0.30
           5    0.50                  loops          walk   0.03                     0.10
           6    0.60  due             jumps          jog    1.00   0.2000    3.000   0.20
           8    0.80  ended           holds          jog    1.10                     0.10
    """)


def test_a_session_in_one_line():
    assert summary_line(SESSION) == "0.90 s: 10 updates, 7 searches, 1 jump, 1 loop"
    assert summary_line([]) == "0.00 s: 0 updates, 0 searches, 0 jumps, 0 loops"


def test_a_name_leaves_what_plays_or_leaves_an_asset_of_that_name():
    assert [line.split()[0] for line in list(session_lines(SESSION, name="Walk"))[2:]] == ["2", "5", "6"]
    assert [line.split()[0] for line in list(session_lines(SESSION, name="jog"))[2:]] == ["6", "8"]
    assert list(session_lines(SESSION, name="swim")) == []
    assert list(session_lines([])) == []


def test_databases_are_told_when_there_are_several_and_mirrored_assets_are_marked():
    other = replace(SESSION[6], playing=playing("tired", "jog", 30, mirrored=True))
    lines = list(session_lines([*SESSION[:6], other]))
    assert "database" in lines[1]
    assert "tired     jog (mirrored)" in lines[-1]


@pytest.mark.parametrize("cause", Trigger)
def test_every_cause_of_a_search_has_a_word(cause):
    told = replace(SESSION[6], why=f"{cause.sentence(WALK)}: jog at 1.00 s costs 0.2.")
    (_, _, row) = session_lines([told])
    assert row.split("  ")[2].strip() or row.split()[2]


def test_a_recorded_session_reads_the_same_as_the_decisions_it_was_made_of():
    trace, decisions = recorded()
    assert text(session_lines(trace.brief())) == text(session_lines(decisions))
    assert text(decision_lines(trace[3], View.ALL)) == text(
        decision_lines(replace(decisions[3], context=trace[3].context), View.ALL)
    )


# ---- widths


@examples(0.3)
@given(st.lists(DECISIONS, max_size=2), st.sampled_from(View))
def test_whatever_was_decided_can_be_told_on_lines_that_move_no_cursor(decisions, view):
    lines = [line for each in decisions for line in decision_lines(each, view)]
    lines += [*session_lines(decisions), summary_line(decisions)]
    assert all(line.isprintable() for line in lines)


LONG = "Fifa_loco_ptm_strafe_spiral_counter_clockwise_jog_to_stop_variation_02"


@pytest.mark.parametrize("view", View)
def test_lines_fit_100_columns_and_long_names_keep_their_ends(view):
    channels = {
        f"{bone} {what}": 1.5 for bone in ("LeftFoot", "RightFoot", "LeftHand", "Hips") for what in ("position", "velocity")
    }
    row = Candidate(LONG, 0, 206, 6.8, True, 36.82, channels, {"looping": -0.005}, LeftOut.NEXT_NATURAL)
    here = Playing(LONG, LONG, 0, 206, 6.8, True)
    candidates = ((LONG, found(row, row)), ("other", found(row)))
    choice = Choice(Hit(LONG, 0, 206, 36.82), LONG, Reason.LOWEST, (Search(LONG, 2.75, Hit(LONG, 0, 206, 36.82), Status.WINNER),))
    told = replace(JUMP, playing=here, before=here, candidates=candidates, choice=choice, context={LONG: LONG, "b": LONG})
    lines = [*decision_lines(told, view, events={(LONG, 206): (LONG, LONG)}), *session_lines([told, *SESSION])]
    assert max(map(width_of, lines)) <= 100
    told_names = [word for line in lines for word in line.split() if word.startswith("Fifa")]
    assert told_names
    assert all("…" in each or each.rstrip(",:") == LONG for each in told_names)


@given(st.text(max_size=30), st.integers(1, 40))
def test_a_shortened_text_fits_and_keeps_both_ends(name, most):
    short = shortened(name, most)
    assert width_of(short) <= max(most, 1)
    head, _, tail = short.partition("…") if short != name else (name, "", "")
    assert name.startswith(head)
    assert name.endswith(tail)


def test_a_table_without_rows_has_no_lines_and_an_empty_column_is_left_out():
    assert list(table_lines([Column("a", [])])) == []
    assert list(table_lines([Column("a", ["x", "y"]), Column("b", ["", ""]), Column("n", ["1", "20"], is_number=True)])) == [
        "a   n",
        "x   1",
        "y  20",
    ]


def test_what_is_too_wide_goes_on_below_with_its_keys():
    columns = [Column("key", ["k"], is_key=True), *(Column(name, ["1" * 8], is_number=True) for name in ("one", "two", "three"))]
    assert list(table_lines(columns, 24)) == [
        "key       one       two",
        "k    11111111  11111111",
        "",
        "key     three",
        "k    11111111",
    ]


@pytest.mark.parametrize(
    ("cost", "told"),
    [
        (None, ""),
        (0.0, "0"),
        (-0.005, "-0.005000"),
        (0.01034, "0.01034"),
        (0.01126, "0.01126"),
        (0.00012345, "0.000123"),
        (1e-6, "0.000001"),
        (4e-7, "4e-07"),
        (3e-16, "0.000"),
        (0.99996, "1.000"),
        (12.345678, "12.35"),
        (-999.96, "-1,000"),
        (1234.5678, "1,235"),
        (1e8, "100,000,000"),
        (1e30, "1e+30"),
        (math.inf, "inf"),
    ],
)
def test_a_cost_reads_as_a_number(cost, told):
    assert cost_text(cost) == told


def test_candidates_without_times_and_of_one_database_need_no_columns_for_these():
    rows = [Ranked(1, "loco", replace(JUMP.candidates[1][1].rows[0], time_s=None))]
    assert text(candidate_lines(rows)) == golden("""
        rank  asset  frame    cost    pose  trajectory  bias
           1  jog       45  0.7500  0.5000      0.2500     0
    """)


@pytest.mark.parametrize(
    ("fact", "text"), [(-123.4567, "-123"), (65.123456, "65.1"), (180.0, "180"), (9.57e-12, "0"), (2.5, "2.5"), (3, "3")]
)
def test_a_fact_has_three_digits(fact: object, text: str):
    assert fact_text(fact) == text
