"""The search and the candidates against an oracle that looks at one frame after another."""

import math
import pickle
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from strategies import examples

from contextdb.errors import QueryError
from contextdb.motion.features.normalisation import Normalisation
from contextdb.motion.markup.left_out import LeftOut, Skip
from contextdb.motion.markup.marks import Mark, Marks, TagFilter
from contextdb.motion.search.database import Biases, MotionDatabase
from contextdb.motion.search.hit import Hit

TAGS = ("Move", "Move.Run", "Stop")
EIGHTHS = st.integers(-16, 16).map(lambda i: i / 8)  # sums of these and of their squares are exact: a tie is a tie


@st.composite
def marked_databases(draw):
    """A few hundred frames in ranges with gaps between them, several channels, kinds, biases: everything a search looks at."""
    rng = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    n_ranges, n_features = draw(st.integers(1, 9)), draw(st.integers(1, 12))
    lengths = rng.integers(0, draw(st.sampled_from([3, 20, 70])), n_ranges)
    gaps = rng.integers(0, 4, n_ranges + 1)
    stops = np.cumsum(lengths + gaps[:-1])
    starts = stops - lengths
    n_frames = int(stops[-1] + gaps[-1])
    walks = rng.integers(-2, 3, (n_frames, n_features)).cumsum(axis=0) / draw(st.sampled_from([1, 8]))
    order = rng.permutation(n_ranges)
    assets = [f"asset {i}" for i in rng.integers(0, max(1, n_ranges - 1), n_ranges)]
    plain = MotionDatabase.from_features(walks.astype(np.float32), starts[order], stops[order], assets)
    cuts = sorted({0, n_features, *rng.integers(0, n_features + 1, 2).tolist()})
    return replace(
        plain,
        slices=tuple(slice(a, b) for a, b in pairwise(cuts)),
        channel_names=tuple(f"channel {a}" for a in cuts[:-1]),
        weights=rng.choice([0.0, 0.5, 1.0, 2.0], len(cuts) - 1),
        marks=_marks(rng, n_frames, n_ranges),
        biases=Biases(*(rng.integers(-2, 3, 3) / 4).tolist()),
        normalisation=Normalisation(rng.integers(-2, 3, n_features).astype(float), rng.choice([0.5, 1.0, 2.0], n_features)),
    )


def _marks(rng, n_frames, n_ranges):
    n_kinds = int(rng.integers(1, 6))
    spans = np.repeat(rng.integers(0, n_kinds, n_frames), rng.integers(1, 20, n_frames))[:n_frames]
    return replace(
        Marks.none(n_frames, n_ranges),
        tags=TAGS,
        kinds=spans.astype(np.uint16),
        kind_tags=rng.random((n_kinds, len(TAGS))) < 0.5,
        kind_marks=np.where(rng.random(n_kinds) < 0.5, rng.integers(0, 64, n_kinds), Mark.MATCH_RANGE).astype(np.uint8),
        kind_biases=rng.integers(-2, 3, n_kinds) / 4,
        kind_root_weights=np.ones(n_kinds),
        looping=rng.random(n_ranges) < 0.5,
    )


@st.composite
def questions(draw, database):
    """A query and everything that may stand beside it."""
    rng = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    n_frames, n_ranges = database.n_frames, len(database.assets)
    often = draw(st.sampled_from([0.1, 0.5, 0.9]))
    given = {"query": np.array(draw(st.lists(EIGHTHS, min_size=database.n_features, max_size=database.n_features)))}
    if draw(st.booleans()) and n_frames:
        given["query"] = database.normalisation.undo(database.features[rng.integers(n_frames)])
    if draw(st.booleans()):
        given["valid"] = rng.random(n_ranges) < often
    if draw(st.booleans()):
        given["tags"] = draw(st.one_of(st.just(rng.random(n_frames) < often), tag_filters()))
    if draw(st.booleans()) and n_frames:
        given["current"] = int(rng.integers(-1, n_frames))
    if draw(st.booleans()):
        given["bias"] = rng.choice([0.0, -1.0, 0.25, 2.0, math.inf], n_frames)
    if draw(st.booleans()):
        edges = rng.integers(0, n_frames + 1, (2, 2))
        given["skip"] = [Skip(int(a), int(b), why) for (a, b), why in zip(edges, (LeftOut.JUMP, LeftOut.HISTORY), strict=True)]
    if draw(st.booleans()):
        given["penalties"] = rng.choice([0.0, 0.5, 3.0], n_ranges)
    given["in_match_range"] = draw(st.booleans())
    return given


def tag_filters():
    tags = st.lists(st.sampled_from(TAGS), max_size=1)
    costs = st.dictionaries(st.sampled_from(TAGS), st.sampled_from([0.5, 2.0]), max_size=2)
    return st.builds(TagFilter, include=tags, every=tags, exclude=tags, prefer=costs, avoid=costs)


def reason_of(database, frame, given):
    """Why one frame may not be chosen, rule by rule, the strongest first."""
    i = next((i for i, (a, b) in enumerate(zip(database.starts, database.stops, strict=True)) if a <= frame < b), None)
    if i is None or not given.get("valid", np.ones(len(database.assets), bool))[i]:
        return LeftOut.NOT_VALID
    tags, marks = given.get("tags"), database.marks
    kind = marks.kinds[frame]
    mark = marks.kind_marks[kind]
    has = {tag for tag, own in zip(TAGS, marks.kind_tags[kind], strict=True) if own}
    has |= {"Move"} & {tag.split(".")[0] for tag in has}
    is_listed = not isinstance(tags, np.ndarray) or tags[frame]
    plays_on = given.get("current") == frame and is_listed and not mark & Mark.EXCLUDED
    if not plays_on:
        for flag, why in (
            (Mark.EXCLUDED, LeftOut.EXCLUDED),
            (Mark.DO_NOT_CHOOSE, LeftOut.DO_NOT_CHOOSE),
            (Mark.PAST_ENTRY, LeftOut.NEXT_NATURAL),
            (Mark.CLIP_END, LeftOut.CLIP_END),
        ):
            if mark & flag:
                return why
        if isinstance(tags, TagFilter) and (
            (tags.include and not has & set(tags.include)) or set(tags.every) - has or has & set(tags.exclude)
        ):
            return LeftOut.TAGS
        if given["in_match_range"] and not mark & Mark.MATCH_RANGE:
            return LeftOut.MATCH_RANGE
        if not is_listed:
            return LeftOut.TAGS
        for skip in given.get("skip", ()):
            if skip.start <= frame < skip.stop:
                return skip.why
    return LeftOut.FORBIDDEN if "bias" in given and given["bias"][frame] == math.inf else LeftOut.NO


def cost_of(database, frame, given):
    """The cost of one frame, number by number in float64."""
    i = database.range_of(frame)
    total = 0.0
    for columns, weight in zip(database.slices, database.weights, strict=True):
        squares = 0.0
        for f in range(columns.start, columns.stop):
            wanted = (given["query"][f] - database.normalisation.offset[f]) / database.normalisation.scale[f]
            squares += (float(database.features[frame, f]) - wanted) ** 2
        total += weight * squares
    marks, tags = database.marks, given.get("tags")
    kind = marks.kinds[frame]
    bias = database.biases.base + (database.biases.looping if marks.looping[i] else 0.0) + marks.kind_biases[kind]
    bias += given["penalties"][i] if "penalties" in given else 0.0
    if isinstance(tags, TagFilter):
        bias += float(marks.tag_biases(tags)[kind])
    bias += float(given["bias"][frame]) if "bias" in given else 0.0
    bias += database.biases.continuing if given.get("current") == frame else 0.0
    return total + bias


def allowed_frames(database, given):
    """Every frame that may be chosen with its cost, cheapest first; on a tie the current one, then the lowest."""
    rows = [
        (cost_of(database, frame, given), frame != given.get("current"), frame)
        for frame in range(database.n_frames)
        if reason_of(database, frame, given) == LeftOut.NO
    ]
    return sorted(rows)


@examples(1.5)
@given(st.data())
def test_a_search_is_a_scan_of_all_frames_whatever_masks_tags_skips_and_biases_say(data):
    database = data.draw(marked_databases())
    given = data.draw(questions(database))
    expected = allowed_frames(database, given)
    hit = database.search(**given)
    if not expected:
        assert not hit
        return
    cost, _, frame = expected[0]
    assert (hit.frame, hit.cost) == (frame, pytest.approx(cost, rel=1e-12, abs=1e-12))
    assert database.starts[hit.range] <= frame < database.stops[hit.range]
    assert hit.asset == database.assets[hit.range]


@examples(1)
@given(st.data())
def test_candidates_begin_with_the_choice_and_every_frame_has_its_reason(data):
    database = data.draw(marked_databases())
    given = data.draw(questions(database))
    found = database.candidates(k=5, **given)
    hit = database.search(**given)
    expected = allowed_frames(database, given)
    assert [row.frame for row in found] == [frame for _, _, frame in expected[:5]]
    assert [(row.frame, row.cost) for row in found][:1] == [(h.frame, h.cost) for h in [hit] if h]
    for row in found:
        assert row.cost == pytest.approx(sum(row.channels.values()) + sum(row.biases.values()), abs=1e-9)
    reasons = [reason_of(database, frame, given) for frame in range(database.n_frames)]
    assert found.why.tolist() == reasons
    in_ranges = [reason for frame, reason in enumerate(reasons) if database.range_of(frame) >= 0 and reason != LeftOut.NO]
    assert found.counts == {reason: in_ranges.count(reason) for reason in set(in_ranges)}
    everything = database.candidates(k=10**6, left_out=True, **given)
    assert {row.frame: row.left_out for row in everything} == {
        frame: reason for frame, reason in enumerate(reasons) if database.range_of(frame) >= 0
    }


@examples(1)
@given(st.data())
def test_the_best_of_each_range_are_those_near_the_best_of_all(data):
    database = data.draw(marked_databases())
    given = data.draw(questions(database))
    within = data.draw(st.sampled_from([0.0, 0.5, 4.0, math.inf]))
    best = {}
    for cost, is_other, frame in allowed_frames(database, given):
        best.setdefault(database.range_of(frame), (cost, is_other, frame))
    least = min((cost for cost, _, _ in best.values()), default=math.inf)
    near = sorted(row for row in best.values() if row[0] <= least + within)
    hits = database.best_of_ranges(within=within, **given)
    assert [hit.frame for hit in hits] == [frame for _, _, frame in near]
    assert [hit.cost for hit in hits] == pytest.approx([cost for cost, _, _ in near], abs=1e-12)
    assert hits[:1] == [hit for hit in [database.search(**given)] if hit]


@given(st.data())
def test_many_characters_are_answered_like_each_alone(data):
    database = data.draw(marked_databases())
    asked = [data.draw(questions(database)) for _ in range(data.draw(st.integers(0, 4)))]
    queries = np.array([one["query"] for one in asked]).reshape(len(asked), database.n_features)
    masks, currents = [one.get("valid") for one in asked], [one.get("current") for one in asked]
    tags = asked[0].get("tags") if asked else None
    singly = [database.search(q, m, tags, c) for q, m, c in zip(queries, masks, currents, strict=True)]
    assert database.search_many(queries, masks, currents, tags) == singly


def test_a_weight_turned_to_zero_hides_no_frame_at_the_ends_of_float32():
    features = np.array([[3e38, 1.0], [-3e38, 0.0]], np.float32)
    plain = MotionDatabase.from_features(features, [0], [2], ["a"])
    database = replace(plain, slices=(slice(0, 1), slice(1, 2)), channel_names=("far", "near"), weights=np.array([0.0, 1.0]))
    assert database.search([3e38, 0.0]) == Hit("a", 0, 1, 0.0)


def test_a_frame_just_cheaper_than_another_is_found_where_float32_cannot_tell_them_apart():
    features = np.zeros((64, 2), np.float32)
    features[:, 0] = 1000.0
    features[40, 1] = 1e-4
    database = MotionDatabase.from_features(features, [0, 32], [32, 64], ["a", "b"])
    assert database.search([0.0, 1e-4]).frame == 40


@pytest.mark.parametrize("penalties", [[1.0], {"a": math.nan}, np.array([0.0, -math.inf])])
def test_penalties_that_do_not_fit_are_refused(penalties):
    database = MotionDatabase.from_features([[0.0], [1.0]], [0, 1], [1, 2], ["a", "b"])
    with pytest.raises(QueryError, match="penalties"):
        database.search([0.0], penalties=penalties)


def test_the_memory_of_a_search_is_a_fifth_more_than_the_features_at_most():
    rng = np.random.default_rng(0)
    lengths = rng.integers(100, 400, 60)
    stops = np.cumsum(lengths)
    features = rng.normal(size=(int(stops[-1]), 27)).astype(np.float32)
    database = MotionDatabase.from_features(features, stops - lengths, stops, [f"a{i}" for i in range(60)])
    assert database.layout.n_bytes + database.frames.n_bytes <= 1.2 * features.nbytes


def test_a_database_that_has_searched_can_be_sent_to_another_process():
    database = MotionDatabase.from_features(np.arange(40.0)[:, None], [0, 20], [20, 40], ["a", "b"])
    hit = database.search([30.2])
    copied = pickle.loads(pickle.dumps(database))
    assert copied.search([30.2]) == hit
