"""What is said of a session that was asked again, where there is little to say."""

from dataclasses import replace

from contextdb.motion.trace.answer_views import diff_lines, stats_lines, what_if_lines, why_lines
from contextdb.motion.trace.cost_views import as_plain
from contextdb.motion.trace.session_diff import Parting, SessionDiff
from contextdb.motion.trace.stats import SessionStats
from contextdb.motion.trace.what_if import ChangedChoice, WhatIf
from contextdb.motion.trace.why_not import WhyNot
from contextdb.motion.trace.winning_changes import Change, ChangePart

WHY = WhyNot("walk", "loco", 7, 0.23, 3, 1.5, "run", 0.5, ("cost: 1.5, 1 more than run",), ())


def test_an_asset_that_was_chosen_needs_no_reason():
    assert list(why_lines(replace(WHY, winner="walk"))) == ["walk was chosen: cost 1.500."]


def test_an_asset_that_nothing_helps_says_so_and_a_mark_is_taken_away():
    assert list(why_lines(WHY))[-1] == "no single change of a cell, a mark, a bias or a weight"
    change = Change((ChangePart("mark", "DoNotChoose", "without"),), True)
    assert "without the mark DoNotChoose" in list(why_lines(replace(WHY, changes=(change,))))[-1]


def test_a_change_tells_the_first_choices_and_counts_the_others():
    choices = tuple(ChangedChoice(i, i / 30.0, "walk", None) for i in range(25))
    lines = list(what_if_lines(WhatIf(30, 26, choices, {}, {}, False)))
    assert lines[0] == "of 30 recorded searches, 26 choose another frame, 25 another asset"
    assert sum("nothing" in line for line in lines) == 20
    assert "and 5 more" in lines
    assert any(line.startswith("(run again unchanged it does not play what was recorded") for line in lines)


def test_of_two_sessions_the_longer_is_named():
    same = SessionDiff(30, 5, 0, 0, None, {}, {})
    assert list(diff_lines(same))[:2] == [
        "both play the same in all 30 updates",
        "the first session is longer by 5 updates",
    ]
    parting = Parting(3, 0.1, "walk", None, "The best.", "Nothing may play.")
    other = list(diff_lines(replace(same, longer=-1, parting=parting, other_frames=4)))
    assert other[:3] == ["they part at tick 3, 0.10 s", "first:  walk. The best.", "second: nothing. Nothing may play."]
    assert "the second session is longer by 1 update" in other


def test_figures_that_there_are_none_of_are_left_out():
    lines = list(stats_lines(SessionStats(1.0, 30, 3, 0, 0, 0, 0.0)))
    assert not any(line.startswith(("gain", "stay", "never used")) for line in lines)


def test_a_set_is_a_list_in_json():
    assert as_plain({"state": frozenset(("b", "a"))}) == {"state": ["a", "b"]}
