"""Reading and writing BVH: what is accepted, what is refused, and with which words."""

import io

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from contextdb.errors import ClipError, FileError
from contextdb.motion import Clip, Skeleton, load_bvh, write_bvh
from contextdb.motion.clips.clip import parse_bvh
from contextdb.motion.clips.skeleton import CHANNELS

SMALL = """HIERARCHY
ROOT Hips
{
  OFFSET 0.0 1.0 2.0
  CHANNELS 6 Xposition Yposition Zposition Zrotation Xrotation Yrotation
  JOINT Leg
  {
    OFFSET 1 -2 .5
    CHANNELS 3 Zrotation Xrotation Yrotation
    End Site
    {
      OFFSET 0 -1e1 0
    }
  }
}
MOTION
Frames: 2
Frame Time: 0.0333333
0 90 0 10 20 30 40 50 60
1 91 2 11 21 31 41 51 61
"""


def changed(before, after, text=SMALL):
    assert before in text
    return text.replace(before, after, 1)


# ---- what is accepted


def test_a_file_gives_joints_channels_end_sites_and_values():
    clip = parse_bvh(SMALL, "small")
    skeleton = clip.skeleton
    assert (clip.name, clip.n_frames, clip.frame_time_s) == ("small", 2, 0.0333333)
    assert skeleton.names == ("Hips", "Leg")
    assert skeleton.parents.tolist() == [-1, 0]
    assert skeleton.offsets.tolist() == [[0.0, 1.0, 2.0], [1.0, -2.0, 0.5]]
    assert skeleton.channels[1] == ("Zrotation", "Xrotation", "Yrotation")
    assert skeleton.end_sites == ((1, (0.0, -10.0, 0.0)),)
    assert clip.values.tolist() == [[0, 90, 0, 10, 20, 30, 40, 50, 60], [1, 91, 2, 11, 21, 31, 41, 51, 61]]


SPELLINGS = {
    "CRLF": SMALL.replace("\n", "\r\n"),
    "CR": SMALL.replace("\n", "\r"),
    "mixed line ends": SMALL.replace("\n", "\r\n", 9),
    "tabs": SMALL.replace("  ", "\t").replace(" ", "\t"),
    "blank lines": SMALL.replace("\n", "\n\n"),
    "trailing spaces": SMALL.replace("\n", "  \n"),
    "no newline at the end": SMALL.rstrip("\n"),
    "braces beside names": SMALL.replace("Hips\n{", "Hips{").replace("Leg\n  {", "Leg {"),
    "keywords in lower case": SMALL.lower().replace("hips", "Hips").replace("leg", "Leg"),
    "no colons": SMALL.replace("Frames:", "Frames").replace("Time:", "Time"),
    "spaces before colons": SMALL.replace("Frames:", "Frames  :").replace("Frame Time:", "Frame   Time :"),
    "plus signs and exponents": SMALL.replace("91", "+9.1E1"),
    "no-break spaces in the motion": SMALL.replace("41 51", "41\u00a051"),
}


@pytest.mark.parametrize("text", SPELLINGS.values(), ids=SPELLINGS)
def test_spelling_makes_no_difference(text):
    plain, clip = parse_bvh(SMALL, "clip"), parse_bvh(text, "clip")
    assert clip.skeleton.names == plain.skeleton.names
    assert clip.skeleton.channels == plain.skeleton.channels
    assert np.array_equal(clip.values, plain.values)
    assert clip.frame_time_s == plain.frame_time_s


def test_joint_names_may_hold_colons_spaces_and_other_scripts():
    names = ("rig:Hips", "Bip01 L Thigh", "左足", "a/b|c.d-e#1")
    text = SMALL.replace("Hips", names[0])
    for name in names[1:]:
        assert parse_bvh(text.replace("Leg", name), "clip").skeleton.names == (names[0], name)


def test_a_byte_order_mark_is_passed_over(tmp_path):
    path = tmp_path / "jog.bvh"
    path.write_bytes(b"\xef\xbb\xbf" + SMALL.encode())
    assert load_bvh(path).name == "jog"


def test_a_clip_may_have_no_frames():
    clip = parse_bvh(SMALL[: SMALL.index("Frames")] + "Frames: 0\nFrame Time: 0.01\n", "none")
    assert clip.values.shape == (0, 9)
    assert clip.duration_s == 0.0


def test_joints_may_have_no_channels_or_any_of_the_six():
    text = changed("CHANNELS 3 Zrotation Xrotation Yrotation", "CHANNELS 0").replace(" 40 50 60", "").replace(" 41 51 61", "")
    assert parse_bvh(text, "clip").skeleton.channels[1] == ()
    text = changed("CHANNELS 3 Zrotation Xrotation Yrotation", "CHANNELS 3 Zrotation Yposition Zrotation")
    assert parse_bvh(text, "clip").skeleton.channels[1] == ("Zrotation", "Yposition", "Zrotation")


def test_ten_thousand_joints_below_one_another_are_read_and_written():
    depth = 10_000
    opened = "".join(f"JOINT j{i} {{ OFFSET 0 1 0 CHANNELS 0\n" for i in range(depth))
    text = (
        f"HIERARCHY ROOT r {{ OFFSET 0 0 0 CHANNELS 1 Xposition\n{opened}{'}' * (depth + 1)} MOTION\nFrames: 1\nFrame Time: 1\n7\n"
    )
    clip = parse_bvh(text, "deep")
    assert clip.skeleton.n_joints == depth + 1
    written = io.StringIO()
    write_bvh(clip, written, digits=0)
    assert parse_bvh(written.getvalue(), "again").skeleton.depths[-1] == depth


# ---- what is refused


def test_a_file_that_is_not_there_is_a_file_error(tmp_path):
    (tmp_path / "walk.bvh").touch()
    with pytest.raises(FileError, match=r'wlak\.bvh: there is no such file. Did you mean ".*walk.bvh"'):
        load_bvh(tmp_path / "wlak.bvh")
    with pytest.raises(FileError, match="this is a folder"):
        load_bvh(tmp_path)
    with pytest.raises(FileError, match="there is no folder"):
        write_bvh(parse_bvh(SMALL, "clip"), tmp_path / "no folder" / "clip.bvh")


# ---- there and back


@st.composite
def clips(draw):
    """Any tree of joints with any channels and a few frames of motion."""
    n_joints = draw(st.integers(1, 8))
    parents = [-1]
    path = [0]
    for joint in range(1, n_joints):
        path = path[: draw(st.integers(1, len(path)))]
        parents.append(path[-1])
        path.append(joint)
    turns = st.lists(st.sampled_from(CHANNELS[3:]), max_size=4)
    moves = st.lists(st.sampled_from(CHANNELS[:3]), unique=True)
    channels = [tuple(draw(st.permutations(draw(turns) + draw(moves)))) for _ in range(n_joints)]
    if not any(channels):
        channels[0] = ("Xrotation",)
    names = draw(
        st.lists(st.text("abcXYZ:_ -#.", min_size=1).map(str.strip).filter(bool), min_size=n_joints, max_size=n_joints, unique=True)
    )
    number = st.floats(-500, 500).map(lambda x: round(x, 3))
    offsets = draw(st.lists(st.tuples(number, number, number), min_size=n_joints, max_size=n_joints))
    ends = draw(
        st.lists(
            st.tuples(st.integers(0, n_joints - 1), st.tuples(number, number, number)), max_size=2, unique_by=lambda end: end[0]
        )
    )
    skeleton = Skeleton(tuple(names), np.array(parents), np.array(offsets), tuple(channels), tuple(sorted(ends)))
    n_frames = draw(st.integers(0, 4))
    row = st.lists(number, min_size=skeleton.n_channels, max_size=skeleton.n_channels)
    values = np.array(draw(st.lists(row, min_size=n_frames, max_size=n_frames))).reshape(n_frames, skeleton.n_channels)
    return Clip("clip", skeleton, draw(st.sampled_from([1 / 30, 1 / 120, 0.5])), values)


@given(clips())
def test_reading_what_was_written_gives_the_same_clip(clip):
    written = io.StringIO()
    write_bvh(clip, written, digits=3)
    again = parse_bvh(written.getvalue(), "clip")
    assert again.skeleton.names == clip.skeleton.names
    assert again.skeleton.parents.tolist() == clip.skeleton.parents.tolist()
    assert again.skeleton.channels == clip.skeleton.channels
    assert again.skeleton.end_sites == clip.skeleton.end_sites
    assert np.array_equal(again.skeleton.offsets, clip.skeleton.offsets)
    assert np.array_equal(again.values, clip.values)
    assert again.frame_time_s == pytest.approx(clip.frame_time_s, rel=1e-8)


def test_what_is_written_is_exact_to_the_digits_asked_for(tmp_path):
    clip = parse_bvh(SMALL.replace("91", "91.123456789"), "clip")
    write_bvh(clip, tmp_path / "clip.bvh", digits=4)
    assert np.abs(load_bvh(tmp_path / "clip.bvh").values - clip.values).max() <= 0.5e-4


# ---- damage


def assert_read_or_refused(path, raw):
    """Reading these bytes gives a whole clip, or a ClipError that names the file; nothing else."""
    path.write_bytes(raw)
    try:
        clip = load_bvh(path)
    except ClipError as refused:
        faults = refused.faults
    else:
        assert np.isfinite(clip.values).all()
        assert clip.values.shape == (clip.n_frames, clip.skeleton.n_channels)
        return
    assert all(fault.found and fault.place.file for fault in faults)


def test_a_file_cut_anywhere_is_read_or_refused(tmp_path):
    raw = SMALL.encode()
    for length in range(len(raw)):
        assert_read_or_refused(tmp_path / "cut.bvh", raw[:length])


@given(st.lists(st.tuples(st.integers(0, len(SMALL) - 1), st.integers(0, 255)), min_size=1, max_size=6))
def test_flipped_bytes_are_read_or_refused(tmp_path_factory, flips):
    raw = bytearray(SMALL.encode())
    for position, byte in flips:
        raw[position] = byte
    assert_read_or_refused(tmp_path_factory.getbasetemp() / "flipped.bvh", bytes(raw))


@given(st.lists(st.sampled_from([*SMALL.split(), "{", "}", "\n", "-1", "1e9", "99999999999999999"]), max_size=40))
def test_any_sequence_of_words_is_read_or_refused(tmp_path_factory, words):
    assert_read_or_refused(tmp_path_factory.getbasetemp() / "words.bvh", " ".join(words).encode())
