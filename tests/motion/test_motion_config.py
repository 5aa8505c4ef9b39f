"""The sections features, databases and selectors of contextdb.toml, from reading to a search."""

import pytest
from made_once import make_clip

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
    with pytest.raises(
        MotionError, match=r'contextdb.toml: \[databases.jog_tired\] no file matches clips = "clips/\*_tired.bvh"'
    ) as error:
        config.load_clips("jog_tired", folder / "clips")
    assert "`contextdb demo --keep FOLDER` makes some" in str(error.value)
    (folder / "clips" / "broken.bvh").write_text("HIERARCHY")
    with pytest.raises(ClipError, match=r"broken\.bvh, line 1"):
        build(config, folder, cache=None)


def test_an_unknown_name_is_refused_with_the_nearest(folder):
    config = MotionConfig.from_dict(SECTIONS)
    with pytest.raises(SchemaError, match=r'there is no \[databases.jgo\].*Did you mean "jog"\?'):
        config.load_clips("jgo", folder)
    with pytest.raises(SchemaError, match=r"there is no \[selectors.locomotive\]"):
        config.selector("locomotive", {})


def test_a_controller_has_its_selector_and_settings():
    sections = SECTIONS | {"controllers": {"player": {"selector": "locomotion", "search_every_s": 0.2}}}
    config = MotionConfig.from_dict(sections)
    controller = config.controller("player", {})
    assert [entry.name for entry in controller.selector.entries] == ["jog_tired", "jog"]
    assert controller.settings == ControllerSettings(search_every_s=0.2)
    with pytest.raises(SchemaError, match=r'Did you mean "player"'):
        config.controller("playr", {})


def test_the_output_of_a_controller_is_read_and_default_without_a_section():
    sections = SECTIONS | {"output": {"player": {"root": "code", "halflife_s": 0.2}}}
    config = MotionConfig.from_dict(sections)
    assert config.output_of("player") == PoseSettings(root="code", halflife_s=0.2)
    assert config.output_of("npc") == PoseSettings()
