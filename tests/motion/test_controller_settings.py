"""What contextdb.toml may say of controllers, and what it may not."""

from contextdb.motion.selection.controller_settings import ControllerSettings, read_controllers
from contextdb.motion.selection.variation import Variation


def read(**part):
    faults = []
    found = list(read_controllers({"player": {"selector": "loco", **part}}, ["loco"], faults, "contextdb.toml"))
    return found, [str(fault) for fault in faults]


def test_settings_are_read_from_the_project():
    keys = {"search_every_s": 0.0, "jump_threshold_s": 0.5, "history_s": 1, "variation_within": 0.05, "variation_memory": 2}
    found, faults = read(**keys)
    assert found == [("player", "loco", (), ControllerSettings(0.0, 0.5, 1.0, Variation(0.05, 2)))]
    assert faults == []
    guards = {"cost_bar": 2, "grace_s": 0.5, "until_natural": True}
    assert read(**guards)[0] == [("player", "loco", (), ControllerSettings(**guards))]
    assert read()[0] == [("player", "loco", (), ControllerSettings())]
    assert read(joint=["tackles", "greetings"])[0] == [("player", "loco", ("tackles", "greetings"), ControllerSettings())]


def test_an_unknown_selector_and_a_memory_without_variation_are_reported():
    found, faults = read(selector="locos", variation_memory=2)
    assert found == []
    assert faults == [
        'contextdb.toml: [controllers.player] selector = "locos": there is no such selector. Accepted: "loco". '
        'Did you mean selector = "loco"?',
        'contextdb.toml: [controllers.player] has "variation_memory", but without "variation_within" nothing varies. '
        "Accepted: variation_within, a cost of 0 or more, such as 0.05.",
    ]
