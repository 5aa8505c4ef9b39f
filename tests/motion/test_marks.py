"""Markup on frames: spans become kinds of frames, and filters choose among them. The oracle asks every span about every frame."""

import math
import pickle

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from contextdb.errors import MotionError, QueryError
from contextdb.motion.markup.left_out import LeftOut
from contextdb.motion.markup.marking import marks_of
from contextdb.motion.markup.marks import ANY_TAGS, Mark, Marks, TagFilter, covers
from contextdb.motion.markup.markup import Markup
from contextdb.motion.markup.reserved import ReservedTag
from contextdb.motion.markup.span_faults import TOLERANCE_S, Span, fits

# ---- the oracle: one frame and one span at a time


def time_of(i, rate):
    return i / rate


def holds(span, asset, i, rate):
    return fits(span.asset, asset) and span.from_s - TOLERANCE_S <= time_of(i, rate) <= span.to_s + TOLERANCE_S


def spans_at(markup, asset, i, rate, tag):
    return [span for span in markup.spans if span.tag == tag and holds(span, asset, i, rate)]


def mark_at(markup, asset, i, length, rate, end_s):
    mark = Mark(0)
    for tag, flag in (("Excluded", Mark.EXCLUDED), ("DoNotChoose", Mark.DO_NOT_CHOOSE), ("NextNaturalOnly", Mark.NEXT_NATURAL)):
        if spans_at(markup, asset, i, rate, tag):
            mark |= flag
    for span in spans_at(markup, asset, i, rate, "NextNaturalOnly"):
        is_first = i == 0 or not holds(span, asset, i - 1, rate)
        if not is_first and time_of(i, rate) > span.from_s + (span.value or 0.0) + TOLERANCE_S:
            mark |= Mark.PAST_ENTRY
    declared = any(span.tag == "MatchRange" and fits(span.asset, asset) for span in markup.spans)
    if not declared or spans_at(markup, asset, i, rate, "MatchRange"):
        mark |= Mark.MATCH_RANGE
    is_late = time_of(i, rate) > time_of(length - 1, rate) - end_s + TOLERANCE_S
    if is_late and i > 0 and not is_looping(markup, asset):
        mark |= Mark.CLIP_END
    return mark


def is_looping(markup, asset):
    return any(span.tag == "Looping" and fits(span.asset, asset) for span in markup.spans)


def weight_at(markup, asset, i, rate):
    found = spans_at(markup, asset, i, rate, "RootMotionWeight")
    named = [span for span in found if "*" not in span.asset] or found
    return max(named, key=lambda span: span.from_s).value if named else 1.0


def left_out_of(mark, tags, wanted, in_match_range):
    """The reason of least number."""

    def has(tag):
        return any(covers(tag, other) for other in tags)

    passes = (
        (not wanted.include or any(map(has, wanted.include))) and all(map(has, wanted.every)) and not any(map(has, wanted.exclude))
    )
    reasons = {
        LeftOut.EXCLUDED: Mark.EXCLUDED in mark,
        LeftOut.DO_NOT_CHOOSE: Mark.DO_NOT_CHOOSE in mark,
        LeftOut.NEXT_NATURAL: Mark.PAST_ENTRY in mark,
        LeftOut.CLIP_END: Mark.CLIP_END in mark,
        LeftOut.TAGS: not passes,
        LeftOut.MATCH_RANGE: in_match_range and Mark.MATCH_RANGE not in mark,
    }
    return min((why for why, it_holds in reasons.items() if it_holds), default=LeftOut.NO)


def bias_of(tags, wanted):
    def has(tag):
        return any(covers(tag, other) for other in tags)

    return sum(cost for tag, cost in wanted.prefer if not has(tag)) + sum(cost for tag, cost in wanted.avoid if has(tag))


# ---- random markup

ASSETS = ("jog", "jog_left", "walk")
PLAIN = ("Move", "Move.Run", "Move.Run.Fast", "HipFire", "Moved")
RATES = (1.0, 7.5, 30.0, 59.94)
times = st.sampled_from([0.0, 0.1, 1 / 3, 0.333333, 0.5, 0.6, 1.0, 1.2, 2.0]) | st.floats(0.0, 2.5)
values = {
    "NextNaturalOnly": st.none() | times,
    "CostModifier": st.floats(-10.0, 10.0),
    "RootMotionWeight": st.sampled_from([0.0, 0.25, 1.0]),
}


@st.composite
def a_span(draw):
    asset = draw(st.sampled_from([*ASSETS, "*", "jog*"]))
    tag = draw(st.sampled_from([*PLAIN, *ReservedTag]))
    if tag == "Looping":
        return Span(asset, tag)
    from_s = draw(times)
    to_s = draw(st.just(math.inf) | times.map(lambda length: from_s + length))
    value = draw(values[tag]) if tag in values else None
    return Span(
        asset, tag, from_s, to_s, None if value is None else min(value, to_s - from_s) if tag == "NextNaturalOnly" else value
    )


@st.composite
def marked(draw):
    """Markup that holds together, ranges, a rate and an end."""
    kept: list[Span] = []
    for span in draw(st.lists(a_span(), max_size=10)):
        try:
            markup = Markup((*kept, span))
        except MotionError:
            continue
        if not any(markup.conflicts_of(asset) for asset in ASSETS):
            kept.append(span)
    assets = draw(st.lists(st.sampled_from([*ASSETS, "swim"]), max_size=4))
    stops, starts, at = [], [], 0
    for _ in assets:
        starts.append(at + draw(st.integers(0, 2)))
        at = starts[-1] + draw(st.integers(0, 40))
        stops.append(at)
    n_frames = at + draw(st.integers(0, 2))
    end_s = draw(st.sampled_from([0.0, 0.1, 0.3, 1.0, 50.0]))
    return (
        Markup(tuple(kept)),
        assets,
        np.array(starts, np.int64),
        np.array(stops, np.int64),
        draw(st.sampled_from(RATES)),
        end_s,
        n_frames,
    )


def marks_of_case(case):
    markup, assets, starts, stops, rate, end_s, n_frames = case
    return marks_of(markup, assets, starts, stops, rate, end_s, n_frames=n_frames)


def frames_of(case):
    """Frame, its asset, its place in the range, and the range's length."""
    _, assets, starts, stops, *_ = case
    for asset, start, stop in zip(assets, starts.tolist(), stops.tolist(), strict=True):
        for frame in range(start, stop):
            yield frame, asset, frame - start, stop - start


# ---- properties


@given(marked())
def test_a_frame_is_marked_as_asking_every_span_tells(case):
    markup, _, _, _, rate, end_s, n_frames = case
    marks = marks_of_case(case)
    within = set()
    for frame, asset, i, length in frames_of(case):
        within.add(frame)
        assert marks.mark_of(frame) == mark_at(markup, asset, i, length, rate, end_s)
        assert marks.tags_of(frame) == tuple(tag for tag in markup.tags if spans_at(markup, asset, i, rate, tag))
        assert marks.bias(frame) == math.fsum(span.value for span in spans_at(markup, asset, i, rate, "CostModifier"))
        assert marks.root_weight(frame) == weight_at(markup, asset, i, rate)
    assert all(marks.kinds[frame] == 0 for frame in range(n_frames) if frame not in within)
    assert len(marks.kinds) == n_frames


@given(marked())
def test_no_two_kinds_say_the_same_and_the_first_says_nothing(case):
    marks = marks_of_case(case)
    rows = [
        (marks.kind_tags[k].tobytes(), int(marks.kind_marks[k]), float(marks.kind_biases[k]), float(marks.kind_root_weights[k]))
        for k in range(marks.n_kinds)
    ]
    assert len(set(rows)) == marks.n_kinds
    assert rows[0] == (bytes(len(marks.tags)), int(Mark.MATCH_RANGE), 0.0, 1.0)
    assert set(marks.kinds.tolist()) | {0} == set(range(marks.n_kinds))


@given(marked())
def test_looping_and_warps_are_those_of_the_spans_and_end_with_their_range(case):
    markup, assets, starts, stops, rate, _, _ = case
    marks = marks_of_case(case)
    assert marks.looping.tolist() == [is_looping(markup, asset) for asset in assets]
    for i, asset in enumerate(assets):
        last_s = (int(stops[i] - starts[i]) - 1) / rate
        for at, tag in enumerate(("WarpPosition", "WarpRotation")):
            fitting = [span for span in markup.spans if span.tag == tag and fits(span.asset, asset)]
            span = next((span for span in fitting if span.asset == asset), fitting[0] if fitting else None)
            if span is None or span.from_s > last_s + TOLERANCE_S:
                assert np.isnan(marks.warps[i, at]).all()
            else:
                assert marks.warps[i, at].tolist() == [min(span.from_s, last_s), min(span.to_s, last_s)]


names = st.lists(st.sampled_from(PLAIN), max_size=2)
penalties = st.dictionaries(st.sampled_from(PLAIN), st.floats(0.0, 100.0), max_size=2)
filters = st.builds(TagFilter, names, names, names, penalties, penalties)


@given(marked(), filters, st.booleans())
def test_a_filter_leaves_out_and_charges_what_asking_every_tag_tells(case, wanted, in_match_range):
    marks = marks_of_case(case)
    assume(all(any(covers(tag, known) for known in marks.tags) for tag in wanted.names))
    why, added, playable = marks.left_out(wanted, in_match_range=in_match_range), marks.tag_biases(wanted), marks.playable()
    for kind in range(marks.n_kinds):
        mark = Mark(int(marks.kind_marks[kind]))
        tags = [tag for tag, it_has in zip(marks.tags, marks.kind_tags[kind], strict=True) if it_has]
        assert why[kind] == left_out_of(mark, tags, wanted, in_match_range)
        assert added[kind] == pytest.approx(bias_of(tags, wanted), abs=1e-12)
        assert playable[kind] == (Mark.EXCLUDED not in mark)


# ---- scenarios


def one_clip(*spans, length=31, rate=30.0, end_s=0.0, asset="jog"):
    return marks_of(Markup(spans), [asset], [0], [length], rate, end_s)


def frames_with(marks, mark):
    return np.flatnonzero(marks.kind_marks[marks.kinds] & mark).tolist()


def test_a_third_of_a_second_need_not_be_typed_to_the_last_digit():
    assert frames_with(one_clip(Span("jog", "DoNotChoose", 0.333334, 0.366666)), Mark.DO_NOT_CHOOSE) == [10, 11]


def test_more_kinds_than_fit_16_bits_take_32():
    n = 33_000  # each span holds three frames and shares the last with the next: two kinds of frames a span
    spans = tuple(Span("jog", "CostModifier", 0.02 * i, 0.02 * i + 0.02, math.sqrt(i + 2)) for i in range(n))
    few = marks_of(Markup(spans[:9]), ["jog"], [0], [2 * n], 100.0)
    many = marks_of(Markup(spans), ["jog"], [0], [2 * n], 100.0)
    assert (few.kinds.dtype, many.kinds.dtype) == (np.uint16, np.int32)
    assert many.n_kinds > 1 << 16
    assert many.bias(2 * n - 2) == math.fsum([math.sqrt(n), math.sqrt(n + 1)])


def test_what_is_said_of_a_frame_is_told_in_the_words_of_the_file():
    marks = one_clip(
        Span("jog", "Move.Run"),
        Span("jog", "DoNotChoose", 0.5),
        Span("jog", "NextNaturalOnly", 0.5, 1.0, 0.1),
        Span("jog", "CostModifier", 0.9, 1.0, 0.5),
        Span("jog", "RootMotionWeight", 0.9, 1.0, 0.25),
        end_s=0.1,
    )
    assert marks.events(0) == ("Move.Run",)
    assert marks.events(15) == ("Move.Run", "DoNotChoose", "NextNaturalOnly entry")
    last = ("Move.Run", "DoNotChoose", "ClipEnd", "NextNaturalOnly", "CostModifier 0.5", "RootMotionWeight 0.25")
    assert marks.events(30) == last


def test_without_markup_nothing_is_said_but_ends():
    marks = marks_of(None, ["jog"], [0], [31], 30.0, 0.3)
    assert marks.tags == ()
    assert frames_with(marks, Mark.CLIP_END) == list(range(22, 31))
    plain, none = marks_of(None, ["jog"], [0], [31], 30.0), Marks.none(31, 1)
    for name in ("kinds", "kind_tags", "kind_marks", "kind_biases", "kind_root_weights", "looping", "warps"):
        np.testing.assert_array_equal(getattr(plain, name), getattr(none, name))
        assert getattr(plain, name).dtype == getattr(none, name).dtype


def test_a_database_without_ranges_has_marks_too():
    assert marks_of(None, [], [], [], 30.0, n_frames=3).kinds.tolist() == [0, 0, 0]
    assert marks_of(None, [], [], [], 30.0).n_kinds == 1


# ---- bad input


@pytest.mark.parametrize(
    ("rate", "end_s"), [(0.0, 0.0), (math.nan, 0.0), (-30.0, 0.0), ("30", 0.0), (30.0, -0.1), (30.0, math.nan)]
)
def test_a_rate_or_an_end_that_is_none_is_refused(rate, end_s):
    with pytest.raises(MotionError, match="Accepted"):
        marks_of(None, ["jog"], [0], [10], rate, end_s)


def test_ranges_that_do_not_fit_are_refused():
    with pytest.raises(MotionError, match="the number of frames"):
        marks_of(None, ["jog"], [0], [10], 30.0, n_frames=9)
    with pytest.raises(MotionError, match="as many of each"):
        marks_of(None, ["jog", "walk"], [0], [10], 30.0)


def test_patterns_that_contradict_each_other_on_an_asset_are_refused_when_the_asset_is_there():
    markup = Markup((Span("jog*", "WarpPosition", 0.0, 1.0), Span("*left", "WarpPosition", 1.0, 2.0)))
    marks_of(markup, ["jog", "left"], [0, 10], [10, 20], 30.0)
    with pytest.raises(MotionError, match='for the asset "jog_left": span 0 gives'):
        marks_of(markup, ["jog_left"], [0], [10], 30.0)


@pytest.mark.parametrize("frame", [-1, 31, 1.5, True, None])
def test_a_frame_that_there_is_not_is_refused(frame):
    with pytest.raises(QueryError, match="a whole number from 0 to 30"):
        one_clip().mark_of(frame)


# ---- filters


def test_a_filter_takes_lists_mappings_and_one_name_alone():
    wanted = TagFilter(include=["Move", "Move"], exclude="HipFire", prefer={"B": 5, "A": 1.0})
    assert wanted.include == ("Move",)
    assert wanted.exclude == ("HipFire",)
    assert wanted.prefer == (("A", 1.0), ("B", 5.0))
    assert wanted.names == ("Move", "HipFire", "A", "B")
    assert wanted.text == "include Move; exclude HipFire; prefer A ~1; prefer B ~5"
    assert ANY_TAGS.text == "any"


def test_equal_filters_are_one_key():
    one, other = TagFilter(["A"], prefer={"B": 1.0, "C": 2.0}), TagFilter(("A",), prefer=[("C", 2.0), ("B", 1.0)])
    assert one == other
    assert hash(one) == hash(other)


@pytest.mark.parametrize(
    ("given_", "said"),
    [
        ({"include": [5]}, "include holds 5"),
        ({"every": [""]}, "every holds ''"),
        ({"exclude": None}, "exclude holds None"),
        ({"prefer": {"A": math.nan}}, 'prefer["A"] is nan. Accepted: a cost from 0 to 1e+30.'),
        ({"prefer": {"A": math.inf}}, 'prefer["A"] is inf'),
        ({"prefer": {"A": "5"}}, "prefer[\"A\"] is '5'"),
        ({"prefer": {"A": -5.0}}, 'a penalty below 0. Accepted: a cost from 0 to 1e+30. Did you mean avoid={"A": 5}?'),
        ({"avoid": {"A": 1e31}}, "Did you mean exclude or every"),
        ({"avoid": "A"}, "avoid is 'A'"),
        ({"avoid": 5.0}, "avoid is 5.0"),
        ({"prefer": {3: 5.0}}, "prefer holds 3"),
    ],
)
def test_a_filter_that_cannot_be_meant_is_refused(given_, said):
    with pytest.raises(QueryError) as caught:
        TagFilter(**given_)
    assert said in str(caught.value)


def test_all_faults_of_a_filter_are_told_together():
    with pytest.raises(QueryError) as caught:
        TagFilter(include=[5], prefer={"A": -1.0, "B": math.nan})
    assert len(caught.value.faults) == 3


def test_a_tag_that_the_markup_does_not_know_is_refused_with_the_nearest():
    marks = one_clip(Span("walk", "HipFire"), Span("walk", "Move.Run"))
    assert marks.tags == ("HipFire", "Move.Run")  # also those that no frame here has
    assert marks.left_out(TagFilter("Move")).tolist() == [LeftOut.TAGS]
    for ask in (marks.left_out, marks.tag_biases):
        with pytest.raises(QueryError, match=r'there is no tag "HipFier".*Did you mean "HipFire"'):
            ask(TagFilter(avoid={"HipFier": 1.0}, include="HipFier"))


def test_answers_to_a_filter_are_kept_and_cannot_be_written_to():
    marks = one_clip(Span("jog", "Move", 0.0, 0.5))
    wanted = TagFilter("Move", prefer={"Move": 2.0})
    assert marks.left_out(wanted) is marks.left_out(TagFilter("Move", prefer={"Move": 2.0}))
    assert marks.tag_biases(wanted) is marks.tag_biases(wanted)
    for array in (marks.left_out(wanted), marks.tag_biases(wanted), marks.playable(), marks.kinds, marks.kind_tags):
        with pytest.raises(ValueError, match="read-only"):
            array[...] = 0


def test_marks_can_be_sent_to_another_process_with_answers_kept():
    marks = one_clip(Span("jog", "Move", 0.0, 0.5))
    marks.left_out(TagFilter("Move"))
    sent = pickle.loads(pickle.dumps(marks))
    assert sent.left_out(TagFilter("Move")).tolist() == marks.left_out(TagFilter("Move")).tolist()
    assert sent.kinds.tolist() == marks.kinds.tolist()
