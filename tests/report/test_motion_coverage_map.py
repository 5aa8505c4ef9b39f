"""The maps of motion coverage in a page: the round one is a disc as seen from above."""

import re

import numpy as np

from contextdb.motion.measuring.moves import MAPS
from contextdb.report.motion_coverage_document import html_map

ROUND, TURNS = MAPS["direction"], MAPS["turn"]
LEFT = [column.name for column in ROUND.columns].index("left")


def test_what_moves_to_the_left_is_at_the_left_of_the_disc_and_the_faster_the_farther_out():
    frames = np.zeros(ROUND.shape, np.int64)
    frames[[1, 3], LEFT] = 7, 9
    page = html_map(ROUND, frames, np.zeros(ROUND.shape), np.zeros(ROUND.shape))
    sectors = re.findall(r'<path class="none some" d="([^"]+)"><title>([^<]*)', page)
    assert [words.rpartition(": ")[2] for _, words in sectors] == ["7 frames", "9 frames"]
    slow, fast = ([float(x) for x in re.findall(r"[ML](-?[\d.]+) ", path)] for path, _ in sectors)
    assert max(slow) < 0.0
    assert min(fast) < min(slow)


def test_only_a_round_map_has_a_disc_and_colours_are_those_of_its_squares():
    frames = np.full(ROUND.shape, 5, np.int64)
    wanted = np.full(ROUND.shape, 0.5)
    page = html_map(ROUND, frames, wanted, wanted)
    assert page.count('<path class="c0"') == frames.size == page.count('class="square c0"')
    none = np.zeros(TURNS.shape)
    assert "<svg" not in html_map(TURNS, np.full(TURNS.shape, 5, np.int64), none, none)
