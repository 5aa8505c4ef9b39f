"""Parts of a motion search that do not go together, and numbers that are none: refused with what is accepted."""

import math

import numpy as np
import pytest
from made_once import make_clip

from contextdb.errors import MotionError, SchemaError
from contextdb.motion import Entry, MotionConfig, MotionDatabase, Selector, Steered
from contextdb.motion.walking.blending import Gait
from contextdb.motion.walking.cycle import Cycle


def database(n_features: int) -> MotionDatabase:
    return MotionDatabase.from_features(np.zeros((4, n_features), np.float32), [0], [4], ["Walk"])


@pytest.mark.parametrize("halflife_s", [0, -1.0, math.inf, math.nan, 10**400, "0.2", None])
@pytest.mark.parametrize("name", ["velocity_halflife_s", "heading_halflife_s"])
def test_a_halflife_is_a_number_of_seconds_above_0(name: str, halflife_s: object):
    with pytest.raises(MotionError, match=f"^{name} is .* Accepted: seconds above 0"):
        Steered(**{name: halflife_s})  # type: ignore[arg-type]


def test_a_selector_has_each_database_once_and_all_of_one_schema():
    with pytest.raises(MotionError, match='the database "all" appears twice in the selector'):
        Selector([Entry("all", database(2), 0.1), Entry("all", database(2))])
    with pytest.raises(MotionError, match='the databases "few" and "many" have different channels'):
        Selector([Entry("few", database(2), 0.1), Entry("many", database(3))])


def test_a_gait_has_one_steady_cycle_of_each_speed():
    cycle = Cycle.of(make_clip("walk").clip)
    with pytest.raises(MotionError, match=r"m/s fast\. Accepted: steady cycles of different speeds"):
        Gait("walk", [cycle, cycle])


def test_only_a_database_with_roles_is_of_joint_clips():
    sections = {
        "features": {"f": {"rate": 30.0, "channels": [{"type": "position", "bone": "Hips"}]}},
        "databases": {"alone": {"clips": "*.bvh", "features": "f"}},
    }
    with pytest.raises(SchemaError, match=r"\[databases.alone\] has no roles"):
        MotionConfig.from_dict(sections).joint("alone", database(2))
