"""Clips that read well and mean nonsense: each doubt, told with its measure and its mend, and no doubt about good clips."""

import os
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from made_once import make_clip
from strategies import some

from contextdb.errors import MotionError
from contextdb.motion import Clip, MotionConfig, load_bvh, write_bvh
from contextdb.motion.clips.clip_measures import Measures, measure
from contextdb.motion.clips.doubts import doubts_of, grouped
from contextdb.motion.storage.building import build_all

BESIDE = Path(__file__).parents[2].parent / "shared" / "data" / "mocap"
MOCAP = Path(os.environ.get("CONTEXTDB_MOCAP", BESIDE))
WALK = make_clip("walk").clip
OTHERS = [make_clip(name).clip for name in ("jog", "idle", "run")]


def rules(clip: Clip) -> list[str]:
    """What is doubted of one clip among good ones."""
    return [finding.rule for finding in doubts_of([*OTHERS, replace(clip, name="it")]) if finding.asset == "it"]


def doubt(clip: Clip):
    """The only doubt about a clip."""
    (found,) = [finding for finding in doubts_of([*OTHERS, replace(clip, name="it")]) if finding.asset == "it"]
    return found


def with_values(clip: Clip, change) -> Clip:
    """A clip whose values are changed in place."""
    values = clip.values.copy()
    change(values)
    return replace(clip, values=values)


def root_columns(clip: Clip) -> list[int]:
    """The columns of the root's position."""
    return [i for i, name in enumerate(clip.skeleton.channels[0]) if name.endswith("position")]


def test_nothing_is_doubted_of_the_made_clips():
    from contextdb.motion.made.recipes import RECIPES

    assert doubts_of([make_clip(name).clip for name in RECIPES]) == []


@pytest.mark.parametrize("factor", [0.01, 0.1, 10.0, 100.0])
def test_a_body_of_another_unit_is_doubted_with_the_unit_that_fits(factor):
    found = doubt(replace(WALK, metres_per_unit=WALK.metres_per_unit * factor))
    assert found.rule == "odd-size"
    assert found.measure == pytest.approx(measure(WALK).size_m * factor)
    assert found.expected == "0.3 to 3 m"
    assert found.mend == "metres_per_unit = 0.01 (centimetres)"


def test_a_file_in_metres_that_is_read_as_centimetres_is_doubted_with_metres():
    skeleton = replace(WALK.skeleton, offsets=WALK.skeleton.offsets / 100.0)

    def shrink(values):
        values[:, root_columns(WALK)] /= 100.0

    found = doubt(replace(with_values(WALK, shrink), skeleton=skeleton))
    assert (found.rule, found.mend) == ("odd-size", "metres_per_unit = 1 (metres)")


@pytest.mark.parametrize("n_frames", [1, 2])
def test_one_and_two_frames_are_told(n_frames):
    found = doubt(replace(WALK, values=WALK.values[:n_frames]))
    assert (found.rule, found.measure) == ("few-frames", n_frames)


def test_a_jump_of_fifty_metres_is_told_with_its_frame():
    def jump(values):
        values[20:, root_columns(WALK)[0]] += 5000.0

    found = doubt(with_values(WALK, jump))
    assert (found.rule, found.frame) == ("jump", 19)
    assert "the hips move 50 m from frame 19 to 20" in found.found
    assert found.measure == pytest.approx(50.0 * WALK.rate, rel=0.05)


def test_zero_poses_are_told_all_or_some():
    assert rules(with_values(WALK, lambda values: values.fill(0.0)))[0] == "zero-poses"
    found = [f for f in doubts_of([with_values(WALK, lambda values: values[7:9].fill(0.0))]) if f.rule == "zero-poses"]
    assert [(f.frame, f.measure) for f in found] == [(7, 2.0)]


@pytest.mark.parametrize("rate", [2.0, 9.0, 241.0, 1000.0])
def test_rates_that_no_recorder_has_are_told(rate):
    slow = replace(WALK, frame_time_s=1.0 / rate)
    assert "odd-rate" in rules(slow)


@pytest.mark.parametrize("rate", [10.0, 29.97, 59.94, 120.0, 240.0])
def test_usual_rates_are_not(rate):
    still = replace(WALK, frame_time_s=1.0 / rate, values=np.repeat(WALK.values[:1], 30, axis=0))
    assert rules(still) == []


@pytest.mark.parametrize("up", ["z", "x"])
def test_a_body_that_lies_is_told_with_the_axis_that_would_make_it_stand(up):
    found = next(f for f in doubts_of([replace(WALK, up=up)]) if f.rule == "lying")
    assert found.mend.startswith('up = "y"')


@pytest.mark.parametrize("by_m", [1.0, -1.0])
def test_feet_that_never_touch_the_ground_are_told(by_m):
    def lift(values):
        values[:, root_columns(WALK)[1]] += by_m / WALK.metres_per_unit

    found = doubt(with_values(WALK, lift))
    assert found.rule == "off-ground"
    assert found.measure == pytest.approx(measure(WALK).lowest + by_m)


def test_a_body_that_stands_in_the_floor_in_every_pose_is_told():
    def sink(values):
        values[:, root_columns(WALK)[1]] -= 0.1 / WALK.metres_per_unit

    found = doubt(with_values(WALK, sink))
    assert found.rule == "off-ground"
    assert "below the ground (0 upwards) in every pose" in found.found


def test_a_body_that_goes_down_below_the_ground_is_not_told():
    def descend(values):
        values[:, root_columns(WALK)[1]] -= np.linspace(0.0, 0.3, len(values)) / WALK.metres_per_unit

    assert rules(with_values(WALK, descend)) == []


def test_a_body_in_another_unit_than_the_other_clips_is_told_though_its_size_is_likely():
    found = doubt(replace(WALK, metres_per_unit=WALK.metres_per_unit / 2.54))
    assert found.rule == "odd-size"
    assert found.measure == pytest.approx(1 / 2.54, rel=0.01)
    assert found.mend == "metres_per_unit = 0.01 (centimetres) in a database of its own"


def test_a_body_a_third_larger_than_the_other_clips_is_not_told():
    assert rules(replace(WALK, metres_per_unit=WALK.metres_per_unit * 1.3)) == []


def test_a_body_of_other_proportions_than_the_other_clips_is_told():
    offsets = WALK.skeleton.offsets.copy()
    legs = [i for i, name in enumerate(WALK.skeleton.names) if "Leg" in name or "Foot" in name]
    offsets[legs] *= 0.4
    assert "odd-proportions" in rules(replace(WALK, skeleton=replace(WALK.skeleton, offsets=offsets)))


def test_a_body_of_another_size_with_the_same_proportions_is_not():
    assert rules(replace(WALK, metres_per_unit=WALK.metres_per_unit * 0.7)) == []


def test_measures_come_back_from_json():
    import json

    found = measure(WALK)
    assert Measures.of_json(json.loads(json.dumps(found.to_json()))) == found


def test_a_doubt_that_many_clips_share_is_one_sentence():
    found = doubts_of([replace(make_clip(name).clip, metres_per_unit=1.0) for name in ("walk", "jog", "run")])
    (sentence,) = grouped(found, 3)
    assert sentence.startswith("walk: the body is ")
    assert sentence.endswith("(2 of the 2 other clips likewise.)")


# ---- in a build

CONFIG = MotionConfig.from_dict(
    {
        "features": {
            "loco": {"rate": 30.0, "channels": [{"type": "position", "bone": "LeftFoot"}]},
            "other": {"rate": 30.0, "channels": [{"type": "position", "bone": "Hips"}]},
        },
        "databases": {
            "jog": {"clips": "jog/*.bvh", "features": "loco"},
            "run": {"clips": "run/*.bvh", "features": "loco"},
            "tail": {"clips": "tail/*.bvh", "features": "other"},
        },
    }
)


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    for database in CONFIG.databases:
        (tmp_path / database).mkdir()
        for name in ("walk", "jog"):
            write_bvh(make_clip(name).clip, tmp_path / database / f"{name}.bvh")
    return tmp_path


def test_doubts_stop_no_build_and_come_from_the_cache_too(folder):
    write_bvh(replace(WALK, values=WALK.values[:1]), folder / "jog" / "pose.bvh")
    first, second = build_all(CONFIG, folder), build_all(CONFIG, folder)
    for built in (first, second):
        assert [(f.rule, f.asset, f.file) for f in built["jog"].doubts] == [
            ("few-frames", "pose", str(folder / "jog" / "pose.bvh"))
        ]
        assert built["run"].doubts == ()
    assert second["jog"].computed == ()


def test_a_clip_without_a_frame_is_refused_with_its_file(folder):
    write_bvh(replace(WALK, values=WALK.values[:0]), folder / "jog" / "none.bvh")
    with pytest.raises(MotionError, match=r"none\.bvh: the clip has no frame \(Frames: 0\)"):
        build_all(CONFIG, folder)


def test_all_faults_of_all_databases_are_told_together(folder):
    (folder / "jog" / "bad.bvh").write_text("no clip", encoding="utf-8")
    for path in (folder / "tail").iterdir():
        path.unlink()
    with pytest.raises(MotionError) as error:
        build_all(CONFIG, folder)
    assert len(error.value.faults) == 2


def test_what_is_tolerated_is_left_out_and_the_rest_is_built(folder):
    (folder / "jog" / "bad.bvh").write_text("no clip", encoding="utf-8")
    for path in (folder / "tail").iterdir():
        path.unlink()
    left = []
    built = build_all(CONFIG, folder, tolerates=lambda name, error: left.append(name) or True)
    assert (sorted(built), left) == (["jog", "run"], ["tail", "jog"])
    assert built["jog"].database.assets == ("jog", "walk")


def test_a_bone_that_all_clips_lack_is_told_once_with_the_bone_that_is_meant(folder):
    wrong = MotionConfig.from_dict(
        {
            "features": {"loco": {"rate": 30.0, "channels": [{"type": "position", "bone": "Foot_L"}]}},
            "databases": {name: {"clips": f"{name}/*.bvh", "features": "loco", "mirror": False} for name in ("jog", "run")},
        }
    )
    with pytest.raises(MotionError) as error:
        build_all(wrong, folder)
    (fault,) = error.value.faults
    assert fault.found == 'there is no bone "Foot_L". (1 other clip lacks it too.)'
    assert fault.mend == '"LeftFoot"'
    assert '"LeftFoot"' in fault.accepted


@pytest.mark.skipif(not MOCAP.is_dir(), reason="no captured clips: set CONTEXTDB_MOCAP to their folder")
@pytest.mark.parametrize(("pattern", "unit"), [("bandai_namco/*.bvh", 0.01), ("cmu/0*.bvh", 0.01), ("cmu/131*.bvh", 0.056444)])
def test_nothing_is_doubted_of_captured_clips(pattern, unit):
    assert doubts_of(load_bvh(path, metres_per_unit=unit) for path in some(sorted(MOCAP.glob(pattern)), 4)) == []
