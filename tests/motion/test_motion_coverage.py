"""Motion coverage of databases: filled, wanted and missing bins, what to capture next, near clips and transitions."""

import os
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from made_once import make_clip

from contextdb.errors import ContextError, MotionError
from contextdb.motion import FeatureSchema, Markup, MotionDatabase, coverage, load_clips
from contextdb.motion.measuring.coverage import MotionCoverage
from contextdb.motion.measuring.moves import DIRECTION, LEAST_FRAMES, MAPS, TURN, ClipContexts, _between, _straightest
from contextdb.motion.measuring.usage import transitions_of

SCHEMA = FeatureSchema.from_dict(
    "loco",
    {
        "rate": 30.0,
        "mirror": [["Left*", "Right*"]],
        "channels": [
            {"type": "position", "bone": "LeftFoot"},
            {"type": "position", "bone": "RightFoot"},
            {"type": "velocity", "bone": "Hips"},
            {"type": "trajectory", "what": "position", "at": [0.33, 1.0]},
        ],
    },
)
NAMES = (
    "idle",
    "walk",
    "walk_turn_left_45",
    "walk_turn_right_45",
    "walk_turn_left_90",
    "jog",
    "jog_turn_left_60",
    "run",
    "start_walk",
)
CLIPS = {name: make_clip(name).clip for name in NAMES}
WALK, JOG = 3, 5
LEFT_45, RIGHT_45 = 2, 6


def database(names: Sequence[str] = NAMES, mirror: bool = False, markup: Markup | None = None) -> MotionDatabase:
    return MotionDatabase.build([CLIPS[name] for name in names], SCHEMA, mirror=mirror, markup=markup)


def measured(names: Sequence[str] = NAMES, mirror: bool = False, contexts: Sequence[ClipContexts] | None = None) -> MotionCoverage:
    return coverage({"loco": database(names, mirror)}, contexts)


def filled(found: MotionCoverage) -> set[tuple[str, int, int]]:
    return {(name, r, c) for name, shares in found.filled_shares.items() for r, c in np.argwhere(shares > 0.0).tolist()}


def valid(*assets: str, mirrored: Sequence[str] = (), share: float = 1.0, **more: object) -> ClipContexts:
    return ClipContexts(frozenset(assets), frozenset(mirrored), share, **more)  # type: ignore[arg-type]


WHOLE = measured()


def test_clips_are_in_the_bins_that_they_were_made_for():
    assert MAPS[TURN].words(WALK, LEFT_45) == "1-1.5 m/s ahead, turning left 35-70°/s"
    found = measured(["walk_turn_left_45"])
    assert found.frames[TURN][WALK, LEFT_45] >= 0.9 * found.n_frames
    assert found.frames[TURN][:, RIGHT_45].sum() == 0


def test_a_mirrored_left_turn_fills_the_bin_of_the_right_turn():
    plain, both = measured(["walk_turn_left_45"]), measured(["walk_turn_left_45"], mirror=True)
    (clip,) = both.clips
    assert clip.mirrored is not None
    assert (clip.mirrored[TURN] == clip.plain[TURN][:, MAPS[TURN].opposite]).all()
    assert (both.frames[TURN] == plain.frames[TURN] + clip.mirrored[TURN]).all()
    assert both.filled_shares[TURN][WALK, RIGHT_45] == 1.0


@pytest.mark.parametrize("removed", NAMES)
def test_removing_a_clip_opens_exactly_the_bins_that_it_alone_fills(removed: str):
    rest = [clip for clip in WHOLE.clips if clip.asset != removed]
    lost = filled(WHOLE) - filled(measured([name for name in NAMES if name != removed]))
    expected = {(name, r, c) for name, r, c in filled(WHOLE) if sum(int(clip.plain[name][r, c]) for clip in rest) < LEAST_FRAMES}
    assert lost == expected
    if removed == "jog_turn_left_60":
        assert (TURN, JOG, LEFT_45) in lost


def test_mirrored_clips_are_valid_by_mirrored_facts():
    left = valid("walk", "walk_turn_left_45", share=0.5)
    seen = valid("walk", mirrored=["walk_turn_left_45"], share=0.5)
    found = measured(["walk", "walk_turn_left_45"], mirror=True, contexts=[left, seen])
    one, other = found.contexts
    assert one.filled[TURN][WALK, LEFT_45]
    assert not one.filled[TURN][WALK, RIGHT_45]
    assert other.filled[TURN][WALK, RIGHT_45]
    assert not other.filled[TURN][WALK, LEFT_45]
    assert found.filled_shares[TURN][WALK, LEFT_45] == 0.5


def test_what_turns_left_is_wanted_to_the_right_where_contexts_are_the_same_in_a_mirror():
    for is_symmetric in (True, False):
        found = measured(contexts=[valid("walk", "walk_turn_left_45", is_symmetric=is_symmetric)])
        assert found.contexts[0].wanted[TURN][WALK, RIGHT_45] == is_symmetric


def test_a_bin_between_two_that_are_filled_is_wanted():
    found = measured(["walk", "jog_turn_left_60", "run"])
    wanted, speeds = found.contexts[0].wanted[TURN], range(WALK, JOG + 2)
    assert all(wanted[row, MAPS[TURN].centre] for row in speeds)
    assert found.hole_shares[TURN][WALK + 1, MAPS[TURN].centre] == 1.0
    assert not wanted[WALK, LEFT_45]


def test_speeds_that_are_asked_for_are_wanted_and_others_are_not():
    asked = valid("walk", "jog", asked={"speed": [(0.8, 4.5)]})
    found = measured(contexts=[asked]).contexts[0]
    straight = found.wanted[TURN][:, MAPS[TURN].centre]
    assert [MAPS[TURN].rows[row].name for row in np.flatnonzero(straight)] == ["0.6-1", "1-1.5", "1.5-2.1", "2.1-3", "3-4", "4-5"]
    assert {"3-4 m/s ahead, straight", "1.5-2.1 m/s ahead, straight"} <= {
        each.words for each in measured(contexts=[asked]).to_capture
    }


def test_a_speed_without_a_clip_is_wanted_as_straight_as_the_clips_go():
    turns = valid("walk_turn_left_45", asked={"speed": [(1.1, 2.6)]}, is_symmetric=False)
    found = measured(contexts=[turns]).contexts[0]
    assert found.holes[TURN][JOG, LEFT_45]
    assert not found.wanted[TURN][JOG, MAPS[TURN].centre]


def test_turns_that_are_asked_for_are_wanted_at_the_speeds_that_are():
    asked = valid("walk", asked={"speed": [(1.0, 1.5)], "turn": [(-70.0, 70.0)]})
    found = measured(contexts=[asked]).contexts[0]
    assert found.wanted[TURN].sum() == 5
    assert found.wanted[TURN][WALK, LEFT_45 : RIGHT_45 + 1].all()


def test_the_covered_share_is_that_of_the_wanted_bins_by_the_share_of_their_contexts():
    asked = {"speed": [(1.0, 1.5)], "turn": [(-70.0, 70.0)]}
    few, more = valid("walk", share=0.3, asked=asked), valid("walk", "walk_turn_left_45", share=0.1, asked=asked)
    found = measured(contexts=[few, more])
    assert found.covered == pytest.approx(0.75 * (1 / 5) + 0.25 * (2 / 5), abs=0.06)
    by_hand = sum(each.contexts.share * (each.n_wanted - each.n_holes) for each in found.contexts) / (5 * 0.4)
    assert found.covered == pytest.approx(by_hand)
    assert sum(each.fills for each in found.to_capture) == pytest.approx(1.0 - found.covered)


def test_what_fills_most_is_to_be_captured_first_and_clips_that_move_so_are_named():
    asked = {"speed": [(1.0, 1.5)], "turn": [(-70.0, 70.0)]}
    contexts = [valid("walk", share=0.6, asked=asked), valid("walk", "walk_turn_left_45", share=0.4, asked=asked)]
    captures = measured(contexts=contexts).to_capture
    assert [each.fills for each in captures] == sorted((each.fills for each in captures), reverse=True)
    left = next(each for each in captures if (each.row, each.column) == (WALK, LEFT_45))
    assert left.contexts == pytest.approx(0.6)
    assert left.elsewhere[0] == "walk_turn_left_45"


def test_one_clip_fills_both_sides_where_clips_are_mirrored():
    asked = {"speed": [(1.0, 1.5)], "turn": [(-70.0, 70.0)]}
    context = valid("walk", mirrored=["walk"], asked=asked)
    plain, both = measured(["walk"], contexts=[context]), measured(["walk"], mirror=True, contexts=[context])
    assert len(both.to_capture) * 2 == len(plain.to_capture)
    assert all(each.is_both_sides for each in both.to_capture)
    assert sum(each.fills for each in both.to_capture) == pytest.approx(sum(each.fills for each in plain.to_capture))


def test_frames_that_markup_never_lets_play_fill_nothing():
    marks = Markup.parse("asset,tag,from,to\nwalk,DoNotChoose,,\n")
    marked = coverage({"loco": database(["walk", "jog"], markup=marks)})
    (dead,) = marked.dead
    assert (dead.asset, dead.n_dead) == ("walk", dead.n_frames)
    assert marked.frames[TURN][WALK].sum() == 0


def test_a_clip_that_is_in_another_is_near_it():
    found = measured()
    near = {(each.asset, each.other) for each in found.near}
    assert ("walk", "start_walk") in near
    assert not any("jog" in pair[0] and "walk" in pair[1] for pair in near)
    (copied,) = {each.cost for each in coverage({"loco": _with_copy()}).near}
    assert copied < 1e-5


def _with_copy() -> MotionDatabase:
    from dataclasses import replace

    return MotionDatabase.build([CLIPS["run"], replace(CLIPS["run"], name="run_again")], SCHEMA)


def test_a_clip_in_two_databases_counts_once():
    twice = coverage({"one": database(), "two": database(["walk", "jog"])})
    assert (twice.frames[TURN] == WHOLE.frames[TURN]).all()


@pytest.mark.parametrize(
    ("names", "pattern", "missing"),
    [
        (
            ["stand_to_walk", "walk_to_run", "run"],
            "{from}_to_{to}",
            [("run", "stand"), ("run", "walk"), ("stand", "run"), ("walk", "stand")],
        ),
        (["a_to_b", "b_to_a"], "{from}_to_{to}", []),
        (["tr-a-b-1", "tr-b-c-1"], "tr-{from}-{to}-1", [("a", "c"), ("b", "a"), ("c", "a"), ("c", "b")]),
        (["walk", "run"], "{from}_to_{to}", []),
    ],
)
def test_transitions_without_a_clip_are_told_by_names(names: list[str], pattern: str, missing: list[tuple[str, str]]):
    assert sorted(transitions_of(names, pattern).missing) == sorted(missing)


@pytest.mark.parametrize("pattern", ["", "{from}", "{from}{to}", "{to}_to_{from}", "{from}_{to}_{to}", "{from}_{from}_{to}"])
def test_a_pattern_without_both_places_is_refused(pattern: str):
    with pytest.raises(MotionError, match="not a pattern of transitions"):
        transitions_of(["a_to_b"], pattern)


def test_databases_without_root_motion_are_refused():
    with pytest.raises(MotionError, match="from features"):
        coverage({"x": MotionDatabase.from_features(np.eye(2), [0], [2], ["a"])})
    with pytest.raises(MotionError, match="no database"):
        coverage({})
    with pytest.raises(ContextError):
        coverage({"x": 5})  # type: ignore[dict-item]


@given(st.lists(st.booleans(), min_size=1, max_size=9))
def test_between_is_what_reading_both_sides_says(row: list[bool]):
    flags = np.array([row])
    expected = [any(row[: i + 1]) and any(row[i:]) for i in range(len(row))]
    assert _between(flags, axis=1)[0].tolist() == expected


def test_the_straightest_column_is_the_nearest_to_straight_ahead():
    flags = np.zeros(MAPS[TURN].shape, np.bool_)
    assert _straightest(MAPS[TURN], flags) == MAPS[TURN].centre
    flags[2, 0] = flags[3, 6] = True
    assert _straightest(MAPS[TURN], flags) == 6


def test_what_goes_sideways_between_two_directions_is_wanted_and_ahead_is_left_to_the_map_of_turns():
    assert not measured().contexts[0].wanted[DIRECTION][:, MAPS[DIRECTION].centre].any()


MOCAP = Path(os.environ.get("CONTEXTDB_MOCAP", Path(__file__).parents[2].parent / "shared" / "data" / "mocap"))


@pytest.mark.skipif(not (MOCAP / "assets.csv").is_file(), reason="no captured clips: set CONTEXTDB_MOCAP to their folder")
def test_captured_clips_are_in_the_bins_of_what_their_names_say():
    schema = FeatureSchema.from_dict("hips", {"rate": 30.0, "channels": [{"type": "velocity", "bone": "Hips"}]})
    clips = load_clips(sorted((MOCAP / "bandai_namco").glob("*_walk-[bt]*.bvh")))
    found = coverage({"captured": MotionDatabase.build(clips, schema)})
    assert len(found.clips) > 40
    centre = MAPS[TURN].centre
    for clip in found.clips:
        turns, directions = clip.plain[TURN].sum(axis=0), clip.plain[DIRECTION].sum(axis=0)
        if "walk-back" in clip.asset:
            assert directions[-1] > 0.8 * directions.sum(), clip.asset
        elif "walk-turn-left" in clip.asset:
            assert turns[:centre].sum() > turns[centre + 1 :].sum(), clip.asset
        elif "walk-turn-right" in clip.asset:
            assert turns[:centre].sum() < turns[centre + 1 :].sum(), clip.asset
