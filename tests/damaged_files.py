"""Compiled files, damaged in the ways in which files are damaged or made to harm."""

import json
import random

EDGES = [0, 1, 2, 3, 7, 8, 63, 64, 65, 255, 2**31 - 1, 2**31, 2**32, 2**53, 2**63 - 1, 2**63, 2**64 - 1, 2**64, 10**30]


def with_header(whole: bytes, header: bytes) -> bytes:
    """The file with another header, which is made as long as its alignment asks."""
    header += b" " * (-len(header) % 8)
    return len(header).to_bytes(8, "little") + header + whole[8 + header_bytes(whole) :]


def header_bytes(whole: bytes) -> int:
    return int.from_bytes(whole[:8], "little")


def with_another_number(rng: random.Random, header: bytes) -> bytes:
    digits = [i for i in range(1, len(header)) if header[i : i + 1].isdigit() and not header[i - 1 : i].isalnum()]
    start = stop = rng.choice(digits)
    while header[stop : stop + 1].isdigit():
        stop += 1
    old = int(header[start:stop])
    new = rng.choice([*EDGES, old + 1, max(old - 1, 0), old + 8, max(old - 8, 0), old * 2, rng.randrange(4000)])
    return header[:start] + str(new).encode() + header[stop:]


def mutated(rng: random.Random, whole: bytes) -> bytes:
    """The file, damaged in one of the ways in which files are damaged or made to harm."""
    size = header_bytes(whole)
    header, way = whole[8 : 8 + size], rng.randrange(8)
    at = rng.randrange(size)
    if way == 0:
        return whole[: rng.randrange(len(whole))]
    if way == 1:
        return rng.choice([*EDGES, size + 8, size - 8]).to_bytes(16, "little")[:8] + whole[8:]
    if way in (2, 3):
        return with_header(whole, with_another_number(rng, header))
    if way == 4:
        return with_header(whole, header[:at] + header[at + rng.randrange(1, 60) :])
    if way == 5:
        piece = rng.choice(
            [b"[" * 2000, b'{"a":' * 2000, b'"', b"\\u0000", b"\\", b"\xff", header[at : at + 200], b"9" * 400, b"\\ud800"]
        )
        return with_header(whole, header[:at] + piece + header[at:])
    octets = bytearray(whole)
    start, stop = (8, 8 + size) if way == 6 else (8 + size, len(whole))
    for _ in range(rng.choice([1, 1, 2, 8])):
        octets[rng.randrange(start, stop)] = rng.choice([0, 1, 0x7F, 0x80, 0xFF, rng.randrange(256)])
    return bytes(octets)


def damaged_program(rng: random.Random, whole: bytes) -> bytes:
    """The file with other numbers in its programs."""
    start = 8 + header_bytes(whole)
    header = json.loads(whole[8:start])
    name = rng.choice([n for n in header if n.startswith("programs.")])
    first, last = (start + at for at in header[name]["data_offsets"])
    octets = bytearray(whole)
    for _ in range(rng.choice([1, 1, 2, 5])):
        if last - first >= 4:
            at = first + 4 * rng.randrange((last - first) // 4)
            number = rng.choice([-1, 0, 1, 2, 3, 33, 34, 255, 2**31 - 1, rng.randrange(40)])
            octets[at : at + 4] = number.to_bytes(4, "little", signed=True)
    return bytes(octets)
