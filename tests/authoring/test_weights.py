"""Weights and thresholds written into contextdb.toml: only these numbers change, in whichever form the file has its channels."""

import tomllib
from pathlib import Path

import pytest

from contextdb.authoring.weights import weights_change
from contextdb.edits.schema_file import SchemaChange
from contextdb.errors import ContextDBError, FileError

INLINE = """# how we move
[features.loco]
rate = 30.0
channels = [
  # the feet
  { type = "position", bone = "LeftFoot" },   # left
  { type = "position", bone = "RightFoot", weight = 0.75 },
  { type = "trajectory", what = "position", at = [0.33, 1.0] },
]
[databases.a]
clips = "a/*.bvh"
features = "loco"
[databases.b]
clips = "b/*.bvh"
features = "loco"
[selectors.moves]
order = [{ database = "a", threshold = 0.5 }, { database = "b" }]  # a first
"""
SECTIONS = """[features.loco]
rate = 30.0
[[features.loco.channels]]
type = "position"
bone = "LeftFoot"  # left

[[features.loco.channels]]
type = "position"
bone = "RightFoot"
weight = 0.75  # less

[[features.loco.channels]]
type = "trajectory"
what = "position"
at = [0.33, 1.0]
"""


def written(tmp_path: Path, text: str, weights: dict[str, float], thresholds: dict[str, float] | None = None) -> str:
    path = tmp_path / "contextdb.toml"
    path.write_bytes(text.encode())
    change = weights_change(path, "loco", weights, "moves", thresholds)
    assert change is not None
    change.write()
    return path.read_bytes().decode()


def lines_changed(before: str, after: str) -> list[tuple[str, str]]:
    pairs = list(zip(before.splitlines(), after.splitlines(), strict=True))
    return [(old, new) for old, new in pairs if old != new]


@pytest.mark.parametrize("end", ["\n", "\r\n"])
def test_a_weight_that_is_there_is_replaced_and_nothing_else(tmp_path: Path, end: str):
    text = INLINE.replace("\n", end)
    after = written(tmp_path, text, {"RightFoot position": 2.0})
    assert after == text.replace("weight = 0.75", "weight = 2.0")


def test_a_weight_that_is_not_there_joins_its_channel(tmp_path: Path):
    after = written(tmp_path, INLINE, {"LeftFoot position": 1.5})
    assert lines_changed(INLINE, after) == [
        (
            '  { type = "position", bone = "LeftFoot" },   # left',
            '  { type = "position", bone = "LeftFoot", weight = 1.5 },   # left',
        )
    ]


def test_channels_in_sections_of_their_own_keep_them(tmp_path: Path):
    after = written(tmp_path, SECTIONS, {"RightFoot position": 2.0, "LeftFoot position": 3.0})
    assert after == SECTIONS.replace("weight = 0.75", "weight = 2.0").replace("# left\n", "# left\nweight = 3.0\n")


def test_a_threshold_is_written_into_its_selector(tmp_path: Path):
    after = written(tmp_path, INLINE, {}, {"a": 0.25})
    assert lines_changed(INLINE, after) == [
        (INLINE.splitlines()[-1], INLINE.splitlines()[-1].replace("threshold = 0.5", "threshold = 0.25"))
    ]


def test_what_the_file_says_already_is_no_change(tmp_path: Path):
    path = tmp_path / "contextdb.toml"
    path.write_text(INLINE, encoding="utf-8")
    assert weights_change(path, "loco", {"RightFoot position": 0.75, "LeftFoot position": 1.0}, "moves", {"a": 0.5}) is None


def test_a_change_written_back_gives_the_bytes_that_were(tmp_path: Path):
    path = tmp_path / "contextdb.toml"
    path.write_bytes(b"\xef\xbb\xbf" + INLINE.encode())
    change = weights_change(path, "loco", {"LeftFoot position": 4.0})
    assert change is not None
    change.write()
    assert path.read_bytes().startswith(b"\xef\xbb\xbf")
    assert change.was is not None
    SchemaChange(path, change.was, change.raw).write()
    assert path.read_bytes() == b"\xef\xbb\xbf" + INLINE.encode()


def test_a_file_that_somebody_changed_meanwhile_stays(tmp_path: Path):
    path = tmp_path / "contextdb.toml"
    path.write_text(INLINE, encoding="utf-8")
    change = weights_change(path, "loco", {"LeftFoot position": 4.0})
    assert change is not None
    path.write_text(INLINE + "# more\n", encoding="utf-8")
    with pytest.raises(FileError, match="changed by somebody else"):
        change.write()
    assert path.read_text(encoding="utf-8") == INLINE + "# more\n"


@pytest.mark.parametrize(
    ("features", "weights", "thresholds", "said"),
    [
        ("loco", {"LeftFoot positon": 1.0}, {}, "LeftFoot position"),
        ("lcoo", {"LeftFoot position": 1.0}, {}, '"loco"'),
        ("loco", {}, {"c": 1.0}, '"a", "b"'),
        ("loco", {"LeftFoot position": -1.0}, {}, "weight"),
    ],
)
def test_what_there_is_not_is_refused_with_the_nearest(tmp_path: Path, features: str, weights: dict, thresholds: dict, said: str):
    path = tmp_path / "contextdb.toml"
    path.write_text(INLINE, encoding="utf-8")
    with pytest.raises(ContextDBError) as refused:
        weights_change(path, features, weights, "moves", thresholds)
    assert said in str(refused.value)
    assert tomllib.loads(path.read_text(encoding="utf-8")) == tomllib.loads(INLINE)
