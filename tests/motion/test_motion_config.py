"""The sections features, databases and selectors of contextdb.toml, from reading to a search."""

import copy

import pytest
from made_once import make_clip
from strategies import for_each

from contextdb.errors import ClipError, MotionError, SchemaError
from contextdb.motion import MotionConfig, PoseSettings, query_from, steady_path, write_bvh
from contextdb.motion.selection.choice import Reason
from contextdb.motion.selection.controller_settings import ControllerSettings
from contextdb.motion.storage.building import build
from contextdb.motion.storage.database_settings import DatabaseSettings

SECTIONS = {
    "features": {
        "loco": {
            "rate": 30.0,
            "channels": [
                {"type": "position", "bone": "LeftFoot", "weight": 0.75},
                {"type": "velocity", "bone": "Hips", "weight": 1.0},
                {"type": "trajectory", "what": "position", "at": [0.33, 0.67, 1.0], "weight": 1.0},
                {"type": "trajectory", "what": "direction", "along": [0.5, 1.0, 2.0], "weight": 1.5},
            ],
        }
    },
    "databases": {
        "jog": {"table": "locomotion", "clips": "clips/*.bvh", "features": "loco"},
        "jog_tired": {"clips": "clips/*_tired.bvh", "features": "loco"},
    },
    "selectors": {"locomotion": {"order": [{"database": "jog_tired", "threshold": 0.1}, {"database": "jog"}]}},
    "conditions": {"other sections": "are passed over"},
}


@pytest.fixture
def folder(tmp_path):
    (tmp_path / "clips").mkdir()
    for name in ("walk", "jog", "jog_tired", "idle"):
        write_bvh(make_clip(name).clip, tmp_path / "clips" / f"{name}.bvh")
    return tmp_path


def test_the_sections_become_a_selector_over_built_databases(folder):
    config = MotionConfig.from_dict(SECTIONS, tables=["locomotion"])
    databases = build(config, folder, {"locomotion": ["walk", "jog", "swim"]}, cache=None)
    assert {name: database.assets for name, database in databases.items()} == {"jog": ("jog", "walk"), "jog_tired": ("jog_tired",)}
    assert databases["jog"].normalisation is databases["jog_tired"].normalisation
    selector = config.selector("locomotion", databases)
    schema = config.features["loco"]
    tired = selector.search(query_from(schema, make_clip("jog_tired").clip, 20))
    assert (tired.database, tired.reason) == ("jog_tired", Reason.UNDER_THRESHOLD)
    walking = selector.search(query_from(schema, make_clip("walk").clip, 20, steady_path(1.3)))
    assert (walking.database, walking.hit.asset) == ("jog", "walk")


def test_without_a_table_s_assets_all_clips_of_the_pattern_are_loaded(folder):
    built = build(MotionConfig.from_dict(SECTIONS), folder, cache=None)
    assert built["jog"].assets == ("idle", "jog", "jog_tired", "walk")


def test_a_database_that_was_not_built_counts_as_not_loaded(folder):
    config = MotionConfig.from_dict(SECTIONS)
    databases = build(config, folder, cache=None)
    selector = config.selector("locomotion", {"jog": databases["jog"]})
    assert selector.search(databases["jog"].raw(0)).database == "jog"


def test_the_unit_and_the_axis_of_clips_are_read():
    part = {"clips": "a/*.bvh", "features": "loco", "metres_per_unit": 0.056444, "up": "z"}
    config = MotionConfig.from_dict({**SECTIONS, "databases": {"x": part}, "selectors": {}})
    assert (config.databases["x"].metres_per_unit, config.databases["x"].up) == (0.056444, "z")


def test_every_key_of_a_database_is_read():
    part = {
        "clips": "a/*.BVH",
        "features": "loco",
        "mirror": True,
        "markup": "a/marks.csv",
        "base_bias": 1,
        "looping_bias": -0.005,
        "continuing_bias": -0.01,
        "end_s": 0,
        "weights": {"Hips velocity": 2, "LeftFoot position": 0.0},
    }
    config = MotionConfig.from_dict({**SECTIONS, "databases": {"x": part}, "selectors": {}})
    weights = {"Hips velocity": 2.0, "LeftFoot position": 0.0}
    assert config.database("x") == DatabaseSettings(
        "x", "a/*.BVH", "loco", None, 0.01, "y", True, "a/marks.csv", 1.0, -0.005, -0.01, 0.0, weights
    )


def test_a_database_is_not_mirrored_and_cannot_be_entered_near_the_ends_of_clips_unless_it_says_so():
    settings = MotionConfig.from_dict(SECTIONS).database("jog")
    assert (settings.mirror, settings.markup, settings.end_s, settings.weights) == (False, None, 0.6, {})
    assert (settings.base_bias, settings.looping_bias, settings.continuing_bias) == (0.0, -0.01, -0.1)


def test_nothing_is_a_config_too():
    assert MotionConfig.from_dict({}) == MotionConfig()
    assert build(MotionConfig(), "nowhere", cache=None) == {}


def test_a_pattern_that_is_none_is_told(folder):
    databases = SECTIONS["databases"] | {"jog": {**SECTIONS["databases"]["jog"], "clips": "clips/**x.bvh"}}
    config = MotionConfig.from_dict({**SECTIONS, "databases": databases})
    with pytest.raises(MotionError, match=r"\[databases.jog\] (clips = .* is not a pattern|no file m)"):  # newer Pythons read it
        config.load_clips("jog", folder)


def test_a_suffix_in_capitals_is_a_clip_on_every_disk(folder):
    (folder / "clips" / "walk.bvh").rename(folder / "clips" / "walk.BVH")
    config = MotionConfig.from_dict(SECTIONS)
    assert [clip.name for clip in config.load_clips("jog", folder)] == ["idle", "jog", "jog_tired", "walk"]
    one = {**SECTIONS["databases"]["jog"], "clips": "clips/walk.bvh"}
    config = MotionConfig.from_dict({**SECTIONS, "databases": {"walk": one}, "selectors": {}})
    assert [clip.name for clip in config.load_clips("walk", folder)] == ["walk"]


def test_no_clips_and_broken_clips_are_told(folder):
    config = MotionConfig.from_dict(SECTIONS, file="contextdb.toml")
    with pytest.raises(MotionError, match=r'contextdb.toml: \[databases.jog_tired\] no file matches clips = "clips/\*_tired.bvh"'):
        config.load_clips("jog_tired", folder / "clips")
    (folder / "clips" / "broken.bvh").write_text("HIERARCHY")
    with pytest.raises(ClipError, match=r"broken\.bvh, line 1"):
        build(config, folder, cache=None)


def test_an_unknown_name_is_refused_with_the_nearest(folder):
    config = MotionConfig.from_dict(SECTIONS)
    with pytest.raises(SchemaError, match=r'there is no \[databases.jgo\].*Did you mean "jog"\?'):
        config.load_clips("jgo", folder)
    with pytest.raises(SchemaError, match=r"there is no \[selectors.locomotive\]"):
        config.selector("locomotive", {})


def with_change(path, value):
    """The sections with one value changed, or taken out when it is None."""
    sections = copy.deepcopy(SECTIONS)
    part = sections
    for key in path[:-1]:
        part = part[key]
    if value is None:
        del part[path[-1]]
    else:
        part[path[-1]] = value
    return sections


CHANNEL_NAMES = (
    "LeftFoot position",
    "Hips velocity",
    "trajectory position at 0.33 0.67 1 s",
    "trajectory direction along 0.5 1 2 m",
)
OTHER = {"rate": 60.0, "channels": [{"type": "velocity", "bone": "Hips"}]}
REFUSED = {
    "a section that is not a table": (("databases",), 3, "databases is a number, not a table."),
    "a database that is not a table": (("databases", "x"), 3, "databases.x = 3: this is a number, not a table."),
    "a misspelt key": (("databases", "jog", "clip"), "a", '[databases.jog] has no key "clip".'),
    "clips elsewhere": (("databases", "jog", "clips"), "../clips/*.bvh", "it leaves the folder of contextdb.toml."),
    "clips on one machine": (("databases", "jog", "clips"), "/clips/*.bvh", "it names a place on one machine"),
    "clips of another format": (("databases", "jog", "clips"), "clips/*.c3d", "its ending is that of no file of clips."),
    "an unknown table": (("databases", "jog", "table"), "locomotoin", 'Did you mean table = "locomotion"?'),
    "an unknown axis": (
        ("databases", "jog", "up"),
        "Y",
        'up = "Y": there is no such axis. Accepted: "y", "z", "x". Did you mean up = "y"?',
    ),
    "markup of another format": (
        ("databases", "jog", "markup"),
        "marks.toml",
        'markup = "marks.toml": its ending is that of no CSV file.',
    ),
    "markup elsewhere": (("databases", "jog", "markup"), "../marks.csv", 'Did you mean markup = "marks.csv"?'),
    "clips below another folder": (("databases", "jog", "clips"), "..\\clips\\*.bvh", 'Did you mean clips = "clips/*.bvh"?'),
    "a flag in quotes": (
        ("databases", "jog", "mirror"),
        "yes",
        'mirror = "yes": this is text, neither true nor false. Accepted: true or false. Did you mean mirror = true?',
    ),
    "a flag that is a number": (("databases", "jog", "mirror"), 0, "Did you mean mirror = false?"),
    "a bias in quotes": (("databases", "jog", "base_bias"), "0.5", "Did you mean base_bias = 0.5?"),
    "weights that are not a table": (("databases", "jog", "weights"), 2.0, "weights = 2.0: this is a number, not a table."),
    "a weight of no channel": (
        ("databases", "jog", "weights"),
        {"Hips velocty": 2.0},
        '[databases.jog] weights has no key "Hips velocty". Accepted: "LeftFoot position", "Hips velocity", ',
    ),
    "a weight below 0": (
        ("databases", "jog", "weights"),
        {"Hips velocity": -1},
        "weights Hips velocity = -1: this is out of range.",
    ),
    "weights that leave nothing": (
        ("databases", "jog", "weights"),
        dict.fromkeys(CHANNEL_NAMES, 0.0),
        "[databases.jog] weights: the weight of every channel is 0. Accepted: at least one above 0",
    ),
    "an order that is not a list": (("selectors", "locomotion", "order"), "jog", "this is text, not a list."),
    "an empty order": (("selectors", "locomotion", "order"), [], "the list is empty."),
    "a step that is not a table": (
        ("selectors", "locomotion", "order", 1),
        "jog",
        '[selectors.locomotion] order 2 is "jog": this is text, not a table. Accepted: { database = "jog" }.',
    ),
    "an unknown database": (
        ("selectors", "locomotion", "order", 1, "database"),
        "jgo",
        '[selectors.locomotion] order 2 database = "jgo": there is no such database. Accepted: "jog", "jog_tired". '
        'Did you mean database = "jog"?',
    ),
    "a database twice": (("selectors", "locomotion", "order", 0, "database"), "jog", 'names the database "jog" 2 times.'),
    "no threshold before the last": (
        ("selectors", "locomotion", "order", 0, "threshold"),
        None,
        '[selectors.locomotion] order 1 has no "threshold". Accepted: a cost, such as 0.1: under it this database wins outright',
    ),
    "a threshold on the last": (
        ("selectors", "locomotion", "order", 1, "threshold"),
        1.0,
        "nothing follows that it could spare a search.",
    ),
}


@for_each(REFUSED.values())
def test_a_fault_is_told_with_what_is_accepted(path, value, message):
    with pytest.raises(SchemaError) as error:
        MotionConfig.from_dict(with_change(path, value), tables=["locomotion"], file="contextdb.toml")
    assert str(error.value).startswith("contextdb.toml: ")
    assert message in str(error.value)


def test_faults_of_all_sections_are_reported_together():
    sections = with_change(("features", "loco", "rate"), "fast")
    sections["databases"]["jog"]["features"] = "lco"
    sections["selectors"]["locomotion"]["order"][0] = {"database": "jgo_tired"}
    with pytest.raises(SchemaError) as error:
        MotionConfig.from_dict(sections)
    assert len(error.value.faults) == 4


def test_databases_of_different_features_cannot_stand_in_one_selector():
    sections = with_change(("features", "other"), OTHER)
    sections["databases"]["jog"]["features"] = "other"
    with pytest.raises(SchemaError, match='has databases of different features: "jog_tired" "loco", "jog" "other"'):
        MotionConfig.from_dict(sections)


def test_weights_of_a_schema_with_faults_are_not_held_against_the_database():
    sections = with_change(("features", "loco", "rate"), "fast")
    sections["databases"]["jog"]["weights"] = {"Hips velocity": 2.0}
    with pytest.raises(SchemaError) as error:
        MotionConfig.from_dict(sections)
    assert len(error.value.faults) == 1


def test_a_controller_has_its_selector_and_settings():
    sections = SECTIONS | {"controllers": {"player": {"selector": "locomotion", "search_every_s": 0.2}}}
    config = MotionConfig.from_dict(sections)
    controller = config.controller("player", {})
    assert [entry.name for entry in controller.selector.entries] == ["jog_tired", "jog"]
    assert controller.settings == ControllerSettings(search_every_s=0.2)
    with pytest.raises(SchemaError, match=r'Did you mean "player"'):
        config.controller("playr", {})


def test_a_controller_of_a_selector_that_is_not_there_is_told_beside_other_faults():
    sections = SECTIONS | {"controllers": {"player": {"selector": "locomotoin", "history_s": -1}}}
    with pytest.raises(SchemaError) as error:
        MotionConfig.from_dict(sections)
    assert len(error.value.faults) == 2
    assert 'Did you mean selector = "locomotion"?' in str(error.value)


def test_the_output_of_a_controller_is_read_and_default_without_a_section():
    sections = SECTIONS | {"output": {"player": {"root": "code", "halflife_s": 0.2}}}
    config = MotionConfig.from_dict(sections)
    assert config.output_of("player") == PoseSettings(root="code", halflife_s=0.2)
    assert config.output_of("npc") == PoseSettings()


def test_the_faults_of_outputs_are_told_beside_others():
    sections = SECTIONS | {"output": {"player": {"root": "cod"}}, "controllers": {"player": {"selector": "locomotoin"}}}
    with pytest.raises(SchemaError) as error:
        MotionConfig.from_dict(sections, file="contextdb.toml")
    assert len(error.value.faults) == 2
    assert '[output.player] root = "cod"' in str(error.value)
    assert 'Did you mean root = "code"?' in str(error.value)
