"""What a copy of a character on another machine must be told to play what its owner plays: a few bytes an update.

A copy has the same build of the databases. It moves its body as the game says, makes its own query and poses, and never searches:
what plays, and since when, comes from the owner. Each packet says all of that, so that after lost ones the next that arrives puts
the copy right: where it entered a clip too late it is at most a frame off, until the next entry is told at its moment.

    1 byte     version, whether it was entered at this update, whether its row says how it plays
    1-3 each   numbers of database, range, and frame of the range (LEB128)
    33         where the row says so: which of its numbers are there, and those

Nothing is in it of where the body is: that is the game's to tell.
"""

from __future__ import annotations

import struct
from collections.abc import Iterable

import numpy as np

from contextdb.cells.row_play import N_PLAY
from contextdb.errors import ContextError, Fault
from contextdb.motion.clips.quaternions import Floats
from contextdb.motion.selection.chooser import ENTERED, PLAY, PLAYING, TIME, Chooser
from contextdb.motion.selection.followed import Followed

VERSION, IS_NEW, HAS_PLAY = 1 << 2, 1, 2
MOST_BYTES = 5
"""A number takes no more."""
NO_PACKET = Fault("these bytes tell nothing that a character of these databases plays.", "what its owner's `pack` gives, or none")


def packed(chooser: Chooser, row: Floats) -> bytes:
    """What plays, of a controller's row [W]; empty where nothing does."""
    d, at, frame = (int(value) for value in row[PLAYING].tolist()[:3])
    if d < 0:
        return b""
    database = chooser.databases[d]
    assert database is not None, "what plays is of a database that is there"
    play = row[PLAY]
    said = ~np.isnan(play)
    head = VERSION | IS_NEW * bool(row[ENTERED] == row[TIME]) | HAS_PLAY * bool(said.any())
    numbers = b"".join(_number(value) for value in (d, at, frame - int(database.starts[at])))
    return bytes([head]) + numbers + (bytes(np.packbits(said)) + play[said].astype("<f8").tobytes() if said.any() else b"")


def followed(chooser: Chooser, data: bytes) -> Followed | None:
    """What such bytes say; None for none. Raises ContextError for what `packed` gives for no character with these databases."""
    if not isinstance(data, bytes):
        raise ContextError(NO_PACKET)
    if not data:
        return None
    try:
        return _followed(chooser, data)
    except (IndexError, ValueError, struct.error):
        raise ContextError(NO_PACKET) from None


def _followed(chooser: Chooser, data: bytes) -> Followed:
    head, rest = data[0], iter(data[1:])
    d, at, frame = (_next_number(rest) for _ in range(3))
    database = chooser.databases[d]
    tail, play = bytes(rest), np.full(N_PLAY, np.nan)
    if head & HAS_PLAY:
        said = np.unpackbits(np.frombuffer(tail[:1], np.uint8)).astype(np.bool_)
        play[said] = np.frombuffer(tail[1:], "<f8")
    is_known = head & ~(IS_NEW | HAS_PLAY) == VERSION and database is not None and (bool(tail) == bool(head & HAS_PLAY))
    if not is_known or database is None or not frame < database.stops[at] - database.starts[at] or np.isinf(play).any():
        raise ValueError
    return Followed(d, at, int(database.starts[at]) + frame, bool(head & IS_NEW), play)


def _number(value: int) -> bytes:
    """A number, seven bits a byte, the lowest first (LEB128)."""
    parts = bytearray()
    while value > 0x7F:
        parts.append(value & 0x7F | 0x80)
        value >>= 7
    return bytes([*parts, value])


def _next_number(data: Iterable[int]) -> int:
    value = 0
    for shift, part in zip(range(MOST_BYTES), data, strict=False):
        value |= (part & 0x7F) << 7 * shift
        if part < 0x80:
            return value
    raise ValueError
