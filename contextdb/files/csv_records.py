"""Where the records and fields of a CSV are in its bytes.

Strict RFC 4180 with commas: a field with a comma, a quote or a line end in it is in double quotes, a quote in it doubled. Lines
end with "\\n", "\\r\\n" or a lone "\\r"; blank ones are no records. A field whose quotes are wrong is a `Stray`.

Characters become bits, 64 to a word, and the words tell at once what is inside quotes: the prefix sum of the quotes, modulo 2. So a
file costs a few passes of numpy over its bytes, and no Python per cell.

Source: Langdale and Lemire, "Parsing gigabytes of JSON per second", VLDB Journal 2019.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from contextdb import bitmask
from contextdb.bitmask import Flags, Words
from contextdb.files.strangers import UTF8_BOM

Octets = NDArray[np.uint8]
Positions = NDArray[np.int64]

MOST_STRAYS = 20
"""Fields with wrong quotes that are looked for."""

COMMA, QUOTE, LF, CR = b',"\n\r'
_BLOCK = 1 << 19
_EDGE = np.zeros(256, np.bool_)
_EDGE[[COMMA, QUOTE, LF, CR]] = True


@dataclass(frozen=True, eq=False)
class Records:
    """The records of a file, the header first: record r is bytes `starts[r]` up to `stops[r]`, its line end left out. int64 [n]."""

    starts: Positions
    stops: Positions
    n_fields: Positions
    is_sound: Flags
    """Whether each record's quotes stand where they may, so that its fields can be reported. bool [n]."""


@dataclass(frozen=True, slots=True)
class Stray:
    """A field whose quotes are wrong: where it opens, and where it seems to close (None: nowhere)."""

    opening: int
    closing: int | None
    is_inside: bool
    """The quote is inside a field that does not begin with one."""


def find_records(raw: bytes) -> tuple[Records, list[Stray]]:
    """Find the records of a CSV in UTF-8 with at least one line that is not blank, and the fields whose quotes are wrong.

    Every line break outside quotes ends a record. A stray field is taken to end with its line; after `MOST_STRAYS` of them the
    search ends, and later records are not sound.
    """
    first = len(UTF8_BOM) if raw.startswith(UTF8_BOM) else 0
    octets = np.frombuffer(raw, np.uint8, offset=first)
    quotes, commas, returns = (_bits(octets, mark) for mark in (QUOTE, COMMA, CR))
    ends = _line_end_bits(_bits(octets, LF), returns)
    ends[-1] |= np.uint64(1 << (len(octets) & 63))  # the last line ends as all others do
    inside, strays = inside_quotes(quotes), list[Stray]()
    if _has_strays(quotes, inside, quotes | commas | returns | ends):
        settled, strays = _settled_quotes(np.append(octets, np.uint8(LF)), bitmask.rows(quotes), bitmask.rows(ends))
        inside = inside_quotes(bitmask.from_rows(settled, len(octets) + 1))
    records = _split(octets, bitmask.rows(ends & ~inside), commas & ~inside, strays)
    moved = [replace(s, opening=s.opening + first, closing=s.closing and s.closing + first) for s in strays]
    return replace(records, starts=records.starts + first, stops=records.stops + first), moved


def line_ends(raw: bytes) -> Positions:
    """Where each line ends: the position of its "\\n", or of a "\\r" that no "\\n" follows."""
    octets = np.frombuffer(raw, np.uint8)
    return bitmask.rows(_line_end_bits(_bits(octets, LF), _bits(octets, CR)))


def inside_quotes(quotes: Words) -> Words:
    """Bits from each opening quote up to, not including, the closing one."""
    inside = quotes.copy()
    for shift in (1, 2, 4, 8, 16, 32):
        inside ^= inside << np.uint64(shift)
    is_odd = np.bitwise_xor.accumulate(inside >> np.uint64(63))
    inside[1:] ^= np.uint64(0) - is_odd[:-1]
    return inside


def field_bounds(chunk: bytes, lengths: Positions, n_fields: int) -> tuple[Positions, Positions]:
    """Where each field of n well-formed records stands: int64 [n, n_fields] twice, field f of record i is `chunk[starts[i, f] :
    stops[i, f]]`, with its quotes. `chunk` is the records without their line ends, one right after the other; `lengths` int64 [n]
    are their bytes."""
    octets = np.frombuffer(chunk, np.uint8)
    inside = inside_quotes(bitmask.pack(octets == QUOTE))
    commas = bitmask.rows(bitmask.pack(octets == COMMA) & ~inside).reshape(len(lengths), n_fields - 1)
    ends = np.cumsum(lengths)[:, None]
    return np.hstack([ends - lengths[:, None], commas + 1]), np.hstack([commas, ends])


def fields_of(record: bytes, n_fields: int) -> list[bytes]:
    """The fields of one record, as they are in it."""
    starts, stops = field_bounds(record, np.array([len(record)]), n_fields)
    return [record[a:b] for a, b in zip(starts[0].tolist(), stops[0].tolist(), strict=True)]


def text_of(field: bytes) -> str:
    """The text that a well-formed field means."""
    return (field[1:-1].replace(b'""', b'"') if field.startswith(b'"') else field).decode()


def as_field(text: str, is_quoted: bool = False) -> bytes:
    """The field that means a text, in quotes where they are needed or wanted."""
    data = text.encode()
    if is_quoted or needs_quotes(data):
        return b'"' + data.replace(b'"', b'""') + b'"'
    return data


def needs_quotes(data: bytes) -> bool:
    """Whether a text would be read as another one without quotes."""
    return b"," in data or b'"' in data or b"\n" in data or b"\r" in data


# ---- bits, one a byte of the file and one for its end


def _bits(octets: Octets, mark: int) -> Words:
    """Where a byte is. A block at a time, so that nothing leaves the cache."""
    packed = np.zeros(bitmask.n_words(len(octets) + 1) * 8, np.uint8)
    for start in range(0, len(octets), _BLOCK):
        block = np.packbits(octets[start : start + _BLOCK] == mark, bitorder="little")
        packed[start // 8 : start // 8 + len(block)] = block
    return packed.view("<u8").astype(np.uint64, copy=False)


def _line_end_bits(feeds: Words, returns: Words) -> Words:
    return feeds | (returns & ~_earlier(feeds))


def _earlier(words: Words) -> Words:
    """Every bit one place earlier."""
    moved = words >> np.uint64(1)
    moved[:-1] |= words[1:] << np.uint64(63)
    return moved


def _later(words: Words) -> Words:
    """Every bit one place later."""
    moved = words << np.uint64(1)
    moved[1:] |= words[:-1] >> np.uint64(63)
    return moved


def _rank(words: Words, positions: Positions) -> Positions:
    """How many bits are before each position."""
    before = np.append(0, np.cumsum(np.bitwise_count(words), dtype=np.int64))
    at, bit = positions >> 6, (positions & 63).astype(np.uint64)
    below = np.bitwise_count(words[at] & ((np.uint64(1) << bit) - np.uint64(1)))
    return np.asarray(before[at] + below, np.int64)


# ---- records


def _split(octets: Octets, breaks: Positions, commas: Words, strays: list[Stray]) -> Records:
    """Records between line ends that are outside quotes, the last of them the end of the file; blank lines are left out."""
    starts, stops = np.append(0, breaks[:-1] + 1), breaks.copy()
    stops[:-1] -= (octets[breaks[:-1]] == LF) & (octets[breaks[:-1] - 1] == CR) & (breaks[:-1] > starts[:-1])
    is_record = stops > starts
    starts, stops = starts[is_record], stops[is_record]
    is_sound = np.ones(len(starts), np.bool_)
    for stray in strays:
        is_sound[np.searchsorted(starts, stray.opening, "right") - 1] = False
    if len(strays) > MOST_STRAYS:
        is_sound[np.searchsorted(starts, strays[-1].opening, "right") - 1 :] = False
    return Records(starts, stops, _rank(commas, stops) - _rank(commas, starts) + 1, is_sound)


# ---- quotes that stand where none may


def _has_strays(quotes: Words, inside: Words, edges: Words) -> bool:
    """Whether an opening quote is not at a field's start, a closing one not at its end, or the last one not closed."""
    after = _later(edges)
    after[0] |= np.uint64(1)
    strays = quotes & ((inside & ~after) | (~inside & ~_earlier(edges)))
    return bool(strays.any()) or bool(np.bitwise_count(quotes).sum() % 2)


def _settled_quotes(octets: Octets, quotes: Positions, line_ends: Positions) -> tuple[Positions, list[Stray]]:
    """The quotes without those of faulty fields, and these fields. After a fault, reading starts from scratch on the next line."""
    settled, strays, rest = [], list[Stray](), quotes
    while (stray := _first_stray(octets, rest)) is not None:
        first, last = stray
        opening, closing = int(rest[first]), int(rest[last]) if last < len(rest) else None
        strays.append(Stray(opening, closing, not _EDGE[octets[opening - 1]]))
        line_end = line_ends[np.searchsorted(line_ends, opening)]
        settled.append(rest[:first])
        rest = rest[np.searchsorted(rest, line_end) :] if len(strays) <= MOST_STRAYS else rest[:0]
    return np.concatenate([*settled, rest]), strays


def _first_stray(octets: Octets, quotes: Positions) -> tuple[int, int] | None:
    """Which quotes open and seem to close the first faulty field."""
    opening, closing = quotes[0::2], quotes[1::2]
    is_stray = ~_EDGE[octets[opening - 1]]  # before the first byte stands the last one, a line end
    is_stray[: len(closing)] |= ~_EDGE[octets[closing + 1]]
    is_stray[len(closing) :] = True
    if not is_stray.any():
        return None
    first = last = 2 * int(is_stray.argmax())
    while first and quotes[first - 1] + 1 == quotes[first]:  # a doubled quote: the field opens further left
        first -= 2
    return first, last + 1
