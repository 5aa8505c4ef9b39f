"""What the core takes over for poses and paths is checked there: no index that comes from an array leads out of another one."""

import numpy as np
import pytest
from played import bank
from strategies import for_each

from contextdb import core
from contextdb.motion import PoseSettings
from contextdb.motion.output import pipeline as pipelines
from contextdb.motion.output.ground import below
from contextdb.motion.output.pose import N_MADE

RIG = bank().skeleton
LEGS = pipelines.legs_of(RIG, bank().feet)
WRONG_ARRAYS = [
    ("rotations", lambda a: a.astype(np.float64)),
    ("rotations", lambda a: a[:-1]),
    ("rotations", lambda a: a[::2]),
    ("positions", lambda a: a[..., :2].copy()),
    ("contacts", lambda a: a.astype(np.int8)),
    ("starts", lambda a: a + 1),
    ("starts", lambda a: a - 1),
    ("n_steps", lambda a: a + 1),
    ("n_steps", lambda a: np.full_like(a, 2**62)),
    ("n_steps", lambda a: np.full_like(a, -1)),
    ("rate", lambda a: 0.0),
    ("rate", lambda a: float("nan")),
    ("steps", lambda a: np.zeros((3, 2, 3))),
]
WRONG_BONES = [
    ("parents", lambda a: np.roll(a, 1)),
    ("parents", lambda a: a + 100),
    ("places", lambda a: a + 9),
    ("places", lambda a: a - 1),
    ("legs", lambda a: a + 100),
    ("legs", lambda a: a - 99),
    ("legs", lambda a: np.zeros_like(a)),
    ("hinges", lambda a: a[:1]),
    ("tops", lambda a: np.array([-1])),
    ("tops", lambda a: np.array([RIG.n_joints])),
    ("spine", lambda a: a + 100),
    ("left", lambda a: a[1:]),
    ("n_moving", lambda a: a + 1),
    ("settings", lambda a: {}),
    ("settings", lambda a: a | {"root": "code"}),
    ("banks", lambda a: (bank(),)),
]


def frames(**changed):
    own = bank()
    given = {
        **{key: np.ascontiguousarray(getattr(own, key)) for key in ("rotations", "positions", "root")},
        **{
            "ways": np.ascontiguousarray(own._ways),
            "contacts": np.ascontiguousarray(own.contacts),
            "steps": None,
            "starts": own.starts,
        },
        **{"n_steps": own.stops - own.starts - 1, "looping": own.looping, "rate": own.rate},
    }
    return core.PoseFrames(*(given | {key: change(given[key]) for key, change in changed.items()}).values())


def poses(**changed):
    spine = pipelines.spine_of(bank())
    parents, offsets, places = bank().joints
    given = {
        **{"parents": parents, "offsets": offsets, "places": places, "legs": LEGS},
        **{"hinges": pipelines.hinges_of(RIG, LEGS, bank().rotations), "tops": np.array(pipelines.tops_of(RIG))},
        **{"spine": spine.joints, "left": spine.left, "most_accel": 60.0, "n_moving": len(bank().moving)},
        **{"settings": pipelines.numbers_of(PoseSettings()), "banks": (frames(),)},
    }
    return core.Poses(*(given | {key: change(given[key]) for key, change in changed.items()}).values())


@pytest.mark.parametrize(("name", "change"), WRONG_ARRAYS)
def test_frames_that_do_not_go_together_are_refused(name, change):
    frames()
    with pytest.raises((ValueError, TypeError, BufferError)):
        frames(**{name: change})


@pytest.mark.parametrize(("name", "change"), WRONG_BONES)
def test_a_rig_that_does_not_go_with_its_banks_is_refused(name, change):
    poses()
    with pytest.raises((ValueError, TypeError)):
        poses(**{name: change})


def slope(x, z):
    return 0.1 * z, (0.0, 0.995, -0.0995)


def updated(own, at=0, number=0.0, **changed):
    """An update of two characters, with one number of what plays another one."""
    n, joints, feet = 2, RIG.n_joints, len(bank().feet)
    before = np.empty((n, own.width))
    for row in before:
        own.begin(row)
    plays = np.zeros((n, pipelines.N_PLAY))
    plays[1, at] = number
    made = np.empty(n * (N_MADE + 10 * joints))
    arrays = {
        **{"before": before, "plays": plays, "places": None, "dt": 0.1, "grounds": None, "after": np.empty_like(before)},
        **{"displayed": np.empty((n, 3)), "roots": np.empty((n, 3)), "made": made},
        **{"contacts": np.empty((n, feet), np.bool_), "moves_body": np.empty(n, np.bool_), "ask": below},
    }
    own.update(*(arrays | changed).values())
    return made[n * N_MADE :]


@pytest.mark.parametrize("at", [0, 3, 6])
@pytest.mark.parametrize(("number", "apart"), [(1.0, 0), (np.inf, 0), (-1.0, 1), (1e300, 1), (np.nan, 1)])
def test_a_moment_that_is_not_there_is_refused(at, number, apart):
    """Of what plays, would play or was displayed: another bank, another range."""
    own = poses()
    assert np.isfinite(updated(own)).all()
    with pytest.raises(ValueError, match="is in no bank"):
        updated(own, at + apart, number)


@pytest.mark.parametrize(
    "changed",
    [
        {"before": np.zeros((2, 5))},
        {"plays": np.zeros((2, 5))},
        {"after": np.zeros((1, 5))},
        {"displayed": np.zeros((2, 2))},
        {"made": np.zeros(7)},
        {"contacts": np.zeros((2, 2))},
        {"moves_body": np.zeros(2)},
        {"places": np.zeros((1, 3))},
        {"roots": np.broadcast_to(0.0, (2, 3))},
        {"dt": "soon"},
    ],
)
def test_arrays_of_another_shape_are_refused(changed):
    with pytest.raises((ValueError, TypeError, BufferError)):
        updated(poses(), **changed)


@pytest.mark.parametrize("ask", [1, lambda _, points: [], lambda _, points: [None] * len(points), lambda *_: 1 / 0])
@pytest.mark.parametrize("grounds", [slope, (slope, slope), (slope,)])
def test_a_ground_that_gives_no_heights_is_refused(ask, grounds):
    with pytest.raises((ValueError, TypeError, IndexError, ZeroDivisionError)):
        updated(poses(), 15, 1.0, grounds=grounds, ask=ask)


@pytest.mark.parametrize("number", [np.nan, np.inf, -1e300])
def test_numbers_that_no_game_gives_lead_nowhere(number):
    """Of a second, a rate and a movement that are none: what comes out is no pose, and nothing else is written or read."""
    for at in (2, 5, 8, 9, 10, 11, 13, 14, 15, 16, 17):
        updated(poses(), at, number)


def written(positions, now=0, feature=(0, 0, 3)):
    """One feature of a path of three frames, in a query of five."""
    path = np.ascontiguousarray(positions[None, :3, :2])
    query = np.zeros((1, 5), np.float32)
    core.write_paths(path, np.zeros((1, 3)), now, 30.0, np.zeros(1), np.array([feature]), query)
    return query


@for_each(
    [
        lambda p, w, r: core.place_joints(RIG.parents + 1, p, r, np.zeros(3), p, w),
        lambda p, w, r: core.place_joints(RIG.parents, p, r, np.zeros(2), p, w),
        lambda p, w, r: core.bend_legs(RIG.parents, p[None], w[None], LEGS[0], p[:1], p[:1], 3.0, r[None]),
        lambda p, w, r: core.bend_legs(RIG.parents, p[None], w[None], np.array([0, 1, 99]), p[:1], p[:1], 3.0, r[None]),
        lambda p, w, r: core.lower_hips(p, LEGS + 99, p[:2], np.zeros((2, 9)), 0.0, np.zeros(2), 0.1),
        lambda p, w, r: core.stand_legs(RIG.parents, p, w, LEGS + 99, p[:2], p[:2], np.zeros((2, 9)), r),
        lambda p, w, r: core.feel_ground(np.zeros((2, 9)), np.zeros(2), p[:3], np.zeros(2), False, 0.1),
        lambda p, w, r: core.feel_ground(),
        lambda p, w, r: core.move_bodies(np.zeros((2, 10)), np.zeros((1, 3)), 0.1, np.zeros((2, 10))),
        lambda p, w, r: core.steer_paths(np.zeros((1, 10)), np.zeros((1, 3)), 30.0, 0, p[None, :, :2].copy(), p[:1]),
        lambda p, w, r: written(p, now=3),
        lambda p, w, r: written(p, now=-1),
        lambda p, w, r: written(p, feature=(0, 0, 4)),
        lambda p, w, r: written(p, feature=(0, 3, 5)),
        lambda p, w, r: written(p, feature=(0, 5, 0)),
        lambda p, w, r: written(p, feature=(0, 0, -1)),
        lambda p, w, r: core.Poses.update(poses()),
        lambda p, w, r: core.PoseFrames.__new__(core.PoseFrames).sample(0, 0.0, r, p, p, p, np.zeros(6)),
        lambda p, w, r: core.Poses.__new__(core.Poses).begin(np.zeros(3)),
        lambda p, w, r: frames().sample(99, 0.0, r, p, p, p, np.zeros(6)),
        lambda p, w, r: frames().accelerations(0, *bank().joints, 10**9, np.zeros(3)),
    ]
)
def test_parts_by_themselves_refuse_joints_that_are_not_there(wrong):
    positions, world, rotations = np.zeros((RIG.n_joints, 3)), np.zeros((RIG.n_joints, 4)), np.ones((RIG.n_joints, 4))
    written(positions)
    with pytest.raises((ValueError, TypeError)):
        wrong(positions, world, rotations)
