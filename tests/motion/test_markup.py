"""Markup files: what is read, what is refused and how, and what does nothing with the assets there are."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from contextdb.errors import MotionError
from contextdb.motion.markup.markup import MOST_FAULTS, Markup
from contextdb.motion.markup.reserved import ReservedTag
from contextdb.motion.markup.span_faults import Span, fits

HEADER = "asset,tag,from,to,value\n"


def spans(*lines: str) -> tuple[Span, ...]:
    return Markup.parse(HEADER + "\n".join(lines)).spans


def faults(text: str) -> list[str]:
    with pytest.raises(MotionError) as caught:
        Markup.parse(text, "marks.csv")
    return [str(fault) for fault in caught.value.faults]


def fault(*lines: str) -> str:
    """The only fault of some lines below the header."""
    (only,) = faults(HEADER + "\n".join(lines))
    return only


# ---- reading


def test_a_row_is_a_span_and_empty_times_are_the_start_and_the_end():
    assert spans("jog,DoNotChoose,0.5,1.25,", "jog,Move.Jog,,,") == (
        Span("jog", "DoNotChoose", 0.5, 1.25),
        Span("jog", "Move.Jog", 0.0, math.inf),
    )


def test_columns_stand_in_any_order_and_value_may_be_absent():
    text = "To,from, tag ,asset\n2,1,Move,jog\n"
    assert Markup.parse(text).spans == (Span("jog", "Move", 1.0, 2.0),)


@pytest.mark.parametrize("tag", list(ReservedTag))
def test_a_reserved_tag_is_known_in_any_case(tag):
    value = {"CostModifier": "0.5", "RootMotionWeight": "0.5"}.get(tag, "")
    (span,) = spans(f"jog,{tag.swapcase()},,,{value}")
    assert span.tag == tag
    assert Markup((span,)).tags == ()


def test_the_vocabulary_is_all_plain_tags_sorted_each_once():
    markup = Markup.parse(HEADER + "b,Move.Run,,,\na,Move,,,\na,Looping,,,\nb,Move,,,\n")
    assert markup.tags == ("Move", "Move.Run")


def test_blank_lines_rows_of_commas_and_spaces_round_fields_do_not_matter():
    assert spans("", ",,,,", " jog , Move , 1 , 2 , ", "") == (Span("jog", "Move", 1.0, 2.0),)


@pytest.mark.parametrize("end", ["\n", "\r\n", "\r"])
def test_any_line_end_will_do_and_lines_are_counted_by_it(end):
    text = end.join([HEADER.strip(), "jog,Move,,,", "", "walk,Move,,,"])
    assert [span.line for span in Markup.parse(text).spans] == [2, 4]


def test_a_quoted_name_may_hold_commas_and_doubled_quotes():
    assert spans('"a, ""b""",Move,,,')[0].asset == 'a, "b"'


def test_a_hash_is_no_comment():
    assert spans("#1,Move,,,")[0].asset == "#1"


def test_a_file_is_read_with_or_without_bom(tmp_path):
    for raw in (HEADER.encode() + b"jog,Move,,,\n", b"\xef\xbb\xbf" + HEADER.encode() + b"jog,Move,,,\n"):
        (tmp_path / "marks.csv").write_bytes(raw)
        assert Markup.load(tmp_path / "marks.csv").spans == (Span("jog", "Move"),)
        assert Markup.parse(raw.decode()).spans == (Span("jog", "Move"),)


# ---- files that are no markup


@given(st.binary(max_size=80) | st.text(max_size=80).map(str.encode) | st.text(',"\n*.aA01-', max_size=80).map(str.encode))
def test_any_bytes_are_markup_or_a_motion_error(tmp_path_factory, raw):
    path = tmp_path_factory.getbasetemp() / "any.csv"
    for start in (b"", HEADER.encode()):
        path.write_bytes(start + raw)
        found, told = outcome(path)
        assert all(span.asset and span.tag and 0.0 <= span.from_s <= span.to_s for span in found)
        assert all(one.found and one.place.file == str(path) for one in told)


def outcome(path):
    """The spans of a file, or its faults."""
    try:
        return Markup.load(path).spans, ()
    except MotionError as error:
        return (), error.faults


# ---- faults of the header and of lines


@pytest.mark.parametrize(
    "name",
    ["Looking", "Looting", "Included", "Match", "Natural", "LoopStart", "Gait.Loping", "Läuft", "move:fast", "_x-7", "7", "Any"],
)
def test_other_names_are_plain_tags(name):
    assert spans(f"jog,{name},,,") == (Span("jog", name),)


# ---- faults of several spans together


@pytest.mark.parametrize("tag", ["WarpPosition", "WarpRotation"])
def test_an_asset_has_one_warp_of_each_sort(tag):
    assert f'line 2 gives "jog" a {tag} too' in fault(f"jog,{tag},0,1,", f"jog,{tag},2,3,")
    assert len(spans("jog,WarpPosition,0,1,", "jog,WarpRotation,0,1,", "walk,WarpPosition,2,3,", "*,WarpPosition,0,1,")) == 4


def test_root_motion_weights_may_touch_or_overlap_with_one_value():
    assert len(spans("jog,RootMotionWeight,0,1,0.2", "jog,RootMotionWeight,1,2,0.4", "jog,RootMotionWeight,1.5,3,0.4")) == 3


def test_of_very_many_faults_the_first_are_told_and_the_rest_counted():
    told = faults(HEADER + "jog,Move,x,,\n" * (MOST_FAULTS + 7))
    assert len(told) == MOST_FAULTS + 1
    assert told[-1] == "marks.csv: there are 7 more faults."


def test_spans_made_in_python_are_checked_alike():
    with pytest.raises(MotionError) as caught:
        Markup((Span("jog", "Move", 2.0, 1.0), Span("jog", "Do Not Choose"), Span("jog", "Move", "1", math.nan), Span("", 5)))
    assert [(fault.place.row, fault.place.column) for fault in caught.value.faults] == [
        (0, "from"),
        (1, "tag"),
        (2, "from"),
        (2, "to"),
        (3, "asset"),
        (3, "tag"),
    ]
    with pytest.raises(MotionError, match="the spans are not a list of spans"):
        Markup(("jog",))


# ---- patterns


@given(st.text("ab*", max_size=8), st.text("ab", max_size=8))
def test_a_pattern_fits_what_trying_every_cut_finds(pattern, name):
    def holds(pattern, name):
        if not pattern:
            return not name
        if pattern[0] == "*":
            return any(holds(pattern[1:], name[i:]) for i in range(len(name) + 1))
        return name[:1] == pattern[0] and holds(pattern[1:], name[1:])

    assert fits(pattern, name) == holds(pattern, name)


def test_the_spans_of_an_asset_are_those_of_its_name_and_of_fitting_patterns_in_order():
    markup = Markup.parse(HEADER + "jog_*,Move,,,\nwalk,Move,,,\njog_left,DoNotChoose,1,,\n*,Looping,,,\n")
    assert [span.line for span in markup.spans_of("jog_left")] == [2, 4, 5]
    assert [span.line for span in markup.spans_of("walk")] == [3, 5]


# ---- against the assets there are


def told_for(lines: list[str], durations_s: dict[str, float], rate: float | None = None) -> list[str]:
    markup = Markup.parse(HEADER + "\n".join(lines), "marks.csv")
    return [str(fault) for fault in markup.faults_for(list(durations_s), durations_s, rate=rate)]


def test_an_asset_that_no_database_holds_is_told_once_with_the_nearest_name():
    told = told_for(["jog_letf,Move,,,", "jog_letf,DoNotChoose,1,,", "jog_letf,DoNotChoose,2,,"], {"jog_left": 3.0})
    assert told == [
        'marks.csv, line 2, column "asset": no database holds the asset "jog_letf". Nor on lines 3-4. Accepted: one of 1 asset. '
        'Did you mean "jog_left"?'
    ]


def test_a_pattern_that_no_asset_fits_is_told():
    assert 'no asset fits the pattern "swim_*"' in told_for(["swim_*,Move,,,"], {"jog": 3.0})[0]
    assert "none: there are no assets" in told_for(["*,Move,,,"], {})[0]


def test_a_span_wholly_behind_the_end_of_its_clip_is_told():
    (told,) = told_for(["jog,Move,3.5,9,", "jog,Move,3,9,", "jog,DoNotChoose,,9,"], {"jog": 3.0})
    assert told == (
        'marks.csv, line 2, column "from": the span starts at 3.5 s, behind the end of the clip. Accepted: times up to 3 s.'
    )


def test_a_span_that_begins_behind_the_last_frame_at_the_rate_and_goes_on_to_the_end_is_not_told():
    """A clip of 120 frames a second ends up to a frame behind the last one at 30; `prepare` marks what it sees there."""
    assert told_for(["jog,Contact.Left,3.025,,"], {"jog": 3.0}, rate=30.0) == []
    assert "behind the end of the clip" in told_for(["jog,Contact.Left,3.04,,"], {"jog": 3.0}, rate=30.0)[0]


def test_a_pattern_is_measured_by_the_longest_clip_that_fits():
    durations_s = {"jog_a": 1.0, "jog_b": 4.0}
    assert told_for(["jog_*,Move,3.5,9,"], durations_s) == []
    assert "behind the end of the longest clip" in told_for(["jog_*,Move,4.5,9,"], durations_s)[0]


def test_with_a_rate_a_span_between_two_frames_is_told():
    lines = ["jog,MatchRange,0.51,0.52,", "jog,Move,0.5,0.5,", "jog,DoNotChoose,0.51,0.54,"]
    (told,) = told_for(lines, {"jog": 3.0}, rate=30.0)
    assert "line 2" in told
    assert "is between two frames and contains none" in told
    assert told_for(lines, {"jog": 3.0}) == []


def test_patterns_that_contradict_each_other_on_an_asset_are_told():
    lines = ["jog_*,RootMotionWeight,0,2,0.2", "*_left,RootMotionWeight,1,3,0.4", "jog_*,WarpPosition,0,1,", "*,WarpPosition,1,2,"]
    told = told_for(lines, {"jog_left": 3.0, "jog_right": 3.0, "walk_left": 3.0})
    assert len(told) == 2
    assert 'line 3, column "value": for the asset "jog_left": on some frames line 2 says 0.2 and this 0.4' in told[0]
    assert "line 5" in told[1]


def test_right_markup_has_no_faults():
    lines = ["jog,RootMotionWeight,,,0.5", "*,RootMotionWeight,,,0.25", "jog,NextNaturalOnly,1,2,0.1", "*,Move,,,"]
    assert told_for(lines, {"jog": 3.0, "walk": 2.0}, rate=30.0) == []
