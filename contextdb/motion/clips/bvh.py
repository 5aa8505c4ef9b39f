"""The BVH file format: the hierarchy and the motion of a text, and the text of both.

`read` gives what the file says, in its own units and in degrees; `contextdb.motion.clips.clip` says what they mean. Accepted: any
order and number of channels on any joint, End Sites, names with spaces and odd characters, any line ends and spacing, keywords in
any case. Everything else is a ClipError with its line. Nothing here reads a file or calls itself, so depth has no limit.

Source: Meredith and Maddock, "Motion Capture File Formats Explained", University of Sheffield, 2001. The format has no standard.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass, field
from itertools import chain

import numpy as np

from contextdb.errors import ClipError, Fault, Place, in_quotes, plural
from contextdb.motion.clips.bvh_words import Words, number_fault, quoted
from contextdb.motion.clips.quaternions import Floats
from contextdb.motion.clips.skeleton import CHANNELS, POSITIONS, Skeleton

MOST_FAULTS = 8
"""A file's first faulty lines are reported one by one, the rest counted."""
LONGEST_FRAME_S = 1.0
"""A longer frame time is a mistake, such as milliseconds: nobody records a body less than once a second."""

IN_JOINT = '"OFFSET", "CHANNELS", "JOINT", "End Site" or "}"'
JOINT_WORDS = ("OFFSET", "CHANNELS", "JOINT", "End Site", "}")
CHANNEL_NAMES = {name.casefold(): name for name in CHANNELS}
LINES = 4096
"""So many lines are read at a time: between them it can be interrupted."""
COUNT = re.compile(r"\d{1,12}", re.ASCII)
FRAMES = re.compile(r"\s*Frames[^\S\n]*:?[^\S\n]*(\S*)", re.IGNORECASE)
FRAME_TIME = re.compile(r"\s*Frame[^\S\n]*Time[^\S\n]*:?[^\S\n]*(\S*)", re.IGNORECASE)

Vector = tuple[float, float, float]


def read(text: str, file: str | None = None) -> tuple[Skeleton, float, Floats]:
    """The skeleton, the seconds between frames, and the values [frames, channels] of a BVH text; `file` is its name in messages."""
    words = Words(text, file)
    if not text.strip():
        words.refuse("the file is empty.", "a BVH file, which starts with the word HIERARCHY")
    skeleton = _read_hierarchy(words)
    n_frames, frame_time_s = _read_frame_counts(words)
    return skeleton, frame_time_s, _read_values(words, n_frames, skeleton.n_channels)


def write(skeleton: Skeleton, frame_time_s: float, values: Floats, digits: int = 6) -> str:
    """The text of a BVH file, with so many digits behind the point."""
    lines = [
        "HIERARCHY",
        *_hierarchy_lines(skeleton, digits),
        "MOTION",
        f"Frames: {len(values)}",
        f"Frame Time: {frame_time_s:.9g}",
    ]
    line = " ".join([f"%.{digits}f"] * skeleton.n_channels)
    return "\n".join([*lines, *(line % tuple(row) for row in values.tolist())]) + "\n"


# ---- the hierarchy


@dataclass
class _Joints:
    """The joints read so far; offset and channels are None until they are met."""

    names: list[str] = field(default_factory=list)
    index: dict[str, int] = field(default_factory=dict)
    lines: list[int] = field(default_factory=list)
    parents: list[int] = field(default_factory=list)
    offsets: list[Vector | None] = field(default_factory=list)
    channels: list[tuple[str, ...] | None] = field(default_factory=list)
    end_sites: list[tuple[int, Vector]] = field(default_factory=list)
    open: list[int] = field(default_factory=list)
    """The joints whose block is not closed yet, the innermost last."""

    def inner(self) -> str:
        """The innermost open joint's name, quoted."""
        return in_quotes(self.names[self.open[-1]])

    def skeleton(self) -> Skeleton:
        offsets = np.array(self.offsets, np.float64).reshape(-1, 3)
        channels = tuple(c or () for c in self.channels)
        return Skeleton(tuple(self.names), np.array(self.parents, np.int64), offsets, channels, tuple(self.end_sites))


def _read_hierarchy(words: Words) -> Skeleton:
    words.expect("HIERARCHY", "a BVH file, which starts with the word HIERARCHY")
    words.expect("ROOT", '"ROOT" and the name of the first joint')
    joints = _Joints()
    _open_joint(words, joints)
    while joints.open:
        _read_joint_part(words, joints)
    word = words.take()
    if word.casefold() != "motion":
        _refuse_after_hierarchy(words, word)
    return joints.skeleton()


def _read_joint_part(words: Words, joints: _Joints) -> None:
    word = words.take()
    match word.casefold():
        case "offset":
            _read_offset(words, joints)
        case "channels":
            _read_channels(words, joints)
        case "joint":
            _open_joint(words, joints)
        case "end":
            _read_end_site(words, joints)
        case "}":
            _close_joint(words, joints)
        case _:
            _refuse_in_joint(words, joints, word)


def _refuse_in_joint(words: Words, joints: _Joints, word: str) -> None:
    if word and word.casefold() not in ("motion", "root"):
        words.fail(word, f"in joint {joints.inner()}: {IN_JOINT}", JOINT_WORDS)
    opened = joints.lines[joints.open[-1]]
    blocks = plural(len(joints.open), "joint")
    words.refuse(f"found {quoted(word)} with {blocks} still open.", f'"}}" to close joint {joints.inner()} of line {opened}', '"}"')


def _refuse_after_hierarchy(words: Words, word: str) -> None:
    if word == "}":
        words.refuse('this "}" closes nothing: every joint is closed.', '"MOTION" behind the root\'s block', '"MOTION"')
    if word.casefold() == "root":
        words.refuse("found a second ROOT.", 'one ROOT, then "MOTION"')
    words.fail(word, '"MOTION" behind the root\'s block', ["MOTION"])


def _open_joint(words: Words, joints: _Joints) -> None:
    name = words.take_rest()
    if not name:
        words.refuse("a joint has no name.", "the name on the line of ROOT or JOINT")
    if name in joints.index:
        first = joints.lines[joints.index[name]]
        words.refuse(f"a second joint is named {in_quotes(name)}; the first is on line {first}.", "different names for all joints")
    joints.parents.append(joints.open[-1] if joints.open else -1)
    joints.open.append(len(joints.names))
    joints.index[name] = len(joints.names)
    joints.names.append(name)
    joints.lines.append(words.line)
    joints.offsets.append(None)
    joints.channels.append(None)
    words.expect("{")


def _close_joint(words: Words, joints: _Joints) -> None:
    joint = joints.open[-1]
    if joints.offsets[joint] is None:
        words.refuse(f"joint {joints.inner()} has no OFFSET.", "an OFFSET and CHANNELS in every joint", '"OFFSET 0 0 0"')
    if joints.channels[joint] is None:
        words.refuse(f"joint {joints.inner()} has no CHANNELS.", "an OFFSET and CHANNELS in every joint", '"CHANNELS 0"')
    joints.open.pop()


def _read_offset(words: Words, joints: _Joints) -> None:
    if joints.offsets[joints.open[-1]] is not None:
        words.refuse(f"joint {joints.inner()} has a second OFFSET.", "one OFFSET")
    joints.offsets[joints.open[-1]] = _vector(words, joints)


def _vector(words: Words, joints: _Joints) -> Vector:
    x, y, z = (words.number(f"OFFSET {axis} of joint {joints.inner()}") for axis in "xyz")
    return x, y, z


def _read_channels(words: Words, joints: _Joints) -> None:
    if joints.channels[joints.open[-1]] is not None:
        words.refuse(f"joint {joints.inner()} has a second CHANNELS.", "one CHANNELS")
    count = words.take()
    if not COUNT.fullmatch(count):
        words.refuse(f"the number of channels is {quoted(count)}.", "a whole number, then as many channel names", '"3"')
    names: list[str] = []
    for _ in range(int(count)):
        names.append(_channel(words, names, count))
    joints.channels[joints.open[-1]] = tuple(names)


def _channel(words: Words, earlier: list[str], count: str) -> str:
    word = words.take()
    name = CHANNEL_NAMES.get(word.casefold())
    if word.casefold() in ("", "{", "}", "joint", "end"):
        words.refuse(
            f"CHANNELS says {count}, but {len(earlier)} are named.", "as many names as it says", f'"CHANNELS {len(earlier)}"'
        )
    if name is None:
        words.fail(word, f"a channel: {', '.join(CHANNELS)}", CHANNELS)
    if name in POSITIONS and name in earlier:
        words.refuse(f"channel {name} appears twice.", "each position channel once")
    return name


def _read_end_site(words: Words, joints: _Joints) -> None:
    words.expect("Site", '"End Site"')
    words.expect("{")
    words.expect("OFFSET", '"OFFSET" in an End Site')
    joints.end_sites.append((joints.open[-1], _vector(words, joints)))
    words.expect("}", '"}" to close the End Site')


# ---- the motion


def _read_frame_counts(words: Words) -> tuple[int, float]:
    count = _labelled(words, FRAMES, '"Frames:" and their number')
    if not COUNT.fullmatch(count):
        meant = count.partition(".")[0]
        words.refuse(f"the number of frames is {quoted(count)}.", "a whole number", f'"{meant}"' if COUNT.fullmatch(meant) else "")
    time = _labelled(words, FRAME_TIME, '"Frame Time:" and the seconds between two frames')
    if number_fault(time) is not None or not 0.0 < float(time) <= LONGEST_FRAME_S:
        accepted = f"seconds between two frames, more than 0 and at most {LONGEST_FRAME_S:g}"
        words.refuse(f"the frame time is {quoted(time)}.", accepted, _meant_frame_time(time))
    return int(count), float(time)


def _labelled(words: Words, label: re.Pattern[str], accepted: str) -> str:
    match = label.match(words.text, words.position)
    if match is None:
        words.fail(words.take(), accepted)
    words.move(match.start(1))
    words.position = match.end(1)
    return match.group(1)


def _meant_frame_time(word: str) -> str:
    """What a refused frame time may have meant: the decimal comma, a lost sign, or milliseconds."""
    number = number_fault(word)
    if number is not None:
        return number
    seconds = abs(float(word))
    seconds = seconds / 1000.0 if seconds > LONGEST_FRAME_S else seconds
    return f'"{seconds:g}"' if 0.0 < seconds <= LONGEST_FRAME_S else ""


def _read_values(words: Words, n_frames: int, n_channels: int) -> Floats:
    """The values [n_frames, n_channels]: all lines at once; one by one only where something may be wrong."""
    text = words.text[words.position :]
    lines = text.split("\n")
    is_plain = text.isascii() and "_" not in text  # float() also takes "1_0" and the digits of other scripts
    if is_plain:
        values = _plain_values(lines, n_channels)
        if values is not None and len(values) == n_frames:
            return values
    faults = _value_faults(words, lines, n_frames, n_channels)
    if faults:
        raise ClipError(*faults)
    return np.array([row for line in lines if (row := line.split())], np.float64).reshape(n_frames, n_channels)


def _plain_values(lines: list[str], n_channels: int) -> Floats | None:
    """The values of lines, some at a time; None where one is not made of so many finite numbers."""
    blocks = [np.zeros((0, n_channels))]
    for first in range(0, len(lines), LINES):
        rows = [row for line in lines[first : first + LINES] if (row := line.split())]
        if not all(len(row) == n_channels for row in rows):
            return None
        try:
            values = np.array(list(map(float, chain.from_iterable(rows))), np.float64)
        except ValueError:
            return None
        if not np.isfinite(values).all():
            return None
        blocks.append(values.reshape(len(rows), n_channels))
    return np.concatenate(blocks)


def _value_faults(words: Words, lines: list[str], n_frames: int, n_channels: int) -> list[Fault]:
    faults = []
    n_lines = 0
    for line, row in enumerate(map(str.split, lines), start=words.line):
        n_lines += bool(row)
        fault = _line_fault(row, n_channels) if row else None
        if fault is not None:
            faults.append(fault.at(Place(words.file, line)))
    if len(faults) > MOST_FAULTS:
        faults[MOST_FAULTS:] = [
            Fault(f"{plural(len(faults) - MOST_FAULTS, 'more line')} of motion cannot be read.", place=Place(words.file))
        ]
    if n_lines != n_frames:
        problem = f"Frames says {n_frames:,}, but {plural(n_lines, 'line')} of motion follow."
        faults.append(Fault(problem, "one line of motion for each frame", f'"Frames: {n_lines}"', Place(words.file, words.line)))
    return faults


def _line_fault(row: list[str], n_channels: int) -> Fault | None:
    wrong = next(((i, word, meant) for i, word in enumerate(row) if (meant := number_fault(word)) is not None), None)
    if wrong is not None:
        i, word, meant = wrong
        return Fault(f"value {i + 1} of a motion line is {quoted(word)}.", "finite numbers, one for each channel", meant)
    if len(row) == n_channels:
        return None
    return Fault(f"{plural(len(row), 'value')} on a motion line.", f"{n_channels:,}, one for each channel of the hierarchy")


# ---- the text


def _hierarchy_lines(skeleton: Skeleton, digits: int) -> Iterator[str]:
    """The lines of the hierarchy, a block closed when the next joint stands less deep."""
    ends: dict[int, list[Vector]] = {}
    for joint, offset in skeleton.end_sites:
        ends.setdefault(joint, []).append(offset)
    depths = skeleton.depths.tolist()
    for joint, (name, depth) in enumerate(zip(skeleton.names, depths, strict=True)):
        pad = _indent(depth)
        yield from (f"{pad}{'JOINT' if depth else 'ROOT'} {_writable(name)}", f"{pad}{{")
        yield f"{pad}\t{_offset(skeleton.offsets[joint].tolist(), digits)}"
        yield f"{pad}\t{' '.join(['CHANNELS', str(len(skeleton.channels[joint])), *skeleton.channels[joint]])}"
        for offset in ends.get(joint, []):
            yield from (f"{pad}\tEnd Site", f"{pad}\t{{", f"{pad}\t\t{_offset(offset, digits)}", f"{pad}\t}}")
        following = depths[joint + 1] if joint + 1 < len(depths) else 0
        yield from (_indent(closed) + "}" for closed in range(depth, following - 1, -1))


def _indent(depth: int) -> str:
    """Indentation that stops growing, so that a very deep chain does not make a file of tabs."""
    return "\t" * min(depth, 40)


def _offset(offset: Vector | list[float], digits: int) -> str:
    return "OFFSET " + " ".join(f"{number:.{digits}f}" for number in offset)


def _writable(name: str) -> str:
    if not name.strip() or name != name.strip() or set("{}\r\n") & set(name):
        raise ClipError(Fault(f"a joint named {in_quotes(name)} cannot be written.", "a name on one line, without braces"))
    return name
