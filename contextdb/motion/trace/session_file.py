"""The rows of a recorded session as Parquet, and back; `contextdb.motion.trace.session` says what a file holds."""

from __future__ import annotations

import io
import json
from collections.abc import Mapping
from typing import Any

from contextdb.columns import polars as pl
from contextdb.errors import (
    ArtefactError,
    Fault,
    Place,
    in_quotes,
    plural,
)
from contextdb.files.parquet_frame import MAGIC, DamagedFrame, require_whole
from contextdb.motion.trace.rows import LATER, Row, columns

FORMAT = 2
FORMAT_KEY, ABOUT_KEY, SHOWN_KEY = "contextdb.trace", "about", "candidates"


N_CANDIDATES = 12


ACCEPTED = "a session recorded by contextdb.motion.Trace"
MEND = "to record the session again"


def frame_of_rows(rows: list[Row]) -> pl.DataFrame:
    import polars as pl

    return pl.DataFrame(rows, schema=columns())


def read_rows(raw: bytes, file: str) -> tuple[pl.DataFrame, dict[str, dict[str, Any]], int]:
    """The rows of a file, what it says of databases, and how many candidates its decisions show; checked."""
    import polars as pl

    why = _no_parquet(raw)
    if why:
        raise refused(why, file)
    try:
        parquet = require_whole(raw)
        metadata = parquet.metadata
        _check_format(metadata, file)
        if not parquet.is_sealed:
            raise refused("the session has no digest: another program wrote it again.", file)
        about = {name: dict(part) for name, part in json.loads(metadata[ABOUT_KEY]).items()}
        n_candidates = int(metadata.get(SHOWN_KEY, N_CANDIDATES))
        frame = pl.read_parquet(io.BytesIO(raw))
    except (ArtefactError, MemoryError):
        raise
    except DamagedFrame as error:
        raise refused(f"the file is damaged: {error}.", file) from None
    except (Exception, pl.exceptions.PanicException) as error:  # some damage makes polars panic instead of raise
        raise refused(f"the file is damaged ({type(error).__name__}).", file) from None
    _check_columns(frame, file)
    missing = [name for name in LATER if name not in frame.columns]
    frame = frame.with_columns(pl.lit(None, columns()[name]).alias(name) for name in missing)
    return frame.select(list(columns())), about, n_candidates


def _no_parquet(raw: bytes) -> str:
    """What is wrong with the file's first and last bytes, if anything."""
    if not raw.startswith(MAGIC):
        return "this is not a Parquet file." if raw else "the file is empty."
    size = int.from_bytes(raw[-8:-4], "little")
    is_whole = len(raw) >= 12 and raw.endswith(MAGIC) and size <= len(raw) - 12
    return "" if is_whole else "the file is cut off: its end, where Parquet lists its columns, is missing."


def _check_format(metadata: Mapping[str, str], file: str) -> None:
    if FORMAT_KEY not in metadata:
        raise refused("this Parquet file is not a recorded session.", file)
    if metadata[FORMAT_KEY] != str(FORMAT):
        problem = f"the session has format {in_quotes(metadata[FORMAT_KEY])}; this version reads format {FORMAT}."
        raise refused(problem, file)


def _check_columns(frame: pl.DataFrame, file: str) -> None:
    wanted = columns()
    present = [name for name in wanted if name in frame.columns or name not in LATER]
    wrong = [name for name in present if frame.schema.get(name) != wanted[name]]
    if wrong:
        problem = f"{plural(len(wrong), 'column')} of the session missing, or of another type: {', '.join(map(in_quotes, wrong))}."
        raise refused(problem, file)


def refused(problem: str, file: str) -> ArtefactError:
    """The error for a file that is no whole session."""
    return ArtefactError(Fault(problem, ACCEPTED, MEND, Place(file or None), "bad-artefact"))
