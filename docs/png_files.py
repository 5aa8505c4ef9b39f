"""PNG files, still and moving, with nothing but zlib."""

from __future__ import annotations

import struct
import zlib
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

Picture = NDArray[np.uint8]
N_COLOURS = 256


def halved(picture: Picture) -> Picture:
    """Half as wide and half as high, each pixel the mean of four: what smooths the edges."""
    wide = picture.astype(np.uint16)
    return ((wide[::2, ::2] + wide[1::2, ::2] + wide[::2, 1::2] + wide[1::2, 1::2]) // 4).astype(np.uint8)


def write_png(path: Path, *pictures: Picture, per_second: int = 12) -> None:
    """Write one picture, or several as a film that begins again at its end. Of a film the colours are made fewer."""
    height, width, _ = pictures[0].shape
    parts = [_chunk(b"IHDR", struct.pack(">IIBBBBB", width, height, 8, 3, 0, 0, 0))]
    palette = palette_of(pictures)
    parts.append(_chunk(b"PLTE", palette.tobytes()))
    if len(pictures) > 1:
        parts.append(_chunk(b"acTL", struct.pack(">II", len(pictures), 0)))
    number, before = 0, None
    for i, picture in enumerate(pictures):
        rows = indexed(picture, palette)
        x, y, changed = (0, 0, rows) if before is None else _changed(before, rows)
        before = rows
        if len(pictures) > 1:
            high, wide = changed.shape
            parts.append(_chunk(b"fcTL", struct.pack(">IIIIIHHBB", number, wide, high, x, y, 1, per_second, 0, 0)))
            number += 1
        packed = _packed(changed)
        if i == 0:
            parts.append(_chunk(b"IDAT", packed))
        else:
            parts.append(_chunk(b"fdAT", struct.pack(">I", number) + packed))
            number += 1
    path.write_bytes(b"\x89PNG\r\n\x1a\n" + b"".join(parts) + _chunk(b"IEND", b""))


def _changed(before: Picture, rows: Picture) -> tuple[int, int, Picture]:
    """The smallest part of a picture that holds all that is not as it was before, and where it begins."""
    differs = before != rows
    ys, xs = np.flatnonzero(differs.any(axis=1)), np.flatnonzero(differs.any(axis=0))
    if not len(ys):
        return 0, 0, rows[:1, :1]
    return int(xs[0]), int(ys[0]), rows[ys[0] : ys[-1] + 1, xs[0] : xs[-1] + 1]


def read_png(path: Path) -> Picture:
    """The first picture of a file that `write_png` wrote."""
    raw, at, parts = path.read_bytes(), 8, dict[bytes, bytes]()
    while at < len(raw):
        size = int.from_bytes(raw[at : at + 4])
        parts.setdefault(raw[at + 4 : at + 8], raw[at + 8 : at + 8 + size])
        at += 12 + size
    width, height = struct.unpack(">II", parts[b"IHDR"][:8])
    rows = np.frombuffer(zlib.decompress(parts[b"IDAT"]), np.uint8).reshape(height, width + 1)
    return np.asarray(np.frombuffer(parts[b"PLTE"], np.uint8).reshape(-1, 3)[rows[:, 1:]])


def palette_of(pictures: Sequence[Picture]) -> Picture:
    """The colours that most pixels have, half of them told apart finely and half coarsely, so that none is far: [256, 3]."""
    pixels = np.concatenate([picture.reshape(-1, 3) for picture in pictures])
    return np.concatenate([_common(pixels, 5), _common(pixels, 3)])


def _common(pixels: Picture, bits: int) -> Picture:
    """The 128 most common colours, of those with the same highest bits the mean."""
    keys = _keys(pixels, bits)
    counts = np.bincount(keys, minlength=1 << 3 * bits)
    common = np.argsort(-counts, kind="stable")[: N_COLOURS // 2]
    sums = np.stack([np.bincount(keys, pixels[:, i], len(counts))[common] for i in range(3)], axis=1)
    return np.asarray(np.round(sums / np.maximum(counts[common], 1)[:, None]), np.uint8)


def indexed(picture: Picture, palette: Picture) -> Picture:
    """The nearest colour of a palette for each pixel: [height, width]."""
    keys = _keys(picture.reshape(-1, 3), 5)
    used, places = np.unique(keys, return_inverse=True)
    shades = np.stack([used >> 10, used >> 5 & 31, used & 31], axis=1) * 8.0 + 4.0
    apart = ((shades[:, None, :] - palette[None].astype(float)) ** 2).sum(axis=2)
    return np.asarray(apart.argmin(axis=1)[places].reshape(picture.shape[:2]), np.uint8)


def _keys(pixels: Picture, bits: int) -> NDArray[np.int64]:
    red, green, blue = (pixels[:, i].astype(np.int64) >> 8 - bits for i in range(3))
    return red << 2 * bits | green << bits | blue


def _packed(rows: Picture) -> bytes:
    return zlib.compress(b"".join(b"\0" + row.tobytes() for row in rows), 9)


def _chunk(name: bytes, data: bytes) -> bytes:
    return struct.pack(">I", len(data)) + name + data + struct.pack(">I", zlib.crc32(name + data))
