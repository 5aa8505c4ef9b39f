"""What contextdb.toml may say of controllers, and what it may not."""

from __future__ import annotations

import pytest

from contextdb.errors import MotionError
from contextdb.motion.selection.controller_settings import ControllerSettings, read_controllers
from contextdb.motion.selection.variation import Variation


def read(**part):
    faults = []
    found = list(read_controllers({"player": {"selector": "loco", **part}}, ["loco"], faults, "contextdb.toml"))
    return found, [str(fault) for fault in faults]


def test_settings_are_read_from_the_project():
    keys = {"search_every_s": 0.0, "jump_threshold_s": 0.5, "history_s": 1, "variation_within": 0.05, "variation_memory": 2}
    found, faults = read(**keys)
    assert found == [("player", "loco", ControllerSettings(0.0, 0.5, 1.0, Variation(0.05, 2)))]
    assert faults == []
    guards = {"cost_bar": 2, "grace_s": 0.5, "until_natural": True}
    assert read(**guards)[0] == [("player", "loco", ControllerSettings(**guards))]
    assert read()[0] == [("player", "loco", ControllerSettings())]


@pytest.mark.parametrize(
    ("part", "message"),
    [
        ({"selector": "locos"}, 'there is no such selector. Accepted: "loco". Did you mean selector = "loco"?'),
        ({"search_every": 0.1}, 'has no key "search_every"'),
        ({"history_s": "0.3"}, 'history_s = "0.3": this is text, not a number'),
        ({"jump_threshold_s": -1}, "jump_threshold_s = -1: this is out of range"),
        ({"variation_memory": 2}, 'has "variation_memory", but without "variation_within" nothing varies'),
        ({"variation_within": 0.1, "variation_memory": 1.5}, "this is not a whole number. Accepted: a whole number from 0 to 1000"),
        ({"cost_bar": "high"}, 'cost_bar = "high": this is text, not a number. Accepted: a cost from 0 to 1e30, such as 1.0'),
        ({"grace_s": 61}, "grace_s = 61: this is out of range"),
        ({"grace": 0.2}, 'has no key "grace"'),
        ({"until_natural": "yes"}, 'until_natural = "yes": this is text, neither true nor false. Accepted: true or false'),
        ({"variation_within": True}, "variation_within = true: this is true or false, not a number"),
    ],
)
def test_settings_that_cannot_be_meant_are_told_with_the_nearest_mend(part, message):
    found, faults = read(**part)
    assert found == []
    assert len(faults) == 1
    assert message in faults[0]
    assert faults[0].startswith("contextdb.toml: [controllers.player]")


def test_settings_made_in_python_are_checked_too():
    with pytest.raises(MotionError, match=r"search_every_s is -1\.0\. Accepted: a number, 0 or more\.\nrate is 0\.0\."):
        ControllerSettings(search_every_s=-1.0, rate=0.0)
