"""The filters of searches as rows of a recorded session, and back: with the query and the database they give every cost again.

A filter is only a few numbers for each range and each kind of frames. What a caller gives for each frame is stored as runs: where
the value changes, and the values between.
"""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from contextdb.motion.markup.left_out import LeftOut, Skip
from contextdb.motion.search.database import MotionDatabase
from contextdb.motion.search.filters import NO_FLAGS, Filter, Kinds

if TYPE_CHECKING:
    from polars import DataType as PolarsType

Row = dict[str, Any]


def filter_type() -> PolarsType:
    """The polars type of the column of filters."""
    import polars as pl

    flags, numbers = pl.List(pl.Boolean()), pl.List(pl.Float64())
    skip = pl.Struct({"start": pl.Int64(), "stop": pl.Int64(), "why": pl.String()})
    kinds = {"allowed": flags, "biases": numbers, "playable": flags, "left_out": pl.List(pl.Int64())}
    fields: dict[str, PolarsType] = {
        "database": pl.String(),
        "ranges": flags,
        "range_biases": numbers,
        "kinds": pl.Struct(kinds),
        "frames": flags,
        "frame_biases": numbers,
        "skips": pl.List(skip),
        "current": pl.Int64(),
        "continuing": pl.Float64(),
        **dict.fromkeys(("frame_runs", "bias_runs"), pl.List(pl.Int64())),
    }
    return pl.List(pl.Struct(fields))


def filter_row(database: str, chosen: Filter) -> Row:
    """The filter of the search of a database, as a row."""
    (frame_runs, frames), (bias_runs, biases) = _runs(chosen.frames), _runs(np.asarray(chosen.frame_biases, np.float64))
    return {
        "database": database,
        "ranges": chosen.ranges.tolist(),
        "range_biases": np.asarray(chosen.range_biases, np.float64).tolist(),
        "kinds": {name: np.asarray(part).tolist() for name, part in chosen.kinds._asdict().items()},
        "frames": frames,
        "frame_biases": biases,
        "skips": [{"start": int(skip.start), "stop": int(skip.stop), "why": skip.why.name} for skip in chosen.skips],
        "current": int(chosen.current),
        "continuing": float(chosen.continuing),
        "frame_runs": frame_runs,
        "bias_runs": bias_runs,
    }


def _runs(values: NDArray[Any]) -> tuple[list[int], list[Any]]:
    """Where each run of equal values ends, and its value."""
    if not len(values):
        return [], []
    ends = np.append(np.flatnonzero(values[1:] != values[:-1]) + 1, len(values))
    return ends.tolist(), values[ends - 1].tolist()


def _unrolled(values: list[Any], runs: list[int], dtype: type[np.generic]) -> NDArray[Any]:
    """A value for each frame, from runs."""
    return np.repeat(np.array(values, dtype), np.diff([0, *runs]))


def filter_of(row: Row) -> Filter:
    """The filter that a row was made of. Raises ValueError, TypeError or KeyError where the row was made of none."""
    ranges, biases = np.array(row["ranges"], np.bool_), np.array(row["range_biases"], np.float64)
    kinds = row["kinds"]
    return Filter(
        ranges=ranges,
        is_whole=bool(ranges.all()),
        range_biases=biases,
        kinds=Kinds(
            np.array(kinds["allowed"], np.bool_),
            np.array(kinds["biases"], np.float64),
            np.array(kinds["playable"], np.bool_),
            np.array(kinds["left_out"], np.uint8),
        ),
        frames=_unrolled(row["frames"], row["frame_runs"], np.bool_) if row["frames"] else NO_FLAGS,
        frame_biases=_unrolled(row["frame_biases"], row["bias_runs"], np.float64),
        skips=tuple(Skip(int(skip["start"]), int(skip["stop"]), LeftOut[skip["why"]]) for skip in row["skips"]),
        current=int(row["current"]),
        continuing=float(row["continuing"]),
    )


def fingerprint(database: MotionDatabase) -> str:
    """A digest of all that costs and reasons come from: features, ranges, weights, biases and markup."""
    lay, digest = database.layout, hashlib.blake2b(digest_size=16)
    scales = (database.weights, database.normalisation.offset, database.normalisation.scale)
    for array in (lay.blocks, lay.frames, database.starts, database.stops, database.mirrored, database.marks.kinds, *scales):
        digest.update(np.ascontiguousarray(array).tobytes())
    digest.update(repr((database.assets, database.channel_names, database.biases)).encode("utf-8", "surrogatepass"))
    return digest.hexdigest()


def markup_digest(database: MotionDatabase) -> str:
    """A digest of what the markup says, whatever tags it knows beside."""
    marks, digest = database.marks, hashlib.blake2b(digest_size=16)
    for array in (marks.kinds, marks.kind_marks, marks.kind_biases, marks.kind_root_weights, marks.looping, marks.warps):
        digest.update(np.ascontiguousarray(array).tobytes())
    for tag, flags in sorted(
        (tag, marks.kind_tags[:, i].tobytes()) for i, tag in enumerate(marks.tags) if marks.kind_tags[:, i].any()
    ):
        digest.update(repr((tag, flags)).encode("utf-8", "surrogatepass"))
    return digest.hexdigest()


def is_recorded(about: Mapping[str, Any], database: MotionDatabase) -> bool:
    """Whether a database is the one that a session was recorded with."""
    return about.get("digest") == fingerprint(database) and about.get("markup") == markup_digest(database)
