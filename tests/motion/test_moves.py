"""How clips move, in bins: paths and made clips of known speed, turn and direction are in the bins that they were made for."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from made_once import make_clip
from strategies import for_each

from contextdb.motion import poses_of, root_trajectory, steady_path
from contextdb.motion.made.recipes import RECIPES
from contextdb.motion.measuring.moves import DIRECTION, MAPS, TURN, Moves

RATE = 30.0


def root_of(speed: float, turn: float = 0.0, direction: float = 0.0) -> np.ndarray:
    """The root of a body on a steady path: x, z and heading."""
    path = steady_path(speed, turn, strafe_deg=direction, reach_s=2.0, rate=RATE)
    return np.column_stack((path.positions, path.headings))


def bins_of(root: np.ndarray, name: str) -> dict[tuple[str, str], int]:
    """The bins of a map that frames are in, by the names of their row and column, and how many."""
    counts = Moves.of(root, RATE).counts(np.ones(len(root), np.bool_))[name]
    of = MAPS[name]
    return {(of.rows[r].name, of.columns[c].name): int(counts[r, c]) for r, c in np.argwhere(counts).tolist()}


@pytest.mark.parametrize(
    ("speed", "turn", "expected"),
    [
        (0.0, 0.0, ("stands", "straight")),
        (0.0, 90.0, ("stands", "left 70-135")),
        (1.3, 0.0, ("1-1.5", "straight")),
        (1.3, 45.0, ("1-1.5", "left 35-70")),
        (1.3, -45.0, ("1-1.5", "right 35-70")),
        (2.5, 20.0, ("2.1-3", "left 15-35")),
        (3.6, -180.0, ("3-4", "right 135+")),
        (9.0, 0.0, ("7+", "straight")),
    ],
)
def test_a_path_of_known_speed_and_turn_is_in_its_bin_of_turns(speed: float, turn: float, expected: tuple[str, str]):
    root = root_of(speed, turn)
    assert bins_of(root, TURN) == {expected: len(root)}


@pytest.mark.parametrize(
    ("direction", "expected"),
    [
        (0, "ahead"),
        (45, "ahead-left"),
        (90, "left"),
        (-90, "right"),
        (135, "back-left"),
        (180, "back"),
        (-180, "back"),
        (-45, "ahead-right"),
    ],
)
def test_a_path_of_known_direction_is_in_its_bin_of_directions(direction: float, expected: str):
    root = root_of(1.3, 0.0, direction)
    assert bins_of(root, DIRECTION) == {("1-1.5", expected): len(root)}


def test_a_path_that_goes_sideways_is_in_no_bin_of_turns():
    assert bins_of(root_of(1.3, 0.0, 90.0), TURN) == {}


def test_a_body_that_stands_is_in_no_bin_of_directions():
    assert bins_of(root_of(0.0), DIRECTION) == {}


@for_each([name for name, recipe in RECIPES.items() if recipe.change == "steady"])
def test_a_made_clip_is_in_the_bin_of_its_recipe(name: str):
    recipe = RECIPES[name]
    path = root_trajectory(poses_of(make_clip(name).clip, RATE))
    found = bins_of(np.column_stack((path.positions, path.headings)), TURN)
    (expected,) = bins_of(root_of(recipe.pace.speed_mps, recipe.turn_dps), TURN)
    assert found[expected] >= 0.9 * sum(found.values())


@given(
    st.lists(st.tuples(st.floats(-0.3, 0.3), st.floats(-0.3, 0.3), st.floats(-0.5, 0.5)), min_size=1, max_size=80),
)
def test_a_mirrored_path_is_in_the_bins_opposite(steps: list[tuple[float, float, float]]):
    root = np.cumsum(np.array(steps), axis=0)
    flipped = root * np.array([-1.0, 1.0, -1.0])
    plain, mirrored = (Moves.of(each, RATE).counts(np.ones(len(root), np.bool_)) for each in (root, flipped))
    for name, of in MAPS.items():
        assert (mirrored[name] == plain[name][:, of.opposite]).all()


@given(st.integers(1, 100), st.floats(0.0, 8.0), st.floats(-300.0, 300.0), st.floats(-180.0, 180.0))
def test_every_frame_is_in_at_most_one_bin_of_a_map(n: int, speed: float, turn: float, direction: float):
    root = root_of(speed, turn, direction)[:n]
    counts = Moves.of(root, RATE).counts(np.ones(len(root), np.bool_))
    assert all(found.sum() <= len(root) for found in counts.values())
    assert counts[TURN][0].sum() + counts[DIRECTION].sum() == len(root)


def test_frames_that_are_not_counted_are_in_no_bin():
    root = root_of(1.3)
    counted = np.arange(len(root)) < 10
    assert Moves.of(root, RATE).counts(counted)[TURN].sum() == 10


def test_the_maps_have_the_middle_of_each_bin_inside_it():
    for of in MAPS.values():
        for each in (*of.rows, *of.columns):
            assert each.low <= each.middle <= each.high
            assert math.isfinite(each.middle)
