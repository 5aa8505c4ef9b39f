"""The settings of a pose stream: every fault, with what is accepted and the nearest mend."""

from __future__ import annotations

import pytest

from contextdb.errors import ContextError, MotionError, SchemaError
from contextdb.motion import PoseSettings


def test_what_is_not_said_is_as_by_default():
    assert PoseSettings.from_dict({}) == PoseSettings()
    assert PoseSettings.from_dict({"root": "code", "halflife_s": 0.2}) == PoseSettings(root="code", halflife_s=0.2)


def test_every_fault_is_told_with_what_is_accepted_and_the_nearest_mend():
    with pytest.raises(SchemaError) as caught:
        PoseSettings.from_dict({"root": "mixd", "blend": 3, "halflive_s": 0.1, "fade_s": 0, "position_weight": "1"}, name="hero")
    faults = caught.value.faults
    assert len(faults) == 5
    said = str(caught.value)
    assert '[output.hero] has no key "halflive_s"' in said
    assert 'Did you mean "halflife_s"' in said
    assert 'root = "mixed"' in said
    assert "seconds from 0.001 to 60" in said
    assert "position_weight = 1" in said


@pytest.mark.parametrize(
    "wrong",
    [
        {"root": "mixd"},
        {"blend": None},
        {"halflife_s": 0.0},
        {"position_weight": 1.5},
        {"rotation_clamp_deg": float("nan")},
        {"foot_lock": 1},
    ],
)
def test_settings_made_in_python_are_checked_too(wrong):
    with pytest.raises(MotionError, match=next(iter(wrong))):
        PoseSettings(**wrong)


def test_what_is_no_mapping_is_told():
    with pytest.raises(ContextError):
        PoseSettings.from_dict("mixed")


def test_a_lock_that_is_neither_true_nor_false_is_told():
    with pytest.raises(SchemaError, match=r'foot_lock = "yes": this is text, neither true nor false. Accepted: true or false'):
        PoseSettings.from_dict({"foot_lock": "yes"})
    assert not PoseSettings.from_dict({"foot_lock": False}).foot_lock
