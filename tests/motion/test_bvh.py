"""Reading and writing BVH: what is accepted, what is refused, and with which words."""

import io
import re

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from strategies import for_each

from contextdb.errors import ClipError, FileError
from contextdb.motion import Clip, Skeleton, load_bvh, load_clips, write_bvh
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


def fault_of(text):
    """The message of the one fault that a text is refused with."""
    with pytest.raises(ClipError) as error:
        parse_bvh(text, "clip", file="clip.bvh")
    assert len(error.value.faults) == 1, error.value
    return str(error.value)


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

REFUSED = {
    "empty": ("", "line 1: the file is empty. Accepted: a BVH file, which starts with the word HIERARCHY."),
    "only spaces": (" \n\n", "the file is empty"),
    "another format": ("<html>", 'line 1: found "<html>". Accepted: a BVH file, which starts with the word HIERARCHY.'),
    "a misspelt first word": (changed("HIERARCHY", "HEIRARCHY"), 'Did you mean "HIERARCHY"?'),
    "no root": (changed("ROOT Hips", "JOINT Hips"), 'line 2: found "JOINT". Accepted: "ROOT" and the name of the first joint.'),
    "a root without a name": (changed("ROOT Hips", "ROOT"), "line 2: a joint has no name."),
    "a second joint of one name": (
        changed("Leg", "Hips"),
        'line 6: a second joint is named "Hips"; the first is on line 2. Accepted: different names for all joints.',
    ),
    "a misspelt keyword": (changed("OFFSET 1", "OFSET 1"), 'line 8: found "OFSET". Accepted: in joint "Leg": "OFFSET", "CHANNELS"'),
    "no offset": (changed("    OFFSET 1 -2 .5\n", ""), 'joint "Leg" has no OFFSET.'),
    "two offsets": (changed("OFFSET 1 -2 .5", "OFFSET 1 -2 .5 OFFSET 0 0 0"), 'joint "Leg" has a second OFFSET.'),
    "no channels": (changed("    CHANNELS 3 Zrotation Xrotation Yrotation\n", ""), 'joint "Leg" has no CHANNELS.'),
    "two lists of channels": (changed("Yrotation\n    End", "Yrotation CHANNELS 0\n    End"), 'joint "Leg" has a second CHANNELS.'),
    "an offset that is not a number": (
        changed("OFFSET 1 -2 .5", "OFFSET 1 -2,5 .5"),
        'line 8: OFFSET y of joint "Leg" is "-2,5". Accepted: a finite number. Did you mean "-2.5"?',
    ),
    "an infinite offset": (changed("OFFSET 1 -2 .5", "OFFSET 1 -2 1e999"), 'line 8: OFFSET z of joint "Leg" is "1e999".'),
    "a short offset": (changed("OFFSET 1 -2 .5", "OFFSET 1 -2"), 'line 9: OFFSET z of joint "Leg" is "CHANNELS".'),
    "an unknown channel": (
        changed("3 Zrotation Xrotation", "3 Zrotation Xroation"),
        'line 9: found "Xroation". Accepted: a channel: Xposition, Yposition, Zposition, Xrotation, Yrotation, Zrotation. '
        'Did you mean "Xrotation"?',
    ),
    "too few channels": (
        changed("CHANNELS 3", "CHANNELS 4"),
        "CHANNELS says 4, but 3 are named. Accepted: as many names as it says. Did you",
    ),
    "too many channels": (changed("CHANNELS 3", "CHANNELS 2"), 'line 9: found "Yrotation". Accepted: in joint "Leg"'),
    "a count of channels that is not a count": (changed("CHANNELS 3", "CHANNELS -3"), 'the number of channels is "-3".'),
    "a position channel twice": (changed("6 Xposition Yposition", "6 Xposition Xposition"), "channel Xposition appears twice."),
    "an end without site": (changed("End Site", "End Sight"), 'line 10: found "Sight". Accepted: "End Site". Did you mean "Site"?'),
    "a brace too many": (changed("}\nMOTION", "}\n}\nMOTION"), 'line 16: this "}" closes nothing: every joint is closed.'),
    "a brace too few": (
        changed("}\nMOTION", "MOTION"),
        'line 15: found "MOTION" with 1 joint still open. Accepted: "}" to close joint "Hips" of line 2. Did you mean "}"?',
    ),
    "a second root": (changed("MOTION", "ROOT Other { }"), "found a second ROOT."),
    "cut in the hierarchy": (SMALL[: SMALL.index("JOINT")], "line 6: found the end of the file with 1 joint still open."),
    "no motion": (SMALL[: SMALL.index("MOTION")], 'found the end of the file. Accepted: "MOTION" behind the root\'s block.'),
    "a misspelt motion": (changed("MOTION", "MOTOIN"), 'Did you mean "MOTION"?'),
    "no frames": (changed("Frames: 2\n", ""), 'found "Frame". Accepted: "Frames:" and their number.'),
    "frames that are not a number": (changed("Frames: 2", "Frames: two"), 'the number of frames is "two".'),
    "frames with a point": (
        changed("Frames: 2", "Frames: 2.0"),
        'the number of frames is "2.0". Accepted: a whole number. Did you mean "2"?',
    ),
    "negative frames": (changed("Frames: 2", "Frames: -2"), 'the number of frames is "-2".'),
    "no frame time": (changed("Frame Time: 0.0333333\n", ""), '"Frame Time:" and the seconds between two frames.'),
    "a negative frame time": (
        changed("0.0333333", "-0.0333333"),
        'time is "-0.0333333". Accepted: seconds between two frames, more than 0 and at most 1. Did you mean "0.0333333"?',
    ),
    "a frame time of nothing": (changed("0.0333333", "0"), 'the frame time is "0".'),
    "a frame time in milliseconds": (changed("0.0333333", "33.3"), 'the frame time is "33.3". Accepted: seconds between'),
    "a frame time in milliseconds, meant in seconds": (changed("0.0333333", "33.3"), 'Did you mean "0.0333"?'),
    "a frame time that is nan": (changed("0.0333333", "nan"), 'the frame time is "nan".'),
    "a missing frame time": (changed("Frame Time: 0.0333333", "Frame Time:"), "the frame time is the end of the file."),
    "more frames than lines": (
        changed("Frames: 2", "Frames: 3"),
        'Frames says 3, but 2 lines of motion follow. Accepted: one line of motion for each frame. Did you mean "Frames: 2"?',
    ),
    "fewer frames than lines": (changed("Frames: 2", "Frames: 1"), 'Did you mean "Frames: 2"?'),
    "a short line": (
        changed("41 51 61", "41 51"),
        "line 20: 8 values on a motion line. Accepted: 9, one for each channel of the hierarchy.",
    ),
    "a long line": (changed("41 51 61", "41 51 61 71"), "line 20: 10 values on a motion line."),
    "a word among the numbers": (
        changed("41 51 61", "41 5l 61"),
        'line 20: value 8 of a motion line is "5l". Accepted: finite numbers, one for each channel.',
    ),
    "nan": (changed("41 51 61", "41 nan 61"), 'value 8 of a motion line is "nan".'),
    "infinity": (changed("41 51 61", "41 -inf 61"), 'value 8 of a motion line is "-inf".'),
    "a number beyond doubles": (changed("41 51 61", "41 1e400 61"), 'value 8 of a motion line is "1e400".'),
    "a decimal comma": (
        changed("41 51 61", "41 5,1 61"),
        'is "5,1". Accepted: finite numbers, one for each channel. Did you mean "5.1"?',
    ),
    "an underscore": (changed("41 51 61", "41 5_1 61"), 'Did you mean "51"?'),
    "digits of another script": (changed("41 51 61", "41 \u0665\u0661 61"), "value 8 of a motion line"),
}


@for_each(REFUSED.values())
def test_a_broken_text_is_refused_with_its_line_and_what_was_expected(text, message):
    found = fault_of(text)
    assert found.startswith("clip.bvh, line ")
    assert message in found


def test_two_lines_of_wrong_length_do_not_make_up_for_each_other():
    text = changed("0 90 0 10 20 30 40 50 60\n1 91", "0 90 0 10 20 30 40 50 60 1\n91")
    with pytest.raises(ClipError) as error:
        parse_bvh(text, "clip")
    assert [fault.place.line for fault in error.value.faults] == [19, 20]


def test_many_broken_lines_are_counted_rather_than_listed():
    text = SMALL.replace("Frames: 2", "Frames: 102") + "x\n" * 100
    with pytest.raises(ClipError, match="92 more lines of motion cannot be read") as error:
        parse_bvh(text, "clip")
    assert len(error.value.faults) == 9


@pytest.mark.parametrize(
    ("raw", "message"),
    [
        (b"HIERARCHY\nROOT \xff\n", "line 2: byte 0xff is not UTF-8."),
        (b"HIERARCHY\r\n\r\nROOT \0", "line 3: the file is binary: it holds a zero byte."),
        (SMALL.encode("utf-16"), "line 1: the file is UTF-16."),
        (b"\x89PNG\r\n\x1a\n\0\0", "the file is binary"),
    ],
)
def test_bytes_that_are_no_text_are_refused(tmp_path, raw, message):
    path = tmp_path / "clip.bvh"
    path.write_bytes(raw)
    with pytest.raises(ClipError, match=re.escape(message)):
        load_bvh(path)


def test_a_file_that_is_not_there_is_a_file_error(tmp_path):
    (tmp_path / "walk.bvh").touch()
    with pytest.raises(FileError, match=r'wlak\.bvh: there is no such file. Did you mean ".*walk.bvh"'):
        load_bvh(tmp_path / "wlak.bvh")
    with pytest.raises(FileError, match="this is a folder"):
        load_bvh(tmp_path)
    with pytest.raises(FileError, match="there is no folder"):
        write_bvh(parse_bvh(SMALL, "clip"), tmp_path / "no folder" / "clip.bvh")


def test_the_faults_of_several_files_are_reported_together(tmp_path):
    for name, text in {"a": SMALL, "b": "", "c": SMALL[:-30]}.items():
        (tmp_path / f"{name}.bvh").write_text(text)
    with pytest.raises(ClipError) as error:
        load_clips(tmp_path / f"{name}.bvh" for name in "abcd")
    assert {fault.place.file for fault in error.value.faults} == {str(tmp_path / f"{name}.bvh") for name in "bcd"}


@pytest.mark.parametrize("unit", [0.0, -1.0, float("nan"), float("inf")])
def test_a_unit_must_be_a_length(unit):
    with pytest.raises(ClipError, match="metres_per_unit is"):
        parse_bvh(SMALL, "clip", metres_per_unit=unit)


def test_an_unknown_axis_is_refused_with_the_known_ones():
    with pytest.raises(ClipError, match=r'the axis that points up is "w"\. Accepted: "y", "z", "x"\.'):
        parse_bvh(SMALL, "clip", up="w")


def test_values_that_do_not_fit_the_skeleton_are_no_clip():
    skeleton = parse_bvh(SMALL, "clip").skeleton
    with pytest.raises(ClipError, match="the values are 2 x 8, or not all finite"):
        Clip("made", skeleton, 0.1, np.zeros((2, 8)))
    with pytest.raises(ClipError, match="not all finite"):
        Clip("made", skeleton, 0.1, np.full((2, 9), np.nan))


def test_a_clip_does_not_lock_the_array_it_was_made_from():
    values = np.zeros((2, 9))
    clip = Clip("made", parse_bvh(SMALL, "clip").skeleton, 0.1, values)
    values[0, 0] = 1.0
    with pytest.raises(ValueError, match="read-only"):
        clip.values[0, 0] = 2.0


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


@pytest.mark.parametrize("name", ["", " a", "a{b", "a\nb"])
def test_a_name_that_the_format_cannot_hold_is_not_written(name):
    clip = Clip("c", Skeleton((name,), np.array([-1]), np.zeros((1, 3)), (("Xrotation",),)), 0.1, np.zeros((1, 1)))
    with pytest.raises(ClipError, match="cannot be written"):
        write_bvh(clip, io.StringIO())


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
