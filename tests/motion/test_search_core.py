"""The search in C by itself: the same bits by all compilers and widths of registers, no byte read outside of its arrays, and no
more work than it needs."""

import os
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from c_compilers import PROGRAMS, SANITIZED, STRICT, c_compiler, compiled, ran, sanitizers, variants
from hypothesis import HealthCheck, given, seed, settings
from hypothesis import strategies as st
from strategies import IS_FULL
from test_search import marked_databases, questions

from contextdb.core import Frames
from contextdb.motion.search.database import MotionDatabase
from contextdb.motion.search.filters import ManyFilters, together

CORE = Path(__file__).parents[2] / "contextdb" / "core"
pytestmark = pytest.mark.skipif(os.name == "nt", reason="the options are those of gcc and clang")
Case = tuple[bytes, bytes]
"""The arrays of a search, and the bits of what the extension answers."""


def case_of(database: MotionDatabase, queries: Any, many: ManyFilters) -> Case:
    n, shared, lay, kinds = len(queries), many.shared, database.layout, database.marks.kinds
    spans, stops = many.skip_spans
    n_kinds, n_ranges = len(shared.kinds.allowed), len(database.assets)
    arrays = [
        *(
            lay.blocks,
            lay.order,
            lay.rank,
            lay.box_starts,
            lay.box_sizes,
            lay.box_ranges,
            lay.kinds_of_boxes(kinds),
            lay.range_boxes,
        ),
        *(kinds.astype(np.int32), database.normalisation.offset, database.normalisation.scale),
        np.array([0, *(columns.stop for columns in database.slices)], np.int64),
        database.cost_weights,
        np.sqrt(np.repeat(database.cost_weights, [columns.stop - columns.start for columns in database.slices])),
        np.ascontiguousarray(queries, np.float64),
        np.broadcast_to(many.ranges, (n, n_ranges)),
        np.broadcast_to(many.range_biases, (n, n_ranges)),
        *(shared.kinds.allowed, shared.kinds.biases, shared.kinds.playable),
        shared.frames if len(shared.frames) else np.ones(len(kinds), np.bool_),
        shared.frame_biases if len(shared.frame_biases) else np.zeros(len(kinds)),
        np.empty((0, 2), np.int64) if spans is None else spans,
        np.zeros(n + 1, np.int64) if stops is None else stops,
        *(many.currents, np.array([shared.continuing]), np.array([np.inf])),
    ]
    n_skips = 0 if spans is None else len(spans)
    sizes = [len(kinds), lay.n_features, len(lay.box_starts), n_ranges, len(database.slices), n_kinds, n, n_skips, 0]
    ranges, frames, totals = database._searcher.least_of_many(np.ascontiguousarray(queries, np.float64), many)
    given = b"".join(array.tobytes() for array in [np.array(sizes, np.int64), *arrays])
    return given, totals.tobytes() + frames.tobytes() + ranges.tobytes()


def drawn_cases(n: int) -> list[Case]:
    """Those that the tests of the search draw."""
    cases: list[Case] = []

    @seed(5)
    @settings(max_examples=n, database=None, deadline=None, suppress_health_check=list(HealthCheck))
    @given(st.data())
    def draw(data: st.DataObject) -> None:
        database = data.draw(marked_databases())
        asked = [data.draw(questions(database)) for _ in range(3)]
        queries = np.array([one.pop("query") for one in asked]).reshape(len(asked), database.n_features)
        filters = [database.filter(**one) for one in asked]
        for numbers in together(filters):
            cases.append(case_of(database, queries[numbers], ManyFilters.of([filters[i] for i in numbers])))

    draw()
    return cases


def walks(n_frames: int, n_features: int, n_queries: int) -> tuple[MotionDatabase, Any, ManyFilters]:
    """Frames that change slowly, in ranges of 250, and queries near some of them; every range may play for every other one."""
    rng = np.random.default_rng(11)
    features = (rng.normal(size=(n_frames, n_features)).cumsum(axis=0) / 8).astype(np.float32)
    starts = np.arange(0, n_frames, 250)
    database = MotionDatabase.from_features(features, starts, starts + 250, [f"a{i}" for i in range(len(starts))])
    queries = features[rng.integers(0, n_frames, n_queries)] + rng.normal(0.0, 0.2, (n_queries, n_features))
    masks = [np.arange(len(starts)) % (1 + i % 2) == 0 for i in range(n_queries)]
    return database, queries, ManyFilters.of([database.filter(mask) for mask in masks])


@pytest.fixture(scope="module")
def cases(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, bytes]:
    """A file of cases, and the bits of their answers."""
    drawn = [*drawn_cases(600 if IS_FULL else 60), case_of(*walks(5_000, 27, 70)), case_of(*walks(1_000, 200, 5))]
    file = tmp_path_factory.mktemp("searches") / "in"
    file.write_bytes(np.int64(len(drawn)).tobytes() + b"".join(given for given, _ in drawn))
    return file, b"".join(expected for _, expected in drawn)


def program(folder: Path, name: str, *command: str) -> Path:
    options = ["-std=c99", "-ffp-contract=off", *STRICT, "-Wno-unused-function"]
    return compiled([*command, *options], PROGRAMS / "search.c", folder / name, CORE, "-lm")


def test_all_compilers_and_widths_of_registers_give_the_same_costs_and_frames(cases: tuple[Path, bytes], tmp_path: Path):
    file, expected = cases
    counts, narrow = set(), "-DCDBM_NARROW"
    for number, command in enumerate(variants(("-O0",), ("-O3", narrow), ("-O3",), ("-O0", narrow))):
        counts.add(ran(program(tmp_path, f"search{number}", *command), file, tmp_path / "out"))
        assert (tmp_path / "out").read_bytes() == expected, command
    assert len(counts) == 1, "the same boxes are looked at, whatever the compiler"


def test_sanitizers_find_no_byte_read_outside_of_an_array(cases: tuple[Path, bytes], tmp_path: Path):
    compiler = c_compiler()
    if compiler is None or not sanitizers(compiler):
        pytest.skip("no compiler with sanitizers was found")
    for name, options in (("wide", ()), ("narrow", ("-DCDBM_NARROW",))):
        ran(program(tmp_path, name, compiler, *SANITIZED, *options), cases[0], tmp_path / "out")
        assert (tmp_path / "out").read_bytes() == cases[1]


def test_no_more_is_looked_at_than_it_takes(tmp_path: Path):
    if c_compiler() is None:
        pytest.skip("no C compiler was found")
    given, expected = case_of(*walks(20_000, 12, 100))
    (tmp_path / "in").write_bytes(np.int64(1).tobytes() + given)
    found = ran(program(tmp_path, "counting", str(c_compiler()), "-O2"), tmp_path / "in", tmp_path / "out")
    assert (tmp_path / "out").read_bytes() == expected
    looked_at = list(map(int, found.split()))
    assert all(n <= most for n, most in zip(looked_at, MOST, strict=True)), f"{looked_at}: pruning is lost"


MOST = (1_000, 1_200, 2_100, 700)
"""Clusters, groups, boxes and frames that 100 queries look at among 20,000 frames: 2,500 boxes."""


def parts_of_frames() -> list[Any]:
    """What `Frames` takes for two ranges of 10 frames of 2 features."""
    blocks, two = np.zeros((4, 2, 8), np.float32), np.arange(2, dtype=np.int64)
    boxes = (np.array([0, 8, 10, 18]), np.array([8, 2, 8, 2], np.int32), np.array([0, 0, 1, 1], np.int32), np.zeros(4, np.int32))
    weights = (np.array([0, 2]), np.ones(1), np.ones(2))
    return [blocks, two, two, *boxes, np.array([[0, 2], [2, 4]]), None, 20, 1, np.zeros(2), np.ones(2), *weights]


def test_arrays_that_do_not_go_together_are_refused_when_they_are_handed_over():
    good = parts_of_frames()
    assert Frames(*good).n_bytes > 0
    wrong: dict[int, list[Any]] = {
        0: [np.zeros((4, 2, 16), np.float32), np.zeros((4, 2, 8)), np.zeros((5, 2, 8), np.float32)],
        1: [np.array([0, 2]), np.array([-1, 0]), np.arange(3)],
        2: [np.array([0, 2]), np.arange(2, dtype=np.int32)],
        3: [np.array([0, 7, 10, 18]), np.array([0, 8, 10, 19]), np.array([-1, 8, 10, 18])],
        4: [np.array([9, 2, 8, 2], np.int32), np.array([0, 2, 8, 2], np.int32)],
        5: [np.array([0, 0, 1, 2], np.int32), np.array([0, 0, 0, 1], np.int32)],
        6: [np.array([0, 0, 0, 1], np.int32), np.array([0, 0, 0, -2], np.int32)],
        7: [np.array([[0, 2], [2, 5]]), np.array([[0, 2], [3, 4]]), np.array([[0, -1], [2, 4]])],
        8: [np.full(20, 1, np.int32), np.full(20, -1, np.int32), np.zeros(19, np.int32)],
        9: [19, -1],
        10: [0],
        13: [np.array([0, 3]), np.array([1, 0]), np.array([-1, 2])],
    }
    for place, values in wrong.items():
        for value in values:
            with pytest.raises(ValueError, match=r"array|go together"):
                Frames(*[value if i == place else part for i, part in enumerate(good)])
    with pytest.raises(TypeError):
        Frames(*good[:-1])


def test_a_search_with_arrays_of_another_shape_is_refused():
    database, queries, many = walks(500, 3, 1)
    frames = database.frames
    one = many.shared
    good = [queries[0], one.ranges, one.range_biases, one.kinds.allowed, one.kinds.biases, one.kinds.playable, None, None, None]
    good += [-1, 0.0, np.inf, np.empty(1), np.empty(1, np.int64)]
    assert frames.search(*good) >= 0
    for place in (*range(6), 12, 13):
        for array in (good[place][:-1], good[place].astype(np.int8), good[place][None], np.append(good[place], good[place])):
            with pytest.raises(ValueError, match=r"array|shape|go together|each range"):
                frames.search(*[array if i == place else part for i, part in enumerate(good)])
