"""FBX and USD files as clips: how they begin, their takes, and the clip of one. They are read by a child process."""

from __future__ import annotations

import html
import re

from contextdb.errors import ClipError, ContextDBError, Fault, Place
from contextdb.motion.clips.clip import Clip
from contextdb.motion.clips.joint_worlds import numbered
from contextdb.motion.clips.parser_process import parser

BINARY_FBX = b"Kaydara FBX Binary"
_ASCII_FBX = re.compile(rb"\s*;\s*FBX|\s*FBXHeaderExtension\s*:")
_ASCII_TAKE = re.compile(rb'AnimationStack:\s{0,9}-?\d{1,20},\s{0,9}"(?:AnimStack::)?([^"]{0,300})"')
_BINARY_TAKE = re.compile(rb"AnimationStackL.{8}S.{4}([^\0]{0,300}?)\0\x01AnimStack", re.DOTALL)
_OLD_TAKE = re.compile(rb'Take:\s{0,9}"([^"]{1,300})"\s{0,9}\{')
MOST_INDENT = 64


def is_fbx(content: bytes) -> bool:
    """Whether bytes begin as FBX, binary or in ASCII."""
    return content.startswith(BINARY_FBX) or _ASCII_FBX.match(content[:256]) is not None


def fbx_takes(content: bytes, file: str) -> tuple[str, ...]:
    """The names of the takes as they stand in the bytes, in order, without reading the file; doubled ones with their number."""
    if content.startswith(BINARY_FBX):
        matches = _BINARY_TAKE.findall(content)
    else:
        matches = _at_lines(_ASCII_TAKE, content) or _at_lines(_OLD_TAKE, content)
    names = [" ".join(html.unescape(match.decode("utf-8", "replace")).split()) or "take" for match in matches]
    return numbered(names)


def _at_lines(pattern: re.Pattern[bytes], content: bytes) -> list[bytes]:
    """The first group of each match with nothing but white space before it in its line: 20 times as fast as a pattern with `^`."""
    groups = []
    for match in pattern.finditer(content):
        before = content[max(match.start() - MOST_INDENT, 0) : match.start()]
        _, line_end, indent = before.rpartition(b"\n")
        if not indent.strip() and (line_end or len(before) < MOST_INDENT):
            groups.append(match[1])
    return groups


def is_usd(content: bytes) -> bool:
    """Whether bytes begin as USD, as a text or as a crate."""
    return content.startswith((b"#usda", b"PXR-USDC"))


def usd_takes(content: bytes, file: str) -> tuple[str, ...]:
    """None: a stage is one clip."""
    return ()


def read(kind: str, content: bytes, take: int, name: str, file: str) -> Clip:
    """The clip of a take of "fbx" or "usd", from 0. Raises ClipError."""
    worlds = parser(kind).worlds(content, take, file)
    try:
        return worlds.clip(name)
    except ContextDBError as error:
        raise ClipError(*(fault.at(Place(file)) for fault in error.faults)) from None
    except ValueError as error:
        raise ClipError(Fault(f"the joints are no body ({error}).", "a skeleton", place=Place(file))) from None
