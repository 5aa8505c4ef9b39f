"""A body that follows a stick, against small steps of the spring's own equation."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from contextdb.errors import MotionError
from contextdb.motion.clips.steering import Steered, steered_path

SPEEDS = st.floats(-5.0, 5.0)


@given(SPEEDS, SPEEDS, SPEEDS, st.floats(0.0, 2.0))
def test_one_long_step_leads_where_many_short_ones_of_the_equation_lead(velocity, acceleration, wanted, seconds):
    damping = 2.0 * math.log(2.0) / 0.27
    n, place, speed, change = 4000, 0.0, velocity, acceleration
    for _ in range(n):
        jerk = -2.0 * damping * change - damping**2 * (speed - wanted)
        place, speed, change = place + speed * seconds / n, speed + change * seconds / n, change + jerk * seconds / n
    body = Steered(velocity=(velocity, 0.0), acceleration=(acceleration, 0.0)).moved(seconds, (wanted, 0.0))
    assert (body.position[0], body.velocity[0]) == pytest.approx((place, speed), abs=0.03)


@given(st.floats(-10.0, 10.0), st.floats(-10.0, 10.0))
def test_it_turns_the_shorter_way_and_faces_where_it_goes(heading, direction):
    wanted = (math.sin(direction), math.cos(direction))
    body = Steered(heading=heading).moved(10.0, wanted)
    assert math.remainder(body.heading - direction, 2.0 * math.pi) == pytest.approx(0.0, abs=1e-4)
    assert abs(body.heading - heading) <= math.pi + 1e-6


PLACES = st.floats(-50.0, 50.0)
PAIRS = st.tuples(PLACES, PLACES)
HALFLIVES = st.floats(0.02, 2.0)
BODIES = st.builds(Steered, PAIRS, PAIRS, PAIRS, st.floats(-9.0, 9.0), SPEEDS, HALFLIVES, HALFLIVES)


def path_step_by_step(past, wanted, facing, reach_s, rate):
    """The bodies of a path one by one, each a long step from the present."""
    future = [past[-1].moved(i / rate, wanted, facing) for i in range(1, math.ceil(reach_s * rate) + 1)]
    bodies = [*past, *future]
    return np.array([body.position for body in bodies]), np.unwrap([body.heading for body in bodies])


@given(
    st.lists(BODIES, min_size=1, max_size=3),
    PAIRS,
    st.none() | st.floats(-9.0, 9.0),
    st.floats(0.0, 2.0),
    st.sampled_from([10.0, 30.0, 60.0]),
)
def test_a_path_is_what_each_of_its_moments_is_alone(past, wanted, facing, reach_s, rate):
    path = steered_path(past, wanted, facing, reach_s=reach_s, rate=rate)
    positions, headings = path_step_by_step(past, wanted, facing, reach_s, rate)
    assert path.positions == pytest.approx(positions, rel=1e-12, abs=1e-12 * 2e3)
    assert path.headings == pytest.approx(headings, rel=1e-12, abs=1e-12)


def test_standing_it_keeps_its_facing_unless_told():
    assert Steered(heading=1.0).moved(1.0, (0.0, 0.0)).heading == 1.0
    assert Steered(heading=1.0).moved(10.0, (0.0, 0.0), facing=2.0).heading == pytest.approx(2.0)


def test_a_path_holds_the_past_the_present_and_what_will_be_if_the_stick_stays():
    past = [Steered(position=(0.0, i / 30.0), velocity=(0.0, 1.0)) for i in range(5)]
    path = steered_path(past, (0.0, 1.0), reach_s=0.5)
    assert (path.now, len(path.headings)) == (4, 20)
    assert path.positions[:, 1] == pytest.approx([i / 30.0 for i in range(20)])
    with pytest.raises(MotionError, match="there is no body to steer"):
        steered_path([], (0.0, 1.0))


def test_a_spring_needs_time():
    with pytest.raises(MotionError, match=r"velocity_halflife_s is 0\.0\. Accepted: seconds above 0"):
        Steered(velocity_halflife_s=0.0)
